//! The problems of the islands in the frames of a pass: W, q, mu of their contacts, `V, R, s` and bounds of their scalar rows, and the same with rolling friction.
//!
//! Islands are stated at the same time, and the contacts of a large one too. W of a symmetric problem is one half and its mirror image, to the last bit. It is most of the work, and
//! whether the impulses of the step before are good enough can be told from its factors: so of a large island at rest it is never formed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use nonsmooth_linalg::{Block, Csc, Inverse, budget};
use nonsmooth_problem::factors::Factors;
use nonsmooth_problem::{
    Bounds, Friction, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, RowsLocal,
};
use nonsmooth_scenes::vec3::{Vec3, apply, dot, scale};
use nonsmooth_solve::registry::Registered;
use nonsmooth_solve::{Outcome, SolveError, Status};

use super::contact::Row;
use super::couple::{Columns, FlatSide, Shared, Side, Sided};
use super::elastic::Solids;
use super::touching::Touching;
use super::{NONE, Stride, Tools, are_finite};
use crate::crew::{Asked, Crew, Inner, SMALL, Sessions, Slot};
use crate::cut::Cut;
use crate::islands::Islands;
use crate::joints::Joints;
use crate::moving::Moving;
use crate::rolling::{self, Roller, Turning};
use crate::{Dimension, SimulateError};

/// The most iterations on a problem that is linear.
const LINEAR: usize = 10;

/// The island that is being looked at: its contacts and scalar rows, by their places among those of the step, its free bodies and its elastic solids.
pub(super) struct Island {
    pub contacts: Vec<u32>,
    pub scalars: Vec<u32>,
    pub members: Vec<u32>,
    pub solids: Vec<u32>,
    bodies: u32,
    /// For each body and solid the last island that it was gathered for, counted through all steps.
    gathered: Vec<u64>,
    gatherings: u64,
}

impl Island {
    pub fn of(bodies: usize, solids: usize) -> Self {
        Self {
            contacts: vec![],
            scalars: vec![],
            members: vec![],
            solids: vec![],
            bodies: bodies as u32,
            gathered: vec![0; bodies + solids],
            gatherings: 0,
        }
    }

    /// Of these contacts and rows, which are numbered on after all contacts.
    fn gather(&mut self, items: impl Iterator<Item = u32>, rows: &[Row], joints: &Joints) {
        let Self { contacts, scalars, members, solids, bodies, gathered, gatherings } = self;
        *gatherings += 1;
        contacts.clear();
        scalars.clear();
        members.clear();
        solids.clear();
        let mut meet = |owner: u32| {
            let last = std::mem::replace(&mut gathered[owner as usize], *gatherings);
            if last != *gatherings {
                match owner.checked_sub(*bodies) {
                    None => members.push(owner),
                    Some(solid) => solids.push(solid),
                }
            }
        };
        for item in items {
            match item.checked_sub(rows.len() as u32) {
                None => {
                    contacts.push(item);
                    rows[item as usize].free_arms().for_each(|a| meet(a.owner));
                }
                Some(k) => {
                    scalars.push(k);
                    joints.levers(k as usize).iter().for_each(|l| meet(l.body));
                }
            }
        }
    }
}

/// The problems of the islands of a step, whose contacts have D rows, and what states and solves them.
pub(super) struct Problems<const D: usize, S> {
    /// Of each contact the sides, by place.
    sides: Vec<[S; 2]>,
    slots: Vec<Slot<D>>,
    /// Those that solve small islands, behind a lock that nobody waits for, so that threads may look at the rest.
    sessions: Mutex<Vec<Sessions<D>>>,
}

impl<const D: usize, S> Default for Problems<D, S> {
    fn default() -> Self {
        Self { sides: vec![], slots: vec![], sessions: Mutex::default() }
    }
}

/// Those of a world in space, or in the plane.
pub(super) enum Stated {
    Space(Problems<3, Side>),
    Plane(Problems<2, FlatSide>),
}

/// Of either.
macro_rules! either {
    ($stated:expr, $problems:ident => $done:expr) => {
        match $stated {
            Stated::Space($problems) => $done,
            Stated::Plane($problems) => $done,
        }
    };
}

