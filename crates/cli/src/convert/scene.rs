//! Robots and scenes of other programs as scenes of `simulate`.

use nonsmooth_record::Origin;

use super::Args;
use crate::report::row;
use crate::{Exit, files, output};

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
    files::apart([from.as_path()], [("TO", to.as_path())])?;
    files::writable_or_stream("TO", to)?;
    let made = origin.read(from).map_err(|e| e.to_string())?;
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
