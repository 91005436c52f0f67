//! **NSGS**, nonsmooth block Gauss–Seidel over contacts.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact, W given by its rows or, in velocity
//! space, by `u_c = H_cᵀ v + w_c` and `v += M⁻¹ H_c Δr_c`.
//!
//! Method: visit the contacts in turn; freeze all impulses but the visited contact's; solve that contact's own
//! problem `u_c = W_cc r_c + (q_c + Σ_{j≠c} W_cj r_j)` with a local solver; go on with the new impulse. With relaxation
//! `r_c ← (1 − ω) r_c + ω r_c^new`, projected back on K where ω > 1.
//!
//! References: JourdanAlartJean1998; Jean1999; Acary, lecture (107); AcaryBremondHuber2018 for orderings, relaxation and freezing.
//!
//! Cost of a sweep: one pass over the blocks of W (or over the rows of H and M⁻¹H) plus nc local solves; nothing is
//! allocated. Storage: the diagonal blocks and the local solver's memo, 100 to 250 bytes a contact.
//!
//! Fails: no convergence proof for friction; on hyperstatic problems (3nc > n) it slows down to thousands of sweeps below 1e-4,
//! and it may circle for large mu with strongly coupled normal and tangential directions.

use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::linalg::small;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cfun::Disk;
use crate::form::{Access, Blockwise};
use crate::local::{
    Exact, LocalSolver, Newton, Projection, ProjectionIterated, Quartic, frictionless,
};
use crate::parts::{Order, Ordering};
use crate::registry::Visitor;
use crate::settings::Settings;
use crate::{SolveError, Solver, Step, cone};

/// The hyperparameters of NSGS.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Nsgs {
    /// The one-contact solver. Contacts without friction and contacts in the plane have a closed form.
    pub local: LocalChoice,
    /// Relaxation, in (0, 2); 1 is plain Gauss-Seidel. Below 1 helps flexible bodies, above 1 rarely helps.
    pub omega: f64,
    /// Where 1000 sweeps bring no progress and go in circles, omega is multiplied by 0.8, down to this, in (0, 2).
    /// Not below omega: never.
    pub omega_min: f64,
    /// The order of the contacts within a sweep.
    pub ordering: Ordering,
    /// The seed of the shuffled orders.
    pub seed: u64,
    /// Freeze a contact after this many visits in a row that moved it by less than a thousandth of the mean
    /// move of a contact in the last sweep; 0 never freezes.
    pub freeze_after: u32,
    /// The number of sweeps for which a frozen contact is passed over.
    pub freeze_for: u32,
    /// Sweeps between two evaluations of the true residual, unless the cheap estimate asks for one earlier.
    pub check_every: usize,
}

/// The one-contact solvers by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LocalChoice {
    /// Cases, and a bracketed one-parameter root for sliding.
    #[default]
    Exact,
    /// Cases, and all roots of the quartic for sliding.
    Quartic,
    /// Safeguarded Newton on the Alart-Curnier function.
    NewtonAc,
    /// Safeguarded Newton on the Jean-Moreau function.
    NewtonJm,
    /// One projection step on the cone a visit.
    Projection,
    /// Projection steps until the contact is solved.
    ProjectionIterated,
}

impl Default for Nsgs {
    fn default() -> Self {
        Self {
            local: LocalChoice::default(),
            omega: 1.0,
            omega_min: 0.4,
            ordering: Ordering::default(),
            seed: 0,
            freeze_after: 0,
            freeze_for: 10,
            check_every: 50,
        }
    }
}

impl Settings for Nsgs {
    fn validate(&self) -> Result<(), String> {
        for (key, omega) in [("omega", self.omega), ("omega_min", self.omega_min)] {
            if !(omega > 0.0 && omega < 2.0) {
                return Err(format!("{key}: expected a number in (0, 2), found {omega}"));
            }
        }
        if self.check_every == 0 {
            return Err("check_every: expected at least 1, found 0".into());
        }
        if self.freeze_after > 0 && self.freeze_for == 0 {
            return Err("freeze_for: expected at least 1 while freeze_after is set, found 0".into());
        }
        Ok(())
    }
}

/// NSGS with its local solver known by type, so that the kernel inlines.
#[derive(Debug, Clone)]
pub struct Sweeps<L, const D: usize> {
    /// The hyperparameters.
    pub settings: Nsgs,
    /// The local solver (`settings.local` by type).
    pub local: L,
}

