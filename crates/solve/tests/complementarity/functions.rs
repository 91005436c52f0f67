//! Scalar complementarity functions: derivatives against differences, neighbouring pieces at kinks, roots, digits.

use nonsmooth_solve::complementarity::functions::{
    EvtushenkoPurtov, FischerBurmeister, Min, MinRho, Penalised, ScalarFunction, Side, Slope, boxed,
};

type Function = Box<dyn Fn(f64, f64) -> Slope>;

fn of<F: ScalarFunction + 'static>(f: F) -> Function {
    Box::new(move |z, w| f.at(z, w))
}

fn all() -> Vec<(&'static str, Function)> {
    vec![
        ("min", of(Min {})),
        ("min(w, 3z)", of(MinRho { rho: 3.0, side: Side::Z })),
        ("min(z, w/2)", of(MinRho { rho: 0.5, side: Side::W })),
        ("fischer_burmeister", of(FischerBurmeister {})),
        ("penalised", of(Penalised { lambda: 0.8 })),
        ("evtushenko_purtov", of(EvtushenkoPurtov {})),
    ]
}

/// A deterministic spread of points in [−1, 1]².
fn points(count: usize) -> impl Iterator<Item = (f64, f64)> {
    let spread = |k: usize, a: f64| 2.0 * ((k as f64 + 0.5) * a).fract() - 1.0;
    (0..count).map(move |k| (spread(k, 0.754_877_666), spread(k, 0.569_840_291)))
}

/// Where a piece ends, one of these is zero.
fn kinks(z: f64, w: f64) -> f64 {
    [z, w, z - w, 3.0 * z - w, z - 0.5 * w, z + w].into_iter().fold(1.0, |m, x: f64| m.min(x.abs()))
}

#[test]
fn slopes_are_derivatives_away_from_kinks() {
    let h = 1e-6;
    for (name, f) in all() {
        for (z, w) in points(2000).filter(|&(z, w)| kinks(z, w) > 1e-3) {
            let at = f(z, w);
            let of_z = (f(z + h, w).value - f(z - h, w).value) / (2.0 * h);
            let of_w = (f(z, w + h).value - f(z, w - h).value) / (2.0 * h);
            let near =
                |a: f64, b: f64| (a - b).abs() < 1e-7 * (1.0 + b.abs()) / kinks(z, w).min(0.1);
            assert!(
                near(at.z, of_z) && near(at.w, of_w),
                "{name} ({z}, {w}): {at:?}, {of_z} {of_w}"
            );
        }
    }
}

#[test]
fn at_a_kink_the_slope_is_that_of_a_piece_that_meets_there() {
    let kinks = [
        (0.0, 0.0),
        (0.5, 0.5),
        (-0.5, -0.5),
        (0.25, 0.75),
        (0.5, 1.0),
        (0.0, 0.7),
        (0.7, 0.0),
        (0.0, -0.7),
        (-0.7, 0.0),
        (0.4, -0.4),
        (0.3, 0.9),
        (-0.25, -0.5),
    ];
    for (name, f) in all() {
        for (z, w) in kinks {
            let at = f(z, w);
            let gap = (0..64)
                .map(|k| {
                    let angle = (k as f64 + 0.37) * std::f64::consts::TAU / 64.0;
                    let near = f(z + 1e-9 * angle.cos(), w + 1e-9 * angle.sin());
                    (near.z - at.z).abs() + (near.w - at.w).abs()
                })
                .fold(f64::INFINITY, f64::min);
            // At the origin Fischer's and Burmeister's function has a piece for every direction.
            let coarse = (z, w) == (0.0, 0.0) && !name.starts_with("min");
            assert!(gap < if coarse { 0.2 } else { 1e-7 }, "{name} ({z}, {w}): {at:?}, {gap:e}");
        }
    }
}

#[test]
fn roots_are_the_complementary_pairs_and_only_those() {
    for (name, f) in all() {
        for x in [0.0, 1e-12, 0.3, 7.0, 1e9] {
            assert_eq!(f(x, 0.0).value, 0.0, "{name} ({x}, 0)");
            assert_eq!(f(0.0, x).value, 0.0, "{name} (0, {x})");
        }
        for (z, w) in points(500).filter(|&(z, w)| kinks(z, w) > 1e-6) {
            let value = f(z, w).value;
            // Positive inside the quadrant, negative outside.
            assert_eq!(value > 0.0, z > 0.0 && w > 0.0, "{name} ({z}, {w}): {value}");
        }
    }
}

