//! From a [`SceneFile`] to bodies in a world.

use std::collections::{BTreeMap, BTreeSet};

use nonsmooth_scenes::vec3::{Mat3, Vec3, add, norm, scale};
use nonsmooth_scenes::{Polyhedron, Rotation, SceneEntry, SceneError};

use super::joints::WORLD;
use super::{
    BodyTable, ComplianceTable, ElasticTable, ForceTable, GenerateTable, LawTable, MotionTable,
    PartTable, PeriodicTable, RotationTable, SceneFile, ShapeOrName, ShapeTable,
};
use crate::error::{finite, require};
use crate::shape::plane;
use crate::{
    Body, BodyId, Compliance, Dimension, Law, Mesh, Motion, Part, Periodic, Polygon, Settled,
    Shape, SimulateError, Simulation, State, World, Wrenches,
};

/// Groups have a bit each.
const GROUPS: usize = 32;
/// The group of nobody, for what touches nothing.
const NOBODY: &str = "nothing";

impl From<LawTable> for Law {
    fn from(LawTable { mu, e, e_t, mu_rolling: mu_r, .. }: LawTable) -> Self {
        Self { mu, e, e_t, mu_r }
    }
}

impl SceneFile {
    /// The world of the scene.
    ///
    /// Errors: a value that is not possible, by its path; names that are not known, or there twice; materials that may meet without a law.
    pub fn world(&self) -> Result<World, SimulateError> {
        finite(|| "gravity".into(), &self.gravity)?;
        let mut builder = Builder::new(self)?;
        if let Some(table) = &self.periodic {
            builder.world.periodic = repeating(table)?;
        }
        for (k, table) in self.bodies.iter().enumerate() {
            let key = match table.name.as_str() {
                "" => format!("bodies[{k}]"),
                name => format!("bodies[{k}] ({name})"),
            };
            let body = builder.body(table, &key)?;
            builder.add(body, &key)?;
        }
        for (k, table) in self.elastic.iter().enumerate() {
            let key = match table.name.as_str() {
                "" => format!("elastic[{k}]"),
                name => format!("elastic[{k}] ({name})"),
            };
            builder.elastic(table, &key)?;
        }
        for (k, table) in self.generate.iter().enumerate() {
            if builder.world.dimension == Dimension::Two {
                let expected = "none in the plane: families are of space";
                return Err(SimulateError::value(format!("generate[{k}]"), expected, "one"));
            }
            builder.family(table, &format!("generate[{k}]"))?;
        }
        self.world_is_nobody()?;
        // Partners of a joint need no law of contact.
        super::joints::join(&mut builder.world, &self.joints, &self.couplings)?;
        builder.laws()?;
        Ok(builder.world)
    }

    /// Whether no body has the name by which joints call the world, where they do: they would not mean the body.
    fn world_is_nobody(&self) -> Result<(), SimulateError> {
        let named = self.bodies.iter().position(|body| body.name == WORLD);
        let mut ends = self.joints.iter().flat_map(|joint| [&joint.a, &joint.b]);
        match named {
            Some(k) if ends.any(|end| end == WORLD) => {
                let expected = "another name, for joints mean by `world` what is no body";
                Err(SimulateError::value(format!("bodies[{k}].name"), expected, "`world`"))
            }
            _ => Ok(()),
        }
    }

    /// An error of the world at the place in the file that states it: laws of contact, which the world knows by their materials, what acts along coordinates of joints,
    /// motions that are given.
    fn in_file(&self, error: SimulateError) -> SimulateError {
        let SimulateError::Value { key, expected, found } = error else { return error };
        let key = super::joints::in_file(&self.joints, key);
        let key = key.replace(".motion.linear", ".motion.velocity");
        let key = key.replace(".motion.angular", ".motion.angular_velocity");
        let of_pair = self.pairs.iter().enumerate().find_map(|(k, pair)| {
            let [a, b] = &pair.between;
            let ways = [format!("pairs[{a}, {b}]."), format!("pairs[{b}, {a}].")];
            let field = ways.iter().find_map(|way| key.strip_prefix(way))?;
            Some((format!("pairs[{k}]"), field))
        });
        let default = || Some(("pairs_default".to_owned(), key.strip_prefix("law.")?));
        let key = match of_pair.or_else(default) {
            Some((place, "mu_r")) => format!("{place}.mu_rolling"),
            Some((place, field)) => format!("{place}.{field}"),
            None => key,
        };
        SimulateError::Value { key, expected, found }
    }

