//! Runs for ParaView: VTK's XML, one collection (`.pvd`) of the bodies and contacts of each frame (`.vtp`).
//!
//! `run.pvd` names `run/bodies-000000.vtp` and `run/contacts-000000.vtp`, one of each a frame, with the frames' times. Bodies are polygons where they are,
//! with the cell fields `body` (its number) and `fixed`, and the point field `velocity`. Contacts are points with the fields `r` (impulse on the second body) and
//! `u` (relative velocity), both in the frame of the world, `gap`, `bodies` (the two numbers) and `status`: 0 took no part, 1 open, 2 stick, 3 slip.
//! Numbers are base64 of 32 bits: enough to look at; all digits are in the [trajectory](crate::trajectory).
//!
//! Reference: Kitware, *VTK File Formats for VTK Version 4.2*, "XML File Formats".

use std::fmt::Write;
use std::path::Path;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::IoError;
use crate::format::put;
use crate::mesh::{Mesh, check, cross};
use crate::replace::WRITABLE;
use crate::trajectory::{Contact, Frame, STATUSES, Trajectory};

/// Writes the collection and the folder of its frames, each file whole, the collection last. Files of frames that an older run left there stay, and nothing
/// names them. Costs the product of frames and vertices.
///
/// Errors: what the system refuses; meshes that do not fit the bodies; a file name that is no UTF-8.
pub fn write(path: &Path, trajectory: &Trajectory, meshes: &[Vec<Mesh>]) -> Result<(), IoError> {
    check(path, trajectory, meshes)?;
    let folder = path.with_extension("");
    let name = folder.file_name().and_then(|name| name.to_str()).filter(|_| folder != path);
    let Some(name) = name else {
        let found = path.display();
        return Err(IoError::data(path, "name", "a file name in UTF-8 that ends in .pvd", found));
    };
    std::fs::create_dir_all(&folder).map_err(|e| IoError::os(&folder, WRITABLE, e))?;
    let mut collection = head("Collection");
    collection += "<Collection>\n";
    for (k, frame) in trajectory.frames.iter().enumerate() {
        let parts = [
            ("bodies", bodies(trajectory, frame, meshes)),
            ("contacts", contacts(&frame.contacts)),
        ];
        for (part, (what, text)) in parts.into_iter().enumerate() {
            let file = format!("{what}-{k:06}.vtp");
            put(&folder.join(&file), text.as_bytes())?;
            let (time, name) = (frame.time, escape(name));
            let line = format_args!(
                "<DataSet timestep=\"{time:?}\" part=\"{part}\" name=\"{what}\" file=\"{name}/{file}\"/>"
            );
            writeln!(collection, "{line}").expect("text grows");
        }
    }
    collection += "</Collection>\n</VTKFile>\n";
    put(path, collection.as_bytes())
}

fn head(kind: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
    )
}

