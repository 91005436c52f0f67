//! Datasets: type, shape, layout, filters, values.

use std::borrow::Cow;

use super::chunks::{Chunked, Grid, Index};
use super::header::{self, Header};
use super::{EXPANSION, FUZZING, Fault, File, Result, damaged};

/// The type of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Type {
    Int {
        big: bool,
        signed: bool,
        shift: u32,
        bits: u32,
    },
    Real {
        big: bool,
        sign: u32,
        exponent: (u32, u32),
        mantissa: (u32, u32),
        bias: u32,
    },
    /// Of fixed length.
    Text,
    /// Of any length.
    VariableText,
    /// What it is, in words.
    Other(&'static str),
}

impl Type {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Type::Int { .. } => "integers",
            Type::Real { .. } => "reals",
            Type::Text | Type::VariableText => "a text",
            Type::Other(name) => name,
        }
    }
}

#[derive(Debug, Clone)]
enum Layout<'a> {
    Compact(&'a [u8]),
    /// `None`: nothing has been written.
    Contiguous(Option<u64>),
    Chunked(Chunked),
}

#[derive(Debug, Clone)]
struct Filter {
    id: u16,
    values: Vec<u32>,
}

const DEFLATE: u16 = 1;
const SHUFFLE: u16 = 2;
const FLETCHER32: u16 = 3;
const SCALEOFFSET: u16 = 6;
const LZF: u16 = 32000;

/// A dataset, its values not yet read.
#[derive(Debug, Clone)]
pub(crate) struct Dataset<'a> {
    pub kind: Type,
    /// Bytes of an element.
    pub width: u64,
    pub shape: Vec<u64>,
    /// What it may grow to.
    most: Vec<u64>,
    layout: Layout<'a>,
    filters: Vec<Filter>,
    fill: &'a [u8],
    /// How many hard links lead to it.
    pub references: u32,
}

impl Dataset<'_> {
    pub(crate) fn is_chunked(&self) -> bool {
        matches!(self.layout, Layout::Chunked(_))
    }

    /// The bytes of all elements; `None`: more than 64 bits count.
    fn bytes(&self) -> Option<u64> {
        self.shape.iter().try_fold(self.width, |a, &b| a.checked_mul(b))
    }
}

impl<'a> File<'a> {
    pub(super) fn dataset(&self, header: &Header<'a>) -> Result<Dataset<'a>> {
        let body = |kind, what: &'static str| match header.first(kind) {
            Some(m) => self.body(m),
            None => damaged(format!("a dataset without {what}")),
        };
        if header.first(header::EXTERNAL).is_some() {
            return Err(Fault::Unsupported("data in another file"));
        }
        let (kind, width) = self.datatype(body(header::DATATYPE, "a type")?)?;
        let (shape, most) = self.dataspace(body(header::DATASPACE, "a shape")?)?;
        let layout = self.layout(body(header::LAYOUT, "a layout")?, shape.len(), width)?;
        let filters = match header.first(header::FILTERS) {
            Some(m) => self.filters(self.body(m)?)?,
            None => vec![],
        };
        let fill = match (header.first(header::FILL), header.first(header::OLD_FILL)) {
            (Some(m), _) => self.fill(self.body(m)?)?,
            (None, Some(m)) => {
                let mut c = self.over(self.body(m)?);
                let size = c.u32()?;
                c.take(size as usize)?
            }
            (None, None) => &[],
        };
        let references = header.references;
        Ok(Dataset { kind, width, shape, most, layout, filters, fill, references })
    }