    /// The scene, ready to move.
    ///
    /// Errors: those of [`world`](Self::world) and of [`Simulation::new`]; forces on bodies that there are not; an unknown solver or setting.
    pub fn build(&self) -> Result<Simulation, SimulateError> {
        Ok(self.made(|world| Ok((Simulation::new(world, self.integrator)?, ())))?.0)
    }

    /// The same with bodies that overlap moved apart, as [`Simulation::settled`] does it.
    ///
    /// Errors: as of [`build`](Self::build), with the overlaps that are left.
    pub fn build_settled(&self) -> Result<(Simulation, Settled), SimulateError> {
        self.made(|world| Simulation::settled(world, self.integrator))
    }

    /// The scene, its world set in motion by `start`, and what else that says.
    fn made<T>(
        &self,
        start: impl FnOnce(World) -> Result<(Simulation, T), SimulateError>,
    ) -> Result<(Simulation, T), SimulateError> {
        let Self { time, solver, .. } = self;
        require(|| "time.h".into(), time.h, time.h > 0.0, "a positive number of seconds")?;
        require(
            || "time.end".into(),
            time.end,
            time.end >= 0.0,
            "a number of seconds of at least 0",
        )?;
        let within = solver.tol > 0.0 && solver.tol <= 1.0;
        require(|| "solver.tol".into(), solver.tol, within, "a positive number of at most 1")?;
        if self.output.every == 0 {
            return Err(SimulateError::value("output.every", "at least one step", 0));
        }
        let world = self.world()?;
        let forces = self.forces.iter().enumerate();
        let forces: Vec<_> = forces
            .map(|(k, table)| acting(table, &world, &format!("forces[{k}]")))
            .collect::<Result<_, _>>()?;
        let (simulation, said) = start(world).map_err(|e| self.in_file(e))?;
        let known = |e: SimulateError| match e {
            SimulateError::Solve(e) => {
                SimulateError::Schema { path: "solver".into(), problem: e.to_string() }
            }
            e => e,
        };
        let mut simulation = simulation
            .with_solver(&solver.name, solver.settings.clone())
            .map_err(known)?
            .with_tolerance(solver.tol);
        for force in forces {
            simulation = simulation.with_force(force);
        }
        Ok((simulation, said))
    }
}

/// How a world repeats itself by the table.
fn repeating(table: &PeriodicTable) -> Result<Periodic, SimulateError> {
    let PeriodicTable { lengths, gradient, corner } = *table;
    let at = |name: &str| format!("periodic.{name}");
    finite(|| at("gradient"), &gradient.concat())?;
    for length in lengths {
        require(|| at("lengths"), length, length >= 0.0, "lengths of at least 0")?;
    }
    if lengths == [0.0; 3] {
        return Err(SimulateError::value(at("lengths"), "one that is not 0", "none"));
    }
    Ok(Periodic { corner, ..Periodic::sheared(lengths, gradient) })
}