/// An attribute as XML takes it: no control character has a place there, however written.
fn escape(text: &str) -> String {
    let text = text.replace(char::is_control, "\u{fffd}");
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// The bodies of a frame.
fn bodies(trajectory: &Trajectory, frame: &Frame, meshes: &[Vec<Mesh>]) -> String {
    let (mut points, mut velocities): (Vec<f32>, Vec<f32>) = (vec![], vec![]);
    let (mut corners, mut ends, mut body, mut fixed) = (vec![], vec![], vec![], vec![]);
    let rigid = frame.bodies.len() - frame.elastic.len();
    for (k, (state, meshes)) in frame.bodies.iter().zip(meshes).enumerate() {
        // Of an elastic solid the vertices are its nodes.
        let nodes = k.checked_sub(rigid).map(|e| &frame.elastic[e]);
        for mesh in meshes {
            let first = (points.len() / 3) as i32;
            for (v, &vertex) in mesh.vertices.iter().enumerate() {
                let arm = match nodes.and_then(|nodes| nodes.get(v)) {
                    Some(node) => std::array::from_fn(|d| node[d] - state.position[d]),
                    None => state.turned(vertex),
                };
                let spin = cross(state.angular_velocity, arm);
                points.extend((0..3).map(|d| (state.position[d] + arm[d]) as f32));
                velocities.extend((0..3).map(|d| (state.velocity[d] + spin[d]) as f32));
            }
            for face in &mesh.faces {
                corners.extend(face.iter().map(|&v| first + v as i32));
                ends.push(corners.len() as i32);
                body.push(k as i32);
                fixed.push(u8::from(trajectory.bodies[k].fixed));
            }
        }
    }
    let cells = [array("body", 1, body), array("fixed", 1, fixed)];
    let velocity = vec![array("velocity", 3, velocities)];
    polydata(&points, "Polys", (&corners, &ends), &velocity, &cells)
}

/// The contacts of a frame.
fn contacts(contacts: &[Contact]) -> String {
    fn vectors(name: &str, contacts: &[Contact], of: fn(&Contact) -> [f64; 3]) -> String {
        array(name, 3, contacts.iter().flat_map(of).map(|x| x as f32))
    }
    let points: Vec<f32> = contacts.iter().flat_map(|c| c.point).map(|x| x as f32).collect();
    let each: Vec<i32> = (0..contacts.len() as i32).collect();
    let ends: Vec<i32> = each.iter().map(|k| k + 1).collect();
    let status = |c: &Contact| STATUSES.iter().position(|s| *s == c.status).unwrap_or(0) as u8;
    let fields = [
        vectors("r", contacts, Contact::world_impulse),
        vectors("u", contacts, Contact::world_velocity),
        array("gap", 1, contacts.iter().map(|c| c.gap as f32)),
        array("bodies", 2, contacts.iter().flat_map(|c| [c.a as i32, c.b as i32])),
        array("status", 1, contacts.iter().map(status)),
    ];
    polydata(&points, "Verts", (&each, &ends), &fields, &[])
}

/// Points, cells of one kind (their corners, and where those of each end), fields.
fn polydata(
    points: &[f32],
    kind: &str,
    (corners, ends): (&[i32], &[i32]),
    of_points: &[String],
    of_cells: &[String],
) -> String {
    let mut out = head("PolyData");
    let counts = ["Verts", "Lines", "Strips", "Polys"]
        .map(|name| format!(" NumberOf{name}=\"{}\"", if name == kind { ends.len() } else { 0 }));
    let (n, counts) = (points.len() / 3, counts.concat());
    write!(
        out,
        "<PolyData>\n<Piece NumberOfPoints=\"{n}\"{counts}>\n<Points>\n{}</Points>\n<{kind}>\n{}{}</{kind}>\n\
         <PointData>\n{}</PointData>\n<CellData>\n{}</CellData>\n</Piece>\n</PolyData>\n</VTKFile>\n",
        array("points", 3, points.iter().copied()),
        array("connectivity", 1, corners.iter().copied()),
        array("offsets", 1, ends.iter().copied()),
        of_points.concat(),
        of_cells.concat(),
    )
    .expect("text grows");
    out
}

/// A number as the format names it.
trait Number: Copy {
    const TYPE: &'static str;
    fn append(self, to: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($t:ty: $name:literal),*) => {$(
        impl Number for $t {
            const TYPE: &'static str = $name;
            fn append(self, to: &mut Vec<u8>) {
                to.extend(self.to_le_bytes());
            }
        }
    )*};
}
numbers!(f32: "Float32", i32: "Int32", u8: "UInt8");

/// Their length in bytes, then the numbers, as one piece of base64.
fn array<T: Number>(name: &str, components: usize, numbers: impl IntoIterator<Item = T>) -> String {
    let mut bytes = vec![0; 8];
    numbers.into_iter().for_each(|x| x.append(&mut bytes));
    let length = bytes.len() as u64 - 8;
    bytes[..8].copy_from_slice(&length.to_le_bytes());
    format!(
        "<DataArray type=\"{}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">{}</DataArray>\n",
        T::TYPE,
        BASE64_STANDARD.encode(bytes)
    )
}
