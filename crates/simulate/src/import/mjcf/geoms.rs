//! Geoms: shapes with their masses, and which of them touch.

use std::cell::OnceCell;
use std::collections::BTreeMap;

use nonsmooth_scenes::vec3::{Vec3, apply, norm, scale, sub};
use nonsmooth_scenes::{MassProperties, Polyhedron};
use serde_json::{Value, json};

use super::compiler::{Compiler, from_third, unknown};
use super::document::{Defaults, Element, Item, MAIN};
use crate::import::Frame;
use crate::scene_file::{ShapeTable, load_mesh};
use crate::{Mesh, Shape, SimulateError};

/// kg/m³, where none is given.
const DENSITY: f64 = 1000.0;

/// Attributes of geoms that are read, or that have to do with pictures or with a law of contact that is not ours.
const KNOWN: [&str; 31] = [
    "name",
    "class",
    "type",
    "pos",
    "quat",
    "axisangle",
    "xyaxes",
    "zaxis",
    "euler",
    "fromto",
    "size",
    "mesh",
    "hfield",
    "mass",
    "density",
    "friction",
    "contype",
    "conaffinity",
    "condim",
    "group",
    "priority",
    "shellinertia",
    "fitscale",
    "rgba",
    "material",
    "user",
    "solref",
    "solimp",
    "solmix",
    "fluidshape",
    "fluidcoef",
];

/// A geom of a body.
pub(super) struct Geom<'a> {
    pub item: Item<'a>,
    /// In the frame of the body.
    pub place: Frame,
    /// As scenes write it; none of one that touches nothing.
    pub shape: Option<Value>,
    /// In the frame of the body.
    pub mass: Option<MassProperties>,
    pub touch: Touch,
}

/// What a geom touches, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    /// `contype` and `conaffinity`.
    pub bits: [u32; 2],
    pub friction: f64,
    /// The coefficient of rolling friction, m, and whether it has any.
    pub rolling: f64,
    pub rolls: bool,
    /// Whether it has friction at all.
    pub rough: bool,
    pub priority: i64,
}

/// Meshes and height fields.
pub(super) struct Assets<'a> {
    meshes: BTreeMap<String, MeshAsset<'a>>,
    fields: BTreeMap<String, Item<'a>>,
    compiler: &'a Compiler,
}

struct MeshAsset<'a> {
    item: Item<'a>,
    solid: OnceCell<Solid>,
}

/// What has a mass.
#[derive(Clone)]
enum Solid {
    Shape(Shape),
    Ellipsoid(Vec3),
    Nothing,
}

impl Solid {
    fn mass(&self, density: f64) -> Result<Option<MassProperties>, SimulateError> {
        match self {
            Solid::Shape(shape) => shape.mass_properties(density).map(Some),
            Solid::Ellipsoid([a, b, c]) => {
                let mass = density * 4.0 / 3.0 * std::f64::consts::PI * a * b * c;
                let mut inertia = [[0.0; 3]; 3];
                for (k, (p, q)) in [(b, c), (a, c), (a, b)].into_iter().enumerate() {
                    inertia[k][k] = 0.2 * mass * (p * p + q * q);
                }
                Ok(Some(MassProperties { mass, centre: [0.0; 3], inertia }))
            }
            Solid::Nothing => Ok(None),
        }
    }
}

impl<'a> Assets<'a> {
    pub fn read(
        root: &'a Element,
        defaults: &'a Defaults,
        compiler: &'a Compiler,
    ) -> Result<Self, SimulateError> {
        let (mut meshes, mut fields) = (BTreeMap::new(), BTreeMap::new());
        let mut known = BTreeMap::new();
        for element in root.named("asset").flat_map(|a| &a.children) {
            let item = defaults.item(element, MAIN)?;
            let stem = || {
                let file = item.text("file")?;
                let name = bare(file);
                Some(name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned())
            };
            let Some(name) = item.text("name").map(str::to_owned).or_else(stem) else { continue };
            match element.tag.as_str() {
                "mesh" => {
                    element.is_first("mesh", Some(name.clone()), &mut known)?;
                    meshes.insert(name, MeshAsset { item, solid: OnceCell::new() });
                }
                "hfield" => {
                    element.is_first("hfield", Some(name.clone()), &mut known)?;
                    fields.insert(name, item);
                }
                "model" => return Err(item.wrong("one model", "another one")),
                // Pictures.
                _ => {}
            }
        }
        Ok(Self { meshes, fields, compiler })
    }

