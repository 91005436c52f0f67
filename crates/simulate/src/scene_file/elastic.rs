//! Elastic boxes of a scene.

use nonsmooth_scenes::{ElasticBox, Material, SceneError};

use super::{ElasticTable, FaceName, RayleighTable};
use crate::error::{finite, require};
use crate::{Elastic, SimulateError};

/// The box of a table, of this material and density.
///
/// Errors: a value that is not possible, by its place.
pub(super) fn solid(
    table: &ElasticTable,
    (material, density): (usize, f64),
    key: &str,
) -> Result<Elastic, SimulateError> {
    for (name, x) in [
        ("position", table.position),
        ("velocity", table.velocity),
        ("angular_velocity", table.angular_velocity),
    ] {
        finite(|| format!("{key}.{name}"), &x)?;
    }
    for half in table.half {
        require(|| format!("{key}.half"), half, half > 0.0, "positive numbers")?;
    }
    let RayleighTable { mass: alpha, stiffness: beta } = table.damping;
    let (young, poisson) = (table.young, table.poisson);
    let made_of = Material { density, young, poisson, alpha, beta };
    let solid = ElasticBox::new(table.half.map(|x| 2.0 * x), table.divisions, made_of);
    let wrong = |e: SceneError| match e {
        SceneError::Value { key: field, expected, found } => {
            let field = match field.as_str() {
                "elements" => "divisions",
                "alpha" => "damping.mass",
                "beta" => "damping.stiffness",
                field => field,
            };
            SimulateError::value(format!("{key}.{field}"), expected, found)
        }
        e => SimulateError::Schema { path: key.into(), problem: e.to_string() },
    };
    let mut solid = solid.map_err(wrong)?.at(table.position);
    solid.lumped = table.lumped;
    for &face in &table.held {
        hold(&mut solid, face);
    }
    solid.add_velocity(table.velocity, table.angular_velocity);
    Ok(Elastic::new(solid).named(&table.name).of(material))
}

/// Holds the nodes of a face.
fn hold(solid: &mut ElasticBox, face: FaceName) {
    let (axis, end) = match face {
        FaceName::Left => (0, 0),
        FaceName::Right => (0, 1),
        FaceName::Front => (1, 0),
        FaceName::Back => (1, 1),
        FaceName::Bottom => (2, 0),
        FaceName::Top => (2, 1),
    };
    let [x, y, _] = solid.elements.map(|n| n + 1);
    for node in 0..solid.nodes() {
        let at = [node % x, node / x % y, node / (x * y)][axis];
        solid.held[node] |= at == end * solid.elements[axis];
    }
}
