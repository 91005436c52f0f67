//! URDF: links are bodies, those that fixed joints connect one body; collision geometry is box, cylinder, sphere, capsule, mesh (STL, OBJ). Joints are revolute,
//! continuous, prismatic, planar, spherical and floating, with limits, damping, friction and mimic. What it does not know, and what is not taken over, is said in warnings:
//! the law of contact, effort and velocity limits, transmissions, and what is there to be looked at. xacro has to be expanded before.

use std::collections::BTreeMap;

use nonsmooth_scenes::vec3::{Mat3, Vec3, apply, congruence, sub};
use nonsmooth_scenes::{MassProperties, Rotation};
use roxmltree::{Document, Node};
use serde_json::{Value, json};

use super::{Frame, Imported, about, entries, text as text_of};
use crate::SimulateError;
use crate::rotation::unit;

/// Friction of all pairs: the format knows none.
const MU: f64 = 0.5;

struct Link<'a> {
    name: &'a str,
    node: Node<'a, 'a>,
    /// The joint above, if it is not the root.
    parent: Option<usize>,
    frame: Option<Frame>,
}

struct Joint<'a> {
    name: &'a str,
    kind: &'a str,
    node: Node<'a, 'a>,
    parent: usize,
    child: usize,
    origin: Frame,
}

/// The robot of a URDF document, its joints at zero, the frame of its root that of the world. Meshes stay files, beside the scene.
///
/// Errors: what is no URDF, by the link or joint and the attribute; a link that moves and has no mass.
pub fn urdf(text: &str) -> Result<Imported, SimulateError> {
    let wrong = |path: &str, expected: &str, found: String| {
        Err(SimulateError::value(path, expected, found))
    };
    let document = Document::parse(text).map_err(|e| {
        SimulateError::value("robot", "an XML document", e.to_string().replace('\n', " "))
    })?;
    let robot = document.root_element();
    if robot.tag_name().name() != "robot" {
        return wrong("robot", "a URDF document", format!("<{}>", robot.tag_name().name()));
    }
    if text.contains("<xacro:") {
        return wrong("robot", "URDF that xacro has been expanded in", "<xacro: ...>".into());
    }
    let mut links: Vec<Link> = vec![];
    let mut number = BTreeMap::new();
    for node in elements(robot, "link") {
        let name = attribute(node, "name", "link")?;
        if number.insert(name, links.len()).is_some() {
            return wrong(&format!("link `{name}`"), "a name that is not taken", "it again".into());
        }
        links.push(Link { name, node, parent: None, frame: None });
    }
    let mut joints: Vec<Joint> = vec![];
    for node in elements(robot, "joint") {
        let name = attribute(node, "name", "joint")?;
        let key = format!("joint `{name}`");
        let end = |tag: &str| {
            let there = element(node, tag);
            let link = there.map_or(Ok(""), |n| attribute(n, "link", &key))?;
            number.get(link).copied().ok_or_else(|| {
                let expected = format!("a {tag} that is a link");
                SimulateError::value(&key, expected, format!("`{link}`"))
            })
        };
        let (parent, child) = (end("parent")?, end("child")?);
        if links[child].parent.replace(joints.len()).is_some() {
            let found = format!("another joint above `{}`", links[child].name);
            return wrong(&key, "a tree of links", found);
        }
        let (kind, origin) = (attribute(node, "type", &key)?, origin(node, &key)?);
        joints.push(Joint { name, kind, node, parent, child, origin });
    }
    if links.is_empty() {
        return wrong("robot", "a link at least", "none".into());
    }
    for k in 0..links.len() {
        place(&mut links, &joints, k)?;
    }
    let roots: Vec<&str> = links.iter().filter(|l| l.parent.is_none()).map(|l| l.name).collect();
    if roots.len() != 1 {
        return wrong("robot", "one link above all others", roots.join(", "));
    }
    let mut robot = Robot { links: &links, joints: &joints, warnings: vec![] };
    let scene = robot.scene(document.root_element().attribute("name").unwrap_or("robot"))?;
    Ok(Imported { scene: text_of(&scene)?, warnings: robot.warnings })
}

