//! Bodies that overlap are found, and moved apart by the problem of a step.

use super::{Stride, Tools, are_finite};
use crate::crew::Inner;
use crate::report::{StepReport, StepStatus};
use crate::state::State;
use crate::{Activation, Geometry, Gyroscopic, MoreauJean, SimulateError, World};

impl Tools {
    /// Pairs of bodies that overlap by more than `share` of the smaller one, with the deepest penetration of each.
    /// What contacts give way by is no overlap.
    pub fn overlaps(
        &mut self,
        world: &World,
        state: &mut State,
        share: f64,
    ) -> Vec<(u32, u32, f64)> {
        self.margins.clear();
        self.margins.resize(world.bodies.len() + self.solids.nodes.list.len(), 0.0);
        let Self { detector, margins, crew, near, solids, .. } = self;
        detector.detect(world, state, margins, crew, (near, &mut solids.feet));
        let mut found: Vec<(u32, u32, f64)> = vec![];
        let hard = self.near.iter().filter(|n| n.compliance.is_none());
        let bodies = world.bodies.len();
        let owner = |k: u32| match (k as usize).checked_sub(bodies) {
            None => k,
            Some(place) => bodies as u32 + self.solids.owner(place),
        };
        for n in hard.filter(|n| n.place.gap < -share * n.size) {
            let (a, b) = (owner(n.a), owner(n.b));
            match found.last_mut() {
                Some(last) if (last.0, last.1) == (a, b) => last.2 = last.2.max(-n.place.gap),
                _ => found.push((a, b, -n.place.gap)),
            }
        }
        found
    }

    /// Moves bodies of a world [at rest](World::at_rest) apart that overlap: the smallest displacement in the norm of the masses after which no gap is
    /// negative, to first order, is the velocity of a step of length 1 whose frictionless contacts, and limits of joints, have the gaps to close. Bodies are
    /// looked for within `depth`, m, of each other. What pushes is in the reports of contacts. Whether the problem was solved.
    pub fn part(
        &mut self,
        world: &World,
        state: &mut State,
        depth: f64,
        inner: &Inner,
    ) -> Result<bool, SimulateError> {
        const H: f64 = 1.0;
        let scheme = MoreauJean {
            theta: 1.0,
            gyroscopic: Gyroscopic::Off,
            geometry: Geometry::Frozen,
            activation: Activation::Gap,
            ..MoreauJean::default()
        };
        let stride = Stride { world, scheme: &scheme, h: H };
        let zero = vec![[0.0; 3]; world.bodies.len()];
        let mut rest = State { velocity: zero.clone(), spin: zero, ..state.clone() };
        self.begin(stride, &rest, &mut []);
        self.margins.iter_mut().for_each(|m| *m += depth);
        self.detect(stride, &mut rest);
        self.near.retain(|near| near.compliance.is_none());
        self.near.iter_mut().for_each(|near| near.image.velocity = [0.0; 3]);
        self.meet(stride, &rest);
        self.joints.close_limits(world, H);
        for (near, &row) in self.near.iter().zip(&self.row_of) {
            let row = &mut self.rows[row as usize];
            (row.mu, row.shift, row.r) = (0.0, [near.place.gap / H, 0.0, 0.0], [0.0; 3]);
            (row.mu_r, row.moment) = (0.0, [0.0; 2]);
        }
        let Some(solved) = self.solve(stride, inner)? else { return Ok(false) };
        let solved = solved.status == StepStatus::Solved;
        self.commit(stride, &mut rest, &mut StepReport::begun(state.t, H));
        if are_finite(rest.position.iter().flatten().chain(rest.rotation.iter().flatten()).copied())
        {
            (state.position, state.rotation) = (rest.position, rest.rotation);
        }
        Ok(solved)
    }
}
