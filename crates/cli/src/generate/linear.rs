//! Linear complementarity problems by their settings, for `nonsmooth gen`.

use nonsmooth_io::linear::{LinearFile, LinearPoint};
use nonsmooth_problem::planted::{
    JournalBearing, Membrane, PlantedBlocks, PlantedClass, PlantedLcp, PlantedMlcp, torsion,
};
use nonsmooth_problem::{Complementarity, HlcpPoint, LcpPoint};
use nonsmooth_solve::settings::{Setting, Settings, SettingsMap, described, parse};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What makes linear complementarity problems, by name.
pub struct Maker {
    /// The name.
    pub name: &'static str,
    /// One line.
    pub summary: &'static str,
    /// The documented settings.
    pub settings: fn() -> Vec<Setting>,
    make: fn(&SettingsMap) -> Result<LinearFile, String>,
}

/// All of them.
pub const MAKERS: &[Maker] = &[
    Maker {
        name: "lcp",
        summary: "an LCP of a class of matrices, with a planted solution",
        settings: described::<Planted>,
        make: |s| {
            let (problem, point) = parse::<Planted>(s)?.plan().lcp();
            Ok(solved(Complementarity::Lcp(problem), Some(of_z(point))))
        },
    },
    Maker {
        name: "box_lcp",
        summary: "an LCP with two bounds, with a planted solution",
        settings: described::<Planted>,
        make: |s| {
            let (problem, point) = parse::<Planted>(s)?.plan().boxed();
            Ok(solved(Complementarity::Box(problem), Some(of_z(point))))
        },
    },
    Maker {
        name: "hlcp",
        summary: "a horizontal LCP, with a planted solution",
        settings: described::<Planted>,
        make: |s| {
            let (problem, HlcpPoint { x, s }) = parse::<Planted>(s)?.plan().hlcp();
            Ok(solved(Complementarity::Hlcp(problem), Some(LinearPoint { z: x, w: Some(s) })))
        },
    },
    Maker {
        name: "infeasible",
        summary: "an LCP without a solution: of a class psd, kkt or copositive_plus",
        settings: described::<Planted>,
        make: |s| {
            let planted = parse::<Planted>(s)?;
            let made = planted.plan().infeasible();
            let (problem, _) = made.ok_or_else(|| {
                let found = serde_json::json!(planted.class);
                format!("class: expected psd, kkt or copositive_plus, as others have solutions, found {found}")
            })?;
            Ok(solved(Complementarity::Lcp(problem), None))
        },
    },
    Maker {
        name: "mlcp",
        summary: "a mixed LCP, with a planted solution",
        settings: described::<Mixed>,
        make: |s| {
            let (problem, point) = parse::<Mixed>(s)?.plan().mlcp();
            Ok(solved(Complementarity::Mlcp(problem), Some(of_z(point))))
        },
    },
    Maker {
        name: "obstacle",
        summary: "a membrane on the unit square above the obstacle sin(3.2 x) sin(3.3 y): an LCP in the gap, sparse",
        settings: described::<Obstacle>,
        make: |s| {
            let Obstacle { n, load } = parse(s)?;
            let membrane = Membrane { load, ..Membrane::square(n) };
            let problem = membrane.above(|x, y| (3.2 * x).sin() * (3.3 * y).sin());
            Ok(solved(Complementarity::Lcp(problem), None))
        },
    },
    Maker {
        name: "bearing",
        summary: "the pressure in the lubricant of a journal bearing: an LCP, sparse",
        settings: described::<Bearing>,
        make: |s| {
            let Bearing { nx, ny, eccentricity, half_width } = parse(s)?;
            let problem = JournalBearing { nx, ny, eccentricity, half_width }.lcp();
            Ok(solved(Complementarity::Lcp(problem), None))
        },
    },
    Maker {
        name: "torsion",
        summary: "elastic-plastic torsion of a square bar: an LCP with two bounds, sparse",
        settings: described::<Torsion>,
        make: |s| {
            let Torsion { n, load } = parse(s)?;
            Ok(solved(Complementarity::Box(torsion(n, load)), None))
        },
    },
];