/// A force of the file, as the simulation asks for it.
fn acting(
    table: &ForceTable,
    world: &World,
    key: &str,
) -> Result<impl FnMut(&State, &mut Wrenches) + Send + use<>, SimulateError> {
    let ForceTable { force, torque, at, .. } = table.clone();
    for (name, vector) in [("force", force), ("torque", torque), ("at", at)] {
        finite(|| format!("{key}.{name}"), &vector)?;
    }
    if world.dimension == Dimension::Two {
        crate::planar::force(key, force, torque, at)?;
    }
    let (from, until) =
        (table.from.unwrap_or(f64::NEG_INFINITY), table.until.unwrap_or(f64::INFINITY));
    if from.is_nan() || until.is_nan() || from >= until {
        let expected = "an end after the beginning";
        return Err(SimulateError::value(
            format!("{key}.until"),
            expected,
            format!("{from} to {until}"),
        ));
    }
    let place = world.bodies.iter().position(|b| b.name == table.body && !b.name.is_empty());
    let Some(place) = place else {
        let names = world.bodies.iter().map(|b| b.name.as_str()).filter(|n| !n.is_empty());
        return Err(unknown(&format!("{key}.body"), "body", &table.body, names));
    };
    if !world.bodies[place].is_free() {
        let found = format!("`{}`, which nothing pushes", table.body);
        let expected = "the name of a body that moves freely";
        return Err(SimulateError::value(format!("{key}.body"), expected, found));
    }
    let body = BodyId(place as u32);
    Ok(move |state: &State, wrenches: &mut Wrenches| {
        // A step has one force from its beginning to its end: what acts for a part of it is as much smaller.
        let share = wrenches.share(from, until);
        if share > 0.0 {
            let [w, x, y, z] = state.rotation[place];
            let arm = nonsmooth_scenes::vec3::apply(&Rotation([w, x, y, z]).matrix(), at);
            let point = add(state.position[place], arm);
            wrenches.force_at(state, body, scale(share, force), point);
            wrenches.torque(body, scale(share, torque));
        }
    })
}

pub(super) fn unknown<'a>(
    key: &str,
    what: &str,
    name: &str,
    known: impl Iterator<Item = &'a str> + Clone,
) -> SimulateError {
    let meant = nonsmooth_solve::spelling::meant(name, known);
    SimulateError::value(key, format!("the name of a {what}"), format!("`{name}`{meant}"))
}

/// A world that is being filled.
struct Builder<'a> {
    file: &'a SceneFile,
    world: World,
    shapes: BTreeMap<&'a str, &'a ShapeTable>,
    groups: Vec<&'a str>,
    /// The groups that bodies are in.
    inhabited: BTreeSet<&'a str>,
    names: BTreeSet<String>,
    /// Pairs of materials with a law.
    stated: BTreeSet<(usize, usize)>,
}

impl<'a> Builder<'a> {
    fn new(file: &'a SceneFile) -> Result<Self, SimulateError> {
        let mut world = World::new(file.gravity);
        world.dimension = super::plane::dimension(file.dimension.into())?;
        if let Some(law) = file.pairs_default {
            world.law = law.into();
        }
        file.materials.keys().for_each(|name| {
            world.material(name);
        });
        for (name, material) in &file.materials {
            if let Some(density) = material.density {
                let key = || format!("materials.{name}.density");
                require(key, density, density > 0.0, "a positive number")?;
            }
        }
        let mut shapes = BTreeMap::new();
        for (k, named) in file.shapes.iter().enumerate() {
            if shapes.insert(named.name.as_str(), &named.shape).is_some() {
                return Err(twice(&format!("shapes[{k}].name"), &named.name));
            }
        }
        Ok(Self {
            file,
            world,
            shapes,
            groups: vec![],
            inhabited: file.bodies.iter().flat_map(|b| &b.groups).map(String::as_str).collect(),
            names: BTreeSet::new(),
            stated: BTreeSet::new(),
        })
    }

    fn add(&mut self, body: Body, key: &str) -> Result<(), SimulateError> {
        if !body.name.is_empty() && !self.names.insert(body.name.clone()) {
            return Err(twice(&format!("{key}.name"), &body.name));
        }
        self.world.add(body);
        Ok(())
    }

