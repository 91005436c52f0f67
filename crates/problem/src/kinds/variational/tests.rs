use nonsmooth_linalg::Csc;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::field::{Differences, Expressions, Pattern};
use judge::Projection;

/// `P_X(p)` by the judge.
fn projected(set: &Set, p: &[f64]) -> Option<Vec<f64>> {
    let mut y = vec![0.0; p.len()];
    for (first, set) in set.parts() {
        let range = first..first + set.dim();
        if !Projection::new(set).onto(set, &p[range.clone()], &p[range.clone()], &mut y[range]) {
            return None;
        }
    }
    Some(y)
}

#[test]
fn a_projection_is_the_same_wherever_it_begins() {
    let mut random = Pcg64::seed_from_u64(9);
    for seed in 0..20 {
        let n = 6;
        let set = random_polyhedron(n, seed);
        let mut point = |size: f64| -> Vec<f64> {
            (0..n).map(|_| size * random.random_range(-1.0..1.0)).collect()
        };
        let p = point(20.0);
        let Some(known) = projected(&set, &p) else { panic!("{seed}") };
        // From the projection itself, from another point of the border, and from anywhere.
        let other = projected(&set, &point(20.0)).unwrap();
        let mut projection = Projection::new(&set);
        for x in [known.clone(), other, point(3.0), vec![f64::MAX; n]] {
            let mut y = vec![0.0; n];
            let q: Vec<f64> = p.iter().map(|p| p * (1.0 + 1e-15)).collect();
            for from in [&p, &q, &p] {
                assert!(projection.onto(&set, from, &x, &mut y), "{seed}");
                let off = y.iter().zip(&known).map(|(a, b)| (a - b).abs());
                assert!(off.fold(0.0, f64::max) < 1e-11, "{seed}: {y:?} {known:?}");
            }
        }
    }
}

fn random_polyhedron(n: usize, seed: u64) -> Set {
    let mut random = Pcg64::seed_from_u64(seed);
    let inside: Vec<f64> = (0..n).map(|_| random.random_range(-1.0..1.0)).collect();
    let mut matrix = |m: usize| {
        let entries: Vec<_> =
            (0..m * n).map(|k| (k / n, k % n, f64::from(random.random_range(-3..4)))).collect();
        let m = Csc::from_triplets(m, n, entries.into_iter()).unwrap();
        let mut at = vec![0.0; m.nrows()];
        m.mul_add(1.0, &inside, &mut at);
        (m, at)
    };
    // More rows than variables, some of them through the same point, and each equality twice.
    let ((a, mut b), (c, d)) = (matrix(2 * n), matrix(n / 3));
    b.iter_mut().skip(n / 2).for_each(|b| *b += 0.5);
    let twice = c.triplets().flat_map(|(i, j, x)| [(2 * i, j, x), (2 * i + 1, j, -2.0 * x)]);
    let doubled = Csc::from_triplets(2 * c.nrows(), n, twice).unwrap();
    let d = d.into_iter().flat_map(|d| [d, -2.0 * d]).collect();
    Set::Polyhedron { A: a, b, C: doubled, d }
}

/// Idempotent, in the set, nonexpansive, and what is left is at an obtuse angle with all that is in the set.
#[test]
fn projections_are_projections() {
    for seed in 0..60 {
        let n = 2 + seed as usize % 7;
        let sets = [
            random_polyhedron(n, seed),
            Set::Ball { centre: vec![0.5; n], radius: 1.5 },
            Set::SecondOrderCone { dimension: n },
            Set::Product(vec![
                Set::Box { lower: vec![-1.0; n], upper: vec![0.5; n] },
                Set::Product(vec![random_polyhedron(n, seed + 1000), Set::orthant(1)]),
            ]),
        ];
        let mut random = Pcg64::seed_from_u64(seed);
        for set in sets {
            let n = set.dim();
            let mut any = || (0..n).map(|_| random.random_range(-5.0..5.0)).collect::<Vec<f64>>();
            let points = [any(), any(), any(), vec![0.0; n]];
            let all = points.each_ref().map(|p| projected(&set, p).expect("not empty"));
            for (p, y) in points.iter().zip(&all) {
                let again = projected(&set, y).unwrap();
                assert!(judge::distance(y, &again) < 1e-12, "{seed} {y:?} {again:?}");
                for z in &all {
                    let angle: f64 = (0..n).map(|i| (p[i] - y[i]) * (z[i] - y[i])).sum();
                    assert!(angle < 1e-10, "{seed} {set:?} {angle:e}");
                }
            }
            for (p, x) in points.iter().zip(&all) {
                for (q, y) in points.iter().zip(&all) {
                    assert!(judge::distance(x, y) <= judge::distance(p, q) + 1e-11);
                }
            }
        }
    }
}

