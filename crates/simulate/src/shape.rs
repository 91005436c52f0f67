//! Shapes of bodies.

use std::sync::Arc;

use nonsmooth_scenes::vec3::{Vec3, norm};
use nonsmooth_scenes::{MassProperties, Polyhedron, Rotation, SceneError};

use crate::error::require;
use crate::polygon::lamina;
use crate::{Mesh, Polygon, SimulateError};

/// A solid in a frame of its own, or a surface; all but surfaces are convex.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A ball about the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A box about the origin, sides along the axes.
    Box {
        /// Half sides, m.
        half: Vec3,
    },
    /// All points within `radius` of the segment from `−half_length` to `half_length` on the third axis.
    Capsule {
        /// Half the length of the segment, m.
        half_length: f64,
        /// Radius, m.
        radius: f64,
    },
    /// The half space below the plane through the origin whose normal is the third axis; for bodies that do not move freely.
    Plane,
    /// A convex polyhedron, where its vertices are.
    Polyhedron(Polyhedron),
    /// All points within `radius` of the third axis and not farther than `half_length` from the origin along it.
    Cylinder {
        /// Half the length, m.
        half_length: f64,
        /// Radius, m.
        radius: f64,
    },
    /// The cone about the third axis with its base at `−half_length` and its point at `half_length`.
    Cone {
        /// Half the height, m.
        half_length: f64,
        /// Radius of the base, m.
        radius: f64,
    },
    /// A surface of triangles.
    Mesh(Arc<Mesh>),
    /// All points within `radius` of the origin, of a world in the plane.
    Disc {
        /// Radius, m.
        radius: f64,
    },
    /// A convex polygon, where its corners are, of a world in the plane.
    Polygon(Polygon),
    /// All points within `radius` of the segment from `−half_length` to `half_length` on the first axis, of a world in the plane.
    Stadium {
        /// Half the length of the segment, m.
        half_length: f64,
        /// Radius, m.
        radius: f64,
    },
}

impl Shape {
    /// What it is called in messages.
    pub fn name(&self) -> &'static str {
        match self {
            Shape::Sphere { .. } => "sphere",
            Shape::Box { .. } => "box",
            Shape::Capsule { .. } => "capsule",
            Shape::Plane => "plane",
            Shape::Polyhedron(_) => "polyhedron",
            Shape::Cylinder { .. } => "cylinder",
            Shape::Cone { .. } => "cone",
            Shape::Mesh(_) => "mesh",
            Shape::Disc { .. } => "disc",
            Shape::Polygon(_) => "polygon",
            Shape::Stadium { .. } => "capsule in the plane",
        }
    }

    /// The largest distance of its points from its origin, m; infinite for a plane.
    pub fn radius(&self) -> f64 {
        match self {
            Shape::Sphere { radius } | Shape::Disc { radius } => *radius,
            Shape::Box { half } => norm(*half),
            Shape::Capsule { half_length, radius } | Shape::Stadium { half_length, radius } => {
                half_length + radius
            }
            Shape::Polygon(p) => p.points().map(norm).fold(0.0, f64::max),
            Shape::Plane => f64::INFINITY,
            Shape::Polyhedron(p) => p.radius_about([0.0; 3]),
            Shape::Cylinder { half_length, radius } | Shape::Cone { half_length, radius } => {
                half_length.hypot(*radius)
            }
            Shape::Mesh(mesh) => mesh.vertices().iter().map(|&v| norm(v)).fold(0.0, f64::max),
        }
    }

    /// Mass, mass centre and inertia for a density in kg/m³; of shapes of the plane in kg/m², as of thin sheets.
    ///
    /// Errors: a length or density that is not positive; a plane, which has no mass; those of [`Mesh::mass_properties`].
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, SimulateError> {
        use nonsmooth_scenes::Shape as Solid;
        Ok(match self {
            Shape::Sphere { radius } => {
                Solid::Sphere { radius: *radius }.mass_properties(density)?
            }
            Shape::Box { half } => Solid::Box { half: *half }.mass_properties(density)?,
            Shape::Polyhedron(p) => Solid::Polyhedron(p.clone()).mass_properties(density)?,
            Shape::Plane => {
                return Err(SimulateError::value("shape", "a solid with a mass", "a plane"));
            }
            Shape::Mesh(mesh) => mesh.mass_properties(density)?,
            Shape::Disc { radius: r } => {
                for (key, x) in [("radius", *r), ("density", density)] {
                    require(|| key.into(), x, x > 0.0, "a positive number")?;
                }
                let mass = density * std::f64::consts::PI * r * r;
                let across = 0.25 * mass * r * r;
                lamina(mass, [0.0; 2], [across, 0.0, across])
            }
            Shape::Polygon(p) => {
                require(|| "density".into(), density, density > 0.0, "a positive number")?;
                p.mass_properties(density)
            }
            Shape::Stadium { half_length: l, radius: r } => {
                for (key, x) in [("half_length", *l), ("radius", *r), ("density", density)] {
                    require(|| key.into(), x, x > 0.0, "a positive number")?;
                }
                // A rectangle and two half discs, whose mass centres lie 4r/(3π) beyond its ends.
                let (middle, ends) =
                    (density * 4.0 * l * r, density * std::f64::consts::PI * r * r);
                let beyond = 4.0 * r / (3.0 * std::f64::consts::PI);
                let along = middle * l * l / 3.0 + ends * (0.25 * r * r + l * l + 2.0 * l * beyond);
                let across = middle * r * r / 3.0 + ends * 0.25 * r * r;
                lamina(middle + ends, [0.0; 2], [along, 0.0, across])
            }
            Shape::Cylinder { half_length: l, radius: r }
            | Shape::Cone { half_length: l, radius: r } => {
                for (key, x) in [("half_length", *l), ("radius", *r), ("density", density)] {
                    require(|| key.into(), x, x > 0.0, "a positive number")?;
                }
                let cylinder = density * std::f64::consts::PI * r * r * 2.0 * l;
                // A cone of height 2 l has a third of the mass, its mass centre l/2 below the middle, and J = m (3/10 r²; 3/20 r² + 3/80 (2 l)²).
                let (mass, centre, axial, across) = match self {
                    Shape::Cylinder { .. } => {
                        (cylinder, 0.0, 0.5 * r * r, r * r / 4.0 + l * l / 3.0)
                    }
                    _ => (cylinder / 3.0, -0.5 * l, 0.3 * r * r, 0.15 * (r * r + l * l)),
                };
                let [axial, across] = [axial, across].map(|x| mass * x);
                let inertia = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, axial]];
                MassProperties { mass, centre: [0.0, 0.0, centre], inertia }
            }
            Shape::Capsule { half_length: l, radius: r } => {
                for (key, x) in [("half_length", *l), ("radius", *r), ("density", density)] {
                    require(|| key.into(), x, x > 0.0, "a positive number")?;
                }
                // A cylinder and two half balls, whose mass centres lie 3r/8 beyond its ends.
                let cylinder = density * std::f64::consts::PI * r * r * 2.0 * l;
                let ball = density * std::f64::consts::PI * 4.0 / 3.0 * r.powi(3);
                let axial = 0.5 * cylinder * r * r + 0.4 * ball * r * r;
                let across = cylinder * (r * r / 4.0 + l * l / 3.0)
                    + ball * (0.4 * r * r + l * l + 0.75 * l * r);
                let inertia = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, axial]];
                MassProperties { mass: cylinder + ball, centre: [0.0; 3], inertia }
            }
        })
    }

    /// Checks its lengths; `key` names it in messages.
    pub(crate) fn validate(&self, key: &str) -> Result<(), SimulateError> {
        let lengths: &[(&str, f64)] = match self {
            Shape::Sphere { radius } | Shape::Disc { radius } => &[("radius", *radius)],
            Shape::Box { half: [a, b, c] } => &[("half", *a), ("half", *b), ("half", *c)],
            Shape::Capsule { half_length, radius }
            | Shape::Cylinder { half_length, radius }
            | Shape::Stadium { half_length, radius }
            | Shape::Cone { half_length, radius } => {
                &[("half_length", *half_length), ("radius", *radius)]
            }
            Shape::Plane | Shape::Polyhedron(_) | Shape::Polygon(_) | Shape::Mesh(_) => &[],
        };
        for (name, x) in lengths {
            require(|| format!("{key}.{name}"), *x, *x > 0.0, "a positive number")?;
        }
        Ok(())
    }
}