impl Stated {
    pub fn new(dimension: Dimension) -> Self {
        match dimension {
            Dimension::Three => Self::Space(Problems::default()),
            Dimension::Two => Self::Plane(Problems::default()),
        }
    }

    /// Makes so many slots ready.
    pub fn provide(&mut self, slots: usize) -> Result<(), SimulateError> {
        either!(self, problems => problems.provide(slots))
    }

    /// What is asked of the solver of slot k, beyond that its numbers are to be finite.
    pub fn ask(&mut self, k: usize, may_rest: bool) {
        either!(self, problems => problems.ask(k, may_rest));
    }

    /// Solves the `open` ones of the first slots.
    pub fn solve(
        &mut self,
        crew: &Crew,
        (count, open): (usize, &[u32]),
        inner: &Inner,
    ) -> Result<(), SimulateError> {
        either!(self, p => {
            let sessions = p.sessions.get_mut().unwrap_or_else(PoisonError::into_inner);
            crew.solve((&mut p.slots[..count], sessions), open, inner)
        })
    }

    /// What came of slot k; nothing where its problem is not finite.
    pub fn outcome(&mut self, k: usize) -> Option<Result<Outcome, SolveError>> {
        either!(self, problems => problems.slots[k].outcome.take())
    }

    /// The impulses of contact c of slot k, and the moments of rolling friction.
    pub fn impulse(&self, k: usize, c: usize, row: &mut Row) {
        either!(self, problems => problems.impulse(k, c, row));
    }

    /// Those of its scalar rows.
    pub fn scalar_impulses(&self, k: usize) -> &[f64] {
        either!(self, problems => &problems.slots[k].point.lambda)
    }

    /// The problem of slot k.
    pub fn problem(&self, k: usize) -> Friction {
        match self {
            Self::Plane(problems) => Friction::Local2(problems.slots[k].problem.clone()),
            Self::Space(problems) => match &problems.slots[k] {
                Slot { rolling: Some(problem), .. } => Friction::RollingLocal(problem.clone()),
                slot => Friction::Local3(slot.problem.clone()),
            },
        }
    }

    /// The relative velocity of a contact after the step.
    pub fn after(&self, place: usize, row: &Row, bodies: &[Moving]) -> [f64; 3] {
        either!(self, problems => problems.after(place, row, bodies))
    }
}

impl Tools {
    pub(super) fn gather(&mut self, k: usize) {
        let Self { islands, island, rows, joints, .. } = self;
        let items = &islands.order[islands.range(k)];
        island.gather(items.iter().copied(), rows, joints);
    }

    /// States the problems of the open islands in their slots; for a solver, those whose impulses to begin with the judge accepts get their outcome and no W, and for `auto` those that are solved
    /// sooner with their bodies are stated so. Returns the seconds that judging took.
    pub(super) fn state(
        &mut self,
        Stride { scheme, h, world }: Stride,
        inner: Option<&Inner>,
    ) -> f64 {
        let Self { crew, islands, touching, open, solids, joints, rows, bodies, stated, .. } = self;
        let (due, count) = (&open.due[..], world.bodies.len());
        let is_due = |k: u32| k != NONE && due[k as usize];
        let all = (&islands.of_body[..count], &mut bodies[..count]);
        crew.spread(all, rows.len(), |(islands, bodies)| {
            let moved = islands.iter().zip(bodies).filter(|b| is_due(*b.0));
            moved.for_each(|(_, body)| body.pass(scheme, h));
        });
        if !joints.rows.is_empty() {
            for &k in &open.list {
                let scalars = scalars(islands, rows.len(), k as usize);
                joints.columns(scalars, rows.len() as u32, bodies);
            }
        }
        if !solids.is_empty() {
            for (row, _) in rows.iter().zip(&islands.of_item).filter(|row| is_due(*row.1)) {
                // Some solves with a large factor each.
                if budget::over() {
                    return 0.0;
                }
                solids.reach(row);
            }
        }
        let parts = Parts { crew, islands, touching, due, rows, bodies, joints, solids };
        match stated {
            Stated::Space(p) => {
                p.state_all(&parts, inner, |k, slot, sides| parts.state_rolling(k, slot, sides))
            }
            Stated::Plane(p) => p.state_all(&parts, inner, |_, _, _| true),
        }
    }
}

