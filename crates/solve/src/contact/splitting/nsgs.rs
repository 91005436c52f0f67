//! **NSGS**, nonsmooth block Gauss–Seidel over contacts.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact, W given by its rows or, in velocity
//! space, by `u_c = H_cᵀ v + w_c` and `v += M⁻¹ H_c Δr_c`.
//!
//! Scalar rows with bounds (limits, motors) are visited after the contacts, by projected SOR with the same ω; rows without are eliminated.
//!
//! Method: visit the contacts in turn; freeze all impulses but the visited contact's; solve that contact's own
//! problem `u_c = W_cc r_c + (q_c + Σ_{j≠c} W_cj r_j)` with a local solver; go on with the new impulse. With relaxation
//! `r_c ← (1 − ω) r_c + ω r_c^new`, projected back on K where ω > 1. Optionally every few sweeps are taken as one step of a fixed point
//! iteration and extrapolated by Anderson's method, projected on K, and taken back where the next sweeps move more than before.
//!
//! References: JourdanAlartJean1998; Jean1999; Acary, lecture (107); AcaryBremondHuber2018 for orderings, relaxation and
//! freezing; WalkerNi2011 for the acceleration.
//!
//! Cost of a sweep: one pass over the blocks of W (or over the rows of H and M⁻¹H) plus nc local solves; nothing is
//! allocated. Storage: the diagonal blocks and the local solver's memo, 100 to 250 bytes a contact.
//!
//! Fails: no convergence proof for friction; on hyperstatic problems (3nc > n) it slows down to thousands of sweeps below 1e-4,
//! and it may circle for large mu with strongly coupled normal and tangential directions.

use nonsmooth_linalg::small;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::form::{AHEAD, Access, Blockwise, Disked, Frictional, put_within_cones};
use crate::contact::law::Rolling;
use crate::contact::law::local::{Exact, LocalSolver, Quartic, RollingExact};
use crate::contact::parts::{Accelerator, put_within_bounds, sweep_rows};
use crate::contact::splitting::ordering::{Order, Ordering};
use crate::core::ranges::{at_least, at_most, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{Boxed, SolveError, Solver, Step};

use super::circles::Circles;
use super::contact::{Answer, Contact, ContactOf};

/// The local solver, the order of the visits, relaxation, and what saves visits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Nsgs {
    /// The one-contact solver. Contacts without friction and contacts in the plane have a closed form.
    pub local: LocalChoice,
    /// How exactly the iterative local solvers (newton_*, projection_iterated) solve.
    pub local_tolerance: LocalTolerance,
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
    /// Anderson acceleration with at most this many differences; 0 for none. Helps on some slow problems and hurts on others.
    pub anderson: usize,
    /// Sweeps between two extrapolations of the Anderson acceleration.
    pub anderson_every: usize,
    /// Sweeps between two evaluations of the true residual, unless the cheap estimate asks for one earlier.
    pub check_every: usize,
}

/// How exactly a contact is solved at a visit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LocalTolerance {
    /// To rounding.
    #[default]
    Fixed,
    /// To a tenth of the mean move of a contact in the last sweep.
    Adaptive,
}

/// The local residual that is allowed, as a part of the last sweep's mean move.
const LOCAL_SHARE: f64 = 0.1;

/// The most differences that the Anderson acceleration keeps.
const ANDERSON_MOST: usize = 50;

/// The one-contact solvers by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LocalChoice {
    /// Cases, and a bracketed one-parameter root for sliding; with rolling friction Newton with safeguards.
    #[default]
    Exact,
    /// Cases, and all roots of the quartic for sliding; with rolling friction there is no quartic, and this is `exact`.
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
            local_tolerance: LocalTolerance::default(),
            omega: 1.0,
            omega_min: 0.4,
            ordering: Ordering::default(),
            seed: 0,
            freeze_after: 0,
            freeze_for: 10,
            anderson: 0,
            anderson_every: 5,
            check_every: 50,
        }
    }
}

