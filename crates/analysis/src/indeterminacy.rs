//! Whether the impulses of a solution are the only ones: static indeterminacy.

use serde::Serialize;

use nonsmooth_linalg::{Csc, norm};
use nonsmooth_problem::check::{ContactStatus, Law, Motion};
use nonsmooth_problem::{Bounds, Friction, FrictionGlobal, FrictionLocal};

use crate::spectrum::{DENSE, rank_of_units};

/// Singular values below this share of the largest, and below so many relative residuals, are those of the rounding and the inaccuracy of r.
const ACCURACY: f64 = 1e-10;
const INACCURACY: f64 = 10.0;

/// How many of the directions in which the impulses of a solution may change the motion feels.
///
/// At a solution an impulse may grow and shrink along these directions A without leaving its law: a contact that sticks inside its cone, in all D; one that
/// slips, or sticks at the limit of friction, along `r_c` itself (likewise the moment of rolling friction); a scalar row between its bounds, in one. What `[H, G] A` maps to zero changes no velocity, so
/// that with `rank < of` the problem has other solutions with the same motion; `of − rank` is the degree of static indeterminacy. With W in place of H the same
/// holds of `[W, V; Vᵀ, R] A`.
///
/// The directions r_c are as accurate as the point, so that singular values count where they are above 1e-10, and above `10 ρ`, times the largest, ρ the relative residual.
///
/// Of matrices of more than 10⁵ entries the rank is not computed; it is then at most the number of degrees of freedom that the directions touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Indeterminacy {
    /// The directions that the motion feels; at most so many where `counted`.
    pub rank: usize,
    /// The directions in which impulses may change.
    pub of: usize,
    /// Whether the rank is an upper bound by counting, in place of one of singular values, which holds up to rounding.
    pub counted: bool,
    /// Whether a contact is at the border of two statuses, or a row at a bound: its impulse may change one way only, along directions that are not among these.
    pub one_sided: bool,
}

impl Indeterminacy {
    /// That of a solution with impulses r (D nc), λ (p), these statuses (nc) and this relative residual. `dofs`: the degrees of freedom that a local problem was condensed from, where
    /// they are known. `None` where no impulse acts, or nothing is known.
    ///
    /// Cost: O(nnz), and the singular values of a matrix of at most 10⁵ entries.
    pub fn of(
        problem: &Friction,
        (r, lambda): (&[f64], &[f64]),
        statuses: &[ContactStatus],
        dofs: Option<usize>,
        residual: f64,
    ) -> Option<Self> {
        let relative = ACCURACY.max(INACCURACY * residual);
        match problem {
            Friction::Local2(p) => local(p, (r, lambda), statuses, dofs, relative),
            Friction::Local3(p) => local(p, (r, lambda), statuses, dofs, relative),
            Friction::RollingLocal(p) => local(p, (r, lambda), statuses, dofs, relative),
            Friction::Global2(p) => global(p, (r, lambda), statuses, relative),
            Friction::Global3(p) => global(p, (r, lambda), statuses, relative),
            Friction::RollingGlobal(p) => global(p, (r, lambda), statuses, relative),
        }
    }

    /// Whether the motion determines the impulses; a rank by counting does not say so, and where impulses may change one way only no rank does.
    pub fn is_unique(&self) -> Option<bool> {
        match (self.rank < self.of, self.counted || self.one_sided) {
            (true, _) => Some(false),
            (false, false) => Some(true),
            (false, true) => None,
        }
    }
}

fn global<const D: usize, L: Law<D>>(
    p: &FrictionGlobal<D, L>,
    (r, lambda): (&[f64], &[f64]),
    statuses: &[ContactStatus],
    relative: f64,
) -> Option<Indeterminacy> {
    let directions = directions(r, statuses, |c| p.law(c));
    let columns = directions.iter().map(|direction| direction.of(&p.H).collect());
    let rows = p.rows.iter().flat_map(|rows| {
        between(&rows.bounds, lambda).map(|j| entries(rows.G.column(j), 0).collect())
    });
    let all: Vec<Vec<_>> = columns.chain(rows).collect();
    let bounds = p.rows.as_ref().map(|rows| &rows.bounds);
    counted(&all, None, relative, is_one_sided(statuses, bounds, lambda))
}

