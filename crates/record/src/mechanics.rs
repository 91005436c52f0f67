//! A mechanics file of Siconos as a scene of `simulate`.
//!
//! Contact laws are between groups of contactors: groups become materials, and bodies whose groups have no law do not meet. Cylinders, cones and capsules stand about the
//! second axis there, and about the third one here. Files of dimension 2 are scenes in the plane, where gravity is along the second axis.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use nonsmooth_io::siconos::{
    MechanicsContactor, MechanicsForm, MechanicsJoint, MechanicsLaw, MechanicsObject,
    MechanicsScene,
};
use nonsmooth_scenes::vec3::{Vec3, add, apply, congruence};
use nonsmooth_scenes::{MassProperties, Polyhedron, Rotation};
use nonsmooth_simulate::import::Imported;
use nonsmooth_simulate::rotation::unit;
use nonsmooth_simulate::scene_file::{FORMAT, VERSION};
use nonsmooth_simulate::{Polygon, Shape};
use serde_json::{Value, json};

/// Gravity of Siconos' runs, m/s².
const GRAVITY: f64 = 9.80665;
/// Entries of a tensor of inertia across the diagonal from each other differ by no more than this part of it.
const SYMMETRIC: f64 = 1e-9;
/// Their step and end where the file has no history, s.
const TIMES: [f64; 2] = [5e-4, 10.0];

/// The scene of a file.
pub(crate) fn read(from: &Path) -> Result<Imported, String> {
    let file = MechanicsScene::read(from).map_err(|e| e.to_string())?;
    scene(&file).map_err(|e| format!("{}: {e}", from.display()))
}

fn scene(file: &MechanicsScene) -> Result<Imported, String> {
    if !matches!(file.dimension, 2 | 3) {
        return Err(format!("dimension: expected 2 or 3, found {}", file.dimension));
    }
    let flat = file.dimension == 2;
    let mut import = Import { file, flat, shapes: BTreeMap::new(), said: vec![] };
    let [h, end] = file.times.unwrap_or(TIMES);
    let from = if file.times.is_some() { "of its history" } else { "the defaults of Siconos" };
    import.said.push(format!("h = {h} and end = {end} are {from}, gravity that of its runs"));
    import.shapes()?;
    import.said.extend(file.others.iter().map(|path| format!("{path}: left out")));
    let contacts = Contacts::new(file, &mut import.said)?;
    let mut bodies = vec![];
    let mut forces = false;
    for object in &file.objects {
        if let Some(time) = object.birth {
            import.said.push(format!("{}: it appears at {time} s: left out", place(object)));
            continue;
        }
        let mut body = import.body(object)?;
        contacts.of(object, &mut body);
        forces |= object.force.is_some();
        bodies.push(body);
    }
    if forces {
        import.said.push("`fext` of bodies acts besides their weight".into());
    }
    if let (true, Some(joint)) = (flat, file.joints.first()) {
        let expected = "none in dimension 2: joints of Siconos are of space";
        return Err(format!(
            "/data/joints/{}: expected {expected}, found {}",
            joint.name, joint.kind
        ));
    }
    let joints: Vec<Value> =
        file.joints.iter().map(|joint| import.joint(joint)).collect::<Result<_, _>>()?;
    let mut scene = json!({
        "format": FORMAT, "version": VERSION, "name": "Siconos",
        "gravity": [0.0, 0.0, -GRAVITY],
        "time": {"h": h, "end": end},
        "bodies": bodies,
    });
    if flat {
        scene["dimension"] = json!(2);
        scene["gravity"] = json!([0.0, -GRAVITY]);
    }
    contacts.laws(&mut scene);
    let (couplings, joints): (Vec<Value>, Vec<Value>) = joints
        .into_iter()
        .flat_map(|j| j.as_array().cloned().unwrap_or_default())
        .partition(|j| j.get("terms").is_some());
    for (name, all) in [("joints", joints), ("couplings", couplings)] {
        if !all.is_empty() {
            scene[name] = json!(all);
        }
    }
    let table = toml::Value::try_from(&scene).map_err(|e| e.to_string())?;
    let text = toml::to_string(&table).map_err(|e| e.to_string())?;
    Ok(Imported { scene: text, warnings: import.said })
}

fn place(object: &MechanicsObject) -> String {
    format!("/data/input/{}", object.name)
}

