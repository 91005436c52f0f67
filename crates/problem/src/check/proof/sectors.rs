//! Contacts in space with Coulomb's friction by cases, each closed by a vector, in exact arithmetic.
//!
//! A solution has at each contact one of three states:
//!
//! ```text
//! open    r = 0,  u_N ≥ 0
//! stick   u = 0,  r ∈ K
//! slide   u_N = 0,  u_T = −α e,  r = r_N (1, mu e),  α ≥ 0,  r_N ≥ 0,  ‖e‖ = 1
//! ```
//!
//! With y over the rows of a [`ConeSystem`] `A t = b`, p its entries in the rows of a contact's velocity and `z = yᵀA` in the columns of its impulse, `yᵀ A t ≥ 0` holds for all t of a state where
//!
//! ```text
//! open    p_T = 0,  p_N ≥ 0
//! stick   z ∈ K*
//! slide   p_Tᵀ e ≤ 0,  z_N + mu z_Tᵀ e ≥ 0
//! ```
//!
//! A y with `yᵀ b < 0` thus closes every choice of states of which this is true at each contact. The directions e are cut into sectors, so that finitely many vectors may close all choices: then
//! there is no solution. Nothing is relaxed: in a sector the conditions are those of all its directions, which squares decide in rational numbers.
//!
//! Cost: three sums of products a contact and vector; a look at each case and the vectors that may close it; rational operations where doubled precision does not decide.

use std::cell::OnceCell;

use nonsmooth_linalg::budget;

use super::cones::{About, Column, ConeSystem, Entries, NEAR, Vector};
use super::evidence::ExactVector;
use super::exact::{Equation, Exact, double, exact, negative, rounded, satisfying};
use super::statement::exacts;

/// A contact in space with Coulomb's friction, as a part of a [`ConeSystem`].
#[derive(Debug, Clone)]
pub(crate) struct Spatial {
    /// The row of u_N, which those of u_T follow.
    pub(crate) row: usize,
    pub(crate) mu: f64,
    /// The columns of r, as the problem has them; without friction that of r_N.
    pub(crate) impulses: Vec<Column>,
    /// The columns of the system that say the same of it, or less.
    pub(crate) own: Vec<usize>,
}

/// Of more contacts than this the choices are too many.
pub(crate) const FEW: usize = 16;

/// The states of a contact that a case leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Case {
    /// All.
    Any,
    /// No impulse.
    Open,
    /// No motion; without friction no normal motion.
    Stick,
    /// Sliding, the impulse of friction in one of these directions.
    Slide(Sector),
}

impl Case {
    /// The cases that it falls into, with friction or without; none where it is small enough.
    pub fn parts(self, friction: bool) -> Vec<Self> {
        match self {
            Self::Any if friction => {
                let sliding = Sector::thirds().map(Self::Slide);
                [Self::Open, Self::Stick].into_iter().chain(sliding).collect()
            }
            Self::Any => vec![Self::Open, Self::Stick],
            Self::Slide(sector) => sector.halves().into_iter().flatten().map(Self::Slide).collect(),
            Self::Open | Self::Stick => vec![],
        }
    }
}

/// Directions between two, both included, less than half a turn apart and counterclockwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sector {
    from: [i32; 2],
    to: [i32; 2],
    halvings: u32,
    /// The first of the smallest sectors that it consists of.
    first: usize,
}

/// Halvings of a third of the circle: down to two degrees.
const HALVINGS: u32 = 6;
/// So many sectors there are then.
const SMALLEST: usize = 3 << HALVINGS;

impl Sector {
    /// All directions.
    pub fn thirds() -> [Self; 3] {
        let corners = [[7, 0], [-4, 6], [-4, -6]];
        let third = |k: usize| Self {
            from: corners[k],
            to: corners[(k + 1) % 3],
            halvings: 0,
            first: k << HALVINGS,
        };
        [0, 1, 2].map(third)
    }

    /// The two parts of it; `None` of one that is small enough.
    pub fn halves(self) -> Option<[Self; 2]> {
        let Self { from, to, halvings, first } = self;
        let middle = [from[0] + to[0], from[1] + to[1]];
        let part = |from, to, first| Self { from, to, halvings: halvings + 1, first };
        let second = first + (1 << HALVINGS >> (halvings + 1));
        (halvings < HALVINGS).then(|| [part(from, middle, first), part(middle, to, second)])
    }

