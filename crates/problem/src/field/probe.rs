//! The pattern of a Jacobian, found by probing: which rows change with which columns.
//!
//! Blocks of columns are halved; of each half it is asked which rows see it, for all halves at once of which no row can see two. Of a pattern with k places a
//! row this takes some `k log₂ n` probes. Where at [`FULL`] blocks a row still sees all of them, n differences would be needed for a Jacobian anyway: the pattern is then taken to be full,
//! unless that is too large ([`MOST`]).

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::Pattern;
use super::groups::Groups;

/// So many blocks of which some row sees all.
const FULL: usize = 64;
/// The most rows of a pattern that is taken to be full.
const MOST: usize = 2000;

/// What a probe says of a row and a set of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Seen {
    /// The row is not defined, or not differentiable, at any of the points.
    Unknown,
    No,
    Yes,
}

/// Points about x at which functions are probed: x itself and others, near and far, of which some are inside where x is on the border of where F is defined.
pub(super) fn points(x: &[f64]) -> Vec<Vec<f64>> {
    let mut random = Pcg64::seed_from_u64(0);
    let mut away = |share: f64| {
        let size = |x: f64| share * x.abs().max(1.0);
        x.iter().map(|&x| x + size(x) * random.random_range(0.5..1.0)).collect()
    };
    vec![x.to_vec(), away(1e-2), away(1.0), away(-0.5)]
}

/// The pattern of n rows. `see` gets at most `lanes` sets of columns and raises what it sees of each row in each of them, at first [`Seen::Unknown`], as
/// `seen[set][row]`. A row about which nothing is known sees all that it may.
pub(super) fn probed(
    n: usize,
    lanes: usize,
    mut see: impl FnMut(&[Vec<usize>], &mut [Vec<Seen>]),
) -> Pattern {
    #[allow(clippy::single_range_in_vec_init)] // Ranges, of which there is one at first.
    let mut blocks = vec![0..n];
    let mut rows = vec![vec![0]; n];
    loop {
        // Halves, and where those of a block begin.
        let (mut halves, mut starts) = (vec![], vec![]);
        for block in &blocks {
            starts.push(halves.len());
            let middle = block.start + block.len().div_ceil(2);
            halves.push(block.start..middle);
            if middle < block.end {
                halves.push(middle..block.end);
            }
        }
        starts.push(halves.len());
        let may = Pattern::new(
            rows.iter().map(|row| row.iter().flat_map(|&b: &usize| starts[b]..starts[b + 1])),
        );
        let groups = Groups::of(&may, halves.len());
        if groups.columns.len() == halves.len() && halves.len() >= FULL && n <= MOST {
            return Pattern::dense(n);
        }
        let mut next = vec![vec![]; n];
        for (first, some) in groups.columns.chunks(lanes).enumerate() {
            let columns = |group: &Vec<usize>| {
                group.iter().flat_map(|&half: &usize| halves[half].clone()).collect()
            };
            let sets: Vec<Vec<usize>> = some.iter().map(columns).collect();
            let mut seen = vec![vec![Seen::Unknown; n]; sets.len()];
            see(&sets, &mut seen);
            for (i, j) in may.places() {
                let lane = groups.of_column[j].checked_sub(first * lanes);
                if lane.and_then(|k| seen.get(k)).is_some_and(|seen| seen[i] != Seen::No) {
                    next[i].push(j);
                }
            }
        }
        next.iter_mut().for_each(|row| row.sort_unstable());
        if halves.len() == n {
            return Pattern::new(next.into_iter().map(Vec::into_iter));
        }
        (rows, blocks) = (next, halves);
    }
}
