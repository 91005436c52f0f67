//! Scenes as pictures: a standalone SVG in perspective, for light and dark pages.

mod camera;
mod ground;
mod order;
mod paper;

use nonsmooth_problem::check::Motion;

pub use camera::View;

use crate::error::{positive, require};
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, add, dot, norm, scale, sub};
use crate::{Scene, SceneError, Shape};
use camera::Camera;
use order::{Solid, paint_order};
use paper::{Colour, Mark, Paper};

/// What to draw of a scene, besides its bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing<'a> {
    /// Width of the picture, px; the height follows.
    pub width: f64,
    /// Where the scene is seen from.
    pub view: View,
    /// A dot at each contact, fainter where a body hides it.
    pub contacts: bool,
    /// An arrow at each moving body, in proportion to its velocity, fainter where a body hides its tip.
    pub velocities: bool,
    /// Impulses r by contact, `[N, T1, T2]` each, N·s: an arrow each, from the contact into the body pushed.
    pub impulses: Option<&'a [f64]>,
    /// What each contact does, shown by colour.
    pub motions: Option<&'a [Motion]>,
    /// What the arrows and dots in the picture mean, below it.
    pub key: bool,
    /// A short line of text below.
    pub caption: Option<&'a str>,
}

impl Default for Drawing<'_> {
    fn default() -> Self {
        Self {
            width: 800.0,
            view: View::default(),
            contacts: true,
            velocities: true,
            impulses: None,
            motions: None,
            key: true,
            caption: None,
        }
    }
}

/// Bodies alternate between these, so that neighbours can be told apart.
const BODY: [Colour; 3] = [[214, 203, 184], [205, 193, 172], [221, 212, 196]];
const OBSTACLE: Colour = [150, 157, 166];
const CONTACT: &str = "#34404c";
const VELOCITY: &str = "#c9871f";

/// Blue, vermilion and grey keep their difference for all kinds of colour vision.
fn motion_colour(motion: Motion) -> &'static str {
    match motion {
        Motion::Open => "#8b949e",
        Motion::Stick => "#1f6fa8",
        Motion::Slip => "#d1502f",
    }
}

