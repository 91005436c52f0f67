//! The sources of functions beside each other.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;

/// A random function, as a list of operations on what comes before.
#[derive(Clone)]
struct Program {
    n: usize,
    steps: Vec<(usize, usize, usize)>,
    rows: Vec<usize>,
}

impl Program {
    fn random(n: usize, seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let steps = (0..3 * n).map(|k| {
            let mut any = || random.random_range(0..n + k);
            let (a, b) = (any(), any());
            (random.random_range(0..7), a, b)
        });
        let steps = steps.collect();
        let rows = (0..n).map(|_| random.random_range(0..4 * n)).collect();
        Self { n, steps, rows }
    }

    fn expressions(&self) -> Expressions {
        let mut g = Graph::new(self.n);
        let mut all: Vec<Id> = (0..self.n).map(|i| g.variable(i)).collect();
        let (one, third) = (g.constant(1.0), g.constant(0.3));
        for &(op, a, b) in &self.steps {
            let (a, b) = (all[a], all[b]);
            let made = match op {
                0 => g.binary(Binary::Add, a, b),
                1 => g.binary(Binary::Sub, a, b),
                2 => g.binary(Binary::Mul, a, b),
                3 => g.unary(Unary::Sin, a),
                4 => {
                    let square = g.binary(Binary::Mul, b, b);
                    let sum = g.binary(Binary::Add, square, one);
                    g.binary(Binary::Div, a, sum)
                }
                5 => g.unary(Unary::Atan, a),
                _ => g.binary(Binary::Mul, a, third),
            };
            all.push(made);
        }
        Expressions::new(g, self.rows.iter().map(|&i| all[i]).collect()).unwrap()
    }
}

#[cfg(feature = "duals")]
impl Function for Program {
    fn dim(&self) -> usize {
        self.n
    }

    fn at<T: Number>(&self, x: &[T], f: &mut [T]) {
        let mut all = x.to_vec();
        for &(op, a, b) in &self.steps {
            let (a, b) = (all[a], all[b]);
            all.push(match op {
                0 => a + b,
                1 => a - b,
                2 => a * b,
                3 => a.sin(),
                4 => a / (b * b + 1.0),
                5 => a.atan(),
                _ => a * 0.3,
            });
        }
        f.iter_mut().zip(&self.rows).for_each(|(f, &i)| *f = all[i]);
    }
}

/// The Jacobian at x with all its zeros, and F.
fn dense(field: &dyn Field, x: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let n = field.dim();
    let (mut f, mut j) = (vec![0.0; n], vec![0.0; field.pattern().len()]);
    assert!(field.evaluator().jacobian(x, &mut f, &mut j));
    let mut out = vec![vec![0.0; n]; n];
    field.pattern().places().zip(&j).for_each(|((i, k), j)| out[i][k] = *j);
    (out, f)
}

/// As a closure.
fn closure(field: &Expressions) -> impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static {
    let field = field.clone();
    move |x, f| {
        field.evaluator().value(x, f);
    }
}

#[test]
fn the_sources_of_a_random_function_agree() {
    for seed in 0..20 {
        let n = 3 + seed as usize;
        let program = Program::random(n, seed);
        let exact = program.expressions();
        let start = vec![0.5; n];
        let differences = Differences::probed(&start, closure(&exact)).unwrap();
        let mut random = Pcg64::seed_from_u64(seed);
        for _ in 0..5 {
            let x: Vec<_> = (0..n).map(|_| random.random_range(-1.0..1.0)).collect();
            let (jacobian, f) = dense(&exact, &x);
            let agrees = |field: &dyn Field, tolerance: f64| {
                let (other, value) = dense(field, &x);
                for i in 0..n {
                    assert!((value[i] - f[i]).abs() <= 1e-13 * (1.0 + f[i].abs()));
                    for j in 0..n {
                        let (a, b) = (jacobian[i][j], other[i][j]);
                        assert!(
                            (a - b).abs() <= tolerance * (1.0 + a.abs()),
                            "{seed} {i} {j} {a} {b}"
                        );
                    }
                }
            };
            agrees(&differences, 1e-6);
            #[cfg(feature = "duals")]
            agrees(&Duals::new(program.clone(), &start).unwrap(), 1e-12);
        }
        #[cfg(feature = "duals")]
        assert_eq!(Duals::new(program, &start).unwrap().pattern(), exact.pattern(), "{seed}");
    }
}

