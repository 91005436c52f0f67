//! Solvers by label, and who makes them.

use std::cmp::Reverse;
use std::fmt;

use nonsmooth_problem::{Kind, OfAny, each_kind};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::{self, SettingsMap};
use nonsmooth_solve::{Session, SolveError};
use serde_json::Value;

/// Who makes solvers: the registry, or a test's own.
pub trait Solvers: Sync {
    /// A session of the solver called `name`.
    ///
    /// Errors: as [`registry::session`].
    fn session<P: Registered>(
        &self,
        name: &str,
        settings: &SettingsMap,
    ) -> Result<Box<dyn Session<P>>, SolveError>;
}

/// The registry of this library.
#[derive(Debug, Clone, Copy, Default)]
pub struct Registry;

impl Solvers for Registry {
    fn session<P: Registered>(
        &self,
        name: &str,
        settings: &SettingsMap,
    ) -> Result<Box<dyn Session<P>>, SolveError> {
        registry::session(name, settings)
    }
}

impl Registry {
    /// The names of the solvers of all kinds of problem, each once: with `composed` also those behind a prefix, as `condense/nsgs`; with `variants` also the
    /// settings that the registry holds worth comparing.
    pub fn labels(composed: bool, variants: bool) -> Vec<String> {
        let mut of_kinds = each_kind!(P => {
            let names = match composed {
                true => registry::solver_names::<P>(),
                false => registry::abouts::<P>().iter().map(|a| a.name.to_owned()).collect(),
            };
            let about = |name: String| (registry::about::<P>(&name), name);
            (P::KIND, names.into_iter().map(about).collect::<Vec<_>>())
        });
        of_kinds.sort_by_key(|(kind, _)| rank(*kind));
        let mut all = vec![];
        for (about, name) in of_kinds.into_iter().flat_map(|(_, names)| names) {
            let settings = about.filter(|_| variants).map_or(&[][..], |a| a.variants);
            let labels = settings.iter().map(|s| format!("{name}:{s}"));
            for label in std::iter::once(name.clone()).chain(labels) {
                if !all.contains(&label) {
                    all.push(label);
                }
            }
        }
        all
    }
}

/// The order of labels: that of the list of kinds, but space before the plane.
fn rank(kind: Kind) -> (Option<usize>, Reverse<usize>) {
    let form = |kind: Kind| kind.name().trim_end_matches("_2d").trim_end_matches("_3d");
    let first = Kind::ALL.iter().position(|other| form(*other) == form(kind));
    (first, Reverse(kind.dimension()))
}

/// A solver as it is asked for: `name` or `name:key=value,key=value`. As a text it has one spelling: without blanks, keys in their
/// alphabetical order, numbers as short as they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// The name in the registry.
    pub name: String,
    /// The settings.
    pub settings: SettingsMap,
}

impl Label {
    /// Reads a label.
    ///
    /// Errors: settings that are not `key=value`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let each: Vec<&str> = rest.split(',').map(str::trim).filter(|s| !s.is_empty()).collect();
        let settings = settings::from_texts(&each).map_err(|e| format!("solver `{text}`: {e}"))?;
        Ok(Self { name: name.trim().into(), settings })
    }

    /// The one spelling of a label; a text that is none stays as it is.
    pub fn canonical(text: &str) -> String {
        Self::parse(text).map_or_else(|_| text.into(), |label| label.to_string())
    }

    /// The kinds of problem that it takes.
    ///
    /// Errors: no kind takes it: an unknown name, an unknown key or a bad value.
    pub fn kinds(&self, solvers: &impl Solvers) -> Result<Vec<Kind>, String> {
        let mut tries = each_kind!(P => (P::KIND, self.refusal::<P>(solvers)));
        tries.sort_by_key(|(kind, _)| rank(*kind));
        let takes =
            |(kind, refusal): &(Kind, Option<SolveError>)| refusal.is_none().then_some(*kind);
        let kinds: Vec<_> = tries.iter().filter_map(takes).collect();
        if !kinds.is_empty() {
            return Ok(kinds);
        }
        // A kind that knows the name says more than one that does not, and then the one that knows the most names.
        let refusals: Vec<_> = tries.into_iter().filter_map(|(_, refusal)| refusal).collect();
        let known = |e: &&SolveError| !matches!(e, SolveError::UnknownSolver { .. });
        let mut names = each_kind!(P => (P::KIND, registry::solver_names::<P>().len()));
        names.sort_by_key(|(kind, _)| rank(*kind));
        let known_names = refusals.iter().zip(names.map(|(_, n)| n)).rev();
        let most = known_names.max_by_key(|(_, n)| *n).map(|(e, _)| e);
        Err(refusals.iter().find(known).or(most).map_or_else(String::new, ToString::to_string))
    }

    fn refusal<P: Registered>(&self, solvers: &impl Solvers) -> Option<SolveError> {
        solvers.session::<P>(&self.name, &self.settings).err()
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)?;
        let mut settings: Vec<_> = self.settings.iter().collect();
        settings.sort_by_key(|&(key, _)| key);
        for (k, (key, value)) in settings.into_iter().enumerate() {
            let mark = if k == 0 { ':' } else { ',' };
            write!(f, "{mark}{key}={}", spelled(value))?;
        }
        Ok(())
    }
}

