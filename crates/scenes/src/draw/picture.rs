//! What is drawn, whatever draws it: bodies with their shapes, and frames with where these are and what happens at the contacts.

use std::array::from_fn;
use std::io;

use nonsmooth_problem::check::Motion;
use serde::{Deserialize, Serialize};
use serde_json::ser::{CompactFormatter, Formatter, Serializer};

use crate::body::Rotation;
use crate::error::{positive, require};
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, add, apply, dot, mean, norm, scale, sub};
use crate::{Ground, Scene, SceneError, Shape};

/// Lengths and velocities beyond this are not drawn: their squares and products would overflow.
const FAR: f64 = 1e30;

/// A scene as it is drawn. It serialises, so that a file or a page can carry it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// What the scene is called.
    pub name: String,
    /// The ground.
    pub ground: Option<Ground>,
    /// The bodies and elastic solids as contacts count them, then what is fixed.
    pub bodies: Vec<Body>,
    /// One after the other in time, at least one.
    pub frames: Vec<Frame>,
}

/// A body's shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Whether it is an obstacle, which no contact counts.
    pub fixed: bool,
    /// Convex parts about the origin of the body's frame.
    pub parts: Vec<Part>,
}

/// A convex part of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// A ball about the origin of the body's frame.
    Ball {
        /// Its radius, m.
        radius: f64,
    },
    /// A convex polyhedron.
    Convex {
        /// The vertices in the body's frame, m.
        vertices: Vec<Vec3>,
        /// The faces by indices of vertices, counter-clockwise seen from outside.
        faces: Vec<Vec<usize>>,
    },
}

/// A state of the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Where each body is.
    pub poses: Vec<Pose>,
    /// The contacts.
    pub contacts: Vec<Touch>,
}

/// Where a body is and how it moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// The origin of its frame, m.
    pub position: Vec3,
    /// The unit quaternion `[w, x, y, z]` that turns its frame into that of the world.
    pub rotation: [f64; 4],
    /// The velocity of the origin, m/s.
    pub velocity: Vec3,
}

/// A contact, and what is known of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Touch {
    /// The first body; none for the ground.
    pub a: Option<usize>,
    /// The second body, on which the impulse acts.
    pub b: usize,
    /// Where b is touched, m.
    pub point: Vec3,
    /// From the point at which a itself touches to `point`: zero but for periodic images, m.
    pub offset: Vec3,
    /// The local frame `[N, T1, T2]`.
    pub frame: [Vec3; 3],
    /// The coefficient of friction.
    pub mu: f64,
    /// The impulse `[N, T1, T2]`, N·s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub r: Option<Vec3>,
    /// The relative velocity `[N, T1, T2]` after the step, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub u: Option<Vec3>,
    /// What the contact does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<Motion>,
}

impl Touch {
    /// The impulse on b in the frame of the world.
    pub(super) fn impulse(&self) -> Option<Vec3> {
        let terms = |r: Vec3| (0..3).fold([0.0; 3], |s, k| add(s, scale(r[k], self.frame[k])));
        self.r.map(terms)
    }
}

/// What a solution says of the contacts, in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer<'a> {
    /// Impulses r, `[N, T1, T2]` each, N·s; of rolling friction five, whose moments are not drawn.
    pub r: &'a [f64],
    /// Relative velocities u, `[N, T1, T2]` each, m/s.
    pub u: Option<&'a [f64]>,
    /// What each contact does.
    pub motions: Option<&'a [Motion]>,
}

/// The components of a contact with rolling friction.
const ROLLING: usize = 5;

