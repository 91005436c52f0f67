//! Contact detection: where bodies are near each other, with keys that persist.
//!
//! | pair | how |
//! | --- | --- |
//! | sphere, capsule with sphere, capsule, plane | closed form; parallel capsules at two points |
//! | sphere with box, polyhedron | nearest vertex, edge or face |
//! | box, polyhedron with plane | all vertices |
//! | box, polyhedron with each other | separating axes with hysteresis, whole faces clipped |
//! | cylinder, cone with plane | the lowest point of each rim; flat ends stand on eight points of the body, too |
//! | cylinder, cone with sphere | closed form in the half plane through the axis |
//! | capsule with box, polyhedron; cylinder, cone with all that is convex | [`convex`]: distance, then features |
//! | elastic box with elastic box | [`facing`]: nodes of the finer mesh at faces of the other |
//! | mesh, heightfield with all that is convex; mesh with plane | [`surface`]: triangles in a tree of boxes, filtered at inner edges; [`inside`]: what lies behind all of them |
//! | mesh with mesh, heightfield | [`surfaces`]: pairs of triangles in two trees, filtered at the edges of both; vertices deep inside the other |
//! | an image of either in a world that repeats itself | [`images`] finds the pair, then as above |
//! | polygon with polygon, disc, capsule | [`outline`]: separating sides with hysteresis, sides clipped by sides; nearest side or corner |
//!
//! What is drawn is what touches: no margin, no skin. A point is reported where the gap is at most the prediction of the pair, so that a step
//! knows what it may run into. Every list is sorted by key: the same bodies give the same contacts in the same order.

mod broad;
mod clip;
mod convex;
mod facing;
mod gjk;
mod hull;
mod images;
mod inside;
mod outline;
mod rounds;
mod segments;
mod surface;
mod surfaces;
mod turned;
mod witness;

use nonsmooth_linalg::budget;
use nonsmooth_scenes::Polyhedron;
use nonsmooth_scenes::vec3::{Vec3, add, scale, sub};

use crate::crew::Crew;
use crate::elastic::{Foot, Nodes};
use crate::error::within_limits;
use crate::periodic::{Image, Pair};
use crate::rotation::Pose;
use crate::state::{Axis, ContactMemory, State};
use crate::{BodyId, Compliance, Dimension, Law, Motion, Shape, SimulateError, World};
use broad::{Aabb, Broad};
use clip::Clip;
use convex::{Extent, Flat, Side};
use facing::Facing;
use hull::{Hull, PosedHull};
use images::Images;
use outline::{Flat as Polygonal, Outline, Rod};
use segments::Segment;
use surface::{Scratch, Surface};
use turned::Turned;
use witness::Feature;
pub use witness::Key;
pub(crate) use witness::{Place, Witness};

/// A point where two bodies are near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Near {
    pub key: Key,
    pub a: u32,
    pub b: u32,
    pub law: Law,
    pub compliance: Option<Compliance>,
    /// The size of the smaller shape.
    pub size: f64,
    pub place: Place,
    pub witness: Witness,
    /// What of a touches: an image of it.
    pub image: Beside,
    /// Whether the bodies overlap so far that the normal is that of the step before, if there was one.
    pub deep: bool,
}

/// An image of a body in a world that repeats itself, zero of the body itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Beside {
    /// From the body to the image at the beginning of the step, m.
    pub offset: Vec3,
    /// Of the image relative to the body, m/s.
    pub velocity: Vec3,
}

impl Beside {
    /// From the body to the image a time later.
    pub fn after(&self, time: f64) -> Vec3 {
        add(self.offset, scale(time, self.velocity))
    }

    /// The pose of the image where that of the body is this one.
    pub fn pose(&self, body: &Pose, time: f64) -> Pose {
        Pose { x: add(body.x, self.after(time)), r: body.r }
    }

    /// Whether it is the body itself.
    pub fn is_itself(&self) -> bool {
        *self == Self::default()
    }
}

/// Bodies that overlap by more than this share of the smaller one leave no normal of their own.
const DEEP: f64 = 0.1;

/// What a shape is made of, in the frame of its body.
#[derive(Debug, Clone)]
enum Solid {
    Rounded(Segment, f64),
    Plane(Pose),
    Hull(Box<Hull>),
    Outline(Box<Outline>),
    Turned(Box<Turned>),
    Surface(Box<Surface>),
}

