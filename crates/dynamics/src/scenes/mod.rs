//! Families of scenes by name, each a struct of settings that builds a [`Scene`].
//!
//! A new family is one file and one line of [`SCENES`].

use std::ops::RangeInclusive;

use nonsmooth_solve::settings::{self, Setting, Settings, SettingsMap};

use crate::error::{positive, require};
use crate::{Contact, Scene, SceneError, Vec3};

/// Declares the settings of a family: its own, then those common to all, each with a default.
macro_rules! settings {
    (
        $(#[$doc:meta])*
        $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ty = $default:expr,)* }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        #[derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $ty,)*
            /// Density of the bodies, kg/m³.
            pub density: f64,
            /// Coefficient of friction of every contact.
            pub mu: f64,
            /// Newton's coefficient of restitution of every contact, from 0 to 1.
            pub e: f64,
            /// Time step, s.
            pub h: f64,
            /// Acceleration of gravity, downwards, m/s².
            pub gravity: f64,
            /// Random velocities of all bodies within ± this, m/s.
            pub disturbance: f64,
            /// Seed of the random velocities.
            pub seed: u64,
        }

        impl Default for $name {
            fn default() -> Self {
                let $crate::scenes::Common { density, mu, e, h, gravity, disturbance, seed } =
                    $crate::scenes::Common::DEFAULT;
                Self { $($field: $default,)* density, mu, e, h, gravity, disturbance, seed }
            }
        }

        impl nonsmooth_solve::settings::Settings for $name {}

        impl $name {
            fn common(&self) -> $crate::scenes::Common {
                let Self { density, mu, e, h, gravity, disturbance, seed, .. } = *self;
                $crate::scenes::Common { density, mu, e, h, gravity, disturbance, seed }
            }
        }
    };
}

mod arch;
mod elastic;
mod elastic_cubes;
mod elastic_wall;
mod sliding_box;
mod spheres;
mod stack;
mod wall;

pub use arch::Arch;
pub use elastic_cubes::{ElasticCubes, Support};
pub use elastic_wall::ElasticWall;
pub use sliding_box::SlidingBox;
pub use spheres::{Layout, Spheres};
pub use stack::Stack;
pub use wall::Wall;

/// Every family.
pub static SCENES: &[SceneEntry] = &[
    SceneEntry::of::<SlidingBox>(),
    SceneEntry::of::<Stack>(),
    SceneEntry::of::<Wall>(),
    SceneEntry::of::<Arch>(),
    SceneEntry::of::<Spheres>(),
    SceneEntry::of::<ElasticCubes>(),
    SceneEntry::of::<ElasticWall>(),
];

/// A family of scenes: a struct that is its settings.
pub trait Family: Settings {
    /// The name by which the registry and the command line call it.
    const NAME: &'static str;
    /// One line on what it shows.
    const SUMMARY: &'static str;

    /// Builds the scene, validated.
    ///
    /// Errors: a setting that makes no scene, by its key.
    fn build(&self) -> Result<Scene, SceneError>;
}

/// One family in the registry.
pub struct SceneEntry {
    /// The name by which the registry and the command line call it.
    pub name: &'static str,
    /// One line on what it shows.
    pub summary: &'static str,
    settings: fn() -> Vec<Setting>,
    make: fn(&SettingsMap) -> Result<Scene, SceneError>,
}

impl SceneEntry {
    const fn of<F: Family>() -> Self {
        Self {
            name: F::NAME,
            summary: F::SUMMARY,
            settings: settings::described::<F>,
            make: |settings| settings::parse::<F>(settings).map_err(SceneError::Setting)?.build(),
        }
    }

    /// The family called `name`.
    ///
    /// Errors: no such family; the message lists those that exist.
    pub fn find(name: &str) -> Result<&'static Self, SceneError> {
        SCENES.iter().find(|s| s.name == name).ok_or_else(|| SceneError::UnknownScene {
            found: name.into(),
            known: SCENES.iter().map(|s| s.name).collect::<Vec<_>>().join(", "),
        })
    }

    /// The documented settings with their defaults.
    pub fn settings(&self) -> Vec<Setting> {
        (self.settings)()
    }

    /// Builds the scene with `settings` in place of the defaults that they name.
    ///
    /// Errors: an unknown key, listing those that exist; a value of the wrong type or one that makes no scene,
    /// by its key.
    pub fn make(&self, settings: &SettingsMap) -> Result<Scene, SceneError> {
        (self.make)(settings)
    }
}

/// The settings common to all families.
#[derive(Debug, Clone, Copy)]
struct Common {
    density: f64,
    mu: f64,
    e: f64,
    h: f64,
    gravity: f64,
    disturbance: f64,
    seed: u64,
}

impl Common {
    const DEFAULT: Self = Self {
        density: 2000.0,
        mu: 0.6,
        e: 0.0,
        h: 0.01,
        gravity: 9.81,
        disturbance: 0.0,
        seed: 0,
    };

    /// An empty scene of the family, if the common settings are possible.
    fn scene(&self, name: &str) -> Result<Scene, SceneError> {
        positive("density", self.density)?;
        require("mu", self.mu, self.mu >= 0.0, "a number of at least 0")?;
        require("e", self.e, (0.0..=1.0).contains(&self.e), "a number from 0 to 1")?;
        positive("h", self.h)?;
        require("gravity", self.gravity, self.gravity >= 0.0, "a number of at least 0")?;
        let amplitude = self.disturbance;
        require("disturbance", amplitude, amplitude >= 0.0, "a number of at least 0")?;
        Ok(Scene {
            name: name.into(),
            bodies: vec![],
            solids: vec![],
            contacts: vec![],
            gravity: [0.0, 0.0, -self.gravity],
            h: self.h,
            ground: Some(crate::Ground::FLAT),
            obstacles: vec![],
        })
    }

    /// A contact with the common coefficients.
    fn contact(&self, a: Option<usize>, b: usize, point: Vec3, normal: Vec3) -> Contact {
        Contact::new(a, b, point, normal, self.mu, self.e)
    }

    /// The finished scene, disturbed and validated.
    fn finish(&self, mut scene: Scene) -> Result<Scene, SceneError> {
        scene.disturb(self.disturbance, self.seed);
        scene.validate()?;
        Ok(scene)
    }
}

/// `n` is an `allowed` count; the upper bound keeps a slip of the keyboard from filling the memory.
fn count(key: &str, n: usize, allowed: RangeInclusive<usize>) -> Result<(), SceneError> {
    if allowed.contains(&n) {
        return Ok(());
    }
    let expected = format!("a count from {} to {}", allowed.start(), allowed.end());
    Err(SceneError::value(key, expected, n))
}
