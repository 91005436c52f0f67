//! Scalar rows with bounds: the judge on planted points, on points that break each part of the law, and in exact numbers.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::check::{Evidence, Judged};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{
    Bounds, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Problem, RowsGlobal, RowsLocal,
};

fn cases() -> impl Iterator<Item = Planted> {
    (0..12).map(|seed| Planted {
        contacts: 6,
        dofs: 40,
        bilateral: seed as usize % 3,
        bounded: 1 + seed as usize % 5,
        seed,
        ..Planted::default()
    })
}

fn relative<P: Judged>(problem: &P, point: &P::Point) -> (bool, f64) {
    let verdict = problem.judge(point, 1e-10).unwrap();
    (verdict.solved, verdict.measure.bilateral.unwrap())
}

#[test]
fn planted_points_are_solutions() {
    for case in cases() {
        fn check<const D: usize>(case: &Planted) {
            let (global, point) = case.global::<D>();
            assert!(global.rows.as_ref().unwrap().bounds.bounded().count() == case.bounded);
            let (solved, bilateral) = relative(&global, &point);
            assert!(solved && bilateral < 1e-12, "{case:?} {bilateral:e}");
            let (local, point) = case.local::<D>();
            let (solved, bilateral) = relative(&local, &point);
            assert!(solved && bilateral < 1e-12, "{case:?} {bilateral:e}");
        }
        check::<2>(&case);
        check::<3>(&case);
    }
}

/// An impulse beyond its bound, a velocity of the wrong sign at a bound, and one that does not vanish between.
#[test]
fn each_part_of_the_law_of_a_row_is_judged() {
    for case in cases() {
        let (local, point) = case.local::<3>();
        let rows = local.rows.as_ref().unwrap();
        for j in rows.bounds.bounded() {
            let [l, u] = rows.bounds.of(j);
            // As if the bound lay where the impulse is not allowed to be.
            let mut narrow = local.clone();
            let own = &mut narrow.rows.as_mut().unwrap().bounds;
            if u.is_finite() {
                own.upper[j] = point.lambda[j] - 0.1;
                own.lower[j] = l.min(own.upper[j]);
            } else {
                own.lower[j] = point.lambda[j] + 0.1;
            }
            assert!(!relative(&narrow, &point).0, "{case:?} row {j}");
            // The velocity of the row turned round, or made where there was none.
            let mut turned = local.clone();
            let s = &mut turned.rows.as_mut().unwrap().s[j];
            let at_lower = point.lambda[j] == l;
            *s += if at_lower { -2.0 } else { 2.0 };
            assert!(!relative(&turned, &point).0, "{case:?} row {j}");
        }
    }
}

/// A point mass on the ground with a motor along it: `M v = f + r + λ e_x`, the motor holds `v_x = 1` as long as its impulse stays within `[−τ, τ]`.
fn motor(limit: f64) -> FrictionGlobal<2> {
    // Columns of H by [N, T]: N is y, T is x.
    let h = Csc::from_triplets(2, 2, [(1, 0, 1.0), (0, 1, 1.0)].into_iter()).unwrap();
    let g = Csc::from_triplets(2, 1, [(0, 0, 1.0)].into_iter()).unwrap();
    let mut problem = FrictionGlobal::new(
        Csc::diagonal(&[1.0, 1.0]),
        h,
        vec![0.0, -2.0],
        vec![0.0; 2],
        vec![0.5],
    )
    .unwrap();
    let bounds = Bounds { lower: vec![-limit], upper: vec![limit] };
    problem.rows = Some(RowsGlobal { G: g, b: vec![-1.0], bounds });
    problem.validate().unwrap();
    problem
}

/// Weight 2, mu = 1/2: the motor needs λ = 1 to move the mass at all and 2 to reach its speed; with 1.5 it moves at 1/2, with 0.5 it stalls.
#[test]
fn a_motor_reaches_its_speed_saturates_or_stalls() {
    for (limit, lambda, v, friction) in
        [(3.0, 2.0, 1.0, -1.0), (1.5, 1.5, 0.5, -1.0), (0.5, 0.5, 0.0, -0.5)]
    {
        let problem = motor(limit);
        let point = GlobalPoint { v: vec![v, 0.0], r: vec![2.0, friction], lambda: vec![lambda] };
        assert!(problem.judge(&point, 1e-12).unwrap().solved, "{limit}");
        // The answers of the other limits are none.
        for other in [3.0, 1.5, 0.5].into_iter().filter(|x| *x != limit) {
            assert!(!motor(other).judge(&point, 1e-6).unwrap().solved, "{limit} {other}");
        }
        // In exact numbers the coefficients say the same.
        let system = problem.cones().unwrap();
        assert!(system.complete);
    }
}

