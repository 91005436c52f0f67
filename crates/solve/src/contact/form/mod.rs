//! Capabilities that the families of solvers are generic over, and which problem offers which.
//!
//! | capability | what a family may ask | offered by |
//! | --- | --- | --- |
//! | [`Disked`] | that the cone is made of disks, and their coefficients | local, global |
//! | [`Frictional`] | that the law is Coulomb's, and its coefficients | local, global without rolling friction |
//! | [`Contacts`] | the law, the diagonal blocks of W, ‖q‖, the impulses of a point | local, global |
//! | [`Rows`] | one scalar row's velocity, and to be told that its impulse moved | local, global |
//! | [`Blockwise`] | in addition, one contact's velocity, and to be told that one contact's impulse moved | local (rows of W), global (velocity space) |
//! | [`Concurrent`] | in addition, which contacts do not feel each other, and visits from several threads | local, global |
//! | [`Linear`] | `u = W r + q` for all contacts | local (W), global (product form) |
//! | [`Explicit`] | entries of matrices that state the symmetric part of W | local (W), global (M, H, G) |
//! | [`Linearised`] | to solve `(Q + P W) x = b` with block-diagonal P, Q | local (in contact space), global (in velocity space) |
//! | [`Parted`] | the problem without rows whose impulses are held, or of an island alone | local, global |
//!
//! [`Regularised`] offers what the problem inside it does, but for [`Explicit`] and [`Parted`].

mod explicit;
mod global;
mod linearised;
mod local;
mod regularised;
mod rows;

use nonsmooth_linalg::{Block, Groups, Moving, Passes, Singular, small};
use nonsmooth_problem::check::{Certificate, Exact, ExactVector, Impulses, friction_rows};
use nonsmooth_problem::{Bounds, FrictionGlobal, Problem, RollingData};

pub use explicit::{Explicit, Model};
pub use local::LocalState;
pub use regularised::{Overwrite, Regularised, RegularisedState};

use crate::SolveError;
use crate::contact::law::cone::ConvexSet;
use crate::contact::law::{ContactLaw, Coulomb, DiskLaw};

/// How a family uses W.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Contact by contact ([`Blockwise`]).
    Visits,
    /// By products with all of it ([`Linear`]).
    Products,
    /// In linear systems ([`Linearised`]), and in both ways above.
    Newton,
    /// Contact by contact and scalar row by scalar row ([`Rows`]): all other ways refuse rows that have bounds.
    Rows,
}

impl Access {
    /// Errors: rows with bounds, for a method that knows none.
    fn admit(self, bounds: Option<&Bounds>) -> Result<(), SolveError> {
        match bounds.and_then(|bounds| bounds.bounded().next().map(|j| (j, bounds.of(j)))) {
            Some((j, [l, u])) if self != Access::Rows => Err(SolveError::needs(
                "scalar rows without bounds (nsgs, psor and auto take bounds)",
                format!("[l, u][{j}] = [{l}, {u}]"),
            )),
            _ => Ok(()),
        }
    }
}

/// A problem with D-dimensional frictional contacts, seen by its contacts.
///
/// `State` is what the view keeps beside the problem: velocities, factorisations, buffers.
pub trait Contacts<const D: usize>: Problem {
    /// The law of the contacts.
    type Law: ContactLaw<D>;
    /// What the view keeps between calls.
    type State: Send;

    /// Prepares the view for one kind of access.
    fn state(&self, access: Access) -> Result<Self::State, SolveError>;

    /// Prepares an existing view for this problem and the same access, reusing memory where the shape is the same.
    fn refill(&self, state: &mut Self::State) -> Result<(), SolveError>;

