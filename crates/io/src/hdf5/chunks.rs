//! The indices of chunks: which chunk of a dataset stands where.

use super::{File, Result, damaged};

/// A dataset in chunks.
#[derive(Debug, Clone)]
pub(crate) struct Chunked {
    /// The lengths of a chunk.
    pub shape: Vec<u64>,
    /// Chunks that reach beyond the dataset are not filtered.
    pub raw_edges: bool,
    pub index: Index,
    /// `None`: nothing has been written.
    pub address: Option<u64>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Index {
    Tree1,
    /// Bytes on the disk and filters left out, if filtered.
    Single(Option<(u64, u32)>),
    Implicit,
    Fixed,
    Extensible,
    Tree2,
}

/// A chunk as an index knows it.
pub(super) struct Chunk<'c> {
    /// Where it stands in the grid of chunks.
    pub at: &'c [u64],
    pub address: u64,
    /// Bytes on the disk, if the index says.
    pub size: Option<u64>,
    /// Filters left out.
    pub mask: u32,
}

/// Where a chunk stands: address, bytes on the disk, filters left out.
type Entry = (u64, Option<u64>, u32);

/// The grid of chunks over a dataset.
pub(super) struct Grid {
    /// Chunks along each dimension.
    pub counts: Vec<u64>,
    /// The place of a chunk in an array: the sum of its coordinates times these.
    strides: Vec<u64>,
}

impl Grid {
    /// Of a dataset of that shape which may grow to `most` (`u64::MAX`: without end).
    pub(super) fn new(shape: &[u64], most: &[u64], chunk: &[u64], index: Index) -> Result<Self> {
        let along = |lengths: &[u64]| -> Vec<u64> {
            lengths.iter().zip(chunk).map(|(n, c)| n.div_ceil(*c)).collect()
        };
        let (counts, most) = (along(shape), along(most));
        // The dimension without end varies slowest in extensible arrays, whose order is else that of C.
        let mut order: Vec<usize> = (0..shape.len()).collect();
        if matches!(index, Index::Extensible) {
            let endless = (0..most.len()).max_by_key(|&k| (most[k], std::cmp::Reverse(k)));
            order.sort_by_key(|&k| (Some(k) != endless, k));
        }
        let mut strides = vec![0; shape.len()];
        let mut stride = 1_u64;
        for &k in order.iter().rev() {
            strides[k] = stride;
            stride = stride.saturating_mul(most[k]);
        }
        Ok(Self { counts, strides })
    }

    fn place(&self, at: &[u64]) -> u64 {
        let terms = at.iter().zip(&self.strides).map(|(a, s)| a.saturating_mul(*s));
        terms.fold(0, u64::saturating_add)
    }
}

impl<'a> File<'a> {
    /// Hands over the chunks that have been written. `bytes` is the size of one before filters.
    pub(super) fn chunks(
        &self,
        chunked: &Chunked,
        grid: &Grid,
        filtered: bool,
        bytes: u64,
        mut each: impl FnMut(Chunk) -> Result<()>,
    ) -> Result<()> {
        let Some(address) = chunked.address else { return Ok(()) };
        let rank = grid.counts.len();
        let mut at = vec![0; rank];
        match chunked.index {
            Index::Tree1 => self.tree_1(address, None, chunked, &mut at, &mut each),
            Index::Tree2 => {
                let kind = if filtered { 11 } else { 10 };
                self.records(address, kind, |record| {
                    let mut c = self.over(record);
                    let address = c.address()?;
                    let (mut size, mut mask) = (None, 0);
                    if filtered {
                        let width = record.len().checked_sub(self.widths.0 + 4 + 8 * rank);
                        size = Some(c.uint(width.unwrap_or(9))?);
                        mask = c.u32()?;
                    }
                    for k in &mut at {
                        *k = c.uint(8)?;
                    }
                    match address {
                        Some(address) => each(Chunk { at: &at, address, size, mask }),
                        None => Ok(()),
                    }
                })
            }
            Index::Single(said) => {
                let (size, mask) = said.map_or((None, 0), |(size, mask)| (Some(size), mask));
                each(Chunk { at: &at, address, size, mask })
            }
            Index::Implicit => self.array(grid, &mut each, |k| {
                let place = k.checked_mul(bytes).and_then(|k| k.checked_add(address));
                Ok(Some((place.unwrap_or(u64::MAX), None, 0)))
            }),
            Index::Fixed => {
                let array = FixedArray::open(self, address, filtered)?;
                self.array(grid, &mut each, |k| array.entry(self, k))
            }
            Index::Extensible => {
                let array = ExtensibleArray::open(self, address, filtered)?;
                self.array(grid, &mut each, |k| array.entry(self, k))
            }
        }
    }

