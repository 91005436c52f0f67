//! Groups of HDF5 files by name, whatever they hold: errors that name the place.

use std::fmt::Display;
use std::path::Path;

use hdf5_pure::{CharacterSet, Datatype, Error, GroupBuilder, StringPadding};

use crate::IoError;
use crate::hdf5::{self, Dataset, Fault, File, Group, Object, Type};
use crate::replace::WRITABLE;

/// The HDF5 file in those bytes.
pub(crate) fn open<'a>(path: &Path, bytes: &'a [u8]) -> Result<File<'a>, IoError> {
    if !hdf5::is_hdf5(bytes) {
        let found = if bytes.is_empty() { "an empty file" } else { "other data" };
        return Err(IoError::NotHdf5 { file: path.into(), found });
    }
    File::new(bytes).map_err(|e| fault(path, "/", e))
}

/// What keeps a part of a file from being read, as an error that names the part.
pub(crate) fn fault(file: &Path, place: &str, fault: Fault) -> IoError {
    match fault {
        Fault::Damaged(found) => IoError::hdf5(file, place, found),
        Fault::Unsupported(what) => {
            IoError::Unsupported { file: file.into(), place: place.into(), what }
        }
        Fault::Dangling(found) => {
            IoError::data(file, place, "a soft link that leads somewhere", found)
        }
        Fault::Size(size, found) => {
            let expected = format!("data that fit in the {size} bytes of the file");
            IoError::data(file, place, expected, found)
        }
    }
}

fn name_of(object: &Object) -> &'static str {
    match object {
        Object::Group(_) => "a group",
        Object::Dataset(_) => "a dataset",
        Object::Other => "something else",
    }
}

/// The leading entries of a dataset that count; what follows them may be anything.
#[derive(Clone, Copy)]
pub(crate) struct Used<'a> {
    pub entries: u64,
    /// What says so.
    pub why: &'a str,
    /// How many entries there are where there are more; any number without it.
    pub room: Option<i64>,
}

/// A group of the file, with what messages about its members need.
///
/// Members are opened by name, so that those that do not matter cannot do harm.
pub(crate) struct Folder<'f, 'a> {
    pub file: &'f Path,
    pub data: &'f File<'a>,
    /// Empty for the root.
    pub path: String,
    pub group: Group<'a>,
}

impl<'f, 'a> Folder<'f, 'a> {
    pub(crate) fn root(file: &'f Path, data: &'f File<'a>) -> Result<Self, IoError> {
        let group = data.root().map_err(|e| fault(file, "/", e))?;
        Ok(Self { file, data, path: String::new(), group })
    }

    pub(crate) fn place(&self, name: impl Display) -> String {
        format!("{}/{name}", self.path)
    }

    pub(crate) fn error(
        &self,
        name: impl Display,
        expected: impl Into<String>,
        found: impl Display,
    ) -> IoError {
        IoError::data(self.file, self.place(name), expected, found)
    }

    pub(crate) fn fault(&self, name: &str) -> impl Fn(Fault) -> IoError {
        move |e| fault(self.file, &self.place(name), e)
    }

