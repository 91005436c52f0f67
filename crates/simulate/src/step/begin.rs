//! Bodies at the beginning of a step: what acts on them, where they are extrapolated to, how far others are looked for.

use std::sync::atomic::{AtomicBool, Ordering};

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Mat3, Vec3, add, apply, norm, scale, sub};

use super::{Stride, Tools, are_finite};
use crate::detect::Detector;
use crate::joints::Joints;
use crate::moving::Moving;
use crate::rotation::{Pose, cayley, inverse};
use crate::state::{State, or_rest};
use crate::world::oscillation;
use crate::{Body, Dimension, Force, Geometry, Motion, Stabilisation, World, Wrenches};

/// What is the same at the beginning of every step, and the memory of forces.
pub(super) struct Start {
    built: Vec<Built>,
    /// Of each node of elastic solids half the least side of an element, m.
    node_sizes: Vec<f64>,
    wrenches: Wrenches,
    /// The state at the middle of the step, extrapolated.
    middle: State,
}

/// What of a body never changes.
struct Built {
    size: f64,
    /// The ball about the mass centre that holds what is finite of it, m.
    reach: f64,
    /// J and J⁻¹, and whether J is the same about all axes.
    inertia: Mat3,
    inverse: Mat3,
    isotropic: bool,
}

impl Built {
    fn new(body: &Body, dimension: Dimension, size: f64) -> Self {
        let finite = body.parts.iter().filter(|p| p.shape.radius().is_finite());
        // In the plane one moment of inertia is all there is.
        let j = match dimension {
            Dimension::Three => body.inertia,
            Dimension::Two => diagonal(body.inertia[2][2]),
        };
        Self {
            inertia: j,
            size,
            reach: finite.map(|p| norm(p.position) + p.shape.radius()).fold(0.0, f64::max),
            inverse: if body.is_free() { inverse(&j) } else { [[0.0; 3]; 3] },
            isotropic: j[0][0] == j[1][1]
                && j[1][1] == j[2][2]
                && [j[0][1], j[0][2], j[1][2]] == [0.0; 3],
        }
    }
}

fn diagonal(x: f64) -> Mat3 {
    [[x, 0.0, 0.0], [0.0, x, 0.0], [0.0, 0.0, x]]
}

impl Start {
    pub fn new(world: &World, state: &State, detector: &Detector) -> Self {
        let mut sizes = detector.sizes();
        let node_sizes = sizes.split_off(world.bodies.len());
        let built = world
            .bodies
            .iter()
            .zip(sizes)
            .map(|(body, size)| Built::new(body, world.dimension, size));
        Self {
            built: built.collect(),
            node_sizes,
            wrenches: Wrenches::default(),
            middle: State { memory: Default::default(), ..state.clone() },
        }
    }

    /// The number of bodies of the world.
    pub fn bodies(&self) -> usize {
        self.built.len()
    }

    /// Asks the forces, at the middle of the step.
    fn ask(&mut self, state: &State, forces: &mut [Box<dyn Force>], h: f64) {
        let Self { built, wrenches, middle, .. } = self;
        wrenches.clear(built.len(), [state.t, state.t + h]);
        if forces.is_empty() {
            return;
        }
        middle.t = state.t + 0.5 * h;
        middle.steps = state.steps;
        for k in 0..built.len() {
            let to = advanced(state, k, 0.5 * h);
            middle.position[k] = to.0;
            middle.rotation[k] = to.1.0;
        }
        middle.velocity.clone_from(&state.velocity);
        middle.spin.clone_from(&state.spin);
        middle.elastic.clone_from(&state.elastic);
        for force in forces {
            force.add(middle, wrenches);
        }
    }

