//! The figures of a campaign for papers: SVG, each with the data that it shows as CSV.

use std::collections::{BTreeMap, HashMap, HashSet};

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::draw::{Axis, GRID, INK, LOOKS, Mark, Style, decades, font, tick, ticks};
use crate::page::names;
use crate::plural;
use crate::profile::{
    Cost, Costs, Curve, DECADES, Progress, Selection, VIRTUAL_BEST, performance,
    performance_of_best,
};
use crate::runs::Runs;
use crate::tables::{Table, number};

/// A figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// A name for its files, such as `profile-seconds`.
    pub name: String,
    /// Its title.
    pub title: String,
    /// The picture, a standalone SVG.
    pub svg: String,
    /// The data that it shows.
    pub csv: String,
}

impl Figure {
    /// The files that it is kept in, by their names.
    pub fn files(&self) -> [(String, &str); 2] {
        [("svg", &self.svg), ("csv", &self.csv)]
            .map(|(end, text)| (format!("{}.{end}", self.name), text.as_str()))
    }
}

/// Every figure that the selected runs have data for: performance profiles by time, iterations and factorisations; data
/// profiles; success against tolerance; residual against time.
///
/// A solver looks the same in all of them, whatever the selection: its look follows its place among all the runs (of
/// more than 32, if that look is free).
pub fn figures(runs: &Runs, selection: &Selection) -> Result<Vec<Figure>, String> {
    let scene = Scene::new(runs, selection);
    let mut all = vec![];
    for cost in Cost::ALL {
        all.extend(scene.profile(cost)?);
    }
    let progress = Progress::of(runs, selection);
    all.extend(scene.data_profile(&progress)?);
    all.extend(scene.success()?);
    all.extend(scene.residual(&progress)?);
    Ok(all)
}

/// The performance profile of the selected runs alone; none where no run has the cost.
pub fn profile(runs: &Runs, selection: &Selection, cost: Cost) -> Result<Option<Figure>, String> {
    Scene::new(runs, selection).profile(cost)
}

/// The figure of success against tolerance alone; none where there is nothing to show.
pub fn success(runs: &Runs, selection: &Selection) -> Result<Option<Figure>, String> {
    Scene::new(runs, selection).success()
}

/// One panel of [`scaling`].
#[derive(Debug, Clone, PartialEq)]
pub struct Scaling {
    /// What is solved.
    pub title: String,
    /// The solvers by label, each with its `(n, seconds)`.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
}

/// A family of solvers in [`scaling`], in panels of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Family<'a> {
    /// What they have in common.
    pub title: &'a str,
    /// Their labels.
    pub labels: &'a [&'a str],
}

/// Times against the number of unknowns, both logarithmic: a power of n is a straight line. There is a row of panels for each family, a panel for
/// each problem in it; `reference` is in all of them. Curves of no family are in the data alone.
///
/// Errors: the drawing fails, or no point is positive.
pub fn scaling(
    name: &str,
    title: &str,
    notes: &[String],
    all: &[Scaling],
    families: &[Family],
    reference: &str,
) -> Result<Figure, String> {
    type Curves<'a> = Vec<&'a (String, Vec<(f64, f64)>)>;
    let axis = |curves: Curves, of: fn(&(f64, f64)) -> f64, step: f64| {
        let logs = curves.iter().flat_map(|(_, p)| p).map(of).filter(|x| *x > 0.0).map(f64::log10);
        let (low, high) =
            logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let (low, high) = (((low - 0.05) / step).floor(), ((high + 0.05) / step).ceil());
        let range = low * step..high * step;
        let ticks = decades(range.start, range.end, 9);
        (low <= high).then_some(Axis { range, ticks }).ok_or(format!("{name}: nothing to draw"))
    };
    let y = axis(all.iter().flat_map(|problem| &problem.curves).collect(), |p| p.1, 1.0)?;
    let mut panels = vec![];
    for family in families {
        for problem in all {
            let style = |label: &str| {
                let place = family.labels.iter().position(|l| *l == label);
                place.map_or_else(Style::bound, Style::plain)
            };
            let shown = |(label, _): &&(String, _)| {
                label == reference || family.labels.contains(&label.as_str())
            };
            let curves: Curves = problem.curves.iter().filter(shown).collect();
            panels.push(Panel {
                title: format!("{}: {}", problem.title, family.title),
                x: axis(problem.curves.iter().collect(), |p| p.0, 0.5)?,
                y: y.clone(),
                x_label: "unknowns n",
                y_label: "time (s)",
                x_text: ten_to,
                y_text: ten_to,
                legend: curves.iter().map(|(label, _)| (label.clone(), style(label))).collect(),
                series: curves
                    .iter()
                    .map(|(label, points)| Series {
                        style: style(label),
                        points: points.iter().map(|p| (p.0.log10(), p.1.log10())).collect(),
                    })
                    .collect(),
            });
        }
    }
    let svg = picture(title, notes, &panels, &[]).map_err(|e| format!("{name}: {e}"))?;
    let rows = all.iter().flat_map(|panel| {
        panel.curves.iter().flat_map(move |(label, points)| {
            points.iter().map(move |(n, t)| {
                vec![panel.title.clone(), label.clone(), number(Some(*n)), number(Some(*t))]
            })
        })
    });
    let csv = table(["problem", "solver", "n", "seconds"], rows.collect());
    Ok(Figure { name: name.into(), title: title.into(), svg, csv })
}

