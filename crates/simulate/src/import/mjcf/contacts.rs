//! Who touches whom, and with which friction.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::compiler::Compiler;
use super::document::{Defaults, Element, MAIN};
use super::geoms::{Geom, Touch};
use super::joints::is_free;
use super::model::Tree;
use crate::SimulateError;

/// A scene has so many groups of bodies; one is that of nobody.
const CLASSES: usize = 31;

/// The kinds of bodies that touch the same others, and the materials.
pub(super) struct Contacts {
    /// The class of each body that has geoms, by the body of the scene.
    classes: Vec<Option<usize>>,
    /// Which classes touch each other.
    meet: Vec<Vec<bool>>,
    materials: Vec<Touch>,
}

/// What bodies of one class have in common: the bits of their geoms, and their number where pairs of bodies are excluded.
type Class = (BTreeSet<[u32; 2]>, Option<usize>);

impl Contacts {
    /// Says in the tree what is left out; refuses what would make other bodies touch.
    pub fn read(
        root: &Element,
        defaults: &Defaults,
        compiler: &Compiler,
        tree: &mut Tree,
    ) -> Result<Self, SimulateError> {
        let mut said = vec![];
        let this = Self::of_tree(root, defaults, compiler, tree, &mut said)?;
        tree.said.extend(said);
        Ok(this)
    }

    fn of_tree(
        root: &Element,
        defaults: &Defaults,
        compiler: &Compiler,
        tree: &Tree,
        said: &mut Vec<String>,
    ) -> Result<Self, SimulateError> {
        let numbers = tree.numbers();
        // The body of the scene that a body is part of.
        let part_of = |k: usize| match tree.carrier(k) {
            0 => k,
            carrier => carrier,
        };
        let touching = |k: usize| tree.bodies[k].geoms.iter().filter(|g| g.shape.is_some());
        // Groups are of bodies as a whole.
        let alone = |k: usize| {
            let others = (0..tree.bodies.len()).filter(|&i| i != k && part_of(i) == part_of(k));
            others.map(touching).all(|mut geoms| geoms.next().is_none())
        };
        let mut apart: BTreeSet<[usize; 2]> = BTreeSet::new();
        for element in root.named("contact").flat_map(|c| c.named("exclude")) {
            let item = defaults.item(element, MAIN)?;
            let mut of = |name: &str| {
                let body = item.text(name).unwrap_or_default();
                let found = numbers.get(body).copied();
                let k = found.ok_or_else(|| {
                    item.wrong(format!("a body as `{name}`"), format!("`{body}`"))
                })?;
                if !alone(k) {
                    said.push(format!(
                        "{}: of `{body}` all that moves with it is excluded, too",
                        item.key()
                    ));
                }
                Ok::<_, SimulateError>(part_of(k))
            };
            let (a, b) = (of("body1")?, of("body2")?);
            apart.insert([a.min(b), a.max(b)]);
        }
        // Elsewhere the joint to the parent keeps the two from touching; a body with all six coordinates has none in the scene.
        for (k, body) in tree.bodies.iter().enumerate().filter(|_| compiler.filter) {
            let parent = tree.carrier(body.parent);
            if parent != 0 && is_free(&body.joints) {
                apart.insert([k.min(parent), k.max(parent)]);
            }
        }
        for element in root.named("contact").flat_map(|c| c.named("pair")) {
            let item = defaults.item(element, MAIN)?;
            let of = |name: &str| {
                let geom = item.text(name).unwrap_or_default();
                let named = |g: &&Geom| g.item.text("name") == Some(geom);
                let found = (0..tree.bodies.len())
                    .find_map(|k| Some((part_of(k), touching(k).find(named)?.touch.bits)));
                // A geom without bits touches nothing else, and is no shape of the scene.
                found.ok_or_else(|| {
                    let expected = format!("a geom that touches by its bits as `{name}`");
                    item.wrong(expected, format!("`{geom}`"))
                })
            };
            let ((a, p), (b, q)) = (of("geom1")?, of("geom2")?);
            let meet = p[0] & q[1] | q[0] & p[1] != 0 && !apart.contains(&[a.min(b), a.max(b)]);
            if !meet || a == b {
                return Err(item.wrong("geoms that touch without it", "two that do not"));
            }
            said.push(format!("{}: left out: the two touch as their materials say", item.key()));
        }
        let mut bits: Vec<BTreeSet<[u32; 2]>> = vec![BTreeSet::new(); tree.bodies.len()];
        let mut materials: Vec<Touch> = vec![];
        for k in 0..tree.bodies.len() {
            for geom in touching(k) {
                let all = &mut bits[part_of(k)];
                if all.insert(geom.touch.bits) && all.len() == 2 {
                    said.push(format!(
                        "{}: other bits than those of other geoms of the body, which touches as a whole whatever one of them touches",
                        geom.item.key()
                    ));
                }
                if !materials.iter().any(|m| alike(m, &geom.touch)) {
                    materials.push(geom.touch);
                }
            }
        }
        let excluded: BTreeSet<usize> = apart.iter().flatten().copied().collect();
        let mut kinds: Vec<Class> = vec![];
        let mut classes = vec![None; tree.bodies.len()];
        for (k, bits) in bits.into_iter().enumerate().filter(|(_, bits)| !bits.is_empty()) {
            let own = (bits, excluded.contains(&k).then_some(k));
            let place = kinds.iter().position(|kind| *kind == own).unwrap_or_else(|| {
                kinds.push(own);
                kinds.len() - 1
            });
            classes[k] = Some(place);
        }
        let meet: Vec<Vec<bool>> = kinds
            .iter()
            .map(|(p, a)| {
                let with = |(q, b): &Class| {
                    let out = a.zip(*b).is_some_and(|(a, b)| apart.contains(&[a.min(b), a.max(b)]));
                    let bits = |p: &[u32; 2]| q.iter().any(|q| p[0] & q[1] | q[0] & p[1] != 0);
                    !out && p.iter().any(bits)
                };
                kinds.iter().map(with).collect()
            })
            .collect();
        let all = meet.iter().flatten().all(|m| *m);
        if !all && kinds.len() > CLASSES {
            let expected = format!("at most {CLASSES} kinds of bodies that touch different others");
            return Err(SimulateError::value("contact", expected, kinds.len()));
        }
        Ok(Self { classes, meet: if all { vec![] } else { meet }, materials })
    }