    /// Writes body k, which is extrapolated with the velocities of `moves`; a bound on the speed of its points in a cell that moves with this velocity.
    fn body(
        &self,
        k: usize,
        stride: Stride,
        (state, moves): (&State, &State),
        cell: Vec3,
        b: &mut Moving,
    ) -> f64 {
        let Stride { world, scheme, h } = stride;
        let (body, built) = (&world.bodies[k], &self.built[k]);
        let start = state.pose(k);
        let free = body.is_free();
        let weight = if free { scale(body.mass, world.gravity) } else { [0.0; 3] };
        let mut push = add(weight, add(body.force, self.wrenches.force[k]));
        let mut twist = add(body.torque, self.wrenches.torque[k]);
        if world.dimension == Dimension::Two {
            // What a force would do across the plane is taken by the plane.
            (push[2], twist[0], twist[1]) = (0.0 * push[2], 0.0 * twist[0], 0.0 * twist[1]);
        }
        let (v, spin) = (or_rest(state.velocity[k]), or_rest(state.spin[k]));
        let spin = if built.isotropic { apply(&start.r, spin) } else { spin };
        *b = Moving {
            owner: k as u32,
            free,
            isotropic: built.isotropic,
            mass: body.mass,
            inertia: built.inertia,
            inverse: built.inverse,
            radius: built.reach.max(built.size),
            start,
            v,
            spin,
            push: scale(h, push),
            twist: scale(h, twist),
            weight,
            middle: start,
            end: start,
            linear: [[0.0; 3]; 2],
            angular: [0.0; 3],
            frame: [[0.0; 3]; 3],
            frame_end: [[0.0; 3]; 3],
            v_new: v,
            spin_new: spin,
            v_free: [0.0; 3],
            spin_free: [0.0; 3],
            impulse: [0.0; 3],
            moment: [0.0; 3],
        };
        let turns = scheme.geometry != Geometry::Frozen;
        let mut speed = 0.0;
        match body.motion {
            Motion::Fixed => {}
            Motion::Surface { linear, angular } => (b.linear, b.angular) = ([linear; 2], angular),
            Motion::Free => {
                speed = norm(sub(b.v, cell)) + norm(spin) * built.reach;
                for (pose, part) in [(&mut b.middle, 0.5), (&mut b.end, 1.0)] {
                    if turns {
                        let (x, q) = advanced(moves, k, part * h);
                        *pose = Pose { x, r: q.matrix() };
                    }
                }
            }
            Motion::Uniform { velocity } => {
                speed = norm(velocity);
                b.linear = [velocity; 2];
                for (pose, part) in [(&mut b.middle, 0.5), (&mut b.end, 1.0)] {
                    if turns {
                        pose.x = add(start.x, scale(part * h, velocity));
                    }
                }
            }
            Motion::Oscillating { amplitude, frequency, phase } => {
                speed = norm(amplitude) * frequency.abs();
                let at = |t: f64| oscillation(amplitude, frequency, phase, t);
                b.linear = [at(state.t).1, at(state.t + h).1];
                if turns {
                    b.middle.x = add(body.position, at(state.t + 0.5 * h).0);
                    b.end.x = add(body.position, at(state.t + h).0);
                }
            }
        }
        speed
    }

    /// A node of an elastic solid that moves with this velocity, and with the free one where nothing touches it.
    pub fn node(place: Vec3, owner: u32, (v, v_free): (Vec3, Vec3), h: f64) -> Moving {
        let zero = [[0.0; 3]; 3];
        let at = |part: f64| Pose::at(add(place, scale(part * h, v)));
        Moving {
            owner,
            free: true,
            isotropic: true,
            mass: f64::INFINITY,
            inertia: zero,
            inverse: zero,
            radius: 0.0,
            start: at(0.0),
            v,
            spin: [0.0; 3],
            push: [0.0; 3],
            twist: [0.0; 3],
            weight: [0.0; 3],
            middle: at(0.5),
            end: at(1.0),
            linear: [[0.0; 3]; 2],
            angular: [0.0; 3],
            frame: zero,
            frame_end: zero,
            v_new: v_free,
            spin_new: [0.0; 3],
            v_free,
            spin_free: [0.0; 3],
            impulse: [0.0; 3],
            moment: [0.0; 3],
        }
    }

