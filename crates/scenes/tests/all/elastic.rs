//! Elastic solids against elasticity and rigid mechanics: patch tests, vibrations in closed form, the rigid limit.

use nonsmooth_linalg::{Csc, Inverse};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{FrictionGlobal, Problem};
use nonsmooth_scenes::scenes::{ElasticCubes, ElasticWall, Family, State, Support};
use nonsmooth_scenes::{
    Contact, ElasticBox, Ground, Gyroscopic, Image, Material, RigidBody, Scene, Shape, Vec3,
};
use nonsmooth_solve::{Limits, Status, registry};

const STONE: Material =
    Material { density: 2400.0, young: 3e7, poisson: 0.3, alpha: 0.0, beta: 0.0 };

/// A box of unequal sides, elements and place.
fn brick() -> ElasticBox {
    ElasticBox::new([0.6, 0.4, 0.3], [3, 2, 2], STONE).unwrap().at([1.0, -2.0, 0.5])
}

fn scene(solids: Vec<ElasticBox>, contacts: Vec<Contact>) -> Scene {
    Scene {
        name: "elastic".into(),
        bodies: vec![],
        solids,
        contacts,
        gravity: [0.0, 0.0, -9.81],
        h: 0.01,
        gyroscopic: Gyroscopic::Explicit,
        ground: Some(Ground::FLAT),
        obstacles: vec![],
        periods: vec![],
    }
}

/// A contact of the ground with the first solid, at its last node.
fn at_last_node(solid: &ElasticBox) -> Contact {
    Contact::new(None, 0, solid.places().last().unwrap(), [0.0, 0.0, 1.0], 0.5, 0.0)
}

fn times(a: &Csc, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; a.nrows()];
    a.mul_add(1.0, x, &mut y);
    y
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// A field of the place, as the degrees of freedom hold it.
fn field(solid: &ElasticBox, f: impl Fn(Vec3) -> Vec3) -> Vec<f64> {
    solid.places().flat_map(f).collect()
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
}

/// The smallest pivot over the largest of a Cholesky factorisation without pivoting; not positive where A is
/// not definite.
fn least_pivot(mut a: Vec<Vec<f64>>) -> f64 {
    let n = a.len();
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for k in 0..n {
        (least, most) = (least.min(a[k][k]), most.max(a[k][k]));
        for i in k + 1..n {
            let f = a[i][k] / a[k][k];
            for j in k + 1..n {
                a[i][j] -= f * a[k][j];
            }
        }
    }
    least / most
}

fn dense(a: &Csc) -> Vec<Vec<f64>> {
    (0..a.nrows()).map(|i| (0..a.ncols()).map(|j| a.get(i, j)).collect()).collect()
}

#[test]
fn only_the_six_rigid_motions_are_free_of_stiffness() {
    let solid = brick();
    let stiffness = solid.stiffness_matrix().unwrap();
    assert_eq!(stiffness.asymmetry(), 0.0);
    let axis = |k: usize| -> Vec3 { std::array::from_fn(|i| f64::from(u8::from(i == k))) };
    let rigid: Vec<Vec<f64>> = (0..6)
        .map(|k| field(&solid, |p| if k < 3 { axis(k) } else { cross(axis(k - 3), p) }))
        .collect();
    let size = stiffness.values().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for r in &rigid {
        assert!(largest(&times(&stiffness, r)) < 1e-13 * size * largest(r));
    }
    // K is definite with the rigid motions added, and so has no other null vector.
    let mut filled = dense(&stiffness);
    for r in &rigid {
        for i in 0..r.len() {
            for j in 0..r.len() {
                filled[i][j] += size * r[i] * r[j] / dot(r, r);
            }
        }
    }
    assert!(least_pivot(filled) > 1e-4);
}