/// Data profiles have at most this many panels.
const PANELS: usize = 4;
/// Parts of the problems for which the residual is shown.
const PARTS: [(f64, &str); 2] = [(0.5, "half"), (0.9, "nine tenths")];
/// Up to this ratio the axis of a performance profile doubles from tick to tick; beyond it grows tenfold.
const DOUBLING: f64 = 300.0;

struct Scene<'a> {
    runs: &'a Runs,
    selection: &'a Selection,
    styles: HashMap<&'a str, Style>,
    foreign: HashSet<&'a str>,
}

/// A curve in the units of the axes: logarithms where these are logarithmic.
struct Series {
    style: Style,
    points: Vec<(f64, f64)>,
}

struct Panel {
    title: String,
    x: Axis,
    y: Axis,
    x_label: &'static str,
    y_label: &'static str,
    x_text: fn(f64) -> String,
    y_text: fn(f64) -> String,
    series: Vec<Series>,
    /// Entries of a legend in the upper left corner, where curves that rise leave room.
    legend: Vec<(String, Style)>,
}

fn ten_to(x: f64) -> String {
    format!("1e{x:.0}")
}

impl<'a> Scene<'a> {
    fn new(runs: &'a Runs, selection: &'a Selection) -> Self {
        let mut styles: HashMap<&str, Style> = HashMap::new();
        for (k, solver) in runs.solvers().into_iter().enumerate() {
            if selection.solvers.is_empty() || selection.solvers.iter().any(|s| s == solver) {
                // Beyond 32 solvers looks repeat; then the next that is free in this selection.
                let mut looks = (k..k + LOOKS).map(Style::of);
                let free = looks.find(|look| styles.values().all(|used| used != look));
                styles.insert(solver, free.unwrap_or(Style::of(k)));
            }
        }
        let campaigns: HashSet<&str> =
            runs.campaigns.iter().filter(|c| c.foreign).map(|c| c.id.as_str()).collect();
        let foreign = runs.runs.iter().filter(|r| campaigns.contains(r.campaign.as_str()));
        Self { runs, selection, styles, foreign: foreign.map(|r| r.solver.as_str()).collect() }
    }

    fn style(&self, solver: &str) -> Style {
        self.styles.get(solver).copied().unwrap_or_else(Style::bound)
    }

