//! Linear systems `(Q + P W) x = b` with block-diagonal P and Q, in contact space or in velocity space.
//!
//! *Contact form*, where only W is known: the D·nc × D·nc matrix itself.
//! *Body form*, where M and H are: with `y = M⁻¹ H x`, `x = Q⁻¹ (b − P Hᵀ y)` and
//! `(M + H Q⁻¹P Hᵀ) y = H Q⁻¹ b`, whose graph is that of the bodies: smaller than W wherever bodies have more than one or two
//! contacts.
//!
//! What is factorised has `Q + δ w_c P` in place of Q, δ = 1e-10, so that Q may be singular (sticking contacts of a
//! Newton matrix) and W rank deficient; refinement against `Q + P W` itself removes the bias wherever that matrix is regular.
//!
//! Finite elements and mechanisms, whose M is one component, are condensed first; their velocities still come from the dynamics, because W carries the
//! rounding of its condensation (4.6e-12 on one of our walls). The analysis of a matrix is used again while the pattern of W stays the same; over the bodies also
//! while contacts change, as long as no two bodies touch that did not before. A new one costs as much as one or two factorisations.

use nonsmooth_linalg::budget::TooLarge;
use nonsmooth_linalg::{Block, BlockLu, Bsr, Csc, Groups, Singular, Slot, norm, pieces, small};

use super::Costs;

/// The relative size of the regularisation.
const DELTA: f64 = 1e-10;
/// Refinement ends here at the latest; what it does not reach, the residual tells.
const MOST_REFINEMENTS: usize = 4;
/// Rounding level of a refined solve.
const ENOUGH: f64 = 1e-12;

/// The fewest contacts that are worth a piece of their own.
const PIECE: usize = 512;

/// Operations of an elimination in a nanosecond. This and the other figures of [`Form::costs`] are fits to the time of Newton and interior-point iterations on 150
/// problems of 4 to 5000 contacts, of which nine in ten are within a third.
const RATE: f64 = 30.0;
/// The same for [`Costs::worth`].
const RATE_WORTH: f64 = 3.0;

/// What is made at its first use; or the memory that it would take, found out once.
pub(super) type Once<T> = Option<Result<T, TooLarge>>;

/// What is there, made now if it was not yet; `None` where there is not the memory.
pub(super) fn made<T>(
    slot: &mut Once<T>,
    make: impl FnOnce() -> Result<T, TooLarge>,
) -> Option<&mut T> {
    slot.get_or_insert_with(make).as_mut().ok()
}

pub(super) fn there<T>(slot: &mut Once<T>) -> Option<&mut T> {
    slot.as_mut().and_then(|made| made.as_mut().ok())
}

/// The costs where there is not the memory for a factorisation.
pub(super) fn unaffordable(sweep: f64) -> Costs {
    const NEVER: f64 = 1e18;
    Costs { sweep, factorisation: NEVER, solve: NEVER, worth: NEVER, look: LOOK_SWEEPS * sweep }
}

/// The sweeps that it takes to complete and judge a point.
const LOOK_SWEEPS: f64 = 3.0;

/// A factorised system, with the blocks that it belongs to.
pub(super) struct System<F, const D: usize> {
    form: F,
    p: Vec<Block<D>>,
    q: Vec<Block<D>>,
    residual: Vec<f64>,
    best: Vec<f64>,
}

/// One way to factorise and solve, up to the regularisation.
pub(super) trait Form<const D: usize> {
    /// Factorises `Q + P W`.
    fn factorise(&mut self, p: &[Block<D>], q: &[Block<D>]) -> Result<(), Singular>;
    /// The sign of the determinant of what was factorised, up to one that is always the same.
    fn sign(&self) -> f64;
    /// `b ← (Q + P W)⁻¹ b`.
    fn solve(&mut self, p: &[Block<D>], b: &mut [f64]);
    /// What iterations cost, with all that a contact has done to it in them, where a sweep costs so much.
    fn costs(&self, sweep: f64) -> Costs;
}

