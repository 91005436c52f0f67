//! Complementarity problems and variational inequalities by their settings, for `nonsmooth gen`.

use std::borrow::Cow;

use nonsmooth_io::{Info, ProblemFile, StoredPoint};
use nonsmooth_linalg::budget;
use nonsmooth_problem::planted::{
    BallsAndCones, Bratu, HarkerPang, JournalBearing, NashCournot, NonlinearClassic, Obstacle,
    PendulumStep, PlantedLcp, PlantedMlcp, Recipe, Torsion, Traffic,
};
use nonsmooth_problem::{AnyPoint, AnyProblem};
use nonsmooth_solve::settings::{Setting, Settings, SettingsMap, described, parse};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// What makes complementarity problems, by name.
pub struct Maker {
    /// The name.
    pub name: &'static str,
    /// One line.
    pub summary: &'static str,
    /// The documented settings.
    pub settings: fn() -> Vec<Setting>,
    make: fn(&SettingsMap) -> Result<ProblemFile, String>,
}

/// All of them.
pub const MAKERS: &[Maker] = &[
    Maker {
        name: "lcp",
        summary: "an LCP of a class of matrices, with a planted solution",
        settings: described::<Of<PlantedLcp>>,
        make: |s| Ok(solved(planted(s)?.lcp())),
    },
    Maker {
        name: "box_lcp",
        summary: "an LCP with two bounds, with a planted solution",
        settings: described::<Of<PlantedLcp>>,
        make: |s| Ok(solved(planted(s)?.boxed())),
    },
    Maker {
        name: "hlcp",
        summary: "a horizontal LCP, with a planted solution",
        settings: described::<Of<PlantedLcp>>,
        make: |s| Ok(solved(planted(s)?.hlcp())),
    },
    Maker {
        name: "infeasible",
        summary: "an LCP without a solution: of a class psd, kkt or copositive_plus",
        settings: || {
            let mut all = described::<Of<PlantedLcp>>();
            if let Some(class) = all.iter_mut().find(|setting| setting.key == "class") {
                (class.default, class.choices) =
                    (INFEASIBLE[0].into(), INFEASIBLE.map(Into::into).into());
            }
            all
        },
        make: |s| {
            let mut s = s.clone();
            let class = s.entry("class").or_insert(INFEASIBLE[0].into()).clone();
            let planted = planted(&s)?;
            let least = PlantedLcp::LEAST_INFEASIBLE;
            if planted.n < least {
                return Err(format!("n: expected at least {least}, found {}", planted.n));
            }
            let (problem, _) = planted.infeasible().ok_or_else(|| {
                format!("class: expected psd, kkt or copositive_plus, as others have solutions, found {class}")
            })?;
            Ok(ProblemFile::new(problem))
        },
    },
    Maker {
        name: "mlcp",
        summary: "a mixed LCP, with a planted solution",
        settings: described::<Of<PlantedMlcp>>,
        make: |s| {
            let made = recipe::<PlantedMlcp>(s)?;
            fits(made.free + made.pairs + made.redundant, made.density)?;
            Ok(solved(made.mlcp()))
        },
    },
    Maker {
        name: "obstacle",
        summary: "a membrane on the unit square above the obstacle sin(3.2 x) sin(3.3 y): an LCP in the gap, sparse",
        settings: described::<Of<Obstacle>>,
        make: |s| Ok(ProblemFile::new(recipe::<Obstacle>(s)?.lcp())),
    },
    Maker {
        name: "bearing",
        summary: "the pressure in the lubricant of a journal bearing: an LCP, sparse",
        settings: described::<Of<JournalBearing>>,
        make: |s| Ok(ProblemFile::new(recipe::<JournalBearing>(s)?.lcp())),
    },
    Maker {
        name: "torsion",
        summary: "elastic-plastic torsion of a square bar: an LCP with two bounds, sparse",
        settings: described::<Of<Torsion>>,
        make: |s| Ok(ProblemFile::new(recipe::<Torsion>(s)?.boxed())),
    },
    Maker {
        name: "harker_pang",
        summary: "a strongly monotone NCP, M x + D arctan x + q, with a planted solution: dense",
        settings: described::<Of<HarkerPang>>,
        make: |s| Ok(solved(recipe::<HarkerPang>(s)?.mcp())),
    },
    Maker {
        name: "nash_cournot",
        summary: "an oligopoly: an NCP in the outputs of the firms and the price, with a planted equilibrium",
        settings: described::<Of<NashCournot>>,
        make: |s| {
            let made = recipe::<NashCournot>(s)?;
            let info = Info { names: made.names(), ..Info::default() };
            Ok(ProblemFile { info, ..solved(made.mcp()) })
        },
    },
    Maker {
        name: "bratu",
        summary: "a reaction that heats itself, below an obstacle, on the unit square: an MCP, sparse",
        settings: described::<Of<Bratu>>,
        make: |s| Ok(ProblemFile::new(recipe::<Bratu>(s)?.mcp())),
    },
    Maker {
        name: "pendulum",
        summary: "a frictionless step with impacts of a pendulum of many links, nonlinear",
        settings: described::<Of<PendulumStep>>,
        make: |s| Ok(ProblemFile::new(recipe::<PendulumStep>(s)?.mcp())),
    },
    Maker {
        name: "traffic",
        summary: "drivers in a grid of streets, each on a shortest way: a VI over a polyhedron, with a planted equilibrium",
        settings: described::<Of<Traffic>>,
        make: |s| {
            let made = recipe::<Traffic>(s)?;
            let info = Info { names: made.names(), ..Info::default() };
            Ok(ProblemFile { info, ..solved(made.vi()) })
        },
    },
    Maker {
        name: "balls_and_cones",
        summary: "a strongly monotone VI over a product of balls and second-order cones, with a planted solution: dense",
        settings: described::<Of<BallsAndCones>>,
        make: |s| Ok(solved(recipe::<BallsAndCones>(s)?.vi())),
    },
    Maker {
        name: "ncp_classic",
        summary: "a worked example of nonlinear complementarity, with a solution",
        settings: described::<Of<NonlinearClassic>>,
        make: |s| {
            let classic = recipe::<NonlinearClassic>(s)?;
            let solution = classic.solutions().into_iter().next().map(StoredPoint::from);
            Ok(ProblemFile { solution, ..ProblemFile::new(classic.mcp()) })
        },
    },
];

