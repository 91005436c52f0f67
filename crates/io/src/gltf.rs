//! Runs as binary glTF 2.0 (`.glb`): opens in Blender, in browsers, and where else pictures in space are looked at.
//!
//! A node for each body, with its name, and animation channels `translation` and `rotation` with linear interpolation; bodies of the same shape share a mesh.
//! Faces have flat normals, those of round surfaces smooth ones. glTF's vertical is the y axis, ours the third: the root node turns it.
//!
//! Reference: The Khronos Group, *glTF 2.0 Specification*.

use std::path::Path;

use serde_json::{Value, json};

use crate::IoError;
use crate::format::put;
use crate::mesh::{Mesh, check, cross};
use crate::trajectory::{State, Trajectory};

/// Colours of bodies by turns, and last that of fixed ones; linear.
const COLOURS: [[f64; 3]; 4] =
    [[0.67, 0.6, 0.48], [0.61, 0.53, 0.41], [0.72, 0.66, 0.55], [0.3, 0.34, 0.38]];

const FLOAT: u32 = 5126;
const UNSIGNED: u32 = 5125;

/// Writes the file. Costs 28 bytes of a body that moves and frame.
///
/// Errors: what the system refuses; meshes that do not fit the bodies; no frame; numbers that are not finite; more than 4 GiB.
pub fn write(path: &Path, trajectory: &Trajectory, meshes: &[Vec<Mesh>]) -> Result<(), IoError> {
    check(path, trajectory, meshes)?;
    put(path, &bytes(path, trajectory, meshes)?)
}

fn bytes(path: &Path, trajectory: &Trajectory, meshes: &[Vec<Mesh>]) -> Result<Vec<u8>, IoError> {
    let Some(start) = trajectory.frames.first() else {
        return Err(IoError::data(path, "frames", "at least one", "none"));
    };
    let mut binary = Binary::default();
    // Times begin at zero and rise, also in single precision.
    let mut shown: Vec<(f32, &[State])> = vec![];
    for frame in &trajectory.frames {
        let time = (frame.time - start.time) as f32;
        if shown.last().is_none_or(|last| time > last.0) {
            shown.push((time, &frame.bodies));
        }
    }
    for (time, states) in &shown {
        let bad = |s: &&State| !s.position.iter().chain(&s.rotation).all(|x| x.is_finite());
        if let Some(state) = states.iter().find(bad) {
            let place = format!("frame at {time} s");
            return Err(IoError::data(path, place, "finite numbers", format!("{state:?}")));
        }
    }
    let mut known: Vec<(&[Mesh], usize)> = vec![];
    let (mut shapes, mut nodes) = (vec![], vec![]);
    let (mut samplers, mut channels) = (vec![], vec![]);
    let times = (shown.len() > 1)
        .then(|| binary.floats("SCALAR", shown.iter().map(|frame| [frame.0]), true));
    let named = trajectory.bodies.iter().zip(meshes).zip(&start.bodies);
    for (k, ((body, meshes), state)) in named.enumerate() {
        let colour = if body.fixed { COLOURS.len() - 1 } else { k % (COLOURS.len() - 1) };
        let name = if body.name.is_empty() { format!("body {k}") } else { body.name.clone() };
        let mut node = json!({
            "name": name, "translation": single(state.position), "rotation": single(turn(state)),
        });
        // A mesh without a face would be an accessor without an entry.
        let solid = |mesh: &&Mesh| !mesh.faces.is_empty();
        if meshes.iter().any(|mesh| solid(&mesh)) {
            let same = |other: &(&[Mesh], usize)| *other == (&meshes[..], colour);
            let shape = known.iter().position(same).unwrap_or_else(|| {
                known.push((meshes, colour));
                let primitives: Vec<Value> = meshes
                    .iter()
                    .filter(solid)
                    .map(|mesh| primitive(&mut binary, mesh, colour))
                    .collect();
                shapes.push(json!({ "primitives": primitives }));
                shapes.len() - 1
            });
            node["mesh"] = json!(shape);
        }
        nodes.push(node);
        let of = || shown.iter().map(|(_, states)| &states[k]);
        let moves = of().any(|s| (s.position, s.rotation) != (state.position, state.rotation));
        let Some(times) = times.filter(|_| moves) else { continue };
        let translation = binary.floats("VEC3", of().map(|s| single(s.position)), false);
        let rotation = binary.floats("VEC4", of().map(|s| single(turn(s))), false);
        for (what, output) in [("translation", translation), ("rotation", rotation)] {
            channels.push(json!({"sampler": samplers.len(), "target": {"node": k, "path": what}}));
            samplers.push(json!({"input": times, "output": output, "interpolation": "LINEAR"}));
        }
    }
    let children: Vec<usize> = (0..nodes.len()).collect();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    nodes.push(json!({"name": "world", "rotation": [-half, 0.0, 0.0, half], "children": children}));
    let material = |[r, g, b]: [f64; 3]| {
        json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8,
            },
            "doubleSided": true,
        })
    };
    let mut all = json!({
        "asset": {"version": "2.0", "generator": trajectory.program},
        "scene": 0,
        "scenes": [{"nodes": [nodes.len() - 1]}],
        "nodes": nodes,
        "materials": COLOURS.map(material),
    });
    if !shapes.is_empty() {
        all["meshes"] = json!(shapes);
    }
    if !channels.is_empty() {
        all["animations"] = json!([{"name": "run", "samplers": samplers, "channels": channels}]);
    }
    if !binary.bytes.is_empty() {
        all["accessors"] = json!(binary.accessors);
        all["bufferViews"] = json!(binary.views);
        all["buffers"] = json!([{"byteLength": binary.bytes.len()}]);
    }
    let mut text = all.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    container(path, &text, &binary.bytes)
}