    fn datatype(&self, body: &'a [u8]) -> Result<(Type, u64)> {
        let mut c = self.over(body);
        let class = c.u8()?;
        let bits = c.uint(3)? as u32;
        let width = c.u32()?;
        if !(1..=5).contains(&(class >> 4)) || width == 0 {
            return damaged(format!("a type of version {} and {width} bytes", class >> 4));
        }
        let big = bits & 1 != 0;
        let kind = match class & 0xf {
            0 | 1 if width > 8 => Type::Other("numbers of more than 64 bits"),
            0 => {
                let (shift, count) = (c.u16()?.into(), c.u16()?.into());
                if count == 0 || shift + count > 8 * width {
                    return damaged("an integer type of impossible sizes");
                }
                Type::Int { big, signed: bits & 8 != 0, shift, bits: count }
            }
            1 => {
                c.skip(4)?;
                let [e_at, e_bits, m_at, m_bits] =
                    [c.u8()?, c.u8()?, c.u8()?, c.u8()?].map(u32::from);
                let bias = c.u32()?;
                let sign = bits >> 8 & 0xff;
                let (exponent, mantissa) = ((e_at, e_bits), (m_at, m_bits));
                let ends = [sign + 1, e_at + e_bits, m_at + m_bits];
                if ends.iter().any(|&end| end > 8 * width) || e_bits == 0 || m_bits == 0 {
                    return damaged("a real type of impossible sizes");
                }
                // With the leading digit implied, at most as wide as a double in each part, and not VAX' order of bytes.
                let known = bits >> 4 & 3 == 2
                    && bits & 0x40 == 0
                    && (2..=11).contains(&e_bits)
                    && m_bits <= 52;
                if !known || bias != (1 << (e_bits - 1)) - 1 {
                    Type::Other("reals of another kind than IEEE 754")
                } else {
                    Type::Real { big, sign, exponent, mantissa, bias }
                }
            }
            3 => Type::Text,
            9 if bits & 0xf == 1 => Type::VariableText,
            2 => Type::Other("times"),
            4 => Type::Other("bit fields"),
            5 => Type::Other("opaque data"),
            6 => Type::Other("a compound type"),
            7 => Type::Other("references"),
            8 => Type::Other("an enumeration"),
            9 => Type::Other("sequences of variable length"),
            10 => Type::Other("arrays"),
            11 => Type::Other("complex numbers"),
            other => return damaged(format!("a type of class {other}")),
        };
        Ok((kind, width.into()))
    }

    /// The lengths, and the most that they may become.
    fn dataspace(&self, body: &'a [u8]) -> Result<(Vec<u64>, Vec<u64>)> {
        let mut c = self.over(body);
        let version = c.version("a dataspace", 1..=2)?;
        let rank: usize = c.u8()?.into();
        let flags = c.u8()?;
        let kind = c.u8()?;
        if version == 1 {
            c.skip(4)?;
        }
        // Nothing, which is less than one number.
        if version == 2 && kind == 2 {
            return Ok((vec![0], vec![0]));
        }
        if rank > 32 {
            return damaged(format!("a dataspace of {rank} dimensions"));
        }
        let mut lengths = || (0..rank).map(|_| c.length()).collect::<Result<Vec<u64>>>();
        let shape = lengths()?;
        let endless = u64::MAX >> (64 - 8 * self.widths.1);
        let most = match flags & 1 {
            0 => shape.clone(),
            _ => lengths()?.into_iter().map(|n| if n == endless { u64::MAX } else { n }).collect(),
        };
        match shape.iter().zip(&most).all(|(n, most)| n <= most) {
            true => Ok((shape, most)),
            false => damaged("a dataspace larger than it may become"),
        }
    }

