//! Histories in the layout of Siconos' mechanics files, so that scripts for these read our runs.
//!
//! ```text
//! /data/static      time, id, x, y, z, q0 .. q3                                       bodies that impulses do not move, id < 0
//! /data/dynamic     the same                                                          all others, id > 0
//! /data/velocities  time, id, v (3), Ω (3, in the frame of the body)
//! /data/cf          time, mu, points on 1 and 2 (3 each), normal (3), impulse on 1 in the world (3), gap (3), u (3), r (3), contact, id 1, id 2
//! /data/solv        time, iterations, residual, local residual                        of each step
//! ```
//!
//! The normal points to body 1, which is our second one, or the one that moves; what touches a body that does not has the same id twice. Gap has one
//! component and two zeros; both points are the one that the trajectory has. Contacts that took no part in a step are left out. Shapes are not written.
//!
//! Reference: Siconos' source, `io/python/mechanics_hdf5.py` and `MechanicsIO.cpp`.

use std::collections::BTreeMap;
use std::path::Path;

use hdf5_pure::{AttrValue, FileBuilder, LibVer};

use crate::IoError;
use crate::folder::{Out, failed};
use crate::format::put;
use crate::trajectory::{Contact, Trajectory};

/// Writes the histories of a run. Errors: what the system refuses; frames without all bodies; contacts of bodies that are not there.
pub fn write_histories(path: &Path, trajectory: &Trajectory) -> Result<(), IoError> {
    trajectory.check(path)?;
    let mut file = FileBuilder::new();
    file.with_libver_bounds(LibVer::V110, LibVer::V110);
    file.set_attr("dimension", AttrValue::I64(3));
    let mut data = Out { file: path, path: "/data".into(), group: file.create_group("data") };
    let fixed = |k: usize| trajectory.bodies[k].fixed;
    let id = |k: usize| (k as f64 + 1.0) * if fixed(k) { -1.0 } else { 1.0 };
    let states = |of_fixed: bool| {
        trajectory.frames.iter().flat_map(move |frame| {
            let of = move |(k, _): &(usize, _)| fixed(*k) == of_fixed;
            frame.bodies.iter().enumerate().filter(of).map(move |(k, s)| (frame.time, k, s))
        })
    };
    for (name, of_fixed) in [("static", true), ("dynamic", false)] {
        let row = |(time, k, s): (f64, usize, &crate::trajectory::State)| {
            let ([x, y, z], [a, b, c, d]) = (s.position, s.rotation);
            [time, id(k), x, y, z, a, b, c, d]
        };
        rows(&mut data, name, states(of_fixed).map(row));
    }
    let velocities = states(false).map(|(time, k, s)| {
        let ([x, y, z], [a, b, c]) = (s.velocity, s.turned_back(s.angular_velocity));
        [time, id(k), x, y, z, a, b, c]
    });
    rows(&mut data, "velocities", velocities);
    // The same contact has the same number in all frames.
    let mut numbers: BTreeMap<[u32; 4], usize> = BTreeMap::new();
    let mut table: Vec<[f64; 26]> = vec![];
    for frame in &trajectory.frames {
        for contact in frame.contacts.iter().filter(|c| c.status.is_some()) {
            let next = numbers.len();
            let number = *numbers.entry(contact.key).or_insert(next);
            let (a, b) = (contact.a as usize, contact.b as usize);
            // Body 1 must move.
            let (one, two, sign) = if fixed(b) { (a, b, -1.0) } else { (b, a, 1.0) };
            let two = if fixed(two) { one } else { two };
            table.push(force(frame.time, contact, sign, [number as f64, id(one), id(two)]));
        }
    }
    rows(&mut data, "cf", table.into_iter());
    let steps = trajectory.steps.iter();
    rows(&mut data, "solv", steps.map(|s| [s.time, s.iterations as f64, s.residual, s.residual]));
    file.add_group(data.group.finish());
    put(path, &file.finish().map_err(|e| failed(path, e))?)
}

fn force(time: f64, c: &Contact, sign: f64, last: [f64; 3]) -> [f64; 26] {
    let signed = |x: [f64; 3]| x.map(|x| sign * x);
    let vectors = [
        c.point,
        c.point,
        signed(c.frame[0]),
        signed(c.world_impulse()),
        [c.gap, 0.0, 0.0],
        c.u,
        c.r,
        last,
    ];
    let mut row = [time, c.mu].into_iter().chain(vectors.into_iter().flatten());
    std::array::from_fn(|_| row.next().unwrap_or_default())
}

fn rows<const D: usize>(data: &mut Out, name: &str, rows: impl Iterator<Item = [f64; D]>) {
    let rows: Vec<[f64; D]> = rows.collect();
    data.table(name, &[rows.len(), D], rows.into_iter().flatten());
}
