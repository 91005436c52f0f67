//! What a step and a run come to.

use std::collections::BTreeMap;

use nonsmooth_problem::check::{Measure, Motion};
use nonsmooth_scenes::vec3::Vec3;
use nonsmooth_solve::Status;

use crate::BodyId;
use crate::detect::Key;

/// How a step ended; caller's mistakes are errors.
#[derive(Debug, Clone, PartialEq)]
pub enum StepStatus {
    /// The judge accepts the impulses of every island, and rotation and contact agree.
    Solved,
    /// The contact problem of an island is not solved; the best impulses found were taken.
    Solver(Status),
    /// Rotation and contact, or Newton's method, did not settle in the passes allowed; the last pass was taken.
    NewtonLimit,
    /// The projection onto relations and gaps did not reach its tolerance in the passes allowed; the last pass was taken.
    ProjectionLimit,
    /// Solved after it was cut into `2^n` parts.
    Halved(u8),
    /// A force or a velocity is no finite number; the state is that before the step.
    NotFinite,
}

impl StepStatus {
    /// Whether the law of contact holds at the tolerance asked for.
    pub fn is_solved(&self) -> bool {
        matches!(self, StepStatus::Solved | StepStatus::Halved(_))
    }

    /// A short name: `solved`, `solver: …`, `newton_limit`, `projection_limit`, `halved`, `not_finite`.
    pub fn name(&self) -> String {
        match self {
            StepStatus::Solved => "solved".into(),
            StepStatus::Solver(status) => format!("solver: {}", status.name()),
            StepStatus::NewtonLimit => "newton_limit".into(),
            StepStatus::ProjectionLimit => "projection_limit".into(),
            StepStatus::Halved(_) => "halved".into(),
            StepStatus::NotFinite => "not_finite".into(),
        }
    }
}

/// The energy of a step by terms, J. `T⁺ − T = gravity + forces + normal + tangential + drives + joints − numerical + imbalance`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyBalance {
    /// Kinetic energy before the step.
    pub kinetic_before: f64,
    /// Kinetic energy after it.
    pub kinetic: f64,
    /// Potential energy after it, of the weights alone, zero at the origin.
    pub potential: f64,
    /// Work of the weights.
    pub gravity: f64,
    /// Work of given forces and torques.
    pub forces: f64,
    /// `Σ u_{N,θ} r_N`: work of normal impulses on the bodies relative to each other.
    pub normal: f64,
    /// `Σ u_{T,θ} · r_T`: work of friction.
    pub tangential: f64,
    /// Work of surfaces and tables that move as they are told.
    pub drives: f64,
    /// Work of joints on the bodies: of springs, motors, friction and limits; equations between bodies do none. Of Lagrangian systems that of relations and rows.
    pub joints: f64,
    /// `(θ − ½) ‖v⁺ − v‖²_M`: what the scheme itself dissipates.
    pub numerical: f64,
    /// What is left: rounding, unless something is wrong.
    pub imbalance: f64,
    /// What the imbalance is to be compared with: the sizes of all terms, and the kinetic energy that gravity gives all bodies in a step.
    pub scale: f64,
}

impl EnergyBalance {
    /// `|imbalance| / scale`, zero where nothing moves.
    pub fn relative_imbalance(&self) -> f64 {
        if self.scale > 0.0 { self.imbalance.abs() / self.scale } else { 0.0 }
    }

    /// Whether the energies of motion and weight, and the works, are numbers: squares leave the range of double precision before velocities do.
    pub(crate) fn is_finite(&self) -> bool {
        let Self { kinetic, potential, imbalance, scale, .. } = *self;
        [kinetic, potential, imbalance, scale].iter().all(|x| x.is_finite())
    }

    /// The sum of two steps, the second of which follows the first.
    pub(crate) fn then(self, next: Self) -> Self {
        Self {
            kinetic_before: self.kinetic_before,
            kinetic: next.kinetic,
            potential: next.potential,
            gravity: self.gravity + next.gravity,
            forces: self.forces + next.forces,
            normal: self.normal + next.normal,
            tangential: self.tangential + next.tangential,
            drives: self.drives + next.drives,
            joints: self.joints + next.joints,
            numerical: self.numerical + next.numerical,
            imbalance: self.imbalance + next.imbalance,
            scale: self.scale.max(next.scale),
        }
    }
}

