//! The global problem by its contacts: velocity space, W never formed.
//!
//! Contact by contact, the state keeps the velocities (so that `u_c = H_cᵀ v + w_c` costs the rows that contact c touches) and
//! what impulses do to them at the same cost ([`Delassus`]). Products with W are one solve,
//! `Hᵀ M⁻¹ (H r + f) + w`, and need nothing of it. `complete` recomputes v exactly, so the rounding that the increments
//! gather never reaches a judged point.

use nonsmooth_linalg::budget::{self, TooLarge};
use nonsmooth_linalg::{
    Block, Bsr, Compensated, Csc, Delassus, Groups, Passes, Refine, Singular, norm_or_one, small,
};
use nonsmooth_problem::check::{Certificate, Impulses};
use nonsmooth_problem::{Bounds, Dynamics, FrictionGlobal, GlobalPoint, RowsGlobal};

use super::linearised::{BodyForm, ContactForm, Form, Once, System, made, there, unaffordable};
use super::{
    Access, Blockwise, Concurrent, Contacts, Costs, DETERMINED, Frictional, Linear, Linearised,
    MANY, Parted, Rows, Visits, held_and_left, lifted, of_contacts, of_each, rolling_of, rows_of,
};
use crate::SolveError;
use crate::contact::law::DiskLaw;

/// What the view keeps.
pub struct GlobalState<const D: usize> {
    dynamics: Dynamics,
    operator: Operator<D>,
    access: Access,
    /// The operator belongs to this H.
    h: Csc,
    /// The velocity without impulses; with the condensed W, what that makes of the velocity at the point last completed.
    q: Vec<f64>,
    scale: f64,
    /// v, as an operator that is visited keeps it.
    y: Vec<f64>,
    /// Where contacts are arranged for several threads: such a v without impulses, another one, and room.
    free: Vec<f64>,
    other: Vec<f64>,
    room: Vec<f64>,
    /// v in doubled precision, where it was asked for: high, low, the last correction.
    precise: [Vec<f64>; 3],
    contradiction: Option<Impulses>,
    /// Of each row, where it has bounds.
    rows: Vec<Option<RowResponse>>,
    /// Made when it is first asked for.
    system: Once<GlobalSystem<D>>,
}

/// What a unit impulse of a row does.
struct RowResponse {
    /// `M⁻¹ G_j`, its entries that are not zero.
    velocities: Vec<(usize, f64)>,
    /// `G_jᵀ M⁻¹ G_j`.
    own: f64,
}

/// The linear system of a Newton method, over whichever graph suits M.
enum GlobalSystem<const D: usize> {
    Bodies(System<BodyForm<D>, D>),
    Contacts(System<ContactForm<D>, D>),
}

/// What a family's access to W needs beside the dynamics.
enum Operator<const D: usize> {
    /// Visits contact by contact.
    Visits(Box<Delassus<D>>),
    /// Products with all of W: the diagonal blocks alone.
    Products(Vec<Block<D>>),
    /// W itself: for Newton methods where M is factorised sparsely (finite elements, mechanisms), so that Z would be dense
    /// and the graph of M far larger than that of W.
    Condensed(Bsr<D>),
}

impl<const D: usize> GlobalSystem<D> {
    fn new<L: DiskLaw<D>>(
        problem: &FrictionGlobal<D, L>,
        operator: &Operator<D>,
        dynamics: &Dynamics,
    ) -> Result<Self, TooLarge> {
        let nc = problem.contacts();
        Ok(match operator {
            Operator::Condensed(w) => Self::Contacts(System::new(ContactForm::new(w)?, nc)),
            _ => {
                let form = BodyForm::new(dynamics.inverse.matrix(), &problem.H)?;
                Self::Bodies(System::new(form, nc))
            }
        })
    }
}

impl<const D: usize> Operator<D> {
    fn diagonal_block(&self, c: usize) -> Block<D> {
        match self {
            Operator::Visits(delassus) => *delassus.diagonal_block(c),
            Operator::Products(diagonal) => diagonal[c],
            Operator::Condensed(w) => w.diagonal_block(c),
        }
    }
}

impl<const D: usize> GlobalState<D> {
    fn update_free_velocity<L: DiskLaw<D>>(&mut self, problem: &FrictionGlobal<D, L>) {
        self.contradiction = self.dynamics.free_velocity(problem, &mut self.q);
        self.scale = norm_or_one(&self.q);
        if let Operator::Visits(delassus) = &self.operator
            && delassus.passes().is_some()
        {
            let v = self.dynamics.velocities(problem);
            self.free.resize(v.len(), 0.0);
            self.other.resize(v.len(), 0.0);
            delassus.enter(&self.dynamics.inverse, v, &mut self.free);
        }
    }
}