/// A row that its own impulse moves by less than velocities are rounded: it moves at 1 whatever the impulse, which therefore is at its lower bound. Bounds say how large impulses are; without one that is not zero,
/// so does what the row moves by, if it does at all.
#[test]
fn a_row_that_no_impulse_moves_has_its_impulse_at_the_bound() {
    let column = |g: f64| Csc::from_triplets(2, 1, [(1, 0, g)].into_iter()).unwrap();
    for g in [0.0, 1e-170, 1e-30, 1e-17, 1e-16, 1e-15, 1e-14, 1e-12] {
        for (bounds, right) in [([-1.0, 1.0], -1.0), ([0.0, f64::INFINITY], 0.0)] {
            if right == 0.0 && g * g > 0.0 {
                continue;
            }
            let bounds = Bounds { lower: vec![bounds[0]], upper: vec![bounds[1]] };
            let mut global = motor(1.0);
            global.f = vec![0.0, -2.0];
            // Along x, which is the first degree of freedom.
            let along = Csc::from_triplets(2, 1, [(0, 0, g)].into_iter()).unwrap();
            global.rows = Some(RowsGlobal { G: along, b: vec![1.0], bounds: bounds.clone() });
            let w = Bsr::from_rows(1, &[vec![(0, [[1.0, 0.0], [0.0, 1.0]])]]);
            let mut local = FrictionLocal::<2>::new(w, vec![-2.0, 0.0], vec![0.5]).unwrap();
            let own = Csc::from_triplets(1, 1, [(0, 0, g * g)].into_iter()).unwrap();
            local.rows = Some(RowsLocal { V: column(g), R: own, s: vec![1.0], bounds });
            for lambda in [-5.0, -1.0, 0.0, 0.5, 3.0] {
                let r = vec![2.0, -lambda * g];
                let (v, impulse) = (vec![0.0; 2], vec![lambda]);
                let at = GlobalPoint { v, r: r.clone(), lambda: impulse.clone() };
                assert_eq!(relative(&global, &at).0, lambda == right, "{g:e} {lambda}");
                let at = LocalPoint { r, lambda: impulse };
                assert_eq!(relative(&local, &at).0, lambda == right, "{g:e} {lambda}");
            }
        }
    }
}

/// Two limits of the same joint that leave no motion: refuted, in exact arithmetic, by the impulses of both.
#[test]
fn limits_that_contradict_each_other_are_refuted() {
    let mut problem = motor(1.0);
    let g = Csc::from_triplets(2, 2, [(0, 0, 1.0), (0, 1, -1.0)].into_iter()).unwrap();
    // v_x ≥ 1 and v_x ≤ 1/2.
    let bounds = Bounds { lower: vec![0.0; 2], upper: vec![f64::INFINITY; 2] };
    problem.rows = Some(RowsGlobal { G: g, b: vec![-1.0, 0.5], bounds });
    problem.validate().unwrap();
    let mut y = vec![0.0; problem.unknowns()];
    y[4..6].copy_from_slice(&[1.0, 1.0]);
    let farkas = nonsmooth_problem::check::Certificate::Farkas { y: y.clone() };
    assert!(matches!(problem.evidence(&farkas), Evidence::Proved(_)));
    // A motor of limited strength cannot enforce anything.
    problem.rows.as_mut().unwrap().bounds.upper = vec![5.0; 2];
    assert!(matches!(problem.evidence(&farkas), Evidence::Nothing));
}

/// A light part that a motor holds, within its bounds, and that rides on a heavy one: `u = v_1 + v_2`, `M = diag(m, 1)`, `f = (1, −1)`. Without the motor the part alone would open the contact at 1/m;
/// with it the heavy body falls at 1, which no such velocity makes small.
#[test]
fn no_contact_hides_behind_what_a_row_holds() {
    for power in [-14, -27, -40] {
        let m = 2f64.powi(power);
        let h = Csc::from_triplets(2, 2, [(0, 0, 1.0), (1, 0, 1.0)].into_iter()).unwrap();
        let g = Csc::from_triplets(2, 1, [(0, 0, 1.0)].into_iter()).unwrap();
        let mut global = FrictionGlobal::<2>::new(
            Csc::diagonal(&[m, 1.0]),
            h,
            vec![1.0, -1.0],
            vec![0.0; 2],
            vec![0.0],
        )
        .unwrap();
        let bounds = || Bounds { lower: vec![-4.0], upper: vec![4.0] };
        global.rows = Some(RowsGlobal { G: g, b: vec![0.0], bounds: bounds() });
        let w = Csc::from_triplets(2, 2, [(0, 0, 1.0 / m + 1.0)].into_iter()).unwrap();
        let q = vec![1.0 / m - 1.0, 0.0];
        let mut local = FrictionLocal::<2>::new(Bsr::from_csc(&w), q, vec![0.0]).unwrap();
        let v = Csc::from_triplets(2, 1, [(0, 0, 1.0 / m)].into_iter()).unwrap();
        let r = Csc::diagonal(&[1.0 / m]);
        local.rows = Some(RowsLocal { V: v, R: r, s: vec![1.0 / m], bounds: bounds() });
        let of = |r: f64| {
            let point =
                GlobalPoint { v: vec![0.0, r - 1.0], r: vec![r, 0.0], lambda: vec![-1.0 - r] };
            let global = global.judge(&point, 1e-8).unwrap();
            let point = LocalPoint { r: point.r, lambda: point.lambda };
            [global, local.judge(&point, 1e-8).unwrap()]
        };
        for verdict in of(1.0) {
            assert!(verdict.solved, "2^{power} {:?}", verdict.measure);
        }
        for verdict in of(0.0) {
            assert!(!verdict.solved, "2^{power} {:?}", verdict.measure);
            assert_eq!(verdict.velocity[0], -1.0);
        }
    }
}
