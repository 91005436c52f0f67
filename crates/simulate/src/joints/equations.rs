//! The equations of joints, their gradients, and their coordinates, at any configuration.

use nonsmooth_scenes::vec3::{Mat3, Vec3, add, cross, dot, norm, scale, sub};

use super::{Coordinate, Coupling, Joint, JointId, JointKind};
use crate::rotation::Pose;
use crate::{Body, Dimension, World};

/// What a unit impulse along a row does to a body, in the world frame: force and moment about its mass centre. Read the other way round: the rate of the row
/// is `Σ force · v + moment · ω` over its levers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    pub body: u32,
    pub force: Vec3,
    pub moment: Vec3,
}

impl Reach {
    /// Whether it moves anything in the plane of the first two axes: of unit forces and moments there is nothing else to tell apart.
    fn is_in_plane(&self) -> bool {
        let Self { force: [x, y, _], moment, .. } = self;
        let turns = self.force == [0.0; 3] && moment[2].abs() > 0.5;
        x.hypot(*y) > 0.5 || turns
    }
}

/// An equation `φ = 0`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Equation {
    /// φ.
    pub value: f64,
    /// Of φ with respect to the positions of the bodies.
    pub gradient: Vec<Reach>,
    /// What `gradient · velocities` is to be: zero unless φ depends on time.
    pub target: f64,
}

impl Equation {
    pub fn new(value: f64, gradient: Vec<Reach>) -> Self {
        Self { value, gradient, target: 0.0 }
    }
}

/// A joint in the frames of its bodies.
#[derive(Debug, Clone)]
pub(crate) struct Linkage {
    pub kind: JointKind,
    pub a: Option<u32>,
    pub b: u32,
    /// Whether it is reported on a.
    pub on_a: bool,
    in_a: Pose,
    in_b: Pose,
    length: f64,
    /// The largest radius of gyration of its bodies, m.
    gyration: f64,
    /// Of which equations there is something in the plane of a world that is one, a bit each.
    kept: u32,
}

/// A joint at a configuration: the two frames, axes by rows, and the mass centres.
pub(crate) struct Placed {
    p: [Vec3; 2],
    axes: [[Vec3; 3]; 2],
    centres: [Vec3; 2],
    d: Vec3,
}

fn columns(r: &Mat3) -> [Vec3; 3] {
    std::array::from_fn(|k| std::array::from_fn(|i| r[i][k]))
}

impl Linkage {
    /// The joint of a world whose bodies stand as they were built.
    pub fn new(joint: &Joint, world: &World) -> Self {
        let frame = joint.frame().expect("validated");
        let of = |body: Option<usize>| match body {
            Some(k) => {
                let b = &world.bodies[k];
                Pose { x: b.position, r: b.rotation.matrix() }
            }
            None => WORLD,
        };
        let local = |body: Option<usize>, anchor: Vec3| {
            let pose = of(body);
            let axes = frame.map(|axis| pose.local_direction(axis));
            Pose { x: pose.local_point(anchor), r: columns(&axes) }
        };
        let a = joint.a.map(|a| a.index());
        let linkage = Self {
            kept: u32::MAX,
            kind: joint.kind,
            a: a.map(|a| a as u32),
            b: joint.b.0,
            on_a: joint.on_a,
            in_a: local(a, joint.anchors[0]),
            in_b: local(Some(joint.b.index()), joint.anchors[1]),
            length: norm(sub(joint.anchors[1], joint.anchors[0])),
            gyration: a.into_iter().chain([joint.b.index()]).fold(0.0, |most, k| {
                let Body { mass, inertia: j, .. } = &world.bodies[k];
                let moved = world.bodies[k].is_free();
                let square = if moved { (j[0][0] + j[1][1] + j[2][2]) / (3.0 * mass) } else { 0.0 };
                f64::max(most, square.sqrt())
            }),
        };
        match world.dimension {
            Dimension::Three => linkage,
            Dimension::Two => {
                let all = linkage.equations(&linkage.place(|k| of(Some(k as usize))), 0.0);
                let acts = |e: &Equation| e.gradient.iter().any(Reach::is_in_plane);
                let bits = all.iter().enumerate().filter(|e| acts(e.1)).map(|e| 1 << e.0);
                Self { kept: bits.sum(), ..linkage }
            }
        }
    }

    /// Where its frames are.
    pub fn place(&self, pose: impl Fn(u32) -> Pose) -> Placed {
        let (a, b) = (self.a.map_or(WORLD, &pose), pose(self.b));
        let (fa, fb) = (a.then(&self.in_a), b.then(&self.in_b));
        Placed {
            p: [fa.x, fb.x],
            axes: [columns(&fa.r), columns(&fb.r)],
            centres: [a.x, b.x],
            d: sub(fb.x, fa.x),
        }
    }

    /// The two bodies' parts of a row: along n, fixed in a, through the anchor of b.
    fn coincidence(&self, at: &Placed, n: Vec3) -> Vec<Reach> {
        let on = |body: u32, sign: f64, centre: Vec3| Reach {
            body,
            force: scale(sign, n),
            moment: scale(sign, cross(sub(at.p[1], centre), n)),
        };
        let a = self.a.map(|a| on(a, -1.0, at.centres[0]));
        a.into_iter().chain([on(self.b, 1.0, at.centres[1])]).collect()
    }