    fn fill(&self, body: &'a [u8]) -> Result<&'a [u8]> {
        let mut c = self.over(body);
        let version = c.version("a fill value", 1..=3)?;
        let defined = match version {
            3 => c.u8()? & 0x20 != 0,
            _ => {
                c.skip(2)?;
                c.u8()? != 0 || version == 1
            }
        };
        if !defined {
            return Ok(&[]);
        }
        let size = c.u32()?;
        c.take(size as usize)
    }

    fn layout(&self, body: &'a [u8], rank: usize, width: u64) -> Result<Layout<'a>> {
        let mut c = self.over(body);
        let version = c.version("a layout", 1..=5)?;
        let mut shape = vec![];
        if version <= 2 {
            let count = c.u8()?;
            let class = c.u8()?;
            c.skip(5)?;
            let address = if class == 0 { None } else { c.address()? };
            for _ in 0..count {
                shape.push(c.u32()?.into());
            }
            return match class {
                0 => {
                    let size = c.u32()?;
                    Ok(Layout::Compact(c.take(size as usize)?))
                }
                1 => Ok(Layout::Contiguous(address)),
                2 => {
                    let element = shape.pop().unwrap_or(0);
                    chunked(shape, element, rank, width, false, Index::Tree1, address)
                }
                _ => damaged("a layout of unknown class"),
            };
        }
        match c.u8()? {
            0 => {
                let size = c.u16()?;
                Ok(Layout::Compact(c.take(size.into())?))
            }
            1 => Ok(Layout::Contiguous(c.address()?)),
            2 if version == 3 => {
                let count = c.u8()?;
                let address = c.address()?;
                for _ in 0..count {
                    shape.push(c.u32()?.into());
                }
                let element = shape.pop().unwrap_or(0);
                chunked(shape, element, rank, width, false, Index::Tree1, address)
            }
            2 => {
                let flags = c.u8()?;
                let count = c.u8()?;
                let bytes = c.u8()?;
                for _ in 0..count {
                    shape.push(c.uint(bytes.into())?);
                }
                let element = shape.pop().unwrap_or(0);
                let index = match c.u8()? {
                    1 if flags & 2 != 0 => Index::Single(Some((c.length()?, c.u32()?))),
                    1 => Index::Single(None),
                    2 => Index::Implicit,
                    3 => {
                        c.skip(1)?;
                        Index::Fixed
                    }
                    4 => {
                        c.skip(5)?;
                        Index::Extensible
                    }
                    5 => {
                        c.skip(6)?;
                        Index::Tree2
                    }
                    other => return damaged(format!("an index of chunks of kind {other}")),
                };
                chunked(shape, element, rank, width, flags & 1 != 0, index, c.address()?)
            }
            3 => Err(Fault::Unsupported("a virtual dataset")),
            _ => damaged("a layout of unknown class"),
        }
    }

    fn filters(&self, body: &'a [u8]) -> Result<Vec<Filter>> {
        let mut c = self.over(body);
        let version = c.version("a list of filters", 1..=2)?;
        let count = c.u8()?;
        if version == 1 {
            c.skip(6)?;
        }
        let mut filters = vec![];
        for _ in 0..count {
            let id = c.u16()?;
            let named = version == 1 || id >= 256;
            let name: usize = if named { c.u16()?.into() } else { 0 };
            c.skip(2)?;
            let values = c.u16()?;
            c.skip(if version == 1 { name.next_multiple_of(8) } else { name })?;
            let values: Vec<u32> = (0..values).map(|_| c.u32()).collect::<Result<_>>()?;
            if version == 1 && values.len() % 2 == 1 {
                c.skip(4)?;
            }
            filters.push(Filter { id, values });
        }
        Ok(filters)
    }

    /// The bytes of all elements, one after the other.
    pub(crate) fn read(&self, d: &Dataset<'a>) -> Result<Cow<'a, [u8]>> {
        // What is not there is filled; what is compressed grows; all else stands in the file as it is.
        let grows = d.is_chunked() || matches!(d.layout, Layout::Contiguous(None));
        let most = self.size().saturating_mul(if grows { EXPANSION } else { 1 });
        let Some(bytes) = d.bytes().filter(|&bytes| bytes <= most) else {
            let (shape, width, size) = (&d.shape, d.width, self.size());
            return Err(Fault::Size(size, format!("shape {shape:?} of {width} bytes each")));
        };
        match &d.layout {
            Layout::Compact(data) => match data.get(..bytes as usize) {
                Some(data) => Ok(Cow::Borrowed(data)),
                None => damaged("data that end early"),
            },
            Layout::Contiguous(Some(address)) if bytes > 0 => {
                self.claim(bytes)?;
                self.slice(*address, bytes).map(Cow::Borrowed)
            }
            Layout::Contiguous(_) => self.filled(d, bytes).map(Cow::Owned),
            Layout::Chunked(chunked) => self.chunked(d, chunked, bytes).map(Cow::Owned),
        }
    }

    /// Where the bytes of a dataset stand in the file as they are, from its very beginning; `None`: they do not.
    pub(crate) fn place(&self, d: &Dataset<'a>) -> Option<std::ops::Range<usize>> {
        let Layout::Contiguous(Some(address)) = d.layout else { return None };
        let bytes = d.bytes()?;
        self.slice(address, bytes).ok()?;
        let from = self.userblock + address as usize;
        Some(from..from + bytes as usize)
    }

    fn filled(&self, d: &Dataset<'a>, bytes: u64) -> Result<Vec<u8>> {
        self.claim(bytes)?;
        let mut all = vec![0; bytes as usize];
        if d.fill.len() as u64 == d.width && d.fill.iter().any(|&byte| byte != 0) {
            all.chunks_exact_mut(d.fill.len()).for_each(|x| x.copy_from_slice(d.fill));
        }
        Ok(all)
    }

    fn chunked(&self, d: &Dataset<'a>, chunked: &Chunked, bytes: u64) -> Result<Vec<u8>> {
        let mut all = self.filled(d, bytes)?;
        if bytes == 0 {
            return Ok(all);
        }
        let grid = Grid::new(&d.shape, &d.most, &chunked.shape, chunked.index)?;
        let whole = chunked.shape.iter().try_fold(d.width, |a, &b| a.checked_mul(b));
        let Some(whole) = whole.filter(|&n| n <= self.size().saturating_mul(EXPANSION)) else {
            let shape = &chunked.shape;
            return Err(Fault::Size(self.size(), format!("chunks of shape {shape:?}")));
        };
        self.chunks(chunked, &grid, !d.filters.is_empty(), whole, |chunk| {
            // Chunks may be left over from when the dataset was larger.
            if chunk.at.iter().zip(&grid.counts).any(|(k, n)| k >= n) {
                return Ok(());
            }
            let part = |k: usize| chunk.at[k] * chunked.shape[k];
            let cut = (0..d.shape.len()).any(|k| d.shape[k] - part(k) < chunked.shape[k]);
            let plain = d.filters.is_empty() || chunked.raw_edges && cut;
            let stored =
                self.slice(chunk.address, if plain { whole } else { chunk.size.unwrap_or(whole) })?;
            self.claim(whole)?;
            let data = match plain {
                true => Cow::Borrowed(stored),
                false => self.unfiltered(&d.filters, chunk.mask, stored, whole as usize)?,
            };
            if data.len() as u64 != whole {
                return damaged(format!("a chunk of {} bytes in place of {whole}", data.len()));
            }
            copy(&mut all, &d.shape, &data, &chunked.shape, chunk.at, d.width as usize);
            Ok(())
        })?;
        Ok(all)
    }

    /// A chunk as it was before the filters, the last of which is undone first.
    fn unfiltered(
        &self,
        filters: &[Filter],
        mask: u32,
        stored: &'a [u8],
        whole: usize,
    ) -> Result<Cow<'a, [u8]>> {
        let mut data = Cow::Borrowed(stored);
        // Checksums are made of what follows.
        let most = whole + 4 * filters.len();
        for (k, filter) in filters.iter().enumerate().rev() {
            if k < 32 && mask >> k & 1 != 0 {
                continue;
            }
            data = match filter.id {
                DEFLATE => {
                    let made = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(&data, most);
                    match made {
                        Ok(made) => Cow::Owned(made),
                        Err(_) => return damaged("a chunk that deflate did not make"),
                    }
                }
                SHUFFLE => {
                    let width = filter.values.first().map_or(1, |&w| w as usize);
                    Cow::Owned(unshuffled(&data, width))
                }
                FLETCHER32 => {
                    let Some((content, sum)) = data.split_last_chunk::<4>() else {
                        return damaged("a chunk without room for its checksum");
                    };
                    if fletcher32(content) != u32::from_le_bytes(*sum) && !FUZZING {
                        return damaged("a chunk with a wrong checksum");
                    }
                    let length = content.len();
                    match data {
                        Cow::Borrowed(data) => Cow::Borrowed(&data[..length]),
                        Cow::Owned(mut data) => {
                            data.truncate(length);
                            Cow::Owned(data)
                        }
                    }
                }
                LZF => Cow::Owned(lzf(&data, most)?),
                SCALEOFFSET => Cow::Owned(scaleoffset(&data, &filter.values, most)?),
                4 => return Err(Fault::Unsupported("the filter szip")),
                5 => return Err(Fault::Unsupported("the filter nbit")),
                32015 => return Err(Fault::Unsupported("the filter zstd")),
                32001 => return Err(Fault::Unsupported("the filter blosc")),
                _ => return Err(Fault::Unsupported("a filter that is not part of HDF5")),
            };
        }
        Ok(data)
    }

    /// All integers; what does not fit becomes the largest that does.
    pub(crate) fn ints(&self, d: &Dataset<'a>) -> Result<Vec<i64>> {
        let bytes = self.read(d)?;
        let Type::Int { big, signed, shift, bits } = d.kind else {
            return damaged(d.kind.name());
        };
        let cut = 64 - bits;
        let one = |x: &[u8]| {
            let x = word(x, big) >> shift << cut;
            if signed { x as i64 >> cut } else { i64::try_from(x >> cut).unwrap_or(i64::MAX) }
        };
        Ok(bytes.chunks_exact(d.width as usize).map(one).collect())
    }

    /// All reals, exactly, and integers rounded as they are in C.
    pub(crate) fn reals(&self, d: &Dataset<'a>) -> Result<Vec<f64>> {
        let bytes = self.read(d)?;
        let each = bytes.chunks_exact(d.width as usize);
        Ok(match d.kind {
            Type::Int { big, signed, shift, bits } => {
                let cut = 64 - bits;
                let one = |x: &[u8]| {
                    let x = word(x, big) >> shift << cut;
                    if signed { (x as i64 >> cut) as f64 } else { (x >> cut) as f64 }
                };
                each.map(one).collect()
            }
            Type::Real { big: false, sign: 63, exponent: (52, 11), mantissa: (0, 52), .. } => {
                each.map(|x| f64::from_bits(word(x, false))).collect()
            }
            Type::Real { big, sign, exponent, mantissa, bias } => {
                each.map(|x| real(word(x, big), sign, exponent, mantissa, bias)).collect()
            }
            other => return damaged(other.name()),
        })
    }

    /// The first text; without any, an empty one.
    pub(crate) fn text(&self, d: &Dataset<'a>) -> Result<Vec<u8>> {
        let bytes = self.read(d)?;
        if bytes.is_empty() {
            return Ok(vec![]);
        }
        let first = &bytes[..d.width as usize];
        let text = match d.kind {
            Type::VariableText => {
                let fault = || Fault::Damaged("a text that ends early".into());
                let a = self.widths.0;
                let (length, place) = first.split_at_checked(4).ok_or_else(fault)?;
                let (address, index) = place.split_at_checked(a).ok_or_else(fault)?;
                let length = word(length, false);
                if length == 0 {
                    return Ok(vec![]);
                }
                match self.global(word(address, false), word(index, false) as u32)? {
                    Some(object) => object.get(..length as usize).ok_or_else(fault)?,
                    None => return damaged("a text that is not where it is said to be"),
                }
            }
            Type::Text => first,
            other => return damaged(other.name()),
        };
        self.claim(text.len() as u64)?;
        let end = text.iter().position(|&c| c == 0).unwrap_or(text.len());
        Ok(text[..end].to_vec())
    }

    /// An attribute of the object at an address; `None`: there is none of that name, or its kind is not read here.
    pub(crate) fn attribute(&self, address: u64, name: &str) -> Result<Option<Dataset<'a>>> {
        let header = self.header(address)?;
        for message in header.all(header::ATTRIBUTE) {
            if let Ok(body) = self.body(message)
                && let Some(value) = self.named(body, name)
            {
                return Ok(Some(value));
            }
        }
        let mut found = None;
        if let Some(info) = header.first(header::ATTRIBUTE_INFO) {
            let mut c = self.over(info.body);
            c.version("attribute information", 0..=0)?;
            if c.u8()? & 1 != 0 {
                c.skip(2)?;
            }
            if let (Some(heap), Some(names)) = (c.address()?, c.address()?) {
                let heap = match super::heap::Heap::open(self, heap) {
                    Err(Fault::Unsupported(_)) => return Ok(None),
                    heap => heap?,
                };
                self.records(names, 8, |record| {
                    if record.len() >= 9 && found.is_none() && record[8] & 2 == 0 {
                        match heap.object(&record[..8]) {
                            Err(Fault::Unsupported(_)) => {}
                            object => found = self.named(object?, name),
                        }
                    }
                    Ok(())
                })?;
            }
        }
        Ok(found)
    }

    /// The attribute, if it has that name, with its values where they stand.
    fn named(&self, body: &'a [u8], wanted: &str) -> Option<Dataset<'a>> {
        let mut c = self.over(body);
        let version = c.version("an attribute", 1..=3).ok()?;
        let flags = c.u8().ok()?;
        let [name, kind, space] = [c.u16().ok()?, c.u16().ok()?, c.u16().ok()?].map(usize::from);
        if version == 3 {
            c.skip(1).ok()?;
        }
        let padded = |n: usize| if version == 1 { n.next_multiple_of(8) } else { n };
        let name = c.take(padded(name)).ok()?;
        let name = name.split(|&c| c == 0).next()?;
        if name != wanted.as_bytes() || version > 1 && flags & 3 != 0 {
            return None;
        }
        let (kind, width) = self.datatype(c.take(padded(kind)).ok()?).ok()?;
        let (shape, most) = self.dataspace(c.take(padded(space)).ok()?).ok()?;
        let layout = Layout::Compact(c.rest());
        Some(Dataset {
            kind,
            width,
            shape,
            most,
            layout,
            filters: vec![],
            fill: &[],
            references: 1,
        })
    }
}

/// A layout in chunks, if it fits the dataset.
fn chunked<'a>(
    shape: Vec<u64>,
    element: u64,
    rank: usize,
    width: u64,
    raw_edges: bool,
    index: Index,
    address: Option<u64>,
) -> Result<Layout<'a>> {
    if shape.len() != rank || rank == 0 || element != width || shape.contains(&0) {
        return damaged("chunks that do not fit their dataset");
    }
    Ok(Layout::Chunked(Chunked { shape, raw_edges, index, address }))
}

