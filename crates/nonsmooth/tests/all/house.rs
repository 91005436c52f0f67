//! The rules of the house that the compiler does not know: who may import whom, that citations resolve, and
//! that no file tells on the machine it was written on.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use nonsmooth::{FrictionLocal, Hlcp, Lcp, Vi};
use nonsmooth_problem::each_kind;
use nonsmooth_solve::registry;

// ------------------------------------------------------------------------------------------------ floors

/// The crates by the name that sources use, each with those it may depend on: `cli, python → {bench, record} → {simulate, scenes, io} → solve → analysis →
/// problem → linalg`, but `simulate → scenes` and `io → problem` only. `nonsmooth` is the facade.
const CRATES: &[(&str, &[&str])] = &[
    ("nonsmooth_linalg", &[]),
    ("nonsmooth_problem", &["nonsmooth_linalg"]),
    ("nonsmooth_analysis", &["nonsmooth_linalg", "nonsmooth_problem"]),
    ("nonsmooth_solve", &["nonsmooth_linalg", "nonsmooth_problem", "nonsmooth_analysis"]),
    ("nonsmooth_io", &["nonsmooth_linalg", "nonsmooth_problem"]),
    ("nonsmooth_scenes", &["nonsmooth_linalg", "nonsmooth_problem", "nonsmooth_solve"]),
    (
        "nonsmooth_simulate",
        &["nonsmooth_linalg", "nonsmooth_problem", "nonsmooth_solve", "nonsmooth_scenes"],
    ),
    ("nonsmooth_record", &LIBRARIES),
    ("nonsmooth_bench", &LIBRARIES),
    ("nonsmooth_cli", &UP_TO_BENCH),
    ("nonsmooth_python", &UP_TO_BENCH),
    ("nonsmooth", &LIBRARIES),
];
const LIBRARIES: [&str; 7] = [
    "nonsmooth_linalg",
    "nonsmooth_problem",
    "nonsmooth_analysis",
    "nonsmooth_solve",
    "nonsmooth_io",
    "nonsmooth_scenes",
    "nonsmooth_simulate",
];
const UP_TO_BENCH: [&str; 9] = [
    "nonsmooth_linalg",
    "nonsmooth_problem",
    "nonsmooth_analysis",
    "nonsmooth_solve",
    "nonsmooth_io",
    "nonsmooth_scenes",
    "nonsmooth_simulate",
    "nonsmooth_record",
    "nonsmooth_bench",
];

/// The rooms of a crate on their floors, from the bottom up: a room may import from itself and from those below.
///
/// A room is a module, `check`, or one inside a wing, `contact/form`. `wing/*` stands for the rooms of a wing that are not named, `*` for all others.
struct Floors {
    floors: &'static [&'static [&'static str]],
    /// Rooms that have parts in the folders of others: every module below one of their name belongs to them.
    scattered: &'static [&'static str],
    /// Whether the rooms that are not named may import each other.
    others_mix: bool,
    /// Wings never import each other; only rooms outside them see both.
    wings: &'static [&'static str],
}

/// A kind names the judge of its own as an associated type, so `check` and the kinds share a floor; what they must not do is lean on planted instances,
/// which stand beside each kind.
const PROBLEM: Floors = Floors {
    floors: &[&["error"], &["check", "*"], &["planted"]],
    scattered: &["planted"],
    others_mix: true,
    wings: &["kinds/contact", "kinds/complementarity"],
};

/// `diagnose → existence → door → registry → bridges → {contact, complementarity, variational} → core`; inside a wing `solvers → families → what they share → form → law`.
/// The question of existence and the elimination of velocities are no families: any may ask them.
const SOLVE: Floors = Floors {
    floors: &[
        &["core"],
        &["contact/law", "complementarity/functions"],
        &["contact/form", "complementarity/form"],
        &[
            "contact/parts",
            "contact/condense",
            "contact/weigh",
            "contact/existence",
            "complementarity/parts",
            "complementarity/guarantees",
            "complementarity/reform",
            "variational/parts",
        ],
        &["contact/*", "complementarity/*", "variational/*"],
        &["variational/auto"],
        &["contact/solvers", "complementarity/solvers", "variational/solvers"],
        &["bridges"],
        &["registry"],
        &["door"],
        &["existence"],
        &["diagnose"],
    ],
    scattered: &[],
    others_mix: false,
    wings: &["contact", "complementarity", "variational"],
};

