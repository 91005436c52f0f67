//! The problem of an island in the frames of a pass: W, q, mu of its contacts, `V, R, s` and bounds of its scalar rows, and the same with rolling friction.

use nonsmooth_linalg::Csc;
use nonsmooth_problem::{Bounds, Friction, FrictionLocal, LocalPoint, RowsLocal};
use nonsmooth_scenes::vec3::{Vec3, apply, dot, scale};
use nonsmooth_solve::registry::Registered;
use nonsmooth_solve::{Outcome, SolveError};

use super::contact::Row;
use super::couple::{Columns, FlatSide, Shared, Side, Sided};
use super::elastic::Solids;
use super::{NONE, Stride, Tools, are_finite};
use crate::crew::{Asked, Crew, Inner, Sessions, Slot};
use crate::joints::Joints;
use crate::moving::Moving;
use crate::rolling::{self, Roller, Turning};
use crate::{Dimension, SimulateError};

/// The most iterations on a problem that is linear.
const LINEAR: usize = 10;

/// The island that is being stated or taken up: its contacts and scalar rows, by their places among those of the step, its free bodies and its elastic solids.
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

    /// From this number on what contacts act on are solids.
    pub fn bodies(&self) -> u32 {
        self.bodies
    }

    /// How many bodies and solids there are in all.
    fn owners(&self) -> usize {
        self.gathered.len()
    }
}

/// The problems of the islands of a step, whose contacts have D rows, and what states and solves them.
pub(super) struct Problems<const D: usize, S> {
    /// Of each contact of the step the sides.
    sides: Vec<[S; 2]>,
    chains: Chains,
    /// For each contact the place of the last block of its row of W that was mirrored, at first the diagonal one.
    mirrored: Vec<u32>,
    /// The scalar rows of each body, with the number of the lever.
    levers: Vec<(u32, u32, u32)>,
    slots: Vec<Slot<D>>,
    /// Those that solve small islands, one a thread.
    sessions: Vec<Sessions<D>>,
}

