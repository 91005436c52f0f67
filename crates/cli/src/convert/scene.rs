//! Robots and scenes of other programs as scenes of `simulate`.

use std::path::Path;

use nonsmooth_io::siconos::MechanicsScene;
use nonsmooth_simulate::SimulateError;
use nonsmooth_simulate::import::{self, Format, Imported};

use super::Args;
use crate::report::row;
use crate::{Exit, files, output};

/// A format that scenes are made of.
pub enum Origin {
    /// A text.
    Text(Format),
    /// Siconos' mechanics HDF5.
    Mechanics,
}

/// The format of a file by its name, if scenes are made of it.
pub fn origin(from: &Path) -> Option<Origin> {
    if let Some(format) = import::format(from) {
        return Some(Origin::Text(format));
    }
    let extension = from.extension()?.to_str()?.to_ascii_lowercase();
    let holds = matches!(extension.as_str(), "h5" | "hdf5") && holds_mechanics(from);
    holds.then_some(Origin::Mechanics)
}

impl Origin {
    fn name(&self) -> &'static str {
        match self {
            Self::Text(format) => format.name,
            Self::Mechanics => "Siconos' mechanics HDF5",
        }
    }

    fn read(&self, from: &Path) -> Result<Imported, String> {
        match self {
            Self::Text(format) => text(from, format.read),
            Self::Mechanics => super::mechanics::read(from),
        }
    }
}

fn holds_mechanics(from: &Path) -> bool {
    std::fs::read(from).is_ok_and(|bytes| MechanicsScene::holds(&bytes))
}

fn text(
    from: &Path,
    read: impl FnOnce(&str, &Path) -> Result<Imported, SimulateError>,
) -> Result<Imported, String> {
    let name = from.display();
    let text = std::fs::read_to_string(from)
        .map_err(|e| format!("{name}: expected a readable file, found: {e}"))?;
    read(&text, from.parent().unwrap_or(Path::new(""))).map_err(|e| format!("{name}: {e}"))
}

/// Writes the scene that a file of another format describes.
pub fn write(Args { from, to, format, as_mcp }: &Args, origin: &Origin) -> Result<Exit, String> {
    let (name, target) = (from.display(), to.display());
    if format.is_some() || *as_mcp {
        return Err(format!("{name}: it becomes a scene: expected neither --format nor --as-mcp"));
    }
    let stream = files::is_stream(to);
    if !stream && to.extension().is_none_or(|e| e != "toml") {
        return Err(format!("{target}: expected a name that ends in .toml, for a scene"));
    }
    files::writable("TO", to)?;
    let made = origin.read(from)?;
    made.warnings.iter().for_each(|w| output::remark(&format!("warning: {w}\n")));
    if stream {
        output::print(&made.scene);
        return Ok(Exit::Solved);
    }
    files::write_text("TO", to, &made.scene)?;
    let mut said = format!("{target}: a scene for `nonsmooth simulate`\n");
    row(&mut said, "from", format!("{name} ({})", origin.name()));
    output::print(&said);
    Ok(Exit::Solved)
}