impl<const D: usize, L: DiskLaw<D>> Contacts<D> for FrictionGlobal<D, L> {
    type Law = L;
    type State = GlobalState<D>;

    fn state(&self, access: Access) -> Result<Self::State, SolveError> {
        access.admit(self.bounds())?;
        let mut dynamics = Dynamics::new(self)?;
        let rows = row_responses(self, &mut dynamics);
        let inverse = &dynamics.inverse;
        match access {
            Access::Newton if inverse.has_sparse_factor() => {
                let bytes = Delassus::<D>::condensed_bytes(&self.H, inverse);
                budget::admit("the condensed W", bytes)?;
            }
            Access::Visits | Access::Rows | Access::Newton => {
                let bytes = Delassus::<D>::kept_bytes(&self.H, inverse);
                budget::admit("the velocities that impulses give", bytes)?;
            }
            Access::Products => {}
        }
        // Newton's methods ask for doubled precision near their end.
        let precise = if access == Access::Newton { inverse.dim() } else { 0 };
        let mut state = GlobalState {
            operator: match access {
                Access::Newton if inverse.has_sparse_factor() => {
                    Operator::Condensed(Delassus::condense(&self.H, inverse))
                }
                Access::Visits | Access::Rows | Access::Newton => {
                    // Rows with bounds speak of v itself; those who sweep in an order of their own keep it.
                    Operator::Visits(Box::new(match rows.is_empty() {
                        true if access == Access::Newton => {
                            Delassus::arranged(&self.H, inverse, MANY)
                        }
                        true => Delassus::new(&self.H, inverse),
                        false => Delassus::direct(&self.H, inverse),
                    }))
                }
                Access::Products => Operator::Products(Delassus::diagonal(&self.H, inverse)),
            },
            access,
            h: self.H.clone(),
            q: vec![0.0; self.w.len()],
            scale: 1.0,
            y: vec![0.0; self.dofs()],
            free: vec![],
            other: vec![],
            room: vec![],
            precise: [0; 3].map(|_| vec![0.0; precise]),
            contradiction: None,
            rows,
            system: None,
            dynamics,
        };
        state.update_free_velocity(self);
        Ok(state)
    }

    fn refill(&self, state: &mut Self::State) -> Result<(), SolveError> {
        if state.dynamics.serves(self) && state.h == self.H {
            state.update_free_velocity(self);
        } else {
            let earlier = state.system.take();
            *state = self.state(state.access)?;
            // A contact set that changed a little can keep the analysis of its Newton matrix.
            if let (Some(Ok(GlobalSystem::Bodies(earlier))), Operator::Visits(_)) =
                (earlier, &state.operator)
            {
                let matrix = state.dynamics.inverse.matrix();
                let form = BodyForm::after(Some(earlier.into_form()), matrix, &self.H);
                let system = |form| GlobalSystem::Bodies(System::new(form, self.contacts()));
                state.system = Some(form.map(system));
            }
        }
        Ok(())
    }

    fn contradiction<'a>(&self, state: &'a Self::State) -> Option<&'a Impulses> {
        state.contradiction.as_ref()
    }

    fn contacts(&self) -> usize {
        self.mu.len()
    }

    #[inline(always)]
    fn law(&self, c: usize) -> L {
        L::of(&self.mu, &self.mu_r, c)
    }

    fn diagonal_block(&self, state: &Self::State, c: usize) -> [[f64; D]; D] {
        state.operator.diagonal_block(c)
    }

    fn velocity_scale(&self, state: &Self::State) -> f64 {
        state.scale
    }

    fn impulses(point: &mut GlobalPoint) -> &mut [f64] {
        &mut point.r
    }

    fn enter(&self, state: &mut Self::State, point: &GlobalPoint) {
        state.dynamics.hold(&point.lambda);
        let GlobalState { dynamics, operator, y, free, room, .. } = state;
        if let Operator::Visits(delassus) = operator
            && !delassus.receive(Some(free), &point.r, y, room)
        {
            dynamics.solve(self, &point.r, Refine::Once);
            delassus.enter(&dynamics.inverse, dynamics.velocities(self), y);
        }
    }

    fn complete(&self, state: &mut Self::State, point: &mut GlobalPoint) {
        state.dynamics.complete(self, point);
        let GlobalState { dynamics, operator, y, q, .. } = state;
        match operator {
            Operator::Visits(delassus) => delassus.enter(&dynamics.inverse, &point.v, y),
            // From here on W r + q is exact at r, and as wrong as W is in what r moves by: one step of refinement a look.
            Operator::Condensed(w) => {
                self.velocity_into(&point.v, q);
                for (c, q) in q.chunks_mut(D).enumerate() {
                    let wr = w.row_product(c, &point.r);
                    q.iter_mut().zip(wr).for_each(|(q, wr)| *q -= wr);
                }
            }
            Operator::Products(_) => {}
        }
    }

    fn bodies(&self) -> Option<&FrictionGlobal<D, L>> {
        self.rows.is_none().then_some(self)
    }
}