#[derive(Debug, Clone)]
struct Solids {
    body: u32,
    material: usize,
    solid: Solid,
    size: f64,
}

impl Solids {
    /// Vertices, where the body `moves`, and the box of a shape that is finite, whose body has this pose and margin.
    fn place(
        &self,
        pose: &Pose,
        margin: f64,
        (moves, posed): (bool, &mut PosedHull),
        bounds: &mut Aabb,
    ) {
        let (low, high, margin) = match &self.solid {
            Solid::Rounded(segment, radius) => {
                let s = segment.placed(pose);
                let end = add(s.p, s.d);
                let by = |f: fn(f64, f64) -> f64| std::array::from_fn(|i| f(s.p[i], end[i]));
                (by(f64::min), by(f64::max), margin + radius)
            }
            solid @ (Solid::Hull(_) | Solid::Outline(_) | Solid::Surface(_)) => {
                match solid {
                    Solid::Hull(hull) if moves => posed.set(hull, pose),
                    Solid::Outline(outline) if moves => posed.set_outline(outline, pose),
                    Solid::Surface(surface) if moves => {
                        posed.vertices.clear();
                        posed.vertices.extend(surface.vertices.iter().map(|&v| pose.point(v)));
                    }
                    _ => {}
                }
                let by = |start: f64, f: fn(f64, f64) -> f64| {
                    posed
                        .vertices
                        .iter()
                        .fold([start; 3], |s, v| std::array::from_fn(|i| f(s[i], v[i])))
                };
                let (mut low, mut high) =
                    (by(f64::INFINITY, f64::min), by(f64::NEG_INFINITY, f64::max));
                if let Solid::Surface(surface) = solid
                    && let Some(below) = surface.below
                {
                    // What has sunk below a field is met there, as far down as the field is large.
                    let depth = scale(surface.size, pose.direction(below));
                    low = std::array::from_fn(|i| low[i] + depth[i].min(0.0));
                    high = std::array::from_fn(|i| high[i] + depth[i].max(0.0));
                }
                (low, high, margin)
            }
            Solid::Turned(turned) => {
                let placed = turned.placed(pose);
                let reach = |i: usize, sign: f64| {
                    let mut e = [0.0; 3];
                    e[i] = sign;
                    placed.support(e)[i]
                };
                let by = |sign: f64| std::array::from_fn(|i| reach(i, sign));
                (by(-1.0), by(1.0), margin)
            }
            Solid::Plane(_) => return,
        };
        *bounds = Aabb { low, high }.grown(margin);
    }
}

/// Points of a surface nearer to each other than this share of the size are one,
const SAME: f64 = 1e-6;
/// where the cosine between their normals is larger than this.
const ALIKE: f64 = 0.9999;

/// Broad and narrow phase, with the memory that they use.
#[derive(Debug, Clone)]
pub(crate) struct Detector {
    /// Bodies, and the nodes of elastic solids, which are points.
    bodies: usize,
    nodes: Nodes,
    facing: Facing,
    solids: Vec<Solids>,
    moves: Vec<bool>,
    planes: Vec<u32>,
    finite: Vec<u32>,
    poses: Vec<Pose>,
    /// Vertices and faces where they are, and boxes, those of planes without a meaning; for each shape.
    hulls: Vec<PosedHull>,
    bounds: Vec<Aabb>,
    boxes: Vec<Aabb>,
    /// For each shape the place of its box.
    box_of: Vec<u32>,
    box_moves: Vec<bool>,
    broad: Broad,
    met: Vec<(u32, u32)>,
    images: Images,
    pairs: Vec<Pair>,
    axes: Vec<(Pair, Axis)>,
    /// One for each part of the pairs.
    finders: Vec<Finder>,
}

/// The narrow phase of a part of the pairs: its buffers and what it has found.
#[derive(Debug, Clone, Default)]
struct Finder {
    clip: Clip,
    scratch: Scratch,
    found: Vec<Near>,
    axes: Vec<(Pair, Axis)>,
    /// Vertices and faces of an image.
    image: PosedHull,
}