#[test]
fn a_linear_displacement_has_the_exact_energy_and_forces() {
    let solid = brick();
    let gradient = [[1e-3, -2e-3, 0.5e-3], [0.7e-3, 3e-3, -1e-3], [-0.2e-3, 4e-3, -2e-3]];
    let u = field(&solid, |p| gradient.map(|row| (0..3).map(|k| row[k] * p[k]).sum()));
    let forces = times(&solid.stiffness_matrix().unwrap(), &u);
    // Hooke's law by E and ν.
    let strain: [[f64; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (gradient[i][j] + gradient[j][i])));
    let trace = strain[0][0] + strain[1][1] + strain[2][2];
    let (e, nu) = (STONE.young, STONE.poisson);
    let stress: [[f64; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let volumetric = if i == j { nu / (1.0 - 2.0 * nu) * trace } else { 0.0 };
            e / (1.0 + nu) * (strain[i][j] + volumetric)
        })
    });
    let density: f64 = (0..9).map(|k| stress[k / 3][k % 3] * strain[k / 3][k % 3]).sum();
    let volume: f64 = solid.sides.iter().product();
    let energy = dot(&u, &forces);
    assert!((energy - density * volume).abs() < 1e-12 * energy, "{energy}");
    // Nothing at inner nodes, and on the plane x = const. the traction σ e_x times the area.
    let size = largest(&forces);
    let mut on_face = [0.0; 3];
    for (node, p) in solid.places().enumerate() {
        let at: Vec3 = std::array::from_fn(|k| (p[k] - solid.position[k]) / solid.sides[k]);
        let force = &forces[3 * node..3 * node + 3];
        if at.iter().all(|x| x.abs() < 0.49) {
            assert!(largest(force) < 1e-13 * size);
        }
        if at[0] > 0.49 {
            (0..3).for_each(|k| on_face[k] += force[k]);
        }
    }
    let area = solid.sides[1] * solid.sides[2];
    for k in 0..3 {
        // Forces on the edges of the face belong to its neighbours too; they cancel between opposite ones.
        assert!((on_face[k] - area * stress[k][0]).abs() < 1e-12 * size, "{k}");
    }
}

#[test]
fn mass_and_inertia_are_those_of_the_box() {
    for lumped in [false, true] {
        let solid = ElasticBox { lumped, ..brick() };
        let mass = solid.mass_matrix().unwrap();
        assert_eq!(mass.asymmetry(), 0.0);
        let energy = |v: &[f64]| dot(v, &times(&mass, v));
        let along = field(&solid, |_| [0.6, 0.0, -0.8]);
        let exact = STONE.density * 0.6 * 0.4 * 0.3;
        assert!((energy(&along) - exact).abs() < 1e-12 * exact);
        let turning =
            field(&solid, |p| cross([0.0, 0.0, 1.0], [0, 1, 2].map(|k| p[k] - solid.position[k])));
        let inertia = exact * (0.6_f64.powi(2) + 0.4_f64.powi(2)) / 12.0;
        // Masses at the nodes lie too far outside; the consistent matrix holds linear fields exactly.
        if lumped {
            assert!(energy(&turning) > 1.1 * inertia);
        } else {
            assert!((energy(&turning) - inertia).abs() < 1e-12 * inertia);
        }
    }
}

/// A bar along z without lateral coupling, its bottom held: exactly the bar of linear elements in one dimension.
fn bar(elements: usize, lumped: bool) -> ElasticBox {
    let material = Material { poisson: 0.0, ..STONE };
    let solid = ElasticBox::new([0.2, 0.3, 2.0], [1, 2, elements], material).unwrap();
    let mut solid = ElasticBox { lumped, ..solid.at([0.0, 0.0, 1.0]) };
    solid.hold_bottom();
    solid
}

/// The first natural frequency of the meshed bar, rad/s: with k = π/2L and elements of length d,
/// `ω² = (E/ρ) (6/d²) (1 − cos kd)/(2 + cos kd)`, or with lumped masses `(E/ρ) (2/d²) (1 − cos kd)`
/// (Hughes1987, chapter 9).
fn discrete_frequency(elements: usize, lumped: bool) -> f64 {
    let d = 2.0 / elements as f64;
    let cosine = (std::f64::consts::PI / 4.0 * d).cos();
    let factor = if lumped { 2.0 } else { 6.0 / (2.0 + cosine) };
    (STONE.young / STONE.density * factor * (1.0 - cosine)).sqrt() / d
}

/// The first mode of the bar.
fn mode(z: f64) -> f64 {
    (std::f64::consts::PI / 4.0 * z).sin()
}

