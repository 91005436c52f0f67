//! Reading.

use std::path::Path;

use super::{
    Checkpoint, Contact, Energy, Frame, Joint, Named, STATUSES, State, Step, Trajectory, VERSION,
};
use crate::IoError;
use crate::folder::{Folder, open};
use crate::hdf5::Type;

pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Trajectory, IoError> {
    let file = open(path, bytes)?;
    let root = Folder::root(path, &file)?;
    if !root.has(VERSION.0)? {
        return Err(root.error("", format!("a trajectory, with /{}", VERSION.0), "another file"));
    }
    let version = root.int(VERSION.0)?;
    if version != VERSION.1 {
        return Err(root.error(VERSION.0, format!("version {}", VERSION.1), version));
    }
    let scene = root.need("scene")?;
    let text = |name| Ok(scene.text(name)?.unwrap_or_default());
    let frames = frames(&root)?;
    let bodies = named(&root.need("bodies")?)?;
    let mut run = Trajectory {
        scene: text("text")?,
        program: text("program")?,
        elastic: elastic(&root.need("bodies")?, &bodies)?,
        bodies,
        joints: root.need("joints")?.texts("name")?,
        frames: vec![],
        steps: steps(&root)?,
        checkpoint: root.folder("checkpoint")?.map(|g| checkpoint(&g)).transpose()?,
    };
    let (stored, found) = (text("sha256")?, run.digest());
    if stored != found {
        let expected = format!("a scene of SHA-256 {stored}");
        return Err(scene.error("text", expected, found));
    }
    run.frames = frames;
    fill(&root, &mut run)?;
    Ok(run)
}

fn named(g: &Folder) -> Result<Vec<Named>, IoError> {
    let names = g.texts("name")?;
    let fixed = g.numbers("fixed", &[names.len()])?;
    let of = |(name, fixed)| Named { name, fixed: fixed != 0 };
    Ok(names.into_iter().zip(fixed).map(of).collect())
}

/// The names of the elastic solids, which are the last of the bodies.
fn elastic(g: &Folder, bodies: &[Named]) -> Result<Vec<String>, IoError> {
    if !g.has("elastic")? {
        return Ok(vec![]);
    }
    let flags = g.numbers("elastic", &[bodies.len()])?;
    let first = flags.iter().position(|&flag| flag != 0).unwrap_or(bodies.len());
    if let Some(k) = flags[first..].iter().position(|&flag| flag == 0) {
        let place = format!("elastic[{}]", first + k);
        return Err(g.error(place, "1, for a body before it is elastic", 0));
    }
    Ok(bodies[first..].iter().map(|b| b.name.clone()).collect())
}

/// The frames, still without what is in them.
fn frames(root: &Folder) -> Result<Vec<Frame>, IoError> {
    let g = root.need("frames")?;
    let steps = g.naturals("step", None)?;
    let times = g.table("time", &[steps.len()])?;
    let of = |(step, time)| Frame { step, time, ..Frame::default() };
    Ok(steps.into_iter().zip(times).map(of).collect())
}

