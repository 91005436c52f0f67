//! Surfaces of triangles: closed ones bound a solid, others are sheets or grounds.

use std::collections::BTreeMap;

use nonsmooth_scenes::MassProperties;
use nonsmooth_scenes::vec3::{Vec3, add, cross, norm, scale, sub};

use crate::SimulateError;
use crate::error::{finite, require};

/// The most open edges that a message names.
const NAMED: usize = 5;
/// Triangles whose area is below this share of the square of the size have none.
const SLIVER: f64 = 1e-14;

/// Triangles about common vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    open: Vec<[u32; 2]>,
    one_sided: bool,
}

impl Mesh {
    /// Of vertices (m) and triangles, counter-clockwise seen from outside. Vertices at the same place become one; of a triangle without area the corner between the other two goes to the triangle
    /// across from it, which is cut in two there, and where there is none the triangle is left out.
    /// The mesh is [closed](Self::open_edges) or a sheet that is met from both sides. Cost: n log n.
    ///
    /// Errors: coordinates that are not finite, vertices that there are not, no triangle with an area.
    pub fn new(vertices: &[Vec3], triangles: &[[usize; 3]]) -> Result<Self, SimulateError> {
        for (k, v) in vertices.iter().enumerate() {
            finite(|| format!("vertices[{k}]"), v)?;
        }
        let mut places: BTreeMap<[u64; 3], u32> = BTreeMap::new();
        let mut kept: Vec<Vec3> = vec![];
        let index: Vec<u32> = vertices
            .iter()
            .map(|v| {
                // Both zeros are one.
                let bits = v.map(|x| (x + 0.0).to_bits());
                *places.entry(bits).or_insert_with(|| {
                    kept.push(*v);
                    kept.len() as u32 - 1
                })
            })
            .collect();
        let size = kept.iter().map(|&v| norm(sub(v, kept[0]))).fold(0.0, f64::max);
        let mut all = vec![];
        for (k, t) in triangles.iter().enumerate() {
            if let Some(bad) = t.iter().find(|v| **v >= index.len()) {
                let expected = format!("vertices below {}", index.len());
                return Err(SimulateError::value(format!("triangles[{k}]"), expected, bad));
            }
            let [a, b, c] = t.map(|v| index[v]);
            if a != b && b != c && c != a {
                all.push([a, b, c]);
            }
        }
        let open = open_edges(&all);
        give_corners_away(&mut all, &kept, SLIVER * size * size);
        if all.is_empty() {
            let found = format!("{} without", triangles.len());
            return Err(SimulateError::value("triangles", "one with an area at least", found));
        }
        let one_sided = open.is_empty();
        Ok(Self { vertices: kept, triangles: all, open, one_sided })
    }

    /// The ground below heights (m) at the knots of a grid, row by row along the second axis, that spans `size` (m) about the origin. Solid below: what has sunk in is
    /// pushed upwards.
    ///
    /// Errors: fewer than two rows or columns, rows of different lengths, heights that are not finite, sides that are not positive.
    pub fn heightfield(heights: &[Vec<f64>], size: [f64; 2]) -> Result<Self, SimulateError> {
        let (rows, columns) = (heights.len(), heights.first().map_or(0, Vec::len));
        if rows < 2 || columns < 2 {
            let found = format!("{rows} of {columns}");
            return Err(SimulateError::value("heights", "two rows of two heights at least", found));
        }
        for (name, x) in [("size[0]", size[0]), ("size[1]", size[1])] {
            require(|| name.into(), x, x > 0.0, "a positive number")?;
        }
        let mut vertices = vec![];
        for (i, row) in heights.iter().enumerate() {
            if row.len() != columns {
                let expected = format!("{columns} heights as in the first row");
                return Err(SimulateError::value(format!("heights[{i}]"), expected, row.len()));
            }
            finite(|| format!("heights[{i}]"), row)?;
            let at =
                |k: usize, count: usize, side: f64| side * (k as f64 / (count - 1) as f64 - 0.5);
            let y = at(i, rows, size[1]);
            vertices.extend(row.iter().enumerate().map(|(j, &z)| [at(j, columns, size[0]), y, z]));
        }
        let mut triangles = vec![];
        for i in 0..rows - 1 {
            for j in 0..columns - 1 {
                let k = i * columns + j;
                triangles.push([k, k + 1, k + columns + 1]);
                triangles.push([k, k + columns + 1, k + columns]);
            }
        }
        Ok(Self { one_sided: true, ..Self::new(&vertices, &triangles)? })
    }

    /// The vertices, m.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// The triangles, by indices of vertices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Whether what is behind it is solid: a closed mesh or a heightfield.
    pub fn is_one_sided(&self) -> bool {
        self.one_sided
    }

    /// The edges that do not have exactly one triangle on either side, in the sense of a triangle; none of a closed mesh.
    pub fn open_edges(&self) -> &[[u32; 2]] {
        &self.open
    }

