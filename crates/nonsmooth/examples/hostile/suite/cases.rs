//! Hostile problems of every kind, each a function of a seed and an index.

use nonsmooth::{
    BoxLcp, Bsr, Csc, Dense, FrictionGlobal, FrictionLocal, Hlcp, Lcp, Matrix, Mlcp, RowsGlobal,
    RowsLocal,
};
use nonsmooth_solve::Reformulation;
use nonsmooth_solve::contact::Condense;

use super::draft::{
    Draft, Rng, Rows, Truth, dot, gram, matrix, scaled, scaled_vector, times, transpose,
};
use super::kinds::Hostile;
use super::oracle::Union;

/// A problem and what is known of it.
pub struct Case<P> {
    pub problem: P,
    pub truth: Truth,
    /// The smallest relative change that was made to whole numbers on purpose: what is true of the problem may be false of
    /// its neighbours from there on.
    pub fine: f64,
    /// Contacts are in units of their own.
    pub apart: bool,
    /// How it was made.
    pub recipe: String,
    /// Whether it is small enough that everybody may be expected to decide it.
    pub small: bool,
}

/// The most cells that are enumerated.
const LEAVES: f64 = 4096.0;

/// A kind with a generator.
pub trait Made: Hostile {
    /// Its name.
    const NAME: &'static str;
    /// The number that random numbers depend on.
    const NUMBER: u64;

    /// Makes one; the truth may be left open. With it, where the problem's own cones are round, a union of polyhedra that has a point exactly where the
    /// problem has a solution.
    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>);

    /// The problem of this seed and index, decided where that is possible.
    fn case(seed: u64, index: u64) -> Case<Self> {
        let mut draft = Draft::new(Rng::of(seed, Self::NUMBER, index));
        let (problem, planted, union) = Self::draw(&mut draft);
        let union = union.or_else(|| problem.union()).filter(|u| u.leaves() <= LEAVES);
        let truth = match (&union, planted) {
            (Some(union), Truth::Unknown) => decide(union),
            // What was planted is tested where that costs little.
            (Some(union), planted) if union.leaves() <= 64.0 => {
                assert_eq!(decide(union), planted, "seed {seed} index {index}: {}", draft.recipe);
                planted
            }
            _ => planted,
        };
        let small = union.is_some();
        // A solution planted in numbers that were then rounded: what is there now is nearer to a solvable problem than a tolerance can tell.
        if truth == Truth::Unsolvable && draft.recipe.contains("planted") {
            draft.fine = draft.fine.min(f64::EPSILON);
        }
        let Draft { fine, apart, recipe, .. } = draft;
        Case { problem, truth, fine, apart, recipe, small }
    }
}

fn decide(union: &Union) -> Truth {
    if union.has_point() { Truth::Solvable } else { Truth::Unsolvable }
}

fn stored(a: &Rows, columns: usize, sparse: bool) -> Matrix {
    let dense = Dense::from_fn(a.len(), columns, |i, j| a[i][j]);
    if sparse { dense.to_csc().into() } else { dense.into() }
}

fn csc(a: &Rows, columns: usize) -> Csc {
    let entries = a.iter().enumerate().flat_map(|(i, row)| {
        row.iter().enumerate().filter(|e| *e.1 != 0.0).map(move |(j, &x)| (i, j, x))
    });
    Csc::from_triplets(a.len(), columns, entries).expect("in range")
}

// --------------------------------------------------------------------------------- complementarity