impl<F, const D: usize> System<F, D> {
    pub(super) fn new(form: F, contacts: usize) -> Self {
        let m = D * contacts;
        Self {
            form,
            p: Vec::with_capacity(contacts),
            q: Vec::with_capacity(contacts),
            residual: vec![0.0; m],
            best: vec![0.0; m],
        }
    }

    /// The form alone.
    pub(super) fn into_form(self) -> F {
        self.form
    }

    /// The way in which it is factorised.
    pub(super) fn form(&mut self) -> &mut F {
        &mut self.form
    }
}

impl<F: Form<D>, const D: usize> System<F, D> {
    /// Factorises; `unit` holds `w_c`.
    pub(super) fn factorise(
        &mut self,
        unit: impl Iterator<Item = f64>,
        p: &[Block<D>],
        q: &[Block<D>],
    ) -> Result<(), Singular> {
        self.p.clear();
        self.p.extend_from_slice(p);
        self.q.clear();
        // The regularised Q is what the form sees; the true one comes back for the refinement.
        self.q.extend(unit.zip(p).zip(q).map(|((w, p), q)| {
            let mut regular = *q;
            for k in 0..D {
                for l in 0..D {
                    regular[k][l] += DELTA * w.abs() * p[k][l];
                }
            }
            regular
        }));
        let factorised = self.form.factorise(p, &self.q);
        self.q.copy_from_slice(q);
        factorised
    }

    /// See [`Form::sign`].
    pub(super) fn sign(&self) -> f64 {
        self.form.sign()
    }

    /// Solves, with `apply(x, wx)` giving `wx = W x`. Returns the relative residual.
    pub(super) fn solve(
        &mut self,
        b: &[f64],
        x: &mut [f64],
        wx: &mut [f64],
        mut apply: impl FnMut(&[f64], &mut [f64]),
    ) -> f64 {
        let Self { form, p, q, residual, best } = self;
        let size = norm(b);
        if size == 0.0 {
            x.fill(0.0);
            wx.fill(0.0);
            return 0.0;
        }
        x.copy_from_slice(b);
        form.solve(p, x);
        let mut least = f64::INFINITY;
        for pass in 0..=MOST_REFINEMENTS {
            apply(x, wx);
            let (now, w_now) = (&*x, &*wx);
            pieces::writing(p.len(), PIECE, [&mut residual[..]], |piece, [left]| {
                for (left, c) in left.chunks_mut(D).zip(piece) {
                    let qx = small::mul(&q[c], &small::block(now, c));
                    let pwx = small::mul(&p[c], &small::block(w_now, c));
                    (0..D).for_each(|k| left[k] = b[D * c + k] - qx[k] - pwx[k]);
                }
                []
            });
            let left = norm(residual) / size;
            if left.is_nan() || left >= least {
                // The step made it worse: back to the one before.
                if least.is_finite() {
                    x.copy_from_slice(best);
                    apply(x, wx);
                    return least;
                }
                return left;
            }
            if left <= ENOUGH || left > 0.5 * least || pass == MOST_REFINEMENTS {
                return left;
            }
            least = left;
            best.copy_from_slice(x);
            form.solve(p, residual);
            x.iter_mut().zip(&*residual).for_each(|(x, d)| *x += d);
        }
        least
    }
}

/// The D·nc × D·nc matrix `Q + P W`.
pub(super) struct ContactForm<const D: usize> {
    lu: BlockLu,
    /// W by rows: where row i begins, and for each block its column, its place in the factor and its value.
    ptr: Vec<usize>,
    columns: Vec<u32>,
    slots: Vec<Slot>,
    diagonal: Vec<Slot>,
    blocks: Vec<Block<D>>,
}