impl Maker {
    /// The one called `name`.
    pub fn find(name: &str) -> Option<&'static Self> {
        MAKERS.iter().find(|m| m.name == name)
    }

    /// The file of its problem; the solution that was planted, if any, is in it.
    pub fn make(&self, settings: &SettingsMap) -> Result<LinearFile, String> {
        (self.make)(settings).map_err(|e| format!("{}: {e}", self.name))
    }
}

fn solved(problem: Complementarity, solution: Option<LinearPoint>) -> LinearFile {
    LinearFile { solution, ..LinearFile::new(problem) }
}

fn of_z(point: LcpPoint) -> LinearPoint {
    LinearPoint { z: point.z, w: None }
}

/// A problem of a class of matrices.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Planted {
    /// The number of variables, at least 2; a multiple of 6 for contact, or rounded up to one.
    n: usize,
    /// The class of the matrix.
    class: Class,
    /// The share of entries that are not zero, about; 1 gives a dense matrix.
    density: f64,
    /// The share of variables with z > 0 among those that are not degenerate.
    active: f64,
    /// The share of variables with z = w = 0.
    degenerate: f64,
    /// Rows and columns are scaled by powers of two from 10^-decades to 10^decades.
    decades: f64,
    /// The seed: the same seed gives the same problem to the bit.
    seed: u64,
}

/// The classes by their names in settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Class {
    Spd,
    MMatrix,
    HPlus,
    P,
    Lcprand,
    Psd,
    Kkt,
    CopositivePlus,
    Contact,
    Bimatrix,
}

impl Class {
    fn planted(self) -> PlantedClass {
        match self {
            Self::Spd => PlantedClass::Spd,
            Self::MMatrix => PlantedClass::MMatrix,
            Self::HPlus => PlantedClass::HPlus,
            Self::P => PlantedClass::P,
            Self::Lcprand => PlantedClass::Lcprand,
            Self::Psd => PlantedClass::Psd,
            Self::Kkt => PlantedClass::Kkt,
            Self::CopositivePlus => PlantedClass::CopositivePlus,
            Self::Contact => PlantedClass::Contact,
            Self::Bimatrix => PlantedClass::Bimatrix,
        }
    }
}

/// A whole number of variables that a machine can hold.
const MOST: usize = 100_000_000;

fn share(key: &str, x: f64) -> Result<(), String> {
    match (0.0..=1.0).contains(&x) {
        true => Ok(()),
        false => Err(format!("{key}: expected a number from 0 to 1, found {x}")),
    }
}

fn size(key: &str, n: usize, least: usize) -> Result<(), String> {
    match (least..=MOST).contains(&n) {
        true => Ok(()),
        false => Err(format!("{key}: expected from {least} to {MOST}, found {n}")),
    }
}

impl Default for Planted {
    fn default() -> Self {
        let PlantedLcp { n, density, active, degenerate, decades, seed, .. } =
            PlantedLcp::default();
        Self { n, class: Class::Spd, density, active, degenerate, decades, seed }
    }
}

impl Settings for Planted {
    fn validate(&self) -> Result<(), String> {
        size("n", self.n, 2)?;
        for (key, x) in
            [("density", self.density), ("active", self.active), ("degenerate", self.degenerate)]
        {
            share(key, x)?;
        }
        match (0.0..=20.0).contains(&self.decades) {
            true => Ok(()),
            false => Err(format!("decades: expected from 0 to 20, found {}", self.decades)),
        }
    }
}

impl Planted {
    fn plan(&self) -> PlantedLcp {
        let Self { n, class, density, active, degenerate, decades, seed } = *self;
        PlantedLcp { n, class: class.planted(), density, active, degenerate, decades, seed }
    }
}

