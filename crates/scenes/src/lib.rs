//! Rigid bodies, elastic solids and given contacts, assembled into the frictional contact problem of one time
//! step.
//!
//! A [`Scene`] holds [`RigidBody`]s, [`ElasticBox`]es and [`Contact`]s; [`Scene::problem`] states the Moreau–Jean
//! step as a global problem and [`Scene::condensed`] as a local one. [`scenes`] has families of scenes by name
//! ([`SCENES`]), [`draw::svg`](draw::svg()) draws any scene, and [`draw::html`](draw::html()) makes a page that turns it. A contact may be with the periodic image of a body or with a
//! moving wall ([`Image`]). SI units throughout: m, kg, s, rad.
//!
//! Scenes are made, not simulated. Packings are relaxed: overlap energy under a weight that fades, a last stage without weight, then an exact blow-up, so that nothing
//! overlaps and radii are those asked for. Voronoi cells are cut by index, so neighbours agree on their faces; normals come from faces, and slivers do not touch. A
//! contact knows the point that each side touches with, and a periodic image is an offset of the arm and a velocity in w, so bodies know nothing of the period. The unknowns of
//! elastic solids come after those of the bodies; a contact reaches them through the shape functions of the element that it touches.
//!
//! ```
//! use nonsmooth_scenes::scenes::{Family, Stack};
//!
//! let scene = Stack { count: 3, mu: 0.4, ..Stack::default() }.build()?;
//! let problem = scene.problem()?;
//! assert_eq!((problem.dofs(), problem.contacts()), (18, 12));
//! # Ok::<(), nonsmooth_scenes::SceneError>(())
//! ```

mod assembly;
mod body;
mod contact;
mod domain;
pub mod draw;
mod elastic;
mod error;
mod packing;
mod polyhedron;
mod scene;
pub mod scenes;
mod turning_ball;
pub mod vec3;
mod voronoi;

pub use body::{RigidBody, Rotation, Shape};
pub use contact::{Contact, Image};
pub use elastic::{ElasticBox, Material};
pub use error::SceneError;
pub use polyhedron::{MassProperties, Polyhedron};
pub use scene::{Ground, Gyroscopic, Obstacle, Scene};
pub use scenes::{SCENES, SceneEntry};
pub use turning_ball::{BallState, TurningBall};
pub use vec3::{Mat3, Vec3};
