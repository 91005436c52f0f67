//! Reading HDF5: what stands in files of problems, whoever wrote them, and no more.
//!
//! All superblocks (0 to 3); groups as symbol tables, as link messages and as dense storage, with hard and soft links; contiguous, compact and
//! chunked data with every index of chunks (B-trees of both versions, single, implicit, fixed and extensible arrays), of every version of the layout
//! up to that of HDF5 2.0; deflate, shuffle, Fletcher's checksum, scaleoffset and LZF; integers and reals of up to 64 bits in either byte order, texts.
//! Refused by name: external links and files, virtual datasets, other filters, wider numbers, messages in shared heaps.
//!
//! The bytes are never believed. Every address and length is checked against the file, every checksum that the format has is compared, and two
//! budgets in proportion to the size of the file bound the work: one for structures, which ends circles, and one for the data that they claim.
//! So neither time nor memory depends on what a file says of itself.
//!
//! Reference: the HDF Group, *HDF5 File Format Specification*, version 4.0.

mod chunks;
mod data;
mod group;
mod header;
mod heap;

use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::collections::HashSet;

pub(crate) use data::{Dataset, Type};
pub(crate) use group::{Group, Link, Object};

/// Why a part of a file cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Fault {
    /// It is no valid HDF5.
    Damaged(Cow<'static, str>),
    /// It is valid and not read here.
    Unsupported(&'static str),
    /// A soft link that leads nowhere.
    Dangling(String),
    /// More data than the file, of that size, can hold.
    Size(u64, String),
}

type Result<T> = std::result::Result<T, Fault>;

fn damaged<T>(found: impl Into<Cow<'static, str>>) -> Result<T> {
    Err(Fault::Damaged(found.into()))
}

/// No filter expands more than deflate, 1032 to 1.
const EXPANSION: u64 = 1032;
/// Fuzzers do not find checksums: for them all are right.
#[allow(unexpected_cfgs)]
const FUZZING: bool = cfg!(fuzzing);
const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Where the file begins: at 0, or behind a block of the user's of 512 bytes, 1024, 2048, ...
fn start(bytes: &[u8]) -> Option<usize> {
    let places =
        std::iter::once(0).chain(std::iter::successors(Some(512_usize), |&at| at.checked_mul(2)));
    let mut places = places.take_while(|&at| at < bytes.len());
    places.find(|&at| bytes[at..].starts_with(SIGNATURE))
}

/// Whether the bytes are those of an HDF5 file, judged by the signature.
pub(crate) fn is_hdf5(bytes: &[u8]) -> bool {
    start(bytes).is_some()
}

/// An HDF5 file in memory.
pub(crate) struct File<'a> {
    /// From the signature on, which is where addresses count from.
    bytes: &'a [u8],
    /// Bytes before it.
    userblock: usize,
    /// Bytes of an address and of a length.
    widths: (usize, usize),
    /// The object header of the root group.
    root: u64,
    /// Bytes of structures that may still be looked at.
    work: Cell<u64>,
    /// Bytes of data that may still be made.
    room: Cell<u64>,
    /// Blocks whose checksums have been compared.
    sound: RefCell<HashSet<u64>>,
}

