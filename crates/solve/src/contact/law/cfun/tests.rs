//! What every complementarity function does: its Jacobian is the derivative on every region and that of neighbours at kinks,
//! and it vanishes at the pairs that obey the law, and only there.

use nonsmooth_linalg::small::mul;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;

type Function<const D: usize> = Box<dyn Fn(&OneContact, &[f64; D], &[f64; D]) -> Linearisation<D>>;

fn boxed<F: ContactFunction<D> + 'static, const D: usize>(f: F) -> Function<D> {
    Box::new(move |law, u, r| f.linearise(law, u, r))
}

/// All but Hüeber–Stadler–Wohlmuth's, whose matrix is on purpose not the derivative of its value (it has its own tests).
fn differentiable<const D: usize>() -> Vec<(&'static str, Function<D>)> {
    vec![
        ("alart_curnier", boxed(AlartCurnier {})),
        ("jean_moreau", boxed(JeanMoreau {})),
        ("park_kwak", boxed(ParkKwak {})),
        ("xuewen_soh_wanji", boxed(XuewenSohWanji {})),
        ("natural_map", boxed(NaturalMap {})),
        ("fischer_burmeister", boxed(FischerBurmeister {})),
        ("smoothed_fischer_burmeister", boxed(SmoothedFischerBurmeister {})),
        ("chks", boxed(ChenMangasarian { kernel: Kernel::Chks })),
        ("neural_network", boxed(ChenMangasarian { kernel: Kernel::NeuralNetwork })),
    ]
}

fn all<const D: usize>() -> Vec<(&'static str, Function<D>)> {
    let mut all = differentiable();
    all.push(("hsw", boxed(HueberStadlerWohlmuth { slip: SlipBlock::Exact })));
    all.push(("hsw modified", boxed(HueberStadlerWohlmuth { slip: SlipBlock::Modified })));
    all
}

fn law(mu: f64, smoothing: f64) -> OneContact {
    OneContact {
        law: Coulomb { mu },
        rho: Radii { normal: 0.7, tangential: 1.3, rolling: 1.3 },
        rho_cone: 0.9,
        smoothing,
    }
}

fn vector<const D: usize>(rng: &mut Pcg64) -> [f64; D] {
    std::array::from_fn(|_| rng.random_range(-1.0..1.0))
}

fn add<const D: usize>(x: &[f64; D], h: f64, d: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| x[k] + h * d[k])
}

