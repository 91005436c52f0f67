//! Meshes in files beside the scene: STL and OBJ.

use std::borrow::Cow;
use std::io::{BufReader, Cursor};
use std::path::Path;

use nonsmooth_scenes::vec3::{Vec3, add, cross, norm, sub};

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

/// The triangles of all solids of a file; it is binary where it is as long as its count of triangles says.
fn stl(bytes: &[u8]) -> Result<Faces, String> {
    let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let needed = count.map(|n| STL.0 + STL.1 * n as usize);
    if needed == Some(bytes.len()) {
        // The reader takes a head that begins with `solid` for words.
        return solid(&[&[b' '; 80], &bytes[80..]].concat());
    }
    let text = text(bytes);
    match needed {
        _ if begins(&text, "solid") => texts(&text),
        Some(needed) if needed < bytes.len() => Err(format!(
            "{} bytes, {} more than its count of triangles takes",
            bytes.len(),
            bytes.len() - needed
        )),
        _ => Err(format!("{} bytes, too few for its triangles", bytes.len())),
    }
}

/// The solids of a file in words, one after the other, whatever their names and letters.
fn texts(text: &str) -> Result<Faces, String> {
    let (mut vertices, mut triangles) = (vec![], vec![]);
    let mut open: Option<String> = None;
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        match &mut open {
            None if begins(line, "solid") => open = Some("solid of\n".into()),
            None => return Err(format!("`{line}` outside of a solid")),
            Some(words) if begins(line, "endsolid") => {
                words.push_str("endsolid of\n");
                let (points, faces) = solid(words.as_bytes())?;
                let first = vertices.len();
                vertices.extend(points);
                triangles.extend(faces.into_iter().map(|t| t.map(|k| first + k)));
                open = None;
            }
            Some(words) => {
                words.push_str(&line.to_ascii_lowercase());
                words.push('\n');
            }
        }
    }
    match open {
        None => Ok((vertices, triangles)),
        Some(_) => Err("a solid without `endsolid`".into()),
    }
}

/// Whether a text begins with a word, in capitals or not.
fn begins(text: &str, word: &str) -> bool {
    let start = text.trim_start();
    start.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word))
}

/// What a file says in words, without the mark with which some begin; names may be in any alphabet.
fn text(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}

fn solid(bytes: &[u8]) -> Result<Faces, String> {
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| one_line(&e.to_string()))?;
    let vertices = mesh.vertices.iter().map(|v| v.0.map(f64::from)).collect();
    Ok((vertices, mesh.faces.iter().map(|f| f.vertices).collect()))
}

fn obj(bytes: &[u8]) -> Result<Faces, String> {
    // Comments behind the numbers, and what follows the three of a vertex, as colours, are not for the reader.
    let plain = |line: &str| {
        let line = line.split('#').next().unwrap_or_default();
        let words: Vec<_> = line.split_whitespace().collect();
        match words[..] {
            ["v", x, y, z, ..] => format!("v {x} {y} {z}\n"),
            _ => format!("{line}\n"),
        }
    };
    let words: String = text(bytes).lines().map(plain).collect();
    let no_material = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let options = tobj::LoadOptions::default();
    let mut reader = BufReader::new(words.as_bytes());
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, no_material)
        .map_err(|e| one_line(&e.to_string()))?;
    let (mut vertices, mut triangles) = (vec![], vec![]);
    for model in &models {
        let first = vertices.len();
        let (points, _) = model.mesh.positions.as_chunks::<3>();
        vertices.extend_from_slice(points);
        let mut corners = model.mesh.indices.iter().map(|&k| k as usize);
        // Where all faces are triangles their sizes are not said.
        let threes = vec![3; model.mesh.indices.len() / 3];
        let said = &model.mesh.face_arities;
        for &size in if said.is_empty() { &threes } else { said } {
            let face: Vec<usize> = corners.by_ref().take(size as usize).collect();
            let places: Vec<Vec3> = face.iter().map(|&k| points[k]).collect();
            let cut = triangulated(&places).ok_or_else(|| {
                format!("a face of {size} corners that crosses itself, with one at {:?}", places[0])
            })?;
            triangles.extend(cut.into_iter().map(|t| t.map(|k| first + face[k])));
        }
    }
    Ok((vertices, triangles))
}