/// Draws `scene` as a standalone SVG document, the same text for the same input.
///
/// Elastic solids are drawn without strain, with the faces of their elements. Faces are shaded flat and painted from
/// the farthest body to the nearest, in an order that is exact for convex bodies with a separating face plane.
/// Cost: O(pairs of bodies that overlap in the picture).
///
/// Errors: those of [`Scene::validate`]; nothing to draw; impulses or motions that do not fit the contacts.
pub fn svg(scene: &Scene, drawing: &Drawing) -> Result<String, SceneError> {
    check(scene, drawing)?;
    let solids = solids(scene)?;
    let (centre, radius) = bounds(&solids);
    let mut camera = Camera::new(&drawing.view, centre, radius);
    let light = camera.light();
    let floor = scene.ground.map(|g| ground::Floor::new(&g, &solids, light));
    let arrows = arrows(scene, drawing);

    // Everything that must fit, then the scale that makes it fit the width.
    let mut reach: Vec<Vec3> = solids.iter().flat_map(Solid::hull).collect();
    reach.extend(floor.iter().flat_map(|f| f.corners()));
    reach.extend(arrows.iter().map(|a| a.to));
    let scene_height = camera.fit(&reach, drawing.width, 16.0);
    let size = mark_size(scene, &camera);
    let key = if drawing.key { key(scene, drawing, &arrows) } else { vec![] };
    let rows = paper::rows(&key, drawing.width);
    let lines = rows.len() + usize::from(drawing.caption.is_some());
    // Room for each line of text, and below them.
    let height = scene_height + if lines > 0 { 22.0 * lines as f64 + 8.0 } else { 0.0 };

    let mut paper = Paper::new(drawing.width, height, &scene.name);
    if let Some(floor) = &floor {
        floor.draw(&solids, light, &camera, &mut paper);
    }
    paper.open(r##"stroke="#4a453d" stroke-width="0.8" stroke-linejoin="round""##);
    for k in paint_order(&solids, &camera) {
        draw_solid(&solids[k], &camera, light, &mut paper);
    }
    paper.close();
    if drawing.contacts {
        draw_contacts(scene, drawing, &solids, &camera, size, &mut paper);
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

fn check(scene: &Scene, drawing: &Drawing) -> Result<(), SceneError> {
    scene.validate()?;
    if scene.bodies.is_empty() && scene.solids.is_empty() && scene.obstacles.is_empty() {
        return Err(SceneError::value("bodies", "something to draw", "none"));
    }
    positive("width", drawing.width)?;
    drawing.view.validate()?;
    let nc = scene.contacts.len();
    if let Some(r) = drawing.impulses {
        if r.len() != 3 * nc {
            let expected = format!("{} entries, 3 for each contact", 3 * nc);
            return Err(SceneError::value("impulses", expected, r.len()));
        }
        require("impulses", r.iter().sum(), true, "finite entries")?;
    }
    match drawing.motions {
        Some(m) if m.len() != nc => Err(SceneError::value(
            "motions",
            format!("{nc} entries, one for each contact"),
            m.len(),
        )),
        _ => Ok(()),
    }
}

/// The bodies, elastic solids and obstacles in the world frame.
fn solids(scene: &Scene) -> Result<Vec<Solid>, SceneError> {
    let colour = |k: usize| BODY[k % BODY.len()];
    let mut all = vec![];
    for (k, body) in scene.bodies.iter().enumerate() {
        all.extend(placed(&body.shape, body.position, |v| body.to_world(v), colour(k)));
    }
    for (k, solid) in scene.solids.iter().enumerate() {
        all.push(Solid::convex(solid.surface()?, colour(scene.bodies.len() + k)));
    }
    for o in &scene.obstacles {
        all.extend(placed(&o.shape, o.position, |v| add(o.position, v), OBSTACLE));
    }
    Ok(all)
}

/// The convex solids of a shape whose points `to_world` maps and whose origin is at `position`.
fn placed(
    shape: &Shape,
    position: Vec3,
    to_world: impl Fn(Vec3) -> Vec3,
    colour: Colour,
) -> Vec<Solid> {
    let convex = |p: &Polyhedron| Solid::convex(p.mapped(&to_world), colour);
    match shape {
        Shape::Box { half } => {
            vec![convex(&Polyhedron::cuboid(*half).expect("a validated body has a volume"))]
        }
        Shape::Polyhedron(p) => vec![convex(p)],
        Shape::Compound(parts) => parts.iter().map(convex).collect(),
        Shape::Sphere { radius } => vec![Solid::Ball { centre: position, radius: *radius, colour }],
    }
}

/// The centre, radius and velocity of each body and each elastic solid.
fn moving(scene: &Scene) -> impl Iterator<Item = (Vec3, f64, Vec3)> + '_ {
    let bodies = scene.bodies.iter().map(|b| (b.position, b.shape.radius(), b.velocity));
    let solids = scene.solids.iter().map(|s| (s.position, s.radius(), s.mean_velocity()));
    bodies.chain(solids)
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

/// The size of a body in the picture on average, px: arrows and dots are small where the bodies are.
fn mark_size(scene: &Scene, camera: &Camera) -> f64 {
    average(moving(scene).map(|(position, radius, _)| radius * camera.magnification(position)))
}

/// What the marks in the picture mean.
fn key(scene: &Scene, drawing: &Drawing, arrows: &[Arrow]) -> Vec<(Mark, String)> {
    let longest = |what| arrows.iter().filter(|a| a.what == what).map(|a| a.size).reduce(f64::max);
    let impulse = longest(What::Impulse);
    let mut out = vec![];
    let marked = drawing.contacts && !scene.contacts.is_empty();
    match drawing.motions {
        Some(motions) if marked || impulse.is_some() => {
            for (motion, said) in
                [(Motion::Stick, "stick"), (Motion::Slip, "slip"), (Motion::Open, "open")]
            {
                if motions.contains(&motion) {
                    out.push((Mark::Dot(motion_colour(motion)), said.into()));
                }
            }
        }
        None if marked => out.push((Mark::Dot(CONTACT), "contact".into())),
        _ => {}
    }
    // Impulses have the colours of their contacts.
    let arrows = [
        (impulse, paper::GREY, "impulse", "N s"),
        (longest(What::Velocity), VELOCITY, "velocity before the step", "m/s"),
    ];
    out.extend(arrows.into_iter().filter_map(|(longest, colour, what, unit)| {
        let text = format!("{what}, up to {} {unit}", paper::short(longest?));
        Some((Mark::Arrow(colour), text))
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
    colour: &'static str,
}

/// Impulses and velocities, the longest of each kind about as long as a body.
fn arrows(scene: &Scene, drawing: &Drawing) -> Vec<Arrow> {
    let size = average(moving(scene).map(|(_, radius, _)| radius));
    let mut out = Vec::new();
    let mut push = |what, length: f64, all: Vec<(Vec3, Vec3, &'static str)>| {
        let longest = all.iter().map(|a| norm(a.1)).fold(0.0, f64::max);
        // An arrow shorter than a twentieth of the longest is only a blot.
        out.extend(all.into_iter().filter(|a| norm(a.1) > 0.05 * longest).map(
            |(from, d, colour)| {
                let to = add(from, scale(length / longest, d));
                Arrow { what, size: norm(d), from, to, colour }
            },
        ));
    };
    if let Some(r) = drawing.impulses {
        let impulse = |(c, contact): (usize, &crate::Contact)| {
            let d = contact
                .frame()
                .iter()
                .zip(&r[3 * c..])
                .fold([0.0; 3], |s, (&axis, &x)| add(s, scale(x, axis)));
            (contact.point, d, contact_colour(drawing, c))
        };
        push(What::Impulse, 1.3 * size, scene.contacts.iter().enumerate().map(impulse).collect());
    }
    if drawing.velocities {
        let each = moving(scene).map(|(position, _, velocity)| (position, velocity, VELOCITY));
        push(What::Velocity, 1.5 * size, each.collect());
    }
    out
}

fn contact_colour(drawing: &Drawing, c: usize) -> &'static str {
    drawing.motions.map_or(CONTACT, |m| motion_colour(m[c]))
}

fn draw_solid(solid: &Solid, camera: &Camera, light: Vec3, paper: &mut Paper) {
    match solid {
        Solid::Convex { polyhedron, planes, colour } => {
            for (face, (normal, offset)) in polyhedron.faces().iter().zip(planes) {
                if dot(*normal, camera.eye) > *offset {
                    // Half lit from everywhere, so that faces in the shade keep their colour.
                    let shade = 0.74 + 0.3 * dot(*normal, light);
                    let points = face.iter().map(|&v| camera.project(polyhedron.vertices()[v]));
                    paper.face(points, paper::shaded(*colour, shade));
                }
            }
        }
        Solid::Ball { centre, radius, colour } => {
            let r = radius * camera.magnification(*centre);
            paper.ball(camera.project(*centre), r, *colour);
        }
    }
}

fn draw_contacts(
    scene: &Scene,
    drawing: &Drawing,
    solids: &[Solid],
    camera: &Camera,
    size: f64,
    paper: &mut Paper,
) {
    let radius = (0.05 * size).clamp(0.6, 4.0);
    for (c, contact) in scene.contacts.iter().enumerate() {
        let hidden = solids.iter().any(|s| s.hides(contact.point, camera.eye));
        // What a hidden contact does is worth seeing, that it exists is worth a hint.
        let opacity = match drawing.motions {
            _ if !hidden => 1.0,
            Some(_) => 0.45,
            None => 0.15,
        };
        let at = camera.project(contact.point);
        paper.dot(at, radius, contact_colour(drawing, c), opacity);
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
