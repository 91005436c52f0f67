//! What a mechanics file of Siconos describes: shapes, objects, laws of contact, joints.
//!
//! ```text
//! /                         dimension
//! /data/ref/SHAPE           type: primitive (with primitive: Sphere, Box, ...), convex, heightmap (with rect), vtp, ...; the numbers or the text
//! /data/input/OBJECT/       mass, inertia, translation, orientation, velocity, center_of_mass, id, ...; a dataset for each contactor, with
//!                           shape_name, group, translation, orientation; or shape_name with tables translations, orientations, velocities
//! /data/nslaws/LAW          type, mu, e, gid1, gid2, ...
//! /data/joints/JOINT        type, object1, object2, points, axes, absolute, stops, friction, ...
//! ```
//!
//! In dimension 2 places have two numbers, orientations the angle, velocities three, inertias one; a convex shape has rows of two. They are read as what they are in space.
//!
//! Almost all stands in attributes. Pickled parameters are never looked into. What is not here (permanent interactions, boundary conditions, plugins) is named.
//!
//! Reference: Siconos' source, `io/python/mechanics_hdf5.py`.

use std::path::Path;

use crate::IoError;
use crate::folder::{Folder, check_finite, open};
use crate::hdf5::{Dataset, Object, Type};

/// A scene of a mechanics file. SI units unless its author meant others; quaternions are `[w, x, y, z]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MechanicsScene {
    /// 2 or 3.
    pub dimension: i64,
    /// The shapes, by name.
    pub shapes: Vec<MechanicsShape>,
    /// The objects in the order of their numbers, those that do not move first.
    pub objects: Vec<MechanicsObject>,
    /// The laws of contact between groups of contactors.
    pub laws: Vec<MechanicsLaw>,
    /// The joints, by name.
    pub joints: Vec<MechanicsJoint>,
    /// The length of a step and the time at the end, s, of a run whose history the file has.
    pub times: Option<[f64; 2]>,
    /// Paths of what stands there besides and changes the motion.
    pub others: Vec<String>,
}

/// A shape.
#[derive(Debug, Clone, PartialEq)]
pub struct MechanicsShape {
    /// What contactors call it.
    pub name: String,
    /// What it is.
    pub form: MechanicsForm,
    /// How far it reaches beyond its numbers, m.
    pub outside_margin: f64,
}

/// What a shape is.
#[derive(Debug, Clone, PartialEq)]
pub enum MechanicsForm {
    /// `Sphere` (r), `Box` (whole sides), `Cylinder`, `Cone`, `Capsule` (r, height along the second axis), `Plane`, ...
    Primitive {
        /// Its name.
        kind: String,
        /// Its numbers.
        size: Vec<f64>,
    },
    /// The convex hull of points.
    Convex(Vec<[f64; 3]>),
    /// The convex hull of points of the plane.
    Flat(Vec<[f64; 2]>),
    /// The ground below heights, a row for each place along the first axis.
    Heights {
        /// m.
        heights: Vec<Vec<f64>>,
        /// Its sides, m.
        size: [f64; 2],
    },
    /// Of another type: a mesh of VTK (`vtp`), `step`, `brep`, ...
    Other(String),
}

/// A body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MechanicsObject {
    /// Its name.
    pub name: String,
    /// kg; none of one that does not move.
    pub mass: Option<f64>,
    /// 3 or 9 numbers, in dimension 2 one, kg·m²; none where it follows from the shapes.
    pub inertia: Option<Vec<f64>>,
    /// The mass centre, m.
    pub position: [f64; 3],
    /// From its frame to that of the world.
    pub rotation: [f64; 4],
    /// Of the mass centre, m/s, and angular in the frame of the body, rad/s.
    pub velocity: [f64; 6],
    /// A constant force, N, and moment, N·m, in the world frame: 3 or 6 numbers, in dimension 2 two or three.
    pub force: Option<Vec<f64>>,
    /// The time at which it appears, s, if it is not there from the start.
    pub birth: Option<f64>,
    /// The time at which it goes.
    pub death: Option<f64>,
    /// Its shapes.
    pub contactors: Vec<MechanicsContactor>,
    /// Names of what it has and is not read: a material of finite elements, pickled parameters.
    pub others: Vec<String>,
}

/// A shape of an object.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MechanicsContactor {
    /// The name of a shape.
    pub shape: String,
    /// What laws call it.
    pub group: i64,
    /// From the mass centre, in the frame of the body, m.
    pub position: [f64; 3],
    /// From its frame to that of the body.
    pub rotation: [f64; 4],
}