fn local<const D: usize, L: Law<D>>(
    p: &FrictionLocal<D, L>,
    (r, lambda): (&[f64], &[f64]),
    statuses: &[ContactStatus],
    dofs: Option<usize>,
    relative: f64,
) -> Option<Indeterminacy> {
    let (w, m) = (p.W.to_csc(), p.q.len());
    let directions = directions(r, statuses, |c| p.law(c));
    let across = p.rows.as_ref().map(|rows| rows.V.transpose());
    let columns = directions.iter().map(|direction| {
        let below = across.iter().flat_map(|v| direction.of(v));
        direction.of(&w).chain(below.map(|(i, x)| (m + i, x))).collect()
    });
    let rows = p.rows.iter().flat_map(|rows| {
        between(&rows.bounds, lambda)
            .map(|j| entries(rows.V.column(j), 0).chain(entries(rows.R.column(j), m)).collect())
    });
    let all: Vec<Vec<_>> = columns.chain(rows).collect();
    let bounds = p.rows.as_ref().map(|rows| &rows.bounds);
    counted(&all, dofs, relative, is_one_sided(statuses, bounds, lambda))
}

/// From the columns by their entries; the rank is at most `most`.
fn counted(
    columns: &[Vec<(usize, f64)>],
    most: Option<usize>,
    relative: f64,
    one_sided: bool,
) -> Option<Indeterminacy> {
    let of = columns.len();
    if of == 0 {
        return None;
    }
    let mut touched: Vec<_> =
        columns.iter().flatten().filter(|e| e.1 != 0.0).map(|e| e.0).collect();
    touched.sort_unstable();
    touched.dedup();
    // Rows without an entry do not enlarge the dense matrix.
    let place = |i: usize| touched.binary_search(&i).ok();
    let triplets = columns
        .iter()
        .enumerate()
        .flat_map(|(j, column)| column.iter().filter_map(move |&(i, x)| Some((place(i)?, j, x))));
    let a = Csc::from_triplets(touched.len(), of, triplets.collect::<Vec<_>>().into_iter()).ok()?;
    let bound = most.map_or(touched.len(), |n| n.min(touched.len()));
    match rank_of_units(&a, DENSE, relative) {
        Some(rank) => Some(Indeterminacy { rank, of, counted: false, one_sided }),
        None => (bound < of).then_some(Indeterminacy { rank: bound, of, counted: true, one_sided }),
    }
}

/// A direction in the impulse of one contact.
struct Direction<const D: usize> {
    contact: usize,
    along: [f64; D],
}

impl<const D: usize> Direction<D> {
    /// The entries of `A d`, to be added up.
    fn of<'a>(&'a self, a: &'a Csc) -> impl Iterator<Item = (usize, f64)> + 'a {
        let each = self.along.iter().enumerate().filter(|(_, x)| **x != 0.0);
        each.flat_map(|(k, &x)| {
            entries(a.column(D * self.contact + k), 0).map(move |(i, a)| (i, a * x))
        })
    }
}

fn entries<'a>(
    (rows, values): (&'a [usize], &'a [f64]),
    after: usize,
) -> impl Iterator<Item = (usize, f64)> + 'a {
    rows.iter().zip(values).map(move |(&i, &x)| (after + i, x))
}

