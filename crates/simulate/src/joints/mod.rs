//! Joints between two bodies, or a body and the world; what acts along their coordinates; couplings of coordinates.
//!
//! A joint holds two frames, one on a and one on b, that coincide at the initial configuration (their third axis is the axis of the joint). With d from
//! the origin of the first to that of the second, a1 a2 a3 and b1 b2 b3 their axes:
//!
//! | joint | equations | free |
//! | --- | --- | --- |
//! | fixed | d = 0; a1·b2 = a2·b3 = a3·b1 = 0 | |
//! | revolute | d = 0; a1·b3 = a2·b3 = 0 | angle |
//! | prismatic | a1·d = a2·d = 0; a1·b2 = a2·b3 = a3·b1 = 0 | slide |
//! | cylindrical | a1·d = a2·d = 0; a1·b3 = a2·b3 = 0 | angle, slide |
//! | screw, pitch p | the same; slide − p angle = 0 | angle |
//! | spherical | d = 0 | three angles |
//! | universal | d = 0; a1·b2 = 0 | two angles |
//! | planar | a3·d = 0; a1·b3 = a2·b3 = 0 | two slides, angle |
//! | point on line | a1·d = a2·d = 0 | slide, three angles |
//! | point on plane | a3·d = 0 | two slides, three angles |
//! | distance | (d·d − L²)/(2 L) = 0 | five |
//!
//! Redundant equations are allowed: the motion is then unique and the impulses of the joints are not.

mod equations;
mod projection;
mod rows;

pub(crate) use rows::Joints;

use nonsmooth_scenes::vec3::{Vec3, cross, dot, norm, scale, sub};

use crate::error::{finite, require};
use crate::{BodyId, SimulateError, World};

/// The number of a joint; never used again for another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JointId(pub u32);

impl JointId {
    /// Its place among [`World::joints`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What a joint leaves free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointKind {
    /// Nothing: a weld.
    Fixed,
    /// A turn about the axis.
    Revolute,
    /// A slide along the axis.
    Prismatic,
    /// Both.
    Cylindrical,
    /// Both, one proportional to the other.
    Screw {
        /// The slide per angle, m/rad.
        pitch: f64,
    },
    /// Every turn about the anchor.
    Spherical,
    /// A turn about the axis on a and one about the reference direction on b: Cardan's joint.
    Universal,
    /// Slides across the axis and a turn about it.
    Planar,
    /// Every turn, and a slide along the axis.
    PointOnLine,
    /// Every turn, and slides across the axis.
    PointOnPlane,
    /// All but the distance of two anchors: a rod without mass.
    Distance,
}

impl JointKind {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Revolute => "revolute",
            Self::Prismatic => "prismatic",
            Self::Cylindrical => "cylindrical",
            Self::Screw { .. } => "screw",
            Self::Spherical => "spherical",
            Self::Universal => "universal",
            Self::Planar => "planar",
            Self::PointOnLine => "point_on_line",
            Self::PointOnPlane => "point_on_plane",
            Self::Distance => "distance",
        }
    }

    /// Whether motors, limits and the like may act along a coordinate of it.
    pub fn has(self, coordinate: Coordinate) -> bool {
        match self {
            Self::Cylindrical | Self::Screw { .. } => true,
            Self::Revolute => coordinate == Coordinate::Angle,
            Self::Prismatic | Self::PointOnLine => coordinate == Coordinate::Slide,
            _ => false,
        }
    }
}

/// A coordinate of a joint, zero at the initial configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Coordinate {
    /// By which b has turned about the axis against a, rad; it goes on beyond a full turn.
    Angle,
    /// By which b has moved along the axis against a, m.
    Slide,
}

impl Coordinate {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Slide => "slide",
        }
    }
}

/// How far a coordinate may go: a unilateral row, `0 ≤ λ ⟂ u⁺ + e u⁻ ≥ 0`, at each end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// rad or m; −∞ for none.
    pub lower: f64,
    /// rad or m, at least the lower one; ∞ for none.
    pub upper: f64,
    /// Coefficient of restitution.
    pub e: f64,
}

/// A spring with a damper, taken implicitly: stable for every stiffness and step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spring {
    /// N/m or N·m/rad.
    pub stiffness: f64,
    /// N·s/m or N·m·s/rad.
    pub damping: f64,
    /// Where it is without force, m or rad.
    pub rest: f64,
}