/// An unsigned integer of up to eight bytes.
fn word(bytes: &[u8], big: bool) -> u64 {
    let mut all = [0; 8];
    let n = bytes.len().min(8);
    if big {
        all[8 - n..].copy_from_slice(&bytes[..n]);
        return u64::from_be_bytes(all);
    }
    all[..n].copy_from_slice(&bytes[..n]);
    u64::from_le_bytes(all)
}

/// A real of IEEE's making with at most the digits and the range of a double.
fn real(
    x: u64,
    sign: u32,
    (e_at, e_bits): (u32, u32),
    (m_at, m_bits): (u32, u32),
    bias: u32,
) -> f64 {
    let field = |at: u32, bits: u32| x >> at & ((1 << bits) - 1);
    let (e, m) = (field(e_at, e_bits), field(m_at, m_bits));
    let negative = field(sign, 1) << 63;
    let fraction = m << (52 - m_bits);
    if e == (1 << e_bits) - 1 {
        return f64::from_bits(negative | 0x7ff << 52 | fraction);
    }
    if e > 0 {
        let e = e + 1023 - u64::from(bias);
        return f64::from_bits(negative | e << 52 | fraction);
    }
    // m 2^(1 - bias - m_bits): both factors and the product are exact, as no double has a larger bias.
    let shift = |k: u32| f64::from_bits(u64::from(1023 - k) << 52);
    let magnitude = m as f64 * shift(m_bits) * shift(bias - 1);
    if negative == 0 { magnitude } else { -magnitude }
}