    /// The entries of the legend, and what the marks in them mean.
    fn legend(&self, solvers: &[String]) -> (Vec<(String, Style)>, Vec<String>) {
        let entry = |s: &String| {
            let dagger = if self.foreign.contains(s.as_str()) { " †" } else { "" };
            (format!("{s}{dagger}"), self.style(s))
        };
        let mut sources: BTreeMap<&str, &str> = BTreeMap::new();
        if solvers.iter().any(|s| self.foreign.contains(s.as_str())) {
            let foreign = self.runs.campaigns.iter().filter(|c| c.foreign);
            sources.extend(foreign.map(|c| (c.program.as_str(), c.machine.cpu.as_str())));
        }
        let source = |(program, machine): (&str, &str)| {
            format!("† measured by others: {program} on {machine}, by its own error")
        };
        (solvers.iter().map(entry).collect(), sources.into_iter().map(source).collect())
    }

    fn series(&self, curves: &[Curve], x: &Axis, log: fn(f64) -> f64) -> Vec<Series> {
        let style = |c: &Curve| self.style(&c.solver);
        curves.iter().map(|c| Series { style: style(c), points: stairs(c, x, log) }).collect()
    }

    fn profile(&self, cost: Cost) -> Result<Option<Figure>, String> {
        let (costs, left_out) = Costs::of(self.runs, self.selection, cost).counted();
        let mut curves = performance(&costs);
        if curves.iter().all(|c| c.steps.is_empty()) {
            return Ok(None);
        }
        curves.insert(0, performance_of_best(&costs));
        let far = curves.iter().filter_map(|c| c.steps.last()).fold(2.0, |far, s| s.0.max(far));
        let doubling = far <= DOUBLING;
        let log: fn(f64) -> f64 = if doubling { f64::log2 } else { f64::log10 };
        let end = 1.03 * log(far);
        let x = Axis { range: 0.0..end, ticks: decades(0.0, end, 10) };
        let by = if cost == Cost::Seconds { "time" } else { cost.name() };
        let title = format!("Performance profile by {by}");
        let n = costs.problems.len();
        let mut notes = vec![format!(
            "share of {} solved to {:e} within τ times the best; failures never count as solved",
            plural(n, "problem"),
            self.selection.tolerance
        )];
        let missing: usize = costs.missing.iter().sum();
        if missing > 0 {
            notes.push(format!(
                "{missing} of {} pairs were not run and count as failures",
                n * costs.solvers.len()
            ));
        }
        let refused: usize = costs.refused.iter().sum();
        if refused > 0 {
            notes.push(format!(
                "{refused} of {} pairs were refused and count for nothing",
                n * costs.solvers.len()
            ));
        }
        notes.extend(without(&left_out, cost.name()));
        let panel = Panel {
            title: String::new(),
            series: self.series(&curves, &x, log),
            x,
            y: shares(),
            x_label: "τ: times the best",
            y_label: "share of problems",
            x_text: if doubling { |x| tick(x.exp2()) } else { tick_of_decade },
            y_text: tick,
            legend: vec![],
        };
        let mut rows = vec![];
        for curve in &curves {
            let start = (1.0, curve.at(1.0));
            let later = curve.steps.iter().copied().filter(|s| s.0 > 1.0);
            rows.extend(std::iter::once(start).chain(later).map(|(tau, share)| {
                vec![curve.solver.clone(), number(Some(tau)), number(Some(share))]
            }));
        }
        let name = format!("profile-{}", cost.name());
        let csv = table(["solver", "tau", "share"], rows);
        self.figure(name, title, notes, &with_best(&costs.solvers), &[panel], csv).map(Some)
    }

    fn data_profile(&self, progress: &Progress) -> Result<Option<Figure>, String> {
        let tolerances = self.runs.tolerances_of(&self.selection.kind);
        let step = tolerances.len().div_ceil(PANELS).max(1);
        let best = progress.best();
        let of = |&e: &f64| (e, [best.data_profile(e), progress.data_profile(e)].concat());
        let all: Vec<(f64, Vec<Curve>)> = tolerances.iter().rev().step_by(step).map(of).collect();
        let curves = all.iter().flat_map(|(_, curves)| curves);
        let Some(x) = seconds(curves) else { return Ok(None) };
        let panels: Vec<Panel> = all
            .iter()
            .rev()
            .map(|(e, curves)| Panel {
                title: format!("residual {e:e}"),
                x: x.clone(),
                y: shares(),
                x_label: "time (s)",
                y_label: "share of problems",
                x_text: ten_to,
                y_text: tick,
                legend: vec![],
                series: self.series(curves, &x, f64::log10),
            })
            .collect();
        let n = plural(progress.problems.len(), "problem");
        let mut notes =
            vec![format!("share of {n} on which the residual is reached within the time")];
        notes.extend(without(&progress.left_out, "residuals"));
        let mut rows = vec![];
        for (e, curves) in all.iter().rev() {
            rows.extend(cells(&number(Some(*e)), curves));
        }
        let csv = table(["residual", "solver", "seconds", "share"], rows);
        let solvers = with_best(&progress.solvers);
        self.figure("data-profile".into(), "Data profile".into(), notes, &solvers, &panels, csv)
            .map(Some)
    }

