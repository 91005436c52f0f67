//! The registry: what it refuses, and that methods that share nothing agree.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, LocalPoint, Problem};
use nonsmooth_solve::registry::{abouts, session};
use nonsmooth_solve::settings::{SettingsMap, from_texts};
use nonsmooth_solve::{Limits, Status};

fn refusal(texts: &[&str]) -> String {
    let map = from_texts(texts).unwrap();
    session::<FrictionLocal<3>>("nsgs", &map).err().expect("refused").to_string()
}

#[test]
fn mistakes_in_settings_name_key_expected_and_found() {
    assert_eq!(
        refusal(&["omga=1"]),
        "solver `nsgs`: unknown key `omga` (did you mean `omega`?); there are: local, local_tolerance, omega, omega_min, \
         ordering, seed, freeze_after, freeze_for, anderson, anderson_every, check_every"
    );
    assert_eq!(
        refusal(&["omega=2.5"]),
        "solver `nsgs`: omega: expected a number in (0, 2), found 2.5"
    );
    assert_eq!(refusal(&["omega=fast"]), "solver `nsgs`: omega: expected a number, found \"fast\"");
    assert!(refusal(&["local=magic"]).contains("local: expected one of exact, quartic,"));
    assert!(refusal(&["seed=-1"]).contains("seed: expected a whole number"));
    assert!(refusal(&["check_every=0"]).contains("check_every: expected at least 1, found 0"));
}

#[test]
fn unknown_solvers_are_refused_with_those_that_exist() {
    let e = session::<FrictionLocal<3>>("lemke", &SettingsMap::new()).err().expect("refused");
    assert!(e.to_string().contains("unknown solver `lemke`") && e.to_string().contains("nsgs"));
    for name in ["condense/nsgs", "facet/nsgs", "nsgs/condense"] {
        assert!(session::<FrictionLocal<3>>(name, &SettingsMap::new()).is_err(), "{name}");
    }
    assert!(session::<FrictionGlobal<3>>("condense/nsgs", &SettingsMap::new()).is_ok());
}

#[test]
fn every_setting_is_documented() {
    for about in abouts::<FrictionLocal<3>>() {
        let settings = (about.settings)();
        assert!(!settings.is_empty(), "{}", about.name);
        assert!(settings.iter().all(|s| !s.help.is_empty()), "{}: {settings:?}", about.name);
    }
}

/// Methods that share no iteration find the same motion where W is regular.
#[test]
fn independent_methods_agree() {
    let planted = Planted { contacts: 20, dofs: 120, seed: 11, ..Planted::default() };
    let (problem, _) = planted.local::<3>();
    let motion = |name: &str, texts: &[&str]| {
        let settings = from_texts(texts).unwrap();
        let mut session = session::<FrictionLocal<3>>(name, &settings).unwrap();
        let mut point = problem.origin();
        let limits = nonsmooth_solve::Limits {
            tolerance: 1e-11,
            max_iterations: 100_000,
            ..nonsmooth_solve::Limits::default()
        };
        let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, nonsmooth_solve::Status::Solved, "{name} {texts:?}");
        let mut u = vec![0.0; problem.q.len()];
        problem.W.mul_plus(&point.r, &problem.q, &mut u);
        u
    };
    let reference = motion("nsgs", &[]);
    let size = nonsmooth_linalg::norm(&problem.q);
    for (name, texts) in [
        ("psor", vec![]),
        ("nsgs_colored", vec!["threads=2", "serial_below=1"]),
        ("nsgs", vec!["anderson=5"]),
        ("nsgs", vec!["local=newton_ac", "local_tolerance=adaptive"]),
        ("nsgs", vec!["local=projection_iterated", "local_tolerance=adaptive"]),
        ("extragradient", vec!["rule=solodov_tseng"]),
        ("hyperplane", vec![]),
        ("proximal/extragradient", vec![]),
        ("admm", vec![]),
        ("admm", vec!["rule=fixed", "anderson=5"]),
        ("proximal/nsgs", vec![]),
        ("proximal/admm", vec!["prox_rule=residual"]),
    ] {
        let u = motion(name, &texts);
        let far = u.iter().zip(&reference).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(far < 1e-8 * size, "{name} {texts:?}: {far:e}");
    }
}

/// The rounding of a start that is far too large stays in the velocities that sweeps of a global problem carry along: a sweep that moves nothing is no end before they are renewed.
#[test]
fn a_start_that_is_far_too_large_is_no_end() {
    let identity = || Csc::diagonal(&[1.0; 3]);
    let (f, w, mu) = (vec![-1.0, 0.3, 0.0], vec![0.0; 3], vec![0.5]);
    let problem = FrictionGlobal::<3>::new(identity(), identity(), f, w, mu).unwrap();
    for name in ["nsgs", "nsgs_colored", "psor"] {
        for size in (0..=20).map(|e| 10.0_f64.powi(e)) {
            for tolerance in [1e-8, 1e-12] {
                let mut session = session(name, &SettingsMap::new()).unwrap();
                let mut point = problem.origin();
                point.r.copy_from_slice(&[size, -0.7 * size, -0.7 * size]);
                let limits = Limits { tolerance, ..Limits::default() };
                let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
                assert_eq!(outcome.status, Status::Solved, "{name} from {size:e} to {tolerance:e}");
            }
        }
    }
}

/// A contact between two bodies whose motion is given has no block in W: what it pressed with in the step before is taken back where it opens.
/// Where squares overflow no step of the projection is short enough by its rule.
#[test]
fn a_start_whose_squares_overflow_ends() {
    let block = [[1e6, 0.0, 0.0], [0.0, 1e6, 0.0], [0.0, 0.0, 1e6]];
    let w = Bsr::from_rows(1, &[vec![(0, block)]]);
    let problem = FrictionLocal::<3>::new(w, vec![-1.0, 1.0, 0.0], vec![0.5]).unwrap();
    let settings = from_texts(&["local=projection_iterated"]).unwrap();
    for solver in ["nsgs", "nsgs_colored"] {
        for scale in [1e100, 1e149, 1e154, 1e200, 1e300] {
            let mut session = session::<FrictionLocal<3>>(solver, &settings).unwrap();
            let r = [1.0, -3.0, 2.0].map(|x| scale * x).to_vec();
            let mut point = LocalPoint { r, lambda: vec![] };
            let limits = Limits { max_iterations: 50, ..Limits::default() };
            let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert!(point.r.iter().all(|r| r.is_finite()), "{solver} {scale:e} {outcome:?}");
        }
    }
}

#[test]
fn a_contact_without_a_block_does_not_keep_its_impulse() {
    let w = Csc::from_triplets(6, 6, (0..3).map(|i| (i, i, 1.0))).unwrap();
    let q = vec![-1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let problem = FrictionLocal::<3>::new(Bsr::from_csc(&w), q, vec![0.5; 2]).unwrap();
    for name in ["nsgs", "nsgs_colored", "psor", "auto"] {
        let mut session = session(name, &SettingsMap::new()).unwrap();
        let mut point = problem.origin();
        point.r.copy_from_slice(&[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        let outcome = session.solve(&problem, &mut point, &Limits::default(), &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{name}: {:?}", point.r);
    }
}