    /// Looks up each chunk of the grid in an array.
    fn array(
        &self,
        grid: &Grid,
        each: &mut impl FnMut(Chunk) -> Result<()>,
        entry: impl Fn(u64) -> Result<Option<Entry>>,
    ) -> Result<()> {
        let mut at = vec![0; grid.counts.len()];
        if grid.counts.contains(&0) {
            return Ok(());
        }
        loop {
            self.spend(1)?;
            if let Some((address, size, mask)) = entry(grid.place(&at))? {
                each(Chunk { at: &at, address, size, mask })?;
            }
            let next = at.iter().zip(&grid.counts).rposition(|(a, n)| a + 1 < *n);
            let Some(next) = next else { return Ok(()) };
            at[next] += 1;
            at[next + 1..].fill(0);
        }
    }

    fn tree_1(
        &self,
        address: u64,
        level: Option<u8>,
        chunked: &Chunked,
        at: &mut [u64],
        each: &mut impl FnMut(Chunk) -> Result<()>,
    ) -> Result<()> {
        // Behind the coordinates stands one for the bytes of an element.
        let (level, children) = self.node_1(address, 1, level, 8 + 8 * (at.len() + 1))?;
        for (key, child) in children {
            if level > 0 {
                self.tree_1(child, Some(level - 1), chunked, at, each)?;
                continue;
            }
            let mut c = self.over(key);
            let (size, mask) = (c.u32()?, c.u32()?);
            for (k, length) in at.iter_mut().zip(&chunked.shape) {
                let first = c.uint(8)?;
                if first % length != 0 {
                    return damaged("a chunk beside the grid");
                }
                *k = first / length;
            }
            each(Chunk { at, address: child, size: Some(size.into()), mask })?;
        }
        Ok(())
    }

    /// An entry of an array of chunks, of that many bytes.
    fn entry(&self, bytes: &'a [u8], filtered: bool) -> Result<Option<Entry>> {
        let mut c = self.over(bytes);
        let address = c.address()?;
        let (mut size, mut mask) = (None, 0);
        if filtered {
            size = Some(c.uint(bytes.len() - self.widths.0 - 4)?);
            mask = c.u32()?;
        }
        Ok(address.map(|address| (address, size, mask)))
    }

    /// An entry's size as an array states it must fit what the entry holds.
    fn entry_size(&self, said: u8, filtered: bool) -> Result<usize> {
        let a = self.widths.0;
        let fits = if filtered { a + 5..=a + 12 } else { a..=a };
        match usize::from(said) {
            said if fits.contains(&said) => Ok(said),
            other => damaged(format!("an index of chunks with entries of {other} bytes")),
        }
    }
}

/// Whether a bit is set, the highest of the first byte being the first.
fn bit(bytes: &[u8], k: usize) -> bool {
    bytes.get(k / 8).is_some_and(|byte| byte & (0x80 >> (k % 8)) != 0)
}

struct FixedArray {
    filtered: bool,
    size: usize,
    count: u64,
    /// Entries of a page, if there are pages.
    page: Option<u64>,
    block: Option<u64>,
}