/// How many of what a step had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Points where bodies are near each other.
    pub near: usize,
    /// Contacts that took part.
    pub active: usize,
    /// Of these, those without impulse.
    pub open: usize,
    /// Of these, those that stick.
    pub stick: usize,
    /// Of these, those that slide.
    pub slip: usize,
    /// Of those that are not open, those that roll against rolling friction.
    pub roll: usize,
    /// Contacts that began with the impulse of the last step.
    pub warm: usize,
    /// Points where bodies overlap by more than a tenth of the smaller one. No normal is right there: that of the step before is kept while the features are the same.
    pub deep: usize,
    /// Scalar rows: equations, limits, motors, friction and springs of joints; relations and rows of Lagrangian systems.
    pub rows: usize,
    /// Islands that were solved apart.
    pub islands: usize,
    /// The most contacts in an island.
    pub largest: usize,
    /// Iterations of the solver, all islands together.
    pub iterations: usize,
}

impl Counts {
    /// What the contacts of a step do.
    pub(crate) fn tell(&mut self, contacts: &[ContactReport]) {
        (self.open, self.stick, self.slip, self.roll) = (0, 0, 0, 0);
        for contact in contacts {
            match contact.motion() {
                Some(Motion::Open) => self.open += 1,
                Some(Motion::Stick) => self.stick += 1,
                Some(Motion::Slip) => self.slip += 1,
                _ => {}
            }
            self.roll += usize::from(contact.rolls());
        }
    }
}

/// How far the configuration is from what it should be, at the beginning of the step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drift {
    /// The deepest penetration, m.
    pub penetration: f64,
    /// The largest `|‖q‖ − 1|` of a quaternion, before it was made one.
    pub quaternion: f64,
    /// The most by which an equation of a joint, or a relation of a Lagrangian system, is violated after the step, in its unit.
    pub joints: f64,
}

/// Where the time of a step went, s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Timings {
    /// Broad and narrow phase.
    pub detection: f64,
    /// Index set, frames, W, q.
    pub assembly: f64,
    /// Solvers and judge.
    pub solve: f64,
    /// All of the step.
    pub total: f64,
}

/// What a step came to.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// How it ended.
    pub status: StepStatus,
    /// The time after it, s.
    pub t: f64,
    /// Its length, s.
    pub h: f64,
    /// The judge's relative residual of contacts and scalar rows, the worst of all islands.
    pub residual: f64,
    /// The energy by terms.
    pub energy: EnergyBalance,
    /// How many of what.
    pub counts: Counts,
    /// Passes over rotation and contact, or iterations of Newton's method.
    pub newton: u32,
    /// How far off the configuration is.
    pub drift: Drift,
    /// Where the time went.
    pub timings: Timings,
}

impl StepReport {
    /// That of a step of which nothing is known yet.
    pub(crate) fn begun(t: f64, h: f64) -> Self {
        Self {
            status: StepStatus::Solved,
            t,
            h,
            residual: 0.0,
            energy: EnergyBalance::default(),
            counts: Counts::default(),
            newton: 1,
            drift: Drift::default(),
            timings: Timings::default(),
        }
    }
}

/// What the judge compares with the tolerance: of the contacts, and of the scalar rows, which may be alone.
pub(crate) fn worst_share(measure: &Measure) -> f64 {
    match measure.bilateral {
        // A maximum that a NaN is not lost in.
        Some(rows) if rows > measure.relative || rows.is_nan() => rows,
        _ => measure.relative,
    }
}

/// A contact that moves along by less than this, m/s, and by less than this share of what it did before, sticks.
const SLIP: f64 = 1e-8;

/// What a contact of the last step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactReport {
    /// Which features touch.
    pub key: Key,
    /// The first body.
    pub a: BodyId,
    /// The second body, which the impulse acts on.
    pub b: BodyId,
    /// Where, m.
    pub point: Vec3,
    /// From the first body to the image of it that touches, m: it is itself touched at `point − offset`. Zero unless the world is [periodic](crate::Periodic).
    pub offset: Vec3,
    /// `[N, T1, T2]`, N from a to b.
    pub frame: [Vec3; 3],
    /// The gap at the beginning of the step, m; negative where they penetrate.
    pub gap: f64,
    /// Coefficient of friction.
    pub mu: f64,
    /// Whether the contact took part in the step; else its impulse is zero.
    pub active: bool,
    /// `[r_N, r_T1, r_T2]`, N·s; the force is r/h unless there was an impact.
    pub impulse: [f64; 3],
    /// `[u_N, u_T1, u_T2]` before the step, m/s; zero if the contact took no part.
    pub before: [f64; 3],
    /// The same after it.
    pub after: [f64; 3],
    /// Coefficient of rolling friction, m.
    pub mu_r: f64,
    /// Moments about the tangents, `[r_R1, r_R2]`, N·m·s, of rolling friction.
    pub moment: [f64; 2],
    /// The angular velocity of b seen from a about the tangents after the step, `[u_R1, u_R2]`, rad/s.
    pub rolling: [f64; 2],
}

