//! Each kind of problem as a [`ConeSystem`].

use super::cones::{Column, ConeSystem};
use super::evidence::Claim;
use super::exact::{Exact, exact};
use crate::{BoxLcp, FrictionGlobal, FrictionLocal, Hlcp, Lcp, Mlcp};
use nonsmooth_linalg::{Csc, Matrix};

/// The columns of M times `sign`, moved down by `row`; `None` of an operator.
fn columns(m: &Matrix, sign: i8, wanted: &dyn Fn(usize) -> bool) -> Option<Vec<Column>> {
    let mut out = vec![Column::new(); m.ncols()];
    let sign = f64::from(sign);
    let known = m.for_each(|i, j, x| {
        if wanted(i) {
            out[j].push((i, exact(sign * x)));
        }
    });
    known.then_some(out)
}

fn exacts(x: &[f64]) -> Vec<Exact> {
    x.iter().map(|&x| exact(x)).collect()
}

/// `x = t_j`.
fn just(j: usize) -> (Exact, Vec<(usize, Exact)>) {
    (Exact::ZERO, vec![(j, Exact::ONE)])
}

/// A problem that can be stated in exact numbers. `wanted`: the rows of the problem whose entries matter; all without it.
pub(crate) trait Exactly {
    /// `None` where the problem's matrix is known by its products only.
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem>;

    /// The rows of the system, but for those that define bounds.
    fn rows(&self) -> usize;

    /// Of a contact problem: the row where the velocities of its contacts begin; those of bilateral constraints follow.
    fn impulses_from(&self) -> Option<usize> {
        None
    }

    /// Whether the vector, where it is the only one, may separate all, by a look in plain arithmetic.
    fn is_plausible(&self, _: &Claim) -> bool {
        true
    }
}

/// `w − M z = q`.
impl Exactly for Lcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        mixed(&self.M, &self.q, 0, 0, wanted)
    }

    fn rows(&self) -> usize {
        self.q.len()
    }

    fn is_plausible(&self, y: &Claim) -> bool {
        plausible(&self.M, &self.q, y)
    }
}

/// Whether `qᵀ y < 0` and `Mᵀ y ≤ 0`, up to much more than rounding: exact numbers of a large matrix are not made in vain.
fn plausible(m: &Matrix, q: &[f64], y: &Claim) -> bool {
    let Claim::Doubles(y) = y else { return true };
    let terms = q.iter().zip(y).map(|(q, y)| q * y);
    let (power, size) = terms.fold((0.0, 0.0), |(sum, size), t: f64| (sum + t, size + t.abs()));
    let mut slopes = vec![(0.0, 0.0); m.ncols()];
    m.for_each(|i, j, x| {
        let (sum, size) = &mut slopes[j];
        *sum += x * y[i];
        *size += (x * y[i]).abs();
    });
    let nearly = |(sum, size): &(f64, f64)| *sum <= 1e-6 * size;
    nearly(&(power, size)) && slopes.iter().all(nearly)
}

impl Exactly for Mlcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        mixed(&self.M, &self.q, self.equalities, self.free, wanted)
    }

    fn rows(&self) -> usize {
        self.q.len()
    }
}

fn mixed(
    m: &Matrix,
    q: &[f64],
    equalities: usize,
    free: usize,
    wanted: Option<&[bool]>,
) -> Option<ConeSystem> {
    let mut system = ConeSystem::new(exacts(q), wanted);
    for (j, column) in columns(m, -1, &|i| system.wants(i))?.into_iter().enumerate() {
        let z = system.column(column);
        system.unknowns.push(just(z));
        match j.checked_sub(free) {
            None => system.free.push(z),
            Some(k) => {
                let w = system.unit(equalities + k, 1);
                system.pairs.push([w, z]);
            }
        }
    }
    Some(system)
}

/// `Q x + R s = q`.
impl Exactly for Hlcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let mut system = ConeSystem::new(exacts(&self.q), wanted);
        let [x, s] = [&self.Q, &self.R].map(|m| columns(m, 1, &|i| system.wants(i)));
        let x: Vec<_> = x?.into_iter().map(|c| system.column(c)).collect();
        let s: Vec<_> = s?.into_iter().map(|c| system.column(c)).collect();
        system.unknowns = x.iter().chain(&s).map(|&j| just(j)).collect();
        system.pairs = x.into_iter().zip(s).map(|(x, s)| [x, s]).collect();
        Some(system)
    }

    fn rows(&self) -> usize {
        self.q.len()
    }
}