#[test]
fn an_empty_polyhedron_has_no_projection() {
    // x1 ≤ −1 and −x1 ≤ 0
    let rows = Csc::from_triplets(2, 2, [(0, 0, 1.0), (1, 0, -1.0)].into_iter()).unwrap();
    assert_eq!(projected(&Set::inequalities(rows, vec![-1.0, 0.0]), &[0.0, 0.0]), None);
    // x1 + x2 = 1 and = 2
    let c =
        Csc::from_triplets(2, 2, [(0, 0, 1.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 1.0)].into_iter())
            .unwrap();
    let set = Set::Polyhedron { A: Csc::zeros(0, 2), b: vec![], C: c, d: vec![1.0, 2.0] };
    assert_eq!(projected(&set, &[0.0, 0.0]), None);
}

/// A cone with the solution planted on its border: `F(x) = M (x − x*) + w`, w in the dual cone, orthogonal to x*.
#[test]
fn verdicts_keep_with_the_units() {
    for (scale, of_x) in [(1.0, 1.0), (1e9, 1e-7)] {
        let (solution, w) = ([5.0 * of_x, 3.0 * of_x, 4.0 * of_x], [5.0, -3.0, -4.0]);
        let pattern = Pattern::dense(3);
        let field = Differences::new(pattern, move |x, f| {
            let d = [0, 1, 2].map(|i| (x[i] - solution[i]) / of_x);
            for i in 0..3 {
                f[i] = scale * (2.0 * d[i] + d[(i + 1) % 3] - d[(i + 2) % 3] + 0.2 * w[i]);
            }
        });
        let cone = Set::SecondOrderCone { dimension: 3 };
        let problem = Vi::new(field.unwrap(), cone, vec![0.0; 3]).unwrap();
        let verdict = problem.judge(&LcpPoint { z: solution.to_vec() }, 1e-12).unwrap();
        assert!(verdict.solved, "{:?}", verdict.measure);
        assert_eq!(verdict.statuses, [SetStatus::Border]);
        let off = LcpPoint { z: vec![5.0 * of_x, 3.0 * of_x, 4.01 * of_x] };
        let verdict = problem.judge(&off, 1e-8).unwrap();
        assert!(!verdict.solved && verdict.worst[0].0 < 3);
        let relative = verdict.measure.relative;
        assert!((1e-4..1e-2).contains(&relative), "{relative}");
        assert!(verdict.measure.primal > 1e-4);
        let apex = problem.judge(&problem.origin(), 1e-8).unwrap();
        assert_eq!(apex.statuses, [SetStatus::Apex]);
        assert!(!apex.solved && apex.measure.relative > 0.1, "{:?}", apex.measure);
    }
}

/// However far off a start is, no error is small beside it.
#[test]
fn a_start_far_off_makes_no_error_small() {
    let field = || Expressions::parse(&["x1 + x2 - 3".into(), "x2 - x1 - 4".into()], &[]).unwrap();
    // −F(x) = λ x with ‖x‖ = 1: 25 = (1 + λ)² + 1.
    let s = 24f64.sqrt();
    let on_the_ball = [(3.0 * s - 4.0) / 25.0, (4.0 * s + 3.0) / 25.0];
    let inside = [-0.5, 3.5];
    let rows = Csc::from_triplets(1, 2, [(0, 0, 1.0)].into_iter()).unwrap();
    let free = || Set::Box { lower: vec![f64::NEG_INFINITY; 2], upper: vec![f64::INFINITY; 2] };
    let ball = || Set::Ball { centre: vec![0.0; 2], radius: 1.0 };
    let half = || Set::inequalities(rows.clone(), vec![10.0]);
    for start in [0.0, 1.0, 1e3, 1e6, 1e9, 1e30] {
        for (set, solution) in [(ball(), on_the_ball), (free(), inside), (half(), inside)] {
            let problem = Vi::new(field(), set, vec![start; 2]).unwrap();
            let solved =
                |x: [f64; 2]| problem.judge(&LcpPoint { z: x.to_vec() }, 1e-8).unwrap().solved;
            assert!(solved(solution), "from {start}");
            for x in [[0.0; 2], [0.707_106_781_186_547_5; 2], [0.428, 0.9038], [-0.5, 3.499]] {
                assert!(!solved(x), "from {start} at {x:?}");
            }
        }
    }
}

