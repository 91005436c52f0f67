//! What the programs that make the documentation's figures share: panels of curves side by side, as SVG and PNG.

use std::ops::Range;
use std::path::Path;

use nonsmooth_bench::draw::{Axis, GRID, INK, font};
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A curve.
pub struct Curve {
    /// The entry of the legend; curves with the same label share it.
    pub label: String,
    /// Of the line.
    pub colour: RGBColor,
    /// Of the line, px of the design.
    pub width: u32,
    /// Whether the line is dashed.
    pub dashed: bool,
    /// Whether a dot marks the last point.
    pub end: bool,
    /// `(x, y)` in the units of the axes.
    pub points: Vec<(f64, f64)>,
}

/// A square panel.
pub struct Panel {
    /// Above it.
    pub title: String,
    /// Of the two axes.
    pub labels: [&'static str; 2],
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// The texts of the ticks.
    pub texts: [fn(f64) -> String; 2],
    /// Painted in this order.
    pub curves: Vec<Curve>,
}

/// Pixels of the picture a unit of its design: coordinates are whole pixels, and curves should look smooth.
const FINE: u32 = 2;
/// The side of a panel with its labels.
const SIDE: u32 = 400 * FINE;
const TOP: u32 = 56 * FINE;
const BOTTOM: u32 = 34 * FINE;
/// The width of a character of the legend, a little more than the mean.
const CHARACTER: f64 = 5.6 * FINE as f64;

/// The picture as SVG.
///
/// Errors: what the drawing library says.
pub fn svg(title: &str, panels: &[Panel]) -> Result<String, String> {
    let mut text = String::new();
    let size = (SIDE * panels.len() as u32, TOP + SIDE + BOTTOM);
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        sheet(&area, title, panels).map_err(|e| e.to_string())?;
    }
    Ok(text)
}

fn sheet(
    area: &DrawingArea<SVGBackend, Shift>,
    title: &str,
    panels: &[Panel],
) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let centre = Pos::new(HPos::Center, VPos::Center);
    let wide = SIDE as i32 * panels.len() as i32;
    area.draw_text(title, &font(17 * FINE).pos(centre), (wide / 2, 20 * FINE as i32))?;
    for (k, panel) in panels.iter().enumerate() {
        let left = SIDE * k as u32;
        let part = area.clone().shrink((left, TOP), (SIDE, SIDE));
        let middle = (left + SIDE / 2) as i32 + 22 * FINE as i32;
        area.draw_text(
            &panel.title,
            &font(14 * FINE).pos(centre),
            (middle, TOP as i32 - 8 * FINE as i32),
        )?;
        draw(&part, panel)?;
    }
    // One line of legend: its entries evenly spaced where each has room, else one after another with equal gaps.
    let mut entries: Vec<&Curve> = vec![];
    for curve in panels.iter().flat_map(|p| &p.curves) {
        if entries.iter().all(|e| e.label != curve.label) {
            entries.push(curve);
        }
    }
    let y = (TOP + SIDE) as i32 + 14 * FINE as i32;
    let need =
        |curve: &&Curve| 32 * FINE as i32 + (CHARACTER * curve.label.chars().count() as f64) as i32;
    let (margin, all) = (14 * FINE as i32, entries.len().max(1) as i32);
    let step = wide / all;
    let even = entries.iter().all(|curve| margin + need(curve) <= step);
    let gap = (wide - entries.iter().map(need).sum::<i32>()) / all;
    let mut x = if even { margin } else { gap / 2 };
    for curve in &entries {
        let line = vec![(x, y), (x + 26 * FINE as i32, y)];
        stroke(curve, line, |e| area.draw(&e), |e| area.draw(&e))?;
        let left = Pos::new(HPos::Left, VPos::Center);
        area.draw_text(&curve.label, &font(13 * FINE).pos(left), (x + 32 * FINE as i32, y))?;
        x += if even { step } else { need(curve) + gap };
    }
    area.present()?;
    Ok(())
}

