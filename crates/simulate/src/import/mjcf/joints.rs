//! Joints of bodies, equalities between them, actuators.

use nonsmooth_scenes::vec3::{cross, dot, norm, sub};
use serde_json::{Value, json};

use super::compiler::{Compiler, left_out, unknown};
use super::document::{Defaults, Element, Item, MAIN};
use super::model::{Joint, Kind, Tree};
use crate::SimulateError;

/// Directions and anchors are the same, or at right angles, up to this.
const SAME: f64 = 1e-9;

/// Attributes of motors and servos that are read, that they do not take over from defaults of other actuators, or that say what else than a joint they act on.
const OF_ACTUATORS: [&str; 37] = [
    "name",
    "class",
    "joint",
    "group",
    "user",
    "ctrlrange",
    "ctrllimited",
    "forcerange",
    "forcelimited",
    "gear",
    "kp",
    "kv",
    "dampratio",
    "timeconst",
    "inheritrange",
    "gaintype",
    "gainprm",
    "biastype",
    "biasprm",
    "armature",
    "damping",
    "delay",
    "nsample",
    "interp",
    "dyntype",
    "dynprm",
    "actdim",
    "actearly",
    "lengthrange",
    "jointinparent",
    "tendon",
    "site",
    "refsite",
    "cranksite",
    "cranklength",
    "slidersite",
    "body",
];

/// What a scene has of them.
#[derive(Default)]
pub(super) struct Joints {
    pub joints: Vec<Value>,
    pub couplings: Vec<Value>,
}

/// A coordinate of the document in the scene.
struct Coordinate {
    name: String,
    /// The joint of the scene.
    joint: usize,
    /// Whether it is the slide of a joint that has an angle, too.
    second: bool,
    start: f64,
    reference: f64,
}

pub(super) fn read(
    root: &Element,
    defaults: &Defaults,
    compiler: &Compiler,
    tree: &mut Tree,
    controls: &[f64],
) -> Result<Joints, SimulateError> {
    let mut out = Joints::default();
    let mut coordinates = vec![];
    let mut said = vec![];
    for (k, body) in tree.bodies.iter().enumerate().skip(1) {
        if body.joints.is_empty() {
            continue;
        }
        let Some(kind) = together(&body.joints) else {
            let found: Vec<_> = body.joints.iter().map(|j| name(j.kind)).collect();
            let expected = "joints that are free, ball, hinge, slide, hinge and slide along one axis, two hinges at a right angle, three hinges at one point, or two slides and a hinge across them";
            return Err(body.item.wrong(expected, found.join(", ")));
        };
        let lead = &body.joints[kind.lead];
        if kind.name == "free" {
            body.joints.iter().for_each(|joint| undriven(joint, &mut said));
            continue;
        }
        let mut table = json!({
            "name": lead.name, "kind": kind.name, "a": scene_name(tree, body.parent), "b": body.name,
            "anchor": lead.anchor, "axis": lead.direction,
        });
        debug_assert_eq!(tree.carrier(k), k, "a body with joints stands for itself");
        if !compiler.filter {
            table["collide"] = json!(true);
        }
        match kind.name {
            "universal" => table["reference"] = json!(body.joints[1].direction),
            "revolute" | "prismatic" | "cylindrical" => {
                for (i, joint) in body.joints.iter().enumerate() {
                    let drive = drive(joint, compiler, &mut said)?;
                    let second = i != kind.lead;
                    coordinates.push(Coordinate {
                        name: joint.name.clone(),
                        joint: out.joints.len(),
                        second,
                        start: joint.start,
                        reference: joint.reference,
                    });
                    let drive = drive.into_iter().filter(|(_, value)| !value.is_null());
                    for (key, value) in drive {
                        match second {
                            true => table["slide"][key] = value,
                            false => table[key] = value,
                        }
                    }
                }
            }
            _ => {}
        }
        if !matches!(kind.name, "revolute" | "prismatic" | "cylindrical") {
            body.joints.iter().for_each(|joint| undriven(joint, &mut said));
        }
        out.joints.push(table);
    }
    let mut rest = Rest { tree, coordinates, out, said };
    for element in root.named("equality").flat_map(|e| &e.children) {
        rest.equality(&defaults.equality(element)?, compiler)?;
    }
    let actuators = root.named("actuator").flat_map(|a| &a.children);
    for (k, element) in actuators.enumerate() {
        let control = controls.get(k).copied().unwrap_or(0.0);
        rest.actuator(&defaults.item(element, MAIN)?, defaults, compiler, control)?;
    }
    let Rest { out, said, .. } = rest;
    tree.said.extend(said);
    Ok(out)
}