    fn body(&mut self, table: &'a BodyTable, key: &str) -> Result<Body, SimulateError> {
        let parts = self.parts(table, key)?;
        let driven = table.fixed || table.motion.is_some();
        let at = |name: &str| format!("{key}.{name}");
        let density = match (table.density, &table.material) {
            (Some(density), _) => Some(density),
            (None, Some(material)) => self.file.materials.get(material).and_then(|m| m.density),
            (None, None) => None,
        };
        let rotation = rotation(table.rotation.as_ref(), &at("rotation"))?;
        if driven {
            unmoved(table, key)?;
        }
        let mut body = match (driven, table.mass, density) {
            (true, Some(_), _) => {
                return Err(SimulateError::value(
                    at("mass"),
                    "none of a body that does not move freely",
                    "one",
                ));
            }
            (true, None, _) => Body::fixed(parts).at(table.position),
            (false, Some(mass), _) => {
                if table.density.is_some() {
                    return Err(SimulateError::value(
                        at("density"),
                        "either a mass or a density",
                        "both",
                    ));
                }
                let inertia = inertia(table.inertia.as_deref(), &at("inertia"))?;
                Body::with_mass(mass, inertia, parts).at(table.position)
            }
            (false, None, Some(density)) => {
                if table.inertia.is_some() {
                    let expected = "none with a density, which it follows from";
                    return Err(SimulateError::value(at("inertia"), expected, "one"));
                }
                require(|| at("density"), density, density > 0.0, "a positive number")?;
                if parts.is_empty() {
                    let expected = "one, for its mass is to follow from a density";
                    return Err(SimulateError::value(at("shape"), expected, "none"));
                }
                let dense = parts.into_iter().map(|part| (part, density)).collect();
                let body = Body::composed(dense).map_err(|e| placed(e, key))?;
                let offset = nonsmooth_scenes::vec3::apply(&rotation.matrix(), body.position);
                let position = add(table.position, offset);
                body.at(position)
            }
            (false, None, None) => {
                let expected =
                    "a mass with inertia, a density, a material with one, or fixed = true";
                return Err(SimulateError::value(at("mass"), expected, "none of them"));
            }
        };
        if table.inertia.is_some() && table.mass.is_none() {
            return Err(SimulateError::value(at("mass"), "one where an inertia is given", "none"));
        }
        body.motion = match (table.fixed, table.motion) {
            (true, Some(_)) => {
                return Err(SimulateError::value(at("motion"), "none of a fixed body", "one"));
            }
            (true, None) => Motion::Fixed,
            (false, Some(MotionTable::Surface { velocity, angular_velocity })) => {
                Motion::Surface { linear: velocity, angular: angular_velocity }
            }
            (false, Some(MotionTable::Uniform { velocity })) => Motion::Uniform { velocity },
            (false, Some(MotionTable::Sine { amplitude, frequency, phase })) => {
                Motion::Oscillating { amplitude, frequency, phase }
            }
            (false, None) => Motion::Free,
        };
        (body.force, body.torque) = (table.force, table.torque);
        if table.groups.iter().any(|group| group == NOBODY) {
            let expected = "another name, for a group of nobody is meant by `nothing`";
            return Err(SimulateError::value(at("groups"), expected, "`nothing`"));
        }
        if !table.groups.is_empty() {
            body.membership = self.bits(&table.groups, &at("groups"))?;
        }
        if !table.collides_with.is_empty() {
            self.known_groups(&table.collides_with, &at("collides_with"))?;
            body.collides_with = self.bits(&table.collides_with, &at("collides_with"))?;
        }
        Ok(body.named(&table.name).turned(rotation).moving(table.velocity, table.angular_velocity))
    }

    fn parts(&mut self, table: &'a BodyTable, key: &str) -> Result<Vec<Part>, SimulateError> {
        let material = self.material(table.material.as_deref(), &format!("{key}.material"))?;
        match (&table.shape, &table.shapes[..]) {
            (Some(shape), []) => Ok(vec![self.part(shape, &format!("{key}.shape"))?.of(material)]),
            (None, shapes) => {
                let each = shapes.iter().enumerate();
                each.map(|(k, part)| self.placed(part, material, &format!("{key}.shapes[{k}]")))
                    .collect()
            }
            (Some(_), _) => {
                let key = format!("{key}.shapes");
                Err(SimulateError::value(key, "either shape or shapes", "both"))
            }
        }
    }

