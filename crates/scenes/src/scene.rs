//! Bodies, elastic solids and contacts together.

use std::array::from_fn;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::error::{positive, require};
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, X, add, cross, norm};
use crate::{Contact, ElasticBox, Image, RigidBody, SceneError, Shape};

/// Bodies, the contacts between them, and what drives them during one time step.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// What the scene is called.
    pub name: String,
    /// The bodies, in the order of the degrees of freedom.
    pub bodies: Vec<RigidBody>,
    /// Elastic solids; contacts count them after all bodies, as their degrees of freedom come after.
    pub solids: Vec<ElasticBox>,
    /// The contacts, all of them active.
    pub contacts: Vec<Contact>,
    /// Acceleration of gravity, m/s².
    pub gravity: Vec3,
    /// Time step, s.
    pub h: f64,
    /// How the gyroscopic torque enters.
    pub gyroscopic: Gyroscopic,
    /// The ground as it is drawn; contacts with the ground state their own geometry.
    pub ground: Option<Ground>,
    /// Fixed solids, drawn only; contacts with them are contacts with the ground.
    pub obstacles: Vec<Obstacle>,
    /// The periods of a scene that repeats itself: a period and the velocity that the image of a body there has relative to the body. Assembly
    /// does not ask for them, for contacts state their own images.
    pub periods: Vec<Image>,
}

/// How the gyroscopic torque `g(ω) = ω × J ω` enters the step.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Gyroscopic {
    /// By its value before the step; M is symmetric.
    Explicit,
    /// Linearised about the velocity before the step, with its derivative in M, which is then not symmetric.
    Implicit,
}

/// A fixed solid.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// Its shape.
    pub shape: Shape,
    /// Where the origin of the shape is, m.
    pub position: Vec3,
}

impl From<Polyhedron> for Obstacle {
    fn from(polyhedron: Polyhedron) -> Self {
        Self { shape: Shape::Polyhedron(polyhedron), position: [0.0; 3] }
    }
}

/// A plane ground.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Ground {
    /// A point of the plane, m.
    pub point: Vec3,
    /// The unit normal, upwards.
    pub normal: Vec3,
    /// A direction along the plane, that of the grid.
    pub along: Vec3,
}

impl Ground {
    /// The plane z = 0.
    pub const FLAT: Self = Self { point: [0.0; 3], normal: [0.0, 0.0, 1.0], along: X };

    pub(crate) fn validate(&self) -> Result<(), SceneError> {
        let across = norm(cross(self.normal, self.along));
        require("ground", across, across > 0.0, "a normal and a direction across it")
    }
}

impl Scene {
    /// Adds a body; returns its index.
    pub fn push(&mut self, body: RigidBody) -> usize {
        self.bodies.push(body);
        self.bodies.len() - 1
    }

    /// Adds an elastic solid; returns its index as contacts count it, so bodies must be added before.
    pub fn push_solid(&mut self, solid: ElasticBox) -> usize {
        self.solids.push(solid);
        self.bodies.len() + self.solids.len() - 1
    }

    /// The number of degrees of freedom.
    pub fn dofs(&self) -> usize {
        6 * self.bodies.len() + self.solids.iter().map(ElasticBox::dofs).sum::<usize>()
    }

    /// The mass of all bodies and solids, kg.
    pub fn mass(&self) -> f64 {
        let solids = self.solids.iter().map(ElasticBox::mass);
        self.bodies.iter().map(|b| b.mass).chain(solids).sum()
    }

    /// Adds to each component of velocity a random number within ±`amplitude` (m/s), uniform and reproducible
    /// by `seed`; angular velocities by as much at the farthest point of the body. An elastic solid gets a rigid
    /// motion, unless it is held.
    pub fn disturb(&mut self, amplitude: f64, seed: u64) {
        if amplitude == 0.0 {
            return;
        }
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut draw = || amplitude * rng.random_range(-1.0..=1.0);
        self.add_velocities(|radius| (from_fn(|_| draw()), from_fn(|_| draw() / radius)));
    }

    /// Adds to each body, then to each elastic solid that nothing holds, the velocity `[linear, angular]` about its
    /// centre that `motion` has for its radius.
    pub(crate) fn add_velocities(&mut self, mut motion: impl FnMut(f64) -> (Vec3, Vec3)) {
        for body in &mut self.bodies {
            let (linear, angular) = motion(body.shape.radius());
            body.velocity = add(body.velocity, linear);
            body.angular_velocity = add(body.angular_velocity, angular);
        }
        for solid in self.solids.iter_mut().filter(|s| !s.is_held()) {
            let (linear, angular) = motion(solid.radius());
            solid.add_velocity(linear, angular);
        }
    }

    /// Checks every value; the fields are public, so assembly calls it first.
    ///
    /// Errors: the first value that is not possible, by its place, for example `bodies[3].mass`.
    pub fn validate(&self) -> Result<(), SceneError> {
        positive("h", self.h)?;
        require("gravity", self.gravity.iter().sum(), true, "finite components")?;
        if let Some(ground) = &self.ground {
            ground.validate()?;
        }
        for (k, body) in self.bodies.iter().enumerate() {
            body.validate(&format!("bodies[{k}]"))?;
        }
        for (k, solid) in self.solids.iter().enumerate() {
            solid.validate(&format!("solids[{k}]"))?;
        }
        for (c, contact) in self.contacts.iter().enumerate() {
            contact.validate(&format!("contacts[{c}]"), self.bodies.len() + self.solids.len())?;
            for (_, k, point) in contact.sides() {
                let Some(s) = k.checked_sub(self.bodies.len()) else { continue };
                if self.solids[s].weights(point).is_none() {
                    let key = format!("contacts[{c}].point");
                    let expected = format!("a point of solids[{s}]");
                    return Err(SceneError::value(key, expected, format!("{point:?}")));
                }
            }
        }
        Ok(())
    }
}
