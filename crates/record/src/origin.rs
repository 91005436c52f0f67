//! Files of other programs that scenes are made of: robots as text, and Siconos' mechanics HDF5.

use std::path::Path;

use nonsmooth_io::siconos::MechanicsScene;
use nonsmooth_simulate::import::{self, Format, Imported};

use crate::mechanics;

/// Why a file gives no scene, in a sentence that begins with its name.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct OriginError(pub(crate) String);

/// A format that scenes are made of.
#[derive(Debug, Clone, Copy)]
pub enum Origin {
    /// A text.
    Text(Format),
    /// Siconos' mechanics HDF5.
    Mechanics,
}

impl Origin {
    /// The format of a file, if scenes are made of it: by its name, and of HDF5 by what it holds, for which it is read.
    pub fn of(file: &Path) -> Option<Self> {
        if let Some(format) = import::format(file) {
            return Some(Self::Text(format));
        }
        let extension = file.extension()?.to_str()?.to_ascii_lowercase();
        let holds = || std::fs::read(file).is_ok_and(|bytes| MechanicsScene::holds(&bytes));
        (matches!(extension.as_str(), "h5" | "hdf5") && holds()).then_some(Self::Mechanics)
    }

    /// What it is called.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Text(format) => format.name,
            Self::Mechanics => "Siconos' mechanics HDF5",
        }
    }

    /// The scene of a file, TOML, and what is to be said of it.
    ///
    /// Errors: a file that cannot be read, or says what no scene can.
    pub fn read(&self, file: &Path) -> Result<Imported, OriginError> {
        let name = file.display();
        match self {
            Self::Text(format) => {
                let text = std::fs::read_to_string(file).map_err(|e| {
                    OriginError(format!("{name}: expected a readable file, found: {e}"))
                })?;
                let folder = file.parent().unwrap_or(Path::new(""));
                (format.read)(&text, folder).map_err(|e| OriginError(format!("{name}: {e}")))
            }
            Self::Mechanics => mechanics::read(file).map_err(OriginError),
        }
    }
}
