//! A problem as a picture: where its matrices have entries, and of contacts how large the impulses are and where they lie in their cones.

use nonsmooth_bench::draw::{Axis, GRID, INK, font, tick, ticks};
use nonsmooth_problem::check::Motion;
use nonsmooth_problem::field::Field;
use nonsmooth_problem::{
    AnyPoint, AnyProblem, AnyStatus, Friction, Problem, Stated, with_complementarity, with_friction,
};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{BEST, Drawn, TOLERANCE};
use crate::kinds::start_of;

/// The width and height of a panel, px.
const PANEL: (u32, u32) = (420, 420);
/// The height of a title of one line, px, and what each further line adds.
const TITLE: u32 = 56;
const LINE: u32 = 20;
/// The width of a character of the title, px, a little more than the mean.
const CHARACTER: u32 = 7;
/// Cells of a panel's side in which the entries of a larger matrix are gathered.
const CELLS: usize = 150;
const OPEN: RGBColor = RGBColor(139, 148, 158);
const BARS: usize = 24;

/// A solution, for the panels of the impulses.
pub struct Solution<'a> {
    /// The point.
    pub point: &'a AnyPoint,
    /// What each contact does.
    pub statuses: &'a [AnyStatus],
    /// Where it comes from, and whether it passes.
    pub says: &'a str,
}

/// Draws a problem, and a solution if there is one, as a standalone SVG.
pub fn svg(
    title: &str,
    problem: &AnyProblem,
    solution: Option<&Solution>,
) -> Result<String, String> {
    let mut text = String::new();
    draw(&mut text, title, problem, solution).map_err(|e| format!("draw: {e}"))?;
    Ok(text)
}

/// The places of a matrix's entries.
struct Spy {
    name: &'static str,
    rows: usize,
    columns: usize,
    /// Row and column.
    entries: Vec<(usize, usize)>,
    /// What rows and columns are.
    counts: String,
}

/// The impulse of a contact.
struct Impulse {
    normal: f64,
    /// `r_T / (mu r_N)`; none without friction or normal impulse.
    part: Option<Vec<f64>>,
    motion: Motion,
}

fn draw(
    text: &mut String,
    title: &str,
    problem: &AnyProblem,
    solution: Option<&Solution>,
) -> Drawn {
    let spies = spies(problem);
    let impulses = match (problem, solution) {
        (AnyProblem::Friction(problem), Some(solution)) => impulses(problem, solution),
        _ => vec![],
    };
    let panels = spies.len() + if impulses.is_empty() { 0 } else { 2 };
    let columns = panels.min(if panels == 4 { 2 } else { 3 });
    let rows = panels.div_ceil(columns);
    let width = PANEL.0 * columns as u32;
    let title = lines(title, ((width - 2 * 24) / CHARACTER) as usize);
    let more = LINE * (title.len() as u32).saturating_sub(1);
    let size = (width, TITLE + more + PANEL.1 * rows as u32);
    let whole = SVGBackend::with_string(text, size).into_drawing_area();
    whole.fill(&WHITE)?;
    let (head, body) = whole.split_vertically(TITLE + more);
    let left = Pos::new(HPos::Left, VPos::Center);
    for (k, line) in (0..).zip(&title) {
        head.draw_text(line, &font(16).pos(left), (24, 22 + LINE as i32 * k))?;
    }
    if let Some(solution) = solution {
        head.draw_text(solution.says, &font(13).pos(left), (24, 44 + more as i32))?;
    }
    let areas = body.split_evenly((rows, columns));
    let mut areas = areas.iter();
    for (spy, area) in spies.iter().zip(areas.by_ref()) {
        spy.draw(area)?;
    }
    if let (false, Some(first), Some(second)) = (impulses.is_empty(), areas.next(), areas.next()) {
        histogram(first, &impulses)?;
        match problem.kind().dimension() {
            2 => cone(second, &impulses)?,
            _ => disk(second, &impulses)?,
        }
    }
    whole.present()?;
    Ok(())
}

