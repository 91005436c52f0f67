//! What is kept of a run: from a simulation to a trajectory, and from that to what plays it.
//!
//! `io` knows no scene and `simulate` no file; this is what stands between them, for the command line and for Python: also the [scenes](Origin) of other programs' files.

mod mechanics;
mod origin;

pub use origin::{Origin, OriginError};

use std::borrow::Cow;

use nonsmooth_io::Mesh;
use nonsmooth_io::trajectory::{Contact, Energy, Frame, Joint, Named, State, Step, Trajectory};
use nonsmooth_scenes::draw::playback::{self, Drawn, Form, Moment, Placed, Playback};
use nonsmooth_scenes::draw::{Pose, Touch, View};
use nonsmooth_scenes::vec3::{Vec3, add, mean, norm, sub};
use nonsmooth_scenes::{Rotation, SceneError};
use nonsmooth_simulate::{
    ContactReport, Dimension, Elastic, JointReport, SceneFile, Shape, Simulation, StepReport, World,
};

/// The trajectory of a run that has not begun: the scene, bodies and joints by their names.
pub fn begun(scene: &SceneFile, simulation: &Simulation) -> Trajectory {
    let world = simulation.world();
    let rigid = world.bodies.iter().map(|b| Named { name: b.name.clone(), fixed: !b.is_free() });
    let names = elastic_names(world);
    let named = rigid.chain(names.iter().map(|name| Named { name: name.clone(), fixed: false }));
    Trajectory {
        scene: scene.to_toml(),
        program: concat!("nonsmooth ", env!("CARGO_PKG_VERSION")).into(),
        bodies: named.collect(),
        elastic: names.clone(),
        joints: simulation.world().joints.iter().map(|j| j.name.clone()).collect(),
        ..Trajectory::default()
    }
}

/// The motion as it is now.
pub fn frame(simulation: &Simulation) -> Frame {
    let state = simulation.state();
    let rigid = (0..state.position.len()).map(|k| State {
        position: state.position[k],
        rotation: state.rotation[k],
        velocity: state.velocity[k],
        angular_velocity: state.angular_velocity(nonsmooth_simulate::BodyId(k as u32)),
    });
    let solids = || simulation.world().elastic.iter().zip(&state.elastic);
    let nodes: Vec<Vec<Vec3>> = solids().map(|(e, s)| e.positions(s).collect()).collect();
    let whole = nodes.iter().zip(&state.elastic).map(|(places, solid)| State {
        position: mean(places),
        rotation: [1.0, 0.0, 0.0, 0.0],
        velocity: mean(&solid.velocity),
        angular_velocity: [0.0; 3],
    });
    let bodies = rigid.chain(whole);
    Frame {
        step: state.steps,
        time: state.t,
        bodies: bodies.collect(),
        contacts: simulation.contacts().iter().map(contact).collect(),
        joints: simulation.joints().iter().map(joint).collect(),
        elastic: nodes.clone(),
    }
}

/// What elastic solids are called in a file, where those without a name have a number.
fn elastic_names(world: &World) -> Vec<String> {
    let taken = |name: &str| world.elastic.iter().any(|e| e.name == name);
    let own = |(k, e): (usize, &Elastic)| match e.name.as_str() {
        "" => {
            let mut name = format!("elastic {k}");
            while taken(&name) {
                name.push('\'');
            }
            name
        }
        name => name.into(),
    };
    world.elastic.iter().enumerate().map(own).collect()
}

/// What a step with this number came to.
pub fn step(number: u64, report: &StepReport) -> Step {
    let (e, c) = (&report.energy, &report.counts);
    Step {
        number,
        time: report.t,
        h: report.h,
        status: report.status.name(),
        residual: report.residual,
        iterations: c.iterations as u64,
        newton: report.newton,
        near: c.near as u32,
        active: c.active as u32,
        open: c.open as u32,
        stick: c.stick as u32,
        slip: c.slip as u32,
        penetration: report.drift.penetration,
        wall: report.timings.total,
        energy: Energy {
            kinetic: e.kinetic,
            potential: e.potential,
            gravity: e.gravity,
            forces: e.forces,
            normal: e.normal,
            tangential: e.tangential,
            drives: e.drives,
            joints: e.joints,
            numerical: e.numerical,
            imbalance: e.imbalance,
        },
    }
}