/// A shape of the scene, the solid that it is, and how it is turned against that of the file.
struct Made {
    table: Value,
    solid: Option<Shape>,
    turned: Rotation,
}

struct Import<'a> {
    file: &'a MechanicsScene,
    /// Whether it is of dimension 2.
    flat: bool,
    shapes: BTreeMap<&'a str, Made>,
    said: Vec<String>,
}

/// The third axis onto the second.
const ONTO_SECOND: Rotation =
    Rotation([std::f64::consts::FRAC_1_SQRT_2, -std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0]);

impl<'a> Import<'a> {
    fn shapes(&mut self) -> Result<(), String> {
        for shape in &self.file.shapes {
            let place = format!("/data/ref/{}", shape.name);
            if shape.outside_margin != 0.0 {
                self.said.push(format!("{place}: `outsideMargin`: shapes have no skin here"));
            }
            let made = match &shape.form {
                MechanicsForm::Primitive { kind, size } => primitive(kind, size, self.flat)
                    .ok_or_else(|| {
                        let expected = match self.flat {
                            true => "in dimension 2 a Disk or Box2d with its positive numbers",
                            false => "a Sphere, Box, Cylinder, Cone, Capsule or Plane with its positive numbers",
                        };
                        format!("{place}: expected {expected}, found {kind} {size:?}")
                    })?,
                MechanicsForm::Heights { .. } | MechanicsForm::Other(_) | MechanicsForm::Convex(_)
                    if self.flat =>
                {
                    let expected = "in dimension 2 a primitive or a convex of rows of 2 numbers";
                    return Err(format!("{place}: expected {expected}, found another shape"));
                }
                MechanicsForm::Convex(points) => {
                    let hull = Polyhedron::hull(points).map_err(|e| format!("{place}: {e}"))?;
                    let table = json!({
                        "kind": "polyhedron", "vertices": hull.vertices(), "faces": hull.faces(),
                    });
                    Made { table, solid: Some(hull.into()), turned: Rotation::IDENTITY }
                }
                MechanicsForm::Flat(points) => {
                    let hull = Polygon::hull(points).map_err(|e| format!("{place}: {e}"))?;
                    let table = json!({"kind": "polygon", "vertices": hull.vertices()});
                    Made { table, solid: Some(Shape::Polygon(hull)), turned: Rotation::IDENTITY }
                }
                MechanicsForm::Heights { heights, size } => {
                    let columns = heights.first().map_or(0, Vec::len);
                    let across: Vec<Vec<f64>> =
                        (0..columns).map(|j| heights.iter().map(|row| row[j]).collect()).collect();
                    let table = json!({"kind": "heightfield", "heights": across, "size": size});
                    Made { table, solid: None, turned: Rotation::IDENTITY }
                }
                MechanicsForm::Other(kind) => {
                    let name = format!("{}.stl", shape.name);
                    self.said.push(format!(
                        "{place}: a {kind} is not read: the scene names {name}, which is to be put beside it"
                    ));
                    let table = json!({"kind": "mesh", "file": name});
                    Made { table, solid: None, turned: Rotation::IDENTITY }
                }
            };
            self.shapes.insert(&shape.name, made);
        }
        Ok(())
    }

