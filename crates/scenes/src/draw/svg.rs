//! A scene on paper: a standalone SVG in perspective.

use nonsmooth_problem::check::Motion;

use super::camera::{Camera, View};
use super::chains::{Chain, chains};
use super::ground;
use super::order::{Solid, paint_order};
use super::paper::{self, Colour, Mark, Paper};
use super::picture::{Body, Part, Picture, Pose, Touch};
use crate::SceneError;
use crate::error::positive;
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, add, dot, norm, scale, sub};

/// What a picture is to show well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Show {
    /// The bodies, with arrows and dots at the contacts; those behind a body are faint.
    Bodies,
    /// The impulses, as force chains in front of pale bodies.
    Forces,
}

/// How to draw a picture on paper.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing<'a> {
    /// Width of the picture, px; the height follows.
    pub width: f64,
    /// Where the scene is seen from.
    pub view: View,
    /// What is shown well; `None` for the impulses of many bodies, or where bodies hide most of them, else the bodies.
    pub show: Option<Show>,
    /// A dot at each contact.
    pub contacts: bool,
    /// An arrow at each moving body, in proportion to its velocity.
    pub velocities: bool,
    /// What the marks in the picture mean, below it.
    pub key: bool,
    /// A short line of text below.
    pub caption: Option<&'a str>,
}

impl Default for Drawing<'_> {
    fn default() -> Self {
        Self {
            width: 800.0,
            view: View::default(),
            show: None,
            contacts: true,
            velocities: true,
            key: true,
            caption: None,
        }
    }
}

impl Drawing<'_> {
    /// Checks the picture and what is asked of it.
    pub(super) fn validate(&self, picture: &Picture) -> Result<(), SceneError> {
        picture.validate()?;
        positive("width", self.width)?;
        self.view.validate()?;
        if self.show == Some(Show::Forces) && !solved(picture) {
            return Err(SceneError::value("view", "impulses, to show forces", "none"));
        }
        Ok(())
    }
}

/// Bodies alternate between these, so that neighbours can be told apart.
pub(super) const BODY: [Colour; 3] = [[214, 203, 184], [205, 193, 172], [221, 212, 196]];
pub(super) const OBSTACLE: Colour = [150, 157, 166];
const CONTACT: Colour = [52, 64, 76];
pub(super) const VELOCITY: Colour = [201, 135, 31];

/// The edges of bodies.
pub(super) const EDGE: &str = "#4a453d";
/// Those of pale ones.
const PALE_EDGE: &str = "#b8b3a9";
/// How far the colours of bodies behind forces are on the way to white.
const PALE: f64 = 0.72;

/// What a contact may do.
pub(super) const MOTIONS: [Motion; 3] = [Motion::Open, Motion::Stick, Motion::Slip];

/// Blue, vermilion and grey keep their difference for all kinds of colour vision.
pub(super) fn motion_colour(motion: Option<Motion>) -> Colour {
    match motion {
        None => CONTACT,
        Some(Motion::Open) => [139, 148, 158],
        Some(Motion::Stick) => [31, 111, 168],
        Some(Motion::Slip) => [209, 80, 47],
    }
}

