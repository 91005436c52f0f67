//! Robots and scenes of other programs as scenes of `simulate`.

use std::path::Path;

use nonsmooth_io::siconos::MechanicsScene;
use nonsmooth_simulate::SimulateError;
use nonsmooth_simulate::import::{Imported, mjcf, urdf};

use super::Args;
use crate::report::row;
use crate::{Exit, files, output};

/// A format that scenes are made of.
pub struct Origin {
    name: &'static str,
    read: fn(&Path) -> Result<Imported, String>,
}

/// The format of a file by its name, if scenes are made of it.
pub fn origin(from: &Path) -> Option<&'static Origin> {
    const URDF: Origin = Origin { name: "URDF", read: |from| text(from, |text, _| urdf(text)) };
    const MJCF: Origin = Origin { name: "MJCF", read: |from| text(from, mjcf) };
    const SICONOS: Origin =
        Origin { name: "Siconos' mechanics HDF5", read: super::mechanics::read };
    let extension = from.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "urdf" => Some(&URDF),
        "xml" | "mjcf" => Some(&MJCF),
        "h5" | "hdf5" if holds_mechanics(from) => Some(&SICONOS),
        _ => None,
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
    let made = (origin.read)(from)?;
    made.warnings.iter().for_each(|w| output::remark(&format!("warning: {w}\n")));
    if stream {
        output::print(&made.scene);
        return Ok(Exit::Solved);
    }
    files::write_text("TO", to, &made.scene)?;
    let mut said = format!("{target}: a scene for `nonsmooth simulate`\n");
    row(&mut said, "from", format!("{name} ({})", origin.name));
    output::print(&said);
    Ok(Exit::Solved)
}
