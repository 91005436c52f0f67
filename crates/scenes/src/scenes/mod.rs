//! Families of scenes by name, each a struct of settings that builds a [`Scene`].
//!
//! A new family is one file and one line of [`SCENES`]. All share the settings of material and time step, the spread of
//! masses (`mass_ratio`), the motion at the beginning (`state`, `disturbance`, `impact_speed`, `spin`), `gyroscopic` and
//! `contact_density`; whatever is random repeats with `seed`. Bodies are elastic solids too in what these settings say,
//! but one that a support holds is not set in motion.

use std::ops::RangeInclusive;

use nonsmooth_solve::settings::{self, Setting, Settings, SettingsMap};
use rand::RngExt;
use rand_pcg::Pcg64;

use crate::error::{positive, require, within_limits};
use crate::{Contact, ElasticBox, Scene, SceneError, Vec3};

/// Hands the settings that all families share, `[documentation, name: type = default, ...]`, and whatever else it
/// was given to another macro.
macro_rules! with_common {
    ($receiver:ident! $($rest:tt)*) => {
        $receiver! {
            [
                /// Density of the bodies, kg/m³; of the lightest with a `mass_ratio` above 1.
                density: f64 = 2000.0,
                /// Density of the densest body over that of the lightest; geometric in between, to the bodies by lot
                /// unless the scene says otherwise.
                mass_ratio: f64 = 1.0,
                /// Coefficient of friction of every contact.
                mu: f64 = 0.6,
                /// Coefficient of rolling friction of every contact, m; 0 for none, above it the problem has five rows a
                /// contact.
                mu_r: f64 = 0.0,
                /// Newton's coefficient of restitution of every contact, from 0 to 1.
                e: f64 = 0.0,
                /// Time step, s.
                h: f64 = 0.01,
                /// Acceleration of gravity, downwards, m/s².
                gravity: f64 = 9.81,
                /// What moves when the step begins, besides what the scene itself sets in motion.
                state: $crate::scenes::State = $crate::scenes::State::Rest,
                /// Random velocities of all bodies within ± this, m/s; 0 means 0.1 in the state `perturbed`.
                disturbance: f64 = 0.0,
                /// Velocity in the state `impact`, m/s.
                impact_speed: f64 = 1.0,
                /// Random angular velocities of all bodies within ± this about each axis, rad/s.
                spin: f64 = 0.0,
                /// How the gyroscopic torque enters; spheres and elastic solids have none.
                gyroscopic: $crate::Gyroscopic = $crate::Gyroscopic::Explicit,
                /// Keeps contacts by lot until 3 contacts / degrees of freedom is this; 0 keeps all.
                contact_density: f64 = 0.0,
                /// Seed of all that is random.
                seed: u64 = 0,
            ]
            $($rest)*
        }
    };
}

/// Declares the settings of a family: its own, then those common to all, each with a default; `with` changes the
/// defaults of common ones.
macro_rules! settings {
    ($($family:tt)*) => { with_common! { family! $($family)* } };
}

macro_rules! family {
    (
        [$($(#[$common_doc:meta])* $common:ident: $common_ty:ty = $common_default:expr,)*]
        $(#[$doc:meta])*
        $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ty = $default:expr,)* }
        $(with { $($changed:ident: $value:expr,)* })?
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        #[derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $ty,)*
            $($(#[$common_doc])* pub $common: $common_ty,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self::with($crate::scenes::Common {
                    $($($changed: $value,)*)?
                    ..$crate::scenes::Common::DEFAULT
                })
            }
        }

        impl nonsmooth_solve::settings::Settings for $name {}

        impl $name {
            /// The defaults of its own settings with these common ones.
            pub(super) fn with(common: $crate::scenes::Common) -> Self {
                Self { $($field: $default,)* $($common: common.$common,)* }
            }

            fn common(&self) -> $crate::scenes::Common {
                $crate::scenes::Common { $($common: self.$common,)* }
            }
        }
    };
}