fn joint(j: &JointReport) -> Joint {
    Joint {
        angle: j.angle,
        slide: j.slide,
        impulse: j.impulse,
        moment: j.moment,
        violation: j.violation,
    }
}

fn contact(c: &ContactReport) -> Contact {
    Contact {
        key: [c.key.shape_a, c.key.shape_b, c.key.feature_a, c.key.feature_b],
        a: c.a.0,
        b: c.b.0,
        point: c.point,
        offset: c.offset,
        frame: c.frame,
        gap: c.gap,
        mu: c.mu,
        r: c.impulse,
        u: c.after,
        mu_r: c.mu_r,
        moment: c.moment,
        rolling: c.rolling,
        status: c.motion(),
    }
}

/// Time, energies, residual and counts, a row a step.
pub fn csv(trajectory: &Trajectory) -> String {
    let mut text = String::from(
        "step,t,h,status,residual,kinetic,work_gravity,work_forces,work_normal,work_tangential,work_drives,work_joints,numerical,imbalance,near,active,open,stick,slip,penetration,iterations,newton\n",
    );
    for s in &trajectory.steps {
        let e = &s.energy;
        let status = match s.status.contains([',', '"']) {
            true => format!("\"{}\"", s.status.replace('"', "\"\"")),
            false => s.status.clone(),
        };
        text += &format!(
            "{},{},{},{status},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{},{},{},{},{},{:e},{},{}\n",
            s.number,
            s.time,
            s.h,
            s.residual,
            e.kinetic,
            e.gravity,
            e.forces,
            e.normal,
            e.tangential,
            e.drives,
            e.joints,
            e.numerical,
            e.imbalance,
            s.near,
            s.active,
            s.open,
            s.stick,
            s.slip,
            s.penetration,
            s.iterations,
            s.newton
        );
    }
    text
}

/// A run of a world that repeats itself as pictures show it: bodies in its cell, contacts where these are. That of another world as it is.
pub fn in_cell<'a>(trajectory: &'a Trajectory, world: &World) -> Cow<'a, Trajectory> {
    if world.periodic.periods.is_empty() {
        return Cow::Borrowed(trajectory);
    }
    let mut shown = trajectory.clone();
    for frame in &mut shown.frames {
        let mut ways = vec![[0.0; 3]; frame.bodies.len()];
        let free = world.bodies.iter().map(|b| b.is_free());
        for ((state, way), _) in frame.bodies.iter_mut().zip(&mut ways).zip(free).filter(|b| b.1) {
            let (x, v) = world.in_cell(state.position, state.velocity, frame.time);
            *way = sub(x, state.position);
            (state.position, state.velocity) = (x, v);
        }
        for c in &mut frame.contacts {
            let [a, b] = [c.a, c.b].map(|k| k as usize);
            let own = sub(c.point, c.offset);
            match [a, b].map(|k| world.bodies[k].is_free()) {
                [true, true] => {
                    c.point = add(c.point, ways[b]);
                    c.offset = sub(c.point, add(own, ways[a]));
                }
                // What is fixed is drawn once: the contact belongs to what is free.
                [true, false] => (c.point, c.offset) = (add(own, ways[a]), [0.0; 3]),
                [false, _] => (c.point, c.offset) = (add(c.point, ways[b]), [0.0; 3]),
            }
        }
    }
    Cow::Owned(shown)
}

/// A run of a world in the plane as pictures show it: the plane stands, its second axis upwards. That of a world in space as it is.
pub fn upright<'a>(trajectory: &'a Trajectory, world: &World) -> Cow<'a, Trajectory> {
    if world.dimension == Dimension::Three {
        return Cow::Borrowed(trajectory);
    }
    let stand = |x: &mut Vec3| *x = [x[0], -x[2], x[1]];
    let quarter = Rotation::about([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2);
    let mut turned = trajectory.clone();
    for frame in &mut turned.frames {
        for State { position, rotation, velocity, angular_velocity } in &mut frame.bodies {
            [position, velocity, angular_velocity].into_iter().for_each(stand);
            *rotation = quarter.after(Rotation(*rotation)).0;
        }
        for contact in &mut frame.contacts {
            stand(&mut contact.point);
            stand(&mut contact.offset);
            contact.frame.iter_mut().for_each(stand);
        }
        for joint in &mut frame.joints {
            [&mut joint.impulse, &mut joint.moment].into_iter().for_each(stand);
        }
    }
    Cow::Owned(turned)
}

