//! The judge of contact problems against exact rational arithmetic, on points where terms cancel; what each contact's own residual does not
//! let pass; the floor.

use dashu_ratio::RBig;
use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::check::{Judged, Measure};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{
    FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Problem, RowsGlobal, RowsLocal,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn exact(x: f64) -> RBig {
    RBig::try_from(x).unwrap()
}

fn power(k: usize) -> RBig {
    RBig::from(2u8).pow(k as isize)
}

/// `√x` to some 2⁻⁶⁰⁰, or as many digits of a smaller one.
fn root(x: &RBig) -> RBig {
    use dashu_int::ops::SquareRoot;
    let scaled = (x * power(2400)).floor();
    let (_, magnitude) = scaled.into_parts();
    RBig::from(magnitude.sqrt()) / power(1200)
}

fn length(x: &[RBig]) -> RBig {
    root(&x.iter().fold(RBig::ZERO, |sum, x| sum + x * x))
}

/// `‖x − P_K(x − ũ)‖²` of one contact.
fn natural_map(x: &[RBig], u: &[RBig], mu: f64) -> RBig {
    let mu = exact(mu);
    let mut modified = u.to_vec();
    modified[0] = &u[0] + &mu * length(&u[1..]);
    let y: Vec<_> = x.iter().zip(&modified).map(|(x, u)| x - u).collect();
    let t = length(&y[1..]);
    let mut p = y.clone();
    if &y[0] + &mu * &t <= RBig::ZERO {
        p.fill(RBig::ZERO);
    } else if t > &mu * &y[0] {
        p[0] = (&y[0] + &mu * &t) / (RBig::ONE + &mu * &mu);
        for k in 1..y.len() {
            p[k] = if t.is_zero() { RBig::ZERO } else { &mu * &p[0] * &y[k] / &t };
        }
    }
    x.iter().zip(&p).fold(RBig::ZERO, |sum, (x, p)| sum + (x - p) * (x - p))
}

/// The residual of the velocities u over ‖q‖, exactly.
fn relative(d: usize, w: &[RBig], r: &[f64], u: &[RBig], mu: &[f64], q: &[RBig]) -> f64 {
    let mut sum = RBig::ZERO;
    for (c, &mu) in mu.iter().enumerate() {
        let x: Vec<_> = r[d * c..d * c + d].iter().map(|&r| &w[c] * exact(r)).collect();
        sum += natural_map(&x, &u[d * c..d * c + d], mu);
    }
    let scale = length(q);
    let scale = if scale.is_zero() { RBig::ONE } else { scale };
    (root(&sum) / scale).to_f64().value()
}

fn product(a: &Csc, x: &[RBig], y: &mut [RBig]) {
    a.triplets().for_each(|(i, j, a)| y[i] += exact(a) * &x[j]);
}

fn product_transposed(a: &Csc, x: &[RBig], y: &mut [RBig]) {
    a.triplets().for_each(|(i, j, a)| y[j] += exact(a) * &x[i]);
}

fn all(x: &[f64]) -> Vec<RBig> {
    x.iter().map(|&x| exact(x)).collect()
}

/// `A⁻¹ b` by elimination.
fn solve(mut a: Vec<Vec<RBig>>, mut b: Vec<RBig>) -> Vec<RBig> {
    let n = b.len();
    for k in 0..n {
        let p = (k..n).find(|&i| !a[i][k].is_zero()).expect("regular");
        a.swap(k, p);
        b.swap(k, p);
        for i in 0..n {
            if i != k && !a[i][k].is_zero() {
                let factor = &a[i][k] / &a[k][k];
                for j in k..n {
                    let change = &factor * &a[k][j];
                    a[i][j] -= change;
                }
                let change = &factor * &b[k];
                b[i] -= change;
            }
        }
    }
    (0..n).map(|i| &b[i] / &a[i][i]).collect()
}

/// The measure with the residual over ‖q‖, without what scalar rows take up of it.
fn over_q(found: Measure, q: &[RBig]) -> Measure {
    let size = length(q).to_f64().value();
    Measure { relative: found.absolute / if size > 0.0 { size } else { 1.0 }, ..found }
}

fn agree(found: &Measure, exact: f64, what: &str) {
    assert!((found.relative - exact).abs() <= 1e-9 * exact + 1e-20, "{what}: {exact:e}, {found:?}");
    // What the judge cannot know it adds.
    assert!(found.relative >= exact * (1.0 - 1e-12), "{what}: {exact:e}, {found:?}");
}

/// A number of any size between 2^-size and 2^size, often a power of two.
fn draw(random: &mut Pcg64, size: i32) -> f64 {
    let digits: f64 = if random.random_bool(0.5) { 1.0 } else { random.random_range(0.5..1.0) };
    let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
    sign * digits * 2f64.powi(random.random_range(-size..=size))
}

/// Impulses of one contact: none, inside K, on its boundary, or anywhere.
fn impulse(random: &mut Pcg64, d: usize, mu: f64, size: i32) -> Vec<f64> {
    let n = draw(random, size).abs();
    match random.random_range(0..4) {
        0 => vec![0.0; d],
        kind => {
            let t = if kind == 1 { 0.3 * mu * n } else { mu * n };
            let angle: f64 = random.random_range(0.0..std::f64::consts::TAU);
            let mut r = vec![n, t * angle.cos(), t * angle.sin()];
            r.truncate(d);
            if d == 2 {
                r[1] = t;
            }
            r
        }
    }
}

/// u near what the law asks for: at rest but for a little, sliding or open.
fn wanted(random: &mut Pcg64, r: &[f64], little: f64) -> Vec<f64> {
    let mut u: Vec<f64> = r.iter().map(|_| little * draw(random, 4)).collect();
    if r[0] == 0.0 && random.random_bool(0.7) {
        u[0] += draw(random, 2).abs();
    } else if random.random_bool(0.3) {
        let slide = draw(random, 2).abs() / r[1].abs().max(1e-300);
        (1..r.len()).for_each(|k| u[k] -= slide * r[k]);
    }
    u
}

/// Local problems near a solution, with terms up to `2^size` that cancel.
fn local<const D: usize>(random: &mut Pcg64, size: i32) -> (FrictionLocal<D>, LocalPoint) {
    let nc = random.random_range(1..=6);
    let (m, p) = (D * nc, random.random_range(0..3usize));
    let mut w = vec![];
    for i in 0..m {
        for j in 0..m {
            if i == j || random.random_bool(0.4) {
                w.push((i, j, if i == j { draw(random, 3).abs() } else { draw(random, 3) }));
            }
        }
    }
    let csc = |rows, columns, entries: Vec<(usize, usize, f64)>| {
        Csc::from_triplets(rows, columns, entries.into_iter()).unwrap()
    };
    let w = csc(m, m, w);
    let v: Vec<_> = (0..m * p).map(|k| (k / p, k % p, draw(random, 8))).collect();
    let rr: Vec<_> = (0..p * p).map(|k| (k / p, k % p, draw(random, 2))).collect();
    let (v, rr) = (csc(m, p, v), csc(p, p, rr));
    let mu: Vec<f64> = (0..nc).map(|_| [0.0, 0.5, 0.3, 1e6][random.random_range(0..4)]).collect();
    let r: Vec<f64> = mu.iter().flat_map(|&mu| impulse(random, D, mu.min(1.0), size)).collect();
    let lambda: Vec<f64> = (0..p).map(|_| draw(random, size)).collect();
    let little = 2f64.powi(-random.random_range(10..50));
    // q is what the terms leave, rounded: u is all rounding, or a little.
    let mut sum = vec![RBig::ZERO; m];
    product(&w, &all(&r), &mut sum);
    product(&v, &all(&lambda), &mut sum);
    let q: Vec<f64> = (0..nc)
        .flat_map(|c| wanted(random, &r[D * c..D * c + D], little))
        .zip(&sum)
        .map(|(u, sum)| (exact(u) - sum).to_f64().value())
        .collect();
    let mut left = vec![RBig::ZERO; p];
    product_transposed(&v, &all(&r), &mut left);
    product(&rr, &all(&lambda), &mut left);
    let s = left.iter().map(|x| -x.to_f64().value()).collect();
    let mut problem = FrictionLocal::new(Bsr::from_csc(&w), q, mu).unwrap();
    if p > 0 {
        problem.rows = Some(RowsLocal::bilateral(v, rr, s));
        problem.validate().unwrap();
    }
    (problem, LocalPoint { r, lambda })
}

fn local_agrees<const D: usize>(
    problem: &FrictionLocal<D>,
    point: &LocalPoint,
    what: &str,
) -> [usize; 2] {
    let found = problem.certify(point, &mut problem.gauge().unwrap());
    let q = all(&problem.q);
    let mut u = q.clone();
    product(&problem.W.to_csc(), &all(&point.r), &mut u);
    if let Some(b) = &problem.rows {
        product(&b.V, &all(&point.lambda), &mut u);
    }
    let w: Vec<RBig> = (0..problem.contacts())
        .map(|c| {
            let block = problem.W.diagonal_block(c);
            (0..D).fold(RBig::ZERO, |sum, k| sum + exact(block[k][k])) / RBig::from(D as u8)
        })
        .collect();
    let exact = relative(D, &w, &point.r, &u, &problem.mu, &q);
    match &problem.rows {
        None => agree(&found, exact, what),
        Some(_) => agree(&over_q(found, &q), exact, what),
    }
    accepted(problem, point, exact, &found, what)
}

/// What plain arithmetic accepts passes in exact arithmetic; at how many of six tolerances it accepts, where doubled precision does.
fn accepted<const D: usize>(
    problem: &FrictionLocal<D>,
    point: &LocalPoint,
    exact: f64,
    certified: &Measure,
    what: &str,
) -> [usize; 2] {
    let mut gauge = problem.gauge().unwrap();
    let mut counts = [0; 2];
    for tolerance in
        [0.5 * exact, exact * (1.0 - 1e-9), exact * (1.0 + 1e-9), 2.0 * exact, 1e-8, 1e-3]
    {
        let passes = tolerance > 0.0 && certified.passes(tolerance);
        counts[1] += usize::from(passes && problem.rows.is_none());
        if let Some((bounds, steered)) = problem.accept(point, &mut gauge, tolerance) {
            counts[0] += 1;
            assert!(steered <= bounds.merit(), "{what}: {steered:e}, {bounds:?}");
            assert!(passes, "{what}: {tolerance:e}, {bounds:?}, {certified:?}");
            assert!(bounds.relative >= exact * (1.0 - 1e-12), "{what}: {exact:e}, {bounds:?}");
            for (bound, found) in
                [(bounds.dual, certified.dual), (bounds.own.unwrap(), certified.own.unwrap())]
            {
                assert!(bound >= found * (1.0 - 1e-9), "{what}: {bounds:?}, {certified:?}");
            }
        }
    }
    counts
}

#[test]
fn local_problems_are_judged_as_exact_arithmetic_does() {
    let mut random = Pcg64::seed_from_u64(11);
    let mut counts = [0; 2];
    for k in 0..400 {
        let size = [2, 10, 25, 40][k % 4];
        let (problem, point) = local::<3>(&mut random, size);
        let in_space = local_agrees(&problem, &point, &format!("3D, {k}"));
        let (problem, point) = local::<2>(&mut random, size);
        let in_plane = local_agrees(&problem, &point, &format!("2D, {k}"));
        (0..2).for_each(|i| counts[i] += in_space[i] + in_plane[i]);
    }
    // On points whose terms cancel to the last bit; of well scaled ones nearly all.
    assert!(counts[1] > 200 && 3 * counts[0] > counts[1], "{counts:?}");
}

/// Global problems near a solution, `f` what the terms leave.
fn global<const D: usize>(random: &mut Pcg64, size: i32) -> (FrictionGlobal<D>, GlobalPoint) {
    let nc = random.random_range(1..=6);
    let (m, n, p) = (D * nc, random.random_range(4..=9usize), random.random_range(0..3usize));
    // Two components and a mass apart: A Aᵀ + a diagonal, rounded.
    let mut mass = vec![vec![0.0; n]; n];
    for part in [0..n / 2, n / 2..n - 1] {
        let columns: Vec<Vec<f64>> =
            (0..3).map(|_| (0..n).map(|_| draw(random, 2)).collect()).collect();
        for i in part.clone() {
            for j in part.clone() {
                mass[i][j] = columns.iter().map(|c| c[i] * c[j]).sum();
            }
            mass[i][i] += draw(random, 3).abs();
        }
    }
    mass[n - 1][n - 1] = draw(random, 10).abs();
    let mass = (0..n * n).map(|k| (k / n, k % n, mass[k / n][k % n])).filter(|e| e.2 != 0.0);
    let mass = Csc::from_triplets(n, n, mass).unwrap();
    let mut h = vec![];
    for j in 0..m {
        h.push((random.random_range(0..n), j, draw(random, 1)));
        (0..n)
            .filter(|i| *i != h.last().unwrap().0 && i % 3 == j % 3)
            .collect::<Vec<_>>()
            .iter()
            .for_each(|&i| h.push((i, j, draw(random, 2))));
    }
    let h = Csc::from_triplets(n, m, h.into_iter()).unwrap();
    let g = (0..p).flat_map(|j| (0..n).map(move |i| (i, j)));
    let g: Vec<_> = g.map(|(i, j)| (i, j, draw(random, 1))).collect();
    let g = Csc::from_triplets(n, p, g.into_iter()).unwrap();
    let mu: Vec<f64> = (0..nc).map(|_| [0.0, 0.5, 0.3][random.random_range(0..3)]).collect();
    let r: Vec<f64> = mu.iter().flat_map(|&mu| impulse(random, D, mu, size)).collect();
    let lambda: Vec<f64> = (0..p).map(|_| draw(random, size)).collect();
    let v: Vec<f64> = (0..n).map(|_| draw(random, 3)).collect();
    let mut f = vec![RBig::ZERO; n];
    product(&mass, &all(&v), &mut f);
    let mut load = vec![RBig::ZERO; n];
    product(&h, &all(&r), &mut load);
    product(&g, &all(&lambda), &mut load);
    let f = f.iter().zip(&load).map(|(a, b)| (a - b).to_f64().value()).collect();
    let mut u = vec![RBig::ZERO; m];
    product_transposed(&h, &all(&v), &mut u);
    let little = 2f64.powi(-random.random_range(10..50));
    let w = (0..nc)
        .flat_map(|c| wanted(random, &r[D * c..D * c + D], little))
        .zip(&u)
        .map(|(want, u)| (exact(want) - u).to_f64().value())
        .collect();
    let mut b = vec![RBig::ZERO; p];
    product_transposed(&g, &all(&v), &mut b);
    let b = b.iter().map(|b| -b.to_f64().value()).collect();
    let mut problem = FrictionGlobal::new(mass, h, f, w, mu).unwrap();
    if p > 0 {
        problem.rows = Some(RowsGlobal::bilateral(g, b));
        problem.validate().unwrap();
    }
    (problem, GlobalPoint { v, r, lambda })
}

fn global_agrees<const D: usize>(problem: &FrictionGlobal<D>, point: &GlobalPoint, what: &str) {
    let found = problem.certify(point, &mut problem.gauge().unwrap());
    let (n, p, m) = (problem.dofs(), problem.multipliers(), problem.w.len());
    let mut mass = vec![vec![RBig::ZERO; n]; n];
    problem.M.triplets().for_each(|(i, j, x)| mass[i][j] += exact(x));
    let velocity = |v: &[RBig]| {
        let mut u = all(&problem.w);
        product_transposed(&problem.H, &v[..n], &mut u);
        u
    };
    let q = velocity(&solve(mass.clone(), all(&problem.f)));
    let w: Vec<RBig> = (0..problem.contacts())
        .map(|c| {
            let mut trace = RBig::ZERO;
            for k in D * c..D * c + D {
                let mut column = vec![RBig::ZERO; n];
                problem
                    .H
                    .triplets()
                    .filter(|e| e.1 == k)
                    .for_each(|(i, _, x)| column[i] += exact(x));
                let z = solve(mass.clone(), column.clone());
                trace += column.iter().zip(&z).fold(RBig::ZERO, |sum, (a, b)| sum + a * b);
            }
            trace / RBig::from(D as u8)
        })
        .collect();
    let mut load = all(&problem.f);
    product(&problem.H, &all(&point.r), &mut load);
    if let Some(b) = &problem.rows {
        mass.iter_mut().for_each(|row| row.resize(n + p, RBig::ZERO));
        mass.resize(n + p, vec![RBig::ZERO; n + p]);
        for (i, j, g) in b.G.triplets() {
            mass[i][n + j] -= exact(g);
            mass[n + j][i] += exact(g);
        }
        load.extend(b.b.iter().map(|b| -exact(*b)));
    }
    let mut without = all(&problem.f);
    without.extend(load[n..].iter().cloned());
    let u = velocity(&solve(mass.clone(), load));
    assert_eq!(u.len(), m);
    let of = |q: &[RBig]| relative(D, &w, &point.r, &u, &problem.mu, q);
    // Where constraints leave more than a rest of q, and no more than there was, the residual is relative to that.
    let enforced = velocity(&solve(mass, without));
    let size = length(&q);
    let left = if size.is_zero() { 0.0 } else { (length(&enforced) / size).to_f64().value() };
    match (1e-3..1.0).contains(&left) || problem.rows.is_none() {
        true => agree(&found, of(&enforced), what),
        false => agree(&over_q(found, &q), of(&q), what),
    }
}

#[test]
fn global_problems_are_judged_as_exact_arithmetic_does() {
    let mut random = Pcg64::seed_from_u64(12);
    for k in 0..60 {
        let size = [2, 8, 16, 24][k % 4];
        let (problem, point) = global::<3>(&mut random, size);
        global_agrees(&problem, &point, &format!("3D, {k}"));
        let (problem, point) = global::<2>(&mut random, size);
        global_agrees(&problem, &point, &format!("2D, {k}"));
    }
}

/// Multipliers of 1e10 against impulses that cancel their velocities: `W r + q` alone is no number to round.
#[test]
fn multipliers_that_cancel_impulses_hide_nothing() {
    let entries = [(0, 0, 1.0), (1, 1, 1.0)];
    let w = Bsr::from_csc(&Csc::from_triplets(2, 2, entries.into_iter()).unwrap());
    let v = Csc::from_triplets(2, 1, [(0, 0, 1.0), (1, 0, 0.5)].into_iter()).unwrap();
    let big = 2f64.powi(34);
    let off = 2f64.powi(-17);
    // u = W r + V λ + q = (−2⁻¹⁷, −2⁻¹⁷), though both W r + q and V λ round to ±2³⁴.
    let (r, lambda) = (vec![big, 0.5 * big], vec![-big]);
    let inertia = Csc::from_triplets(1, 1, [(0, 0, 1.25)].into_iter()).unwrap();
    let q = vec![-off, -off];
    let mut problem = FrictionLocal::<2>::new(w, q, vec![1.0]).unwrap();
    problem.rows = Some(RowsLocal::bilateral(v, inertia, vec![0.0]));
    problem.validate().unwrap();
    let verdict = problem.judge(&LocalPoint { r, lambda }, 1e-3).unwrap();
    assert!(!verdict.solved);
    assert_eq!(verdict.velocity, [-off, -off]);
    assert_eq!(verdict.measure.bilateral, Some(0.0));
    // ũ = (−2⁻¹⁷ + 2⁻¹⁷, −2⁻¹⁷).
    assert!((verdict.measure.relative - 0.5f64.sqrt()).abs() < 1e-12, "{:?}", verdict.measure);
}

/// A contact of size 1 at its solution, and one of another size that approaches with nothing to stop it.
fn beside(size: f64, mu: f64) -> (FrictionLocal<3>, LocalPoint) {
    let block = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let w = Bsr::from_rows(2, &[vec![(0, block)], vec![(1, [[0.0; 3]; 3])]]);
    let problem =
        FrictionLocal::new(w, vec![-1.0, 0.0, 0.0, -size, 0.0, 0.0], vec![mu; 2]).unwrap();
    let r = vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    (problem, LocalPoint { r, lambda: vec![] })
}

#[test]
fn no_contact_hides_behind_a_larger_one() {
    for size in [1.0, 1e-9, 1e-30, 1e-200] {
        for mu in [0.0, 0.4] {
            let (problem, point) = beside(size, mu);
            let verdict = problem.judge(&point, 1e-8).unwrap();
            assert!(!verdict.solved, "{size:e} {:?}", verdict.measure);
            assert!((verdict.measure.own.unwrap() - 1.0).abs() < 1e-12);
            assert_eq!(verdict.measure.own_contact, Some(1));
        }
    }
}

/// Where `[W, V; Vᵀ, R]` is far from positive semidefinite, or far from symmetric, W_cc does not say what an impulse does.
#[test]
fn no_contact_hides_behind_a_small_block_of_its_own() {
    for power in [-20, -40, -60] {
        let e = 2f64.powi(power);
        // The free row answers the impulse of the contact by a velocity of −r: r_N = −9 makes u_N = 8.
        let w = Bsr::from_csc(&Csc::diagonal(&[e; 2]));
        let v = Csc::from_triplets(2, 1, [(0, 0, 1.0)].into_iter()).unwrap();
        let mut problem = FrictionLocal::<2>::new(w, vec![-1.0, 0.0], vec![0.0]).unwrap();
        problem.rows = Some(RowsLocal::bilateral(v, Csc::diagonal(&[1.0]), vec![0.0]));
        let verdict = problem.judge(&LocalPoint { r: vec![-9.0, 0.0], lambda: vec![9.0] }, 1e-8);
        assert!(!verdict.unwrap().solved, "2^{power}");
        // Two normals that turn each other round: r_N = 1 stops both, r_N = 683 neither.
        let skew = [(0, 2, 1.0), (2, 0, -1.0)];
        let entries = (0..4).map(|i| (i, i, e)).chain(skew);
        let w = Bsr::from_csc(&Csc::from_triplets(4, 4, entries).unwrap());
        let problem = FrictionLocal::<2>::new(w, vec![-1.0, 0.0, 1.0, 0.0], vec![0.5; 2]).unwrap();
        let solved = |r: [f64; 2]| {
            let point = LocalPoint { r: vec![r[0], 0.0, r[1], 0.0], lambda: vec![] };
            problem.judge(&point, 1e-8).unwrap().solved
        };
        // u = (e r_1 + r_2 − 1, e r_2 − r_1 + 1)
        let first = (1.0 + e) / (1.0 + e * e);
        assert!(solved([first, 1.0 - e * first]), "2^{power}");
        assert!(!solved([1.0, 683.0]), "2^{power}");
    }
}

#[test]
fn no_sliding_excuses_sinking_but_that_of_its_own_rounding() {
    // One contact that slides at 1 m/s, without impulses: it sinks by δ, all there is along its normal.
    let own = |delta: f64| {
        let w = Bsr::from_csc(&Csc::diagonal(&[1.0; 3]));
        let problem = FrictionLocal::<3>::new(w, vec![-delta, 1.0, 0.0], vec![0.5]).unwrap();
        let point = LocalPoint { r: vec![0.0; 3], ..problem.origin() };
        problem.judge(&point, 1e-8).unwrap().measure.own.unwrap()
    };
    assert!((own(1e-10) - 1.0).abs() < 1e-5 && (own(1e-14) - 1.0).abs() < 0.1);
    assert!(own(1e-16) < 1e-8 && own(1e-157) < 1e-8);
}

#[test]
fn what_rounding_makes_of_the_loads_along_a_wall_is_no_sinking() {
    // A ball at rest in a corner: what carries it at one contact holds the other's tangent still, and what is left along the normal of the wall
    // is δ alone.
    let own = |delta: f64| {
        let mut w = [[0.0; 6]; 6];
        (0..6).for_each(|i| w[i][i] = 1.0);
        (w[1][3], w[3][1]) = (1.0, 1.0);
        let entries = (0..36).map(|k| (k / 6, k % 6, w[k / 6][k % 6]));
        let w = Bsr::from_csc(&Csc::from_triplets(6, 6, entries.filter(|e| e.2 != 0.0)).unwrap());
        let q = vec![-delta, -0.1, 0.0, -0.1, 0.0, 0.0];
        let problem = FrictionLocal::<3>::new(w, q, vec![0.5; 2]).unwrap();
        let point = LocalPoint { r: vec![0.0, 0.0, 0.0, 0.1, 0.0, 0.0], ..problem.origin() };
        problem.judge(&point, 1e-8).unwrap().measure.own.unwrap()
    };
    assert!((own(1e-10) - 1.0).abs() < 1e-5 && (own(1e-14) - 1.0).abs() < 0.1);
    assert!(own(1e-18) < 1e-8 && own(1e-53) < 1e-8);
}

#[test]
fn what_the_square_of_the_loads_rounding_drowns_is_not_heard() {
    // The second contact ought to carry δ of the load that reaches it through their coupling, and carries nothing.
    let own = |delta: f64| {
        let mut w = [[0.0; 6]; 6];
        (0..6).for_each(|i| w[i][i] = 1.0);
        (w[0][3], w[3][0]) = (-delta, -delta);
        let entries = (0..36).map(|k| (k / 6, k % 6, w[k / 6][k % 6]));
        let w = Bsr::from_csc(&Csc::from_triplets(6, 6, entries.filter(|e| e.2 != 0.0)).unwrap());
        let q = vec![-1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let problem = FrictionLocal::<3>::new(w, q, vec![0.5; 2]).unwrap();
        let point = LocalPoint { r: vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0], ..problem.origin() };
        problem.judge(&point, 1e-8).unwrap().measure.own.unwrap()
    };
    assert!((own(1e-12) - 1.0).abs() < 1e-3 && (own(1e-30) - 1.0).abs() < 1e-3);
    assert!(own(1e-40) < 1e-8 && own(1e-133) < 1e-8);
}

/// An interior point leaves such impulses where others of any size are.
#[test]
fn impulses_that_are_rounding_of_the_loads_are_put_to_zero() {
    // The tangents are coupled, and the second contact bears nothing.
    let mut w = [[0.0; 6]; 6];
    (0..6).for_each(|i| w[i][i] = 1.0);
    (w[1][4], w[4][1]) = (0.5, 0.5);
    let entries = (0..36).map(|k| (k / 6, k % 6, w[k / 6][k % 6]));
    let w = Bsr::from_csc(&Csc::from_triplets(6, 6, entries.filter(|e| e.2 != 0.0)).unwrap());
    let q = vec![-1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let problem = FrictionLocal::<3>::new(w, q, vec![0.5; 2]).unwrap();
    for (left, boldly, is_rounding) in [
        (1e-17, false, true),
        (1e-15, false, true),
        (1e-13, false, false),
        (1e-13, true, true),
        (1e-11, true, false),
    ] {
        let r = vec![1.0, 0.0, 0.0, left, 0.0, 0.0];
        let mut point = LocalPoint { r, ..problem.origin() };
        assert!(!problem.judge(&point, 1e-8).unwrap().solved, "{left}");
        let mut gauge = problem.gauge().unwrap();
        problem.measure(&point, &mut gauge);
        assert_eq!(problem.tidy(&mut point, &mut gauge, boldly), is_rounding, "{left}");
        assert_eq!(problem.judge(&point, 1e-8).unwrap().solved, is_rounding, "{left}");
    }
}

#[test]
fn own_does_not_depend_on_the_scale_of_a_contact() {
    let (problem, point) = Planted { contacts: 8, dofs: 30, ..Planted::default() }.local::<3>();
    let mut wrong = point.clone();
    wrong.r[4] += 1e-6;
    for point in [point, wrong] {
        let before = problem.judge(&point, 1e-8).unwrap();
        for c in 0..8 {
            let scale = |k: usize| if k == c { 2f64.powi(-40) } else { 1.0 };
            let rows: Vec<_> = (0..8)
                .map(|i| {
                    let (columns, blocks) = problem.W.row(i);
                    let entries = columns.iter().zip(blocks).map(|(&j, block)| {
                        (j, block.map(|row| row.map(|x| x * scale(i) * scale(j as usize))))
                    });
                    entries.collect()
                })
                .collect();
            let mut scaled = problem.clone();
            scaled.W = Bsr::from_rows(8, &rows);
            let mut moved = point.clone();
            for k in 3 * c..3 * c + 3 {
                scaled.q[k] *= scale(c);
                moved.r[k] /= scale(c);
            }
            let after = scaled.judge(&moved, 1e-8).unwrap();
            let (a, b) = (before.measure.own.unwrap(), after.measure.own.unwrap());
            assert!((a - b).abs() <= 1e-12 * a.max(1e-9), "{c}: {a:e} {b:e}");
            assert_eq!(before.solved, after.solved);
        }
    }
}

#[test]
fn the_floor_is_what_rounding_makes_of_a_solution() {
    // A light body under a heavy one: q of size 1, impulses of size 2^k that cancel.
    for k in [0, 10, 30] {
        let big = 2f64.powi(k) * 1.1;
        let entries =
            [(0, 0, 1.0), (1, 1, 1.0), (2, 2, 1.0), (3, 3, 1.0), (0, 2, -1.0), (2, 0, -1.0)];
        let w = Bsr::from_csc(&Csc::from_triplets(4, 4, entries.into_iter()).unwrap());
        let problem = FrictionLocal::<2>::new(w, vec![1.0, 0.0, 0.0, 0.0], vec![0.0; 2]).unwrap();
        let point = LocalPoint { r: vec![big, 0.0, big, 0.0], lambda: vec![] };
        let measure = problem.certify(&point, &mut problem.gauge().unwrap());
        let floor = measure.floor.unwrap();
        assert!(floor > 0.5e-16 * big && floor < 4e-16 * big, "{floor:e}");
        assert_eq!(problem.measure(&point, &mut problem.gauge().unwrap()).floor, None);
    }
}

fn one_contact(w: [f64; 3], q: [f64; 3], mu: f64) -> FrictionLocal<3> {
    let w = Bsr::from_csc(&Csc::diagonal(&w));
    FrictionLocal::new(w, q.to_vec(), vec![mu]).unwrap()
}

/// The trace of an indefinite block cancels but for rounding: it is no unit for impulses, beside which every velocity would be large.
#[test]
fn a_trace_of_rounding_hides_no_velocity() {
    for last in [-0.3, -0.300_000_000_000_000_04, -0.25] {
        let p = one_contact([0.1, 0.2, last], [-0.1 + 5e-6, 0.0, 0.0], 0.5);
        let point = LocalPoint { r: vec![1.0, 0.0, 0.0], lambda: vec![] };
        let verdict = p.judge(&point, 1e-8).unwrap();
        let found = verdict.measure.relative;
        assert!(!verdict.solved && (found / 5e-5 - 1.0).abs() < 1e-3, "{last}: {found:e}");
    }
    // Nor is the mean of traces that cancel each other.
    let blocks = [0.1, 0.1, 0.1, 0.2, 0.2, 0.2, -0.3, -0.3, -0.3];
    let w = Bsr::<3>::from_csc(&Csc::diagonal(&blocks));
    let mut q = vec![0.0; 9];
    (q[0], q[3], q[6]) = (-0.1, 1.0, 0.3 + 5e-6);
    let p = FrictionLocal::new(w, q, vec![0.5; 3]).unwrap();
    let mut point = p.origin();
    (point.r[0], point.r[6]) = (1.0, 1.0);
    assert!(p.judge(&point, 1e-8).unwrap().measure.relative > 1e-6);
}

/// A velocity of δ into the obstacle is one of δ whatever the friction, with sliding or without; never less than `δ/√2`.
#[test]
fn a_velocity_into_the_obstacle_counts_the_same_whatever_the_friction() {
    let delta = 1e-9;
    for mu in [0.0, 0.5, 1.0, 100.0, 1e6, 1e12] {
        let p = one_contact([1.0; 3], [-1.0, 0.0, 0.0], mu);
        let of = |sliding: f64| {
            let r = vec![1.0 - delta, sliding, 0.0];
            p.judge(&LocalPoint { r, lambda: vec![] }, 1e-8).unwrap()
        };
        let dual = of(0.0).measure.dual;
        assert!(of(0.0).solved && (dual / delta - 1.0).abs() < 1e-6, "{mu}: {dual:e}");
        for sliding in [1e-3, 1.0, 3.0].map(|s| s * delta) {
            let dual = of(sliding).measure.dual;
            assert!(dual < 1.01 * delta && dual > 0.7 * delta, "{mu}: {dual:e}");
        }
    }
}

/// Where q vanishes, in the rounding of doubled precision, the residual is absolute, as where it is zero.
#[test]
fn loads_that_cancel_to_the_last_digit_are_none() {
    let mut random = Pcg64::seed_from_u64(11);
    for case in 0..300 {
        let n = random.random_range(2..5);
        let mut draw = |size: i32| f64::from(random.random_range(-size..=size));
        let b: Vec<Vec<f64>> = (0..n).map(|_| (0..n).map(|_| draw(2)).collect()).collect();
        let entry = |i: usize, j: usize| -> f64 {
            (0..n).map(|k| b[i][k] * b[j][k]).sum::<f64>() + f64::from(u8::from(i == j))
        };
        let mass = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let m = Csc::from_triplets(n, n, mass.map(|(i, j)| (i, j, entry(i, j)))).unwrap();
        let h: Vec<_> = (0..n).flat_map(|i| [(i, 0, draw(2)), (i, 1, draw(2))]).collect();
        let h = Csc::from_triplets(n, 2, h.into_iter()).unwrap();
        let v: Vec<f64> = (0..n).map(|_| draw(3)).collect();
        let (mut f, mut w) = (vec![0.0; n], vec![0.0; 2]);
        m.mul_add(1.0, &v, &mut f);
        h.mul_transpose_add(-1.0, &v, &mut w);
        let p = FrictionGlobal::<2>::new(m, h, f, w, vec![0.5]).unwrap();
        let verdict = p.judge(&GlobalPoint { v, r: vec![0.0; 2], lambda: vec![] }, 1e-8).unwrap();
        assert!(verdict.solved, "{case}: {:?}", verdict.measure);
    }
}

/// With much friction what rounding makes of a velocity at rest comes back mu times as large.
#[test]
fn the_floor_grows_with_friction_where_a_contact_sticks() {
    let floor = |mu: f64, pull: f64| {
        let p = one_contact([1.0; 3], [-1.0, pull, 0.0], mu);
        let point = LocalPoint { r: vec![1.0, -pull, 0.0], lambda: vec![] };
        p.judge(&point, 1e-8).unwrap().measure.floor.unwrap()
    };
    let [usual, much] = [0.5, 1e8].map(|mu| floor(mu, 0.1));
    assert!(usual < 1e-15 && much > 1e6 * usual && much < 1e8 * usual, "{usual:e} {much:e}");
}