/// What drives a coordinate, with a bounded force or torque: a row with bounds `−h max ≤ λ ≤ h max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motor {
    /// To a velocity.
    Velocity {
        /// m/s or rad/s.
        velocity: f64,
        /// N or N·m; ∞ allowed.
        max: f64,
    },
    /// To a position, by a spring and a damper that are taken implicitly: PD control.
    Position {
        /// What it pulls with; `rest` is the target.
        spring: Spring,
        /// N or N·m; ∞ allowed.
        max: f64,
    },
}

/// A motion along a coordinate that is given: `s(t) = velocity t + amplitude (sin(frequency t + phase) − sin(phase))`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Driver {
    /// m/s or rad/s.
    pub velocity: f64,
    /// m or rad.
    pub amplitude: f64,
    /// rad/s.
    pub frequency: f64,
    /// rad.
    pub phase: f64,
}

impl Driver {
    /// s(t).
    pub fn at(&self, t: f64) -> f64 {
        let Self { velocity, amplitude, frequency, phase } = *self;
        velocity * t + amplitude * ((frequency * t + phase).sin() - phase.sin())
    }

    /// s'(t).
    pub fn rate(&self, t: f64) -> f64 {
        let Self { velocity, amplitude, frequency, phase } = *self;
        velocity + amplitude * frequency * (frequency * t + phase).cos()
    }
}

/// What acts along a coordinate of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Along which.
    pub coordinate: Coordinate,
    /// How far it may go.
    pub limits: Option<JointLimits>,
    /// A spring and a damper.
    pub spring: Option<Spring>,
    /// Dry friction, N or N·m: a relay, `−h friction ≤ λ ≤ h friction`.
    pub friction: f64,
    /// A motor.
    pub motor: Option<Motor>,
    /// A motion that is given.
    pub driver: Option<Driver>,
}

impl Drive {
    /// Nothing yet.
    pub fn along(coordinate: Coordinate) -> Self {
        Self { coordinate, limits: None, spring: None, friction: 0.0, motor: None, driver: None }
    }
}

/// A joint. Anchors and axes are in the world frame, at the initial configuration of the bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// What messages and files call it; may be empty.
    pub name: String,
    /// What it leaves free.
    pub kind: JointKind,
    /// The first body; without one, the world.
    pub a: Option<BodyId>,
    /// The second one.
    pub b: BodyId,
    /// The origins of the two frames, m; the same but for [`JointKind::Distance`].
    pub anchors: [Vec3; 2],
    /// The axis, of any length.
    pub axis: Vec3,
    /// The first axis of both frames, the part of it across the axis; of a universal joint the axis on b, across the one on a. Without one, any.
    pub reference: Option<Vec3>,
    /// Whether the two bodies may touch each other.
    pub collide: bool,
    /// Whether impulse and moment are told on a, or the world, and about the anchor there, in place of b.
    pub on_a: bool,
    /// What acts along its coordinates.
    pub drives: Vec<Drive>,
}

impl Joint {
    /// Of this kind, at `anchor`, along the third axis of the world.
    pub fn new(kind: JointKind, a: Option<BodyId>, b: BodyId, anchor: Vec3) -> Self {
        Self {
            name: String::new(),
            kind,
            a,
            b,
            anchors: [anchor; 2],
            axis: [0.0, 0.0, 1.0],
            reference: None,
            collide: false,
            on_a: false,
            drives: vec![],
        }
    }

    /// A turn about an axis.
    pub fn revolute(a: Option<BodyId>, b: BodyId, anchor: Vec3, axis: Vec3) -> Self {
        Self { axis, ..Self::new(JointKind::Revolute, a, b, anchor) }
    }

    /// A slide along an axis.
    pub fn prismatic(a: Option<BodyId>, b: BodyId, anchor: Vec3, axis: Vec3) -> Self {
        Self { axis, ..Self::new(JointKind::Prismatic, a, b, anchor) }
    }

    /// A ball in a socket.
    pub fn spherical(a: Option<BodyId>, b: BodyId, anchor: Vec3) -> Self {
        Self::new(JointKind::Spherical, a, b, anchor)
    }

    /// A weld.
    pub fn fixed(a: Option<BodyId>, b: BodyId, anchor: Vec3) -> Self {
        Self::new(JointKind::Fixed, a, b, anchor)
    }

    /// A rod without mass between a point of a and one of b.
    pub fn distance(a: Option<BodyId>, b: BodyId, anchors: [Vec3; 2]) -> Self {
        Self { anchors, ..Self::new(JointKind::Distance, a, b, anchors[0]) }
    }