impl<const D: usize> ContactForm<D> {
    pub(super) fn new(w: &Bsr<D>) -> Result<Self, TooLarge> {
        let nc = w.nrows();
        let pairs = || (0..nc).flat_map(|i| w.row(i).0.iter().map(move |&j| (i as u32, j)));
        let lu = BlockLu::new(&vec![D; nc], pairs().filter(|(i, j)| i != j))?;
        let slots = pairs().map(|(i, j)| lu.slot(i as usize, j as usize)).collect();
        let diagonal = (0..nc).map(|i| lu.slot(i, i)).collect();
        let mut ptr = vec![0];
        ptr.extend((0..nc).scan(0, |end, i| {
            *end += w.row(i).0.len();
            Some(*end)
        }));
        let columns = pairs().map(|(_, j)| j).collect();
        Ok(Self { lu, ptr, columns, slots, diagonal, blocks: w.blocks().to_vec() })
    }

    /// Takes another W; false where its pattern is not the one that was analysed.
    pub(super) fn refill(&mut self, w: &Bsr<D>) -> bool {
        let rows = self.ptr.len() - 1;
        let same = w.nrows() == rows
            && w.nblocks() == self.columns.len()
            && (0..rows).all(|i| *w.row(i).0 == self.columns[self.ptr[i]..self.ptr[i + 1]]);
        if same {
            self.blocks.copy_from_slice(w.blocks());
        }
        same
    }
}

impl<const D: usize> Form<D> for ContactForm<D> {
    fn factorise(&mut self, p: &[Block<D>], q: &[Block<D>]) -> Result<(), Singular> {
        self.lu.clear();
        for (i, (p, q)) in p.iter().zip(q).enumerate() {
            self.lu.add_at(self.diagonal[i], q.as_flattened());
            if *p == [[0.0; D]; D] {
                continue;
            }
            for k in self.ptr[i]..self.ptr[i + 1] {
                let product = multiply(p, &self.blocks[k]);
                self.lu.add_at(self.slots[k], product.as_flattened());
            }
        }
        self.lu.factorise()
    }

    fn sign(&self) -> f64 {
        self.lu.sign()
    }

    fn solve(&mut self, _: &[Block<D>], b: &mut [f64]) {
        self.lu.solve(b);
    }

    fn costs(&self, sweep: f64) -> Costs {
        let contacts = self.diagonal.len() as f64;
        let (blocks, entries) = (self.blocks.len() as f64, self.lu.factor_len() as f64);
        Costs {
            sweep,
            factorisation: self.lu.flops() / RATE + 5.0 * (entries + blocks) + 400.0 * contacts,
            solve: 0.6 * entries + 150.0 * contacts,
            worth: self.lu.flops() / RATE_WORTH + 20.0 * blocks,
            look: LOOK_SWEEPS * sweep,
        }
    }
}

/// `M + H Q⁻¹P Hᵀ` over the bodies.
pub(super) struct BodyForm<const D: usize> {
    lu: BlockLu,
    /// M by blocks.
    mass: Vec<(Slot, Vec<f64>)>,
    touches: Touches<D>,
    /// Places of the products of each pair of parts of a contact, row by row, contact after contact.
    slots: Vec<Slot>,
    /// `Q⁻¹` of the contacts.
    q_inverse: Vec<Block<D>>,
    y: Vec<f64>,
    scratch: Vec<f64>,
}

/// The rows of H by contact and body, one after the other.
struct Touches<const D: usize> {
    /// The parts of contact c: `parts[first[c]..first[c + 1]]`.
    first: Vec<usize>,
    parts: Vec<Part>,
    /// Of each part, the entries of H of each of its unknowns.
    rows: Vec<[f64; D]>,
}

/// A body that a contact touches.
#[derive(Clone, Copy)]
struct Part {
    node: u32,
    /// How many unknowns the node has.
    size: u32,
    /// The first of them, of the factor's unknowns.
    start: usize,
    /// Its first row of H.
    rows: usize,
}

impl Part {
    /// Its rows of H.
    #[inline(always)]
    fn of<'a, const D: usize>(&self, rows: &'a [[f64; D]]) -> &'a [[f64; D]] {
        &rows[self.rows..self.rows + self.size as usize]
    }
}

impl<const D: usize> Touches<D> {
    fn contacts(&self) -> usize {
        self.first.len() - 1
    }