/// A mixed problem.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Mixed {
    /// The number of free variables, at least 1.
    free: usize,
    /// The number of complementary pairs, at least 1.
    pairs: usize,
    /// What the blocks are like: all regular, A of half its rank, or B zero.
    blocks: Blocks,
    /// Equalities that repeat another one, so that A has more rows than columns.
    redundant: usize,
    /// The share of entries that are not zero, about; 1 gives a dense matrix.
    density: f64,
    /// The share of pairs with v = w = 0.
    degenerate: f64,
    /// The seed: the same seed gives the same problem to the bit.
    seed: u64,
}

/// The blocks by their names in settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Blocks {
    Regular,
    SingularA,
    NoB,
}

impl Default for Mixed {
    fn default() -> Self {
        let PlantedMlcp { free, pairs, redundant, density, degenerate, seed, .. } =
            PlantedMlcp::default();
        Self { free, pairs, blocks: Blocks::Regular, redundant, density, degenerate, seed }
    }
}

impl Settings for Mixed {
    fn validate(&self) -> Result<(), String> {
        size("free", self.free, 1)?;
        size("pairs", self.pairs, 1)?;
        size("redundant", self.redundant, 0)?;
        share("density", self.density)?;
        share("degenerate", self.degenerate)
    }
}

impl Mixed {
    fn plan(&self) -> PlantedMlcp {
        let Self { free, pairs, blocks, redundant, density, degenerate, seed } = *self;
        let blocks = match blocks {
            Blocks::Regular => PlantedBlocks::Regular,
            Blocks::SingularA => PlantedBlocks::SingularA,
            Blocks::NoB => PlantedBlocks::NoB,
        };
        PlantedMlcp { free, pairs, blocks, redundant, density, degenerate, seed }
    }
}

/// The most points of a grid along a side.
const SIDE: usize = 10_000;

fn side(key: &str, n: usize) -> Result<(), String> {
    match (1..=SIDE).contains(&n) {
        true => Ok(()),
        false => Err(format!("{key}: expected from 1 to {SIDE}, found {n}")),
    }
}

fn finite(key: &str, x: f64) -> Result<(), String> {
    match x.is_finite() {
        true => Ok(()),
        false => Err(format!("{key}: expected a finite number, found {x}")),
    }
}

/// A membrane above an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Obstacle {
    /// Interior points along each side: n^2 variables.
    n: usize,
    /// The load that pulls the membrane up, a force per area; negative loads press it down.
    load: f64,
}

impl Default for Obstacle {
    fn default() -> Self {
        Self { n: 20, load: 1.0 }
    }
}

impl Settings for Obstacle {
    fn validate(&self) -> Result<(), String> {
        side("n", self.n)?;
        finite("load", self.load)
    }
}

/// A journal bearing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Bearing {
    /// Interior points along the circumference.
    nx: usize,
    /// Interior points along the axis.
    ny: usize,
    /// The eccentricity, between 0 and 1.
    eccentricity: f64,
    /// Half of the axial extent, positive.
    half_width: f64,
}

impl Default for Bearing {
    fn default() -> Self {
        let JournalBearing { eccentricity, half_width, .. } = JournalBearing::default();
        Self { nx: 50, ny: 50, eccentricity, half_width }
    }
}

impl Settings for Bearing {
    fn validate(&self) -> Result<(), String> {
        side("nx", self.nx)?;
        side("ny", self.ny)?;
        let Self { eccentricity, half_width, .. } = *self;
        if !(eccentricity > 0.0 && eccentricity < 1.0) {
            return Err(format!("eccentricity: expected a number in (0, 1), found {eccentricity}"));
        }
        match half_width > 0.0 && half_width.is_finite() {
            true => Ok(()),
            false => Err(format!("half_width: expected a positive number, found {half_width}")),
        }
    }
}

/// Torsion of a bar.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Torsion {
    /// Interior points along each side: n^2 variables.
    n: usize,
    /// The angle of twist, as a load.
    load: f64,
}

impl Default for Torsion {
    fn default() -> Self {
        Self { n: 20, load: 5.0 }
    }
}

impl Settings for Torsion {
    fn validate(&self) -> Result<(), String> {
        side("n", self.n)?;
        finite("load", self.load)
    }
}