/// `M z + q` for pairs, with a solution planted, or the reason why there is none, or nothing known.
fn pairs(draft: &mut Draft, n: usize) -> (Rows, Vec<f64>, Truth) {
    let large = n > 10;
    let mut m = if large { draft.ints(n, n) } else { draft.square(n) };
    let mut q = draft.vector(n);
    let way = if large { draft.rng.below(3) } else { draft.rng.below(8) };
    match way {
        0 => {
            draft.say("planted");
            let z: Vec<_> = (0..n).map(|_| draft.rng.whole(-3, 3).max(0.0)).collect();
            let mz = times(&m, &z);
            let rng = &mut draft.rng;
            q = (0..n).map(|i| if z[i] > 0.0 { -mz[i] } else { rng.whole(0, 3) - mz[i] }).collect();
            let truth = if draft.exact { Truth::Solvable } else { Truth::Unknown };
            (m, q, truth)
        }
        1 if n > 1 => {
            draft.say("farkas");
            let mut y: Vec<_> = (0..n).map(|_| draft.rng.whole(-2, 3).max(0.0)).collect();
            let k = draft.rng.below(n);
            y[k] = 0.0;
            let columns = transpose(&m, n);
            for j in 0..n {
                m[k][j] = -dot(&columns[j], &y) + columns[j][k] * y[k];
                if draft.rng.chance(20) {
                    m[k][j] -= draft.rng.whole(0, 2);
                }
            }
            let gap = if !large && draft.rng.chance(20) { draft.tiny() } else { 1.0 };
            q[k] = -dot(&q, &y) - gap;
            let truth = if draft.exact { Truth::Unsolvable } else { Truth::Unknown };
            (m, q, truth)
        }
        2 if large => {
            draft.say("core");
            let (core, small) = loop {
                let k = 2 + draft.rng.below(2);
                let (core, small) = (draft.ints(k, k), draft.vector(k));
                let mut union = Union::new(k);
                for i in 0..k {
                    let entries: Vec<_> = core[i].iter().copied().enumerate().collect();
                    let (z, w) = (union.form(&[(i, 1.0)], 0.0), union.form(&entries, small[i]));
                    union.pair(z, w);
                }
                if draft.exact && !union.has_point() {
                    break (core, small);
                }
                draft.exact = true;
            };
            let k = small.len();
            for i in 0..k {
                m[i].fill(0.0);
                m[i][..k].copy_from_slice(&core[i]);
                q[i] = small[i];
            }
            // Hidden by a change of places.
            for i in 0..n {
                let j = draft.rng.below(n);
                m.swap(i, j);
                q.swap(i, j);
                m.iter_mut().for_each(|row| row.swap(i, j));
            }
            draft.fine = 1.0;
            (m, q, Truth::Unsolvable)
        }
        _ => (m, q, Truth::Unknown),
    }
}

fn size(draft: &mut Draft) -> usize {
    if draft.rng.chance(2) { 11 + draft.rng.below(30) } else { draft.small() }
}

impl Made for Lcp {
    const NAME: &'static str = "lcp";
    const NUMBER: u64 = 1;

    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>) {
        let n = size(draft);
        let (m, q, truth) = pairs(draft, n);
        let (rows, columns) = (draft.exponents(n, "rows"), draft.exponents(n, "columns"));
        let m = scaled(&m, &rows, &columns);
        let sparse = draft.rng.chance(40);
        let lcp = Lcp::new(stored(&m, n, sparse), scaled_vector(&q, &rows)).expect("valid");
        (lcp, truth, None)
    }
}

impl Made for Mlcp {
    const NAME: &'static str = "mlcp";
    const NUMBER: u64 = 2;

    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>) {
        let pairs_count = draft.small().min(8);
        let free = draft.rng.below(4);
        let equalities = match draft.rng.below(4) {
            0 => draft.rng.below(4),
            _ => free,
        };
        let (height, width) = (equalities + pairs_count, free + pairs_count);
        let n = height.max(width);
        let mut m = draft.square(n);
        m.truncate(height);
        m.iter_mut().for_each(|row| row.truncate(width));
        if free > 0 && draft.rng.chance(15) {
            draft.say("no-A");
            m[..equalities].iter_mut().for_each(|row| row[..free].fill(0.0));
        }
        if equalities > 1 && draft.rng.chance(15) {
            draft.say("same-equalities");
            m[0] = m[1].clone();
        }
        let mut q = draft.vector(height);
        let mut truth = Truth::Unknown;
        if draft.rng.chance(30) {
            draft.say("planted");
            let z: Vec<_> = (0..width)
                .map(|j| {
                    let x = draft.rng.whole(-3, 3);
                    if j < free { x } else { x.max(0.0) }
                })
                .collect();
            q = times(&m, &z).iter().map(|x| -x).collect();
            for k in 0..pairs_count {
                if z[free + k] == 0.0 {
                    q[equalities + k] += draft.rng.whole(0, 3);
                }
            }
            if draft.exact {
                truth = Truth::Solvable;
            }
        }
        let rows = draft.exponents(height, "rows");
        let columns = draft.exponents(width, "columns");
        let sparse = draft.rng.chance(40);
        let m = stored(&scaled(&m, &rows, &columns), width, sparse);
        let q = scaled_vector(&q, &rows);
        let problem = Mlcp::rectangular(m, q, equalities, free).expect("valid");
        (problem, truth, None)
    }
}