    /// The same of a turn about n.
    fn turn(&self, n: Vec3) -> Vec<Reach> {
        let on = |body: u32, sign: f64| Reach { body, force: [0.0; 3], moment: scale(sign, n) };
        self.a.map(|a| on(a, -1.0)).into_iter().chain([on(self.b, 1.0)]).collect()
    }

    /// All equations with their gradients; `angle` is the coordinate that goes on beyond a full turn.
    pub fn equations(&self, at: &Placed, angle: f64) -> Vec<Equation> {
        let [[a1, a2, a3], [b1, b2, b3]] = at.axes;
        let along = |n: Vec3| Equation::new(dot(n, at.d), self.coincidence(at, n));
        // φ = s·t with s on a and t on b: φ' = (s × t)·(ω_a − ω_b).
        let right = |s: Vec3, t: Vec3| Equation::new(dot(s, t), self.turn(cross(t, s)));
        use JointKind::*;
        let mut out = vec![];
        match self.kind {
            Fixed | Revolute | Spherical | Universal => {
                out.extend([a1, a2, a3].map(along));
            }
            Prismatic | Cylindrical | Screw { .. } | PointOnLine => out.extend([a1, a2].map(along)),
            Planar | PointOnPlane => out.push(along(a3)),
            Distance => {
                let n = scale(1.0 / self.length, at.d);
                let phi = 0.5 * (dot(at.d, at.d) / self.length - self.length);
                let on = |body: u32, sign: f64, k: usize| Reach {
                    body,
                    force: scale(sign, n),
                    moment: scale(sign, cross(sub(at.p[k], at.centres[k]), n)),
                };
                let a = self.a.map(|a| on(a, -1.0, 0));
                let gradient = a.into_iter().chain([on(self.b, 1.0, 1)]).collect();
                out.push(Equation::new(phi, gradient));
            }
        }
        match self.kind {
            Fixed | Prismatic => out.extend([right(a1, b2), right(a2, b3), right(a3, b1)]),
            Revolute | Cylindrical | Screw { .. } | Planar => {
                out.extend([right(a1, b3), right(a2, b3)]);
            }
            Universal => out.push(right(a1, b2)),
            _ => {}
        }
        if let Screw { pitch } = self.kind {
            let phi = dot(a3, at.d) - pitch * angle;
            let mut reach = self.coincidence(at, a3);
            for (r, turn) in reach.iter_mut().zip(self.turn(a3)) {
                r.moment = sub(r.moment, scale(pitch, turn.moment));
            }
            out.push(Equation::new(phi, reach));
        }
        let mut number = 0;
        out.retain(|_| {
            number += 1;
            self.kept & (1 << (number - 1)) != 0
        });
        out
    }

    /// The gradient of a coordinate.
    pub fn gradient(&self, at: &Placed, coordinate: Coordinate) -> Vec<Reach> {
        let axis = at.axes[0][2];
        match coordinate {
            Coordinate::Angle => self.turn(axis),
            Coordinate::Slide => self.coincidence(at, axis),
        }
    }

    /// The slide, and the angle that is nearest to `last`.
    pub fn coordinates(&self, at: &Placed, last: f64) -> [f64; 2] {
        let [[a1, a2, a3], [b1, ..]] = at.axes;
        let raw = dot(b1, a2).atan2(dot(b1, a1));
        let turns = ((last - raw) / std::f64::consts::TAU).round();
        [raw + turns * std::f64::consts::TAU, dot(a3, at.d)]
    }

    /// What turns an angle into a length: the distance of the anchors from the mass centres, or the radius of gyration `√(tr J / (3 m))` of a body, where that is
    /// larger. So a joint whose anchor is a mass centre has a size too, against which its slides and violations are measured.
    pub fn size(&self) -> f64 {
        norm(self.in_a.x).max(norm(self.in_b.x)).max(self.length).max(self.gyration)
    }
}

impl Placed {
    /// The anchor of b, or that of a.
    pub fn anchor(&self, on_a: bool) -> Vec3 {
        self.p[usize::from(!on_a)]
    }
}

/// The pose of what is no body.
const WORLD: Pose = Pose { x: [0.0; 3], r: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

/// The equation of a coupling: weighted coordinates with their gradients.
pub(crate) fn coupled(
    coupling: &Coupling,
    mut each: impl FnMut(JointId, Coordinate) -> (f64, Vec<Reach>),
) -> Equation {
    let (mut phi, mut reach) = (0.0, vec![]);
    for &(joint, coordinate, weight) in &coupling.terms {
        let (value, gradient) = each(joint, coordinate);
        phi += weight * value;
        reach.extend(gradient.into_iter().map(|r| Reach {
            body: r.body,
            force: scale(weight, r.force),
            moment: scale(weight, r.moment),
        }));
    }
    Equation::new(phi, merged(reach))
}

/// One lever a body.
fn merged(mut reach: Vec<Reach>) -> Vec<Reach> {
    reach.sort_by_key(|r| r.body);
    let mut out: Vec<Reach> = vec![];
    for r in reach {
        match out.last_mut() {
            Some(last) if last.body == r.body => {
                last.force = add(last.force, r.force);
                last.moment = add(last.moment, r.moment);
            }
            _ => out.push(r),
        }
    }
    out
}
