//! The history of a solve as a picture, and below it what the method recorded.

pub mod problem;
pub mod scene;
mod trace;

use nonsmooth_bench::draw::{Axis, GRID, INK, decades, font, tick, ticks};
use nonsmooth_solve::Sample;
use nonsmooth_solve::trace::Trace;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

const SIZE: (u32, u32) = (960, 380);
const RESIDUAL: RGBColor = RGBColor(143, 184, 212);
const BEST: RGBColor = RGBColor(31, 111, 168);
const TOLERANCE: RGBColor = RGBColor(209, 80, 47);
/// The dashes of the tolerance and the gaps between them, px.
const DASHES: (i32, i32) = (6, 4);
/// Points that a curve keeps: about two for each pixel.
const KEPT: usize = 800;
/// Samples that are so near, as a part of the panel's width, are joined whatever lies between them.
const NEAR: f64 = 0.03;
/// Of so many samples each has a mark.
const MARKED: usize = 80;
/// Decades that a picture shows at most.
const DEPTH: f64 = 20.0;

/// Draws the relative residual against iterations and against time, two panels side by side, as a standalone SVG; below them
/// two panels of the method's record, if there is one.
pub fn svg(
    title: &str,
    history: &[Sample],
    trace: &Trace,
    tolerance: f64,
) -> Result<String, String> {
    let mut text = String::new();
    draw(&mut text, title, history, trace, tolerance).map_err(|e| format!("plot: {e}"))?;
    Ok(text)
}

type Drawn = Result<(), Box<dyn std::error::Error>>;

fn draw(
    text: &mut String,
    title: &str,
    history: &[Sample],
    trace: &Trace,
    tolerance: f64,
) -> Drawn {
    let recorded = trace::panels(trace);
    let (width, height) = SIZE;
    let below = if recorded.is_some() { trace::HEIGHT } else { 0 };
    let whole = SVGBackend::with_string(text, (width, height + below)).into_drawing_area();
    whole.fill(&WHITE)?;
    let (root, record) = whole.split_vertically(height);
    let curves = Curves::new(history, tolerance);
    let notes = curves.notes();
    let (head, body) = root.split_vertically(36 + 18 * notes.len() as u32);
    let left = Pos::new(HPos::Left, VPos::Center);
    head.draw_text(title, &font(15).pos(left), (66, 20))?;
    let legend = [("residual", RESIDUAL), ("best so far", BEST), ("tolerance", TOLERANCE)];
    for (k, (what, colour)) in legend.into_iter().enumerate() {
        let x = SIZE.0 as i32 - 330 + 110 * k as i32;
        let line = [(x, 20), (x + 20, 20)];
        if colour == TOLERANCE {
            let (dash, gap) = DASHES;
            let dashed = DashedPathElement::new(line, dash, gap, colour);
            head.draw(&dashed)?;
        } else {
            head.draw(&PathElement::new(line, colour.stroke_width(2)))?;
        }
        head.draw_text(what, &font(12).pos(left), (x + 26, 20))?;
    }
    for (k, note) in (0..).zip(&notes) {
        head.draw_text(note, &font(12).pos(left), (66, 40 + 18 * k))?;
    }
    let (left, right) = body.split_horizontally(SIZE.0 / 2);

    let end = history.last().map_or(0.0, |s| s.seconds);
    let (unit, scale) = match end {
        t if t < 1e-3 => ("time (µs)", 1e6),
        t if t < 1.0 => ("time (ms)", 1e3),
        _ => ("time (s)", 1.0),
    };
    curves.panel(&left, "iterations", true, |s| s.iteration as f64)?;
    curves.panel(&right, unit, false, |s| scale * s.seconds)?;
    if let Some([left_panel, right_panel]) = recorded {
        let (left, right) = record.split_horizontally(width / 2);
        left_panel.draw(&left)?;
        right_panel.draw(&right)?;
    }
    whole.present()?;
    Ok(())
}

/// What both panels show, heights as decimal logarithms.
struct Curves<'a> {
    history: &'a [Sample],
    tolerance: f64,
    low: f64,
    high: f64,
}

impl<'a> Curves<'a> {
    fn new(history: &'a [Sample], tolerance: f64) -> Self {
        let tolerance = tolerance.log10();
        let heights = history.iter().map(|s| s.relative.log10());
        let finite = || heights.clone().filter(|h| h.is_finite());
        let high = (finite().fold(tolerance + 1.0, f64::max) + 0.15).ceil();
        let low = finite().fold(tolerance, f64::min).max(high - DEPTH);
        // A little room below the lowest curve.
        let low = (low - 0.3).floor().min(tolerance.floor().max(high - DEPTH));
        Self { history, tolerance, low, high }
    }

    /// The height of a residual: at the lower edge if it is zero or far below, none if it is not finite.
    fn height(&self, residual: f64) -> Option<f64> {
        let known = residual.is_finite() && residual >= 0.0;
        known.then(|| residual.log10().max(self.low))
    }