    /// Its ends, of length 1 up to rounding.
    pub fn ends(self) -> [[f64; 2]; 2] {
        [self.from, self.to].map(|d| {
            let [x, y] = d.map(f64::from);
            let size = x.hypot(y);
            [x / size, y / size]
        })
    }

    /// How often a third of the circle was halved for it.
    pub fn depth(self) -> u32 {
        self.halvings
    }

    /// The smallest sectors, counterclockwise.
    fn smallest() -> Vec<Self> {
        let mut all = Self::thirds().to_vec();
        for _ in 0..HALVINGS {
            all = all.into_iter().flat_map(Self::halves).flatten().collect();
        }
        all
    }
}

/// States of a contact as a set: open, sticking, and each of the smallest sectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct States([u64; STATES.div_ceil(64)]);

const STATES: usize = 2 + SMALLEST;

impl States {
    fn insert(&mut self, state: usize) {
        self.0[state / 64] |= 1 << (state % 64);
    }

    /// Those of a case.
    fn of(case: Case, friction: bool) -> Self {
        let mut all = Self::default();
        let range = match case {
            Case::Any if friction => 0..STATES,
            Case::Any => 0..2,
            Case::Open => 0..1,
            Case::Stick => 1..2,
            Case::Slide(s) => 2 + s.first..2 + s.first + (1 << HALVINGS >> s.halvings),
        };
        range.for_each(|state| all.insert(state));
        all
    }

    fn holds(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(a, b)| b & !a == 0)
    }

    fn meets(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).any(|(a, b)| a & b != 0)
    }
}

/// What a vector says of a contact.
struct Look {
    /// y in the rows of its velocity.
    p: [Exact; 3],
    near: [f64; 3],
    /// `yᵀA` in the columns of its impulse, in doubled precision, and exactly once that is asked for.
    z: [About; 3],
    exact: OnceCell<[Exact; 3]>,
}

/// A vector that separates b where all contacts are in cases that it closes.
struct Closing<'a> {
    y: Vec<Exact>,
    contacts: &'a [Spatial],
    looks: Vec<Look>,
    /// The relative change of the entries that makes true what it has to satisfy beside the contacts.
    beside: f64,
    /// Its power is more than rounding makes.
    strong: bool,
}

/// The least relative power of a vector that closes cases up to rounding.
const POWER: f64 = 1e-8;

/// The claim that these vectors close all cases.
pub(super) struct Claimed<'a> {
    system: &'a ConeSystem,
    closing: Vec<Closing<'a>>,
    /// Their places among those that were given.
    places: Vec<usize>,
    /// The smallest sectors, with the unit vectors of their ends.
    sectors: Vec<(Sector, [[f64; 2]; 2])>,
}

impl<'a> Claimed<'a> {
    /// The vectors that may close something. `None` of a system without such contacts, and where the computation of this thread is over.
    pub(super) fn new(
        system: &'a ConeSystem,
        entries: &Entries,
        vectors: &[Vec<Exact>],
    ) -> Option<Self> {
        if system.spatial.is_empty() {
            return None;
        }
        let own = system.own();
        let columns: Vec<Vec<Vec<(usize, f64)>>> =
            system.spatial.iter().map(|c| c.impulses.iter().map(in_doubles).collect()).collect();
        let (mut closing, mut places) = (vec![], vec![]);
        for (k, y) in vectors.iter().enumerate() {
            if budget::over() {
                return None;
            }
            if let Some(one) = Closing::new(system, entries, y, &own, &columns) {
                closing.push(one);
                places.push(k);
            }
        }
        let sectors = Sector::smallest().into_iter().map(|s| (s, s.ends())).collect();
        Some(Self { system, closing, places, sectors })
    }

    /// Whether they close all cases **in exact arithmetic**: of those that it takes the places and, as for [`ConeSystem::refutation`], by how much there is no solution.
    pub(super) fn refutation(&self, weights: &[f64]) -> Option<(Vec<usize>, f64)> {
        let covered = self.cover(0.0)?;
        let used: Vec<usize> = (0..covered.used.len()).filter(|&k| covered.used[k]).collect();
        let weights = exacts(weights);
        let margin = |&k: &usize| self.system.excess(&self.closing[k].y, &weights);
        let least = used.iter().map(margin).fold(f64::INFINITY, f64::min);
        Some((used.iter().map(|&k| self.places[k]).collect(), least))
    }