/// Copies the part of a chunk that lies in the dataset, row by row.
fn copy(all: &mut [u8], shape: &[u64], data: &[u8], chunk: &[u64], at: &[u64], width: usize) {
    let rank = shape.len();
    let (shape, chunk): (Vec<usize>, Vec<usize>) =
        shape.iter().zip(chunk).map(|(&n, &c)| (n as usize, c as usize)).unzip();
    let first: Vec<usize> = at.iter().zip(&chunk).map(|(&k, c)| k as usize * c).collect();
    let count: Vec<usize> = (0..rank).map(|k| chunk[k].min(shape[k] - first[k])).collect();
    let mut row = vec![0; rank];
    loop {
        let place = |lengths: &[usize], offset: &[usize]| {
            (0..rank).fold(0, |sum, k| sum * lengths[k] + row[k] + offset[k])
        };
        let to = place(&shape, &first) * width;
        let from = place(&chunk, &vec![0; rank]) * width;
        let n = count[rank - 1] * width;
        all[to..to + n].copy_from_slice(&data[from..from + n]);
        let Some(next) = (0..rank - 1).rev().find(|&k| row[k] + 1 < count[k]) else { return };
        row[next] += 1;
        row[next + 1..].fill(0);
    }
}

/// First all first bytes, then all second ones, ...: put back. What remains at the end was not moved.
fn unshuffled(data: &[u8], width: usize) -> Vec<u8> {
    let mut out = data.to_vec();
    let count = data.len().checked_div(width).unwrap_or(0);
    if width > 1 && count > 1 {
        for byte in 0..width {
            for k in 0..count {
                out[k * width + byte] = data[byte * count + k];
            }
        }
    }
    out
}