impl Settings for Nsgs {
    fn validate(&self) -> Result<(), String> {
        below("omega", self.omega, 2.0)?;
        below("omega_min", self.omega_min, 2.0)?;
        at_least("check_every", self.check_every, 1)?;
        if self.freeze_after > 0 && self.freeze_for == 0 {
            return Err("freeze_for: expected at least 1 while freeze_after is set, found 0".into());
        }
        at_most("anderson", self.anderson, ANDERSON_MOST)?;
        at_least("anderson_every", self.anderson_every, 1)
    }
}

impl Described for Nsgs {
    const ABOUT: &'static About = &About {
        name: "nsgs",
        family: "splitting",
        solves: Solves::Law,
        summary: "nonsmooth block Gauss-Seidel over contacts and scalar rows with bounds, with a choice of local solvers",
        needs: &[],
        cites: &[
            "JourdanAlartJean1998",
            "Jean1999",
            "Acary2018",
            "AcaryBremondHuber2018",
            "DBB11",
            "WalkerNi2011",
        ],
        variants: &[
            "local=quartic",
            "local=newton_ac",
            "local=newton_jm",
            "local=projection",
            "local=projection_iterated",
            "ordering=shuffled",
            "ordering=fully_shuffled",
            "omega=0.9",
            "freeze_after=5",
            "local_tolerance=adaptive",
            "anderson=5",
        ],
        settings: described::<Self>,
    };
}

/// NSGS with its local solver known by type, so that the kernel inlines.
#[derive(Debug, Clone)]
pub struct Sweeps<L, const D: usize> {
    /// As the user gave them; the local solver is already chosen by them.
    pub settings: Nsgs,
    /// The local solver (`settings.local` by type).
    pub local: L,
}

/// Evaluates an expression with the local solver of a [`LocalChoice`], known by type: the one list of them. What is exact, and what the quartic is, goes by the law.
macro_rules! with_local {
    ($choice:expr, [$exact:expr, $quartic:expr], $local:ident => $body:expr) => {{
        use $crate::contact::law::cfun::Disk;
        use $crate::contact::law::local::{Newton, Projection, ProjectionIterated};
        match $choice {
            LocalChoice::Exact => {
                let $local = $exact;
                $body
            }
            LocalChoice::Quartic => {
                let $local = $quartic;
                $body
            }
            LocalChoice::NewtonAc => {
                let $local = Newton::new(Disk::AlartCurnier);
                $body
            }
            LocalChoice::NewtonJm => {
                let $local = Newton::new(Disk::JeanMoreau);
                $body
            }
            LocalChoice::Projection => {
                let $local = Projection::default();
                $body
            }
            LocalChoice::ProjectionIterated => {
                let $local = ProjectionIterated::default();
                $body
            }
        }
    }};
}
pub(super) use with_local;

impl Nsgs {
    /// The method with its local solver known by type.
    pub(crate) fn boxed<P: Blockwise<D> + Frictional<D> + 'static, const D: usize>(
        self,
    ) -> Boxed<P> {
        with_local!(self.local, [Exact, Quartic], local => Boxed::new(Sweeps { settings: self, local }))
    }

    /// The same with rolling friction.
    pub(crate) fn rolling<P: Blockwise<D> + Disked<D, Law = Rolling> + 'static, const D: usize>(
        self,
    ) -> Boxed<P> {
        with_local!(self.local, [RollingExact, RollingExact], local => {
            Boxed::new(Sweeps { settings: self, local })
        })
    }
}

/// The workspace: the problem's view, and what each contact keeps.
pub struct SweepsWork<P: Blockwise<D>, L: LocalSolver<D, P::Law>, const D: usize> {
    state: P::State,
    /// The local solver with the tolerance of the present sweep.
    local: L,
    contacts: Vec<ContactOf<P, L, D>>,
    order: Order,
    /// The mean of `w_c²‖Δr_c‖²/‖q‖²` in the last sweep, the yardstick of freezing and of the local tolerance.
    mean_move: f64,
    circles: Circles,
    accelerator: Accelerator,
    /// Sweeps since the last extrapolation.
    since: usize,
    /// The last sweep moved nothing.
    still: bool,
}