/// A law of contact, or of friction in joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MechanicsLaw {
    /// Its name.
    pub name: String,
    /// The name of its class, as `NewtonImpactFrictionNSL`.
    pub kind: String,
    /// Coefficient of friction; 0 where the law has none.
    pub mu: f64,
    /// Of rolling friction, m.
    pub mu_rolling: f64,
    /// Coefficient of restitution.
    pub e: f64,
    /// The bounds of a relay.
    pub bounds: [f64; 2],
    /// The groups of contactors that it is of.
    pub groups: [i64; 2],
}

/// A joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MechanicsJoint {
    /// Its name.
    pub name: String,
    /// The name of its class, as `PivotJointR`.
    pub kind: String,
    /// The objects; the second is the world where none is named.
    pub objects: (String, Option<String>),
    /// m.
    pub points: Vec<[f64; 3]>,
    /// Of any length.
    pub axes: Vec<[f64; 3]>,
    /// Whether points and axes are in the world frame; else in that of the first object.
    pub absolute: bool,
    /// Whether its partners may touch.
    pub collide: bool,
    /// Coordinate, position, and 1 for a lower end, −1 for an upper one.
    pub stops: Vec<[f64; 3]>,
    /// The law of each stop, or one of all.
    pub laws: Vec<String>,
    /// The law of friction of each coordinate; may be empty.
    pub friction: Vec<String>,
    /// Couplings of two of its coordinates, by their ratio.
    pub coupled: Vec<[f64; 3]>,
}

impl MechanicsScene {
    /// Reads a file. Errors: one that is none or damaged, by the place.
    pub fn read(path: &Path) -> Result<Self, IoError> {
        Self::parse(path, &crate::format::bytes(path)?)
    }

    /// Reads the bytes of a file; `name` is for messages. Errors: as of [`read`](Self::read).
    pub fn parse(name: &Path, bytes: &[u8]) -> Result<Self, IoError> {
        let file = open(name, bytes)?;
        let root = Folder::root(name, &file)?;
        let data = root.need("data")?;
        let address = root.group.address;
        let top = Attributes { folder: &root, name: "", address, flat: false };
        let dimension = top.int("dimension")?.unwrap_or(3);
        let flat = dimension == 2;
        let mut out = Self { dimension, times: times(&data)?, ..Self::default() };
        each(&data, flat, "ref", |at, object| {
            out.shapes.push(shape(at, object)?);
            Ok(())
        })?;
        let mut numbered = vec![];
        each(&data, flat, "input", |at, object| {
            let number = at.int("id")?.unwrap_or_default();
            let objects = objects(at, object)?;
            numbered.extend(objects.into_iter().map(|o| (number > 0, number.abs(), o)));
            Ok(())
        })?;
        numbered.sort_by_key(|(moves, number, _)| (*moves, *number));
        out.objects = numbered.into_iter().map(|(.., object)| object).collect();
        each(&data, flat, "nslaws", |at, _| {
            let number = |name: &str| Ok::<_, IoError>(at.real(name)?.unwrap_or_default());
            out.laws.push(MechanicsLaw {
                name: at.name.into(),
                kind: at.needed_text("type")?,
                mu: number("mu")?,
                mu_rolling: number("mu_r")?,
                e: number("e")?,
                bounds: [number("lb")?, number("ub")?],
                groups: [at.int("gid1")?.unwrap_or_default(), at.int("gid2")?.unwrap_or_default()],
            });
            Ok(())
        })?;
        each(&data, flat, "joints", |at, _| {
            out.joints.push(joint(at)?);
            Ok(())
        })?;
        for group in
            ["permanent_interactions", "boundary_conditions", "external_functions", "plugins"]
        {
            each(&data, flat, group, |at, _| {
                out.others.push(at.place());
                Ok(())
            })?;
        }
        Ok(out)
    }

    /// Whether these are the bytes of a mechanics file with objects, intact or not.
    pub fn holds(bytes: &[u8]) -> bool {
        let name = Path::new("");
        let input = |bytes| -> Result<bool, IoError> {
            let file = open(name, bytes)?;
            let data = Folder::root(name, &file)?.folder("data")?;
            data.map_or(Ok(false), |data| data.has("input"))
        };
        input(bytes).unwrap_or(false)
    }
}

