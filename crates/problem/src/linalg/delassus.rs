//! The Delassus operator W = Hᵀ M⁻¹ H of a global problem, never formed, and its condensation.

use super::{Block, BlockRow, Bsr, Csc, Inverse, small};

/// `W = Hᵀ M⁻¹ H` in product form, contact by contact.
///
/// For each contact c it keeps the rows of `H_c` (n × D) that are not zero and those of `Z_c = M⁻¹ H_c`, so that
///
/// - `u_c = H_cᵀ v + w_c` and `v += Z_c Δr_c` cost O(rows touched): the movements of Gauss–Seidel in velocity space;
/// - `W r = Hᵀ Σ_c Z_c r_c` is a product without W;
/// - `W_ij = H_iᵀ Z_j` condenses it.
///
/// With bilateral constraints `M⁻¹` stands for the velocity part of `[M, −G; Gᵀ, 0]⁻¹`.
/// Storage: 8(D+½) bytes for each touched row, twice; 12 rows a contact between two rigid bodies.
#[derive(Debug, Clone)]
pub struct Delassus<const D: usize> {
    n: usize,
    h: BlockColumns<D>,
    z: BlockColumns<D>,
}

/// A sparse n × (D·nc) matrix by block columns: for each contact, rows and their D entries.
#[derive(Debug, Clone)]
struct BlockColumns<const D: usize> {
    ptr: Vec<usize>,
    row: Vec<u32>,
    entries: Vec<[f64; D]>,
}

impl<const D: usize> BlockColumns<D> {
    fn new() -> Self {
        Self { ptr: vec![0], row: vec![], entries: vec![] }
    }

    fn push(&mut self, row: usize, entries: [f64; D]) {
        self.row.push(u32::try_from(row).expect("fewer than 2³² degrees of freedom"));
        self.entries.push(entries);
    }

    #[inline(always)]
    fn column(&self, c: usize) -> impl Iterator<Item = (usize, &[f64; D])> {
        let range = self.ptr[c]..self.ptr[c + 1];
        self.row[range.clone()].iter().map(|&i| i as usize).zip(&self.entries[range])
    }
}

impl<const D: usize> Delassus<D> {
    /// Prepares the operator from H (n × D·nc) and the inverse of M, which may carry bilateral rows after n.
    ///
    /// Cost: D solves for each contact and component of M that it touches.
    pub fn new(h: &Csc, inverse: &Inverse) -> Self {
        let (n, nc) = (h.nrows(), h.ncols() / D);
        let mut out = Self { n, h: BlockColumns::new(), z: BlockColumns::new() };
        let mut dense = vec![[0.0; D]; inverse.dim()];
        let mut x = vec![0.0; inverse.scratch_len()];
        let mut scratch = vec![0.0; inverse.scratch_len()];
        let (mut touched, mut components) = (Vec::new(), Vec::new());
        for c in 0..nc {
            touched.clear();
            components.clear();
            for k in 0..D {
                let (rows, values) = h.column(D * c + k);
                for (&i, &value) in rows.iter().zip(values) {
                    dense[i][k] = value;
                    touched.push(i);
                }
            }
            touched.sort_unstable();
            touched.dedup();
            for &i in &touched {
                out.h.push(i, dense[i]);
                components.push(inverse.component_of(i));
            }
            components.sort_unstable();
            components.dedup();
            for &component in &components {
                let index = inverse.component(component);
                let mut solved = vec![[0.0; D]; index.len()];
                for k in 0..D {
                    let x = &mut x[..index.len()];
                    x.iter_mut().zip(index).for_each(|(x, &i)| *x = dense[i][k]);
                    if x.iter().any(|&v| v != 0.0) {
                        inverse.solve_component(component, x, &mut scratch);
                        solved.iter_mut().zip(x).for_each(|(s, x)| s[k] = *x);
                    }
                }
                for (&i, s) in index.iter().zip(solved) {
                    // Rows after n are multipliers of bilateral constraints, recovered on demand.
                    if i < n && s.iter().any(|&v| v != 0.0) {
                        out.z.push(i, s);
                    }
                }
            }
            out.h.ptr.push(out.h.row.len());
            out.z.ptr.push(out.z.row.len());
            touched.iter().for_each(|&i| dense[i] = [0.0; D]);
        }
        out
    }

