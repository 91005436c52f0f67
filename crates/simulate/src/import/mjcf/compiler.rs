//! What `compiler` and `option` say: units, orders of turning, and which numbers follow from which.

use std::collections::BTreeSet;
use std::path::PathBuf;

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale};

use super::document::{Defaults, Element, Item, MAIN};
use crate::SimulateError;
use crate::import::{Frame, about};
use crate::rotation::unit;

/// Attributes of options that are read, or of solvers, sensors, air and laws of contact that are not ours.
const OF_OPTIONS: [&str; 26] = [
    "gravity",
    "timestep",
    "density",
    "viscosity",
    "wind",
    "magnetic",
    "actuatorgroupdisable",
    "o_friction",
    "o_solref",
    "o_solimp",
    "impratio",
    "cone",
    "integrator",
    "jacobian",
    "solver",
    "iterations",
    "tolerance",
    "ls_iterations",
    "ls_tolerance",
    "noslip_iterations",
    "noslip_tolerance",
    "ccd_iterations",
    "ccd_tolerance",
    "sdf_initpoints",
    "sdf_iterations",
    "sleep_tolerance",
];

/// How the numbers of a model are meant.
pub(super) struct Compiler {
    /// What angles are multiplied by.
    pub angle: f64,
    euler: [(usize, bool); 3],
    pub autolimits: bool,
    /// Whether masses follow from geoms: always, never, or where there is no `inertial`.
    pub from_geoms: Option<bool>,
    /// The groups of geoms that have a mass.
    pub groups: [i64; 2],
    pub folder: PathBuf,
    /// Added to the path of a mesh, and of a height field.
    pub meshdir: String,
    pub assetdir: String,
    /// Whether files are looked for by their names without their folders.
    pub strippath: bool,
    pub gravity: Vec3,
    /// Whether a flag takes gravity away, whatever `gravity` says.
    weightless: bool,
    pub h: f64,
    /// Whether parent and child pass through each other.
    pub filter: bool,
    /// Whether controls stay in their ranges.
    pub clamps: bool,
    /// The groups of actuators that do nothing.
    pub disabled: BTreeSet<i64>,
    /// The friction of all contacts (two of sliding, one of turning, two of rolling), and whether it goes before that of the geoms.
    friction: [f64; 5],
    overrides: bool,
}

impl Compiler {
    pub fn read(
        root: &Element,
        defaults: &Defaults,
        folder: PathBuf,
        said: &mut Vec<String>,
    ) -> Result<Self, SimulateError> {
        let mut out = Self {
            angle: 1.0_f64.to_radians(),
            euler: [(0, true), (1, true), (2, true)],
            autolimits: true,
            from_geoms: None,
            groups: [0, 5],
            folder,
            meshdir: String::new(),
            assetdir: String::new(),
            strippath: false,
            gravity: [0.0, 0.0, -9.81],
            weightless: false,
            h: 2e-3,
            filter: true,
            clamps: true,
            disabled: BTreeSet::new(),
            friction: [1.0, 1.0, 5e-3, 1e-4, 1e-4],
            overrides: false,
        };
        for element in root.named("compiler") {
            out.compiler(&defaults.item(element, MAIN)?, said)?;
        }
        for element in root.named("option") {
            out.option(&defaults.item(element, MAIN)?, said)?;
        }
        if out.weightless {
            out.gravity = [0.0; 3];
        }
        Ok(out)
    }