/// Of a problem with rows that have bounds, what their impulses do; of another, nothing.
fn row_responses<const D: usize, L: DiskLaw<D>>(
    problem: &FrictionGlobal<D, L>,
    dynamics: &mut Dynamics,
) -> Vec<Option<RowResponse>> {
    let Some(b) = problem.rows.as_ref().filter(|b| !b.bounds.are_free()) else { return vec![] };
    let mut of = |j: usize| {
        let v = dynamics.respond_to_row(problem, j);
        let own = b.G.column_dot(j, v);
        // About what it is without the bilateral rows.
        let (rows, values) = b.G.column(j);
        let alone: f64 = rows.iter().zip(values).map(|(&i, g)| g * g / problem.M.get(i, i)).sum();
        if own <= DETERMINED * alone {
            return RowResponse { velocities: vec![], own: 0.0 };
        }
        let moving = v.iter().enumerate().filter(|(_, v)| **v != 0.0);
        RowResponse { own, velocities: moving.map(|(i, &v)| (i, v)).collect() }
    };
    (0..b.b.len()).map(|j| (!b.bounds.is_free(j)).then(|| of(j))).collect()
}

impl<const D: usize> Frictional<D> for FrictionGlobal<D> {
    fn mu(&self) -> &[f64] {
        &self.mu
    }
}

impl<const D: usize, L: DiskLaw<D>> Rows<D> for FrictionGlobal<D, L> {
    fn bounds(&self) -> Option<&Bounds> {
        self.rows.as_ref().map(|b| &b.bounds)
    }

    fn all_impulses(point: &mut GlobalPoint) -> (&mut [f64], &mut [f64]) {
        (&mut point.r, &mut point.lambda)
    }

    fn row_response(&self, state: &Self::State, j: usize) -> f64 {
        state.rows[j].as_ref().map_or(0.0, |row| row.own)
    }

    fn row_velocity(&self, state: &Self::State, _: &[f64], _: &[f64], j: usize) -> f64 {
        self.rows.as_ref().map_or(0.0, |b| b.G.column_dot(j, &state.y) + b.b[j])
    }

    fn row_moved(&self, state: &mut Self::State, j: usize, by: f64) {
        let GlobalState { rows, y, .. } = state;
        rows[j].iter().flat_map(|row| &row.velocities).for_each(|&(i, x)| y[i] += by * x);
    }
}

impl<const D: usize, L: DiskLaw<D>> Parted<D> for FrictionGlobal<D, L> {
    fn holding(&self, held: &[Option<f64>]) -> Self {
        let Some(b) = &self.rows else { return self.clone() };
        let (loads, left) = held_and_left(held);
        let mut f = self.f.clone();
        b.G.mul_add(1.0, &loads, &mut f);
        let given = left.iter().map(|&j| b.b[j]).collect();
        let rows = RowsGlobal::bilateral(b.G.columns(&left), given);
        Self { f, rows: (!left.is_empty()).then_some(rows), ..self.clone() }
    }

    fn join(&self, groups: &mut Groups) {
        let nc = self.contacts();
        groups.restart(nc + self.dofs());
        for (i, j, x) in self.H.triplets() {
            if x != 0.0 {
                groups.join(j / D, nc + i);
            }
        }
        for (i, j, x) in self.M.triplets() {
            if x != 0.0 {
                groups.join(nc + i, nc + j);
            }
        }
    }

    fn island(&self, members: &[usize]) -> Self {
        let (none, mu_r) = (|| Csc::zeros(0, 0), L::Rolling::default());
        let (f, w, mu) = (vec![], vec![], vec![]);
        let mut island = Self { M: none(), H: none(), f, w, mu, mu_r, rows: None };
        self.island_again(members, &mut island);
        island
    }

