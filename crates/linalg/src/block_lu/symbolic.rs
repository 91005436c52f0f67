//! What the pattern alone decides: the order of elimination, the fronts and where everything lies.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use super::dissection::nested_dissection;
use super::kernel::WIDTH;
use super::plan::Plan;
use crate::budget;

/// `(from, to, length)`: consecutive rows of a front's remainder that are consecutive in its parent too.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    pub from: u32,
    pub to: u32,
    pub len: u32,
}

/// A front: `pivots` unknowns eliminated together, coupled to `rest` later ones.
#[derive(Debug, Clone)]
pub(super) struct Front {
    /// Its first unknown in the order of elimination; the other pivots follow.
    pub start: usize,
    pub pivots: usize,
    pub rest: usize,
    /// Columns of L with the diagonal block, `pivots + rest` rows each, from here on.
    pub lower: usize,
    /// Columns of U beside the diagonal block, `pivots` rows each.
    pub upper: usize,
    /// The remainder (Schur complement), `rest` rows a column, in the stack.
    pub remainder: usize,
    /// The inverses of the unit lower triangles of the diagonal blocks.
    pub triangles: usize,
    /// Positions of the `rest` unknowns.
    pub rows: usize,
    /// The fronts whose remainders are added to this one: a range of `children`.
    pub children: std::ops::Range<usize>,
    /// How this front's remainder lies in the parent: a range of `runs`.
    pub runs: std::ops::Range<usize>,
    /// The first of its runs that lies beyond the parent's pivots. Runs do not cross that border.
    pub beyond: usize,
    /// Its blocks of A: a range of blocks.
    pub blocks: std::ops::Range<usize>,
}

impl Front {
    /// The positions of its unknowns that are no pivots, among those of all fronts.
    pub(super) fn rest_of<'a>(&self, rows: &'a [u32]) -> &'a [u32] {
        &rows[self.rows..self.rows + self.rest]
    }
}

/// Where a block of A (of two groups of nodes) lies among the values, and in its front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Its first value; columns of `rows` values.
    pub values: usize,
    /// First row and column in the order of elimination, for the scales.
    pub row: u32,
    pub column: u32,
    pub rows: u32,
    pub columns: u32,
    /// The entry of the front's storage (of U's where `upper`) that takes its first value.
    pub to: usize,
    pub upper: bool,
}

#[derive(Debug, Clone)]
pub(super) struct Symbolic {
    pub dim: usize,
    pub groups: Groups,
    /// Of unknown k in the order of elimination: its place in the caller's order.
    pub order: Vec<u32>,
    /// Blocks of group i: columns `pattern[pattern_start[i]..]`, sorted, and their numbers.
    pub pattern_start: Vec<usize>,
    pub pattern: Vec<u32>,
    pub number: Vec<u32>,
    pub places: Vec<Place>,
    pub fronts: Vec<Front>,
    pub children: Vec<u32>,
    pub runs: Vec<Run>,
    /// Positions of the rest of each front.
    pub rows: Vec<u32>,
    pub values_len: usize,
    pub lower_len: usize,
    pub upper_len: usize,
    pub stack_len: usize,
    pub plan: Plan,
    pub triangles_len: usize,
    pub widest: usize,
    pub flops: f64,
}

const NONE: u32 = u32::MAX;

/// A supernode while fronts are being formed: nodes in steps of elimination.
#[derive(Default)]
struct Super {
    columns: Vec<u32>,
    /// Later nodes that it is coupled to, sorted at the end only.
    rest: Vec<u32>,
    pivots: usize,
    rest_size: usize,
    parent: u32,
    merged: bool,
}

/// Estimated nanoseconds for a front, its share of assembly included; what merging is decided by.
pub(super) fn cost(k: usize, m: usize) -> f64 {
    let (k, m) = (k as f64, m as f64);
    400.0 + 25.0 * k + flops(k, m) / 30.0 + 0.5 * (k + m) * (k + m)
}

fn flops(k: f64, m: f64) -> f64 {
    k * k * k * (2.0 / 3.0) + 2.0 * k * m * (k + m)
}

