//! The tree of bodies, and where it stands.

use std::collections::{BTreeMap, BTreeSet};

use nonsmooth_scenes::vec3::{Mat3, Vec3, add, norm, scale, sub};
use nonsmooth_scenes::{MassProperties, Rotation};

use super::compiler::{Compiler, unknown};
use super::document::{Defaults, Element, Item, MAIN};
use super::geoms::{Assets, Geom};
use crate::SimulateError;
use crate::import::Frame;
use crate::rotation::unit;

/// A body of a model; the first one is the world.
pub(super) struct Body<'a> {
    pub name: String,
    pub item: Item<'a>,
    pub parent: usize,
    /// In the frame of its parent.
    pub place: Frame,
    pub joints: Vec<Joint<'a>>,
    pub geoms: Vec<Geom<'a>>,
    /// In its own frame, of `inertial` or its geoms.
    pub masses: Vec<MassProperties>,
    /// What `inertial` says.
    stated: Option<MassProperties>,
    /// In the frame of the world at the beginning, and where all joints are at their reference.
    pub at: Frame,
    pub at_reference: Frame,
}

/// A joint between a body and its parent.
pub(super) struct Joint<'a> {
    pub name: String,
    pub item: Item<'a>,
    pub kind: Kind,
    position: Vec3,
    axis: Vec3,
    /// Its coordinate in the document, and where the motion begins.
    pub reference: f64,
    pub start: f64,
    /// In the frame of the world, at the beginning.
    pub anchor: Vec3,
    pub direction: Vec3,
}

/// What joints are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Free,
    Ball,
    Hinge,
    Slide,
}

impl Kind {
    /// Coordinates of the position.
    fn count(self) -> usize {
        match self {
            Kind::Free => 7,
            Kind::Ball => 4,
            Kind::Hinge | Kind::Slide => 1,
        }
    }
}

/// Attributes of bodies, frames, inertials and joints that are read, or that change no motion.
const OF_BODIES: [&str; 13] = [
    "name",
    "class",
    "childclass",
    "pos",
    "quat",
    "axisangle",
    "xyaxes",
    "zaxis",
    "euler",
    "gravcomp",
    "mocap",
    "user",
    "sleep",
];
const OF_FRAMES: [&str; 8] =
    ["name", "childclass", "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler"];
const OF_INERTIALS: [&str; 9] =
    ["pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "mass", "diaginertia", "fullinertia"];
const OF_JOINTS: [&str; 20] = [
    "name",
    "class",
    "type",
    "pos",
    "axis",
    "ref",
    "range",
    "limited",
    "stiffness",
    "damping",
    "springref",
    "frictionloss",
    "armature",
    "group",
    "user",
    "margin",
    "solreflimit",
    "solimplimit",
    "solreffriction",
    "solimpfriction",
];

pub(super) struct Tree<'a> {
    pub bodies: Vec<Body<'a>>,
    pub said: Vec<String>,
    names: BTreeSet<String>,
}

/// Where something stands in the document, while it is read.
#[derive(Clone)]
struct Place {
    body: usize,
    /// Of a `frame` in the body.
    frame: Frame,
    class: String,
    /// Whether geoms have a mass.
    heavy: bool,
}

impl<'a> Tree<'a> {
    pub fn read(
        root: &'a Element,
        defaults: &'a Defaults,
        compiler: &Compiler,
        assets: &Assets<'a>,
        said: Vec<String>,
    ) -> Result<Self, SimulateError> {
        let mut worlds = root.named("worldbody");
        let Some(first) = worlds.next() else {
            return Err(root.wrong("<worldbody>", "none"));
        };
        let world = Body {
            name: "worldbody".into(),
            item: defaults.item(first, MAIN)?,
            parent: 0,
            place: Frame::HERE,
            joints: vec![],
            geoms: vec![],
            masses: vec![],
            stated: None,
            at: Frame::HERE,
            at_reference: Frame::HERE,
        };
        let mut out = Self {
            bodies: vec![world],
            said,
            // The name of the world is taken.
            names: BTreeSet::from(["world".to_owned(), "worldbody".to_owned()]),
        };
        let reader = Reader { defaults, compiler, assets };
        for element in std::iter::once(first).chain(worlds) {
            let heavy = compiler.from_geoms.unwrap_or(true);
            let place = Place { body: 0, frame: Frame::HERE, class: MAIN.into(), heavy };
            out.inner(&reader, element, &place)?;
        }
        Ok(out)
    }

    /// A name that nothing has yet.
    pub fn fresh(&mut self, name: String) -> String {
        let mut found = name.clone();
        let mut k = 2;
        while !self.names.insert(found.clone()) {
            found = format!("{name} {k}");
            k += 1;
        }
        found
    }