fn draw(
    area: &DrawingArea<SVGBackend, Shift>,
    panel: &Panel,
) -> Result<(), Box<dyn std::error::Error>> {
    let mut chart = ChartBuilder::on(area)
        .margin_top(8 * FINE)
        .margin_right(14 * FINE)
        .margin_left(10 * FINE)
        .x_label_area_size(42 * FINE)
        .y_label_area_size(54 * FINE)
        .build_cartesian_2d(panel.x.clone(), panel.y.clone())?;
    let [x_text, y_text] = panel.texts;
    chart
        .configure_mesh()
        .axis_style(INK)
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .label_style(font(12 * FINE))
        .axis_desc_style(font(13 * FINE))
        .x_desc(panel.labels[0])
        .y_desc(panel.labels[1])
        .x_label_formatter(&|x| x_text(*x))
        .y_label_formatter(&|y| y_text(*y))
        .draw()?;
    for curve in &panel.curves {
        let inside: Vec<_> = thinned(curve.points.iter().copied());
        // The parts of the curve inside the panel; plotters does not clip.
        let shows = |p: &(f64, f64)| panel.x.range.contains(&p.0) && panel.y.range.contains(&p.1);
        for part in inside.split(|p| !shows(p)).filter(|part| part.len() > 1) {
            let (solid, dashed) = (style(curve), style(curve));
            if curve.dashed {
                chart.draw_series(std::iter::once(DashedPathElement::new(
                    part.to_vec(),
                    5 * FINE,
                    4 * FINE,
                    dashed,
                )))?;
            } else {
                chart.draw_series(LineSeries::new(part.to_vec(), solid))?;
            }
        }
        if let Some(last) = curve.points.last().filter(|p| curve.end && shows(p)) {
            chart.draw_series([Circle::new(
                *last,
                (curve.width + 2) * FINE,
                curve.colour.filled(),
            )])?;
        }
    }
    Ok(())
}

fn style(curve: &Curve) -> ShapeStyle {
    curve.colour.stroke_width(curve.width * FINE)
}

type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn stroke(
    curve: &Curve,
    line: Vec<(i32, i32)>,
    solid: impl Fn(PathElement<(i32, i32)>) -> Drawn,
    dashed: impl Fn(DashedPathElement<std::vec::IntoIter<(i32, i32)>, u32>) -> Drawn,
) -> Drawn {
    if curve.dashed {
        dashed(DashedPathElement::new(line, 5 * FINE, 4 * FINE, style(curve)))
    } else {
        solid(PathElement::new(line, style(curve)))
    }
}

/// At most about 800 points.
fn thinned(points: impl ExactSizeIterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let (last, step) = (points.len().saturating_sub(1), points.len().div_ceil(800).max(1));
    points.enumerate().filter(|(k, _)| k % step == 0 || *k == last).map(|(_, p)| p).collect()
}

/// A linear axis of this range with about five round ticks.
pub fn linear(range: Range<f64>) -> Axis {
    let rough = (range.end - range.start) / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|s| s * power).into_iter().find(|s| *s >= rough);
    let step = step.unwrap_or(rough);
    let (first, last) = ((range.start / step).ceil() as i64, (range.end / step).floor() as i64);
    Axis { ticks: (first..=last).map(|k| k as f64 * step).collect(), range }
}

/// What stands for "sans-serif" where the machine has it.
const FONTS: [&str; 6] =
    ["DejaVu Sans", "Liberation Sans", "Noto Sans", "Arial", "Helvetica", "Helvetica Neue"];

/// The SVG as pixels, written to `path` as PNG.
///
/// Errors: no font without serifs, an SVG that cannot be read, a file that cannot be written.
pub fn png(svg: &str, path: &Path) -> Result<(), String> {
    use resvg::{tiny_skia, usvg};
    let mut options = usvg::Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_system_fonts();
    let has = |family: &&&str| {
        fonts.faces().any(|face| face.families.iter().any(|(name, _)| name == **family))
    };
    let family = FONTS.iter().find(has).ok_or("the texts of the PNG need a font without serifs")?;
    fonts.set_sans_serif_family(*family);
    let tree = usvg::Tree::from_str(svg, &options).map_err(|e| e.to_string())?;
    let size = tree.size().to_int_size();
    let mut pixels =
        tiny_skia::Pixmap::new(size.width(), size.height()).ok_or("an empty picture")?;
    resvg::render(&tree, tiny_skia::Transform::identity(), &mut pixels.as_mut());
    let bytes = pixels.encode_png().map_err(|e| e.to_string())?;
    write(path, &bytes)
}

/// Writes a file.
///
/// Errors: a file that cannot be written, by its path.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    std::fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}
