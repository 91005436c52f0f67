//! Rigid bodies in motion through impacts, sticking and sliding: contact detection, Moreau–Jean time stepping, every step judged.
//!
//! A [`World`] is plain data: [`Body`]s of [`Part`]s, laws of contact by pairs of materials, gravity. A [`Simulation`] moves it: each [`step`](Simulation::step) states
//! the frictional contact problem of its islands, has them solved by the solvers of `nonsmooth-solve`, and says in a [`StepReport`] whether the judge accepts
//! what came out, and where every joule went. Nothing is frozen that turns: rotations are implicit midpoint steps with the Cayley map, exact in energy and
//! momentum; directions of contacts are taken at the extrapolated midpoint. SI units; velocities given and reported in the world frame.
//!
//! ```
//! use nonsmooth_simulate::{Body, Law, MoreauJean, Shape, Simulation, World};
//!
//! let mut world = World::new([0.0, 0.0, -9.81]).with_law(Law { mu: 0.3, e: 0.8, ..Law::default() });
//! world.add(Body::floor());
//! let ball = Body::solid(Shape::Sphere { radius: 0.1 }, 1000.0)?;
//! let ball = world.add(ball.at([0.0, 0.0, 1.1]).moving([1.0, 0.0, 0.0], [0.0; 3]));
//!
//! let mut simulation = Simulation::new(world, MoreauJean::default())?;
//! let run = simulation.run(2.0, 1e-3, &mut ())?;
//! assert!(run.is_solved() && run.residual <= 1e-10 && run.imbalance <= 1e-12);
//! assert!(simulation.state().position[ball.index()][0] > 1.0);
//! # Ok::<(), nonsmooth_simulate::SimulateError>(())
//! ```
//!
//! Mechanisms and oscillators in generalised coordinates are stated by the trait [`Lagrangian`] and moved by a [`LagrangianSimulation`].
//!
//! Scenes of `nonsmooth-scenes` are worlds too: `World::try_from(&scene)`. Scenes in files are [`SceneFile`]s.

mod crew;
mod cut;
mod detect;
mod drive;
mod elastic;
mod error;
pub mod import;
mod islands;
mod joints;
mod lagrangian;
mod mesh;
mod moreau_jean;
mod moving;
mod periodic;
mod planar;
mod polygon;
mod projection;
mod report;
mod restitution;
mod rolling;
pub mod rotation;
pub mod scene_file;
mod shape;
mod simulation;
mod state;
mod step;
mod world;

pub use detect::Key;
pub use drive::{Control, Observer};
pub use elastic::Elastic;
pub use error::{Overlap, SimulateError};
pub use joints::{
    Coordinate, Coupling, Drive, Driver, Joint, JointId, JointKind, JointLimits, JointReport,
    Motor, Spring,
};
pub use lagrangian::{
    Constant, Directions, Lagrangian, LagrangianContact, LagrangianScheme, LagrangianSimulation,
    LagrangianState, LinearContact, LinearRow, LinearSystem, RelationsAt, RowLaw, Size,
};
pub use mesh::Mesh;
pub use moreau_jean::{Activation, Geometry, Gyroscopic, Impact, MoreauJean, Stabilisation};
pub use periodic::{Period, Periodic};
pub use polygon::Polygon;
pub use report::{
    ContactReport, Counts, Drift, EnergyBalance, RunReport, Settled, StepReport, StepStatus,
    Timings,
};
pub use scene_file::SceneFile;
pub use shape::{Part, Shape, plane};
pub use simulation::{Force, Simulation, Wrenches};
pub use state::{ContactMemory, ElasticState, State};
pub use world::{Body, BodyId, Compliance, Dimension, Law, Motion, World};
