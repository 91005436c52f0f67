//! The world: bodies, what they are made of, and what drives them. Plain data, checked by [`World::validate`].

use std::collections::{BTreeMap, BTreeSet};

use nonsmooth_scenes::vec3::{Mat3, Vec3, add, dot, norm, scale, sub};
use nonsmooth_scenes::{self as scenes, ElasticBox, MassProperties, Polyhedron, Rotation, Scene};

use crate::elastic::Elastic;
use crate::error::{finite, require};
use crate::planar;
use crate::rotation::unit;
use crate::shape::plane;
use crate::state::State;
use crate::{
    Coupling, Drive, Driver, Joint, JointId, Part, Period, Periodic, Shape, SimulateError,
};

/// The number of a body; never used again for another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId(pub u32);

impl BodyId {
    /// Its place among [`World::bodies`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// How a body moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// As forces and contacts make it.
    Free,
    /// Not at all.
    Fixed,
    /// Its shapes stay, its surface moves with `linear + angular × (p − position)`: a conveyor belt, a turntable; m/s and rad/s.
    Surface {
        /// At the position of the body, m/s.
        linear: Vec3,
        /// rad/s.
        angular: Vec3,
    },
    /// With a constant velocity, shapes and all: a piston, a plate that closes.
    Uniform {
        /// m/s.
        velocity: Vec3,
    },
    /// About its position by `amplitude sin(frequency t + phase)`: a shaking table.
    Oscillating {
        /// m.
        amplitude: Vec3,
        /// rad/s.
        frequency: f64,
        /// rad.
        phase: f64,
    },
}

impl Motion {
    /// The velocity at a time of a body that impulses do not move, shapes and all.
    pub(crate) fn velocity(&self, t: f64) -> Vec3 {
        match *self {
            Self::Uniform { velocity } => velocity,
            Self::Oscillating { amplitude, frequency, phase } => {
                oscillation(amplitude, frequency, phase, t).1
            }
            Self::Free | Self::Fixed | Self::Surface { .. } => [0.0; 3],
        }
    }
}

/// A rigid body with any number of shapes. Velocities are in the world frame; the origin of its frame is its mass centre.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// What messages and files call it; may be empty.
    pub name: String,
    /// How it moves.
    pub motion: Motion,
    /// Mass, kg; without meaning unless it moves freely.
    pub mass: f64,
    /// Inertia about the mass centre in the body frame, kg·m².
    pub inertia: Mat3,
    /// Mass centre, m.
    pub position: Vec3,
    /// Orientation of the body frame.
    pub rotation: Rotation,
    /// Velocity of the mass centre, m/s.
    pub velocity: Vec3,
    /// Angular velocity in the world frame, rad/s.
    pub angular_velocity: Vec3,
    /// Constant force at the mass centre besides the weight, N.
    pub force: Vec3,
    /// Constant torque in the world frame, N·m.
    pub torque: Vec3,
    /// Its shapes.
    pub parts: Vec<Part>,
    /// The groups that it belongs to, one a bit.
    pub membership: u32,
    /// The groups that it may touch, one a bit; two bodies touch where each may touch the other.
    pub collides_with: u32,
}

impl Body {
    fn bare(motion: Motion, parts: Vec<Part>) -> Self {
        Self {
            name: String::new(),
            motion,
            mass: 1.0,
            inertia: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            position: [0.0; 3],
            rotation: Rotation::IDENTITY,
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            force: [0.0; 3],
            torque: [0.0; 3],
            parts,
            membership: u32::MAX,
            collides_with: u32::MAX,
        }
    }

    /// A homogeneous body at rest. Spheres, boxes and capsules are centred at the origin, polyhedra stay where their vertices are.
    ///
    /// Errors: those of [`Shape::mass_properties`].
    pub fn solid(shape: impl Into<Shape>, density: f64) -> Result<Self, SimulateError> {
        Self::composed(vec![(Part::new(shape), density)])
    }