    /// The parts of contact c.
    #[inline(always)]
    fn of(&self, c: usize) -> &[Part] {
        &self.parts[self.first[c]..self.first[c + 1]]
    }

    fn new(h: &Csc, nodes: &Nodes) -> Self {
        let contacts = h.ncols() / D;
        let mut out = Self { first: vec![0], parts: vec![], rows: vec![] };
        let mut list: Vec<u32> = vec![];
        for c in 0..contacts {
            let entries = |k: usize| {
                let (rows, values) = h.column(D * c + k);
                rows.iter().zip(values).filter(|e| *e.1 != 0.0)
            };
            list.clear();
            list.extend((0..D).flat_map(|k| entries(k).map(|(&i, _)| nodes.of[i])));
            list.sort_unstable();
            list.dedup();
            let begin = out.parts.len();
            for &node in &list {
                let (size, start) = (nodes.sizes[node as usize], nodes.start[node as usize]);
                out.parts.push(Part { node, size: size as u32, start, rows: out.rows.len() });
                out.rows.resize(out.rows.len() + size, [0.0; D]);
            }
            for k in 0..D {
                for (&i, &value) in entries(k) {
                    let part = list.binary_search(&nodes.of[i]).expect("listed");
                    out.rows[out.parts[begin + part].rows + nodes.within[i]][k] = value;
                }
            }
            out.first.push(out.parts.len());
        }
        out
    }

    /// The pairs of nodes that a contact couples, each node with itself too.
    fn pairs(&self) -> impl Iterator<Item = (u32, u32)> + Clone {
        (0..self.contacts()).flat_map(|c| {
            let parts = self.of(c);
            parts.iter().flat_map(move |a| parts.iter().map(move |b| (a.node, b.node)))
        })
    }
}

impl<const D: usize> BodyForm<D> {
    /// `matrix` is M, or M bordered by bilateral constraints (its rows after those of H).
    pub(super) fn new(matrix: &Csc, h: &Csc) -> Result<Self, TooLarge> {
        Self::after(None, matrix, h)
    }

    /// As [`new`](Self::new), with the analysis of an earlier form where that serves: the bodies are the same, and no two of them touch that
    /// did not touch before.
    pub(super) fn after(earlier: Option<Self>, matrix: &Csc, h: &Csc) -> Result<Self, TooLarge> {
        let nodes = Nodes::new::<D>(matrix, h);
        let touches = Touches::new(h, &nodes);
        let lu = {
            let couplings = matrix.triplets().map(|(i, j, _)| (nodes.of[i], nodes.of[j]));
            let edges = couplings.chain(touches.pairs()).filter(|(i, j)| i != j);
            match earlier {
                Some(Self { lu, .. }) if lu.serves(&nodes.sizes, edges.clone()) => lu,
                _ => BlockLu::new(&nodes.sizes, edges)?,
            }
        };
        let slots = touches.pairs().map(|(a, b)| lu.slot(a as usize, b as usize)).collect();
        // M by blocks.
        let mut blocks = std::collections::BTreeMap::new();
        for (i, j, value) in matrix.triplets() {
            let (a, b) = (nodes.of[i] as usize, nodes.of[j] as usize);
            let width = nodes.sizes[b];
            let block = blocks.entry((a, b)).or_insert_with(|| vec![0.0; nodes.sizes[a] * width]);
            block[nodes.within[i] * width + nodes.within[j]] += value;
        }
        let mass = blocks.into_iter().map(|((a, b), v)| (lu.slot(a, b), v)).collect();
        let largest = nodes.sizes.iter().max().copied().unwrap_or(0);
        Ok(Self {
            mass,
            slots,
            q_inverse: vec![[[0.0; D]; D]; touches.contacts()],
            touches,
            y: vec![0.0; lu.dim()],
            scratch: vec![0.0; largest * largest],
            lu,
        })
    }
}