impl Made for Hlcp {
    const NAME: &'static str = "hlcp";
    const NUMBER: u64 = 3;

    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>) {
        let n = draft.small();
        let (q, r, right, truth) = if draft.rng.chance(50) {
            // An LCP with its rows combined.
            draft.say("lcp");
            let (m, q, truth) = pairs(draft, n);
            let mut a = matrix(n, n, |i, j| f64::from(u8::from(i == j)));
            for _ in 0..draft.rng.below(n + 1) {
                let (i, j, f) = (draft.rng.below(n), draft.rng.below(n), draft.rng.whole(-2, 2));
                if i != j {
                    let row = a[j].clone();
                    a[i].iter_mut().zip(row).for_each(|(a, b)| *a += f * b);
                }
            }
            let columns = transpose(&m, n);
            let product = matrix(n, n, |i, j| dot(&a[i], &columns[j]));
            let minus = matrix(n, n, |i, j| -a[i][j]);
            let right = a.iter().map(|row| -dot(row, &q)).collect();
            // Sums of perturbed entries may be rounded.
            let truth = if draft.exact { truth } else { Truth::Unknown };
            (product, minus, right, truth)
        } else {
            let (q, r) = (draft.square(n), draft.square(n));
            let mut right = draft.vector(n);
            let mut truth = Truth::Unknown;
            if draft.rng.chance(30) {
                draft.say("planted");
                let x: Vec<_> = (0..n).map(|_| draft.rng.whole(-3, 3)).collect();
                let (a, b): (Vec<f64>, Vec<f64>) =
                    x.iter().map(|x| (x.max(0.0), (-x).max(0.0))).unzip();
                right = times(&q, &a).iter().zip(times(&r, &b)).map(|(a, b)| a + b).collect();
                if draft.exact {
                    truth = Truth::Solvable;
                }
            }
            (q, r, right, truth)
        };
        let rows = draft.exponents(n, "rows");
        let (xs, ss) = (draft.exponents(n, "x"), draft.exponents(n, "s"));
        let sparse = draft.rng.chance(40);
        let q = stored(&scaled(&q, &rows, &xs), n, sparse);
        let r = stored(&scaled(&r, &rows, &ss), n, sparse);
        let problem = Hlcp::new(q, r, scaled_vector(&right, &rows)).expect("valid");
        (problem, truth, None)
    }
}

impl Made for BoxLcp {
    const NAME: &'static str = "box_lcp";
    const NUMBER: u64 = 4;

    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>) {
        let n = draft.small().min(7);
        let (m, q, _) = pairs(draft, n);
        let rows = draft.exponents(n, "rows");
        let columns = draft.exponents(n, "columns");
        let (mut lower, mut upper) = (vec![], vec![]);
        let often = draft.rng.pick(&[10, 50, 90]);
        for &e in &columns {
            let unit = 2.0_f64.powi(-e);
            let (mut l, mut u) = (0.0, f64::INFINITY);
            if draft.rng.chance(often) {
                (l, u) = match draft.rng.below(6) {
                    0 => (f64::NEG_INFINITY, f64::INFINITY),
                    1 => (f64::NEG_INFINITY, draft.rng.whole(-3, 3)),
                    2 => (draft.rng.whole(-3, 3), f64::INFINITY),
                    _ => {
                        let l = draft.rng.whole(-4, 2);
                        (l, l + draft.rng.whole(0, 4))
                    }
                };
            }
            lower.push(l * unit);
            upper.push(u * unit);
        }
        let m = scaled(&m, &rows, &columns);
        let sparse = draft.rng.chance(40);
        let q = scaled_vector(&q, &rows);
        let problem = BoxLcp::new(stored(&m, n, sparse), q, lower, upper).expect("valid");
        (problem, Truth::Unknown, None)
    }
}

