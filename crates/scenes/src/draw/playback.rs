//! Motion as a page: one HTML file that plays it in a browser, without a network.
//!
//! A [`Playback`] is plain data, whoever computed it. The page shows bodies, contact forces and force chains, and energy and residual against time.
//! Positions travel in single precision and rotations in 16 bits, 20 bytes of a body and frame: 1000 bodies in 600 frames are 16 MB.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use nonsmooth_problem::check::Motion;
use serde::Serialize;

use super::camera::View;
use super::html::{Colours, STYLE, filled};
use super::paper::escape;
use super::picture::{Body, Frame, Part, Picture, Pose, Touch, short_json};
pub use super::surface::Surface;
use crate::body::Rotation;
use crate::error::{positive, require};
use crate::vec3::{Vec3, add, apply, norm, scale, sub};
use crate::{Ground, SceneError};

const PAGE: &str = include_str!("page/play.html");
const OWN_STYLE: &str = include_str!("page/play.css");
const SCRIPT: &str = include_str!("page/play.js");

/// The bytes of motion that a page holds, unless more are asked for.
pub const LIMIT: usize = 24_000_000;

/// A curve of the page has at most about this many points: more cannot be seen.
const POINTS: usize = 2000;

/// A motion to be played.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Playback {
    /// What it is called.
    pub title: String,
    /// Where it is seen from at the beginning.
    pub view: View,
    /// The bodies, as contacts count them.
    pub bodies: Vec<Drawn>,
    /// One after the other in time, at least one.
    pub frames: Vec<Moment>,
    /// The energy against time; may be empty.
    pub energy: Vec<Energy>,
    /// Time (s) and residual of steps; may be empty.
    pub residual: Vec<[f64; 2]>,
    /// What moves farther than this between two frames has been brought to the other side of a cell: the page shows it on either side and nowhere between, m.
    pub jump: Option<f64>,
}

/// A body's shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// What it is called; may be empty.
    pub name: String,
    /// Whether impulses do not move it.
    pub fixed: bool,
    /// Its parts.
    pub parts: Vec<Placed>,
}

/// A solid in the frame of its body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Placed {
    /// The solid.
    pub form: Form,
    /// The origin of its frame, m.
    pub position: Vec3,
    /// The orientation of its frame.
    #[serde(serialize_with = "quaternion")]
    pub rotation: Rotation,
}

fn quaternion<S: serde::Serializer>(rotation: &Rotation, to: S) -> Result<S::Ok, S::Error> {
    rotation.0.serialize(to)
}

/// A solid about the origin of its frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// A ball.
    Sphere {
        /// m.
        radius: f64,
    },
    /// A box with sides along the axes.
    Box {
        /// Half sides, m.
        half: Vec3,
    },
    /// All points within `radius` of the segment from `−half_length` to `half_length` on the third axis.
    Capsule {
        /// Half the length of the segment, m.
        half_length: f64,
        /// m.
        radius: f64,
    },
    /// The half space below the first two axes, drawn as a sheet with a grid.
    Plane,
    /// A convex polyhedron.
    Polyhedron {
        /// m.
        vertices: Vec<Vec3>,
        /// By indices of vertices, counter-clockwise seen from outside.
        faces: Vec<Vec<usize>>,
    },
    /// All points within `radius` of the third axis and not farther than `half_length` from the origin along it.
    Cylinder {
        /// Half the length, m.
        half_length: f64,
        /// m.
        radius: f64,
    },
    /// The cone about the third axis with its base at `−half_length` and its point at `half_length`.
    Cone {
        /// Half the height, m.
        half_length: f64,
        /// Of the base, m.
        radius: f64,
    },
    /// Any surface; what is behind a face may be seen.
    Mesh {
        /// m.
        vertices: Vec<Vec3>,
        /// By indices of vertices, counter-clockwise seen from outside.
        faces: Vec<Vec<usize>>,
    },
}

/// A frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Moment {
    /// s.
    pub time: f64,
    /// Where each body is.
    pub poses: Vec<Pose>,
    /// The contacts. Other than in a [`Picture`], either body may be a fixed one.
    pub contacts: Vec<Touch>,
    /// Where the vertices of those are that deform, m: the last so many of the bodies, each one mesh.
    pub shapes: Vec<Vec<Vec3>>,
}

/// The energy at a time, J.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// s.
    pub time: f64,
    /// Of motion.
    pub kinetic: f64,
    /// Of weight.
    pub potential: f64,
}