macro_rules! common {
    ([$($(#[$doc:meta])* $field:ident: $ty:ty = $default:expr,)*]) => {
        /// The settings common to all families.
        #[derive(Debug, Clone, Copy)]
        struct Common {
            $($field: $ty,)*
        }

        impl Common {
            const DEFAULT: Self = Self { $($field: $default,)* };
        }
    };
}

with_common! { common! }

/// What moves when the step begins.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Nothing.
    Rest,
    /// All bodies, by small random velocities.
    Perturbed,
    /// All bodies fall with `impact_speed`, so that contacts close at once; with neither a ground nor a held solid to fall
    /// upon they have random velocities of that size.
    Impact,
}

/// How the densities of a `mass_ratio` are given to the bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Spread {
    /// By lot.
    Random,
    /// The first body is the lightest, the last the densest.
    ByIndex,
}

mod arch;
mod bridge;
mod chain;
mod chute;
mod elastic;
mod elastic_cubes;
mod elastic_wall;
mod kapla;
mod periodic_box;
mod polyhedra;
mod sliding_box;
mod sphere_pile;
mod spheres;
mod stack;
mod wall;

pub use arch::Arch;
pub use bridge::Bridge;
pub use chain::Chain;
pub use chute::Chute;
pub use elastic_cubes::{ElasticCubes, Support};
pub use elastic_wall::ElasticWall;
pub use kapla::Kapla;
pub use periodic_box::{Grains, Periodic, PeriodicBox};
pub use polyhedra::Polyhedra;
pub use sliding_box::SlidingBox;
pub use sphere_pile::SpherePile;
pub use spheres::{Layout, Spheres};
pub use stack::Stack;
pub use wall::Wall;

/// Every family.
pub static SCENES: &[SceneEntry] = &[
    SceneEntry::of::<SlidingBox>(),
    SceneEntry::of::<Stack>(),
    SceneEntry::of::<Wall>(),
    SceneEntry::of::<Kapla>(),
    SceneEntry::of::<Arch>(),
    SceneEntry::of::<Bridge>(),
    SceneEntry::of::<Chain>(),
    SceneEntry::of::<Spheres>(),
    SceneEntry::of::<SpherePile>(),
    SceneEntry::of::<Chute>(),
    SceneEntry::of::<Polyhedra>(),
    SceneEntry::of::<PeriodicBox>(),
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
    /// by its key; [`SceneError::Stopped`] where the limits in force ([`nonsmooth_linalg::budget`]) ended it.
    pub fn make(&self, settings: &SettingsMap) -> Result<Scene, SceneError> {
        (self.make)(settings)
    }
}

/// What random numbers are for: each purpose has a stream of its own, so that changing one setting leaves the rest
/// of a scene as it is.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    Masses,
    Impact,
    Spin,
    Contacts,
    Shapes,
    Places,
    Faces,
}

impl Common {
    /// Random numbers for one purpose, reproducible by `seed`.
    fn random(&self, purpose: Purpose) -> Pcg64 {
        Pcg64::new(self.seed.into(), 1 + purpose as u128)
    }

    /// An empty scene of the family, if the common settings are possible.
    fn scene(&self, name: &str) -> Result<Scene, SceneError> {
        positive("density", self.density)?;
        positive("mass_ratio", self.mass_ratio)?;
        require("mu", self.mu, self.mu >= 0.0, "a number of at least 0")?;
        require("mu_r", self.mu_r, self.mu_r >= 0.0, "a length of at least 0")?;
        require("e", self.e, (0.0..=1.0).contains(&self.e), "a number from 0 to 1")?;
        positive("h", self.h)?;
        for (key, x) in [
            ("gravity", self.gravity),
            ("disturbance", self.disturbance),
            ("impact_speed", self.impact_speed),
            ("spin", self.spin),
            ("contact_density", self.contact_density),
        ] {
            require(key, x, x >= 0.0, "a number of at least 0")?;
        }
        Ok(Scene {
            name: name.into(),
            bodies: vec![],
            solids: vec![],
            contacts: vec![],
            gravity: [0.0, 0.0, -self.gravity],
            h: self.h,
            gyroscopic: self.gyroscopic,
            ground: Some(crate::Ground::FLAT),
            obstacles: vec![],
            periods: vec![],
        })
    }

    /// A contact with the common coefficients.
    fn contact(&self, a: Option<usize>, b: usize, point: Vec3, normal: Vec3) -> Contact {
        Contact { mu_r: self.mu_r, ..Contact::new(a, b, point, normal, self.mu, self.e) }
    }

    /// Random radii within ± the share `spread` of `radius`.
    ///
    /// Errors: values that are no radii, by the keys `radius` and `spread`.
    fn radii(&self, count: usize, radius: f64, spread: f64) -> Result<Vec<f64>, SceneError> {
        length("radius", radius)?;
        let expected = "a number from 0 to below 1";
        require("spread", spread, (0.0..1.0).contains(&spread), expected)?;
        let mut rng = self.random(Purpose::Shapes);
        let mut draw = |_| radius * (1.0 + spread * rng.random_range(-1.0..=1.0));
        Ok((0..count).map(&mut draw).collect())
    }