/// Where link k is, by way of all links above it.
fn place(links: &mut [Link], joints: &[Joint], k: usize) -> Result<(), SimulateError> {
    let mut above = vec![k];
    while let Some(j) = links[above[above.len() - 1]].parent {
        if links[above[above.len() - 1]].frame.is_some() {
            break;
        }
        above.push(joints[j].parent);
        if above.len() > links.len() {
            let key = format!("joint `{}`", joints[j].name);
            return Err(SimulateError::value(key, "a tree of links", "a ring"));
        }
    }
    for &k in above.iter().rev() {
        let frame = match links[k].parent {
            _ if links[k].frame.is_some() => continue,
            None => Frame::HERE,
            Some(j) => {
                let parent = links[joints[j].parent].frame.unwrap_or(Frame::HERE);
                parent.then(&joints[j].origin)
            }
        };
        links[k].frame = Some(frame);
    }
    Ok(())
}

struct Robot<'a> {
    links: &'a [Link<'a>],
    joints: &'a [Joint<'a>],
    warnings: Vec<String>,
}

impl<'a> Robot<'a> {
    fn frame(&self, link: usize) -> Frame {
        self.links[link].frame.unwrap_or(Frame::HERE)
    }

    /// The link that stands for all that are fixed to it: the highest of them.
    fn body_of(&self, mut link: usize) -> usize {
        while let Some(j) = self.links[link].parent.filter(|&j| self.joints[j].kind == "fixed") {
            link = self.joints[j].parent;
        }
        link
    }

    fn scene(&mut self, name: &str) -> Result<Value, SimulateError> {
        let groups: Vec<usize> = (0..self.links.len()).map(|k| self.body_of(k)).collect();
        let mut bodies = vec![];
        let mut world = vec![false; self.links.len()];
        for root in 0..self.links.len() {
            if groups[root] != root {
                continue;
            }
            let members: Vec<usize> =
                (0..self.links.len()).filter(|&k| groups[k] == root).collect();
            match self.body(root, &members)? {
                Some(body) => bodies.push(body),
                None => world[root] = true,
            }
        }
        let mut joints = vec![];
        let mut couplings = vec![];
        for joint in self.joints.iter().filter(|j| j.kind != "fixed" && j.kind != "floating") {
            let of = |link: usize| match world[groups[link]] {
                true => "world",
                false => self.called(groups[link]),
            };
            let (mut table, mimic) = self.joint(joint)?;
            (table["a"], table["b"]) = (json!(of(joint.parent)), json!(of(joint.child)));
            couplings.extend(mimic);
            joints.push(table);
        }
        for joint in self.joints {
            let key = format!("joint `{}`", joint.name);
            let limit = element(joint.node, "limit");
            if limit.is_some_and(|l| l.has_attribute("effort") || l.has_attribute("velocity")) {
                self.warnings.push(format!(
                    "{key}: effort and velocity of its limit are of a motor, which URDF does not have: left out"
                ));
            }
            if matches!(joint.kind, "revolute" | "continuous" | "prismatic" | "fixed") {
                continue;
            }
            for (tag, names) in
                [("limit", ["lower", "upper"]), ("dynamics", ["damping", "friction"])]
            {
                let Some(node) = element(joint.node, tag) else { continue };
                let [a, b] = names.map(|name| real(node, name, &key));
                if [a?, b?].into_iter().flatten().any(|x| x != 0.0) {
                    let [a, b] = names;
                    self.warnings
                        .push(format!("{key}: {a} and {b} of a {} joint are left out", joint.kind));
                }
            }
        }
        let links = self.links.iter().map(|l| ("link", l.name, l.node));
        for (tag, name, node) in links.chain(self.joints.iter().map(|j| ("joint", j.name, j.node)))
        {
            let turned = |n: &Node| {
                let seen = n.parent().is_some_and(|p| p.has_tag_name("visual"));
                n.has_tag_name("origin") && n.has_attribute("quat_xyzw") && !seen
            };
            if !knows_quaternions(node) && node.descendants().any(|n| turned(&n)) {
                self.warnings.push(format!(
                    "{tag} `{name}`: `quat_xyzw` is left out, for it means something only in a <robot> of version 1.1"
                ));
            }
        }
        self.warnings.push(format!(
            "URDF has no law of contact and no ground: pairs_default is mu = {MU}, e = 0, and nothing stands below the robot"
        ));
        let mut scene = json!({
            "format": crate::scene_file::FORMAT,
            "version": crate::scene_file::VERSION,
            "name": name,
            "time": {"h": 1e-3, "end": 1.0},
            "pairs_default": {"mu": MU},
            "bodies": bodies,
        });
        if !joints.is_empty() {
            scene["joints"] = json!(joints);
        }
        if !couplings.is_empty() {
            scene["couplings"] = json!(couplings);
        }
        Ok(scene)
    }

