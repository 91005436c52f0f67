//! One step of Moreau–Jean's θ-scheme for rigid bodies.
//!
//! With Ω in the body frame, `v_θ = θ v⁺ + (1 − θ) v_k`, impulses r over the whole step and d each of the three directions of a contact,
//!
//! ```text
//! m (v⁺ − v_k) = h (m g + F) + Σ ± d r,                                        x⁺ = x_k + h v_θ
//! J (Ω⁺ − Ω_k) + h Ω_θ × J Ω_θ = (I − ½ h Ω̂_θ) R_kᵀ (h τ + Σ ± (p − x) × d r),   R⁺ = R_k cay(h Ω_θ)
//! K* ∋ u⁺ + w + mu‖u_T⁺ + w_T‖ e_N  ⟂  r ∈ K,   w_N = e u_{N,k},   w_T = e_T u_{T,k}   for the contacts of the index set, r = 0 elsewhere.
//! ```
//!
//! `(I − ½ h Ω̂_θ) R_kᵀ` is the inverse of the mean of R_k and R⁺ at θ = ½: a torque that is fixed in space changes the momentum in space by just that, and
//! `Ω_θ · (…) = (R_k Ω_θ) · L`, so momentum and energy are exact at any h. Bodies whose inertia is isotropic have
//! no gyroscopic torque; their velocities are taken in the world frame, where nothing has to be solved.
//!
//! Method: bodies move freely, contacts of the index set (`g + γ h u_N ≤ 0`) get their directions at the extrapolated midpoint, islands are solved as
//! local problems in r by sessions of the project's solvers ([`crate::crew`]), judged by the problem's own judge. Gyroscopic torque and the frames of torques are those of the last
//! pass; with the impulses found each body's rotation is solved exactly, and where that moves no velocity by more than the tolerance, the step is done.
//! A large island that is slow and whose contacts are new is first asked whether it may stay at rest ([`crate::crew`]): a pile that can stand stands.
//! What rests or rolls has w_N = 0 while it opens, until an impact in its island gives it e ([`crate::restitution`]).
//! A persistent contact has the velocity in its law at the extrapolated end of the step. Frémond's law has `w_T = (1 − θ)/θ u_{T,k}`: u_θ in place of u⁺,
//! and so has rolling friction.
//!
//! References: Moreau1988 and Jean1999 for the scheme, Acary2016 for its energy, SimoWong1991 for the rotation, Acary2018 for the index set.
//!
//! Energy: `T⁺ − T_k = Σ u_θ · r − s_θ · r + h v_θ · (m g + F) + h ω_θ · τ − (θ − ½) ‖v⁺ − v_k‖²_M`, s the velocity of surfaces that are moved; what is left is rounding.
//! Cost: W has a block for each pair of contacts that share a body. Fails (a status, never silence) where a contact problem is not solved, or where h ‖Ω‖ is so
//! large that passes do not contract.

mod apart;
mod begin;
mod contact;
mod couple;
mod elastic;
mod energy;
mod frame;
mod global;
mod memory;
mod problem;
mod rigid;
mod solve;
mod take;
mod touching;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use nonsmooth_linalg::budget::{self, Budget};
use nonsmooth_problem::Friction;
use nonsmooth_scenes::vec3::norm;

use crate::crew::{Crew, Inner};
use crate::detect::{Detector, Key, Near};
use crate::drive::CANCELLED;
use crate::islands::Islands;
use crate::joints::Joints;
use crate::moving::Moving;
use crate::report::{ContactReport, EnergyBalance, StepReport, StepStatus, Timings};
use crate::state::State;
use crate::{Dimension, Force, Geometry, MoreauJean, SimulateError, World};

use begin::Start;
use contact::Row;
use elastic::Solids;
use memory::Met;
use problem::{Island, Stated};
use solve::Open;
use touching::Touching;

/// No body, no row.
const NONE: u32 = u32::MAX;

/// A step of a world by a scheme, of length h in s.
#[derive(Clone, Copy)]
pub(crate) struct Stride<'a> {
    pub world: &'a World,
    pub scheme: &'a MoreauJean,
    pub h: f64,
}

impl Stride<'_> {
    /// What is slower than this, m/s, is at rest but for the weight of a step or two.
    fn rest(&self) -> f64 {
        2.0 * self.h * norm(self.world.gravity)
    }
}

/// All memory of a simulation that is not its state.
pub(crate) struct Tools {
    detector: Detector,
    start: Start,
    /// The bodies of the world, after them the nodes of elastic solids that may touch them, and after these the feet of nodes on faces of other solids.
    bodies: Vec<Moving>,
    solids: Solids,
    /// How far from each body others are looked for, m.
    margins: Vec<f64>,
    /// The points where bodies are near each other; for each what is found of it first, and its row if it has one.
    near: Vec<Near>,
    met: Met,
    row_of: Vec<u32>,
    /// The index set, with the free bodies and elastic solids of each contact.
    rows: Vec<Row>,
    pairs: Vec<[u32; 2]>,
    /// Contacts that take part whatever the forecast says, sorted.
    pub insisted: Vec<Key>,
    pub joints: Joints,
    islands: Islands,
    touching: Touching,
    /// Of each island the largest restitution of an impact.
    impacts: Vec<f64>,
    island: Island,
    /// The problems of the islands, and which are not solved yet.
    stated: Stated,
    open: Open,
    crew: Crew,
    /// Sums of energies, and how far quaternions were from length one.
    sums: Vec<EnergyBalance>,
    off: Vec<f64>,
    pub contacts: Vec<ContactReport>,
}