/// Step and end of the run whose history is there.
fn times(data: &Folder) -> Result<Option<[f64; 2]>, IoError> {
    if !data.has("solv")? {
        return Ok(None);
    }
    let set = data.dataset("solv")?;
    let [rows, columns] = set.shape[..] else { return Ok(None) };
    if rows < 2 || columns == 0 {
        return Ok(None);
    }
    let x = data.data.reals(&set).map_err(data.fault("solv"))?;
    let at = |row: u64| x[(row * columns) as usize];
    let times = [at(1) - at(0), at(rows - 1)];
    Ok(times.iter().all(|t| t.is_finite() && *t > 0.0).then_some(times))
}

/// Calls `f` with all members of a group, if there is one.
fn each<'a>(
    data: &Folder<'_, 'a>,
    flat: bool,
    group: &str,
    mut f: impl FnMut(&Attributes<'_, '_, 'a>, Object<'a>) -> Result<(), IoError>,
) -> Result<(), IoError> {
    let Some(folder) = data.folder(group)? else { return Ok(()) };
    let names: Vec<String> =
        folder.group.links.keys().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
    for name in &names {
        let address = folder.data.address(&folder.group, name).map_err(folder.fault(name))?;
        let (Some(address), Some(object)) = (address, folder.find(name)?) else { continue };
        f(&Attributes { folder: &folder, name, address, flat }, object)?;
    }
    Ok(())
}

fn shape<'a>(at: &Attributes<'_, '_, 'a>, object: Object<'a>) -> Result<MechanicsShape, IoError> {
    let kind = at.needed_text("type")?;
    let table = || -> Result<(Vec<f64>, Vec<usize>), IoError> {
        let Object::Dataset(set) = &object else {
            return Err(at.error("a dataset", "a group"));
        };
        let numbers = at.folder.reals(at.name, None)?;
        Ok((numbers, set.shape.iter().map(|n| *n as usize).collect()))
    };
    let form = match kind.as_str() {
        "primitive" => {
            MechanicsForm::Primitive { kind: at.needed_text("primitive")?, size: table()?.0 }
        }
        "convex" => {
            let (numbers, shape) = table()?;
            match shape[..] {
                [_, 2] if at.flat => MechanicsForm::Flat(numbers.as_chunks::<2>().0.to_vec()),
                [_, 3] if !at.flat => MechanicsForm::Convex(numbers.as_chunks::<3>().0.to_vec()),
                _ => MechanicsForm::Other(format!("convex of shape {shape:?}")),
            }
        }
        "heightmap" => {
            let (numbers, shape) = table()?;
            let (&[_, columns], Some([x, y])) = (&shape[..], at.fixed::<2>("rect")?) else {
                return Err(at.error("a table of heights with `rect`", format!("{shape:?}")));
            };
            let heights = numbers.chunks(columns.max(1)).map(<[f64]>::to_vec).collect();
            MechanicsForm::Heights { heights, size: [x, y] }
        }
        _ => MechanicsForm::Other(kind),
    };
    let outside_margin = at.real("outsideMargin")?.unwrap_or_default();
    Ok(MechanicsShape { name: at.name.into(), form, outside_margin })
}