fn size<const D: usize>(x: &[f64; D]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// `A du + B dr`.
fn directional<const D: usize>(at: &Linearisation<D>, du: &[f64; D], dr: &[f64; D]) -> [f64; D] {
    add(&mul(&at.a, du), 1.0, &mul(&at.b, dr))
}

fn gap<const D: usize>(x: &[f64; D], y: &[f64; D]) -> f64 {
    size(&add(x, -1.0, y))
}

/// Random points of all regions, compared along random directions, unless a kink lies between the two sides.
fn jacobians_are_derivatives<const D: usize>() {
    for (name, f) in differentiable::<D>() {
        let (mut compared, mut near_kinks) = (0, 0);
        let mut rng = Pcg64::seed_from_u64(1);
        for i in 0..3000 {
            let mu = [0.0, 0.1, 0.6, 1.5][i % 4];
            let law = law(mu, [0.0, 0.3, 0.01][i % 3]);
            let (mut u, mut r) = (vector::<D>(&mut rng), vector::<D>(&mut rng));
            if i % 5 == 0 {
                // Nearly sticking: u small, r inside.
                u = u.map(|x| 0.05 * x);
                r[0] = 1.0 + r[0].abs();
            }
            let (du, dr) = (vector(&mut rng), vector(&mut rng));
            let side = |h: f64| f(&law, &add(&u, h, &du), &add(&r, h, &dr));
            let h = 1e-6;
            let at = f(&law, &u, &r);
            let (up, down) = (side(h), side(-h));
            let slope = add(&up.phi, -1.0, &down.phi).map(|x| x / (2.0 * h));
            let mean = directional(&at, &du, &dr);
            let bend = gap(&directional(&up, &du, &dr), &directional(&down, &du, &dr));
            if bend > 1e-2 * (1.0 + size(&mean)) {
                near_kinks += 1;
                continue;
            }
            compared += 1;
            // Central differences are exact to the bend, which is h times the curvature.
            let error = gap(&slope, &mean);
            assert!(
                error < 1e-7 * (1.0 + size(&mean)) + 0.5 * bend,
                "{name} D={D} mu {mu} {law:?} u {u:?} r {r:?}: {slope:?} {mean:?}"
            );
        }
        assert!(compared > 2900, "{name}: {compared} compared, {near_kinks} near kinks");
    }
}

#[test]
fn the_jacobian_is_the_derivative_on_every_region_in_space() {
    jacobians_are_derivatives::<3>();
}

#[test]
fn the_jacobian_is_the_derivative_on_every_region_in_the_plane() {
    jacobians_are_derivatives::<2>();
}

/// At a kink the Jacobian is that of a neighbouring piece or, where the derivative of ‖u_T‖ is set to zero, the mean of two.
#[test]
fn at_kinks_the_jacobian_is_that_of_neighbours() {
    let mu = 0.5;
    let kinks: [([f64; 3], [f64; 3]); 6] = [
        ([0.0; 3], [2.0, 0.6, 0.8]),          // stick and slip meet
        ([0.0; 3], [2.0, 0.1, 0.3]),          // ‖u_T‖ has its kink
        ([0.0, 0.3, 0.4], [0.0; 3]),          // sliding without pressure: open and slip
        ([0.5, 0.0, 0.0], [0.0; 3]),          // open without sliding
        ([0.0, 0.6, 0.8], [2.0, -0.6, -0.8]), // sliding: |u × r|
        ([0.0; 3], [0.0; 3]),
    ];
    for (name, f) in differentiable::<3>() {
        for (u, r) in kinks {
            let law = law(mu, 0.0);
            let at = f(&law, &u, &r);
            let mut rng = Pcg64::seed_from_u64(3);
            let (mut best, mut smallest, mut largest) = (f64::INFINITY, f64::INFINITY, 0.0_f64);
            for _ in 0..3000 {
                let du = vector(&mut rng).map(|x| x * 10f64.powi(rng.random_range(-2..1)));
                let dr = vector(&mut rng);
                // The same impulse, opposite velocities: of the two pieces of ‖u_T‖.
                let side = |h: f64| f(&law, &add(&u, h, &du), &add(&r, 1e-7, &dr));
                let (up, down) = (side(1e-7), side(-1e-7));
                let distance = |x: &[f64; 3], y: &[f64; 3]| gap(x, y);
                let rows = |m: &dyn Fn(usize) -> ([f64; 3], [f64; 3])| {
                    (0..3)
                        .map(|k| {
                            let (a, b) = m(k);
                            distance(&a, &at.a[k]).max(distance(&b, &at.b[k]))
                        })
                        .fold(0.0, f64::max)
                };
                let one = rows(&|k| (up.a[k], up.b[k]));
                let mean = rows(&|k| {
                    (
                        add(&up.a[k], 1.0, &down.a[k]).map(|x| 0.5 * x),
                        add(&up.b[k], 1.0, &down.b[k]).map(|x| 0.5 * x),
                    )
                });
                best = best.min(one).min(mean);
                for v in up.a.iter().chain(&up.b).flatten() {
                    (smallest, largest) = (smallest.min(*v), largest.max(*v));
                }
            }
            // Where neither has a tangential part and r = 0, every direction has a piece of its own: the Jacobian lies among them.
            // So it is for Fischer–Burmeister's where L(z) is singular: the limit of the smoothing is no piece's.
            let singular = name.contains("fischer_burmeister") && r == [2.0, 0.6, 0.8];
            if singular || u[1..] == [0.0; 2] && r == [0.0; 3] {
                let entries = at.a.iter().chain(&at.b).flatten();
                assert!(entries.clone().all(|v| *v >= smallest - 0.1 && *v <= largest + 0.1));
            } else {
                assert!(best < 0.15, "{name} at {u:?} {r:?}: {best}");
            }
        }
    }
}

/// Pairs that obey the law, of every status, degenerate ones included.
fn lawful<const D: usize>(mu: f64, rng: &mut Pcg64) -> Vec<([f64; D], [f64; D])> {
    let mut t = [0.0; D];
    while size(&t) < 0.1 {
        t = vector(rng);
        t[0] = 0.0;
    }
    let length = size(&t);
    let t = t.map(|x| x / length);
    let along = |normal: f64, tangential: f64| {
        let mut x = t.map(|v| tangential * v);
        x[0] = normal;
        x
    };
    let (n, s) = (rng.random_range(0.1..2.0), rng.random_range(0.1..2.0));
    vec![
        (along(s, 0.7), [0.0; D]),          // open
        (along(s, 0.0), [0.0; D]),          // open, not sliding
        (along(0.0, s), along(n, -mu * n)), // slip
        ([0.0; D], along(n, 0.4 * mu * n)), // stick
        ([0.0; D], along(n, 0.0)),          // stick without tangential impulse
        ([0.0; D], along(n, mu * n)),       // stick on the boundary
        (along(0.0, s), [0.0; D]),          // touching, sliding without pressure
        ([0.0; D], [0.0; D]),
    ]
}

/// The distance by which the law is missed: the natural map.
fn missed<const D: usize>(law: &OneContact, u: &[f64; D], r: &[f64; D]) -> f64 {
    size(&NaturalMap {}.linearise(law, u, r).phi)
}

fn zeros_are_solutions<const D: usize>() {
    for (name, f) in all::<D>() {
        let mut rng = Pcg64::seed_from_u64(2);
        for i in 0..400 {
            let mu = [0.0, 0.2, 0.6, 1.5][i % 4];
            let law = law(mu, 0.0);
            for (u, r) in lawful(mu, &mut rng) {
                let phi = f(&law, &u, &r).phi;
                assert!(size(&phi) < 1e-14, "{name} mu {mu} {u:?} {r:?}: {phi:?}");
                // A little beside it, the function tells by how much.
                let (v, s) = (add(&u, 1e-3, &vector(&mut rng)), add(&r, 1e-3, &vector(&mut rng)));
                let (phi, missed) = (size(&f(&law, &v, &s).phi), missed(&law, &v, &s));
                assert!(phi > 1e-3 * missed, "{name} mu {mu} {v:?} {s:?}: {phi:e} {missed:e}");
            }
            let (u, r) = (vector(&mut rng), vector(&mut rng));
            let (phi, missed) = (size(&f(&law, &u, &r).phi), missed(&law, &u, &r));
            assert!(phi > 1e-2 * missed, "{name} mu {mu} {u:?} {r:?}: {phi:e} {missed:e}");
        }
        // What looks like a solution at a glance and is none.
        for (u, r) in [
            ([0.0, 1.0], [1.0, 0.5]),  // sliding along its impulse
            ([0.0, 0.0], [1.0, 0.9]),  // beyond the cone
            ([-0.1, 0.0], [0.0, 0.0]), // penetrating
            ([0.1, 0.0], [1.0, 0.0]),  // pressing while it separates
            ([0.0, 0.0], [-1.0, 0.0]), // adhesion
            ([0.5, 0.0], [0.0, 0.4]),  // impulse without pressure
            ([0.0, 1.0], [0.0, 1.3]),  // r_T = ρ_T u_T with R = 0
        ] {
            let (mut v, mut s) = ([0.0; D], [0.0; D]);
            v[..2].copy_from_slice(&u);
            s[..2].copy_from_slice(&r);
            let phi = f(&law(0.5, 0.0), &v, &s).phi;
            assert!(size(&phi) > 1e-2, "{name} {v:?} {s:?}: {phi:?}");
        }
    }
}

#[test]
fn zeros_are_the_solutions_in_space() {
    zeros_are_solutions::<3>();
}

#[test]
fn zeros_are_the_solutions_in_the_plane() {
    zeros_are_solutions::<2>();
}

/// `‖φ_ε − φ‖ ≤ C ε`, and the central path of (117): `x∘y = ε² e` at zeros.
#[test]
fn smoothed_functions_tend_to_what_they_smooth() {
    let mut rng = Pcg64::seed_from_u64(4);
    for _ in 0..500 {
        let (u, r) = (vector::<3>(&mut rng), vector::<3>(&mut rng));
        let of = |f: &dyn Fn(&OneContact) -> [f64; 3], e: f64| f(&law(0.6, e));
        let fb = |law: &OneContact| SmoothedFischerBurmeister {}.linearise(law, &u, &r).phi;
        let cm =
            |kernel| move |law: &OneContact| ChenMangasarian { kernel }.linearise(law, &u, &r).phi;
        let limit = FischerBurmeister {}.linearise(&law(0.6, 0.0), &u, &r).phi;
        for e in [1e-1, 1e-3, 1e-6, 1e-300] {
            assert!(gap(&of(&fb, e), &limit) <= 5.0 * e + 1e-14);
            for kernel in [Kernel::Chks, Kernel::NeuralNetwork] {
                assert!(gap(&of(&cm(kernel), e), &of(&cm(kernel), 0.0)) <= 5.0 * e + 1e-14);
            }
        }
    }
}

/// A large impulse does not round a small velocity away.
#[test]
fn a_large_impulse_leaves_a_small_velocity_its_digits() {
    let (u, r) = ([1e-9, 2e-9, -1e-9], [1e6, 1e5, 2e5]);
    for (name, f) in all::<3>() {
        let near = |x: f64| f(&law(0.5, 0.0), &u.map(|v| x * v), &r).phi;
        // Homogeneous in u at a sticking contact, to first order.
        let (one, two) = (near(1.0), near(2.0));
        assert!(size(&one) > 1e-10, "{name} {one:?}");
        assert!(gap(&two, &one.map(|x| 2.0 * x)) < 1e-6 * size(&one), "{name} {one:?} {two:?}");
    }
}