/// Nodes that are coupled to each other and to the same others, taken together: a fraction of the pattern, and larger blocks.
#[derive(Debug, Clone)]
pub(super) struct Groups {
    /// Of each node: its group, its size, and the rows before it in the group.
    pub of: Vec<u32>,
    pub node_sizes: Vec<u32>,
    pub within: Vec<u32>,
    /// Of each group: its size, and its unknowns in the caller's order: `members[start[g]..start[g + 1]]`.
    pub sizes: Vec<u32>,
    pub start: Vec<usize>,
    pub members: Vec<u32>,
}

impl Symbolic {
    pub(super) fn new(sizes: &[usize], edges: impl Iterator<Item = (u32, u32)>) -> Self {
        Self::ordered(sizes, edges, elimination_order)
    }

    /// With an order of the groups' elimination of the caller's.
    pub(super) fn ordered(
        sizes: &[usize],
        edges: impl Iterator<Item = (u32, u32)>,
        order: impl FnOnce(&Pattern) -> Elimination,
    ) -> Self {
        let dim = sizes.iter().sum::<usize>();
        assert!(sizes.len().max(dim) < OWNED as usize, "fewer than 2³¹ unknowns");
        let (groups, pattern_start, pattern) = grouped(sizes, edges);
        let given = Pattern { sizes: &groups.sizes, start: &pattern_start, columns: &pattern };
        let Elimination { order, step, .. } = order(&given);
        let fronts = supernodes(&groups.sizes, &pattern_start, &pattern, &order, &step);
        let mut out = Self {
            dim,
            groups,
            order: vec![],
            pattern_start,
            number: vec![0; pattern.len()],
            pattern,
            places: vec![],
            fronts: vec![],
            children: vec![],
            runs: vec![],
            rows: vec![],
            values_len: 0,
            lower_len: 0,
            upper_len: 0,
            stack_len: 0,
            plan: Plan::default(),
            triangles_len: 0,
            widest: 0,
            flops: 0.0,
        };
        out.lay_out(&order, fronts);
        out
    }

    /// Numbers the unknowns, and gives everything its place. `order`: node of each step that `supers` speak of.
    fn lay_out(&mut self, order: &[u32], supers: Vec<Super>) {
        let n = self.groups.sizes.len();
        let sequence = postorder(&supers);
        // Positions of groups.
        let mut position = vec![0_u32; n]; // of a group: its first unknown in the order of elimination
        let mut front_of = vec![0_u32; n];
        self.order.reserve(self.dim);
        let mut number_of = vec![NONE; supers.len()];
        for (f, &s) in sequence.iter().enumerate() {
            number_of[s as usize] = f as u32;
            for &c in &supers[s as usize].columns {
                let node = order[c as usize] as usize;
                position[node] = self.order.len() as u32;
                front_of[node] = f as u32;
                let members = self.groups.start[node]..self.groups.start[node + 1];
                self.order.extend_from_slice(&self.groups.members[members]);
            }
        }
        // Fronts.
        let mut children: Vec<Vec<u32>> = vec![vec![]; sequence.len()];
        let (mut start, mut rest) = (0, Vec::new());
        for (f, &s) in sequence.iter().enumerate() {
            let s = &supers[s as usize];
            rest.clear();
            rest.extend(s.rest.iter().map(|&c| order[c as usize]));
            rest.sort_unstable_by_key(|&i| position[i as usize]);
            let (pivots, m) = (s.pivots, s.rest_size);
            self.fronts.push(Front {
                start,
                pivots,
                rest: m,
                lower: self.lower_len,
                upper: self.upper_len,
                remainder: 0,
                triangles: self.triangles_len,
                rows: self.rows.len(),
                children: 0..0,
                runs: 0..0,
                beyond: 0,
                blocks: 0..0,
            });
            for &i in &rest {
                let p = position[i as usize];
                self.rows.extend(p..p + self.groups.sizes[i as usize]);
            }
            if s.parent != NONE {
                children[number_of[s.parent as usize] as usize].push(f as u32);
            }
            start += pivots;
            self.lower_len += pivots * (pivots + m);
            self.upper_len += pivots * m;
            self.triangles_len += pivots.div_ceil(WIDTH) * WIDTH * WIDTH;
            self.widest = self.widest.max(pivots + m);
            self.flops += flops(pivots as f64, m as f64);
        }
        // Relative places: of the parent's rows in `local`, then runs of each child.
        let mut local = vec![0_u32; self.dim];
        for f in 0..self.fronts.len() {
            let front = &self.fronts[f];
            for k in 0..front.pivots {
                local[front.start + k] = k as u32;
            }
            let rows = front.rest_of(&self.rows);
            for (k, &r) in rows.iter().enumerate() {
                local[r as usize] = (front.pivots + k) as u32;
            }
            self.place_children(f, &children[f], &local);
            let columns = supers[sequence[f] as usize].columns.iter();
            let nodes = columns.map(|&c| order[c as usize] as usize);
            self.place_blocks(f, nodes, &position, &front_of, &local);
        }
        self.place_remainders();
    }

