//! Rolling friction of the contacts of a step: two more rows a contact, `u_R = t_k · (ω_b − ω_a)` for the two tangents, with moments about them for impulses,
//! and the law of problems with rolling friction in place of Coulomb's ([`nonsmooth_problem::Rolling`]).
//!
//! An island in which a contact has rolling friction is solved as a problem of five rows a contact, made of that of three rows and what turns.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::{FrictionLocal, RollingLocal, RowsLocal};
use nonsmooth_scenes::vec3::{Vec3, dot};

/// What one side of a contact turns, in the frame of its body: velocities of the body to u_R, and moments to velocities of the body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Turning {
    pub rows: [Vec3; 2],
    pub solved: [Vec3; 2],
}

/// A contact as the problem of five rows has it beside that of three.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Roller {
    pub mu_r: f64,
    /// The free bodies of its sides.
    pub bodies: [Option<u32>; 2],
    /// What turns at each.
    pub sides: [Turning; 2],
    /// The angular parts of the three rows at each side, by direction: of velocities, and of impulses.
    pub rows: [[Vec3; 3]; 2],
    pub solved: [[Vec3; 3]; 2],
    /// The free angular velocity.
    pub free: [f64; 2],
    /// Moments to begin with.
    pub start: [f64; 2],
}

/// A lever of a scalar row: its body, the row's place, and the angular part of what a unit impulse does to that body.
pub(crate) type Turned = (u32, usize, Vec3);

/// The problem of five rows, and its start from that of three rows.
pub(crate) fn problem(
    plain: &FrictionLocal<3>,
    contacts: &[Roller],
    levers: &[Turned],
    r: &[f64],
) -> (RollingLocal, Vec<f64>) {
    let n = contacts.len();
    let mut w = Bsr::from_rows(n, &[]);
    w.clear(n);
    for (c, own) in contacts.iter().enumerate() {
        let (columns, blocks) = plain.W.row(c);
        for (&j, block) in columns.iter().zip(blocks) {
            w.push(j as usize, widened(block, own, &contacts[j as usize]));
        }
        w.end_row();
    }
    let place = |i: usize| 5 * (i / 3) + i % 3;
    let (mut q, mut start) = (vec![0.0; 5 * n], vec![0.0; 5 * n]);
    for i in 0..3 * n {
        (q[place(i)], start[place(i)]) = (plain.q[i], r[i]);
    }
    for (c, own) in contacts.iter().enumerate() {
        q[5 * c + 3..5 * c + 5].copy_from_slice(&own.free);
        start[5 * c + 3..5 * c + 5].copy_from_slice(&own.start);
    }
    let rows = plain.rows.as_ref().map(|rows| {
        let mut v: Vec<_> = rows.V.triplets().map(|(i, j, x)| (place(i), j, x)).collect();
        for (c, own) in contacts.iter().enumerate() {
            for (side, body) in own.sides.iter().zip(own.bodies) {
                for (_, j, solved) in levers.iter().filter(|l| Some(l.0) == body) {
                    let each = side.rows.iter().enumerate();
                    v.extend(each.map(|(k, row)| (5 * c + 3 + k, *j, dot(*row, *solved))));
                }
            }
        }
        let v = Csc::from_triplets(5 * n, rows.V.ncols(), v.into_iter()).expect("in range");
        RowsLocal { V: v, ..rows.clone() }
    });
    let mu_r = contacts.iter().map(|c| c.mu_r).collect();
    (RollingLocal { W: w, q, mu: plain.mu.clone(), mu_r, rows }, start)
}

/// The block of two contacts with what turns, a sum over the bodies that they share.
fn widened(block: &[[f64; 3]; 3], own: &Roller, other: &Roller) -> [[f64; 5]; 5] {
    let mut out = [[0.0; 5]; 5];
    for (wide, row) in out.iter_mut().zip(block) {
        wide[..3].copy_from_slice(row);
    }
    for (p, body) in own.bodies.iter().enumerate().filter(|b| b.1.is_some()) {
        for (q, _) in other.bodies.iter().enumerate().filter(|b| b.1 == body) {
            let (left, right) = (&own.sides[p], &other.sides[q]);
            for k in 0..2 {
                for i in 0..3 {
                    out[i][3 + k] += dot(own.rows[p][i], right.solved[k]);
                    out[3 + k][i] += dot(left.rows[k], other.solved[q][i]);
                }
                for l in 0..2 {
                    out[3 + k][3 + l] += dot(left.rows[k], right.solved[l]);
                }
            }
        }
    }
    out
}

/// Moments within what the normal impulse allows.
pub(crate) fn clipped(moment: [f64; 2], mu_r: f64, normal: f64) -> [f64; 2] {
    let (size, bound) = (moment[0].hypot(moment[1]), mu_r * normal.max(0.0));
    if size > bound { moment.map(|m| m * (bound / size)) } else { moment }
}
