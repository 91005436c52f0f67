//! Nested dissection: an order of elimination from separators of the graph.
//!
//! A set S of vertices whose removal leaves two parts without an edge between them is eliminated after both, which then do not fill each other
//! (George1973). With separators of O(n^⅔) vertices, as graphs in space have them, a factorisation takes O(n²) operations (LiptonRoseTarjan1979), where
//! minimum degree was seen to take n^2.4. Each part is dissected in turn, until it has at most [`LEAF`] vertices, which are ordered by minimum degree.
//!
//! A separator is found at several levels (KarypisKumar1998): the graph is coarsened by matching neighbours along heavy edges, a separator of the
//! coarsest graph grows from a seed, and at each level on the way back moves of single vertices, the best first and worsening ones too, make it
//! lighter (FiducciaMattheyses1982, on separators in place of cut edges). Weights are unknowns; a part weighs at most [`SHARE`] of the whole.
//!
//! Cost: O(e log n) time with e edges, O(e) memory, no recursion. The only chance is a fixed sequence of numbers: equal graphs get equal orders.

use std::collections::BinaryHeap;

use super::symbolic::{Pattern, minimum_degree};

/// Parts of at most this many vertices are not dissected.
const LEAF: usize = 120;
/// Coarsening ends at about this many vertices.
const COARSEST: usize = 80;
/// The largest share of the weight that a side of a separator may have.
const SHARE: f64 = 0.6;
/// Seeds from which a separator of the coarsest graph grows.
const SEEDS: usize = 6;
/// Most passes of refinement at a level.
const PASSES: usize = 10;
/// A pass ends after as many moves, and a hundredth of the vertices, without a better separator.
const PATIENCE: usize = 60;
/// Parts of more than this share of the graph, whose fronts are the largest, take the best of several separators.
const LARGE: f64 = 0.125;
const TRIALS: usize = 3;

const NONE: u32 = u32::MAX;
/// The third side of a vertex: in the separator.
const SEPARATOR: u8 = 2;

/// A symmetric graph by rows, without loops.
#[derive(Default)]
struct Graph {
    start: Vec<usize>,
    to: Vec<u32>,
    /// Of each entry of `to`: how many edges of the finest graph it stands for.
    edges: Vec<u32>,
    weight: Vec<u32>,
}

impl Graph {
    fn len(&self) -> usize {
        self.weight.len()
    }

    fn row(&self, v: usize) -> &[u32] {
        &self.to[self.start[v]..self.start[v + 1]]
    }

    fn degree(&self, v: usize) -> usize {
        self.start[v + 1] - self.start[v]
    }

    fn total(&self) -> i64 {
        self.weight.iter().map(|&w| i64::from(w)).sum()
    }

    /// The subgraphs of the vertices with `part[v] = 0, 1, …`, with the names of their vertices in this graph, which ascend. Others are left out.
    fn parts(&self, part: &[u32], count: usize) -> Vec<(Graph, Vec<u32>)> {
        let mut local = vec![0_u32; self.len()];
        let mut out: Vec<(Graph, Vec<u32>)> = (0..count).map(|_| Default::default()).collect();
        for v in 0..self.len() {
            if let Some((_, names)) = out.get_mut(part[v] as usize) {
                local[v] = names.len() as u32;
                names.push(v as u32);
            }
        }
        for (p, (graph, names)) in out.iter_mut().enumerate() {
            graph.start.reserve(names.len() + 1);
            graph.start.push(0);
            for &v in names.iter() {
                let v = v as usize;
                let inside = self.row(v).iter().filter(|&&u| part[u as usize] as usize == p);
                graph.to.extend(inside.map(|&u| local[u as usize]));
                graph.start.push(graph.to.len());
                graph.weight.push(self.weight[v]);
            }
            graph.edges = vec![1; graph.to.len()];
        }
        out
    }
}

/// Numbers that look random (Knuth's linear congruential generator), the same in every run.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, n: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (((self.0 >> 32) * n as u64) >> 32) as usize
    }
}

/// A part that waits for its order, with its vertices' names in the whole graph; it takes the places of the order that end at `end`.
struct Task {
    graph: Graph,
    names: Vec<u32>,
    end: usize,
}