impl Form {
    /// The largest distance of its points from its origin, m; of a plane zero.
    fn radius(&self) -> f64 {
        match self {
            Form::Sphere { radius } => *radius,
            Form::Box { half } => norm(*half),
            Form::Capsule { half_length, radius } => half_length + radius,
            Form::Plane => 0.0,
            Form::Cylinder { half_length, radius } | Form::Cone { half_length, radius } => {
                half_length.hypot(*radius)
            }
            Form::Polyhedron { vertices, .. } | Form::Mesh { vertices, .. } => {
                vertices.iter().map(|&v| norm(v)).fold(0.0, f64::max)
            }
        }
    }

    fn validate(&self, key: &str) -> Result<(), SceneError> {
        let at = |name: &str| format!("{key}.{name}");
        match self {
            Form::Sphere { radius } => positive(&at("radius"), *radius),
            Form::Box { half } => half.iter().try_for_each(|x| positive(&at("half"), *x)),
            Form::Cylinder { half_length, radius } | Form::Cone { half_length, radius } => {
                positive(&at("radius"), *radius)?;
                positive(&at("half_length"), *half_length)
            }
            Form::Capsule { half_length, radius } => {
                positive(&at("radius"), *radius)?;
                require(&at("half_length"), *half_length, *half_length >= 0.0, "no negative number")
            }
            Form::Plane => Ok(()),
            Form::Polyhedron { vertices, faces } | Form::Mesh { vertices, faces } => {
                Part::Convex { vertices: vertices.clone(), faces: faces.clone() }.validate(key)
            }
        }
    }
}

impl Drawn {
    /// The radius about its origin of all that is no plane, m.
    fn radius(&self) -> f64 {
        let of = |part: &Placed| match part.form {
            Form::Plane => 0.0,
            _ => norm(part.position) + part.form.radius(),
        };
        self.parts.iter().map(of).fold(0.0, f64::max)
    }

    /// With the vertices of its mesh elsewhere, about its origin.
    fn deformed(mut self, shape: &[Vec3], origin: Vec3) -> Self {
        for part in &mut self.parts {
            if let Form::Mesh { vertices, .. } = &mut part.form {
                *vertices = shape.iter().map(|&x| sub(x, origin)).collect();
            }
        }
        self
    }

    /// Whether it is one ball about its origin.
    fn is_ball(&self) -> bool {
        matches!(
            &self.parts[..],
            [Placed { form: Form::Sphere { .. }, position: [0.0, 0.0, 0.0], .. }]
        )
    }
}