    /// A relative change of the entries of A and b for which they would; `None` where that is more than [`NEAR`].
    pub(super) fn nearness(&self) -> Option<f64> {
        [1e-13, 1e-11, NEAR]
            .into_iter()
            .find_map(|most| self.cover(most))
            .map(|covered| covered.change)
    }

    /// How the vectors close all cases, where a relative change of the entries up to `most` is forgiven; `None` where a case stays open.
    fn cover(&self, most: f64) -> Option<Covered> {
        let contacts = &self.system.spatial;
        let mut covered = Covered { used: vec![false; self.closing.len()], change: 0.0 };
        // Of each vector and contact the states that it closes, and what it asks to be forgiven.
        let mut closed: Vec<Vec<(States, f64)>> = vec![];
        for closing in &self.closing {
            if budget::over() {
                return None;
            }
            let states = |c| closing.states(c, &self.sectors, most);
            closed.push((0..contacts.len()).map(states).collect());
        }
        let all: Vec<usize> =
            (0..self.closing.len()).filter(|&k| self.closing[k].counts(most)).collect();
        let friction = |c: usize| contacts[c].mu > 0.0;
        let any = |c: usize| (Case::Any, States::of(Case::Any, friction(c)));
        let mut open = vec![((0..contacts.len()).map(any).collect::<Vec<_>>(), all)];
        let mut seen = 0;
        while let Some((cases, candidates)) = open.pop() {
            seen += 1;
            if seen > CASES || budget::over() {
                return None;
            }
            let whole =
                |k: &&usize| closed[**k].iter().zip(&cases).all(|(s, case)| s.0.holds(&case.1));
            if let Some(&k) = candidates.iter().find(whole) {
                covered.used[k] = true;
                let asked = closed[k].iter().fold(self.closing[k].beside, |a, s| a.max(s.1));
                covered.change = covered.change.max(asked);
                continue;
            }
            // The contact of which most of those that may close something want to know more.
            let wanting = |c: usize| {
                candidates.iter().filter(|&&k| !closed[k][c].0.holds(&cases[c].1)).count()
            };
            let divisible =
                (0..contacts.len()).filter(|&c| !cases[c].0.parts(friction(c)).is_empty());
            let c = divisible.max_by_key(|&c| (wanting(c), usize::MAX - c))?;
            for part in cases[c].0.parts(friction(c)) {
                let part = (part, States::of(part, friction(c)));
                let may = |k: &usize| closed[*k][c].0.meets(&part.1);
                let left: Vec<usize> = candidates.iter().copied().filter(may).collect();
                if left.is_empty() {
                    return None;
                }
                let mut cases = cases.clone();
                cases[c] = part;
                open.push((cases, left));
            }
        }
        Some(covered)
    }
}

/// The vectors that close all cases, and the largest relative change that one of them asks for.
struct Covered {
    used: Vec<bool>,
    change: f64,
}

/// What doubled precision knows of an inequality: whether it holds, and a relative change of the entries for which it does.
struct Known {
    sign: Option<bool>,
    change: f64,
}

impl Known {
    /// The change that it asks for; `None` where that is more than `most`. What is not known is decided exactly.
    fn within(&self, most: f64, decided: impl FnOnce() -> bool) -> Option<f64> {
        match self.sign {
            Some(true) => Some(0.0),
            _ if self.change <= most => Some(self.change),
            Some(false) => None,
            None => decided().then_some(0.0),
        }
    }
}

/// Cases that are looked at.
const CASES: usize = 50_000;
/// States that are decided in rational numbers, a contact and vector: more are at the boundary by rounding.
const DOUBTFUL: usize = 8;

fn in_doubles(column: &Column) -> Vec<(usize, f64)> {
    column.iter().map(|(i, x)| (*i, double(x).unwrap_or(f64::NAN))).collect()
}