impl ContactReport {
    /// What the contact does, if it takes part: without an impulse it is open, with one it slips where it moves along.
    pub fn motion(&self) -> Option<Motion> {
        let tangential = |x: &[f64; 3]| x[1].hypot(x[2]);
        self.active.then(|| match self.impulse {
            [n, ..] if n <= 0.0 => Motion::Open,
            _ if tangential(&self.after) > SLIP * (1.0 + tangential(&self.before)) => Motion::Slip,
            _ => Motion::Stick,
        })
    }

    /// The moment on b in the world frame, N·m·s.
    pub fn world_moment(&self) -> Vec3 {
        let [_, s, t] = self.frame;
        std::array::from_fn(|k| s[k] * self.moment[0] + t[k] * self.moment[1])
    }

    /// Whether it rolls against rolling friction.
    pub fn rolls(&self) -> bool {
        let [s, t] = self.rolling;
        self.active && self.mu_r > 0.0 && self.impulse[0] > 0.0 && s.hypot(t) > SLIP
    }

    /// The impulse on b in the world frame, N·s.
    pub fn world_impulse(&self) -> Vec3 {
        let [n, s, t] = self.frame;
        std::array::from_fn(|k| {
            n[k] * self.impulse[0] + s[k] * self.impulse[1] + t[k] * self.impulse[2]
        })
    }
}

/// How bodies that overlapped at the start were moved apart.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settled {
    /// Pairs of bodies that overlapped.
    pub pairs: usize,
    /// How deep at most, m.
    pub depth: f64,
    /// How often bodies were moved; 0 where none overlapped.
    pub rounds: u32,
    /// The farthest that a mass centre was moved, m.
    pub moved: f64,
}

/// What a run came to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunReport {
    /// Steps done.
    pub steps: u64,
    /// The number of steps by how they ended.
    pub statuses: BTreeMap<String, u64>,
    /// Steps that were not solved.
    pub unsolved: u64,
    /// The time after the first of them, s.
    pub first_unsolved: Option<f64>,
    /// The largest residual of a step.
    pub residual: f64,
    /// The largest relative imbalance of energy of a step.
    pub imbalance: f64,
    /// The deepest penetration, m.
    pub penetration: f64,
    /// The most by which an equation of a joint, or a relation of a Lagrangian system, is violated after a step, in its unit.
    pub joints: f64,
    /// Steps with [deep](Counts::deep) contacts.
    pub deep: u64,
    /// The time after the first of them, s.
    pub first_deep: Option<f64>,
    /// The time at the end, s.
    pub t: f64,
    /// Whether the observer stopped it before the end.
    pub stopped: bool,
}

impl RunReport {
    /// Whether every step was solved.
    pub fn is_solved(&self) -> bool {
        self.unsolved == 0
    }

    pub(crate) fn note(&mut self, step: &StepReport) {
        self.steps += 1;
        *self.statuses.entry(step.status.name()).or_default() += 1;
        if !step.status.is_solved() {
            self.unsolved += 1;
            self.first_unsolved.get_or_insert(step.t);
        }
        if step.counts.deep > 0 {
            self.deep += 1;
            self.first_deep.get_or_insert(step.t);
        }
        // A maximum that a NaN is not lost in.
        let worse = |old: f64, new: f64| if new > old || new.is_nan() { new } else { old };
        self.residual = worse(self.residual, step.residual);
        self.imbalance = worse(self.imbalance, step.energy.relative_imbalance());
        self.penetration = worse(self.penetration, step.drift.penetration);
        self.joints = worse(self.joints, step.drift.joints);
        self.t = step.t;
    }
}

impl std::fmt::Display for RunReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let statuses: Vec<_> = self.statuses.iter().map(|(n, k)| format!("{k} {n}")).collect();
        let ended = if self.stopped { ", stopped" } else { "" };
        write!(f, "{} steps to t = {:.6} s{ended}", self.steps, self.t)?;
        if self.steps == 0 {
            return Ok(());
        }
        write!(
            f,
            ": {}; residual at most {:.1e}, energy imbalance at most {:.1e}, penetration at most {:.1e}, relations violated by at most {:.1e}",
            statuses.join(", "),
            self.residual,
            self.imbalance,
            self.penetration,
            self.joints
        )
    }
}