    fn success(&self) -> Result<Option<Figure>, String> {
        let (mut all, left_out) = crate::profile::success(self.runs, self.selection);
        if all.is_empty() {
            return Ok(None);
        }
        if all.len() == 2 {
            all.remove(0);
        }
        let x = Axis { range: 2.7..14.3, ticks: vec![4.0, 6.0, 8.0, 10.0, 12.0, 14.0] };
        let depths = DECADES.map(|e| -e.log10());
        let counted = self.selection.counted();
        let mut panels = vec![];
        let mut rows = vec![];
        for group in &all {
            let class = group.size.map_or("all sizes".into(), |s| format!("{} {counted}", s.name));
            // The virtual best goes below the others.
            let shares_of = group.shares.iter().rev();
            panels.push(Panel {
                title: format!("{class} ({})", plural(group.problems, "problem")),
                x: x.clone(),
                y: shares(),
                x_label: "tolerance",
                y_label: "share of problems",
                x_text: |x| format!("1e-{x:.0}"),
                y_text: tick,
                legend: vec![],
                series: shares_of
                    .map(|(solver, shares)| Series {
                        style: self.style(solver),
                        points: depths.into_iter().zip(*shares).collect(),
                    })
                    .collect(),
            });
            for (solver, shares) in &group.shares {
                let size = group.size.map_or("all", |s| s.name);
                rows.extend(DECADES.iter().zip(shares).map(|(e, share)| {
                    vec![
                        size.into(),
                        group.problems.to_string(),
                        solver.clone(),
                        number(Some(*e)),
                        number(Some(*share)),
                    ]
                }));
            }
        }
        let tolerances = self.runs.tolerances_of(&self.selection.kind);
        let tightest = tolerances.last().copied().unwrap_or(0.0);
        let mut notes = vec![format!(
            "share of problems with a smaller residual in any run; runs stop at their own tolerance, the tightest is {tightest:e}"
        )];
        notes.extend(without(&left_out, "residuals"));
        let csv = table(["size", "problems", "solver", "tolerance", "share"], rows);
        let shown = self.selection.solvers(self.runs).into_iter().map(String::from);
        let solvers: Vec<String> = shown.filter(|s| !left_out.contains(s)).collect();
        let title = "Success against tolerance".into();
        self.figure("success".into(), title, notes, &with_best(&solvers), &panels, csv).map(Some)
    }