    /// Gives a body of the scene its groups.
    pub fn of(&self, body: usize, table: &mut Value) {
        let Some(class) = self.classes[body].filter(|_| !self.meet.is_empty()) else { return };
        let name = |k: usize| format!("class {k}");
        let row = self.meet[class].iter().enumerate();
        let mut met: Vec<String> = row.filter(|(_, meet)| **meet).map(|(k, _)| name(k)).collect();
        if met.is_empty() {
            met.push("nothing".into());
        }
        table["groups"] = json!([name(class)]);
        table["collides_with"] = json!(met);
    }

    /// Gives a part of a body its material.
    pub fn material(&self, geom: &Geom, part: &mut Value) {
        if self.materials.len() > 1
            && let Some(k) = self.materials.iter().position(|m| alike(m, &geom.touch))
        {
            part["material"] = json!(self.name(k));
        }
    }

    fn name(&self, k: usize) -> String {
        let Touch { friction, rough, rolling, rolls, priority, .. } = self.materials[k];
        let mut name = match rough {
            true => format!("friction {friction}"),
            false => format!("friction {friction} of condim 1"),
        };
        if rolls {
            name += &format!(", rolling {rolling}");
        }
        if priority != 0 {
            name += &format!(", priority {priority}");
        }
        name
    }

    /// The laws of contact of all pairs of materials.
    pub fn laws(&self, scene: &mut Value) {
        if let [] | [_] = self.materials[..] {
            let law = self.materials.first().map_or(json!({"mu": 0.0}), |m| law(m, m));
            scene["pairs_default"] = law;
            return;
        }
        let mut pairs = vec![];
        for (k, a) in self.materials.iter().enumerate() {
            scene["materials"][self.name(k)] = json!({});
            for (l, b) in self.materials.iter().enumerate().skip(k) {
                let mut pair = law(a, b);
                pair["between"] = json!([self.name(k), self.name(l)]);
                pairs.push(pair);
            }
        }
        scene["pairs"] = json!(pairs);
    }
}

/// Whether two geoms have the same law with all others. Of rolling friction only those that have any.
fn alike(a: &Touch, b: &Touch) -> bool {
    let rolling = |t: &Touch| t.rolls.then_some(t.rolling);
    (a.friction, a.rough, a.priority, rolling(a)) == (b.friction, b.rough, b.priority, rolling(b))
}

/// The law of two: of higher priority, else with the larger coefficients; without friction where both have normal forces only, with rolling friction where one has
/// `condim` 6.
fn law(a: &Touch, b: &Touch) -> Value {
    let one = |t: &Touch| (t.friction, t.rough, t.rolling, t.rolls);
    let (friction, rough, rolling, rolls) = match a.priority.cmp(&b.priority) {
        std::cmp::Ordering::Greater => one(a),
        std::cmp::Ordering::Less => one(b),
        std::cmp::Ordering::Equal => {
            let rolling = a.rolling.max(b.rolling);
            (a.friction.max(b.friction), a.rough || b.rough, rolling, a.rolls || b.rolls)
        }
    };
    let mut law = json!({"mu": if rough { friction } else { 0.0 }});
    if rolls && rolling > 0.0 {
        law["mu_rolling"] = json!(rolling);
    }
    law
}