    /// What stands in a body or a frame.
    fn inner(
        &mut self,
        reader: &Reader<'a, '_>,
        element: &'a Element,
        place: &Place,
    ) -> Result<(), SimulateError> {
        for child in &element.children {
            let item = reader.defaults.item(child, &place.class)?;
            match child.tag.as_str() {
                "body" => self.body(reader, item, place)?,
                "frame" => {
                    unknown(&item, &OF_FRAMES, &mut self.said);
                    let class = child.attributes.get("childclass").unwrap_or(&place.class);
                    let frame = place.frame.then(&reader.compiler.frame(&item)?);
                    let inner = Place { frame, class: class.clone(), ..*place };
                    self.inner(reader, child, &inner)?;
                }
                "geom" => {
                    let said = &mut self.said;
                    let geom = reader.assets.geom(item, &place.frame, place.heavy, said)?;
                    let body = &mut self.bodies[place.body];
                    body.masses.extend(geom.mass);
                    body.geoms.push(geom);
                }
                "joint" | "freejoint" => self.joint(reader, item, place)?,
                "inertial" => {
                    unknown(&item, &OF_INERTIALS, &mut self.said);
                    let own = place.frame.mass(&own_mass(&item, reader.compiler)?);
                    self.bodies[place.body].stated = Some(own);
                }
                // What has no mass and touches nothing.
                "site" | "camera" | "light" | "plugin" => {}
                tag => {
                    let expected =
                        "body, frame, inertial, joint, freejoint, geom, site, camera or light";
                    return Err(child.wrong(expected, format!("<{tag}>")));
                }
            }
        }
        Ok(())
    }

    fn body(
        &mut self,
        reader: &Reader<'a, '_>,
        item: Item<'a>,
        place: &Place,
    ) -> Result<(), SimulateError> {
        unknown(&item, &OF_BODIES, &mut self.said);
        let number = self.bodies.len();
        let name = item.element.attributes.get("name");
        let name = self.fresh(name.cloned().unwrap_or_else(|| format!("body {number}")));
        let class = item.element.attributes.get("childclass").unwrap_or(&place.class);
        // Masses of geoms count where there is no inertial, or always.
        let heavy = reader.compiler.from_geoms.unwrap_or_else(|| !inertial(item.element));
        let own = Place { body: number, frame: Frame::HERE, class: class.clone(), heavy };
        self.bodies.push(Body {
            name,
            item,
            parent: place.body,
            place: place.frame.then(&reader.compiler.frame(&item)?),
            joints: vec![],
            geoms: vec![],
            masses: vec![],
            stated: None,
            at: Frame::HERE,
            at_reference: Frame::HERE,
        });
        self.inner(reader, item.element, &own)?;
        // Where the geoms have none, it is that of the inertial after all.
        let body = &mut self.bodies[number];
        if body.masses.is_empty() {
            body.masses.extend(body.stated.take());
        }
        Ok(())
    }

    fn joint(
        &mut self,
        reader: &Reader,
        item: Item<'a>,
        place: &Place,
    ) -> Result<(), SimulateError> {
        if place.body == 0 {
            return Err(item.wrong("a joint of a body", "one of the world"));
        }
        unknown(&item, &OF_JOINTS, &mut self.said);
        let kind = match (item.element.tag.as_str(), item.text("type").unwrap_or("hinge")) {
            ("freejoint", _) | (_, "free") => Kind::Free,
            (_, "ball") => Kind::Ball,
            (_, "hinge") => Kind::Hinge,
            (_, "slide") => Kind::Slide,
            (_, other) => return Err(item.wrong("free, ball, hinge or slide as `type`", other)),
        };
        if kind == Kind::Free && self.bodies[place.body].parent != 0 {
            return Err(item.wrong("a free joint of a body in the world", "one in another body"));
        }
        let axis = item.some::<3>("axis")?.unwrap_or([0.0, 0.0, 1.0]);
        let length = norm(axis);
        if length == 0.0 {
            return Err(item.wrong("a direction as `axis`", "zero"));
        }
        let unit = if kind == Kind::Hinge { reader.compiler.angle } else { 1.0 };
        let reference = match kind {
            Kind::Hinge | Kind::Slide => unit * item.real("ref", 0.0)?,
            Kind::Free | Kind::Ball => 0.0,
        };
        let name = match item.element.attributes.get("name") {
            Some(name) => name.clone(),
            None => {
                let body = &self.bodies[place.body];
                match body.joints.len() {
                    0 => format!("joint of {}", body.name),
                    k => format!("joint {} of {}", k + 1, body.name),
                }
            }
        };
        self.bodies[place.body].joints.push(Joint {
            name,
            item,
            kind,
            position: place.frame.point(item.some("pos")?.unwrap_or_default()),
            axis: place.frame.direction(scale(1.0 / length, axis)),
            reference,
            start: reference,
            anchor: [0.0; 3],
            direction: [0.0; 3],
        });
        Ok(())
    }