impl<'a> Closing<'a> {
    /// `None` where y separates nothing, whatever the states, even up to rounding.
    fn new(
        system: &'a ConeSystem,
        entries: &Entries,
        y: &[Exact],
        own: &[bool],
        columns: &[Vec<Vec<(usize, f64)>>],
    ) -> Option<Self> {
        let contacts = &system.spatial[..];
        let mut y = y.to_vec();
        // The rows that bound friction are not needed here.
        let bounds = system.slack_rows.iter().filter(|(_, slacks)| slacks.iter().all(|&j| own[j]));
        bounds.for_each(|(row, _)| y[*row] = Exact::ZERO);
        let power = y.iter().zip(&system.rhs).fold(Exact::ZERO, |sum, (y, b)| sum + y * b);
        if !negative(&power) {
            return None;
        }
        let terms = y.iter().zip(&system.rhs).map(|(y, b)| (rounded(y) * rounded(b)).abs());
        let strong = rounded(&power) < -POWER * terms.sum::<f64>();
        let beside = system.beside(entries, &y, own)?;
        let vector = Vector::new(&y);
        let look = |(contact, columns): (&Spatial, &Vec<Vec<(usize, f64)>>)| {
            let p = [0, 1, 2].map(|k| y[contact.row + k].clone());
            let of = |k: usize| columns.get(k).into_iter().flatten().copied();
            let z = [0, 1, 2].map(|k| {
                let about = About::sum(of(k), &vector.doubled);
                // Nothing by their size may be terms below all doubles.
                let hidden = about.size == 0.0 && of(k).any(|(i, x)| x != 0.0 && !y[i].is_zero());
                About { size: if hidden { f64::NAN } else { about.size }, ..about }
            });
            let near = [0, 1, 2].map(|k| rounded(&p[k]));
            Look { p, near, z, exact: OnceCell::new() }
        };
        let looks = contacts.iter().zip(columns).map(look).collect();
        Some(Self { y, contacts, looks, beside, strong })
    }

    /// Whether it is one of those that may close something, where a relative change of the entries is forgiven.
    fn counts(&self, change: f64) -> bool {
        self.beside <= change && (self.strong || change == 0.0)
    }

    /// The states of contact c that it closes where a relative change of the entries up to `most` is forgiven, exactly where that is zero, and how much of it is asked for.
    fn states(&self, c: usize, sectors: &[(Sector, [[f64; 2]; 2])], most: f64) -> (States, f64) {
        let (look, mu) = (&self.looks[c], self.contacts[c].mu);
        let (mut states, mut asked) = (States::default(), 0.0_f64);
        let still = look.p[1].is_zero() && look.p[2].is_zero();
        if still && !negative(&look.p[0]) {
            states.insert(0);
        }
        let in_cone =
            self.friction(c, None).within(most, || in_dual_cone(look.exactly(self, c), &exact(mu)));
        if (still || mu > 0.0)
            && let Some(change) = in_cone
        {
            states.insert(1);
            asked = asked.max(change);
        }
        let mut doubtful = 0;
        for (k, (sector, ends)) in sectors.iter().enumerate() {
            let away = |d| still || look.is_away(d);
            if mu == 0.0 || !(away(sector.from) && away(sector.to)) {
                continue;
            }
            let decided = || {
                doubtful += 1;
                doubtful <= DOUBTFUL && self.holds(c, *sector)
            };
            let change = in_cone.or_else(|| self.friction(c, Some(ends)).within(most, decided));
            if let Some(change) = change {
                states.insert(2 + k);
                asked = asked.max(change);
            }
        }
        (states, asked)
    }

    /// What doubled precision knows of `z_N + mu z_Tᵀ e ≥ 0` for all unit vectors e, or those between two.
    fn friction(&self, c: usize, ends: Option<&[[f64; 2]; 2]>) -> Known {
        let (look, mu) = (&self.looks[c], self.contacts[c].mu);
        let [n, t1, t2] = &look.z;
        if !look.z.iter().all(|z| z.size == 0.0 || z.is_in_range()) {
            return Known { sign: None, change: f64::INFINITY };
        }
        let size = n.size + mu * (t1.size + t2.size);
        let value = least(&[n.value, t1.value, t2.value], mu, ends);
        let error = n.error + mu * (t1.error + t2.error);
        let doubt = error + 1e-14 * (n.value.abs() + mu * (t1.value.abs() + t2.value.abs()));
        let sure = value.abs() > doubt || size == 0.0;
        // Less than that is not told from nothing.
        let change = ((doubt - value) / size).max(f64::EPSILON / 16.0);
        Known { sign: sure.then_some(value >= 0.0), change }
    }

    /// Whether it is so in a sector, exactly.
    fn holds(&self, c: usize, sector: Sector) -> bool {
        let (z, mu) = (self.looks[c].exactly(self, c), exact(self.contacts[c].mu));
        // Where the impulse of friction may be opposite to z_T, that is the least.
        if is_between(sector, &[-&z[1], -&z[2]]) {
            return in_dual_cone(z, &mu);
        }
        [sector.from, sector.to].into_iter().all(|d| is_borne(z, &mu, d))
    }
}