#[test]
fn the_bar_vibrates_as_theory_says() {
    for lumped in [false, true] {
        let mut last = f64::INFINITY;
        for elements in [2, 4, 8] {
            let solid = bar(elements, lumped);
            let shape = field(&solid, |p| [0.0, 0.0, mode(p[2])]);
            let (m, k) = (solid.mass_matrix().unwrap(), solid.stiffness_matrix().unwrap());
            let omega = discrete_frequency(elements, lumped);
            let (inertia, elastic) = (times(&m, &shape), times(&k, &shape));
            for i in (0..shape.len()).filter(|i| !solid.held[i / 3]) {
                let residual = elastic[i] - omega * omega * inertia[i];
                assert!(residual.abs() < 1e-12 * largest(&elastic), "{lumped} {elements} {i}");
            }
            // The continuous bar: ω = (π/2L) √(E/ρ), approached with the square of the mesh width.
            let exact = std::f64::consts::PI / 4.0 * (STONE.young / STONE.density).sqrt();
            let error = (omega / exact - 1.0).abs();
            assert!(error < 0.26 * last, "{error} {last}");
            last = error;
        }
        assert!(last < 2e-3);
    }
}

/// One time step without impulses.
fn free_step(scene: &mut Scene) {
    let p = scene.problem().unwrap();
    let mut v = p.f.clone();
    Inverse::new(&p.M, "M").unwrap().solve(&mut v);
    let solid = &mut scene.solids[0];
    for (node, v) in v.chunks(3).enumerate() {
        for k in 0..3 {
            let mean = solid.theta * v[k] + (1.0 - solid.theta) * solid.velocity[node][k];
            solid.displacement[node][k] += scene.h * mean;
        }
        solid.velocity[node].copy_from_slice(v);
    }
}

fn energy(solid: &ElasticBox) -> f64 {
    let (x, v) = (solid.displacement.concat(), solid.velocity.concat());
    let kinetic = dot(&v, &times(&solid.mass_matrix().unwrap(), &v));
    0.5 * (kinetic + dot(&x, &times(&solid.stiffness_matrix().unwrap(), &x)))
}

#[test]
fn steps_follow_the_theta_scheme_of_one_oscillator() {
    // The mode of the bar moves as one mass on a spring, with its damping; a step of that is two numbers.
    for (theta, alpha, beta) in
        [(0.5, 0.0, 0.0), (0.5, 3.0, 0.0), (0.7, 0.0, 2e-3), (1.0, 1.0, 1e-3)]
    {
        let mut solid = ElasticBox { theta, ..bar(4, false) };
        (solid.material.alpha, solid.material.beta) = (alpha, beta);
        let omega = discrete_frequency(4, false);
        let damping = alpha + beta * omega * omega;
        let (mut x, mut v) = (2e-3, -0.3);
        let places: Vec<Vec3> = solid.places().collect();
        for (node, p) in places.into_iter().enumerate() {
            solid.displacement[node] = [0.0, 0.0, x * mode(p[2])];
            solid.velocity[node] = [0.0, 0.0, v * mode(p[2])];
        }
        let before = energy(&solid);
        let contact = at_last_node(&solid);
        let mut scene = Scene { gravity: [0.0; 3], ..scene(vec![solid], vec![contact]) };
        let h = scene.h;
        for _ in 0..20 {
            free_step(&mut scene);
            // v' − v = −h ω² (θ x' + (1 − θ) x) − h c (θ v' + (1 − θ) v), x' = x + h (θ v' + (1 − θ) v).
            let stiff = h * omega * omega;
            let past =
                v - stiff * (x + theta * h * (1.0 - theta) * v) - h * damping * (1.0 - theta) * v;
            let next = past / (1.0 + stiff * h * theta * theta + h * damping * theta);
            x += h * (theta * next + (1.0 - theta) * v);
            v = next;
        }
        let solid = &scene.solids[0];
        for (node, p) in solid.places().enumerate() {
            let (dx, dv) = (solid.displacement[node], solid.velocity[node]);
            assert!((dx[2] - x * mode(p[2])).abs() < 1e-12, "{theta} {dx:?}");
            assert!((dv[2] - v * mode(p[2])).abs() < 1e-10, "{theta} {dv:?}");
            assert!(largest(&dx[..2]) < 1e-13 && largest(&dv[..2]) < 1e-11);
        }
        // Undamped, θ = 1/2 keeps the energy and nothing else does.
        let kept = energy(solid) / before;
        assert_eq!((kept - 1.0).abs() < 1e-10, theta == 0.5 && damping == 0.0, "{kept}");
        assert!(kept < 1.0 + 1e-10);
    }
}