impl<'a> File<'a> {
    pub(crate) fn new(whole: &'a [u8]) -> Result<Self> {
        let Some(userblock) = start(whole) else { return damaged("other data") };
        let bytes = &whole[userblock..];
        let mut c = Cursor { bytes, at: SIGNATURE.len(), widths: (8, 8) };
        let version = c.u8()?;
        let (end, root) = match version {
            0 | 1 => {
                c.skip(4)?;
                c.widths = widths(c.u8()?, c.u8()?)?;
                c.skip(9)?;
                if version == 1 {
                    c.skip(4)?;
                }
                // Base address and address of the free space.
                c.skip(2 * c.widths.0)?;
                let end = c.address()?;
                // Driver information, and the name of the root in its entry.
                c.skip(2 * c.widths.0)?;
                (end, c.address()?)
            }
            2 | 3 => {
                c.widths = widths(c.u8()?, c.u8()?)?;
                c.skip(1 + 2 * c.widths.0)?;
                let ends = (c.address()?, c.address()?);
                let sum = checksum(&bytes[..c.at]);
                if c.u32()? != sum && !FUZZING {
                    return damaged("a superblock with a wrong checksum");
                }
                ends
            }
            other => return damaged(format!("a superblock of version {other}")),
        };
        let (Some(end), Some(root)) = (end, root) else {
            return damaged("a superblock without a root group");
        };
        let size = whole.len() as u64;
        if end > size {
            return damaged(format!("a truncated file ({size} bytes of {end})"));
        }
        Ok(Self {
            bytes,
            userblock,
            widths: c.widths,
            root,
            work: Cell::new(64 * size + (1 << 20)),
            room: Cell::new(4 * EXPANSION * size),
            sound: RefCell::default(),
        })
    }

    /// Takes from the budget of work.
    fn spend(&self, bytes: usize) -> Result<()> {
        match self.work.get().checked_sub(bytes as u64) {
            Some(left) => {
                self.work.set(left);
                Ok(())
            }
            None => damaged("structures that lead in circles"),
        }
    }

    /// Takes from the budget of data.
    fn claim(&self, bytes: u64) -> Result<()> {
        match self.room.get().checked_sub(bytes) {
            Some(left) => {
                self.room.set(left);
                Ok(())
            }
            None => Err(Fault::Size(self.size(), "far more".into())),
        }
    }

    fn size(&self) -> u64 {
        (self.bytes.len() + self.userblock) as u64
    }

    /// So many bytes from an address on.
    fn slice(&self, address: u64, size: u64) -> Result<&'a [u8]> {
        let range = usize::try_from(address).ok().and_then(|from| {
            let to = from.checked_add(usize::try_from(size).ok()?)?;
            self.bytes.get(from..to)
        });
        range.map_or_else(|| damaged("an address beyond the end of the file"), Ok)
    }

    /// All bytes from an address on.
    fn cursor(&self, address: u64) -> Result<Cursor<'a>> {
        self.spend(16)?;
        let rest = self.slice(address, (self.bytes.len() as u64).saturating_sub(address))?;
        Ok(Cursor { bytes: rest, at: 0, widths: self.widths })
    }

    fn over(&self, bytes: &'a [u8]) -> Cursor<'a> {
        Cursor { bytes, at: 0, widths: self.widths }
    }

    /// A block of that many bytes with its signature in front and its checksum behind: what stands between them.
    fn block(&self, address: u64, size: usize, signature: &[u8; 4]) -> Result<Cursor<'a>> {
        let block = self.slice(address, size as u64)?;
        if !block.starts_with(signature) {
            return damaged(format!("no {} where one must be", signature.escape_ascii()));
        }
        let mut c = self.over(self.sealed(address, size)?);
        c.bytes = &c.bytes[4.min(c.bytes.len())..];
        Ok(c)
    }

    /// That many bytes, of which the last four are a checksum: the others.
    fn sealed(&self, address: u64, size: usize) -> Result<&'a [u8]> {
        let Some((content, sum)) = self.slice(address, size as u64)?.split_last_chunk::<4>() else {
            return damaged("a block without room for its checksum");
        };
        if self.sound.borrow().contains(&address) {
            self.spend(1)?;
        } else {
            self.spend(size + 16)?;
            if u32::from_le_bytes(*sum) != checksum(content) && !FUZZING {
                return damaged("a block with a wrong checksum");
            }
            self.sound.borrow_mut().insert(address);
        }
        Ok(content)
    }
}

/// The bytes of addresses and of lengths.
fn widths(address: u8, length: u8) -> Result<(usize, usize)> {
    match (address, length) {
        (2 | 4 | 8, 2 | 4 | 8) => Ok((address.into(), length.into())),
        _ => damaged(format!("addresses of {address} bytes and lengths of {length}")),
    }
}

/// Bytes in sequence.
#[derive(Clone, Copy)]
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    widths: (usize, usize),
}