/// A prism on a polygon of the plane, `half` thick to both sides.
fn slab(corners: &[[f64; 2]], half: f64) -> Form {
    let n = corners.len();
    let at = |z: f64| corners.iter().map(move |&[x, y]| [x, y, z]);
    let side = |k: usize| vec![k, (k + 1) % n, n + (k + 1) % n, n + k];
    let ends = [(0..n).rev().collect(), (n..2 * n).collect()];
    Form::Polyhedron {
        vertices: at(-half).chain(at(half)).collect(),
        faces: ends.into_iter().chain((0..n).map(side)).collect(),
    }
}

/// A rounded segment of the plane as a polygon.
fn stadium(half_length: f64, radius: f64) -> Vec<[f64; 2]> {
    const STEPS: usize = 16;
    let around = |k: usize| {
        let end = k / (STEPS + 1);
        let angle = std::f64::consts::PI * ((k - end) as f64 / STEPS as f64 - 0.5);
        let (s, c) = angle.sin_cos();
        [radius * c + if end == 0 { half_length } else { -half_length }, radius * s]
    };
    (0..2 * (STEPS + 1)).map(around).collect()
}

/// How thick shapes of the plane are drawn to both sides, m.
fn thickness(world: &World) -> f64 {
    let radii = world.bodies.iter().flat_map(|b| &b.parts).map(|part| part.shape.radius());
    let least = radii.filter(|r| r.is_finite()).fold(f64::INFINITY, f64::min);
    if least.is_finite() { 0.3 * least } else { 1.0 }
}

/// The shapes of a world, as they are drawn.
fn drawn(world: &World) -> Vec<Drawn> {
    let thick = thickness(world);
    let form = |shape: &Shape| match shape {
        Shape::Sphere { radius } => Form::Sphere { radius: *radius },
        Shape::Box { half } => Form::Box { half: *half },
        Shape::Capsule { half_length, radius } => {
            Form::Capsule { half_length: *half_length, radius: *radius }
        }
        Shape::Plane => Form::Plane,
        Shape::Disc { radius } => Form::Cylinder { half_length: thick, radius: *radius },
        Shape::Polygon(p) => slab(p.vertices(), thick),
        Shape::Stadium { half_length, radius } => slab(&stadium(*half_length, *radius), thick),
        Shape::Polyhedron(p) => {
            Form::Polyhedron { vertices: p.vertices().to_vec(), faces: p.faces().to_vec() }
        }
        Shape::Cylinder { half_length, radius } => {
            Form::Cylinder { half_length: *half_length, radius: *radius }
        }
        Shape::Cone { half_length, radius } => {
            Form::Cone { half_length: *half_length, radius: *radius }
        }
        Shape::Mesh(mesh) => {
            let faces = mesh.triangles().iter().map(|t| t.map(|k| k as usize).to_vec()).collect();
            Form::Mesh { vertices: mesh.vertices().to_vec(), faces }
        }
    };
    let placed = |part: &nonsmooth_simulate::Part, form: Form| Placed {
        form,
        position: part.position,
        rotation: part.rotation,
    };
    // A disc has a bar, so that one sees it turn.
    let bar = |part: &nonsmooth_simulate::Part| match part.shape {
        Shape::Disc { radius } => {
            let half = [0.7 * radius, 0.08 * radius, 1.05 * thick];
            Some(placed(part, Form::Box { half }))
        }
        _ => None,
    };
    let bodies = world.bodies.iter().map(|body| Drawn {
        name: body.name.clone(),
        fixed: !body.is_free(),
        parts: body
            .parts
            .iter()
            .flat_map(|part| [Some(placed(part, form(&part.shape))), bar(part)])
            .flatten()
            .collect(),
    });
    let solids = world.elastic.iter().zip(elastic_names(world)).map(|(elastic, name)| {
        let (nodes, faces) = elastic.solid.skin();
        let places: Vec<Vec3> = elastic.solid.places().collect();
        let vertices = nodes.iter().map(|&node| sub(places[node], elastic.solid.position));
        let faces = faces.iter().map(|face| face.to_vec()).collect();
        let form = Form::Mesh { vertices: vertices.collect(), faces };
        let part = Placed { form, position: [0.0; 3], rotation: Rotation::IDENTITY };
        Drawn { name, fixed: false, parts: vec![part] }
    });
    bodies.chain(solids).collect()
}