    /// Where the remainders of f's children go in f: runs of rows. `local`: place in f of each unknown that f has.
    fn place_children(&mut self, f: usize, children: &[u32], local: &[u32]) {
        let pivots = self.fronts[f].pivots;
        let first_child = self.children.len();
        for &c in children {
            self.children.push(c);
            let child = &self.fronts[c as usize];
            let begin = self.runs.len();
            let mut beyond = None;
            for (k, &r) in child.rest_of(&self.rows).iter().enumerate() {
                let to = local[r as usize];
                let crossing = beyond.is_none() && to as usize >= pivots;
                match self.runs[begin..].last_mut() {
                    Some(run) if run.to + run.len == to && !crossing => run.len += 1,
                    _ => self.runs.push(Run { from: k as u32, to, len: 1 }),
                }
                if crossing {
                    beyond = Some(self.runs.len() - 1);
                }
            }
            let end = self.runs.len();
            let child = &mut self.fronts[c as usize];
            child.runs = begin..end;
            child.beyond = beyond.unwrap_or(end);
        }
        self.fronts[f].children = first_child..self.children.len();
    }

    /// The blocks of A whose first node of elimination is in front f: `nodes`, those that f eliminates.
    fn place_blocks(
        &mut self,
        f: usize,
        nodes: impl Iterator<Item = usize>,
        position: &[u32],
        front_of: &[u32],
        local: &[u32],
    ) {
        let Front { pivots, rest, lower, upper, .. } = self.fronts[f];
        let begin = self.places.len();
        for j in nodes {
            for e in self.pattern_start[j]..self.pattern_start[j + 1] {
                let i = self.pattern[e] as usize;
                let of = front_of[i] as usize;
                if of < f {
                    continue;
                }
                // Block (i, j) in column j; and (j, i) in row j where i is not a pivot of this front.
                let (pi, pj) = (position[i], position[j]);
                let (si, sj) = (self.groups.sizes[i], self.groups.sizes[j]);
                let (li, lj) = (local[pi as usize] as usize, local[pj as usize] as usize);
                let mirror = self.find(i, j).expect("the pattern is symmetric");
                self.number[mirror] = self.places.len() as u32;
                self.places.push(Place {
                    values: self.values_len,
                    row: pi,
                    column: pj,
                    rows: si,
                    columns: sj,
                    to: lower + lj * (pivots + rest) + li,
                    upper: false,
                });
                self.values_len += si as usize * sj as usize;
                if of > f {
                    self.number[e] = self.places.len() as u32;
                    self.places.push(Place {
                        values: self.values_len,
                        row: pj,
                        column: pi,
                        rows: sj,
                        columns: si,
                        to: upper + (li - pivots) * pivots + lj,
                        upper: true,
                    });
                    self.values_len += si as usize * sj as usize;
                }
            }
        }
        self.fronts[f].blocks = begin..self.places.len();
    }

    /// The entry of the pattern that holds groups (i, j), if they are coupled.
    pub(super) fn find(&self, i: usize, j: usize) -> Option<usize> {
        let range = self.pattern_start[i]..self.pattern_start[i + 1];
        let found = self.pattern[range.clone()].binary_search(&(j as u32));
        found.ok().map(|at| range.start + at)
    }

    /// Prepares a factorisation on so many threads, where the memory for their stacks is there; keeps another plan where not.
    pub(super) fn share(&mut self, threads: usize) {
        if self.plan.threads == threads {
            return;
        }
        let before = self.stack_len;
        self.plan = Plan::new(threads, &self.fronts, &self.children);
        self.place_remainders();
        if self.stack_len > before && !budget::fits(8.0 * self.stack_len as f64) {
            self.plan = Plan { threads, regions: vec![0], ..Plan::default() };
            self.place_remainders();
        }
    }