/// The directions in which the impulses of contacts may change.
fn directions<L: Law<D>, const D: usize>(
    r: &[f64],
    statuses: &[ContactStatus],
    law: impl Fn(usize) -> L,
) -> Vec<Direction<D>> {
    let rows = (D - 1) / L::DISKS;
    let mut all = vec![];
    for (contact, (status, r)) in statuses.iter().zip(r.chunks_exact(D)).enumerate() {
        // Within a disk the impulse may go anywhere; on its boundary it grows with the pressure.
        let law = law(contact);
        let sticks = status.status == Motion::Stick && !status.at_limit;
        let inside = [sticks, !status.rolls && !status.at_rolling_limit];
        let is_free = |k: usize| {
            let disk = k.checked_sub(1).map(|k| k / rows);
            disk.is_some_and(|disk| inside[disk] && law.coefficient(disk) > 0.0)
        };
        let mut along: [f64; D] = std::array::from_fn(|k| if is_free(k) { 0.0 } else { r[k] });
        let size = norm(&along);
        if status.status == Motion::Open || size <= 0.0 {
            continue;
        }
        along.iter_mut().for_each(|x| *x /= size);
        all.push(Direction { contact, along });
        let axis = |k| std::array::from_fn(|l| f64::from(u8::from(k == l)));
        all.extend((0..D).filter(|&k| is_free(k)).map(|k| Direction { contact, along: axis(k) }));
    }
    all
}

/// Whether a contact may have another status as well, or the impulse of a row is at a bound.
fn is_one_sided(statuses: &[ContactStatus], bounds: Option<&Bounds>, lambda: &[f64]) -> bool {
    let at_bound = bounds.is_some_and(|bounds| between(bounds, lambda).count() < lambda.len());
    at_bound || statuses.iter().any(|status| status.degenerate)
}