impl<const D: usize> Form<D> for BodyForm<D> {
    fn factorise(&mut self, p: &[Block<D>], q: &[Block<D>]) -> Result<(), Singular> {
        let Self { lu, mass, touches, slots, q_inverse, scratch, .. } = self;
        lu.clear();
        for (slot, block) in mass {
            lu.add_at(*slot, block);
        }
        let mut slots = &slots[..];
        for c in 0..touches.contacts() {
            let parts = touches.of(c);
            let (own, others) = slots.split_at(parts.len() * parts.len());
            slots = others;
            q_inverse[c] = small::inverse(&q[c]).ok_or(Singular)?;
            if p[c] == [[0.0; D]; D] {
                continue;
            }
            let weight = multiply(&q_inverse[c], &p[c]); //                Q⁻¹P
            for (a, slots) in parts.iter().zip(own.chunks(parts.len().max(1))) {
                let a = a.of(&touches.rows);
                for (b, slot) in parts.iter().zip(slots) {
                    let b = b.of(&touches.rows);
                    let block = &mut scratch[..a.len() * b.len()];
                    match (a.len(), b.len()) {
                        // Of bodies in space, and in the plane.
                        (6, 6) => outer::<6, D>(a, &weight, b, block),
                        (3, 3) => outer::<3, D>(a, &weight, b, block),
                        _ => outer_of_any(a, &weight, b, block),
                    }
                    lu.add_at(*slot, block); //                            H Q⁻¹P Hᵀ
                }
            }
        }
        lu.factorise()
    }

    /// `det (Q + P W) = det Q det(M + H Q⁻¹P Hᵀ)/det M`.
    fn sign(&self) -> f64 {
        let blocks = self.q_inverse.iter().map(|q| small::determinant(q).signum());
        self.lu.sign() * blocks.product::<f64>()
    }

    fn solve(&mut self, p: &[Block<D>], b: &mut [f64]) {
        let Self { lu, touches, q_inverse, y, .. } = self;
        y.fill(0.0);
        for c in 0..touches.contacts() {
            let x = small::mul(&q_inverse[c], &small::block(b, c)); //     Q⁻¹ b
            b[D * c..D * c + D].copy_from_slice(&x);
            for part in touches.of(c) {
                for (y, h) in y[part.start..].iter_mut().zip(part.of(&touches.rows)) {
                    *y += (0..D).map(|k| h[k] * x[k]).sum::<f64>(); //     H Q⁻¹ b
                }
            }
        }
        lu.solve(y);
        let (y, touches, q_inverse) = (&*y, &*touches, &*q_inverse);
        pieces::writing(touches.contacts(), PIECE, [b], |piece, [b]| {
            for (b, c) in b.chunks_mut(D).zip(piece) {
                let mut u = [0.0; D];
                for part in touches.of(c) {
                    for (y, h) in y[part.start..].iter().zip(part.of(&touches.rows)) {
                        (0..D).for_each(|k| u[k] += h[k] * y); //          Hᵀ y
                    }
                }
                let x = small::mul(&q_inverse[c], &small::mul(&p[c], &u));
                (0..D).for_each(|k| b[k] -= x[k]); //                      Q⁻¹ (b − P Hᵀ y)
            }
            []
        });
    }

    fn costs(&self, sweep: f64) -> Costs {
        let (contacts, entries) = (self.touches.contacts() as f64, self.lu.factor_len() as f64);
        Costs {
            sweep,
            factorisation: self.lu.flops() / RATE + 5.0 * entries + 900.0 * contacts,
            solve: 0.6 * entries + 200.0 * contacts,
            worth: self.lu.flops() / RATE_WORTH + 200.0 * contacts,
            look: LOOK_SWEEPS * sweep,
        }
    }
}

/// `block = A weight Bᵀ` by rows, A and B of any number of rows.
#[inline(always)]
fn outer_of_any<const D: usize>(
    a: &[[f64; D]],
    weight: &Block<D>,
    b: &[[f64; D]],
    block: &mut [f64],
) {
    for (row, a) in block.chunks_exact_mut(b.len()).zip(a) {
        let left: [f64; D] =
            std::array::from_fn(|l| (0..D).map(|k| a[k] * weight[k][l]).sum::<f64>());
        for (out, b) in row.iter_mut().zip(b) {
            *out = (0..D).map(|l| left[l] * b[l]).sum();
        }
    }
}

