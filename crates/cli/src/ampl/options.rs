//! Options as AMPL and Pyomo state them: words `key=value`, in the environment and as arguments.

use nonsmooth_io::nl;
use nonsmooth_solve::settings::{self, SettingsMap};
use nonsmooth_solve::{registry, spelling};

use crate::files;

/// What the words set.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Options {
    pub(super) solver: String,
    pub(super) tolerance: f64,
    pub(super) iterations: Option<usize>,
    pub(super) seconds: Option<f64>,
    pub(super) model: nl::Options,
    /// Bits: 1 a solution file, 2 the values printed, 8 no message.
    pub(super) wantsol: u8,
    /// Settings of the solver.
    pub(super) settings: SettingsMap,
    /// Options of PATH that nothing here answers to.
    pub(super) ignored: Vec<String>,
    /// Whether the version was asked for.
    pub(super) version: bool,
}

const OTHERS: &str = "any other";

/// The keys with what they mean, as `-=` lists them.
pub(super) const KEYS: [(&str, &str); 12] = [
    ("convergence_tolerance", "the same as tol"),
    ("infinity", "bounds of this modulus and more are infinite (1e20)"),
    ("major_iteration_limit", "the same as max_iter"),
    ("max_iter", "at most this many iterations"),
    (
        "sideineq",
        "1: inequalities without a variable become rows of their own; 0 (default): they are refused",
    ),
    ("solver", "the solver, one of `nonsmooth list` (auto)"),
    ("subsolver", "the same as solver, which Pyomo keeps to itself"),
    ("time_limit", "at most this many seconds"),
    ("tol", "the relative residual to reach (1e-8)"),
    ("version", "print the version (no value)"),
    (
        "wantsol",
        "without -AMPL, a sum of: 1 write .sol, 2 print the values, 4 print dual values (there are none), 8 no message",
    ),
    (OTHERS, "a setting of the solver"),
];

/// What PATH and its driver know by name and nothing here answers to: they are passed by, so that a user's options need no change.
fn is_of_path(key: &str) -> bool {
    const NAMES: [&str; 17] = [
        "cumulative_iteration_limit",
        "debug",
        "factorization_method",
        "interrupt_limit",
        "logfile",
        "maxfwd",
        "merit_function",
        "minor_iteration_limit",
        "nms",
        "optfile",
        "output",
        "preprocess",
        "proximal_perturbation",
        "restart_limit",
        "return_best_point",
        "sqwarn",
        "statusfile",
    ];
    let families = ["crash_", "gradient_", "lemke_", "nms_", "output_"];
    NAMES.contains(&key) || families.iter().any(|f| key.starts_with(f))
}

impl Default for Options {
    fn default() -> Self {
        Self {
            solver: registry::DEFAULT.into(),
            tolerance: 1e-8,
            iterations: None,
            seconds: None,
            model: nl::Options::default(),
            wantsol: 0,
            settings: SettingsMap::new(),
            ignored: vec![],
            version: false,
        }
    }
}

impl Options {
    /// Sets what the pairs say; the last of one key counts.
    ///
    /// Errors: a value of the wrong type, by its key.
    pub(super) fn set(&mut self, pairs: &[(String, String)]) -> Result<(), String> {
        for (key, value) in pairs {
            let wrong = |expected: &str| format!("{key}: expected {expected}, found `{value}`");
            let number = || value.parse::<f64>().ok().filter(|x| *x >= 0.0);
            let real = || number().ok_or_else(|| wrong("a number of at least 0"));
            let whole = || {
                let found = number().filter(|x| x.fract() == 0.0 && *x <= 9e15);
                found.map(|x| x as usize).ok_or_else(|| wrong("a whole number"))
            };
            match key.as_str() {
                "solver" | "subsolver" => self.solver.clone_from(value),
                "tol" | "convergence_tolerance" => {
                    let found = number().filter(|x| files::is_tolerance(*x));
                    self.tolerance = found.ok_or_else(|| wrong(files::TOLERANCE))?;
                }
                "max_iter" | "major_iteration_limit" => self.iterations = Some(whole()?),
                "time_limit" => self.seconds = Some(real()?),
                "infinity" => self.model.infinity = real()?,
                "sideineq" => self.model.side_inequalities = whole()? != 0,
                "wantsol" => {
                    self.wantsol = whole()?.try_into().map_err(|_| wrong("a number below 16"))?;
                }
                "version" => self.version = true,
                key if is_of_path(key) => self.ignored.push(key.into()),
                _ => {
                    let one = settings::from_texts(&[format!("{key}={value}")])?;
                    self.settings.extend(one);
                }
            }
        }
        Ok(())
    }

    /// Of an unknown key, those that may be meant.
    pub(super) fn meant(key: &str) -> String {
        spelling::meant(key, KEYS.iter().map(|k| k.0).filter(|known| *known != OTHERS))
    }
}

/// The words of an option variable: `key=value`, `key = value` or `key value`, values with blanks between quotes.
pub(super) fn pairs_of(text: &str) -> Result<Vec<(String, String)>, String> {
    let mut words: Vec<String> = vec![];
    let mut word: Option<String> = None;
    let mut quote = None;
    for c in text.chars() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (None, '"' | '\'') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (None, c) if c.is_whitespace() => words.extend(word.take()),
            // Inside a value it is a character as others.
            (None, '=') if word.is_none() || words.last().is_none_or(|w| w != "=") => {
                words.extend(word.take());
                words.push("=".into());
            }
            (_, c) => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    pairs(words)
}

/// Arguments: each a pair, or a key whose value follows.
pub(super) fn pairs_in(arguments: &[String]) -> Result<Vec<(String, String)>, String> {
    let words = arguments.iter().flat_map(|word| match word.split_once('=') {
        Some((key, value)) => {
            let parts = [key.trim(), "=", value.trim()].map(str::to_owned);
            parts.into_iter().filter(|part| !part.is_empty()).collect()
        }
        None => vec![word.clone()],
    });
    pairs(words.collect())
}

fn pairs(words: Vec<String>) -> Result<Vec<(String, String)>, String> {
    let mut pairs = vec![];
    let mut words = words.into_iter().peekable();
    while let Some(key) = words.next() {
        if key == "version" {
            pairs.push((key, String::new()));
            continue;
        }
        words.next_if(|word| word == "=");
        match words.next() {
            Some(value) if key != "=" => pairs.push((key, value)),
            _ => return Err(format!("expected key=value, found `{key}`")),
        }
    }
    Ok(pairs)
}