    /// Where front f begins in all arrays, or where they end.
    pub(super) fn bounds(&self, f: usize) -> Bounds {
        match self.fronts.get(f) {
            Some(&Front { start, lower, upper, triangles, .. }) => {
                Bounds { start, lower, upper, triangles }
            }
            None => Bounds {
                start: self.dim,
                lower: self.lower_len,
                upper: self.upper_len,
                triangles: self.triangles_len,
            },
        }
    }

    /// Gives each remainder room in the stack. Tasks of the plan have a region each; the fronts above take what these leave free.
    fn place_remainders(&mut self) {
        let mut plan = std::mem::take(&mut self.plan);
        plan.regions = vec![0];
        let mut free = Room::default();
        for task in &plan.tasks {
            let mut room = Room { gaps: vec![], end: free.end };
            task.clone().for_each(|f| self.place_remainder(f, &mut room));
            free.gaps.append(&mut room.gaps);
            free.end = room.end;
            plan.regions.push(room.end);
        }
        plan.others(self.fronts.len()).for_each(|f| self.place_remainder(f, &mut free));
        self.stack_len = free.end;
        self.plan = plan;
    }

    /// The remainder of front f takes the first gap that is large enough; then its children's become gaps.
    fn place_remainder(&mut self, f: usize, room: &mut Room) {
        let need = self.fronts[f].rest * self.fronts[f].rest;
        if need > 0 {
            self.fronts[f].remainder = room.take(need);
        }
        for c in self.fronts[f].children.clone() {
            let child = &self.fronts[self.children[c] as usize];
            room.give_back(child.remainder, child.remainder + child.rest * child.rest);
        }
    }
}

/// The places of a front, or of what follows the last one, in the arrays of the factors.
pub(super) struct Bounds {
    pub start: usize,
    pub lower: usize,
    pub upper: usize,
    pub triangles: usize,
}

/// A stack with gaps (begin, end), sorted.
#[derive(Default)]
struct Room {
    gaps: Vec<(usize, usize)>,
    end: usize,
}

impl Room {
    /// The begin of the first gap that is large enough.
    fn take(&mut self, need: usize) -> usize {
        let Self { gaps, end } = self;
        match gaps.iter().position(|g| g.1 - g.0 >= need) {
            Some(g) => {
                let begin = gaps[g].0;
                gaps[g].0 += need;
                if gaps[g].0 == gaps[g].1 {
                    gaps.remove(g);
                }
                begin
            }
            None => {
                // A gap at the very end grows.
                let begin = match gaps.last() {
                    Some(g) if g.1 == *end => g.0,
                    _ => *end,
                };
                if begin < *end {
                    gaps.pop();
                }
                *end = begin + need;
                begin
            }
        }
    }

    /// Entries from `begin` to `end` are free.
    fn give_back(&mut self, begin: usize, end: usize) {
        let gaps = &mut self.gaps;
        if begin == end {
            return;
        }
        let mut g = gaps.partition_point(|g| g.0 < begin);
        gaps.insert(g, (begin, end));
        if g + 1 < gaps.len() && gaps[g].1 == gaps[g + 1].0 {
            gaps[g].1 = gaps.remove(g + 1).1;
        }
        if g > 0 && gaps[g - 1].1 == gaps[g].0 {
            gaps[g - 1].1 = gaps.remove(g).1;
            g -= 1;
        }
        debug_assert!(gaps[g].0 < gaps[g].1);
    }
}

/// The fronts that are left after merging, children before their parents.
fn postorder(supers: &[Super]) -> Vec<u32> {
    // Parents have larger steps than their children, so lists are filled backwards.
    let count = supers.len();
    let (mut child, mut sibling) = (vec![NONE; count + 1], vec![NONE; count]);
    for s in (0..count).rev().filter(|&s| !supers[s].merged) {
        let parent = (supers[s].parent as usize).min(count);
        sibling[s] = child[parent];
        child[parent] = s as u32;
    }
    let mut sequence: Vec<u32> = Vec::new();
    let mut stack = vec![];
    let mut at = child[count];
    // Depth first: down to the first child, out, to the sibling.
    while at != NONE || !stack.is_empty() {
        if at != NONE {
            stack.push(at);
            at = child[at as usize];
        } else if let Some(s) = stack.pop() {
            sequence.push(s);
            at = sibling[s as usize];
        }
    }
    sequence
}