impl From<Mesh> for Shape {
    fn from(mesh: Mesh) -> Self {
        Shape::Mesh(Arc::new(mesh))
    }
}

impl From<Polygon> for Shape {
    fn from(polygon: Polygon) -> Self {
        Shape::Polygon(polygon)
    }
}

impl From<Polyhedron> for Shape {
    fn from(polyhedron: Polyhedron) -> Self {
        Shape::Polyhedron(polyhedron)
    }
}

/// A shape of a body: where it is in the frame of the body, and what it is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// The shape.
    pub shape: Shape,
    /// The origin of the shape's frame in the frame of the body, m.
    pub position: Vec3,
    /// The orientation of the shape's frame in that of the body.
    pub rotation: Rotation,
    /// The material, as [`World::material`](crate::World::material) counts them; 0 is that of all who ask for none.
    pub material: usize,
}

impl Part {
    /// The shape in the frame of the body.
    pub fn new(shape: impl Into<Shape>) -> Self {
        Self { shape: shape.into(), position: [0.0; 3], rotation: Rotation::IDENTITY, material: 0 }
    }

    /// The same shape elsewhere.
    #[must_use]
    pub fn at(self, position: Vec3, rotation: Rotation) -> Self {
        Self { position, rotation, ..self }
    }

    /// The same shape of another material.
    #[must_use]
    pub fn of(self, material: usize) -> Self {
        Self { material, ..self }
    }
}

/// The half space below the plane through `point` with the outward `normal`, as a part of a body whose frame is that of the world.
///
/// Errors: a normal without direction.
pub fn plane(point: Vec3, normal: Vec3) -> Result<Part, SceneError> {
    let length = norm(normal);
    if !(length > 0.0 && length.is_finite()) {
        let (key, expected) = ("normal".into(), "a direction".into());
        return Err(SceneError::Value { key, expected, found: format!("{normal:?}") });
    }
    let n = normal.map(|x| x / length);
    // The shortest turn from the third axis; upside down by half a turn about the first.
    let rotation = if n[2] > -1.0 + 1e-12 {
        let s = (2.0 * (1.0 + n[2])).sqrt();
        Rotation([0.5 * s, -n[1] / s, n[0] / s, 0.0])
    } else {
        Rotation([0.0, 1.0, 0.0, 0.0])
    };
    Ok(Part::new(Shape::Plane).at(point, rotation))
}