    /// What the curves cannot show.
    fn notes(&self) -> Vec<String> {
        let count =
            |is: &dyn Fn(f64) -> bool| self.history.iter().filter(|s| is(s.relative)).count();
        let zero = count(&|r| r == 0.0);
        let below = count(&|r| r > 0.0 && r.log10() < self.low);
        let unknown = count(&|r| !(r.is_finite() && r >= 0.0));
        let points = |n: usize| crate::report::count(n, "point");
        let mut notes = vec![];
        if self.history.is_empty() {
            notes.push("no residual: nothing was judged".into());
        }
        if zero + below > 0 {
            let what = match (zero, below) {
                (z, 0) => format!("{} with residual 0", points(z)),
                (0, b) => format!("{} below the picture", points(b)),
                (z, b) => format!("{} with residual 0 and {b} below the picture", points(z)),
            };
            notes.push(format!("at the lower edge: {what}"));
        }
        if unknown > 0 {
            let all = if unknown == self.history.len() { "no finite residual: " } else { "" };
            notes.push(format!("{all}{} not shown, NaN or infinite", points(unknown)));
        }
        notes
    }

    fn panel<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, plotters::coord::Shift>,
        x_label: &str,
        first: bool,
        x: impl Fn(&Sample) -> f64,
    ) -> Result<(), Box<dyn std::error::Error>>
    where
        DB::ErrorType: 'static,
    {
        let points: Vec<_> = self.history.iter().map(|s| (x(s), self.height(s.relative))).collect();
        let end = points.last().map_or(0.0, |p| p.0);
        let end = if end > 0.0 { end } else { 1.0 };
        // Iterations are whole.
        let least = if first { 1.0 } else { 0.0 };
        let x_axis = Axis { range: 0.0..1.02 * end, ticks: ticks(end, 8, least) };
        let y_axis = Axis { range: self.low..self.high, ticks: decades(self.low, self.high, 10) };
        let mut chart = ChartBuilder::on(area)
            .margin_right(24)
            .margin_left(if first { 6 } else { 18 })
            .margin_bottom(8)
            .x_label_area_size(42)
            .y_label_area_size(if first { 58 } else { 40 })
            .build_cartesian_2d(x_axis, y_axis)?;
        let mut mesh = chart.configure_mesh();
        mesh.bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .axis_style(INK)
            .label_style(font(12))
            .axis_desc_style(font(13))
            .x_label_formatter(&|x| tick(*x))
            .y_label_formatter(&|y| format!("1e{y:.0}"))
            .x_desc(x_label);
        if first {
            mesh.y_desc("relative residual");
        }
        mesh.draw()?;

        let right = 1.02 * end;
        let line = [(0.0, self.tolerance), (right, self.tolerance)];
        let (dash, gap) = DASHES;
        chart.draw_series(DashedLineSeries::new(line, dash, gap, TOLERANCE.stroke_width(1)))?;

        // The residual, in pieces where nobody looked or it was not finite; marks say where somebody did.
        let known =
            points.iter().zip(self.history).filter_map(|(&(x, h), s)| Some((x, h?, s.iteration)));
        let known: Vec<_> = known.collect();
        for piece in pieces(&known, end, first) {
            let alone = piece.len() == 1;
            let piece = thinned(&piece, end);
            if alone || points.len() <= MARKED {
                let dot = |&p: &(f64, f64)| Circle::new(p, 2, RESIDUAL.filled());
                chart.draw_series(piece.iter().map(dot))?;
            }
            chart.draw_series(LineSeries::new(piece, RESIDUAL.stroke_width(1)))?;
        }
        let best = best(&points);
        chart.draw_series(LineSeries::new(stairs(&thinned(&best, end)), BEST.stroke_width(2)))?;
        // The point that is returned; the whole history where it is a single point.
        let last = best.iter().find(|p| Some(p.1) == best.last().map(|b| b.1));
        chart.draw_series(last.map(|&p| Circle::new(p, 3, BEST.filled())))?;
        Ok(())
    }
}

/// Samples that are joined by lines: `(x, height, iteration)` without the iterations. Where samples are far apart and steps lie between them, or, by time, a step
/// took much longer than most (a stage of `auto` that the judge did not see), a line would show what nobody knows.
fn pieces(samples: &[(f64, f64, usize)], end: f64, by_iterations: bool) -> Vec<Vec<(f64, f64)>> {
    let mut gaps: Vec<f64> = samples.windows(2).map(|w| w[1].0 - w[0].0).collect();
    gaps.sort_by(f64::total_cmp);
    let usual = gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
    let joined = |a: &(f64, f64, usize), b: &(f64, f64, usize)| {
        let gap = b.0 - a.0;
        let next = b.2 <= a.2 + 1;
        gap <= NEAR * end || (next && (by_iterations || gap <= 4.0 * usual))
    };
    samples.chunk_by(joined).map(|piece| piece.iter().map(|s| (s.0, s.1)).collect()).collect()
}