/// Turns by less than this, over the square of the face's size, are none.
const STRAIGHT: f64 = 1e-12;

/// The triangles of a polygon, which need not be convex, by its corners: ears are cut off, one after the other (Meisters 1975). Points and lines have none; `None` where it crosses itself.
fn triangulated(corners: &[Vec3]) -> Option<Vec<[usize; 3]>> {
    let n = corners.len();
    if n <= 3 {
        return Some(if n == 3 { vec![[0, 1, 2]] } else { vec![] });
    }
    let arm = |k: usize| sub(corners[k % n], corners[0]);
    let normal = (0..n).fold([0.0; 3], |sum, k| add(sum, cross(arm(k), arm(k + 1))));
    // Seen along the axis that is nearest to its normal, counter-clockwise.
    let axis = (0..3).max_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs()))?;
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let (i, j) = if normal[axis] < 0.0 { (j, i) } else { (i, j) };
    let turn = |a: usize, b: usize, c: usize| {
        let (p, q) = (sub(corners[b], corners[a]), sub(corners[c], corners[a]));
        p[i] * q[j] - p[j] * q[i]
    };
    let size = (0..n).map(|k| norm(arm(k))).fold(0.0, f64::max);
    let least = STRAIGHT * size * size;
    if (0..n).all(|k| turn(k, (k + 1) % n, (k + 2) % n) > least) && norm(normal) > 0.0 {
        return Some((1..n - 1).map(|k| [0, k, k + 1]).collect());
    }
    let mut left: Vec<usize> = (0..n).collect();
    let mut triangles = vec![];
    while left.len() > 3 {
        let m = left.len();
        let ear = |k: usize| [left[(k + m - 1) % m], left[k], left[(k + 1) % m]];
        let is_free = |[a, b, c]: [usize; 3]| {
            let mut others =
                left.iter().filter(|k| ![a, b, c].map(|v| corners[v]).contains(&corners[**k]));
            !others.any(|&k| turn(a, b, k) >= 0.0 && turn(b, c, k) >= 0.0 && turn(c, a, k) >= 0.0)
        };
        let at = |k: usize| {
            let [a, b, c] = ear(k);
            turn(a, b, c)
        };
        let round = (0..m).find(|&k| at(k) > least && is_free(ear(k)));
        // A corner on a straight side, where nothing else is left.
        let k = round.or_else(|| (0..m).find(|&k| at(k).abs() <= least))?;
        triangles.push(ear(k));
        left.remove(k);
    }
    let last = [left[0], left[1], left[2]];
    triangles.push(last);
    (turn(last[0], last[1], last[2]) >= -least).then_some(triangles)
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The signed volume: a closed surface that was read whole has that of its solids.
    fn volume((vertices, triangles): &Faces) -> f64 {
        let of = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|k| vertices[k]);
            (0..3).map(|k| a[k] * cross(b, c)[k]).sum::<f64>() / 6.0
        };
        triangles.iter().map(of).sum()
    }

    const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
    const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn words(head: &str, foot: &str, off: f32) -> String {
        let corner = |k: usize| {
            let [x, y, z] = CORNERS[k];
            format!("    vertex {} {y} {z}\n", x + off)
        };
        let facet = |face: &[usize; 3]| {
            let corners: String = face.iter().map(|&k| corner(k)).collect();
            format!(" facet normal 0 0 0\n  outer loop\n{corners}  endloop\n endfacet\n")
        };
        format!("{head}\n{}{foot}\n", FACES.iter().map(facet).collect::<String>())
    }

    fn binary(head: &str) -> Vec<u8> {
        let mut stl = head.as_bytes().to_vec();
        stl.resize(80, b' ');
        stl.extend(4_u32.to_le_bytes());
        for face in FACES {
            stl.extend([0_u8; 12]);
            face.iter().flat_map(|&k| CORNERS[k]).for_each(|x| stl.extend(x.to_le_bytes()));
            stl.extend([0_u8; 2]);
        }
        stl
    }

    #[test]
    fn stl_is_read_whole_or_refused() {
        let one = 8.0 / 6.0;
        for (head, foot) in [
            ("solid part", "endsolid part"),
            ("solid", "endsolid"),
            ("\u{feff}\n  SOLID Teil für alle", "EndSolid"),
        ] {
            let read = stl(words(head, foot, 0.0).as_bytes()).unwrap();
            assert!((volume(&read) - one).abs() < 1e-12, "{head}");
            let two = words(head, foot, 0.0) + "\n" + &words("solid b", "endsolid b", 9.0);
            let read = stl(two.as_bytes()).unwrap();
            assert!((volume(&read) - 2.0 * one).abs() < 1e-12, "{head}, two solids");
        }
        let latin = [b"solid f\xfcr\n", &words("", "endsolid", 0.0).into_bytes()[..]].concat();
        assert!((volume(&stl(&latin).unwrap()) - one).abs() < 1e-12);
        let capitals = words("solid x", "endsolid x", 0.0).to_uppercase();
        assert!((volume(&stl(capitals.as_bytes()).unwrap()) - one).abs() < 1e-12);
        for head in ["", "solid of a program that says so in every file"] {
            assert!((volume(&stl(&binary(head)).unwrap()) - one).abs() < 1e-12, "{head}");
            let mut more = binary(head);
            more.extend([0; 53]);
            let refused = stl(&more).unwrap_err();
            if head.is_empty() {
                assert_eq!(refused, "337 bytes, 53 more than its count of triangles takes");
            }
        }
        for (text, says) in [
            (words("solid a", "", 0.0), "a solid without `endsolid`"),
            (words("solid a", "endsolid a\nsoup", 0.0), "`soup` outside of a solid"),
            ("sol".into(), "3 bytes, too few for its triangles"),
        ] {
            assert_eq!(stl(text.as_bytes()).unwrap_err(), says);
        }
    }

    /// A prism over a U, which is not convex, its polygons begun at each of their corners, with comments and colours.
    #[test]
    fn polygons_need_not_be_convex() {
        let u = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]];
        for first in 0..8 {
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                let k = 3 - i - j;
                let mut text = String::from("\u{feff}# a prism\n");
                for z in [0, 1] {
                    for [x, y] in u {
                        let mut at = [0; 3];
                        (at[i], at[j], at[k]) = (x, y, z);
                        let colour = if x == 0 { " 0.5 0.5 1.0" } else { "" };
                        let [x, y, z] = at;
                        text += &format!("v {x} {y} {z}{colour} # corner\n");
                    }
                }
                let face = |corners: Vec<usize>| {
                    let names: Vec<_> = corners.iter().map(|c| (c + 1).to_string()).collect();
                    format!("f {} # face\n", names.join(" "))
                };
                text += &face((0..8).map(|c| 8 + (first + c) % 8).collect());
                text += &face((0..8).rev().map(|c| (first + c) % 8).collect());
                for c in 0..8 {
                    let d = (c + 1) % 8;
                    text += &face(vec![c, d, 8 + d, 8 + c]);
                }
                let read = obj(text.as_bytes()).unwrap();
                assert!((volume(&read) - 7.0).abs() < 1e-12, "{first}: {}", volume(&read));
                let mesh = crate::Mesh::new(&read.0, &read.1).unwrap();
                assert!(mesh.is_one_sided() && mesh.triangles().len() == 28, "{first}");
                let over_the_notch = |t: &[u32; 3]| {
                    let middle = |d: usize| {
                        t.iter().map(|&v| mesh.vertices()[v as usize][d]).sum::<f64>() / 3.0
                    };
                    let (x, y) = (middle(i), middle(j));
                    x > 1.0 && x < 2.0 && y > 1.0
                };
                assert!(!mesh.triangles().iter().any(over_the_notch), "{first}");
            }
        }
        let cross = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3 4\n";
        assert!(obj(cross.as_bytes()).unwrap_err().starts_with("a face of 4 corners that crosses"));
    }
}