/// The vertex of each step of elimination.
pub(super) fn nested_dissection(pattern: &Pattern) -> Vec<u32> {
    let n = pattern.sizes.len();
    let mut order = vec![NONE; n];
    let mut tasks = vec![without_hubs(pattern, &mut order)];
    let mut numbers = Numbers(1);
    while let Some(Task { graph, names, end }) = tasks.pop() {
        let Components { of, count, large } = components(&graph);
        if large == 0 {
            finish(&graph, &names, &mut order[..end]);
            continue;
        }
        if count > 1 {
            divide(&graph, &names, end, &of, count, &mut tasks);
            continue;
        }
        let trials = if graph.len() as f64 > LARGE * n as f64 { TRIALS } else { 1 };
        let side = separator(&graph, trials, &mut numbers);
        let count = |s: u8| side.iter().filter(|&&x| x == s).count();
        // Without a separator, as in a clique; parts that hardly become smaller would take quadratic time.
        if count(0).min(count(1)) == 0 || count(0).max(count(1)) * 10 > graph.len() * 9 {
            finish(&graph, &names, &mut order[..end]);
            continue;
        }
        let last = (0..graph.len()).filter(|&v| side[v] == SEPARATOR).map(|v| names[v]);
        let begin = end - count(SEPARATOR);
        order[begin..end].iter_mut().zip(last).for_each(|(o, v)| *o = v);
        let part: Vec<u32> = side.iter().map(|&s| u32::from(s)).collect();
        divide(&graph, &names, begin, &part, 2, &mut tasks);
    }
    order
}

/// The whole graph without the vertices whose row is so long that hardly a separator misses them: they come last, as in minimum degree.
fn without_hubs(pattern: &Pattern, order: &mut [u32]) -> Task {
    let n = pattern.sizes.len();
    let long = (10.0 * (n as f64).sqrt()).max(16.0) as usize;
    let hub = |v: usize| pattern.row(v).len() > long + 1;
    let mut end = n;
    for v in (0..n).rev().filter(|&v| hub(v)) {
        end -= 1;
        order[end] = v as u32;
    }
    let names: Vec<u32> = (0..n as u32).filter(|&v| !hub(v as usize)).collect();
    let mut local = vec![NONE; n];
    names.iter().enumerate().for_each(|(k, &v)| local[v as usize] = k as u32);
    let mut graph = Graph { start: vec![0], ..Graph::default() };
    for &v in &names {
        let row = pattern.row(v as usize).iter();
        let others = row.filter(|&&u| u != v && local[u as usize] != NONE);
        graph.to.extend(others.map(|&u| local[u as usize]));
        graph.start.push(graph.to.len());
        graph.weight.push(pattern.sizes[v as usize]);
    }
    graph.edges = vec![1; graph.to.len()];
    Task { graph, names, end }
}

/// Puts a part in order by minimum degree.
fn finish(graph: &Graph, names: &[u32], order: &mut [u32]) {
    let begin = order.len() - names.len();
    let local = minimum_degree(&graph.start, &graph.to);
    for (o, &v) in order[begin..].iter_mut().zip(&local) {
        *o = names[v as usize];
    }
}

/// The parts of a graph become tasks, one before the other.
fn divide(
    graph: &Graph,
    names: &[u32],
    mut end: usize,
    part: &[u32],
    count: usize,
    tasks: &mut Vec<Task>,
) {
    for (graph, mut inner) in graph.parts(part, count) {
        inner.iter_mut().for_each(|v| *v = names[*v as usize]);
        let len = inner.len();
        tasks.push(Task { graph, names: inner, end });
        end -= len;
    }
}

/// Of each vertex: its connected component, those of at most [`LEAF`] vertices taken together; their number, and how many are larger.
struct Components {
    of: Vec<u32>,
    count: usize,
    large: usize,
}

/// By breadth-first search.
fn components(graph: &Graph) -> Components {
    let n = graph.len();
    let (mut of, mut reached) = (vec![NONE; n], Vec::with_capacity(n));
    let (mut count, mut large, mut small) = (0, 0, NONE);
    for seed in 0..n {
        if of[seed] != NONE {
            continue;
        }
        let begin = reached.len();
        of[seed] = count;
        reached.push(seed as u32);
        let mut at = begin;
        while at < reached.len() {
            for &u in graph.row(reached[at] as usize) {
                if of[u as usize] == NONE {
                    of[u as usize] = count;
                    reached.push(u);
                }
            }
            at += 1;
        }
        if reached.len() - begin > LEAF {
            count += 1;
            large += 1;
        } else if small == NONE {
            small = count;
            count += 1;
        } else {
            reached[begin..].iter().for_each(|&v| of[v as usize] = small);
        }
    }
    Components { of, count: count as usize, large }
}