    fn body(&mut self, object: &MechanicsObject) -> Result<Value, String> {
        let place = place(object);
        let mut table = json!({"name": object.name, "position": self.vector(object.position)});
        let q = Rotation(object.rotation);
        if object.rotation.iter().all(|x| *x == 0.0) {
            return Err(format!("{place}: expected a quaternion as `orientation`, found zero"));
        }
        let q = unit(q);
        table["rotation"] = self.turn(q);
        self.said.extend(object.others.iter().map(|name| format!("{place}: `{name}` is left out")));
        if object.death.is_some() {
            self.said.push(format!("{place}: `time_of_death` is left out: it stays"));
        }
        let mut parts = vec![];
        let mut solids = vec![];
        for contactor in &object.contactors {
            let made = self.shapes.get(contactor.shape.as_str()).ok_or_else(|| {
                format!("{place}: expected a shape of /data/ref, found `{}`", contactor.shape)
            })?;
            let own = unit(unit(Rotation(contactor.rotation)).after(made.turned));
            solids.push(made.solid.as_ref().map(|solid| (solid, contactor.position, own)));
            parts.push(json!({
                "shape": made.table, "position": self.vector(contactor.position),
                "rotation": self.turn(own), "material": material(contactor.group),
            }));
        }
        match object.mass {
            None => table["fixed"] = json!(true),
            Some(mass) if self.flat => {
                let inertia = match object.inertia.as_deref() {
                    Some(&[j] | &[0.0, 0.0, j]) => j,
                    Some(other) => {
                        let found = format!("{other:?}");
                        return Err(format!("{place}: expected one number as `inertia` in dimension 2, found {found}"));
                    }
                    None => *inertia(mass, &solids).and_then(|j| j.get(2).copied()).as_ref().ok_or_else(|| {
                        format!("{place}: expected `inertia`, or shapes that it follows from, found neither")
                    })?,
                };
                let [x, y, .., turn] = object.velocity;
                table["mass"] = json!(mass);
                table["inertia"] = json!(inertia);
                table["velocity"] = json!([x, y]);
                table["angular_velocity"] = json!(turn);
                match object.force.as_deref() {
                    Some(&[x, y]) => table["force"] = json!([x, y]),
                    Some(&[x, y, torque]) => {
                        (table["force"], table["torque"]) = (json!([x, y]), json!(torque));
                    }
                    Some(other) => {
                        let found = format!("{} numbers", other.len());
                        return Err(format!(
                            "{place}: expected 2 or 3 numbers as `fext`, found {found}"
                        ));
                    }
                    None => {}
                }
            }
            Some(mass) => {
                let inertia = match object.inertia.as_deref() {
                    Some(&[x, y, z]) => vec![x, y, z],
                    // By rows.
                    Some(&[xx, xy, xz, yx, yy, yz, zx, zy, zz]) => {
                        let size = xx.abs().max(yy.abs()).max(zz.abs());
                        let apart = [xy - yx, xz - zx, yz - zy].into_iter().map(f64::abs);
                        let apart = apart.fold(0.0, f64::max);
                        if apart > SYMMETRIC * size {
                            return Err(format!(
                                "{place}: expected a symmetric `inertia`, found entries that differ by {apart} from those across the diagonal"
                            ));
                        }
                        vec![xx, yy, zz, xy, xz, yz]
                    }
                    Some(other) => {
                        let found = format!("{} numbers", other.len());
                        return Err(format!("{place}: expected 3 or 9 numbers as `inertia`, found {found}"));
                    }
                    None => inertia(mass, &solids).ok_or_else(|| {
                        format!("{place}: expected `inertia`, or shapes that it follows from, found neither")
                    })?,
                };
                let [v0, v1, v2, w0, w1, w2] = object.velocity;
                table["mass"] = json!(mass);
                table["inertia"] = json!(inertia);
                table["velocity"] = json!([v0, v1, v2]);
                table["angular_velocity"] = json!(apply(&q.matrix(), [w0, w1, w2]));
                match object.force.as_deref() {
                    Some(&[x, y, z, ref rest @ ..]) if matches!(rest.len(), 0 | 3) => {
                        table["force"] = json!([x, y, z]);
                        if let [a, b, c] = rest {
                            table["torque"] = json!([a, b, c]);
                        }
                    }
                    Some(other) => {
                        let found = format!("{} numbers", other.len());
                        return Err(format!(
                            "{place}: expected 3 or 6 numbers as `fext`, found {found}"
                        ));
                    }
                    None => {}
                }
            }
        }
        if !parts.is_empty() {
            table["shapes"] = json!(parts);
        }
        Ok(table)
    }

    /// A vector as the scene has it.
    fn vector(&self, x: Vec3) -> Value {
        if self.flat { json!([x[0], x[1]]) } else { json!(x) }
    }

    /// An orientation as the scene has it.
    fn turn(&self, q: Rotation) -> Value {
        match self.flat {
            true => json!(2.0 * q.0[3].atan2(q.0[0])),
            false => json!({"quaternion": q.0}),
        }
    }