    fn compiler(&mut self, item: &Item, said: &mut Vec<String>) -> Result<(), SimulateError> {
        for name in item.names() {
            let text = item.text(name).unwrap_or_default();
            match name {
                "angle" => {
                    self.angle = match text {
                        "radian" => 1.0,
                        "degree" => 1.0_f64.to_radians(),
                        _ => return Err(item.wrong("radian or degree as `angle`", text)),
                    }
                }
                "eulerseq" => self.euler = order(item, text)?,
                "autolimits" => self.autolimits = item.flag(name, true)?,
                "inertiafromgeom" => {
                    self.from_geoms = match text {
                        "auto" => None,
                        _ => Some(item.flag(name, true)?),
                    }
                }
                "inertiagrouprange" => {
                    let found = item.some::<2>(name)?.unwrap_or([0.0, 5.0]);
                    self.groups = found.map(|x| x as i64);
                }
                "meshdir" => self.meshdir = text.into(),
                "assetdir" => self.assetdir = text.into(),
                "coordinate" if text == "local" => {}
                "coordinate" => return Err(item.wrong("local coordinates", text)),
                "settotalmass" if item.real(name, -1.0)? <= 0.0 => {}
                "boundmass" | "boundinertia" if item.real(name, 0.0)? == 0.0 => {}
                "balanceinertia" if !item.flag(name, false)? => {}
                "settotalmass" | "boundmass" | "boundinertia" | "balanceinertia" => {
                    said.push(format!("{}: `{name}` changes masses and is left out", item.key()));
                }
                "strippath" => self.strippath = item.flag(name, false)?,
                "alignfree" if !item.flag(name, false)? => {}
                "alignfree" => said.push(format!(
                    "{}, for `qpos` of a keyframe is taken for that of the bodies as they are written",
                    left_out(item, name)
                )),
                // What has to do with pictures, speed, or how the model is kept.
                "texturedir" | "discardvisual" | "usethread" | "fusestatic"
                | "exactmeshinertia" | "saveinertial" | "conflict" => {}
                other => said.push(left_out(item, other)),
            }
        }
        Ok(())
    }