impl Detector {
    /// Of a valid world.
    ///
    /// Errors: two shapes that may meet and whose contact is not implemented.
    pub fn new(world: &World) -> Result<Self, SimulateError> {
        let mut solids = vec![];
        let mut names = vec![];
        for (k, body) in world.bodies.iter().enumerate() {
            within_limits()?;
            for (s, part) in body.parts.iter().enumerate() {
                let pose = Pose { x: part.position, r: part.rotation.matrix() };
                let hull = |p: &Polyhedron| Solid::Hull(Box::new(Hull::new(p, &pose)));
                let solid = match &part.shape {
                    Shape::Sphere { radius } => Solid::Rounded(Segment::point(pose.x), *radius),
                    Shape::Capsule { half_length, radius } => {
                        let end = |z| pose.point([0.0, 0.0, z]);
                        Solid::Rounded(
                            Segment::between(end(-half_length), end(*half_length)),
                            *radius,
                        )
                    }
                    Shape::Disc { radius } => Solid::Rounded(Segment::point(pose.x), *radius),
                    Shape::Stadium { half_length, radius } => {
                        let end = |x| pose.point([x, 0.0, 0.0]);
                        Solid::Rounded(
                            Segment::between(end(-half_length), end(*half_length)),
                            *radius,
                        )
                    }
                    Shape::Polygon(p) => {
                        let corners = p.points().map(|v| pose.point(v)).collect();
                        Solid::Outline(Box::new(Outline::new(corners)))
                    }
                    Shape::Plane => Solid::Plane(match world.dimension {
                        Dimension::Three => pose,
                        Dimension::Two => flat(&pose),
                    }),
                    Shape::Box { half } => hull(&Polyhedron::cuboid(*half)?),
                    Shape::Polyhedron(p) => hull(p),
                    Shape::Cylinder { half_length, radius } => {
                        let radii = [*radius, *radius];
                        Solid::Turned(Box::new(Turned::new(&pose, *half_length, radii)))
                    }
                    Shape::Cone { half_length, radius } => {
                        let radii = [*radius, 0.0];
                        Solid::Turned(Box::new(Turned::new(&pose, *half_length, radii)))
                    }
                    Shape::Mesh(mesh) => Solid::Surface(Box::new(Surface::new(mesh, &pose))),
                };
                let size = match &solid {
                    Solid::Hull(hull) => hull.size,
                    Solid::Outline(outline) => outline.size,
                    Solid::Surface(surface) => surface.size,
                    _ => part.shape.radius(),
                };
                solids.push(Solids { body: k as u32, material: part.material, solid, size });
                names.push((k, s, part.shape.name()));
            }
        }
        let nodes = Nodes::of(world);
        for (k, node) in (world.bodies.len()..).zip(&nodes.list) {
            let solid = Solid::Rounded(Segment::point([0.0; 3]), 0.0);
            solids.push(Solids { body: k as u32, material: node.material, solid, size: node.size });
        }
        // Surfaces meet each other where something is behind them: sheets have no side.
        let surfaces: Vec<usize> =
            (0..solids.len()).filter(|&k| matches!(solids[k].solid, Solid::Surface(_))).collect();
        let is_sheet = |k: usize| matches!(&solids[k].solid, Solid::Surface(s) if !s.one_sided);
        for (n, &i) in surfaces.iter().enumerate() {
            let meets = |j: &usize| {
                let (p, q) = (solids[i].body, solids[*j].body);
                p != q && world.may_touch(BodyId(p), BodyId(q)) && (is_sheet(i) || is_sheet(*j))
            };
            if let Some(&j) = surfaces[n + 1..].iter().find(|j| meets(j)) {
                let place = |k: usize| format!("{}.parts[{}]", world.label(names[k].0), names[k].1);
                let name =
                    |k: usize| if is_sheet(k) { "mesh that is not closed" } else { names[k].2 };
                let (first, second) = (name(i), name(j));
                return Err(SimulateError::Pair { a: place(i), b: place(j), first, second });
            }
        }
        // Nor is it known from which side a point has come that has passed one by rounding.
        let sheet = surfaces.iter().find(|&&k| is_sheet(k));
        if let (Some(&k), false) = (sheet, world.elastic.is_empty()) {
            let (a, b) =
                (format!("{}.parts[{}]", world.label(names[k].0), names[k].1), "elastic[0]".into());
            let (first, second) = ("mesh that is not closed", "box that is elastic");
            return Err(SimulateError::Pair { a, b, first, second });
        }
        let free = world.bodies.iter().map(super::world::Body::is_free);
        let moves: Vec<bool> = free.chain(nodes.list.iter().map(|_| true)).collect();
        let is_plane = |k: &u32| matches!(solids[*k as usize].solid, Solid::Plane(_));
        let (planes, finite): (Vec<u32>, Vec<u32>) =
            (0..solids.len() as u32).partition(|k| is_plane(k));
        let mut box_of = vec![0; solids.len()];
        finite.iter().enumerate().for_each(|(place, &k)| box_of[k as usize] = place as u32);
        let box_moves = finite.iter().map(|&k| moves[solids[k as usize].body as usize]).collect();
        Ok(Self {
            hulls: vec![PosedHull::default(); solids.len()],
            bounds: vec![Aabb { low: [0.0; 3], high: [0.0; 3] }; solids.len()],
            moves,
            planes,
            finite,
            poses: vec![],
            boxes: vec![],
            box_moves,
            broad: Broad::default(),
            met: vec![],
            images: Images::default(),
            pairs: vec![],
            axes: vec![],
            finders: vec![Finder::default()],
            box_of,
            bodies: world.bodies.len(),
            facing: Facing::new(world, &nodes, solids.len()),
            nodes,
            solids,
        })
    }