impl Floors {
    /// The room that a module is in, and its floor; none for the root of a crate or of a wing, which may import all that is in it.
    fn room(&self, module: &[String]) -> Option<(String, usize)> {
        let first = module.first()?;
        let floor = |name: &str| self.floors.iter().position(|floor| floor.contains(&name));
        if let Some(name) = self.scattered.iter().find(|name| module.iter().any(|m| m == *name)) {
            return Some(((*name).to_owned(), floor(name)?));
        }
        if let Some(second) = module.get(1) {
            let room = format!("{first}/{second}");
            if let Some(at) = floor(&room).or_else(|| floor(&format!("{first}/*"))) {
                return Some((room, at));
            }
        } else if self.wings.contains(&first.as_str()) {
            return None;
        }
        Some((first.clone(), floor(first).or_else(|| floor("*")).unwrap_or(self.floors.len())))
    }

    /// What is wrong if a module imports from another, if anything is.
    fn forbids(&self, from: &[String], to: &[String]) -> bool {
        let Some((from_room, a)) = self.room(from) else { return false };
        let Some((to_room, b)) = self.room(to) else {
            return true; // a wing as a whole
        };
        let begins = |module: &[String], wing: &str| {
            wing.split('/').enumerate().all(|(k, part)| module.get(k).is_some_and(|m| m == part))
        };
        let wing = |module: &[String]| self.wings.iter().find(|wing| begins(module, wing));
        let across = wing(from).is_some() && wing(to).is_some() && wing(from) != wing(to);
        let mix = self.others_mix && self.floors[a].contains(&"*");
        across || (from_room != to_room && !(b < a || (a == b && mix)))
    }
}

/// The floors of a crate's modules, for the crates that have any.
fn floors_of(krate: &str) -> Option<&'static Floors> {
    match krate {
        "nonsmooth_problem" => Some(&PROBLEM),
        "nonsmooth_solve" => Some(&SOLVE),
        _ => None,
    }
}

/// One source file of a crate, without its comments, its texts and its tests.
struct Source {
    /// `crate::a::b` as `[a, b]`; the root is empty.
    module: Vec<String>,
    tokens: Vec<String>,
}

impl Source {
    /// `place` is the file's path below `src`.
    fn new(place: &str, text: &str) -> Self {
        let mut module: Vec<_> =
            place.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
        if ["lib", "main", "mod"].contains(&module[module.len() - 1].as_str()) {
            module.pop();
        }
        Self { module, tokens: without_tests(tokens(text)) }
    }

    /// Every path that starts at a crate of the house or at `crate`, `self` or `super`, made absolute.
    fn paths(&self) -> Vec<Vec<String>> {
        let mut found = vec![];
        let mut module = self.module.clone();
        // Inline modules that are open, with the depth of braces at which each ends.
        let (mut open, mut depth) = (vec![], 0_usize);
        let mut i = 0;
        while i < self.tokens.len() {
            let (token, next) = (self.tokens[i].as_str(), self.token(i + 1));
            let before = i.checked_sub(1).map_or("", |k| self.token(k));
            match token {
                "{" => depth += 1,
                "}" => {
                    depth = depth.saturating_sub(1);
                    if open.last() == Some(&depth) {
                        open.pop();
                        module.pop();
                    }
                }
                "mod" if self.token(i + 2) == "{" => {
                    open.push(depth);
                    module.push(next.to_owned());
                }
                // A path that goes on, and who may see: `pub(in crate::wing)`.
                _ if before == "::" || before == "in" && token == "crate" => {}
                _ if token == "nonsmooth" || token.starts_with("nonsmooth_") => {
                    self.tree(i + 1, vec![token.to_owned()], &mut found);
                }
                "crate" | "self" | "super" if next == "::" => {
                    let mut base = module.clone();
                    match token {
                        "crate" => base.clear(),
                        "super" => drop(base.pop()),
                        _ => {}
                    }
                    let mut k = i + 1;
                    while self.token(k) == "::" && self.token(k + 1) == "super" {
                        base.pop();
                        k += 2;
                    }
                    base.insert(0, "crate".to_owned());
                    self.tree(k, base, &mut found);
                }
                // In the root a plain `use` starts at a module.
                "use" if module.is_empty() && !["crate", "self", "::"].contains(&next) => {
                    let base = vec!["crate".to_owned(), next.to_owned()];
                    self.tree(i + 2, base, &mut found);
                }
                _ => {}
            }
            i += 1;
        }
        found
    }

    fn token(&self, i: usize) -> &str {
        self.tokens.get(i).map_or("", String::as_str)
    }