/// Fletcher's checksum of words whose first byte is the higher, as HDF5 has it.
fn fletcher32(data: &[u8]) -> u32 {
    let (mut a, mut b) = (0_u32, 0_u32);
    let fold = |x: u32| (x & 0xffff) + (x >> 16);
    // So many words cannot overflow the sums.
    for part in data.chunks(720) {
        for pair in part.chunks(2) {
            let word = u32::from(pair[0]) << 8 | pair.get(1).map_or(0, |&low| low.into());
            a += word;
            b += a;
        }
        (a, b) = (fold(a), fold(b));
    }
    (a, b) = (fold(a), fold(b));
    b << 16 | a
}

/// LZF: runs of bytes as they are, and copies of what came before.
fn lzf(data: &[u8], most: usize) -> Result<Vec<u8>> {
    let fault = || Fault::Damaged("a chunk that LZF did not make".into());
    let mut out = vec![];
    let mut rest = data.iter().copied();
    while let Some(control) = rest.next() {
        let control = usize::from(control);
        if control < 32 {
            for _ in 0..=control {
                out.push(rest.next().ok_or_else(fault)?);
            }
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(rest.next().ok_or_else(fault)?);
            }
            let back = (control & 31) << 8 | usize::from(rest.next().ok_or_else(fault)?);
            let from = out.len().checked_sub(back + 1).ok_or_else(fault)?;
            for k in from..from + length + 2 {
                out.push(out[k]);
            }
        }
        if out.len() > most {
            return Err(fault());
        }
    }
    Ok(out)
}