    /// Mass, mass centre and inertia of the solid inside for a density in kg/m³, exact: the signed sum of tetrahedra between a point and the triangles.
    ///
    /// Errors: a mesh that is not closed, by its open edges; one whose triangles look inwards; a density that is not positive.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, SimulateError> {
        require(|| "density".into(), density, density > 0.0, "a positive number")?;
        let open = self.open_edges();
        if !open.is_empty() {
            let named = open.iter().take(NAMED).map(|[i, j]| {
                let [p, q] = [i, j].map(|k| self.vertices[*k as usize]);
                format!("{p:?} to {q:?}")
            });
            let named: Vec<_> = named.collect();
            let more = if open.len() > NAMED { ", ..." } else { "" };
            let found = format!("{} open edges: {}{more}", open.len(), named.join(", "));
            let expected = "a closed mesh where mass follows from a density";
            return Err(SimulateError::value("mesh", expected, found));
        }
        let sum = self.vertices.iter().fold([0.0; 3], |s, &v| add(s, v));
        let inner = scale(1.0 / self.vertices.len() as f64, sum);
        let at = |t: &[u32; 3]| t.map(|v| self.vertices[v as usize]);
        let found = MassProperties::inside(self.triangles.iter().map(at), inner, density);
        if found.mass.is_nan() || found.mass <= 0.0 {
            let expected = "triangles counter-clockwise from outside";
            let volume = format!("a volume of {} m^3", found.mass / density);
            return Err(SimulateError::value("mesh", expected, volume));
        }
        Ok(found)
    }
}

/// The edges of a triangle, in its sense.
fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// The edges that do not have exactly one triangle on either side. Cost: n log n.
fn open_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut count: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for edge in triangles.iter().copied().flat_map(edges) {
        *count.entry(edge).or_default() += 1;
    }
    let paired = |[i, j]: [u32; 2]| count[&[i, j]] == 1 && count.get(&[j, i]) == Some(&1);
    count.keys().copied().filter(|e| !paired(*e)).collect()
}

