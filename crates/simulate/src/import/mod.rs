//! Robots of other formats as scenes.

mod mjcf;
mod urdf;

use std::path::Path;

use nonsmooth_scenes::vec3::{Mat3, Vec3, add, apply, congruence, scale};
use nonsmooth_scenes::{MassProperties, Rotation};
use serde_json::Value;

pub use mjcf::mjcf;
pub use urdf::urdf;

use crate::SimulateError;
use crate::rotation::unit;

/// A scene that was made of another format.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The scene as TOML.
    pub scene: String,
    /// What was left out or is to be decided, a line each.
    pub warnings: Vec<String>,
}

/// A format of text that scenes are made of.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// What it is called.
    pub name: &'static str,
    /// Makes the scene of a text whose files lie in a folder.
    pub read: fn(&str, &Path) -> Result<Imported, SimulateError>,
}

/// The format of a file by its extension: `.urdf`; `.xml` and `.mjcf`. None of other files.
pub fn format(file: &Path) -> Option<Format> {
    let extension = file.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "urdf" => Some(Format { name: "URDF", read: |text, _| urdf(text) }),
        "xml" | "mjcf" => Some(Format { name: "MJCF", read: mjcf }),
        _ => None,
    }
}

/// Where something is: turned first.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Frame {
    x: Vec3,
    q: Rotation,
}

impl Frame {
    const HERE: Self = Self { x: [0.0; 3], q: Rotation::IDENTITY };

    fn point(&self, p: Vec3) -> Vec3 {
        add(self.x, self.direction(p))
    }

    fn direction(&self, d: Vec3) -> Vec3 {
        apply(&self.q.matrix(), d)
    }

    fn then(&self, inner: &Self) -> Self {
        Self { x: self.point(inner.x), q: unit(self.q.after(inner.q)) }
    }

    /// The inverse.
    fn back(&self) -> Self {
        let [w, x, y, z] = self.q.0;
        let q = Rotation([w, -x, -y, -z]);
        Self { x: scale(-1.0, apply(&q.matrix(), self.x)), q }
    }

    /// What is known in this frame, outside of it.
    fn mass(&self, own: &MassProperties) -> MassProperties {
        let inertia = congruence(&self.q.matrix(), &own.inertia);
        MassProperties { mass: own.mass, centre: self.point(own.centre), inertia }
    }
}

/// The rotation about the k-th axis.
fn about(k: usize, angle: f64) -> Rotation {
    let mut axis = [0.0; 3];
    axis[k] = 1.0;
    Rotation::about(axis, angle)
}

/// An inertia as scenes write it: xx, yy, zz, xy, xz, yz.
fn entries(j: &Mat3) -> [f64; 6] {
    [j[0][0], j[1][1], j[2][2], j[0][1], j[0][2], j[1][2]]
}

/// A scene as text. Errors: numbers that became infinite.
fn text(scene: &Value) -> Result<String, SimulateError> {
    // JSON has no infinite numbers and puts null in their places, which TOML does not have.
    let table = toml::Value::try_from(scene);
    let text = table.ok().and_then(|table| toml::to_string(&table).ok());
    text.ok_or_else(|| {
        SimulateError::value("scene", "finite numbers", "others, as sums of large ones")
    })
}