/// The place of a point of an m by m grid and of its neighbours, ascending.
fn neighbours(m: usize, k: usize) -> Vec<usize> {
    let (i, j) = (k / m, k % m);
    let mut all = vec![k];
    all.extend((i > 0).then(|| k - m));
    all.extend((i + 1 < m).then(|| k + m));
    all.extend((j > 0).then(|| k - 1));
    all.extend((j + 1 < m).then(|| k + 1));
    all.sort_unstable();
    all
}

/// `4 x_k − Σ x_neighbours − e^{x_k}`
#[derive(Clone, Copy)]
struct Grid(usize);

impl Grid {
    fn pattern(self) -> Pattern {
        Pattern::new((0..self.0 * self.0).map(|k| neighbours(self.0, k).into_iter()))
    }
}

#[cfg(feature = "duals")]
impl Function for Grid {
    fn dim(&self) -> usize {
        self.0 * self.0
    }

    fn at<T: Number>(&self, x: &[T], f: &mut [T]) {
        for k in 0..x.len() {
            let around = neighbours(self.0, k);
            let sum: T = around.iter().filter(|&&j| j != k).map(|&j| x[j]).sum();
            f[k] = x[k] * 4.0 - sum - x[k].exp();
        }
    }
}

#[test]
fn a_grid_of_five_points_has_few_colours_and_is_found_by_few_probes() {
    let grid = Grid(40);
    let pattern = grid.pattern();
    let colours = pattern.groups(1600).len();
    assert!((5..=7).contains(&colours), "{colours}");
    let (mut values, mut probes) = (vec![0.0; 1600], 0);
    let found = probe::probed(1600, 1, |sets, seen| {
        probes += 1;
        let mut marked = vec![0.0; 1600];
        sets[0].iter().for_each(|&j| marked[j] = 1.0);
        for (i, value) in values.iter_mut().enumerate() {
            *value = pattern.row(i).iter().map(|&j| marked[j]).sum();
            seen[0][i] = if *value > 0.0 { probe::Seen::Yes } else { probe::Seen::No };
        }
    });
    assert_eq!(found, pattern);
    assert!(probes < 200, "{probes}");
    #[cfg(feature = "duals")]
    assert_eq!(*Duals::new(grid, &[0.0; 1600]).unwrap().pattern(), pattern);
}

#[test]
fn where_nothing_is_known_of_a_row_it_is_full() {
    let differences = Differences::probed(&[-200.0, 1.0], |x, f| {
        f.copy_from_slice(&[(x[0] - 1e6).ln(), x[1]]);
    });
    let pattern = differences.unwrap().pattern().clone();
    assert_eq!((pattern.row(0), pattern.row(1)), (&[0, 1][..], &[1][..]));
}

