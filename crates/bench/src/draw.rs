//! Shared parts of pictures with curves: the look, axes with ticks of our choice, and their labels.

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::*;

/// The colour of texts and axes.
pub const INK: RGBColor = RGBColor(52, 64, 76);
/// The colour of grid lines.
pub const GRID: RGBColor = RGBColor(226, 230, 234);

/// A linear axis with ticks of our choice.
#[derive(Debug, Clone)]
pub struct Axis {
    /// From the least to the largest value.
    pub range: std::ops::Range<f64>,
    /// Where the ticks are.
    pub ticks: Vec<f64>,
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, x: &f64, (from, to): (i32, i32)) -> i32 {
        let part = (x - self.range.start) / (self.range.end - self.range.start);
        from + (part * f64::from(to - from)).round() as i32
    }

    fn key_points<H: KeyPointHint>(&self, _: H) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.range.clone()
    }
}

/// Text of this size, px.
pub fn font(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

/// Multiples of 1, 2 or 5 times a power of ten from 0 to `end`, about `n` of them and `least` apart.
pub fn ticks(end: f64, n: usize, least: f64) -> Vec<f64> {
    let rough = (end / n as f64).max(least);
    let power = 10f64.powf(rough.log10().floor());
    let nice = [1.0, 2.0, 5.0, 10.0];
    let step = power * nice.into_iter().find(|s| s * power >= rough).unwrap_or(10.0);
    (0..=(end / step * 1.02) as usize).map(|k| k as f64 * step).collect()
}

/// Whole numbers from `low` to `high`, at most about `n` of them: the decades of a logarithmic axis.
pub fn decades(low: f64, high: f64, n: usize) -> Vec<f64> {
    let step = ((high - low) / n as f64).ceil().max(1.0);
    // What rounds up to zero has no sign.
    let first = (low / step).ceil() * step + 0.0;
    let mut all = vec![];
    let mut at = first;
    while at <= high {
        all.push(at);
        at += step;
    }
    all
}

/// A tick's text: no digits that say nothing.
pub fn tick(x: f64) -> String {
    if x >= 1e6 {
        return format!("{x:.1e}");
    }
    let text = format!("{x:.3}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}

/// How a solver's curve looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    /// The colour.
    pub colour: RGBColor,
    /// Dash and gap, px; none for a solid line.
    pub dash: Option<(i32, i32)>,
    /// The shape of the marks along the curve, if any.
    pub mark: Option<Mark>,
    /// The width of the line, px.
    pub width: u32,
    /// By how many eighths of their distance the marks are shifted, to keep clear of those of others.
    pub shift: u8,
}

/// The shape of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A filled circle.
    Dot,
    /// A filled triangle.
    Triangle,
    /// A cross.
    Cross,
}

/// Colours that readers with any colour vision tell apart on white: Okabe and Ito's without black and yellow, and two darker ones.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(122, 79, 163),
    RGBColor(26, 26, 26),
];
/// The number of looks that colour and dash tell apart.
pub const LOOKS: usize = COLOURS.len() * DASHES.len();

const DASHES: [Option<(i32, i32)>; 4] = [None, Some((9, 4)), Some((4, 3)), Some((2, 3))];
const MARKS: [Option<Mark>; 4] = [None, Some(Mark::Dot), Some(Mark::Triangle), Some(Mark::Cross)];

impl Style {
    /// The look of the k-th solver. Colour and dash tell 32 apart, dash and mark 16 without colour.
    pub fn of(k: usize) -> Self {
        let dash = DASHES[(k + k / 8) % 4];
        let mark = MARKS[(k / 4) % 4];
        // A solid line shows below another of the same course only if it is wider.
        let width = if dash.is_none() && mark.is_none() { 3 } else { 2 };
        Self { colour: COLOURS[k % 8], dash, mark, width, shift: (k % 8) as u8 }
    }

    /// The k-th of a few: colours alone, with dots that stand on the curve.
    pub fn plain(k: usize) -> Self {
        let colour = COLOURS[k % COLOURS.len()];
        Self { colour, dash: None, mark: Some(Mark::Dot), width: 2, shift: 0 }
    }

    /// The look of what bounds all solvers.
    pub fn bound() -> Self {
        Self { colour: RGBColor(150, 150, 150), dash: None, mark: None, width: 2, shift: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(ticks(100.0, 5, 1.0), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(ticks(7.0, 6, 0.0), [0.0, 2.0, 4.0, 6.0]);
        assert_eq!(ticks(2.0, 8, 1.0), [0.0, 1.0, 2.0]);
        assert_eq!(decades(-9.0, 1.0, 10).len(), 11);
        assert_eq!(decades(-19.0, 1.0, 10)[0], -18.0);
        assert!(decades(-0.5, 3.0, 9)[0].is_sign_positive());
        assert_eq!((tick(0.5), tick(40.0), tick(2e7)), ("0.5".into(), "40".into(), "2.0e7".into()));
    }

    #[test]
    fn no_two_of_32_solvers_look_alike() {
        let look = |k: usize| (Style::of(k).colour, Style::of(k).dash);
        let grey = |k: usize| (Style::of(k).dash, Style::of(k).mark);
        let all: Vec<_> = (0..LOOKS).map(look).collect();
        assert!((0..LOOKS).all(|k| all.iter().filter(|l| **l == all[k]).count() == 1));
        let all: Vec<_> = (0..16).map(grey).collect();
        assert!((0..16).all(|k| all.iter().filter(|l| **l == all[k]).count() == 1));
    }
}