/// A bound that is as good as none counts as none.
#[test]
fn a_far_bound_makes_no_error_small() {
    let solved = |f: &[&str], set: &Set, start: &[f64], x: &[f64]| {
        let texts: Vec<String> = f.iter().map(|f| (*f).into()).collect();
        let field = Expressions::parse(&texts, &[]).unwrap();
        let problem = Vi::new(field, set.clone(), start.to_vec()).unwrap();
        problem.judge(&LcpPoint { z: x.to_vec() }, 1e-8).unwrap().solved
    };
    for far in [1e3, 1e8, 1e9, 1e12, 1e20, 1e300] {
        for set in [[-5.0, far], [-far, far]] {
            let set = Set::Box { lower: vec![set[0]], upper: vec![set[1]] };
            for start in [7.0, 0.0] {
                for (x, right) in [(7.0, false), (0.0, false), (1.0, true)] {
                    assert_eq!(solved(&["x1 - 1"], &set, &[start], &[x]), right, "{x}, {far}");
                }
            }
        }
        let ball = Set::Ball { centre: vec![0.0], radius: 3.0 };
        let far_box = Set::Box { lower: vec![0.0], upper: vec![far] };
        let (both, f) = (Set::Product(vec![ball, far_box]), ["x1 + x1^3 - 2", "x2 - 1"]);
        assert!(!solved(&f, &both, &[0.5, 3.0], &[0.5, 3.0]));
        assert!(solved(&f, &both, &[0.5, 3.0], &[1.0, 1.0]));
        let rows = Csc::from_triplets(2, 1, [(0, 0, -1.0), (1, 0, 1.0)].into_iter()).unwrap();
        let set = Set::inequalities(rows, vec![5.0, far]);
        let f = ["x1^3 + x1 + 1"];
        assert!(!solved(&f, &set, &[3.0], &[3.0]));
        assert!(solved(&f, &set, &[3.0], &[-0.682_327_803_828_019_3]));
        // On the bound that holds, with a rounding error of what was computed there.
        let set = Set::Box { lower: vec![0.0], upper: vec![far] };
        assert!(solved(&["x1 + 1"], &set, &[0.0], &[0.0]));
        assert!(solved(&["x1 + 1"], &set, &[0.0], &[1e-17]));
        assert!(solved(&["x1 + 1"], &set, &[2.0], &[1e-17]));
    }
}

/// A plane that is far away makes no violation of the others rounding.
#[test]
fn a_far_plane_changes_no_projection() {
    let rows = [(0, 0, -1.0), (1, 1, -1.0), (2, 0, -1.0), (2, 1, -1.0), (3, 0, 1.0), (3, 1, 2.0)];
    let rows = Csc::from_triplets(4, 2, rows.into_iter()).unwrap();
    for far in [10.0, 1e8, 1e15, 1e20, 1e300] {
        let set = Set::inequalities(rows.clone(), vec![1.0, 1.0, 1.5, far]);
        for (p, y) in [
            ([-3.0, -2.0], [-1.0, -0.5]),
            ([-3.0, 1e-3], [-1.0, 1e-3]),
            ([-1.0 - 1e-9, 0.5], [-1.0, 0.5]),
            ([0.5, -1.5], [0.5, -1.0]),
        ] {
            let found = projected(&set, &p).unwrap();
            let off = found.iter().zip(&y).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-12, "{far:e}, {p:?}: {found:?}");
        }
    }
}