    /// A body of parts with a density each, kg/m³, where the parts are. Parts that overlap count twice.
    ///
    /// Errors: those of [`Shape::mass_properties`]; no parts.
    pub fn composed(parts: Vec<(Part, f64)>) -> Result<Self, SimulateError> {
        if parts.is_empty() {
            return Err(SimulateError::value("parts", "at least one", "none"));
        }
        let mut all = vec![];
        for (part, density) in &parts {
            let p = part.shape.mass_properties(*density)?;
            let r = part.rotation.matrix();
            all.push(MassProperties {
                mass: p.mass,
                centre: add(part.position, scenes::vec3::apply(&r, p.centre)),
                inertia: scenes::vec3::congruence(&r, &p.inertia),
            });
        }
        let MassProperties { mass, centre, inertia } = MassProperties::joined(&all);
        let parts = parts
            .into_iter()
            .map(|(p, _)| Part { position: sub(p.position, centre), ..p })
            .collect();
        let body = Self::bare(Motion::Free, parts);
        Ok(Self { mass, inertia, position: centre, ..body })
    }

    /// A body of given mass and inertia, kg and kg·m², about the origin of its parts.
    pub fn with_mass(mass: f64, inertia: Mat3, parts: Vec<Part>) -> Self {
        Self { mass, inertia, ..Self::bare(Motion::Free, parts) }
    }

    /// A body of a world in the plane, of given mass and moment of inertia, kg and kg·m², about the origin of its parts.
    pub fn in_plane(mass: f64, inertia: f64, parts: Vec<Part>) -> Self {
        let j = 0.5 * inertia;
        Self::with_mass(mass, [[j, 0.0, 0.0], [0.0, j, 0.0], [0.0, 0.0, inertia]], parts)
    }

    /// A body that does not move.
    pub fn fixed(parts: Vec<Part>) -> Self {
        Self::bare(Motion::Fixed, parts)
    }

    /// The plane z = 0, with all below it.
    pub fn floor() -> Self {
        Self::fixed(vec![Part::new(Shape::Plane)])
    }

    /// With this name.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// The half plane y ≤ 0 of a world in the plane.
    pub fn ground() -> Self {
        let turn = std::f64::consts::FRAC_1_SQRT_2;
        let plane = Part::new(Shape::Plane).at([0.0; 3], Rotation([turn, -turn, 0.0, 0.0]));
        Self::fixed(vec![plane])
    }

    /// With its mass centre at `position`.
    #[must_use]
    pub fn at(self, position: Vec3) -> Self {
        Self { position, ..self }
    }

    /// With this orientation.
    #[must_use]
    pub fn turned(self, rotation: Rotation) -> Self {
        Self { rotation, ..self }
    }

    /// With these velocities, both in the world frame.
    #[must_use]
    pub fn moving(self, velocity: Vec3, angular_velocity: Vec3) -> Self {
        Self { velocity, angular_velocity, ..self }
    }

    /// With all its parts of this material.
    #[must_use]
    pub fn of(mut self, material: usize) -> Self {
        self.parts.iter_mut().for_each(|p| p.material = material);
        self
    }

    /// Whether forces and contacts move it.
    pub fn is_free(&self) -> bool {
        self.motion == Motion::Free
    }
}

/// The law of contact between two materials.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Law {
    /// Coefficient of friction, at least 0.
    pub mu: f64,
    /// Coefficient of restitution, from 0 to 1.
    pub e: f64,
    /// Tangential coefficient of restitution, in (−1, 1]; with Newton's law energy may grow where it is not 0.
    pub e_t: f64,
    /// Coefficient of rolling friction, m, at least 0: how far off the point of contact the normal force may act.
    pub mu_r: f64,
}

impl Law {
    /// Friction alone.
    pub fn friction(mu: f64) -> Self {
        Self { mu, ..Self::default() }
    }