// ----------------------------------------------------------------------------------------- contact

/// The data of a local problem, D rows a contact.
struct Local {
    w: Rows,
    q: Vec<f64>,
    mu: Vec<f64>,
    /// V by rows, R, s.
    bilateral: Option<(Rows, Rows, Vec<f64>)>,
}

fn local<const D: usize>(data: &Local) -> FrictionLocal<D> {
    let m = data.q.len();
    let w = Bsr::from_csc(&csc(&data.w, m));
    let bilateral = data
        .bilateral
        .as_ref()
        .map(|(v, r, s)| RowsLocal::bilateral(csc(v, s.len()), csc(r, s.len()), s.clone()));
    let problem =
        FrictionLocal { W: w, q: data.q.clone(), mu: data.mu.clone(), mu_r: (), rows: bilateral };
    problem.validate().expect("valid");
    problem
}

/// Impulses and velocities that obey the law, exactly: directions of sliding are those of right triangles in whole numbers.
fn obedient<const D: usize>(draft: &mut Draft, mu: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (mut r, mut u) = (vec![0.0; D * mu.len()], vec![0.0; D * mu.len()]);
    for (c, &mu) in mu.iter().enumerate() {
        let (r, u) = (&mut r[D * c..D * c + D], &mut u[D * c..D * c + D]);
        match draft.rng.below(4) {
            0 => {
                u.iter_mut().for_each(|u| *u = draft.rng.whole(-3, 3));
                u[0] = u[0].abs();
            }
            1 if mu > 0.0 => {
                r[0] = draft.rng.whole(0, 3);
                // A half, and a half of each component in space, is inside of the cone.
                let most = mu * r[0] / 2.0;
                r[1..].iter_mut().for_each(|t| *t = most * draft.rng.whole(-1, 1));
            }
            _ => {
                let a = draft.rng.whole(0, 3);
                let k = draft.rng.whole(0, 2);
                let (x, y) = draft.rng.pick(&[(3.0, 4.0), (-4.0, 3.0), (5.0, 0.0), (0.0, -5.0)]);
                r[0] = 5.0 * a;
                if D == 2 {
                    let side = draft.rng.pick(&[-5.0, 5.0]);
                    (u[1], r[1]) = (k * side, -mu * a * side);
                } else {
                    (u[1], u[2]) = (k * x, k * y);
                    (r[1], r[2]) = (-mu * a * x, -mu * a * y);
                }
            }
        }
    }
    (r, u)
}