/// The scalar rows of island k, numbered on after all `contacts`.
pub(super) fn scalars(islands: &Islands, contacts: usize, k: usize) -> &[u32] {
    let items = &islands.order[islands.range(k)];
    &items[items.partition_point(|&item| (item as usize) < contacts)..]
}

/// What problems are made of.
pub(super) struct Parts<'a> {
    crew: &'a Crew,
    islands: &'a Islands,
    pub touching: &'a Touching,
    due: &'a [bool],
    pub rows: &'a [Row],
    pub bodies: &'a [Moving],
    joints: &'a Joints,
    solids: &'a Solids,
}

/// Consecutive slots, the first of which has this number, with the sides of their contacts.
struct Slots<'a, const D: usize, S> {
    first: usize,
    slots: &'a mut [Slot<D>],
    sides: &'a mut [[S; 2]],
    touching: &'a Touching,
}

impl<const D: usize, S: Send> Cut for Slots<'_, D, S> {
    fn count(&self) -> usize {
        self.slots.len()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        let Self { first, slots, sides, touching } = self;
        let middle = first + at;
        let (slots, sides) =
            (slots.cut(at), sides.cut(touching.firsts[middle] - touching.firsts[first]));
        (
            Self { first, slots: slots.0, sides: sides.0, touching },
            Self { first: middle, slots: slots.1, sides: sides.1, touching },
        )
    }
}

/// Consecutive rows of W of an island, from contact `first` on; `begins` has where in all blocks each row begins, and the last
/// one ends. `next` is for each contact the place of the last block of its row that was mirrored, at first the diagonal one.
struct Filling<'a, const D: usize> {
    first: usize,
    begins: &'a [usize],
    columns: &'a mut [u32],
    blocks: &'a mut [Block<D>],
    next: &'a mut [u32],
}

impl<const D: usize> Cut for Filling<'_, D> {
    fn count(&self) -> usize {
        self.next.len()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        let Self { first, begins, columns, blocks, next } = self;
        let middle = begins[at] - begins[0];
        let (columns, blocks, next) = (columns.cut(middle), blocks.cut(middle), next.cut(at));
        (
            Self {
                first,
                begins: &begins[..=at],
                columns: columns.0,
                blocks: blocks.0,
                next: next.0,
            },
            Self {
                first: first + at,
                begins: &begins[at..],
                columns: columns.1,
                blocks: blocks.1,
                next: next.1,
            },
        )
    }
}

/// W of an island by its factors: each side of a contact moves its body, and the body both sides.
struct ByBodies<'a, S> {
    touching: &'a Touching,
    island: usize,
    sides: &'a [[S; 2]],
    symmetric: bool,
}

impl<const D: usize, S: Sided<D>> Factors<D> for ByBodies<'_, S> {
    fn contacts(&self) -> usize {
        self.sides.len()
    }

    fn is_symmetric(&self) -> bool {
        self.symmetric
    }

    fn bodies(&self) -> usize {
        self.touching.members(self.island)
    }

    fn of(&self, contact: usize) -> [Option<usize>; 2] {
        self.touching.members_at(self.touching.firsts[self.island] + contact)
    }

    #[inline]
    fn side(&self, contact: usize, side: usize) -> impl Iterator<Item = ([f64; D], [f64; D])> {
        self.sides[contact][side].columns()
    }
}

