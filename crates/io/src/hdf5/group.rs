//! Groups and the links in them.

use std::collections::BTreeMap;

use super::data::Dataset;
use super::header::{self, Header};
use super::heap::Heap;
use super::{Fault, File, Result, damaged};

/// What a name in a group leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Link<'a> {
    /// An object header.
    Hard(u64),
    /// A path.
    Soft(&'a [u8]),
    /// Another file, or a kind of link that an application made up.
    External,
}

/// A group with all its links.
#[derive(Debug, Clone)]
pub(crate) struct Group<'a> {
    pub links: BTreeMap<&'a [u8], Link<'a>>,
    /// Its object header.
    pub address: u64,
    /// How many hard links lead to it.
    pub references: u32,
}

/// What stands at an address.
// Few at a time: their size does not matter.
#[allow(clippy::large_enum_variant)]
pub(crate) enum Object<'a> {
    Group(Group<'a>),
    Dataset(Dataset<'a>),
    /// A committed datatype, or nothing that is known.
    Other,
}

/// A child of a node of a B-tree of version 1, with the key before it.
type Child<'a> = (&'a [u8], u64);

/// Soft links in a row, as many as the C library follows.
const MOST_LINKS: usize = 16;

impl<'a> File<'a> {
    pub(crate) fn root(&self) -> Result<Group<'a>> {
        match self.object(self.root)? {
            Object::Group(group) => Ok(group),
            _ => damaged("a root that is no group"),
        }
    }

    /// The object of that name in a group, soft links followed; `None`: no such name.
    pub(crate) fn find(&self, group: &Group<'a>, name: &str) -> Result<Option<Object<'a>>> {
        self.address(group, name)?.map(|address| self.object(address)).transpose()
    }

    /// Where the object of that name is, soft links followed.
    pub(crate) fn address(&self, group: &Group<'a>, name: &str) -> Result<Option<u64>> {
        self.lead(group, name.as_bytes(), &mut { MOST_LINKS })
    }

    pub(crate) fn object(&self, address: u64) -> Result<Object<'a>> {
        let header = self.header(address)?;
        let has = |kind| header.first(kind).is_some();
        if has(header::SYMBOL_TABLE) || has(header::LINK_INFO) || has(header::LINK) {
            let links = self.links(&header)?;
            return Ok(Object::Group(Group { links, address, references: header.references }));
        }
        if has(header::LAYOUT) {
            return self.dataset(&header).map(Object::Dataset);
        }
        Ok(Object::Other)
    }

    /// The address behind a name.
    fn lead(&self, group: &Group<'a>, name: &[u8], left: &mut usize) -> Result<Option<u64>> {
        match group.links.get(name) {
            None => Ok(None),
            Some(Link::Hard(address)) => Ok(Some(*address)),
            Some(Link::External) => Err(Fault::Unsupported("an external link")),
            Some(Link::Soft(path)) => {
                let said = String::from_utf8_lossy(path);
                match left.checked_sub(1) {
                    Some(fewer) => *left = fewer,
                    None => {
                        let found = format!(
                            "more than {MOST_LINKS} soft links in a row, the last to `{said}`"
                        );
                        return Err(Fault::Dangling(found));
                    }
                }
                match self.walk(group, path, left)? {
                    Some(address) => Ok(Some(address)),
                    None => Err(Fault::Dangling(format!(
                        "a soft link to `{said}`, where nothing stands"
                    ))),
                }
            }
        }
    }

    /// The address at the end of a path from a group on.
    fn walk(&self, from: &Group<'a>, path: &[u8], left: &mut usize) -> Result<Option<u64>> {
        let parts: Vec<&[u8]> =
            path.split(|&c| c == b'/').filter(|part| !part.is_empty() && *part != b".").collect();
        let root;
        let mut group = from;
        if path.starts_with(b"/") {
            root = self.root()?;
            group = &root;
        }
        let Some((last, before)) = parts.split_last() else { return Ok(Some(group.address)) };
        let mut inner;
        for part in before {
            let Some(address) = self.lead(group, part, left)? else { return Ok(None) };
            match self.object(address)? {
                Object::Group(next) => {
                    inner = next;
                    group = &inner;
                }
                _ => return Ok(None),
            }
        }
        self.lead(group, last, left)
    }

    fn links(&self, header: &Header<'a>) -> Result<BTreeMap<&'a [u8], Link<'a>>> {
        let mut links = BTreeMap::new();
        if let Some(table) = header.first(header::SYMBOL_TABLE) {
            let mut c = self.over(table.body);
            let (tree, heap) = (c.defined()?, c.defined()?);
            let names = self.local_heap(heap)?;
            self.symbols(tree, names, None, &mut links)?;
            return Ok(links);
        }
        for message in header.all(header::LINK) {
            self.link(message.body, &mut links)?;
        }
        if let Some(info) = header.first(header::LINK_INFO) {
            let mut c = self.over(info.body);
            c.version("link information", 0..=0)?;
            if c.u8()? & 1 != 0 {
                c.skip(8)?;
            }
            if let Some(heap) = c.address()? {
                let names = c.defined()?;
                let heap = Heap::open(self, heap)?;
                // Before the identity in the heap stands the hash of the name.
                self.records(names, 5, |record| self.link(heap.object(&record[4..])?, &mut links))?;
            }
        }
        Ok(links)
    }

    fn link(&self, body: &'a [u8], links: &mut BTreeMap<&'a [u8], Link<'a>>) -> Result<()> {
        let mut c = self.over(body);
        c.version("a link", 1..=1)?;
        let flags = c.u8()?;
        let kind = if flags & 8 != 0 { c.u8()? } else { 0 };
        if flags & 4 != 0 {
            c.skip(8)?;
        }
        if flags & 0x10 != 0 {
            c.skip(1)?;
        }
        let length = c.uint(1 << (flags & 3))?;
        let name = c.take(usize::try_from(length).unwrap_or(usize::MAX))?;
        let link = match kind {
            0 => Link::Hard(c.defined()?),
            1 => {
                let length = c.u16()?;
                Link::Soft(c.take(length.into())?)
            }
            _ => Link::External,
        };
        links.insert(name, link);
        Ok(())
    }

    /// The data of a local heap.
    fn local_heap(&self, address: u64) -> Result<&'a [u8]> {
        let mut c = self.cursor(address)?;
        if c.take(4)? != b"HEAP" {
            return damaged("no HEAP where one must be");
        }
        c.version("a local heap", 0..=0)?;
        c.skip(3)?;
        let size = c.length()?;
        c.length()?;
        self.slice(c.defined()?, size)
    }

    /// All symbols below a node of a B-tree of version 1, which must have the level named, if one is.
    fn symbols(
        &self,
        address: u64,
        names: &'a [u8],
        level: Option<u8>,
        links: &mut BTreeMap<&'a [u8], Link<'a>>,
    ) -> Result<()> {
        let (level, children) = self.node_1(address, 0, level, self.widths.1)?;
        for (_, child) in children {
            if level > 0 {
                self.symbols(child, names, Some(level - 1), links)?;
                continue;
            }
            let mut c = self.cursor(child)?;
            if c.take(4)? != b"SNOD" {
                return damaged("no SNOD where one must be");
            }
            c.version("a node of symbols", 1..=1)?;
            c.skip(1)?;
            let count = c.u16()?;
            for _ in 0..count {
                self.spend(40)?;
                let name = text_at(names, c.uint(self.widths.0)?)?;
                let address = c.address()?;
                let kind = c.u32()?;
                c.skip(4)?;
                let mut scratch = self.over(c.take(16)?);
                let link = match (kind, address) {
                    (2, _) => Link::Soft(text_at(names, scratch.u32()?.into())?),
                    (_, Some(address)) => Link::Hard(address),
                    (_, None) => return damaged("a link to an undefined address"),
                };
                links.insert(name, link);
            }
        }
        Ok(())
    }

    /// The level of a node of a B-tree of version 1, and its children with the keys before them.
    pub(super) fn node_1(
        &self,
        address: u64,
        kind: u8,
        level: Option<u8>,
        key: usize,
    ) -> Result<(u8, Vec<Child<'a>>)> {
        let mut c = self.cursor(address)?;
        if c.take(4)? != b"TREE" {
            return damaged("no TREE where one must be");
        }
        if c.u8()? != kind {
            return damaged("a B-tree of another kind");
        }
        // Levels fall by one from node to node, so that no path leads in a circle.
        let found = c.u8()?;
        if level.is_some_and(|level| level != found) {
            return damaged("a B-tree whose levels are out of order");
        }
        let count: usize = c.u16()?.into();
        c.skip(2 * self.widths.0)?;
        self.spend(count * (key + self.widths.0))?;
        let mut children = vec![];
        for _ in 0..count {
            let key = c.take(key)?;
            children.push((key, c.defined()?));
        }
        Ok((found, children))
    }
}

/// A text that ends with NUL.
fn text_at(heap: &[u8], at: u64) -> Result<&[u8]> {
    let rest = usize::try_from(at).ok().and_then(|at| heap.get(at..));
    let text = rest.and_then(|rest| rest.split(|&c| c == 0).next());
    text.map_or_else(|| damaged("a name beyond the end of its heap"), Ok)
}
