//! What a world in the plane of the first two axes may hold, and what belongs there only.

use nonsmooth_scenes::vec3::Vec3;

use crate::error::require;
use crate::rotation::Pose;
use crate::{Body, Dimension, Joint, JointKind, Motion, Part, Shape, SimulateError, World};

/// The normal of a half plane that leaves the plane by less is in it.
const IN_PLANE: f64 = 1e-12;

/// Errors: shapes, joints and numbers that a world of its dimension has not, by their place.
pub(crate) fn validate(world: &World) -> Result<(), SimulateError> {
    let named = |list: &str, k: usize, name: &str| match name {
        "" => format!("{list}[{k}]"),
        name => format!("{list}[{k}] ({name})"),
    };
    for (k, b) in world.bodies.iter().enumerate() {
        for (s, part) in b.parts.iter().enumerate() {
            let key = || named("bodies", k, &b.name) + &format!(".parts[{s}].shape");
            belongs(&part.shape, world.dimension, key)?;
        }
    }
    if world.dimension == Dimension::Three {
        return Ok(());
    }
    flat("gravity", world.gravity)?;
    if let Some(solid) = world.elastic.first() {
        let expected = "none: elastic boxes are solids of space";
        return Err(SimulateError::value(named("elastic", 0, &solid.name), expected, "one"));
    }
    for (key, law) in world.laws() {
        let expected = "0 in the plane: rolling friction has two tangents";
        require(|| format!("{key}.mu_r"), law.mu_r, law.mu_r == 0.0, expected)?;
    }
    for (k, b) in world.bodies.iter().enumerate() {
        body(b, &named("bodies", k, &b.name))?;
    }
    for (k, j) in world.joints.iter().enumerate() {
        joint(j, &named("joints", k, &j.name))?;
    }
    Ok(())
}

/// Errors: a shape of space in the plane, or the other way round.
pub(crate) fn belongs(
    shape: &Shape,
    dimension: Dimension,
    key: impl Fn() -> String,
) -> Result<(), SimulateError> {
    let of_plane = matches!(shape, Shape::Disc { .. } | Shape::Polygon(_) | Shape::Stadium { .. });
    let expected = match (dimension, of_plane || *shape == Shape::Plane) {
        (Dimension::Two, false) => {
            "a disc, polygon, box, capsule or plane, for the world is a plane"
        }
        (Dimension::Three, true) if of_plane => "a solid: this shape is one of worlds in the plane",
        _ => return Ok(()),
    };
    Err(SimulateError::value(key(), expected, format!("a {}", shape.name())))
}

/// Nothing along the third axis.
fn flat(key: &str, x: Vec3) -> Result<(), SimulateError> {
    let expected = "0 as the third component, for the world is a plane";
    require(|| key.into(), x[2], x[2] == 0.0, expected)
}

/// Nothing but a turn in the plane.
fn turn(key: &str, [x, y, _]: Vec3) -> Result<(), SimulateError> {
    let expected = "0 as the first two components, for the world is a plane";
    require(|| key.into(), x.abs() + y.abs(), x == 0.0 && y == 0.0, expected)
}

/// Of a force of a scene in the plane.
pub(crate) fn force(key: &str, force: Vec3, torque: Vec3, at: Vec3) -> Result<(), SimulateError> {
    flat(&format!("{key}.force"), force)?;
    turn(&format!("{key}.torque"), torque)?;
    flat(&format!("{key}.at"), at)
}

fn rotation(key: &str, [_, x, y, _]: [f64; 4]) -> Result<(), SimulateError> {
    let expected = "a rotation about the third axis, for the world is a plane";
    require(|| key.into(), x.abs() + y.abs(), x == 0.0 && y == 0.0, expected)
}

fn body(body: &Body, key: &str) -> Result<(), SimulateError> {
    let at = |name: &str| format!("{key}.{name}");
    flat(&at("position"), body.position)?;
    flat(&at("velocity"), body.velocity)?;
    flat(&at("force"), body.force)?;
    turn(&at("angular_velocity"), body.angular_velocity)?;
    turn(&at("torque"), body.torque)?;
    rotation(&at("rotation"), body.rotation.0)?;
    match body.motion {
        Motion::Free => {
            let across = body.inertia[0][2].abs() + body.inertia[1][2].abs();
            let expected =
                "a moment about the third axis that is a principal one, for the world is a plane";
            require(|| at("inertia"), across, across == 0.0, expected)?;
        }
        Motion::Fixed => {}
        Motion::Surface { linear, angular } => {
            flat(&at("motion.velocity"), linear)?;
            turn(&at("motion.angular_velocity"), angular)?;
        }
        Motion::Uniform { velocity } => flat(&at("motion.velocity"), velocity)?,
        Motion::Oscillating { amplitude, .. } => flat(&at("motion.amplitude"), amplitude)?,
    }
    for (s, part) in body.parts.iter().enumerate() {
        placed(part, &format!("{key}.parts[{s}]"))?;
    }
    Ok(())
}

fn placed(part: &Part, key: &str) -> Result<(), SimulateError> {
    flat(&format!("{key}.position"), part.position)?;
    if part.shape != Shape::Plane {
        return rotation(&format!("{key}.rotation"), part.rotation.0);
    }
    let pose = Pose { x: part.position, r: part.rotation.matrix() };
    let normal = pose.direction([0.0, 0.0, 1.0]);
    let expected = "a normal in the plane";
    require(|| format!("{key}.rotation"), normal[2], normal[2].abs() <= IN_PLANE, expected)
}

fn joint(joint: &Joint, key: &str) -> Result<(), SimulateError> {
    let at = |name: &str| format!("{key}.{name}");
    let [x, y, z] = joint.axis;
    match joint.kind {
        JointKind::Fixed | JointKind::Distance => {}
        JointKind::Revolute => {
            let expected = "the third axis, for the world is a plane";
            require(|| at("axis"), x.abs() + y.abs(), x == 0.0 && y == 0.0, expected)?;
        }
        JointKind::Prismatic | JointKind::PointOnLine => {
            let expected = "a direction in the plane";
            require(|| at("axis"), z, z == 0.0, expected)?;
        }
        kind => {
            let expected =
                "fixed, revolute, prismatic, point_on_line or distance, for the world is a plane";
            return Err(SimulateError::value(at("kind"), expected, kind.name()));
        }
    }
    if let Some(reference) = joint.reference {
        flat(&at("reference"), reference)?;
    }
    joint.anchors.iter().try_for_each(|anchor| flat(&at("anchor"), *anchor))
}
