//! What a simulation leaves behind: motion, contacts, energy and the fate of every step in one HDF5 file.
//!
//! ```text
//! /trajectory_version          2
//! /scene/                      text, sha256, program
//! /bodies/                     name (b), fixed (b), elastic (b) where one is; position, velocity, angular_velocity (n, b, 3), rotation (n, b, 4)
//! /elastic/NAME/               position (n, nodes, 3): of each elastic solid, which is also one of the last bodies, with its mean motion
//! /frames/                     step (n), time (n)
//! /contacts/                   offset (n + 1): those of frame k are offset[k] .. offset[k + 1]
//!                              key (c, 4), a, b (c), point (c, 3), frame (c, 3, 3), gap, mu (c)
//!                              offset_a (c, 3), from a to the image of it that touches, where one does;
//!                              mu_r (c), moment (c, 3), moment_local, rolling (c, 2), where there is rolling friction;
//!                              r, r_local, u (c, 3), status (c): 0 took no part, 1 open, 2 stick, 3 slip
//! /joints/                     name (j); angle, slide, violation (n, j), impulse, moment (n, j, 3)
//! /steps/                      number, time, h, status, residual, iterations, newton, near, active, open, stick, slip,
//!                              penetration, wall (s); status_name: what the numbers of status mean
//! /energy/                     kinetic, potential, gravity, forces, normal, tangential, drives, joints, numerical, imbalance (s)
//! /checkpoint/                 step, time, state (bytes); absent where a run cannot be resumed
//! ```
//!
//! with n frames of b bodies and j joints, c contacts in all frames together and s steps, of which frames are a part. Reals have 64 bits and pass bit for bit, infinities
//! and NaN too: the last step of a run that failed is what one wants to see. Tables are in chunks with shuffle, deflate and Fletcher's checksum, in the
//! format of HDF5 1.10, which h5py and h5dump read. A file is made whole beside the old one and renamed, so it opens whatever happens to
//! the program. While a run goes on, what is new is put into parts beside the file ([`Writer`]), which [`Trajectory::read`] joins to it; what is lost is what came after the
//! last [`Writer::flush`].

mod parts;
mod read;
mod write;

pub use parts::Writer;

use std::path::Path;

use nonsmooth_problem::check::Motion;
use sha2::{Digest, Sha256};

use crate::IoError;
use crate::hdf5::File;

/// What tells a trajectory from other files of HDF5, and the version of its layout.
const VERSION: (&str, i64) = ("trajectory_version", 2);

/// What statuses of contacts are as numbers; 0 stands for those that took no part.
pub(crate) const STATUSES: [Option<Motion>; 4] =
    [None, Some(Motion::Open), Some(Motion::Stick), Some(Motion::Slip)];

/// A run of a simulation. SI units; the world frame unless it is said otherwise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// The scene as text, completed by what it did not say, so that the run can be repeated from the file alone.
    pub scene: String,
    /// The program that ran it, with its version.
    pub program: String,
    /// The bodies, in the order of their numbers.
    pub bodies: Vec<Named>,
    /// The names of the elastic solids, none empty or twice there; the last of the bodies are these.
    pub elastic: Vec<String>,
    /// The names of the joints, in the order of their numbers; they may be empty.
    pub joints: Vec<String>,
    /// What was recorded of the motion, in the order of time.
    pub frames: Vec<Frame>,
    /// All steps, also those without a frame.
    pub steps: Vec<Step>,
    /// What the run can be resumed from.
    pub checkpoint: Option<Checkpoint>,
}

/// A body of a trajectory.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Named {
    /// What the scene calls it; may be empty.
    pub name: String,
    /// Whether impulses do not move it.
    pub fixed: bool,
}

/// The motion at a time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// The number of the step that it follows; 0 for the start.
    pub step: u64,
    /// s.
    pub time: f64,
    /// The state of each body.
    pub bodies: Vec<State>,
    /// The contacts of the step.
    pub contacts: Vec<Contact>,
    /// What each joint did.
    pub joints: Vec<Joint>,
    /// Where the nodes of each elastic solid are, m.
    pub elastic: Vec<Vec<[f64; 3]>>,
}