/// `w − M (z − z₀) = q + M z₀` with z₀ at a bound of each variable.
impl Exactly for BoxLcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let mut system = ConeSystem::new(exacts(&self.q), wanted);
        let all = columns(&self.M, -1, &|i| system.wants(i))?;
        for (j, column) in all.into_iter().enumerate() {
            let unknown = bounded(&mut system, j, column, [self.lower[j], self.upper[j]]);
            system.unknowns.push(unknown);
        }
        Some(system)
    }

    fn rows(&self) -> usize {
        self.q.len()
    }
}

/// The variable z of a row whose `w = M z + q` is its partner, with the column of −M: `−w ∈ N_[l, u](z)`. A variable between two bounds has its distances from
/// both, x and y with `x + y = u − l`, and `w = w⁺ − w⁻`: pairs (w⁺, x) and (w⁻, y).
fn bounded(
    system: &mut ConeSystem,
    row: usize,
    column: Column,
    [l, u]: [f64; 2],
) -> (Exact, Vec<(usize, Exact)>) {
    let origin = exact(if l.is_finite() { l } else { u });
    for (i, x) in &column {
        system.rhs[*i] -= x * &origin;
    }
    let opposite = |c: &Column| c.iter().map(|(i, x)| (*i, -x)).collect::<Column>();
    let unknown = match (l.is_finite(), u.is_finite()) {
        (false, false) => {
            let z = system.column(column);
            system.free.push(z);
            vec![(z, Exact::ONE)]
        }
        (true, false) => {
            let pair = [system.unit(row, 1), system.column(column)];
            system.pairs.push(pair);
            vec![(pair[1], Exact::ONE)]
        }
        (false, true) => {
            let pair = [system.unit(row, -1), system.column(opposite(&column))];
            system.pairs.push(pair);
            vec![(pair[1], -Exact::ONE)]
        }
        (true, true) if l == u => {
            let w = system.unit(row, 1);
            system.free.push(w);
            vec![]
        }
        (true, true) => {
            let bound = system.row(exact(u) - exact(l));
            let x = system.column([column, vec![(bound, Exact::ONE)]].concat());
            let y = system.unit(bound, 1);
            let pairs = [[system.unit(row, 1), x], [system.unit(row, -1), y]];
            system.pairs.extend(pairs);
            system.slack_rows.push((bound, [x, y]));
            vec![(x, Exact::ONE)]
        }
    };
    (origin, unknown)
}

/// The impulses and velocities of contacts: columns of r as given, in the rows that begin with `first` the velocities u.
///
/// The law in the plane: `0 ≤ u_N ⟂ r_N ≥ 0`, `u_T = a − b`, `0 ≤ a ⟂ mu r_N + r_T ≥ 0`, `0 ≤ b ⟂ mu r_N − r_T ≥ 0`: r_T < mu r_N where it moves
/// is excluded, and the pairs of a resting contact may have a = b. In space with friction only `0 ≤ u_N ⟂ r_N ≥ 0`, `|r_Tk| ≤ mu r_N` is said.
fn contacts<const D: usize>(
    system: &mut ConeSystem,
    first: usize,
    mut impulses: Vec<Column>,
    mu: &[f64],
) -> Vec<(Exact, Vec<(usize, Exact)>)> {
    let mut unknowns = vec![];
    for (c, &mu) in mu.iter().enumerate() {
        let row = |k: usize| first + D * c + k;
        let mut normal = std::mem::take(&mut impulses[D * c]);
        let coefficient = exact(mu);
        let mut tangential = vec![];
        for k in 1..D {
            if mu == 0.0 {
                let u = system.unit(row(k), 1);
                system.free.push(u);
                tangential.push((Exact::ZERO, vec![]));
                continue;
            }
            // With σ± = mu r_N ± r_T ≥ 0: r_T = σ⁺ − mu r_N, and σ⁺ + σ⁻ = 2 mu r_N in a row of its own.
            let along = std::mem::take(&mut impulses[D * c + k]);
            normal.extend(along.iter().map(|(i, x)| (*i, -(&coefficient * x))));
            let bound = system.row(Exact::ZERO);
            normal.push((bound, Exact::from(2u8) * &coefficient));
            let plus = system.column([along, vec![(bound, -Exact::ONE)]].concat());
            let minus = system.unit(bound, -1);
            system.slack_rows.push((bound, [plus, minus]));
            if D == 2 {
                let (a, b) = (system.unit(row(k), 1), system.unit(row(k), -1));
                system.pairs.extend([[a, plus], [b, minus]]);
            } else {
                let u = system.unit(row(k), 1);
                system.free.push(u);
                system.rays.extend([plus, minus]);
                system.complete = false;
            }
            tangential.push((Exact::ZERO, vec![(plus, Exact::ONE)]));
        }
        let pair = [system.unit(row(0), 1), system.column(normal)];
        system.pairs.push(pair);
        unknowns.push(just(pair[1]));
        for mut t in tangential {
            if !t.1.is_empty() {
                t.1.push((pair[1], -&coefficient));
            }
            unknowns.push(t);
        }
    }
    unknowns
}