    pub(crate) fn validate(&self, key: &str) -> Result<(), SimulateError> {
        let Self { mu, e, e_t, mu_r } = *self;
        require(|| format!("{key}.mu_r"), mu_r, mu_r >= 0.0, "a length of at least 0")?;
        require(|| format!("{key}.mu"), mu, mu >= 0.0, "a coefficient of at least 0")?;
        require(|| format!("{key}.e"), e, (0.0..=1.0).contains(&e), "a coefficient from 0 to 1")?;
        let allowed = -1.0 < e_t && e_t <= 1.0;
        require(|| format!("{key}.e_t"), e_t, allowed, "a coefficient above -1 and at most 1")
    }
}

/// A contact that gives way, by Kelvin and Voigt's law: `r_N = h (−k g⁺ − d u_N⁺)₊` with `g⁺ = g + h u_N⁺`, which is
///
/// ```text
/// 0 ≤ r_N ⟂ u_N + c r_N + k g/(d + h k) ≥ 0,     c = 1/(h (d + h k)):
/// ```
///
/// a diagonal on W and a term in q. Friction as before. Implicit: stable for every stiffness and step, and of first order.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Compliance {
    /// k of each contact point, N/m.
    pub stiffness: f64,
    /// d of each contact point, N·s/m.
    pub damping: f64,
}

impl Compliance {
    /// Errors: a stiffness, a damping or a restitution that contacts which give way cannot have, of the law at `key`.
    pub(crate) fn validate(self, key: &str, e: f64) -> Result<(), SimulateError> {
        let Self { stiffness, damping } = self;
        let at = |field: &str| format!("{key}.{field}");
        require(|| at("compliance.stiffness"), stiffness, stiffness > 0.0, "a positive number")?;
        require(|| at("compliance.damping"), damping, damping >= 0.0, "a number of at least 0")?;
        require(|| at("e"), e, e == 0.0, "0 where contacts have a compliance")
    }
}

/// How many directions there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dimension {
    /// Bodies move in the plane of the first two axes and turn about the third: three degrees of freedom each, contacts with one tangent.
    Two,
    /// Space.
    #[default]
    Three,
}

/// Bodies, materials and gravity.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// Space or a plane.
    pub dimension: Dimension,
    /// All bodies; a [`BodyId`] is a place here.
    pub bodies: Vec<Body>,
    /// Acceleration of gravity, m/s².
    pub gravity: Vec3,
    /// The law where no other is given for two materials.
    pub law: Law,
    materials: Vec<String>,
    pairs: BTreeMap<(usize, usize), Law>,
    compliances: BTreeMap<(usize, usize), Compliance>,
    apart: BTreeSet<(BodyId, BodyId)>,
    /// Elastic solids, whose [`BodyId`]s go on where those of the bodies end.
    pub elastic: Vec<Elastic>,
    /// All joints; a [`JointId`] is a place here.
    pub joints: Vec<Joint>,
    /// Couplings of their coordinates.
    pub couplings: Vec<Coupling>,
    /// How the world repeats itself, if it does.
    pub periodic: Periodic,
}

impl Default for World {
    fn default() -> Self {
        Self::new([0.0, 0.0, -9.81])
    }
}

impl World {
    /// An empty world, frictionless and without restitution.
    pub fn new(gravity: Vec3) -> Self {
        Self {
            dimension: Dimension::Three,
            bodies: vec![],
            gravity,
            law: Law::default(),
            materials: vec!["default".into()],
            pairs: BTreeMap::new(),
            compliances: BTreeMap::new(),
            apart: BTreeSet::new(),
            elastic: vec![],
            joints: vec![],
            couplings: vec![],
            periodic: Periodic::default(),
        }
    }

    /// An empty world in the plane. Places and velocities have zero as their third component, axes of rotations and torques that alone.
    pub fn in_plane([x, y]: [f64; 2]) -> Self {
        Self { dimension: Dimension::Two, ..Self::new([x, y, 0.0]) }
    }

    /// With this law between all materials that have no other.
    #[must_use]
    pub fn with_law(self, law: Law) -> Self {
        Self { law, ..self }
    }