/// [`outer_of_any`] of N rows each, known when it is compiled.
fn outer<const N: usize, const D: usize>(
    a: &[[f64; D]],
    weight: &Block<D>,
    b: &[[f64; D]],
    block: &mut [f64],
) {
    outer_of_any(&a[..N], weight, &b[..N], &mut block[..N * N]);
}

/// The nodes of the graph that is factorised: what M couples, and unknowns that the same contacts touch, so that the six of a rigid body
/// whose M is diagonal are one node.
struct Nodes {
    /// Of each unknown: its node, and its place there.
    of: Vec<u32>,
    within: Vec<usize>,
    /// Of each node: its number of unknowns, and those of the nodes before it.
    sizes: Vec<usize>,
    start: Vec<usize>,
}

/// Unknowns of a node that are together because of contacts; what M couples may be more.
const MOST_JOINED: usize = 12;

impl Nodes {
    /// Rows of `matrix` beyond those of H, multipliers of constraints, join the first unknown that they act on.
    fn new<const D: usize>(matrix: &Csc, h: &Csc) -> Self {
        let n = h.nrows();
        let mut groups = Groups::new(n);
        let coupled = |e: &(usize, usize, f64)| e.0 < n && e.1 < n && e.2 != 0.0;
        matrix.triplets().filter(coupled).for_each(|(i, j, _)| groups.join(i, j));
        join_touched_alike::<D>(h, &mut groups);
        let mut of: Vec<u32> = groups.numbers().into_iter().map(|node| node as u32).collect();
        let mut sizes = vec![0; of.iter().max().map_or(0, |last| *last as usize + 1)];
        for j in n..matrix.ncols() {
            let (rows, values) = matrix.column(j);
            let first = rows.iter().zip(values).find(|(i, v)| **i < n && **v != 0.0);
            of.push(first.map_or(0, |(&i, _)| of[i]));
        }
        let mut within = Vec::with_capacity(of.len());
        for &node in &of {
            within.push(sizes[node as usize]);
            sizes[node as usize] += 1;
        }
        let before = |next: &mut usize, size: &usize| {
            let start = *next;
            *next += size;
            Some(start)
        };
        let start = sizes.iter().scan(0, before).collect();
        Self { of, within, sizes, start }
    }
}

/// Joins unknowns that the same contacts touch.
fn join_touched_alike<const D: usize>(h: &Csc, groups: &mut Groups) {
    let n = h.nrows();
    // The contacts of each unknown, in order: a counting sort of the entries of H.
    let touching = || {
        (0..h.ncols()).flat_map(move |j| {
            let (rows, values) = h.column(j);
            let there = rows.iter().zip(values).filter(|e| *e.1 != 0.0);
            there.map(move |(&i, _)| (i, (j / D) as u32))
        })
    };
    let mut end = vec![0; n + 1];
    touching().for_each(|(i, _)| end[i + 1] += 1);
    (0..n).for_each(|i| end[i + 1] += end[i]);
    let (first, mut contacts) = (end.clone(), vec![0; end[n]]);
    for (i, c) in touching() {
        if end[i] == first[i] || contacts[end[i] - 1] != c {
            contacts[end[i]] = c;
            end[i] += 1;
        }
    }
    let mut size = vec![0; n];
    (0..n).for_each(|i| size[groups.root(i)] += 1);
    let mut alike = std::collections::HashMap::new();
    for i in (0..n).filter(|&i| end[i] > first[i]) {
        let other = *alike.entry(&contacts[first[i]..end[i]]).or_insert(i);
        let (a, b) = (groups.root(i), groups.root(other));
        if a != b && size[a] + size[b] <= MOST_JOINED {
            let together = size[a] + size[b];
            groups.join(a, b);
            size[groups.root(a)] = together;
        }
    }
}