    /// The size of each body and node: the radius of its largest finite shape.
    pub fn sizes(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.bodies + self.nodes.list.len()];
        for s in self.solids.iter().filter(|s| s.size.is_finite()) {
            let size = &mut out[s.body as usize];
            *size = f64::max(*size, s.size);
        }
        out
    }

    /// All points where two bodies that may touch are within the sum of their margins (m, one a body), by key. The axes that separate polyhedra are left in
    /// the memory of the state, the feet of nodes on faces of other elastic solids in `feet`: these are bodies that count on where nodes end.
    /// Shapes and pairs are cut into consecutive parts for the threads of the crew: what is found is the same for any number. Where the limits in force
    /// ([`budget`]) are over nothing is found and the state stays: whoever asked looks at them, too.
    pub fn detect(
        &mut self,
        world: &World,
        state: &mut State,
        margins: &[f64],
        crew: &Crew,
        (out, feet): (&mut Vec<Near>, &mut Vec<Foot>),
    ) {
        self.place(world, state, margins, crew);
        self.pairs.clear();
        self.meet(world, state.t, crew);
        self.pairs_with_planes(world, state.t, margins);
        crew.sort_by_key(&mut self.pairs, |p| {
            (u64::from(p.first) << 32 | u64::from(p.second), p.image)
        });
        let parts = crew.parts(self.pairs.len());
        let mut finders = std::mem::take(&mut self.finders);
        finders.resize_with(finders.len().max(parts), Finder::default);
        let (this, t) = (&*self, state.t);
        let known = (state.steps > 0).then_some(&state.memory);
        let share = this.pairs.len().div_ceil(parts).max(1);
        let used = this.pairs.len().div_ceil(share);
        crew.spread((0..used, &mut finders[..used]), this.pairs.len(), |(numbers, finders)| {
            for (k, finder) in numbers.zip(finders) {
                let end = this.pairs.len().min(share * (k + 1));
                let axes = &state.memory.axes[..];
                this.find((world, t), margins, &this.pairs[share * k..end], (axes, known), finder);
            }
        });
        if budget::over() {
            out.clear();
            self.finders = finders;
            return;
        }
        if let [only] = &mut finders[..used] {
            std::mem::swap(out, &mut only.found);
            std::mem::swap(&mut self.axes, &mut only.axes);
        } else {
            let found = finders[..used].iter().map(|f| &f.found[..]);
            crew.join(found, out);
            self.axes.clear();
            finders[..used].iter().for_each(|f| self.axes.extend_from_slice(&f.axes));
        }
        self.finders = finders;
        std::mem::swap(&mut state.memory.axes, &mut self.axes);
        self.facing.find(world, state, (margins, &self.nodes), out, feet);
    }

    /// The narrow phase of consecutive pairs, with the separating axes `known` and what is remembered of the step before, if there was one; all lists are sorted.
    fn find(
        &self,
        (world, t): (&World, f64),
        margins: &[f64],
        pairs: &[Pair],
        (known, before): (&[(Pair, Axis)], Option<&ContactMemory>),
        finder: &mut Finder,
    ) {
        finder.found.clear();
        finder.axes.clear();
        let Some(&start) = pairs.first() else { return };
        let mut last = known.partition_point(|k| k.0 < start);
        let (mut bodies, mut may) = ((u32::MAX, u32::MAX, [0; 3]), false);
        for &pair in pairs {
            if budget::over() {
                return;
            }
            let Pair { first: i, second: j, image } = pair;
            let (p, q) = (self.solids[i as usize].body, self.solids[j as usize].body);
            if (p, q, image) != bodies {
                bodies = (p, q, image);
                may = p != q && self.may_touch(world, p, q, image);
            }
            if !may {
                continue;
            }
            while last < known.len() && known[last].0 < pair {
                last += 1;
            }
            let axis = known.get(last).filter(|k| k.0 == pair).map(|k| k.1);
            let reach = Reach { margins: [p, q].map(|body| margins[body as usize]), before };
            let first = finder.found.len();
            let now = self.narrow((world, t), pair, axis, reach, finder);
            finder.axes.extend(now.map(|now| (pair, now)));
            finder.found[first..].sort_unstable_by_key(|n| n.key);
            let surface = |k: u32| matches!(self.solids[k as usize].solid, Solid::Surface(_));
            if surface(i) || surface(j) {
                merge(&mut finder.found, first);
            }
        }
    }

    /// Nodes do not touch nodes. Bodies that are kept apart may touch images of each other.
    fn may_touch(&self, world: &World, p: u32, q: u32, image: Image) -> bool {
        let [p_is_node, q_is_node] = [p, q].map(|k| k as usize >= self.bodies);
        match p_is_node || q_is_node {
            true => p_is_node != q_is_node,
            false if image == [0; 3] => world.may_touch(BodyId(p), BodyId(q)),
            false => world.may_meet(BodyId(p), BodyId(q)),
        }
    }

    /// Poses of bodies, vertices of polyhedra and boxes of finite shapes.
    fn place(&mut self, world: &World, state: &State, margins: &[f64], crew: &Crew) {
        let anew = self.poses.is_empty();
        self.poses.resize(self.bodies, Pose::at([0.0; 3]));
        crew.spread((0..self.bodies, &mut self.poses[..]), self.bodies, |(numbers, poses)| {
            numbers.zip(poses).for_each(|(k, pose)| *pose = state.pose(k));
        });
        self.poses.extend(self.nodes.list.iter().map(|n| Pose::at(n.position(&state.elastic))));
        let Self { solids, hulls, bounds, poses, .. } = self;
        let count = solids.len();
        crew.spread((&solids[..], &mut hulls[..], &mut bounds[..]), count, |(solids, h, b)| {
            for ((shape, posed), bounds) in solids.iter().zip(h).zip(b) {
                let body = shape.body as usize;
                let still = world.bodies.get(body).is_some_and(|b| b.motion == Motion::Fixed);
                shape.place(&poses[body], margins[body], (anew || !still, posed), bounds);
            }
        });
        self.boxes.clear();
        self.boxes.extend(self.finite.iter().map(|&k| self.bounds[k as usize]));
    }

    /// The pairs of boxes that meet.
    fn meet(&mut self, world: &World, t: f64, crew: &Crew) {
        let Self { solids, finite, poses, boxes, box_moves, broad, met, images, pairs, .. } = self;
        if world.periodic.periods.is_empty() {
            met.clear();
            broad.pairs(boxes, box_moves, crew, met);
            pairs.extend(met.iter().map(|&(i, j)| Pair::of(i, j)));
        } else {
            let centre = |k: usize| poses[solids[finite[k] as usize].body as usize].x;
            images.pairs(&world.periodic.lattice(t), (boxes, box_moves), centre, crew, pairs);
        }
        for pair in pairs {
            // Places among the finite shapes, which keep the order of all shapes.
            pair.first = finite[pair.first as usize];
            pair.second = finite[pair.second as usize];
        }
    }

    /// A plane has no box: those shapes whose box reaches below it. Where images move it has the velocity of its image in the cell of the body.
    fn pairs_with_planes(&mut self, world: &World, t: f64, margins: &[f64]) {
        let lattice = world.periodic.moves().then(|| world.periodic.lattice(t));
        let cell = |x: Vec3| lattice.as_ref().map_or([0; 3], |l| l.image(l.cell(x)));
        for &k in &self.planes {
            let Solids { body, solid: Solid::Plane(pose), .. } = &self.solids[k as usize] else {
                continue;
            };
            let pose = self.poses[*body as usize].then(pose);
            let n = pose.direction([0.0, 0.0, 1.0]);
            let offset = nonsmooth_scenes::vec3::dot(n, pose.x) + margins[*body as usize];
            for (b, &j) in self.boxes.iter().zip(&self.finite) {
                let least: f64 =
                    (0..3).map(|i| n[i] * if n[i] > 0.0 { b.low[i] } else { b.high[i] }).sum();
                let body = self.solids[j as usize].body as usize;
                if least <= offset && self.moves[body] {
                    let cell = cell(self.poses[body].x);
                    let image = if k < j { cell } else { cell.map(|n| -n) };
                    self.pairs.push(Pair { image, ..Pair::of(k, j) });
                }
            }
        }
    }

    fn narrow(
        &self,
        (world, time): (&World, f64),
        Pair { first: i, second: j, image }: Pair,
        axis: Option<Axis>,
        Reach { margins, before }: Reach,
        Finder { clip, scratch, found: out, image: moved, .. }: &mut Finder,
    ) -> Option<Axis> {
        let Self { solids, poses, hulls, boxes, box_of, .. } = self;
        let (s, t) = (&solids[i as usize], &solids[j as usize]);
        let (a, b) = (&poses[s.body as usize], &poses[t.body as usize]);
        let (hull_a, hull_b) = (&hulls[i as usize], &hulls[j as usize]);
        let here = image == [0; 3];
        let beside = match here {
            true => Beside::default(),
            false => {
                let (offset, velocity) = world.periodic.offset(image, time);
                Beside { offset, velocity }
            }
        };
        let offset = beside.offset;
        let posed;
        let (a, hull_a) = match here {
            true => (a, hull_a),
            false => {
                posed = beside.pose(a, 0.0);
                moved.set_moved(hull_a, offset);
                (&posed, &*moved)
            }
        };
        let prediction = margins[0] + margins[1];
        let law = world.law_between(s.material, t.material);
        let compliance = world.compliance_between(s.material, t.material);
        let size = s.size.min(t.size);
        let fallback = || {
            // Bodies that coincide leave no direction: from the one centre to the other, upwards if these do too.
            let d = sub(b.x, a.x);
            let length = nonsmooth_scenes::vec3::norm(d);
            let upwards = match world.dimension {
                Dimension::Three => [0.0, 0.0, 1.0],
                Dimension::Two => [0.0, 1.0, 0.0],
            };
            if length > 0.0 { scale(1.0 / length, d) } else { upwards }
        };
        let mut found = |[f, g]: [Feature; 2], witness: Witness| {
            let place = witness.place(a, b, fallback());
            if place.gap <= prediction {
                let features = (f.code(), g.code());
                let key = Key {
                    shape_a: i,
                    shape_b: j,
                    image,
                    feature_a: features.0,
                    feature_b: features.1,
                };
                let deep = place.gap < -DEEP * size;
                let (a, b) = (s.body, t.body);
                let near =
                    Near { key, a, b, law, compliance, size, place, witness, image: beside, deep };
                out.push(near);
            }
        };
        let center = |segment: &Segment, pose: &Pose| pose.point(segment.p);
        match (&s.solid, &t.solid) {
            (Solid::Rounded(p, r), Solid::Rounded(q, o)) => {
                rounds::rounds((*p, *r, a), (*q, *o, b), found);
                None
            }
            (Solid::Plane(plane), Solid::Rounded(q, r)) => {
                let plane = a.then(plane);
                rounds::plane(true, &plane, a, ends(q, b), *r, prediction, found);
                None
            }
            (Solid::Rounded(q, r), Solid::Plane(plane)) => {
                let plane = b.then(plane);
                rounds::plane(false, &plane, b, ends(q, a), *r, prediction, found);
                None
            }
            (Solid::Plane(plane), Solid::Hull(hull)) => {
                let points = corners(hull, hull_b);
                rounds::plane(true, &a.then(plane), a, points, 0.0, prediction, found);
                None
            }
            (Solid::Hull(hull), Solid::Plane(plane)) => {
                let points = corners(hull, hull_a);
                rounds::plane(false, &b.then(plane), b, points, 0.0, prediction, found);
                None
            }
            (Solid::Plane(plane), Solid::Outline(p)) => {
                let points = numbered(&p.vertices, hull_b);
                rounds::plane(true, &a.then(plane), a, points, 0.0, prediction, found);
                None
            }
            (Solid::Outline(p), Solid::Plane(plane)) => {
                let points = numbered(&p.vertices, hull_a);
                rounds::plane(false, &b.then(plane), b, points, 0.0, prediction, found);
                None
            }
            (Solid::Outline(p), Solid::Outline(q)) => {
                let first = Polygonal::of(p, hull_a, a);
                let second = Polygonal::of(q, hull_b, b);
                outline::collide(&first, &second, axis, prediction, found)
            }
            (Solid::Outline(p), Solid::Rounded(q, r)) => {
                let flat = Polygonal::of(p, hull_a, a);
                if q.is_point() {
                    outline::disc((q.p, center(q, b), *r), &flat, true, prediction, found);
                    return None;
                }
                outline::collide(&flat, &Rod::new(q, *r, b).flat(), axis, prediction, found)
            }
            (Solid::Rounded(q, r), Solid::Outline(p)) => {
                let flat = Polygonal::of(p, hull_b, b);
                if q.is_point() {
                    outline::disc((q.p, center(q, a), *r), &flat, false, prediction, found);
                    return None;
                }
                outline::collide(&Rod::new(q, *r, a).flat(), &flat, axis, prediction, found)
            }
            (Solid::Hull(hull), Solid::Rounded(q, r)) if q.is_point() => {
                let side = (&**hull, hull_a, a);
                let ball = (q.p, center(q, b), *r);
                rounds::ball_and_hull(ball, side, true, prediction, found);
                None
            }
            (Solid::Rounded(q, r), Solid::Hull(hull)) if q.is_point() => {
                let side = (&**hull, hull_b, b);
                let ball = (q.p, center(q, a), *r);
                rounds::ball_and_hull(ball, side, false, prediction, found);
                None
            }
            (Solid::Turned(turned), Solid::Rounded(q, r)) if q.is_point() => {
                let ball = (q.p, center(q, b), *r);
                turned::ball(ball, (turned, &turned.placed(a)), true, found);
                None
            }
            (Solid::Rounded(q, r), Solid::Turned(turned)) if q.is_point() => {
                let ball = (q.p, center(q, a), *r);
                turned::ball(ball, (turned, &turned.placed(b)), false, found);
                None
            }
            (Solid::Plane(plane), Solid::Turned(_)) => {
                let side = side(&t.solid, hull_b, b);
                let flat = half_space(a.then(plane), a);
                side.iter().for_each(|s| convex::on_flat(&flat, true, s, prediction, &mut found));
                None
            }
            (Solid::Turned(_), Solid::Plane(plane)) => {
                let side = side(&s.solid, hull_a, a);
                let flat = half_space(b.then(plane), b);
                side.iter().for_each(|s| convex::on_flat(&flat, false, s, prediction, &mut found));
                None
            }
            (Solid::Plane(plane), Solid::Surface(surface)) => {
                let points = knots(surface, hull_b);
                rounds::plane(true, &a.then(plane), a, points, 0.0, prediction, found);
                None
            }
            (Solid::Surface(surface), Solid::Plane(plane)) => {
                let points = knots(surface, hull_a);
                rounds::plane(false, &b.then(plane), b, points, 0.0, prediction, found);
                None
            }
            (Solid::Surface(p), Solid::Surface(q)) => {
                // Of what was never looked at nothing is known.
                let depth = before.map_or(f64::INFINITY, |memory| memory.depth((i, j)));
                surfaces::collide((p, a), (q, b), (prediction, depth), (clip, scratch), found);
                None
            }
            (Solid::Surface(surface), other) => {
                if let Some(other) = side(other, hull_b, b) {
                    let bounds = &boxes[box_of[j as usize] as usize].grown(margins[0]);
                    surface.collide((a, &other, bounds), prediction, (clip, scratch), found);
                }
                None
            }
            (other, Solid::Surface(surface)) => {
                if let Some(other) = side(other, hull_a, a) {
                    let bounds = boxes[box_of[i as usize] as usize].moved(offset);
                    let bounds = &bounds.grown(margins[1]);
                    let swapped = |[f, g]: [Feature; 2], w: Witness| found([g, f], w.swapped());
                    surface.collide((b, &other, bounds), prediction, (clip, scratch), swapped);
                }
                None
            }
            (Solid::Hull(p), Solid::Hull(q)) => {
                let first = (&**p, hull_a, a);
                let second = (&**q, hull_b, b);
                clip.collide(first, second, axis, prediction, &mut found)
            }
            (Solid::Plane(_), Solid::Plane(_)) => None,
            (p, q) => {
                let both = (side(p, hull_a, a), side(q, hull_b, b));
                if let (Some(p), Some(q)) = both {
                    convex::collide(&p, &q, prediction, found);
                }
                None
            }
        }
    }
}