    /// Repeating itself.
    #[must_use]
    pub fn repeating(self, periodic: Periodic) -> Self {
        Self { periodic, ..self }
    }

    /// Adds a body.
    pub fn add(&mut self, body: Body) -> BodyId {
        self.bodies.push(body);
        BodyId(self.bodies.len() as u32 - 1)
    }

    /// Adds an elastic solid.
    pub fn add_elastic(&mut self, solid: Elastic) {
        self.elastic.push(solid);
    }

    /// Adds a joint; its partners do not touch each other unless it says so.
    pub fn join(&mut self, joint: Joint) -> JointId {
        if let (Some(a), false) = (joint.a, joint.collide) {
            self.keep_apart(a, joint.b);
        }
        self.joints.push(joint);
        JointId(self.joints.len() as u32 - 1)
    }

    /// The number of the material of this name, which is made where there is none.
    pub fn material(&mut self, name: &str) -> usize {
        self.materials.iter().position(|m| m == name).unwrap_or_else(|| {
            self.materials.push(name.into());
            self.materials.len() - 1
        })
    }

    /// The names of the materials.
    pub fn materials(&self) -> &[String] {
        &self.materials
    }

    /// The energy of the weights of free bodies, J, zero at the origin.
    pub(crate) fn potential(&self, state: &State) -> f64 {
        let free = self.bodies.iter().zip(&state.position).filter(|(b, _)| b.is_free());
        -free.map(|(b, x)| b.mass * dot(self.gravity, *x)).sum::<f64>()
    }

    /// The same bodies and joints without anything that moves them: for what concerns positions alone.
    pub(crate) fn at_rest(&self) -> Self {
        let mut rest = Self { gravity: [0.0; 3], ..self.clone() };
        for body in &mut rest.bodies {
            (body.force, body.torque) = ([0.0; 3], [0.0; 3]);
            // Not fixed: the state moves it, and what is fixed is put in its place once.
            if !matches!(body.motion, Motion::Free | Motion::Fixed) {
                body.motion = Motion::Surface { linear: [0.0; 3], angular: [0.0; 3] };
            }
        }
        for drive in rest.joints.iter_mut().flat_map(|joint| &mut joint.drives) {
            let Drive { coordinate, limits, driver, .. } = *drive;
            let driver = driver.map(|_| Driver::default());
            *drive = Drive { limits, driver, ..Drive::along(coordinate) };
        }
        rest
    }

    /// Gives two materials, which may be the same, a law of their own.
    pub fn pair(&mut self, a: usize, b: usize, law: Law) {
        self.pairs.insert((a.min(b), a.max(b)), law);
    }

    /// Lets contacts of two materials give way. They have no restitution: their rebound is that of the spring.
    pub fn comply(&mut self, a: usize, b: usize, compliance: Compliance) {
        self.compliances.insert((a.min(b), a.max(b)), compliance);
    }

    /// How contacts of two materials give way, if they do.
    pub fn compliance_between(&self, a: usize, b: usize) -> Option<Compliance> {
        self.compliances.get(&(a.min(b), a.max(b))).copied()
    }

    /// The law between two materials.
    pub fn law_between(&self, a: usize, b: usize) -> Law {
        self.pairs.get(&(a.min(b), a.max(b))).copied().unwrap_or(self.law)
    }