    fn option(&mut self, item: &Item, said: &mut Vec<String>) -> Result<(), SimulateError> {
        self.gravity = item.some("gravity")?.unwrap_or(self.gravity);
        self.h = item.real("timestep", self.h)?;
        for name in ["density", "viscosity"] {
            if item.real(name, 0.0)? != 0.0 {
                said.push(format!("{}: `{name}`: air and water are left out", item.key()));
            }
        }
        unknown(item, &OF_OPTIONS, said);
        self.friction = item.list("o_friction", self.friction)?;
        for group in item.numbers("actuatorgroupdisable")?.unwrap_or_default() {
            if !(0.0..=30.0).contains(&group) || group.fract() != 0.0 {
                let expected = "whole numbers of 0 to 30 as `actuatorgroupdisable`";
                return Err(item.wrong(expected, group));
            }
            self.disabled.insert(group as i64);
        }
        for flag in item.element.named("flag") {
            for (name, text) in &flag.attributes {
                match (name.as_str(), text.as_str()) {
                    // The last of several flags holds.
                    ("gravity", text) => self.weightless = text == "disable",
                    ("filterparent", text) => self.filter = text != "disable",
                    ("clampctrl", text) => self.clamps = text != "disable",
                    ("override", text) => self.overrides = text == "enable",
                    (
                        "contact" | "limit" | "equality" | "frictionloss" | "passive" | "spring"
                        | "damper" | "constraint" | "actuation",
                        "disable",
                    ) => said.push(format!("{}: `{name}` stays switched on", flag.key())),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// The coefficients of sliding and rolling friction of all contacts, where they go before those of the geoms.
    pub fn friction(&self) -> Option<[f64; 2]> {
        let [sliding, _, _, rolling, _] = self.friction.map(|x| x.max(0.0));
        self.overrides.then_some([sliding, rolling])
    }

    /// Where an element is in that around it: `pos`, and one of the ways to say an orientation.
    pub fn frame(&self, item: &Item) -> Result<Frame, SimulateError> {
        Ok(Frame { x: item.some("pos")?.unwrap_or_default(), q: self.rotation(item)? })
    }

    pub fn rotation(&self, item: &Item) -> Result<Rotation, SimulateError> {
        const WAYS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];
        // What stands in the element goes before what stands in its class.
        let own = WAYS.iter().filter(|way| item.element.attributes.contains_key(**way));
        if own.count() > 1 {
            return Err(item.wrong("one orientation", "several"));
        }
        let way = WAYS.iter().find(|way| item.element.attributes.contains_key(**way));
        let Some(way) = way.or_else(|| WAYS.iter().find(|way| item.text(way).is_some())) else {
            return Ok(Rotation::IDENTITY);
        };
        let direction = |x: Vec3| match norm(x) > 0.0 {
            true => Ok(scale(1.0 / norm(x), x)),
            false => Err(item.wrong(format!("directions as `{way}`"), format!("{x:?}"))),
        };
        match *way {
            "quat" => {
                let q = item.some::<4>("quat")?.unwrap_or([1.0, 0.0, 0.0, 0.0]);
                match q.iter().any(|x| *x != 0.0) {
                    true => Ok(unit(Rotation(q))),
                    false => Err(item.wrong("a quaternion", "zero")),
                }
            }
            "axisangle" => {
                let [x, y, z, angle] = item.some::<4>("axisangle")?.unwrap_or_default();
                Ok(Rotation::about(direction([x, y, z])?, self.angle * angle))
            }
            "xyaxes" => {
                let [a, b, c, d, e, f] = item.some::<6>("xyaxes")?.unwrap_or_default();
                let (x, y) = (direction([a, b, c])?, [d, e, f]);
                let y = direction(add(y, scale(-dot(x, y), x)))?;
                Ok(of_axes(x, y, cross(x, y)))
            }
            "zaxis" => Ok(from_third(direction(item.some("zaxis")?.unwrap_or_default())?)),
            _ => {
                let angles = item.some::<3>("euler")?.unwrap_or_default();
                let turns = self.euler.iter().zip(angles);
                Ok(unit(turns.fold(Rotation::IDENTITY, |q, (&(axis, moving), angle)| {
                    let turn = about(axis, self.angle * angle);
                    if moving { q.after(turn) } else { turn.after(q) }
                })))
            }
        }
    }
}

/// That an attribute is not in the subset.
pub(super) fn left_out(item: &Item, name: &str) -> String {
    format!("{}: `{name}` is left out", item.key())
}

/// Says which attributes of an element are not in the subset.
pub(super) fn unknown(item: &Item, known: &[&str], said: &mut Vec<String>) {
    let names = item.names().into_iter().filter(|name| !known.contains(name));
    said.extend(names.map(|name| left_out(item, name)));
}

/// The axes that Euler's angles turn about, small letters those that move along.
fn order(item: &Item, text: &str) -> Result<[(usize, bool); 3], SimulateError> {
    let axes = text
        .chars()
        .map(|c| "xyz".find(c.to_ascii_lowercase()).map(|k| (k, c.is_ascii_lowercase())));
    let found: Option<Vec<_>> = axes.collect();
    found
        .and_then(|axes| axes.try_into().ok())
        .ok_or_else(|| item.wrong("three letters of x, y, z as `eulerseq`", format!("`{text}`")))
}

/// The shortest turn of the third axis to a unit vector.
pub(super) fn from_third(z: Vec3) -> Rotation {
    let axis = cross([0.0, 0.0, 1.0], z);
    match norm(axis) > 1e-10 {
        true => Rotation::about(axis, norm(axis).atan2(z[2])),
        false if z[2] > 0.0 => Rotation::IDENTITY,
        false => Rotation([0.0, 1.0, 0.0, 0.0]),
    }
}

/// The rotation whose matrix has these columns (Shepperd's method).
fn of_axes(x: Vec3, y: Vec3, z: Vec3) -> Rotation {
    let (xx, yy, zz) = (x[0], y[1], z[2]);
    let squares = [1.0 + xx + yy + zz, 1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz];
    let largest = (0..4).fold(0, |k, l| if squares[l] > squares[k] { l } else { k });
    let turns = [y[2] - z[1], z[0] - x[2], x[1] - y[0]];
    let sums = [z[1] + y[2], x[2] + z[0], y[0] + x[1]];
    unit(Rotation(match largest {
        0 => [squares[0], turns[0], turns[1], turns[2]],
        1 => [turns[0], squares[1], sums[2], sums[1]],
        2 => [turns[1], sums[2], squares[2], sums[0]],
        _ => [turns[2], sums[1], sums[0], squares[3]],
    }))
}