impl Parts<'_> {
    /// The columns of H and the rows of the velocities, q and mu, and the impulses to begin with; whether all is finite.
    fn state<const D: usize, S: Sided<D>>(
        &self,
        k: usize,
        Slot { problem, point, symmetric, rigid, .. }: &mut Slot<D>,
        sides: &mut [[S; 2]],
    ) -> bool {
        let Self { crew, touching, rows, bodies, .. } = *self;
        let order = &touching.order[touching.island(k)];
        let count = order.len();
        problem.q.resize(D * count, 0.0);
        problem.mu.resize(count, 0.0);
        point.r.resize(D * count, 0.0);
        let holds: [_; 3] = std::array::from_fn(|_| AtomicBool::new(true));
        let impulses = (&mut problem.mu[..], point.r.as_chunks_mut::<D>().0);
        let velocities = problem.q.as_chunks_mut::<D>().0;
        let all = ((order, sides), (velocities, impulses));
        crew.spread(all, count, |((order, sides), (q, (mu, r)))| {
            let (mut check, mut symmetric, mut rigid) = (0.0, true, true);
            let each = order.iter().zip(sides).zip(q).zip(mu).zip(r);
            for ((((&c, sides), q), mu), r) in each {
                let row = &rows[c as usize];
                for (arm, side) in row.arms.iter().zip(&mut *sides).filter(|a| a.0.free) {
                    side.write(row, arm, &bodies[arm.body as usize]);
                }
                symmetric &= !row.later;
                rigid &= row.compliance == 0.0 && row.mu_r == 0.0;
                *mu = row.mu;
                r.copy_from_slice(&row.r[..D]);
                let free = |b: &Moving| (b.v_free, b.spin_free);
                let rounding = row.rounding(sides, bodies, free);
                for i in 0..D {
                    let given = row.given[i] + row.shift[i];
                    let u = row.velocity(sides, i, given, bodies, free);
                    check += 0.0 * u;
                    q[i] = unrounded(u, rounding);
                }
            }
            for (all, holds) in holds.iter().zip([check == 0.0, symmetric, rigid]) {
                all.fetch_and(holds, Ordering::Relaxed);
            }
        });
        let [finite, all_symmetric, all_rigid] = holds.map(AtomicBool::into_inner);
        (*symmetric, *rigid) = (all_symmetric, all_rigid);
        finite
    }

    /// Whether rigid contacts between rigid bodies, without rolling friction, are all there is of island k.
    pub(super) fn has_contacts_alone<const D: usize>(&self, k: usize, slot: &Slot<D>) -> bool {
        slot.rigid && self.solids.is_empty() && scalars(self.islands, self.rows.len(), k).is_empty()
    }

    /// What the judge says of the impulses to begin with, from the factors of W, where it accepts them and many contacts alone make the problem.
    fn accept<const D: usize, S: Sided<D>>(
        &self,
        k: usize,
        slot: &mut Slot<D>,
        sides: &[[S; 2]],
        tolerance: f64,
    ) -> Option<Outcome> {
        // W of a small one is formed as soon, by memory that is at hand.
        if !(sides.len() > SMALL && self.has_contacts_alone(k, slot)) {
            return None;
        }
        let begun = Instant::now();
        let Slot { problem, point, gauge, symmetric, .. } = slot;
        let touching = self.touching;
        let factors = ByBodies { touching, island: k, sides, symmetric: *symmetric };
        let measure = gauge.accept(&factors, (&problem.q, &problem.mu), &point.r, tolerance)?;
        slot.leave_rows_out();
        Some(Outcome {
            status: Status::Solved,
            measure,
            iterations: 0,
            factorisations: 0,
            seconds: begun.elapsed().as_secs_f64(),
            cpu_seconds: None,
        })
    }

    /// W; whether it is finite.
    fn form<const D: usize, S: Sided<D>>(
        &self,
        k: usize,
        Slot { problem, scratch, symmetric, .. }: &mut Slot<D>,
        sides: &[[S; 2]],
    ) -> bool {
        let Self { crew, touching, .. } = *self;
        let places = touching.island(k);
        let (count, first) = (places.len(), places.start);
        scratch.resize(count, 0);
        crew.spread((places, &mut scratch[..]), count, |(places, lengths)| {
            for (place, length) in places.zip(lengths) {
                *length = touching.neighbours(place).count() as u32;
            }
        });
        let lengths = scratch.iter().map(|&n| n as usize);
        let (begins, columns, blocks) = problem.W.lay_out(count, lengths);
        let finite = AtomicBool::new(true);
        let filling = Filling { first, begins, columns, blocks, next: scratch };
        crew.spread(filling, count, |part| {
            if !self.fill(part, (first, sides), *symmetric) {
                finite.store(false, Ordering::Relaxed);
            }
        });
        finite.into_inner()
    }

    fn fill<const D: usize, S: Sided<D>>(
        &self,
        part: Filling<D>,
        (origin, sides): (usize, &[[S; 2]]),
        symmetric: bool,
    ) -> bool {
        let Self { touching, rows, solids, .. } = *self;
        let mut check = 0.0;
        let offset = part.begins[0];
        for at in 0..part.next.len() {
            let place = part.first + at;
            let (row, own) = (&rows[touching.order[place] as usize], &sides[place - origin]);
            let begin = part.begins[at] - offset;
            let (before, from) = part.blocks.split_at_mut(begin);
            let through_solids = |block: &mut Block<D>, of: usize, with: usize| {
                let [row, other] = [of, with].map(|p| &rows[touching.order[p] as usize]);
                solids.couple(block, row, other);
            };
            // Blocks are written where they stay: on their way through a variable they would wait for it.
            for (width, (j, shared)) in touching.neighbours(place).enumerate() {
                let to = &mut from[width];
                let other = &sides[j - origin];
                part.columns[begin + width] = (j - origin) as u32;
                if symmetric && j < place {
                    // The mirror image of a block above the diagonal, made anew where another part has it.
                    if let Some(j) = j.checked_sub(part.first) {
                        // Row j has met later contacts in the order in which they ask for it.
                        part.next[j] += 1;
                        transpose(to, &before[part.begins[j] - offset + part.next[j] as usize]);
                    } else {
                        let mut there = S::coupling(other, own, seen_from_the_other(shared));
                        if !solids.is_empty() {
                            through_solids(&mut there, j, place);
                        }
                        transpose(to, &there);
                    }
                } else {
                    *to = S::coupling(own, other, shared);
                    if !solids.is_empty() {
                        through_solids(to, place, j);
                    }
                    if j == place {
                        part.next[at] = width as u32;
                        to[0][0] += row.compliance;
                    }
                }
                check += 0.0 * (0..D).map(|i| to[i][i]).sum::<f64>();
            }
        }
        check == 0.0
    }

    /// The scalar rows, after the contacts: `V`, `R`, `s` and the bounds.
    #[allow(non_snake_case)]
    fn state_rows<const D: usize, S: Sided<D>>(
        &self,
        k: usize,
        Slot { problem, point, .. }: &mut Slot<D>,
        sides: &[[S; 2]],
    ) -> bool {
        let Self { islands, touching, rows, bodies, joints, .. } = *self;
        let contacts = rows.len() as u32;
        let scalars = scalars(islands, rows.len(), k);
        let origin = touching.firsts[k];
        point.lambda.clear();
        if scalars.is_empty() {
            problem.rows = None;
            return true;
        }
        // Those of each body, with the number of the lever.
        let mut levers = vec![];
        for (j, &k) in scalars.iter().enumerate() {
            let each = joints.levers((k - contacts) as usize).iter().enumerate();
            levers.extend(each.map(|(l, lever)| (lever.body, j as u32, l as u32)));
        }
        levers.sort_unstable();
        let (mut v, mut r) = (vec![], vec![]);
        let lever = |(_, j, l): (u32, u32, u32)| {
            &joints.levers((scalars[j as usize] - contacts) as usize)[l as usize]
        };
        for same in levers.chunk_by(|a, b| a.0 == b.0) {
            let body = same[0].0;
            for &e in same {
                let solved = &lever(e).solved;
                // One half and its mirror image: the other differs by rounding, and rounding is no coupling.
                for &other in same.iter().filter(|o| o.1 <= e.1) {
                    let row = &lever(other).row;
                    let entry: f64 = row.iter().zip(solved).map(|(a, b)| a * b).sum();
                    let (i, j) = (other.1 as usize, e.1 as usize);
                    r.push((i, j, entry));
                    if i != j {
                        r.push((j, i, entry));
                    }
                }
                for (place, side) in touching.of(body) {
                    let c = place - origin;
                    for i in 0..D {
                        v.push((D * c + i, e.1 as usize, sides[c][side].rate(i, solved)));
                    }
                }
            }
        }
        let (mut bounds, mut s) = (Bounds { lower: vec![], upper: vec![] }, vec![]);
        let mut sizes = vec![];
        for (j, k) in scalars.iter().map(|k| (k - contacts) as usize).enumerate() {
            let row = &joints.rows[k];
            let (free, terms) = joints.free(k, bodies);
            s.push(unrounded(free, ROUNDING * terms));
            sizes.push(terms);
            bounds.lower.push(row.bounds[0]);
            bounds.upper.push(row.bounds[1]);
            point.lambda.push(row.lambda);
            r.push((j, j, row.compliance));
        }
        let finite = r.iter().chain(&v).all(|e| e.2.is_finite()) && s.iter().all(|x| x.is_finite());
        let (n, p) = (D * sides.len(), scalars.len());
        let V = Csc::from_triplets(n, p, v.into_iter()).expect("in range");
        let R = Csc::from_triplets(p, p, r.into_iter()).expect("in range");
        if finite {
            agree(&R, &bounds, (&mut s, &sizes), joints.redundant.is_some());
        }
        problem.rows = Some(RowsLocal { V, R, s, bounds });
        finite
    }

    /// The problem with rolling friction, where a contact has any, beside that without.
    fn state_rolling(
        &self,
        k: usize,
        Slot { problem, rolling, point, .. }: &mut Slot<3>,
        sides: &[[Side; 2]],
    ) -> bool {
        let Self { islands, touching, rows, bodies, joints, .. } = *self;
        *rolling = None;
        let order = &touching.order[touching.island(k)];
        if order.iter().all(|&c| rows[c as usize].mu_r == 0.0) {
            return true;
        }
        let roller = |(&c, sides): (&u32, &[Side; 2])| rows[c as usize].roller(sides, bodies);
        let rollers: Vec<Roller> = order.iter().zip(sides).map(roller).collect();
        let levers = scalars(islands, rows.len(), k).iter().enumerate().flat_map(|(j, &k)| {
            let each = joints.levers(k as usize - rows.len()).iter();
            each.map(move |l| (l.body, j, [l.solved[3], l.solved[4], l.solved[5]]))
        });
        let levers: Vec<_> = levers.collect();
        let (stated, start) = rolling::problem(problem, &rollers, &levers, &point.r);
        let finite = are_finite(stated.q.iter().copied())
            && are_finite(stated.W.blocks().iter().flatten().flatten().copied());
        (*rolling, point.r) = (Some(stated), start);
        finite
    }
}

