//! How far faceted friction is from Coulomb's law, against the number of facets: a table and a log–log plot.
//!
//! `cargo run --release -p nonsmooth-figures --example facet_accuracy -- [DIRECTORY]`
//!
//! Writes `facet-accuracy.svg` and `facet-accuracy.csv` to the directory, by default docs/figures, and prints the table of docs/facets.md. A figure is the mean
//! of the relative residual, by the friction problem's judge, over the problems of a family and four angles of the first facet.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::PathBuf;

use nonsmooth_bench::draw::{Axis, Style};
use nonsmooth_figures::{Curve, Panel};
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionLocal, Problem};
use nonsmooth_scenes::scenes::{Family, SlidingBox};
use nonsmooth_solve::{Limits, Status, registry, settings};

const FACETS: [usize; 6] = [4, 8, 16, 32, 64, 128];
const ANGLES: usize = 4;
const EDGES: [(&str, &str); 2] = [("facet_inner", "inner facets"), ("facet_outer", "outer facets")];

/// The relative residual of the faceted answer; `None` where the faceted problem is not solved.
fn residual(
    problem: &FrictionLocal<3>,
    edge: &str,
    facets: usize,
    angle: f64,
) -> Result<Option<f64>, String> {
    let texts = [format!("facets={facets}"), format!("facet_angle={angle}")];
    let settings = settings::from_texts(&texts)?;
    let solver = format!("{edge}/lemke");
    let mut session =
        registry::session::<FrictionLocal<3>>(&solver, &settings).map_err(|e| e.to_string())?;
    let limits = Limits { tolerance: 1e-9, max_iterations: 100_000, ..Limits::default() };
    let mut point = problem.origin();
    // A method that does not apply says so here.
    let Ok(outcome) = session.solve(problem, &mut point, &limits, &mut |_| {}) else {
        return Ok(None);
    };
    let said = outcome.status.to_string();
    let done = outcome.status == Status::Solved || said.contains("the faceted problem is solved");
    Ok(done.then_some(outcome.measure.relative))
}

fn families() -> Result<Vec<(&'static str, Vec<FrictionLocal<3>>)>, String> {
    let planted = |mix, contacts, dofs| -> Vec<FrictionLocal<3>> {
        let one =
            |seed| Planted { contacts, dofs, mix, mu: (0.2, 0.6), seed, ..Planted::default() };
        (0..6).map(|seed| one(seed).local::<3>().0).collect()
    };
    let sliding = PlantedMix { open: 0.0, stick: 0.0, slip: 1.0, degenerate: 0.0 };
    let mixed = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };
    let thrown = SlidingBox { speed: 1.0, ..SlidingBox::default() }.build();
    let thrown = thrown.and_then(|scene| scene.condensed()).map_err(|e| e.to_string())?;
    Ok(vec![
        ("6 contacts that slide", planted(sliding, 6, 36)),
        ("6 contacts, open, sticking and sliding", planted(mixed, 6, 36)),
        ("a box that slides on a slope", vec![thrown]),
    ])
}

/// The mean over problems and angles, if all are solved.
fn mean(problems: &[FrictionLocal<3>], edge: &str, facets: usize) -> Result<Option<f64>, String> {
    let mut sum = 0.0;
    for problem in problems {
        for k in 0..ANGLES {
            let angle = TAU / facets as f64 * (k as f64 + 0.5) / ANGLES as f64;
            match residual(problem, edge, facets, angle)? {
                Some(found) => sum += found,
                None => return Ok(None),
            }
        }
    }
    Ok(Some(sum / (ANGLES * problems.len()) as f64))
}

fn main() -> Result<(), String> {
    let directory = PathBuf::from(std::env::args().nth(1).unwrap_or("docs/figures".into()));
    let families = families()?;
    let mut csv = String::from("law,problems,facets,mean_relative_residual\n");
    let mut panels = vec![];
    for (edge, title) in EDGES {
        let mut curves = vec![];
        for (k, (name, problems)) in families.iter().enumerate() {
            let mut points = vec![];
            for facets in FACETS {
                let Some(mean) = mean(problems, edge, facets)? else { continue };
                println!("{edge:12} {name:40} {facets:4} {mean:.2e}");
                let _ = writeln!(csv, "{edge},\"{name}\",{facets},{mean:.3e}");
                points.push(((facets as f64).log2(), mean.log10()));
            }
            let colour = Style::of(k).colour;
            let label = (*name).to_owned();
            curves.push(Curve { label, colour, width: 2, dashed: false, end: true, points });
        }
        let slope = |facets: usize| ((facets as f64).log2(), (0.4 / facets as f64).log10());
        curves.push(Curve {
            label: "proportional to 1/ω".into(),
            colour: Style::bound().colour,
            width: 2,
            dashed: true,
            end: false,
            points: FACETS.map(slope).into(),
        });
        panels.push(Panel {
            title: title.into(),
            labels: ["facets ω", "relative residual of Coulomb's law"],
            x: Axis { range: 1.8..7.2, ticks: (2..=7).map(f64::from).collect() },
            y: Axis { range: -4.0..0.0, ticks: (-4..=0).map(f64::from).collect() },
            texts: [|x| format!("{:.0}", x.exp2()), |y| format!("1e{y:.0}")],
            curves,
        });
    }
    let svg = nonsmooth_figures::svg("How far faceted friction is from Coulomb's law", &panels)?;
    nonsmooth_figures::write(&directory.join("facet-accuracy.svg"), svg.as_bytes())?;
    nonsmooth_figures::write(&directory.join("facet-accuracy.csv"), csv.as_bytes())
}
