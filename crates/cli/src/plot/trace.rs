//! What a method recorded, as two panels: pivots, or the path of an interior point.

use nonsmooth_bench::draw::{Axis, GRID, INK, decades, font, tick, ticks};
use nonsmooth_solve::trace::{PathPoint, Pivot, Trace, Variable};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{BEST, DEPTH, Drawn, RESIDUAL, TOLERANCE, thinned};

/// The height of the panels, px.
pub(super) const HEIGHT: u32 = 330;
/// The height of a panel's title, px.
const TITLE: u32 = 30;
/// What is no larger counts as zero: it lies at the lower edge of a logarithmic panel.
const FLOOR: f64 = 1e-300;

/// A panel: curves over the number of the pivot or iteration.
pub(super) struct Panel {
    /// What the numbers count.
    x: &'static str,
    /// Heights are decimal logarithms.
    logarithmic: bool,
    curves: Vec<Curve>,
}

/// A curve; values that no logarithm has lie at the lower edge.
struct Curve {
    name: &'static str,
    colour: RGBColor,
    /// Marks only: the values of neighbours have nothing to do with each other.
    marks: bool,
    points: Vec<(f64, f64)>,
}

/// The panels of a record; none where nothing was recorded.
pub(super) fn panels(trace: &Trace) -> Option<[Panel; 2]> {
    match trace {
        Trace::Pivots(rows) if !rows.is_empty() => Some(pivots(rows)),
        Trace::Path(rows) if !rows.is_empty() => Some(path(rows)),
        _ => None,
    }
}

fn pivots(rows: &[Pivot]) -> [Panel; 2] {
    let curve = |name, colour, marks, of: &dyn Fn(&Pivot) -> Option<f64>| Curve {
        name,
        colour,
        marks,
        points: rows.iter().filter_map(|p| Some((p.iteration as f64, of(p)?))).collect(),
    };
    // Of methods without z0: where in the basis they work, and whether they come back.
    let left = match rows.iter().any(|p| p.z0.is_some()) {
        true => curve("z0", BEST, false, &|p| p.z0),
        false => curve("index of the entering variable", BEST, true, &|p| match p.entering {
            Variable::Z(i) | Variable::W(i) => Some(i as f64 + 1.0),
            Variable::Artificial => Some(0.0),
        }),
    };
    let ratio =
        curve("|ratio|, zeros at the lower edge", TOLERANCE, true, &|p| Some(p.ratio.abs()));
    [
        Panel { x: "pivots", logarithmic: false, curves: vec![left] },
        Panel { x: "pivots", logarithmic: true, curves: vec![ratio] },
    ]
}

fn path(rows: &[PathPoint]) -> [Panel; 2] {
    let curve = |name, colour, of: fn(&PathPoint) -> f64| Curve {
        name,
        colour,
        marks: false,
        points: rows.iter().map(|p| (p.iteration as f64, of(p))).collect(),
    };
    let convergence = vec![
        curve("mu", BEST, |p| p.mu),
        curve("residual of the equations", RESIDUAL, |p| p.residual),
    ];
    let centrality = vec![
        curve("centrality delta", BEST, |p| p.delta),
        curve("least x s / mu", RESIDUAL, |p| p.least),
        curve("step", TOLERANCE, |p| p.step),
    ];
    [
        Panel { x: "iterations", logarithmic: true, curves: convergence },
        Panel { x: "iterations", logarithmic: true, curves: centrality },
    ]
}

impl Panel {
    /// The range of heights.
    fn range(&self) -> (f64, f64) {
        let all = || self.curves.iter().flat_map(|c| c.points.iter().map(|p| p.1));
        if !self.logarithmic {
            let finite = || all().filter(|y| y.is_finite());
            let (low, high) = (finite().fold(0.0, f64::min), finite().fold(0.0, f64::max));
            let room = if high > low { 0.05 * (high - low) } else { 1.0 };
            return (if low < 0.0 { low - room } else { 0.0 }, high + room);
        }
        let heights = || all().filter(|y| y.is_finite() && *y > FLOOR).map(f64::log10);
        let high = heights().fold(f64::NEG_INFINITY, f64::max);
        if !high.is_finite() {
            return (-1.0, 1.0);
        }
        let high = (high + 0.1).ceil();
        let low = heights().fold(f64::INFINITY, f64::min).max(high - DEPTH);
        // A zero lies at the lower edge, so nothing else does.
        ((low - 0.3).floor().min(high - 1.0), high)
    }

    /// The height of a value; none where it is not a number.
    fn height(&self, y: f64, low: f64) -> Option<f64> {
        match self.logarithmic {
            true if y.is_finite() => Some(if y > FLOOR { y.log10().max(low) } else { low }),
            false if y.is_finite() => Some(y),
            _ => None,
        }
    }

