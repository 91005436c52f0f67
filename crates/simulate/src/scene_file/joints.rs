//! From the joints of a file to those of a world.

use super::build::{twice, unknown};
use super::{
    CoordinateName, CouplingTable, DriveTable, DriverTable, JointName, JointTable, LimitsTable,
    MotorTable, SpringTable,
};
use crate::world::entry;
use crate::{
    BodyId, Coordinate, Coupling, Drive, Driver, Joint, JointId, JointKind, JointLimits, Motor,
    SimulateError, Spring, World,
};

/// The name of what is no body.
pub(super) const WORLD: &str = "world";

/// Adds the joints and couplings of a file to a world that has its bodies.
pub(super) fn join(
    world: &mut World,
    joints: &[JointTable],
    couplings: &[CouplingTable],
) -> Result<(), SimulateError> {
    for (k, table) in joints.iter().enumerate() {
        let key = entry("joints", k, &table.name);
        if !table.name.is_empty() && world.joints.iter().any(|j| j.name == table.name) {
            return Err(twice(&format!("{key}.name"), &table.name));
        }
        let joint = joint(table, world, &key)?;
        world.join(joint);
    }
    for (k, table) in couplings.iter().enumerate() {
        let coupling = coupling(table, world, &format!("couplings[{k}]"))?;
        world.couplings.push(coupling);
    }
    Ok(())
}

/// The key of the file where the world has that of a coordinate: what acts along the main one of a joint stands in the joint itself.
pub(super) fn in_file(joints: &[JointTable], key: String) -> String {
    for (k, table) in joints.iter().enumerate() {
        let entry = entry("joints", k, &table.name);
        let main = format!("{entry}.{}.", main(table.kind).name());
        if let Some(field) = key.strip_prefix(&main) {
            return format!("{entry}.{field}");
        }
    }
    key
}

/// The coordinate along which acts what stands in the joint itself.
fn main(kind: JointName) -> Coordinate {
    match kind {
        JointName::Prismatic | JointName::PointOnLine => Coordinate::Slide,
        _ => Coordinate::Angle,
    }
}

fn body(name: &str, world: &World, key: String) -> Result<Option<BodyId>, SimulateError> {
    if name == WORLD {
        return Ok(None);
    }
    let place = world.bodies.iter().position(|b| b.name == name && !name.is_empty());
    place.map(|k| Some(BodyId(k as u32))).ok_or_else(|| {
        let names = world.bodies.iter().map(|b| b.name.as_str()).filter(|n| !n.is_empty());
        unknown(&key, "body", name, names.chain([WORLD]))
    })
}

fn joint(table: &JointTable, world: &World, key: &str) -> Result<Joint, SimulateError> {
    let at = |name: &str| format!("{key}.{name}");
    let bodies = (body(&table.a, world, at("a"))?, body(&table.b, world, at("b"))?);
    let anchors = [table.anchor, table.anchor_b.unwrap_or(table.anchor)];
    // A joint has its second body: where that is the world, the two change places and the axis turns round. Reports are on the second of the file.
    let (a, b, anchors, axis, on_a) = match bodies {
        (a, Some(b)) => (a, b, anchors, table.axis, false),
        (Some(a), None) => (None, a, [anchors[1], anchors[0]], table.axis.map(|x| -x), true),
        (None, None) => {
            return Err(SimulateError::value(at("b"), "a body on one side", "`world` on both"));
        }
    };
    if on_a && matches!(table.kind, JointName::PointOnLine | JointName::PointOnPlane) {
        let expected = "the body whose point it is, for line and plane are fixed in a";
        return Err(SimulateError::value(at("b"), expected, "`world`"));
    }
    let (axis, reference) = match (table.kind, table.reference) {
        (JointName::Universal, Some(reference)) if on_a => (reference, Some(table.axis)),
        (_, reference) => (axis, reference),
    };
    if table.anchor_b.is_some() && table.kind != JointName::Distance {
        return Err(SimulateError::value(at("anchor_b"), "one of a `distance` only", "one"));
    }
    if table.anchor_b.is_none() && table.kind == JointName::Distance {
        return Err(SimulateError::value(at("anchor_b"), "the end on b of a `distance`", "none"));
    }
    let pitch = match (table.kind, table.pitch) {
        (JointName::Screw, Some(pitch)) => pitch,
        (JointName::Screw, None) => {
            return Err(SimulateError::value(at("pitch"), "the slide per angle, m/rad", "none"));
        }
        (_, Some(_)) => {
            return Err(SimulateError::value(at("pitch"), "one of a `screw` only", "one"));
        }
        (_, None) => 0.0,
    };
    let kind = match table.kind {
        JointName::Fixed => JointKind::Fixed,
        JointName::Revolute => JointKind::Revolute,
        JointName::Prismatic => JointKind::Prismatic,
        JointName::Cylindrical => JointKind::Cylindrical,
        JointName::Screw => JointKind::Screw { pitch },
        JointName::Spherical => JointKind::Spherical,
        JointName::Universal => JointKind::Universal,
        JointName::Planar => JointKind::Planar,
        JointName::PointOnLine => JointKind::PointOnLine,
        JointName::PointOnPlane => JointKind::PointOnPlane,
        JointName::Distance => JointKind::Distance,
    };
    let main = main(table.kind);
    let JointTable { limits, spring, friction, motor, motion, .. } = *table;
    let own = DriveTable { limits, spring, friction, motor, motion };
    let said = [
        ("limits", limits.is_some()),
        ("spring", spring.is_some()),
        ("friction", friction != 0.0),
        ("motor", motor.is_some()),
        ("motion", motion.is_some()),
    ];
    if let Some((name, _)) = said.iter().find(|(_, is)| *is && !kind.has(main)) {
        let expected = format!("none, for a {} joint has no coordinate", kind.name());
        return Err(SimulateError::value(at(name), expected, "one"));
    }
    let mut drives = vec![];
    if own != DriveTable::default() {
        drives.push(drive(main, &own, key)?);
    }
    if let Some(slide) = &table.slide {
        drives.push(drive(Coordinate::Slide, slide, &at("slide"))?);
    }
    Ok(Joint {
        name: table.name.clone(),
        kind,
        a,
        b,
        anchors,
        axis,
        reference,
        collide: table.collide,
        on_a,
        drives,
    })
}

