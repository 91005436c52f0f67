//! One contact as the sweeps see it, and the answer to a visit.

use nonsmooth_linalg::small;

use crate::contact::form::Contacts;
use crate::contact::law::ContactLaw;
use crate::contact::law::local::{LocalSolver, frictionless};
use crate::contact::parts::NEGLIGIBLE;

/// What the sweeps keep of a contact.
pub(super) struct Contact<Memo, Law, const D: usize> {
    w: [[f64; D]; D],
    law: Law,
    /// `tr(W_cc)/D` over ‖q‖: turns an impulse into a relative velocity.
    pub(super) unit: f64,
    /// Visits in a row with hardly a move; beyond `freeze_after` it counts sweeps slept.
    pub(super) settled: u32,
    memo: Memo,
}

/// What the sweeps keep of a contact of the problem P for the local solver L.
pub(super) type ContactOf<P, L, const D: usize> =
    Contact<<L as LocalSolver<D, <P as Contacts<D>>::Law>>::Memo, <P as Contacts<D>>::Law, D>;

/// What a visit comes to.
pub(super) struct Answer<const D: usize> {
    pub(super) new: [f64; D],
    pub(super) dr: [f64; D],
    /// `(w_c‖Δr_c‖/‖q‖)²`.
    pub(super) moved: f64,
    /// The move is to be made: it is not negligible, or of an empty block, which feels nothing of it.
    pub(super) made: bool,
}

impl<Memo, Law: ContactLaw<D>, const D: usize> Contact<Memo, Law, D> {
    pub(super) fn new<L>(local: &L, w: [[f64; D]; D], law: Law, scale: f64) -> Self
    where
        L: LocalSolver<D, Law, Memo = Memo>,
    {
        let unit = small::mean_diagonal(&w).abs() / scale;
        Self { memo: local.prepare(&w, law), w, law, unit, settled: 0 }
    }

    /// The answer to the velocity `u` with the present impulse `old`, relaxed by ω.
    #[inline(always)]
    pub(super) fn answer<L>(
        &mut self,
        local: &L,
        u: &[f64; D],
        old: &[f64; D],
        omega: f64,
    ) -> Answer<D>
    where
        L: LocalSolver<D, Law, Memo = Memo>,
    {
        let own = small::mul(&self.w, old);
        let mut q = *u;
        for k in 0..D {
            q[k] -= own[k];
        }
        let mut new = if self.law.is_frictionless() {
            frictionless(&self.w, &q, old)
        } else {
            local.solve(&mut self.memo, &self.w, &q, self.law, old)
        };
        if omega != 1.0 {
            for k in 0..D {
                new[k] = (1.0 - omega) * old[k] + omega * new[k];
            }
            if omega > 1.0 {
                new = self.law.project(&new);
            }
        }
        let mut dr = new;
        for k in 0..D {
            dr[k] -= old[k];
        }
        let moved = dr.iter().map(|x| (self.unit * x).powi(2)).sum();
        let unfelt = self.unit == 0.0 && dr != [0.0; D];
        Answer { new, dr, moved, made: moved > NEGLIGIBLE || unfelt }
    }
}
