//! The Delassus operator W = Hᵀ M⁻¹ H of a global problem: its diagonal, its condensation, and its factors
//! contact by contact.

use super::budget::Pace;
use super::passes::{Parts, Passes};
use super::pieces;
use super::roots::Roots;
use super::row::prefetch;
use super::{Block, BlockRow, Bsr, Csc, Inverse, small};

/// `W = Hᵀ M⁻¹ H` without W, for the movements of Gauss–Seidel in velocity space: `u_c = H_cᵀ v + w_c` and `v += M⁻¹ H_c Δr_c` cost O(rows touched).
///
/// Where M falls into small symmetric blocks, `M = L Lᵀ` (rigid bodies), the velocities are kept as `y = Lᵀ v`, and with `A = L⁻¹ H` one matrix serves both ways:
/// `u_c = A_cᵀ y + w_c`, `y += A_c Δr_c`. Else y = v, and `Z = M⁻¹ H` is kept beside H. With bilateral constraints `M⁻¹` stands for the velocity
/// part of `[M, −G; Gᵀ, 0]⁻¹`.
///
/// Storage: `8 D` bytes for each touched row: 12 rows a contact between two rigid bodies, but all degrees of freedom of a finite element body in Z
/// (condense those instead).
#[derive(Debug, Clone)]
pub struct Delassus<const D: usize> {
    /// A, or H; of many contacts in the order of the passes.
    seen: Columns<D>,
    response: Response<D>,
    diagonal: Vec<Block<D>>,
    passes: Option<Passes>,
}

/// Parts of the contacts whose impulses are added by themselves before all are: no more than several threads come for, since each has memory of its own.
const SLABS: usize = pieces::SHARED;
/// The fewest contacts that are worth a piece of their own, and unknowns.
const PIECE: usize = 64;
const UNKNOWNS: usize = 2048;

/// The velocities of a [`Delassus`] while several threads visit contacts.
#[derive(Debug)]
pub struct Moving<'a, const D: usize> {
    delassus: &'a Delassus<D>,
    y: Parts<'a, f64>,
}

/// What an impulse does to y.
#[derive(Debug, Clone)]
enum Response<const D: usize> {
    /// A, by the roots of M.
    Rooted(Roots),
    /// Z.
    Direct(Columns<D>),
}

impl<const D: usize> Delassus<D> {
    /// Keeps A where M has roots, else H (n × D·nc) and `Z = M⁻¹ H`. `inverse` may carry bilateral rows after n.
    ///
    /// Cost: with roots O(rows touched), else D solves for each contact and component of M that it touches.
    pub fn new(h: &Csc, inverse: &Inverse) -> Self {
        Self::arranged(h, inverse, usize::MAX)
    }

    /// The same; at least so many contacts are kept in an order in which sweeps can follow each other closely, where M has roots.
    pub fn arranged(h: &Csc, inverse: &Inverse, many: usize) -> Self {
        let Some(roots) = Roots::of(inverse) else {
            return Self::direct(h, inverse);
        };
        let passes = (h.ncols() / D >= many).then(|| passes::<D>(h, inverse));
        Self::rooted(h, inverse, roots, passes)
    }

    /// Keeps H and Z whatever M is: y = v.
    pub fn direct(h: &Csc, inverse: &Inverse) -> Self {
        let (mut seen, mut z_rows) = (Columns::new(), Columns::new());
        let diagonal = with_diagonal::<D>(h, inverse, |h, z| {
            seen.push(h);
            z_rows.push(z);
        });
        Self { seen, response: Response::Direct(z_rows), diagonal, passes: None }
    }