impl FixedArray {
    fn open(file: &File, address: u64, filtered: bool) -> Result<Self> {
        let (a, l) = file.widths;
        let mut c = file.block(address, 12 + a + l, b"FAHD")?;
        c.version("a fixed array", 0..=0)?;
        if c.u8()? != u8::from(filtered) {
            return damaged("an index of chunks of another kind");
        }
        let size = file.entry_size(c.u8()?, filtered)?;
        let bits = c.u8()?;
        let count = c.length()?;
        let page = 1_u64.checked_shl(bits.into()).filter(|&page| page < count);
        // More entries than the file has bytes cannot be.
        if count > file.size() {
            return damaged("a fixed array of more entries than the file has bytes");
        }
        Ok(Self { filtered, size, count, page, block: c.address()? })
    }

    fn entry<'a>(&self, file: &File<'a>, k: u64) -> Result<Option<Entry>> {
        let Some(block) = self.block else { return Ok(None) };
        if k >= self.count {
            return damaged("a fixed array that is too short");
        }
        let prefix = 6 + file.widths.0;
        let Some(page) = self.page else {
            // Below the size of the file, like all sums of this kind here.
            let c = file.block(block, prefix + self.count as usize * self.size + 4, b"FADB")?;
            let from = prefix - 4 + k as usize * self.size;
            return file.entry(&c.bytes[from..from + self.size], self.filtered);
        };
        let pages = self.count.div_ceil(page) as usize;
        let map = pages.div_ceil(8);
        let c = file.block(block, prefix + map + 4, b"FADB")?;
        let number = (k / page) as usize;
        if !bit(&c.bytes[prefix - 4..], number) {
            return Ok(None);
        }
        let entries = page.min(self.count - number as u64 * page) as usize;
        let full = page as usize * self.size + 4;
        let at = block.saturating_add((prefix + map + 4 + number * full) as u64);
        let bytes = file.sealed(at, entries * self.size + 4)?;
        let from = (k % page) as usize * self.size;
        file.entry(&bytes[from..from + self.size], self.filtered)
    }
}

struct ExtensibleArray {
    filtered: bool,
    size: usize,
    /// Bytes of a block's place in the array.
    place: usize,
    /// Entries in the index block.
    first: u64,
    /// Entries of the smallest data block.
    least: u64,
    /// Entries of a page.
    page: u64,
    /// Super blocks whose data blocks the index block names itself; how many these are.
    direct: u32,
    named: usize,
    /// All super blocks.
    supers: u32,
    block: Option<u64>,
}

impl ExtensibleArray {
    fn open(file: &File, address: u64, filtered: bool) -> Result<Self> {
        let (a, l) = file.widths;
        let mut c = file.block(address, 16 + a + 6 * l, b"EAHD")?;
        c.version("an extensible array", 0..=0)?;
        if c.u8()? != u8::from(filtered) {
            return damaged("an index of chunks of another kind");
        }
        let size = file.entry_size(c.u8()?, filtered)?;
        let bits = c.u8()?;
        let first = c.u8()?.into();
        let (least, pointers) = (u64::from(c.u8()?), u64::from(c.u8()?));
        let page_bits = c.u8()?;
        c.skip(6 * l)?;
        let sound = least.is_power_of_two()
            && pointers.is_power_of_two()
            && bits <= 64
            && least.ilog2() <= bits.into()
            && page_bits <= bits;
        if !sound {
            return damaged("an extensible array of impossible sizes");
        }
        let supers = 1 + u32::from(bits) - least.ilog2();
        Ok(Self {
            filtered,
            size,
            place: usize::from(bits).div_ceil(8),
            first,
            least,
            page: 1_u64.checked_shl(page_bits.into()).unwrap_or(u64::MAX),
            direct: (2 * pointers.ilog2()).min(supers),
            named: 2 * (pointers as usize - 1),
            supers,
            block: c.address()?,
        })
    }

