//! Greedy colouring of contacts: two of one colour do not feel each other.
//!
//! A contact reads some places (impulses or velocities) and writes some; two contacts are coupled if one writes what the other
//! reads. Each contact in turn gets the first colour that no contact coupled to it has: at most one more than the largest number of
//! neighbours. Cost: the couplings, once each way.
//!
//! Source: JonesPlassmann1993 for colourings in parallel methods; the greedy order is the contacts' own.

use crate::contact::form::Concurrent;

/// Colours of contacts. Keeps its memory from one colouring to the next.
#[derive(Debug, Clone, Default)]
pub struct Coloring {
    colors: Vec<u32>,
    count: usize,
    /// For each place the colours of those who read and of those who write it, so far.
    readers: Vec<Vec<u32>>,
    writers: Vec<Vec<u32>>,
    /// The last contact that may not have a colour.
    barred: Vec<usize>,
    reads: Vec<u32>,
    writes: Vec<u32>,
}

impl Coloring {
    /// Colours the contacts of a problem.
    pub fn fill<P: Concurrent<D>, const D: usize>(&mut self, problem: &P, state: &P::State) {
        self.colors.clear();
        self.count = 0;
        self.readers.iter_mut().for_each(Vec::clear);
        self.writers.iter_mut().for_each(Vec::clear);
        self.barred.clear();
        for c in 0..problem.contacts() {
            self.reads.clear();
            self.writes.clear();
            problem.places(state, c, &mut self.reads, &mut self.writes);
            let places = self.reads.iter().chain(&self.writes).max().map_or(0, |p| *p as usize + 1);
            if places > self.readers.len() {
                self.readers.resize(places, vec![]);
                self.writers.resize(places, vec![]);
            }
            let of_readers = self.writes.iter().flat_map(|p| &self.readers[*p as usize]);
            let of_writers = self.reads.iter().flat_map(|p| &self.writers[*p as usize]);
            for color in of_readers.chain(of_writers) {
                self.barred[*color as usize] = c;
            }
            let color = (0..self.count).find(|k| self.barred[*k] != c).unwrap_or(self.count);
            if color == self.count {
                self.count += 1;
                self.barred.push(usize::MAX);
            }
            let color = color as u32;
            self.colors.push(color);
            // A colour stands at most once at a place, and last where it has just been put.
            let note = |lists: &mut Vec<Vec<u32>>, places: &[u32]| {
                for p in places {
                    let list = &mut lists[*p as usize];
                    if !list.contains(&color) {
                        list.push(color);
                    }
                }
            };
            note(&mut self.readers, &self.reads);
            note(&mut self.writers, &self.writes);
        }
    }

    /// The colour of each contact.
    pub fn colors(&self) -> &[u32] {
        &self.colors
    }

    pub fn count(&self) -> usize {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::FrictionLocal;
    use nonsmooth_problem::planted::Planted;

    use super::*;
    use crate::contact::form::Access;

    fn coupled(reads: &[Vec<u32>], writes: &[Vec<u32>], a: usize, b: usize) -> bool {
        let meets = |x: &[u32], y: &[u32]| x.iter().any(|p| y.contains(p));
        meets(&reads[a], &writes[b]) || meets(&writes[a], &reads[b])
    }

    fn checked<P: Concurrent<D>, const D: usize>(problem: &P, coloring: &mut Coloring) {
        let mut state = problem.state(Access::Visits).unwrap();
        coloring.fill(problem, &state);
        let n = problem.contacts();
        let (mut reads, mut writes) = (vec![vec![]; n], vec![vec![]; n]);
        for c in 0..n {
            problem.places(&state, c, &mut reads[c], &mut writes[c]);
        }
        let colors = coloring.colors();
        assert_eq!(colors.len(), n);
        assert!(colors.iter().all(|k| (*k as usize) < coloring.count()));
        // What is said to be uncoupled really is: an impulse changes no velocity of its own colour.
        let mut r = vec![0.0; D * n];
        for a in 0..n {
            let neighbours = (0..n).filter(|b| *b != a && coupled(&reads, &writes, a, *b)).count();
            assert!(colors[a] as usize <= neighbours);
            let before: Vec<_> = (0..n).map(|b| problem.velocity(&state, &r, b)).collect();
            let dr = [1.0; D];
            r[D * a..D * a + D].copy_from_slice(&dr);
            problem.moved(&mut state, a, &dr);
            for b in (0..n).filter(|b| *b != a && colors[*b] == colors[a]) {
                assert!(!coupled(&reads, &writes, a, b));
                assert_eq!(problem.velocity(&state, &r, b), before[b], "{a} moves {b}");
            }
            r[D * a..D * a + D].fill(0.0);
            problem.moved(&mut state, a, &dr.map(|x| -x));
        }
    }

    #[test]
    fn contacts_of_one_colour_do_not_feel_each_other() {
        let mut coloring = Coloring::default();
        let mut most = 0;
        for seed in 0..6 {
            let planted = Planted { contacts: 40, dofs: 240, seed, ..Planted::default() };
            checked(&planted.local::<3>().0, &mut coloring);
            most = most.max(40 - coloring.count());
            checked(&planted.global::<3>().0, &mut coloring);
            checked(&planted.global::<2>().0, &mut coloring);
            let constrained = Planted { bilateral: 4, ..planted };
            checked(&constrained.local::<3>().0, &mut coloring);
            checked(&constrained.global::<3>().0, &mut coloring);
        }
        assert!(most > 0, "some contacts share a colour");
    }

    /// Random sparse graphs as patterns of W, one-sided couplings included.
    #[test]
    fn random_graphs() {
        use nonsmooth_linalg::{Bsr, Csc};
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let mut coloring = Coloring::default();
        for degree in [0, 1, 3, 10] {
            let n = 60;
            let mut triplets: Vec<_> = (0..2 * n).map(|i| (i, i, 10.0)).collect();
            for _ in 0..degree * n {
                let (i, j) = (rng.random_range(0..2 * n), rng.random_range(0..2 * n));
                triplets.push((i, j, 0.1));
            }
            let w = Csc::from_triplets(2 * n, 2 * n, triplets.into_iter()).unwrap();
            let problem =
                FrictionLocal::<2>::new(Bsr::from_csc(&w), vec![-1.0; 2 * n], vec![0.3; n])
                    .unwrap();
            checked(&problem, &mut coloring);
            assert_eq!(coloring.count() == 1, degree == 0);
        }
    }
}