/// The side of each vertex of a connected graph, 0, 1 or [`SEPARATOR`], by the best of several trials. Where nothing separates, as in a clique, a side is empty.
fn separator(graph: &Graph, trials: usize, numbers: &mut Numbers) -> Vec<u8> {
    best_of((0..trials).map(|_| multilevel(graph, numbers)))
}

/// The first of the separators that none is better than.
fn best_of(found: impl Iterator<Item = (Merit, Vec<u8>)>) -> Vec<u8> {
    let better = |a: (Merit, Vec<u8>), b: (Merit, Vec<u8>)| if b.0 < a.0 { b } else { a };
    found.reduce(better).map(|best| best.1).unwrap_or_default()
}

/// A separator by way of coarser graphs.
fn multilevel(graph: &Graph, numbers: &mut Numbers) -> (Merit, Vec<u8>) {
    let heaviest = (1.5 * graph.total() as f64 / COARSEST as f64) as u32;
    // Of each level: which vertex of the next coarser one a vertex is part of. The finest graph is the caller's.
    let mut maps: Vec<Vec<u32>> = vec![];
    let mut coarser: Vec<Graph> = vec![];
    loop {
        let fine = coarser.last().unwrap_or(graph);
        if fine.len() <= COARSEST {
            break;
        }
        let (map, coarse) = contract(fine, &matching(fine, heaviest, numbers));
        if coarse.len() * 20 > fine.len() * 19 {
            break;
        }
        maps.push(map);
        coarser.push(coarse);
    }
    let side = first_separator(coarser.last().unwrap_or(graph), numbers);
    let mut found = Split::new(coarser.last().unwrap_or(graph), side).result();
    while let Some(map) = maps.pop() {
        coarser.pop();
        let finer = map.iter().map(|&c| found.1[c as usize]).collect();
        let mut split = Split::new(coarser.last().unwrap_or(graph), finer);
        split.refine();
        found = split.result();
    }
    found
}

/// Of each vertex: the neighbour that it is merged with, or itself. Vertices of few edges choose first, each the neighbour along its heaviest edge.
fn matching(graph: &Graph, heaviest: u32, numbers: &mut Numbers) -> Vec<u32> {
    let n = graph.len();
    let mut sequence: Vec<u32> = (0..n as u32).collect();
    for k in (1..n).rev() {
        sequence.swap(k, numbers.below(k + 1));
    }
    let most = graph.to.len() / n + 1;
    sequence.sort_by_key(|&v| graph.degree(v as usize).min(most));
    let mut mates = vec![NONE; n];
    // Of each vertex: a neighbour that found none of its own neighbours free, and waits for another such.
    let mut waiting = vec![NONE; n];
    for &v in &sequence {
        let v = v as usize;
        if mates[v] != NONE {
            continue;
        }
        let (mut best, mut hub) = ((0, 0, v as u32), (0, NONE));
        for e in graph.start[v]..graph.start[v + 1] {
            let u = graph.to[e];
            let both = graph.weight[v].saturating_add(graph.weight[u as usize]);
            let free = mates[u as usize] == NONE && both <= heaviest;
            if free && (graph.edges[e], u32::MAX - both) > (best.0, best.1) {
                best = (graph.edges[e], u32::MAX - both, u);
            }
            if graph.edges[e] > hub.0 {
                hub = (graph.edges[e], u);
            }
        }
        let mut mate = best.2 as usize;
        if mate == v && hub.1 != NONE {
            // Leaves of a star, which have no free neighbour, are merged with each other.
            let other = std::mem::replace(&mut waiting[hub.1 as usize], v as u32);
            if other != NONE && mates[other as usize] == other {
                let both = graph.weight[v].saturating_add(graph.weight[other as usize]);
                if both <= heaviest {
                    mate = other as usize;
                    waiting[hub.1 as usize] = NONE;
                }
            }
        }
        mates[v] = mate as u32;
        mates[mate] = v as u32;
    }
    mates
}