/// States of bodies, contacts.
fn fill(root: &Folder, run: &mut Trajectory) -> Result<(), IoError> {
    let (n, b) = (run.frames.len(), run.bodies.len());
    let g = root.need("bodies")?;
    let vectors = |name| g.vectors::<3>(name, &[n, b, 3]);
    let (position, velocity) = (vectors("position")?, vectors("velocity")?);
    let (angular, rotation) =
        (vectors("angular_velocity")?, g.vectors::<4>("rotation", &[n, b, 4])?);
    let state = |k: usize| State {
        position: position[k],
        rotation: rotation[k],
        velocity: velocity[k],
        angular_velocity: angular[k],
    };
    for (f, frame) in run.frames.iter_mut().enumerate() {
        frame.bodies = (f * b..(f + 1) * b).map(state).collect();
    }

    for name in &run.elastic {
        let g = root.need("elastic")?.need(name)?;
        let nodes = g.dataset("position")?.shape.get(1).copied().unwrap_or(0) as usize;
        let places = g.vectors::<3>("position", &[n, nodes, 3])?;
        for (f, frame) in run.frames.iter_mut().enumerate() {
            frame.elastic.push(places[f * nodes..(f + 1) * nodes].to_vec());
        }
    }

    let (g, j) = (root.need("joints")?, run.joints.len());
    let reals = |name| g.table(name, &[n, j]);
    let (angle, slide, violation) = (reals("angle")?, reals("slide")?, reals("violation")?);
    let vectors = |name| g.vectors::<3>(name, &[n, j, 3]);
    let (impulse, moment) = (vectors("impulse")?, vectors("moment")?);
    let joint = |k: usize| Joint {
        angle: angle[k],
        slide: slide[k],
        impulse: impulse[k],
        moment: moment[k],
        violation: violation[k],
    };
    for (f, frame) in run.frames.iter_mut().enumerate() {
        frame.joints = (f * j..(f + 1) * j).map(joint).collect();
    }

    let g = root.need("contacts")?;
    let a = g.naturals("a", Some(b))?;
    let c = a.len();
    let bodies = g.numbers("b", &[c])?;
    if let Some(k) = bodies.iter().position(|&i| i as usize >= b) {
        return Err(g.error(format_args!("b[{k}]"), format!("one of {b} bodies"), bodies[k]));
    }
    let offset = g.naturals("offset", None)?;
    let rises = offset.windows(2).all(|w| w[0] <= w[1]);
    if !rises
        || offset.len() != n + 1
        || offset.first() != Some(&0)
        || offset.last() != Some(&(c as u64))
    {
        let expected = format!("{} numbers that rise from 0 to {c}", n + 1);
        return Err(g.error("offset", expected, format!("{} others", offset.len())));
    }
    let key = g.numbers("key", &[c, 4])?;
    let vectors = |name| g.vectors::<3>(name, &[c, 3]);
    let (point, r, u) = (vectors("point")?, vectors("r_local")?, vectors("u")?);
    let beside = match g.has("offset_a")? {
        true => vectors("offset_a")?,
        false => vec![[0.0; 3]; c],
    };
    let rolls = g.has("mu_r")?;
    let mu_r = if rolls { g.table("mu_r", &[c])? } else { vec![0.0; c] };
    let pairs = |name| match rolls {
        true => g.vectors::<2>(name, &[c, 2]),
        false => Ok(vec![[0.0; 2]; c]),
    };
    let (moment, rolling) = (pairs("moment_local")?, pairs("rolling")?);
    let axes = g.vectors::<3>("frame", &[c, 3, 3])?;
    let (gap, mu) = (g.table("gap", &[c])?, g.table("mu", &[c])?);
    let status = g.naturals("status", Some(STATUSES.len()))?;
    if status.len() != c {
        let found = format!("{} entries", status.len());
        return Err(g.error("status", format!("{c} entries"), found));
    }
    let contact = |k: usize| Contact {
        key: std::array::from_fn(|i| key[4 * k + i]),
        a: a[k] as u32,
        b: bodies[k],
        point: point[k],
        offset: beside[k],
        frame: [axes[3 * k], axes[3 * k + 1], axes[3 * k + 2]],
        gap: gap[k],
        mu: mu[k],
        r: r[k],
        u: u[k],
        mu_r: mu_r[k],
        moment: moment[k],
        rolling: rolling[k],
        status: STATUSES[status[k] as usize],
    };
    for (frame, w) in run.frames.iter_mut().zip(offset.windows(2)) {
        frame.contacts = (w[0] as usize..w[1] as usize).map(contact).collect();
    }
    Ok(())
}