    /// A verified certificate that the bilateral constraints contradict each other, if they do.
    fn contradiction<'a>(&self, state: &'a Self::State) -> Option<&'a Impulses>;

    /// The number of contacts nc.
    fn contacts(&self) -> usize;

    /// The law of contact c.
    fn law(&self, c: usize) -> Self::Law;

    /// The diagonal block `W_cc`.
    fn diagonal_block(&self, state: &Self::State, c: usize) -> [[f64; D]; D];

    /// `w_c = tr(W_cc)/D` of all contacts, which makes impulses velocities. Positive: of a contact that its own impulse does not move, the mean of the others, or 1.
    fn units(&self, state: &Self::State, unit: &mut Vec<f64>) {
        unit.clear();
        let of = |c| small::mean_diagonal(&self.diagonal_block(state, c));
        unit.extend((0..self.contacts()).map(of));
        if unit.iter().all(|w| *w > 0.0) {
            return;
        }
        let positive = unit.iter().filter(|w| **w > 0.0);
        let (count, sum) = (positive.clone().count(), positive.sum::<f64>());
        let mean = if count > 0 { sum / count as f64 } else { 1.0 };
        unit.iter_mut().filter(|w| w.is_nan() || **w <= 0.0).for_each(|w| *w = mean);
    }

    /// `‖q‖`, or 1 where q = 0: what a solver's estimate is relative to.
    fn velocity_scale(&self, state: &Self::State) -> f64;

    /// The impulses of a point.
    fn impulses(point: &mut Self::Point) -> &mut [f64];

    /// Takes the impulses of `point` as the current ones.
    fn enter(&self, state: &mut Self::State, point: &Self::Point);

    /// Completes `point` (velocities, multipliers) from its impulses, exactly.
    fn complete(&self, state: &mut Self::State, point: &mut Self::Point);

    /// The problem by its bodies, where it is stated so and no scalar rows join them.
    fn bodies(&self) -> Option<&FrictionGlobal<D, Self::Law>>
    where
        Self::Law: DiskLaw<D>,
    {
        None
    }
}

/// Contacts with Coulomb's law, for methods whose formulas are those of that law.
pub trait Frictional<const D: usize>: Contacts<D, Law = Coulomb> {
    /// mu, nc, each ≥ 0.
    fn mu(&self) -> &[f64];
}

/// Contacts under a law whose cone is made of disks, with rolling friction or without.
pub trait Disked<const D: usize>: Contacts<D, Law: DiskLaw<D>> {}

impl<P: Contacts<D, Law: DiskLaw<D>>, const D: usize> Disked<D> for P {}

/// Access to the scalar rows that have bounds, row by row. Those without are no concern of a visitor: the view keeps `c = 0` there.
///
/// The state must be made with [`Access::Rows`].
pub trait Rows<const D: usize>: Contacts<D> {
    /// The bounds, if the problem has rows.
    fn bounds(&self) -> Option<&Bounds>;

    /// The impulses of the contacts of a point, and those of all rows.
    fn all_impulses(point: &mut Self::Point) -> (&mut [f64], &mut [f64]);

    /// `∂c_j/∂λ_j`; zero where bilateral rows determine c_j, see `DETERMINED`.
    fn row_response(&self, state: &Self::State, j: usize) -> f64;

    /// The velocity `c_j` of row j for the current impulses.
    fn row_velocity(&self, state: &Self::State, r: &[f64], lambda: &[f64], j: usize) -> f64;

    /// The impulse of row j moved by `by` (and λ holds it already).
    fn row_moved(&self, state: &mut Self::State, j: usize, by: f64);
}

/// What bilateral rows leave of the response of a row is rounding where it is at most this part of the response without them.
const DETERMINED: f64 = 1e-12;

/// Problems that are parts of this one.
pub trait Parted<const D: usize>: Rows<D> + Sized {
    /// The problem without the rows that are `held`, whose impulses are loads of it; the others, in their order, have no bounds there.
    fn holding(&self, held: &[Option<f64>]) -> Self;

    /// Joins what feels each other, of the numbers of the contacts and, after them, of the unknowns that contacts may have beside their impulses. Of a problem without scalar rows.
    fn join(&self, groups: &mut Groups);

    /// The problem of one of these groups alone, by its members in ascending order.
    fn island(&self, members: &[usize]) -> Self;

    /// As [`island`](Self::island), in place of one of the same members; allocates nothing where what it is made of keeps its shape, of a global problem where M and H stay as they are.
    fn island_again(&self, members: &[usize], island: &mut Self);

    /// What says that an island has no solution, said of the whole.
    fn lifted(&self, members: &[usize], certificate: Certificate) -> Certificate;
}

/// That of some `contacts` said of all: `given` are the places, among so many rows, of the rows that are no [`friction_rows`].
fn lifted<L: DiskLaw<D>, const D: usize>(
    laws: &[L],
    contacts: &[usize],
    (given, rows): (&[usize], usize),
    certificate: Certificate,
) -> Certificate {
    match certificate {
        Certificate::Impulses(Impulses { r, lambda }) => {
            let mut all = vec![0.0; D * laws.len()];
            for (r, &c) in r.chunks(D).zip(contacts) {
                all[D * c..D * c + D].copy_from_slice(r);
            }
            Certificate::Impulses(Impulses { r: all, lambda })
        }
        Certificate::Separating { vectors } => {
            let whole = friction_rows::<L, D>(laws.iter().copied());
            let own = friction_rows::<L, D>(contacts.iter().map(|&c| laws[c]));
            let place = |&[c, k]: &[usize; 2]| whole.binary_search(&[contacts[c], k]);
            let of_friction = own.iter().filter_map(|row| Some(rows + place(row).ok()?));
            let places: Vec<usize> = given.iter().copied().chain(of_friction).collect();
            let lift = |vector: ExactVector| {
                let mut all = vec![Exact::ZERO; rows + whole.len()];
                places.iter().zip(vector.0).for_each(|(&place, y)| all[place] = y);
                ExactVector(all)
            };
            Certificate::Separating { vectors: vectors.into_iter().map(lift).collect() }
        }
        other => other,
    }
}