/// A local problem, what is known of it.
fn local_data<const D: usize>(draft: &mut Draft, nc: usize) -> (Local, Truth) {
    let m = D * nc;
    let mut w = draft.square(m);
    let mut q: Vec<_> = (0..m).map(|_| draft.rng.whole(-3, 3)).collect();
    let mu = draft.mus(nc);
    let mut bilateral = None;
    if draft.rng.chance(30) {
        draft.say("bilateral");
        let p = 1 + draft.rng.below(3);
        let mut v = draft.ints(m, p);
        let mut r = match draft.rng.below(4) {
            0 => draft.square(p),
            1 => matrix(p, p, |_, _| 0.0),
            _ => {
                let signs: Vec<_> =
                    (0..p).map(|_| draft.rng.pick(&[1.0, 1.0, -1.0, 4.0])).collect();
                matrix(p, p, |i, j| if i == j { signs[i] } else { 0.0 })
            }
        };
        if draft.rng.chance(25) {
            // V R⁻¹ Vᵀ nearly cancels W.
            draft.say("cancelling");
            let tiny = draft.tiny();
            for c in 0..nc {
                for k in 0..p {
                    v[D * c][k] = if k == c { 1.0 } else { 0.0 };
                }
                w[D * c][D * c] = 1.0 + if draft.rng.chance(50) { tiny } else { 0.0 };
            }
            r = matrix(p, p, |i, j| if i == j { 1.0 } else { 0.0 });
        }
        let s: Vec<_> = (0..p).map(|_| draft.rng.whole(-3, 3)).collect();
        bilateral = Some((v, r, s));
    }
    let mut truth = Truth::Unknown;
    match draft.rng.below(5) {
        0 => {
            draft.say("planted");
            let (r, u) = obedient::<D>(draft, &mu);
            let wr = times(&w, &r);
            q = (0..m).map(|i| u[i] - wr[i]).collect();
            if let Some((v, big_r, s)) = &mut bilateral {
                let lambda: Vec<_> = s.iter().map(|_| draft.rng.whole(-2, 2)).collect();
                let share = times(v, &lambda);
                q.iter_mut().zip(share).for_each(|(q, x)| *q -= x);
                let columns = transpose(v, s.len());
                *s =
                    (0..s.len()).map(|j| -dot(&columns[j], &r) - dot(&big_r[j], &lambda)).collect();
            }
            if draft.exact {
                truth = Truth::Solvable;
            }
        }
        1 if nc > 1 && draft.exact => {
            draft.say("squeezed");
            let p: Vec<_> = (0..nc)
                .map(|c| if c == 0 { 0.0 } else { draft.rng.whole(-1, 2).max(0.0) })
                .collect();
            let symmetric = draft.rng.chance(60) && bilateral.is_none();
            let weighted = |rows: &Rows, j: usize| -> f64 {
                -(1..nc).map(|c| p[c] * rows[D * c][j]).sum::<f64>()
            };
            if symmetric {
                let mut b = draft.ints(m, m);
                b[0] = (0..m).map(|j| weighted(&b, j)).collect();
                w = gram(&b);
            } else {
                w[0] = (0..m).map(|j| weighted(&w, j)).collect();
            }
            if let Some((v, _, s)) = &mut bilateral {
                v[0] = (0..s.len()).map(|j| weighted(v, j)).collect();
            }
            let gap = if draft.rng.chance(20) { draft.tiny() } else { 1.0 };
            q[0] = -(1..nc).map(|c| p[c] * q[D * c]).sum::<f64>() - gap;
            // A tiny gap may be rounded away.
            truth = if draft.exact { Truth::Unsolvable } else { Truth::Unknown };
        }
        _ => {}
    }
    (Local { w, q, mu, bilateral }, truth)
}

/// Every contact in units of its own, for impulses and for velocities; the cones stay.
fn in_units(data: &mut Local, d: usize, draft: &mut Draft) {
    let nc = data.mu.len();
    let u = draft.exponents(nc, "u");
    draft.beside(largest(&data.q), u.iter().any(|&e| e != 0));
    // V is both a column of u and a row of r: only equal units keep it one matrix.
    let same = data.bilateral.is_some() || draft.rng.chance(60);
    let r = if same { u.clone() } else { draft.exponents(nc, "r") };
    let spread = |e: &[i32]| e.iter().flat_map(|&e| vec![e; d]).collect::<Vec<_>>();
    let (u, r) = (spread(&u), spread(&r));
    data.w = scaled(&data.w, &u, &r);
    data.q = scaled_vector(&data.q, &u);
    if let Some((v, big_r, s)) = &mut data.bilateral {
        let l = draft.exponents(s.len(), "l");
        *v = scaled(v, &u, &l);
        *big_r = scaled(big_r, &l, &l);
        *s = scaled_vector(s, &l);
    }
}

/// The turns of a tangent plane in whole numbers, each with what it multiplies lengths by.
const TURNS: [([[f64; 2]; 2], f64); 5] = [
    ([[1.0, 0.0], [0.0, 1.0]], 1.0),
    ([[0.0, -1.0], [1.0, 0.0]], 1.0),
    ([[3.0, -4.0], [4.0, 3.0]], 5.0),
    ([[4.0, 3.0], [-3.0, 4.0]], 5.0),
    ([[1.0, 0.0], [0.0, -1.0]], 1.0),
];

/// Turned axes of each contact, u = S u' in space; `mu` becomes that of the plane.
fn turns(draft: &mut Draft, mu: &mut [f64]) -> Vec<[[f64; 3]; 3]> {
    mu.iter_mut()
        .map(|mu| {
            // What was perturbed in its last bits would be rounded by a turn.
            let (t, length) = if draft.exact { draft.rng.pick(&TURNS) } else { TURNS[0] };
            // r = S⁻ᵀ r' shrinks what u grows by: the plane has the larger coefficient.
            *mu *= length;
            [[1.0, 0.0, 0.0], [0.0, t[0][0], t[0][1]], [0.0, t[1][0], t[1][1]]]
        })
        .collect()
}