impl<const D: usize, S: Sided<D>> Problems<D, S>
where
    FrictionLocal<D>: Registered<Point = LocalPoint>,
    FrictionGlobal<D>: Registered<Point = GlobalPoint>,
{
    fn provide(&mut self, slots: usize) -> Result<(), SimulateError> {
        while self.slots.len() < slots {
            self.slots.push(Slot::new()?);
        }
        Ok(())
    }

    /// See [`Tools::state`]; `beyond` states what is beyond contacts and rows.
    fn state_all(
        &mut self,
        parts: &Parts,
        inner: Option<&Inner>,
        beyond: impl Fn(usize, &mut Slot<D>, &[[S; 2]]) -> bool + Sync,
    ) -> f64 {
        self.sides.resize(parts.touching.order.len(), [S::default(); 2]);
        self.each(parts, |k, slot, sides| {
            slot.outcome = None;
            slot.asked.finite = parts.state(k, slot, sides);
        });
        let begun = Instant::now();
        if let Some(Inner { limits, .. }) = inner {
            self.each(parts, |k, slot, sides| {
                slot.outcome = parts.accept(k, slot, sides, limits.tolerance).map(Ok);
            });
        }
        let seconds = begun.elapsed().as_secs_f64();
        let may_be_global = inner.is_some_and(Inner::is_auto);
        self.each(parts, |k, slot, sides| {
            slot.global = None;
            if !slot.asked.finite || slot.outcome.is_some() {
                return;
            }
            if may_be_global && parts.is_global::<D, S>(k, slot) {
                slot.asked.finite = parts.state_global(k, slot, sides);
            } else {
                slot.asked.finite = parts.form(k, slot, sides)
                    && parts.state_rows(k, slot, sides)
                    && beyond(k, slot, sides);
            }
        });
        seconds
    }

    /// Calls with each island that is due, its slot and the sides of its contacts.
    fn each(&mut self, parts: &Parts, call: impl Fn(usize, &mut Slot<D>, &mut [[S; 2]]) + Sync) {
        let touching = parts.touching;
        let slots = &mut self.slots[..parts.due.len()];
        let all = Slots { first: 0, slots, sides: &mut self.sides, touching };
        parts.crew.spread(all, touching.order.len(), |Slots { first, slots, sides, .. }| {
            let mut rest = sides;
            for (k, slot) in (first..).zip(slots) {
                let own;
                (own, rest) = rest.split_at_mut(touching.island(k).len());
                if parts.due[k] {
                    call(k, slot, own);
                }
            }
        });
    }

    fn ask(&mut self, k: usize, may_rest: bool) {
        let slot = &mut self.slots[k];
        // Equations alone are solved at once, or not at all.
        let linear = slot.problem.rows.as_ref().is_some_and(|r| r.bounds.are_free());
        let linear = linear && slot.problem.mu.is_empty();
        let most = if linear { LINEAR } else { usize::MAX };
        slot.asked = Asked { most, may_rest, ..slot.asked };
    }

    fn impulse(&self, k: usize, c: usize, row: &mut Row) {
        let Slot { point, rolling, .. } = &self.slots[k];
        let width = if rolling.is_some() { 5 } else { D };
        let r = &point.r[width * c..width * (c + 1)];
        row.r[..D].copy_from_slice(&r[..D]);
        if rolling.is_some() {
            row.moment.copy_from_slice(&r[3..]);
        }
    }

    fn after(&self, place: usize, row: &Row, bodies: &[Moving]) -> [f64; 3] {
        let sides = &self.sides[place];
        let along = |i| row.velocity(sides, i, row.given[i], bodies, |b| (b.v_new, b.spin_new));
        std::array::from_fn(|i| if i < D { along(i) } else { 0.0 })
    }
}

