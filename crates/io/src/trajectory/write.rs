//! Writing.

use std::path::Path;

use hdf5_pure::{CharacterSet, DatasetBuilder, Datatype, FileBuilder, LibVer, StringPadding};

use super::{
    Checkpoint, Contact, Frame, Named, STATUSES, State, Step, Trajectory, VERSION, digest,
};
use crate::IoError;
use crate::folder::{Out, failed};

/// Bytes of a chunk, about: small enough for one body's path to be read alone, large enough to compress.
const CHUNK: u64 = 1 << 17;
/// Rows and columns of a chunk at most: longer ones take three bytes where the library that writes takes four, and libhdf5 2.0 refuses to open such datasets.
const LONGEST: u64 = 0xffff;

/// What a file holds of a run: all of it, or what came after a step.
pub(super) struct View<'a> {
    pub scene: &'a str,
    pub program: &'a str,
    pub bodies: &'a [Named],
    pub joints: &'a [String],
    pub elastic: &'a [String],
    pub frames: &'a [Frame],
    pub steps: &'a [Step],
    pub checkpoint: Option<&'a Checkpoint>,
}

impl<'a> From<&'a Trajectory> for View<'a> {
    fn from(run: &'a Trajectory) -> Self {
        Self {
            scene: &run.scene,
            program: &run.program,
            bodies: &run.bodies,
            joints: &run.joints,
            elastic: &run.elastic,
            frames: &run.frames,
            steps: &run.steps,
            checkpoint: run.checkpoint.as_ref(),
        }
    }
}

pub(super) fn to_bytes(path: &Path, run: &View) -> Result<Vec<u8>, IoError> {
    run.check(path)?;
    let mut file = FileBuilder::new();
    // The oldest format that has chunks in the builder, for the sake of old readers.
    file.with_libver_bounds(LibVer::V110, LibVer::V110);
    file.create_dataset(VERSION.0).with_i32_data(&[VERSION.1 as i32]);
    let mut top = |name: &str, fill: &dyn Fn(&mut Out) -> Result<(), IoError>| {
        let group = file.create_group(name);
        let mut g = Out { file: path, path: format!("/{name}"), group };
        fill(&mut g)?;
        file.add_group(g.group.finish());
        Ok::<(), IoError>(())
    };
    top("scene", &|g| {
        g.text("text", run.scene)?;
        g.text("sha256", &digest(run.scene))?;
        g.text("program", run.program)
    })?;
    top("bodies", &|g| bodies(g, run))?;
    if !run.elastic.is_empty() {
        top("elastic", &|g| elastic(g, run))?;
    }
    top("frames", &|g| {
        g.longs("step", run.frames.iter().map(|f| f.step));
        g.table("time", &[run.frames.len()], run.frames.iter().map(|f| f.time));
        Ok(())
    })?;
    top("contacts", &|g| {
        contacts(g, run);
        Ok(())
    })?;
    top("joints", &|g| joints(g, run))?;
    top("steps", &|g| steps(g, run.steps))?;
    top("energy", &|g| {
        let terms: Vec<_> =
            run.steps.iter().map(|s| s.energy.clone().terms().map(|t| *t.1)).collect();
        for (k, (name, _)) in super::Energy::default().terms().into_iter().enumerate() {
            g.table(name, &[terms.len()], terms.iter().map(|t| t[k]));
        }
        Ok(())
    })?;
    if let Some(checkpoint) = run.checkpoint {
        top("checkpoint", &|g| {
            g.longs("step", [checkpoint.step]);
            g.table("time", &[1], [checkpoint.time]);
            g.bytes("state", checkpoint.state.iter().copied());
            Ok(())
        })?;
    }
    file.finish().map_err(|e| failed(path, e))
}