    fn residual(&self, progress: &Progress) -> Result<Option<Figure>, String> {
        let best = progress.best();
        let of = |(part, what)| (what, [best.quantile(part), progress.quantile(part)].concat());
        let all: Vec<(&str, Vec<Curve>)> = PARTS.into_iter().map(of).collect();
        let curves = || all.iter().flat_map(|(_, curves)| curves);
        let Some(x) = seconds(curves()) else { return Ok(None) };
        let log = |r: f64| r.max(1e-16).log10();
        let heights = || curves().flat_map(|c| c.steps.iter().map(|s| log(s.1)));
        let low = heights().fold(f64::INFINITY, f64::min).floor() - 0.3;
        let high =
            (heights().fold(f64::NEG_INFINITY, f64::max) + 0.15).ceil().min(4.0).max(low + 1.0);
        let y = Axis { range: low..high, ticks: decades(low, high, 10) };
        let panels: Vec<Panel> = all
            .iter()
            .map(|(what, curves)| Panel {
                title: format!("{what} of the problems"),
                x: x.clone(),
                y: y.clone(),
                x_label: "time (s)",
                y_label: "residual",
                x_text: ten_to,
                y_text: ten_to,
                legend: vec![],
                series: curves
                    .iter()
                    .map(|c| {
                        let stairs = stairs(c, &x, f64::log10).into_iter();
                        let finite = stairs.filter(|p| p.1.is_finite());
                        let points = finite.map(|(t, r)| (t, log(r).min(high))).collect();
                        Series { style: self.style(&c.solver), points }
                    })
                    .collect(),
            })
            .collect();
        let n = plural(progress.problems.len(), "problem");
        let mut notes =
            vec![format!("the residual that is reached on so many of {n}, against time")];
        notes.extend(without(&progress.left_out, "residuals"));
        let mut rows = vec![];
        for ((part, _), (_, curves)) in PARTS.into_iter().zip(&all) {
            rows.extend(cells(&number(Some(part)), curves));
        }
        let csv = table(["part", "solver", "seconds", "residual"], rows);
        let solvers = with_best(&progress.solvers);
        let title = "Residual against time".into();
        self.figure("residual".into(), title, notes, &solvers, &panels, csv).map(Some)
    }

    fn figure(
        &self,
        name: String,
        title: String,
        mut notes: Vec<String>,
        solvers: &[String],
        panels: &[Panel],
        csv: String,
    ) -> Result<Figure, String> {
        let (legend, sources) = self.legend(solvers);
        notes.extend(sources);
        let svg = picture(&title, &notes, panels, &legend).map_err(|e| format!("{name}: {e}"))?;
        Ok(Figure { name, title, svg, csv })
    }
}

fn without(left_out: &[String], what: &str) -> Option<String> {
    (!left_out.is_empty()).then(|| format!("without {}: {what} not reported", left_out.join(", ")))
}

fn with_best(solvers: &[String]) -> Vec<String> {
    solvers.iter().cloned().chain([VIRTUAL_BEST.into()]).collect()
}

fn cells<'a>(first: &'a str, curves: &'a [Curve]) -> impl Iterator<Item = Vec<String>> + 'a {
    curves.iter().flat_map(move |curve| {
        let row = |(x, y): &(f64, f64)| {
            vec![first.to_owned(), curve.solver.clone(), number(Some(*x)), number(Some(*y))]
        };
        curve.steps.iter().map(row)
    })
}

fn table<const N: usize>(head: [&str; N], rows: Vec<Vec<String>>) -> String {
    Table { head: head.map(String::from).into(), rows }.csv()
}

fn shares() -> Axis {
    // A little room, so that a curve at 0 or 1 does not hide in the frame.
    Axis { range: -0.015..1.015, ticks: ticks(1.0, 5, 0.0) }
}

/// A logarithmic axis for the times of the curves.
fn seconds<'a>(curves: impl Iterator<Item = &'a Curve>) -> Option<Axis> {
    let times = curves.flat_map(|c| c.steps.iter().map(|s| s.0.max(Cost::Seconds.floor()).log10()));
    let (low, high) =
        times.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(t), h.max(t)));
    let (low, high) = ((low - 0.05).floor(), (high + 0.05).ceil());
    (low < high).then(|| Axis { range: low..high, ticks: decades(low, high, 9) })
}

fn tick_of_decade(x: f64) -> String {
    if x < 3.5 { tick(10f64.powf(x).round()) } else { ten_to(x) }
}

/// The corners of a step function within an axis. Of the steps that fall on one pixel the last is kept.
fn stairs(curve: &Curve, x: &Axis, log: fn(f64) -> f64) -> Vec<(f64, f64)> {
    let (from, to) = (x.range.start, x.range.end);
    let pixel = |x: f64| ((x - from) / (to - from) * 1000.0) as i64;
    let mut value = curve.before;
    let mut corners = vec![(from, value)];
    let inside = curve.steps.iter().map(|&(x, y)| (log(x.max(f64::MIN_POSITIVE)).max(from), y));
    let inside: Vec<_> = inside.filter(|(x, _)| *x <= to).collect();
    for (k, &(x, y)) in inside.iter().enumerate() {
        if inside.get(k + 1).is_none_or(|next| pixel(next.0) > pixel(x)) {
            corners.extend([(x, value), (x, y)]);
            value = y;
        }
    }
    corners.push((to, value));
    corners.dedup();
    corners
}