    /// All laws by their places in messages.
    pub(crate) fn laws(&self) -> impl Iterator<Item = (String, Law)> + '_ {
        let own = self.pairs.iter().map(|(&(a, b), law)| (self.pair_place(a, b), *law));
        std::iter::once(("law".into(), self.law)).chain(own)
    }

    /// Where messages find the law between two materials.
    pub(crate) fn law_place(&self, a: usize, b: usize) -> String {
        match self.pairs.contains_key(&(a.min(b), a.max(b))) {
            true => self.pair_place(a, b),
            false => "law".into(),
        }
    }

    fn pair_place(&self, a: usize, b: usize) -> String {
        let name = |k: usize| self.materials.get(k).map_or("?", String::as_str);
        format!("pairs[{}, {}]", name(a.min(b)), name(a.max(b)))
    }

    /// Lets two bodies pass through each other: partners of a joint. In a [periodic](Periodic) world images of them still touch.
    pub fn keep_apart(&mut self, a: BodyId, b: BodyId) {
        self.apart.insert((a.min(b), a.max(b)));
    }

    /// Whether two bodies may touch.
    pub fn may_touch(&self, a: BodyId, b: BodyId) -> bool {
        self.may_meet(a, b) && !self.apart.contains(&(a.min(b), a.max(b)))
    }

    /// Whether they may by their groups.
    pub(crate) fn may_meet(&self, a: BodyId, b: BodyId) -> bool {
        let (p, q) = (&self.bodies[a.index()], &self.bodies[b.index()]);
        (p.is_free() || q.is_free())
            && p.membership & q.collides_with != 0
            && q.membership & p.collides_with != 0
    }

    /// What messages call a body.
    pub fn label(&self, body: usize) -> String {
        let (list, place, name) = match body.checked_sub(self.bodies.len()) {
            None => ("bodies", body, &self.bodies[body].name),
            Some(k) => ("elastic", k, &self.elastic[k].name),
        };
        match name.as_str() {
            "" => format!("{list}[{place}]"),
            name => format!("`{name}`"),
        }
    }

    /// Checks every value and makes quaternions that are nearly of length one exactly so; returns what it changed, in words.
    ///
    /// Errors: the first value that is not possible, by its place: masses that are not positive, inertia that no solid has (it must be symmetric, positive
    /// and satisfy the triangle inequality), quaternions whose squared length is off by more than 1e-3, a plane that moves freely, a material that does not exist.
    pub fn validate(&mut self) -> Result<Vec<String>, SimulateError> {
        let mut said = vec![];
        finite(|| "gravity".into(), &self.gravity)?;
        self.law.validate("law")?;
        let count = self.materials.len();
        for (&(a, b), law) in &self.pairs {
            let key = self.pair_place(a, b);
            if b >= count {
                let expected = format!("two of the {count} materials");
                return Err(SimulateError::value(key, expected, format!("{a} and {b}")));
            }
            law.validate(&key)?;
        }
        for (&(a, b), compliance) in &self.compliances {
            let key = self.pair_place(a, b);
            compliance.validate(&key, self.law_between(a, b).e)?;
        }
        for (k, body) in self.bodies.iter_mut().enumerate() {
            body.validate(&entry("bodies", k, &body.name), count, &mut said)?;
        }
        for (k, solid) in self.elastic.iter().enumerate() {
            solid.validate(&entry("elastic", k, &solid.name), self)?;
        }
        for (k, joint) in self.joints.iter().enumerate() {
            joint.validate(&entry("joints", k, &joint.name), self)?;
        }
        for (k, coupling) in self.couplings.iter().enumerate() {
            coupling.validate(&entry("couplings", k, &coupling.name), self)?;
        }
        planar::validate(self)?;
        Periodic::validate(self)?;
        Ok(said)
    }
}

/// The place of an entry in messages, with its name if it has one.
pub(crate) fn entry(list: &str, k: usize, name: &str) -> String {
    match name {
        "" => format!("{list}[{k}]"),
        name => format!("{list}[{k}] ({name})"),
    }
}