/// A text in lines of at most so many characters, broken between words.
fn lines(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

fn spies(problem: &AnyProblem) -> Vec<Spy> {
    let sparse = |name, a: &nonsmooth_linalg::Csc| Spy {
        name,
        rows: a.nrows(),
        columns: a.ncols(),
        entries: a.triplets().filter(|t| t.2 != 0.0).map(|t| (t.0, t.1)).collect(),
        counts: format!("{} × {}", a.nrows(), a.ncols()),
    };
    fn blocks<const D: usize>(w: &nonsmooth_linalg::Bsr<D>) -> Spy {
        let row = |i: usize| w.row(i).0.iter().map(move |&j| (i, j as usize));
        let counts = format!("{0} × {0} blocks of {D} × {D}, one a contact", w.nrows());
        let entries = (0..w.nrows()).flat_map(row).collect();
        Spy { name: "W", rows: w.nrows(), columns: w.ncols(), entries, counts }
    }
    let any = |name, a: &nonsmooth_linalg::Matrix| {
        let mut entries = vec![];
        a.for_each(|i, j, x| {
            if x != 0.0 {
                entries.push((i, j));
            }
        });
        let counts = format!("{} × {}", a.nrows(), a.ncols());
        Spy { name, rows: a.nrows(), columns: a.ncols(), entries, counts }
    };
    match problem {
        AnyProblem::Friction(Friction::Local2(p)) => vec![blocks(&p.W)],
        AnyProblem::Friction(Friction::Local3(p)) => vec![blocks(&p.W)],
        AnyProblem::Friction(Friction::RollingLocal(p)) => vec![blocks(&p.W)],
        AnyProblem::Friction(Friction::Global2(p)) => vec![sparse("M", &p.M), sparse("H", &p.H)],
        AnyProblem::Friction(Friction::Global3(p)) => vec![sparse("M", &p.M), sparse("H", &p.H)],
        AnyProblem::Friction(Friction::RollingGlobal(p)) => {
            vec![sparse("M", &p.M), sparse("H", &p.H)]
        }
        AnyProblem::Complementarity(p) => {
            let (matrices, function) = with_complementarity!(p, p => (p.matrices(), p.function()));
            let matrices = matrices.into_iter().map(|(name, m)| any(name, m));
            let spy = |f| jacobian(f, &start_of(problem));
            matrices.chain(function.map(spy)).collect()
        }
    }
}

/// Where the Jacobian is not zero at the start; where it is not defined there, all its places.
fn jacobian(field: &dyn Field, start: &[f64]) -> Spy {
    let (n, pattern) = (field.dim(), field.pattern());
    let mut values = vec![0.0; pattern.len()];
    let defined = field.evaluator().jacobian(start, &mut vec![0.0; n], &mut values);
    let places = pattern.places().zip(&values).filter(|(_, x)| !defined || **x != 0.0);
    let at = if defined { "at the start" } else { "undefined at the start: its places" };
    Spy {
        name: "Jacobian of F",
        rows: n,
        columns: n,
        entries: places.map(|(place, _)| place).collect(),
        counts: format!("{n} × {n}, {at}"),
    }
}

fn impulses(problem: &Friction, solution: &Solution) -> Vec<Impulse> {
    let (AnyPoint::Local(nonsmooth_problem::LocalPoint { r, .. })
    | AnyPoint::Global(nonsmooth_problem::GlobalPoint { r, .. })) = solution.point
    else {
        return vec![];
    };
    let mu: &[f64] = with_friction!(problem, p => &p.mu);
    let each = r.chunks(problem.kind().dimension()).zip(mu).zip(solution.statuses);
    each.map(|((r, &mu), status)| {
        let normal = r[0];
        let reach = mu * normal;
        let motion = match status {
            AnyStatus::Contact(contact) => contact.status,
            AnyStatus::Row(_) | AnyStatus::Set(_) => Motion::Open,
        };
        // What rounding leaves at an open contact is no impulse.
        // Moments are drawn nowhere.
        let tangential = &r[1..r.len().min(3)];
        let part = (reach > 0.0 && motion != Motion::Open)
            .then(|| tangential.iter().map(|t| t / reach).collect());
        Impulse { normal, part, motion }
    })
    .collect()
}

fn colour(motion: Motion) -> RGBColor {
    match motion {
        Motion::Open => OPEN,
        Motion::Stick => BEST,
        Motion::Slip => TOLERANCE,
    }
}

impl Spy {
    /// Filled cells, row by row; an entry is at least a cell.
    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn
    where
        DB::ErrorType: 'static,
    {
        const ROOM: (i32, i32) = (24, 40);
        let room = (PANEL.0 as i32 - 2 * ROOM.0, PANEL.1 as i32 - ROOM.1 - 24);
        let scale = (f64::from(room.0) / self.columns.max(1) as f64)
            .min(f64::from(room.1) / self.rows.max(1) as f64);
        // A panel is not drawn so flat or narrow that nothing can be seen.
        let side = |n: usize, most: i32| ((scale * n as f64).max(12.0) as i32).min(most);
        let (width, height) = (side(self.columns, room.0), side(self.rows, room.1));
        let share = self.entries.len() as f64 / (self.rows * self.columns).max(1) as f64;
        let title = format!("{}: {}, {}% filled", self.name, self.counts, percent(share));
        area.draw_text(&title, &font(13).pos(Pos::new(HPos::Left, VPos::Center)), (ROOM.0, 20))?;
        let cells = (self.rows.min(CELLS), self.columns.min(CELLS));
        let mut filled = vec![false; cells.0 * cells.1];
        for &(i, j) in &self.entries {
            filled[i * cells.0 / self.rows * cells.1 + j * cells.1 / self.columns] = true;
        }
        let at = |k: usize, of: usize, size: i32| {
            (k as f64 / of as f64 * f64::from(size)).round() as i32
        };
        for (i, row) in filled.chunks(cells.1.max(1)).enumerate() {
            let (top, bottom) = (at(i, cells.0, height), at(i + 1, cells.0, height));
            let mut j = 0;
            for run in row.chunk_by(|a, b| a == b) {
                if run[0] {
                    let (left, right) = (at(j, cells.1, width), at(j + run.len(), cells.1, width));
                    let corners = [
                        (ROOM.0 + left, ROOM.1 + top),
                        (ROOM.0 + right.max(left + 1), ROOM.1 + bottom.max(top + 1)),
                    ];
                    area.draw(&Rectangle::new(corners, INK.filled()))?;
                }
                j += run.len();
            }
        }
        let frame = [(ROOM.0 - 1, ROOM.1 - 1), (ROOM.0 + width + 1, ROOM.1 + height + 1)];
        area.draw(&Rectangle::new(frame, OPEN.stroke_width(1)))?;
        Ok(())
    }
}

fn percent(share: f64) -> String {
    let x = 100.0 * share;
    if x >= 10.0 { format!("{x:.0}") } else { format!("{x:.2}") }
}

/// The numbers of contacts by status, in their colours.
fn legend<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    title: &str,
    impulses: &[Impulse],
    which: &[(Motion, &str)],
) -> Drawn
where
    DB::ErrorType: 'static,
{
    let left = Pos::new(HPos::Left, VPos::Center);
    area.draw_text(title, &font(13).pos(left), (24, 20))?;
    let mut x = 24;
    for &(motion, name) in which {
        let count = impulses.iter().filter(|i| i.motion == motion).count();
        area.draw(&Circle::new((x + 5, 40), 4, colour(motion).filled()))?;
        let text = format!("{count} {name}");
        area.draw_text(&text, &font(12).pos(left), (x + 14, 40))?;
        x += 34 + 7 * text.len() as i32;
    }
    Ok(())
}