fn steps(root: &Folder) -> Result<Vec<Step>, IoError> {
    let g = root.need("steps")?;
    let number = g.naturals("number", None)?;
    let s = number.len();
    let names = g.texts("status_name")?;
    let status = g.naturals("status", Some(names.len()))?;
    let iterations = g.naturals("iterations", None)?;
    for (name, found) in [("status", status.len()), ("iterations", iterations.len())] {
        if found != s {
            return Err(g.error(name, format!("{s} entries"), format!("{found} entries")));
        }
    }
    let step = |k: usize| Step {
        number: number[k],
        iterations: iterations[k],
        status: names[status[k] as usize].clone(),
        ..Step::default()
    };
    let mut steps: Vec<Step> = (0..s).map(step).collect();
    for (name, of) in super::STEP_REALS {
        steps.iter_mut().zip(g.table(name, &[s])?).for_each(|(step, x)| *of(step) = x);
    }
    for (name, of) in super::STEP_COUNTS {
        steps.iter_mut().zip(g.numbers(name, &[s])?).for_each(|(step, x)| *of(step) = x);
    }
    let g = root.need("energy")?;
    for (k, (name, _)) in Energy::default().terms().into_iter().enumerate() {
        let values = g.table(name, &[s])?;
        steps.iter_mut().zip(values).for_each(|(step, x)| *step.energy.terms()[k].1 = x);
    }
    Ok(steps)
}

fn checkpoint(g: &Folder) -> Result<Checkpoint, IoError> {
    let step = g.naturals("step", None)?.first().copied().unwrap_or_default();
    let time = g.table("time", &[1])?[0];
    let state = g.naturals("state", Some(256))?.into_iter().map(|x| x as u8).collect();
    Ok(Checkpoint { step, time, state })
}

/// Tables of trajectories.
impl Folder<'_, '_> {
    /// Reals of a shape, whatever they are.
    fn table(&self, name: &str, shape: &[usize]) -> Result<Vec<f64>, IoError> {
        let dataset = self.dataset(name)?;
        if !matches!(dataset.kind, Type::Real { .. }) {
            return Err(self.error(name, "reals", dataset.kind.name()));
        }
        if !dataset.shape.iter().eq(shape.iter().map(|&n| n as u64).collect::<Vec<_>>().iter()) {
            let found = format!("shape {:?}", dataset.shape);
            return Err(self.error(name, format!("shape {shape:?}"), found));
        }
        self.data.reals(&dataset).map_err(self.fault(name))
    }

    fn vectors<const D: usize>(
        &self,
        name: &str,
        shape: &[usize],
    ) -> Result<Vec<[f64; D]>, IoError> {
        Ok(self.table(name, shape)?.as_chunks::<D>().0.to_vec())
    }

    /// Whole numbers from 0 on, below a bound.
    fn naturals(&self, name: &str, bound: Option<usize>) -> Result<Vec<u64>, IoError> {
        let x = self.ints(name, None)?;
        let bad = |x: &i64| *x < 0 || bound.is_some_and(|bound| *x as u64 >= bound as u64);
        match x.iter().position(bad) {
            None => Ok(x.into_iter().map(|x| x as u64).collect()),
            Some(k) => {
                let below = bound.map_or(String::new(), |bound| format!(" and below {bound}"));
                let expected = format!("a number of at least 0{below}");
                Err(self.error(format_args!("{name}[{k}]"), expected, x[k]))
            }
        }
    }

    /// As many of them, of 32 bits, as a shape has room for.
    fn numbers(&self, name: &str, shape: &[usize]) -> Result<Vec<u32>, IoError> {
        let x = self.naturals(name, Some(1 << 32))?;
        let expected = shape.iter().product::<usize>();
        match x.len() == expected {
            true => Ok(x.into_iter().map(|x| x as u32).collect()),
            false => {
                Err(self.error(name, format!("{expected} entries"), format!("{} entries", x.len())))
            }
        }
    }

    /// Texts of one width.
    fn texts(&self, name: &str) -> Result<Vec<String>, IoError> {
        let dataset = self.dataset(name)?;
        if dataset.kind != Type::Text {
            return Err(self.error(name, "texts of one width", dataset.kind.name()));
        }
        let bytes = self.data.read(&dataset).map_err(self.fault(name))?;
        let text = |bytes: &[u8]| {
            let end = bytes.iter().position(|&c| c == 0).unwrap_or(bytes.len());
            String::from_utf8_lossy(&bytes[..end]).into_owned()
        };
        Ok(bytes.chunks_exact(dataset.width as usize).map(text).collect())
    }
}