    fn rooted(h: &Csc, inverse: &Inverse, roots: Roots, passes: Option<Passes>) -> Self {
        let nc = h.ncols() / D;
        let mut seen = Columns::new();
        let mut diagonal = vec![[[0.0; D]; D]; nc];
        let (mut touched, mut local, mut rows) = (vec![], vec![], vec![]);
        let mut pace = Pace::default();
        let mut late = false;
        for c in (0..nc).map(|at| passes.as_ref().map_or(at, |passes| passes.item(at))) {
            let of_h = block_column::<D>(h, c);
            late = late || pace.over(100.0 * of_h.len() as f64);
            if late {
                // Nobody will use it: the shape alone.
                seen.push(&of_h);
                continue;
            }
            touched.clear();
            touched.extend(of_h.iter().map(|(i, _)| inverse.component_of(*i as usize)));
            touched.sort_unstable();
            touched.dedup();
            rows.clear();
            for &k in &touched {
                let index = inverse.component(k);
                local.clear();
                local.resize(index.len(), [0.0; D]);
                for (i, row) in &of_h {
                    if inverse.component_of(*i as usize) == k {
                        local[inverse.place_in_component(*i as usize)] = *row;
                    }
                }
                roots.solve(k, &mut local);
                rows.extend(index.iter().zip(&local).map(|(&i, &row)| (i as u32, row)));
            }
            rows.retain(|(_, row): &(u32, [f64; D])| row.iter().any(|&x| x != 0.0));
            rows.sort_unstable_by_key(|row| row.0);
            rows.iter().for_each(|(_, row)| add_outer(&mut diagonal[c], row, row));
            seen.push(&rows);
        }
        Self { seen, response: Response::Rooted(roots), diagonal, passes }
    }

    /// The diagonal blocks `W_cc = H_cᵀ M⁻¹ H_c`. Cost as [`new`](Self::new); keeps nothing else.
    pub fn diagonal(h: &Csc, inverse: &Inverse) -> Vec<Block<D>> {
        with_diagonal::<D>(h, inverse, |_, _| {})
    }

    /// The diagonal block `W_cc`.
    pub fn diagonal_block(&self, c: usize) -> &Block<D> {
        &self.diagonal[c]
    }

    /// Forms W in block-sparse rows, `W_ij = H_iᵀ Z_j`, one Z_j at a time.
    ///
    /// Cost: the solves of [`new`](Self::new), and Σ over degrees of freedom of (contacts in H) × (contacts in Z).
    pub fn condense(h: &Csc, inverse: &Inverse) -> Bsr<D> {
        let nc = h.ncols() / D;
        // Contacts whose H touches a degree of freedom.
        let mut touching: Vec<Vec<(u32, [f64; D])>> = vec![Vec::new(); h.nrows()];
        for c in 0..nc {
            for (i, row) in block_column::<D>(h, c) {
                touching[i as usize].push((c as u32, row));
            }
        }
        let mut rows: Vec<BlockRow<D>> = vec![Vec::new(); nc];
        let mut slot = vec![usize::MAX; nc];
        let mut met: BlockRow<D> = Vec::new();
        solve_columns::<D>(h, inverse, |j, _, z| {
            for (dof, row) in z {
                for &(i, ref h_row) in &touching[*dof as usize] {
                    let at = &mut slot[i as usize];
                    if *at == usize::MAX {
                        *at = met.len();
                        met.push((i, [[0.0; D]; D]));
                    }
                    add_outer(&mut met[*at].1, h_row, row);
                }
            }
            for (i, w) in met.drain(..) {
                slot[i as usize] = usize::MAX;
                rows[i as usize].push((j as u32, w));
            }
        });
        Bsr::from_rows(nc, &rows)
    }

    /// The bytes that [`condense`](Self::condense) takes, from above: every pair of contacts that touch the same component of M.
    pub fn condensed_bytes(h: &Csc, inverse: &Inverse) -> f64 {
        let pairs = |count: usize, _: usize| (count * count) as f64;
        // The rows as they are filled, and the matrix that is made of them.
        2.0 * (8 * D * D + 8) as f64 * sum_over_components::<D>(h, inverse, pairs)
    }

    /// The bytes that [`new`](Self::new) keeps of Z, from above.
    pub fn kept_bytes(h: &Csc, inverse: &Inverse) -> f64 {
        let rows = |count: usize, size: usize| (count * size) as f64;
        (8 * D + 8) as f64 * sum_over_components::<D>(h, inverse, rows)
    }

    /// `y` of the velocities v. `inverse` is the one that this was made from.
    pub fn enter(&self, inverse: &Inverse, v: &[f64], y: &mut [f64]) {
        match &self.response {
            Response::Rooted(roots) => roots.transposed(inverse, v, y),
            Response::Direct(_) => y.copy_from_slice(v),
        }
    }