/// The header, the chunk of JSON, and that of numbers if there are any.
fn container(path: &Path, text: &[u8], numbers: &[u8]) -> Result<Vec<u8>, IoError> {
    let chunks = [(*b"JSON", text), (*b"BIN\0", numbers)];
    let chunks: Vec<_> = chunks.into_iter().filter(|(_, bytes)| !bytes.is_empty()).collect();
    let length = 12 + chunks.iter().map(|(_, bytes)| 8 + bytes.len()).sum::<usize>();
    let Ok(size) = u32::try_from(length) else {
        let expected = format!("at most {} bytes", u32::MAX);
        return Err(IoError::data(path, "size", expected, length));
    };
    let mut out = Vec::with_capacity(length);
    out.extend(*b"glTF");
    out.extend(2_u32.to_le_bytes());
    out.extend(size.to_le_bytes());
    for (kind, bytes) in chunks {
        out.extend((bytes.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(bytes);
    }
    Ok(out)
}

fn single<const D: usize>(x: [f64; D]) -> [f32; D] {
    x.map(|x| x as f32)
}

/// The rotation as glTF has it: w last, of unit length.
fn turn(state: &State) -> [f64; 4] {
    let [w, x, y, z] = state.rotation;
    let length = (w * w + x * x + y * y + z * z).sqrt();
    if length > 0.0 { [x, y, z, w].map(|c| c / length) } else { [0.0, 0.0, 0.0, 1.0] }
}

/// A mesh as triangles with normals.
fn primitive(binary: &mut Binary, mesh: &Mesh, colour: usize) -> Value {
    let (mut points, mut normals, mut corners) = (vec![], vec![], vec![]);
    // The normals of faces by their vectors of area (Newell), which also weight the mean at a vertex.
    let area = |face: &[usize]| {
        let mut sum = [0.0; 3];
        for (k, &from) in face.iter().enumerate() {
            let to = face[(k + 1) % face.len()];
            let part = cross(mesh.vertices[from], mesh.vertices[to]);
            sum = std::array::from_fn(|d| sum[d] + part[d]);
        }
        sum
    };
    if mesh.smooth {
        points.extend(mesh.vertices.iter().map(|&v| single(v)));
        normals.resize(points.len(), [0.0; 3]);
        for face in &mesh.faces {
            let area = area(face);
            for &v in face {
                normals[v] = std::array::from_fn(|d| normals[v][d] + area[d]);
            }
        }
    }
    for face in &mesh.faces {
        let first = points.len();
        if !mesh.smooth {
            points.extend(face.iter().map(|&v| single(mesh.vertices[v])));
            normals.resize(points.len(), area(face));
        }
        for k in 1..face.len() - 1 {
            let corner = |i: usize| (if mesh.smooth { face[i] } else { first + i }) as u32;
            corners.extend([0, k, k + 1].map(corner));
        }
    }
    let unit = |n: [f64; 3]| {
        let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        single(if length > 0.0 { n.map(|x| x / length) } else { [0.0, 0.0, 1.0] })
    };
    let position = binary.floats("VEC3", points.iter().copied(), true);
    let normal = binary.floats("VEC3", normals.into_iter().map(unit), false);
    let indices = binary.push(
        "SCALAR",
        UNSIGNED,
        corners.len(),
        corners.iter().flat_map(|c| c.to_le_bytes()),
    );
    json!({
        "attributes": {"POSITION": position, "NORMAL": normal}, "indices": indices, "material": colour,
    })
}

/// Numbers, with what says where they are.
#[derive(Default)]
struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    /// The number of the accessor that tells of them.
    fn push(
        &mut self,
        kind: &str,
        component: u32,
        count: usize,
        bytes: impl Iterator<Item = u8>,
    ) -> usize {
        let from = self.bytes.len();
        self.bytes.extend(bytes);
        self.views
            .push(json!({"buffer": 0, "byteOffset": from, "byteLength": self.bytes.len() - from}));
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": component, "count": count, "type": kind,
        }));
        self.accessors.len() - 1
    }

    fn floats<const D: usize>(
        &mut self,
        kind: &str,
        x: impl Iterator<Item = [f32; D]> + Clone,
        bounded: bool,
    ) -> usize {
        let count = x.clone().count();
        let at = self.push(kind, FLOAT, count, x.clone().flatten().flat_map(f32::to_le_bytes));
        if bounded {
            let of = |start: f32, choose: fn(f32, f32) -> f32| {
                let bound = |d: usize| x.clone().map(|x| x[d]).fold(start, choose);
                std::array::from_fn::<f32, D, _>(bound).to_vec()
            };
            self.accessors[at]["min"] = json!(of(f32::INFINITY, f32::min));
            self.accessors[at]["max"] = json!(of(f32::NEG_INFINITY, f32::max));
        }
        at
    }
}