/// The nodes that each node is coupled with, itself first, none twice: `rows[start[i]..end[i]]`. Nodes with equal sets have equal keys, which are
/// sorted, each with its node.
struct NodeRows {
    start: Vec<usize>,
    end: Vec<usize>,
    rows: Vec<u32>,
    keys: Vec<(u64, u32)>,
}

impl NodeRows {
    fn new(n: usize, edges: impl Iterator<Item = (u32, u32)>) -> Self {
        let pairs: Vec<(u32, u32)> = edges.filter(|(i, j)| i != j).collect();
        let mut start = vec![0_usize; n + 1];
        for &(i, j) in &pairs {
            assert!((i as usize) < n && (j as usize) < n, "an edge joins nodes");
            start[i as usize + 1] += 1;
            start[j as usize + 1] += 1;
        }
        (0..n).for_each(|i| start[i + 1] += start[i] + 1);
        let mut rows = vec![0_u32; start[n]];
        let mut end: Vec<usize> = start[..n].to_vec();
        for i in 0..n {
            rows[end[i]] = i as u32;
            end[i] += 1;
        }
        for &(i, j) in &pairs {
            for (i, j) in [(i as usize, j), (j as usize, i)] {
                rows[end[i]] = j;
                end[i] += 1;
            }
        }
        let mut mark = vec![NONE; n];
        // A sum of scrambled numbers is the same for equal sets in any order.
        let scrambled = |j: u32| {
            let x = (u64::from(j) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9)
        };
        let mut keys: Vec<(u64, u32)> = Vec::with_capacity(n);
        for i in 0..n {
            let (mut kept, mut sum) = (start[i], 0_u64);
            for e in start[i]..end[i] {
                let j = rows[e];
                if mark[j as usize] != i as u32 {
                    mark[j as usize] = i as u32;
                    rows[kept] = j;
                    kept += 1;
                    sum = sum.wrapping_add(scrambled(j));
                }
            }
            end[i] = kept;
            keys.push((sum, i as u32));
        }
        keys.sort_unstable();
        Self { start, end, rows, keys }
    }
}

/// Of each node: the first node with the same row.
fn leaders_of(start: &[usize], end: &[usize], rows: &[u32], keys: &[(u64, u32)]) -> Vec<u32> {
    let n = keys.len();
    let mut leader: Vec<u32> = (0..n as u32).collect();
    let mut mark = vec![NONE; n];
    let mut marked = NONE;
    let mut first = 0;
    for k in 1..n {
        if keys[k].0 != keys[first].0 {
            first = k;
            continue;
        }
        let (i, l) = (keys[k].1 as usize, keys[first].1 as usize);
        if marked != l as u32 {
            marked = l as u32;
            rows[start[l]..end[l]].iter().for_each(|&j| mark[j as usize] = marked);
        }
        let same = end[i] - start[i] == end[l] - start[l]
            && rows[start[i]..end[i]].iter().all(|&j| mark[j as usize] == marked);
        if same {
            leader[i] = l as u32;
        }
    }
    leader
}

/// The groups of nodes, and their symmetric pattern by rows, diagonal included, sorted.
fn grouped(
    sizes: &[usize],
    edges: impl Iterator<Item = (u32, u32)>,
) -> (Groups, Vec<usize>, Vec<u32>) {
    let n = sizes.len();
    let NodeRows { start, end, rows, keys } = NodeRows::new(n, edges);
    let leader = leaders_of(&start, &end, &rows, &keys);
    // Groups in the order of their first nodes; keys are sorted, so a leader comes before those it leads.
    let mut groups = Groups {
        of: vec![0; n],
        node_sizes: sizes.iter().map(|&s| s as u32).collect(),
        within: vec![0; n],
        sizes: vec![],
        start: vec![0],
        members: vec![],
    };
    let mut leaders = vec![];
    for i in 0..n {
        if leader[i] as usize == i {
            groups.of[i] = leaders.len() as u32;
            leaders.push(i);
            groups.sizes.push(0);
        } else {
            groups.of[i] = groups.of[leader[i] as usize];
        }
        let size = &mut groups.sizes[groups.of[i] as usize];
        groups.within[i] = *size;
        *size += sizes[i] as u32;
    }
    for g in 0..groups.sizes.len() {
        groups.start.push(groups.start[g] + groups.sizes[g] as usize);
    }
    groups.members = vec![0; groups.start[groups.sizes.len()]];
    let mut unknown = 0;
    for i in 0..n {
        let at = groups.start[groups.of[i] as usize] + groups.within[i] as usize;
        for k in 0..sizes[i] {
            groups.members[at + k] = unknown;
            unknown += 1;
        }
    }
    // Their pattern.
    let (mut pattern_start, mut pattern) = (vec![0], Vec::new());
    for (g, &l) in leaders.iter().enumerate() {
        let from = pattern.len();
        // Of each group, the leader stands for all.
        let others = rows[start[l]..end[l]].iter().filter(|&&j| leader[j as usize] == j);
        pattern.extend(others.map(|&j| groups.of[j as usize]));
        pattern[from..].sort_unstable();
        debug_assert!(pattern[from..].contains(&(g as u32)));
        pattern_start.push(pattern.len());
    }
    (groups, pattern_start, pattern)
}

