//! What bodies look like, for formats that know polygons only.

use std::path::Path;

use crate::IoError;
use crate::trajectory::{State, Trajectory};

/// Faces about vertices in the frame of a body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// m.
    pub vertices: Vec<[f64; 3]>,
    /// By indices of vertices, counter-clockwise seen from outside, at least three each.
    pub faces: Vec<Vec<usize>>,
    /// Whether it stands for a round surface, so that its edges are to be shaded away.
    pub smooth: bool,
}

/// Checks that there are meshes for each body, and that their faces have corners.
pub(crate) fn check(
    path: &Path,
    trajectory: &Trajectory,
    meshes: &[Vec<Mesh>],
) -> Result<(), IoError> {
    let bodies = trajectory.bodies.len();
    if meshes.len() != bodies {
        let expected = format!("one list for each of {bodies} bodies");
        return Err(IoError::data(path, "meshes", expected, meshes.len()));
    }
    let frame = |f: &&crate::trajectory::Frame| f.bodies.len() != bodies;
    if let Some(frame) = trajectory.frames.iter().find(frame) {
        let place = format!("frame of step {}", frame.step);
        return Err(IoError::data(path, place, format!("{bodies} bodies"), frame.bodies.len()));
    }
    for (k, mesh) in meshes.iter().enumerate().flat_map(|(k, all)| all.iter().map(move |m| (k, m)))
    {
        let n = mesh.vertices.len();
        let bad = |face: &&Vec<usize>| face.len() < 3 || face.iter().any(|&v| v >= n);
        if let Some(face) = mesh.faces.iter().find(bad) {
            let expected = format!("faces of at least 3 of {n} vertices");
            return Err(IoError::data(path, format!("meshes[{k}]"), expected, format!("{face:?}")));
        }
    }
    Ok(())
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i] * b[j] - a[j] * b[i]
    })
}

impl State {
    /// A vector of the body's frame in that of the world.
    pub(crate) fn turned(&self, x: [f64; 3]) -> [f64; 3] {
        let [w, q @ ..] = self.rotation;
        rotated(w, q, x)
    }

    /// A vector of the world in the body's frame.
    pub(crate) fn turned_back(&self, x: [f64; 3]) -> [f64; 3] {
        let [w, q @ ..] = self.rotation;
        rotated(w, q.map(|c| -c), x)
    }
}

/// `x + 2 q × (q × x + w x)`.
fn rotated(w: f64, q: [f64; 3], x: [f64; 3]) -> [f64; 3] {
    let t = cross(q, x);
    let s = cross(q, std::array::from_fn(|k| t[k] + w * x[k]));
    std::array::from_fn(|k| x[k] + 2.0 * s[k])
}