    /// `y` of the velocities `v + M⁻¹ H r` on all threads that the budget allows, where `base` is the y of v, or of zero where it is not given; false, and nothing done, of
    /// contacts that were not [`arranged`](Self::arranged). `room` is memory.
    pub fn receive(
        &self,
        base: Option<&[f64]>,
        r: &[f64],
        y: &mut [f64],
        room: &mut Vec<f64>,
    ) -> bool {
        let (Some(passes), n) = (&self.passes, y.len()) else { return false };
        let contacts = r.len() / D;
        let slab = contacts.div_ceil(SLABS);
        room.resize(SLABS * n, 0.0);
        // Each part of the contacts, in the order in which they lie in memory, has a y of its own.
        pieces::writing(SLABS, 1, [&mut room[..]], |piece, [own]| {
            for (own, k) in own.chunks_exact_mut(n.max(1)).zip(piece) {
                own.fill(0.0);
                for at in (k * slab).min(contacts)..((k + 1) * slab).min(contacts) {
                    let impulse: [f64; D] = small::block(r, passes.item(at));
                    self.seen.each_run(at, |first, rows| {
                        add_transposed_product(&mut own[first..][..rows.len()], rows, &impulse);
                    });
                }
            }
            []
        });
        pieces::writing(n, UNKNOWNS, [y], |piece, [y]| {
            match base {
                Some(base) => y.copy_from_slice(&base[piece.clone()]),
                None => y.fill(0.0),
            }
            for own in room.chunks_exact(n) {
                y.iter_mut().zip(&own[piece.clone()]).for_each(|(y, own)| *y += own);
            }
            []
        });
        true
    }

    /// `u_c = H_cᵀ v` of all contacts, of y, on all threads that the budget allows.
    pub fn local_velocities(&self, y: &[f64], u: &mut [f64]) {
        let (contacts, u) = (u.len() / D, Parts::of(u));
        pieces::each(contacts, PIECE, |piece| {
            for at in piece {
                let c = self.passes.as_ref().map_or(at, |passes| passes.item(at));
                // SAFETY: each contact has one position.
                let u = unsafe { u.part(D * c, D) };
                u.copy_from_slice(&self.velocity_at(at, y));
            }
        });
    }

    /// How sweeps may follow each other, of contacts that were [`arranged`](Self::arranged).
    pub fn passes(&self) -> Option<&Passes> {
        self.passes.as_ref()
    }

    /// Where there are passes, for visits from several threads.
    pub fn moving<'a>(&'a self, y: &'a mut [f64]) -> Option<(&'a Passes, Moving<'a, D>)> {
        Some((self.passes.as_ref()?, Moving { delassus: self, y: Parts::of(y) }))
    }

    /// The column of contact c.
    #[inline(always)]
    fn at(&self, c: usize) -> usize {
        self.passes.as_ref().map_or(c, |passes| passes.position(c))
    }

    /// `H_cᵀ v`, of y.
    #[inline(always)]
    pub fn local_velocity(&self, c: usize, y: &[f64]) -> [f64; D] {
        self.velocity_at(self.at(c), y)
    }

    /// The same of the contact in a column.
    #[inline(always)]
    fn velocity_at(&self, at: usize, y: &[f64]) -> [f64; D] {
        let mut u = [0.0; D];
        self.seen.each_run(at, |first, rows| {
            add_product(&mut u, rows, &y[first..first + rows.len()]);
        });
        u
    }

    /// Fetches what a visit of contact c reads and writes of y into the cache: bodies that meet are far apart in memory.
    #[inline(always)]
    pub fn foresee(&self, c: usize, y: &[f64]) {
        self.seen.each_run(self.at(c), |first, rows| {
            let y = &y[first..first + rows.len()];
            y.first().into_iter().chain(y.last()).for_each(|y| prefetch(y));
        });
    }

    /// `v += M⁻¹ H_c dr`, on y.
    #[inline(always)]
    pub fn apply_impulse(&self, c: usize, dr: &[f64; D], y: &mut [f64]) {
        self.response().each_run(self.at(c), |first, rows| {
            add_transposed_product(&mut y[first..first + rows.len()], rows, dr);
        });
    }

    #[inline(always)]
    fn response(&self) -> &Columns<D> {
        match &self.response {
            Response::Rooted(_) => &self.seen,
            Response::Direct(z) => z,
        }
    }
}

