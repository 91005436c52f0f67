//! Rest: impulses within the cones that leave no contact moving, as resting structures have them.
//!
//! Problem: r with `W r + q = 0` and `r_c ∈ K_c` for each contact. Where there is one it solves the law, whose velocities are all zero; W may have any
//! rank. The static problem of limit analysis.
//!
//! Method: Douglas–Rachford splitting between the two sets in the metric `w_c = tr(W_cc)/D`, the affine set relaxed by a small ρ:
//!
//! ```text
//! (W + ρ w) r = ρ w (z − y) − q − s,    s = shift(u) e_N with the dual velocity u = −ρ w y,
//! t = r + y,    z = P_K(t),    y = t − z.
//! ```
//!
//! It is ADMM with a penalty that vanishes; its fixed points obey the exact law whatever ρ, so that contacts that do move cost iterations, not
//! correctness. Where the impulses of least norm lie within the cones the first iteration ends it, however tall the structure; near a collapse it
//! needs many, and where something slides it stands still: the caller watches the rate.
//!
//! References: EcksteinBertsekas1992 (Douglas–Rachford and ADMM); Carpentier2024 (ADMM with the exact law); Heyman1966 for the static theorem.
//! Cost: one factorisation of `W + ρ w`, then of each iteration one solve with it, refined with products with W, and nc projections.

use nonsmooth_linalg::{Block, Singular, small};

use crate::contact::form::{Disked, Linearised};
use crate::contact::law::ContactLaw;
use crate::contact::law::cone::ConvexSet;

/// ρ. Walls and towers of up to 540 layers were solved in the same few iterations with 1e-4 to 1e-7.
const RHO: f64 = 1e-6;

/// The iterate.
#[derive(Debug, Default)]
pub(super) struct Rest<const D: usize> {
    /// `ρ w_c`.
    penalty: Vec<f64>,
    identity: Vec<Block<D>>,
    blocks: Vec<Block<D>>,
    q: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    y: Vec<f64>,
    right: Vec<f64>,
    wr: Vec<f64>,
    scale: f64,
}

impl<const D: usize> Rest<D> {
    /// Factorises, and begins at no impulses. Errors: a matrix that cannot be factorised.
    pub(super) fn begin<P: Linearised<D> + Disked<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<(), Singular> {
        let nc = problem.contacts();
        self.scale = problem.velocity_scale(state);
        self.penalty.clear();
        self.penalty.extend((0..nc).map(|c| {
            let w = small::mean_diagonal(&problem.diagonal_block(state, c));
            RHO * if w > 0.0 { w } else { 1.0 }
        }));
        let diagonal = |x: f64| {
            let mut block = [[0.0; D]; D];
            (0..D).for_each(|k| block[k][k] = x);
            block
        };
        self.identity.clear();
        self.identity.resize(nc, diagonal(1.0));
        self.blocks.clear();
        self.blocks.extend(self.penalty.iter().map(|&x| diagonal(x)));
        for x in [
            &mut self.q,
            &mut self.r,
            &mut self.z,
            &mut self.y,
            &mut self.right,
            &mut self.wr,
        ] {
            x.clear();
            x.resize(D * nc, 0.0);
        }
        problem.velocities(state, &self.z, &mut self.q);
        problem.linearise(state, &self.identity, &self.blocks)
    }

    /// One iteration; returns its residual, relative to ‖q‖: that of the splitting, which bounds the problem's own at [`impulses`](Self::impulses)
    /// up to the spread of W.
    pub(super) fn iterate<P: Linearised<D> + Disked<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> f64 {
        let Self { penalty, q, r, z, y, right, wr, scale, .. } = self;
        for (c, &penalty) in penalty.iter().enumerate() {
            let dual: [f64; D] = small::block::<D>(y, c).map(|y| -penalty * y);
            for i in D * c..D * c + D {
                right[i] = penalty * (z[i] - y[i]) - q[i];
            }
            right[D * c] -= problem.law(c).shift(&dual);
        }
        problem.solve_linearised(state, right, r, wr);
        let (mut primal, mut dual) = (0.0, 0.0);
        for (c, &penalty) in penalty.iter().enumerate() {
            let i = D * c;
            let t: [f64; D] = std::array::from_fn(|k| r[i + k] + y[i + k]);
            let new = problem.law(c).project(&t);
            for k in 0..D {
                primal += (penalty / RHO * (r[i + k] - new[k])).powi(2);
                dual += (penalty * (new[k] - z[i + k])).powi(2);
                z[i + k] = new[k];
                y[i + k] = t[k] - new[k];
            }
        }
        primal.max(dual).sqrt() / *scale
    }

    /// The impulses, within the cones.
    pub(super) fn impulses(&self) -> &[f64] {
        &self.z
    }
}