/// An object, or the many of an aggregate.
fn objects<'a>(
    at: &Attributes<'_, '_, 'a>,
    object: Object<'a>,
) -> Result<Vec<MechanicsObject>, IoError> {
    let Object::Group(group) = object else {
        return Err(at.error("a group", "a dataset"));
    };
    let inner = Folder { file: at.folder.file, data: at.folder.data, path: at.place(), group };
    let mut like = MechanicsObject {
        name: at.name.into(),
        mass: at.real("mass")?.filter(|mass| *mass != 0.0),
        inertia: at.numbers("inertia")?,
        rotation: [1.0, 0.0, 0.0, 0.0],
        force: at.numbers("fext")?,
        birth: at.real("time_of_birth")?.filter(|t| *t > 0.0),
        death: at.real("time_of_death")?,
        ..MechanicsObject::default()
    };
    for name in ["material", "boundary_conditions", "nodal_forces"] {
        if at.find(name)?.is_some() {
            like.others.push(name.into());
        }
    }
    if at.text("type")?.is_some_and(|kind| kind.ends_with("_aggregate")) {
        like.contactors.push(MechanicsContactor {
            shape: at.needed_text("shape_name")?,
            group: at.int("group")?.unwrap_or_default(),
            position: [0.0; 3],
            rotation: [1.0, 0.0, 0.0, 0.0],
        });
        let (places, turns, velocities) = match at.flat {
            false => (
                rows::<3>(&inner, "translations")?,
                rows::<4>(&inner, "orientations")?,
                rows::<6>(&inner, "velocities")?,
            ),
            true => (
                rows::<2>(&inner, "translations")?.into_iter().map(|[x, y]| [x, y, 0.0]).collect(),
                rows::<1>(&inner, "orientations")?.into_iter().map(|[a]| about_third(a)).collect(),
                rows::<3>(&inner, "velocities")?.into_iter().map(in_plane).collect(),
            ),
        };
        if [turns.len(), velocities.len()] != [places.len(); 2] {
            let found = format!("{} and {}", turns.len(), velocities.len());
            let expected = format!("{} orientations and velocities", places.len());
            return Err(at.error(expected, found));
        }
        let of = |k: usize| MechanicsObject {
            name: format!("{} {k}", like.name),
            position: places[k],
            rotation: turns[k],
            velocity: velocities[k],
            ..like.clone()
        };
        return Ok((0..places.len()).map(of).collect());
    }
    like.position = at.point("translation")?;
    like.rotation = at.turn("orientation")?;
    like.velocity = match at.flat {
        true => at.fixed("velocity")?.map(in_plane).unwrap_or_default(),
        false => at.fixed("velocity")?.unwrap_or_default(),
    };
    let centre = at.point("center_of_mass")?;
    let names: Vec<String> =
        inner.group.links.keys().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
    for name in &names {
        let address = inner.data.address(&inner.group, name).map_err(inner.fault(name))?;
        let Some(address) = address else { continue };
        let part = Attributes { folder: &inner, name, address, flat: at.flat };
        // Contactors are placed about the origin of the shape; the body is where its mass centre is.
        let place = part.point("translation")?;
        if part.find("parameters")?.is_some() {
            like.others.push(format!("parameters of {name}"));
        }
        like.contactors.push(MechanicsContactor {
            shape: part.needed_text("shape_name")?,
            group: part.int("group")?.unwrap_or_default(),
            position: std::array::from_fn(|k| place[k] - centre[k]),
            rotation: part.turn("orientation")?,
        });
    }
    Ok(vec![like])
}

/// A turn about the third axis.
fn about_third(angle: f64) -> [f64; 4] {
    let (s, c) = (0.5 * angle).sin_cos();
    [c, 0.0, 0.0, s]
}

/// A velocity in the plane, and the rate of turning there.
fn in_plane([x, y, turn]: [f64; 3]) -> [f64; 6] {
    [x, y, 0.0, 0.0, 0.0, turn]
}

fn rows<const N: usize>(folder: &Folder, name: &str) -> Result<Vec<[f64; N]>, IoError> {
    let shape = folder.dataset(name)?.shape;
    match shape[..] {
        [_, n] if n == N as u64 => Ok(folder.reals(name, None)?.as_chunks::<N>().0.to_vec()),
        _ => Err(folder.error(name, format!("rows of {N} numbers"), format!("{shape:?}"))),
    }
}

fn joint(at: &Attributes) -> Result<MechanicsJoint, IoError> {
    Ok(MechanicsJoint {
        name: at.name.into(),
        kind: at.needed_text("type")?,
        objects: (at.needed_text("object1")?, at.text("object2")?),
        points: at.triples("points")?,
        axes: at.triples("axes")?,
        absolute: at.flag("absolute")?.unwrap_or(true),
        collide: at.flag("allow_self_collide")?.unwrap_or(false),
        stops: at.triples("stops")?,
        laws: at.texts("nslaws")?,
        friction: at.texts("friction")?,
        coupled: at.triples("coupled")?,
    })
}

/// The attributes of a member of a group.
struct Attributes<'g, 'f, 'a> {
    folder: &'g Folder<'f, 'a>,
    name: &'g str,
    address: u64,
    /// Whether the file is of dimension 2.
    flat: bool,
}

impl<'a> Attributes<'_, '_, 'a> {
    fn place(&self) -> String {
        self.folder.place(self.name)
    }

    fn error(&self, expected: impl Into<String>, found: impl std::fmt::Display) -> IoError {
        self.folder.error(self.name, expected, found)
    }