// ------------------------------------------------------------------------------------------------ drawing

const WIDTH: u32 = 960;
/// The height of a panel among several.
const HEIGHT: u32 = 290;
/// A single panel is as high as its legend, within these bounds.
const SINGLE: (u32, u32) = (430, 640);
const LINE: u32 = 18;
/// The width of a character of 12 px, near enough.
const CHARACTER: f64 = 6.4;
/// Longer labels are cut to this length.
const LABEL: usize = 38;
/// Marks along a curve.
const MARKED: usize = 7;

type Drawn = Result<(), Box<dyn std::error::Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The picture, as XML whatever its texts hold.
fn picture(
    title: &str,
    notes: &[String],
    panels: &[Panel],
    legend: &[(String, Style)],
) -> Result<String, Box<dyn std::error::Error>> {
    let mut svg = String::new();
    sheet(&mut svg, title, notes, panels, legend)?;
    // XML takes these in no form, not even escaped.
    let barred =
        |c: char| c.is_control() && !"\n\t".contains(c) || matches!(c, '\u{fffe}' | '\u{ffff}');
    Ok(svg.replace(barred, "\u{fffd}"))
}

/// Title and notes on top, panels side by side in rows, the legend on the right.
fn sheet(
    text: &mut String,
    title: &str,
    notes: &[String],
    panels: &[Panel],
    legend: &[(String, Style)],
) -> Drawn {
    let columns = panels.len().min(2);
    let rows = panels.len().div_ceil(columns.max(1)) as u32;
    let labels = cut(legend.iter().map(|(label, _)| label.as_str()));
    let longest = labels.iter().map(|l| l.chars().count()).max().unwrap_or(0);
    let legend_width = match longest {
        0 => 0,
        _ => 56 + (CHARACTER * longest as f64) as u32,
    };
    let head_height = 40 + LINE * notes.len() as u32;
    let legend_height = LINE * legend.len() as u32 + 30;
    let height = if panels.len() > 1 { HEIGHT } else { legend_height.clamp(SINGLE.0, SINGLE.1) };
    let body_height = (rows * height).max(legend_height);
    let size = (WIDTH.max(560 + legend_width), head_height + body_height);
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, body) = root.split_vertically(head_height);
    let left = Pos::new(HPos::Left, VPos::Center);
    head.draw_text(title, &font(16).pos(left), (62, 22))?;
    for (k, note) in (0..).zip(notes) {
        head.draw_text(note, &font(12).pos(left), (62, 42 + LINE as i32 * k))?;
    }
    let (charts, side) = body.split_horizontally(size.0 - legend_width);
    for (k, (label, (_, style))) in (0..).zip(labels.iter().zip(legend)) {
        let y = 16 + LINE as i32 * k;
        line(&side, &[(4, y), (36, y)], *style)?;
        side.draw_text(label, &font(12).pos(left), (43, y))?;
    }
    let (charts, _) = charts.split_vertically(rows * height);
    for (area, panel) in charts.split_evenly((rows as usize, columns)).iter().zip(panels) {
        panel.draw(area)?;
    }
    root.present()?;
    Ok(())
}

/// Labels with the middle of the long ones cut out, as both ends tell them apart; what is then alike is numbered.
fn cut<'a>(all: impl Iterator<Item = &'a str>) -> Vec<String> {
    let short = |label: &str| -> String {
        let n = label.chars().count();
        let part = if n > LABEL { LABEL / 2 } else { n };
        let end = label.chars().skip(part.max(n - part));
        let gap = (n > LABEL).then_some('…');
        label.chars().take(part).chain(gap).chain(end).collect()
    };
    let mut labels: Vec<String> = vec![];
    for label in all {
        let free = names(short(label)).find(|name| !labels.contains(name));
        labels.extend(free);
    }
    labels
}

