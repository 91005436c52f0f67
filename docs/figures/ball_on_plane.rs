//! The lecture's ball on a plane under a turning force: Coulomb's cone against facets, in one picture.
//!
//! `cargo run --release -p nonsmooth-figures --example ball_on_plane -- [DIRECTORY]`
//!
//! Writes `ball-on-plane.svg`, `ball-on-plane.png` and `ball-on-plane.csv` (the positions at the end of the period) to the directory, by default
//! docs/figures, and prints the table of docs/facets.md.

use std::fmt::Write;
use std::path::PathBuf;

use nonsmooth_bench::draw::{Axis, INK, Style, tick};
use nonsmooth_figures::{Curve, Panel, linear};
use nonsmooth_problem::FrictionLocal;
use nonsmooth_scenes::{BallState, TurningBall};
use nonsmooth_solve::{Limits, registry, settings};

const FACETS: [usize; 5] = [4, 6, 8, 16, 32];
/// Phases of the force: one period.
const PHASES: usize = 3;
/// Time steps a phase: 1 ms each.
const STEPS: usize = 5000;

/// The path with the contact problems solved by the solver of this name.
fn path(ball: &TurningBall, solver: &str, texts: &[String]) -> Result<Vec<BallState>, String> {
    let settings = settings::from_texts(texts)?;
    let mut session =
        registry::session::<FrictionLocal<3>>(solver, &settings).map_err(|e| e.to_string())?;
    let limits = Limits { tolerance: 1e-12, max_iterations: 10_000, ..Limits::default() };
    ball.path(&mut *session, &limits, PHASES, STEPS).map_err(|e| e.to_string())
}

/// How the ball starts, and its paths by the law of friction.
struct Start {
    name: &'static str,
    exact: Vec<BallState>,
    /// Law, number of facets, path.
    paths: Vec<(&'static str, usize, Vec<BallState>)>,
}

impl Start {
    fn new(name: &'static str, velocity: [f64; 2]) -> Result<Self, String> {
        let ball = TurningBall { velocity, ..TurningBall::default() };
        let mut paths = vec![("cone", 0, path(&ball, "nsgs", &[])?)];
        for edge in ["facet_inner", "facet_outer"] {
            for facets in FACETS {
                let texts = [format!("facets={facets}")];
                paths.push((edge, facets, path(&ball, &format!("{edge}/lemke"), &texts)?));
            }
        }
        Ok(Self { name, exact: ball.exact(PHASES, 400), paths })
    }

    /// Where the ball should be, the end of a path, and how far that is.
    fn ends(&self) -> impl Iterator<Item = (&'static str, usize, [f64; 2], f64)> {
        let target = end(&self.exact);
        self.paths.iter().map(move |(law, facets, path)| {
            let [x, y] = end(path);
            (*law, *facets, [x, y], (x - target[0]).hypot(y - target[1]))
        })
    }

    fn panel(&self, title: &str, square: Option<[f64; 2]>) -> Panel {
        let place = |s: &BallState| (s.position[0], s.position[1]);
        let inner = self.paths.iter().filter(|p| p.0 == "facet_inner");
        let mut curves: Vec<Curve> = inner
            .enumerate()
            .map(|(k, (_, facets, path))| Curve {
                label: format!("ω = {facets}"),
                colour: Style::of(k).colour,
                width: 2,
                dashed: false,
                end: true,
                points: path.iter().map(place).collect(),
            })
            .collect();
        curves.push(Curve {
            label: "Coulomb's cone".into(),
            colour: INK,
            width: 3,
            dashed: true,
            end: true,
            points: self.exact.iter().map(place).collect(),
        });
        let (x, y) = square.map_or_else(|| frame(&curves), |[a, b]| (linear(a..b), linear(a..b)));
        Panel { title: title.into(), labels: ["x (m)", "y (m)"], x, y, texts: [text; 2], curves }
    }
}

fn text(x: f64) -> String {
    if x < 0.0 { format!("−{}", tick(-x)) } else { tick(x) }
}

fn end(path: &[BallState]) -> [f64; 2] {
    path.last().map_or([0.0; 2], |s| s.position)
}

/// A square around all curves.
fn frame(curves: &[Curve]) -> (Axis, Axis) {
    let bounds = |of: fn(&(f64, f64)) -> f64| {
        let all = curves.iter().flat_map(|c| &c.points).map(of);
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
    };
    let (x, y) = (bounds(|p| p.0), bounds(|p| p.1));
    let half = 0.53 * (x.1 - x.0).max(y.1 - y.0);
    let around = |(low, high): (f64, f64)| {
        let middle = 0.5 * (low + high);
        linear(middle - half..middle + half)
    };
    (around(x), around(y))
}

fn main() -> Result<(), String> {
    let directory = PathBuf::from(std::env::args().nth(1).unwrap_or("docs/figures".into()));
    let starts = [Start::new("launched", [4.0, 0.0])?, Start::new("rest", [0.0, 0.0])?];
    let [launched, rest] = &starts;
    let panels = [
        launched.panel("launched with 4 m/s along x", None),
        rest.panel("from rest: it should not move", None),
        rest.panel("from rest, nearer", Some([-0.08, 0.24])),
    ];
    let title = "A ball on a plane under a force of the size of the friction limit that turns in 15 s: inner facets";
    let svg = nonsmooth_figures::svg(title, &panels)?;
    nonsmooth_figures::write(&directory.join("ball-on-plane.svg"), svg.as_bytes())?;
    nonsmooth_figures::png(&svg, &directory.join("ball-on-plane.png"))?;
    let mut csv = String::from("start,law,facets,x_m,y_m,distance_m\n");
    for start in &starts {
        let [x, y] = end(&start.exact);
        let _ = writeln!(csv, "{},closed_form,,{x:.6},{y:.6},0", start.name);
        for (law, facets, [x, y], far) in start.ends() {
            let facets = if facets > 0 { facets.to_string() } else { String::new() };
            let _ = writeln!(csv, "{},{law},{facets},{x:.6},{y:.6},{far:.6}", start.name);
        }
    }
    nonsmooth_figures::write(&directory.join("ball-on-plane.csv"), csv.as_bytes())?;
    println!("| law | launched: end (m) | off by (m) | from rest: end (m) | off by (m) |");
    println!("| --- | --- | --- | --- | --- |");
    for (a, b) in launched.ends().zip(rest.ends()) {
        let name = if a.1 > 0 { format!("{}, ω = {}", a.0, a.1) } else { "cone, stepped".into() };
        let at = |p: [f64; 2]| format!("({:.3}, {:.3})", p[0] + 0.0, p[1] + 0.0);
        println!("| {name} | {} | {:.3} | {} | {:.3} |", at(a.2), a.3, at(b.2), b.3);
    }
    Ok(())
}