/// A problem of the plane put into space, with a second tangent that nothing drives, and turned: it has a solution exactly where that of
/// the plane has one. The second is in space, the first what it comes from.
fn lifted(draft: &mut Draft, plane: Local) -> (Local, Local) {
    let nc = plane.mu.len();
    let mut flat = plane;
    let mu = flat.mu.clone();
    let turns = turns(draft, &mut flat.mu);
    let extra: Vec<_> = (0..nc).map(|_| draft.rng.whole(1, 3)).collect();
    let at = |i: usize| (i % 3 < 2).then_some(2 * (i / 3) + i % 3);
    let m = 3 * nc;
    let w = matrix(m, m, |i, j| match (at(i), at(j)) {
        (Some(a), Some(b)) => flat.w[a][b],
        (None, None) if i == j => extra[i / 3],
        _ => 0.0,
    });
    let turn = |i: usize, k: usize| if i / 3 == k / 3 { turns[i / 3][i % 3][k % 3] } else { 0.0 };
    let s = matrix(m, m, turn);
    let ws = matrix(m, m, |i, j| dot(&w[i], &s[j]));
    let columns = transpose(&ws, m);
    let w = matrix(m, m, |i, j| dot(&s[i], &columns[j]));
    let q: Vec<_> = (0..m).map(|i| at(i).map_or(0.0, |a| flat.q[a])).collect();
    let q = times(&s, &q);
    let bilateral = flat.bilateral.as_ref().map(|(v, r, g)| {
        let p = g.len();
        let v = matrix(m, p, |i, j| at(i).map_or(0.0, |a| v[a][j]));
        let columns = transpose(&v, p);
        (matrix(m, p, |i, j| dot(&s[i], &columns[j])), r.clone(), g.clone())
    });
    draft.say("lifted");
    (flat, Local { w, q, mu, bilateral })
}

impl Made for FrictionLocal<2> {
    const NAME: &'static str = "friction_local_2d";
    const NUMBER: u64 = 5;

    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>) {
        let nc = contacts(draft);
        let (mut data, truth) = local_data::<2>(draft, nc);
        in_units(&mut data, 2, draft);
        (local::<2>(&data), truth, None)
    }
}

impl Made for FrictionLocal<3> {
    const NAME: &'static str = "friction_local_3d";
    const NUMBER: u64 = 6;

    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>) {
        let nc = contacts(draft).min(4);
        let (mut data, truth, union) = if draft.rng.chance(60) {
            let (plane, truth) = local_data::<2>(draft, nc);
            let (flat, space) = lifted(draft, plane);
            // The planted truth is that of the plane with the coefficients that it had before.
            let truth = if truth == Truth::Unsolvable { truth } else { Truth::Unknown };
            (space, truth, local::<2>(&flat).union())
        } else {
            let (data, truth) = local_data::<3>(draft, nc);
            (data, truth, None)
        };
        in_units(&mut data, 3, draft);
        (local::<3>(&data), truth, union)
    }
}

fn contacts(draft: &mut Draft) -> usize {
    match draft.rng.below(10) {
        0..7 => 1 + draft.rng.below(2),
        7..9 => 3,
        _ => 4 + draft.rng.below(2),
    }
}

/// The data of a global problem; H by rows, its columns by contact.
struct Global {
    m: Rows,
    h: Rows,
    f: Vec<f64>,
    w: Vec<f64>,
    mu: Vec<f64>,
    /// G by rows, b.
    bilateral: Option<(Rows, Vec<f64>)>,
}

fn global<const D: usize>(data: &Global) -> FrictionGlobal<D> {
    let (n, columns) = (data.f.len(), data.w.len());
    let problem = FrictionGlobal {
        M: csc(&data.m, n),
        H: csc(&data.h, columns),
        f: data.f.clone(),
        w: data.w.clone(),
        mu: data.mu.clone(),
        mu_r: (),
        rows: data
            .bilateral
            .as_ref()
            .map(|(g, b)| RowsGlobal::bilateral(csc(g, b.len()), b.clone())),
    };
    problem.validate().expect("valid");
    problem
}