/// What a joint did in a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Joint {
    /// By which its second body has turned about the axis, rad.
    pub angle: f64,
    /// By which it has moved along the axis, m.
    pub slide: f64,
    /// The impulse on the second body in the world frame, N·s.
    pub impulse: [f64; 3],
    /// Its moment about the anchor, N·m·s.
    pub moment: [f64; 3],
    /// The most by which an equation is violated, m or rad.
    pub violation: f64,
}

/// Where a body is and how it moves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Mass centre, m.
    pub position: [f64; 3],
    /// The unit quaternion `[w, x, y, z]` that turns its frame into that of the world.
    pub rotation: [f64; 4],
    /// Velocity of the mass centre, m/s.
    pub velocity: [f64; 3],
    /// rad/s.
    pub angular_velocity: [f64; 3],
}

/// A contact of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Which features of which shapes touch: the same in the next frame for the same contact.
    pub key: [u32; 4],
    /// The first body.
    pub a: u32,
    /// The second body, on which the impulse acts.
    pub b: u32,
    /// m.
    pub point: [f64; 3],
    /// From a to the image of it that touches, m: zero unless the world repeats itself.
    pub offset: [f64; 3],
    /// The local frame `[N, T1, T2]`, N from a to b.
    pub frame: [[f64; 3]; 3],
    /// The gap at the beginning of the step, m; negative where they penetrate.
    pub gap: f64,
    /// The coefficient of friction.
    pub mu: f64,
    /// The impulse on b as `[N, T1, T2]`, N·s.
    pub r: [f64; 3],
    /// The relative velocity after the step as `[N, T1, T2]`, m/s.
    pub u: [f64; 3],
    /// The coefficient of rolling friction, m; zero without it, and then what follows is too.
    pub mu_r: f64,
    /// The moment on b about `[T1, T2]`, N·m·s.
    pub moment: [f64; 2],
    /// The angular velocity of b seen from a after the step about `[T1, T2]`, rad/s.
    pub rolling: [f64; 2],
    /// What it does; `None`: it took no part in the step.
    pub status: Option<Motion>,
}

impl Contact {
    /// The impulse on b in the frame of the world, N·s.
    pub fn world_impulse(&self) -> [f64; 3] {
        self.in_world(self.r)
    }

    /// The moment of rolling friction on b in the frame of the world, N·m·s.
    pub fn world_moment(&self) -> [f64; 3] {
        self.in_world([0.0, self.moment[0], self.moment[1]])
    }

    /// The relative velocity after the step in the frame of the world, m/s.
    pub fn world_velocity(&self) -> [f64; 3] {
        self.in_world(self.u)
    }

    fn in_world(&self, x: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| (0..3).map(|d| self.frame[d][k] * x[d]).sum())
    }
}

/// What a step came to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Step {
    /// Its number, from 1.
    pub number: u64,
    /// The time after it, s.
    pub time: f64,
    /// Its length, s.
    pub h: f64,
    /// How it ended, in a word.
    pub status: String,
    /// The judge's relative residual, the worst of all islands.
    pub residual: f64,
    /// Iterations of the solver, all islands together.
    pub iterations: u64,
    /// Passes of rotation and contact.
    pub newton: u32,
    /// Points where bodies are near each other.
    pub near: u32,
    /// Contacts that took part.
    pub active: u32,
    /// Of these, those without impulse.
    pub open: u32,
    /// Of these, those that stick.
    pub stick: u32,
    /// Of these, those that slide.
    pub slip: u32,
    /// The deepest penetration, m.
    pub penetration: f64,
    /// The time that it took, s.
    pub wall: f64,
    /// Where the energy went.
    pub energy: Energy,
}

/// A part of a step, to be read or set.
type Of<T> = fn(&mut Step) -> &mut T;

/// The reals of a step by their names in a file.
const STEP_REALS: [(&str, Of<f64>); 5] = [
    ("time", |s| &mut s.time),
    ("h", |s| &mut s.h),
    ("residual", |s| &mut s.residual),
    ("penetration", |s| &mut s.penetration),
    ("wall", |s| &mut s.wall),
];

