//! Derivatives of solutions against central differences of solutions, for every kind of problem and every part of its data; and forwards against backwards.

use nonsmooth::derivative::{Change, DerivativeError};
use nonsmooth::field::Expressions;
use nonsmooth::{
    AnyPoint, AnyProblem, BoxLcp, Bsr, Csc, Dense, Derivative, FrictionGlobal, FrictionLocal, Hlcp,
    Lcp, LcpPoint, LocalPoint, Matrix, Mcp, Mlcp, Problem, RowsGlobal, RowsLocal, Set, Solve, Vi,
};
use nonsmooth_problem::Bounds;

/// Numbers in [−1, 1), the same every time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }

    fn csc(&mut self, m: usize, n: usize) -> Csc {
        let entries: Vec<_> = (0..m * n).map(|k| (k / n, k % n, self.next())).collect();
        Csc::from_triplets(m, n, entries.into_iter()).unwrap()
    }

    /// Positive definite, not symmetric.
    fn definite(&mut self, n: usize) -> Csc {
        let a = self.csc(n, n);
        let product = plus(&times(&a, &a), &self.csc(n, n), 0.1 / n as f64);
        plus(&product, &Csc::diagonal(&vec![1.0; n]), 1.0)
    }
}

/// Aᵀ B
fn times(a: &Csc, b: &Csc) -> Csc {
    let mut entries = vec![];
    for i in 0..a.ncols() {
        for j in 0..b.ncols() {
            let dot: f64 = (0..a.nrows()).map(|k| a.get(k, i) * b.get(k, j)).sum();
            entries.push((i, j, dot));
        }
    }
    Csc::from_triplets(a.ncols(), b.ncols(), entries.into_iter()).unwrap()
}

/// A + h B
fn plus(a: &Csc, b: &Csc, h: f64) -> Csc {
    let scaled = b.triplets().map(|(i, j, x)| (i, j, h * x));
    let entries: Vec<_> = a.triplets().chain(scaled).collect();
    Csc::from_triplets(a.nrows(), a.ncols(), entries.into_iter()).unwrap()
}

fn moved(a: &[f64], d: &[f64], h: f64) -> Vec<f64> {
    a.iter().zip(d).map(|(a, d)| a + h * d).collect()
}

#[derive(Clone)]
enum Direction {
    Vector(Vec<f64>),
    Matrix(Matrix),
}

/// A part of the data: its letter, a direction, and the problem that is so far away along it.
struct Along {
    letter: &'static str,
    direction: Direction,
    problem: Box<dyn Fn(f64) -> AnyProblem>,
}

fn vector<P: Clone + Into<AnyProblem> + 'static>(
    problem: &P,
    letter: &'static str,
    random: &mut Random,
    part: fn(&mut P) -> &mut Vec<f64>,
) -> Along {
    let base = problem.clone();
    let d = random.vector(part(&mut base.clone()).len());
    let direction = Direction::Vector(d.clone());
    let problem = move |h: f64| {
        let mut other = base.clone();
        *part(&mut other) = moved(part(&mut base.clone()), &d, h);
        other.into()
    };
    Along { letter, direction, problem: Box::new(problem) }
}

fn sparse<P: Clone + Into<AnyProblem> + 'static>(
    problem: &P,
    letter: &'static str,
    random: &mut Random,
    part: fn(&mut P) -> &mut Csc,
) -> Along {
    let base = problem.clone();
    let shape = part(&mut base.clone()).clone();
    let d = random.csc(shape.nrows(), shape.ncols());
    let direction = Direction::Matrix(d.clone().into());
    let problem = move |h: f64| {
        let mut other = base.clone();
        *part(&mut other) = plus(part(&mut base.clone()), &d, h);
        other.into()
    };
    Along { letter, direction, problem: Box::new(problem) }
}

fn matrix<P: Clone + Into<AnyProblem> + 'static>(
    problem: &P,
    letter: &'static str,
    random: &mut Random,
    part: fn(&mut P) -> &mut Matrix,
) -> Along {
    let base = problem.clone();
    let whole = part(&mut base.clone()).to_csc().unwrap();
    let d = random.csc(whole.nrows(), whole.ncols());
    let direction = Direction::Matrix(d.clone().into());
    let problem = move |h: f64| {
        let mut other = base.clone();
        *part(&mut other) = plus(&whole, &d, h).into();
        other.into()
    };
    Along { letter, direction, problem: Box::new(problem) }
}