/// A curve that keeps its height until the next point.
fn stairs(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let corner = |w: &[(f64, f64)]| [(w[1].0, w[0].1), w[1]];
    points.first().copied().into_iter().chain(points.windows(2).flat_map(corner)).collect()
}

/// The lowest height so far, from the first that is known.
fn best(points: &[(f64, Option<f64>)]) -> Vec<(f64, f64)> {
    let mut lowest = f64::INFINITY;
    let running = points.iter().map(|&(x, height)| {
        lowest = lowest.min(height.unwrap_or(lowest));
        (x, lowest)
    });
    running.filter(|p| p.1.is_finite()).collect()
}

/// The curve with at most four points for each of `KEPT`/4 columns: first, lowest, highest and last.
fn thinned(points: &[(f64, f64)], end: f64) -> Vec<(f64, f64)> {
    if points.len() <= KEPT {
        return points.to_vec();
    }
    let column = |x: f64| (x / end * (KEPT / 4) as f64) as usize;
    points
        .chunk_by(|a, b| column(a.0) == column(b.0))
        .flat_map(|chunk| {
            let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
            let ends = [chunk.first(), chunk.last()];
            let extremes = [chunk.iter().min_by(by_height), chunk.iter().max_by(by_height)];
            let mut kept: Vec<_> = ends.into_iter().chain(extremes).flatten().copied().collect();
            kept.sort_by(|a, b| a.0.total_cmp(&b.0));
            kept.dedup();
            kept
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(residuals: impl IntoIterator<Item = f64>) -> Vec<Sample> {
        let sample =
            |(k, relative)| Sample { iteration: 10 * k, seconds: 1e-4 * k as f64, relative };
        residuals.into_iter().enumerate().map(sample).collect()
    }

    fn picture(residuals: impl IntoIterator<Item = f64>) -> String {
        let svg = svg("a <b> & c", &history(residuals), &Trace::None, 1e-8).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("a &lt;b&gt; &amp; c"), "the title is escaped");
        assert!(!svg.contains("\"NaN") && !svg.contains("\"inf"));
        assert!(svg.contains("iterations") && svg.contains("tolerance"));
        svg
    }

    #[test]
    fn any_history_can_be_drawn() {
        let says = |residuals: &[f64], notes: &[&str]| {
            let svg = picture(residuals.iter().copied());
            assert!(notes.iter().all(|note| svg.contains(note)), "{notes:?} in {svg}");
        };
        says(&[], &["nothing was judged"]);
        assert!(picture([1.0]).contains("<circle"));
        says(&[0.0], &["at the lower edge: 1 point with residual 0"]);
        says(&[f64::NAN], &["no finite residual: 1 point"]);
        says(&[f64::NAN, f64::INFINITY, -1.0], &["no finite residual: 3 points"]);
        let wild = [1.0, f64::NAN, 1e-3, 0.0, 1e-300, f64::INFINITY, 1e300];
        says(&wild, &["1 point with residual 0 and 3 below", "2 points not shown"]);
        picture([1e-9, 1e-9]);
        picture((0..100).map(|k| 0.8_f64.powi(k)));
    }

    #[test]
    fn huge_histories_make_small_pictures() {
        let wild = (0..1_000_000).map(|k| (1.0 + f64::from(k % 7)) / (1.0 + f64::from(k)));
        assert!(picture(wild).len() < 200_000);
    }

    #[test]
    fn no_line_spans_what_was_not_sampled() {
        let cut = |samples: &[(f64, f64, usize)], by_iterations| -> Vec<usize> {
            let end = samples.last().unwrap().0;
            pieces(samples, end, by_iterations).iter().map(Vec::len).collect()
        };
        // Every iteration was seen, however few they are.
        assert_eq!(cut(&[(0.0, 0.0, 0), (1.0, -1.0, 1), (2.0, -2.0, 2)], true), [3]);
        // Lemke's method is seen at its ends.
        assert_eq!(cut(&[(0.0, 0.0, 0), (200.0, -16.0, 200)], true), [1, 1]);
        // A history that was thinned is dense all the same.
        let thinned: Vec<_> = (0..100).map(|k| (f64::from(k), 0.0, 7 * k as usize)).collect();
        assert_eq!(cut(&thinned, false), [100]);
        // By time, one step was a stage of its own.
        let stage = [(1.0, 0.0, 1), (2.0, 0.0, 2), (3.0, 0.0, 3), (20.0, -9.0, 4)];
        assert_eq!(cut(&stage, false), [3, 1]);
        assert_eq!(cut(&stage, true), [4]);
        assert_eq!(stairs(&[(0.0, 0.0), (2.0, -1.0)]), [(0.0, 0.0), (2.0, 0.0), (2.0, -1.0)]);
    }

    #[test]
    fn the_best_residual_never_rises() {
        let heights = [None, Some(0.0), Some(-2.0), None, Some(-1.0)];
        let points: Vec<_> = (0..).map(f64::from).zip(heights).collect();
        assert_eq!(best(&points), [(1.0, 0.0), (2.0, -2.0), (3.0, -2.0), (4.0, -2.0)]);
    }
}