impl Playback {
    /// Checks every index, number and length.
    ///
    /// Errors: the first value that is not possible, by its place, for example `frames[0].contacts[3].b`.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.view.validate()?;
        for (key, none) in [("bodies", self.bodies.is_empty()), ("frames", self.frames.is_empty())]
        {
            if none {
                return Err(SceneError::value(key, "at least one", "none"));
            }
        }
        let finite = |key: &dyn Fn() -> String, x: &[f64]| match x.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(SceneError::value(key(), "finite numbers", format!("{x:?}"))),
        };
        let n = self.bodies.len();
        for (k, body) in self.bodies.iter().enumerate() {
            for (i, part) in body.parts.iter().enumerate() {
                let key = format!("bodies[{k}].parts[{i}]");
                part.form.validate(&key)?;
                finite(&|| key.clone(), &[&part.position[..], &part.rotation.0].concat())?;
            }
        }
        let mut before = f64::NEG_INFINITY;
        for (f, frame) in self.frames.iter().enumerate() {
            let rises = frame.time >= before;
            require(&format!("frames[{f}].time"), frame.time, rises, "a time not before the last")?;
            before = frame.time;
            if frame.poses.len() != n {
                let (key, expected) =
                    (format!("frames[{f}].poses"), format!("{n}, one for each body"));
                return Err(SceneError::value(key, expected, frame.poses.len()));
            }
            self.validate_shapes(f)?;
            for (k, p) in frame.poses.iter().enumerate() {
                let all = [&p.position[..], &p.rotation, &p.velocity].concat();
                finite(&|| format!("frames[{f}].poses[{k}]"), &all)?;
            }
            for (c, touch) in frame.contacts.iter().enumerate() {
                let key = |what: &str| format!("frames[{f}].contacts[{c}]{what}");
                for (what, body) in [(".a", touch.a), (".b", Some(touch.b))] {
                    if let Some(k) = body.filter(|&k| k >= n) {
                        return Err(SceneError::value(key(what), format!("one of {n} bodies"), k));
                    }
                }
                let r = touch.r.unwrap_or_default();
                let all: Vec<f64> =
                    touch.frame.iter().flatten().chain(&touch.point).chain(&r).copied().collect();
                finite(&|| key(""), &all)?;
            }
        }
        Ok(())
    }

    /// The shapes of a frame: as many as in the first one, of bodies that are one mesh, a place for each vertex.
    fn validate_shapes(&self, f: usize) -> Result<(), SceneError> {
        let shapes = &self.frames[f].shapes;
        let all = self.frames[0].shapes.len();
        if shapes.len() != all || all > self.bodies.len() {
            let key = format!("frames[{f}].shapes");
            return Err(SceneError::value(key, format!("{all} of bodies"), shapes.len()));
        }
        for (k, (shape, body)) in shapes.iter().zip(self.deforming()).enumerate() {
            let key = format!("frames[{f}].shapes[{k}]");
            let vertices = match &body.parts[..] {
                [Placed { form: Form::Mesh { vertices, .. }, .. }] => vertices.len(),
                _ => return Err(SceneError::value(key, "the shape of one mesh", "of others")),
            };
            if shape.len() != vertices {
                return Err(SceneError::value(key, format!("{vertices} vertices"), shape.len()));
            }
            if !shape.iter().flatten().all(|x| x.is_finite()) {
                return Err(SceneError::value(key, "finite numbers", "others"));
            }
        }
        Ok(())
    }

    /// The bodies that deform.
    fn deforming(&self) -> &[Drawn] {
        let shapes = self.frames.first().map_or(0, |f| f.shapes.len());
        &self.bodies[self.bodies.len() - shapes..]
    }

    /// The motion as a page of HTML that holds it whole, with three.js. Of the frames so many are left out, evenly, that what moves takes no more than
    /// `limit` bytes, if that is possible with two frames; the page says so.
    ///
    /// Errors: those of [`validate`](Self::validate).
    pub fn html(&self, limit: usize) -> Result<String, SceneError> {
        self.validate()?;
        let every = self.stride(limit);
        let shown: Vec<&Moment> = self.shown(every).collect();
        let poses = || shown.iter().flat_map(|f| &f.poses);
        let contacts = || shown.iter().flat_map(|f| &f.contacts);
        let mut end = 0;
        let ends = shown.iter().map(|f| {
            end += f.contacts.len() as u32;
            end
        });
        let body = |body: Option<usize>| body.map_or(-1, |k| k as i32).to_le_bytes();
        let data = Data {
            bodies: self.bodies.iter().map(BodyData::of).collect(),
            frames: shown.len(),
            every,
            recorded: self.frames.len(),
            limit,
            times: packed(shown.iter().map(|f| f.time.to_le_bytes())),
            positions: floats(poses().flat_map(|p| p.position)),
            rotations: packed(poses().flat_map(|p| unit(p.rotation)).map(i16::to_le_bytes)),
            ends: packed(ends.map(u32::to_le_bytes)),
            pairs: packed(contacts().flat_map(|c| [body(c.a), body(Some(c.b))])),
            forces: floats(contacts().flat_map(|c| {
                let [x, y, z] = c.impulse().unwrap_or_default();
                let [p, q, r] = c.point;
                [p, q, r, x, y, z]
            })),
            offsets: match contacts().any(|c| c.offset != [0.0; 3]) {
                true => floats(contacts().flat_map(|c| c.offset)),
                false => String::new(),
            },
            jump: self.jump,
            statuses: packed(contacts().map(|c| {
                [match c.status {
                    None => 0,
                    Some(Motion::Open) => 1,
                    Some(Motion::Stick) => 2,
                    Some(Motion::Slip) => 3,
                }]
            })),
            energy: floats(
                thinned(&self.energy, |e| e.kinetic).flat_map(|e| [e.time, e.kinetic, e.potential]),
            ),
            residual: floats(thinned(&self.residual, |r| r[1]).flatten()),
            deforming: self.deforming().len(),
            shapes: floats(
                shown.iter().flat_map(|f| &f.shapes).flatten().flat_map(|x| x.iter().copied()),
            ),
            view: self.view,
            colours: Colours::default(),
        };
        let style = [STYLE, OWN_STYLE].concat();
        Ok(filled(PAGE, &escape(&self.title), &short_json(&data), &style, SCRIPT))
    }

    /// Every so many frames fit the limit.
    fn stride(&self, limit: usize) -> usize {
        let vertices = |f: &Moment| f.shapes.iter().map(Vec::len).sum::<usize>();
        let bytes =
            |f: &Moment| (20 * f.poses.len() + 33 * f.contacts.len() + 12 * vertices(f)) * 4 / 3;
        let fits = |every: &usize| self.shown(*every).map(bytes).sum::<usize>() <= limit;
        let most = self.frames.len().max(2) - 1;
        (1..most).find(fits).unwrap_or(most)
    }

    /// Every so many frames, and the last one.
    fn shown(&self, every: usize) -> impl Iterator<Item = &Moment> {
        let last = self.frames.len() - 1;
        self.frames
            .iter()
            .enumerate()
            .filter(move |(k, _)| k % every == 0 || *k == last)
            .map(|f| f.1)
    }

    /// How far what moves comes about: the diagonal of the box around its positions in all frames and the largest of its bodies, m.
    fn reach(&self) -> f64 {
        let moving = |k: &usize| !self.bodies[*k].fixed;
        let all = || (0..self.bodies.len()).filter(moving);
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for pose in self.frames.iter().flat_map(|f| all().map(|k| &f.poses[k])) {
            for (d, x) in pose.position.into_iter().enumerate() {
                bounds[0][d] = bounds[0][d].min(x);
                bounds[1][d] = bounds[1][d].max(x);
            }
        }
        let radius = all().map(|k| self.bodies[k].radius()).fold(0.0, f64::max);
        let diagonal = norm(std::array::from_fn(|d| (bounds[1][d] - bounds[0][d]).max(0.0)));
        match diagonal + 2.0 * radius {
            reach if reach > 0.0 => reach,
            _ => 1.0,
        }
    }

    /// The surfaces of each body in its frame, for what knows polygons only; planes are square sheets of twice the reach of what moves.
    pub fn surfaces(&self) -> Vec<Vec<Surface>> {
        let sheet = 2.0 * self.reach();
        self.bodies.iter().map(|body| body.surfaces(sheet)).collect()
    }

    /// A frame as a picture, for [`svg`](super::svg()). The first plane of a fixed body is the ground, others are left out.
    ///
    /// Errors: those of [`validate`](Self::validate); a frame that is not there; nothing to draw but planes.
    pub fn picture(&self, frame: usize) -> Result<Picture, SceneError> {
        self.validate()?;
        let Some(moment) = self.frames.get(frame) else {
            let expected = format!("one of {}", self.frames.len());
            return Err(SceneError::value("frame", expected, frame));
        };
        let mut ground = None;
        let (mut bodies, mut poses, mut numbers) = (vec![], vec![], vec![]);
        let first = self.bodies.len() - moment.shapes.len();
        for (k, (body, pose)) in self.bodies.iter().zip(&moment.poses).enumerate() {
            let deformed = k.checked_sub(first).map(|e| &moment.shapes[e]);
            let planes = body.parts.iter().filter(|p| body.fixed && p.form == Form::Plane);
            for plane in planes {
                ground.get_or_insert_with(|| {
                    let turn = Rotation(pose.rotation).after(plane.rotation).matrix();
                    let place = apply(&Rotation(pose.rotation).matrix(), plane.position);
                    let axis = |d: usize| std::array::from_fn(|k| turn[k][d]);
                    Ground { point: add(pose.position, place), normal: axis(2), along: axis(0) }
                });
            }
            let solid = Drawn {
                parts: body.parts.iter().filter(|p| p.form != Form::Plane).cloned().collect(),
                ..body.clone()
            };
            let solid = match deformed {
                Some(shape) => solid.deformed(shape, pose.position),
                None => solid,
            };
            let parts: Vec<Part> = match &solid.parts[..] {
                [Placed { form: Form::Sphere { radius }, .. }] if solid.is_ball() => {
                    vec![Part::Ball { radius: *radius }]
                }
                _ => {
                    // A painter needs convex parts: of a mesh these are its faces.
                    let parts = solid.parts.iter().zip(solid.surfaces(1.0));
                    let convex = |(part, s): (&Placed, Surface)| match part.form {
                        Form::Mesh { .. } => s.faces.iter().map(|f| face(&s.vertices, f)).collect(),
                        _ => vec![Part::Convex { vertices: s.vertices, faces: s.faces }],
                    };
                    parts.flat_map(convex).collect()
                }
            };
            numbers.push((!body.fixed && !parts.is_empty()).then_some(bodies.len()));
            if !parts.is_empty() {
                bodies.push(Body { fixed: body.fixed, parts });
                // What only rounding moves has no arrow.
                let rests = norm(pose.velocity) <= REST;
                let velocity = if rests { [0.0; 3] } else { pose.velocity };
                poses.push(Pose { velocity, ..pose.clone() });
            }
        }
        let touch = |touch: &Touch| {
            let a = touch.a.and_then(|a| numbers[a]);
            let touch = touch.clone();
            match numbers[touch.b] {
                Some(b) => Some(Touch { a, b, ..touch }),
                // In a picture the second body moves: the same contact from the other side.
                None => Some(Touch {
                    a: None,
                    b: a?,
                    frame: touch.frame.map(|x| scale(-1.0, x)),
                    ..touch
                }),
            }
        };
        let contacts = moment.contacts.iter().filter_map(touch).collect();
        let frames = vec![Frame { poses, contacts }];
        let picture = Picture { name: self.title.clone(), ground, bodies, frames };
        picture.validate()?;
        Ok(picture)
    }
}