    /// With this name.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// With this axis.
    #[must_use]
    pub fn along(self, axis: Vec3) -> Self {
        Self { axis, ..self }
    }

    /// With what acts along one of its coordinates.
    #[must_use]
    pub fn driven(mut self, drive: Drive) -> Self {
        self.drives.push(drive);
        self
    }

    /// The three axes of both frames, in the world at the initial configuration; none where the axes are no directions or do not fit.
    pub(crate) fn frame(&self) -> Option<[Vec3; 3]> {
        let unit = |v: Vec3| {
            let length = norm(v);
            (length > 0.0 && length.is_finite()).then(|| scale(1.0 / length, v))
        };
        let axis = unit(self.axis)?;
        let across = |v: Vec3| sub(v, scale(dot(v, axis), axis));
        let least = (0..3).min_by(|&i, &k| axis[i].abs().total_cmp(&axis[k].abs()))?;
        let mut any = [0.0; 3];
        any[least] = 1.0;
        let reference = match self.reference {
            Some(r) => unit(r).map(across).filter(|r| norm(*r) > 1e-6)?,
            None => across(any),
        };
        let first = unit(reference)?;
        Some(match self.kind {
            JointKind::Universal => {
                // a1 is the axis on a, b2 the one on b.
                if self.reference.is_some_and(|r| dot(unit(r).unwrap_or(r), axis).abs() > 1e-9) {
                    return None;
                }
                [axis, first, cross(axis, first)]
            }
            _ => [first, cross(axis, first), axis],
        })
    }

    pub(crate) fn validate(&self, key: &str, world: &World) -> Result<(), SimulateError> {
        let bodies = world.bodies.len();
        for (name, body) in [("a", self.a), ("b", Some(self.b))] {
            if let Some(body) = body.filter(|b| b.index() >= bodies) {
                let expected = format!("one of {bodies} bodies");
                return Err(SimulateError::value(format!("{key}.{name}"), expected, body.0));
            }
        }
        if self.a == Some(self.b) {
            return Err(SimulateError::value(
                format!("{key}.b"),
                "another body than a",
                "the same",
            ));
        }
        let free = |b: BodyId| world.bodies[b.index()].is_free();
        if !free(self.b) && !self.a.is_some_and(free) {
            let expected = "a body that moves freely on one side";
            return Err(SimulateError::value(key, expected, "none"));
        }
        for anchor in &self.anchors {
            finite(|| format!("{key}.anchor"), anchor)?;
        }
        finite(|| format!("{key}.axis"), &self.axis)?;
        if self.frame().is_none() {
            let expected = match self.kind {
                JointKind::Universal => "two directions at right angles, axis and reference",
                _ => "a direction, and a reference across it",
            };
            let found = match self.reference {
                Some(reference) => format!("{:?} and {reference:?}", self.axis),
                None => format!("{:?}", self.axis),
            };
            return Err(SimulateError::value(format!("{key}.axis"), expected, found));
        }
        if let JointKind::Screw { pitch } = self.kind {
            require(|| format!("{key}.pitch"), pitch, pitch.is_finite(), "a finite number")?;
        }
        if self.kind == JointKind::Distance {
            let length = norm(sub(self.anchors[1], self.anchors[0]));
            let expected = "two anchors that are apart";
            require(|| format!("{key}.anchor_b"), length, length > 0.0, expected)?;
        }
        for drive in &self.drives {
            let name = drive.coordinate.name();
            if !self.kind.has(drive.coordinate) {
                let expected = format!("no {name} of a {} joint", self.kind.name());
                return Err(SimulateError::value(format!("{key}.{name}"), expected, "one"));
            }
            drive.validate(&format!("{key}.{name}"))?;
        }
        self.is_driven_once(key)
    }

    /// Whether no coordinate is forced to two velocities at once, which no impulse can do. A screw has one coordinate under two names.
    fn is_driven_once(&self, key: &str) -> Result<(), SimulateError> {
        let mut motions = self.drives.iter().filter(|drive| drive.driver.is_some());
        let motors = self.drives.iter().filter_map(|drive| match drive.motor {
            Some(Motor::Velocity { max, .. }) if max == f64::INFINITY => Some(drive.coordinate),
            _ => None,
        });
        let screw = matches!(self.kind, JointKind::Screw { .. });
        let clash = motions.find_map(|motion| {
            let same = |c: &Coordinate| screw || *c == motion.coordinate;
            motors.clone().find(same)
        });
        match clash {
            None => Ok(()),
            Some(coordinate) => {
                let key = format!("{key}.{}.motor.max", coordinate.name());
                let expected = "a bound, for the coordinate has a motion that is given";
                Err(SimulateError::value(key, expected, f64::INFINITY))
            }
        }
    }
}

