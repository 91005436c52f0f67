//! Scenes as files: TOML, or the same document as JSON.
//!
//! A [`SceneFile`] is what the file says, with defaults for the rest; [`build`](SceneFile::build) makes a [`Simulation`](crate::Simulation) of it. Names are ids, bodies have the order of the file, lengths are
//! metres, masses kilograms, angles radians. Friction belongs to pairs of materials: nothing is mixed. Whatever is wrong is one line that begins with the
//! place, for example `bodies[2].mass`.
//!
//! ```
//! use nonsmooth_simulate::SceneFile;
//!
//! let scene = SceneFile::parse(r#"
//!     format = "nonsmooth-scene"
//!     version = 1
//!     time = { h = 1e-3, end = 1.0 }
//!     pairs_default = { e = 0.8 }
//!     bodies = [
//!         { name = "floor", shape = { kind = "plane" }, fixed = true },
//!         { name = "ball", shape = { kind = "sphere", radius = 0.1 }, density = 1000, position = [0, 0, 1.1] },
//!     ]
//! "#, &[])?;
//! let mut simulation = scene.build()?;
//! let run = simulation.run(scene.time.end, scene.time.h, &mut ())?;
//! assert!(run.is_solved() && run.steps == 1000);
//! # Ok::<(), nonsmooth_simulate::SimulateError>(())
//! ```

mod build;
mod elastic;
mod joints;
mod made;
mod meshes;
mod plane;
mod read;

pub use made::Made;
pub(crate) use meshes::load as load_mesh;

use std::collections::BTreeMap;

use nonsmooth_solve::settings::SettingsMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::MoreauJean;

/// What `format` has to say.
pub const FORMAT: &str = "nonsmooth-scene";
/// The version of the format that is read.
pub const VERSION: u32 = 1;

/// A scene: bodies, what they are made of, how long they move and what is kept of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// `nonsmooth-scene`.
    pub format: String,
    /// 1.
    pub version: u32,
    /// The title of pictures and files.
    #[serde(default)]
    pub name: String,
    /// 3, or 2: then bodies move in the plane of the first two axes and turn about the third. Vectors have two components there, what turns one; densities are in kg/m².
    #[serde(default = "space")]
    #[schemars(range(min = 2, max = 3))]
    pub dimension: u8,
    /// Acceleration of gravity, m/s².
    #[serde(default = "earth")]
    #[schemars(schema_with = "plane::vector")]
    pub gravity: [f64; 3],
    /// How the world repeats itself, if it does: what moves out on one side comes in on the other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub periodic: Option<PeriodicTable>,
    /// How long, and in which steps.
    pub time: Time,
    /// The scheme.
    #[serde(default)]
    pub integrator: MoreauJean,
    /// Who solves the contact problems.
    #[serde(default)]
    pub solver: SolverTable,
    /// Materials by name.
    #[serde(default)]
    pub materials: BTreeMap<String, Material>,
    /// The law of contact of each pair of materials that meets.
    #[serde(default)]
    pub pairs: Vec<PairTable>,
    /// The law of pairs that are not listed. Without it, a pair that may meet and is not listed is refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pairs_default: Option<LawTable>,
    /// Shapes that several bodies have.
    #[serde(default)]
    pub shapes: Vec<NamedShape>,
    /// Bodies, one by one.
    #[serde(default)]
    pub bodies: Vec<BodyTable>,
    /// Elastic boxes, one by one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub elastic: Vec<ElasticTable>,
    /// Bodies of the families of `nonsmooth gen`: walls, piles, arches.
    #[serde(default)]
    pub generate: Vec<GenerateTable>,
    /// Joints between bodies, or a body and the world.
    #[serde(default)]
    pub joints: Vec<JointTable>,
    /// Gears, racks, pulleys: coordinates of joints whose weighted sum does not change.
    #[serde(default)]
    pub couplings: Vec<CouplingTable>,
    /// Forces that do not act at the mass centre, or not always.
    #[serde(default)]
    pub forces: Vec<ForceTable>,
    /// What is kept of a run.
    #[serde(default)]
    pub output: OutputTable,
}

