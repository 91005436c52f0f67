//! Several solutions of a nonlinear problem, from several starts.
//!
//! A nonlinear complementarity problem may have any number of solutions, and a solver finds one of them. Here it begins at the problem's start and at random
//! points; the solutions that differ are kept. That is a sample: nothing says that there are no others.

use nonsmooth_problem::{LcpPoint, Mcp, Problem};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::door::{Answer, Solve};
use crate::{Limit, SolveError, Status};

/// What several starts came to.
#[derive(Debug, Clone)]
pub struct Found {
    /// The solutions that differ, in the order in which they were found, each with how many starts led to it.
    pub solutions: Vec<(Answer<Mcp>, usize)>,
    /// The starts tried.
    pub starts: usize,
    /// The limit that came before the others.
    pub limit: Option<Limit>,
}

/// Two points are one solution if no coordinate differs by more than this part of `1 + |x|`.
const SAME: f64 = 1e-6;
/// Random starts of variables without finite bounds are so far from the problem's start at most, in units of its size.
const SPREAD: [f64; 4] = [1.0, 10.0, 100.0, 0.1];

/// Solves the problem from its start and from `starts − 1` random points, as `how` says; its limit on time is for all together. Between two finite bounds the random points are
/// uniform, elsewhere around the start, near and far by turns; the same seed gives the same.
///
/// Errors: as [`Solve::run`].
pub fn multistart(
    problem: &Mcp,
    how: &Solve,
    starts: usize,
    seed: u64,
) -> Result<Found, SolveError> {
    let begun = std::time::Instant::now();
    let mut found = Found { solutions: vec![], starts: 0, limit: None };
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    for turn in 0..starts {
        if turn > 0
            && let Some(limit) = how.limits.reached(begun)
        {
            found.limit = Some(limit);
            break;
        }
        let limits = how.limits.left(begun);
        let start = match turn {
            0 => problem.origin(),
            _ => around(problem, SPREAD[turn % SPREAD.len()], &mut random),
        };
        let answer = how.clone().limits(limits).warm(&start).run(problem)?;
        found.starts += 1;
        if !answer.is_solved() {
            if let Status::Limit(limit @ (Limit::Time | Limit::Cancelled)) = answer.status {
                found.limit = Some(limit);
                break;
            }
            continue;
        }
        let same = |(other, _): &&mut (Answer<Mcp>, usize)| is_same(&other.point, &answer.point);
        match found.solutions.iter_mut().find(same) {
            Some((_, times)) => *times += 1,
            None => found.solutions.push((answer, 1)),
        }
    }
    Ok(found)
}

fn is_same(a: &LcpPoint, b: &LcpPoint) -> bool {
    let near = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME * (1.0 + a.abs().max(b.abs()));
    a.z.iter().zip(&b.z).all(near)
}

/// A random point of the box.
fn around(problem: &Mcp, spread: f64, random: &mut Pcg64Mcg) -> LcpPoint {
    let origin = problem.origin();
    let at = |(i, x): (usize, &f64)| {
        let (l, u) = (problem.lower[i], problem.upper[i]);
        let share: f64 = random.random_range(0.0..1.0);
        if (u - l).is_finite() {
            l + share * (u - l)
        } else {
            let size = spread * x.abs().max(1.0);
            problem.project(i, x + (2.0 * share - 1.0) * size)
        }
    };
    LcpPoint { z: origin.z.iter().enumerate().map(at).collect() }
}