    /// The finished scene: masses spread, set in motion, contacts thinned, validated.
    ///
    /// Errors: those of validation; limits that are over, which may have cut short what was made.
    fn finish(&self, mut scene: Scene, spread: Spread) -> Result<Scene, SceneError> {
        within_limits()?;
        self.spread_masses(&mut scene, spread);
        self.set_in_motion(&mut scene);
        self.thin(&mut scene)?;
        scene.validate()?;
        within_limits()?;
        Ok(scene)
    }

    fn spread_masses(&self, scene: &mut Scene, spread: Spread) {
        let n = scene.bodies.len() + scene.solids.len();
        if self.mass_ratio == 1.0 || n < 2 {
            return;
        }
        let mut ranks: Vec<usize> = (0..n).collect();
        if spread == Spread::Random {
            shuffle(&mut ranks, n, &mut self.random(Purpose::Masses));
        }
        let factor = |rank| self.mass_ratio.powf(rank as f64 / (n - 1) as f64);
        let (of_bodies, of_solids) = ranks.split_at(scene.bodies.len());
        for (body, &rank) in scene.bodies.iter_mut().zip(of_bodies) {
            body.mass *= factor(rank);
            body.inertia = body.inertia.map(|row| row.map(|x| factor(rank) * x));
        }
        for (solid, &rank) in scene.solids.iter_mut().zip(of_solids) {
            solid.material.density *= factor(rank);
        }
    }

    fn set_in_motion(&self, scene: &mut Scene) {
        let amplitude = match self.state {
            State::Perturbed if self.disturbance == 0.0 => 0.1,
            _ => self.disturbance,
        };
        scene.disturb(amplitude, self.seed);
        if self.state == State::Impact {
            let falls = scene.contacts.iter().any(|c| c.a.is_none())
                || scene.solids.iter().any(ElasticBox::is_held);
            let mut rng = self.random(Purpose::Impact);
            scene.add_velocities(|_| match falls {
                true => ([0.0, 0.0, -self.impact_speed], [0.0; 3]),
                false => (symmetric(self.impact_speed, &mut rng), [0.0; 3]),
            });
        }
        let mut rng = self.random(Purpose::Spin);
        scene.add_velocities(|_| ([0.0; 3], symmetric(self.spin, &mut rng)));
    }

    /// Keeps a random subset of the contacts so that `3 nc / n` comes to `contact_density`.
    fn thin(&self, scene: &mut Scene) -> Result<(), SceneError> {
        if self.contact_density == 0.0 {
            return Ok(());
        }
        let (all, n) = (scene.contacts.len(), scene.dofs());
        let kept = (self.contact_density * n as f64 / 3.0).round().max(1.0);
        if kept > all as f64 {
            let most = 3.0 * all as f64 / n as f64;
            let expected = format!("0 or a number up to {most:.4}, that of the scene");
            return Err(SceneError::value("contact_density", expected, self.contact_density));
        }
        let kept = kept as usize;
        let mut chosen: Vec<usize> = (0..all).collect();
        shuffle(&mut chosen, kept, &mut self.random(Purpose::Contacts));
        chosen.truncate(kept);
        chosen.sort_unstable();
        scene.contacts = chosen.into_iter().map(|c| scene.contacts[c]).collect();
        Ok(())
    }
}

/// Puts a random choice of the entries first, in random order (Fisher and Yates).
fn shuffle(items: &mut [usize], first: usize, rng: &mut Pcg64) {
    for k in 0..first.min(items.len()) {
        let other = rng.random_range(k..items.len());
        items.swap(k, other);
    }
}

/// A vector of random components within ± `amplitude`.
fn symmetric(amplitude: f64, rng: &mut Pcg64) -> Vec3 {
    std::array::from_fn(|_| amplitude * rng.random_range(-1.0..=1.0))
}

/// A vector of member `k` where every second member lies crosswise: x and y change places for odd `k`.
fn crosswise(k: usize, [x, y, z]: Vec3) -> Vec3 {
    if k.is_multiple_of(2) { [x, y, z] } else { [y, x, z] }
}

/// `x` is a length in m whose cube is a number too.
fn length(key: &str, x: f64) -> Result<(), SceneError> {
    require(key, x, (1e-9..=1e9).contains(&x), "a number from 1e-9 to 1e9")
}

/// `x` is a distance up to which spheres touch, in mean radii.
fn gap(x: f64) -> Result<(), SceneError> {
    require("gap", x, x > 0.0 && x <= 1.0, "a positive number up to 1")
}

/// `n` is an `allowed` count; the upper bound keeps a slip of the keyboard from filling the memory.
fn count(key: &str, n: usize, allowed: RangeInclusive<usize>) -> Result<(), SceneError> {
    if allowed.contains(&n) {
        return Ok(());
    }
    let expected = format!("a count from {} to {}", allowed.start(), allowed.end());
    Err(SceneError::value(key, expected, n))
}
