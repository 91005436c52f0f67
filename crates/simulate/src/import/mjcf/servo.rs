//! The gain and the bias of actuators, which their shorthands and classes say in several ways.

use super::document::Item;
use crate::SimulateError;

/// The actuators, which have one default in a class.
pub(super) const ACTUATORS: [&str; 10] = [
    GENERAL,
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
];

/// What all of them are shorthands of.
const GENERAL: &str = "general";
/// What shorthands say besides, and what stands for nothing there.
const BESIDES: [&str; 2] = ["timeconst", "inheritrange"];

/// The force `gain` · control + `bias` · (1, position, velocity); where the last number is positive, it is a ratio of damping.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Servo {
    /// Which actuator was said last.
    kind: &'static str,
    pub gain: f64,
    pub bias: [f64; 3],
    /// Of [`BESIDES`].
    besides: [f64; 2],
    /// The element that says a gain or a bias of another form.
    other: Option<String>,
}

impl Servo {
    /// Where nothing is said.
    pub const NONE: Self =
        Self { kind: GENERAL, gain: 1.0, bias: [0.0; 3], besides: [0.0; 2], other: None };

    /// Whether an actuator takes over what is said here: a shorthand takes nothing of another one.
    pub fn serves(&self, actuator: &str) -> bool {
        [actuator, GENERAL].contains(&self.kind) || actuator == GENERAL
    }

    /// With what an actuator says itself, or one of a class without what the class says.
    ///
    /// Errors: numbers that are none; a negative `kv` of a servo for positions, as in MuJoCo.
    pub fn with(mut self, own: &Item) -> Result<Self, SimulateError> {
        let tag = own.element.tag.as_str();
        self.kind = ACTUATORS.into_iter().find(|kind| *kind == tag).unwrap_or(GENERAL);
        match self.kind {
            GENERAL => {
                let (gain, [a, b, c], o) = (self.gain, self.bias, 0.0);
                self.gain = own.list("gainprm", [gain, o, o, o, o, o, o, o, o, o])?[0];
                let bias = own.list("biasprm", [a, b, c, o, o, o, o, o, o, o])?;
                self.bias = [bias[0], bias[1], bias[2]];
                let plain = |name: &str, forms: &[&str]| {
                    own.text(name).is_none_or(|form| forms.contains(&form))
                };
                if !plain("gaintype", &["fixed"]) || !plain("biastype", &["none", "affine"]) {
                    self = Self { other: Some(own.key()), ..Self::NONE };
                }
            }
            "position" | "intvelocity" => {
                self.gain = own.first("kp")?.unwrap_or(self.gain);
                let kv = own.first("kv")?;
                if let Some(kv) = kv.filter(|kv| *kv < 0.0) {
                    return Err(own.wrong("a `kv` of at least 0", kv));
                }
                let damping = kv.map(|kv| -kv).or(own.first("dampratio")?);
                self.bias = [0.0, -self.gain, damping.unwrap_or(self.bias[2])];
                for (value, name) in self.besides.iter_mut().zip(BESIDES) {
                    *value = own.first(name)?.unwrap_or(*value);
                }
            }
            "velocity" => {
                self.gain = own.first("kv")?.unwrap_or(self.gain);
                self.bias = [0.0, 0.0, -self.gain];
            }
            kind => {
                let other = (kind != "motor").then(|| own.key());
                self = Self { kind, other, ..Self::NONE };
            }
        }
        Ok(self)
    }

    /// What of it cannot be said of a motor of a scene.
    pub fn left_out(&self) -> impl Iterator<Item = String> {
        let besides = BESIDES.into_iter().zip(self.besides).filter(|(_, x)| *x != 0.0);
        let ratio = (self.bias[2] > 0.0 && self.kind != "velocity").then_some("dampratio");
        let names = ratio.into_iter().chain(besides.map(|(name, _)| name));
        let names = names.map(|name| format!("`{name}` is left out"));
        let other = self.other.iter();
        names.chain(other.map(|key| format!("what {key} says of gain and bias is left out")))
    }
}
