//! The quadratic program: boxes, both forms, what it needs.

use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{BoxLcp, Lcp, Mlcp, Problem};
use nonsmooth_solve::registry::{self};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::{Limits, Status};

use super::{ALL, Numbers, gram, off, planted, run, run_from};
use crate::common::w_of;

#[test]
fn programs_take_boxes_and_both_forms() {
    for n in [1, 4, 30, 100] {
        for seed in 0..4 {
            let numbers = &mut Numbers(seed + 5 * n as u64);
            let m = gram(n, if seed % 2 == 0 { n } else { n.div_ceil(2) }, 0.0, numbers);
            let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
            let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
            for i in 0..n {
                (lower[i], upper[i]) = match numbers.bits() % 5 {
                    0 => (-1.0, 2.0),
                    1 => (f64::NEG_INFINITY, 1.0),
                    2 => (0.5, f64::INFINITY),
                    3 => (f64::NEG_INFINITY, f64::INFINITY),
                    _ => (0.25, 0.25),
                };
                let side = numbers.within(-1.0, 1.0);
                let size = numbers.within(0.5, 1.0);
                if side < -0.3 && lower[i].is_finite() {
                    (z[i], w[i]) = (lower[i], size);
                } else if (side > 0.3 && upper[i].is_finite()) || lower[i] == upper[i] {
                    (z[i], w[i]) = (upper[i], -size);
                } else {
                    z[i] = lower[i].max(-2.0) + 0.5 * (upper[i].min(2.0) - lower[i].max(-2.0));
                }
            }
            let mut q = vec![0.0; n];
            Matrix::from(m.clone()).mul(&z, &mut q);
            q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
            for m in [Matrix::from(m.clone()), m.to_csc().into()] {
                let problem = BoxLcp::new(m, q.clone(), lower.clone(), upper.clone()).unwrap();
                let run = run(&problem, "qp", 1e-11);
                assert_eq!(
                    run.outcome.status,
                    Status::Solved,
                    "n = {n}, seed {seed}: {:?}, {:?}",
                    run.outcome.measure,
                    run.account
                );
            }
            let (_, w, q) = planted(&Matrix::from(m.clone()), 0.3, numbers);
            let problem = Lcp::new(m, q).unwrap();
            for form in ["form=energy", "form=gap"] {
                let run = run_from(&problem, "qp", &[form], 1e-11, problem.origin());
                assert_eq!(
                    run.outcome.status,
                    Status::Solved,
                    "{form}, n = {n}, seed {seed}: {:?}, {:?}",
                    run.outcome.measure,
                    run.account
                );
                assert!(off(&w_of(&problem, &run.point.z), &w) < 1e-8);
            }
        }
    }
}

#[test]
fn programs_say_what_they_need() {
    let refusal = |problem: &dyn Fn() -> String| problem();
    let lcp = |rows: &[[f64; 2]], settings: &[&str]| {
        let problem = Lcp::new(Dense::from_rows(rows).unwrap(), vec![-1.0, 1.0]).unwrap();
        let mut session = registry::session::<Lcp>("qp", &from_texts(settings).unwrap()).unwrap();
        session
            .solve(&problem, &mut problem.origin(), &Limits::default(), &mut |_| {})
            .unwrap_err()
            .to_string()
    };
    let indefinite = refusal(&|| lcp(&[[1.0, 2.0], [2.0, 1.0]], &[]));
    assert!(indefinite.contains("a positive semidefinite M"), "{indefinite}");
    let skew = refusal(&|| lcp(&[[1.0, 2.0], [-2.0, 1.0]], &["form=energy"]));
    assert!(skew.contains("a symmetric M"), "{skew}");
    let boxed =
        BoxLcp::new(Dense::from_rows(&[[1.0]]).unwrap(), vec![1.0], vec![0.0], vec![1.0]).unwrap();
    let mut session =
        registry::session::<BoxLcp>("qp", &from_texts(&["form=gap"]).unwrap()).unwrap();
    let error =
        session.solve(&boxed, &mut boxed.origin(), &Limits::default(), &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("free or nonnegative"), "{error}");
    let rectangular = Mlcp::rectangular(Dense::zeros(3, 2), vec![0.0; 3], 2, 1).unwrap();
    for name in ALL {
        let mut session =
            registry::session::<Mlcp>(name, &from_texts::<&str>(&[]).unwrap()).unwrap();
        let error = session
            .solve(&rectangular, &mut rectangular.origin(), &Limits::default(), &mut |_| {})
            .unwrap_err();
        assert!(error.is_inapplicable(), "{name}: {error}");
    }
}

#[test]
fn an_unbounded_box_is_refuted() {
    // min −z_1 + …, z_1 unbounded above with a zero row; the third variable only below.
    let m = Dense::from_rows(&[[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).unwrap();
    let (lower, upper) =
        (vec![f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0], vec![0.0, f64::INFINITY, 1.0]);
    // y = (−1, 1, 0): M y = 0, qᵀy = −2.
    let problem = BoxLcp::new(m, vec![1.0, -1.0, 0.5], lower, upper).unwrap();
    let run = run(&problem, "qp", 1e-9);
    assert!(
        run.outcome.status.refutes()
            && matches!(run.outcome.status.certificate(), Some(Certificate::Farkas { .. })),
        "{:?} {:?}",
        run.outcome.status,
        run.account
    );
}