impl Picture {
    /// The scene before the step, its one frame.
    ///
    /// Errors: those of [`Scene::validate`]; nothing to draw.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        scene.validate()?;
        let (mut bodies, mut poses) = (vec![], vec![]);
        let mut push = |fixed, parts, position, Rotation(rotation): Rotation, velocity| {
            bodies.push(Body { fixed, parts });
            poses.push(Pose { position, rotation, velocity });
        };
        for body in &scene.bodies {
            push(false, parts(&body.shape)?, body.position, body.rotation, body.velocity);
        }
        for solid in &scene.solids {
            // The frame of a solid turns with it no more than its strain is drawn.
            let surface = solid.surface()?.mapped(|v| sub(v, solid.position));
            let (at, velocity) = (solid.position, solid.mean_velocity());
            push(false, vec![convex(&surface)], at, Rotation::IDENTITY, velocity);
        }
        for o in &scene.obstacles {
            push(true, parts(&o.shape)?, o.position, Rotation::IDENTITY, [0.0; 3]);
        }
        let contact = |c: &crate::Contact| Touch {
            a: c.a,
            b: c.b,
            point: c.point,
            offset: if c.a.is_some() { c.image.offset } else { [0.0; 3] },
            frame: c.frame(),
            mu: c.mu,
            r: None,
            u: None,
            status: None,
        };
        let contacts = scene.contacts.iter().map(contact).collect();
        let frames = vec![Frame { poses, contacts }];
        let picture = Self { name: scene.name.clone(), ground: scene.ground, bodies, frames };
        picture.validate()?;
        Ok(picture)
    }

    /// The same picture with what is known of the contacts of its last frame.
    ///
    /// Errors: numbers that do not fit the contacts or are not finite.
    pub fn with(mut self, answer: &Answer) -> Result<Self, SceneError> {
        let contacts = self.frames.last_mut().map_or(&mut [][..], |f| &mut f.contacts[..]);
        let nc = contacts.len();
        for (key, values) in [("impulses", Some(answer.r)), ("velocities", answer.u)] {
            let Some(values) = values else { continue };
            if ![3 * nc, ROLLING * nc].contains(&values.len()) {
                let expected = format!("{} entries, 3 for each contact", 3 * nc);
                return Err(SceneError::value(key, expected, values.len()));
            }
            require(key, values.iter().sum(), true, "finite entries")?;
        }
        if let Some(m) = answer.motions.filter(|m| m.len() != nc) {
            let expected = format!("{nc} entries, one for each contact");
            return Err(SceneError::value("motions", expected, m.len()));
        }
        let three = |x: &[f64], c: usize| from_fn(|k| x[x.len() / nc * c + k]);
        for (c, contact) in contacts.iter_mut().enumerate() {
            contact.r = Some(three(answer.r, c));
            contact.u = answer.u.map(|u| three(u, c));
            contact.status = answer.motions.map(|m| m[c]);
        }
        Ok(self)
    }

    /// Checks what comes from elsewhere: every index, number and length.
    ///
    /// Errors: the first value that is not possible, by its place, for example `frames[0].contacts[3].b`.
    pub fn validate(&self) -> Result<(), SceneError> {
        if self.bodies.is_empty() {
            return Err(SceneError::value("bodies", "something to draw", "none"));
        }
        let finite = |key: &dyn Fn() -> String, x: &[f64]| match x.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(SceneError::value(key(), "finite numbers", format!("{x:?}"))),
        };
        let near = |key: &dyn Fn() -> String, x: &[f64]| match x.iter().all(|x| x.abs() <= FAR) {
            true => Ok(()),
            false => {
                Err(SceneError::value(key(), format!("numbers up to {FAR:e}"), format!("{x:?}")))
            }
        };
        if let Some(ground) = &self.ground {
            ground.validate()?;
        }
        for (k, body) in self.bodies.iter().enumerate() {
            if body.parts.is_empty() {
                let key = format!("bodies[{k}].parts");
                return Err(SceneError::value(key, "at least one part", "none"));
            }
            for (i, part) in body.parts.iter().enumerate() {
                part.validate(&format!("bodies[{k}].parts[{i}]"))?;
            }
        }
        if self.frames.is_empty() {
            return Err(SceneError::value("frames", "at least one", "none"));
        }
        for (f, frame) in self.frames.iter().enumerate() {
            let (poses, n) = (frame.poses.len(), self.bodies.len());
            if poses != n {
                let key = format!("frames[{f}].poses");
                return Err(SceneError::value(key, format!("{n}, one for each body"), poses));
            }
            for (k, p) in frame.poses.iter().enumerate() {
                let all = [&p.position[..], &p.rotation, &p.velocity].concat();
                near(&|| format!("frames[{f}].poses[{k}]"), &all)?;
            }
            for (c, touch) in frame.contacts.iter().enumerate() {
                let key = |what: &str| format!("frames[{f}].contacts[{c}]{what}");
                for (what, body) in [(".a", touch.a), (".b", Some(touch.b))] {
                    let known = |k: usize| self.bodies.get(k).is_some_and(|b| !b.fixed);
                    if let Some(k) = body.filter(|&k| !known(k)) {
                        let expected = format!("one of the {n} bodies that is not fixed");
                        return Err(SceneError::value(key(what), expected, k));
                    }
                }
                near(&|| key(""), &[touch.point, touch.offset].concat())?;
                let known = [touch.r, touch.u].into_iter().flatten().flatten();
                let frame = touch.frame.iter().flatten().copied();
                let all: Vec<f64> = frame.chain([touch.mu]).chain(known).collect();
                finite(&|| key(""), &all)?;
            }
        }
        Ok(())
    }

    /// The picture as JSON, numbers rounded to single precision: more digits cannot be seen.
    pub fn json(&self) -> String {
        short_json(self)
    }

    /// The picture that [`json`](Self::json) wrote.
    ///
    /// Errors: what is no such JSON; those of [`validate`](Self::validate).
    pub fn from_json(text: &str) -> Result<Self, SceneError> {
        let picture: Self = serde_json::from_str(text)
            .map_err(|e| SceneError::value("drawing", "a picture as JSON", e))?;
        picture.validate()?;
        Ok(picture)
    }

    /// The last frame, the one that is drawn on paper.
    pub(super) fn last(&self) -> &Frame {
        self.frames.last().expect("a validated picture has a frame")
    }

    /// The centre, radius and velocity of each body that is not fixed.
    pub(super) fn moving(&self) -> impl Iterator<Item = (Vec3, f64, Vec3)> + '_ {
        let all = self.bodies.iter().zip(&self.last().poses).filter(|(body, _)| !body.fixed);
        all.map(|(body, pose)| (pose.position, body.radius(), pose.velocity))
    }
}