/// A curve in pixels, with its marks.
fn line(area: &Area, points: &[(i32, i32)], style: Style) -> Drawn {
    let stroke = style.colour.stroke_width(style.width);
    match style.dash {
        Some((dash, gap)) => {
            area.draw(&DashedPathElement::new(points.iter().copied(), dash, gap, stroke))?;
        }
        None => area.draw(&PathElement::new(points.to_vec(), stroke))?,
    }
    let Some(mark) = style.mark else { return Ok(()) };
    for place in places(points, style.shift) {
        match mark {
            Mark::Dot => area.draw(&Circle::new(place, 4, style.colour.filled()))?,
            Mark::Triangle => area.draw(&TriangleMarker::new(place, 6, style.colour.filled()))?,
            Mark::Cross => area.draw(&Cross::new(place, 4, stroke))?,
        }
    }
    Ok(())
}

/// Where the marks stand: evenly along the curve, so that they keep apart where it is steep.
fn places(points: &[(i32, i32)], shift: u8) -> Vec<(i32, i32)> {
    let length = |a: &(i32, i32), b: &(i32, i32)| f64::from(b.0 - a.0).hypot(f64::from(b.1 - a.1));
    let total: f64 = points.windows(2).map(|w| length(&w[0], &w[1])).sum();
    // A short line, as in the legend, has one in the middle.
    let (n, first) = match total < 100.0 {
        true => (1, 0.5),
        false => (MARKED, (f64::from(shift) + 0.5) / 8.0),
    };
    let (mut found, mut walked) = (vec![], 0.0);
    for w in points.windows(2) {
        let step = length(&w[0], &w[1]);
        while found.len() < n {
            let ahead = total * (found.len() as f64 + first) / n as f64 - walked;
            if ahead > step || step == 0.0 {
                break;
            }
            let part = |a: i32, b: i32| a + (f64::from(b - a) * ahead / step).round() as i32;
            found.push((part(w[0].0, w[1].0), part(w[0].1, w[1].1)));
        }
        walked += step;
    }
    found
}

impl Panel {
    fn draw(&self, area: &Area) -> Drawn {
        let mut chart = ChartBuilder::on(area)
            .margin_right(14)
            .margin_left(6)
            .margin_top(if self.title.is_empty() { 8 } else { 26 })
            .margin_bottom(8)
            .x_label_area_size(42)
            .y_label_area_size(56)
            .build_cartesian_2d(self.x.clone(), self.y.clone())?;
        chart
            .configure_mesh()
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .axis_style(INK)
            .label_style(font(12))
            .axis_desc_style(font(13))
            .x_label_formatter(&|x| (self.x_text)(*x))
            .y_label_formatter(&|y| (self.y_text)(*y))
            .x_desc(self.x_label)
            .y_desc(self.y_label)
            .draw()?;
        let title = font(13).pos(Pos::new(HPos::Left, VPos::Center));
        area.draw_text(&self.title, &title, (62, 14))?;
        // Dashes go on top of solid lines, so that none hides another.
        let base = area.get_base_pixel();
        let (solid, dashed): (Vec<_>, Vec<_>) =
            self.series.iter().partition(|s| s.style.dash.is_none());
        for series in solid.into_iter().chain(dashed) {
            let pixel = |p: &(f64, f64)| {
                let (x, y) = chart.backend_coord(p);
                (x - base.0, y - base.1)
            };
            let points: Vec<_> = series.points.iter().map(pixel).collect();
            if points.len() > 1 {
                line(area, &points, series.style)?;
            }
        }
        let left = Pos::new(HPos::Left, VPos::Center);
        for (k, (label, style)) in (0..).zip(&self.legend) {
            let y = 42 + 17 * k;
            line(area, &[(74, y), (100, y)], *style)?;
            area.draw_text(label, &font(12).pos(left), (107, y))?;
        }
        Ok(())
    }
}