    fn entry<'a>(&self, file: &File<'a>, k: u64) -> Result<Option<Entry>> {
        let Some(block) = self.block else { return Ok(None) };
        let a = file.widths.0;
        let head = 2 + a;
        let indirect = (self.supers - self.direct) as usize;
        let total = 4 + head + self.first as usize * self.size + (self.named + indirect) * a + 4;
        let mut c = file.block(block, total, b"EAIB")?;
        c.skip(head)?;
        let own = c.take(self.first as usize * self.size)?;
        let Some(k) = k.checked_sub(self.first) else {
            let from = k as usize * self.size;
            return file.entry(&own[from..from + self.size], self.filtered);
        };
        // Super block s has 2^(s/2) data blocks of 2^((s+1)/2) times the least number of entries.
        let s = (k / self.least).saturating_add(1).ilog2();
        if s >= self.supers {
            return damaged("an extensible array that is too short");
        }
        let k = k - ((1_u64 << s) - 1) * self.least;
        let entries = self.least << s.div_ceil(2);
        let (number, k) = ((k / entries) as usize, k % entries);
        let pages = entries.div_ceil(self.page);
        if s < self.direct {
            if pages > 1 {
                return damaged("an extensible array of impossible sizes");
            }
            // Before those of s stand 2^0 + 2^0 + 2^1 + 2^1 + ... data blocks.
            let before = (1_usize << (s / 2)) - 1 + (1_usize << s.div_ceil(2)) - 1;
            c.skip((before + number) * a)?;
            return match c.address()? {
                Some(block) => self.in_block(file, block, entries, k),
                None => Ok(None),
            };
        }
        c.skip((self.named + (s - self.direct) as usize) * a)?;
        let Some(block) = c.address()? else { return Ok(None) };
        let blocks = 1_usize << (s / 2);
        let map = if pages > 1 { blocks.saturating_mul(pages.div_ceil(8) as usize) } else { 0 };
        let head = head + self.place;
        let total = blocks.saturating_mul(a).saturating_add(map).saturating_add(8 + head);
        let mut c = file.block(block, total, b"EASB")?;
        c.skip(head)?;
        let map = c.take(map)?;
        c.skip(number * a)?;
        let Some(block) = c.address()? else { return Ok(None) };
        if pages <= 1 {
            return self.in_block(file, block, entries, k);
        }
        let page = k / self.page;
        if !bit(map, number * pages as usize + page as usize) {
            return Ok(None);
        }
        // Its head has a checksum of its own, and so has each page.
        file.block(block, 4 + head + 4, b"EADB")?;
        let full =
            usize::try_from(self.page).ok().and_then(|n| n.checked_mul(self.size)?.checked_add(4));
        let at = full.and_then(|full| {
            let at = (page as usize).checked_mul(full)?.checked_add(8 + head)?;
            Some((block.checked_add(at as u64)?, full))
        });
        let Some((at, full)) = at else {
            return damaged("an extensible array of impossible sizes");
        };
        let bytes = file.sealed(at, full)?;
        let from = (k % self.page) as usize * self.size;
        file.entry(&bytes[from..from + self.size], self.filtered)
    }

    /// An entry of a data block without pages.
    fn in_block<'a>(
        &self,
        file: &File<'a>,
        block: u64,
        entries: u64,
        k: u64,
    ) -> Result<Option<Entry>> {
        let head = 2 + file.widths.0 + self.place;
        let Some(bytes) = usize::try_from(entries).ok().and_then(|n| n.checked_mul(self.size))
        else {
            return damaged("an extensible array of impossible sizes");
        };
        let total = bytes.saturating_add(8 + head);
        let mut c = file.block(block, total, b"EADB")?;
        c.skip(head)?;
        c.skip(k as usize * self.size)?;
        let bytes = c.take(self.size)?;
        file.entry(bytes, self.filtered)
    }
}