/// A vector of a body or contact by its name in a file.
type Vector<T> = (&'static str, fn(&T) -> [f64; 3]);

impl View<'_> {
    /// What no layout of a run can hold.
    fn check(&self, path: &Path) -> Result<(), IoError> {
        let bodies = self.bodies.len();
        let last = &self.bodies[bodies.saturating_sub(self.elastic.len())..];
        if !last.iter().map(|b| &b.name).eq(self.elastic) {
            let expected = "elastic solids to be the last of the bodies, by their names";
            return Err(IoError::data(path, "/elastic", expected, self.elastic.join(", ")));
        }
        for (k, frame) in self.frames.iter().enumerate() {
            if frame.bodies.len() != bodies {
                let expected = format!("{bodies} bodies, as in /bodies/name");
                return Err(IoError::data(
                    path,
                    format!("/frames[{k}]"),
                    expected,
                    frame.bodies.len(),
                ));
            }
            if frame.joints.len() != self.joints.len() {
                let expected = format!("{} joints, as in /joints/name", self.joints.len());
                let (place, found) = (format!("/frames[{k}]"), frame.joints.len());
                return Err(IoError::data(path, place, expected, found));
            }
            let nodes = |f: &Frame| f.elastic.iter().map(Vec::len).collect::<Vec<_>>();
            if frame.elastic.len() != self.elastic.len() || nodes(frame) != nodes(&self.frames[0]) {
                let expected = "as many nodes of each elastic solid as in the first frame";
                let found = format!("{:?}", nodes(frame));
                return Err(IoError::data(path, format!("/frames[{k}]"), expected, found));
            }
            for (c, contact) in frame.contacts.iter().enumerate() {
                if let Some(body) =
                    [contact.a, contact.b].into_iter().find(|&i| i as usize >= bodies)
                {
                    let place = format!("/contacts of frame {k}, [{c}]");
                    return Err(IoError::data(
                        path,
                        place,
                        format!("one of {bodies} bodies"),
                        body,
                    ));
                }
            }
        }
        Ok(())
    }
}

impl Trajectory {
    /// What no layout of a run can hold.
    pub(crate) fn check(&self, path: &Path) -> Result<(), IoError> {
        View::from(self).check(path)
    }
}

fn bodies(g: &mut Out, run: &View) -> Result<(), IoError> {
    g.texts("name", run.bodies.iter().map(|b| &b.name[..]))?;
    g.bytes("fixed", run.bodies.iter().map(|b| u8::from(b.fixed)));
    let (n, b) = (run.frames.len(), run.bodies.len());
    if !run.elastic.is_empty() {
        g.bytes("elastic", (0..b).map(|k| u8::from(k + run.elastic.len() >= b)));
    }
    let all = || run.frames.iter().flat_map(|f| &f.bodies);
    let vectors: [Vector<State>; 3] = [
        ("position", |s| s.position),
        ("velocity", |s| s.velocity),
        ("angular_velocity", |s| s.angular_velocity),
    ];
    for (name, of) in vectors {
        g.table(name, &[n, b, 3], all().flat_map(of));
    }
    g.table("rotation", &[n, b, 4], all().flat_map(|s| s.rotation));
    Ok(())
}

fn elastic(g: &mut Out, run: &View) -> Result<(), IoError> {
    for (e, name) in run.elastic.iter().enumerate() {
        let nodes = run.frames.first().map_or(0, |f| f.elastic[e].len());
        let all = run.frames.iter().flat_map(|f| f.elastic[e].iter().flatten().copied());
        g.child(name, |g| {
            g.table("position", &[run.frames.len(), nodes, 3], all);
            Ok(())
        })?;
    }
    Ok(())
}

fn joints(g: &mut Out, run: &View) -> Result<(), IoError> {
    g.texts("name", run.joints.iter().map(|name| &name[..]))?;
    let (n, j) = (run.frames.len(), run.joints.len());
    let all = || run.frames.iter().flat_map(|f| &f.joints);
    g.table("angle", &[n, j], all().map(|x| x.angle));
    g.table("slide", &[n, j], all().map(|x| x.slide));
    g.table("violation", &[n, j], all().map(|x| x.violation));
    g.table("impulse", &[n, j, 3], all().flat_map(|x| x.impulse));
    g.table("moment", &[n, j, 3], all().flat_map(|x| x.moment));
    Ok(())
}

fn contacts(g: &mut Out, run: &View) {
    let all = || run.frames.iter().flat_map(|f| &f.contacts);
    let c = all().count();
    let mut end = 0;
    let ends = run.frames.iter().map(|f| {
        end += f.contacts.len() as u64;
        end
    });
    g.longs("offset", std::iter::once(0).chain(ends));
    g.ints("key", &[c, 4], all().flat_map(|t| t.key));
    g.ints("a", &[c], all().map(|t| t.a));
    g.ints("b", &[c], all().map(|t| t.b));
    let vectors: [Vector<Contact>; 4] = [
        ("point", |t| t.point),
        ("r", Contact::world_impulse),
        ("r_local", |t| t.r),
        ("u", |t| t.u),
    ];
    for (name, of) in vectors {
        g.table(name, &[c, 3], all().flat_map(of));
    }
    if all().any(|t| t.offset != [0.0; 3]) {
        g.table("offset_a", &[c, 3], all().flat_map(|t| t.offset));
    }
    if all().any(|t| t.mu_r != 0.0) {
        g.table("mu_r", &[c], all().map(|t| t.mu_r));
        g.table("moment", &[c, 3], all().flat_map(Contact::world_moment));
        g.table("moment_local", &[c, 2], all().flat_map(|t| t.moment));
        g.table("rolling", &[c, 2], all().flat_map(|t| t.rolling));
    }
    g.table("frame", &[c, 3, 3], all().flat_map(|t| t.frame.into_iter().flatten()));
    g.table("gap", &[c], all().map(|t| t.gap));
    g.table("mu", &[c], all().map(|t| t.mu));
    let code = |t: &Contact| STATUSES.iter().position(|s| *s == t.status).expect("all are there");
    g.bytes("status", all().map(|t| code(t) as u8));
}