    fn placed(
        &mut self,
        table: &'a PartTable,
        material: usize,
        key: &str,
    ) -> Result<Part, SimulateError> {
        let own = match &table.material {
            None => material,
            name => self.material(name.as_deref(), &format!("{key}.material"))?,
        };
        let part = self.part(&table.shape, &format!("{key}.shape"))?;
        let turned = rotation(table.rotation.as_ref(), &format!("{key}.rotation"))?;
        let position =
            add(table.position, nonsmooth_scenes::vec3::apply(&turned.matrix(), part.position));
        finite(|| format!("{key}.position"), &table.position)?;
        Ok(part.clone().at(position, turned.after(part.rotation)).of(own))
    }

    fn material(&mut self, name: Option<&str>, key: &str) -> Result<usize, SimulateError> {
        let Some(name) = name else { return Ok(0) };
        match self.file.materials.contains_key(name) {
            true => Ok(self.world.material(name)),
            false => {
                let known = self.file.materials.keys().map(String::as_str);
                Err(unknown(key, "material of [materials]", name, known))
            }
        }
    }

    fn part(&self, shape: &ShapeOrName, key: &str) -> Result<Part, SimulateError> {
        let table = match shape {
            ShapeOrName::Shape(table) => table,
            ShapeOrName::Name(name) => {
                self.shapes.get(name.as_str()).copied().ok_or_else(|| {
                    unknown(key, "shape of [[shapes]]", name, self.shapes.keys().copied())
                })?
            }
        };
        let solid = |made: Result<Polyhedron, nonsmooth_scenes::SceneError>| {
            made.map(|p| Part::new(Shape::Polyhedron(p)))
                .map_err(|e| SimulateError::Schema { path: key.into(), problem: e.to_string() })
        };
        let flat = self.world.dimension == Dimension::Two;
        let part = match table {
            ShapeTable::Disc { radius } => Part::new(Shape::Disc { radius: *radius }),
            ShapeTable::Polygon { vertices } => {
                Part::new(Polygon::new(vertices).map_err(|e| placed(e, key))?)
            }
            ShapeTable::Box { half: [a, b, c] } if flat => {
                if *c != 0.0 {
                    let expected = "two half sides, for the scene is in the plane";
                    return Err(SimulateError::value(format!("{key}.half"), expected, "three"));
                }
                Part::new(Polygon::rectangle([*a, *b]).map_err(|e| placed(e, key))?)
            }
            ShapeTable::Capsule { half_length, radius } if flat => {
                Part::new(Shape::Stadium { half_length: *half_length, radius: *radius })
            }
            ShapeTable::Sphere { radius } => Part::new(Shape::Sphere { radius: *radius }),
            ShapeTable::Box { half } => Part::new(Shape::Box { half: *half }),
            ShapeTable::Capsule { half_length, radius } => {
                Part::new(Shape::Capsule { half_length: *half_length, radius: *radius })
            }
            ShapeTable::Cylinder { half_length, radius } => {
                Part::new(Shape::Cylinder { half_length: *half_length, radius: *radius })
            }
            ShapeTable::Cone { half_length, radius } => {
                Part::new(Shape::Cone { half_length: *half_length, radius: *radius })
            }
            ShapeTable::Mesh { file: Some(file), .. } => {
                let expected = "a scene that was read with its files (SceneFile::load_meshes)";
                return Err(SimulateError::value(format!("{key}.file"), expected, file));
            }
            ShapeTable::Mesh { scale: Some(scale), .. } => {
                let expected = "none without a file";
                return Err(SimulateError::value(format!("{key}.scale"), expected, scale));
            }
            ShapeTable::Mesh { vertices, triangles, .. } => {
                Part::new(Mesh::new(vertices, triangles).map_err(|e| placed(e, key))?)
            }
            ShapeTable::Heightfield { heights, size } => {
                Part::new(Mesh::heightfield(heights, *size).map_err(|e| placed(e, key))?)
            }
            ShapeTable::Plane { normal } => plane([0.0; 3], *normal)
                .map_err(|e| SimulateError::Schema { path: key.into(), problem: e.to_string() })?,
            ShapeTable::Polyhedron { vertices, faces } => {
                solid(Polyhedron::new(vertices.clone(), faces.clone()))?
            }
            ShapeTable::Prism { base, half_height } => {
                let h = *half_height;
                require(|| format!("{key}.half_height"), h, h > 0.0, "a positive number")?;
                let base: Vec<Vec3> = base.iter().map(|[x, y]| [*x, *y, -h]).collect();
                solid(Polyhedron::prism(&base, [0.0, 0.0, 2.0 * h]))?
            }
        };
        crate::planar::belongs(&part.shape, self.world.dimension, || key.into())?;
        part.shape.validate(key)?;
        Ok(part)
    }