    fn find(&self, name: &str) -> Result<Option<Dataset<'a>>, IoError> {
        self.folder.data.attribute(self.address, name).map_err(self.folder.fault(self.name))
    }

    /// Finite numbers, if they are there.
    fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, IoError> {
        let Some(found) = self.find(name)? else { return Ok(None) };
        if !matches!(found.kind, Type::Int { .. } | Type::Real { .. }) {
            return Err(self.error(format!("numbers as `{name}`"), found.kind.name()));
        }
        let x = self.folder.data.reals(&found).map_err(self.folder.fault(self.name))?;
        check_finite(self.folder.file, &format!("{}.{name}", self.place()), &x)?;
        Ok(Some(x))
    }

    fn fixed<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, IoError> {
        let Some(found) = self.numbers(name)? else { return Ok(None) };
        let count = found.len();
        let array = found.try_into().map(Some);
        array.map_err(|_| self.error(format!("{N} numbers as `{name}`"), count))
    }

    /// A point; the origin where there is none.
    fn point(&self, name: &str) -> Result<[f64; 3], IoError> {
        match (self.flat, self.numbers(name)?.as_deref()) {
            (_, None) => Ok([0.0; 3]),
            (false, Some(&[x, y, z])) => Ok([x, y, z]),
            (true, Some(&[x, y] | &[x, y, 0.0])) => Ok([x, y, 0.0]),
            (flat, Some(found)) => {
                let expected =
                    if flat { "2 numbers, or 3 with 0 as the third," } else { "3 numbers" };
                Err(self.error(format!("{expected} as `{name}`"), format!("{found:?}")))
            }
        }
    }

    /// An orientation; none where nothing is said.
    fn turn(&self, name: &str) -> Result<[f64; 4], IoError> {
        match (self.flat, self.numbers(name)?.as_deref()) {
            (_, None) => Ok([1.0, 0.0, 0.0, 0.0]),
            (false, Some(&[w, x, y, z])) => Ok([w, x, y, z]),
            (true, Some(&[angle])) => Ok(about_third(angle)),
            (true, Some(&[w, 0.0, 0.0, z])) => Ok([w, 0.0, 0.0, z]),
            (flat, Some(found)) => {
                let expected = match flat {
                    true => "the angle, or a quaternion about the third axis,",
                    false => "4 numbers",
                };
                Err(self.error(format!("{expected} as `{name}`"), format!("{found:?}")))
            }
        }
    }

    fn real(&self, name: &str) -> Result<Option<f64>, IoError> {
        Ok(self.fixed::<1>(name)?.map(|[x]| x))
    }

    fn int(&self, name: &str) -> Result<Option<i64>, IoError> {
        match self.real(name)? {
            Some(x) if x.fract() != 0.0 || x.abs() > f64::from(i32::MAX) => {
                Err(self.error(format!("a whole number as `{name}`"), x))
            }
            x => Ok(x.map(|x| x as i64)),
        }
    }

    fn triples(&self, name: &str) -> Result<Vec<[f64; 3]>, IoError> {
        let x = self.numbers(name)?.unwrap_or_default();
        match x.as_chunks::<3>() {
            (triples, []) => Ok(triples.to_vec()),
            _ => Err(self.error(format!("triples as `{name}`"), format!("{} numbers", x.len()))),
        }
    }

    /// A truth value, which h5py writes as an enumeration of one byte.
    fn flag(&self, name: &str) -> Result<Option<bool>, IoError> {
        let Some(found) = self.find(name)? else { return Ok(None) };
        let bytes = self.folder.data.read(&found).map_err(self.folder.fault(self.name))?;
        Ok(Some(bytes.iter().any(|byte| *byte != 0)))
    }

    fn text(&self, name: &str) -> Result<Option<String>, IoError> {
        let Some(found) = self.find(name)? else { return Ok(None) };
        if !matches!(found.kind, Type::Text | Type::VariableText) {
            return Err(self.error(format!("a text as `{name}`"), found.kind.name()));
        }
        let bytes = self.folder.data.text(&found).map_err(self.folder.fault(self.name))?;
        Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
    }

    fn needed_text(&self, name: &str) -> Result<String, IoError> {
        self.text(name)?.ok_or_else(|| self.error(format!("the attribute `{name}`"), "none"))
    }

    /// Texts of one width, or one of any.
    fn texts(&self, name: &str) -> Result<Vec<String>, IoError> {
        let Some(found) = self.find(name)? else { return Ok(vec![]) };
        match found.kind {
            Type::Text => {
                let bytes = self.folder.data.read(&found).map_err(self.folder.fault(self.name))?;
                let text = |bytes: &[u8]| {
                    let end = bytes.iter().position(|&c| c == 0).unwrap_or(bytes.len());
                    String::from_utf8_lossy(&bytes[..end]).into_owned()
                };
                Ok(bytes.chunks_exact(found.width as usize).map(text).collect())
            }
            Type::VariableText if found.shape.iter().product::<u64>() == 1 => {
                Ok(self.text(name)?.into_iter().collect())
            }
            other => Err(self.error(format!("texts of one width as `{name}`"), other.name())),
        }
    }
}