/// Groups of unknowns by their sizes, and which are coupled: symmetric, by rows, sorted, diagonal included.
#[derive(Clone, Copy)]
pub(super) struct Pattern<'a> {
    pub sizes: &'a [u32],
    pub start: &'a [usize],
    pub columns: &'a [u32],
}

impl Pattern<'_> {
    pub(super) fn row(&self, i: usize) -> &[u32] {
        &self.columns[self.start[i]..self.start[i + 1]]
    }
}

/// An order of elimination that is a postorder of its tree.
pub(super) struct Elimination {
    /// The node of each step, and the step of each node.
    pub order: Vec<u32>,
    pub step: Vec<u32>,
    /// The parent of each step in the tree, NONE for roots.
    parent: Vec<u32>,
}

impl Elimination {
    /// The same elimination as in a given order, in a postorder of its tree.
    pub(super) fn new(pattern: &Pattern, given: &[u32]) -> Self {
        let n = given.len();
        let mut step = vec![0_u32; n];
        given.iter().enumerate().for_each(|(k, &i)| step[i as usize] = k as u32);
        let tree = elimination_tree(pattern, given, &step);
        let (mut child, mut sibling) = (vec![NONE; n + 1], vec![NONE; n]);
        for k in (0..n).rev() {
            let p = (tree[k] as usize).min(n);
            sibling[k] = child[p];
            child[p] = k as u32;
        }
        let mut order = Vec::with_capacity(n);
        let mut stack = vec![];
        let mut at = child[n];
        while at != NONE || !stack.is_empty() {
            if at != NONE {
                stack.push(at);
                at = child[at as usize];
            } else if let Some(k) = stack.pop() {
                order.push(given[k as usize]);
                at = sibling[k as usize];
            }
        }
        let mut parent = vec![NONE; n];
        let before = step;
        let mut step = vec![0_u32; n];
        order.iter().enumerate().for_each(|(k, &i)| step[i as usize] = k as u32);
        for (k, &i) in order.iter().enumerate() {
            let p = tree[before[i as usize] as usize];
            if p != NONE {
                parent[k] = step[given[p as usize] as usize];
            }
        }
        Self { order, step, parent }
    }

    /// Operations of a factorisation without merging, from the unknowns in each column of L (GilbertNgPeyton1994); near linear in the pattern.
    ///
    /// Column k of L has row i where k lies in the subtree of step i that its pattern reaches. Each leaf of that subtree adds i's unknowns to the count, each
    /// meeting of two paths takes them off again, and so does the parent of i; sums over subtrees are then the counts.
    pub(super) fn flops(&self, pattern: &Pattern) -> f64 {
        let n = self.order.len();
        let size = |k: usize| i64::from(pattern.sizes[self.order[k] as usize]);
        let mut first = vec![NONE; n];
        let mut count = vec![0_i64; n];
        for k in 0..n {
            if first[k] == NONE {
                (first[k], count[k]) = (k as u32, size(k));
            }
            let p = self.parent[k] as usize;
            if p < n && first[p] == NONE {
                first[p] = first[k];
            }
        }
        let (mut latest, mut newest) = (vec![NONE; n], vec![NONE; n]);
        let mut ancestor: Vec<u32> = (0..n as u32).collect();
        for k in 0..n {
            let p = self.parent[k];
            if p != NONE {
                count[p as usize] -= size(k);
            }
            for &j in pattern.row(self.order[k] as usize) {
                let i = self.step[j as usize] as usize;
                // A leaf of i's subtree has no descendant that was seen from i.
                if i <= k || (newest[i] != NONE && first[k] <= newest[i]) {
                    continue;
                }
                newest[i] = k as u32;
                count[k] += size(i);
                let before = std::mem::replace(&mut latest[i], k as u32);
                if before != NONE {
                    count[root(&mut ancestor, before) as usize] -= size(i);
                }
            }
            if p != NONE {
                ancestor[k] = p;
            }
        }
        let mut sum = 0.0;
        for k in 0..n {
            if self.parent[k] != NONE {
                count[self.parent[k] as usize] += count[k];
            }
            sum += flops(size(k) as f64, (count[k] - size(k)) as f64);
        }
        sum
    }
}