    /// Adds an elastic box.
    fn elastic(&mut self, table: &'a ElasticTable, key: &str) -> Result<(), SimulateError> {
        if !table.name.is_empty() && !self.names.insert(table.name.clone()) {
            return Err(twice(&format!("{key}.name"), &table.name));
        }
        let material = self.material(table.material.as_deref(), &format!("{key}.material"))?;
        let of_material = || self.file.materials.get(table.material.as_ref()?)?.density;
        let Some(density) = table.density.or_else(of_material) else {
            let expected = "a density, or a material with one";
            return Err(SimulateError::value(format!("{key}.density"), expected, "none"));
        };
        self.world.add_elastic(super::elastic::solid(table, (material, density), key)?);
        Ok(())
    }

    /// Whether there is somebody in each of these groups.
    fn known_groups(&self, names: &[String], key: &str) -> Result<(), SimulateError> {
        let known = &self.inhabited;
        match names.iter().find(|name| *name != NOBODY && !known.contains(name.as_str())) {
            None => Ok(()),
            Some(name) => Err(unknown(key, "group that a body is in", name, known.iter().copied())),
        }
    }

    /// The bits of groups, which are numbered as they are met.
    fn bits(&mut self, names: &'a [String], key: &str) -> Result<u32, SimulateError> {
        let mut bits = 0;
        for name in names {
            let k = self.groups.iter().position(|g| g == name).unwrap_or(self.groups.len());
            if k == GROUPS {
                let expected = format!("at most {GROUPS} groups in a scene");
                return Err(SimulateError::value(key, expected, format!("`{name}` as another")));
            }
            if k == self.groups.len() {
                self.groups.push(name);
            }
            bits |= 1 << k;
        }
        Ok(bits)
    }

    /// Adds the bodies of a family.
    fn family(&mut self, table: &GenerateTable, key: &str) -> Result<(), SimulateError> {
        finite(|| format!("{key}.position"), &table.position)?;
        let wrong = |problem: String| SimulateError::Schema { path: key.into(), problem };
        let fresh;
        let scene = match table.made.scene(&table.scene, &table.set) {
            Some(scene) => scene,
            None => {
                let made = SceneEntry::find(&table.scene).and_then(|entry| entry.make(&table.set));
                fresh = made.map_err(|e| match e {
                    SceneError::Stopped => e.into(),
                    e => wrong(e.to_string()),
                })?;
                &fresh
            }
        };
        let made = World::try_from(scene).map_err(|e| wrong(e.to_string()))?;
        if !made.periodic.periods.is_empty() {
            if !self.world.periodic.periods.is_empty() {
                let expected = "no periods besides those of `periodic` or of a family before";
                let found = format!("`{}` with its own", table.scene);
                return Err(SimulateError::value(key, expected, found));
            }
            self.world.periodic = Periodic { corner: table.position, ..made.periodic.clone() };
        }
        let name = table.name.as_deref().unwrap_or(&table.scene);
        let material = self.world.material(name);
        self.world.pair(material, material, made.law);
        self.stated.insert((material, material));
        for (k, body) in made.bodies.into_iter().enumerate() {
            let own = match body.name.as_str() {
                "" => format!("{name} {k}"),
                of => format!("{name} {of}"),
            };
            let position = add(body.position, table.position);
            self.add(body.named(own).at(position).of(material), key)?;
        }
        for (k, mut elastic) in made.elastic.into_iter().enumerate() {
            let own = format!("{name} {k}");
            if !self.names.insert(own.clone()) {
                return Err(twice(&format!("{key}.name"), &own));
            }
            elastic.solid.position = add(elastic.solid.position, table.position);
            self.world.add_elastic(elastic.named(own).of(material));
        }
        Ok(())
    }