/// Bodies that are slower rest on paper, m/s.
const REST: f64 = 1e-6;

/// One face of a surface.
fn face(vertices: &[Vec3], corners: &[usize]) -> Part {
    let vertices = corners.iter().map(|&k| vertices[k]).collect();
    Part::Convex { vertices, faces: vec![(0..corners.len()).collect()] }
}

/// What the script reads. Tables are base64 of little-endian numbers.
#[derive(Serialize)]
struct Data<'a> {
    bodies: Vec<BodyData<'a>>,
    /// Frames in the page, every so many of those recorded, within a limit of bytes.
    frames: usize,
    every: usize,
    recorded: usize,
    limit: usize,
    /// f64, frames.
    times: String,
    /// f32, frames × bodies × 3.
    positions: String,
    /// i16, frames × bodies × 4 (w, x, y, z), in units of 1/32767.
    rotations: String,
    /// u32, frames: where the contacts of each end.
    ends: String,
    /// i32, contacts × 2.
    pairs: String,
    /// f32, contacts × 6: point, impulse on the second body.
    forces: String,
    /// f32, contacts × 3: from where the first body is touched to the point; empty where no image touches.
    offsets: String,
    jump: Option<f64>,
    /// u8, contacts.
    statuses: String,
    /// f32: time, kinetic, potential.
    energy: String,
    /// f32: time, residual.
    residual: String,
    /// How many of the bodies deform, the last ones; f32, frames × their vertices × 3.
    deforming: usize,
    shapes: String,
    view: View,
    colours: Colours,
}