impl Nsgs {
    /// Hands the method with its local solver's type to `visitor`, once a session.
    pub(crate) fn visit<const D: usize, V>(self, visitor: V) -> V::Output
    where
        V: Visitor,
        V::Problem: Blockwise<D>,
    {
        let settings = self;
        match settings.local {
            LocalChoice::Exact => visitor.visit(Sweeps { settings, local: Exact }),
            LocalChoice::Quartic => visitor.visit(Sweeps { settings, local: Quartic }),
            LocalChoice::NewtonAc => {
                visitor.visit(Sweeps { settings, local: Newton { disk: Disk::AlartCurnier } })
            }
            LocalChoice::NewtonJm => {
                visitor.visit(Sweeps { settings, local: Newton { disk: Disk::JeanMoreau } })
            }
            LocalChoice::Projection => visitor.visit(Sweeps { settings, local: Projection }),
            LocalChoice::ProjectionIterated => {
                visitor.visit(Sweeps { settings, local: ProjectionIterated::default() })
            }
        }
    }
}

/// The workspace: the problem's view, and what each contact keeps.
pub struct SweepsWork<P: Blockwise<D>, L: LocalSolver<D>, const D: usize> {
    state: P::State,
    contacts: Vec<Contact<L::Memo, D>>,
    order: Order,
    /// The mean of `w_c²‖Δr_c‖²/‖q‖²` in the last sweep, the yardstick of freezing.
    mean_move: f64,
    relaxation: Relaxation,
    /// The impulses before the last two sweeps of a window.
    marks: [Vec<f64>; 2],
}

/// The relaxation of the present sweep, lowered where the sweeps go in circles.
///
/// Gauss–Seidel with exact local solves can enter a limit cycle (nonsymmetric W, status changes that chase each other);
/// a smaller ω breaks it. A cycle shows in two things: the smallest move of a window of sweeps is no smaller than that of
/// the window before, and one sweep does not move as the one before it did, which slow convergence and impulses that run
/// away do.
#[derive(Debug, Clone, Copy)]
struct Relaxation {
    omega: f64,
    sweeps: usize,
    smallest: f64,
    before: f64,
}

impl Relaxation {
    const WINDOW: usize = 1000;
    const NO_PROGRESS: f64 = 0.98;
    const ALIGNED: f64 = 0.999;
    const FACTOR: f64 = 0.8;

    fn new(omega: f64) -> Self {
        Self { omega, sweeps: 0, smallest: f64::INFINITY, before: f64::INFINITY }
    }

    /// Counts a sweep; true at the end of a window without progress.
    fn observe(&mut self, estimate: f64) -> bool {
        self.smallest = self.smallest.min(estimate);
        self.sweeps += 1;
        if self.sweeps < Self::WINDOW {
            return false;
        }
        let stuck = self.smallest > Self::NO_PROGRESS * self.before;
        (self.sweeps, self.before, self.smallest) = (0, self.smallest, f64::INFINITY);
        stuck
    }

    /// Which mark the next sweep starts from, if it is one of the last two of a window.
    fn mark(&self) -> Option<usize> {
        (self.sweeps + 2).checked_sub(Self::WINDOW)
    }

    fn lower(&mut self, omega_min: f64) {
        if self.omega > omega_min {
            self.omega = (Self::FACTOR * self.omega).max(omega_min);
        }
    }
}

struct Contact<Memo, const D: usize> {
    w: [[f64; D]; D],
    mu: f64,
    /// `tr(W_cc)/D` over ‖q‖: turns an impulse into a relative velocity.
    unit: f64,
    /// Visits in a row with hardly a move; beyond `freeze_after` it counts sweeps slept.
    settled: u32,
    memo: Memo,
}

/// The square of a relative move that is far below any rounding: impulses that die away end as zeros instead of
/// as subnormal numbers, which are slow.
const NEGLIGIBLE: f64 = 1e-80;

