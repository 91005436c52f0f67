//! MJCF, the format of MuJoCo: bodies with their geoms, joints and masses, defaults by class, files that are included.
//!
//! Bodies without joints are one with their parents. Friction is the larger of two geoms' or that of higher priority, as there; contacts are rigid, with Coulomb's law.
//! What is stated otherwise there and changes the motion (solref, armature, tendons, controls from outside) is said in warnings, element by element; what cannot be
//! left out without another body coming to be (composites, ellipsoids that touch, shells) is refused.
//!
//! Reference: MuJoCo's documentation, *XML reference*; masses, inertias and places are compared with the program itself (`crates/simulate/tests/compare_mujoco.py`).

mod compiler;
mod contacts;
mod document;
mod geoms;
mod joints;
mod model;
mod servo;

use std::collections::BTreeMap;
use std::path::Path;

use nonsmooth_scenes::MassProperties;
use nonsmooth_scenes::vec3::{norm, scale, sub};
use serde_json::{Value, json};

use self::compiler::Compiler;
use self::contacts::Contacts;
use self::document::{Defaults, Element, Item, MAIN};
use self::geoms::Assets;
use self::joints::Joints;
use self::model::{Tree, quaternion};
use super::{Frame, Imported, entries, text as text_of};
use crate::SimulateError;

/// The model of an MJCF document in `folder`, which files that it includes and meshes are looked for in. It stands as its first keyframe says, else with its joints at
/// their reference. Meshes stay files, beside the scene, unless they are scaled unevenly.
///
/// Errors: what is no MJCF, and what is not in the subset and cannot be left out, by the element with its line; files that cannot be read; a body that moves and has no mass.
pub fn mjcf(text: &str, folder: &Path) -> Result<Imported, SimulateError> {
    let root = document::read(text, folder)?;
    let defaults = Defaults::read(&root)?;
    let mut said = vec![
        "contacts are rigid, with Coulomb's law and e = 0: solref, solimp, impratio and torsional friction are not of our law and left out".to_owned(),
    ];
    known(&root, &mut said)?;
    document::names_differ(&root)?;
    let compiler = Compiler::read(&root, &defaults, folder.into(), &mut said)?;
    let assets = Assets::read(&root, &defaults, &compiler)?;
    let mut tree = Tree::read(&root, &defaults, &compiler, &assets, said)?;
    let controls = keyframe(&root, &defaults, &mut tree)?;
    let contacts = Contacts::read(&root, &defaults, &compiler, &mut tree)?;
    let mut bodies = vec![];
    for k in 0..tree.bodies.len() {
        if lifts_unevenly(&tree, k)? {
            let key = tree.bodies[k].item.key();
            tree.said.push(format!(
                "{key}: `gravcomp` of a part of what moves as one body lifts its mass centre; the moment is left out"
            ));
        }
        if let Some(mut body) = body(&tree, &compiler, &contacts, k)? {
            contacts.of(k, &mut body);
            bodies.push(body);
        }
    }
    let mut scene = json!({
        "format": crate::scene_file::FORMAT,
        "version": crate::scene_file::VERSION,
        "name": root.attributes.get("model").map_or("MuJoCo Model", String::as_str),
        "gravity": compiler.gravity,
        "time": {"h": compiler.h, "end": 1.0},
        "bodies": bodies,
    });
    contacts.laws(&mut scene);
    let Joints { joints, couplings } =
        joints::read(&root, &defaults, &compiler, &mut tree, &controls)?;
    if !joints.is_empty() {
        scene["joints"] = json!(joints);
    }
    if !couplings.is_empty() {
        scene["couplings"] = json!(couplings);
    }
    remarks(&mut tree, &scene);
    Ok(Imported { scene: text_of(&scene)?, warnings: tree.said })
}

/// Says which parts of the document are left out, and refuses what there is none of.
fn known(root: &Element, said: &mut Vec<String>) -> Result<(), SimulateError> {
    for part in &root.children {
        match part.tag.as_str() {
            "compiler" | "option" | "default" | "asset" | "worldbody" | "contact" | "equality"
            | "actuator" | "keyframe" => {}
            // What measures, shows or names.
            "size" | "visual" | "statistic" | "custom" | "sensor" => {}
            "tendon" | "deformable" | "extension" => {
                said.extend(part.children.iter().map(|e| format!("{}: left out", e.key())));
            }
            tag => return Err(part.wrong("a part of a model", format!("<{tag}>"))),
        }
    }
    Ok(())
}

/// Puts the model where its first keyframe with coordinates says; its controls.
fn keyframe(
    root: &Element,
    defaults: &Defaults,
    tree: &mut Tree,
) -> Result<Vec<f64>, SimulateError> {
    const COORDINATES: [&str; 3] = ["qpos", "mpos", "mquat"];
    let mut keys = root.named("keyframe").flat_map(|k| k.named("key"));
    let placed = |key: &&Element| COORDINATES.iter().any(|c| key.attributes.contains_key(*c));
    let Some(key) = keys.find(placed) else {
        tree.stand(None, &BTreeMap::new())?;
        return Ok(vec![]);
    };
    let item = defaults.item(key, MAIN)?;
    let led = led(&item, tree)?;
    let q = item.numbers("qpos")?;
    let expected = tree.coordinates();
    if let Some(q) = q.as_ref().filter(|q| q.len() != expected) {
        return Err(item.wrong(format!("{expected} numbers as `qpos`"), q.len()));
    }
    tree.stand(q.as_deref(), &led)?;
    tree.said.push(format!("{}: the motion begins here", item.key()));
    if item.numbers("qvel")?.is_some_and(|v| v.iter().any(|x| *x != 0.0)) {
        tree.said.push(format!("{}: `qvel` is left out: all is at rest at first", item.key()));
    }
    Ok(item.numbers("ctrl")?.unwrap_or_default())
}