    /// A joint, and the couplings of its own coordinates.
    fn joint(&mut self, joint: &MechanicsJoint) -> Result<Value, String> {
        let place = format!("/data/joints/{}", joint.name);
        let object = |name: &str| {
            let found = self.file.objects.iter().find(|o| o.name == name && o.birth.is_none());
            found.ok_or_else(|| {
                format!("{place}: expected an object that is there from the start, found `{name}`")
            })
        };
        let first = object(&joint.objects.0)?;
        let second = joint.objects.1.as_deref().map(object).transpose()?;
        let kind = match joint.kind.as_str() {
            "PivotJointR" => "revolute",
            "PrismaticJointR" => "prismatic",
            "KneeJointR" => "spherical",
            "FixedJointR" => "fixed",
            "CylindricalJointR" => "cylindrical",
            other => {
                let expected =
                    "PivotJointR, PrismaticJointR, KneeJointR, FixedJointR or CylindricalJointR";
                return Err(format!("{place}: expected {expected}, found {other}"));
            }
        };
        let frame = unit(Rotation(first.rotation)).matrix();
        let point = joint.points.first().copied();
        let axis = joint.axes.first().copied();
        let turned = |x: Vec3| if joint.absolute { x } else { apply(&frame, x) };
        let anchor = match point {
            Some(p) if joint.absolute => p,
            Some(p) => add(first.position, apply(&frame, p)),
            None => first.position,
        };
        let needed = match kind {
            "revolute" | "cylindrical" => [1, 1],
            "prismatic" => [0, 1],
            "spherical" => [1, 0],
            _ => [0, 0],
        };
        for (needed, found, name, old) in [
            (needed[0], joint.points.len(), "points", "pivot_point"),
            (needed[1], joint.axes.len(), "axes", "axis"),
        ] {
            if found < needed {
                return Err(format!(
                    "{place}: expected {needed} in `{name}` of a {} (`{old}` of files from before `{name}` is not read), found {found}",
                    joint.kind
                ));
            }
        }
        // A joint between two that stand is none.
        if first.mass.is_none() && second.is_none_or(|o| o.mass.is_none()) {
            return Err(format!("{place}: expected an object that moves, found none"));
        }
        let mut table = json!({
            "name": joint.name, "kind": kind, "a": first.name,
            "b": second.map_or("world", |o| &o.name), "anchor": anchor,
        });
        if let Some(axis) = axis {
            table["axis"] = json!(turned(axis));
        }
        if joint.collide {
            table["collide"] = json!(true);
        }
        // Of two coordinates the slide is the first there; here it is a table of its own.
        let coordinate = |axis: f64| match (kind, axis) {
            ("revolute" | "prismatic", 0.0) => Some(None),
            ("cylindrical", 0.0) => Some(Some("slide")),
            ("cylindrical", 1.0) => Some(None),
            _ => None,
        };
        for (k, &[axis, position, sign]) in joint.stops.iter().enumerate() {
            let Some(inner) = coordinate(axis) else {
                self.said.push(format!("{place}: the stop of coordinate {axis} is left out"));
                continue;
            };
            let law = joint.laws.get(k).or(joint.laws.first().filter(|_| joint.laws.len() == 1));
            let law = law.and_then(|name| self.file.laws.iter().find(|l| l.name == *name));
            let table = match inner {
                Some(inner) => &mut table[inner],
                None => &mut table,
            };
            let end = if sign < 0.0 { "upper" } else { "lower" };
            table["limits"][end] = json!(position);
            let e = law.map_or(0.0, |law| law.e);
            let known = table["limits"].get("e").and_then(Value::as_f64);
            if known.is_some_and(|known| known != e) {
                self.said.push(format!("{place}: both ends have the restitution of one"));
            }
            table["limits"]["e"] = json!(e);
        }
        for (k, name) in joint.friction.iter().enumerate().filter(|(_, name)| !name.is_empty()) {
            let law = self.file.laws.iter().find(|l| l.name == *name && l.kind == "RelayNSL");
            match (coordinate(k as f64), law.map(|l| l.bounds)) {
                (Some(inner), Some([lower, upper])) if lower == -upper && upper >= 0.0 => {
                    let table = match inner {
                        Some(inner) => &mut table[inner],
                        None => &mut table,
                    };
                    table["friction"] = json!(upper);
                }
                _ => self.said.push(format!("{place}: its friction `{name}` is left out")),
            }
        }
        let mut all = vec![];
        for &[one, two, ratio] in &joint.coupled {
            match (kind, [one, two] == [0.0, 1.0] || [one, two] == [1.0, 0.0]) {
                ("cylindrical", true) => {
                    let name = |k: f64| if k == 0.0 { "slide" } else { "angle" };
                    // There one coordinate is the ratio times the other.
                    all.push(json!({"name": format!("{} coupled", joint.name), "terms": [
                        {"joint": joint.name, "coordinate": name(one), "weight": ratio},
                        {"joint": joint.name, "coordinate": name(two), "weight": -1.0},
                    ]}));
                }
                _ => self.said.push(format!("{place}: `coupled` is left out")),
            }
        }
        all.push(table);
        Ok(json!(all))
    }
}

