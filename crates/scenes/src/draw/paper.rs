//! The SVG text.

use std::fmt::Write;

/// Red, green, blue.
pub(super) type Colour = [u8; 3];

type Point = [f64; 2];

/// A colour made darker or lighter.
pub(super) fn shaded(colour: Colour, factor: f64) -> Colour {
    colour.map(|c| (factor * f64::from(c)).round().clamp(0.0, 255.0) as u8)
}

/// A colour on the way to white, which is 1.
pub(super) fn paled(colour: Colour, part: f64) -> Colour {
    colour.map(|c| (f64::from(c) + part * (255.0 - f64::from(c))).round() as u8)
}

pub(super) fn hex([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A sign explained in the key, by its colour.
pub(super) enum Mark {
    Dot(Colour),
    Arrow(Colour),
    Chain(Colour),
}

/// The colour of texts, and of marks in the key that have several colours in the picture.
pub(super) const GREY: Colour = [91, 101, 112];

/// The size of the text, px, and the width of its letters on average.
const TEXT: f64 = 14.0;
const LETTER: f64 = 0.5 * TEXT;
/// The gap between two entries of the key.
const GAP: f64 = 18.0;

type Entry = (Mark, String);

/// The room that a mark takes before its text.
fn room(mark: &Mark) -> f64 {
    match mark {
        Mark::Dot(_) => 12.0,
        Mark::Arrow(_) | Mark::Chain(_) => 26.0,
    }
}

fn width(entry: &Entry) -> f64 {
    room(&entry.0) + LETTER * entry.1.chars().count() as f64 + GAP
}

/// The entries of a key in rows that fit a width, as far as they can.
pub(super) fn rows(key: &[Entry], fit: f64) -> Vec<&[Entry]> {
    let mut out = vec![];
    let mut rest = key;
    while !rest.is_empty() {
        let mut used = 0.0;
        let fits = rest.iter().take_while(|entry| {
            used += width(entry);
            used <= fit
        });
        let (row, then) = rest.split_at(fits.count().max(1));
        out.push(row);
        rest = then;
    }
    out
}

/// A number of two digits, as short as it can be said.
pub(super) fn short(x: f64) -> String {
    let digits = (1.0 - x.abs().log10().floor()).clamp(0.0, 9.0);
    let text = format!("{x:.0$}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// An SVG document under construction; coordinates in px, y downwards.
pub(super) struct Paper {
    body: String,
    width: f64,
    height: f64,
    title: String,
    /// The colours of balls, and how pale they are.
    balls: Vec<(Colour, f64)>,
}

/// Writing to a string cannot fail.
macro_rules! put {
    ($paper:expr, $($arguments:tt)*) => {
        writeln!($paper.body, $($arguments)*).expect("a string takes everything")
    };
}

impl Paper {
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        Self { body: String::new(), width, height, title: escape(title), balls: vec![] }
    }

    /// Opens a group with the given attributes.
    pub fn open(&mut self, attributes: &str) {
        put!(self, "<g {attributes}>");
    }

    pub fn close(&mut self) {
        put!(self, "</g>");
    }

    pub fn polygon(&mut self, points: impl Iterator<Item = Point>) {
        put!(self, r#"<path d="{}"/>"#, path(points));
    }

    pub fn face(&mut self, points: impl Iterator<Item = Point>, fill: Colour) {
        put!(self, r#"<path fill="{}" d="{}"/>"#, hex(fill), path(points));
    }

    pub fn line(&mut self, [x1, y1]: Point, [x2, y2]: Point) {
        put!(self, r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}"/>"#);
    }

    /// A sphere, lit from above left.
    pub fn ball(&mut self, [x, y]: Point, r: f64, colour: Colour, pale: f64) {
        let look = (colour, pale);
        let k = self.balls.iter().position(|&b| b == look).unwrap_or_else(|| {
            self.balls.push(look);
            self.balls.len() - 1
        });
        put!(self, r#"<circle cx="{x:.1}" cy="{y:.1}" r="{r:.2}" fill="url(#ball{k})"/>"#);
    }

    /// A dot with a light rim, to be seen on dark and light faces; without one if it is small.
    pub fn dot(&mut self, [x, y]: Point, r: f64, fill: Colour, opacity: f64) {
        let rim = if r < 1.2 {
            String::new()
        } else {
            format!(r##" stroke="#fff" stroke-width="{:.2}""##, 0.3 * r)
        };
        let fill = hex(fill);
        put!(
            self,
            r##"<circle cx="{x:.1}" cy="{y:.1}" r="{r:.2}" fill="{fill}"{rim} opacity="{opacity}"/>"##
        );
    }

    /// An arrow with a light rim; without one if it is small or the bodies are, of `size` px.
    pub fn arrow(&mut self, from: Point, to: Point, size: f64, colour: Colour, opacity: f64) {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let length = dx.hypot(dy);
        // Seen from its tip it is a dot, which the contact or the body already is.
        if length < 1.0 {
            return;
        }
        let along = [dx / length, dy / length];
        let head = (0.35 * length).max((0.15 * size).clamp(1.2, 3.0)).min(15.0).min(length);
        let width = 0.24 * head;
        let rim = if width < 1.2 || size < 30.0 {
            ""
        } else {
            r##" stroke="#fff" stroke-width="0.8" stroke-opacity="0.8" stroke-linejoin="round" paint-order="stroke""##
        };
        let at = |back: f64, side: f64| {
            [to[0] - back * along[0] - side * along[1], to[1] - back * along[1] + side * along[0]]
        };
        let outline = [
            at(length, 0.5 * width),
            at(head, 0.5 * width),
            at(head, 0.38 * head),
            to,
            at(head, -0.38 * head),
            at(head, -0.5 * width),
            at(length, -0.5 * width),
        ];
        put!(
            self,
            r##"<path fill="{}" opacity="{opacity}"{rim} d="{}"/>"##,
            hex(colour),
            path(outline.into_iter())
        );
    }

    /// A line of this width with round ends, paler with its depth from 0 to 1, and a light rim if it is wide.
    pub fn chain(
        &mut self,
        points: impl Iterator<Item = Point>,
        width: f64,
        colour: Colour,
        depth: f64,
    ) {
        let d = path(points);
        let d = d.trim_end_matches('Z');
        // Not transparent: where chains cross, the nearer one is to be seen alone.
        let colour = hex(paled(colour, 0.62 * depth));
        let style =
            format!(r#"fill="none" stroke-linecap="round" stroke-linejoin="round" d="{d}""#);
        if width > 2.0 {
            put!(self, r##"<path stroke="#fff" stroke-width="{:.1}" {style}/>"##, width + 1.4);
        }
        put!(self, r##"<path stroke="{colour}" stroke-width="{width:.1}" {style}/>"##);
    }

    /// A row of the key around the height `y`, in the middle.
    pub fn key(&mut self, row: &[Entry], y: f64) {
        let mut x = 0.5 * (self.width + GAP - row.iter().map(width).sum::<f64>());
        for entry in row {
            match entry.0 {
                Mark::Dot(colour) => self.dot([x + 4.0, y], 4.0, colour, 1.0),
                Mark::Arrow(colour) => self.arrow([x, y], [x + 20.0, y], 0.0, colour, 1.0),
                Mark::Chain(colour) => {
                    self.chain([[x + 2.0, y], [x + 18.0, y]].into_iter(), 5.0, colour, 0.0);
                }
            }
            self.text([x + room(&entry.0), y], "start", &entry.1);
            x += width(entry);
        }
    }

    /// A line of text around the height `y`, in the middle.
    pub fn caption(&mut self, text: &str, y: f64) {
        self.text([0.5 * self.width, y], "middle", text);
    }

    /// Text in [`GREY`].
    fn text(&mut self, [x, y]: Point, anchor: &str, text: &str) {
        let (y, text, fill) = (y + 0.35 * TEXT, escape(text), hex(GREY));
        put!(
            self,
            r##"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" font-family="sans-serif" font-size="{TEXT}" fill="{fill}">{text}</text>"##
        );
    }

    pub fn finish(self) -> String {
        let (w, h) = (self.width.round(), self.height.round());
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\">\n\
             <title>{}</title>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            self.title
        );
        if !self.balls.is_empty() {
            out += "<defs>\n";
            for (k, &(colour, pale)) in self.balls.iter().enumerate() {
                let stops = [(0, 1.1), (45, 0.95), (100, 0.56)].map(|(offset, factor)| {
                    let colour = hex(paled(shaded(colour, factor), pale));
                    format!(r#"<stop offset="{offset}%" stop-color="{colour}"/>"#)
                });
                out += &format!(
                    "<radialGradient id=\"ball{k}\" cx=\"36%\" cy=\"28%\" r=\"76%\">{}</radialGradient>\n",
                    stops.concat()
                );
            }
            out += "</defs>\n";
        }
        out + &self.body + "</svg>\n"
    }
}

/// A closed path.
fn path(points: impl Iterator<Item = Point>) -> String {
    let mut out = String::new();
    for (k, [x, y]) in points.enumerate() {
        let command = if k == 0 { 'M' } else { 'L' };
        write!(out, "{command}{x:.1} {y:.1}").expect("a string takes everything");
    }
    out + "Z"
}

/// Text as XML takes it: no control character has a place there, however written.
pub(super) fn escape(text: &str) -> String {
    let text = text.replace(char::is_control, "\u{fffd}");
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