/// The root of a tree of ancestors, by paths that become shorter.
fn root(ancestor: &mut [u32], mut k: u32) -> u32 {
    let mut root = k;
    while ancestor[root as usize] != root {
        root = ancestor[root as usize];
    }
    while ancestor[k as usize] != root {
        k = std::mem::replace(&mut ancestor[k as usize], root);
    }
    root
}

/// Operations in whose time an entry of the pattern is dissected, twice over: a dissection then takes at most half of a factorisation's time.
///
/// Measured: 1.0 to 1.7 µs an entry, and some 30 operations a nanosecond. Piles of spheres pass it from about 1000 bodies on, polyhedra from 600, walls from
/// 30 000; towers and thin flows, which would gain nothing, never do.
const DISSECTION: f64 = 1e5;

/// By approximate minimum degree; where that takes many operations, by nested dissection if it takes fewer. Counts decide, so equal patterns get equal orders.
pub(super) fn elimination_order(pattern: &Pattern) -> Elimination {
    let by_degree = Elimination::new(pattern, &minimum_degree(pattern.start, pattern.columns));
    let flops = by_degree.flops(pattern);
    if flops < DISSECTION * pattern.columns.len() as f64 {
        return by_degree;
    }
    let dissected = Elimination::new(pattern, &nested_dissection(pattern));
    if dissected.flops(pattern) < flops { dissected } else { by_degree }
}

/// AMD of AmestoyDavisDuff1996, as faer has it.
pub(super) fn minimum_degree(start: &[usize], pattern: &[u32]) -> Vec<u32> {
    let n = start.len() - 1;
    // Strictly upper part by columns: the earlier entries of each row.
    let mut column_start = vec![0_u32; n + 1];
    let mut rows = Vec::with_capacity(pattern.len() / 2);
    for j in 0..n {
        rows.extend(pattern[start[j]..start[j + 1]].iter().filter(|&&i| (i as usize) < j));
        column_start[j + 1] = rows.len() as u32;
    }
    let mut identity: Vec<u32> = (0..n as u32).collect();
    if rows.is_empty() || n < 2 {
        return identity;
    }
    let (mut order, mut inverse) = (vec![0_u32; n], vec![0_u32; n]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(n, rows.len()));
    let a = SymbolicSparseColMatRef::new_checked(n, n, &column_start, None, &rows);
    let control = amd::Control::default();
    let stack = MemStack::new(&mut memory);
    if amd::order(&mut order, &mut inverse, a, control, stack).is_ok() {
        identity = order;
    }
    identity
}

/// The parent of each step (Liu1990), NONE for roots.
fn elimination_tree(pattern: &Pattern, order: &[u32], step: &[u32]) -> Vec<u32> {
    let n = order.len();
    let (mut parent, mut ancestor) = (vec![NONE; n], vec![NONE; n]);
    for k in 0..n {
        let i = order[k] as usize;
        for &j in pattern.row(i) {
            let mut at = step[j as usize];
            while at < k as u32 {
                let next = ancestor[at as usize];
                ancestor[at as usize] = k as u32;
                if next == NONE {
                    parent[at as usize] = k as u32;
                    break;
                }
                at = next;
            }
        }
    }
    parent
}