/// What plays a trajectory of a world; its title is the scene's.
pub fn playback(trajectory: &Trajectory, scene: &SceneFile, world: &World) -> Playback {
    let trajectory = &*in_cell(trajectory, world);
    let trajectory = &*upright(trajectory, world);
    let view = match world.dimension {
        Dimension::Three => View::default(),
        // From the front, a little from above.
        Dimension::Two => View { azimuth: -90.0, elevation: 8.0, distance: 8.0 },
    };
    let pose =
        |s: &State| Pose { position: s.position, rotation: s.rotation, velocity: s.velocity };
    let touch = |c: &Contact| Touch {
        a: Some(c.a as usize),
        b: c.b as usize,
        point: c.point,
        offset: c.offset,
        frame: c.frame,
        mu: c.mu,
        r: Some(c.r),
        u: Some(c.u),
        status: c.status,
    };
    let skins: Vec<Vec<usize>> = world.elastic.iter().map(|e| e.solid.skin().0).collect();
    let shape = |(nodes, skin): (&Vec<Vec3>, &Vec<usize>)| {
        skin.iter().filter_map(|&node| nodes.get(node).copied()).collect()
    };
    let frames = trajectory.frames.iter().map(|f| Moment {
        time: f.time,
        poses: f.bodies.iter().map(pose).collect(),
        contacts: f.contacts.iter().map(touch).collect(),
        shapes: f.elastic.iter().zip(&skins).map(shape).collect(),
    });
    let energy = trajectory.steps.iter().map(|s| playback::Energy {
        time: s.time,
        kinetic: s.energy.kinetic,
        potential: s.energy.potential,
    });
    let periods = world.periods_at(0.0);
    let shortest = periods.into_iter().map(norm).fold(f64::INFINITY, f64::min);
    Playback {
        title: scene.name.clone(),
        view,
        bodies: drawn(world),
        frames: frames.collect(),
        energy: energy.collect(),
        residual: trajectory.steps.iter().map(|s| [s.time, s.residual]).collect(),
        jump: shortest.is_finite().then_some(0.5 * shortest),
    }
}

/// The page that plays a trajectory.
///
/// Errors: more than a page may hold.
pub fn page(
    trajectory: &Trajectory,
    scene: &SceneFile,
    world: &World,
) -> Result<String, SceneError> {
    playback(trajectory, scene, world).html(playback::LIMIT)
}

/// The surfaces of each body, for other viewers.
pub fn meshes(trajectory: &Trajectory, world: &World) -> Vec<Vec<Mesh>> {
    let nameless = SceneFile::of_family("", Default::default(), 1.0, 0.0);
    let surfaces = playback(trajectory, &nameless, world).surfaces();
    let mesh =
        |s: playback::Surface| Mesh { vertices: s.vertices, faces: s.faces, smooth: s.smooth };
    let mut meshes: Vec<Vec<Mesh>> =
        surfaces.into_iter().map(|all| all.into_iter().map(mesh).collect()).collect();
    // Vertices of elastic solids are all their nodes, as the frames have them.
    for (meshes, elastic) in meshes[world.bodies.len()..].iter_mut().zip(&world.elastic) {
        let (nodes, faces) = elastic.solid.skin();
        let centre = elastic.solid.position;
        *meshes = vec![Mesh {
            vertices: elastic.solid.places().map(|x| sub(x, centre)).collect(),
            faces: faces.iter().map(|face| face.map(|k| nodes[k]).to_vec()).collect(),
            smooth: false,
        }];
    }
    meshes
}