    /// Reads the rest of a path or of a tree of `use` from token `i`; the first token after it.
    fn tree(&self, mut i: usize, mut path: Vec<String>, found: &mut Vec<Vec<String>>) -> usize {
        while self.token(i) == "::" {
            match self.token(i + 1) {
                "{" => {
                    i += 2;
                    while !["}", ""].contains(&self.token(i)) {
                        match self.token(i) {
                            "," => i += 1,
                            "self" => {
                                found.push(path.clone());
                                i += 1;
                            }
                            head => {
                                let mut longer = path.clone();
                                longer.push(head.to_owned());
                                i = self.tree(i + 1, longer, found);
                            }
                        }
                    }
                    return i + 1;
                }
                // Generic arguments end the path; what is in them starts anew.
                "<" => break,
                segment => {
                    path.push(segment.to_owned());
                    i += 2;
                }
            }
        }
        found.push(path);
        if self.token(i) == "as" { i + 2 } else { i }
    }
}

/// Identifiers, `::` and single signs. Comments, texts, characters and lifetimes are left out.
fn tokens(text: &str) -> Vec<String> {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let mut out = vec![];
    let mut i = 0;
    while i < chars.len() {
        match at(i) {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1;
                }
            }
            '/' if at(i + 1) == '*' => {
                let mut depth = 0;
                while i < chars.len() {
                    match (at(i), at(i + 1)) {
                        ('/', '*') => depth += 1,
                        ('*', '/') => depth -= 1,
                        _ => {
                            i += 1;
                            continue;
                        }
                    }
                    i += 2;
                    if depth == 0 {
                        break;
                    }
                }
            }
            '"' => i = after_text(&chars, i),
            '\'' if at(i + 1) == '\\' || at(i + 2) == '\'' => {
                i += if at(i + 1) == '\\' { 3 } else { 2 };
                while i < chars.len() && at(i) != '\'' {
                    i += 1;
                }
                i += 1;
            }
            '\'' => {
                i += 1;
                while word(at(i)) {
                    i += 1;
                }
            }
            ':' if at(i + 1) == ':' => {
                out.push("::".to_owned());
                i += 2;
            }
            c if word(c) => {
                let start = i;
                while word(at(i)) {
                    i += 1;
                }
                let name: String = chars[start..i].iter().collect();
                match (name.as_str(), at(i)) {
                    ("b" | "c", '"') => i = after_text(&chars, i),
                    ("r" | "br" | "cr", '"' | '#') => {
                        let mut hashes = 0;
                        while at(i + hashes) == '#' {
                            hashes += 1;
                        }
                        if at(i + hashes) == '"' {
                            i += hashes + 1;
                            while i < chars.len()
                                && !(at(i) == '"' && (1..=hashes).all(|k| at(i + k) == '#'))
                            {
                                i += 1;
                            }
                            i += hashes + 1;
                        } else {
                            i += hashes; // a raw identifier
                        }
                    }
                    _ => out.push(name),
                }
            }
            c => {
                if !c.is_whitespace() {
                    out.push(c.to_string());
                }
                i += 1;
            }
        }
    }
    out
}