/// Supernodes of equal structure, then merged with their parents where the estimated time says so.
fn supernodes(
    sizes: &[u32],
    start: &[usize],
    pattern: &[u32],
    order: &[u32],
    step: &[u32],
) -> Vec<Super> {
    let n = order.len();
    let size = |k: u32| sizes[order[k as usize] as usize] as usize;
    let mut supers: Vec<Super> = Vec::new();
    // Supernodes that wait for the step that is the first of their rest; a list for each step.
    let (mut waiting, mut next): (Vec<u32>, Vec<u32>) = (vec![NONE; n], vec![]);
    let mut mark = vec![NONE; n];
    let mut rest: Vec<u32> = vec![];
    for k in 0..n as u32 {
        rest.clear();
        mark[k as usize] = k;
        let i = order[k as usize] as usize;
        let mut add = |j: u32, rest: &mut Vec<u32>| {
            if mark[j as usize] != k {
                mark[j as usize] = k;
                rest.push(j);
            }
        };
        for &j in &pattern[start[i]..start[i + 1]] {
            let j = step[j as usize];
            if j > k {
                add(j, &mut rest);
            }
        }
        // Children: those whose parent is k.
        let mut c = waiting[k as usize];
        while c != NONE {
            for e in 0..supers[c as usize].rest.len() {
                let j = supers[c as usize].rest[e];
                add(j, &mut rest);
            }
            c = next[c as usize];
        }
        // The child k − 1 with the same structure goes on as the same supernode.
        let same = supers.len().checked_sub(1).filter(|&s| {
            let s = &supers[s];
            s.parent == k
                && s.rest.len() == rest.len() + 1
                && s.columns.last() == k.checked_sub(1).as_ref()
        });
        let s = match same {
            Some(s) => {
                let last = &mut supers[s];
                last.columns.push(k);
                std::mem::swap(&mut last.rest, &mut rest);
                s
            }
            None => {
                supers.push(Super { columns: vec![k], rest: rest.clone(), ..Super::default() });
                next.push(NONE);
                supers.len() - 1
            }
        };
        // The children other than itself now belong to s.
        let mut c = waiting[k as usize];
        while c != NONE {
            let following = next[c as usize];
            if c as usize != s {
                supers[c as usize].parent = s as u32 | OWNED;
            }
            c = following;
        }
        let first = supers[s].rest.iter().copied().min().unwrap_or(NONE);
        supers[s].parent = first;
        if first != NONE {
            next[s] = waiting[first as usize];
            waiting[first as usize] = s as u32;
        }
    }
    for s in &mut supers {
        s.parent = if s.parent == NONE { NONE } else { s.parent & !OWNED };
        s.pivots = s.columns.iter().map(|&k| size(k)).sum();
        s.rest_size = s.rest.iter().map(|&k| size(k)).sum();
    }
    merge(&mut supers);
    supers
}

/// Marks a parent that is a supernode already, no longer a step.
const OWNED: u32 = 1 << 31;

/// Merges fronts into their parents, bottom up, while the estimated time falls.
fn merge(supers: &mut [Super]) {
    let count = supers.len();
    let (mut child, mut sibling) = (vec![NONE; count], vec![NONE; count]);
    for p in 0..count {
        // The children of p are complete: they come before it. Best gain first, as long as there is one.
        loop {
            let mut best = (0.0, NONE);
            let (mut c, kp, mp) = (child[p], supers[p].pivots, supers[p].rest_size);
            while c != NONE {
                let (k, m) = (supers[c as usize].pivots, supers[c as usize].rest_size);
                let apart = cost(k, m) + cost(kp, mp);
                let gain = apart - cost(k + kp, mp);
                if gain > best.0 {
                    best = (gain, c);
                }
                c = sibling[c as usize];
            }
            if best.1 == NONE {
                break;
            }
            // The merged child leaves the list, its children enter it.
            let c = best.1;
            let mut grandchild = child[c as usize];
            let mut list = NONE;
            let mut at = child[p];
            while at != NONE {
                let following = sibling[at as usize];
                if at != c {
                    sibling[at as usize] = list;
                    list = at;
                }
                at = following;
            }
            while grandchild != NONE {
                let following = sibling[grandchild as usize];
                supers[grandchild as usize].parent = p as u32;
                sibling[grandchild as usize] = list;
                list = grandchild;
                grandchild = following;
            }
            child[p] = list;
            let merged = &mut supers[c as usize];
            merged.merged = true;
            let mut columns = std::mem::take(&mut merged.columns);
            merged.rest = vec![];
            let pivots = merged.pivots;
            columns.append(&mut supers[p].columns);
            supers[p].columns = columns;
            supers[p].pivots += pivots;
        }
        let parent = supers[p].parent;
        if parent != NONE {
            sibling[p] = child[parent as usize];
            child[parent as usize] = p as u32;
        }
    }
}