/// `A B`.
fn multiply<const D: usize>(a: &Block<D>, b: &Block<D>) -> Block<D> {
    let mut out = [[0.0; D]; D];
    for i in 0..D {
        for k in 0..D {
            for j in 0..D {
                out[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::Problem;
    use nonsmooth_problem::planted::Planted;

    use super::*;
    use crate::Reformulation;
    use crate::contact::Condense;
    use crate::contact::form::{Access, Linearised};

    /// Blocks of an Alart–Curnier Jacobian: open, sticking (Q = 0) and sliding contacts in turn.
    fn blocks(unit: impl Iterator<Item = f64>) -> (Vec<Block<3>>, Vec<Block<3>>) {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let scaled = |a: f64| identity.map(|row| row.map(|x| a * x));
        unit.enumerate()
            .map(|(c, w)| match c % 3 {
                0 => (scaled(0.0), identity),
                1 => (scaled(1.0 / w), scaled(0.0)),
                _ => (
                    [[1.0 / w, 0.0, 0.0], [0.6 / w, 0.4 / w, 0.0], [0.8 / w, 0.0, 0.4 / w]],
                    [[0.0, 0.0, 0.0], [-0.6, 0.7, 0.1], [-0.8, 0.1, 0.6]],
                ),
            })
            .unzip()
    }

    fn solved<P: Linearised<3>>(problem: &P) -> (Vec<f64>, Vec<f64>) {
        let mut state = problem.state(Access::Newton).unwrap();
        let nc = problem.contacts();
        let unit: Vec<f64> =
            (0..nc).map(|c| small::mean_diagonal(&problem.diagonal_block(&state, c))).collect();
        let (p, q) = blocks(unit.into_iter());
        let b: Vec<f64> = (0..3 * nc).map(|i| (i as f64).sin()).collect();
        let (mut x, mut wx) = (vec![0.0; 3 * nc], vec![0.0; 3 * nc]);
        problem.linearise(&mut state, &p, &q).unwrap();
        let left = problem.solve_linearised(&mut state, &b, &mut x, &mut wx);
        assert!(left < 1e-12, "{left:e}");
        // The system holds, with W from its definition as a difference of velocities.
        let (mut u, mut u0) = (vec![0.0; 3 * nc], vec![0.0; 3 * nc]);
        problem.velocities(&mut state, &x, &mut u);
        problem.velocities(&mut state, &vec![0.0; 3 * nc], &mut u0);
        for c in 0..nc {
            let w: [f64; 3] = std::array::from_fn(|k| u[3 * c + k] - u0[3 * c + k]);
            let (pw, qx) = (small::mul(&p[c], &w), small::mul(&q[c], &small::block(&x, c)));
            for k in 0..3 {
                assert!((pw[k] + qx[k] - b[3 * c + k]).abs() < 1e-8, "contact {c}");
                assert!((w[k] - wx[3 * c + k]).abs() < 1e-9);
            }
        }
        (x, wx)
    }

    #[test]
    fn body_and_contact_forms_solve_the_same_system() {
        for (bilateral, skew) in [(0, 0.0), (0, 0.02), (4, 0.0)] {
            let planted = Planted { contacts: 12, dofs: 60, bilateral, skew, ..Planted::default() };
            let (global, _) = planted.global::<3>();
            let (local, _) = Condense.reduce(&global).unwrap();
            assert_eq!(local.unknowns(), 36);
            let ((x, wx), (y, wy)) = (solved(&global), solved(&local));
            for i in 0..36 {
                assert!((x[i] - y[i]).abs() < 1e-7 * (1.0 + x[i].abs()), "{bilateral} {i}");
                assert!((wx[i] - wy[i]).abs() < 1e-8 * (1.0 + wx[i].abs()), "{bilateral} {i}");
            }
        }
    }

    #[test]
    fn unknowns_that_the_same_contacts_touch_are_one_node() {
        // Two bodies of six with a diagonal M, on the ground and on each other; a third that nothing touches.
        let entries = |contact: usize, bodies: &'static [usize]| {
            let of = move |b: &usize| {
                let b = *b;
                (0..18).map(move |k| (6 * b + k / 3, 3 * contact + k % 3, 1.0 + k as f64))
            };
            bodies.iter().flat_map(of)
        };
        let h = entries(0, &[0]).chain(entries(1, &[0, 1]));
        let h = Csc::from_triplets(18, 6, h).unwrap();
        let nodes = Nodes::new::<3>(&Csc::diagonal(&[1.0; 18]), &h);
        assert_eq!(nodes.sizes, [6, 6, 1, 1, 1, 1, 1, 1]);
        assert_eq!(nodes.of[..12], [0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1]);
        // A multiplier joins the first unknown that it acts on.
        let bordered = (0..19).map(|i| (i, i, 1.0)).chain([(7, 18, 1.0), (18, 7, 1.0)]);
        let bordered = Csc::from_triplets(19, 19, bordered).unwrap();
        assert_eq!(Nodes::new::<3>(&bordered, &h).sizes, [6, 7, 1, 1, 1, 1, 1, 1]);
    }

    #[test]
    fn fewer_contacts_between_the_same_bodies_need_no_new_analysis() {
        let (problem, _) = Planted { contacts: 12, dofs: 60, ..Planted::default() }.global::<3>();
        let fewer = Csc::from_triplets(60, 27, problem.H.triplets().filter(|e| e.1 < 27)).unwrap();
        let mut first = BodyForm::<3>::new(&problem.M, &problem.H).unwrap();
        let (p, q) = blocks((0..9).map(|_| 1.0));
        let regular = p.iter().zip(q).map(|(p, mut q)| {
            (0..3).for_each(|k| (0..3).for_each(|l| q[k][l] += 0.5 * p[k][l]));
            q
        });
        let regular: Vec<Block<3>> = regular.collect();
        let flops = first.lu.flops();
        let solve = |form: &mut BodyForm<3>| {
            form.factorise(&p, &regular).unwrap();
            let mut b: Vec<f64> = (0..27).map(|i| (i as f64).sin()).collect();
            form.solve(&p, &mut b);
            b
        };
        // The earlier analysis has more couplings than the new one would.
        let mut fresh = BodyForm::new(&problem.M, &fewer).unwrap();
        assert!(fresh.lu.flops() < flops);
        first = BodyForm::after(Some(first), &problem.M, &fewer).unwrap();
        assert_eq!(first.lu.flops(), flops);
        let (a, b) = (solve(&mut first), solve(&mut fresh));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + b.abs())));
        // More contacts than were analysed: anew.
        let more = BodyForm::after(Some(fresh), &problem.M, &problem.H).unwrap();
        assert_eq!(more.lu.flops(), flops);
    }

    #[test]
    fn hyperstatic_systems_are_solved_by_a_proximal_term() {
        // 3nc = 60 unknowns, rank 12: Q = ε w_c P.
        let planted = Planted { contacts: 20, dofs: 12, ..Planted::default() };
        let (global, _) = planted.global::<3>();
        let (local, _) = Condense.reduce(&global).unwrap();
        fn residual<P: Linearised<3>>(problem: &P) -> f64 {
            let mut state = problem.state(Access::Newton).unwrap();
            let nc = problem.contacts();
            let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let unit = |c| small::mean_diagonal(&problem.diagonal_block(&state, c));
            let q: Vec<_> =
                (0..nc).map(|c| identity.map(|row| row.map(|x| 1e-6 * unit(c) * x))).collect();
            problem.linearise(&mut state, &vec![identity; nc], &q).unwrap();
            let b: Vec<f64> = (0..3 * nc).map(|i| (i as f64).cos()).collect();
            let (mut x, mut wx) = (vec![0.0; 3 * nc], vec![0.0; 3 * nc]);
            problem.solve_linearised(&mut state, &b, &mut x, &mut wx)
        }
        assert!(residual(&global) < 1e-9, "{:e}", residual(&global));
        assert!(residual(&local) < 1e-9, "{:e}", residual(&local));
    }
}