    /// The number of contacts.
    pub fn contacts(&self) -> usize {
        self.h.ptr.len() - 1
    }

    /// The number of degrees of freedom n.
    pub fn dofs(&self) -> usize {
        self.n
    }

    /// `H_cᵀ v`.
    #[inline(always)]
    pub fn local_velocity(&self, c: usize, v: &[f64]) -> [f64; D] {
        let mut u = [0.0; D];
        for (i, h) in self.h.column(c) {
            for k in 0..D {
                u[k] += h[k] * v[i];
            }
        }
        u
    }

    /// `v += M⁻¹ H_c dr`.
    #[inline(always)]
    pub fn apply_impulse(&self, c: usize, dr: &[f64; D], v: &mut [f64]) {
        for (i, z) in self.z.column(c) {
            for k in 0..D {
                v[i] += z[k] * dr[k];
            }
        }
    }

    /// `u = W r + q` through the velocities; `v` is a buffer of n entries. Allocates nothing.
    pub fn mul_plus(&self, r: &[f64], q: &[f64], u: &mut [f64], v: &mut [f64]) {
        v.fill(0.0);
        for c in 0..self.contacts() {
            self.apply_impulse(c, &small::block(r, c), v);
        }
        for c in 0..self.contacts() {
            let uc = self.local_velocity(c, v);
            for k in 0..D {
                u[D * c + k] = uc[k] + q[D * c + k];
            }
        }
    }

    /// The diagonal block `W_cc = H_cᵀ M⁻¹ H_c`.
    pub fn diagonal_block(&self, c: usize) -> Block<D> {
        let mut w = [[0.0; D]; D];
        let mut z = self.z.column(c).peekable();
        // Both lists hold distinct rows, H sorted; Z is sorted within each component only.
        for (i, h) in self.h.column(c) {
            let matching = match z.peek() {
                Some(&(j, entries)) if j == i => {
                    z.next();
                    Some(entries)
                }
                _ => self.z.column(c).find(|&(j, _)| j == i).map(|(_, entries)| entries),
            };
            if let Some(entries) = matching {
                for k in 0..D {
                    for l in 0..D {
                        w[k][l] += h[k] * entries[l];
                    }
                }
            }
        }
        w
    }

    /// Forms W in block-sparse rows. Cost: Σ over degrees of freedom of (contacts in H) × (contacts in Z).
    pub fn condense(&self) -> Bsr<D> {
        let nc = self.contacts();
        // Contacts whose H touches a degree of freedom, by rows of H.
        let mut by_row: Vec<Vec<(u32, [f64; D])>> = vec![Vec::new(); self.n];
        for c in 0..nc {
            for (i, h) in self.h.column(c) {
                by_row[i].push((c as u32, *h));
            }
        }
        let mut rows: Vec<BlockRow<D>> = vec![Vec::new(); nc];
        let mut slot = vec![usize::MAX; nc];
        let mut met: BlockRow<D> = Vec::new();
        for j in 0..nc {
            for (row, z) in self.z.column(j) {
                for &(i, ref h) in &by_row[row] {
                    let at = &mut slot[i as usize];
                    if *at == usize::MAX {
                        *at = met.len();
                        met.push((i, [[0.0; D]; D]));
                    }
                    let w = &mut met[*at].1;
                    for k in 0..D {
                        for l in 0..D {
                            w[k][l] += h[k] * z[l];
                        }
                    }
                }
            }
            for (i, w) in met.drain(..) {
                slot[i as usize] = usize::MAX;
                rows[i as usize].push((j as u32, w));
            }
        }
        Bsr::from_rows(nc, &rows)
    }
}