impl Look {
    /// `yᵀA` in the columns of the impulse of contact c, which this is about.
    fn exactly(&self, closing: &Closing, c: usize) -> &[Exact; 3] {
        self.exact.get_or_init(|| {
            let columns = &closing.contacts[c].impulses;
            let sum = |column: &Column| {
                let terms = column.iter().filter(|(i, _)| !closing.y[*i].is_zero());
                terms.fold(Exact::ZERO, |sum, (i, x)| sum + x * &closing.y[*i])
            };
            [0, 1, 2].map(|k| columns.get(k).map_or(Exact::ZERO, sum))
        })
    }

    /// The sign of `p_Tᵀ d`: whether it is at most zero.
    fn is_away(&self, d: [i32; 2]) -> bool {
        let parts = [0, 1].map(|k| self.near[1 + k] * f64::from(d[k]));
        let (sum, size) = (parts[0] + parts[1], parts[0].abs() + parts[1].abs());
        if sum.abs() > 1e-14 * size && size > 1e-200 && size.is_finite() {
            return sum < 0.0;
        }
        let exact = &self.p[1] * Exact::from(d[0]) + &self.p[2] * Exact::from(d[1]);
        exact <= Exact::ZERO
    }
}

/// `min z_N + mu z_Tᵀ e` over all unit vectors e, or those of a sector with these ends, up to rounding.
fn least(z: &[f64; 3], mu: f64, ends: Option<&[[f64; 2]; 2]>) -> f64 {
    let all = z[0] - mu * z[1].hypot(z[2]);
    let Some(&[from, to]) = ends else { return all };
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let opposite = [-z[1], -z[2]];
    if cross(from, opposite) >= 0.0 && cross(opposite, to) >= 0.0 {
        return all;
    }
    let at = |e: [f64; 2]| z[0] + mu * (z[1] * e[0] + z[2] * e[1]);
    at(from).min(at(to))
}

/// `z_N ≥ mu‖z_T‖`
fn in_dual_cone(z: &[Exact; 3], mu: &Exact) -> bool {
    let square = |x: &Exact| x * x;
    !negative(&z[0]) && square(&z[0]) >= square(mu) * (square(&z[1]) + square(&z[2]))
}

/// Whether d is in the sector.
fn is_between(sector: Sector, d: &[Exact; 2]) -> bool {
    let cross = |a: [i32; 2]| Exact::from(a[0]) * &d[1] - Exact::from(a[1]) * &d[0];
    !negative(&cross(sector.from)) && cross(sector.to) <= Exact::ZERO
}

/// `z_N ‖d‖ + mu z_Tᵀ d ≥ 0`
fn is_borne(z: &[Exact; 3], mu: &Exact, d: [i32; 2]) -> bool {
    let along = mu * (&z[1] * Exact::from(d[0]) + &z[2] * Exact::from(d[1]));
    let length = d.iter().map(|&d| i64::from(d) * i64::from(d)).sum::<i64>();
    let [normal, along_2] = [&z[0] * &z[0] * Exact::from(length), &along * &along];
    match (negative(&z[0]), negative(&along)) {
        (false, false) => true,
        (false, true) => normal >= along_2,
        (true, false) => along_2 >= normal,
        (true, true) => false,
    }
}

/// Rational operations that balancing a vector may cost.
const BUDGET: usize = 200_000;
/// Products below this, relative to their terms, are meant to be zero.
const MEANT: f64 = 1e-12;