    /// Puts all bodies where the coordinates `q` say, or else where their joints are at their reference; those that are `led` where they are led.
    pub fn stand(
        &mut self,
        q: Option<&[f64]>,
        led: &BTreeMap<usize, Frame>,
    ) -> Result<(), SimulateError> {
        for k in 1..self.bodies.len() {
            let parent = self.bodies[k].parent;
            let above = self.bodies[parent].at_reference;
            self.bodies[k].at_reference = above.then(&self.bodies[k].place);
        }
        let mut next = 0;
        for k in 1..self.bodies.len() {
            let parent = self.bodies[k].parent;
            let beside = || self.bodies[parent].at.then(&self.bodies[k].place);
            let mut at = led.get(&k).copied().unwrap_or_else(beside);
            for joint in &mut self.bodies[k].joints {
                let own = q.map(|q| &q[next..next + joint.kind.count()]);
                next += joint.kind.count();
                (joint.anchor, joint.direction) =
                    (at.point(joint.position), at.direction(joint.axis));
                let Some(own) = own else { continue };
                let turn = match *own {
                    [x, y, z, a, b, c, d] => {
                        at = Frame { x: [x, y, z], q: quaternion(&joint.item, [a, b, c, d])? };
                        continue;
                    }
                    [a, b, c, d] => quaternion(&joint.item, [a, b, c, d])?,
                    [s] => {
                        joint.start = s;
                        let by = s - joint.reference;
                        if joint.kind == Kind::Slide {
                            at.x = add(at.x, scale(by, joint.direction));
                            continue;
                        }
                        Rotation::about(joint.axis, by)
                    }
                    _ => unreachable!("joints have 1, 4 or 7 coordinates"),
                };
                // The anchor stays where it is.
                at.q = unit(at.q.after(turn));
                at.x = sub(joint.anchor, at.direction(joint.position));
            }
            self.bodies[k].at = at;
        }
        Ok(())
    }

    /// How many coordinates its joints have.
    pub fn coordinates(&self) -> usize {
        self.bodies.iter().flat_map(|b| &b.joints).map(|j| j.kind.count()).sum()
    }

    /// The bodies by the names in the document.
    pub fn numbers(&self) -> BTreeMap<&str, usize> {
        let bodies = self.bodies.iter().enumerate();
        let named = bodies.filter_map(|(k, b)| {
            b.item.element.attributes.get("name").map(|name| (name.as_str(), k))
        });
        named.chain([("world", 0)]).collect()
    }

    /// The body that stands for all that do not move against it: the highest of them, 0 of what does not move.
    pub fn carrier(&self, mut body: usize) -> usize {
        while body != 0 && self.bodies[body].joints.is_empty() {
            body = self.bodies[body].parent;
        }
        body
    }
}

struct Reader<'a, 'b> {
    defaults: &'a Defaults,
    compiler: &'b Compiler,
    assets: &'b Assets<'a>,
}

/// Whether a body states its mass.
fn inertial(element: &Element) -> bool {
    element.named("inertial").next().is_some() || element.named("frame").any(inertial)
}

/// A quaternion of a keyframe, for what an item says.
pub(super) fn quaternion(item: &Item, q: [f64; 4]) -> Result<Rotation, SimulateError> {
    match q.iter().any(|x| *x != 0.0) {
        true => Ok(unit(Rotation(q))),
        false => Err(item.wrong("a quaternion in the keyframe", "zero")),
    }
}

/// `inertial`, in the frame of its body.
fn own_mass(item: &Item, compiler: &Compiler) -> Result<MassProperties, SimulateError> {
    let at = compiler.frame(item)?;
    let Some([mass]) = item.some::<1>("mass")? else {
        return Err(item.wrong("`mass`", "none"));
    };
    let inertia: Mat3 = match (item.some::<3>("diaginertia")?, item.some::<6>("fullinertia")?) {
        (None, Some([xx, yy, zz, xy, xz, yz])) => [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
        (Some([x, y, z]), None) => [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]],
        (None, None) => return Err(item.wrong("`diaginertia` or `fullinertia`", "none")),
        (Some(_), Some(_)) => {
            return Err(item.wrong("either `diaginertia` or `fullinertia`", "both"));
        }
    };
    Ok(at.mass(&MassProperties { mass, centre: [0.0; 3], inertia }))
}