fn global_data<const D: usize>(draft: &mut Draft, nc: usize) -> (Global, Truth) {
    let (n, columns) = (1 + draft.rng.below(5), D * nc);
    let mut m = match draft.rng.below(6) {
        0 => draft.square(n),
        1 => {
            let (mut g, s) = (gram(&draft.ints(n, n)), draft.ints(n, n));
            for i in 0..n {
                for j in 0..n {
                    g[i][j] += f64::from(u8::from(i == j)) + s[i][j] - s[j][i];
                }
            }
            g
        }
        2 => {
            let mut g = gram(&draft.ints(n, n));
            (0..n).for_each(|i| g[i][i] += 1.0);
            g
        }
        _ => {
            let masses: Vec<_> = (0..n).map(|_| draft.rng.whole(1, 9)).collect();
            matrix(n, n, |i, j| if i == j { masses[i] } else { 0.0 })
        }
    };
    let mut h = draft.ints(n, columns);
    let mut f: Vec<_> = (0..n).map(|_| draft.rng.whole(-5, 2)).collect();
    let mut w: Vec<_> = (0..columns).map(|_| draft.rng.whole(-3, 3)).collect();
    let still = draft.rng.chance(30);
    if still {
        w.fill(0.0);
    }
    let mu = draft.mus(nc);
    let mut bilateral = None;
    if draft.rng.chance(35) {
        draft.say("bilateral");
        let p = 1 + draft.rng.below(3);
        let mut g = draft.ints(n, p);
        let mut b: Vec<_> = (0..p).map(|_| draft.rng.whole(-3, 3)).collect();
        if p > 1 && draft.rng.chance(30) {
            draft.say("redundant");
            g.iter_mut().for_each(|row| row[0] = 2.0 * row[1]);
            b[0] = 2.0 * b[1];
            if draft.rng.chance(40) {
                let i = draft.rng.below(n);
                let tiny = draft.tiny();
                g[i][0] += tiny;
            }
        }
        bilateral = Some((g, b));
    }
    if draft.rng.chance(10) {
        draft.say("mass-ratio");
        let tiny = 2.0_f64.powi(draft.rng.int(10, 40));
        let i = draft.rng.below(n);
        m[i][i] *= tiny;
        // The velocities of the heavy one are numbers of that size.
        draft.fine = draft.fine.min(1.0 / tiny);
        draft.exact = false;
    }
    let mut truth = Truth::Unknown;
    match draft.rng.below(5) {
        0 => {
            draft.say("planted");
            let (r, u) = obedient::<D>(draft, &mu);
            let v: Vec<_> = (0..n).map(|_| draft.rng.whole(-3, 3)).collect();
            let motion = times(&transpose(&h, columns), &v);
            w = (0..columns).map(|j| u[j] - motion[j]).collect();
            let push = times(&h, &r);
            f = times(&m, &v).iter().zip(push).map(|(a, b)| a - b).collect();
            if let Some((g, b)) = &mut bilateral {
                let lambda: Vec<_> = b.iter().map(|_| draft.rng.whole(-2, 2)).collect();
                f.iter_mut().zip(times(g, &lambda)).for_each(|(f, x)| *f -= x);
                *b = times(&transpose(g, b.len()), &v).iter().map(|x| -x).collect();
            }
            if draft.exact {
                truth = Truth::Solvable;
            }
        }
        1 if nc > 1 => {
            draft.say("squeezed");
            let p: Vec<_> = (0..nc)
                .map(|c| if c == 0 { 0.0 } else { draft.rng.whole(-1, 2).max(0.0) })
                .collect();
            for row in &mut h {
                row[0] = -(1..nc).map(|c| p[c] * row[D * c]).sum::<f64>();
            }
            let gap = if draft.rng.chance(20) { draft.tiny() } else { 1.0 };
            w[0] = -(1..nc).map(|c| p[c] * w[D * c]).sum::<f64>() - gap;
            truth = if draft.exact { Truth::Unsolvable } else { Truth::Unknown };
        }
        _ => {}
    }
    let plain = Global { m, h, f, w, mu, bilateral };
    let velocity =
        Condense.reduce(&global::<D>(&plain)).map_or(1.0, |(local, _)| largest(&local.q));
    let Global { m, h, f, w, mu, bilateral } = plain;
    // Units of contacts and of motions.
    let e = draft.exponents(nc, "u");
    draft.beside(velocity, e.iter().any(|&e| e != 0));
    let e: Vec<_> = e.iter().flat_map(|&e| vec![e; D]).collect();
    let s = draft.exponents(n, "v");
    let m = scaled(&m, &s, &s);
    let h = scaled(&h, &s, &e);
    let (f, w) = (scaled_vector(&f, &s), scaled_vector(&w, &e));
    let bilateral = bilateral.map(|(g, b)| {
        let l = draft.exponents(b.len(), "l");
        (scaled(&g, &s, &l), scaled_vector(&b, &l))
    });
    (Global { m, h, f, w, mu, bilateral }, truth)
}

