//! Substitution with the factors: front by front, or whole subtrees of the tree of elimination side by side.

use rayon::prelude::*;

use super::super::budget;
use super::BlockLu;
use super::factor::Cut;
use super::kernel::{self, At, Simd, WIDTH};
use super::symbolic::{Front, Symbolic};

/// Factors of more entries than this, read in half a millisecond, are shared among the threads that the budget allows.
pub(super) const SHARED: usize = 1 << 20;

/// What all fronts read.
#[derive(Clone, Copy)]
struct Factors<'a> {
    symbolic: &'a Symbolic,
    simd: Simd,
    lower: &'a [f64],
    upper: &'a [f64],
    triangles: &'a [f64],
    inverses: &'a [f64],
    swaps: &'a [u32],
}

/// The unknowns of consecutive fronts, from `start` on in the order of elimination, and room for what one front sees.
struct Part<'a> {
    x: &'a mut [f64],
    start: usize,
    z: &'a mut [f64],
}

impl BlockLu {
    /// `x ← A⁻¹ x` with the last factors, nodes concatenated in the caller's order. One pass, not refined; the same bits for any
    /// number of threads.
    pub fn solve(&mut self, x: &mut [f64]) {
        assert_eq!(x.len(), self.dim());
        let tasks = self.symbolic.plan.tasks.len();
        let shared = tasks > 1 && self.factor_len() > SHARED;
        let team = if shared { budget::team() } else { None };
        let Self {
            symbolic,
            simd,
            lower,
            upper,
            triangles,
            inverses,
            swaps,
            row_scale,
            column_scale,
            x: work,
            z,
            ..
        } = self;
        let (symbolic, simd) = (&*symbolic, *simd);
        let factors = Factors { symbolic, simd, lower, upper, triangles, inverses, swaps };
        for ((w, &i), scale) in work.iter_mut().zip(&symbolic.order).zip(row_scale.iter()) {
            *w = x[i as usize] * scale;
        }
        match team {
            Some(team) => team.install(|| factors.substitute_shared(work, z)),
            None => factors.substitute(&mut Part { x: work, start: 0, z }),
        }
        for ((w, &i), scale) in work.iter().zip(&symbolic.order).zip(column_scale.iter()) {
            x[i as usize] = w * scale;
        }
    }
}