/// The graph of merged pairs: their weights added, and those of parallel edges. Also which of its vertices each vertex is part of.
fn contract(graph: &Graph, mates: &[u32]) -> (Vec<u32>, Graph) {
    let n = graph.len();
    let mut map = vec![NONE; n];
    let mut count = 0;
    for v in 0..n {
        if map[v] == NONE {
            map[v] = count;
            map[mates[v] as usize] = count;
            count += 1;
        }
    }
    let mut coarse = Graph::default();
    coarse.start.reserve(count as usize + 1);
    coarse.start.push(0);
    coarse.to.reserve(graph.to.len());
    coarse.edges.reserve(graph.to.len());
    coarse.weight.reserve(count as usize);
    // Where in `to` a coarse vertex was last entered; entries before the current row are of other rows.
    let mut place = vec![usize::MAX; count as usize];
    for v in 0..n {
        let (c, mate) = (map[v], mates[v] as usize);
        if mate < v {
            continue;
        }
        let begin = coarse.to.len();
        let pair = [v, mate];
        let members = &pair[..1 + usize::from(mate != v)];
        for &member in members {
            for e in graph.start[member]..graph.start[member + 1] {
                let d = map[graph.to[e] as usize];
                let at = place[d as usize];
                if d == c {
                    continue;
                }
                if at != usize::MAX && at >= begin {
                    coarse.edges[at] += graph.edges[e];
                } else {
                    place[d as usize] = coarse.to.len();
                    coarse.to.push(d);
                    coarse.edges.push(graph.edges[e]);
                }
            }
        }
        coarse.start.push(coarse.to.len());
        coarse.weight.push(members.iter().map(|&m| graph.weight[m]).sum());
    }
    (map, coarse)
}

/// The best of the separators that grow from several seeds, every other one at an end of the graph.
fn first_separator(graph: &Graph, numbers: &mut Numbers) -> Vec<u8> {
    best_of((0..SEEDS).map(|k| {
        let seed = numbers.below(graph.len());
        let seed = if k % 2 == 0 { farthest(graph, farthest(graph, seed)) } else { seed };
        let mut split = Split::new(graph, vec![1; graph.len()]);
        split.grow(seed);
        split.refine();
        split.result()
    }))
}

/// A vertex that is as many edges away as any.
fn farthest(graph: &Graph, seed: usize) -> usize {
    let mut seen = vec![false; graph.len()];
    let mut reached = vec![seed as u32];
    seen[seed] = true;
    let mut at = 0;
    while at < reached.len() {
        for &u in graph.row(reached[at] as usize) {
            if !std::mem::replace(&mut seen[u as usize], true) {
                reached.push(u);
            }
        }
        at += 1;
    }
    reached[reached.len() - 1] as usize
}

/// What is to become small, the first first: by how much a side is too heavy, and the separator's weight, more where the sides differ.
type Merit = (i64, f64);

/// A separator that is being improved.
///
/// Its vertex v may move to side `to`; its neighbours on the other side `from` then enter the separator, which becomes lighter by
/// `gain = weight(v) − near[v]`. All moves of a pass go to the same side, so a vertex moves at most once.
struct Split<'a> {
    graph: &'a Graph,
    side: Vec<u8>,
    /// Of the two sides and of the separator.
    weights: [i64; 3],
    /// The weight of a side beyond which it is too heavy.
    limit: i64,
    to: u8,
    from: u8,
    /// Of the separator's vertices: the weight of the neighbours on side `from`.
    near: Vec<i64>,
    /// Possible moves, `(gain, count, v)`, the best and then the latest on top. Those whose gain has changed since stand there in vain.
    queue: BinaryHeap<(i64, u32, u32)>,
    entered: u32,
    /// Vertices moved in this pass, each with the place from which on `pulled` has what it pulled into the separator.
    moves: Vec<(u32, usize)>,
    pulled: Vec<u32>,
}

impl<'a> Split<'a> {
    fn new(graph: &'a Graph, side: Vec<u8>) -> Self {
        let mut weights = [0; 3];
        for (&s, &w) in side.iter().zip(&graph.weight) {
            weights[s as usize] += i64::from(w);
        }
        let total: i64 = weights.iter().sum();
        Self {
            graph,
            weights,
            limit: (SHARE * total as f64) as i64,
            to: 0,
            from: 1,
            near: vec![0; side.len()],
            queue: BinaryHeap::new(),
            entered: 0,
            moves: vec![],
            pulled: vec![],
            side,
        }
    }

    fn result(self) -> (Merit, Vec<u8>) {
        (self.merit(), self.side)
    }

    /// With sides that differ by a share d of the whole, work that grows with the square of a part is 1 + d² times as much as with equal ones.
    fn merit(&self) -> Merit {
        let [a, b, separator] = self.weights.map(|w| w as f64);
        let d = (a - b) / (a + b + separator);
        let excess = self.weights[0].max(self.weights[1]) - self.limit;
        (excess.max(0), separator * (1.0 + d * d))
    }