/// The place after the text whose opening quote stands at `i`.
fn after_text(chars: &[char], mut i: usize) -> usize {
    i += 1;
    while i < chars.len() && chars[i] != '"' {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

/// Drops every item under `#[cfg(test)]`: tests may look anywhere.
fn without_tests(tokens: Vec<String>) -> Vec<String> {
    let at = |i: usize| tokens.get(i).map_or("", String::as_str);
    // The place after the bracket that closes the one at `i`.
    let closing = |mut i: usize, open: &str, close: &str| {
        let mut depth = 0_usize;
        while i < tokens.len() {
            if at(i) == open {
                depth += 1;
            } else if at(i) == close {
                depth -= 1;
                if depth == 0 {
                    break;
                }
            }
            i += 1;
        }
        i + 1
    };
    let mut out = vec![];
    let mut i = 0;
    while i < tokens.len() {
        let attribute = at(i) == "#" && at(i + 1) == "[";
        if attribute && at(i + 2) == "cfg" {
            let end = closing(i + 1, "[", "]");
            let condition = &tokens[i + 3..end.min(tokens.len())];
            let holds = |word: &str| condition.iter().any(|t| t == word);
            if holds("test") && !holds("not") {
                i = end;
                while at(i) == "#" {
                    i = closing(i + 1, "[", "]");
                }
                while i < tokens.len() && at(i) != "{" && at(i) != ";" {
                    i += 1;
                }
                i = if at(i) == "{" { closing(i, "{", "}") } else { i + 1 };
                continue;
            }
        }
        out.push(tokens[i].clone());
        i += 1;
    }
    out
}

/// What the root of a crate re-exports: the name outside, and where it comes from.
fn reexports(root: &Source) -> BTreeMap<String, Vec<String>> {
    let inside = |p: &[String]| p[0] == "crate" && p.len() > 2;
    root.paths()
        .into_iter()
        .filter(|p| inside(p))
        .map(|p| (p[p.len() - 1].clone(), p[1..].to_vec()))
        .collect()
}

/// What is wrong with the imports of one file, in words.
fn violations(
    krate: &str,
    source: &Source,
    reexported: &BTreeMap<String, Vec<String>>,
) -> Vec<String> {
    let Some((_, below)) = CRATES.iter().find(|(name, _)| *name == krate) else {
        return vec![format!("{krate} stands on no floor: name it in CRATES")];
    };
    let mut wrong = BTreeSet::new();
    for path in source.paths() {
        let text = path.join("::");
        if path[0] != "crate" {
            let known = CRATES.iter().any(|(name, _)| *name == path[0]);
            if known && path[0] != krate && !below.contains(&path[0].as_str()) {
                wrong.insert(format!("{krate} must not depend on {text}"));
            }
            continue;
        }
        let (Some(floors), Some(head)) = (floors_of(krate), path.get(1)) else {
            continue;
        };
        let from = source.module.join("/");
        if head == "*" {
            if !from.is_empty() {
                wrong.insert(format!("{from} imports {text}: name what you need"));
            }
            continue;
        }
        let to: Vec<String> = match reexported.get(head) {
            Some(place) => [place, &path[2..]].concat(),
            None => path[1..].to_vec(),
        };
        // Names of things are no modules; what the root itself defines (a macro) is in no room.
        let modules = to.iter().take_while(|name| name.starts_with(|c: char| c.is_lowercase()));
        let to: Vec<String> = modules.cloned().collect();
        if !to.is_empty() && floors.forbids(&source.module, &to) {
            wrong.insert(format!("{krate}: {from} must not import {text}"));
        }
    }
    wrong.into_iter().collect()
}

/// The crates of the house among the `[dependencies]` of a manifest, development ones apart.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut section = "";
    let mut found = BTreeSet::new();
    for line in manifest.lines().map(str::trim) {
        if let Some(header) = line.strip_prefix('[') {
            section = header.trim_end_matches(']');
            // `[dependencies.name]`
            let (table, name) = section.rsplit_once('.').unwrap_or((section, ""));
            if table.ends_with("dependencies") && !table.ends_with("dev-dependencies") {
                found.insert(name.replace('-', "_"));
            }
        } else if section.ends_with("dependencies") && !section.ends_with("dev-dependencies") {
            let name = line.split(['.', '=', ' ']).next().unwrap_or_default();
            found.insert(name.replace('-', "_"));
        }
    }
    found.retain(|name| name == "nonsmooth" || name.starts_with("nonsmooth_"));
    found
}

#[test]
fn every_crate_and_module_keeps_to_its_floor() {
    let mut wrong = vec![];
    let mut seen = 0;
    for folder in crate_folders() {
        let manifest = read(&folder.join("Cargo.toml"));
        let name = manifest
            .lines()
            .find_map(|l| l.strip_prefix("name = \""))
            .and_then(|l| l.split('"').next())
            .expect("a package has a name")
            .replace('-', "_");
        let below = CRATES.iter().find(|(n, _)| *n == name).map(|(_, b)| *b);
        for dependency in dependencies(&manifest) {
            if !below.is_some_and(|b| b.contains(&dependency.as_str())) {
                wrong.push(format!("{name}'s Cargo.toml must not name {dependency}"));
            }
        }
        let src = folder.join("src");
        let root = ["lib.rs", "main.rs"].map(|f| src.join(f));
        let root = root.iter().find(|p| p.exists()).expect("a crate has a root");
        let reexported = reexports(&Source::new("lib.rs", &read(root)));
        for file in files(&src).into_iter().filter(|f| has_extension(f, "rs")) {
            let place = relative(&file, &src);
            if place.ends_with("/tests.rs") {
                continue;
            }
            let source = Source::new(&place, &read(&file));
            for violation in violations(&name, &source, &reexported) {
                wrong.push(format!("{}: {violation}", relative(&file, &root_folder())));
            }
            seen += 1;
        }
    }
    assert!(seen > 50, "only {seen} sources found");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// The violations of a planted file.
fn planted(krate: &str, place: &str, text: &str) -> Vec<String> {
    let root = "mod core; pub use self::core::drive::{Driver, Limit as Bound}; pub use self::core::settings;";
    let root = Source::new("lib.rs", root);
    violations(krate, &Source::new(place, text), &reexports(&root))
}

#[test]
fn the_checker_finds_planted_violations() {
    let solve = |place, text| planted("nonsmooth_solve", place, text);
    let problem = |place, text| planted("nonsmooth_problem", place, text);
    // Crates.
    assert_eq!(
        planted("nonsmooth_io", "lib.rs", "use nonsmooth_solve::Driver;"),
        ["nonsmooth_io must not depend on nonsmooth_solve::Driver"]
    );
    assert_eq!(solve("core/drive.rs", "fn f() { nonsmooth_scenes::x() }").len(), 1);
    assert_eq!(solve("core/drive.rs", "use nonsmooth_bench as b;").len(), 1);
    assert_eq!(planted("nonsmooth_new", "lib.rs", "").len(), 1);
    assert_eq!(planted("nonsmooth_linalg", "csc.rs", "use nonsmooth_problem::Lcp;").len(), 1);
    assert_eq!(planted("nonsmooth_analysis", "x.rs", "use nonsmooth_solve::solve;").len(), 1);
    // A family and another family, by every way of writing it.
    for text in [
        "use crate::contact::newton::X;",
        "use crate::{SolveError, contact::newton::{self, X}};",
        "use super::super::newton::X;",
        "use super::super::{newton::X};",
        "use crate::contact::newton;",
        "fn f() -> crate::contact::newton::X { todo!() }",
        "fn f(x: Vec<crate::contact::newton::X>) {}",
        "mod inner { use super::super::super::newton::X; }",
        "pub use crate::{contact::{form::{Linear, Blockwise}, newton::X as Y}};",
    ] {
        let found = solve("contact/splitting/nsgs.rs", text);
        assert!(!found.is_empty(), "{text}");
        for violation in found {
            let expected =
                "nonsmooth_solve: contact/splitting/nsgs must not import crate::contact::newton";
            assert!(violation.starts_with(expected), "{text}: {violation}");
        }
    }
    // One wing and the other, on whatever floor.
    for (place, text) in [
        ("contact/splitting/nsgs.rs", "use crate::complementarity::form::Bounded;"),
        ("contact/solvers.rs", "use crate::complementarity::functions::Min;"),
        ("complementarity/newton/min.rs", "use crate::contact::law::cone;"),
        ("complementarity/mod.rs", "use crate::contact;"),
    ] {
        let found = solve(place, text).len();
        assert_eq!(found, usize::from(place != "complementarity/mod.rs"), "{place} {text}");
    }
    // Upwards.
    assert_eq!(solve("contact/law/cone/coulomb.rs", "use crate::contact::form::Linear;").len(), 1);
    assert_eq!(solve("contact/form/local.rs", "use crate::contact::parts::Sweep;").len(), 1);
    assert_eq!(solve("contact/parts/mod.rs", "use crate::contact::solvers::x;").len(), 1);
    assert_eq!(solve("contact/parts/mod.rs", "use crate::contact::existence::x;").len(), 1);
    assert_eq!(solve("contact/law/local.rs", "use crate::contact::splitting::Nsgs;").len(), 1);
    assert_eq!(solve("contact/newton/mod.rs", "use crate::registry::About;").len(), 1);
    assert_eq!(solve("contact/solvers.rs", "use crate::bridges::FacetInner;").len(), 1);
    assert_eq!(solve("core/drive.rs", "use crate::registry::About;").len(), 1);
    assert_eq!(solve("core/drive.rs", "use crate::contact::form::Linear;").len(), 1);
    assert_eq!(solve("core/drive.rs", "use crate::contact::Condense;").len(), 1, "a whole wing");
    assert_eq!(solve("contact/law/local.rs", "use crate::*;").len(), 1);
    assert_eq!(problem("check/rows.rs", "use super::super::planted::Planted;").len(), 1);
    for (place, text) in [
        ("kinds/contact/local/mod.rs", "use crate::planted::Planted;"),
        ("kinds/contact/local/mod.rs", "use crate::kinds::contact::planted::Planted;"),
        ("kinds/complementarity/lcp.rs", "use super::planted::PlantedLcp;"),
        ("kinds/contact/rows.rs", "use crate::kinds::complementarity::Lcp;"),
        ("kinds/complementarity/planted/linear.rs", "use crate::kinds::contact::planted::Planted;"),
    ] {
        assert_eq!(problem(place, text).len(), 1, "{place} {text}");
    }
    // After an item under test the file goes on.
    let text = "#[cfg(test)] mod tests { fn f() {} } use crate::planted::Planted;";
    assert_eq!(problem("lcp.rs", text).len(), 1);
    let text = "#[cfg(not(test))] use crate::planted::Planted;";
    assert_eq!(problem("lcp.rs", text).len(), 1);
}

#[test]
fn the_checker_lets_the_house_live() {
    let solve = |place, text| planted("nonsmooth_solve", place, text);
    let problem = |place, text| planted("nonsmooth_problem", place, text);
    for (place, text) in [
        ("contact/splitting/nsgs.rs", "use crate::contact::{law::local::Exact, form::Blockwise};"),
        ("contact/splitting/nsgs.rs", "use crate::core::{register::About, settings::Settings};"),
        ("contact/splitting/nsgs.rs", "use super::nsgs2::X; use crate::contact::parts::Order;"),
        ("contact/form/local.rs", "use crate::Driver; use crate::settings::Settings;"),
        ("contact/splitting/mod.rs", "mod nsgs; pub use nsgs::Nsgs; use self::nsgs::X;"),
        ("contact/mod.rs", "pub mod newton; pub use newton::Newton; use self::splitting::X;"),
        (
            "contact/solvers.rs",
            "use crate::contact::{splitting::Nsgs, newton::Newton}; use crate::Driver;",
        ),
        (
            "bridges/facets.rs",
            "use crate::contact::form::Contacts; use crate::complementarity::solvers::x;",
        ),
        ("registry.rs", "use crate::{bridges::X, contact::solvers::x};"),
        ("lib.rs", "pub mod contact; pub use contact::newton;"),
        (
            "core/via.rs",
            "use crate::core::reformulation::Reformulation; use crate::core::solver::Solver;",
        ),
        ("contact/law/mod.rs", "#[cfg(test)] mod tests { use crate::contact::newton::X; }"),
        ("contact/law/mod.rs", "#[cfg(test)] #[path = \"t.rs\"] mod tests; fn f() {}"),
        (
            "contact/law/mod.rs",
            "/// [x](crate::contact::newton)\n/* crate::newton /* */ crate::newton */ fn f() {}",
        ),
        ("contact/law/mod.rs", "const A: &str = \"crate::newton\\\" crate::newton\";"),
        (
            "contact/law/mod.rs",
            "const A: &str = r#\"crate::\"newton\"#; fn f<'a>(c: char) { c == '\"'; }",
        ),
        ("contact/law/mod.rs", "pub(crate) fn f() {} pub(super) fn g() {}"),
        (
            "contact/form/mod.rs",
            "use nonsmooth_problem::{Problem, Kind}; use nonsmooth_linalg::Csc; use crate::SolveError;",
        ),
    ] {
        assert_eq!(solve(place, text), [""; 0], "{text}");
    }
    for (place, text) in [
        ("kinds/contact/law.rs", "use crate::check::{self, Measure}; use nonsmooth_linalg::Csc;"),
        ("check/mod.rs", "pub use crate::kinds::contact::Law; use super::Measure;"),
        ("planted.rs", "pub use crate::kinds::contact::planted::Planted;"),
        ("kinds/contact/planted.rs", "use crate::planted::Recipe; use crate::check::Measure;"),
        ("kinds/mod.rs", "macro_rules! m { () => { $crate::Friction } }"),
    ] {
        assert_eq!(problem(place, text), [""; 0], "{text}");
    }
    assert_eq!(
        dependencies(
            "[package]\nname = \"nonsmooth-io\"\n[dependencies]\nnonsmooth-problem.workspace = true\n\
             faer = \"1\"\n[dependencies.nonsmooth-solve]\nversion = \"1\"\n[dev-dependencies]\n\
             nonsmooth-bench.workspace = true\n"
        )
        .into_iter()
        .collect::<Vec<_>>(),
        ["nonsmooth_problem", "nonsmooth_solve"]
    );
}

/// A kind is its folder, what solves and differentiates it, and the formats with a layout for it alone: all else asks the problem.
#[test]
fn what_is_common_to_all_kinds_names_none() {
    // The roots of the library export them, and types of points stand in `any`.
    let others = ["problem/src/any.rs", "problem/src/lib.rs", "nonsmooth/src/lib.rs"];
    let rooms = ["problem/src/kinds/", "analysis/src/derivative/", "solve/", "io/"];
    let rooms = rooms.into_iter().chain(others);
    let mut seen = 0;
    for folder in crate_folders() {
        for file in files(&folder.join("src")).into_iter().filter(|f| has_extension(f, "rs")) {
            let place = relative(&file, &root_folder().join("crates"));
            if rooms.clone().any(|room| place.starts_with(room)) || place.ends_with("/tests.rs") {
                continue;
            }
            let used = without_tests(tokens(&read(&file)));
            let named =
                used.iter().find(|t| ["Hlcp", "BoxLcp", "FrictionGlobal2d"].contains(&t.as_str()));
            assert!(named.is_none(), "{place} names {named:?}");
            seen += 1;
        }
    }
    assert!(seen > 100, "only {seen} sources found");
}

/// The judge and the solvers may not share a kernel: an error there would go unseen.
#[test]
fn the_judge_multiplies_by_itself() {
    // The products with W that solvers use.
    let kernels = ["row_product", "mul_plus"];
    let problem = root_folder().join("crates/problem/src");
    let of_judge = |file: &PathBuf| {
        let place = relative(file, &problem);
        place.split(['/', '.']).any(|part| part == "check" || part == "judge")
    };
    let judge: Vec<_> = files(&problem).into_iter().filter(of_judge).collect();
    assert!(judge.len() > 15, "{judge:?}");
    for file in judge {
        let used = without_tests(tokens(&read(&file)));
        let shared = used.iter().find(|t| kernels.contains(&t.as_str()));
        assert!(shared.is_none(), "{} uses {shared:?}", file.display());
    }
    // They exist under these names, so that the test means something.
    let bsr = tokens(&read(&root_folder().join("crates/linalg/src/bsr.rs")));
    assert!(kernels.iter().all(|k| bsr.iter().any(|t| t == k)));
}

// --------------------------------------------------------------------------------------------- citations

/// The keys of `docs/refs.bib`, each with its entry.
fn bibliography() -> BTreeMap<String, String> {
    let text = read(&root_folder().join("docs/refs.bib"));
    let mut entries = BTreeMap::new();
    for entry in text.split("\n@").skip(1) {
        let (head, body) = entry.split_once(',').expect("@type{key, fields}");
        let (_, key) = head.split_once('{').expect("@type{key");
        let twice = entries.insert(key.trim().to_owned(), body.to_owned());
        assert!(twice.is_none(), "{key} stands twice in refs.bib");
    }
    entries
}

/// Words that look like citation keys: names and a year (`HanLo2002`).
fn keys_with_year(text: &str) -> BTreeSet<String> {
    words(text)
        .filter(|word| {
            let (name, year) = word.split_at(word.len().saturating_sub(4));
            let mut letters = name.chars();
            name.len() >= 2
                && letters.next().is_some_and(|c| c.is_ascii_uppercase())
                && letters.all(|c| c.is_ascii_alphabetic())
                && ["18", "19", "20"].iter().any(|century| year.starts_with(century))
                && year.chars().all(|c| c.is_ascii_digit())
        })
        .map(str::to_owned)
        .collect()
}

/// Words that look like keys of initials and two figures (`DBB11`); only trusted where references stand.
fn keys_of_initials(text: &str) -> BTreeSet<String> {
    words(text)
        .filter(|word| {
            let (name, year) = word.split_at(word.len().saturating_sub(2));
            name.len() >= 2
                && name.chars().all(|c| c.is_ascii_uppercase())
                && year.chars().all(|c| c.is_ascii_digit())
        })
        .map(str::to_owned)
        .collect()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric())
}

/// The comment paragraphs of a source from `References:` or `Source:` on.
fn references(source: &str) -> String {
    let mut out = String::new();
    let mut inside = false;
    for line in source.lines().map(str::trim_start) {
        let comment = line.strip_prefix("//");
        let text = comment.unwrap_or_default().trim_start_matches(['/', '!']);
        let starts = ["References:", "Reference:", "Source:", "Sources:"];
        let start = starts.iter().filter_map(|s| text.find(s)).min();
        inside = !text.trim().is_empty() && (inside || start.is_some());
        if inside {
            out.push_str(&text[start.unwrap_or(0)..]);
            out.push('\n');
        }
    }
    out
}

/// The comments of a source.
fn comments(source: &str) -> String {
    let lines = source.lines().filter_map(|l| l.split_once("//"));
    lines.map(|(_, c)| c).collect::<Vec<_>>().join("\n")
}

/// The keys that the registry cites, each with who cites it.
fn registered() -> BTreeMap<String, String> {
    let abouts = each_kind!(P => registry::abouts::<P>());
    let solvers = abouts.into_iter().flatten().map(|a| (a.name, a.cites));
    let prefixes = each_kind!(P => registry::prefixes::<P>());
    let prefixes = prefixes.into_iter().flatten().map(|p| (p.name, p.cites));
    let cited = solvers.chain(prefixes).flat_map(|(name, cites)| {
        assert!(!cites.is_empty(), "{name} cites nothing");
        cites.iter().map(move |key| ((*key).to_owned(), format!("the registry's {name}")))
    });
    cited.collect()
}

#[test]
fn every_citation_is_in_the_bibliography_and_every_entry_is_cited() {
    let root = root_folder();
    let known = bibliography();
    let mut cited = registered();
    let mut mentioned = BTreeSet::new();
    for file in project_files() {
        let place = relative(&file, &root);
        let rust = has_extension(&file, "rs");
        // This file plants keys to test itself.
        if !(rust || has_extension(&file, "md")) || place.starts_with("crates/nonsmooth/tests/") {
            continue;
        }
        let text = read(&file);
        let mut keys = keys_with_year(&if rust { comments(&text) } else { text.clone() });
        if rust {
            keys.extend(keys_of_initials(&references(&text)));
        }
        mentioned.extend(words(&text).map(str::to_owned));
        cited.extend(keys.into_iter().map(|key| (key, place.clone())));
    }
    let missing: Vec<_> = (cited.iter())
        .filter(|(key, _)| !known.contains_key(*key))
        .map(|(key, place)| format!("{key} ({place}) is not in docs/refs.bib"))
        .collect();
    let idle: Vec<_> = (known.keys())
        .filter(|key| !mentioned.contains(*key))
        .map(|key| format!("{key} is in docs/refs.bib, but nothing cites it"))
        .collect();
    assert!(missing.is_empty() && idle.is_empty(), "\n{}\n{}", missing.join("\n"), idle.join("\n"));
}

#[test]
fn every_entry_of_the_bibliography_is_complete() {
    let entries = bibliography();
    assert!(!entries.is_empty());
    for (key, body) in entries {
        for field in ["author", "title", "year"] {
            let given = body.lines().any(|l| l.trim_start().starts_with(field) && l.contains('='));
            assert!(given, "{key} has no {field}");
        }
        let (open, close) = (body.matches('{').count(), body.matches('}').count());
        assert_eq!(open + 1, close, "{key}: braces");
        assert!(
            words(&key).eq([key.as_str()]),
            "{key}: letters and figures only, so that it can be found in a text"
        );
    }
}

#[test]
fn keys_are_recognised() {
    let header = "//! Method. Source: DBB11, section 4; HanLo2002\n//! and AB12.\n//!\n//! XY99 no.\nlet a = 1; // UTF16\n";
    assert_eq!(
        keys_of_initials(&references(header)).into_iter().collect::<Vec<_>>(),
        ["AB12", "DBB11"]
    );
    let keys = keys_with_year(
        "HanLo2002; (Jean1999), Acary2018. FooBar12345, x2000, X2000, Foo1700, HDF5",
    );
    assert_eq!(keys.into_iter().collect::<Vec<_>>(), ["Acary2018", "HanLo2002", "Jean1999"]);
}

#[test]
fn the_family_of_a_solver_is_its_folder() {
    for (wing, abouts) in [
        ("contact", registry::abouts::<FrictionLocal<3>>()),
        ("complementarity", registry::abouts::<Lcp>()),
        ("complementarity", registry::abouts::<Hlcp>()),
        ("variational", registry::abouts::<Vi>()),
    ] {
        for about in abouts {
            let folder = root_folder().join("crates/solve/src").join(wing).join(about.family);
            assert!(folder.is_dir(), "{}: no folder {}", about.name, folder.display());
        }
    }
}

// ------------------------------------------------------------------------------------------------- files

#[test]
fn no_file_names_a_place_on_someones_machine() {
    // Spelt apart, so that this file passes its own test.
    let places = [
        concat!("/", "work/"),
        concat!("/", "tmp/"),
        concat!("/", "home/"),
        concat!("/", "Users/"),
        concat!("/", "root/"),
    ];
    let root = root_folder();
    let mut wrong = vec![];
    for file in project_files() {
        // Binary files are problems, not texts.
        let Ok(text) = fs::read_to_string(&file) else {
            continue;
        };
        for (number, line) in text.lines().enumerate() {
            if let Some(place) = places.iter().find(|p| line.contains(**p)) {
                let file = relative(&file, &root);
                wrong.push(format!("{file}:{}: {place}", number + 1));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

fn root_folder() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("crates/nonsmooth").to_owned()
}

fn crate_folders() -> Vec<PathBuf> {
    let crates = root_folder().join("crates");
    let entries = fs::read_dir(crates).expect("crates").map(|e| e.expect("readable").path());
    let mut folders: Vec<_> = entries.filter(|p| p.join("Cargo.toml").exists()).collect();
    folders.sort();
    folders
}

/// The files of the project: everything but what is built and what is hidden (`.ci` is not).
fn project_files() -> Vec<PathBuf> {
    files(&root_folder())
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = vec![];
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("readable").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name == "target" || (name.starts_with('.') && name != ".ci") {
            continue;
        }
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e == extension)
}

fn relative(path: &Path, base: &Path) -> String {
    let below = path.strip_prefix(base).expect("below the base");
    below.to_string_lossy().replace('\\', "/")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