/// The rows whose impulses are strictly between their bounds.
fn between<'a>(bounds: &'a Bounds, lambda: &'a [f64]) -> impl Iterator<Item = usize> + 'a {
    let inside = |&j: &usize| {
        let [l, u] = bounds.of(j);
        l < lambda[j] && lambda[j] < u
    };
    (0..lambda.len()).filter(inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_problem::GlobalPoint;
    use nonsmooth_problem::check::Judged;
    use nonsmooth_problem::planted::{Planted, PlantedMix};

    /// A body of one degree of freedom on two supports below it, in the plane: the weight may be on either.
    fn beam(supports: usize, mu: f64) -> (FrictionGlobal<2>, Vec<f64>) {
        let h = (0..supports).flat_map(|c| [(0, 2 * c, 1.0), (1, 2 * c + 1, 1.0)]);
        let h = Csc::from_triplets(2, 2 * supports, h).unwrap();
        let problem = FrictionGlobal::new(
            Csc::diagonal(&[1.0, 1.0]),
            h,
            vec![-1.0, 0.0],
            vec![0.0; 2 * supports],
            vec![mu; supports],
        );
        let r = (0..supports).flat_map(|_| [1.0 / supports as f64, 0.0]).collect();
        (problem.unwrap(), r)
    }

    fn found<const D: usize>(p: &FrictionGlobal<D>, r: &[f64]) -> Option<Indeterminacy> {
        let mut v = p.f.clone();
        p.H.mul_add(1.0, r, &mut v);
        let point = GlobalPoint { v, r: r.to_vec(), lambda: vec![] };
        let verdict = p.judge(&point, 1e-10).unwrap();
        assert!(verdict.solved, "{:?}", verdict.measure);
        global(p, (r, &[]), &verdict.statuses, ACCURACY)
    }

    #[test]
    fn a_weight_on_two_supports_may_be_on_either() {
        let found_with =
            |rank, of, one_sided| Some(Indeterminacy { rank, of, counted: false, one_sided });
        let some = |rank, of| found_with(rank, of, false);
        let (one, r) = beam(1, 0.5);
        assert_eq!(found(&one, &r), some(2, 2));
        let (two, r) = beam(2, 0.5);
        let indeterminate = found(&two, &r).unwrap();
        assert_eq!(Some(indeterminate), some(2, 4));
        assert_eq!(indeterminate.is_unique(), Some(false));
        // Another solution with the same motion, and one at the limits of friction, which one line each is left of.
        assert_eq!(found(&two, &[0.7, 0.1, 0.3, -0.1]), some(2, 4));
        let at_limits = found(&two, &[0.5, 0.25, 0.5, -0.25]);
        assert_eq!(at_limits, found_with(2, 2, true));
        // All of it on one support: the other one is open, and may take some.
        let on_one = found(&two, &[1.0, 0.0, 0.0, 0.0]);
        assert_eq!(on_one, found_with(2, 2, true));
        assert_eq!([at_limits, on_one].map(|i| i.unwrap().is_unique()), [None, None]);
        assert_eq!(found(&one, &[1.0, 0.0]).unwrap().is_unique(), Some(true));
        let (smooth, r) = beam(3, 0.0);
        assert_eq!(found(&smooth, &r), some(1, 3));
        let (empty, _) = beam(2, 0.5);
        let still = FrictionGlobal { f: vec![1.0, 0.0], ..empty };
        assert_eq!(found(&still, &[0.0; 4]), None);
    }

    /// A body in the plane that slides along on four supports, which fix its normal impulse and its moment: the directions of friction are those of the solver's last bits.
    #[test]
    fn what_slides_one_way_is_counted_once_whatever_the_rounding() {
        let supports = [-1.0, -0.4, 0.3, 1.0];
        let mut h = vec![];
        for (c, &x) in supports.iter().enumerate() {
            h.extend([(0, 2 * c, 1.0), (1, 2 * c + 1, 1.0), (2, 2 * c, x), (2, 2 * c + 1, 0.5)]);
        }
        let h = Csc::from_triplets(3, 8, h.into_iter()).unwrap();
        let p = FrictionGlobal::<2>::new(
            Csc::diagonal(&[1.0; 3]),
            h,
            vec![-1.0, 10.0, 0.125],
            vec![0.0; 8],
            vec![0.2; 4],
        )
        .unwrap();
        let r: Vec<f64> = (0..4)
            .flat_map(|c| {
                let noise = 1.0 + 1e-13 * [1.0, -2.0, 0.5, 3.0][c];
                [0.25, -0.2 * 0.25 * noise]
            })
            .collect();
        let found = found(&p, &r).unwrap();
        assert_eq!((found.rank, found.of, found.is_unique()), (2, 4, Some(false)));
    }

    /// In the local form the degrees of freedom are gone, and the rank is the same.
    #[test]
    fn both_forms_agree_scalar_rows_included() {
        for (contacts, dofs, bilateral) in [(4, 60, 0), (12, 24, 0), (12, 30, 5), (3, 60, 8)] {
            let mix = PlantedMix { open: 1.0, stick: 3.0, slip: 2.0, degenerate: 0.0 };
            let case = Planted { contacts, dofs, bilateral, mix, ..Planted::default() };
            let (p, point) = case.global::<3>();
            let statuses = p.judge(&point, 1e-8).unwrap().statuses;
            let of_global = global(&p, (&point.r, &point.lambda), &statuses, ACCURACY).unwrap();
            let (q, point) = case.local::<3>();
            let of_local = local(&q, (&point.r, &point.lambda), &statuses, None, ACCURACY).unwrap();
            assert_eq!(of_global, of_local);
            let (stick, slip) = (Motion::Stick, Motion::Slip);
            let count = |m: Motion| statuses.iter().filter(|s| s.status == m).count();
            assert_eq!(of_global.of, 3 * count(stick) + count(slip) + bilateral);
            assert_eq!(of_global.rank, of_global.of.min(dofs));
        }
    }

    #[test]
    fn what_is_too_large_for_singular_values_is_counted() {
        let mix = PlantedMix { open: 0.0, stick: 1.0, slip: 0.0, degenerate: 0.0 };
        let case = Planted { contacts: 200, dofs: 240, mix, ..Planted::default() };
        let (p, point) = case.global::<3>();
        let statuses = p.judge(&point, 1e-8).unwrap().statuses;
        let counted = Indeterminacy { rank: 240, of: 600, counted: true, one_sided: false };
        assert_eq!(global(&p, (&point.r, &[]), &statuses, ACCURACY), Some(counted));
        let (q, point) = case.local::<3>();
        assert_eq!(local(&q, (&point.r, &[]), &statuses, Some(240), ACCURACY), Some(counted));
        assert_eq!(local(&q, (&point.r, &[]), &statuses, None, ACCURACY), None);
    }
}