/// How far two shapes are looked for: the margins of their bodies, which the box of each has already, and what is remembered of the step before, if there was one.
#[derive(Clone, Copy)]
struct Reach<'a> {
    margins: [f64; 2],
    before: Option<&'a ContactMemory>,
}

/// Points of a surface and another shape at the same place with the same normal become one, that of the least key; of those with one key the deepest is left.
fn merge(out: &mut Vec<Near>, first: usize) {
    let mut kept = first;
    for k in first..out.len() {
        let Near { key, place, size, .. } = out[k];
        let same = |other: &Near| {
            let far = nonsmooth_scenes::vec3::norm(sub(other.place.point, place.point));
            other.key == key
                || (far <= SAME * size
                    && nonsmooth_scenes::vec3::dot(other.place.normal, place.normal) > ALIKE)
        };
        match out[first..kept].iter().position(same) {
            None => {
                out[kept] = out[k];
                kept += 1;
            }
            // Two sides of one feature: the deeper one holds.
            Some(p) if out[first + p].key == key && place.gap < out[first + p].place.gap => {
                out[first + p] = out[k];
            }
            Some(_) => {}
        }
    }
    out.truncate(kept);
}

/// The frame of a half plane with its normal in the plane to the last bit: what leaves it by rounding would take the bodies with it.
fn flat(pose: &Pose) -> Pose {
    let [x, y, _] = pose.direction([0.0, 0.0, 1.0]);
    let length = x.hypot(y);
    let (x, y) = (x / length, y / length);
    Pose { x: pose.x, r: [[-y, 0.0, x], [x, 0.0, y], [0.0, 1.0, 0.0]] }
}