/// A world that repeats itself along axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PeriodicTable {
    /// After which length along each axis, m; 0: not along this one.
    #[schemars(schema_with = "plane::vector")]
    pub lengths: [f64; 3],
    /// L, 1/s, by rows: the image a period p away moves with `L p` relative to the body, where p is that of the start. Shears and stretches what fills the world.
    #[serde(default)]
    #[schemars(schema_with = "plane::matrix")]
    pub gradient: [[f64; 3]; 3],
    /// The lower corner of the cell in which pictures show the bodies, m; motion does not depend on it.
    #[serde(default)]
    #[schemars(schema_with = "plane::vector")]
    pub corner: [f64; 3],
}

/// How long, and in which steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// Time step, s.
    pub h: f64,
    /// End of the run, s.
    pub end: f64,
}

/// Who solves the contact problems of a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SolverTable {
    /// A solver of `nonsmooth list` for local problems of the scene's dimension.
    pub name: String,
    /// The relative residual at which the judge is content.
    pub tol: f64,
    /// What departs from the solver's defaults.
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub settings: SettingsMap,
}

impl Default for SolverTable {
    fn default() -> Self {
        Self { name: "auto".into(), tol: 1e-10, settings: SettingsMap::new() }
    }
}

/// What bodies are made of.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// kg/m³, in the plane kg/m²; for bodies that have no density or mass of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
}

/// A law of contact.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LawTable {
    /// Coefficient of friction.
    pub mu: f64,
    /// Newton's coefficient of restitution, from 0 to 1.
    pub e: f64,
    /// Tangential coefficient of restitution, above −1 and at most 1.
    pub e_t: f64,
    /// Coefficient of rolling friction, m.
    #[serde(skip_serializing_if = "is_zero")]
    pub mu_rolling: f64,
    /// How contacts give way, if they do; then without restitution.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compliance: Option<ComplianceTable>,
}

/// What a scene need not say.
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// The law of contact of two materials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PairTable {
    /// Two materials, which may be the same.
    pub between: [String; 2],
    /// Coefficient of friction.
    #[serde(default)]
    pub mu: f64,
    /// Newton's coefficient of restitution, from 0 to 1.
    #[serde(default)]
    pub e: f64,
    /// Tangential coefficient of restitution, above −1 and at most 1.
    #[serde(default)]
    pub e_t: f64,
    /// Coefficient of rolling friction, m.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mu_rolling: f64,
    /// How contacts give way, if they do; then without restitution.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compliance: Option<ComplianceTable>,
}

/// A spring and a damper at each contact point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ComplianceTable {
    /// N/m.
    pub stiffness: f64,
    /// N·s/m.
    #[serde(default)]
    pub damping: f64,
}

/// A shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeTable {
    /// A ball about the origin.
    Sphere {
        /// m.
        radius: f64,
    },
    /// A box about the origin, sides along the axes; in the plane a rectangle.
    Box {
        /// Half sides, m.
        #[schemars(schema_with = "plane::vector")]
        half: [f64; 3],
    },
    /// All points within the radius of a segment on the third axis about the origin, in the plane on the first.
    Capsule {
        /// Half the length of the segment, m.
        half_length: f64,
        /// m.
        radius: f64,
    },
    /// All points within the radius of the third axis and not farther than half the length from the origin along it.
    Cylinder {
        /// Half the length, m.
        half_length: f64,
        /// m.
        radius: f64,
    },
    /// A cone about the third axis, its base below the origin, its point above.
    Cone {
        /// Half the height, m.
        half_length: f64,
        /// Of the base, m.
        radius: f64,
    },
    /// A surface of triangles, from a file or written out. A closed one is solid; one that is not is a sheet, of a body that is fixed or has a given mass.
    Mesh {
        /// STL or OBJ, beside the scene.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<String>,
        /// What its coordinates are multiplied by: 0.001 where they are in millimetres.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scale: Option<f64>,
        /// m.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        vertices: Vec<[f64; 3]>,
        /// Vertices by number, counterclockwise from outside.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        triangles: Vec<[usize; 3]>,
    },
    /// The ground below heights at the knots of a grid about the origin, solid below.
    Heightfield {
        /// m; a row for each place along the second axis.
        heights: Vec<Vec<f64>>,
        /// Its sides along the first two axes, m.
        size: [f64; 2],
    },
    /// The half space below a plane through the origin, in the plane the half plane below a line; of bodies that are fixed.
    Plane {
        /// Its normal, of any length; upwards where none is given.
        #[serde(default = "upwards")]
        #[schemars(schema_with = "plane::vector")]
        normal: [f64; 3],
    },
    /// All points of the plane within the radius of the origin.
    Disc {
        /// m.
        radius: f64,
    },
    /// A convex polygon in the plane.
    Polygon {
        /// Corners (x, y), counterclockwise, m.
        vertices: Vec<[f64; 2]>,
    },
    /// A convex polyhedron.
    Polyhedron {
        /// m.
        vertices: Vec<[f64; 3]>,
        /// The vertices of each face by number, counterclockwise from outside.
        faces: Vec<Vec<usize>>,
    },
    /// A straight prism on a convex polygon, counterclockwise from above, that it has in the plane z = −half_height.
    Prism {
        /// Corners (x, y), m.
        base: Vec<[f64; 2]>,
        /// m.
        half_height: f64,
    },
}