impl Body {
    fn validate(
        &mut self,
        key: &str,
        materials: usize,
        said: &mut Vec<String>,
    ) -> Result<(), SimulateError> {
        for (name, x) in [
            ("position", self.position),
            ("velocity", self.velocity),
            ("angular_velocity", self.angular_velocity),
            ("force", self.force),
            ("torque", self.torque),
        ] {
            finite(|| format!("{key}.{name}"), &x)?;
        }
        unit_quaternion(&format!("{key}.rotation"), &mut self.rotation, said)?;
        match self.motion {
            Motion::Free => {
                let mass = self.mass;
                require(|| format!("{key}.mass"), mass, mass > 0.0, "a positive number")?;
                inertia(&format!("{key}.inertia"), &mut self.inertia)?;
            }
            Motion::Fixed => {}
            Motion::Surface { linear, angular } => {
                finite(|| format!("{key}.motion.linear"), &linear)?;
                finite(|| format!("{key}.motion.angular"), &angular)?;
            }
            Motion::Uniform { velocity } => {
                finite(|| format!("{key}.motion.velocity"), &velocity)?;
            }
            Motion::Oscillating { amplitude, frequency, phase } => {
                finite(|| format!("{key}.motion.amplitude"), &amplitude)?;
                finite(|| format!("{key}.motion.frequency"), &[frequency, phase])?;
            }
        }
        for (s, part) in self.parts.iter_mut().enumerate() {
            let key = format!("{key}.parts[{s}]");
            part.shape.validate(&key)?;
            finite(|| format!("{key}.position"), &part.position)?;
            unit_quaternion(&format!("{key}.rotation"), &mut part.rotation, said)?;
            if part.material >= materials {
                let expected = format!("one of the {materials} materials");
                return Err(SimulateError::value(
                    format!("{key}.material"),
                    expected,
                    part.material,
                ));
            }
            if part.shape == Shape::Plane && self.motion == Motion::Free {
                let expected = "a solid: a plane cannot move freely";
                return Err(SimulateError::value(format!("{key}.shape"), expected, "a plane"));
            }
        }
        Ok(())
    }
}

fn unit_quaternion(
    key: &str,
    q: &mut Rotation,
    said: &mut Vec<String>,
) -> Result<(), SimulateError> {
    let square = q.0.iter().map(|x| x * x).sum::<f64>();
    let off = (square - 1.0).abs();
    if off.is_nan() || off >= 1e-3 {
        return Err(SimulateError::value(
            key,
            "a unit quaternion [w, x, y, z]",
            format!("{:?}", q.0),
        ));
    }
    if off > 1e-12 {
        said.push(format!(
            "{key}: a quaternion of squared length {square} was made one of length 1"
        ));
    }
    if off > 0.0 {
        *q = unit(*q);
    }
    Ok(())
}

/// Symmetric, positive, and with `½ tr(J) I − J = ∫ x xᵀ` positive semidefinite: the triangle inequality of the principal moments.
fn inertia(key: &str, j: &mut Mat3) -> Result<(), SimulateError> {
    let bad = |expected: &str, j: &Mat3| Err(SimulateError::value(key, expected, format!("{j:?}")));
    let trace = j[0][0] + j[1][1] + j[2][2];
    let tiny = 1e-9 * trace.abs();
    let skew = (0..3).map(|k| (j[k][(k + 1) % 3] - j[(k + 1) % 3][k]).abs()).fold(0.0, f64::max);
    if !j.iter().flatten().all(|x| x.is_finite()) {
        return bad("finite components", j);
    }
    if skew > tiny {
        return bad("a symmetric matrix", j);
    }
    for k in 0..3 {
        for l in 0..k {
            let mean = 0.5 * (j[k][l] + j[l][k]);
            (j[k][l], j[l][k]) = (mean, mean);
        }
    }
    let least = |a: &Mat3, slack: f64| {
        let minor = |k: usize, l: usize| a[k][k] * a[l][l] - a[k][l] * a[k][l];
        let det = dot(a[0], scenes::vec3::cross(a[1], a[2]));
        (0..3).all(|k| a[k][k] > -slack)
            && [(0, 1), (1, 2), (0, 2)].iter().all(|&(k, l)| minor(k, l) > -slack * trace)
            && det > -slack * trace * trace
    };
    if !least(j, 0.0) {
        return bad("a positive definite matrix", j);
    }
    let mut second: Mat3 = j.map(|row| row.map(|x| -x));
    (0..3).for_each(|k| second[k][k] += 0.5 * trace);
    if !least(&second, tiny.max(f64::MIN_POSITIVE)) {
        return bad("an inertia whose principal moments satisfy the triangle inequality", j);
    }
    Ok(())
}

