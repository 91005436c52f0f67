//! The product form of the inverse: what has changed in a basis since it was factorised.
//!
//! ```text
//! B⁻¹ = E_c … E_1 B₀⁻¹,   E = I with column r replaced by (−y_i / y_r, 1 / y_r),   y = B⁻¹ a
//! ```
//!
//! Cost: the entries of all columns that are not zero, for each solve.

/// The elementary matrices `E_c … E_1`: each says that a column `y` of the tableau has taken slot r.
#[derive(Debug, Clone, Default)]
pub struct Updates {
    /// r, 1 / y_r and where the entries end.
    heads: Vec<(usize, f64, usize)>,
    slots: Vec<u32>,
    values: Vec<f64>,
}

impl Updates {
    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.heads.clear();
        self.slots.clear();
        self.values.clear();
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Column `y` takes slot r.
    pub fn push(&mut self, r: usize, y: &[f64]) {
        for (i, &y) in y.iter().enumerate() {
            if y != 0.0 && i != r {
                self.slots.push(i as u32);
                self.values.push(y);
            }
        }
        self.heads.push((r, 1.0 / y[r], self.values.len()));
    }

    fn entries(&self, k: usize) -> (&[u32], &[f64]) {
        let from = if k == 0 { 0 } else { self.heads[k - 1].2 };
        let range = from..self.heads[k].2;
        (&self.slots[range.clone()], &self.values[range])
    }

    /// `x ← E_c … E_1 x`.
    pub fn forward(&self, x: &mut [f64]) {
        for (k, &(r, inverse, _)) in self.heads.iter().enumerate() {
            if x[r] == 0.0 {
                continue;
            }
            let t = x[r] * inverse;
            x[r] = t;
            let (slots, values) = self.entries(k);
            for (&i, &y) in slots.iter().zip(values) {
                x[i as usize] -= y * t;
            }
        }
    }

    /// `s ← E_1ᵀ … E_cᵀ s`.
    pub fn backward(&self, s: &mut [f64]) {
        for (k, &(r, inverse, _)) in self.heads.iter().enumerate().rev() {
            let (slots, values) = self.entries(k);
            let sum: f64 = slots.iter().zip(values).map(|(&i, &y)| y * s[i as usize]).sum();
            s[r] = (s[r] - sum) * inverse;
        }
    }
}