/// The columns of A times −1, its rows moved down by `row`.
fn opposite(a: &Csc, row: usize, system: &ConeSystem) -> Vec<Column> {
    let mut out = vec![Column::new(); a.ncols()];
    for (i, j, x) in a.triplets() {
        if system.wants(row + i) {
            out[j].push((row + i, exact(-x)));
        }
    }
    out
}

/// Adds the columns of the second to those of the first.
fn under(first: Vec<Column>, second: Vec<Column>) -> Vec<Column> {
    first.into_iter().zip(second).map(|(a, b)| [a, b].concat()).collect()
}

/// `u − W r − V λ = q`, `c − Vᵀ r − R λ = s`.
impl<const D: usize> Exactly for FrictionLocal<D> {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let m = self.q.len();
        let mut rhs = exacts(&self.q);
        rhs.extend(self.rows.iter().flat_map(|b| exacts(&b.s)));
        let mut system = ConeSystem::new(rhs, wanted);
        let mut impulses = opposite(&self.W.to_csc(), 0, &system);
        let mut multipliers = vec![];
        if let Some(b) = &self.rows {
            impulses = under(impulses, opposite(&b.V.transpose(), m, &system));
            let all = under(opposite(&b.V, 0, &system), opposite(&b.R, m, &system));
            let all = all.into_iter().enumerate();
            multipliers =
                all.map(|(j, c)| bounded(&mut system, m + j, c, b.bounds.of(j))).collect();
        }
        system.unknowns = contacts::<D>(&mut system, 0, impulses, &self.mu);
        system.unknowns.extend(multipliers);
        Some(system)
    }

    fn rows(&self) -> usize {
        self.q.len() + self.multipliers()
    }

    fn impulses_from(&self) -> Option<usize> {
        Some(0)
    }
}

/// `M v − H r − G λ = f`, `u − Hᵀ v = w`, `c − Gᵀ v = b`.
impl<const D: usize> Exactly for FrictionGlobal<D> {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let (n, m) = (self.dofs(), self.w.len());
        let mut rhs = exacts(&[&self.f[..], &self.w].concat());
        rhs.extend(self.rows.iter().flat_map(|b| exacts(&b.b)));
        let mut system = ConeSystem::new(rhs, wanted);
        let mut velocities = opposite(&self.M, 0, &system);
        velocities.iter_mut().flatten().for_each(|(_, x)| *x = -std::mem::take(x));
        velocities = under(velocities, opposite(&self.H.transpose(), n, &system));
        let mut multipliers = vec![];
        if let Some(b) = &self.rows {
            velocities = under(velocities, opposite(&b.G.transpose(), n + m, &system));
            multipliers = opposite(&b.G, 0, &system);
        }
        let velocities: Vec<_> = velocities.into_iter().map(|c| system.column(c)).collect();
        system.free.extend(&velocities);
        let bounds = self.rows.iter().flat_map(|b| (0..b.b.len()).map(|j| b.bounds.of(j)));
        let multipliers = multipliers.into_iter().zip(bounds).enumerate();
        let of_row = |(j, (c, bounds))| bounded(&mut system, n + m + j, c, bounds);
        let multipliers: Vec<_> = multipliers.map(of_row).collect();
        let impulses = opposite(&self.H, 0, &system);
        let impulses = contacts::<D>(&mut system, n, impulses, &self.mu);
        system.unknowns = velocities.into_iter().map(just).collect();
        system.unknowns.extend(impulses);
        system.unknowns.extend(multipliers);
        Some(system)
    }

    fn rows(&self) -> usize {
        self.dofs() + self.w.len() + self.multipliers()
    }

    fn impulses_from(&self) -> Option<usize> {
        Some(self.dofs())
    }
}
