//! Runs for other programs: what stands in the files of ParaView and of glTF, read by other parsers than wrote them.

use std::path::Path;
use std::process::Command;

use crate::motion::run;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use nonsmooth_io::siconos::write_histories;
use nonsmooth_io::{Mesh, gltf, vtk};
use roxmltree::{Document, Node};
use serde_json::Value;

/// A sheet for the floor, a tetrahedron for the two others: round for the ball, nothing beside it for the last.
fn meshes() -> Vec<Vec<Mesh>> {
    let vertices = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let faces = vec![vec![0, 1, 2], vec![0, 2, 3], vec![0, 3, 1], vec![1, 3, 2]];
    let corners = vec![[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [5.0, 5.0, 0.0], [-5.0, 5.0, 0.0]];
    let sheet = Mesh { vertices: corners, faces: vec![vec![0, 1, 2, 3]], smooth: false };
    let solid = |smooth| Mesh { vertices: vertices.clone(), faces: faces.clone(), smooth };
    vec![vec![sheet], vec![solid(true)], vec![solid(false), Mesh::default()]]
}

/// The numbers of an array by its name, whatever their type.
fn array(file: &Document, name: &str) -> Vec<f64> {
    let is = |n: &Node| n.attribute("Name") == Some(name);
    let node = file.descendants().find(is).unwrap_or_else(|| panic!("no array {name}"));
    let bytes = BASE64_STANDARD.decode(node.text().unwrap()).unwrap();
    let (length, bytes) = bytes.split_first_chunk::<8>().unwrap();
    assert_eq!(u64::from_le_bytes(*length), bytes.len() as u64);
    let words = || bytes.as_chunks::<4>().0.iter();
    match node.attribute("type").unwrap() {
        "Float32" => words().map(|w| f64::from(f32::from_le_bytes(*w))).collect(),
        "Int32" => words().map(|w| f64::from(i32::from_le_bytes(*w))).collect(),
        "UInt8" => bytes.iter().map(|&x| f64::from(x)).collect(),
        other => panic!("{other}"),
    }
}

fn near(a: &[f64], b: &[f64]) {
    let close = a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(close, "{a:?} {b:?}");
}

#[test]
fn paraview_gets_well_formed_files_of_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a & b.pvd");
    let run = run(8);
    vtk::write(&path, &run, &meshes()).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let collection = Document::parse(&text).unwrap();
    let sets: Vec<Node> = collection.descendants().filter(|n| n.has_tag_name("DataSet")).collect();
    assert_eq!(sets.len(), 16);
    for (k, set) in sets.iter().enumerate() {
        let frame = &run.frames[k / 2];
        assert_eq!(set.attribute("timestep").unwrap().parse(), Ok(frame.time));
        let text =
            std::fs::read_to_string(folder.path().join(set.attribute("file").unwrap())).unwrap();
        let file = Document::parse(&text).unwrap();
        let piece = file.descendants().find(|n| n.has_tag_name("Piece")).unwrap();
        let count = |name: &str| piece.attribute(name).unwrap().parse::<usize>().unwrap();
        let points = array(&file, "points");
        assert_eq!(points.len(), 3 * count("NumberOfPoints"));
        let ends = array(&file, "offsets");
        assert_eq!(ends.len(), count("NumberOfPolys") + count("NumberOfVerts"));
        let corners = array(&file, "connectivity");
        assert_eq!(ends.last().copied().unwrap_or(0.0), corners.len() as f64);
        assert!(corners.iter().all(|&c| c < count("NumberOfPoints") as f64));
        if set.attribute("name") == Some("contacts") {
            let n = frame.contacts.len();
            assert_eq!(count("NumberOfVerts"), n);
            near(&array(&file, "status"), &[0.0, 1.0, 2.0, 3.0][..n]);
            near(&array(&file, "r"), &[-0.5, 0.25, 2.0].repeat(n));
            near(&array(&file, "u"), &[0.125, 0.0, 0.0].repeat(n));
            near(&array(&file, "bodies"), &[0.0, 1.0, 0.0, 2.0, 0.0, 1.0, 0.0, 2.0][..2 * n]);
            continue;
        }
        assert_eq!(count("NumberOfPolys"), 9);
        near(&array(&file, "body"), &[0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]);
        near(&array(&file, "fixed"), &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        // The ball has turned about the y axis by its time: x' = c x + s z, z' = c z - s x.
        let state = &frame.bodies[1];
        let (s, c) = frame.time.sin_cos();
        let [x, y, z] = state.position;
        near(&points[12..15], &[x + c + s, y + 1.0, z + c - s]);
        // And its first vertex moves with ω × arm besides.
        let [vx, vy, vz] = state.velocity;
        let omega = state.angular_velocity[1];
        near(&array(&file, "velocity")[12..15], &[vx + omega * (c - s), vy, vz - omega * (c + s)]);
    }
}

#[test]
fn vtk_itself_reads_it() {
    const READ: &str = r#"
import sys, vtk
reader = vtk.vtkXMLPolyDataReader()
for name in sys.argv[1:]:
    reader.SetFileName(name)
    reader.Update()
    data = reader.GetOutput()
    arrays = [data.GetPointData(), data.GetCellData()]
    print(data.GetNumberOfPoints(), data.GetNumberOfCells(), [a.GetArrayName(k) for a in arrays for k in range(a.GetNumberOfArrays())], data.GetBounds()[0])
"#;
    let here = Command::new("python3").args(["-c", "import vtk"]).output();
    if !here.is_ok_and(|o| o.status.success()) {
        crate::common::skipped("python3 with vtk is not here");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    vtk::write(&folder.path().join("run.pvd"), &run(5), &meshes()).unwrap();
    let files =
        ["bodies", "contacts"].map(|what| folder.path().join(format!("run/{what}-000004.vtp")));
    let output = Command::new("python3").args(["-c", READ]).args(files).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let expected = "12 9 ['velocity', 'body', 'fixed'] -5.0\n\
                    4 4 ['r', 'u', 'gap', 'bodies', 'status'] 0.03999999910593033\n";
    assert_eq!(said, expected, "{}", String::from_utf8_lossy(&output.stderr));
}

/// The JSON of a `.glb` and its numbers.
fn opened(path: &Path) -> (Value, Vec<u8>) {
    let bytes = std::fs::read(path).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let text = 20 + word(12);
    assert_eq!((&bytes[16..20], text % 4), (&b"JSON"[..], 0));
    assert_eq!((&bytes[text + 4..text + 8], text + 8 + word(text)), (&b"BIN\0"[..], bytes.len()));
    (serde_json::from_slice(&bytes[20..text]).unwrap(), bytes[text + 8..].to_vec())
}

fn numbers(file: &Value, binary: &[u8], accessor: &Value) -> Vec<f64> {
    let accessor = &file["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &file["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let [from, length] =
        ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
    let words = binary[from..from + length].as_chunks::<4>().0;
    let width = match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        "VEC3" => 3,
        "VEC4" => 4,
        other => panic!("{other}"),
    };
    assert_eq!(words.len(), width * accessor["count"].as_u64().unwrap() as usize);
    match accessor["componentType"].as_u64().unwrap() {
        5126 => words.iter().map(|w| f64::from(f32::from_le_bytes(*w))).collect(),
        5125 => words.iter().map(|w| f64::from(u32::from_le_bytes(*w))).collect(),
        other => panic!("{other}"),
    }
}

#[test]
fn gltf_has_a_node_a_body_and_its_motion() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.glb");
    let run = run(30);
    gltf::write(&path, &run, &meshes()).unwrap();
    let (file, binary) = opened(&path);
    let names: Vec<_> =
        file["nodes"].as_array().unwrap().iter().map(|n| n["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["floor", "Kugel ⌀ 0.4", "body 2", "world"]);
    assert_eq!(file["buffers"][0]["byteLength"], binary.len());
    // The floor stands still; the other two move.
    let animation = &file["animations"][0];
    let channels = animation["channels"].as_array().unwrap();
    let targets: Vec<_> = channels.iter().map(|c| c["target"]["node"].as_u64().unwrap()).collect();
    assert_eq!(targets, [1, 1, 2, 2]);
    for channel in channels {
        let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
        let times = numbers(&file, &binary, &sampler["input"]);
        near(&times, &run.frames.iter().map(|f| f.time).collect::<Vec<_>>());
        let body = channel["target"]["node"].as_u64().unwrap() as usize;
        let output = numbers(&file, &binary, &sampler["output"]);
        let expected: Vec<f64> = match channel["target"]["path"].as_str().unwrap() {
            "translation" => run.frames.iter().flat_map(|f| f.bodies[body].position).collect(),
            _ => run
                .frames
                .iter()
                .flat_map(|f| {
                    let [w, x, y, z] = f.bodies[body].rotation;
                    [x, y, z, w]
                })
                .collect(),
        };
        near(&output, &expected);
    }
    // The ball shares its four vertices, the box has its own for each face; normals are of unit length and look outwards.
    for (mesh, count) in [(0, 4), (1, 4), (2, 12)] {
        let primitives = file["meshes"][mesh]["primitives"].as_array().unwrap();
        assert_eq!(primitives.len(), 1);
        let attributes = &primitives[0]["attributes"];
        let points = numbers(&file, &binary, &attributes["POSITION"]);
        let normals = numbers(&file, &binary, &attributes["NORMAL"]);
        assert_eq!((points.len(), normals.len()), (3 * count, 3 * count));
        for (p, n) in points.as_chunks::<3>().0.iter().zip(normals.as_chunks::<3>().0) {
            let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            assert!((dot(n, n) - 1.0).abs() < 1e-6);
            assert!(mesh == 0 || dot(n, p) > 0.5, "{n:?} {p:?}");
        }
    }
    // One frame is a scene that does not move; of equal bodies there is one mesh.
    let mut still = crate::motion::run(1);
    still.bodies.iter_mut().for_each(|b| b.fixed = true);
    gltf::write(&path, &still, &vec![meshes()[1].clone(); 3]).unwrap();
    let (file, _) = opened(&path);
    assert!(file["animations"].is_null());
    assert_eq!(file["meshes"].as_array().unwrap().len(), 1);
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (glb, pvd) = (folder.path().join("run.glb"), folder.path().join("run.pvd"));
    let line = |result: Result<(), nonsmooth_io::IoError>| result.unwrap_err().to_string();
    let message = line(gltf::write(&glb, &run(0), &meshes()));
    assert_eq!(message, format!("{}: frames: expected at least one, found none", glb.display()));
    let mut wrong = meshes();
    wrong[1][0].faces[2] = vec![0, 1, 4];
    for message in
        [line(gltf::write(&glb, &run(2), &wrong)), line(vtk::write(&pvd, &run(2), &wrong))]
    {
        assert!(
            message.ends_with(
                "meshes[1]: expected faces of at least 3 of 4 vertices, found [0, 1, 4]"
            ),
            "{message}"
        );
    }
    let message = line(vtk::write(&pvd, &run(2), &meshes()[1..]));
    assert!(
        message.ends_with("meshes: expected one list for each of 3 bodies, found 2"),
        "{message}"
    );
    let mut lost = run(3);
    lost.frames[1].bodies[2].position[0] = f64::NAN;
    let message = line(gltf::write(&glb, &lost, &meshes()));
    assert!(
        message.contains("frame at 0.01 s: expected finite numbers, found State {"),
        "{message}"
    );
    let bare = folder.path().join("run");
    assert!(line(vtk::write(&bare, &run(2), &meshes())).contains("ends in .pvd"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn siconos_histories_are_tables_that_h5py_reads() {
    const READ: &str = r#"
import sys, h5py
with h5py.File(sys.argv[1]) as f:
    d = f["data"]
    print(int(f.attrs["dimension"]), {k: v.shape for k, v in sorted(d.items())})
    print(d["static"][1, :3].tolist(), d["dynamic"][3, :2].tolist(), [round(x, 12) + 0.0 for x in d["velocities"][2].tolist()])
    print(d["cf"][-3].tolist())
    print(d["cf"][-1].tolist())
    print(d["solv"][1].tolist())
"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("siconos.hdf5");
    let mut content = run(5);
    // Turned by a quarter about x, an angular velocity along z is one along y of the body.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    content.frames[1].bodies[1].rotation = [half, half, 0.0, 0.0];
    content.frames[1].bodies[1].angular_velocity = [0.0, 0.0, 0.5];
    // The last contact from the other side: the floor is its second body.
    let contact = content.frames[4].contacts.last_mut().unwrap();
    (contact.a, contact.b) = (2, 0);
    write_histories(&path, &content).unwrap();
    let here = Command::new("python3").args(["-c", "import h5py"]).output();
    if !here.is_ok_and(|o| o.status.success()) {
        crate::common::skipped("python3 with h5py is not here");
        return;
    }
    let output = Command::new("python3").args(["-c", READ]).arg(&path).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    // Of 0 to 4 contacts in five frames the first took no part.
    let expected = "3 {'cf': (6, 26), 'dynamic': (10, 9), 'solv': (10, 4), 'static': (5, 9), 'velocities': (10, 8)}\n\
        [0.01, -1.0, 0.0] [0.01, 3.0] [0.01, 2.0, 1.0, 0.0, -0.01, 0.0, 0.5, 0.0]\n\
        [0.04, 0.3, 0.04, 1.0, 0.0, 0.04, 1.0, 0.0, 0.0, 0.0, 1.0, -0.5, 0.25, 2.0, -1e-09, 0.0, 0.0, 0.0, 0.125, 0.0, 2.0, -0.5, 0.25, 0.0, 3.0, 3.0]\n\
        [0.04, 0.3, 0.04, 3.0, 0.0, 0.04, 3.0, 0.0, -0.0, -0.0, -1.0, 0.5, -0.25, -2.0, -1e-09, 0.0, 0.0, 0.0, 0.125, 0.0, 2.0, -0.5, 0.25, 2.0, 3.0, 3.0]\n\
        [0.01, 3.0, 1e-12, 1e-12]\n";
    assert_eq!(said, expected, "{}", String::from_utf8_lossy(&output.stderr));
}