/// A shape that bodies ask for by name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NamedShape {
    /// The name.
    pub name: String,
    /// The shape.
    #[serde(flatten)]
    pub shape: ShapeTable,
}

/// A shape, or the name of one of `shapes`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ShapeOrName {
    /// One of `shapes`.
    Name(String),
    /// One of its own.
    Shape(ShapeTable),
}

/// An orientation: `axis` with `angle` (or `angle_deg`), or `quaternion`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotationTable {
    /// The axis, of any length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<f64>,
    /// Degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// `[w, x, y, z]`, of length 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion: Option<[f64; 4]>,
}

/// One of several shapes of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartTable {
    /// The shape.
    pub shape: ShapeOrName,
    /// The origin of the shape in the body, m.
    #[serde(default)]
    #[schemars(schema_with = "plane::vector")]
    pub position: [f64; 3],
    /// The orientation of the shape in the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "plane::rotation")]
    pub rotation: Option<RotationTable>,
    /// The material, in place of the body's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
}

/// A body. With a density, its own or its material's, mass and inertia are those of its shapes, and its frame moves to their mass centre; else `mass` and `inertia`
/// are about the origin of its frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BodyTable {
    /// The name, an id where it is given.
    pub name: String,
    /// Its shape,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeOrName>,
    /// or shapes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<PartTable>,
    /// One of `materials`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// kg/m³, in the plane kg/m², in place of the material's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// kg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// kg·m²: `[xx, yy, zz]` or `[xx, yy, zz, xy, xz, yz]`, in the body frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "plane::inertia")]
    pub inertia: Option<Vec<f64>>,
    /// Where the origin of its frame is, m.
    #[schemars(schema_with = "plane::vector")]
    pub position: [f64; 3],
    /// The orientation of its frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "plane::rotation")]
    pub rotation: Option<RotationTable>,
    /// Of the mass centre at the beginning, m/s; of bodies that move freely.
    #[schemars(schema_with = "plane::vector")]
    pub velocity: [f64; 3],
    /// In the world frame, at the beginning, rad/s; of bodies that move freely.
    #[schemars(schema_with = "plane::turn")]
    pub angular_velocity: [f64; 3],
    /// Whether it stays where it is.
    pub fixed: bool,
    /// How it is driven, if it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionTable>,
    /// Constant force at the mass centre besides the weight, N.
    #[schemars(schema_with = "plane::vector")]
    pub force: [f64; 3],
    /// Constant torque in the world frame, N·m.
    #[schemars(schema_with = "plane::turn")]
    pub torque: [f64; 3],
    /// The groups that it belongs to; of all, where none is named.
    pub groups: Vec<String>,
    /// The groups that it may touch; all, where none is named. Of `nothing` is nobody.
    pub collides_with: Vec<String>,
}

/// An elastic box along the axes of the world, of equal trilinear hexahedra: small strains, small turns. The nodes of its surface touch bodies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElasticTable {
    /// The name, an id where it is given; of its positions in trajectories too.
    #[serde(default)]
    pub name: String,
    /// Half sides, m.
    pub half: [f64; 3],
    /// Elements along each axis.
    pub divisions: [usize; 3],
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio, above −1 and below ½.
    #[serde(default)]
    pub poisson: f64,
    /// kg/m³, in place of the material's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// One of `materials`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Rayleigh's damping.
    #[serde(default)]
    pub damping: RayleighTable,
    /// Whether masses are at the nodes, in place of the consistent mass matrix: contact forces then oscillate less.
    #[serde(default = "yes")]
    pub lumped: bool,
    /// Faces whose nodes stay where they are.
    #[serde(default)]
    pub held: Vec<FaceName>,
    /// Where its centre is, m.
    #[serde(default)]
    pub position: [f64; 3],
    /// Of the centre, m/s.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// About the centre, rad/s.
    #[serde(default)]
    pub angular_velocity: [f64; 3],
}

