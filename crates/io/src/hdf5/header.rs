//! Object headers: the messages that say what an object is.

use super::{Cursor, Fault, File, Result, damaged};

pub(super) const DATASPACE: u16 = 0x01;
pub(super) const LINK_INFO: u16 = 0x02;
pub(super) const DATATYPE: u16 = 0x03;
pub(super) const OLD_FILL: u16 = 0x04;
pub(super) const FILL: u16 = 0x05;
pub(super) const LINK: u16 = 0x06;
pub(super) const EXTERNAL: u16 = 0x07;
pub(super) const LAYOUT: u16 = 0x08;
pub(super) const FILTERS: u16 = 0x0b;
pub(super) const ATTRIBUTE: u16 = 0x0c;
const CONTINUATION: u16 = 0x10;
pub(super) const SYMBOL_TABLE: u16 = 0x11;
pub(super) const ATTRIBUTE_INFO: u16 = 0x15;
const REFERENCES: u16 = 0x16;
/// The last kind of message that the specification knows.
const LAST: u16 = 0x18;

#[derive(Clone, Copy)]
pub(super) struct Message<'a> {
    pub kind: u16,
    /// It stands elsewhere, and the body says where.
    pub shared: bool,
    pub body: &'a [u8],
}

pub(super) struct Header<'a> {
    pub messages: Vec<Message<'a>>,
    /// How many hard links lead to the object.
    pub references: u32,
}

impl<'a> Header<'a> {
    pub(super) fn all(&self, kind: u16) -> impl Iterator<Item = Message<'a>> + '_ {
        self.messages.iter().copied().filter(move |m| m.kind == kind)
    }

    pub(super) fn first(&self, kind: u16) -> Option<Message<'a>> {
        self.all(kind).next()
    }
}

impl<'a> File<'a> {
    pub(super) fn header(&self, address: u64) -> Result<Header<'a>> {
        let c = self.cursor(address)?;
        match c.bytes {
            [b'O', b'H', b'D', b'R', ..] => self.header_2(address),
            [1, ..] => self.header_1(address),
            _ => damaged("no object header where one must be"),
        }
    }

    fn header_1(&self, address: u64) -> Result<Header<'a>> {
        let mut c = self.cursor(address)?;
        c.skip(2)?;
        let count = c.u16()?;
        let references = c.u32()?;
        let size = c.u32()?;
        // Messages begin at multiples of eight.
        let mut parts = vec![(address.saturating_add(16), u64::from(size))];
        let mut header = Header { messages: vec![], references };
        let mut k = 0;
        while let Some(&(at, size)) = parts.get(k) {
            k += 1;
            let part = self.slice(at, size)?;
            self.spend(part.len() + 16)?;
            let mut c = self.over(part);
            while c.rest().len() >= 8 && header.messages.len() < count.into() {
                let kind = c.u16()?;
                let size = c.u16()?;
                let flags = c.u8()?;
                c.skip(3)?;
                let body = c.take(size.into())?;
                self.add(&mut header, &mut parts, kind, flags, body)?;
            }
        }
        Ok(header)
    }

    fn header_2(&self, address: u64) -> Result<Header<'a>> {
        let mut c = self.cursor(address)?;
        c.skip(4)?;
        c.version("an object header", 2..=2)?;
        let flags = c.u8()?;
        if flags & 0x20 != 0 {
            c.skip(16)?;
        }
        if flags & 0x10 != 0 {
            c.skip(4)?;
        }
        let size = c.uint(1 << (flags & 3))?;
        let prefix = c.at - 4;
        let total = usize::try_from(size).ok().and_then(|size| size.checked_add(c.at + 4));
        let Some(total) = total else { return damaged("an object header without end") };
        let mut first = self.block(address, total, b"OHDR")?;
        first.skip(prefix)?;
        let mut header = Header { messages: vec![], references: 1 };
        let mut parts = vec![];
        let ordered = flags & 4 != 0;
        self.part_2(first, ordered, &mut header, &mut parts)?;
        let mut k = 0;
        while let Some(&(at, size)) = parts.get(k) {
            k += 1;
            let size = usize::try_from(size).unwrap_or(usize::MAX);
            let c = self.block(at, size, b"OCHK")?;
            self.part_2(c, ordered, &mut header, &mut parts)?;
        }
        if let Some(m) = header.first(REFERENCES) {
            let mut c = self.over(m.body);
            c.skip(1)?;
            header.references = c.u32()?;
        }
        Ok(header)
    }

    fn part_2(
        &self,
        mut c: Cursor<'a>,
        ordered: bool,
        header: &mut Header<'a>,
        parts: &mut Vec<(u64, u64)>,
    ) -> Result<()> {
        // What is too short for a message is a gap.
        let least = if ordered { 6 } else { 4 };
        self.spend(c.rest().len())?;
        while c.rest().len() >= least {
            let kind = c.u8()?.into();
            let size = c.u16()?;
            let flags = c.u8()?;
            if ordered {
                c.skip(2)?;
            }
            let body = c.take(size.into())?;
            self.add(header, parts, kind, flags, body)?;
        }
        Ok(())
    }

    fn add(
        &self,
        header: &mut Header<'a>,
        parts: &mut Vec<(u64, u64)>,
        kind: u16,
        flags: u8,
        body: &'a [u8],
    ) -> Result<()> {
        if kind == CONTINUATION {
            let mut c = self.over(body);
            let part = (c.defined()?, c.length()?);
            if parts.contains(&part) {
                return damaged("an object header that goes on in itself");
            }
            parts.push(part);
        }
        if kind > LAST && flags & 0x80 != 0 {
            return Err(Fault::Unsupported("a message that only newer readers understand"));
        }
        header.messages.push(Message { kind, shared: flags & 2 != 0, body });
        Ok(())
    }

    /// The body of a message, from where it stands.
    pub(super) fn body(&self, message: Message<'a>) -> Result<&'a [u8]> {
        if !message.shared {
            return Ok(message.body);
        }
        let mut c = self.over(message.body);
        let version = c.version("a shared message", 1..=3)?;
        let place = c.u8()?;
        if version == 1 {
            c.skip(6)?;
        }
        if version == 3 && place != 2 {
            return Err(Fault::Unsupported("a message in a shared heap"));
        }
        // A committed datatype.
        match self.header(c.defined()?)?.first(message.kind) {
            Some(m) if !m.shared => Ok(m.body),
            _ => damaged("a shared message that leads nowhere"),
        }
    }
}