/// Two planes are one where their normals and offsets differ by less than this share of the scene.
const SAME_PLANE: f64 = 1e-6;

impl TryFrom<&Scene> for World {
    type Error = SimulateError;

    /// The rigid bodies and elastic solids of a scene, its ground and obstacles fixed, gravity, and the law of its contacts. Contacts with the ground that neither the
    /// ground nor an obstacle explains are with walls, which become planes; a wall that moves keeps its velocity. Periods stay.
    ///
    /// Errors: images of bodies where the scene has no periods; contacts of different laws; elastic solids with rolling friction, once the world is validated.
    fn try_from(scene: &Scene) -> Result<Self, SimulateError> {
        scene.validate()?;
        let law = scene.contacts.first().map_or(Law::default(), |c| Law {
            mu: c.mu,
            e: c.e,
            e_t: 0.0,
            mu_r: c.mu_r,
        });
        for (k, c) in scene.contacts.iter().enumerate() {
            if (c.mu, c.e, c.mu_r) != (law.mu, law.e, law.mu_r) {
                let told =
                    |mu: f64, e: f64, mu_r: f64| format!("mu = {mu}, e = {e} and mu_r = {mu_r}");
                let expected = told(law.mu, law.e, law.mu_r) + " as of contacts[0]";
                let found = told(c.mu, c.e, c.mu_r);
                return Err(SimulateError::value(format!("contacts[{k}]"), expected, found));
            }
            if c.a.is_some() && c.image != scenes::Image::default() && scene.periods.is_empty() {
                let expected = "no images, for the scene has no periods";
                return Err(SimulateError::value(format!("contacts[{k}].image"), expected, "one"));
            }
        }
        let mut world = World::new(scene.gravity).with_law(law);
        let period = |p: &scenes::Image| Period { vector: p.offset, velocity: p.velocity };
        world.periodic.periods = scene.periods.iter().map(period).collect();
        for body in &scene.bodies {
            world.add(Body {
                mass: body.mass,
                inertia: body.inertia,
                position: body.position,
                rotation: body.rotation,
                velocity: body.velocity,
                angular_velocity: body.angular_velocity,
                force: body.force,
                ..Body::bare(Motion::Free, parts(&body.shape))
            });
        }
        for solid in &scene.solids {
            world.add_elastic(Elastic::new(solid.clone()));
        }
        for (k, obstacle) in scene.obstacles.iter().enumerate() {
            let body = Body::fixed(parts(&obstacle.shape)).at(obstacle.position);
            world.add(body.named(format!("obstacle {k}")));
        }
        let mut planes: Vec<(Vec3, Vec3, Vec3)> = vec![];
        if let Some(ground) = &scene.ground {
            planes.push((ground.point, ground.normal, [0.0; 3]));
        }
        let grounds = planes.len();
        let cells = scene.solids.iter().flat_map(ElasticBox::cell);
        let sizes = scene.bodies.iter().map(|b| b.shape.radius()).chain(cells);
        let size = sizes.fold(0.0, f64::max);
        for c in scene.contacts.iter().filter(|c| c.a.is_none()) {
            let n = c.frame()[0];
            let on_plane = |&(p, m, v): &(Vec3, Vec3, Vec3)| {
                dot(n, m) > 1.0 - SAME_PLANE
                    && dot(m, sub(c.point, p)).abs() < 0.1 * size
                    && v == c.image.velocity
            };
            let on_obstacle =
                scene.obstacles.iter().any(|o| touches(o, (c.point, n), SAME_PLANE * size));
            if on_obstacle {
                continue;
            }
            // A contact may be some gap away from its wall; no body is behind it.
            let known = planes.iter().position(on_plane).unwrap_or_else(|| {
                planes.push((c.point, n, c.image.velocity));
                planes.len() - 1
            });
            let (point, m, _) = &mut planes[known];
            let low = match c.b.checked_sub(scene.bodies.len()) {
                None => lowest(&scene.bodies[c.b], *m),
                Some(solid) => {
                    let heights = scene.solids[solid].places().map(|x| dot(*m, x));
                    heights.fold(f64::INFINITY, f64::min)
                }
            };
            let behind = low - dot(*m, *point);
            if known >= grounds && behind < 0.0 {
                *point = add(*point, scale(behind, *m));
            }
        }
        for (k, (point, normal, velocity)) in planes.into_iter().enumerate() {
            let body = Body::fixed(vec![plane(point, normal)?]).named(format!("plane {k}"));
            let motion = match (velocity == [0.0; 3], dot(velocity, normal) == 0.0) {
                (true, _) => Motion::Fixed,
                (_, true) => Motion::Surface { linear: velocity, angular: [0.0; 3] },
                (_, false) => Motion::Uniform { velocity },
            };
            world.add(Body { motion, ..body });
        }
        Ok(world)
    }
}