/// Contacts by their position in the passes.
impl<const D: usize> Moving<'_, D> {
    /// [`Delassus::foresee`], of what others may be writing.
    #[inline(always)]
    pub fn foresee(&self, at: usize) {
        self.delassus.seen.each_run(at, |first, rows| {
            self.y.prefetch(first, rows.len());
        });
    }

    /// [`Delassus::local_velocity`].
    ///
    /// # Safety
    ///
    /// Nobody else visits a contact meanwhile that touches a component of M in common with this one.
    #[inline(always)]
    pub unsafe fn local_velocity(&self, at: usize) -> [f64; D] {
        let mut u = [0.0; D];
        self.delassus.seen.each_run(at, |first, rows| {
            // SAFETY: the rows of a contact's own components, which are the caller's.
            add_product(&mut u, rows, unsafe { self.y.part(first, rows.len()) });
        });
        u
    }

    /// [`Delassus::apply_impulse`].
    ///
    /// # Safety
    ///
    /// As of [`local_velocity`](Self::local_velocity).
    #[inline(always)]
    pub unsafe fn apply_impulse(&self, at: usize, dr: &[f64; D]) {
        // Passes are arranged with roots alone: what is seen is what responds.
        self.delassus.seen.each_run(at, |first, rows| {
            // SAFETY: as above.
            add_transposed_product(unsafe { self.y.part(first, rows.len()) }, rows, dr);
        });
    }
}

/// `u += Aᵀ y`.
#[inline(always)]
fn add_product<const D: usize>(u: &mut [f64; D], a: &[[f64; D]], y: &[f64]) {
    for (row, y) in a.iter().zip(y) {
        for k in 0..D {
            u[k] += row[k] * y;
        }
    }
}

/// `y += A dr`.
#[inline(always)]
fn add_transposed_product<const D: usize>(y: &mut [f64], a: &[[f64; D]], dr: &[f64; D]) {
    for (row, y) in a.iter().zip(y) {
        for k in 0..D {
            *y += row[k] * dr[k];
        }
    }
}

/// The passes over contacts that touch the components of M.
fn passes<const D: usize>(h: &Csc, inverse: &Inverse) -> Passes {
    let (mut ptr, mut places) = (vec![0], vec![]);
    for c in 0..h.ncols() / D {
        let first = places.len();
        for &i in (D * c..D * c + D).flat_map(|j| h.column(j).0) {
            let component = inverse.component_of(i) as u32;
            if !places[first..].contains(&component) {
                places.push(component);
            }
        }
        ptr.push(places.len() as u32);
    }
    Passes::new(&ptr, &places, inverse.component_sizes().count())
}

/// A sparse n × (D·nc) matrix by block columns, each a few runs of rows that follow each other, with D entries a row.
#[derive(Debug, Clone)]
struct Columns<const D: usize> {
    /// Where the runs and the rows of each contact begin.
    ptr: Vec<(usize, usize)>,
    /// First row and number of rows.
    runs: Vec<(u32, u32)>,
    rows: Vec<[f64; D]>,
}

impl<const D: usize> Columns<D> {
    fn new() -> Self {
        Self { ptr: vec![(0, 0)], runs: vec![], rows: vec![] }
    }

    fn push(&mut self, rows: &[(u32, [f64; D])]) {
        for run in rows.chunk_by(|a, b| a.0 + 1 == b.0) {
            self.runs.push((run[0].0, run.len() as u32));
        }
        self.rows.extend(rows.iter().map(|row| row.1));
        self.ptr.push((self.runs.len(), self.rows.len()));
    }

    /// Calls `visit` with the first row and the rows of each run of contact c.
    #[inline(always)]
    fn each_run(&self, c: usize, mut visit: impl FnMut(usize, &[[f64; D]])) {
        let ((run, row), (run_end, row_end)) = (self.ptr[c], self.ptr[c + 1]);
        let mut rows = &self.rows[row..row_end];
        for &(first, len) in &self.runs[run..run_end] {
            let (now, rest) = rows.split_at(len as usize);
            visit(first as usize, now);
            rows = rest;
        }
    }
}

/// `Σ f(contacts that touch it, size)` over the components of M.
fn sum_over_components<const D: usize>(
    h: &Csc,
    inverse: &Inverse,
    f: impl Fn(usize, usize) -> f64,
) -> f64 {
    let sizes: Vec<usize> = inverse.component_sizes().collect();
    let (mut counts, mut last) = (vec![0_usize; sizes.len()], vec![usize::MAX; sizes.len()]);
    for c in 0..h.ncols() / D {
        for &i in (D * c..D * c + D).flat_map(|j| h.column(j).0) {
            let k = inverse.component_of(i);
            if last[k] != c {
                last[k] = c;
                counts[k] += 1;
            }
        }
    }
    counts.iter().zip(sizes).map(|(&count, size)| f(count, size)).sum()
}