    fn island_again(&self, members: &[usize], island: &mut Self) {
        let nc = self.contacts();
        let (contacts, dofs) = members.split_at(members.partition_point(|&x| x < nc));
        // An entry that is stored and zero may lie in another group.
        let place = |dof: usize| dofs.binary_search(&(nc + dof)).ok();
        let own = || dofs.iter().map(|&dof| dof - nc);
        part(&self.M, own(), (dofs.len(), place), &mut island.M);
        part(&self.H, rows_of::<D>(0, contacts), (dofs.len(), place), &mut island.H);
        of_each(&self.f, own(), &mut island.f);
        of_contacts::<D>(&self.w, contacts, &mut island.w);
        of_each(&self.mu, contacts.iter().copied(), &mut island.mu);
        island.mu_r = rolling_of(&self.mu_r, contacts);
    }

    fn lifted(&self, members: &[usize], certificate: Certificate) -> Certificate {
        let (nc, n) = (self.contacts(), self.dofs());
        let (contacts, dofs) = members.split_at(members.partition_point(|&x| x < nc));
        let laws: Vec<L> = (0..nc).map(|c| Contacts::law(self, c)).collect();
        let own = dofs.iter().map(|&dof| dof - nc);
        let given: Vec<usize> = own.chain(rows_of::<D>(n, contacts)).collect();
        lifted(&laws, contacts, (&given, n + self.w.len()), certificate)
    }
}

/// The entries of `a` in some columns and in the rows that have a `place` among so many, if they are not what `part` has.
fn part(
    a: &Csc,
    columns: impl Iterator<Item = usize> + Clone,
    (rows, place): (usize, impl Fn(usize) -> Option<usize> + Copy),
    part: &mut Csc,
) {
    let entries = || {
        columns.clone().enumerate().flat_map(move |(k, j)| {
            let (rows, values) = a.column(j);
            let entry = move |(&i, &x): (&usize, &f64)| Some((place(i)?, k, x));
            rows.iter().zip(values).filter_map(entry)
        })
    };
    let count = columns.clone().count();
    if (part.nrows(), part.ncols()) != (rows, count) || !part.triplets().eq(entries()) {
        *part = Csc::from_triplets(rows, count, entries()).expect("places in range");
    }
}

impl<const D: usize, L: DiskLaw<D>> Blockwise<D> for FrictionGlobal<D, L> {
    #[inline(always)]
    fn velocity(&self, state: &Self::State, r: &[f64], c: usize) -> [f64; D] {
        let (mut u, given) = match &state.operator {
            Operator::Visits(delassus) => (delassus.local_velocity(c, &state.y), &self.w),
            Operator::Condensed(w) => (w.row_product(c, r), &state.q),
            Operator::Products(_) => unreachable!("a state for products is not visited"),
        };
        let given: [f64; D] = small::block(given, c);
        for k in 0..D {
            u[k] += given[k];
        }
        u
    }

    #[inline(always)]
    fn moved(&self, state: &mut Self::State, c: usize, dr: &[f64; D]) {
        if let Operator::Visits(delassus) = &state.operator {
            delassus.apply_impulse(c, dr, &mut state.y);
        }
    }

    #[inline(always)]
    fn foresee(&self, state: &Self::State, c: usize) {
        if let Operator::Visits(delassus) = &state.operator {
            delassus.foresee(c, &state.y);
        }
    }

    fn passes<'a>(&self, state: &'a Self::State) -> Option<&'a Passes> {
        match &state.operator {
            Operator::Visits(delassus) => delassus.passes(),
            _ => None,
        }
    }

    fn moving<'a>(&'a self, state: &'a mut Self::State) -> Option<Visits<'a, D>> {
        let GlobalState { operator: Operator::Visits(delassus), y, .. } = state else {
            return None;
        };
        let (passes, moving) = delassus.moving(y)?;
        Some(Visits { passes, moving, given: &self.w })
    }
}

impl<const D: usize, L: DiskLaw<D>> Concurrent<D> for FrictionGlobal<D, L> {
    /// Places are the components of M (with bilateral constraints: of the bordered matrix): `M⁻¹ H_c` reaches all of a component.
    fn places(&self, state: &Self::State, c: usize, reads: &mut Vec<u32>, writes: &mut Vec<u32>) {
        let first = reads.len();
        for k in D * c..D * c + D {
            for &i in self.H.column(k).0 {
                let component = state.dynamics.inverse.component_of(i) as u32;
                if !reads[first..].contains(&component) {
                    reads.push(component);
                }
            }
        }
        writes.extend_from_slice(&reads[first..]);
    }
}

