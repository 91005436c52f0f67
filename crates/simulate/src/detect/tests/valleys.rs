//! Meshes in valleys, saddles and deep inside each other.

use super::*;
use crate::{MoreauJean, SimulateError, Simulation};

/// A tetrahedron that stands on its tip, 0.15 m below its centre.
fn tetrahedron() -> Vec<Vec3> {
    vec![[0.1, 0.0, 0.05], [-0.05, 0.0866, 0.05], [-0.05, -0.0866, 0.05], [0.0, 0.0, -0.15]]
}

const TRIANGLES: [[usize; 3]; 4] = [[0, 1, 2], [1, 0, 3], [2, 1, 3], [0, 2, 3]];

/// A valley along y, as a field and as a closed mesh.
fn valleys(slope: f64) -> [Body; 2] {
    let section = [[-1.0, -0.5], [1.0, -0.5], [1.0, slope], [0.0, 0.0], [-1.0, slope]];
    let at = |y: f64| section.map(|[x, z]| [x, y, z]);
    let vertices = [at(-1.0), at(1.0)].concat();
    let side = [[0, 1, 3], [1, 2, 3], [0, 3, 4]];
    let mut triangles: Vec<[usize; 3]> = side.to_vec();
    triangles.extend(side.map(|[i, j, k]| [i + 5, k + 5, j + 5]));
    for i in 0..5 {
        let j = (i + 1) % 5;
        triangles.extend([[i, j + 5, j], [i, i + 5, j + 5]]);
    }
    let mesh = crate::Mesh::new(&vertices, &triangles).unwrap();
    [grid(3, |x, _| slope * x.abs()), Body::fixed(vec![Part::new(mesh)])]
}

/// A ring about the third axis.
fn ring([n, m]: [usize; 2]) -> crate::Mesh {
    let angle = |k: usize, of: usize| std::f64::consts::TAU * k as f64 / of as f64;
    let at = |k: usize| {
        let (s, c) = angle(k / m, n).sin_cos();
        let (t, d) = angle(k % m, m).sin_cos();
        let far = 0.1 + 0.02 * d;
        [far * c, far * s, 0.02 * t]
    };
    let vertices: Vec<Vec3> = (0..n * m).map(at).collect();
    let mut triangles = vec![];
    for k in 0..n * m {
        let (i, j) = (k / m, k % m);
        let name = |i: usize, j: usize| (i % n) * m + j % m;
        let [p, q, s, u] = [name(i, j), name(i + 1, j), name(i + 1, j + 1), name(i, j + 1)];
        triangles.extend([[p, q, s], [p, s, u]]);
    }
    crate::Mesh::new(&vertices, &triangles).unwrap()
}

fn moved(world: World, until: f64) -> Simulation {
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    let run = simulation.run(until, 1e-3, &mut ()).unwrap();
    assert!(run.is_solved(), "{run:?}");
    simulation
}

#[test]
fn a_tip_in_a_valley_stays_above_it() {
    let mesh = crate::Mesh::new(&tetrahedron(), &TRIANGLES).unwrap();
    let sides: Vec<Vec<usize>> = TRIANGLES.iter().map(|t| t.to_vec()).collect();
    let convex = Polyhedron::new(tetrahedron(), sides).unwrap();
    for slope in [0.3, 1.0] {
        for ground in valleys(slope) {
            let n = normalise([-slope, 0.0, 1.0]);
            for x in [0.0, 1e-5] {
                let at = [x, 0.0, 0.15 - 1e-3];
                let found = contacts(&two(ground.clone(), solid(mesh.clone()).at(at)));
                let both = [n, [-n[0], 0.0, n[2]]];
                for n in both {
                    let near = |c: &&Near| {
                        let tip = c.key.feature_b == Feature::Vertex(3).code();
                        tip && norm(sub(c.place.normal, n)) < 1e-9
                    };
                    let gap = found.iter().find(near).map(|c| c.place.gap);
                    let exact = n[0] * x - n[2] * 1e-3;
                    assert!(gap.is_some_and(|g| (g - exact).abs() < 1e-12), "{slope} {found:#?}");
                }
            }
            for shape in [Shape::from(mesh.clone()), Shape::from(convex.clone())] {
                for x in [0.0, 0.001] {
                    let body = solid(shape.clone()).at([x, 0.0, 0.2]);
                    let ends = moved(two(ground.clone(), body), 0.3);
                    let tip = ends.state().pose(1).point([0.0, 0.0, -0.15]);
                    let height = n[2] * tip[2] - n[2] * slope * tip[0].abs();
                    assert!(height > -2e-3, "{slope} {x} {height}");
                }
            }
        }
    }
}

#[test]
fn a_ring_hangs_in_a_ring() {
    let turned = |axis, body: Body| body.turned(Rotation::about(axis, 0.5 * std::f64::consts::PI));
    for size in [[16, 8], [12, 6]] {
        let first = turned([1.0, 0.0, 0.0], Body::fixed(vec![Part::new(ring(size))]));
        let second = turned([0.0, 1.0, 0.0], solid(ring(size))).at([0.0, 0.0, -0.155]);
        let ends = moved(two(first, second), 0.3);
        assert!(ends.state().position[1][2] > -0.17, "{:?}", ends.state().position[1]);
    }
}

#[test]
fn a_mesh_deep_inside_another_is_refused_and_counted() {
    let small = || solid(crate_mesh([0.1; 3])).turned(Rotation::about([1.0, 2.0, 3.0], 0.3));
    let field = || grid(3, |_, _| 0.0);
    for (ground, top) in [(Body::fixed(vec![Part::new(crate_mesh([1.0; 3]))]), 1.0), (field(), 0.0)]
    {
        let world = |z: f64| two(ground.clone(), small().at([0.013, 0.027, z]));
        for depth in [0.05, 0.15, 0.5, 0.9] {
            let made = Simulation::new(world(top - depth), MoreauJean::default());
            let Err(SimulateError::Overlap(pairs)) = made else { panic!("{depth}") };
            assert!(pairs[0].depth > 0.5 * depth, "{depth} {pairs:?}");
        }
        let fast = small().at([0.013, 0.027, top + 0.2]).moving([0.0, 0.0, -200.0], [0.0; 3]);
        let mut simulation =
            Simulation::new(two(ground.clone(), fast), MoreauJean::default()).unwrap();
        let run = simulation.run(0.02, 1e-3, &mut ()).unwrap();
        assert!(run.deep > 0, "{run:?}");
        assert!(simulation.state().position[1][2] > top - 0.5);
    }
}

#[test]
fn what_one_side_of_a_valley_meets_does_not_go_on_behind_the_other() {
    // A cone that lies on one side, with its rim on the valley.
    let poses = [
        ([-0.022202, 0.004449, 0.109870], [0.019403, 0.602550, 0.783145, 0.152449]),
        ([-0.019005, 0.004449, 0.106673], [0.017447, 0.599139, 0.785354, 0.154751]),
        ([-0.015567, 0.004449, 0.103236], [0.015497, 0.595713, 0.787540, 0.157055]),
    ];
    let n = normalise([-1.0, 0.0, 1.0]);
    for (there, turn) in poses {
        let body = cone(0.08, 0.1).turned(Rotation(turn)).at(there);
        let depth = -dot(n, farthest(&body, scale(-1.0, n)));
        assert!(depth > 0.005, "{depth}");
        for ground in valleys(1.0) {
            let least = gaps(&two(ground, body.clone()))[0];
            assert!((least + depth).abs() < 1e-3, "{least} {depth}");
        }
    }
}