/// The least `n · x` of the points x of a body.
fn lowest(body: &scenes::RigidBody, n: Vec3) -> f64 {
    let of = |p: &Polyhedron| {
        let heights = p.vertices().iter().map(|&v| dot(n, body.to_world(v)));
        heights.fold(f64::INFINITY, f64::min)
    };
    match &body.shape {
        scenes::Shape::Sphere { radius } => dot(n, body.position) - radius,
        scenes::Shape::Box { half } => {
            let r = body.rotation.matrix();
            let along = |k: usize| n[0] * r[0][k] + n[1] * r[1][k] + n[2] * r[2][k];
            dot(n, body.position) - (0..3).map(|k| (along(k) * half[k]).abs()).sum::<f64>()
        }
        scenes::Shape::Polyhedron(p) => of(p),
        scenes::Shape::Compound(parts) => parts.iter().map(of).fold(f64::INFINITY, f64::min),
    }
}

/// The parts of a shape of a scene.
fn parts(shape: &scenes::Shape) -> Vec<Part> {
    match shape {
        scenes::Shape::Box { half } => vec![Part::new(Shape::Box { half: *half })],
        scenes::Shape::Sphere { radius } => vec![Part::new(Shape::Sphere { radius: *radius })],
        scenes::Shape::Polyhedron(p) => vec![Part::new(p.clone())],
        scenes::Shape::Compound(parts) => parts.iter().cloned().map(Part::new).collect(),
    }
}

/// A contact with a ball may be this share of its radius away from it.
const BESIDE: f64 = 0.1;

/// Whether a contact of this point and normal is on, or within `slack` of, an obstacle; or beside a ball, along its radius.
fn touches(obstacle: &scenes::Obstacle, (point, normal): (Vec3, Vec3), slack: f64) -> bool {
    let p = sub(point, obstacle.position);
    let inside = |q: &scenes::Polyhedron| {
        (0..q.faces().len()).all(|k| {
            let (n, d) = q.plane(k);
            dot(n, p) - d <= slack
        })
    };
    match &obstacle.shape {
        scenes::Shape::Box { half } => (0..3).all(|k| p[k].abs() <= half[k] + slack),
        scenes::Shape::Sphere { radius } => {
            let far = norm(p);
            let radial = dot(normal, p) >= (1.0 - SAME_PLANE) * far;
            far <= radius + slack || (radial && far <= (1.0 + BESIDE) * radius)
        }
        scenes::Shape::Polyhedron(q) => inside(q),
        scenes::Shape::Compound(parts) => parts.iter().any(inside),
    }
}

impl From<scenes::Polyhedron> for Part {
    fn from(polyhedron: scenes::Polyhedron) -> Self {
        Part::new(polyhedron)
    }
}

/// `amplitude sin(frequency t + phase)` and its rate.
pub(crate) fn oscillation(amplitude: Vec3, frequency: f64, phase: f64, t: f64) -> (Vec3, Vec3) {
    let (s, c) = (frequency * t + phase).sin_cos();
    (scale(s, amplitude), scale(frequency * c, amplitude))
}