impl<'a> Cursor<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8]> {
        let taken = self.at.checked_add(n).and_then(|end| self.bytes.get(self.at..end));
        match taken {
            Some(bytes) => {
                self.at += n;
                Ok(bytes)
            }
            None => damaged("a structure that ends early"),
        }
    }

    fn skip(&mut self, n: usize) -> Result<()> {
        self.take(n).map(drop)
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// An integer of up to eight bytes, the lowest first.
    fn uint(&mut self, width: usize) -> Result<u64> {
        let mut all = [0; 8];
        match all.get_mut(..width) {
            Some(low) => low.copy_from_slice(self.take(width)?),
            None => return damaged(format!("an integer of {width} bytes in a structure")),
        }
        Ok(u64::from_le_bytes(all))
    }

    fn u8(&mut self) -> Result<u8> {
        Ok(self.take(1)?[0])
    }

    fn u16(&mut self) -> Result<u16> {
        self.uint(2).map(|x| x as u16)
    }

    fn u32(&mut self) -> Result<u32> {
        self.uint(4).map(|x| x as u32)
    }

    fn length(&mut self) -> Result<u64> {
        self.uint(self.widths.1)
    }

    /// `None`: undefined, all bits set.
    fn address(&mut self) -> Result<Option<u64>> {
        let x = self.uint(self.widths.0)?;
        Ok((x != u64::MAX >> (64 - 8 * self.widths.0)).then_some(x))
    }

    fn defined(&mut self) -> Result<u64> {
        self.address()?.map_or_else(|| damaged("an undefined address"), Ok)
    }

    /// The version of a structure, which must be one of those known.
    fn version(&mut self, what: &str, known: std::ops::RangeInclusive<u8>) -> Result<u8> {
        match self.u8()? {
            version if known.contains(&version) => Ok(version),
            other => damaged(format!("{what} of version {other}")),
        }
    }
}

/// Bob Jenkins' lookup3, `hashlittle` with initial value 0: the checksum of all newer structures.
fn checksum(bytes: &[u8]) -> u32 {
    let start = 0xdead_beef_u32.wrapping_add(bytes.len() as u32);
    let (mut a, mut b, mut c) = (start, start, start);
    let word = |block: &[u8], k: usize| {
        let mut word = [0; 4];
        let part = block.get(4 * k..block.len().min(4 * k + 4)).unwrap_or_default();
        word[..part.len()].copy_from_slice(part);
        u32::from_le_bytes(word)
    };
    let mut rest = bytes;
    while rest.len() > 12 {
        let (block, after) = rest.split_at(12);
        a = a.wrapping_add(word(block, 0));
        b = b.wrapping_add(word(block, 1));
        c = c.wrapping_add(word(block, 2));
        for (x, y, z, by) in
            [(0, 2, 1, 4), (1, 0, 2, 6), (2, 1, 0, 8), (0, 2, 1, 16), (1, 0, 2, 19), (2, 1, 0, 4)]
        {
            let mut s = [a, b, c];
            s[x] = s[x].wrapping_sub(s[y]) ^ s[y].rotate_left(by);
            s[y] = s[y].wrapping_add(s[z]);
            [a, b, c] = s;
        }
        rest = after;
    }
    if rest.is_empty() {
        return c;
    }
    a = a.wrapping_add(word(rest, 0));
    b = b.wrapping_add(word(rest, 1));
    c = c.wrapping_add(word(rest, 2));
    for (x, y, by) in
        [(2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24)]
    {
        let mut s = [a, b, c];
        s[x] = (s[x] ^ s[y]).wrapping_sub(s[y].rotate_left(by));
        [a, b, c] = s;
    }
    c
}

#[cfg(test)]
mod tests {
    use super::checksum;

    #[test]
    fn the_checksum_is_lookup3() {
        // The values that its author prints.
        assert_eq!(checksum(b""), 0xdead_beef);
        assert_eq!(checksum(b"Four score and seven years ago"), 0x1777_0551);
    }
}