type Chart<'a, DB> = ChartContext<'a, DB, Cartesian2d<Axis, Axis>>;

/// The two axes of a panel with their labels; `x_text` is what stands at a tick to the right.
fn chart<'a, DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    [x, y]: [Axis; 2],
    [x_label, y_label]: [&str; 2],
    x_text: &dyn Fn(&f64) -> String,
) -> Result<Chart<'a, DB>, DrawingAreaErrorKind<DB::ErrorType>> {
    let mut chart = ChartBuilder::on(area)
        .margin_right(24)
        .margin_left(4)
        .margin_bottom(8)
        .x_label_area_size(40)
        .y_label_area_size(52)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .label_style(font(12))
        .axis_desc_style(font(13))
        .x_label_formatter(x_text)
        .y_label_formatter(&|y| tick(*y))
        .x_desc(x_label)
        .y_desc(y_label)
        .draw()?;
    Ok(chart)
}

/// How many contacts have a normal impulse of which size, in units of the mean of those that are closed.
fn histogram<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, impulses: &[Impulse]) -> Drawn
where
    DB::ErrorType: 'static,
{
    let closed: Vec<&Impulse> =
        impulses.iter().filter(|i| i.normal > 0.0 && i.motion != Motion::Open).collect();
    let mean = closed.iter().map(|i| i.normal).sum::<f64>() / closed.len().max(1) as f64;
    let names = [(Motion::Stick, "stick"), (Motion::Slip, "slip"), (Motion::Open, "open")];
    legend(area, &format!("Normal impulses, mean {mean:.3e} N s"), impulses, &names)?;
    let (_, body) = area.split_vertically(54);
    let end = closed.iter().map(|i| i.normal / mean).fold(1.0, f64::max) * 1.0001;
    let mut counts = [[0_usize; 2]; BARS];
    for i in &closed {
        let bar = ((i.normal / mean / end * BARS as f64) as usize).min(BARS - 1);
        counts[bar][usize::from(i.motion == Motion::Slip)] += 1;
    }
    let most = counts.iter().map(|c| c[0] + c[1]).max().unwrap_or(0).max(1) as f64;
    let axes = [
        Axis { range: 0.0..end, ticks: ticks(end, 6, 0.0) },
        Axis { range: 0.0..1.05 * most, ticks: ticks(most, 6, 1.0) },
    ];
    let mut chart = chart(&body, axes, ["normal impulse / mean", "contacts"], &|x| tick(*x))?;
    let width = end / BARS as f64;
    for (k, [stick, slip]) in counts.iter().enumerate() {
        let (left, right) = (k as f64 * width, (k as f64 + 0.92) * width);
        let middle = *stick as f64;
        let top = middle + *slip as f64;
        for (low, high, motion) in [(0.0, middle, Motion::Stick), (middle, top, Motion::Slip)] {
            if high > low {
                let bar = Rectangle::new([(left, low), (right, high)], colour(motion).filled());
                chart.draw_series(std::iter::once(bar))?;
            }
        }
    }
    Ok(())
}