    fn mesh(&self, geom: &Item) -> Result<&MeshAsset<'a>, SimulateError> {
        let name = geom.text("mesh").unwrap_or_default();
        let found = self.meshes.get(name);
        found.ok_or_else(|| geom.wrong("a mesh of <asset>", format!("`{name}`")))
    }

    /// The geom of an element; `say` takes what is left out.
    pub fn geom(
        &self,
        item: Item<'a>,
        around: &Frame,
        with_mass: bool,
        say: &mut Vec<String>,
    ) -> Result<Geom<'a>, SimulateError> {
        unknown(&item, &KNOWN, say);
        let touch = touch(&item, self.compiler)?;
        let touches = touch.bits != [0, 0];
        let group = item.whole("group", 0)?;
        let groups = self.compiler.groups;
        let heavy = with_mass && (groups[0]..=groups[1]).contains(&group);
        let mut own = self.compiler.frame(&item)?;
        let kind = item.text("type").unwrap_or("sphere");
        let (solid, shape) = match kind {
            "mesh" if !touches && !heavy => (Solid::Nothing, json!(null)),
            "mesh" => self.mesh(&item)?.shape(self.compiler, heavy)?,
            "hfield" if !touches => (Solid::Nothing, json!(null)),
            "hfield" => (Solid::Nothing, self.field(&item)?),
            _ if item.text("mesh").is_some() => {
                return Err(item.wrong("type mesh, for primitives are not fitted", kind));
            }
            _ => primitive(&item, kind, touches, &mut own)?,
        };
        if item.flag("shellinertia", false)? && heavy {
            return Err(item.wrong("a solid", "`shellinertia`"));
        }
        let place = around.then(&own);
        let mass = match (heavy, item.some::<1>("mass")?) {
            (false, _) => None,
            (true, Some([mass])) if mass < 0.0 => {
                return Err(item.wrong("a mass of at least 0", mass));
            }
            (true, Some([mass])) => {
                let like = solid.mass(1.0).map_err(|e| item.wrong("a solid", e))?;
                like.filter(|_| mass > 0.0).map(|like| MassProperties {
                    mass,
                    inertia: like.inertia.map(|row| row.map(|x| x * mass / like.mass)),
                    ..like
                })
            }
            (true, None) => match item.real("density", DENSITY)? {
                0.0 => None,
                density => solid.mass(density).map_err(|e| item.wrong("a solid", e))?,
            },
        };
        let mass = mass.map(|own| place.mass(&own));
        Ok(Geom { item, place, shape: touches.then_some(shape), mass, touch })
    }

    /// A height field: an image is refused, heights in the model are the rows from the far end on.
    fn field(&self, geom: &Item) -> Result<Value, SimulateError> {
        let name = geom.text("hfield").unwrap_or_default();
        let Some(item) = self.fields.get(name) else {
            return Err(geom.wrong("an hfield of <asset>", format!("`{name}`")));
        };
        let Some([x, y, top, _]) = item.some::<4>("size")? else {
            return Err(item.wrong("`size`", "none"));
        };
        let (rows, columns) = (item.whole("nrow", 0)?, item.whole("ncol", 0)?);
        let Some(heights) = item.numbers("elevation")? else {
            return Err(item.wrong("heights as `elevation`", "none"));
        };
        let count = rows.checked_mul(columns).filter(|_| rows >= 2 && columns >= 2);
        if count != Some(heights.len() as i64) {
            let expected = format!("{rows} × {columns} heights, at least 2 × 2");
            return Err(item.wrong(expected, heights.len()));
        }
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let by = if high > low { top / (high - low) } else { 0.0 };
        let rows: Vec<Vec<f64>> = heights
            .chunks(columns as usize)
            .rev()
            .map(|row| row.iter().map(|z| by * (z - low)).collect())
            .collect();
        Ok(json!({"kind": "heightfield", "heights": rows, "size": [2.0 * x, 2.0 * y]}))
    }
}