/// Damping `C = mass · M + stiffness · K`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RayleighTable {
    /// 1/s.
    pub mass: f64,
    /// s.
    pub stiffness: f64,
}

/// A face of a box by its outward normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FaceName {
    /// Towards negative x.
    #[serde(rename = "-x")]
    Left,
    /// Towards positive x.
    #[serde(rename = "+x")]
    Right,
    /// Towards negative y.
    #[serde(rename = "-y")]
    Front,
    /// Towards positive y.
    #[serde(rename = "+y")]
    Back,
    /// Towards negative z.
    #[serde(rename = "-z")]
    Bottom,
    /// Towards positive z.
    #[serde(rename = "+z")]
    Top,
}

/// How a driven body moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum MotionTable {
    /// It stays, its surface moves: a conveyor belt, a turntable.
    Surface {
        /// At the origin of the body, m/s.
        #[serde(default)]
        #[schemars(schema_with = "plane::vector")]
        velocity: [f64; 3],
        /// rad/s.
        #[serde(default)]
        #[schemars(schema_with = "plane::turn")]
        angular_velocity: [f64; 3],
    },
    /// With a constant velocity, shapes and all: a piston, a plate that closes.
    Uniform {
        /// m/s.
        #[schemars(schema_with = "plane::vector")]
        velocity: [f64; 3],
    },
    /// About its position by `amplitude sin(frequency t + phase)`: a shaking table.
    Sine {
        /// m.
        #[schemars(schema_with = "plane::vector")]
        amplitude: [f64; 3],
        /// rad/s.
        frequency: f64,
        /// rad.
        #[serde(default)]
        phase: f64,
    },
}

/// The bodies of a family of `nonsmooth gen`, with its ground and the law of its contacts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GenerateTable {
    /// One of `nonsmooth gen --list`.
    pub scene: String,
    /// Its settings.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub set: SettingsMap,
    /// The name of its material, for pairs with others; also how the names of its bodies begin. The family's name, where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// By how much all is moved, m.
    #[serde(default)]
    pub position: [f64; 3],
    /// The scene, if it was made before.
    #[serde(skip)]
    #[schemars(skip)]
    pub made: Made,
}

/// A force on a body that moves freely. Of a step in which it begins or ends it has its share, so that its impulse is the same in steps of any length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ForceTable {
    /// The name of the body.
    pub body: String,
    /// In the world frame, N.
    #[serde(default)]
    #[schemars(schema_with = "plane::vector")]
    pub force: [f64; 3],
    /// In the world frame, N·m.
    #[serde(default)]
    #[schemars(schema_with = "plane::turn")]
    pub torque: [f64; 3],
    /// Where the force acts, in the body frame, m.
    #[serde(default)]
    #[schemars(schema_with = "plane::vector")]
    pub at: [f64; 3],
    /// It begins here, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// It ends here, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
}

/// A joint. Anchors and axes are in the world frame, where the bodies stand at the beginning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointTable {
    /// The name, an id where it is given.
    #[serde(default)]
    pub name: String,
    /// What it leaves free.
    pub kind: JointName,
    /// The first body, or `world`.
    pub a: String,
    /// The second one, or `world`.
    pub b: String,
    /// Where it is, m.
    #[serde(default)]
    #[schemars(schema_with = "plane::vector")]
    pub anchor: [f64; 3],
    /// The end on b of a `distance`, which needs it, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "plane::vector")]
    pub anchor_b: Option<[f64; 3]>,
    /// Its axis, of any length.
    #[serde(default = "upwards")]
    #[schemars(schema_with = "plane::vector")]
    pub axis: [f64; 3],
    /// Of a `universal` joint the axis on b, at a right angle to `axis`, which is that on a; of others a direction across the axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "plane::vector")]
    pub reference: Option<[f64; 3]>,
    /// Of a `screw` the slide per angle, m/rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch: Option<f64>,
    /// Whether its two bodies may touch each other.
    #[serde(default)]
    pub collide: bool,
    /// How far its coordinate may go: the slide of a `prismatic` joint and of a `point_on_line`, the angle of others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<LimitsTable>,
    /// A spring and a damper along its coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring: Option<SpringTable>,
    /// Dry friction along its coordinate, N or N·m.
    #[serde(default)]
    pub friction: f64,
    /// A motor along its coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motor: Option<MotorTable>,
    /// A motion of its coordinate that is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<DriverTable>,
    /// What acts along the slide of a `cylindrical` joint or a `screw`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slide: Option<DriveTable>,
}