    /// The name of a link's body: joints of scenes call what is no body `world`.
    fn called(&self, link: usize) -> &'a str {
        let taken = |name: &str| self.links.iter().any(|l| l.name == name);
        match self.links[link].name {
            "world" if !taken("world_link") => "world_link",
            name => name,
        }
    }

    /// A body of links that do not move against each other, in the axes of the first. What is fixed to a root called `world` stands, as do roots without any mass: no body where there is no shape either.
    fn body(&mut self, root: usize, members: &[usize]) -> Result<Option<Value>, SimulateError> {
        let frame = self.frame(root);
        let inner = |link: usize| frame.back().then(&self.frame(link));
        let (mut masses, mut heavy, mut shapes) = (vec![], vec![], vec![]);
        for &k in members {
            let (link, place) = (&self.links[k], inner(k));
            let key = format!("link `{}`", link.name);
            if let Some(node) = element(link.node, "inertial")
                && let Some(own) = inertial(node, &key)?
            {
                masses.push(place.mass(&own));
                heavy.push(k);
            }
            for node in elements(link.node, "collision") {
                let at = place.then(&origin(node, &key)?);
                shapes.push((geometry(node, &key)?, at));
            }
        }
        let name = self.links[root].name;
        let moved = self.links[root].parent.map(|j| &self.joints[j]);
        let mut body = json!({"name": self.called(root)});
        let weightless = moved.is_none() && !heavy.contains(&root);
        let stands = weightless && (heavy.is_empty() || name == "world");
        if weightless && !stands {
            self.warnings.push(format!(
                "link `{name}`: a root without mass moves with what is fixed to it, as `{}`; one called `world` would stand",
                self.links[heavy[0]].name
            ));
        }
        let centre = match moved {
            None if stands => {
                if shapes.is_empty() {
                    return Ok(None);
                }
                body["fixed"] = json!(true);
                [0.0; 3]
            }
            Some(joint) if masses.is_empty() => {
                let expected =
                    format!("a mass, for joint `{}` of type {} moves it", joint.name, joint.kind);
                return Err(SimulateError::value(format!("link `{name}`"), expected, "none"));
            }
            _ => {
                let MassProperties { mass, centre, inertia } = MassProperties::joined(&masses);
                body["mass"] = json!(mass);
                body["inertia"] = json!(entries(&inertia));
                centre
            }
        };
        body["position"] = json!(frame.point(centre));
        body["rotation"] = json!({"quaternion": frame.q.0});
        let parts = shapes.into_iter().map(|(shape, at)| {
            json!({
                "shape": shape, "position": sub(at.x, centre), "rotation": {"quaternion": at.q.0},
            })
        });
        body["shapes"] = parts.collect();
        if body["shapes"].as_array().is_none_or(Vec::is_empty) {
            body.as_object_mut().map(|b| b.remove("shapes"));
            self.warnings
                .push(format!("link `{name}`: no collision geometry, so nothing touches it"));
        }
        Ok(Some(body))
    }

    /// A joint without its bodies, and what couples it to another one.
    fn joint(&self, joint: &Joint) -> Result<(Value, Option<Value>), SimulateError> {
        let key = format!("joint `{}`", joint.name);
        let frame = self.frame(joint.child);
        let kind = match joint.kind {
            "revolute" | "continuous" => "revolute",
            known @ ("prismatic" | "planar" | "spherical") => known,
            other => {
                let expected =
                    "fixed, revolute, continuous, prismatic, planar, spherical or floating";
                return Err(SimulateError::value(format!("{key}.type"), expected, other));
            }
        };
        let axis = match element(joint.node, "axis") {
            Some(node) => triple(node, "xyz", &key)?.unwrap_or([1.0, 0.0, 0.0]),
            None => [1.0, 0.0, 0.0],
        };
        let axis = apply(&frame.q.matrix(), axis);
        let mut table = json!({
            "name": joint.name, "kind": kind, "a": "", "b": "", "anchor": frame.x, "axis": axis,
        });
        let number = |tag: &str, name: &str| match element(joint.node, tag) {
            Some(node) => real(node, name, &key),
            None => Ok(None),
        };
        if let "revolute" | "prismatic" = joint.kind {
            if element(joint.node, "limit").is_none() {
                let expected = format!("<limit>, which a {} joint has", joint.kind);
                return Err(SimulateError::value(key, expected, "none"));
            }
            let [lower, upper] =
                [number("limit", "lower")?, number("limit", "upper")?].map(|x| x.unwrap_or(0.0));
            table["limits"] = json!({"lower": lower, "upper": upper});
        }
        if kind == "revolute" || kind == "prismatic" {
            if let Some(damping) = number("dynamics", "damping")?.filter(|x| *x != 0.0) {
                table["spring"] = json!({"damping": damping});
            }
            if let Some(friction) = number("dynamics", "friction")?.filter(|x| *x != 0.0) {
                table["friction"] = json!(friction);
            }
        }
        let mimic = match element(joint.node, "mimic") {
            None => None,
            Some(node) => {
                let other = attribute(node, "joint", &key)?;
                let multiplier = real(node, "multiplier", &key)?.unwrap_or(1.0);
                Some(json!({
                    "name": format!("{} mimics {other}", joint.name),
                    "terms": [
                        {"joint": joint.name, "weight": 1.0},
                        {"joint": other, "weight": -multiplier},
                    ],
                }))
            }
        };
        Ok((table, mimic))
    }
}