/// The largest modulus.
fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |size, x| size.max(x.abs()))
}

impl Made for FrictionGlobal<2> {
    const NAME: &'static str = "friction_global_2d";
    const NUMBER: u64 = 7;

    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>) {
        let nc = contacts(draft);
        let (data, truth) = global_data::<2>(draft, nc);
        (global::<2>(&data), truth, None)
    }
}

impl Made for FrictionGlobal<3> {
    const NAME: &'static str = "friction_global_3d";
    const NUMBER: u64 = 8;

    fn draw(draft: &mut Draft) -> (Self, Truth, Option<Union>) {
        let nc = contacts(draft).min(4);
        if draft.rng.chance(40) {
            let (data, truth) = global_data::<3>(draft, nc);
            return (global::<3>(&data), truth, None);
        }
        // From the plane, with a motion of its own for each second tangent.
        draft.say("lifted");
        let (mut flat, truth) = global_data::<2>(draft, nc);
        let mu = flat.mu.clone();
        let turns = turns(draft, &mut flat.mu);
        let (n, columns) = (flat.f.len(), 3 * nc);
        let at = |j: usize| (j % 3 < 2).then_some(2 * (j / 3) + j % 3);
        let (heavy, m) = (n + nc, &flat.m);
        let m = matrix(heavy, heavy, |i, j| match (i < n, j < n) {
            (true, true) => m[i][j],
            (false, false) if i == j => 1.0,
            _ => 0.0,
        });
        // In the unit of the contact: the most that it makes of motions in theirs, to a power of two.
        let width = |c: usize| {
            let of = |(i, row): (usize, &Vec<f64>)| {
                let mass = if flat.m[i][i] == 0.0 { 1.0 } else { flat.m[i][i].abs() };
                row[2 * c].abs().max(row[2 * c + 1].abs()) / mass.sqrt()
            };
            match flat.h.iter().enumerate().map(of).fold(0.0, f64::max) {
                0.0 => 1.0,
                width => width.log2().round().exp2(),
            }
        };
        let straight = matrix(heavy, columns, |i, j| match at(j) {
            Some(k) if i < n => flat.h[i][k],
            None if i == n + j / 3 => width(j / 3),
            _ => 0.0,
        });
        // u = S Hᵀ v + S w.
        let turned = |x: &[f64], j: usize| -> f64 {
            (0..3).map(|k| turns[j / 3][j % 3][k] * x[j / 3 * 3 + k]).sum()
        };
        let h = matrix(heavy, columns, |i, j| turned(&straight[i], j));
        let w: Vec<_> = (0..columns).map(|j| at(j).map_or(0.0, |k| flat.w[k])).collect();
        let w = (0..columns).map(|j| turned(&w, j)).collect();
        let mut f = flat.f.clone();
        f.resize(heavy, 0.0);
        let bilateral = flat.bilateral.clone().map(|(mut g, b)| {
            g.resize(heavy, vec![0.0; b.len()]);
            (g, b)
        });
        let union = global::<2>(&flat).union();
        let truth = if truth == Truth::Unsolvable { truth } else { Truth::Unknown };
        (global::<3>(&Global { m, h, f, w, mu, bilateral }), truth, union)
    }
}