/// `w += aᵀ b` for two rows.
#[inline(always)]
fn add_outer<const D: usize>(w: &mut Block<D>, a: &[f64; D], b: &[f64; D]) {
    for k in 0..D {
        for l in 0..D {
            w[k][l] += a[k] * b[l];
        }
    }
}

/// The rows of `H_c` that hold something, in order.
fn block_column<const D: usize>(h: &Csc, c: usize) -> Vec<(u32, [f64; D])> {
    let mut rows: Vec<(u32, [f64; D])> = Vec::new();
    for k in 0..D {
        let (indices, values) = h.column(D * c + k);
        for (&i, &value) in indices.iter().zip(values) {
            let i = u32::try_from(i).expect("fewer than 2³² degrees of freedom");
            let at = rows.binary_search_by_key(&i, |r| r.0).unwrap_or_else(|at| {
                rows.insert(at, (i, [0.0; D]));
                at
            });
            rows[at].1[k] = value;
        }
    }
    rows
}

/// As [`solve_columns`], and returns the diagonal blocks.
fn with_diagonal<const D: usize>(
    h: &Csc,
    inverse: &Inverse,
    mut visit: impl FnMut(&[(u32, [f64; D])], &[(u32, [f64; D])]),
) -> Vec<Block<D>> {
    let mut blocks = Vec::with_capacity(h.ncols() / D);
    let mut dense = vec![[0.0; D]; h.nrows()];
    solve_columns::<D>(h, inverse, |_, h, z| {
        h.iter().for_each(|&(i, row)| dense[i as usize] = row);
        let mut w = [[0.0; D]; D];
        z.iter().for_each(|(i, row)| add_outer(&mut w, &dense[*i as usize], row));
        h.iter().for_each(|&(i, _)| dense[i as usize] = [0.0; D]);
        blocks.push(w);
        visit(h, z);
    });
    blocks
}

/// Contacts whose columns are solved together where a component is large: its factor is read from memory once for
/// all of them (55 566 degrees of freedom, 361 contacts: 13 s in place of about 390 s).
const TOGETHER: usize = 16;