fn elements<'a>(node: Node<'a, 'a>, tag: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |n| n.has_tag_name(tag))
}

fn element<'a>(node: Node<'a, 'a>, tag: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|n| n.has_tag_name(tag))
}

fn attribute<'a>(node: Node<'a, 'a>, name: &str, key: &str) -> Result<&'a str, SimulateError> {
    node.attribute(name).ok_or_else(|| {
        let tag = node.tag_name().name();
        SimulateError::value(key, format!("<{tag}> with `{name}`"), "none")
    })
}

/// The numbers of an attribute, each finite, if it is there.
fn numbers(node: Node, name: &str, key: &str) -> Result<Option<Vec<f64>>, SimulateError> {
    let Some(text) = node.attribute(name) else { return Ok(None) };
    let read: Option<Vec<f64>> = text
        .split_whitespace()
        .map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    read.map(Some).ok_or_else(|| {
        let key = format!("{key}.{}.{name}", node.tag_name().name());
        SimulateError::value(key, "finite numbers", format!("`{text}`"))
    })
}

fn some<const N: usize>(
    node: Node,
    name: &str,
    key: &str,
) -> Result<Option<[f64; N]>, SimulateError> {
    let Some(found) = numbers(node, name, key)? else { return Ok(None) };
    let count = found.len();
    found.try_into().map(Some).map_err(|_| {
        let key = format!("{key}.{}.{name}", node.tag_name().name());
        SimulateError::value(key, format!("{N} numbers"), count)
    })
}

fn triple(node: Node, name: &str, key: &str) -> Result<Option<Vec3>, SimulateError> {
    some(node, name, key)
}

fn real(node: Node, name: &str, key: &str) -> Result<Option<f64>, SimulateError> {
    Ok(some::<1>(node, name, key)?.map(|[x]| x))
}

fn needed(node: Node, name: &str, key: &str) -> Result<f64, SimulateError> {
    real(node, name, key)?.ok_or_else(|| {
        let tag = node.tag_name().name();
        SimulateError::value(key, format!("<{tag}> with `{name}`"), "none")
    })
}

/// Whether quaternions have a meaning in the document: from version 1.1 on.
fn knows_quaternions(node: Node) -> bool {
    let version = node.document().root_element().attribute("version");
    version.and_then(|v| v.parse().ok()).is_some_and(|v: f64| v >= 1.1)
}