/// The statuses that have a place in a cone.
const CLOSED: [(Motion, &str); 2] =
    [(Motion::Stick, "stick"), (Motion::Slip, "slip: at the limit")];

/// In space: the tangential impulses over their largest size, in the unit disk.
fn disk<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, impulses: &[Impulse]) -> Drawn
where
    DB::ErrorType: 'static,
{
    legend(area, "Friction cones from above: r_T / (mu r_N)", impulses, &CLOSED)?;
    const CENTRE: (i32, i32) = (PANEL.0 as i32 / 2, 54 + (PANEL.1 as i32 - 54) / 2 - 4);
    const RADIUS: i32 = 160;
    for (radius, style) in [(RADIUS, INK.stroke_width(1)), (RADIUS / 2, GRID.stroke_width(1))] {
        area.draw(&Circle::new(CENTRE, radius, style))?;
    }
    for [a, b] in [[(-RADIUS, 0), (RADIUS, 0)], [(0, -RADIUS), (0, RADIUS)]] {
        let line = [(CENTRE.0 + a.0, CENTRE.1 + a.1), (CENTRE.0 + b.0, CENTRE.1 + b.1)];
        area.draw(&PathElement::new(line, GRID.stroke_width(1)))?;
    }
    for (motion, part) in parts(impulses) {
        let [s, t] = part else { continue };
        let at = |x: f64| (x.clamp(-1.1, 1.1) * f64::from(RADIUS)).round() as i32;
        let place = (CENTRE.0 + at(*s), CENTRE.1 - at(*t));
        area.draw(&Circle::new(place, dot(impulses), colour(motion).filled()))?;
    }
    Ok(())
}

/// In the plane: the cone itself, upright, each impulse at the height of its normal part.
fn cone<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, impulses: &[Impulse]) -> Drawn
where
    DB::ErrorType: 'static,
{
    legend(area, "Friction cone, r_T over mu", impulses, &CLOSED)?;
    let (_, body) = area.split_vertically(54);
    let top = impulses.iter().map(|i| i.normal).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let axes = [
        Axis { range: -1.08..1.08, ticks: vec![-1.0, -0.5, 0.0, 0.5, 1.0] },
        Axis { range: 0.0..1.05, ticks: vec![0.0, 0.25, 0.5, 0.75, 1.0] },
    ];
    let mut chart =
        chart(&body, axes, ["r_T / mu, in units of the largest r_N", "r_N"], &|x| format!("{x}"))?;
    let sides = vec![(-1.0, 1.0), (0.0, 0.0), (1.0, 1.0)];
    chart.draw_series(std::iter::once(PathElement::new(sides, INK.stroke_width(1))))?;
    let size = dot(impulses);
    for i in impulses {
        let Some(part) = &i.part else { continue };
        let height = i.normal / top;
        let place = (part[0].clamp(-1.08, 1.08) * height, height);
        chart.draw_series(std::iter::once(Circle::new(place, size, colour(i.motion).filled())))?;
    }
    Ok(())
}