/// Draws the last frame of a picture as a standalone SVG document, white behind, the same text for the same input.
///
/// Impulses are arrows from the contact into the body pushed, or force chains; what a contact does is shown by colour.
/// Elastic solids are drawn without strain, with the faces of their elements. Faces are shaded flat and painted from
/// the farthest body to the nearest, in an order that is exact for convex bodies with a separating face plane.
/// Cost: O(pairs of bodies that overlap in the picture), and contacts × bodies.
///
/// Errors: those of [`Picture::validate`]; a width or view that is not possible; forces of a picture without impulses.
pub fn svg(picture: &Picture, drawing: &Drawing) -> Result<String, SceneError> {
    drawing.validate(picture)?;
    let solids = solids(picture);
    let mut camera = camera(drawing, &solids);
    let forces = shows_forces(picture, drawing);
    let light = camera.light();
    let floor = picture.ground.map(|g| ground::Floor::new(&g, &solids, light));
    let arrows = if forces { vec![] } else { arrows(picture, drawing) };
    let chains = if forces { chains(picture, picture.last()) } else { vec![] };

    // Everything that must fit, then the scale that makes it fit the width.
    let mut reach: Vec<Vec3> = solids.iter().flat_map(Solid::hull).collect();
    reach.extend(floor.iter().flat_map(|f| f.corners()));
    reach.extend(arrows.iter().map(|a| a.to));
    let scene_height = camera.fit(&reach, drawing.width, 16.0);
    let size = mark_size(picture, &camera);
    let key = if drawing.key { key(picture, drawing, &arrows, &chains) } else { vec![] };
    let rows = paper::rows(&key, drawing.width);
    let lines = rows.len() + usize::from(drawing.caption.is_some());
    // Room for each line of text, and below them.
    let height = scene_height + if lines > 0 { 22.0 * lines as f64 + 8.0 } else { 0.0 };

    let mut paper = Paper::new(drawing.width, height, &picture.name);
    if let Some(floor) = &floor {
        floor.draw(&solids, light, &camera, &mut paper);
    }
    let edge = if forces { PALE_EDGE } else { EDGE };
    paper.open(&format!(r##"stroke="{edge}" stroke-width="0.8" stroke-linejoin="round""##));
    let pale = if forces { PALE } else { 0.0 };
    for k in paint_order(&solids, &camera) {
        draw_solid(&solids[k], &camera, light, pale, &mut paper);
    }
    paper.close();
    if forces {
        draw_chains(picture, chains, &camera, size, &mut paper);
    } else if drawing.contacts {
        draw_contacts(picture, &solids, &camera, size, &mut paper);
    }
    for arrow in &arrows {
        let hidden = solids.iter().any(|s| s.hides(arrow.to, camera.eye));
        let opacity = if hidden { 0.35 } else { 1.0 };
        let (from, to) = (camera.project(arrow.from), camera.project(arrow.to));
        paper.arrow(from, to, size, arrow.colour, opacity);
    }
    let mut y = scene_height + 10.0;
    for row in rows {
        paper.key(row, y);
        y += 22.0;
    }
    if let Some(text) = drawing.caption {
        paper.caption(text, y);
    }
    Ok(paper.finish())
}

/// Whether impulses are known.
fn solved(picture: &Picture) -> bool {
    picture.last().contacts.iter().any(|c| c.r.is_some())
}

/// Of more bodies than this arrows are too short to be read.
const CROWD: usize = 60;

/// Whether to show the forces: as asked for, or of many bodies, or where bodies hide more than half of the contacts that press.
pub(super) fn shows_forces(picture: &Picture, drawing: &Drawing) -> bool {
    if let Some(show) = drawing.show {
        return show == Show::Forces;
    }
    if !solved(picture) || picture.moving().count() > CROWD {
        return solved(picture);
    }
    let solids = solids(picture);
    let eye = camera(drawing, &solids).eye;
    let presses = |c: &&Touch| c.r.is_some() && c.status != Some(Motion::Open);
    let hidden = |c: &&Touch| solids.iter().any(|s| s.hides(c.point, eye));
    let contacts = || picture.last().contacts.iter().filter(presses);
    2 * contacts().filter(hidden).count() > contacts().count()
}

fn camera(drawing: &Drawing, solids: &[Solid]) -> Camera {
    let (centre, radius) = bounds(solids);
    Camera::new(&drawing.view, centre, radius)
}

/// The bodies in the world frame.
fn solids(picture: &Picture) -> Vec<Solid> {
    let placed = |(k, (body, pose)): (usize, (&Body, &Pose))| {
        let colour = if body.fixed { OBSTACLE } else { BODY[k % BODY.len()] };
        let solid = |part: &Part| match part {
            Part::Ball { radius } => Solid::Ball { centre: pose.position, radius: *radius, colour },
            Part::Convex { vertices, faces } => {
                let placed = vertices.iter().map(|&v| pose.to_world(v)).collect();
                Solid::convex(Polyhedron::trusted(placed, faces.clone()), colour)
            }
        };
        body.parts.iter().map(solid).collect::<Vec<_>>()
    };
    picture.bodies.iter().zip(&picture.last().poses).enumerate().flat_map(placed).collect()
}

/// The mean of some sizes, zero of none.
fn average(sizes: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = sizes.fold((0.0, 0), |(sum, n), x| (sum + x, n + 1));
    sum / f64::from(n.max(1))
}

/// The centre of the bounding box and half its diagonal.
fn bounds(solids: &[Solid]) -> (Vec3, f64) {
    let axis = |k: usize| {
        let n = std::array::from_fn(|i| f64::from(u8::from(i == k)));
        solids.iter().map(|s| s.extent(n)).fold((f64::INFINITY, f64::NEG_INFINITY), |all, one| {
            (all.0.min(one.0), all.1.max(one.1))
        })
    };
    let box3: [(f64, f64); 3] = std::array::from_fn(axis);
    (box3.map(|(a, b)| 0.5 * (a + b)), 0.5 * norm(box3.map(|(a, b)| b - a)))
}

/// The radius of a body on average, m.
pub(super) fn body_size(picture: &Picture) -> f64 {
    average(picture.moving().map(|(_, radius, _)| radius))
}

/// Half the thickness of a body on average, m.
pub(super) fn body_thickness(picture: &Picture) -> f64 {
    let moving = picture.bodies.iter().filter(|b| !b.fixed);
    average(moving.map(Body::inner_radius))
}

/// The size of a body in the picture on average, px: arrows and dots are small where the bodies are.
fn mark_size(picture: &Picture, camera: &Camera) -> f64 {
    average(picture.moving().map(|(position, radius, _)| radius * camera.magnification(position)))
}

/// What the marks in the picture mean.
fn key(
    picture: &Picture,
    drawing: &Drawing,
    arrows: &[Arrow],
    chains: &[Chain],
) -> Vec<(Mark, String)> {
    let longest = |what| arrows.iter().filter(|a| a.what == what).map(|a| a.size).reduce(f64::max);
    let impulse = longest(What::Impulse);
    let largest = chains.iter().map(|c| c.size).reduce(f64::max);
    let contacts = &picture.last().contacts;
    let mut out = vec![];
    // Chains are of some contacts, dots of all.
    let shown: Vec<Option<Motion>> = match chains {
        [] if drawing.contacts || impulse.is_some() => contacts.iter().map(|c| c.status).collect(),
        _ => chains.iter().map(|c| contacts[c.contact].status).collect(),
    };
    for (motion, said) in [
        (Some(Motion::Stick), "stick"),
        (Some(Motion::Slip), "slip"),
        (Some(Motion::Open), "open"),
        (None, "contact"),
    ] {
        if shown.contains(&motion) {
            out.push((Mark::Dot(motion_colour(motion)), said.into()));
        }
    }
    // Impulses have the colours of their contacts.
    let sized = [
        (largest, Mark::Chain(paper::GREY), "impulse by width", "N s"),
        (impulse, Mark::Arrow(paper::GREY), "impulse", "N s"),
        (longest(What::Velocity), Mark::Arrow(VELOCITY), "velocity", "m/s"),
    ];
    out.extend(sized.into_iter().filter_map(|(longest, mark, what, unit)| {
        Some((mark, format!("{what}, up to {} {unit}", paper::short(longest?))))
    }));
    out
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum What {
    Impulse,
    Velocity,
}

struct Arrow {
    what: What,
    /// Of the vector itself.
    size: f64,
    from: Vec3,
    to: Vec3,
    colour: Colour,
}

/// Impulses and velocities, the longest of each kind about as long as a body.
fn arrows(picture: &Picture, drawing: &Drawing) -> Vec<Arrow> {
    let size = body_size(picture);
    let mut out = Vec::new();
    let mut push = |what, length: f64, all: Vec<(Vec3, Vec3, Colour)>| {
        let longest = all.iter().map(|a| norm(a.1)).fold(0.0, f64::max);
        // An arrow shorter than a twentieth of the longest is only a blot.
        out.extend(all.into_iter().filter(|a| norm(a.1) > 0.05 * longest).map(
            |(from, d, colour)| {
                let to = add(from, scale(length / longest, d));
                Arrow { what, size: norm(d), from, to, colour }
            },
        ));
    };
    let impulse = |c: &Touch| Some((c.point, c.impulse()?, motion_colour(c.status)));
    push(What::Impulse, 1.3 * size, picture.last().contacts.iter().filter_map(impulse).collect());
    if drawing.velocities {
        let each = picture.moving().map(|(position, _, velocity)| (position, velocity, VELOCITY));
        push(What::Velocity, 1.5 * size, each.collect());
    }
    out
}

/// Force chains from the farthest to the nearest, which are the strongest in colour: depth where nothing else shows it.
fn draw_chains(
    picture: &Picture,
    mut chains: Vec<Chain>,
    camera: &Camera,
    size: f64,
    paper: &mut Paper,
) {
    let largest = chains.iter().map(|c| c.size).fold(0.0, f64::max);
    let widest = chain_width(size);
    let far = |c: &Chain| camera.depth(c.segments[0][0]);
    chains.sort_by(|a, b| far(b).total_cmp(&far(a)));
    let (back, front) = (chains.first().map_or(0.0, far), chains.last().map_or(0.0, far));
    for chain in &chains {
        let depth = if back > front { (far(chain) - front) / (back - front) } else { 0.0 };
        let colour = motion_colour(picture.last().contacts[chain.contact].status);
        let width = (widest * chain.size / largest).max(0.4);
        let mut points: Vec<_> = chain.segments[0].iter().rev().copied().collect();
        match chain.segments.get(1) {
            // Both halves of most chains meet at the contact; of a periodic image they do not.
            Some(&[from, to]) if from == chain.segments[0][0] => points.push(to),
            Some(half) => {
                paper.chain(half.map(|p| camera.project(p)).into_iter(), width, colour, depth)
            }
            None => {}
        }
        paper.chain(points.into_iter().map(|p| camera.project(p)), width, colour, depth);
    }
}

/// The width of the largest impulse where bodies are of this size, px.
fn chain_width(size: f64) -> f64 {
    (0.45 * size).clamp(2.5, 12.0)
}

fn draw_solid(solid: &Solid, camera: &Camera, light: Vec3, pale: f64, paper: &mut Paper) {
    match solid {
        Solid::Convex { polyhedron, planes, colour } => {
            for (face, (normal, offset)) in polyhedron.faces().iter().zip(planes) {
                if dot(*normal, camera.eye) > *offset {
                    // Half lit from everywhere, so that faces in the shade keep their colour.
                    let shade = 0.74 + 0.3 * dot(*normal, light);
                    let points = face.iter().map(|&v| camera.project(polyhedron.vertices()[v]));
                    paper.face(points, paper::paled(paper::shaded(*colour, shade), pale));
                }
            }
        }
        Solid::Ball { centre, radius, colour } => {
            let r = radius * camera.magnification(*centre);
            paper.ball(camera.project(*centre), r, *colour, pale);
        }
    }
}

fn draw_contacts(
    picture: &Picture,
    solids: &[Solid],
    camera: &Camera,
    size: f64,
    paper: &mut Paper,
) {
    let radius = (0.05 * size).clamp(0.6, 4.0);
    for contact in &picture.last().contacts {
        let hidden = solids.iter().any(|s| s.hides(contact.point, camera.eye));
        // What a hidden contact does is worth seeing, that it exists is worth a hint.
        let opacity = match contact.status {
            _ if !hidden => 1.0,
            Some(_) => 0.45,
            None => 0.15,
        };
        let at = camera.project(contact.point);
        paper.dot(at, radius, motion_colour(contact.status), opacity);
    }
}

impl Solid {
    /// Whether this solid covers `point` as seen from `eye`, its own surface apart.
    fn hides(&self, point: Vec3, eye: Vec3) -> bool {
        let ray = sub(point, eye);
        // The part of the ray inside the solid, as an interval of [0, 1].
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        match self {
            Solid::Convex { planes, .. } => {
                for &(n, d) in planes {
                    let (slope, start) = (dot(n, ray), d - dot(n, eye));
                    if slope < 0.0 {
                        enter = enter.max(start / slope);
                    } else if slope > 0.0 {
                        leave = leave.min(start / slope);
                    } else if start < 0.0 {
                        return false;
                    }
                }
            }
            Solid::Ball { centre, radius, .. } => {
                let to = sub(*centre, eye);
                let (rr, half) = (dot(ray, ray), dot(ray, to));
                let root = half * half - rr * (dot(to, to) - radius * radius);
                if root <= 0.0 {
                    return false;
                }
                enter = (half - root.sqrt()) / rr;
                leave = leave.min((half + root.sqrt()) / rr);
            }
        }
        leave - enter > 1e-3
    }
}