/// `xyz` with `rpy`, turned about the fixed axes x, y, z in this order, or with `quat_xyzw`.
fn origin<'a>(node: Node<'a, 'a>, key: &str) -> Result<Frame, SimulateError> {
    let Some(node) = element(node, "origin") else { return Ok(Frame::HERE) };
    let x = triple(node, "xyz", key)?.unwrap_or_default();
    let rpy = triple(node, "rpy", key)?;
    let quaternion = some::<4>(node, "quat_xyzw", key)?.filter(|_| knows_quaternions(node));
    let q = match (rpy, quaternion) {
        (Some(_), Some(_)) => {
            return Err(SimulateError::value(key, "either `rpy` or `quat_xyzw`", "both"));
        }
        (None, Some([0.0, 0.0, 0.0, 0.0])) => {
            return Err(SimulateError::value(key, "a quaternion as `quat_xyzw`", "zero"));
        }
        (None, Some([x, y, z, w])) => Rotation([w, x, y, z]),
        (rpy, None) => {
            let [r, p, y] = rpy.unwrap_or_default();
            about(2, y).after(about(1, p)).after(about(0, r))
        }
    };
    Ok(Frame { x, q: unit(q) })
}

/// Mass and inertia of a link in its frame; none without mass.
fn inertial<'a>(node: Node<'a, 'a>, key: &str) -> Result<Option<MassProperties>, SimulateError> {
    let at = origin(node, key)?;
    let mass = element(node, "mass").map(|n| needed(n, "value", key)).transpose()?.unwrap_or(0.0);
    if mass < 0.0 {
        return Err(SimulateError::value(
            format!("{key}.mass.value"),
            "a mass of at least 0",
            mass,
        ));
    }
    if mass == 0.0 {
        return Ok(None);
    }
    let Some(inertia) = element(node, "inertia") else {
        return Err(SimulateError::value(key, "<inertia> beside a mass", "none"));
    };
    let of = |name: &str| real(inertia, name, key).map(|x| x.unwrap_or(0.0));
    let [xx, yy, zz] = [of("ixx")?, of("iyy")?, of("izz")?];
    let [xy, xz, yz] = [of("ixy")?, of("ixz")?, of("iyz")?];
    let j: Mat3 = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    Ok(Some(MassProperties { mass, centre: at.x, inertia: congruence(&at.q.matrix(), &j) }))
}

/// The shape of a collision.
fn geometry<'a>(node: Node<'a, 'a>, key: &str) -> Result<Value, SimulateError> {
    let key = format!("{key}.collision");
    let shape = element(node, "geometry").and_then(|g| g.children().find(Node::is_element));
    let Some(shape) = shape else {
        return Err(SimulateError::value(key, "<geometry> with a shape", "none"));
    };
    let half = |name: &str| needed(shape, name, &key).map(|x| 0.5 * x);
    Ok(match shape.tag_name().name() {
        "box" => {
            let size = triple(shape, "size", &key)?
                .ok_or_else(|| SimulateError::value(&key, "<box> with `size`", "none"))?;
            json!({"kind": "box", "half": size.map(|x| 0.5 * x)})
        }
        "sphere" => json!({"kind": "sphere", "radius": needed(shape, "radius", &key)?}),
        kind @ ("cylinder" | "capsule") => json!({
            "kind": kind, "radius": needed(shape, "radius", &key)?, "half_length": half("length")?,
        }),
        "mesh" => {
            let name = attribute(shape, "filename", &key)?;
            // Packages are folders beside the scene.
            let file = ["package://", "file://"].iter().find_map(|p| name.strip_prefix(p));
            let mut mesh = json!({"kind": "mesh", "file": file.unwrap_or(name)});
            if let Some([x, y, z]) = triple(shape, "scale", &key)? {
                if x != y || y != z || x.is_nan() || x <= 0.0 {
                    let expected = "the same positive scale along all axes";
                    return Err(SimulateError::value(key, expected, format!("{x} {y} {z}")));
                }
                mesh["scale"] = json!(x);
            }
            mesh
        }
        other => {
            let expected = "box, cylinder, sphere, capsule or mesh";
            return Err(SimulateError::value(key, expected, format!("<{other}>")));
        }
    })
}