#[derive(Serialize)]
struct BodyData<'a> {
    name: &'a str,
    fixed: bool,
    /// m; zero of a plane.
    radius: f64,
    ball: bool,
    parts: &'a [Placed],
}

impl<'a> BodyData<'a> {
    fn of(body: &'a Drawn) -> Self {
        let Drawn { name, fixed, parts } = body;
        Self { name, fixed: *fixed, radius: body.radius(), ball: body.is_ball(), parts }
    }
}

fn packed<const W: usize>(numbers: impl Iterator<Item = [u8; W]>) -> String {
    BASE64_STANDARD.encode(numbers.flatten().collect::<Vec<u8>>())
}

fn floats(x: impl Iterator<Item = f64>) -> String {
    packed(x.map(|x| (x as f32).to_le_bytes()))
}

/// The components of a quaternion in 16 bits, of unit length before.
fn unit(q: [f64; 4]) -> [i16; 4] {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| (32767.0 * x / length).round() as i16)
}

/// A curve of at most about twice [`POINTS`] points: of each piece the lowest and the highest, so that no peak is lost; NaN is highest.
fn thinned<T: Copy>(curve: &[T], height: impl Fn(T) -> f64) -> impl Iterator<Item = T> {
    let piece = curve.len().div_ceil(POINTS).max(1);
    let order = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
    let ends = curve.chunks(piece).flat_map(move |piece| {
        let by = |a: &usize, b: &usize| order(&height(piece[*a]), &height(piece[*b]));
        let low = (0..piece.len()).min_by(by).unwrap_or(0);
        let high = (0..piece.len()).max_by(by).unwrap_or(0);
        let mut both = vec![low.min(high), low.max(high)];
        both.dedup();
        both.into_iter().map(|k| piece[k]).collect::<Vec<T>>()
    });
    ends.collect::<Vec<T>>().into_iter()
}
