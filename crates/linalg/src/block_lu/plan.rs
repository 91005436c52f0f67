//! Which fronts of a factorisation go side by side on several threads.

use std::ops::Range;

use super::symbolic::{Front, cost};

/// Ranges of fronts, each of whole subtrees of the tree of elimination, that have nothing to do with each other. The fronts above come after them.
#[derive(Debug, Clone, Default)]
pub(super) struct Plan {
    /// The number of threads that it is for.
    pub threads: usize,
    /// In the order of fronts.
    pub tasks: Vec<Range<usize>>,
    /// Where in the stack the remainders of each task lie: one begins where that before it ends.
    pub regions: Vec<usize>,
}

/// Tasks a thread, at least: so that all end at about the same time.
const TASKS: f64 = 4.0;
/// Estimated nanoseconds below which subtrees are left to the thread that does the fronts above.
const SMALL: f64 = 2e4;

impl Plan {
    /// For trees whose fronts have `children`; on one thread, no tasks. Cost: linear in the number of fronts.
    pub(super) fn new(threads: usize, fronts: &[Front], children: &[u32]) -> Self {
        let tasks = if threads > 1 { tasks(threads, fronts, children) } else { vec![] };
        Self { threads, tasks, regions: vec![0] }
    }

    /// The fronts of no task.
    pub(super) fn others(&self, fronts: usize) -> impl Iterator<Item = usize> {
        let begins = std::iter::once(0).chain(self.tasks.iter().map(|t| t.end));
        let ends = self.tasks.iter().map(|t| t.start).chain(std::iter::once(fronts));
        begins.zip(ends).flat_map(|(begin, end)| begin..end)
    }
}

/// From the roots down, subtrees that take less than a share of the whole; small neighbours together.
fn tasks(threads: usize, fronts: &[Front], children: &[u32]) -> Vec<Range<usize>> {
    let n = fronts.len();
    let (mut first, mut work, mut root) = ((0..n).collect::<Vec<_>>(), vec![0.0; n], vec![true; n]);
    for (f, front) in fronts.iter().enumerate() {
        work[f] = cost(front.pivots, front.rest);
        for &c in &children[front.children.clone()] {
            let c = c as usize;
            first[f] = first[f].min(first[c]);
            work[f] += work[c];
            root[c] = false;
        }
    }
    let mut open: Vec<usize> = (0..n).filter(|&f| root[f]).collect();
    let share = open.iter().map(|&f| work[f]).sum::<f64>() / (TASKS * threads as f64);
    let mut found: Vec<(Range<usize>, f64)> = vec![];
    while let Some(f) = open.pop() {
        if work[f] > share {
            open.extend(children[fronts[f].children.clone()].iter().map(|&c| c as usize));
        } else {
            found.push((first[f]..f + 1, work[f]));
        }
    }
    found.sort_unstable_by_key(|(range, _)| range.start);
    let mut out: Vec<(Range<usize>, f64)> = vec![];
    for (range, work) in found {
        match out.last_mut() {
            Some((last, sum)) if last.end == range.start && *sum + work <= share => {
                last.end = range.end;
                *sum += work;
            }
            _ => out.push((range, work)),
        }
    }
    out.into_iter().filter(|(_, work)| *work > SMALL).map(|(range, _)| range).collect()
}