/// What a refined solve with a sparse factor of M costs ([`Costs`]): some 25 ns an entry of M for finite elements, 15 for mechanisms.
fn solved(mass: &Csc) -> f64 {
    20.0 * mass.nnz() as f64
}

impl<const D: usize, L: DiskLaw<D>> Linear<D> for FrictionGlobal<D, L> {
    fn velocities(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        let GlobalState { dynamics, operator, q, free, other, room, .. } = state;
        match operator {
            Operator::Condensed(w) => return w.mul_plus(r, q, u),
            Operator::Visits(delassus) if delassus.receive(Some(free), r, other, room) => {
                delassus.local_velocities(other, u);
                return u.iter_mut().zip(&self.w).for_each(|(u, w)| *u += w);
            }
            _ => {}
        }
        let (v, _) = dynamics.solve(self, r, Refine::Once);
        self.velocity_into(v, u);
    }

    fn velocities_precisely(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        let [high, low, last] = &mut state.precise;
        let n = state.dynamics.inverse.dim();
        for part in [&mut *high, &mut *low, &mut *last] {
            part.resize(n, 0.0);
        }
        state.dynamics.solve_doubled(self, r, [high, low, last]);
        for (i, u) in u.iter_mut().enumerate() {
            let mut sum = Compensated::from(self.w[i]);
            let (rows, values) = self.H.column(i);
            for (&j, &h) in rows.iter().zip(values) {
                sum.add_product(h, high[j]);
                sum.add_product(h, low[j]);
            }
            *u = sum.value();
        }
    }
}

impl<const D: usize, L: DiskLaw<D>> Linearised<D> for FrictionGlobal<D, L> {
    fn linearise(
        &self,
        state: &mut Self::State,
        p: &[Block<D>],
        q: &[Block<D>],
    ) -> Result<(), Singular> {
        let GlobalState { operator, system, dynamics, .. } = state;
        let unit = (0..self.contacts()).map(|c| small::mean_diagonal(&operator.diagonal_block(c)));
        let system = made(system, || GlobalSystem::new(self, operator, dynamics));
        match system.ok_or(Singular)? {
            GlobalSystem::Bodies(system) => system.factorise(unit, p, q),
            GlobalSystem::Contacts(system) => system.factorise(unit, p, q),
        }
    }

    fn orientation(&self, state: &mut Self::State) -> f64 {
        match there(&mut state.system) {
            Some(GlobalSystem::Bodies(system)) => system.sign(),
            Some(GlobalSystem::Contacts(system)) => system.sign(),
            None => f64::NAN,
        }
    }

    fn solve_linearised(
        &self,
        state: &mut Self::State,
        b: &[f64],
        x: &mut [f64],
        wx: &mut [f64],
    ) -> f64 {
        let GlobalState { operator, system, dynamics, other, room, .. } = state;
        let apply = |x: &[f64], wx: &mut [f64]| match &*operator {
            Operator::Visits(delassus) if delassus.receive(None, x, other, room) => {
                delassus.local_velocities(other, wx);
            }
            Operator::Condensed(w) => {
                for (c, wx) in wx.chunks_mut(D).enumerate() {
                    wx.copy_from_slice(&w.row_product(c, x));
                }
            }
            _ => {
                let v = dynamics.respond(self, x, Refine::Once);
                wx.fill(0.0);
                self.H.mul_transpose_add(1.0, v, wx);
            }
        };
        match there(system) {
            Some(GlobalSystem::Bodies(system)) => system.solve(b, x, wx, apply),
            Some(GlobalSystem::Contacts(system)) => system.solve(b, x, wx, apply),
            None => f64::NAN,
        }
    }

    fn costs(&self, state: &mut Self::State) -> Costs {
        let GlobalState { operator, system, dynamics, .. } = state;
        let contacts = self.contacts() as f64;
        let visits = match &*operator {
            Operator::Condensed(w) => 2.0 * w.nblocks() as f64,
            _ => 1.5 * self.H.nnz() as f64,
        };
        let sweep = 30.0 * contacts + visits;
        let costs = match made(system, || GlobalSystem::new(self, operator, dynamics)) {
            Some(GlobalSystem::Bodies(system)) => system.form().costs(sweep),
            Some(GlobalSystem::Contacts(system)) => system.form().costs(sweep),
            None => unaffordable(sweep),
        };
        match operator {
            Operator::Condensed(_) => Costs { look: costs.look + solved(&self.M), ..costs },
            _ => costs,
        }
    }
}