    /// Puts the extrapolated middle of the step on the joints: elsewhere equations that follow from the others where a loop is closed contradict them, and the
    /// loop would be locked.
    fn close_middle(
        &mut self,
        bodies: &mut [Moving],
        joints: &Joints,
        (world, state): (&World, &State),
        h: f64,
    ) {
        let middle = &mut self.middle;
        middle.t = state.t + 0.5 * h;
        middle.memory.angles.clone_from(&state.memory.angles);
        for (k, body) in bodies.iter().enumerate() {
            middle.position[k] = body.middle.x;
            middle.rotation[k] = match body.free {
                true => advanced(state, k, 0.5 * h).1.0,
                false => state.rotation[k],
            };
        }
        joints.project(world, middle);
        for (k, body) in bodies.iter_mut().enumerate().filter(|b| b.1.free) {
            body.middle = middle.pose(k);
        }
    }
}

impl Tools {
    /// Bodies at the beginning of a step, with forces and margins; false where something is no finite number.
    pub(super) fn begin(
        &mut self,
        stride: Stride,
        state: &State,
        forces: &mut [Box<dyn Force>],
    ) -> bool {
        let Stride { world, scheme, h } = stride;
        self.joints.fit(scheme, world, state);
        // The impulse that makes velocities fit acts where bodies come to with those they have; what that leaves of the rest of the step the projection takes.
        let projected = scheme.stabilisation != Stabilisation::None;
        let moves = self.joints.fitted.as_ref().filter(|_| !projected).unwrap_or(state);
        self.start.ask(moves, forces, h);
        let gravity = norm(world.gravity);
        let (gamma, slack) = scheme.activation.forecast().unwrap_or((1.0, 0.0));
        // Bodies come together as fast as they move in their cells, and as these do.
        let lattice = world.periodic.moves().then(|| world.periodic.lattice(state.t));
        let closing = lattice.as_ref().map_or(0.0, |l| 0.5 * world.periodic.closing(l));
        let count = world.bodies.len();
        self.bodies.resize(count, Start::node([0.0; 3], 0, ([0.0; 3], [0.0; 3]), 0.0));
        self.margins.resize(count, 0.0);
        let finite = AtomicBool::new(true);
        let Self { start, bodies, margins, crew, .. } = self;
        let start = &*start;
        crew.spread((0..count, &mut bodies[..], &mut margins[..]), count, |(numbers, b, m)| {
            for ((k, body), margin) in numbers.zip(b).zip(m) {
                let cell = lattice
                    .as_ref()
                    .map_or([0.0; 3], |l| world.periodic.velocity_at(l, state.position[k]));
                let speed = start.body(k, stride, (state, moves), cell, body) + closing;
                let fall = if body.free { h * h * gravity } else { 0.0 };
                let least = (1e-6_f64).max(slack) * start.built[k].size;
                *margin = (gamma + 1.0) * h * speed + fall + least;
                if !are_finite(body.push.into_iter().chain(body.twist)) {
                    finite.store(false, Ordering::Relaxed);
                }
                if body.free {
                    body.rotate(scheme, h);
                }
            }
        });
        let mut finite = finite.into_inner();
        finite &= self.solids.begin(stride, state);
        for (k, node) in self.solids.nodes.list.iter().enumerate() {
            let place = node.position(&state.elastic);
            let v = state.elastic[node.solid as usize].velocity[node.node as usize];
            let owner = world.bodies.len() as u32 + node.solid;
            let least = (1e-6_f64).max(slack) * self.start.node_sizes[k];
            self.margins.push((gamma + 1.0) * h * norm(v) + h * h * gravity + least);
            let stands = scheme.geometry == Geometry::Frozen;
            let free = self.solids.free(k);
            self.bodies.push(Start::node(place, owner, (v, free), if stands { 0.0 } else { h }));
        }
        if self.joints.redundant.is_some() && scheme.geometry != Geometry::Frozen {
            self.start.close_middle(&mut self.bodies, &self.joints, (world, moves), h);
        }
        finite
    }
}

/// Position and rotation of a body after it has moved for a time with its velocities.
fn advanced(state: &State, k: usize, time: f64) -> (Vec3, Rotation) {
    let x = add(state.position[k], scale(time, state.velocity[k]));
    (x, Rotation(state.rotation[k]).after(cayley(scale(time, state.spin[k]))))
}
