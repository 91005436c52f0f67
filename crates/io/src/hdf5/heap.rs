//! Fractal heaps, B-trees of version 2, global heaps.

use super::{Cursor, FUZZING, Fault, File, Result, damaged};

/// The objects of a fractal heap.
pub(super) struct Heap<'f, 'a> {
    file: &'f File<'a>,
    /// Bytes of an object's place and of its length.
    place: usize,
    length: usize,
    /// Whether direct blocks have checksums.
    sums: bool,
    width: u64,
    start: u64,
    most_direct: u64,
    root: Option<u64>,
    /// Rows of the root, 0 if it is a direct block.
    rows: u64,
}

impl<'f, 'a> Heap<'f, 'a> {
    pub(super) fn open(file: &'f File<'a>, address: u64) -> Result<Self> {
        let (a, l) = file.widths;
        let mut c = file.cursor(address)?;
        c.skip(7)?;
        if c.u16()? != 0 {
            return Err(Fault::Unsupported("a compressed heap of links"));
        }
        let mut c = file.block(address, 26 + 3 * a + 12 * l, b"FRHP")?;
        c.version("a fractal heap", 0..=0)?;
        c.skip(4)?;
        let sums = c.u8()? & 2 != 0;
        let most_managed = c.u32()?;
        c.skip(10 * l + 2 * a)?;
        let width = c.u16()?.into();
        let start = c.length()?;
        let most_direct = c.length()?;
        let bits: usize = c.u16()?.into();
        c.skip(2)?;
        let root = c.address()?;
        let rows = c.u16()?.into();
        let powers =
            start.is_power_of_two() && most_direct.is_power_of_two() && start <= most_direct;
        if !powers || width == 0 || !(1..=64).contains(&bits) {
            return damaged("a fractal heap of impossible sizes");
        }
        let length = (most_direct.ilog2() as usize).div_ceil(8).min(bytes_of(most_managed.into()));
        let place = bits.div_ceil(8);
        Ok(Self { file, place, length, sums, width, start, most_direct, root, rows })
    }