#[inline]
fn transpose<const D: usize>(to: &mut Block<D>, from: &Block<D>) {
    for i in 0..D {
        for j in 0..D {
            to[i][j] = from[j][i];
        }
    }
}

/// What contact c shares with contact j, from what j shares with c.
fn seen_from_the_other(shared: Shared) -> Shared {
    let mut out = [NONE; 2];
    for (own, &other) in shared.iter().enumerate().filter(|s| *s.1 != NONE) {
        out[other as usize] = own as u32;
    }
    out
}

/// What rounding makes of a relative velocity at most, in parts of its terms: a dozen products of numbers that a few operations made.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Bodies that move together have no relative velocity: what rounding leaves of one would be a load of its own, to be borne to the last digit.
fn unrounded(velocity: f64, rounding: f64) -> f64 {
    if velocity.abs() <= rounding.max(DECAYED) { 0.0 } else { velocity }
}

/// What is left of a velocity that has decayed to where doubles have no digits any more, m/s.
const DECAYED: f64 = 1e-290;

/// What is not known of the rate of an equation at poses that are closed to rounding, in parts of its terms.
const CLOSED: f64 = 128.0 * f64::EPSILON;
/// Loads in which less than this share is rounding are as good as exact to the judge.
const KNOWN: f64 = 1e-11;
/// What is added to the diagonal of R so that it can be factorised, in parts of it.
const REGULAR: f64 = 1e-12;