/// A value as [`Label::parse`] reads it back.
fn spelled(value: &Value) -> String {
    /// Up to here whole numbers are exact.
    const WHOLE: f64 = 9e15;
    let back = |text: &str| settings::from_texts(&[format!("key={text}")]);
    match value {
        Value::Number(n) if n.is_f64() => match n.as_f64() {
            Some(x) if x.fract() == 0.0 && x.abs() < WHOLE => (x as i64).to_string(),
            Some(x) => format!("{x:?}"),
            None => n.to_string(),
        },
        // A text that looks like a number keeps its quotes.
        Value::String(text) if back(text).is_ok_and(|map| map.get("key") == Some(value)) => {
            text.clone()
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(label: &str) -> Result<Vec<Kind>, String> {
        Label::parse(label)?.kinds(&Registry)
    }

    #[test]
    fn labels_carry_settings_and_know_their_problems() {
        assert_eq!(kinds("nsgs:omega=0.9, local=quartic").unwrap().len(), 6);
        let global = [Kind::FrictionGlobal3d, Kind::FrictionGlobal2d, Kind::RollingGlobal3d];
        assert_eq!(kinds("condense/nsgs").unwrap(), global);
        assert!(kinds("magic").unwrap_err().contains("unknown solver `magic`"));
        assert!(kinds("nsgs:omga=1").unwrap_err().contains("unknown key `omga`"));
        assert!(kinds("condense/nsgs:omga=1").unwrap_err().contains("unknown key `omga`"));
        assert!(kinds("nsgs:omega").unwrap_err().contains("expected key=value"));
    }

    #[test]
    fn a_label_has_one_spelling() {
        for (text, label) in [
            ("nsgs", "nsgs"),
            (" nsgs: ", "nsgs"),
            ("nsgs:omega=0.9", "nsgs:omega=0.9"),
            ("nsgs: omega = 0.90", "nsgs:omega=0.9"),
            ("nsgs:omega=.9,local=\"quartic\"", "nsgs:local=quartic,omega=0.9"),
            ("nsgs:local=quartic, omega=9e-1", "nsgs:local=quartic,omega=0.9"),
            ("psor:omega=1.0", "psor:omega=1"),
            ("a:b=\"1\",c=true,d=1e-10", "a:b=\"1\",c=true,d=1e-10"),
            ("a:b=1e300,c=-0.0,d=", "a:b=1e300,c=0,d="),
            ("none: such", "none: such"),
        ] {
            assert_eq!(Label::canonical(text), label);
            assert_eq!(Label::canonical(label), label);
        }
        for label in Registry::labels(true, true) {
            assert_eq!(Label::canonical(&label), label);
        }
    }

    #[test]
    fn the_registry_lists_every_name_once() {
        let plain = Registry::labels(false, false);
        assert!(plain.contains(&"nsgs".into()) && plain.iter().all(|name| !name.contains('/')));
        let all = Registry::labels(true, true);
        assert!(all.contains(&"condense/extragradient".into()));
        assert!(all.contains(&"nsgs:local=quartic".into()));
        let unique: std::collections::HashSet<_> = all.iter().collect();
        assert_eq!(unique.len(), all.len());
        assert!(all.iter().all(|l| kinds(l).is_ok()), "{all:?}");
    }
}
