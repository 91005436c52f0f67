//! The local problem that the lines of a step make, and the velocities that its impulses make.

use nonsmooth_linalg::Csc;
use nonsmooth_problem::{FrictionLocal, LocalPoint, RowsLocal};

use super::gradients::dot;
use super::lines::{Line, Lines};
use super::matrices::Matrices;

impl<const D: usize> Lines<D> {
    /// States the problem of an iteration whose velocity without impulses is `free`.
    pub fn state(
        &mut self,
        matrices: &mut Matrices,
        changed: bool,
        free: &[f64],
        problem: &mut FrictionLocal<D>,
        point: &mut LocalPoint,
    ) {
        let nc = self.touching.len();
        let steep = self.lines.iter().any(|l| l.steep);
        let same = self.solve_lines(matrices, changed, free.len())
            && !steep
            && self.stated.iter().copied().eq(self.lines.iter().map(|l| l.index));
        if !same {
            self.stated.clear();
            self.stated.extend(self.lines.iter().map(|l| l.index));
            self.couple(problem);
        }
        let (contacts, scalars) = self.lines.split_at(D * nc);
        let velocity = |line: &Line| dot(self.slope(line), free) + line.offset;
        problem.q.clear();
        problem.q.extend(contacts.iter().map(velocity));
        problem.mu.clear();
        problem.mu.extend(self.touching.iter().map(|t| t.law.mu));
        point.r.clear();
        point.r.extend(contacts.iter().map(|l| l.impulse));
        point.lambda.clear();
        point.lambda.extend(scalars.iter().map(|l| l.impulse));
        if let Some(rows) = &mut problem.rows {
            rows.s.clear();
            rows.s.extend(scalars.iter().map(velocity));
            rows.bounds.lower.clone_from(&self.bounds.lower);
            rows.bounds.upper.clone_from(&self.bounds.upper);
        }
        // Without a load nothing pushes, and what was left of the last impulses would be the measure of what is off.
        let rates = problem.q.iter().chain(problem.rows.iter().flat_map(|r| &r.s));
        if rates.into_iter().all(|c| *c == 0.0) {
            point.r.fill(0.0);
            point.lambda.fill(0.0);
        }
        for (lambda, j) in point.lambda.iter_mut().zip(0..) {
            *lambda = lambda.clamp(self.bounds.lower[j], self.bounds.upper[j]);
        }
    }

    /// The gradient that the velocity of a line is stated with.
    fn slope(&self, line: &Line) -> &[f64] {
        let at = if line.steep { &self.end } else { &self.now };
        at.line(line.index)
    }

    /// Whether the problem is to be symmetric: it has more than relations.
    pub fn is_symmetric(&self) -> bool {
        self.lines.len() > self.relations
    }

    /// M̂⁻¹ of each line that takes part; whether all were there already.
    fn solve_lines(&mut self, matrices: &mut Matrices, changed: bool, n: usize) -> bool {
        let all = self.now.len();
        if (self.solved.nrows(), self.solved.ncols()) != (all, n) {
            self.solved.reset(all, n);
            self.fresh.clear();
            self.fresh.resize(all, false);
        }
        if changed {
            self.fresh.fill(false);
        }
        if self.last != self.now {
            for i in 0..all {
                if self.last.len() != all || self.last.line(i) != self.now.line(i) {
                    self.fresh[i] = false;
                }
            }
            self.last.clone_from(&self.now);
        }
        let mut same = true;
        for line in &self.lines {
            let i = line.index;
            if !self.fresh[i] {
                same = false;
                self.solved.row_mut(i).copy_from_slice(self.now.line(i));
                matrices.solve_hat(self.solved.row_mut(i));
                self.fresh[i] = true;
            }
        }
        same
    }

    /// W, V and R of the lines that take part.
    #[allow(non_snake_case)]
    fn couple(&self, problem: &mut FrictionLocal<D>) {
        let nc = self.touching.len();
        let p = self.lines.len() - D * nc;
        let product = |i: usize, j: usize| {
            // Where the matrix is symmetric, what is below the diagonal is what is above it, to the last bit.
            let (i, j) = if self.lines[i].steep { (i, j) } else { (i.min(j), i.max(j)) };
            dot(self.slope(&self.lines[i]), self.solved.row(self.lines[j].index))
        };
        problem.W.clear(nc);
        for a in 0..nc {
            for b in 0..nc {
                let block =
                    std::array::from_fn(|i| std::array::from_fn(|j| product(D * a + i, D * b + j)));
                problem.W.push(b, block);
            }
            problem.W.end_row();
        }
        if p == 0 {
            problem.rows = None;
            return;
        }
        let fill = |out: &mut Csc, rows: usize, first: usize| {
            let entries = (0..p).flat_map(|j| (0..rows).map(move |i| (i, j)));
            if (out.nrows(), out.ncols(), out.nnz()) != (rows, p, rows * p) {
                let ones = entries.clone().map(|(i, j)| (i, j, 1.0));
                *out = Csc::from_triplets(rows, p, ones).expect("in range");
            }
            for (x, (i, j)) in out.values_mut().iter_mut().zip(entries) {
                *x = product(first + i, D * nc + j);
            }
        };
        let rows = problem.rows.get_or_insert_with(|| {
            RowsLocal::bilateral(Csc::zeros(0, 0), Csc::zeros(0, 0), vec![])
        });
        fill(&mut rows.V, D * nc, 0);
        fill(&mut rows.R, p, D * nc);
    }

    /// `v = free + M̂⁻¹ (H r + G λ)` with the impulses of the point, and the velocities in the laws. What is below the rounding of its own sum is zero, so that what
    /// rests, rests exactly.
    pub fn respond(&mut self, point: &LocalPoint, free: &[f64], v: &mut [f64]) {
        v.copy_from_slice(free);
        self.sums.clear();
        self.sums.extend(free.iter().map(|x| x.abs()));
        let impulses = point.r.iter().chain(&point.lambda);
        for (line, &impulse) in self.lines.iter_mut().zip(impulses) {
            line.impulse = impulse;
            let solved = self.solved.row(line.index);
            for ((v, sum), x) in v.iter_mut().zip(&mut self.sums).zip(solved) {
                *v += impulse * x;
                *sum += (impulse * x).abs();
            }
        }
        for (v, sum) in v.iter_mut().zip(&self.sums) {
            if v.abs() <= 8.0 * f64::EPSILON * sum {
                *v = 0.0;
            }
        }
        for line in &mut self.lines {
            let at = if line.steep { &self.end } else { &self.now };
            line.velocity = dot(at.line(line.index), v) + line.offset;
        }
    }
}