/// Loads `s` that are all rounding are none. Equations that follow from the others (`redundant`) agree with them but for rounding, and no impulse bears the difference: where it counts, the loads of the free rows become `R κ`, which impulses can answer, if none moves by more than is not known of it.
/// The velocities of bodies carry their rounding from row to row, in units of √R_jj.
#[allow(non_snake_case)]
fn agree(R: &Csc, bounds: &Bounds, (s, terms): (&mut [f64], &[f64]), redundant: bool) {
    let unit: Vec<f64> = (0..s.len()).map(|j| R.get(j, j).sqrt()).collect();
    let most = |x: &[f64]| {
        let each = x.iter().zip(&unit).filter(|e| *e.1 > 0.0);
        each.fold(0.0_f64, |most, (x, unit)| most.max(x.abs() / unit))
    };
    let (load, size) = (most(s), most(terms));
    if load <= ROUNDING * size {
        s.fill(0.0);
    } else if redundant && ROUNDING * size > KNOWN * load {
        answer_of(R, bounds, (s, &unit), CLOSED * size);
    }
}

/// Makes the loads of the free rows `R κ` where none moves by more than `most` in units of √R_jj.
#[allow(non_snake_case)]
fn answer_of(R: &Csc, bounds: &Bounds, (s, unit): (&mut [f64], &[f64]), most: f64) {
    let free: Vec<usize> = (0..s.len()).filter(|&j| bounds.is_free(j)).collect();
    let mut place = vec![usize::MAX; s.len()];
    free.iter().enumerate().for_each(|(k, &j)| place[j] = k);
    let own = R.triplets().map(|(i, j, x)| (place[i], place[j], x));
    let own = own.filter(|e| e.0.max(e.1) < usize::MAX);
    let p = free.len();
    let more = free.iter().enumerate().map(|(k, &j)| (k, k, REGULAR * unit[j] * unit[j]));
    let matrices =
        [Csc::from_triplets(p, p, own.clone()), Csc::from_triplets(p, p, own.chain(more))];
    let [Ok(R), Ok(regular)] = matrices else { return };
    let Ok(inverse) = Inverse::new(&regular, "R") else { return };
    let mut answered: Vec<f64> = free.iter().map(|&j| s[j]).collect();
    // What cannot be answered makes large impulses and these rounding, but for the second time; within each the second solve brings what the diagonal has kept off.
    for _ in 0..2 {
        let loads = std::mem::replace(&mut answered, vec![0.0; p]);
        for _ in 0..2 {
            let mut kappa: Vec<f64> = loads.iter().zip(&answered).map(|(s, x)| s - x).collect();
            inverse.solve(&mut kappa);
            R.mul_add(1.0, &kappa, &mut answered);
        }
    }
    let all = || free.iter().zip(&answered);
    if all().all(|(&j, x)| (x - s[j]).abs() <= most * unit[j]) {
        all().for_each(|(&j, &x)| s[j] = x);
    }
}

