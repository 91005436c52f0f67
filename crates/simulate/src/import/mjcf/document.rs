//! Elements with their places, files that are included put in, and classes of defaults.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use roxmltree::{Document, Node};

use super::servo::{ACTUATORS, Servo};
use crate::SimulateError;

/// Elements may stand in each other so deep.
const DEPTH: usize = 200;

/// An element of a model.
#[derive(Debug)]
pub(super) struct Element {
    pub tag: String,
    pub attributes: BTreeMap<String, String>,
    pub children: Vec<Self>,
    /// The line, with the file where that is an included one.
    pub place: String,
}

impl Element {
    pub fn named<'a>(&'a self, tag: &'a str) -> impl Iterator<Item = &'a Self> {
        self.children.iter().filter(move |e| e.tag == tag)
    }

    /// What messages call it.
    pub fn key(&self) -> String {
        match self.attributes.get("name") {
            Some(name) => format!("<{}> `{name}` ({})", self.tag, self.place),
            None => format!("<{}> ({})", self.tag, self.place),
        }
    }

    pub fn wrong(&self, expected: impl Into<String>, found: impl ToString) -> SimulateError {
        SimulateError::value(self.key(), expected, found)
    }

    /// Notes it under its name among the elements of a space of names.
    ///
    /// Errors: another one of that name.
    pub fn is_first<'a, 's>(
        &'a self,
        space: &'s str,
        name: Option<String>,
        known: &mut BTreeMap<(&'s str, String), &'a Self>,
    ) -> Result<(), SimulateError> {
        let Some(name) = name.filter(|name| !name.is_empty()) else { return Ok(()) };
        match known.insert((space, name), self) {
            Some(first) => Err(self.wrong("a name of its own", format!("that of {}", first.key()))),
            None => Ok(()),
        }
    }
}

/// The elements of a model in `folder`, with those of the files that it includes in their places.
pub(super) fn read(text: &str, folder: &Path) -> Result<Element, SimulateError> {
    let mut root = document(text, None)?;
    if root.tag != "mujoco" {
        return Err(SimulateError::value("mujoco", "an MJCF document", format!("<{}>", root.tag)));
    }
    include(&mut root, folder, &mut BTreeSet::new())?;
    Ok(root)
}

fn document(text: &str, file: Option<&str>) -> Result<Element, SimulateError> {
    let document = Document::parse(text).map_err(|e| {
        let found = e.to_string().replace('\n', " ");
        SimulateError::value(file.unwrap_or("mujoco"), "an XML document", found)
    })?;
    // Lines are found by bisection: counting them for each element would take quadratic time.
    let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
    element(document.root_element(), &ends, file, 0)
}

fn element(
    node: Node,
    ends: &[usize],
    file: Option<&str>,
    depth: usize,
) -> Result<Element, SimulateError> {
    let line = 1 + ends.partition_point(|&end| end < node.range().start);
    let place = match file {
        Some(file) => format!("{file} line {line}"),
        None => format!("line {line}"),
    };
    if depth > DEPTH {
        let found = "one deeper";
        return Err(SimulateError::value(place, format!("elements {DEPTH} deep at most"), found));
    }
    let children = node.children().filter(Node::is_element);
    Ok(Element {
        tag: node.tag_name().name().into(),
        attributes: node.attributes().map(|a| (a.name().into(), a.value().into())).collect(),
        children: children
            .map(|child| element(child, ends, file, depth + 1))
            .collect::<Result<_, _>>()?,
        place,
    })
}

/// Puts the elements of included files where the model includes them; each file may be included once.
fn include(
    element: &mut Element,
    folder: &Path,
    known: &mut BTreeSet<PathBuf>,
) -> Result<(), SimulateError> {
    let mut children = vec![];
    for mut child in std::mem::take(&mut element.children) {
        if child.tag != "include" {
            include(&mut child, folder, known)?;
            children.push(child);
            continue;
        }
        let Some(name) = child.attributes.get("file") else {
            return Err(child.wrong("`file`", "none"));
        };
        let path = folder.join(name);
        if !known.insert(path.clone()) {
            return Err(child.wrong("a file that is included once", format!("`{name}` again")));
        }
        let text = std::fs::read_to_string(path)
            .map_err(|e| child.wrong("a readable file", format!("`{name}`: {e}")))?;
        let mut inner = document(&text, Some(name))?;
        include(&mut inner, folder, known)?;
        children.append(&mut inner.children);
    }
    element.children = children;
    Ok(())
}

/// Bodies, geoms and joints are looked up by their names, each of its own tag.
///
/// Errors: two of the same name.
pub(super) fn names_differ(root: &Element) -> Result<(), SimulateError> {
    let mut known = BTreeMap::new();
    let mut open: Vec<&Element> = root.named("worldbody").collect();
    while let Some(element) = open.pop() {
        // From the last to the first: they are met in the order of the document.
        open.extend(element.children.iter().rev());
        let space = match element.tag.as_str() {
            "body" | "geom" | "joint" => &element.tag[..],
            "freejoint" => "joint",
            _ => continue,
        };
        element.is_first(space, element.attributes.get("name").cloned(), &mut known)?;
    }
    Ok(())
}

type Attributes = BTreeMap<String, String>;

/// The attributes that elements have where they say none, by class and tag.
pub(super) struct Defaults {
    classes: BTreeMap<String, Class>,
}

/// What a class says, and those that it is in.
#[derive(Clone)]
struct Class {
    parent: Option<String>,
    tags: BTreeMap<String, Attributes>,
    servo: Servo,
}

/// Lists that may end early: what is said further out holds beyond their end.
const LISTS: [&str; 9] = [
    "friction",
    "o_friction",
    "size",
    "polycoef",
    "gear",
    "gainprm",
    "biasprm",
    "stiffness",
    "damping",
];

/// A list with the numbers of another one beyond its end.
fn laid(over: &str, under: &str) -> String {
    let count = over.split_whitespace().count();
    let words = over.split_whitespace().chain(under.split_whitespace().skip(count));
    words.collect::<Vec<_>>().join(" ")
}

/// What elements with a tag have their defaults in common with.
fn family(tag: &str) -> &str {
    match tag {
        "connect" | "weld" => "equality",
        _ if ACTUATORS.contains(&tag) => "actuator",
        _ => tag,
    }
}

/// The class of elements that name none.
pub(super) const MAIN: &str = "main";

impl Defaults {
    pub fn read(root: &Element) -> Result<Self, SimulateError> {
        let main = Class { parent: None, tags: BTreeMap::new(), servo: Servo::NONE };
        let mut out = Self { classes: BTreeMap::from([(MAIN.to_owned(), main)]) };
        for top in root.named("default") {
            // The outermost one is of the main class, whatever it is called.
            out.class(top, MAIN, None)?;
            if let Some(name) = top.attributes.get("class") {
                let own = out.classes[MAIN].clone();
                out.classes.insert(name.clone(), own);
            }
        }
        Ok(out)
    }