fn name(kind: Kind) -> &'static str {
    match kind {
        Kind::Free => "free",
        Kind::Ball => "ball",
        Kind::Hinge => "hinge",
        Kind::Slide => "slide",
    }
}

/// What joints of one body are together.
struct Together {
    name: &'static str,
    /// The joint that has its anchor and axis.
    lead: usize,
}

fn together(joints: &[Joint]) -> Option<Together> {
    let of = |kind: Kind| -> Vec<usize> {
        (0..joints.len()).filter(|&k| joints[k].kind == kind).collect()
    };
    let (hinges, slides) = (of(Kind::Hinge), of(Kind::Slide));
    let axis = |k: usize| joints[k].direction;
    let apart = |k: usize, l: usize| sub(joints[k].anchor, joints[l].anchor);
    let across = |k: usize, l: usize| dot(axis(k), axis(l)).abs() < SAME;
    let independent = |all: &[usize]| match *all {
        [a, b, c] => dot(axis(a), cross(axis(b), axis(c))).abs() > 1e-3,
        _ => false,
    };
    let one_point = |all: &[usize]| all.iter().all(|&k| norm(apart(k, all[0])) < SAME);
    let gimbal = |all: &[usize]| independent(all) && one_point(all);
    let balls = of(Kind::Ball).len();
    let found = |name, lead| Some(Together { name, lead });
    match (of(Kind::Free).len(), balls, &hinges[..], &slides[..]) {
        (1, 0, [], []) => found("free", 0),
        (0, 1, [], []) => found("spherical", 0),
        (0, 0, &[hinge], []) => found("revolute", hinge),
        (0, 0, [], &[slide]) => found("prismatic", slide),
        // The slide goes along the axis of the hinge, wherever it is said to be.
        (0, 0, &[hinge], &[slide]) if norm(sub(axis(hinge), axis(slide))) < SAME => {
            found("cylindrical", hinge)
        }
        (0, 0, &[a, b], []) if across(a, b) && one_point(&hinges) => found("universal", a),
        (0, 0, all, []) if gimbal(all) => found("spherical", all[0]),
        (0, 0, &[hinge], &[a, b])
            if across(hinge, a) && across(hinge, b) && norm(cross(axis(a), axis(b))) > 1e-3 =>
        {
            found("planar", hinge)
        }
        (0, 1, [], all) if independent(all) => found("free", 0),
        (0, 0, turns, all) if independent(all) && gimbal(turns) => found("free", 0),
        _ => None,
    }
}

/// Whether joints leave their body all six coordinates.
pub(super) fn is_free(joints: &[Joint]) -> bool {
    together(joints).is_some_and(|kind| kind.name == "free")
}

/// What the scene calls a body of the document in a joint.
fn scene_name<'t>(tree: &'t Tree, body: usize) -> &'t str {
    match tree.carrier(body) {
        0 => "world",
        carrier => &tree.bodies[carrier].name,
    }
}