#[test]
fn a_hanging_bar_stretches_by_its_weight() {
    // Steps with θ = 1 far longer than the period end at the static solution u(z) = −(ρ g/E)(L z − z²/2), which
    // linear elements have exactly at their nodes.
    let solid = ElasticBox { theta: 1.0, ..bar(4, false) };
    let contact = at_last_node(&solid);
    let mut scene = Scene { h: 1e4, ..scene(vec![solid], vec![contact]) };
    free_step(&mut scene);
    free_step(&mut scene);
    let solid = &scene.solids[0];
    let tip = STONE.density * 9.81 / STONE.young * 2.0;
    for (p, u) in solid.places().zip(&solid.displacement) {
        let exact = -STONE.density * 9.81 / STONE.young * (2.0 * p[2] - 0.5 * p[2] * p[2]);
        assert!((u[2] - exact).abs() < 1e-8 * tip && u[0].abs() < 1e-9 * tip, "{p:?} {u:?}");
    }
}

#[test]
fn contacts_feel_rigid_motions_as_rigid_bodies_do() {
    let solid = brick();
    let inside = |x: Vec3| [0, 1, 2].map(|k| solid.position[k] + x[k] * solid.sides[k]);
    let points =
        [[0.37, -0.11, -0.5], [-0.5, 0.5, -0.5], [0.5, 0.02, 0.41], [-1.0 / 6.0, 0.0, 0.5]];
    let contacts =
        points.map(|x| Contact::new(None, 0, inside(x), [0.2, -0.3, 1.0], 0.4, 0.0)).to_vec();
    let p = scene(vec![solid.clone()], contacts.clone()).problem().unwrap();
    let (linear, angular) = ([0.3, -1.0, 2.0], [5.0, 3.0, -4.0]);
    let velocity = |at: Vec3| {
        let turned = cross(angular, at);
        [0, 1, 2].map(|k| linear[k] + turned[k])
    };
    let v = field(&solid, velocity);
    for (c, contact) in contacts.iter().enumerate() {
        for (k, axis) in contact.frame().iter().enumerate() {
            let exact = dot(axis, &velocity(contact.point));
            assert!((p.H.column_dot(3 * c + k, &v) - exact).abs() < 1e-13);
        }
        // A face has four nodes, an edge two, a node itself.
        let nodes = [4, 1, 4, 1][c];
        assert_eq!(p.H.column(3 * c).0.len(), 3 * nodes);
    }
    // What pushes on the upper of two solids pushes back on the lower.
    let upper = solid.clone().at([1.1, -1.95, 0.8]);
    let contact = Contact { a: Some(0), b: 1, ..contacts[3] };
    let p = scene(vec![solid.clone(), upper.clone()], vec![contact]).problem().unwrap();
    let both = [v, field(&upper, velocity)].concat();
    assert!((0..3).all(|k| p.H.column_dot(k, &both).abs() < 1e-13));
    // The bottom on an image of the top, which turns with the rest and lags by ω × offset.
    let offset = [0.0, 0.0, -solid.sides[2]];
    let image = Image { offset, velocity: [0.0; 3] };
    let contact = Contact { a: Some(0), image, ..contacts[0] };
    let p = scene(vec![solid.clone()], vec![contact]).problem().unwrap();
    for (k, axis) in contact.frame().iter().enumerate() {
        let exact = dot(axis, &cross(angular, offset));
        assert!((p.H.column_dot(k, &field(&solid, velocity)) - exact).abs() < 1e-13);
    }
}