/// A convex solid that is neither a half space nor a surface, where it is.
fn side<'a>(solid: &'a Solid, posed: &'a PosedHull, pose: &'a Pose) -> Option<Side<'a>> {
    match solid {
        Solid::Hull(hull) => Some(Side::Hull { hull, posed, pose }),
        Solid::Turned(turned) => {
            Some(Side::Turned { local: turned, world: turned.placed(pose), pose })
        }
        Solid::Rounded(local, radius) => {
            let world = local.placed(pose);
            Some(Side::Rod { local: *local, world, radius: *radius, pose })
        }
        Solid::Plane(_) | Solid::Surface(_) | Solid::Outline(_) => None,
    }
}

/// The half space below the first two axes of `plane`, of the body at `pose`.
fn half_space(plane: Pose, pose: &Pose) -> Flat<'_> {
    let normal = plane.direction([0.0, 0.0, 1.0]);
    Flat {
        feature: Feature::Face(0),
        normal,
        local: pose.local_direction(normal),
        point: plane.x,
        pose,
        extent: Extent::All,
    }
}

/// The vertices of a surface that are more than points of a plane, as features, in the frame of the body and in the world.
fn knots<'a>(
    surface: &'a Surface,
    posed: &'a PosedHull,
) -> impl Iterator<Item = (Feature, Vec3, Vec3)> + 'a {
    surface.corners().map(|k| (Feature::Vertex(k as u32), surface.vertices[k], posed.vertices[k]))
}

/// The ends of a segment as features, in the frame of the body and in the world; one of a point.
fn ends<'a>(s: &'a Segment, pose: &'a Pose) -> impl Iterator<Item = (Feature, Vec3, Vec3)> + 'a {
    let count = if s.d == [0.0; 3] { 1 } else { 2 };
    (0..count).map(move |k| {
        let p = s.at(f64::from(k));
        (Feature::Curved(k as u32), p, pose.point(p))
    })
}

fn corners<'a>(
    hull: &'a Hull,
    posed: &'a PosedHull,
) -> impl Iterator<Item = (Feature, Vec3, Vec3)> + 'a {
    numbered(&hull.vertices, posed)
}

fn numbered<'a>(
    local: &'a [Vec3],
    posed: &'a PosedHull,
) -> impl Iterator<Item = (Feature, Vec3, Vec3)> + 'a {
    let both = local.iter().zip(&posed.vertices);
    both.enumerate().map(|(k, (&p, &q))| (Feature::Vertex(k as u32), p, q))
}

#[cfg(test)]
mod tests;