impl Factors<'_> {
    /// `x ← U⁻¹ L⁻¹ P x`.
    fn substitute(self, whole: &mut Part) {
        let fronts = &self.symbolic.fronts;
        fronts.iter().for_each(|front| self.forward(front, whole, |_| ()));
        fronts.iter().rev().for_each(|front| self.backward(front, whole, &[]));
    }

    /// The same on the threads of the pool that this is called in. What a task adds to the unknowns of fronts above it waits
    /// until all tasks are done, and is added in the order in which one thread would.
    fn substitute_shared(self, x: &mut [f64], z: &mut [f64]) {
        let (s, fronts) = (self.symbolic, &self.symbolic.fronts);
        let tasks = &s.plan.tasks;
        let added: Vec<Vec<f64>> = (self.tasks(x).into_par_iter().zip(tasks))
            .with_max_len(1)
            .map(|((x, start), task)| {
                let (mut added, z) = (vec![], &mut vec![0.0; s.widest][..]);
                let part = &mut Part { x, start, z };
                for front in &fronts[task.clone()] {
                    self.forward(front, part, |z| added.push(z));
                }
                added
            })
            .collect();
        let whole = &mut Part { x, start: 0, z };
        let mut from = 0;
        for (task, added) in tasks.iter().zip(added) {
            fronts[from..task.start].iter().for_each(|front| self.forward(front, whole, |_| ()));
            let (end, mut added) = (s.bounds(task.end).start, added.into_iter());
            for front in &fronts[task.clone()] {
                let above = front.rest_of(&s.rows).iter().filter(|&&r| r as usize >= end);
                above.zip(&mut added).for_each(|(&r, z)| whole.x[r as usize] += z);
            }
            from = task.end;
        }
        fronts[from..].iter().for_each(|front| self.forward(front, whole, |_| ()));
        let others: Vec<usize> = s.plan.others(fronts.len()).collect();
        others.iter().rev().for_each(|&f| self.backward(&fronts[f], whole, &[]));
        let above = whole.x.to_vec();
        let tasks = self.tasks(whole.x).into_par_iter().zip(tasks);
        tasks.with_max_len(1).for_each(|((x, start), task)| {
            let part = &mut Part { x, start, z: &mut vec![0.0; s.widest] };
            let own = fronts[task.clone()].iter().rev();
            own.for_each(|front| self.backward(front, part, &above));
        });
    }

    /// The unknowns of each task of the plan, and the first of them.
    fn tasks(self, x: &mut [f64]) -> Vec<(&mut [f64], usize)> {
        let (s, mut cut) = (self.symbolic, Cut::new(x));
        let range = |task: &std::ops::Range<usize>| {
            let (start, end) = (s.bounds(task.start).start, s.bounds(task.end).start);
            (cut.range(start, end), start)
        };
        s.plan.tasks.iter().map(range).collect()
    }

    /// `x ← L⁻¹ P x` of one front; what it adds to unknowns beyond the part goes to `beyond`.
    #[inline(always)]
    fn forward(self, front: &Front, part: &mut Part, mut beyond: impl FnMut(f64)) {
        let Front { pivots: k, rest: m, start, .. } = *front;
        let Self { simd, triangles, .. } = self;
        let ld = k + m;
        let lower = &self.lower[front.lower..front.lower + k * ld];
        let z = &mut part.z[..ld];
        let own = &mut part.x[start - part.start..][..k];
        for (j, &p) in self.swaps[start..start + k].iter().enumerate() {
            own.swap(j, p as usize);
        }
        z[..k].copy_from_slice(own);
        z[k..].fill(0.0);
        for b in (0..k).step_by(WIDTH) {
            let e = (b + WIDTH).min(k);
            let y: [f64; WIDTH] = std::array::from_fn(|i| if b + i < e { z[b + i] } else { 0.0 });
            z[b..e].fill(0.0);
            let triangle = At { at: front.triangles + b * WIDTH, ld: WIDTH };
            kernel::product_vector(simd, (triangles, triangle), &y[..e - b], &mut z[b..e]);
            let (done, open) = z.split_at_mut(e);
            kernel::product_vector(simd, (lower, At { at: b * ld + e, ld }), &done[b..], open);
        }
        own.copy_from_slice(&z[..k]);
        for (&r, &z) in front.rest_of(&self.symbolic.rows).iter().zip(&z[k..]) {
            match part.x.get_mut(r as usize - part.start) {
                Some(x) => *x += z,
                None => beyond(z),
            }
        }
    }

    /// `x ← U⁻¹ x` of one front; unknowns beyond the part are those of `whole`.
    #[inline(always)]
    fn backward(self, front: &Front, part: &mut Part, whole: &[f64]) {
        let Front { pivots: k, rest: m, start, .. } = *front;
        let simd = self.simd;
        let ld = k + m;
        let lower = &self.lower[front.lower..front.lower + k * ld];
        let upper = &self.upper[front.upper..front.upper + k * m];
        let inverses = &self.inverses[start..start + k];
        let z = &mut part.z[..m];
        for (&r, z) in front.rest_of(&self.symbolic.rows).iter().zip(&mut *z) {
            let own = part.x.get(r as usize - part.start);
            *z = *own.unwrap_or_else(|| &whole[r as usize]);
        }
        let own = &mut part.x[start - part.start..][..k];
        kernel::product_vector(simd, (upper, At { at: 0, ld: k }), z, own);
        let mut e = k;
        while e > 0 {
            let b = (e - 1) / WIDTH * WIDTH;
            upper_solve(&lower[b * ld + b..], ld, &inverses[b..e], &mut own[b..e]);
            let (open, done) = own.split_at_mut(b);
            kernel::product_vector(simd, (lower, At { at: b * ld, ld }), &done[..e - b], open);
            e = b;
        }
    }
}

/// `x ← U⁻¹ x` for a diagonal block of at most [`WIDTH`] rows.
fn upper_solve(block: &[f64], ld: usize, inverses: &[f64], x: &mut [f64]) {
    let w = x.len();
    if w < WIDTH {
        for j in (0..w).rev() {
            x[j] *= inverses[j];
            let y = x[j];
            for i in 0..j {
                x[i] -= block[j * ld + i] * y;
            }
        }
        return;
    }
    // Whole columns, masked, in a register.
    let mut z: [f64; WIDTH] = std::array::from_fn(|i| x[i]);
    for j in (0..WIDTH).rev() {
        let y = z[j] * inverses[j];
        let column = &block[j * ld..j * ld + WIDTH];
        for i in 0..WIDTH {
            z[i] = match i.cmp(&j) {
                std::cmp::Ordering::Less => z[i] - column[i] * y,
                std::cmp::Ordering::Equal => y,
                std::cmp::Ordering::Greater => z[i],
            };
        }
    }
    x.copy_from_slice(&z);
}