/// Where a keyframe puts the bodies that are led from outside (`mocap`).
fn led(key: &Item, tree: &Tree) -> Result<BTreeMap<usize, Frame>, SimulateError> {
    let mut bodies = vec![];
    for (k, body) in tree.bodies.iter().enumerate().skip(1) {
        if body.item.flag("mocap", false)? {
            bodies.push(k);
        }
    }
    let mut out: BTreeMap<usize, Frame> =
        bodies.iter().map(|&k| (k, tree.bodies[k].place)).collect();
    for (name, size) in [("mpos", 3), ("mquat", 4)] {
        let Some(found) = key.numbers(name)? else { continue };
        let expected = size * bodies.len();
        if found.len() != expected {
            return Err(key.wrong(format!("{expected} numbers as `{name}`"), found.len()));
        }
        for (frame, own) in out.values_mut().zip(found.chunks(size)) {
            match *own {
                [w, x, y, z] => frame.q = quaternion(key, [w, x, y, z])?,
                [x, y, z] => frame.x = [x, y, z],
                _ => unreachable!("chunks of 3 or 4"),
            }
        }
    }
    Ok(out)
}

/// Whether parts with a mass of what moves with body k have several `gravcomp`.
fn lifts_unevenly(tree: &Tree, k: usize) -> Result<bool, SimulateError> {
    if k == 0 || tree.carrier(k) != k {
        return Ok(false);
    }
    let mut lifts = vec![];
    for (i, body) in tree.bodies.iter().enumerate().filter(|(i, _)| tree.carrier(*i) == k) {
        if tree.bodies[i].masses.iter().any(|m| m.mass > 0.0) {
            lifts.push(body.item.real("gravcomp", 0.0)?);
        }
    }
    Ok(lifts.iter().any(|lift| *lift != lifts[0]))
}

/// A body of the scene: one that moves with all that does not move against it, or one that stands and is touched.
fn body(
    tree: &Tree,
    compiler: &Compiler,
    contacts: &Contacts,
    k: usize,
) -> Result<Option<Value>, SimulateError> {
    let (own, carrier) = (&tree.bodies[k], tree.carrier(k));
    if carrier != 0 && carrier != k {
        return Ok(None);
    }
    let frame = own.at;
    let mut table = json!({"name": own.name});
    let members: Vec<usize> = match carrier {
        0 => vec![k],
        _ => (0..tree.bodies.len()).filter(|&i| tree.carrier(i) == k).collect(),
    };
    let mut centre = [0.0; 3];
    if carrier == 0 {
        if own.geoms.iter().all(|g| g.shape.is_none()) {
            return Ok(None);
        }
        table["fixed"] = json!(true);
    } else {
        let mut masses: Vec<MassProperties> = vec![];
        let mut force = [0.0; 3];
        for &i in &members {
            let inner = frame.back().then(&tree.bodies[i].at);
            masses.extend(tree.bodies[i].masses.iter().map(|m| inner.mass(m)));
            let lift = tree.bodies[i].item.real("gravcomp", 0.0)?;
            let mass: f64 = tree.bodies[i].masses.iter().map(|m| m.mass).sum();
            force = sub(force, scale(lift * mass, compiler.gravity));
        }
        let joined = MassProperties::joined(&masses);
        if masses.is_empty() || joined.mass.is_nan() || joined.mass <= 0.0 {
            return Err(own.item.wrong("a mass, for its joints move it", "none"));
        }
        table["mass"] = json!(joined.mass);
        table["inertia"] = json!(entries(&joined.inertia));
        if norm(force) > 0.0 {
            table["force"] = json!(force);
        }
        centre = joined.centre;
    }
    table["position"] = json!(frame.point(centre));
    table["rotation"] = json!({"quaternion": frame.q.0});
    let mut shapes = vec![];
    for &i in &members {
        let inner = frame.back().then(&tree.bodies[i].at);
        for geom in &tree.bodies[i].geoms {
            let Some(shape) = &geom.shape else { continue };
            let Frame { x, q } = inner.then(&geom.place);
            let mut part = json!({
                "shape": shape, "position": sub(x, centre), "rotation": {"quaternion": q.0},
            });
            if carrier != 0 && shape["kind"] == "plane" {
                return Err(geom.item.wrong("a solid of a body that moves", "a plane"));
            }
            contacts.material(geom, &mut part);
            shapes.push(part);
        }
    }
    if !shapes.is_empty() {
        table["shapes"] = json!(shapes);
    }
    Ok(Some(table))
}

/// What concerns all of the scene.
fn remarks(tree: &mut Tree, scene: &Value) {
    let bodies = scene["bodies"].as_array().map_or(&[][..], |b| &b[..]);
    let bare: Vec<_> = bodies.iter().filter(|b| b.get("shapes").is_none()).collect();
    if !bare.is_empty() {
        let names: Vec<_> = bare.iter().filter_map(|b| b["name"].as_str()).collect();
        tree.said.push(format!("without geoms that touch: {}", names.join(", ")));
    }
    let parts = bodies.iter().flat_map(|b| b["shapes"].as_array().into_iter().flatten());
    if parts.into_iter().any(|part| part["shape"]["kind"] == "mesh") {
        tree.said.push(
            "meshes touch with their surfaces, where MuJoCo takes their convex hulls; one that is not closed is refused beside another".into(),
        );
    }
}
