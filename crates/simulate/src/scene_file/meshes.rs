//! Meshes in files beside the scene: STL and OBJ.

use std::io::{BufReader, Cursor};
use std::path::Path;

use super::{SceneFile, ShapeOrName, ShapeTable};
use crate::SimulateError;
use crate::error::require;

/// Vertices and triangles of a file.
type Faces = (Vec<[f64; 3]>, Vec<[usize; 3]>);

impl SceneFile {
    /// Puts the meshes that shapes name as files, relative to `folder`, into the scene, so that it is complete without them.
    ///
    /// Errors: a file that cannot be read, or is no mesh, by the place that names it.
    pub fn load_meshes(&mut self, folder: &Path) -> Result<(), SimulateError> {
        for (k, named) in self.shapes.iter_mut().enumerate() {
            load(&mut named.shape, folder, &format!("shapes[{k}]"))?;
        }
        for (k, body) in self.bodies.iter_mut().enumerate() {
            if let Some(ShapeOrName::Shape(shape)) = &mut body.shape {
                load(shape, folder, &format!("bodies[{k}].shape"))?;
            }
            for (i, part) in body.shapes.iter_mut().enumerate() {
                if let ShapeOrName::Shape(shape) = &mut part.shape {
                    load(shape, folder, &format!("bodies[{k}].shapes[{i}].shape"))?;
                }
            }
        }
        Ok(())
    }
}

/// Puts the mesh of a file into a shape that names one; `key` is for messages.
pub(crate) fn load(shape: &mut ShapeTable, folder: &Path, key: &str) -> Result<(), SimulateError> {
    let ShapeTable::Mesh { file, scale, vertices, triangles } = shape else { return Ok(()) };
    let Some(name) = file else { return Ok(()) };
    if !vertices.is_empty() || !triangles.is_empty() {
        let expected = "either a file or vertices with triangles";
        return Err(SimulateError::value(format!("{key}.file"), expected, "both"));
    }
    let by = scale.unwrap_or(1.0);
    require(|| format!("{key}.scale"), by, by > 0.0, "a positive number")?;
    let wrong = |expected: &str, found: String| {
        SimulateError::value(format!("{key}.file"), expected, format!("`{name}`: {found}"))
    };
    let bytes =
        std::fs::read(folder.join(&*name)).map_err(|e| wrong("a readable file", e.to_string()))?;
    let extension = Path::new(&*name).extension().and_then(|e| e.to_str()).unwrap_or("");
    let read = match extension.to_ascii_lowercase().as_str() {
        "stl" => stl(&bytes),
        "obj" => obj(&bytes),
        other => Err(format!("a name that ends in .{other}")),
    };
    let (points, faces) = read.map_err(|found| wrong("a mesh as .stl or .obj", found))?;
    *vertices = points.into_iter().map(|v| v.map(|x| by * x)).collect();
    (*triangles, *file, *scale) = (faces, None, None);
    Ok(())
}

/// Bytes before the triangles of a binary STL file, and of each triangle.
const STL: (usize, usize) = (84, 50);

fn stl(bytes: &[u8]) -> Result<Faces, String> {
    // A binary file says how many triangles it has: the reader takes its word for it.
    if !bytes.starts_with(b"solid") {
        let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let needed = count.map(|n| STL.0 + STL.1 * n as usize);
        if needed.is_none_or(|needed| bytes.len() < needed) {
            return Err(format!("{} bytes, too few for its triangles", bytes.len()));
        }
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| one_line(&e.to_string()))?;
    let vertices = mesh.vertices.iter().map(|v| v.0.map(f64::from)).collect();
    Ok((vertices, mesh.faces.iter().map(|f| f.vertices).collect()))
}

fn obj(bytes: &[u8]) -> Result<Faces, String> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let no_material = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut BufReader::new(bytes), &options, no_material)
        .map_err(|e| one_line(&e.to_string()))?;
    let (mut vertices, mut triangles) = (vec![], vec![]);
    for model in &models {
        let first = vertices.len();
        let (points, _) = model.mesh.positions.as_chunks::<3>();
        vertices.extend_from_slice(points);
        let (corners, _) = model.mesh.indices.as_chunks::<3>();
        triangles.extend(corners.iter().map(|t| t.map(|k| first + k as usize)));
    }
    Ok((vertices, triangles))
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}