/// The coefficients of rolling friction of these contacts.
fn rolling_of<R: RollingData>(all: &R, contacts: &[usize]) -> R {
    R::of(contacts.iter().filter_map(|&c| all.values().get(c).copied()).collect())
}

/// The rows of these contacts, the first of all being `first`.
fn rows_of<const D: usize>(
    first: usize,
    contacts: &[usize],
) -> impl Iterator<Item = usize> + Clone + '_ {
    contacts.iter().flat_map(move |&c| first + D * c..first + D * (c + 1))
}

/// The components of these contacts, of all.
fn of_contacts<const D: usize>(all: &[f64], contacts: &[usize], own: &mut Vec<f64>) {
    own.clear();
    own.extend(contacts.iter().flat_map(|&c| small::block::<D>(all, c)));
}

/// The values at these places, of all or of none.
fn of_each(all: &[f64], places: impl Iterator<Item = usize>, own: &mut Vec<f64>) {
    own.clear();
    own.extend(places.filter_map(|place| all.get(place).copied()));
}

/// The impulses of the rows that are held, zero of the others, and the places of the latter.
fn held_and_left(held: &[Option<f64>]) -> (Vec<f64>, Vec<usize>) {
    let loads = held.iter().map(|x| x.unwrap_or(0.0)).collect();
    (loads, (0..held.len()).filter(|&j| held[j].is_none()).collect())
}

/// Whether the problem has rows with bounds.
pub fn has_bounds<P: Rows<D>, const D: usize>(problem: &P) -> bool {
    problem.bounds().is_some_and(|bounds| !bounds.are_free())
}

/// Puts impulses within the cones, each at the nearest point of its own.
pub fn put_within_cones<P: Contacts<D>, const D: usize>(problem: &P, r: &mut [f64]) {
    for c in 0..problem.contacts() {
        let inside = problem.law(c).project(&small::block::<D>(r, c));
        r[D * c..D * c + D].copy_from_slice(&inside);
    }
}

/// Access contact by contact, as block Gauss–Seidel needs it.
pub trait Blockwise<const D: usize>: Rows<D> {
    /// The relative velocity `u_c` for the current impulses `r`.
    fn velocity(&self, state: &Self::State, r: &[f64], c: usize) -> [f64; D];

    /// The impulse of contact `c` moved by `dr` (and `r` holds it already).
    fn moved(&self, state: &mut Self::State, c: usize, dr: &[f64; D]);

    /// Contact `c` will be visited after [`AHEAD`] others: what the visit reads from afar may be fetched into the cache.
    #[inline(always)]
    fn foresee(&self, _state: &Self::State, _c: usize) {}

    /// How sweeps may follow each other on several threads, where there are 20 000 contacts or more: each comes to the contacts in this order.
    fn passes<'a>(&self, _state: &'a Self::State) -> Option<&'a Passes> {
        None
    }

    /// The same view for visits from several threads, where it has passes.
    fn moving<'a>(&'a self, _state: &'a mut Self::State) -> Option<Visits<'a, D>> {
        None
    }
}

/// So many contacts are worth an order of their own: a sweep takes a millisecond.
const MANY: usize = 20_000;

/// What a view that has passes lets several threads see and move at the same time: `u_c − given_c`, by the contact's position in the passes.
pub struct Visits<'a, const D: usize> {
    /// The passes.
    pub passes: &'a Passes,
    /// `H_cᵀ v`.
    pub moving: Moving<'a, D>,
    /// The part of the velocities that no impulse changes, by contact.
    pub given: &'a [f64],
}

/// So many visits take as long as memory takes to answer.
pub const AHEAD: usize = 4;

/// Access contact by contact from several threads: velocities may be asked for at the same time.
pub trait Concurrent<const D: usize>: Blockwise<D> + Contacts<D, State: Sync> + Sync {
    /// Appends the places that the velocity of contact c depends on, and those that its impulse changes. Places are numbered as the
    /// view likes; two contacts do not feel each other if neither changes what the other depends on.
    fn places(&self, state: &Self::State, c: usize, reads: &mut Vec<u32>, writes: &mut Vec<u32>);
}