/// At a vertex with more rows than unknowns, and an equation through it, what rounding leaves of the rows contradicts nothing.
#[test]
fn a_vertex_of_many_rows_is_projected_onto() {
    let csc = |rows: &[[f64; 2]]| {
        let entries = rows.iter().enumerate().flat_map(|(i, r)| [(i, 0, r[0]), (i, 1, r[1])]);
        Csc::from_triplets(rows.len(), 2, entries).unwrap()
    };
    let at = |rows: &[[f64; 2]], x: [f64; 2]| -> Vec<f64> {
        rows.iter().map(|r| r[0] * x[0] + r[1] * x[1]).collect()
    };
    let mut random = Pcg64::seed_from_u64(3);
    for round in 0..400 {
        let mut row = || [0; 2].map(|_| f64::from(random.random_range(-3..4)));
        let rows: Vec<_> = (0..3 + round % 4).map(|_| row()).filter(|r| *r != [0.0; 2]).collect();
        let equations: Vec<_> = (0..round % 2).map(|_| row()).filter(|r| *r != [0.0; 2]).collect();
        let vertex = row();
        let set = Set::Polyhedron {
            A: csc(&rows),
            b: at(&rows, vertex),
            C: csc(&equations),
            d: at(&equations, vertex),
        };
        for off in [0.0, 1e-16, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0] {
            let way = row();
            let p = [vertex[0] + off * way[0], vertex[1] + off * way[1]];
            let y = projected(&set, &p).unwrap_or_else(|| panic!("{round}, {off:e}: {set:?}"));
            let far = |z: [f64; 2]| (p[0] - z[0]).hypot(p[1] - z[1]);
            // A few roundings, over the sine of the angle between two rows.
            assert!(far([y[0], y[1]]) <= far(vertex) + 1e-13, "{round}, {off:e}: {y:?}");
            let beyond = at(&rows, [y[0], y[1]]).into_iter().zip(at(&rows, vertex));
            assert!(beyond.fold(0.0, |most: f64, (a, b)| most.max(a - b)) < 1e-13, "{y:?}");
        }
    }
}

/// From whatever start over a set without a size, of a function that cannot be asked at zero.
#[test]
fn no_start_makes_the_errors_of_a_function_small() {
    let value = |x: &[f64], f: &mut [f64]| {
        f.copy_from_slice(&[x[0] + 0.3 * x[1] - 2.3, 0.5 * x[1] - 0.3 * x[0] + 0.1]);
    };
    for size in [1.0, 1e10, 1e20, 1e30, 1e50, 1e150] {
        let field = Differences::new(Pattern::dense(2), value).unwrap();
        let cone = Set::SecondOrderCone { dimension: 2 };
        let problem = Vi::new(field, cone, vec![-0.25 * size, size]).unwrap();
        let solved = |z: [f64; 2]| problem.judge(&LcpPoint { z: z.to_vec() }, 1e-8).unwrap().solved;
        assert!(!solved([4659.0, -3271.0]) && !solved([20.0, 10.0]), "from {size}");
        assert!(solved([2.0, 1.0]), "from {size}");
    }
}

/// No row of the set touches x_1 and x_2, of which one row of F is twenty thousand times as large as the other: x that runs away along its kernel solves nothing.
#[test]
fn variables_that_no_row_ties_are_judged_each_by_itself() {
    let f = ["20000*x1+20000*x2", "x1+x2-1", "x3"].map(String::from);
    let f = Expressions::parse(&f, &[]).unwrap();
    let c = Csc::from_triplets(1, 3, [(0, 2, 1.0)].into_iter()).unwrap();
    let set = Set::Polyhedron { A: Csc::zeros(0, 3), b: vec![], C: c, d: vec![1.0] };
    let problem = Vi::new(f, set, vec![0.0; 3]).unwrap();
    for far in [1e6, 1e12] {
        let verdict = problem.judge(&LcpPoint { z: vec![-far, far, 1.0] }, 1e-8).unwrap();
        assert!(!verdict.solved, "{far:e} {:?}", verdict.measure);
    }
}

/// Inside of a set that joins variables each row of F vanishes by itself; on its border they belong together.
#[test]
fn inside_of_a_set_no_row_hides_behind_another() {
    let f = || Expressions::parse(&["x1 - 1".into(), "1e9*(x2 - 1)".into()], &[]).unwrap();
    let row = |b: f64| {
        let sum = Csc::from_triplets(1, 2, [(0, 0, 1.0), (0, 1, 1.0)].into_iter()).unwrap();
        Set::inequalities(sum, vec![b])
    };
    let ball = |radius: f64| Set::Ball { centre: vec![0.0; 2], radius };
    for set in [ball(10.0), row(10.0)] {
        let problem = Vi::new(f(), set, vec![0.0; 2]).unwrap();
        let solved = |z: [f64; 2]| problem.judge(&LcpPoint { z: z.to_vec() }, 1e-8).unwrap().solved;
        assert!(!solved([3.6e-8, 1.0]) && !solved([1.1, 1.0]), "{}", problem.set);
        assert!(solved([1.0, 1.0]) && solved([1.0 + 1e-9, 1.0]), "{}", problem.set);
    }
    // On the border F is a multiple of the normal.
    let problem = Vi::new(f(), row(1.0), vec![0.0; 2]).unwrap();
    let point = LcpPoint { z: vec![1e-9, 1.0 - 1e-9] };
    assert!(problem.judge(&point, 1e-8).unwrap().solved);
}