    pub(super) fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn
    where
        DB::ErrorType: 'static,
    {
        let (head, body) = area.split_vertically(TITLE);
        let left = Pos::new(HPos::Left, VPos::Center);
        let mut x = 66;
        for Curve { name, colour, marks, .. } in &self.curves {
            if *marks {
                head.draw(&Circle::new((x + 8, 16), 3, colour.filled()))?;
            } else {
                head.draw(&PathElement::new([(x, 16), (x + 16, 16)], colour.stroke_width(2)))?;
            }
            head.draw_text(name, &font(12).pos(left), (x + 22, 16))?;
            x += 44 + 7 * name.len() as i32;
        }
        let (low, high) = self.range();
        let end =
            self.curves.iter().filter_map(|c| c.points.last()).map(|p| p.0).fold(1.0, f64::max);
        let y_ticks = match self.logarithmic {
            true => decades(low, high, 8),
            false => signed_ticks(low, high),
        };
        let mut chart = ChartBuilder::on(&body)
            .margin_right(24)
            .margin_left(6)
            .margin_bottom(8)
            .x_label_area_size(42)
            .y_label_area_size(58)
            .build_cartesian_2d(
                Axis { range: 0.0..1.02 * end, ticks: ticks(end, 8, 1.0) },
                Axis { range: low..high, ticks: y_ticks },
            )?;
        let logarithmic = self.logarithmic;
        chart
            .configure_mesh()
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .axis_style(INK)
            .label_style(font(12))
            .axis_desc_style(font(13))
            .x_label_formatter(&|x| tick(*x))
            .y_label_formatter(&move |y| if logarithmic { format!("1e{y:.0}") } else { plain(*y) })
            .x_desc(self.x)
            .draw()?;
        for Curve { colour, marks, points, .. } in &self.curves {
            let points: Vec<_> = points.iter().map(|&(x, y)| (x, self.height(y, low))).collect();
            // Pivots and iterations are counted one by one, of a predictor and its corrector twice: a jump is a stage of another method, or rows that are not there.
            let next = |a: &(f64, Option<f64>), b: &(f64, Option<f64>)| {
                *marks || (b.1.is_some() == a.1.is_some() && (a.0..=a.0 + 1.0).contains(&b.0))
            };
            for piece in points.chunk_by(next) {
                let piece: Vec<_> = piece.iter().filter_map(|&(x, y)| Some((x, y?))).collect();
                let piece = thinned(&piece, end);
                let single = piece.len() == 1;
                if *marks || single {
                    let size = if piece.len() > 100 { 1 } else { 3 };
                    let circle = |&p: &(f64, f64)| Circle::new(p, size, colour.filled());
                    chart.draw_series(piece.iter().map(circle))?;
                } else {
                    chart.draw_series(LineSeries::new(piece, colour.stroke_width(2)))?;
                }
            }
        }
        Ok(())
    }
}

/// Round numbers from `low`, which may be negative, to `high`.
fn signed_ticks(low: f64, high: f64) -> Vec<f64> {
    let all = ticks(high.max(-low), 6, 0.0);
    let below = all.iter().rev().map(|t| -t).filter(|t| *t >= low && *t < 0.0);
    below.chain(all.iter().copied().filter(|t| *t <= high)).collect()
}

/// A tick of a linear axis, whatever its size.
fn plain(y: f64) -> String {
    match y.abs() {
        0.0 => "0".into(),
        a if (1e-2..1e5).contains(&a) && y > 0.0 => tick(y),
        a if (1e-2..1e5).contains(&a) => format!("-{}", tick(a)),
        _ => format!("{y:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::svg;
    use super::*;

    fn picture(trace: &Trace) -> String {
        let svg = svg("a", &[], trace, 1e-8).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(!svg.contains("\"NaN") && !svg.contains("\"inf"));
        svg
    }

    fn pivot(iteration: usize, ratio: f64, z0: Option<f64>) -> Pivot {
        let entering = Variable::Z(iteration % 3);
        Pivot { iteration, entering, leaving: Variable::W(0), ratio, z0 }
    }

    #[test]
    fn any_record_can_be_drawn() {
        let height = |svg: &str| svg.contains("height=\"710\"");
        assert!(!height(&picture(&Trace::None)) && !height(&picture(&Trace::Pivots(vec![]))));
        let wild = [0.0, 1.0, f64::NAN, 1e300, -3.0, f64::INFINITY, 1e-320];
        for z0 in [false, true] {
            for n in 1..=wild.len() {
                let rows = wild[..n].iter().enumerate();
                let rows = rows.map(|(k, &x)| pivot(k + 1, x, z0.then_some(x))).collect();
                let svg = picture(&Trace::Pivots(rows));
                assert!(height(&svg) && svg.contains("|ratio|"));
                assert_eq!(svg.contains("index of the entering variable"), !z0);
            }
        }
        for n in 1..=wild.len() {
            let rows = wild[..n].iter().enumerate().map(|(k, &x)| PathPoint {
                iteration: k + 1,
                mu: x,
                delta: x,
                least: x,
                step: x,
                residual: x,
            });
            let svg = picture(&Trace::Path(rows.collect()));
            assert!(height(&svg) && svg.contains("centrality delta"));
        }
        let many = (1..100_000).map(|k| pivot(k, 1.0 / k as f64, Some(1.0 / k as f64)));
        assert!(picture(&Trace::Pivots(many.collect())).len() < 300_000);
    }
}