/// Products with the whole operator.
pub trait Linear<const D: usize>: Contacts<D> {
    /// `u = W r + q`.
    fn velocities(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]);

    /// The same with all sums in doubled precision, rounded once: for the last digits, where the terms of u are so much larger
    /// than u that their rounding hides the residual. Costs several times a plain product.
    fn velocities_precisely(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]);
}

/// What the means of a method cost, in units of about a nanosecond: to choose between them, the same on every machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// One Gauss–Seidel sweep over all contacts.
    pub sweep: f64,
    /// An iteration with one [`linearise`](Linearised::linearise).
    pub factorisation: f64,
    /// An iteration with one [`solve_linearised`](Linearised::solve_linearised) alone.
    pub solve: f64,
    /// What may be spent in place of a factorisation where many of them are to come: as if elimination were ten times as slow as it is. The more a graph fills, the more iterations its problems take.
    pub worth: f64,
    /// A point completed and judged.
    pub look: f64,
}

/// Linear systems with a block-diagonal modification of W, as Newton, interior-point and proximal methods have them.
///
/// The state must be made with [`Access::Newton`]. Cost of `linearise`: assembly and one sparse LU, whose symbolic analysis is
/// done once per pattern; of `solve_linearised`: one to five solves and products with W.
pub trait Linearised<const D: usize>: Linear<D> + Blockwise<D> {
    /// Factorises `Q + P W`.
    ///
    /// The factor is that of `Q + δ w_c P + P W`, δ = 1e-10, so Q may be singular and W rank deficient.
    /// Errors: a matrix that cannot be factorised even so (not finite, a zero row).
    fn linearise(
        &self,
        state: &mut Self::State,
        p: &[Block<D>],
        q: &[Block<D>],
    ) -> Result<(), Singular>;

    /// The sign of `det(Q + P W)` for the P and Q last given, times one that is the same for all of them; NaN where nothing was factorised.
    fn orientation(&self, state: &mut Self::State) -> f64;

    /// The solution of `(Q + P W) x = b` for the P and Q last given, refined against that matrix, and `wx = W x`.
    ///
    /// Returns `‖b − Q x − P W x‖ / ‖b‖`: where `Q + P W` is singular it need not be small.
    fn solve_linearised(
        &self,
        state: &mut Self::State,
        b: &[f64],
        x: &mut [f64],
        wx: &mut [f64],
    ) -> f64;

    /// What sweeps and factorisations cost on this problem. Makes the symbolic analysis.
    fn costs(&self, state: &mut Self::State) -> Costs;

    /// About the share of all directions of impulses that move the bodies in a way of their own, in [0, 1]: `(tr W)²/(m ‖W‖²)` in units of `w_c`, which is rank W/m where all
    /// eigenvalues but zero are alike, else less. Small where a structure is hyperstatic.
    ///
    /// Here `‖W‖²` is the mean of `‖W g‖²` over a few vectors g of signs in no order (Hutchinson1990), which is good to a fifth or so. Cost: as many products with W; `room` is memory.
    fn spread(&self, state: &mut Self::State, room: &mut Vec<f64>) -> f64 {
        const PROBES: u64 = 4;
        let m = D * self.contacts();
        room.clear();
        room.resize(4 * m, 0.0);
        let (unit, rest) = room.split_at_mut(m);
        let (r, rest) = rest.split_at_mut(m);
        let (q, u) = rest.split_at_mut(m);
        for (c, unit) in unit.chunks_mut(D).enumerate() {
            let w = small::mean_diagonal(&self.diagonal_block(state, c));
            unit.fill(if w > 0.0 { 1.0 / w.sqrt() } else { 0.0 });
        }
        self.velocities(state, r, q);
        let mut squares = 0.0;
        for probe in 0..PROBES {
            for (i, (r, unit)) in r.iter_mut().zip(&*unit).enumerate() {
                // The sign of a fixed hash of the place.
                let place = PROBES * i as u64 + probe;
                let hash = (place + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_mul(place | 1);
                *r = if hash >> 63 == 0 { *unit } else { -unit };
            }
            self.velocities(state, r, u);
            let moved =
                u.iter().zip(&*q).zip(&*unit).map(|((u, q), unit)| ((u - q) * unit).powi(2));
            squares += moved.sum::<f64>();
        }
        let felt = unit.iter().filter(|unit| **unit > 0.0).count();
        felt as f64 * PROBES as f64 / squares
    }
}

/// The method S, which is its hyperparameters, on contacts of dimension D.
#[derive(Debug, Clone, Copy)]
pub struct OnContacts<S, const D: usize>(pub S);