    fn class(
        &mut self,
        element: &Element,
        name: &str,
        parent: Option<&str>,
    ) -> Result<(), SimulateError> {
        let mut own = self.classes[parent.unwrap_or(name)].clone();
        own.parent = parent.map(str::to_owned);
        for child in element.children.iter().filter(|e| e.tag != "default") {
            if family(&child.tag) == "actuator" {
                let alone = Item { element: child, defaults: None };
                own.servo = self.begun(&own, &child.tag).with(&alone)?;
            }
            let all = own.tags.entry(family(&child.tag).to_owned()).or_default();
            for (name, text) in &child.attributes {
                let under = all.get(name).filter(|_| LISTS.contains(&name.as_str()));
                let text = under.map_or_else(|| text.clone(), |under| laid(text, under));
                all.insert(name.clone(), text);
            }
        }
        self.classes.insert(name.into(), own);
        for child in element.named("default") {
            let Some(class) = child.attributes.get("class") else {
                return Err(child.wrong("`class`", "none"));
            };
            if self.classes.contains_key(class) {
                return Err(child.wrong("a class that is not there yet", format!("`{class}`")));
            }
            self.class(child, class, Some(name))?;
        }
        Ok(())
    }

    /// What an actuator of a class begins with: the class may have said something of another one last, then so much as the nearest class around it says.
    fn begun<'a>(&'a self, mut class: &'a Class, actuator: &str) -> Servo {
        while !class.servo.serves(actuator) {
            let Some(parent) = &class.parent else { return Servo::NONE };
            class = &self.classes[parent];
        }
        class.servo.clone()
    }

    fn of(&self, element: &Element, force: &str) -> Result<&Class, SimulateError> {
        let class = element.attributes.get("class").map_or(force, String::as_str);
        let found = self.classes.get(class);
        found.ok_or_else(|| element.wrong("a class of <default>", format!("`{class}`")))
    }

    /// An element with the defaults of its class, or else of the class that is in force where it stands.
    pub fn item<'a>(
        &'a self,
        element: &'a Element,
        force: &str,
    ) -> Result<Item<'a>, SimulateError> {
        let class = self.of(element, force)?;
        Ok(Item { element, defaults: class.tags.get(family(&element.tag)) })
    }

    /// The same of an equality, whose tag `joint` would be that of a joint of a body.
    pub fn equality<'a>(&'a self, element: &'a Element) -> Result<Item<'a>, SimulateError> {
        let class = self.of(element, MAIN)?;
        Ok(Item { element, defaults: class.tags.get("equality") })
    }

    /// Gain and bias of an actuator.
    pub fn servo(&self, element: &Element) -> Result<Servo, SimulateError> {
        let class = self.of(element, MAIN)?;
        self.begun(class, &element.tag).with(&Item { element, defaults: None })
    }
}

/// An element with its defaults.
#[derive(Clone, Copy)]
pub(super) struct Item<'a> {
    pub element: &'a Element,
    defaults: Option<&'a Attributes>,
}