impl<const D: usize, S> Default for Problems<D, S> {
    fn default() -> Self {
        Self {
            sides: vec![],
            chains: Chains::default(),
            mirrored: vec![],
            levers: vec![],
            slots: vec![],
            sessions: vec![],
        }
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

/// The contacts of each body of an island as a list, in order.
#[derive(Default)]
struct Chains {
    /// The first contact of each body, and for each contact the next one of its two bodies.
    heads: Vec<u32>,
    next: Vec<[u32; 2]>,
    /// The free bodies of each contact.
    pairs: Vec<[u32; 2]>,
}

impl Chains {
    fn link(&mut self, island: &Island, pairs: impl Iterator<Item = [u32; 2]>) {
        self.heads.resize(island.owners(), NONE);
        let solids = island.solids.iter().map(|k| island.bodies + k);
        for owner in island.members.iter().copied().chain(solids) {
            self.heads[owner as usize] = NONE;
        }
        self.pairs.clear();
        self.pairs.extend(pairs);
        self.next.clear();
        self.next.resize(self.pairs.len(), [NONE; 2]);
        // Made from the back.
        for c in (0..self.pairs.len()).rev() {
            for (side, &body) in self.pairs[c].iter().enumerate().filter(|b| *b.1 != NONE) {
                self.next[c][side] = std::mem::replace(&mut self.heads[body as usize], c as u32);
            }
        }
    }

    fn side(&self, c: u32, body: u32) -> usize {
        usize::from(self.pairs[c as usize][0] != body)
    }

    fn after(&self, c: u32, body: u32) -> u32 {
        self.next[c as usize][self.side(c, body)]
    }

    /// The contacts of a body, with its side of each.
    fn of(&self, body: u32) -> impl Iterator<Item = (usize, usize)> {
        let mut c = self.heads[body as usize];
        std::iter::from_fn(move || {
            let found = (c != NONE).then(|| (c as usize, self.side(c, body)))?;
            c = self.after(c, body);
            Some(found)
        })
    }

    /// The contacts of the two bodies of a contact, merged, each with the sides on which it touches the one and the other; a body that is not free has none.
    fn neighbours(&self, c: usize) -> impl Iterator<Item = (usize, Shared)> {
        let own = self.pairs[c];
        let mut at = own.map(|b| if b == NONE { NONE } else { self.heads[b as usize] });
        std::iter::from_fn(move || {
            let j = at[0].min(at[1]);
            if j == NONE {
                return None;
            }
            let mut shared = [NONE; 2];
            for k in 0..2 {
                if at[k] == j {
                    let side = self.side(j, own[k]);
                    shared[k] = side as u32;
                    at[k] = self.next[j as usize][side];
                }
            }
            Some((j as usize, shared))
        })
    }
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

    /// What is asked of the solver of slot k.
    pub fn ask(&mut self, k: usize, asked: Asked) {
        either!(self, problems => problems.ask(k, asked));
    }

    /// Solves the `open` ones of the first slots.
    pub fn solve(
        &mut self,
        crew: &Crew,
        (count, open): (usize, &[u32]),
        inner: &Inner,
    ) -> Result<(), SimulateError> {
        either!(self, p => crew.solve((&mut p.slots[..count], &mut p.sessions), open, inner))
    }

    /// What came of slot k; nothing where its problem is not finite.
    pub fn outcome(&mut self, k: usize) -> Option<Result<Outcome, SolveError>> {
        either!(self, problems => problems.slots[k].outcome.take())
    }

    /// The impulses of slot k.
    pub fn copy_impulses(&self, k: usize, island: &Island, rows: &mut [Row], joints: &mut Joints) {
        either!(self, problems => problems.copy_impulses(k, island, rows, joints));
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
        let first = if k == 0 { 0 } else { islands.ends[k - 1] };
        let items = &islands.order[first..islands.ends[k]];
        island.gather(items.iter().copied(), rows, joints);
    }

    /// All contacts and rows as if they were one island.
    pub(super) fn gather_all(&mut self) {
        let Self { island, rows, joints, .. } = self;
        island.gather(0..(rows.len() + joints.rows.len()) as u32, rows, joints);
    }

    /// States the problem of the island that was gathered in slot k; false where it has a number that is not finite.
    pub(super) fn state(&mut self, Stride { scheme, h, .. }: Stride, k: usize) -> bool {
        for &b in &self.island.members {
            self.bodies[b as usize].pass(scheme, h);
        }
        self.joints.columns(scheme, &self.island.scalars, &self.bodies);
        let Self { island, rows, bodies, solids, joints, stated, .. } = self;
        let parts = Parts { island, rows, bodies, joints };
        match stated {
            Stated::Space(p) => {
                p.state(&parts, solids, k) && p.state_rows(&parts, k) && p.state_rolling(&parts, k)
            }
            Stated::Plane(p) => p.state(&parts, solids, k) && p.state_rows(&parts, k),
        }
    }
}

/// What the problem of an island is made of.
struct Parts<'a> {
    island: &'a Island,
    rows: &'a [Row],
    bodies: &'a [Moving],
    joints: &'a Joints,
}

impl<const D: usize, S: Sided<D>> Problems<D, S>
where
    FrictionLocal<D>: Registered<Point = LocalPoint>,
{
    fn provide(&mut self, slots: usize) -> Result<(), SimulateError> {
        while self.slots.len() < slots {
            self.slots.push(Slot::new()?);
        }
        Ok(())
    }

    fn ask(&mut self, k: usize, asked: Asked) {
        let slot = &mut self.slots[k];
        // Equations alone are solved at once, or not at all.
        let linear = slot.problem.rows.as_ref().is_some_and(|r| r.bounds.are_free());
        let linear = linear && slot.problem.mu.is_empty();
        slot.asked = Asked { most: if linear { LINEAR } else { usize::MAX }, ..asked };
    }

    fn copy_impulses(&self, k: usize, island: &Island, rows: &mut [Row], joints: &mut Joints) {
        let Slot { point, rolling, .. } = &self.slots[k];
        let width = if rolling.is_some() { 5 } else { D };
        for (&c, r) in island.contacts.iter().zip(point.r.chunks_exact(width)) {
            let row = &mut rows[c as usize];
            row.r[..D].copy_from_slice(&r[..D]);
            if rolling.is_some() {
                row.moment.copy_from_slice(&r[3..]);
            }
        }
        for (&k, &lambda) in island.scalars.iter().zip(&point.lambda) {
            joints.rows[k as usize].lambda = lambda;
        }
    }

    fn after(&self, place: usize, row: &Row, bodies: &[Moving]) -> [f64; 3] {
        let sides = &self.sides[place];
        let along = |i| row.velocity(sides, i, row.given[i], bodies, |b| (b.v_new, b.spin_new));
        std::array::from_fn(|i| if i < D { along(i) } else { 0.0 })
    }

    /// The columns of H and the rows of the velocities.
    fn write_sides(&mut self, Parts { island, rows, bodies, .. }: &Parts) {
        self.sides.resize(rows.len(), [S::default(); 2]);
        for &c in &island.contacts {
            let row = &rows[c as usize];
            let sides = &mut self.sides[c as usize];
            for (arm, side) in row.arms.iter().zip(sides).filter(|a| a.0.free) {
                side.write(row, arm, &bodies[arm.body as usize]);
            }
        }
    }

    /// W, q and mu, and the impulses to begin with.
    fn state(&mut self, parts: &Parts, solids: &mut Solids, k: usize) -> bool {
        self.write_sides(parts);
        let Parts { island, rows, bodies, .. } = *parts;
        let Self { sides, chains, mirrored, slots, .. } = self;
        let Slot { problem, point, .. } = &mut slots[k];
        let order = &island.contacts;
        chains.link(island, order.iter().map(|&c| rows[c as usize].free_owners()));
        if !solids.is_empty() {
            order.iter().for_each(|&c| solids.reach(&rows[c as usize]));
        }
        problem.W.clear(order.len());
        problem.q.clear();
        problem.mu.clear();
        point.r.clear();
        let mut check = 0.0;
        let symmetric = order.iter().all(|&c| !rows[c as usize].later);
        mirrored.clear();
        mirrored.resize(order.len(), 0_u32);
        for (c, &place) in order.iter().enumerate() {
            let (row, own) = (&rows[place as usize], &sides[place as usize]);
            problem.mu.push(row.mu);
            point.r.extend_from_slice(&row.r[..D]);
            for i in 0..D {
                let given = row.given[i] + row.shift[i];
                let q = row.velocity(own, i, given, bodies, |b| (b.v_free, b.spin_free));
                problem.q.push(q);
                check += 0.0 * q;
            }
            for (width, (j, shared)) in chains.neighbours(c).enumerate() {
                let block = if symmetric && j < c {
                    // Row j has met later contacts in the order in which they ask for it.
                    mirrored[j] += 1;
                    let there = &problem.W.row(j).1[mirrored[j] as usize];
                    std::array::from_fn(|p| std::array::from_fn(|q| there[q][p]))
                } else {
                    let other = &sides[order[j] as usize];
                    let mut block = S::coupling(own, other, shared);
                    if !solids.is_empty() {
                        solids.couple(&mut block, row, &rows[order[j] as usize]);
                    }
                    if j == c {
                        mirrored[c] = width as u32;
                        block[0][0] += row.compliance;
                    }
                    block
                };
                check += 0.0 * (0..D).map(|i| block[i][i]).sum::<f64>();
                problem.W.push(j, block);
            }
            problem.W.end_row();
        }
        check == 0.0
    }

    /// The scalar rows, after the contacts: `V`, `R`, `s` and the bounds.
    #[allow(non_snake_case)]
    fn state_rows(&mut self, parts: &Parts, k: usize) -> bool {
        let Parts { island, bodies, joints, .. } = *parts;
        let Self { sides, chains, levers, slots, .. } = self;
        let Slot { problem, point, .. } = &mut slots[k];
        let Island { contacts: order, scalars, .. } = island;
        point.lambda.clear();
        if scalars.is_empty() {
            problem.rows = None;
            return true;
        }
        levers.clear();
        for (j, &k) in scalars.iter().enumerate() {
            let each = joints.levers(k as usize).iter().enumerate();
            levers.extend(each.map(|(l, lever)| (lever.body, j as u32, l as u32)));
        }
        levers.sort_unstable();
        let (mut v, mut r) = (vec![], vec![]);
        let lever =
            |(_, j, l): (u32, u32, u32)| &joints.levers(scalars[j as usize] as usize)[l as usize];
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
                for (c, side) in chains.of(body) {
                    let arm = &sides[order[c] as usize][side];
                    for i in 0..D {
                        v.push((D * c + i, e.1 as usize, arm.rate(i, solved)));
                    }
                }
            }
        }
        let (mut bounds, mut s) = (Bounds { lower: vec![], upper: vec![] }, vec![]);
        for (j, &k) in scalars.iter().enumerate() {
            let row = &joints.rows[k as usize];
            let mut free = row.shift;
            for lever in joints.levers(k as usize) {
                let b = &bodies[lever.body as usize];
                free += lever.rate(b.v_free, b.spin_free);
            }
            s.push(free);
            bounds.lower.push(row.bounds[0]);
            bounds.upper.push(row.bounds[1]);
            point.lambda.push(row.lambda);
            r.push((j, j, row.compliance));
        }
        let finite = r.iter().chain(&v).all(|e| e.2.is_finite()) && s.iter().all(|x| x.is_finite());
        let (n, p) = (D * order.len(), scalars.len());
        let V = Csc::from_triplets(n, p, v.into_iter()).expect("in range");
        let R = Csc::from_triplets(p, p, r.into_iter()).expect("in range");
        problem.rows = Some(RowsLocal { V, R, s, bounds });
        finite
    }
}

impl Problems<3, Side> {
    /// The problem with rolling friction, where a contact has any, beside that without.
    fn state_rolling(&mut self, parts: &Parts, k: usize) -> bool {
        let Parts { island, rows, bodies, joints } = *parts;
        let Self { sides, slots, .. } = self;
        let Slot { problem, rolling, point, .. } = &mut slots[k];
        *rolling = None;
        if island.contacts.iter().all(|&c| rows[c as usize].mu_r == 0.0) {
            return true;
        }
        let roller = |&c: &u32| rows[c as usize].roller(&sides[c as usize], bodies);
        let rollers: Vec<Roller> = island.contacts.iter().map(roller).collect();
        let levers = island.scalars.iter().enumerate().flat_map(|(j, &k)| {
            let each = joints.levers(k as usize).iter();
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
            free: [0, 1].map(|k| self.turned[k] + spin(k)),
            start: self.moment,
            sides: turning,
        }
    }
}