/// What acts along a hinge or a slide, by the keys of the scene.
fn drive(
    joint: &Joint,
    compiler: &Compiler,
    said: &mut Vec<String>,
) -> Result<[(&'static str, Value); 3], SimulateError> {
    let (item, start) = (&joint.item, joint.start);
    let unit = if joint.kind == Kind::Hinge { compiler.angle } else { 1.0 };
    let limits = match item.range("range", "limited", compiler.autolimits)? {
        Some([lower, upper]) => {
            json!({"lower": unit * lower - start, "upper": unit * upper - start})
        }
        None => Value::Null,
    };
    let mut linear = |name: &str| {
        // The first of several is the constant one.
        let [first, rest @ ..] = item.list(name, [0.0; 3])?;
        if rest != [0.0; 2] {
            said.push(format!("{}: of `{name}` the linear part is taken", item.key()));
        }
        Ok::<_, SimulateError>(first)
    };
    let (stiffness, damping) = (linear("stiffness")?, linear("damping")?);
    let rest = unit * item.real("springref", 0.0)? - start;
    let spring = match (stiffness, damping) {
        (0.0, 0.0) => Value::Null,
        (0.0, _) => json!({"damping": damping}),
        (_, 0.0) => json!({"stiffness": stiffness, "rest": rest}),
        _ => json!({"stiffness": stiffness, "damping": damping, "rest": rest}),
    };
    let friction = match item.real("frictionloss", 0.0)? {
        0.0 => Value::Null,
        friction => json!(friction),
    };
    if item.first("armature")?.is_some_and(|x| x != 0.0) {
        said.push(left_out(item, "armature"));
    }
    Ok([("limits", limits), ("spring", spring), ("friction", friction)])
}

/// Says what acts along a joint that has no coordinate in a scene.
fn undriven(joint: &Joint, said: &mut Vec<String>) {
    for name in ["range", "stiffness", "damping", "frictionloss", "armature"] {
        // A free joint that is <freejoint> takes no defaults.
        if joint.item.element.tag != "freejoint" && joint.item.acts(name) {
            said.push(left_out(&joint.item, name));
        }
    }
}

/// What is added to the joints of the bodies.
struct Rest<'t, 'a> {
    tree: &'t Tree<'a>,
    coordinates: Vec<Coordinate>,
    out: Joints,
    said: Vec<String>,
}

impl Rest<'_, '_> {
    fn equality(&mut self, item: &Item, compiler: &Compiler) -> Result<(), SimulateError> {
        if !item.flag("active", true)? {
            self.said.push(format!("{}: not active, left out", item.key()));
            return Ok(());
        }
        match item.element.tag.as_str() {
            kind @ ("connect" | "weld") => self.bodies(item, kind),
            "joint" => self.joints(item, compiler),
            _ => {
                self.said.push(format!("{}: left out", item.key()));
                Ok(())
            }
        }
    }

    /// `connect` and `weld`: a ball joint, and a fixed one.
    fn bodies(&mut self, item: &Item, kind: &str) -> Result<(), SimulateError> {
        let numbers = self.tree.numbers();
        let body = |name: &str, other: Option<usize>| {
            let of = |text: &str| numbers.get(text).copied();
            let found = item.text(name).map_or(other, of);
            let said = item.text(name).map_or("none".into(), |text| format!("`{text}`"));
            found.ok_or_else(|| item.wrong(format!("a body as `{name}`"), said))
        };
        let (a, b) = (body("body1", None)?, body("body2", Some(0))?);
        let tree = self.tree;
        let (one, two) = (&tree.bodies[a], &tree.bodies[b]);
        if tree.carrier(a) == tree.carrier(b) {
            return Err(item.wrong("two bodies that move against each other", "one"));
        }
        let (kind, anchor) = match kind {
            "connect" => {
                let Some(anchor) = item.some::<3>("anchor")? else {
                    return Err(item.wrong("`anchor`", "none"));
                };
                ("spherical", anchor)
            }
            _ => {
                let pose = item.some::<7>("relpose")?;
                if pose.is_some_and(|pose| pose[3..].iter().any(|x| *x != 0.0)) {
                    self.said.push(format!(
                        "{}: `relpose` is left out: the bodies are kept as they stand",
                        item.key()
                    ));
                }
                ("fixed", [0.0; 3])
            }
        };
        let at = one.at.point(anchor);
        // What meets at the reference may be apart in a keyframe: where the one would be that the other holds.
        let held = two.at.then(&two.at_reference.back()).then(&one.at_reference);
        let gap = norm(sub(at, held.point(anchor)));
        let [w, x, y, z] = held.back().q.after(one.at.q).0;
        let turn = match kind {
            "fixed" => 2.0 * norm([x, y, z]).atan2(w.abs()),
            _ => 0.0,
        };
        let open = [(gap, "m"), (turn, "rad")].into_iter().filter(|(by, _)| *by > 1e-6);
        let open: Vec<_> = open.map(|(by, unit)| format!("{by:.1e} {unit}")).collect();
        if !open.is_empty() {
            self.said.push(format!(
                "{}: open by {} where the motion begins, and kept as it stands",
                item.key(),
                open.join(" and ")
            ));
        }
        let name = item.element.attributes.get("name").cloned();
        let name = name.unwrap_or_else(|| format!("{} and {}", one.name, two.name));
        self.out.joints.push(json!({
            "name": self.fresh(name), "kind": kind, "a": scene_name(tree, a),
            "b": scene_name(tree, b), "anchor": at, "collide": true,
        }));
        Ok(())
    }

    /// A name that no joint has.
    fn fresh(&self, name: String) -> String {
        let taken = |name: &str| self.out.joints.iter().any(|j| j["name"] == name);
        if !taken(&name) {
            return name;
        }
        (2..).map(|k| format!("{name} {k}")).find(|n| !taken(n)).unwrap_or(name)
    }

    /// `joint`: a coordinate that follows another, or stays.
    fn joints(&mut self, item: &Item, compiler: &Compiler) -> Result<(), SimulateError> {
        let poly = item.list("polycoef", [0.0, 1.0, 0.0, 0.0, 0.0])?;
        let of = |name: &str, coordinates: &[Coordinate]| -> Result<usize, SimulateError> {
            let text = item.text(name).unwrap_or_default();
            let found = coordinates.iter().position(|c| c.name == text);
            found.ok_or_else(|| {
                item.wrong(format!("a hinge or slide of its own as `{name}`"), format!("`{text}`"))
            })
        };
        let first = of("joint1", &self.coordinates)?;
        if item.text("joint2").is_none() {
            let c = &self.coordinates[first];
            let target = poly[0] + c.reference - c.start;
            if target.abs() > 1e-9 {
                self.said.push(format!(
                    "{}: away from its value by {target:.1e} where the motion begins, and kept there",
                    item.key()
                ));
            }
            let table = &mut self.out.joints[c.joint];
            let table = if c.second { &mut table["slide"] } else { table };
            table["motion"] = json!({"velocity": 0.0});
            return Ok(());
        }
        let second = of("joint2", &self.coordinates)?;
        if poly[2..].iter().any(|x| *x != 0.0) {
            return Err(item.wrong("a linear `polycoef`", format!("{poly:?}")));
        }
        let [a, b] = [first, second].map(|k| &self.coordinates[k]);
        let off = (a.start - a.reference) - poly[0] - poly[1] * (b.start - b.reference);
        // Hinges are in radians here and there.
        if off.abs() > 1e-9 * compiler.angle.max(1.0) {
            self.said.push(format!(
                "{}: open by {off:.1e} where the motion begins, and kept as it stands",
                item.key()
            ));
        }
        let term = |c: &Coordinate, weight: f64| {
            let mut term = json!({"joint": self.out.joints[c.joint]["name"], "weight": weight});
            if c.second {
                term["coordinate"] = json!("slide");
            }
            term
        };
        let coupling = json!({
            "name": format!("{} follows {}", a.name, b.name),
            "terms": [term(a, 1.0), term(b, -poly[1])],
        });
        self.out.couplings.push(coupling);
        Ok(())
    }

    fn actuator(
        &mut self,
        item: &Item,
        defaults: &Defaults,
        compiler: &Compiler,
        control: f64,
    ) -> Result<(), SimulateError> {
        let kind = item.element.tag.as_str();
        if compiler.disabled.contains(&item.whole("group", 0)?) {
            self.said.push(format!("{}: left out: its group is disabled", item.key()));
            return Ok(());
        }
        if !matches!(kind, "motor" | "position" | "velocity") {
            self.said.push(format!(
                "{}: left out, with what it does without a control: motors of scenes are `position` and `velocity`",
                item.key()
            ));
            return Ok(());
        }
        unknown(item, &OF_ACTUATORS, &mut self.said);
        let added = ["armature", "damping", "delay"].into_iter().filter(|name| item.acts(name));
        self.said.extend(added.map(|name| left_out(item, name)));
        let range = item.range("ctrlrange", "ctrllimited", compiler.autolimits)?;
        let control = match range.filter(|_| compiler.clamps) {
            Some([lower, upper]) => control.clamp(lower, upper),
            None => control,
        };
        if kind == "motor" {
            self.said.push(match control {
                0.0 => format!(
                    "{}: its control comes from outside, so it does nothing here: left out",
                    item.key()
                ),
                _ => format!("{}: left out, with its control of {control}", item.key()),
            });
            return Ok(());
        }
        let known = item.text("joint");
        let found = known.and_then(|joint| self.coordinates.iter().find(|c| c.name == joint));
        let Some(c) = found else {
            self.said.push(format!("{}: left out: no hinge or slide of its own", item.key()));
            return Ok(());
        };
        let servo = defaults.servo(item.element)?;
        self.said.extend(servo.left_out().map(|what| format!("{}: {what}", item.key())));
        let [gear, ..] = item.list("gear", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
        let mut motor = match kind {
            "position" => json!({
                "position": control / gear - c.start,
                "stiffness": gear * gear * servo.gain,
                // A positive one is a ratio, which is left out.
                "damping": gear * gear * servo.bias[2].min(0.0).abs(),
            }),
            _ => {
                if control != 0.0 {
                    self.said.push(format!("{}: its control is taken for 0", item.key()));
                }
                json!({"position": -c.start, "damping": gear * gear * servo.gain})
            }
        };
        if gear == 0.0 {
            return Err(item.wrong("a `gear` that is not 0", gear));
        }
        if let Some([lower, upper]) =
            item.range("forcerange", "forcelimited", compiler.autolimits)?
        {
            if lower != -upper {
                self.said.push(format!(
                    "{}: of `forcerange` the larger size is taken for both signs",
                    item.key()
                ));
            }
            motor["max"] = json!(gear.abs() * upper.abs().max(lower.abs()));
        }
        let table = &mut self.out.joints[c.joint];
        let table = if c.second { &mut table["slide"] } else { table };
        if table.get("motor").is_some() {
            self.said.push(format!("{}: left out, for the joint has a motor", item.key()));
            return Ok(());
        }
        table["motor"] = motor;
        Ok(())
    }
}
