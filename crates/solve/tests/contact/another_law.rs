//! A law that the library does not have, rolling friction in the plane, enters by its type alone: what is asked of it here is all that Gauss–Seidel with projections
//! and the projection methods ask of any law.
//!
//! A contact has the components `[N, T, R]`, R a moment: `K = {|r_T| ≤ mu r_N, |r_R| ≤ mu_r r_N}`, `ũ = u + (mu|u_T| + mu_r|u_R|) e_N`.

use nonsmooth_linalg::small;
use nonsmooth_problem::check::{Certificate, ConeSystem, Evidence, Impulses, LocalGauge, Measure};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{Bounds, FrictionLocal, Kind, LocalPoint, Problem, ProblemError};
use nonsmooth_solve::contact::form::{Access, Blockwise, Contacts, Linear, LocalState, Rows};
use nonsmooth_solve::contact::law::ContactLaw;
use nonsmooth_solve::contact::law::cone::ConvexSet;
use nonsmooth_solve::contact::law::local::{Projection, ProjectionIterated};
use nonsmooth_solve::contact::projection::{DeSaxce, Extragradient, Projected};
use nonsmooth_solve::contact::splitting::{Nsgs, Sweeps};
use nonsmooth_solve::{SolveError, Solver, Step};

#[derive(Debug, Clone, Copy)]
struct Rolling {
    mu: f64,
    mu_r: f64,
}

impl ConvexSet<3> for Rolling {
    /// With the normal part n given, the others are clamped; `g(n) = n − x_N − mu (|x_T| − mu n)₊ − mu_r (|x_R| − mu_r n)₊` is piecewise linear and increasing.
    fn project(&self, x: &[f64; 3]) -> [f64; 3] {
        let Self { mu, mu_r } = *self;
        let parts = [(mu, x[1].abs()), (mu_r, x[2].abs())];
        let g =
            |n: f64| n - x[0] - parts.iter().map(|(mu, t)| mu * (t - mu * n).max(0.0)).sum::<f64>();
        let n = if g(0.0) >= 0.0 {
            0.0
        } else {
            let (mut a, mut b) =
                (0.0, 1.0 + x.iter().map(|x| x.abs()).sum::<f64>() * (1.0 + mu + mu_r));
            while b - a > 1e-16 * b {
                let m = 0.5 * (a + b);
                if m <= a || m >= b {
                    break;
                }
                if g(m) < 0.0 { a = m } else { b = m }
            }
            b
        };
        [n, x[1].clamp(-mu * n, mu * n), x[2].clamp(-mu_r * n, mu_r * n)]
    }

    fn jacobian(&self, x: &[f64; 3]) -> [[f64; 3]; 3] {
        let p = self.project(x);
        let h = 1e-7;
        let mut out = [[0.0; 3]; 3];
        for l in 0..3 {
            let mut y = *x;
            y[l] += h;
            let q = self.project(&y);
            (0..3).for_each(|k| out[k][l] = (q[k] - p[k]) / h);
        }
        out
    }
}

impl ContactLaw<3> for Rolling {
    fn shift(&self, u: &[f64; 3]) -> f64 {
        self.mu * u[1].abs() + self.mu_r * u[2].abs()
    }

    fn is_frictionless(&self) -> bool {
        false
    }
}

/// The data of a local problem under another law. Its judge, Coulomb's, is not asked.
#[derive(Clone)]
struct Rolled {
    data: FrictionLocal<3>,
    mu_r: Vec<f64>,
}

impl Problem for Rolled {
    type Point = LocalPoint;
    type Gauge = LocalGauge;

    fn kind(&self) -> Kind {
        self.data.kind()
    }

    fn unknowns(&self) -> usize {
        self.data.unknowns()
    }

    fn origin(&self) -> LocalPoint {
        self.data.origin()
    }

    fn validate(&self) -> Result<(), ProblemError> {
        self.data.validate()
    }