/// A primitive with all its numbers positive.
fn primitive(kind: &str, size: &[f64], flat: bool) -> Option<Made> {
    if size.iter().any(|x| *x <= 0.0) && kind != "Plane" {
        return None;
    }
    if flat {
        let (solid, table) = match (kind, size) {
            ("Disk", &[radius]) => {
                (Shape::Disc { radius }, json!({"kind": "disc", "radius": radius}))
            }
            ("Box2d", &[x, y]) => {
                let half = [0.5 * x, 0.5 * y];
                let table = json!({"kind": "box", "half": half});
                (Shape::Polygon(Polygon::rectangle(half).ok()?), table)
            }
            _ => return None,
        };
        return Some(Made { table, solid: Some(solid), turned: Rotation::IDENTITY });
    }
    let (solid, table) = match (kind, size) {
        ("Sphere", &[radius]) => {
            (Shape::Sphere { radius }, json!({"kind": "sphere", "radius": radius}))
        }
        ("Box", &[x, y, z]) => {
            let half = [0.5 * x, 0.5 * y, 0.5 * z];
            (Shape::Box { half }, json!({"kind": "box", "half": half}))
        }
        ("Cylinder" | "Cone" | "Capsule", &[radius, height]) => {
            let half_length = 0.5 * height;
            let (name, solid) = match kind {
                "Cylinder" => ("cylinder", Shape::Cylinder { half_length, radius }),
                "Cone" => ("cone", Shape::Cone { half_length, radius }),
                _ => ("capsule", Shape::Capsule { half_length, radius }),
            };
            let table = json!({"kind": name, "radius": radius, "half_length": half_length});
            return Some(Made { table, solid: Some(solid), turned: ONTO_SECOND });
        }
        ("Plane", _) => {
            let table = json!({"kind": "plane"});
            return Some(Made { table, solid: None, turned: Rotation::IDENTITY });
        }
        _ => return None,
    };
    Some(Made { table, solid: Some(solid), turned: Rotation::IDENTITY })
}

/// The inertia of homogeneous shapes of a mass together, about the origin of the body.
fn inertia(mass: f64, solids: &[Option<(&Shape, Vec3, Rotation)>]) -> Option<Vec<f64>> {
    let mut parts = vec![];
    for (solid, position, q) in solids.iter().copied().collect::<Option<Vec<_>>>()? {
        let own = solid.mass_properties(1.0).ok()?;
        let r = q.matrix();
        let centre = add(position, apply(&r, own.centre));
        parts.push(MassProperties { centre, inertia: congruence(&r, &own.inertia), ..own });
    }
    let joined = MassProperties::joined(&parts);
    let by = (!parts.is_empty()).then_some(mass / joined.mass)?;
    let j = joined.inertia;
    Some([j[0][0], j[1][1], j[2][2], j[0][1], j[0][2], j[1][2]].map(|x| by * x).to_vec())
}

fn material(group: i64) -> String {
    format!("group {group}")
}

/// Laws between groups.
struct Contacts<'a> {
    laws: BTreeMap<(i64, i64), &'a MechanicsLaw>,
    groups: BTreeSet<i64>,
    fremond: bool,
}