impl Row {
    /// Component i of a relative velocity: what is given and what free bodies make with these velocities.
    fn velocity<const D: usize, S: Sided<D>>(
        &self,
        sides: &[S; 2],
        i: usize,
        given: f64,
        bodies: &[Moving],
        of: impl Fn(&Moving) -> (Vec3, Vec3),
    ) -> f64 {
        let free = self.arms.iter().zip(sides).filter(|a| a.0.free);
        free.fold(given, |u, (arm, side)| u + side.velocity(i, of(&bodies[arm.body as usize])))
    }

    /// What rounding makes of such a velocity, with what is given, at most.
    fn rounding<const D: usize, S: Sided<D>>(
        &self,
        sides: &[S; 2],
        bodies: &[Moving],
        of: impl Fn(&Moving) -> (Vec3, Vec3),
    ) -> f64 {
        let given = self.given.iter().chain(&self.shift).fold(0.0_f64, |x, y| x.max(y.abs()));
        let free = self.arms.iter().zip(sides).filter(|a| a.0.free);
        let terms = free.map(|(arm, side)| side.terms(of(&bodies[arm.body as usize])));
        ROUNDING * (given + terms.sum::<f64>())
    }

    fn roller(&self, sides: &[Side; 2], bodies: &[Moving]) -> Roller {
        let turning = self.arms.each_ref().map(|arm| {
            if !arm.free {
                return Turning::default();
            }
            let b = &bodies[arm.body as usize];
            let later = if self.later { &b.frame_end } else { &b.frame };
            let of = |k: usize| {
                let moved = scale(arm.sign, apply(later, self.frame_end[1 + k]));
                let pushed = scale(arm.sign, apply(&b.frame, self.frame[1 + k]));
                (moved, apply(&b.inverse, pushed))
            };
            let [one, two] = [of(0), of(1)];
            Turning { rows: [one.0, two.0], solved: [one.1, two.1] }
        });
        let angular =
            |columns: &Columns| std::array::from_fn(|i| std::array::from_fn(|k| columns[3 + k][i]));
        let spin = |k: usize| {
            let free = self.arms.iter().zip(&turning).filter(|a| a.0.free);
            free.map(|(a, t)| dot(t.rows[k], bodies[a.body as usize].spin_free)).sum::<f64>()
        };
        Roller {
            mu_r: self.mu_r,
            bodies: self.arms.each_ref().map(|a| a.free.then_some(a.owner)),
            rows: sides.each_ref().map(|s| angular(&s.rows)),
            solved: sides.each_ref().map(|s| angular(&s.solved)),
            free: [0, 1].map(|k| self.turned[k] + self.turned_shift[k] + spin(k)),
            start: self.moment,
            sides: turning,
        }
    }
}