/// The kinds of joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JointName {
    /// A weld.
    Fixed,
    /// A turn about the axis.
    Revolute,
    /// A slide along the axis.
    Prismatic,
    /// Both.
    Cylindrical,
    /// Both, one proportional to the other.
    Screw,
    /// A ball in a socket.
    Spherical,
    /// Cardan's joint.
    Universal,
    /// Slides across the axis and a turn about it.
    Planar,
    /// A point of b stays on a line of a.
    PointOnLine,
    /// A point of b stays on a plane of a.
    PointOnPlane,
    /// A rod without mass.
    Distance,
}

/// What acts along a coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriveTable {
    /// How far it may go.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limits: Option<LimitsTable>,
    /// A spring and a damper.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spring: Option<SpringTable>,
    /// Dry friction, N or N·m.
    pub friction: f64,
    /// A motor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motor: Option<MotorTable>,
    /// A motion that is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<DriverTable>,
}

/// How far a coordinate may go; it is zero at the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitsTable {
    /// rad or m; none where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// rad or m; none where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<f64>,
    /// Coefficient of restitution.
    #[serde(default)]
    pub e: f64,
}

/// A spring with a damper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpringTable {
    /// N/m or N·m/rad.
    #[serde(default)]
    pub stiffness: f64,
    /// N·s/m or N·m·s/rad.
    #[serde(default)]
    pub damping: f64,
    /// Where it is without force, m or rad.
    #[serde(default)]
    pub rest: f64,
}

/// A motor: to a `velocity`, or to a `position` by a stiffness and a damping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorTable {
    /// m/s or rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<f64>,
    /// m or rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<f64>,
    /// N/m or N·m/rad, of a motor to a position, which needs it or a damping.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// N·s/m or N·m·s/rad, of a motor to a position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<f64>,
    /// The most force or torque, N or N·m; no bound where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
}

/// A motion that is given: `velocity t + amplitude (sin(frequency t + phase) − sin(phase))`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriverTable {
    /// m/s or rad/s.
    pub velocity: f64,
    /// m or rad.
    pub amplitude: f64,
    /// rad/s.
    pub frequency: f64,
    /// rad.
    pub phase: f64,
}

/// Coordinates of joints with `Σ weight · coordinate` constant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouplingTable {
    /// The name.
    #[serde(default)]
    pub name: String,
    /// The coordinates.
    pub terms: Vec<TermTable>,
}

/// A coordinate with its weight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermTable {
    /// The name of a joint.
    pub joint: String,
    /// Which of its coordinates; its only one, where none is named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coordinate: Option<CoordinateName>,
    /// The weight.
    pub weight: f64,
}

/// A coordinate of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CoordinateName {
    /// rad.
    Angle,
    /// m.
    Slide,
}

/// What is kept of a run, and where: files beside the scene's, unless the command line says otherwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OutputTable {
    /// Steps between two frames.
    pub every: u64,
    /// The trajectory, HDF5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<String>,
    /// A page that plays it in a browser, without a network.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub html: Option<String>,
    /// A table of time, energy and residual, a row a step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub csv: Option<String>,
    /// For ParaView, a .pvd file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vtk: Option<String>,
}

impl Default for OutputTable {
    fn default() -> Self {
        Self { every: 1, trajectory: None, html: None, csv: None, vtk: None }
    }
}

/// Gravity where none is given, m/s².
const EARTH: f64 = 9.81;

fn earth() -> [f64; 3] {
    [0.0, 0.0, -EARTH]
}

fn space() -> u8 {
    3
}

fn yes() -> bool {
    true
}

fn upwards() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}