    fn validate_point(&self, point: &LocalPoint) -> Result<(), ProblemError> {
        self.data.validate_point(point)
    }

    fn copy_point(from: &LocalPoint, to: &mut LocalPoint) {
        FrictionLocal::<3>::copy_point(from, to);
    }

    fn gauge(&self) -> Result<LocalGauge, ProblemError> {
        self.data.gauge()
    }

    fn measure(&self, point: &LocalPoint, gauge: &mut LocalGauge) -> Measure {
        self.data.measure(point, gauge)
    }

    fn certify(&self, point: &LocalPoint, gauge: &mut LocalGauge) -> Measure {
        self.data.certify(point, gauge)
    }

    fn partner(&self, point: &LocalPoint) -> Vec<f64> {
        self.data.partner(point)
    }

    fn evidence(&self, _: &Certificate) -> Evidence {
        Evidence::Nothing
    }

    fn cones(&self) -> Option<ConeSystem> {
        None
    }

    fn assembled(&self, unknowns: &[f64]) -> LocalPoint {
        self.data.assembled(unknowns)
    }
}

impl Contacts<3> for Rolled {
    type Law = Rolling;
    type State = LocalState<3>;

    fn state(&self, access: Access) -> Result<Self::State, SolveError> {
        self.data.state(access)
    }

    fn refill(&self, state: &mut Self::State) -> Result<(), SolveError> {
        self.data.refill(state)
    }

    fn contradiction<'a>(&self, _: &'a Self::State) -> Option<&'a Impulses> {
        None
    }

    fn contacts(&self) -> usize {
        self.mu_r.len()
    }

    fn law(&self, c: usize) -> Rolling {
        Rolling { mu: self.data.mu[c], mu_r: self.mu_r[c] }
    }

    fn diagonal_block(&self, state: &Self::State, c: usize) -> [[f64; 3]; 3] {
        self.data.diagonal_block(state, c)
    }

    fn velocity_scale(&self, state: &Self::State) -> f64 {
        self.data.velocity_scale(state)
    }

    fn impulses(point: &mut LocalPoint) -> &mut [f64] {
        &mut point.r
    }

    fn enter(&self, _: &mut Self::State, _: &LocalPoint) {}

    fn complete(&self, _: &mut Self::State, _: &mut LocalPoint) {}
}

impl Rows<3> for Rolled {
    fn bounds(&self) -> Option<&Bounds> {
        None
    }

    fn all_impulses(point: &mut LocalPoint) -> (&mut [f64], &mut [f64]) {
        (&mut point.r, &mut point.lambda)
    }

    fn row_response(&self, _: &Self::State, _: usize) -> f64 {
        0.0
    }

    fn row_velocity(&self, _: &Self::State, _: &[f64], _: &[f64], _: usize) -> f64 {
        0.0
    }

    fn row_moved(&self, _: &mut Self::State, _: usize, _: f64) {}
}

impl Blockwise<3> for Rolled {
    fn velocity(&self, state: &Self::State, r: &[f64], c: usize) -> [f64; 3] {
        self.data.velocity(state, r, c)
    }

    fn moved(&self, _: &mut Self::State, _: usize, _: &[f64; 3]) {}
}

impl Linear<3> for Rolled {
    fn velocities(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        self.data.velocities(state, r, u);
    }

    fn velocities_precisely(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        self.data.velocities_precisely(state, r, u);
    }
}