impl<const D: usize, P, L> Solver<P> for Sweeps<L, D>
where
    P: Blockwise<D>,
    L: LocalSolver<D>,
{
    type Work = SweepsWork<P, L, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let mut work = SweepsWork {
            state: problem.state(Access::Visits)?,
            contacts: Vec::with_capacity(problem.mu().len()),
            order: Order::new(self.settings.ordering, problem.mu().len(), self.settings.seed),
            mean_move: 0.0,
            relaxation: Relaxation::new(self.settings.omega),
            marks: Default::default(),
        };
        self.fill(problem, &mut work);
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)?;
        self.fill(problem, work);
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.enter(&mut work.state, point);
        work.mean_move = 0.0;
        work.relaxation = Relaxation::new(self.settings.omega);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone());
        }
        let r = P::impulses(point);
        let SweepsWork { state, contacts, order, mean_move, relaxation, marks } = work;
        if let Some(mark) = relaxation.mark() {
            marks[mark].copy_from_slice(r);
        }
        let Nsgs { omega_min, freeze_after, freeze_for, .. } = self.settings;
        let omega = relaxation.omega;
        let mut moves = 0.0;
        let mut still = true;
        let settled_below = 1e-6 * *mean_move;
        for &c in order.next_sweep() {
            let c = c as usize;
            let contact = &mut contacts[c];
            if freeze_after > 0 && contact.settled >= freeze_after {
                contact.settled += 1;
                if contact.settled > freeze_after + freeze_for {
                    contact.settled = 0;
                }
                continue;
            }
            let old: [f64; D] = small::block(r, c);
            let u = problem.velocity(state, r, c);
            let own = small::mul(&contact.w, &old);
            let mut q = u;
            for k in 0..D {
                q[k] -= own[k];
            }
            let mut new = if contact.mu > 0.0 {
                self.local.solve(&mut contact.memo, &contact.w, &q, contact.mu, &old)
            } else {
                frictionless(&contact.w, &q, &old)
            };
            if omega != 1.0 {
                for k in 0..D {
                    new[k] = (1.0 - omega) * old[k] + omega * new[k];
                }
                if omega > 1.0 {
                    new = cone::project(&new, contact.mu);
                }
            }
            let mut dr = new;
            for k in 0..D {
                dr[k] -= old[k];
            }
            let moved: f64 = dr.iter().map(|x| (contact.unit * x).powi(2)).sum();
            if moved > NEGLIGIBLE {
                still = false;
                r[D * c..D * c + D].copy_from_slice(&new);
                problem.moved(state, c, &dr);
            }
            contact.settled = if moved <= settled_below { contact.settled + 1 } else { 0 };
            moves += moved;
        }
        *mean_move = moves / contacts.len() as f64;
        if still && freeze_after == 0 && self.settings.ordering == Ordering::Given {
            // Every later sweep would repeat this one.
            return Step::Done;
        }
        let estimate = moves.sqrt();
        if relaxation.observe(estimate) {
            let [first, second] = &*marks;
            if alignment(contacts, first, second, r) < Relaxation::ALIGNED {
                relaxation.lower(omega_min);
            } else if let Some(ray) = runaway::<D>(problem.mu(), second, r)
                && problem.verify(&ray)
            {
                return Step::NoSolution(ray);
            }
        }
        Step::Continue { estimate }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.state, point);
    }

    fn check_every(&self) -> usize {
        self.settings.check_every
    }
}

impl<L, const D: usize> Sweeps<L, D> {
    fn fill<P>(&self, problem: &P, work: &mut SweepsWork<P, L, D>)
    where
        P: Blockwise<D>,
        L: LocalSolver<D>,
    {
        let scale = problem.velocity_scale(&work.state);
        work.order.restart(problem.mu().len(), self.settings.seed);
        for mark in &mut work.marks {
            mark.resize(D * problem.mu().len(), 0.0);
        }
        work.contacts.clear();
        for (c, &mu) in problem.mu().iter().enumerate() {
            let w = problem.diagonal_block(&work.state, c);
            let memo = self.local.prepare(&w, mu);
            let unit = small::mean_diagonal(&w).abs() / scale;
            work.contacts.push(Contact { w, mu, unit, settled: 0, memo });
        }
    }
}

/// The cosine of the angle between two successive sweeps' moves, in units of velocity; 0 where nothing moved.
fn alignment<Memo, const D: usize>(
    contacts: &[Contact<Memo, D>],
    first: &[f64],
    second: &[f64],
    r: &[f64],
) -> f64 {
    let (mut product, mut a, mut b) = (0.0, 0.0, 0.0);
    for (c, contact) in contacts.iter().enumerate() {
        for i in D * c..D * c + D {
            let x = contact.unit * (second[i] - first[i]);
            let y = contact.unit * (r[i] - second[i]);
            product += x * y;
            a += x * x;
            b += y * y;
        }
    }
    if a > 0.0 && b > 0.0 { product / (a * b).sqrt() } else { 0.0 }
}

/// The last move of the contacts without friction as a ray: where no motion is admissible, their impulses grow along one
/// for ever, while all others have settled. A candidate that the judge must verify.
fn runaway<const D: usize>(mu: &[f64], before: &[f64], r: &[f64]) -> Option<Certificate> {
    if !mu.contains(&0.0) {
        return None;
    }
    let largest = before.iter().zip(r).fold(0.0_f64, |m, (b, r)| m.max((r - b).abs()));
    let mut ray = vec![0.0; r.len()];
    for (c, &mu) in mu.iter().enumerate() {
        let i = D * c;
        if mu == 0.0 {
            ray[i] = ((r[i] - before[i]) / largest).max(0.0);
        } else if (i..i + D).any(|i| (r[i] - before[i]).abs() > 1e-12 * largest) {
            return None;
        }
    }
    Some(Certificate { r: ray, lambda: vec![] })
}