#[test]
fn the_iteration_matrix_is_definite_and_holds_what_is_held() {
    let falling = ElasticCubes {
        beta: 1e-3,
        alpha: 0.5,
        state: State::Impact,
        impact_speed: 0.5,
        ..ElasticCubes::default()
    };
    let scene = falling.build().unwrap();
    let p = scene.problem().unwrap();
    assert_eq!(p.M.asymmetry(), 0.0);
    assert!(least_pivot(dense(&p.M)) > 1e-6);
    let free = scene.solids[1].iteration_matrix(scene.h).unwrap();
    assert_eq!(free.get(0, 3), p.M.get(81, 84));
    let mut v = p.f.clone();
    Inverse::new(&p.M, "M").unwrap().solve(&mut v);
    let held: Vec<usize> = (0..27).filter(|&k| scene.solids[0].held[k]).collect();
    assert_eq!(held.len(), 9);
    assert!(held.iter().all(|k| v[3 * k..3 * k + 3] == [0.0; 3]));
    // The cube that nothing holds falls as a whole, slowed down by α.
    let exact = (-0.5 * (1.0 - 0.01 * 0.25) - 0.0981) / (1.0 + 0.01 * 0.25);
    for v in v[81..].chunks(3) {
        assert!(largest(&v[..2]) < 1e-12 && (v[2] - exact).abs() < 1e-12, "{v:?}");
    }
}

#[test]
fn stiff_solids_are_rigid_bodies() {
    // The same four contacts under a rigid and an elastic box: W and q agree the better the stiffer it is.
    let half = [0.5, 0.4, 0.3];
    let body = RigidBody {
        velocity: [0.3, 0.0, -1.0],
        ..RigidBody::solid(Shape::Box { half }, STONE.density).unwrap()
    };
    let contacts = [[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]]
        .map(|[x, y]| Contact::new(None, 0, [x, y, -0.3], [0.0, 0.0, 1.0], 0.5, 0.2))
        .to_vec();
    let mut rigid = scene(vec![], contacts.clone());
    rigid.push(body.clone());
    let rigid = rigid.condensed().unwrap();
    let difference = |young: f64| {
        let material = Material { young, ..STONE };
        let mut solid = ElasticBox::new(half.map(|x| 2.0 * x), [2, 2, 2], material).unwrap();
        solid.add_velocity(body.velocity, body.angular_velocity);
        let local = scene(vec![solid], contacts.clone()).condensed().unwrap();
        let apart: Vec<f64> = local.q.iter().zip(&rigid.q).map(|(x, y)| x - y).collect();
        assert!(largest(&apart) < 1e-7, "{apart:?}");
        let (a, b) = (dense(&local.W.to_csc()).concat(), dense(&rigid.W.to_csc()).concat());
        let apart: Vec<f64> = a.iter().zip(&b).map(|(x, y)| x - y).collect();
        largest(&apart) / largest(&b)
    };
    let [soft, hard] = [1e10, 1e12].map(difference);
    assert!(hard < 1e-2 && (soft / hard - 100.0).abs() < 2.0, "{soft} {hard}");
}

#[test]
fn one_contact_a_node_gives_a_delassus_operator_of_full_rank() {
    let ground = ElasticCubes { support: Support::Ground, ..ElasticCubes::default() };
    let scenes = [
        (ElasticCubes::default().build(), 4),
        (ElasticCubes { elements: 5, ..ElasticCubes::default() }.build(), 25),
        (ElasticCubes { count: 3, ..ground.clone() }.build(), 17),
        (ElasticCubes { offset: 0.0, ..ground }.build(), 18),
        (ElasticWall { rows: 3, columns: 3, ..ElasticWall::default() }.build(), 60),
    ];
    for (scene, nc) in scenes {
        let w = scene.unwrap().condensed().unwrap().W;
        assert!(w.asymmetry() < 1e-12);
        assert_eq!(w.to_csc().nrows(), 3 * nc);
        let pivot = least_pivot(dense(&w.to_csc()));
        assert!(pivot > 1e-4, "{nc} contacts: {pivot:e}");
    }
}