/// Hands `H_c` and `Z_c = M⁻¹ H_c` of each contact in turn to `visit`, both as rows that hold something. Once the time is over (see
/// [`budget`](super::budget)) the rest of Z is empty.
fn solve_columns<const D: usize>(
    h: &Csc,
    inverse: &Inverse,
    mut visit: impl FnMut(usize, &[(u32, [f64; D])], &[(u32, [f64; D])]),
) {
    let n = h.nrows();
    let (mut x, mut z, mut scratch) = (Vec::new(), Vec::new(), Vec::new());
    let mut starts = Vec::new();
    // Each component that a contact touches: (component, contact of the group).
    let mut touched: Vec<(usize, usize)> = Vec::new();
    let together = if inverse.has_sparse_factor() { TOGETHER } else { 1 };
    let contacts: Vec<usize> = (0..h.ncols() / D).collect();
    let mut pace = Pace::default();
    let mut late = false;
    for group in contacts.chunks(together) {
        if late {
            // Nobody will use it: the shape alone.
            group.iter().for_each(|&c| visit(c, &block_column::<D>(h, c), &[]));
            continue;
        }
        let rows: Vec<_> = group.iter().map(|&c| block_column::<D>(h, c)).collect();
        touched.clear();
        for (g, rows) in rows.iter().enumerate() {
            touched.extend(rows.iter().map(|r| (inverse.component_of(r.0 as usize), g)));
        }
        touched.sort_unstable();
        touched.dedup();
        // The columns of each touched component lie one after the other, those of one component together.
        let size = |component: usize| inverse.component(component).len();
        x.clear();
        starts.clear();
        for &(component, g) in &touched {
            let (start, size) = (x.len(), size(component));
            starts.push(start);
            x.resize(start + D * size, 0.0);
            for (i, row) in &rows[g] {
                if inverse.component_of(*i as usize) == component {
                    let place = inverse.place_in_component(*i as usize);
                    (0..D).for_each(|k| x[start + k * size + place] = row[k]);
                }
            }
        }
        late = pace.over(100.0 * x.len() as f64);
        let mut start = 0;
        for pairs in touched.chunk_by(|a, b| a.0 == b.0) {
            let component = pairs[0].0;
            let end = start + pairs.len() * D * size(component);
            inverse.solve_columns(component, &mut x[start..end], &mut scratch);
            start = end;
        }
        for (g, rows) in rows.iter().enumerate() {
            z.clear();
            for (&(component, _), start) in touched.iter().zip(&starts).filter(|t| t.0.1 == g) {
                let size = size(component);
                let at = |place: usize| std::array::from_fn(|k| x[start + k * size + place]);
                let index = inverse.component(component).iter().enumerate();
                z.extend(index.map(|(place, &i)| (i as u32, at(place))));
            }
            // Rows after n are multipliers of bilateral constraints, recovered on demand.
            z.retain(|(i, row): &(u32, [f64; D])| {
                (*i as usize) < n && row.iter().any(|&v| v != 0.0)
            });
            visit(group[g], rows, &z);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;

    /// Bodies of three unknowns with full masses in a row, each contact between two that may be far apart, in an order that jumps.
    fn row(bodies: usize, contacts: usize) -> (Csc, Inverse) {
        let wave = |k: usize| (k as f64 * 0.7).sin();
        let mass = (0..bodies).flat_map(|b| {
            (0..9).map(move |k| {
                let (i, j) = (k / 3, k % 3);
                let own = if i == j { 2.0 + (b % 4) as f64 } else { 0.3 };
                (3 * b + i, 3 * b + j, own)
            })
        });
        let mass = Csc::from_triplets(3 * bodies, 3 * bodies, mass).unwrap();
        let h = (0..contacts).flat_map(|k| {
            let first = k * 7919 % contacts * (bodies - 1) / contacts;
            // Neighbours, whose unknowns follow each other, or not.
            let other = (first + 1 + 2 * (k % 3)).min(bodies - 1);
            (0..18).map(move |e| {
                let (body, row, column) = ([first, other][e / 9], e % 9 / 3, e % 3);
                (3 * body + row, 3 * k + column, wave(18 * k + e))
            })
        });
        let h = Csc::from_triplets(3 * bodies, 3 * contacts, h).unwrap();
        (h, Inverse::new(&mass, "M").unwrap())
    }

    /// And the same bits on several threads.
    #[test]
    fn impulses_are_received_as_by_the_mass_matrix() {
        let (h, inverse) = row(900, 3000);
        let (n, m) = (h.nrows(), h.ncols());
        let delassus = Delassus::<3>::arranged(&h, &inverse, 0);
        assert!(delassus.passes().is_some());
        let r: Vec<f64> = (0..m).map(|i| (i as f64 * 1.3).cos()).collect();
        let f: Vec<f64> = (0..n).map(|i| (i as f64 * 0.9).sin()).collect();
        for loads in [Some(f), None] {
            let mut v = loads.clone().unwrap_or(vec![0.0; n]);
            let base = loads.map(|mut free| {
                inverse.solve(&mut free);
                let mut base = vec![0.0; n];
                delassus.enter(&inverse, &free, &mut base);
                base
            });
            h.mul_add(1.0, &r, &mut v);
            inverse.solve(&mut v);
            let mut expected = vec![0.0; n];
            delassus.enter(&inverse, &v, &mut expected);
            let mut u = vec![0.0; m];
            h.mul_transpose_add(1.0, &v, &mut u);
            let found = [1, 3].map(|threads| {
                let _scope = Budget { threads, ..Budget::default() }.enter();
                let (mut y, mut of_contacts) = (vec![f64::NAN; n], vec![f64::NAN; m]);
                assert!(delassus.receive(base.as_deref(), &r, &mut y, &mut vec![]));
                delassus.local_velocities(&y, &mut of_contacts);
                (y, of_contacts)
            });
            assert_eq!(found[0], found[1]);
            let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(near(&found[0].0, &expected) && near(&found[0].1, &u));
        }
        let plain = Delassus::<3>::new(&h, &inverse);
        assert!(!plain.receive(None, &r, &mut vec![0.0; n], &mut vec![]));
    }
}