impl Drive {
    fn validate(&self, key: &str) -> Result<(), SimulateError> {
        let some = "a number of at least 0";
        let at = |name: &'static str| move || format!("{key}.{name}");
        if let Some(JointLimits { lower, upper, e }) = self.limits {
            // A limit at infinity is none, on its own side.
            let wrong = |name, expected, x: f64| Err(SimulateError::value(at(name)(), expected, x));
            if lower.is_nan() || lower == f64::INFINITY {
                return wrong("limits.lower", "a number, or -inf for none", lower);
            }
            if upper.is_nan() || upper == f64::NEG_INFINITY {
                return wrong("limits.upper", "a number, or inf for none", upper);
            }
            if lower > upper {
                return wrong("limits.upper", "a number of at least the lower limit", upper);
            }
            let unit = (0.0..=1.0).contains(&e);
            require(at("limits.e"), e, unit, "a coefficient from 0 to 1")?;
        }
        let spring = |s: &Spring, name: &str| {
            let at = |field: &'static str| move || format!("{key}.{name}.{field}");
            require(at("stiffness"), s.stiffness, s.stiffness >= 0.0, some)?;
            require(at("damping"), s.damping, s.damping >= 0.0, some)?;
            finite(at("rest"), &[s.rest])
        };
        if let Some(s) = &self.spring {
            spring(s, "spring")?;
        }
        require(at("friction"), self.friction, self.friction >= 0.0, some)?;
        match self.motor {
            Some(Motor::Velocity { velocity, max }) => {
                finite(at("motor.velocity"), &[velocity])?;
                if max.is_nan() || max < 0.0 {
                    return Err(SimulateError::value(at("motor.max")(), some, max));
                }
            }
            Some(Motor::Position { spring: s, max }) => {
                spring(&s, "motor")?;
                if max.is_nan() || max < 0.0 {
                    return Err(SimulateError::value(at("motor.max")(), some, max));
                }
            }
            None => {}
        }
        match self.driver {
            Some(Driver { velocity, amplitude, frequency, phase }) => {
                finite(at("motion"), &[velocity, amplitude, frequency, phase])
            }
            None => Ok(()),
        }
    }
}

/// Coordinates whose weighted sum does not change, `Σ weight · coordinate = const`: gears, racks, pulleys.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Coupling {
    /// What messages and files call it; may be empty.
    pub name: String,
    /// Joint, coordinate, weight.
    pub terms: Vec<(JointId, Coordinate, f64)>,
}

impl Coupling {
    pub(crate) fn validate(&self, key: &str, world: &World) -> Result<(), SimulateError> {
        if self.terms.is_empty() {
            return Err(SimulateError::value(format!("{key}.terms"), "at least one", "none"));
        }
        for (k, &(joint, coordinate, weight)) in self.terms.iter().enumerate() {
            let key = format!("{key}.terms[{k}]");
            let Some(joint) = world.joints.get(joint.index()) else {
                let expected = format!("one of {} joints", world.joints.len());
                return Err(SimulateError::value(format!("{key}.joint"), expected, joint.0));
            };
            if !joint.kind.has(coordinate) {
                let expected = format!("a coordinate of a {} joint", joint.kind.name());
                let found = coordinate.name();
                return Err(SimulateError::value(format!("{key}.coordinate"), expected, found));
            }
            finite(|| format!("{key}.weight"), &[weight])?;
        }
        Ok(())
    }
}

/// What a joint did in the last step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointReport {
    /// Which.
    pub joint: JointId,
    /// By which b has turned about the axis after the step, rad; zero of joints without this coordinate.
    pub angle: f64,
    /// By which b has moved along the axis, m.
    pub slide: f64,
    /// The impulse of the joint on b, all its rows together, in the world frame, N·s. Where equations are redundant it is one of many. That of the step itself:
    /// what the projection of velocities adds at its end is not in it, O(h²), so that over h it is the load to first order.
    pub impulse: Vec3,
    /// Its moment on b about the anchor there, N·m·s.
    pub moment: Vec3,
    /// The most by which an equation is violated after the step, m or rad.
    pub violation: f64,
}