/// What a step counts, by its names in a file.
const STEP_COUNTS: [(&str, Of<u32>); 6] = [
    ("newton", |s| &mut s.newton),
    ("near", |s| &mut s.near),
    ("active", |s| &mut s.active),
    ("open", |s| &mut s.open),
    ("stick", |s| &mut s.stick),
    ("slip", |s| &mut s.slip),
];

/// The energy of a step by terms, J: `T⁺ − T = gravity + forces + normal + tangential + drives + joints − numerical + imbalance`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Kinetic energy after the step.
    pub kinetic: f64,
    /// Potential energy after it.
    pub potential: f64,
    /// Work of the weights.
    pub gravity: f64,
    /// Work of given forces and torques.
    pub forces: f64,
    /// Work of normal impulses.
    pub normal: f64,
    /// Work of friction.
    pub tangential: f64,
    /// Work of what moves as it is told.
    pub drives: f64,
    /// Work of joints: of springs, motors, friction and limits.
    pub joints: f64,
    /// What the scheme itself dissipates.
    pub numerical: f64,
    /// What is left.
    pub imbalance: f64,
}

impl Energy {
    /// The terms by their names in a file.
    fn terms(&mut self) -> [(&'static str, &mut f64); 10] {
        [
            ("kinetic", &mut self.kinetic),
            ("potential", &mut self.potential),
            ("gravity", &mut self.gravity),
            ("forces", &mut self.forces),
            ("normal", &mut self.normal),
            ("tangential", &mut self.tangential),
            ("drives", &mut self.drives),
            ("joints", &mut self.joints),
            ("numerical", &mut self.numerical),
            ("imbalance", &mut self.imbalance),
        ]
    }
}

/// The state of a simulation, for who made it to go on from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Checkpoint {
    /// Steps done.
    pub step: u64,
    /// s.
    pub time: f64,
    /// The state; this crate does not look into it.
    pub state: Vec<u8>,
}

impl Trajectory {
    /// Reads a file, and the parts of it that a [`Writer`] which was killed left beside it. Time and memory in proportion to their size.
    ///
    /// Errors: a file that is none, or damaged, or whose parts do not fit each other, by the part; a scene that its SHA-256 does not belong to.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, IoError> {
        let path = path.as_ref();
        if path.is_dir() {
            let (expected, found) =
                ("a trajectory, which is one file".into(), "a directory".into());
            return Err(IoError::Data { file: path.into(), place: "/".into(), expected, found });
        }
        let mut gap = None;
        loop {
            let mut run = Self::parse(path, &crate::format::bytes(path)?)?;
            gap = parts::join(path, &mut run, gap)?;
            if gap.is_none() {
                return Ok(run);
            }
        }
    }

    /// Reads the bytes of a file; `name` is for messages. Errors: as of [`read`](Self::read).
    pub fn parse(name: &Path, bytes: &[u8]) -> Result<Self, IoError> {
        read::parse(name, bytes)
    }

    /// Writes the whole file beside the old one and gives it its name, when it is on the disk: at each moment there is one that opens. Costs time in proportion
    /// to the run so far; a run that is written as it grows has a [`Writer`]. Parts that one left beside the file are removed.
    ///
    /// Errors: what the system refuses; frames that do not have all bodies; contacts of bodies that are not there; NUL characters in texts.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), IoError> {
        let path = path.as_ref();
        crate::format::put(path, &self.to_bytes(path)?)?;
        parts::remove(path);
        Ok(())
    }

    /// The file in memory; `name` is for messages. Errors: as of [`write`](Self::write).
    pub fn to_bytes(&self, name: &Path) -> Result<Vec<u8>, IoError> {
        write::to_bytes(name, &self.into())
    }

    /// SHA-256 of the scene in hexadecimal digits.
    pub fn digest(&self) -> String {
        digest(&self.scene)
    }
}

/// SHA-256 in hexadecimal digits.
fn digest(text: &str) -> String {
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Whether these are the bytes of a trajectory, intact or not.
pub fn holds(bytes: &[u8]) -> bool {
    crate::hdf5::is_hdf5(bytes)
        && File::new(bytes).is_ok_and(|file| {
            file.root().is_ok_and(|root| matches!(file.find(&root, VERSION.0), Ok(Some(_))))
        })
}