impl ConeSystem {
    /// The vector with these entries in the rows of its contacts in space, three a contact, whose other entries make its products with the free columns beside them vanish, exactly. Where other
    /// entries can do so at all, products with the impulse of a contact that nearly vanish are made to vanish as well, by a change of the entries within rounding.
    /// `None` where there are no such contacts, or no such entries.
    pub fn balanced(&self, p: &[f64]) -> Option<ExactVector> {
        if self.spatial.is_empty() || p.len() != 3 * self.spatial.len() {
            return None;
        }
        let mut y = vec![Exact::ZERO; self.rhs.len()];
        let mut weights = vec![1.0; y.len()];
        for (c, contact) in self.spatial.iter().enumerate() {
            for k in 0..3 {
                y[contact.row + k] = exact(p[3 * c + k]);
                weights[contact.row + k] = 0.0;
            }
        }
        self.slack_rows.iter().for_each(|(row, _)| weights[*row] = 0.0);
        let own = self.own();
        let equation = |terms: &Column| Equation { terms: terms.clone(), constant: Exact::ZERO };
        let others = self.free.iter().filter(|&&j| !own[j]).map(|&j| &self.columns[j]);
        let balance: Vec<&Column> = others.collect();
        let all = |columns: &[&Column]| columns.iter().map(|c| equation(c)).collect();
        let y = satisfying(all(&balance), &y, &weights, BUDGET)?;
        if balance.is_empty() {
            return Some(ExactVector(y));
        }
        let doubled = Vector::new(&y).doubled;
        let vanishes = |column: &&Column| {
            let z = About::sum(in_doubles(column).into_iter(), &doubled);
            z.value.abs() <= MEANT * z.size
        };
        let still = self.spatial.iter().filter(|c| c.impulses.iter().all(|r| vanishes(&r)));
        let tight: Vec<&Column> = still.flat_map(|c| &c.impulses).chain(balance).collect();
        self.spatial.iter().flat_map(|c| c.row..c.row + 3).for_each(|i| {
            weights[i] = rounded(&y[i]).abs();
        });
        let mended = satisfying(all(&tight), &y, &weights, BUDGET);
        let largest = p.iter().fold(0.0_f64, |l, p| l.max(p.abs()));
        let is_near = |mended: &Vec<Exact>| {
            let rows = self.spatial.iter().flat_map(|c| c.row..c.row + 3);
            rows.zip(p).all(|(i, p)| (rounded(&mended[i]) - p).abs() <= NEAR * largest)
        };
        Some(ExactVector(mended.filter(is_near).unwrap_or(y)))
    }

    /// Of each column whether it is one of the contacts in space.
    fn own(&self) -> Vec<bool> {
        let mut own = vec![false; self.columns.len()];
        self.spatial.iter().flat_map(|c| &c.own).for_each(|&j| own[j] = true);
        own
    }

    /// The relative change of the entries that makes y satisfy what columns beside the contacts in space ask of it, the two of a pair for themselves; `None` where that is more than
    /// [`NEAR`], and where the computation of this thread is over.
    fn beside(&self, entries: &Entries, y: &[Exact], own: &[bool]) -> Option<f64> {
        let vector = &Vector::new(y);
        let mut change = 0.0_f64;
        let others = self.rays.iter().chain(self.pairs.iter().flatten());
        let all = self.free.iter().map(|j| (j, true)).chain(others.map(|j| (j, false)));
        for (&j, free) in all.filter(|(j, _)| !own[**j]) {
            if budget::over() {
                return None;
            }
            let sign = self.sign(entries, vector, j);
            if sign.is_eq() || (!free && sign.is_gt()) {
                continue;
            }
            let (value, size) = self.measured(entries, vector, j);
            change = change.max(value.abs() / size);
        }
        (change <= NEAR).then_some(change)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use nonsmooth_linalg::{Bsr, Csc};

    use super::*;
    use crate::check::{Certificate, Evidence};
    use crate::{FrictionLocal, Problem};

    /// A sector of some depth, by the halves that are chosen.
    fn some(random: &mut Pcg64Mcg) -> Sector {
        let mut sector = Sector::thirds()[random.random_range(0..3)];
        for _ in 0..random.random_range(0..=HALVINGS) {
            sector = sector.halves().unwrap()[random.random_range(0..2)];
        }
        sector
    }

    /// Unit vectors of a sector, its ends among them.
    fn directions(sector: Sector, count: usize) -> impl Iterator<Item = [f64; 2]> {
        let [from, to] = sector.ends();
        let turn = (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1]);
        let at = from[1].atan2(from[0]);
        (0..=count).map(move |k| {
            let angle = at + turn * k as f64 / count as f64;
            [angle.cos(), angle.sin()]
        })
    }