    /// The laws of pairs; whoever may meet must have one.
    fn laws(&mut self) -> Result<(), SimulateError> {
        for (k, pair) in self.file.pairs.iter().enumerate() {
            let [a, b] = &pair.between;
            let number = |name: &str| {
                let known = self.world.materials();
                match known.iter().position(|m| m == name) {
                    Some(k) => Ok(k),
                    None => {
                        let key = format!("pairs[{k}].between");
                        Err(unknown(&key, "material", name, known.iter().map(String::as_str)))
                    }
                }
            };
            let (a, b) = (number(a)?, number(b)?);
            let fresh = self.stated.insert((a.min(b), a.max(b)));
            let own = self.file.generate.iter().any(|g| {
                let name = g.name.as_deref().unwrap_or(&g.scene);
                a == b && self.world.materials()[a] == name
            });
            if !fresh && !own {
                let names = format!("{} and {}", pair.between[0], pair.between[1]);
                return Err(twice(&format!("pairs[{k}].between"), &names));
            }
            let super::PairTable { mu, e, e_t, mu_rolling: mu_r, .. } = *pair;
            self.world.pair(a, b, Law { mu, e, e_t, mu_r });
            if let Some(ComplianceTable { stiffness, damping }) = pair.compliance {
                self.world.comply(a, b, Compliance { stiffness, damping });
            }
        }
        match self.file.pairs_default {
            Some(law) => law.compliance.map_or(Ok(()), |c| self.all_comply(c, law.e)),
            None => self.all_stated(),
        }
    }

    /// Lets all pairs without a law of their own give way.
    fn all_comply(&mut self, table: ComplianceTable, e: f64) -> Result<(), SimulateError> {
        let ComplianceTable { stiffness, damping } = table;
        let compliance = Compliance { stiffness, damping };
        compliance.validate("pairs_default", e)?;
        let count = self.world.materials().len();
        for (a, b) in (0..count).flat_map(|b| (0..=b).map(move |a| (a, b))) {
            if !self.stated.contains(&(a, b)) {
                self.world.comply(a, b, compliance);
            }
        }
        Ok(())
    }

    fn all_stated(&self) -> Result<(), SimulateError> {
        // Of each combination of materials and groups one body is enough; those that do not move freely differ from those that do.
        let mut kinds: BTreeMap<_, usize> = BTreeMap::new();
        for (k, body) in self.world.bodies.iter().enumerate() {
            for part in &body.parts {
                let like = (part.material, body.membership, body.collides_with, body.is_free());
                kinds.entry((like, 0)).or_insert(k);
                // Two of a kind may meet, too.
                if kinds[&(like, 0)] != k {
                    kinds.entry((like, 1)).or_insert(k);
                }
            }
        }
        for (k, elastic) in self.world.elastic.iter().enumerate() {
            let solid = elastic.material;
            for (i, body) in self.world.bodies.iter().enumerate() {
                for m in body.parts.iter().map(|part| part.material) {
                    if !self.stated.contains(&(m.min(solid), m.max(solid))) {
                        return Err(self.lawless((solid, self.world.bodies.len() + k), (m, i)));
                    }
                }
            }
        }
        let all: Vec<_> = kinds.iter().map(|(((material, ..), _), &k)| (*material, k)).collect();
        for (i, &(m, a)) in all.iter().enumerate() {
            for &(n, b) in &all[i + 1..] {
                let meet = a != b && self.world.may_touch(BodyId(a as u32), BodyId(b as u32));
                if meet && !self.stated.contains(&(m.min(n), m.max(n))) {
                    return Err(self.lawless((m, a), (n, b)));
                }
            }
        }
        Ok(())
    }