impl MeshAsset<'_> {
    /// The surface, as a solid where a mass is asked for.
    fn shape(&self, compiler: &Compiler, heavy: bool) -> Result<(Solid, Value), SimulateError> {
        let item = &self.item;
        if let Some(kind) = item.text("inertia").filter(|kind| *kind != "exact" && heavy) {
            return Err(item.wrong("a mesh with its exact inertia", format!("`inertia` {kind}")));
        }
        let by = item.some::<3>("scale")?.unwrap_or([1.0; 3]);
        let origin = item.some::<3>("refpos")?.unwrap_or_default();
        let turned = item.text("refquat").is_some();
        let same = by[0] == by[1] && by[1] == by[2] && by[0] > 0.0;
        let file = item.text("file");
        let solid = match (self.solid.get(), file) {
            (Some(solid), _) => solid.clone(),
            // A surface that stays in its file and needs no mass is not read.
            (None, Some(_)) if same && origin == [0.0; 3] && !turned && !heavy => Solid::Nothing,
            (None, _) => {
                let solid = self.read(compiler, by, origin)?;
                self.solid.get_or_init(|| solid).clone()
            }
        };
        let shape = match (&solid, file) {
            (_, Some(file)) if same && origin == [0.0; 3] && !turned => {
                let mut shape = json!({"kind": "mesh", "file": path(compiler, file)});
                if by[0] != 1.0 {
                    shape["scale"] = json!(by[0]);
                }
                shape
            }
            (Solid::Shape(Shape::Mesh(mesh)), _) => {
                json!({"kind": "mesh", "vertices": mesh.vertices(), "triangles": mesh.triangles()})
            }
            (Solid::Shape(Shape::Polyhedron(p)), _) => {
                json!({"kind": "polyhedron", "vertices": p.vertices(), "faces": p.faces()})
            }
            _ => return Err(item.wrong("a file, or vertices", "none")),
        };
        Ok((solid, shape))
    }

    fn read(&self, compiler: &Compiler, by: Vec3, origin: Vec3) -> Result<Solid, SimulateError> {
        let item = &self.item;
        let back = match item.some::<4>("refquat")? {
            Some(q) => {
                Frame { x: [0.0; 3], q: crate::rotation::unit(nonsmooth_scenes::Rotation(q)) }
                    .back()
            }
            None => Frame::HERE,
        };
        let moved = |v: &Vec3| {
            let v = apply(&back.q.matrix(), sub(*v, origin));
            [by[0] * v[0], by[1] * v[1], by[2] * v[2]]
        };
        let (mut vertices, mut triangles) = match item.text("file") {
            Some(file) => {
                let file = Some(path(compiler, file));
                let mut table =
                    ShapeTable::Mesh { file, scale: None, vertices: vec![], triangles: vec![] };
                load_mesh(&mut table, &compiler.folder, &item.key())?;
                let ShapeTable::Mesh { vertices, triangles, .. } = table else {
                    unreachable!("a mesh stays one")
                };
                (vertices, triangles)
            }
            None => {
                let Some(numbers) = item.numbers("vertex")? else {
                    return Err(item.wrong("`file` or `vertex`", "none"));
                };
                let faces = item.numbers("face")?.unwrap_or_default();
                let (points, rest) = numbers.as_chunks::<3>();
                let (corners, more) = faces.as_chunks::<3>();
                if !rest.is_empty() || !more.is_empty() {
                    return Err(item.wrong("three numbers of each vertex and face", "others"));
                }
                if let Some(x) = faces.iter().find(|x| **x < 0.0 || x.fract() != 0.0) {
                    return Err(item.wrong("whole numbers of at least 0 as `face`", x));
                }
                let triangles: Vec<_> = corners.iter().map(|t| t.map(|x| x as usize)).collect();
                (points.to_vec(), triangles)
            }
        };
        vertices.iter_mut().for_each(|v| *v = moved(v));
        // A mirror turns surfaces inside out.
        if by[0] * by[1] * by[2] < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        if triangles.is_empty() {
            // Vertices alone stand for their convex hull.
            let hull = Polyhedron::hull(&vertices);
            return Ok(Solid::Shape(hull.map_err(|e| item.wrong("a convex solid", e))?.into()));
        }
        let mesh = Mesh::new(&vertices, &triangles).map_err(|e| item.wrong("a surface", e))?;
        Ok(Solid::Shape(mesh.into()))
    }
}