    #[test]
    fn parts_cover_what_they_are_parts_of() {
        let holds = |sector: Sector, d: &[Exact; 2]| is_between(sector, d);
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let mut narrowest = f64::INFINITY;
        for _ in 0..2000 {
            let d = [0, 1].map(|_| exact(random.random_range(-1.0..1.0)));
            assert!(Sector::thirds().into_iter().any(|s| holds(s, &d)));
            let sector = some(&mut random);
            let [from, to] = sector.ends();
            narrowest = narrowest.min(from[0] * to[1] - from[1] * to[0]);
            assert!(narrowest > 0.0);
            match sector.halves() {
                Some(halves) => {
                    assert_eq!(holds(sector, &d), halves.into_iter().any(|h| holds(h, &d)));
                }
                None => assert_eq!(sector, Sector::smallest()[sector.first]),
            }
            let states = |case| States::of(case, true);
            let parts = Case::Slide(sector).parts(true);
            let any = parts.iter().any(|&part| states(part).meets(&states(Case::Slide(sector))));
            assert_eq!(any, !parts.is_empty());
            assert!(states(Case::Any).holds(&states(Case::Slide(sector))));
        }
        assert!(narrowest < 0.04, "{narrowest}");
        assert_eq!(Sector::smallest().len(), SMALLEST);
        assert_eq!(Case::Any.parts(true).len(), 5);
        assert_eq!(Case::Any.parts(false), [Case::Open, Case::Stick]);
        assert!(Case::Open.parts(true).is_empty() && Case::Stick.parts(true).is_empty());
    }

    #[test]
    fn the_least_product_over_a_sector_is_found_exactly_and_in_doubles() {
        let mut random = Pcg64Mcg::seed_from_u64(2);
        let mut signs = [0, 0];
        for _ in 0..3000 {
            let sector = some(&mut random);
            let mu = random.random_range(0.1..3.0);
            let z: [f64; 3] = std::array::from_fn(|_| random.random_range(-1.0..1.0));
            let of = |e: [f64; 2]| z[0] + mu * (z[1] * e[0] + z[2] * e[1]);
            let sampled = directions(sector, 400).map(of).fold(f64::INFINITY, f64::min);
            let found = least(&z, mu, Some(&sector.ends()));
            assert!(found <= sampled + 1e-12 && found > sampled - 1e-4, "{found} {sampled}");
            let (e, m) = (z.map(exact), exact(mu));
            let holds = if is_between(sector, &[-&e[1], -&e[2]]) {
                in_dual_cone(&e, &m)
            } else {
                [sector.from, sector.to].into_iter().all(|d| is_borne(&e, &m, d))
            };
            assert_eq!(holds, found >= 0.0, "{found}");
            signs[usize::from(holds)] += 1;
        }
        assert!(signs.iter().all(|&n| n > 300), "{signs:?}");
    }

    /// One contact with a mass of its own, which is driven into the ground: `u_N = r_N - 1` closes no case but the open one, whatever the vector says in units in which its terms vanish.
    #[test]
    fn terms_below_all_doubles_are_no_zeros() {
        for tiny in [1.0, 1e-160, 1e-170] {
            let w = Bsr::from_csc(&Csc::diagonal(&[tiny; 3]));
            let problem = FrictionLocal::<3>::new(w, vec![-1.0, 0.0, 0.0], vec![0.5]).unwrap();
            let vectors = vec![ExactVector(vec![exact(tiny), Exact::ZERO, Exact::ZERO])];
            let evidence = problem.evidence(&Certificate::Separating { vectors });
            assert!(!matches!(evidence, Evidence::Proved(_)), "{tiny}");
        }
    }

    #[test]
    fn signs_at_the_boundary_are_exact() {
        let sector = Sector { from: [1, 0], to: [0, 1], halvings: 0, first: 0 };
        let whole = |x: [i32; 3]| x.map(Exact::from);
        // z_N = 5 mu, z_T = -(3, 4): on the boundary of K*, and beside it by less than doubles see.
        let mu = Exact::from(1) / Exact::from(3);
        let on = [Exact::from(5) * &mu, Exact::from(-3), Exact::from(-4)];
        assert!(in_dual_cone(&on, &mu) && is_between(sector, &[-&on[1], -&on[2]]));
        let tiny = exact(1e-300);
        let below = [&on[0] - &tiny, on[1].clone(), on[2].clone()];
        assert!(!in_dual_cone(&below, &mu));
        // Along the ends, of any length: 1 - 1 = 0, and less.
        assert!(is_borne(&whole([1, -1, 9]), &Exact::ONE, [7, 0]));
        assert!(!is_borne(&whole([1, -2, 9]), &Exact::ONE, [7, 0]));
        assert!(is_borne(&whole([-1, 1, 9]), &Exact::ONE, [7, 0]));
        assert!(!is_borne(&whole([-2, 1, 9]), &Exact::ONE, [7, 0]));
    }
}