    /// The object of an identity.
    pub(super) fn object(&self, id: &'a [u8]) -> Result<&'a [u8]> {
        let mut c = self.file.over(id);
        let kind = c.u8()?;
        match kind & 0xf0 {
            0x00 => {}
            0x20 => return c.take(usize::from(kind & 0x0f) + 1),
            _ => return Err(Fault::Unsupported("a link of more than 64 KiB")),
        }
        let (at, length) = (c.uint(self.place)?, c.uint(self.length)?);
        let Some(root) = self.root else { return damaged("an object of an empty heap") };
        let (block, size, at) = match self.rows {
            // Such a block has the size of the first.
            0 => (root, self.start, at),
            rows => self.direct(root, rows, at)?,
        };
        if at.checked_add(length).is_none_or(|end| end > size) {
            return damaged("an object beyond the end of its heap");
        }
        let size = usize::try_from(size).unwrap_or(usize::MAX);
        self.file.spend(16)?;
        let block = self.file.slice(block, size as u64)?;
        if !block.starts_with(b"FHDB") {
            return damaged("no FHDB where one must be");
        }
        // The checksum stands inside, where zeros stood when it was made.
        let sum = 5 + self.file.widths.0 + self.place;
        if self.sums && !FUZZING && !self.known(block) {
            self.file.spend(size)?;
            let mut copy = block.to_vec();
            let Some(stored) = copy.get_mut(sum..sum + 4) else {
                return damaged("a block without room for its checksum");
            };
            let said = u32::from_le_bytes([stored[0], stored[1], stored[2], stored[3]]);
            stored.fill(0);
            if super::checksum(&copy) != said {
                return damaged("FHDB with a wrong checksum");
            }
        }
        self.file.spend(length as usize)?;
        Ok(&block[at as usize..(at + length) as usize])
    }

    /// Whether a block has been checked; from now on it has.
    fn known(&self, block: &[u8]) -> bool {
        let address = block.as_ptr() as u64 - self.file.bytes.as_ptr() as u64;
        !self.file.sound.borrow_mut().insert(address)
    }

    /// The direct block below an indirect one that holds a place: its address, its size, and the place in it.
    fn direct(&self, mut block: u64, mut rows: u64, mut at: u64) -> Result<(u64, u64, u64)> {
        let (a, _) = self.file.widths;
        let direct_rows = u64::from(self.most_direct.ilog2() - self.start.ilog2()) + 2;
        let overflow = || Fault::Damaged("a fractal heap of impossible sizes".into());
        let first_row = self.width.checked_mul(self.start).ok_or_else(overflow)?;
        // Indirect blocks below have fewer rows, so this ends.
        loop {
            let row = if at < first_row { 0 } else { u64::from((at / first_row).ilog2()) + 1 };
            if row >= rows || rows > 64 {
                return damaged("an object beyond the end of its heap");
            }
            let doubled = |x: u64| {
                x.checked_shl(row.saturating_sub(1) as u32)
                    .filter(|y| y >> row.saturating_sub(1) == x)
            };
            let size = doubled(self.start).ok_or_else(overflow)?;
            let before = if row == 0 { 0 } else { doubled(first_row).ok_or_else(overflow)? };
            let column = (at - before) / size;
            let children = usize::try_from(rows * self.width).unwrap_or(usize::MAX);
            let total = children.checked_mul(a).and_then(|n| n.checked_add(9 + a + self.place));
            let mut c = self.file.block(block, total.ok_or_else(overflow)?, b"FHIB")?;
            c.skip(1 + a + self.place)?;
            c.skip((row * self.width + column) as usize * a)?;
            block = c.defined()?;
            at -= before + column * size;
            if row < direct_rows {
                return Ok((block, size, at));
            }
            let below =
                u64::from(size.ilog2()).checked_sub(u64::from(first_row.ilog2())).map(|k| k + 1);
            match below {
                Some(below) if below < rows => rows = below,
                _ => return damaged("a fractal heap whose blocks do not shrink"),
            }
        }
    }
}

/// Bytes that hold any number up to `most`.
fn bytes_of(most: u64) -> usize {
    most.max(1).ilog2() as usize / 8 + 1
}

impl<'a> File<'a> {
    /// Hands over each record of a B-tree of version 2 and the given kind.
    pub(super) fn records(
        &self,
        address: u64,
        kind: u8,
        mut each: impl FnMut(&'a [u8]) -> Result<()>,
    ) -> Result<()> {
        let (a, l) = self.widths;
        let mut c = self.block(address, 22 + a + l, b"BTHD")?;
        c.version("a B-tree", 0..=0)?;
        if c.u8()? != kind {
            return damaged("a B-tree of another kind");
        }
        let node: usize = c.u32()? as usize;
        let record: usize = c.u16()?.into();
        let depth: usize = c.u16()?.into();
        c.skip(2)?;
        let root = c.address()?;
        let count: usize = c.u16()?.into();
        let least = match kind {
            5 => 5,
            _ => 1 + a,
        };
        if record < least || node < 10 + record || depth > 32 {
            return damaged("a B-tree of impossible sizes");
        }
        let Some(root) = root else { return Ok(()) };
        // For each level from the leaves up: bytes of the total below a child.
        let leaf = (node - 10) / record;
        let own = bytes_of(leaf as u64);
        let mut totals = vec![0];
        let mut most = leaf as u64;
        for _ in 0..depth {
            let pointer = a + own + totals[totals.len() - 1];
            let room = node.saturating_sub(10 + pointer) / (record + pointer);
            most = most.saturating_mul(room as u64 + 1).saturating_add(room as u64);
            totals.push(bytes_of(most));
        }
        let tree = Tree { node, record, own, totals };
        self.below(&tree, root, count, depth, kind, &mut each)
    }

    fn below(
        &self,
        tree: &Tree,
        address: u64,
        count: usize,
        depth: usize,
        kind: u8,
        each: &mut impl FnMut(&'a [u8]) -> Result<()>,
    ) -> Result<()> {
        let Tree { node, record, own, ref totals } = *tree;
        let (signature, pointer) = match depth {
            0 => (b"BTLF", 0),
            _ => (b"BTIN", self.widths.0 + own + totals[depth - 1]),
        };
        let children = if depth == 0 { 0 } else { count + 1 };
        let used = 10 + count * record + children * pointer;
        if used > node {
            return damaged("a node of a B-tree with too many records");
        }
        let mut c: Cursor = self.block(address, used, signature)?;
        c.version("a node of a B-tree", 0..=0)?;
        if c.u8()? != kind {
            return damaged("a node of another B-tree");
        }
        self.spend(used)?;
        for _ in 0..count {
            each(c.take(record)?)?;
        }
        for _ in 0..children {
            let child = c.defined()?;
            let count = c.uint(own)? as usize;
            c.skip(totals[depth - 1])?;
            self.below(tree, child, count, depth - 1, kind, each)?;
        }
        Ok(())
    }

    /// An object of a global heap; `None`: not there.
    pub(super) fn global(&self, address: u64, index: u32) -> Result<Option<&'a [u8]>> {
        let mut c = self.cursor(address)?;
        if c.take(4)? != b"GCOL" {
            return damaged("no GCOL where one must be");
        }
        c.version("a global heap", 1..=1)?;
        c.skip(3)?;
        let size = c.length()?;
        let mut rest = self.over(self.slice(address, size)?);
        rest.skip(c.at)?;
        while rest.rest().len() >= 8 + self.widths.1 {
            self.spend(16)?;
            let found = rest.u16()?;
            rest.skip(6)?;
            let size = rest.length()?;
            if found == 0 {
                break;
            }
            let object = rest.take(usize::try_from(size).unwrap_or(usize::MAX))?;
            if u32::from(found) == index {
                return Ok(Some(object));
            }
            let pad = object.len().next_multiple_of(8) - object.len();
            rest.skip(pad.min(rest.rest().len()))?;
        }
        Ok(None)
    }
}

/// The shape of a B-tree of version 2.
struct Tree {
    node: usize,
    record: usize,
    /// Bytes of the number of records in a child.
    own: usize,
    /// Bytes of the number of records below a child, by its depth.
    totals: Vec<usize>,
}