/// The classes of which there are problems without a solution.
const INFEASIBLE: [&str; 3] = ["psd", "kkt", "copositive_plus"];

/// Bytes of an entry of a matrix that is being made: its place and its value, and once more in the matrix.
const ENTRY: f64 = 32.0;

/// Refuses a matrix of n rows with this share of entries that the machine has no room for.
fn fits(n: usize, share: f64) -> Result<(), String> {
    let needed = ENTRY * share * (n as f64).powi(2);
    match budget::fits(needed) {
        true => Ok(()),
        false => Err(format!(
            "expected a matrix that fits in memory, found {n} × {n}, which take about {:.0} GB",
            1e-9 * needed
        )),
    }
}

fn planted(settings: &SettingsMap) -> Result<PlantedLcp, String> {
    let made = recipe::<PlantedLcp>(settings)?;
    fits(made.n, made.density)?;
    Ok(made)
}

impl Maker {
    /// The one called `name`.
    pub fn find(name: &str) -> Option<&'static Self> {
        MAKERS.iter().find(|m| m.name == name)
    }

    /// The file of its problem; the solution that was planted, if any, is in it.
    pub fn make(&self, settings: &SettingsMap) -> Result<ProblemFile, String> {
        (self.make)(settings).map_err(|e| format!("{}: {e}", self.name))
    }
}

fn solved((problem, point): (impl Into<AnyProblem>, impl Into<AnyPoint>)) -> ProblemFile {
    let solution = Some(StoredPoint::from(point));
    ProblemFile { solution, ..ProblemFile::new(problem) }
}

/// A recipe as settings.
#[derive(Default, Serialize, Deserialize)]
#[serde(transparent)]
struct Of<R>(R);

/// The recipe's own schema: a derived one would refer to it, and have no properties.
impl<R: JsonSchema> JsonSchema for Of<R> {
    fn schema_name() -> Cow<'static, str> {
        R::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        R::json_schema(generator)
    }
}

impl<R: Recipe + DeserializeOwned + Serialize + JsonSchema + Default> Settings for Of<R> {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

fn recipe<R>(settings: &SettingsMap) -> Result<R, String>
where
    R: Recipe + DeserializeOwned + Serialize + JsonSchema + Default,
{
    Ok(parse::<Of<R>>(settings)?.0)
}