/// log and root, at the border of where they are defined and beyond.
#[test]
fn undefined_values_and_slopes_are_said() {
    let f = |x: &[f64], f: &mut [f64]| f.copy_from_slice(&[x[0].ln(), x[1] * x[1].sqrt()]);
    let differences = Differences::probed(&[1.0, 1.0], f).unwrap();
    let closures = Closures::new(differences.pattern().clone(), f, |x, j| {
        j.copy_from_slice(&[1.0 / x[0], 1.5 * x[1].sqrt()]);
    });
    let closures = closures.unwrap();
    let fields: [&dyn Field; 2] = [&differences, &closures];
    let (mut value, mut jacobian) = ([0.0; 2], [0.0; 2]);
    for field in fields {
        let mut run = field.evaluator();
        assert!(!run.value(&[-1.0, 1.0], &mut value));
        assert!(!run.jacobian(&[0.0, 1.0], &mut value, &mut jacobian));
        // A root's slope of zero, from one side.
        assert!(run.jacobian(&[2.0, 0.0], &mut value, &mut jacobian));
        assert!((jacobian[0] - 0.5).abs() < 1e-9 && jacobian[1].abs() < 1e-3, "{jacobian:?}");
    }
}

#[test]
fn a_pattern_that_is_none_is_refused() {
    let refused = |rows: &[&[usize]]| {
        let pattern = Pattern::new(rows.iter().map(|row| row.iter().copied()));
        Differences::new(pattern, |_, _| ()).unwrap_err().to_string()
    };
    assert_eq!(refused(&[]), "pattern: expected at least one row, found none");
    let said = refused(&[&[0], &[0, 2]]);
    assert_eq!(said, "pattern[1][1]: expected columns below 2 in ascending order, found 2");
    assert!(refused(&[&[1, 0], &[0]]).starts_with("pattern[0][1]:"));
    assert!(Differences::probed(&[f64::NAN], |_, _| ()).is_err());
}

/// F and JF by closures that count how often they are asked; J by differences without the second.
#[test]
fn within_a_computation_closures_are_not_asked_twice_at_a_point() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use nonsmooth_linalg::budget::Budget;

    let asked = Arc::new([AtomicUsize::new(0), AtomicUsize::new(0)]);
    let counted = |which: usize| {
        let asked = asked.clone();
        move || asked[which].fetch_add(1, Ordering::Relaxed)
    };
    let so_far = || [0, 1].map(|which: usize| asked[which].swap(0, Ordering::Relaxed));
    let pattern = || Pattern::dense(2);
    let (value, slope, alone) = (counted(0), counted(1), counted(0));
    let f = |x: &[f64], f: &mut [f64]| (f[0], f[1]) = (x[0].ln(), x[0] * x[1]);
    let closures = Closures::new(
        pattern(),
        move |x, out| {
            value();
            f(x, out);
        },
        move |x, j| {
            slope();
            j.copy_from_slice(&[1.0 / x[0], 0.0, x[1], x[0]]);
        },
    );
    let differences = Differences::new(pattern(), move |x, out| {
        alone();
        f(x, out);
    });
    let fields: [(Arc<dyn Field>, _); 2] =
        [(Arc::new(closures.unwrap()), [1, 1]), (Arc::new(differences.unwrap()), [5, 0])];
    for (field, once) in fields {
        let look = |at: &[f64]| {
            // Of judge and solver.
            let (mut f, mut j) = ([0.0; 2], [0.0; 4]);
            for mut evaluator in [field.evaluator(), field.evaluator()] {
                evaluator.value(at, &mut f);
                evaluator.jacobian(at, &mut f, &mut j);
            }
            (f, j)
        };
        for _ in 0..2 {
            let _scope = Budget::default().enter();
            let first = look(&[2.0, 3.0]);
            assert_eq!(so_far(), once);
            assert_eq!((look(&[2.0, 3.0]), so_far()), (first, [0, 0]));
            // Another point, but for a bit of its sign, and back.
            look(&[2.0, 0.0]);
            look(&[2.0, -0.0]);
            assert_eq!(so_far(), once.map(|count| 2 * count));
            assert_eq!((look(&[2.0, 3.0]).0, so_far()[0] <= once[0]), (first.0, true));
            so_far();
            // What is not defined is asked again.
            look(&[-1.0, 3.0]);
            assert!(so_far()[0] >= 2);
        }
        look(&[2.0, 3.0]);
        assert!(so_far()[0] >= 2 * once[0]);
    }
}