/// Numbers as bits above the least: integers, or reals times a power of ten.
fn scaleoffset(data: &[u8], values: &[u32], most: usize) -> Result<Vec<u8>> {
    let fault = || Fault::Damaged("a chunk that scaleoffset did not make".into());
    let &[scale, factor, count, class, size, _, order, has_fill, ref fill @ ..] = values else {
        return Err(fault());
    };
    let (count, size) = (count as usize, size as usize);
    let bytes = count.checked_mul(size).filter(|&n| n <= most && (1..=8).contains(&size));
    let (bytes, head) = (bytes.ok_or_else(fault)?, data.get(..21).ok_or_else(fault)?);
    let (bits, packed) = (word(&head[..4], false), &data[21..]);
    let least = word(&head[5..5 + usize::from(head[4]).min(8)], false);
    let full = 8 * size as u64;
    if bits == full {
        return packed.get(..bytes).map(<[u8]>::to_vec).ok_or_else(fault);
    }
    if bits > full || (packed.len() as u64 * 8) / bits.max(1) < count as u64 && bits > 0 {
        return Err(fault());
    }
    // All bits set stand for the fill value, if there is one.
    let fill = (has_fill == 1).then(|| {
        let parts = fill.iter().take(2).enumerate();
        parts.fold(0, |sum, (k, &part)| sum | u64::from(part) << (32 * k))
    });
    let power = 10_f64.powi(factor as i32);
    let mut out = Vec::with_capacity(bytes);
    for k in 0..count as u64 {
        // The highest bit first.
        let bit = |at: u64| u64::from(packed[(at / 8) as usize] >> (7 - at % 8) & 1);
        let x = (k * bits..(k + 1) * bits).fold(0, |x, at| x << 1 | bit(at));
        let x = match (fill, class, scale, size) {
            (Some(fill), ..) if x == (1 << bits) - 1 => fill,
            (_, 0, 2, _) => x.wrapping_add(least),
            (_, 1, 0, 8) => (x as i64 as f64 / power + f64::from_bits(least)).to_bits(),
            (_, 1, 0, 4) => {
                let (x, least) = (x as u32 as i32 as f32, f32::from_bits(least as u32));
                u64::from((x / power as f32 + least).to_bits())
            }
            _ => return Err(Fault::Unsupported("this kind of the filter scaleoffset")),
        };
        match order {
            0 => out.extend_from_slice(&x.to_le_bytes()[..size]),
            _ => out.extend_from_slice(&x.to_be_bytes()[8 - size..]),
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_precision_is_exact() {
        let half = |x: u16| real(x.into(), 15, (10, 5), (0, 10), 15);
        assert_eq!(half(0x3c00), 1.0);
        assert_eq!(half(0xc000), -2.0);
        assert_eq!(half(0x7bff), 65504.0);
        assert_eq!(half(0x0001), 2_f64.powi(-24));
        assert_eq!(half(0x83ff), -1023.0 * 2_f64.powi(-24));
        assert_eq!(half(0x8000).to_bits(), (-0.0_f64).to_bits());
        assert_eq!(half(0x7c00), f64::INFINITY);
        assert!(half(0x7e00).is_nan());
    }

    #[test]
    fn reals_of_all_widths_are_those_of_the_processor() {
        let mut x = 0x1234_5678_9abc_def1_u64;
        for _ in 0..20_000 {
            x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // Half of them subnormal.
            for bits in [x, x & !(0x7ff << 52)] {
                let (double, single) = (f64::from_bits(bits), f32::from_bits((bits >> 32) as u32));
                let read = real(bits, 63, (52, 11), (0, 52), 1023);
                assert!(read.to_bits() == double.to_bits() || double.is_nan());
                let read = real(bits >> 32, 31, (23, 8), (0, 23), 127);
                assert!(read.to_bits() == f64::from(single).to_bits() || single.is_nan());
            }
        }
    }

    #[test]
    fn texts_that_were_packed_are_unpacked() {
        assert_eq!(lzf(b"\x02abc\x80\x02", 100).unwrap(), b"abcabcabc");
        assert!(lzf(b"\x20\x05", 100).is_err());
        assert!(lzf(b"\x05ab", 100).is_err());
        assert_eq!(fletcher32(b"abcde"), 0x4ff0_29c7);
        assert_eq!(unshuffled(b"acebdfg", 2), b"abcdefg");
    }
}