/// The name of a file without its folders.
fn bare(file: &str) -> &str {
    file.rsplit(['/', '\\']).next().unwrap_or(file)
}

/// Where a mesh is, from the folder of the model.
fn path(compiler: &Compiler, file: &str) -> String {
    let file = if compiler.strippath { bare(file) } else { file };
    let folder = match compiler.meshdir.as_str() {
        "" => compiler.assetdir.as_str(),
        folder => folder,
    };
    match folder.trim_end_matches('/') {
        "" => file.into(),
        folder => format!("{folder}/{file}"),
    }
}

/// MuJoCo's coefficients of friction where none are given: of sliding, and of turning and rolling, m.
const FRICTION: [f64; 3] = [1.0, 5e-3, 1e-4];

fn touch(item: &Item, compiler: &Compiler) -> Result<Touch, SimulateError> {
    let bits = |name: &str| item.whole(name, 1).map(|x| x as u32);
    let [friction, _, rolling] = item.list("friction", FRICTION)?;
    if rolling < 0.0 {
        return Err(item.wrong("a third `friction` of at least 0", rolling));
    }
    if friction < 0.0 {
        return Err(item.wrong("a `friction` of at least 0", friction));
    }
    let [friction, rolling] = compiler.friction().unwrap_or([friction, rolling]);
    Ok(Touch {
        bits: [bits("contype")?, bits("conaffinity")?],
        friction,
        rough: item.whole("condim", 3)? != 1,
        rolling,
        rolls: item.whole("condim", 3)? == 6,
        priority: item.whole("priority", 0)?,
    })
}

/// A shape that is stated by its size; `own` is where `fromto` puts it.
fn primitive(
    item: &Item,
    kind: &str,
    touches: bool,
    own: &mut Frame,
) -> Result<(Solid, Value), SimulateError> {
    let mut size = item.list("size", [0.0; 3])?;
    if let Some([a, b, c, d, e, f]) = item.some::<6>("fromto")? {
        let along = sub([a, b, c], [d, e, f]);
        let length = norm(along);
        if !matches!(kind, "capsule" | "cylinder" | "box" | "ellipsoid") || length == 0.0 {
            return Err(item.wrong("`fromto` of a capsule, cylinder, box or ellipsoid", kind));
        }
        let middle = [0.5 * (a + d), 0.5 * (b + e), 0.5 * (c + f)];
        *own = Frame { x: middle, q: from_third(scale(1.0 / length, along)) };
        size = match kind {
            "box" | "ellipsoid" => [size[0], size[0], 0.5 * length],
            _ => [size[0], 0.5 * length, 0.0],
        };
    }
    let needed = match kind {
        "plane" => 0,
        "sphere" => 1,
        "capsule" | "cylinder" => 2,
        _ => 3,
    };
    if size[..needed].iter().any(|x| *x <= 0.0) {
        let expected = format!("{needed} positive numbers as `size`");
        let found = item.text("size").map_or("none".into(), |text| format!("`{text}`"));
        return Err(item.wrong(expected, found));
    }
    let (radius, half_length) = (size[0], size[1]);
    let half = size;
    let (shape, value) = match kind {
        "sphere" => (Shape::Sphere { radius }, json!({"kind": kind, "radius": radius})),
        "box" => (Shape::Box { half }, json!({"kind": kind, "half": half})),
        "capsule" | "cylinder" => {
            let value = json!({"kind": kind, "radius": radius, "half_length": half_length});
            let shape = match kind {
                "capsule" => Shape::Capsule { half_length, radius },
                _ => Shape::Cylinder { half_length, radius },
            };
            (shape, value)
        }
        "plane" => return Ok((Solid::Nothing, json!({"kind": "plane"}))),
        "ellipsoid" if !touches => return Ok((Solid::Ellipsoid(half), json!(null))),
        other => {
            let expected = "plane, sphere, capsule, cylinder, box, mesh or hfield as `type`";
            return Err(item.wrong(expected, other));
        }
    };
    Ok((Solid::Shape(shape), value))
}