fn steps(g: &mut Out, steps: &[Step]) -> Result<(), IoError> {
    let s = [steps.len()];
    let mut names: Vec<&str> = vec![];
    let mut codes = vec![];
    for step in steps {
        let known = names.iter().position(|name| *name == step.status);
        codes.push(known.unwrap_or(names.len()) as u32);
        if known.is_none() {
            names.push(&step.status);
        }
    }
    g.ints("status", &s, codes);
    g.texts("status_name", names.into_iter())?;
    g.longs("number", steps.iter().map(|s| s.number));
    g.longs("iterations", steps.iter().map(|s| s.iterations));
    let mut steps = steps.to_vec();
    for (name, of) in super::STEP_REALS {
        g.table(name, &s, steps.iter_mut().map(|s| *of(s)));
    }
    for (name, of) in super::STEP_COUNTS {
        g.ints(name, &s, steps.iter_mut().map(|s| *of(s)));
    }
    Ok(())
}

/// Tables of trajectories.
impl Out<'_> {
    pub(crate) fn table(&mut self, name: &str, shape: &[usize], x: impl IntoIterator<Item = f64>) {
        let x: Vec<f64> = x.into_iter().collect();
        pack(self.group.create_dataset(name).with_f64_data(&x), shape, 8);
    }

    fn ints(&mut self, name: &str, shape: &[usize], x: impl IntoIterator<Item = u32>) {
        let x: Vec<u32> = x.into_iter().collect();
        pack(self.group.create_dataset(name).with_u32_data(&x), shape, 4);
    }

    fn longs(&mut self, name: &str, x: impl IntoIterator<Item = u64>) {
        let x: Vec<u64> = x.into_iter().collect();
        pack(self.group.create_dataset(name).with_u64_data(&x), &[x.len()], 8);
    }

    fn bytes(&mut self, name: &str, x: impl IntoIterator<Item = u8>) {
        let x: Vec<u8> = x.into_iter().collect();
        pack(self.group.create_dataset(name).with_u8_data(&x), &[x.len()], 1);
    }

    /// Texts of one width, each ended by a NUL.
    fn texts<'t>(
        &mut self,
        name: &str,
        texts: impl Iterator<Item = &'t str> + Clone,
    ) -> Result<(), IoError> {
        let width = 1 + texts.clone().map(str::len).max().unwrap_or(0);
        let size = self.as_int(name, width)? as u32;
        let mut bytes = vec![];
        for (k, text) in texts.enumerate() {
            if text.contains('\0') {
                let place = format!("{}/{name}[{k}]", self.path);
                let expected = "a text without NUL characters";
                return Err(IoError::data(self.file, place, expected, "one with"));
            }
            bytes.extend_from_slice(text.as_bytes());
            bytes.resize((k + 1) * width, 0);
        }
        let (padding, charset) = (StringPadding::NullTerminate, CharacterSet::Utf8);
        let kind = Datatype::String { size, padding, charset };
        let count = bytes.len() / width;
        let set = self.group.create_dataset(name).with_raw_data(kind, bytes, count as u64);
        pack(set, &[count], width);
        Ok(())
    }
}

/// Gives a dataset its shape, and chunks of so many rows that they are about [`CHUNK`] long, compressed and with a checksum.
fn pack(set: &mut DatasetBuilder, shape: &[usize], width: usize) {
    let mut shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
    set.with_shape(&shape);
    if shape.contains(&0) {
        return;
    }
    let row = shape[1..].iter().product::<u64>() * width as u64;
    shape[0] = (CHUNK / row).clamp(1, shape[0]);
    shape.iter_mut().for_each(|n| *n = (*n).min(LONGEST));
    set.with_chunks(&shape).with_shuffle().with_deflate(1).with_fletcher32();
}