/// Takes away the triangles whose area is not above `least`, twice that; the corner between the two others cuts the triangle on the other side of the long edge in two, so that a surface that was closed
/// stays so. Cost: n log n where there are any.
fn give_corners_away(triangles: &mut Vec<[u32; 3]>, vertices: &[Vec3], least: f64) {
    let at = |v: u32| vertices[v as usize];
    let is_flat = |[p, q, r]: [u32; 3]| norm(cross(sub(at(q), at(p)), sub(at(r), at(p)))) <= least;
    let mut flat: Vec<usize> = (0..triangles.len()).filter(|&k| is_flat(triangles[k])).collect();
    if flat.is_empty() {
        return;
    }
    let mut of_edge = BTreeMap::new();
    for (k, t) in triangles.iter().enumerate() {
        edges(*t).into_iter().for_each(|edge| {
            of_edge.insert(edge, k);
        });
    }
    let mut gone = vec![false; triangles.len()];
    // Each turn gives one away; flat ones beside each other may hand theirs on.
    for _ in 0..4 * flat.len() {
        let Some(k) = flat.pop() else { break };
        if gone[k] {
            continue;
        }
        let longest = edges(triangles[k]).into_iter().zip([2, 0, 1]);
        let length = |[i, j]: [u32; 2]| norm(sub(at(i), at(j)));
        let Some(([c, a], middle)) = longest.max_by(|x, y| length(x.0).total_cmp(&length(y.0)))
        else {
            break;
        };
        let b = triangles[k][middle];
        let across = of_edge.get(&[a, c]).copied().filter(|&other| other != k && !gone[other]);
        let Some(other) = across else {
            gone[k] = true;
            continue;
        };
        let Some(&d) = triangles[other].iter().find(|v| **v != a && **v != c) else { break };
        if d == b {
            // Two on top of each other.
            (gone[k], gone[other]) = (true, true);
            continue;
        }
        (triangles[k], triangles[other]) = ([a, b, d], [b, c, d]);
        for place in [k, other] {
            edges(triangles[place]).into_iter().for_each(|edge| {
                of_edge.insert(edge, place);
            });
            if is_flat(triangles[place]) {
                flat.push(place);
            }
        }
    }
    flat.into_iter().for_each(|k| gone[k] = true);
    let mut gone = gone.into_iter();
    triangles.retain(|_| gone.next() == Some(false));
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_scenes::Polyhedron;

    /// A cube with corners in the middle of edges, whose faces meet there in triangles without area: closed, and as heavy.
    #[test]
    fn corners_on_edges_leave_a_mesh_closed() {
        let p = Polyhedron::cuboid([1.0, 1.0, 1.0]).unwrap();
        let mut vertices = p.vertices().to_vec();
        for several in [1, 3] {
            let mut triangles: Vec<[usize; 3]> = vec![];
            for (k, face) in p.faces().iter().enumerate() {
                let edge = |a: usize, b: usize| (face[a], face[b]);
                let (a, b) = edge(0, 1);
                if k == 0 {
                    // A fan from a over points of its own edge: triangles without area first.
                    let mut fan = vec![a];
                    for i in 1..=several {
                        let part = i as f64 / (several + 1) as f64;
                        let (x, y) = (p.vertices()[a], p.vertices()[b]);
                        vertices.push([0, 1, 2].map(|k| x[k] + part * (y[k] - x[k])));
                        fan.push(vertices.len() - 1);
                    }
                    fan.extend(&face[1..]);
                    triangles.extend((1..fan.len() - 1).map(|i| [fan[0], fan[i], fan[i + 1]]));
                } else {
                    triangles.extend([[a, b, face[2]], [a, face[2], face[3]]]);
                }
            }
            // The neighbour knows nothing of the points: an open edge unless they are its own, too.
            assert!(!Mesh::new(&vertices, &triangles).unwrap().is_one_sided());
            let (a, b) = (p.faces()[0][0], p.faces()[0][1]);
            let points: Vec<usize> = (vertices.len() - several..vertices.len()).collect();
            let k = triangles
                .iter()
                .position(|t| edges(t.map(|v| v as u32)).contains(&[b as u32, a as u32]))
                .unwrap();
            let c = *triangles[k].iter().find(|v| **v != a && **v != b).unwrap();
            triangles.remove(k);
            let chain =
                [&[b][..], &points.iter().rev().copied().collect::<Vec<_>>(), &[a]].concat();
            triangles.extend(chain.windows(2).map(|w| [w[0], w[1], c]));
            let mesh = Mesh::new(&vertices, &triangles).unwrap();
            assert!(mesh.is_one_sided() && open_edges(mesh.triangles()).is_empty(), "{several}");
            let (found, expected) = (mesh.mass_properties(2.0).unwrap(), p.mass_properties(2.0));
            assert!((found.mass - expected.mass).abs() < 1e-13, "{several}: {found:?}");
            vertices.truncate(8);
        }
    }

    #[test]
    fn a_mesh_that_is_not_closed_names_its_open_edges() {
        let p = Polyhedron::cuboid([0.5, 1.0, 1.5]).unwrap();
        let fan = |f: &Vec<usize>| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]];
        let mut triangles: Vec<[usize; 3]> = p.faces().iter().flat_map(fan).collect();
        // Vertices once for each triangle, as STL has them.
        let split: Vec<Vec3> = triangles.iter().flatten().map(|&k| p.vertices()[k]).collect();
        let numbered: Vec<[usize; 3]> = (0..12).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let closed = Mesh::new(&split, &numbered).unwrap();
        assert_eq!((closed.vertices().len(), closed.open_edges().len()), (8, 0));
        let (found, expected) = (closed.mass_properties(2.0).unwrap(), p.mass_properties(2.0));
        assert!((found.mass - expected.mass).abs() < 1e-13);
        for k in 0..3 {
            assert!((found.inertia[k][k] - expected.inertia[k][k]).abs() < 1e-12);
        }
        let inside: Vec<[usize; 3]> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let error = Mesh::new(p.vertices(), &inside).unwrap().mass_properties(1.0).unwrap_err();
        assert!(error.to_string().contains("found a volume of -"), "{error}");
        triangles.remove(3);
        let open = Mesh::new(p.vertices(), &triangles).unwrap();
        assert!(closed.is_one_sided() && !open.is_one_sided());
        assert_eq!(open.open_edges().len(), 3);
        let error = open.mass_properties(1.0).unwrap_err().to_string();
        let says =
            "mesh: expected a closed mesh where mass follows from a density, found 3 open edges: [";
        assert!(error.starts_with(says), "{error}");
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let v = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]];
        for (vertices, triangles, says) in [
            (&v[..], vec![[0, 1, 4]], "triangles[0]: expected vertices below 4, found 4"),
            (
                &v[..],
                vec![[0, 1, 3]],
                "triangles: expected one with an area at least, found 1 without",
            ),
            (&[[f64::NAN; 3]][..], vec![], "vertices[0]: expected finite components"),
            (&[][..], vec![], "triangles: expected one"),
        ] {
            let error = Mesh::new(vertices, &triangles).unwrap_err().to_string();
            assert!(error.starts_with(says), "{error}");
        }
        for (heights, says) in [
            (
                vec![vec![0.0; 3]],
                "heights: expected two rows of two heights at least, found 1 of 3",
            ),
            (
                vec![vec![0.0; 3], vec![0.0; 2]],
                "heights[1]: expected 3 heights as in the first row",
            ),
            (vec![vec![0.0; 2], vec![0.0, f64::NAN]], "heights[1]: expected finite"),
        ] {
            let error = Mesh::heightfield(&heights, [1.0, 1.0]).unwrap_err().to_string();
            assert!(error.starts_with(says), "{error}");
        }
        assert!(Mesh::heightfield(&[vec![0.0; 2], vec![0.0; 2]], [1.0, -1.0]).is_err());
    }
}