#[test]
fn slopes_are_not_negative() {
    for (name, f) in all().into_iter().filter(|(name, _)| *name != "evtushenko_purtov") {
        for (z, w) in points(500) {
            let at = f(z, w);
            assert!(at.z >= 0.0 && at.w >= 0.0 && at.z + at.w > 0.0, "{name} ({z}, {w}): {at:?}");
        }
    }
}

#[test]
fn fischer_burmeister_keeps_its_digits() {
    // For small ε: z + ε − √(z² + ε²) = ε − ε²/2z + …
    for (z, e) in [(1.0, 1e-9), (1e8, 1e-8), (1e-8, 1e-17), (1e200, 1e-100)] {
        for at in [FischerBurmeister {}.at(z, e), {
            let t = FischerBurmeister {}.at(e, z);
            Slope { z: t.w, w: t.z, ..t }
        }] {
            assert!((at.value - e).abs() <= e * (e / z) + 1e-15 * e, "{at:?}");
            let expected = 0.5 * (e / z) * (e / z);
            assert!(
                (at.z - expected).abs() <= 1e-12 * expected + f64::MIN_POSITIVE,
                "{at:?} {expected}"
            );
            assert!((at.w - (1.0 - e / z)).abs() < 1e-15);
        }
    }
    assert_eq!(FischerBurmeister {}.at(-3.0, -4.0).value, -12.0);
}

#[test]
fn two_bounds_nest() {
    let inf = f64::INFINITY;
    let middle = |z: f64, w: f64, l: f64, u: f64| (z - l).min(w.max(z - u));
    for (z, w) in points(300) {
        for (l, u) in [(-0.3, 0.4), (-0.3, inf), (-inf, 0.4), (-inf, inf), (0.2, 0.2)] {
            let at = boxed(&Min {}, z, w, l, u);
            if l < u {
                assert!((at.value - middle(z, w, l, u)).abs() < 1e-15);
            } else {
                assert_eq!(at, Slope { value: z - l, z: 1.0, w: 0.0 });
            }
            // The same roots for every function, and derivatives that are those of differences.
            for f in [0.8, 1.0].map(|lambda| Penalised { lambda }) {
                let h = 1e-6;
                let at = boxed(&f, z, w, l, u);
                let of_z = boxed(&f, z + h, w, l, u).value - boxed(&f, z - h, w, l, u).value;
                let of_w = boxed(&f, z, w + h, l, u).value - boxed(&f, z, w - h, l, u).value;
                let smooth = [z - l, u - z, w].iter().all(|x| x.abs() > 1e-3);
                if smooth {
                    assert!((at.z - of_z / (2.0 * h)).abs() < 1e-3, "({z}, {w}) [{l}, {u}] {at:?}");
                    assert!((at.w - of_w / (2.0 * h)).abs() < 1e-3, "({z}, {w}) [{l}, {u}] {at:?}");
                }
            }
        }
    }
    roots_between_bounds(Penalised { lambda: 1.0 });
    roots_between_bounds(Penalised { lambda: 0.7 });
    roots_between_bounds(MinRho { rho: 3.0, side: Side::Z });
    roots_between_bounds(MinRho { rho: 0.5, side: Side::W });
    roots_between_bounds(EvtushenkoPurtov {});
}

fn roots_between_bounds<F: ScalarFunction>(f: F) {
    for (z, w) in [(-0.3, 0.0), (-0.3, 2.0), (0.4, -1.0), (0.4, 0.0), (0.1, 0.0)] {
        assert!(boxed(&f, z, w, -0.3, 0.4).value.abs() < 1e-15, "({z}, {w})");
    }
    for (z, w) in [(-0.3, -1.0), (0.4, 1.0), (0.1, 0.5), (0.1, -0.5), (0.5, 0.0), (-0.4, 1.0)] {
        assert!(boxed(&f, z, w, -0.3, 0.4).value.abs() > 1e-3, "({z}, {w})");
    }
}