impl<'a> Item<'a> {
    /// What the element says, and what its class does.
    fn said(&self, name: &str) -> [Option<&'a String>; 2] {
        [self.element.attributes.get(name), self.defaults.and_then(|all| all.get(name))]
    }

    pub fn text(&self, name: &str) -> Option<&'a str> {
        let [own, class] = self.said(name);
        own.or(class).map(String::as_str)
    }

    /// The names of all its attributes, of the defaults too.
    pub fn names(&self) -> BTreeSet<&'a str> {
        let all = std::iter::once(&self.element.attributes);
        let all = all.chain(self.defaults);
        all.flat_map(|a| a.keys().map(String::as_str)).collect()
    }

    pub fn key(&self) -> String {
        self.element.key()
    }

    pub fn wrong(&self, expected: impl Into<String>, found: impl ToString) -> SimulateError {
        self.element.wrong(expected, found)
    }

    /// The numbers of an attribute, each finite, if it is there.
    pub fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, SimulateError> {
        self.text(name).map(|text| self.read(name, text)).transpose()
    }

    fn read(&self, name: &str, text: &str) -> Result<Vec<f64>, SimulateError> {
        let words = text.split_whitespace();
        let read = words.map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()));
        read.collect::<Option<Vec<f64>>>()
            .ok_or_else(|| self.wrong(format!("finite numbers as `{name}`"), format!("`{text}`")))
    }

    /// One of [`LISTS`]: the numbers of the element, beyond them those of its class, beyond these the ones that are built in.
    pub fn list<const N: usize>(
        &self,
        name: &str,
        mut all: [f64; N],
    ) -> Result<[f64; N], SimulateError> {
        debug_assert!(LISTS.contains(&name), "classes lay it over each other");
        let found = match self.said(name) {
            [Some(own), Some(class)] => self.read(name, &laid(own, class))?,
            [own, class] => own.or(class).map_or(Ok(vec![]), |text| self.read(name, text))?,
        };
        let Some(first) = all.get_mut(..found.len()) else {
            return Err(self.wrong(format!("at most {N} numbers as `{name}`"), found.len()));
        };
        first.copy_from_slice(&found);
        Ok(all)
    }

    /// Exactly so many of them.
    pub fn some<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, SimulateError> {
        let Some(found) = self.numbers(name)? else { return Ok(None) };
        let count = found.len();
        found
            .try_into()
            .map(Some)
            .map_err(|_| self.wrong(format!("{N} numbers as `{name}`"), count))
    }

    /// The first of them: of lists whose end may be left out.
    pub fn first(&self, name: &str) -> Result<Option<f64>, SimulateError> {
        Ok(self.numbers(name)?.and_then(|x| x.first().copied()))
    }

    /// A number, or what stands for it where none is given.
    pub fn real(&self, name: &str, other: f64) -> Result<f64, SimulateError> {
        Ok(self.some::<1>(name)?.map_or(other, |[x]| x))
    }

    /// Whether it is there and says anything but zeros.
    pub fn acts(&self, name: &str) -> bool {
        let zero = |text: &str| text.split_whitespace().all(|x| x.parse() == Ok(0.0));
        self.text(name).is_some_and(|text| !zero(text))
    }

    /// The range that is in force: where `limited` leaves it open and the compiler decides (`auto`), one whose first number is below the second.
    ///
    /// Errors: a range in force that is none; one that neither decides about.
    pub fn range(
        &self,
        name: &str,
        limited: &str,
        auto: bool,
    ) -> Result<Option<[f64; 2]>, SimulateError> {
        let range = self.some::<2>(name)?;
        let rising = range.filter(|[lower, upper]| lower < upper);
        match [self.flag(limited, false)?, self.flag(limited, true)?] {
            [false, false] => Ok(None),
            [true, _] if rising.is_none() => {
                let found = self.text(name).map_or("none".into(), |text| format!("`{text}`"));
                Err(self.wrong(format!("a number and a larger one as `{name}`"), found))
            }
            [false, true] if !auto && self.acts(name) => {
                let expected = format!("`{limited}` beside `{name}`, without autolimits");
                Err(self.wrong(expected, "none"))
            }
            _ => Ok(rising),
        }
    }

    /// A whole number of 32 bits.
    pub fn whole(&self, name: &str, other: i64) -> Result<i64, SimulateError> {
        let Some(text) = self.text(name) else { return Ok(other) };
        let number = text.trim().parse().ok().filter(|x: &i64| x.unsigned_abs() <= 1 << 32);
        number.ok_or_else(|| self.wrong(format!("a whole number as `{name}`"), format!("`{text}`")))
    }

    /// `true`, `false`, or what stands for `auto` and nothing.
    pub fn flag(&self, name: &str, other: bool) -> Result<bool, SimulateError> {
        match self.text(name) {
            Some("true" | "enable") => Ok(true),
            Some("false" | "disable") => Ok(false),
            Some("auto") | None => Ok(other),
            Some(text) => {
                Err(self.wrong(format!("true, false or auto as `{name}`"), format!("`{text}`")))
            }
        }
    }
}