impl Tools {
    pub fn new(world: &World, state: &State) -> Result<Self, SimulateError> {
        let detector = Detector::new(world)?;
        let mut joints = Joints::new(world);
        joints.redundant = joints.redundant(world, state);
        Ok(Self {
            start: Start::new(world, state, &detector),
            detector,
            bodies: vec![],
            solids: Solids::new(world)?,
            margins: vec![],
            near: vec![],
            met: Met::default(),
            row_of: vec![],
            rows: vec![],
            pairs: vec![],
            insisted: vec![],
            joints,
            islands: Islands::default(),
            touching: Touching::default(),
            impacts: vec![],
            island: Island::of(world.bodies.len(), world.elastic.len()),
            stated: Stated::new(world.dimension),
            open: Open::default(),
            crew: Crew::new(1),
            sums: vec![],
            off: vec![],
            contacts: vec![],
        })
    }

    /// Forgets the sessions of the solver.
    pub fn forget_solver(&mut self, dimension: Dimension) {
        self.stated = Stated::new(dimension);
    }

    /// Lets so many threads work, 0 for one a core.
    pub fn set_threads(&mut self, threads: usize) {
        self.crew = Crew::new(threads);
    }

    /// How many threads were asked for.
    pub fn threads(&self) -> usize {
        self.crew.threads
    }

    /// Everything up to the velocities after the step; the state is as before but for the axes of its memory.
    pub fn attempt(
        &mut self,
        stride: Stride,
        state: &mut State,
        forces: &mut [Box<dyn Force>],
        inner: &Inner,
    ) -> Result<StepReport, SimulateError> {
        stride.world.periods_hold(state.t + stride.h)?;
        let begun = Instant::now();
        // What ends the run also ends a step, between its parts.
        let flag = Budget { cancel: inner.limits.cancel.clone(), ..Budget::default() };
        let _scope = flag.enter();
        let mut timings = Timings::default();
        let mut report = StepReport::begun(state.t, stride.h);
        let ended = |mut report: StepReport, status| {
            report.status = status;
            report.timings.total = begun.elapsed().as_secs_f64();
            Ok(report)
        };
        let begins = self.begin(stride, state, forces);
        // A factorisation that was cut short has left nothing finite.
        if budget::over() {
            return ended(report, CANCELLED);
        }
        if !begins {
            return ended(report, StepStatus::NotFinite);
        }
        let detecting = Instant::now();
        self.detect(stride, state);
        timings.detection = detecting.elapsed().as_secs_f64();
        if budget::over() {
            return ended(report, CANCELLED);
        }
        self.meet(stride, state);
        let Some(mut solved) = self.solve(stride, inner)? else {
            return ended(report, CANCELLED);
        };
        if !self.moves_are_finite() || !self.solids.is_finite() {
            solved.status = StepStatus::NotFinite;
        }
        report.energy = self.energy(stride, state);
        if !report.energy.is_finite() {
            solved.status = StepStatus::NotFinite;
        }
        self.count(&mut report);
        timings.solve = solved.seconds;
        timings.total = begun.elapsed().as_secs_f64();
        timings.assembly = timings.total - timings.solve - timings.detection;
        report.timings = timings;
        solved.tell(&mut report);
        Ok(report)
    }

    /// The contact problem of a step in the first pass, all islands together; none without contacts and rows of joints.
    pub fn problem(
        &mut self,
        stride: Stride,
        state: &mut State,
        forces: &mut [Box<dyn Force>],
    ) -> Result<Option<Friction>, SimulateError> {
        stride.world.periods_hold(state.t + stride.h)?;
        if !self.begin(stride, state, forces) {
            return Ok(None);
        }
        self.detect(stride, state);
        self.meet(stride, state);
        if self.rows.is_empty() && self.joints.rows.is_empty() {
            return Ok(None);
        }
        self.stated.provide(1)?;
        self.islands.unite();
        self.touching.arrange(self.islands.of_body.len(), &self.pairs, &self.islands);
        self.open.begin(1);
        self.state(stride, None);
        Ok(Some(self.stated.problem(0)))
    }

    /// Whether all velocities after the step are finite.
    fn moves_are_finite(&self) -> bool {
        let finite = AtomicBool::new(true);
        self.crew.spread(&self.bodies[..], self.bodies.len(), |bodies| {
            if !are_finite(bodies.iter().flat_map(|b| [b.v_new, b.spin_new]).flatten()) {
                finite.store(false, Ordering::Relaxed);
            }
        });
        finite.into_inner()
    }

    /// The points where bodies are near each other, and the bodies that feet are.
    fn detect(&mut self, Stride { world, scheme, h }: Stride, state: &mut State) {
        let Self { detector, margins, crew, near, solids, bodies, .. } = self;
        detector.detect(world, state, margins, crew, (near, &mut solids.feet));
        let h = if scheme.geometry == Geometry::Frozen { 0.0 } else { h };
        for foot in &solids.feet {
            let owner = world.bodies.len() as u32 + foot.solid;
            let moves = solids.foot_velocities(foot, state);
            bodies.push(Start::node(foot.place, owner, moves, h));
        }
    }
}

/// Whether no number is infinite or none: of those 0 x is none.
fn are_finite(numbers: impl Iterator<Item = f64>) -> bool {
    numbers.map(|x| 0.0 * x).sum::<f64>() == 0.0
}