impl<'a> Contacts<'a> {
    fn new(file: &'a MechanicsScene, said: &mut Vec<String>) -> Result<Self, String> {
        let contactors = file.objects.iter().filter(|o| o.birth.is_none());
        let contactors = contactors.flat_map(|o| &o.contactors);
        let groups: BTreeSet<i64> = contactors.map(|c: &MechanicsContactor| c.group).collect();
        let mut out = Self { laws: BTreeMap::new(), groups, fremond: false };
        let mut kinds = BTreeSet::new();
        for law in &file.laws {
            let place = format!("/data/nslaws/{}", law.name);
            match law.kind.as_str() {
                "NewtonImpactFrictionNSL"
                | "NewtonImpactNSL"
                | "FremondImpactFrictionNSL"
                | "NewtonImpactRollingFrictionNSL" => {}
                // Of joints, which name it.
                "RelayNSL" => continue,
                other => {
                    let expected = "NewtonImpactFrictionNSL, NewtonImpactRollingFrictionNSL, FremondImpactFrictionNSL, NewtonImpactNSL or RelayNSL";
                    return Err(format!("{place}: expected {expected}, found {other}"));
                }
            }
            if file.dimension == 2 && law.mu_rolling > 0.0 {
                let expected = "no rolling friction in dimension 2, where there is none here";
                return Err(format!(
                    "{place}: expected {expected}, found mu_r = {}",
                    law.mu_rolling
                ));
            }
            kinds.insert(law.kind == "FremondImpactFrictionNSL");
            let [a, b] = law.groups;
            let old = out.laws.insert((a.min(b), a.max(b)), law);
            if let Some(old) =
                old.filter(|old| (old.mu, old.e, old.mu_rolling) != (law.mu, law.e, law.mu_rolling))
            {
                said.push(format!("{place}: it stands in place of `{}`", old.name));
            }
        }
        said.extend(out.lawless(file));
        out.fremond = kinds == BTreeSet::from([true]);
        if kinds.len() > 1 {
            said.push(
                "Fremond's impact law is of all contacts or of none: Newton's is taken".into(),
            );
        }
        Ok(out)
    }

    fn meet(&self, a: i64, b: i64) -> bool {
        self.laws.contains_key(&(a.min(b), a.max(b)))
    }

    /// Says which groups of two bodies that meet have no law. There their contactors pass through each other, here bodies meet as a whole.
    fn lawless(&self, file: &MechanicsScene) -> Vec<String> {
        // Of each combination of groups two bodies are enough.
        let mut kinds: BTreeMap<(BTreeSet<i64>, bool), Vec<&MechanicsObject>> = BTreeMap::new();
        for object in file.objects.iter().filter(|o| o.birth.is_none()) {
            let groups = object.contactors.iter().map(|c| c.group).collect();
            let like = kinds.entry((groups, object.mass.is_some())).or_default();
            if like.len() < 2 {
                like.push(object);
            }
        }
        let all: Vec<_> =
            kinds.iter().flat_map(|(kind, like)| like.iter().map(move |o| (kind, *o))).collect();
        let mut found: BTreeMap<(i64, i64), String> = BTreeMap::new();
        for (k, &((own, moves), one)) in all.iter().enumerate() {
            for &((others, move_too), two) in &all[k + 1..] {
                let pairs = || own.iter().flat_map(|&a| others.iter().map(move |&b| (a, b)));
                if !(*moves || *move_too) || !pairs().any(|(a, b)| self.meet(a, b)) {
                    continue;
                }
                for (a, b) in pairs().filter(|&(a, b)| !self.meet(a, b)) {
                    let names = format!("`{}` and `{}`", one.name, two.name);
                    found.entry((a.min(b), a.max(b))).or_insert(names);
                }
            }
        }
        let say = |((a, b), names): (&(i64, i64), &String)| {
            format!(
                "/data/nslaws: none of groups {a} and {b}, and {names}, which have them, meet by other groups: `simulate` asks for one in `pairs`"
            )
        };
        found.iter().map(say).collect()
    }

    /// Whether all that may meet have a law.
    fn complete(&self) -> bool {
        self.groups.iter().all(|&a| self.groups.iter().all(|&b| self.meet(a, b)))
    }

    /// Keeps a body from those that it has no law with.
    fn of(&self, object: &MechanicsObject, body: &mut Value) {
        if self.complete() || object.contactors.is_empty() {
            return;
        }
        let own: BTreeSet<i64> = object.contactors.iter().map(|c| c.group).collect();
        let met = self.groups.iter().filter(|&&b| own.iter().any(|&a| self.meet(a, b)));
        let mut met: Vec<String> = met.map(|&g| material(g)).collect();
        if met.is_empty() {
            met.push("nothing".into());
        }
        body["groups"] = json!(own.iter().map(|&g| material(g)).collect::<Vec<_>>());
        body["collides_with"] = json!(met);
    }