    pub(crate) fn find(&self, name: &str) -> Result<Option<Object<'a>>, IoError> {
        self.data.find(&self.group, name).map_err(self.fault(name))
    }

    pub(crate) fn has(&self, name: &str) -> Result<bool, IoError> {
        Ok(self.find(name)?.is_some())
    }

    /// The group `name`, if there is one.
    pub(crate) fn folder(&self, name: &str) -> Result<Option<Folder<'f, 'a>>, IoError> {
        match self.find(name)? {
            None => Ok(None),
            Some(Object::Group(group)) => {
                let path = self.place(name);
                Ok(Some(Folder { file: self.file, data: self.data, path, group }))
            }
            Some(other) => Err(self.error(name, "a group", name_of(&other))),
        }
    }

    /// The group `name`.
    pub(crate) fn need(&self, name: &str) -> Result<Folder<'f, 'a>, IoError> {
        self.folder(name)?.ok_or_else(|| self.error(name, "a group", "nothing of that name"))
    }

    pub(crate) fn dataset(&self, name: &str) -> Result<Dataset<'a>, IoError> {
        match self.find(name)? {
            Some(Object::Dataset(dataset)) => Ok(dataset),
            other => {
                let found = other.as_ref().map_or("nothing of that name", name_of);
                Err(self.error(name, "a dataset", found))
            }
        }
    }

    /// Integers: those `used`, or all. Reals that are whole numbers will do.
    pub(crate) fn ints(&self, name: &str, used: Option<Used>) -> Result<Vec<i64>, IoError> {
        let dataset = self.dataset(name)?;
        match dataset.kind {
            // What does not fit is too large for any use here; the range checks say so.
            Type::Int { .. } => self.used(name, self.data.ints(&dataset), used),
            Type::Real { .. } => {
                // The first real beyond i64, exactly.
                const END: f64 = -(i64::MIN as f64);
                let whole = |(k, x): (usize, f64)| {
                    // Not so for NaN and infinities either.
                    if x.fract() == 0.0 && (-END..END).contains(&x) {
                        Ok(x as i64)
                    } else {
                        let place = format_args!("{name}[{k}]");
                        Err(self.error(place, "a whole number of at most 64 bits", x))
                    }
                };
                let x = self.used(name, self.data.reals(&dataset), used)?;
                x.into_iter().enumerate().map(whole).collect()
            }
            other => Err(self.error(name, "integers", other.name())),
        }
    }

    pub(crate) fn int(&self, name: &str) -> Result<i64, IoError> {
        match self.ints(name, None)?[..] {
            [x] => Ok(x),
            ref x => Err(self.error(name, "one integer", format!("{} entries", x.len()))),
        }
    }

    /// Finite reals: those `used`, or all. Integers will do; the widest round as they do in C.
    pub(crate) fn reals(&self, name: &str, used: Option<Used>) -> Result<Vec<f64>, IoError> {
        let dataset = self.dataset(name)?;
        match dataset.kind {
            Type::Int { .. } | Type::Real { .. } => {
                let x = self.used(name, self.data.reals(&dataset), used)?;
                check_finite(self.file, &self.place(name), &x)?;
                Ok(x)
            }
            other => Err(self.error(name, "reals", other.name())),
        }
    }

    /// The values that count, out of all.
    pub(crate) fn used<T>(
        &self,
        name: &str,
        values: Result<Vec<T>, Fault>,
        used: Option<Used>,
    ) -> Result<Vec<T>, IoError> {
        let mut values = values.map_err(self.fault(name))?;
        if let Some(Used { entries, why, room }) = used {
            let found = values.len();
            let more = room.is_none_or(|room| usize::try_from(room) == Ok(found));
            match usize::try_from(entries) {
                Ok(entries) if entries == found || entries < found && more => {
                    values.truncate(entries);
                }
                _ => {
                    let expected = format!("{entries} entries ({why})");
                    return Err(self.error(name, expected, format!("{found} entries")));
                }
            }
        }
        Ok(values)
    }

    /// A text that is there or not; bytes that are no UTF-8 are replaced, as it is only for people.
    pub(crate) fn text(&self, name: &str) -> Result<Option<String>, IoError> {
        if !self.has(name)? {
            return Ok(None);
        }
        let dataset = self.dataset(name)?;
        match dataset.kind {
            Type::Text | Type::VariableText => {
                let bytes = self.data.text(&dataset).map_err(self.fault(name))?;
                Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
            }
            other => Err(self.error(name, "a text", other.name())),
        }
    }
}

/// All entries are finite.
pub(crate) fn check_finite(file: &Path, place: &str, x: &[f64]) -> Result<(), IoError> {
    match x.iter().position(|v| !v.is_finite()) {
        Some(k) => Err(IoError::data(file, format!("{place}[{k}]"), "a finite number", x[k])),
        None => Ok(()),
    }
}

/// What the builder of a file reports.
pub(crate) fn failed(path: &Path, e: Error) -> IoError {
    match e {
        Error::Io(e) => IoError::os(path, WRITABLE, e),
        e => IoError::hdf5(path, "/", e),
    }
}

/// A group under construction, with what messages about its members need.
pub(crate) struct Out<'a> {
    pub file: &'a Path,
    pub path: String,
    pub group: GroupBuilder,
}

impl Out<'_> {
    pub(crate) fn child(
        &mut self,
        name: &str,
        fill: impl FnOnce(&mut Out) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let group = self.group.create_group(name);
        let mut child = Out { file: self.file, path: format!("{}/{name}", self.path), group };
        fill(&mut child)?;
        self.group.add_group(child.group.finish());
        Ok(())
    }

    /// A C int, which is what FCLIB has for sizes and indices.
    pub(crate) fn as_int(&self, name: impl Display, x: usize) -> Result<i32, IoError> {
        let place = || format!("{}/{name}", self.path);
        let expected = || format!("at most {} (a C int)", i32::MAX);
        i32::try_from(x).map_err(|_| IoError::data(self.file, place(), expected(), x))
    }

    pub(crate) fn int(&mut self, name: &str, x: usize) -> Result<(), IoError> {
        let x = self.as_int(name, x)?;
        self.group.create_dataset(name).with_i32_data(&[x]);
        Ok(())
    }

    pub(crate) fn reals(&mut self, name: &str, x: &[f64]) {
        self.group.create_dataset(name).with_f64_data(x);
    }

    /// A scalar string with the terminating NUL that C readers allocate by.
    pub(crate) fn text(&mut self, name: &str, text: &str) -> Result<(), IoError> {
        let place = format!("{}/{name}", self.path);
        if text.contains('\0') {
            let expected = "a text without NUL characters";
            return Err(IoError::data(self.file, place, expected, "one with"));
        }
        let size = self.as_int(name, text.len() + 1)? as u32;
        let charset = if text.is_ascii() { CharacterSet::Ascii } else { CharacterSet::Utf8 };
        let datatype = Datatype::String { size, padding: StringPadding::NullTerminate, charset };
        let bytes = [text.as_bytes(), b"\0"].concat();
        self.group.create_dataset(name).with_raw_data(datatype, bytes, 1).with_shape(&[]);
        Ok(())
    }
}