/// A problem with contacts that are open, stick, slide, roll, and slide while they roll, and that solution.
fn planted(seed: u64) -> (Rolled, Vec<f64>) {
    let (mut data, _) = Planted { contacts: 10, dofs: 60, seed, ..Planted::default() }.local::<3>();
    let mu_r: Vec<f64> = (0..10).map(|c| 0.05 + 0.02 * c as f64).collect();
    let (mut u, mut r) = (vec![], vec![]);
    for c in 0..10 {
        let (mu, mu_r) = (data.mu[c], mu_r[c]);
        let (of_u, of_r) = match c % 5 {
            0 => ([0.5, 0.3, -0.2], [0.0; 3]),
            1 => ([0.0; 3], [1.0, 0.4 * mu, -0.3 * mu_r]),
            2 => ([0.0, 0.7, 0.0], [0.8, -0.8 * mu, 0.2 * mu_r]),
            3 => ([0.0, 0.0, -0.4], [0.6, 0.1 * mu, 0.6 * mu_r]),
            _ => ([0.0, -0.5, 0.6], [0.9, 0.9 * mu, -0.9 * mu_r]),
        };
        u.extend(of_u);
        r.extend(of_r);
    }
    // q = u − W r.
    let mut wr = vec![0.0; 30];
    data.W.mul_plus(&r, &[0.0; 30], &mut wr);
    data.q = u.iter().zip(&wr).map(|(u, wr)| u - wr).collect();
    (Rolled { data, mu_r }, r)
}

/// `‖r − P_K(r − ũ)‖`, from the definition.
fn residual(problem: &Rolled, r: &[f64]) -> f64 {
    let u = problem.partner(&LocalPoint { r: r.to_vec(), lambda: vec![] });
    let of = |c: usize| {
        let (law, x) = (problem.law(c), small::block::<3>(r, c));
        let mut y: [f64; 3] = small::block(&u, c);
        y[0] += law.shift(&y);
        let p = law.project(&std::array::from_fn(|k| x[k] - y[k]));
        (0..3).map(|k| (x[k] - p[k]).powi(2)).sum::<f64>()
    };
    (0..problem.contacts()).map(of).sum::<f64>().sqrt()
}

fn solved(problem: &Rolled, solver: impl Solver<Rolled>, steps: usize) -> f64 {
    let mut work = solver.work(problem).unwrap();
    let mut point = problem.origin();
    solver.start(problem, &mut point, &mut work);
    for _ in 0..steps {
        if !matches!(solver.step(problem, &mut point, &mut work), Step::Continue { .. }) {
            break;
        }
    }
    solver.publish(problem, &mut point, &mut work);
    residual(problem, &point.r)
}

#[test]
fn methods_that_ask_for_a_law_alone_solve_rolling_friction() {
    for seed in 0..4 {
        let (problem, r) = planted(seed);
        assert!(residual(&problem, &r) < 1e-12);
        let sweeps = |_: ()| Nsgs::default();
        let one = Sweeps { settings: sweeps(()), local: Projection::default() };
        let iterated = Sweeps { settings: sweeps(()), local: ProjectionIterated::default() };
        let found = [
            solved(&problem, one, 20_000),
            solved(&problem, iterated, 5_000),
            solved(&problem, Projected::<_, 3>(Extragradient::default()), 20_000),
            solved(&problem, Projected::<_, 3>(DeSaxce::default()), 50_000),
        ];
        assert!(found.iter().all(|x| *x < 1e-7), "{seed}: {found:?}");
    }
}

#[test]
fn the_projection_on_the_cone_of_rolling_friction_is_one() {
    let law = Rolling { mu: 0.6, mu_r: 0.2 };
    for i in 0..200 {
        let a = f64::from(i);
        let x = [(0.7 * a).sin(), 1.5 * (1.3 * a).cos(), (0.9 * a).sin()];
        let p = law.project(&x);
        let again = law.project(&p);
        assert!((0..3).all(|k| (p[k] - again[k]).abs() < 1e-14), "{x:?}");
        // x − p is in the polar cone and orthogonal to p.
        let d: [f64; 3] = std::array::from_fn(|k| x[k] - p[k]);
        assert!((0..3).map(|k| d[k] * p[k]).sum::<f64>().abs() < 1e-14, "{x:?}");
        assert!(d[0] + law.mu * d[1].abs() + law.mu_r * d[2].abs() < 1e-14, "{x:?}");
    }
}