#[test]
fn families_have_the_published_sizes() {
    // FCLIB's Cubes_H8_2, _5, _20: 162, 1296, 55566 degrees of freedom; 3 to 5, 17 to 36, 361 to 388 contacts.
    for (elements, dofs, contacts) in [(2, 162, 3..=5), (5, 1296, 17..=36), (20, 55566, 361..=388)]
    {
        let scene = ElasticCubes { elements, ..ElasticCubes::default() }.build().unwrap();
        assert_eq!(scene.dofs(), dofs);
        assert!(contacts.contains(&scene.contacts.len()), "{}", scene.contacts.len());
    }
    // LowWall_FEM: 7212 degrees of freedom, 624 to 688 contacts, c = 0.28.
    let scene = ElasticWall { rows: 8, columns: 11, ..ElasticWall::default() }.build().unwrap();
    assert!((7100..7300).contains(&scene.dofs()) && (624..=688).contains(&scene.contacts.len()));
    // The bricks weigh what the wall does, whole or half.
    let mass = 2000.0 * 8.0 * 11.0 * 0.4 * 0.2 * 0.2;
    assert!((scene.mass() - mass).abs() < 1e-9 * mass);
}

/// The velocities at the contacts and of the solids at the solution.
fn solved(problem: &FrictionGlobal<3>, path: &str) -> (Vec<f64>, Vec<f64>) {
    let limits = Limits { tolerance: 1e-11, max_iterations: 100_000, ..Limits::default() };
    let mut session = registry::session::<FrictionGlobal<3>>(path, &Default::default()).unwrap();
    let mut point = problem.origin();
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    assert_eq!(outcome.status, Status::Solved, "{path}");
    let verdict = problem.judge(&point, limits.tolerance).unwrap();
    assert!(verdict.solved, "{path}");
    (verdict.velocity, point.v)
}

#[test]
fn condensed_or_not_the_velocities_are_the_same() {
    let moving =
        ElasticCubes { mu: 0.3, state: State::Impact, disturbance: 0.4, ..ElasticCubes::default() };
    let standing = ElasticCubes { support: Support::Ground, ..moving.clone() };
    let wall = ElasticWall { rows: 2, columns: 2, disturbance: 0.2, ..ElasticWall::default() };
    for scene in [moving.build(), standing.build(), wall.build()] {
        let p = scene.unwrap().problem().unwrap();
        let ((u, v), (u2, v2)) = (solved(&p, "nsgs"), solved(&p, "condense/nsgs"));
        let apart =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        assert!(apart(&u, &u2) < 1e-9 && apart(&v, &v2) < 1e-9);
        assert!(largest(&u) > 1e-3);
    }
}

#[test]
fn impossible_solids_name_what_is_wrong() {
    let message = |spoil: &dyn Fn(&mut Scene)| {
        let mut scene = scene(vec![brick()], vec![at_last_node(&brick())]);
        spoil(&mut scene);
        scene.problem().unwrap_err().to_string()
    };
    let cases = [
        ("solids[0].elements: expected at least 1", message(&|s| s.solids[0].elements[1] = 0)),
        ("solids[0].sides: expected a positive", message(&|s| s.solids[0].sides[2] = -1.0)),
        (
            "solids[0].poisson: expected a number between",
            message(&|s| s.solids[0].material.poisson = 0.5),
        ),
        (
            "solids[0].young: expected a positive",
            message(&|s| s.solids[0].material.young = f64::NAN),
        ),
        ("solids[0].theta: expected a number from 0.5", message(&|s| s.solids[0].theta = 0.4)),
        ("solids[0].velocity: expected 36 entries", message(&|s| s.solids[0].velocity.truncate(7))),
        (
            "solids[0].velocity[5]: expected zero",
            message(&|s| {
                s.solids[0].held[5] = true;
                s.solids[0].velocity[5] = [1.0; 3];
            }),
        ),
        ("contacts[0].point: expected a point of", message(&|s| s.contacts[0].point[2] += 1.0)),
        ("contacts[0]: expected two different", message(&|s| s.contacts[0].b = 1)),
    ];
    for (start, message) in cases {
        assert!(message.starts_with(start) && !message.contains('\n'), "{message}");
    }
    let endless = ElasticBox::new([1.0; 3], [usize::MAX, 2, 2], STONE).unwrap_err().to_string();
    assert!(endless.starts_with("elements: expected at least 1 along each axis and at most"));
}