/// JSON with numbers in single precision.
pub(super) fn short_json(value: &impl Serialize) -> String {
    struct Short;
    impl Formatter for Short {
        fn write_f64<W: ?Sized + io::Write>(&mut self, to: &mut W, x: f64) -> io::Result<()> {
            let short = x as f32;
            match short.is_finite() {
                true => CompactFormatter.write_f32(to, short),
                false => CompactFormatter.write_f64(to, x),
            }
        }
    }
    let mut text = vec![];
    value
        .serialize(&mut Serializer::with_formatter(&mut text, Short))
        .expect("structs of numbers and texts are JSON");
    String::from_utf8(text).expect("JSON is UTF-8")
}

impl Pose {
    /// The world coordinates of a point of the body's frame.
    pub(super) fn to_world(&self, point: Vec3) -> Vec3 {
        add(self.position, apply(&Rotation(self.rotation).matrix(), point))
    }
}

impl Body {
    /// The largest distance from the origin of its frame, m.
    pub(super) fn radius(&self) -> f64 {
        let of = |part: &Part| match part {
            Part::Ball { radius } => *radius,
            Part::Convex { vertices, .. } => vertices.iter().map(|&v| norm(v)).fold(0.0, f64::max),
        };
        self.parts.iter().map(of).fold(0.0, f64::max)
    }

    /// Half the thickness of its thinnest part, about: the distance from the middle to the nearest face, m.
    pub(super) fn inner_radius(&self) -> f64 {
        let of = |part: &Part| match part {
            Part::Ball { radius } => *radius,
            Part::Convex { vertices, faces } => {
                let p = Polyhedron::trusted(vertices.clone(), faces.clone());
                let middle = mean(vertices);
                let distance = |k| {
                    let (normal, offset) = p.plane(k);
                    offset - dot(normal, middle)
                };
                // A face without area has no plane, and the minimum passes its NaN by.
                (0..faces.len()).map(distance).fold(f64::INFINITY, f64::min)
            }
        };
        self.parts.iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// Whether it is a ball and nothing else.
    pub(super) fn is_ball(&self) -> bool {
        matches!(self.parts[..], [Part::Ball { .. }])
    }
}

impl Part {
    pub(super) fn validate(&self, key: &str) -> Result<(), SceneError> {
        match self {
            Part::Ball { radius } => {
                positive(&format!("{key}.radius"), *radius)?;
                require(
                    &format!("{key}.radius"),
                    *radius,
                    *radius <= FAR,
                    "a size that can be drawn",
                )
            }
            Part::Convex { vertices, faces } => {
                let far = vertices.iter().flatten().fold(0.0, |far: f64, x| far.max(x.abs()));
                let sum: f64 = vertices.iter().flatten().sum();
                require(
                    &format!("{key}.vertices"),
                    sum,
                    far <= FAR,
                    "coordinates that can be drawn",
                )?;
                let bad = |f: &&Vec<usize>| f.len() < 3 || f.iter().any(|&k| k >= vertices.len());
                match faces.iter().find(bad) {
                    Some(face) => {
                        let expected = "at least 3 of the vertices each";
                        Err(SceneError::value(
                            format!("{key}.faces"),
                            expected,
                            format!("{face:?}"),
                        ))
                    }
                    None if faces.is_empty() => {
                        Err(SceneError::value(format!("{key}.faces"), "at least one", "none"))
                    }
                    None => Ok(()),
                }
            }
        }
    }
}

fn parts(shape: &Shape) -> Result<Vec<Part>, SceneError> {
    Ok(match shape {
        Shape::Box { half } => vec![convex(&Polyhedron::cuboid(*half)?)],
        Shape::Polyhedron(p) => vec![convex(p)],
        Shape::Compound(parts) => parts.iter().map(convex).collect(),
        Shape::Sphere { radius } => vec![Part::Ball { radius: *radius }],
    })
}

fn convex(p: &Polyhedron) -> Part {
    Part::Convex { vertices: p.vertices().to_vec(), faces: p.faces().to_vec() }
}