    /// Two of these materials may meet, and nothing is said of them.
    fn lawless(&self, (m, a): (usize, usize), (n, b): (usize, usize)) -> SimulateError {
        let name = |k: usize| self.world.materials()[k].clone();
        SimulateError::Lawless {
            a: name(m),
            b: name(n),
            first: self.world.label(a).to_string(),
            second: self.world.label(b).to_string(),
        }
    }
}

/// Whether nothing is said of a body that does not move freely which it would not do.
fn unmoved(table: &BodyTable, key: &str) -> Result<(), SimulateError> {
    let expected = match table.fixed {
        true => "none of a fixed body",
        false => "none of a body whose motion is given",
    };
    let said = [
        ("velocity", table.velocity),
        ("angular_velocity", table.angular_velocity),
        ("force", table.force),
        ("torque", table.torque),
    ];
    match said.into_iter().find(|(_, x)| *x != [0.0; 3]) {
        None => Ok(()),
        Some((name, x)) => {
            Err(SimulateError::value(format!("{key}.{name}"), expected, format!("{x:?}")))
        }
    }
}

pub(super) fn twice(key: &str, name: &str) -> SimulateError {
    SimulateError::value(key, "a name that is not taken", format!("`{name}` again"))
}

/// An error of a part of a body, at its place in the file.
fn placed(error: SimulateError, key: &str) -> SimulateError {
    SimulateError::Schema { path: key.into(), problem: error.to_string() }
}

fn rotation(table: Option<&RotationTable>, key: &str) -> Result<Rotation, SimulateError> {
    let Some(table) = table else { return Ok(Rotation::IDENTITY) };
    let wrong = |found: &str| {
        let expected = "axis with angle or angle_deg, or quaternion";
        Err(SimulateError::value(key, expected, found))
    };
    match *table {
        RotationTable { quaternion: Some(q), axis: None, angle: None, angle_deg: None } => {
            finite(|| format!("{key}.quaternion"), &q)?;
            Ok(Rotation(q))
        }
        RotationTable { quaternion: None, axis: Some(axis), angle, angle_deg } => {
            let angle = match (angle, angle_deg) {
                (Some(angle), None) => angle,
                (None, Some(degrees)) => degrees.to_radians(),
                (None, None) => return wrong("axis alone"),
                (Some(_), Some(_)) => return wrong("both angle and angle_deg"),
            };
            require(|| format!("{key}.angle"), angle, true, "a finite number")?;
            let length = norm(axis);
            if !(length > 0.0 && length.is_finite()) {
                let found = format!("{axis:?}");
                return Err(SimulateError::value(format!("{key}.axis"), "a direction", found));
            }
            Ok(Rotation::about(axis, angle))
        }
        RotationTable { quaternion: Some(_), .. } => wrong("quaternion and more"),
        RotationTable { axis: None, .. } => wrong("no axis"),
    }
}

fn inertia(values: Option<&[f64]>, key: &str) -> Result<Mat3, SimulateError> {
    match values {
        Some(&[a, b, c]) => Ok([[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]]),
        Some(&[a, b, c, ab, ac, bc]) => Ok([[a, ab, ac], [ab, b, bc], [ac, bc, c]]),
        Some(other) => {
            Err(SimulateError::value(key, "3 or 6 numbers", format!("{} numbers", other.len())))
        }
        None => Err(SimulateError::value(key, "3 or 6 numbers, since a mass is given", "none")),
    }
}