#[test]
fn mistakes_are_named() {
    let field = || Expressions::parse(&["x1".into(), "x2".into()], &[]).unwrap();
    let said = |set, start| Vi::new(field(), set, start).unwrap_err().to_string();
    assert_eq!(
        said(Set::orthant(3), vec![0.0; 3]),
        "F: expected 3 rows (variables of the set), found 2"
    );
    let ball = |radius| Set::Ball { centre: vec![0.0; 2], radius };
    assert_eq!(said(ball(-1.0), vec![0.0; 2]), "radius: expected a number ≥ 0, found -1");
    assert!(said(ball(1.0), vec![0.0; 3]).starts_with("start: expected 2 entries"));
    let set = Set::inequalities(Csc::zeros(1, 2), vec![]);
    assert!(said(set, vec![0.0; 2]).starts_with("b: expected 1 entries"));
    let product = Set::Product(vec![]);
    assert_eq!(said(product, vec![]), "set: expected at least one variable, found none");
}

/// What is planted solves what was made; sizes are refused where the judge cannot project.
#[test]
fn planted_inequalities_are_solved_by_what_was_planted() {
    use crate::check::Judged;
    use crate::planted::{BallsAndCones, Traffic};
    for seed in 0..5 {
        for gamma in [0.0, 0.5] {
            let (problem, known) = Traffic { m: 3, streams: 4, gamma, seed }.vi();
            assert!(problem.judge(&known, 1e-12).unwrap().solved, "traffic {seed}");
            assert!(!problem.judge(&problem.origin(), 1e-3).unwrap().solved);
            assert_eq!(Traffic { m: 3, streams: 4, gamma, seed }.names().len(), problem.dim());
        }
        for (active, dimension) in [(0.0, 2), (1.0, 3), (0.5, 7)] {
            let made = BallsAndCones { active, dimension, seed, ..BallsAndCones::default() };
            let (problem, known) = made.vi();
            let verdict = problem.judge(&known, 1e-12).unwrap();
            assert!(verdict.solved, "{made:?}: {:?}", verdict.measure);
            let expected = if active == 0.0 {
                0
            } else if active == 1.0 {
                5
            } else {
                verdict.counts.border
            };
            assert_eq!(verdict.counts.border, expected, "{made:?}");
        }
    }
    let n = 10_000;
    let rows = Csc::from_triplets(n, n, (0..n).map(|i| (i, i, 1.0))).unwrap();
    let field = Expressions::parse(&vec!["1".to_owned(); n], &[]).unwrap();
    let large = Vi::new(field, Set::inequalities(rows, vec![1.0; n]), vec![0.0; n]).unwrap();
    let said = large.gauge().map(|_| ()).unwrap_err().to_string();
    assert!(said.contains("at most 50000000") && said.ends_with("found 100000000"), "{said}");
}

#[test]
fn a_box_is_a_complementarity_problem() {
    let field = || Expressions::parse(&["x1 - 2".into(), "x2 + x1".into()], &[]).unwrap();
    let parts = |u: f64| Set::Box { lower: vec![0.0], upper: vec![u] };
    let set = Set::Product(vec![parts(1.0), parts(f64::INFINITY)]);
    assert_eq!(set.to_string(), "2 boxes");
    assert!(!set.is_compact() && parts(1.0).is_compact());
    let problem = Vi::new(field(), set, vec![0.5; 2]).unwrap();
    let mcp = problem.mcp().unwrap();
    assert_eq!((&mcp.lower[..], &mcp.upper[..]), (&[0.0, 0.0][..], &[1.0, f64::INFINITY][..]));
    let system = problem.system(None);
    assert!(system.is_some());
    assert_eq!(format!("{system:?}"), format!("{:?}", mcp.system(None)));
    let ball = Set::Ball { centre: vec![0.0; 2], radius: 1.0 };
    assert!(ball.is_compact());
    assert!(Vi::new(field(), ball, vec![0.0; 2]).unwrap().mcp().is_none());
}