fn parts(impulses: &[Impulse]) -> impl Iterator<Item = (Motion, &[f64])> {
    // Sliding contacts last, so that none of the few is hidden.
    let of = |slip: bool| {
        let these = impulses.iter().filter(move |i| (i.motion == Motion::Slip) == slip);
        these.filter_map(|i| Some((i.motion, i.part.as_deref()?)))
    };
    of(false).chain(of(true))
}

/// The radius of a contact's mark, px.
fn dot(impulses: &[Impulse]) -> i32 {
    match impulses.len() {
        ..100 => 4,
        100..1000 => 3,
        _ => 2,
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::check::Judged;
    use nonsmooth_problem::planted::{Planted, PlantedLcp};

    use super::*;

    fn picture(problem: &AnyProblem, point: Option<AnyPoint>) -> String {
        let verdict = point.as_ref().map(|point| problem.judge(point, 1e-8).unwrap());
        let solution = point.as_ref().zip(verdict.as_ref()).map(|(point, verdict)| Solution {
            point,
            statuses: &verdict.statuses,
            says: "stored",
        });
        let svg = svg("a <b>", problem, solution.as_ref()).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("a &lt;b&gt;") && !svg.contains("NaN"));
        svg
    }

    #[test]
    fn every_kind_is_drawn() {
        let planted = Planted { contacts: 5, dofs: 24, ..Planted::default() };
        let (problem, point) = planted.local::<2>();
        let svg = picture(&problem.into(), Some(point.into()));
        assert!(svg.contains("W: 5 × 5 blocks") && svg.contains("Friction cone, r_T over mu"));
        let (problem, point) = planted.global::<3>();
        let problem = AnyProblem::from(problem);
        let svg = picture(&problem, Some(point.into()));
        assert!(
            svg.contains("M: 24 × 24") && svg.contains("H: 24 × 15") && svg.contains("from above")
        );
        // Nothing has an impulse.
        picture(&problem, Some(problem.origin()));
        assert!(!picture(&problem, None).contains("Normal impulses"));
        assert!(picture(&PlantedLcp::default().lcp().0.into(), None).contains("M: "));
        // At the start 0 the second row has one entry, x1 being a factor; the first is not defined in the second problem.
        for (texts, said) in [
            (["x1 + x2", "x1*x2 + x2"], "Jacobian of F: 2 × 2, at the start, 75% filled"),
            (["log(x1)", "x1*x2"], "undefined at the start: its places, 75% filled"),
        ] {
            let f = nonsmooth_problem::field::Expressions::parse(&texts.map(String::from), &[]);
            let problem = nonsmooth_problem::Mcp::ncp(f.unwrap(), vec![0.0; 2]).unwrap();
            let svg = picture(&problem.into(), None);
            assert!(svg.contains(said), "{svg}");
        }
    }

    #[test]
    fn a_long_title_is_broken_between_words() {
        assert_eq!(lines("one two three", 7), ["one two", "three"]);
        assert_eq!(lines("one  twentytwo a b", 6), ["one", "twentytwo", "a b"]);
        assert!(lines("", 6).is_empty());
        let problem = AnyProblem::from(PlantedLcp::default().lcp().0);
        let svg = svg(&"word ".repeat(30), &problem, None).unwrap();
        let longest = svg.lines().filter(|l| l.starts_with("word")).map(str::len).max();
        assert!(longest.is_some_and(|n| n <= 53), "{svg}");
    }

    #[test]
    fn a_dense_matrix_makes_a_small_picture() {
        let n = 400;
        let full = nonsmooth_linalg::Dense::from_fn(n, n, |_, _| 1.0);
        let problem = nonsmooth_problem::Lcp::new(full, vec![1.0; n]).unwrap();
        let svg = picture(&problem.into(), None);
        assert!(svg.contains("100% filled") && svg.len() < 50_000, "{}", svg.len());
    }
}