    fn laws(&self, scene: &mut Value) {
        for &group in &self.groups {
            scene["materials"][material(group)] = json!({});
        }
        let known = |g: &i64| self.groups.contains(g);
        let laws = self.laws.iter().filter(|((a, b), _)| known(a) && known(b));
        let pairs: Vec<Value> = laws
            .map(|((a, b), law)| {
                let mut pair =
                    json!({"between": [material(*a), material(*b)], "mu": law.mu, "e": law.e});
                if law.mu_rolling > 0.0 {
                    pair["mu_rolling"] = json!(law.mu_rolling);
                }
                pair
            })
            .collect();
        if !pairs.is_empty() {
            scene["pairs"] = json!(pairs);
        }
        if self.fremond {
            scene["integrator"] = json!({"impact": "fremond"});
        }
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_io::siconos::MechanicsShape;
    use nonsmooth_simulate::SceneFile;

    use super::*;

    /// A ball with contactors of the groups on a floor of group 0; a law of groups 0 and 1.
    fn ball(groups: &[i64]) -> MechanicsScene {
        let primitive = |name: &str, kind: &str, size: &[f64]| MechanicsShape {
            name: name.into(),
            form: MechanicsForm::Primitive { kind: kind.into(), size: size.into() },
            outside_margin: 0.0,
        };
        let object = |name: &str, mass, shape: &str, groups: &[i64]| MechanicsObject {
            name: name.into(),
            mass,
            rotation: [1.0, 0.0, 0.0, 0.0],
            contactors: groups
                .iter()
                .map(|&group| MechanicsContactor {
                    shape: shape.into(),
                    group,
                    rotation: [1.0, 0.0, 0.0, 0.0],
                    ..MechanicsContactor::default()
                })
                .collect(),
            ..MechanicsObject::default()
        };
        MechanicsScene {
            dimension: 3,
            shapes: vec![primitive("S", "Sphere", &[0.5]), primitive("B", "Box", &[1.0; 3])],
            objects: vec![object("floor", None, "B", &[0]), object("ball", Some(1.0), "S", groups)],
            laws: vec![MechanicsLaw {
                name: "law".into(),
                kind: "NewtonImpactNSL".into(),
                groups: [0, 1],
                ..MechanicsLaw::default()
            }],
            ..MechanicsScene::default()
        }
    }

    #[test]
    fn bodies_that_meet_by_groups_without_a_law_are_named() {
        let simulated = |made: &Imported| SceneFile::parse(&made.scene, &[]).unwrap().world();
        for (groups, lawless) in [(&[1, 2][..], true), (&[1], false), (&[2], false)] {
            let made = scene(&ball(groups)).unwrap();
            let said = made.warnings.iter().any(|w| {
                w.contains("none of groups 0 and 2, and `floor` and `ball`, which have them, meet")
            });
            assert_eq!((said, simulated(&made).is_err()), (lawless, lawless), "{groups:?}");
        }
    }

    #[test]
    fn joints_without_their_points_and_axes_are_refused() {
        for (kind, points, axes) in
            [("PivotJointR", 1, 1), ("CylindricalJointR", 1, 1), ("KneeJointR", 1, 0)]
                .into_iter()
                .chain([("PrismaticJointR", 0, 1), ("FixedJointR", 0, 0)])
        {
            let with = |points: usize, axes: usize| {
                let mut file = ball(&[1]);
                file.joints.push(MechanicsJoint {
                    name: "j".into(),
                    kind: kind.into(),
                    objects: ("ball".into(), None),
                    points: vec![[0.0, 0.0, 1.0]; points],
                    axes: vec![[0.0, 1.0, 0.0]; axes],
                    ..MechanicsJoint::default()
                });
                scene(&file)
            };
            assert!(with(points, axes).is_ok(), "{kind}");
            let expected =
                |name: &str| format!("/data/joints/j: expected 1 in `{name}` of a {kind}");
            if points > 0 {
                assert!(with(0, axes).is_err_and(|e| e.starts_with(&expected("points"))), "{kind}");
            }
            if axes > 0 {
                assert!(with(points, 0).is_err_and(|e| e.starts_with(&expected("axes"))), "{kind}");
            }
        }
    }
}