fn drive(coordinate: Coordinate, table: &DriveTable, key: &str) -> Result<Drive, SimulateError> {
    let limits = table.limits.map(|LimitsTable { lower, upper, e }| JointLimits {
        lower: lower.unwrap_or(f64::NEG_INFINITY),
        upper: upper.unwrap_or(f64::INFINITY),
        e,
    });
    let spring = table.spring.map(|SpringTable { stiffness, damping, rest }| Spring {
        stiffness,
        damping,
        rest,
    });
    let driver = table.motion.map(|DriverTable { velocity, amplitude, frequency, phase }| Driver {
        velocity,
        amplitude,
        frequency,
        phase,
    });
    let motor = table.motor.map(|motor| self::motor(&motor, key)).transpose()?;
    Ok(Drive { coordinate, limits, spring, friction: table.friction, motor, driver })
}

fn motor(table: &MotorTable, key: &str) -> Result<Motor, SimulateError> {
    let MotorTable { velocity, position, stiffness, damping, max } = *table;
    let max = max.unwrap_or(f64::INFINITY);
    let found = match (velocity, position) {
        (Some(velocity), None) if stiffness.is_none() && damping.is_none() => {
            return Ok(Motor::Velocity { velocity, max });
        }
        (None, Some(_)) if stiffness.is_none() && damping.is_none() => {
            // Without either it would do nothing.
            let expected = "the stiffness with which it pulls to the position";
            return Err(SimulateError::value(format!("{key}.motor.stiffness"), expected, "none"));
        }
        (None, Some(rest)) => {
            let [stiffness, damping] = [stiffness, damping].map(|x| x.unwrap_or(0.0));
            return Ok(Motor::Position { spring: Spring { stiffness, damping, rest }, max });
        }
        (Some(_), Some(_)) => "both a velocity and a position",
        (Some(_), None) if stiffness.is_some() => "a velocity with a stiffness",
        (Some(_), None) => "a velocity with a damping",
        (None, None) => "neither",
    };
    let expected = "a velocity alone, or a position with stiffness and damping";
    Err(SimulateError::value(format!("{key}.motor"), expected, found))
}

fn coupling(table: &CouplingTable, world: &World, key: &str) -> Result<Coupling, SimulateError> {
    let mut terms = vec![];
    for (k, term) in table.terms.iter().enumerate() {
        let key = format!("{key}.terms[{k}]");
        let place = world.joints.iter().position(|j| j.name == term.joint && !j.name.is_empty());
        let Some(place) = place else {
            let names = world.joints.iter().map(|j| j.name.as_str()).filter(|n| !n.is_empty());
            return Err(unknown(&format!("{key}.joint"), "joint", &term.joint, names));
        };
        let coordinate = match term.coordinate {
            Some(CoordinateName::Angle) => Coordinate::Angle,
            Some(CoordinateName::Slide) => Coordinate::Slide,
            None if world.joints[place].kind.has(Coordinate::Angle) => Coordinate::Angle,
            None => Coordinate::Slide,
        };
        terms.push((JointId(place as u32), coordinate, term.weight));
    }
    Ok(Coupling { name: table.name.clone(), terms })
}