/// The parts of a solution by name.
fn solution(problem: &AnyProblem) -> (AnyPoint, Vec<(&'static str, Vec<f64>)>) {
    let answer = Solve::new().tolerance(1e-13).run(problem).unwrap();
    let residual = answer.verdict.measure.relative;
    assert!(residual < 1e-11, "{}: {residual:e}, {}", problem.kind().name(), answer.status);
    let parts = problem.point_parts(&answer.point, &answer.verdict.velocity);
    let parts = parts.into_iter().map(|(name, x)| (name, x.to_vec())).collect();
    (answer.point, parts)
}

const STEP: f64 = 1e-5;

/// The derivative along every part of the data, against differences and against its adjoint. `None` at a degenerate solution.
fn check(problem: &AnyProblem, data: &[Along]) -> Option<Vec<(&'static str, Vec<f64>)>> {
    let mut random = Random(5);
    let kind = problem.kind().name();
    let (point, parts) = solution(problem);
    let by = Derivative::of(problem, &point, 1e-8).unwrap();
    if by.degenerate > 0 {
        return None;
    }
    let gradients: Vec<(&str, Vec<f64>)> =
        by.solution().map(|(name, n)| (name, random.vector(n))).collect();
    let given: Vec<_> = gradients.iter().map(|(name, g)| (*name, &g[..])).collect();
    let back = by.backward(&given).unwrap();
    let letters: Vec<_> = by.vectors().map(|v| v.0).chain(by.matrices().map(|m| m.0)).collect();
    for letter in &letters {
        assert!(data.iter().any(|along| along.letter == *letter), "{kind}: {letter} is not tested");
    }
    for Along { letter, direction, problem } in data {
        let change = match direction {
            Direction::Vector(d) => Change::Vector(d),
            Direction::Matrix(d) => Change::Matrix(d),
        };
        let moved = by.forward(&[(letter, change)]).unwrap();
        let (ahead, behind) = (solution(&problem(STEP)).1, solution(&problem(-STEP)).1);
        for ((name, ahead), (_, behind)) in ahead.iter().zip(&behind) {
            // Without rows there are no impulses of theirs.
            let Some(found) = moved.part(name) else { continue };
            // Equalities come first, and have no w.
            let (ahead, behind) =
                (&ahead[ahead.len() - found.len()..], &behind[behind.len() - found.len()..]);
            let seen: Vec<f64> =
                ahead.iter().zip(behind).map(|(a, b)| (a - b) / (2.0 * STEP)).collect();
            let size = seen.iter().fold(1e-2_f64, |size, x| size.max(x.abs()));
            for (k, (found, seen)) in found.iter().zip(&seen).enumerate() {
                let apart = (found - seen).abs() / size;
                assert!(apart < 1e-6, "{kind}: d{name}[{k}]/d{letter}: {found} and {seen}");
            }
        }
        // ⟨g, D d⟩ = ⟨Dᵀ g, d⟩
        let forwards: f64 = gradients.iter().map(|(n, g)| dot(g, moved.part(n).unwrap())).sum();
        let backwards = match direction {
            Direction::Vector(d) => dot(back.vector(letter).unwrap(), d),
            Direction::Matrix(d) => {
                let mut sum = 0.0;
                for [a, b] in back.matrix(letter).unwrap() {
                    d.for_each(|i, j, x| sum += a[i] * x * b[j]);
                }
                sum
            }
        };
        let size = 1.0 + forwards.abs();
        assert!(
            (forwards - backwards).abs() < 1e-9 * size,
            "{kind}: {letter}: {forwards} and {backwards}"
        );
    }
    Some(parts)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Runs a test on many seeds; enough of their solutions must be nondegenerate.
fn often(test: impl Fn(&mut Random) -> bool) {
    let seeds = 8;
    let good = (1..=seeds).filter(|seed| test(&mut Random(*seed))).count();
    assert!(good + 2 >= seeds as usize, "{good} of {seeds}");
}

#[test]
fn linear_complementarity() {
    often(|random| {
        let problem = Lcp::new(random.definite(8), random.vector(8)).unwrap();
        let data = [
            vector(&problem, "q", random, |p| &mut p.q),
            matrix(&problem, "M", random, |p| &mut p.M),
        ];
        check(&problem.into(), &data).is_some()
    });
}

#[test]
fn two_bounds() {
    often(|random| {
        let q = random.vector(9).iter().map(|x| 3.0 * x).collect();
        let problem = BoxLcp::new(random.definite(9), q, vec![-0.2; 9], vec![0.3; 9]).unwrap();
        let data = [
            vector(&problem, "q", random, |p| &mut p.q),
            vector(&problem, "lower", random, |p| &mut p.lower),
            vector(&problem, "upper", random, |p| &mut p.upper),
            matrix(&problem, "M", random, |p| &mut p.M),
        ];
        check(&problem.into(), &data).is_some()
    });
}

#[test]
fn mixed() {
    often(|random| {
        let problem = Mlcp::new(random.definite(9), random.vector(9), 3).unwrap();
        let data = [
            vector(&problem, "q", random, |p| &mut p.q),
            matrix(&problem, "M", random, |p| &mut p.M),
        ];
        check(&problem.into(), &data).is_some()
    });
}

#[test]
fn horizontal() {
    often(|random| {
        let (n, q) = (7, random.vector(7));
        let r = plus(&Csc::diagonal(&vec![-1.0; n]), &random.csc(n, n), 0.05);
        let problem = Hlcp::new(random.definite(n), r, q).unwrap();
        let data = [
            vector(&problem, "q", random, |p| &mut p.q),
            matrix(&problem, "Q", random, |p| &mut p.Q),
            matrix(&problem, "R", random, |p| &mut p.R),
        ];
        check(&problem.into(), &data).is_some()
    });
}

/// `F(x) = A x + x³/2 + c`, written out.
fn cubic(a: &Csc, c: &[f64]) -> Expressions {
    let rows = (0..c.len()).map(|i| {
        let linear: Vec<_> =
            (0..c.len()).map(|j| format!("{:?} * x{}", a.get(i, j), j + 1)).collect();
        format!("{} + 0.5 * x{}^3 + {:?}", linear.join(" + "), i + 1, c[i])
    });
    Expressions::parse(&rows.collect::<Vec<_>>(), &[]).unwrap()
}

#[test]
fn nonlinear_complementarity_and_inequalities_over_boxes() {
    often(|random| {
        let n = 6;
        let (a, c) = (random.definite(n), random.vector(n));
        let (lower, upper) = (vec![-0.1; n], vec![0.2; n]);
        let problem = Mcp::new(cubic(&a, &c), lower, upper, vec![0.0; n]).unwrap();
        let direction = random.vector(n);
        let (base, d) = (problem.clone(), direction.clone());
        let added = move |h: f64| Mcp {
            F: std::sync::Arc::new(cubic(&a, &moved(&c, &d, h))),
            ..base.clone()
        };
        let over_box = {
            let added = added.clone();
            move |h: f64| {
                let Mcp { F, lower, upper, start } = added(h);
                Vi::of(F, Set::Box { lower, upper }, start).unwrap().into()
            }
        };
        let f = |problem: Box<dyn Fn(f64) -> AnyProblem>| Along {
            letter: "F",
            direction: Direction::Vector(direction.clone()),
            problem,
        };
        let mut data = vec![
            vector(&problem, "lower", random, |p| &mut p.lower),
            vector(&problem, "upper", random, |p| &mut p.upper),
            f(Box::new(move |h| added(h).into())),
        ];
        let whole = check(&problem.clone().into(), &data).is_some();
        // Bounds of the set are those of the problem: what is left is F.
        let vi: AnyProblem = over_box(0.0);
        data.pop();
        for (letter, along) in ["lower", "upper"].into_iter().zip(&mut data) {
            let base = problem.clone();
            let Direction::Vector(d) = along.direction.clone() else { unreachable!() };
            along.problem = Box::new(move |h| {
                let mut other = base.clone();
                let bound = if letter == "lower" { &mut other.lower } else { &mut other.upper };
                *bound = moved(bound, &d, h);
                let Mcp { F, lower, upper, start } = other;
                Vi::of(F, Set::Box { lower, upper }, start).unwrap().into()
            });
        }
        data.push(f(Box::new(over_box)));
        whole && check(&vi, &data).is_some()
    });
}

/// F of a problem over this set along a direction in F, and along one in each part of the set's data.
fn over(
    set: Set,
    random: &mut Random,
    parts: &[(&'static str, Reach)],
) -> (AnyProblem, Vec<Along>) {
    let n = set.dim();
    let (a, c) = (random.definite(n), random.vector(n));
    let c: Vec<f64> = c.iter().map(|c| 3.0 * c).collect();
    let made = move |c: &[f64], set: Set| -> AnyProblem {
        Vi::new(cubic(&a, c), set, vec![0.0; n]).unwrap().into()
    };
    let d = random.vector(n);
    let added = {
        let (made, c, set, d) = (made.clone(), c.clone(), set.clone(), d.clone());
        move |h: f64| made(&moved(&c, &d, h), set.clone())
    };
    let mut data =
        vec![Along { letter: "F", direction: Direction::Vector(d), problem: Box::new(added) }];
    for &(letter, reach) in parts {
        let mut with = |direction: Direction, change: Changed| {
            let (made, c, set) = (made.clone(), c.clone(), set.clone());
            let problem = move |h: f64| {
                let mut other = set.clone();
                change(&mut other, h);
                made(&c, other)
            };
            data.push(Along { letter, direction, problem: Box::new(problem) });
        };
        match reach {
            Reach::Vector(part) => {
                let all = |set: &mut Set| -> usize {
                    sets(set).into_iter().filter_map(part).map(|x| x.len()).sum()
                };
                let d = random.vector(all(&mut set.clone()));
                let direction = Direction::Vector(d.clone());
                let change = move |set: &mut Set, h: f64| {
                    let entries = sets(set).into_iter().filter_map(part).flatten();
                    entries.zip(&d).for_each(|(x, d)| *x += h * d);
                };
                with(direction, Box::new(change));
            }
            Reach::Matrix(part) => {
                let base = part(&mut set.clone()).clone();
                let d = random.csc(base.nrows(), base.ncols());
                let direction = Direction::Matrix(d.clone().into());
                let change = move |set: &mut Set, h: f64| *part(set) = plus(&base, &d, h);
                with(direction, Box::new(change));
            }
        }
    }
    (made(&c, set), data)
}

/// What moves a set along a direction.
type Changed = Box<dyn Fn(&mut Set, f64)>;

/// Where a part of a set's data is: in each set of a product, one after the other, or in the only one.
#[derive(Clone, Copy)]
enum Reach {
    Vector(fn(&mut Set) -> Option<&mut [f64]>),
    Matrix(fn(&mut Set) -> &mut Csc),
}

/// The sets of a product.
fn sets(set: &mut Set) -> Vec<&mut Set> {
    match set {
        Set::Product(all) => all.iter_mut().collect(),
        one => vec![one],
    }
}

const OF_LOWER: (&str, Reach) = (
    "lower",
    Reach::Vector(|set| if let Set::Box { lower, .. } = set { Some(lower) } else { None }),
);
const OF_UPPER: (&str, Reach) = (
    "upper",
    Reach::Vector(|set| if let Set::Box { upper, .. } = set { Some(upper) } else { None }),
);
const OF_B: (&str, Reach) =
    ("b", Reach::Vector(|set| if let Set::Polyhedron { b, .. } = set { Some(b) } else { None }));
const OF_D: (&str, Reach) =
    ("d", Reach::Vector(|set| if let Set::Polyhedron { d, .. } = set { Some(d) } else { None }));
const OF_CENTRE: (&str, Reach) = (
    "centre",
    Reach::Vector(|set| if let Set::Ball { centre, .. } = set { Some(centre) } else { None }),
);
const OF_RADIUS: (&str, Reach) = (
    "radius",
    Reach::Vector(|set| match set {
        Set::Ball { radius, .. } => Some(std::slice::from_mut(radius)),
        _ => None,
    }),
);
/// The matrices of the first polyhedron.
const OF_A: (&str, Reach) = (
    "A",
    Reach::Matrix(|set| {
        let mut all = sets(set).into_iter();
        all.find_map(|set| if let Set::Polyhedron { A, .. } = set { Some(A) } else { None })
            .unwrap()
    }),
);
const OF_C: (&str, Reach) = (
    "C",
    Reach::Matrix(|set| {
        let mut all = sets(set).into_iter();
        all.find_map(|set| if let Set::Polyhedron { C, .. } = set { Some(C) } else { None })
            .unwrap()
    }),
);

/// Constraints that hold with some room at zero, of which F makes some bind, and an equation.
fn polyhedron(random: &mut Random, n: usize, rows: usize) -> Set {
    let b = (0..rows).map(|_| 0.05 + 0.05 * random.next()).collect();
    Set::Polyhedron { A: random.csc(rows, n), b, C: random.csc(1, n), d: vec![0.1] }
}

#[test]
fn inequalities_over_polyhedra() {
    let binding = std::cell::Cell::new(0);
    often(|random| {
        let set = polyhedron(random, 6, 5);
        let (problem, data) = over(set, random, &[OF_B, OF_D, OF_A, OF_C]);
        let answer = Solve::new().tolerance(1e-12).run(&problem).unwrap();
        let nonsmooth::AnyCounts::Sets(counts) = answer.verdict.counts else { unreachable!() };
        binding.set(binding.get() + counts.border);
        check(&problem, &data).is_some()
    });
    assert!(binding.get() >= 8, "{}", binding.get());
}

#[test]
fn inequalities_over_balls_and_cones() {
    let seen = std::cell::RefCell::new(std::collections::BTreeSet::new());
    often(|random| {
        // Near and far, so that some hold x and some do not.
        let ball = |random: &mut Random, radius: f64| Set::Ball {
            centre: random.vector(3).iter().map(|c| 0.1 * c).collect(),
            radius,
        };
        let cone = |dimension| Set::SecondOrderCone { dimension };
        let parts = vec![ball(random, 0.2), cone(3), ball(random, 5.0), cone(2), cone(1), cone(4)];
        let (problem, data) = over(Set::Product(parts), random, &[OF_CENTRE, OF_RADIUS]);
        let answer = Solve::new().tolerance(1e-12).run(&problem).unwrap();
        seen.borrow_mut().extend(answer.verdict.statuses.iter().map(|s| format!("{s:?}")));
        check(&problem, &data).is_some()
    });
    assert_eq!(seen.borrow().len(), 3, "{:?}", seen.borrow());
}

#[test]
fn inequalities_over_products() {
    often(|random| {
        let parts = vec![
            Set::Box { lower: vec![-0.1; 3], upper: vec![0.1; 3] },
            polyhedron(random, 4, 3),
            Set::Ball { centre: vec![0.1; 2], radius: 0.3 },
            Set::Product(vec![]),
            Set::SecondOrderCone { dimension: 3 },
            Set::Box { lower: vec![0.0; 2], upper: vec![f64::INFINITY; 2] },
        ];
        let all = [OF_LOWER, OF_UPPER, OF_B, OF_D, OF_A, OF_C, OF_CENTRE, OF_RADIUS];
        let (problem, data) = over(Set::Product(parts), random, &all);
        check(&problem, &data).is_some()
    });
    // Of two polyhedra the matrices have no letter.
    often(|random| {
        let set = Set::Product(vec![polyhedron(random, 4, 3), polyhedron(random, 3, 2)]);
        let (problem, data) = over(set, random, &[OF_B, OF_D]);
        check(&problem, &data).is_some()
    });
}

/// Where the row of a variable with equal bounds vanishes it follows the one bound or the other.
#[test]
fn equal_bounds_without_a_force_are_a_border() {
    let two = || vec![1.0; 2];
    let identity = Dense::from_rows(&[[1.0, 0.0], [0.0, 1.0]]).unwrap();
    let row = |i: usize| format!("x{} - {:?}", i + 1, [1.0, 5.0][i]);
    let field = || Expressions::parse(&[row(0), row(1)], &[]).unwrap();
    let set = Set::Box { lower: two(), upper: two() };
    let problems: [AnyProblem; 3] = [
        BoxLcp::new(identity, vec![-1.0, -5.0], two(), two()).unwrap().into(),
        Mcp::new(field(), two(), two(), two()).unwrap().into(),
        Vi::new(field(), set, two()).unwrap().into(),
    ];
    for problem in problems {
        let by = Derivative::of(&problem, &LcpPoint { z: two() }.into(), 1e-8).unwrap();
        assert_eq!(by.degenerate, 1, "{}", problem.kind().name());
    }
}

/// By hand, and where pieces meet.
#[test]
fn sets_at_their_borders() {
    let nearest = |set: Set, to: [f64; 2]| -> AnyProblem {
        let rows = [format!("x1 - {:?}", to[0]), format!("x2 - {:?}", to[1])];
        Vi::new(Expressions::parse(&rows, &[]).unwrap(), set, vec![0.0; 2]).unwrap().into()
    };
    let at = |problem: &AnyProblem, z: [f64; 2]| {
        let point = LcpPoint { z: z.to_vec() }.into();
        Derivative::of(problem, &point, 1e-8).unwrap()
    };
    // The point of the disk that is nearest to (3, 4): a change of F by f moves it by −(I − t tᵀ) f/5, of the radius along t.
    let ball = |radius: f64| Set::Ball { centre: vec![0.0; 2], radius };
    let by = at(&nearest(ball(1.0), [3.0, 4.0]), [0.6, 0.8]);
    assert_eq!(by.degenerate, 0);
    let along = by.forward(&[("F", Change::Vector(&[1.0, 0.0]))]).unwrap();
    let expected = [-(1.0 - 0.36) / 5.0, 0.48 / 5.0];
    assert!(along.part("x").unwrap().iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14));
    let along = by.forward(&[("radius", Change::Vector(&[1.0]))]).unwrap();
    assert!(along.part("x").unwrap().iter().zip([0.6, 0.8]).all(|(a, b)| (a - b).abs() < 1e-14));
    // F vanishes on the border; a ball of radius zero moves with its centre.
    assert_eq!(at(&nearest(ball(1.0), [0.6, 0.8]), [0.6, 0.8]).degenerate, 1);
    let by = at(&nearest(ball(0.0), [3.0, 4.0]), [0.0, 0.0]);
    assert_eq!(by.degenerate, 1);
    let along = by.forward(&[("centre", Change::Vector(&[1.0, 2.0]))]).unwrap();
    assert_eq!(along.part("x").unwrap(), [1.0, 2.0]);
    // F on the border of the dual cone, at the point of the cone and on its border.
    let cone = || Set::SecondOrderCone { dimension: 2 };
    let by = at(&nearest(cone(), [-2.0, 1.0]), [0.0, 0.0]);
    assert_eq!(by.degenerate, 0);
    let along = by.forward(&[("F", Change::Vector(&[1.0, 5.0]))]).unwrap();
    assert_eq!(
        (along.part("x").unwrap(), along.part("F").unwrap()),
        (&[0.0, 0.0][..], &[1.0, 5.0][..])
    );
    assert_eq!(at(&nearest(cone(), [-1.0, 1.0]), [0.0, 0.0]).degenerate, 1);
    assert_eq!(at(&nearest(cone(), [1.0, 1.0]), [1.0, 1.0]).degenerate, 1);
    // A row that holds x with no force; rows and equations that repeat each other.
    let rows = |a: &[[f64; 2]], b: &[f64], c: &[[f64; 2]], d: &[f64]| {
        let csc = |rows: &[[f64; 2]]| {
            let entries: Vec<_> =
                rows.iter().enumerate().flat_map(|(i, r)| [(i, 0, r[0]), (i, 1, r[1])]).collect();
            Csc::from_triplets(rows.len(), 2, entries.into_iter()).unwrap()
        };
        Set::Polyhedron { A: csc(a), b: b.to_vec(), C: csc(c), d: d.to_vec() }
    };
    let corner = rows(&[[1.0, 0.0], [0.0, 1.0]], &[1.0, 1.0], &[], &[]);
    assert_eq!(at(&nearest(corner.clone(), [2.0, 2.0]), [1.0, 1.0]).degenerate, 0);
    assert_eq!(at(&nearest(corner, [2.0, 1.0]), [1.0, 1.0]).degenerate, 1);
    let twice =
        rows(&[[1.0, 0.0], [2.0, 0.0]], &[1.0, 2.0], &[[1.0, 1.0], [2.0, 2.0]], &[1.0, 2.0]);
    let by = at(&nearest(twice, [5.0, 0.0]), [1.0, 0.0]);
    assert_eq!(by.degenerate, 2);
    // With respect to F it is the derivative all the same.
    let along = by.forward(&[("F", Change::Vector(&[1.0, 5.0]))]).unwrap();
    assert!(along.part("x").unwrap().iter().all(|x| x.abs() < 1e-14));
}

/// Of traffic on a grid of streets, whose planted equilibrium has no flow on many streets: as many equations as crossings of each stream.
#[test]
fn an_equilibrium_of_traffic() {
    let traffic = nonsmooth_problem::planted::Traffic { m: 3, streams: 2, gamma: 0.3, seed: 1 };
    let (problem, known) = traffic.vi();
    let by = Derivative::of_vi(&problem, &known, 1e-8).unwrap();
    let Set::Polyhedron { C, .. } = &problem.set else { unreachable!() };
    // More demand, with the flow: what leaves a crossing less what arrives there.
    let d: Vec<f64> = (0..C.nrows()).map(|k| 0.1 * (k as f64).sin()).collect();
    let moved = by.forward(&[("d", Change::Vector(&d))]).unwrap();
    let mut left = d.iter().map(|d| -d).collect::<Vec<_>>();
    C.mul_add(1.0, moved.part("x").unwrap(), &mut left);
    assert!(left.iter().all(|x| x.abs() < 1e-12), "{left:?}");
}

/// One factorisation is a single call into a library: it is given up at a limit, and when the flag is set.
#[test]
fn a_long_factorisation_ends_at_a_limit() {
    use nonsmooth::{Limits, derivative_within};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    let m = 32;
    let n = m * m * m;
    let place = |i: usize, j: usize, k: usize| (i * m + j) * m + k;
    let mut entries = vec![];
    for (i, j, k) in (0..n).map(|at| (at / m / m, at / m % m, at % m)) {
        let at = place(i, j, k);
        entries.push((at, at, 7.0));
        for (inside, next) in [
            (i + 1 < m, place(i + 1, j, k)),
            (j + 1 < m, place(i, j + 1, k)),
            (k + 1 < m, place(i, j, k + 1)),
        ] {
            if inside {
                entries.extend([(at, next, -1.0), (next, at, -1.0)]);
            }
        }
    }
    let matrix = Csc::from_triplets(n, n, entries.into_iter()).unwrap();
    let mut q = vec![0.0; n];
    matrix.mul_add(-1.0, &vec![1.0; n], &mut q);
    let problem: AnyProblem = Lcp::new(matrix, q).unwrap().into();
    let point: AnyPoint = LcpPoint { z: vec![1.0; n] }.into();
    let slack: f64 =
        std::env::var("NONSMOOTH_SLACK").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    let begun = std::time::Instant::now();
    let limits = Limits { tolerance: 1e-8, time_limit: Some(0.1), ..Limits::default() };
    let found = derivative_within(&problem, &point, &limits, || {}).unwrap_err();
    assert_eq!(found, DerivativeError::Interrupted);
    let took = begun.elapsed().as_secs_f64();
    assert!(took < 0.11 + 0.2 * slack, "{took} s");
    let flag = Arc::new(AtomicBool::new(false));
    let limits = Limits { time_limit: None, cancel: Some(flag.clone()), ..limits };
    let begun = std::time::Instant::now();
    let mut ticks = 0;
    let tick = || {
        ticks += 1;
        flag.store(ticks > 10, Ordering::Relaxed);
    };
    let found = derivative_within(&problem, &point, &limits, tick).unwrap_err();
    assert_eq!(found, DerivativeError::Interrupted);
    let took = begun.elapsed().as_secs_f64();
    assert!(took < 0.11 + 0.2 * slack, "{took} s");
}

/// Rows with no, one and two bounds.
fn bounds() -> Bounds {
    let inf = f64::INFINITY;
    Bounds { lower: vec![-inf, 0.0, -0.1, -0.1], upper: vec![inf, inf, 0.1, 0.1] }
}

fn local<const D: usize>(random: &mut Random) -> FrictionLocal<D> {
    let (nc, p) = (4, 4);
    let whole = {
        let a = random.csc(D * nc + p, D * nc + p);
        plus(&times(&a, &a), &Csc::diagonal(&vec![1.0; D * nc + p]), 1.0)
    };
    let part = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| {
        let (m, n) = (rows.len(), columns.len());
        let entries: Vec<_> = (0..m * n)
            .map(|k| (k / n, k % n, whole.get(rows.start + k / n, columns.start + k % n)))
            .collect();
        Csc::from_triplets(m, n, entries.into_iter()).unwrap()
    };
    let (m, all) = (D * nc, D * nc + p);
    let mut q = random.vector(m);
    q.iter_mut().step_by(D).for_each(|q| *q -= 0.7);
    let s = random.vector(p);
    let rows = RowsLocal { V: part(0..m, m..all), R: part(m..all, m..all), s, bounds: bounds() };
    FrictionLocal::with_rows(Bsr::from_csc(&part(0..m, 0..m)), q, vec![0.3; nc], rows).unwrap()
}

fn local_data<const D: usize>(problem: &FrictionLocal<D>, random: &mut Random) -> Vec<Along>
where
    FrictionLocal<D>: Into<AnyProblem>,
{
    let rows = |p: &mut FrictionLocal<D>| p.rows.take().unwrap();
    let base = problem.clone();
    let d = random.csc(problem.q.len(), problem.q.len());
    let direction = Direction::Matrix(d.clone().into());
    let of_w = move |h: f64| {
        let w = Bsr::from_csc(&plus(&base.W.to_csc(), &d, h));
        FrictionLocal { W: w, ..base.clone() }.into()
    };
    assert_eq!(rows(&mut problem.clone()).s.len(), 4);
    vec![
        Along { letter: "W", direction, problem: Box::new(of_w) },
        vector(problem, "q", random, |p| &mut p.q),
        vector(problem, "mu", random, |p| &mut p.mu),
        vector(problem, "s", random, |p| &mut p.rows.as_mut().unwrap().s),
        vector(problem, "lower", random, |p| &mut p.rows.as_mut().unwrap().bounds.lower),
        vector(problem, "upper", random, |p| &mut p.rows.as_mut().unwrap().bounds.upper),
        sparse(problem, "V", random, |p| &mut p.rows.as_mut().unwrap().V),
        sparse(problem, "R", random, |p| &mut p.rows.as_mut().unwrap().R),
    ]
}

#[test]
fn local_contacts_with_scalar_rows() {
    often(|random| {
        let problem = local::<3>(random);
        let data = local_data(&problem, random);
        check(&problem.into(), &data).is_some()
    });
    often(|random| {
        let problem = local::<2>(random);
        let data = local_data(&problem, random);
        check(&problem.into(), &data).is_some()
    });
}

fn global<const D: usize>(random: &mut Random) -> FrictionGlobal<D> {
    let (n, nc, p) = (20, 4, 4);
    let mut w = random.vector(D * nc);
    w.iter_mut().step_by(D).for_each(|w| *w -= 0.7);
    let problem = FrictionGlobal::<D>::new(
        random.definite(n),
        random.csc(n, D * nc),
        random.vector(n),
        w,
        vec![0.3; nc],
    );
    let rows = RowsGlobal { G: random.csc(n, p), b: random.vector(p), bounds: bounds() };
    FrictionGlobal { rows: Some(rows), ..problem.unwrap() }
}

#[test]
fn global_contacts_with_scalar_rows() {
    fn tried<const D: usize>(random: &mut Random) -> bool
    where
        FrictionGlobal<D>: Into<AnyProblem>,
    {
        let problem = global::<D>(random);
        let data = [
            sparse(&problem, "M", random, |p| &mut p.M),
            sparse(&problem, "H", random, |p| &mut p.H),
            sparse(&problem, "G", random, |p| &mut p.rows.as_mut().unwrap().G),
            vector(&problem, "f", random, |p| &mut p.f),
            vector(&problem, "w", random, |p| &mut p.w),
            vector(&problem, "mu", random, |p| &mut p.mu),
            vector(&problem, "b", random, |p| &mut p.rows.as_mut().unwrap().b),
            vector(&problem, "lower", random, |p| &mut p.rows.as_mut().unwrap().bounds.lower),
            vector(&problem, "upper", random, |p| &mut p.rows.as_mut().unwrap().bounds.upper),
        ];
        check(&problem.into(), &data).is_some()
    }
    often(tried::<3>);
    often(tried::<2>);
}

/// What is tested above has contacts and rows of every status.
#[test]
fn the_problems_have_every_status() {
    let mut seen = std::collections::BTreeSet::new();
    for seed in 1..=8 {
        let problem: AnyProblem = local::<3>(&mut Random(seed)).into();
        let AnyPoint::Local(point) = solution(&problem).0 else { unreachable!() };
        for (j, [l, u]) in (0..4).map(|j| (j, bounds().of(j))) {
            let lambda = point.lambda[j];
            seen.insert(if lambda <= l + 1e-9 {
                "lower"
            } else if lambda >= u - 1e-9 {
                "upper"
            } else {
                "between"
            });
        }
        let answer = Solve::new().tolerance(1e-10).run(&local::<3>(&mut Random(seed))).unwrap();
        let counts = answer.verdict.counts;
        for (name, count) in [("open", counts.open), ("stick", counts.stick), ("slip", counts.slip)]
        {
            if count > 0 {
                seen.insert(name);
            }
        }
    }
    assert_eq!(Vec::from_iter(seen), ["between", "lower", "open", "slip", "stick", "upper"]);
}

/// The local problem of a global one has the same derivative with respect to mu.
#[test]
fn the_local_and_the_global_form_agree() {
    let global = FrictionGlobal::<3> { rows: None, ..global::<3>(&mut Random(3)) };
    let m = Dense::from_rows(
        &(0..20)
            .map(|i| std::array::from_fn::<f64, 20, _>(|j| global.M.get(i, j)))
            .collect::<Vec<_>>(),
    )
    .unwrap();
    // W = Hᵀ M⁻¹ H and q = Hᵀ M⁻¹ f + w, column by column.
    let mut lu = nonsmooth_linalg::SquareLu::default();
    lu.factorise(&m.into()).unwrap();
    let solve = |x: &[f64]| {
        let mut x = x.to_vec();
        lu.solve(&mut x);
        x
    };
    let k = global.H.ncols();
    let transposed = |x: &[f64]| {
        let mut y = vec![0.0; k];
        global.H.mul_transpose_add(1.0, x, &mut y);
        y
    };
    let mut entries = vec![];
    for j in 0..k {
        let column: Vec<f64> = (0..20).map(|i| global.H.get(i, j)).collect();
        let w = transposed(&solve(&column));
        entries.extend(w.into_iter().enumerate().map(|(i, x)| (i, j, x)));
    }
    let w = Csc::from_triplets(k, k, entries.into_iter()).unwrap();
    let q = moved(&transposed(&solve(&global.f)), &global.w, 1.0);
    let local: AnyProblem =
        FrictionLocal::<3>::new(Bsr::from_csc(&w), q, global.mu.clone()).unwrap().into();
    let global: AnyProblem = global.into();
    let direction = [1.0, -0.5, 0.25, 2.0];
    let [a, b] = [&local, &global].map(|problem| {
        let by = Derivative::of(problem, &solution(problem).0, 1e-8).unwrap();
        by.forward(&[("mu", Change::Vector(&direction))]).unwrap()
    });
    for name in ["r", "u"] {
        for (a, b) in a.part(name).unwrap().iter().zip(b.part(name).unwrap()) {
            assert!((a - b).abs() < 1e-8, "d{name}: {a} and {b}");
        }
    }
}

#[test]
fn what_has_no_derivative_says_so() {
    // More equalities than free variables, which agree with each other.
    let m = Dense::from_rows(&[[1.0], [2.0]]).unwrap();
    let over = Mlcp::rectangular(m, vec![-1.0, -2.0], 2, 1).unwrap();
    let at = LcpPoint { z: vec![1.0] };
    assert_eq!(Derivative::of_mlcp(&over, &at, 1e-8).unwrap_err(), DerivativeError::Singular);
    // A row between two bounds, perhaps equal, that are met with no velocity: it is at a border.
    for upper in [1.0, 0.0] {
        let rows = RowsLocal {
            V: Csc::zeros(2, 1),
            R: Csc::diagonal(&[1.0]),
            s: vec![0.0],
            bounds: Bounds { lower: vec![0.0], upper: vec![upper] },
        };
        let w = Bsr::<2>::from_csc(&Csc::diagonal(&[1.0, 1.0]));
        let local = FrictionLocal::with_rows(w, vec![-1.0, 0.1], vec![0.5], rows).unwrap();
        let at = LocalPoint { r: vec![1.0, -0.1], lambda: vec![0.0] };
        assert_eq!(Derivative::of_local(&local, &at, 1e-8).unwrap().degenerate, 1);
    }
}

/// Units of bodies and contacts that are far apart are no singularity.
#[test]
fn units_do_not_matter() {
    let mut random = Random(4);
    let mut problem = FrictionGlobal::<3> { rows: None, ..global::<3>(&mut random) };
    let plain = {
        let any: AnyProblem = problem.clone().into();
        let by = Derivative::of(&any, &solution(&any).0, 1e-8).unwrap();
        by.forward(&[("mu", Change::Vector(&[1.0; 4]))]).unwrap()
    };
    // Masses and impulses a million million times smaller.
    let unit = 1e-12;
    problem.M = Csc::from_triplets(
        20,
        20,
        problem.M.triplets().map(|(i, j, x)| (i, j, unit * x)).collect::<Vec<_>>().into_iter(),
    )
    .unwrap();
    problem.f.iter_mut().for_each(|f| *f *= unit);
    let any: AnyProblem = problem.into();
    let by = Derivative::of(&any, &solution(&any).0, 1e-8).unwrap();
    let scaled = by.forward(&[("mu", Change::Vector(&[1.0; 4]))]).unwrap();
    for (a, b) in plain.part("r").unwrap().iter().zip(scaled.part("r").unwrap()) {
        assert!((unit * a - b).abs() < 1e-8 * unit, "{a} and {b}");
    }
}

/// One box: pressed with N, pushed with T beyond friction; dr and du by hand.
#[test]
fn a_sliding_box_moves_as_by_hand() {
    let (mu, push) = (0.5, 2.0);
    let identity = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    let w = Bsr::from_rows(1, &[vec![(0, identity)]]);
    let problem = FrictionLocal::<3>::new(w, vec![-1.0, push, 0.0], vec![mu]).unwrap();
    let point = LocalPoint { r: vec![1.0, -mu, 0.0], lambda: vec![] };
    let derivative = Derivative::of_local(&problem, &point, 1e-10).unwrap();
    assert_eq!(derivative.degenerate, 0);
    let near = |a: &[f64], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    let moves = |letter: &str, change: &[f64], dr: [f64; 3]| {
        let moved = derivative.forward(&[(letter, Change::Vector(change))]).unwrap();
        near(moved.part("r").unwrap(), dr)
    };
    // Pressed more: r_N and the friction that goes with it.
    assert!(moves("q", &[-1.0, 0.0, 0.0], [1.0, -mu, 0.0]));
    // Pushed more: nothing. To the side: friction turns.
    assert!(moves("q", &[0.0, 1.0, 0.0], [0.0, 0.0, 0.0]));
    assert!(moves("q", &[0.0, 0.0, 1.0], [0.0, 0.0, -mu / push]));
    assert!(moves("mu", &[1.0], [0.0, -1.0, 0.0]));
    // ⟨g, dx⟩ = ⟨∂, dp⟩ for g = r_T2.
    let gradient = derivative.backward(&[("r", &[0.0, 0.0, 1.0])]).unwrap();
    assert!(near(gradient.vector("q").unwrap(), [0.0, 0.0, -mu / push]));
    assert!(gradient.vector("mu").unwrap()[0].abs() < 1e-14);
}

/// A contact without friction that rests: `t` has no direction, and none is asked for.
#[test]
fn a_frictionless_contact_at_rest_has_a_derivative() {
    let identity = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    let w = Bsr::from_rows(1, &[vec![(0, identity)]]);
    let problem = FrictionLocal::<3>::new(w, vec![-1.0, 0.0, 0.0], vec![0.0]).unwrap();
    let point = LocalPoint { r: vec![1.0, 0.0, 0.0], lambda: vec![] };
    let derivative = Derivative::of_local(&problem, &point, 1e-10).unwrap();
    assert_eq!(derivative.degenerate, 0);
    let moved = derivative.forward(&[("q", Change::Vector(&[-1.0, 1.0, 0.0]))]).unwrap();
    assert_eq!(moved.part("r").unwrap(), [1.0, 0.0, 0.0]);
    assert_eq!(moved.part("u").unwrap(), [0.0, 1.0, 0.0]);
}

#[test]
fn changes_that_are_none_are_refused() {
    let identity = Dense::from_rows(&[[1.0, 0.0], [0.0, 1.0]]).unwrap();
    let problem = Lcp::new(identity.clone(), vec![-1.0, 1.0]).unwrap();
    let point = LcpPoint { z: vec![1.0, 0.0] };
    let by = Derivative::of_lcp(&problem, &point, 1e-8).unwrap();
    let said = |changes: &[(&str, Change<'_>)]| by.forward(changes).unwrap_err().to_string();
    let [two, three] = [&[0.0; 2][..], &[0.0; 3]];
    assert_eq!(said(&[("q", Change::Vector(three))]), "dq: expected 2 entries, found 3");
    assert_eq!(said(&[("mu", Change::Vector(two))]), "derivative: expected one of q, found mu");
    let nan = said(&[("q", Change::Vector(&[0.0, f64::NAN]))]);
    assert_eq!(nan, "dq[1]: expected a finite number, found NaN");
    let thin = Dense::from_rows(&[[1.0, 0.0]]).unwrap().into();
    assert_eq!(said(&[("M", Change::Matrix(&thin))]), "dM: expected 2 × 2, found 1 × 2");
    let unknown = by.backward(&[("r", two)]).unwrap_err().to_string();
    assert_eq!(unknown, "derivative: expected one of z, w, found r");
    let other = AnyPoint::Local(LocalPoint::default());
    let found = Derivative::of(&problem.into(), &other, 1e-8).unwrap_err().to_string();
    assert_eq!(found, "the point: expected one of a problem lcp, found one of another kind");
}

#[test]
fn linear_problems_without_a_derivative_say_so() {
    // M_αα = 0 where z is free to choose, a degenerate pair, a point that is no solution.
    let m = |rows: &[[f64; 2]]| Dense::from_rows(rows).unwrap();
    let singular = Lcp::new(m(&[[1.0, 1.0], [1.0, 1.0]]), vec![-2.0, -2.0]).unwrap();
    let at = |z: [f64; 2]| LcpPoint { z: z.to_vec() };
    let found = Derivative::of_lcp(&singular, &at([1.0, 1.0]), 1e-8);
    assert_eq!(found.unwrap_err(), DerivativeError::Singular);
    let regular = Lcp::new(m(&[[1.0, 0.0], [0.0, 1.0]]), vec![-1.0, 0.0]).unwrap();
    assert_eq!(Derivative::of_lcp(&regular, &at([1.0, 0.0]), 1e-8).unwrap().degenerate, 1);
    let found = Derivative::of_lcp(&regular, &at([0.0, 0.0]), 1e-8).unwrap_err().to_string();
    assert!(found.starts_with("the point: expected a solution at tolerance 1e-8"), "{found}");
    // Two contacts of one body at one place share their load as they like.
    let identity = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    let row = || vec![(0, identity), (1, identity)];
    let shared = FrictionLocal::<2>::new(
        Bsr::from_rows(2, &[row(), row()]),
        vec![-1.0, 0.0, -1.0, 0.0],
        vec![0.5, 0.5],
    )
    .unwrap();
    let point = LocalPoint { r: vec![0.5, 0.0, 0.5, 0.0], lambda: vec![] };
    let found = Derivative::of_local(&shared, &point, 1e-8);
    assert_eq!(found.unwrap_err(), DerivativeError::Singular);
}