impl<const D: usize, P, L> Solver<P> for Sweeps<L, D>
where
    P: Blockwise<D>,
    L: LocalSolver<D, P::Law> + Clone,
{
    type Work = SweepsWork<P, L, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let n = problem.contacts();
        let mut work = SweepsWork {
            state: problem.state(Access::Rows)?,
            local: self.local.clone(),
            contacts: Vec::with_capacity(n),
            order: Order::new(self.settings.ordering, n, self.settings.seed),
            mean_move: 0.0,
            circles: Circles::default(),
            accelerator: Accelerator::new(self.settings.anderson, D * n),
            since: 0,
            still: false,
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
        put_within_bounds(problem, point);
        problem.enter(&mut work.state, point);
        work.mean_move = 0.0;
        work.circles.restart(self.settings.omega, self.settings.omega_min);
        work.accelerator.forget();
        (work.since, work.still) = (0, false);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone().into());
        }
        let (r, lambda) = P::all_impulses(point);
        let SweepsWork { state, local, contacts, order, mean_move, circles, .. } = work;
        let accelerated = work.accelerator.is_on();
        if accelerated && work.since == 0 {
            work.accelerator.begin(r);
        }
        let Nsgs { freeze_after, freeze_for, .. } = self.settings;
        let tolerance = match self.settings.local_tolerance {
            LocalTolerance::Fixed => 0.0,
            LocalTolerance::Adaptive => {
                LOCAL_SHARE * mean_move.sqrt() * problem.velocity_scale(state)
            }
        };
        local.tolerate(tolerance);
        let omega = circles.omega(r);
        let mut moves = 0.0;
        let mut still = true;
        let settled_below = 1e-6 * *mean_move;
        let visits = order.next_sweep();
        for (i, &c) in visits.iter().enumerate() {
            let c = c as usize;
            if let Some(&later) = visits.get(i + AHEAD) {
                problem.foresee(state, later as usize);
            }
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
            let Answer { new, dr, moved, made } = contact.answer(&*local, &u, &old, omega);
            if made {
                still = false;
                r[D * c..D * c + D].copy_from_slice(&new);
                problem.moved(state, c, &dr);
            }
            contact.settled = if moved <= settled_below { contact.settled + 1 } else { 0 };
            moves += moved;
        }
        let of_rows = sweep_rows(problem, state, (r, lambda), omega);
        still &= of_rows == 0.0;
        moves += of_rows / problem.velocity_scale(state).powi(2);
        *mean_move = moves / contacts.len() as f64;
        let repeats = freeze_after == 0 && self.settings.ordering == Ordering::Given;
        let still = still && repeats && tolerance == 0.0;
        if std::mem::replace(&mut work.still, still) && still {
            // Every later sweep would repeat this one. A single one that moves nothing may have seen velocities with the rounding of a start that was far larger; the judge's look renews them.
            return Step::Done;
        }
        let estimate = moves.sqrt();
        let unit = |c: usize| contacts[c].unit;
        if let Some(ray) = circles.observe(problem, &unit, r, estimate) {
            return Step::NoSolution(ray);
        }
        work.since += 1;
        if accelerated && work.since >= self.settings.anderson_every {
            work.since = 0;
            work.accelerator.advance(r, |i| unit(i / D));
            put_within_cones(problem, r);
            problem.enter(state, point);
        }
        Step::Continue { estimate }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.state, point);
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.settings.check_every
    }
}

impl<L, const D: usize> Sweeps<L, D> {
    fn fill<P>(&self, problem: &P, work: &mut SweepsWork<P, L, D>)
    where
        P: Blockwise<D>,
        L: LocalSolver<D, P::Law>,
    {
        let n = problem.contacts();
        let scale = problem.velocity_scale(&work.state);
        work.order.restart(n, self.settings.seed);
        work.circles.resize(D * n);
        work.accelerator.resize(D * n);
        work.contacts.clear();
        for c in 0..n {
            let w = problem.diagonal_block(&work.state, c);
            work.contacts.push(Contact::new(&self.local, w, problem.law(c), scale));
        }
    }
}
