//! Rigid bodies.

use crate::SceneError;
use crate::error::{positive, require};
use crate::polyhedron::{MassProperties, Polyhedron};
use crate::vec3::{Mat3, Vec3, add, apply, congruence, norm, scale, sub};

/// A unit quaternion `[w, x, y, z]` that turns the body frame into the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation(pub [f64; 4]);

impl Rotation {
    /// No rotation.
    pub const IDENTITY: Self = Self([1.0, 0.0, 0.0, 0.0]);

    /// The rotation by `angle` (rad) about `axis`, which need not be of unit length; none for a zero axis.
    pub fn about(axis: Vec3, angle: f64) -> Self {
        let length = norm(axis);
        if length == 0.0 {
            return Self::IDENTITY;
        }
        let [x, y, z] = scale((angle / 2.0).sin() / length, axis);
        Self([(angle / 2.0).cos(), x, y, z])
    }

    /// `self` after `first`.
    pub fn after(self, first: Self) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, first.0);
        Self([
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ])
    }

    /// The rotation matrix.
    pub fn matrix(self) -> Mat3 {
        let [w, x, y, z] = self.0;
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }
}

/// The shape of a body about its mass centre, in the body frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A box.
    Box {
        /// Half sides, m.
        half: Vec3,
    },
    /// A ball.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A convex polyhedron.
    Polyhedron(Polyhedron),
    /// Convex polyhedra without common volume, rigidly joined: a link of a chain.
    Compound(Vec<Polyhedron>),
}

impl Shape {
    /// Mass, mass centre and inertia for a density in kg/m³.
    ///
    /// Errors: a side, radius or density that is not positive; a compound of nothing.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, SceneError> {
        positive("density", density)?;
        let diagonal = |mass: f64, d: Vec3| MassProperties {
            mass,
            centre: [0.0; 3],
            inertia: [[d[0], 0.0, 0.0], [0.0, d[1], 0.0], [0.0, 0.0, d[2]]],
        };
        Ok(match self {
            Shape::Box { half: [a, b, c] } => {
                for x in [a, b, c] {
                    positive("half", *x)?;
                }
                let third = density * 8.0 * a * b * c / 3.0;
                let inertia = [b * b + c * c, c * c + a * a, a * a + b * b].map(|x| third * x);
                diagonal(3.0 * third, inertia)
            }
            Shape::Sphere { radius } => {
                positive("radius", *radius)?;
                let mass = density * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
                diagonal(mass, [0.4 * mass * radius * radius; 3])
            }
            Shape::Polyhedron(p) => p.mass_properties(density),
            Shape::Compound(parts) if parts.is_empty() => {
                return Err(SceneError::value("parts", "at least one polyhedron", "none"));
            }
            Shape::Compound(parts) => {
                let parts: Vec<_> = parts.iter().map(|p| p.mass_properties(density)).collect();
                MassProperties::joined(&parts)
            }
        })
    }

    /// The largest distance from the mass centre, m.
    pub fn radius(&self) -> f64 {
        match self {
            Shape::Box { half } => norm(*half),
            Shape::Sphere { radius } => *radius,
            Shape::Polyhedron(p) => p.radius_about([0.0; 3]),
            Shape::Compound(parts) => {
                parts.iter().map(|p| p.radius_about([0.0; 3])).fold(0.0, f64::max)
            }
        }
    }
}

/// A rigid body: 6 degrees of freedom, its velocity `[linear, angular]`, both in the world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBody {
    /// Mass, kg.
    pub mass: f64,
    /// Inertia about the mass centre in the body frame, symmetric positive definite, kg·m².
    pub inertia: Mat3,
    /// Mass centre, m.
    pub position: Vec3,
    /// Orientation of the body frame.
    pub rotation: Rotation,
    /// Velocity of the mass centre, m/s.
    pub velocity: Vec3,
    /// Angular velocity in the world frame, rad/s.
    pub angular_velocity: Vec3,
    /// Given force at the mass centre besides the weight, N.
    pub force: Vec3,
    /// The shape about the mass centre.
    pub shape: Shape,
}

impl RigidBody {
    /// A homogeneous solid at rest, its frame that of the world.
    ///
    /// Boxes and spheres are centred at the origin, polyhedra stay where their vertices are.
    /// Errors: those of [`Shape::mass_properties`].
    pub fn solid(shape: Shape, density: f64) -> Result<Self, SceneError> {
        let MassProperties { mass, centre, inertia } = shape.mass_properties(density)?;
        let shape = match shape {
            Shape::Polyhedron(p) => Shape::Polyhedron(p.mapped(|v| sub(v, centre))),
            Shape::Compound(parts) => {
                Shape::Compound(parts.iter().map(|p| p.mapped(|v| sub(v, centre))).collect())
            }
            other => other,
        };
        Ok(Self {
            mass,
            inertia,
            position: centre,
            rotation: Rotation::IDENTITY,
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            force: [0.0; 3],
            shape,
        })
    }

    /// The same body with its mass centre at `position`.
    pub fn at(self, position: Vec3) -> Self {
        Self { position, ..self }
    }

    /// The inertia about the mass centre in the world frame, `R J Rᵀ`, kg·m².
    pub fn world_inertia(&self) -> Mat3 {
        congruence(&self.rotation.matrix(), &self.inertia)
    }

    /// The world coordinates of a point of the body frame.
    pub fn to_world(&self, point: Vec3) -> Vec3 {
        add(self.position, apply(&self.rotation.matrix(), point))
    }

    /// Checks every value; `key` names the body in messages.
    pub(crate) fn validate(&self, key: &str) -> Result<(), SceneError> {
        positive(&format!("{key}.mass"), self.mass)?;
        let j = &self.inertia;
        let d2 = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let d3 = crate::vec3::dot(j[0], crate::vec3::cross(j[1], j[2]));
        let symmetric = (0..3).all(|k| {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            (j[a][b] - j[b][a]).abs() <= 1e-9 * (j[a][a] * j[b][b]).abs().sqrt()
        });
        if !(j[0][0] > 0.0 && d2 > 0.0 && d3 > 0.0 && d3.is_finite() && symmetric) {
            let expected = "a symmetric positive definite matrix";
            return Err(SceneError::value(format!("{key}.inertia"), expected, format!("{j:?}")));
        }
        let q = self.rotation.0.iter().map(|x| x * x).sum::<f64>();
        require(&format!("{key}.rotation"), q, (q - 1.0).abs() < 1e-9, "a unit quaternion")?;
        for (name, x) in [
            ("position", self.position),
            ("velocity", self.velocity),
            ("angular_velocity", self.angular_velocity),
            ("force", self.force),
        ] {
            require(&format!("{key}.{name}"), x.iter().sum(), true, "finite components")?;
        }
        Ok(())
    }
}