    /// Enters v, whose gain is new, among the possible moves.
    fn enter(&mut self, v: usize) {
        self.entered += 1;
        let gain = i64::from(self.graph.weight[v]) - self.near[v];
        self.queue.push((gain, self.entered, v as u32));
    }

    /// Takes the best move.
    fn best(&mut self) -> Option<usize> {
        while let Some((gain, _, v)) = self.queue.pop() {
            let v = v as usize;
            if self.side[v] == SEPARATOR && i64::from(self.graph.weight[v]) - self.near[v] == gain {
                return Some(v);
            }
        }
        None
    }

    /// Counts the neighbours of a vertex of the separator, and enters it.
    fn count(&mut self, v: usize) {
        let behind = self.graph.row(v).iter().filter(|&&u| self.side[u as usize] == self.from);
        self.near[v] = behind.map(|&u| i64::from(self.graph.weight[u as usize])).sum();
        self.enter(v);
    }

    /// Takes v to a side or into the separator.
    fn reside(&mut self, v: usize, side: u8) {
        let weight = i64::from(self.graph.weight[v]);
        self.weights[self.side[v] as usize] -= weight;
        self.weights[side as usize] += weight;
        self.side[v] = side;
    }

    /// Moves v out of the separator, and its neighbours behind it into it.
    fn shift(&mut self, v: usize) {
        self.moves.push((v as u32, self.pulled.len()));
        self.reside(v, self.to);
        for &u in self.graph.row(v) {
            if self.side[u as usize] == self.from {
                self.pulled.push(u);
                self.pull(u as usize);
            }
        }
    }

    /// Takes u into the separator.
    fn pull(&mut self, u: usize) {
        self.reside(u, SEPARATOR);
        self.count(u);
        let weight = i64::from(self.graph.weight[u]);
        for &x in self.graph.row(u) {
            if self.side[x as usize] == SEPARATOR {
                self.near[x as usize] -= weight;
                self.enter(x as usize);
            }
        }
    }

    /// Takes back all moves of this pass but the first `kept`.
    fn take_back(&mut self, kept: usize) {
        while self.moves.len() > kept {
            let Some((v, begin)) = self.moves.pop() else { return };
            self.reside(v as usize, SEPARATOR);
            while self.pulled.len() > begin {
                let Some(u) = self.pulled.pop() else { return };
                self.reside(u as usize, self.from);
            }
        }
    }

    /// From all vertices on side 1: side 0 grows from a seed, by the best move each time, until it is the heavier one.
    fn grow(&mut self, seed: usize) {
        self.pull(seed);
        while self.weights[0] < self.weights[1] {
            let Some(v) = self.best() else { break };
            self.shift(v);
        }
    }

    /// Passes to either side in turn, the lighter one first, until one to each has been in vain.
    ///
    /// A pass to one side carries the whole separator over a hill. With moves to both sides in one pass it wavers on the spot: factorisations took 1.2 times
    /// the operations in piles, 1.6 times in walls.
    fn refine(&mut self) {
        let lighter = u8::from(self.weights[1] < self.weights[0]);
        (self.to, self.from) = (lighter, 1 - lighter);
        let mut vain = 0;
        for _ in 0..PASSES {
            let before = self.merit();
            self.pass();
            (self.to, self.from) = (self.from, self.to);
            vain = if self.merit() < before { 0 } else { vain + 1 };
            if vain == 2 {
                break;
            }
        }
    }

    /// Moves to one side, the best first, worsening ones too, until no better separator has come for long; then back to the best.
    fn pass(&mut self) {
        self.queue.clear();
        self.moves.clear();
        self.pulled.clear();
        for v in 0..self.side.len() {
            if self.side[v] == SEPARATOR {
                self.count(v);
            }
        }
        let patience = PATIENCE + self.side.len() / 100;
        let (mut best, mut kept) = (self.merit(), 0);
        while self.moves.len() - kept < patience {
            let Some(v) = self.best() else { break };
            let after = self.weights[self.to as usize] + i64::from(self.graph.weight[v]);
            if after > self.limit.max(self.weights[self.from as usize]) {
                continue;
            }
            self.shift(v);
            let merit = self.merit();
            if merit < best {
                (best, kept) = (merit, self.moves.len());
            }
        }
        self.take_back(kept);
    }
}

#[cfg(test)]
mod tests;
