//! The cost of F and its Jacobian from each source of functions, on the reaction `4 x_k − Σ x_neighbours − 10⁻³ e^{x_k}` of a five-point grid.
//!
//! `cargo run --release -p nonsmooth-bench --example fields -- [POINTS_ON_A_SIDE]`
//!
//! Columns: microseconds of F, and of F with JF, the fastest of 200; multiples of the hand-written closures; colours and how the pattern is known. Before it, the seconds of probing.

use std::hint::black_box;
use std::time::Instant;

use nonsmooth_problem::field::{
    Binary, Closures, Differences, Duals, Expressions, Field, Function, Graph, Node, Number,
    Pattern, Unary,
};

/// The neighbours of a point of an m by m grid and itself, ascending.
fn around(m: usize, k: usize) -> impl Iterator<Item = usize> + Clone {
    let (i, j) = (k / m, k % m);
    let near = [
        (i > 0).then(|| k - m),
        (j > 0).then(|| k - 1),
        Some(k),
        (j + 1 < m).then_some(k + 1),
        (i + 1 < m).then_some(k + m),
    ];
    near.into_iter().flatten()
}

#[derive(Clone, Copy)]
struct Grid(usize);

impl Function for Grid {
    fn dim(&self) -> usize {
        self.0 * self.0
    }

    fn at<T: Number>(&self, x: &[T], f: &mut [T]) {
        let m = self.0;
        for k in 0..m * m {
            let (i, j) = (k / m, k % m);
            let mut sum = x[k] * 4.0;
            if i > 0 {
                sum -= x[k - m];
            }
            if j > 0 {
                sum -= x[k - 1];
            }
            if j + 1 < m {
                sum -= x[k + 1];
            }
            if i + 1 < m {
                sum -= x[k + m];
            }
            f[k] = sum - x[k].exp() * 1e-3;
        }
    }
}

impl Grid {
    fn slopes(self, x: &[f64], slopes: &mut [f64]) {
        let mut slopes = slopes.iter_mut();
        for k in 0..self.0 * self.0 {
            let row =
                around(self.0, k).map(|j| if j == k { 4.0 - 1e-3 * x[k].exp() } else { -1.0 });
            row.zip(&mut slopes).for_each(|(from, to)| *to = from);
        }
    }

    fn expressions(self) -> Expressions {
        let n = self.dim();
        let mut g = Graph::new(n);
        let small = g.constant(1e-3);
        let row = |k: usize| {
            let terms = around(self.0, k).map(|j| (j, if j == k { 4.0 } else { -1.0 })).collect();
            let (x, linear) = (g.variable(k), g.add(Node::Linear(terms)));
            let growth = g.unary(Unary::Exp, x);
            let growth = g.binary(Binary::Mul, small, growth);
            g.binary(Binary::Sub, linear, growth)
        };
        let rows = (0..n).map(row).collect();
        Expressions::new(g, rows).expect("as many rows as variables")
    }
}

/// The fastest of several, in microseconds.
fn fastest(mut run: impl FnMut()) -> f64 {
    let times = (0..200).map(|_| {
        let begun = Instant::now();
        run();
        begun.elapsed().as_secs_f64()
    });
    1e6 * times.fold(f64::INFINITY, f64::min)
}

fn measure(field: &dyn Field, x: &[f64]) -> [f64; 2] {
    let mut run = field.evaluator();
    let (mut f, mut jacobian) = (vec![0.0; x.len()], vec![0.0; field.pattern().len()]);
    let value = fastest(|| {
        black_box(run.value(black_box(x), &mut f));
    });
    let both = fastest(|| {
        black_box(run.jacobian(black_box(x), &mut f, &mut jacobian));
    });
    [value, both]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = std::env::args().nth(1).map_or(Ok(141), |m| m.parse())?;
    let grid = Grid(m);
    let start = vec![0.0; grid.dim()];
    let value = move |x: &[f64], f: &mut [f64]| grid.at(x, f);
    let pattern = Pattern::new((0..grid.dim()).map(|k| around(m, k)));
    let begun = Instant::now();
    let duals = Duals::new(grid, &start)?;
    println!("probing by duals: {:.2} s", begun.elapsed().as_secs_f64());
    let begun = Instant::now();
    let differences = Differences::probed(&start, value)?;
    println!("probing by differences: {:.2} s", begun.elapsed().as_secs_f64());
    let closures = Closures::new(pattern, value, move |x, slopes| grid.slopes(x, slopes))?;
    let expressions = grid.expressions();
    let all: [&dyn Field; 4] = [&closures, &expressions, &duals, &differences];
    let x: Vec<f64> = (0..grid.dim()).map(|k| (0.01 * k as f64).sin()).collect();
    let mut unit = [f64::NAN; 2];
    for field in all {
        let times = measure(field, &x);
        if unit[0].is_nan() {
            unit = times;
        }
        println!(
            "{:8.1} us ({:4.2}), with JF {:8.1} us ({:5.2})   {}",
            times[0],
            times[0] / unit[0],
            times[1],
            times[1] / unit[1],
            field.source()
        );
    }
    Ok(())
}
