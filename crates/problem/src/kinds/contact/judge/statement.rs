//! Contacts as parts of a [`ConeSystem`].

use crate::check::proof::{FEW_SPATIAL, Spatial, exact, just};
use crate::check::{Column, ConeSystem, Exact, Law};
use nonsmooth_linalg::Csc;

/// The rows of friction of the [`ConeSystem`] of these contacts, which come after all others: contact c and component k of each `σ⁺ + σ⁻ = 2 mu r_N`.
pub fn friction_rows<L: Law<D>, const D: usize>(laws: impl Iterator<Item = L>) -> Vec<[usize; 2]> {
    let rows_of_disk = (D - 1) / L::DISKS;
    let of = |(c, law): (usize, L)| {
        let has_one = move |k: &usize| law.coefficient((k - 1) / rows_of_disk) != 0.0;
        (1..D).filter(has_one).map(move |k| [c, k])
    };
    laws.enumerate().flat_map(of).collect()
}

/// The impulses and velocities of contacts: columns of r as given, in the rows that begin with `first` the velocities u.
///
/// The law in the plane: `0 ≤ u_N ⟂ r_N ≥ 0`, `u_T = a − b`, `0 ≤ a ⟂ mu r_N + r_T ≥ 0`, `0 ≤ b ⟂ mu r_N − r_T ≥ 0`: r_T < mu r_N where it moves
/// is excluded, and the pairs of a resting contact may have a = b. In space with friction only `0 ≤ u_N ⟂ r_N ≥ 0`, `|r_Tk| ≤ mu r_N` is said, of rolling `|r_Rk| ≤ mu_r r_N`; of few
/// contacts with Coulomb's friction the law is kept beside it ([`Spatial`]).
pub(crate) fn contacts<L: Law<D>, const D: usize>(
    system: &mut ConeSystem,
    first: usize,
    mut impulses: Vec<Column>,
    laws: &[L],
) -> Vec<(Exact, Vec<(usize, Exact)>)> {
    let mut unknowns = vec![];
    let rows_of_disk = (D - 1) / L::DISKS;
    let spatial = D == 3 && L::DISKS == 1;
    for (c, law) in laws.iter().enumerate() {
        let row = |k: usize| first + D * c + k;
        let mu = law.coefficient(0);
        let components = if mu == 0.0 { 1 } else { D };
        let own = &impulses[D * c..D * c + components];
        // Of what nobody asks nothing has to be kept.
        let asked = (0..D).any(|k| system.wants(row(k))) || own.iter().any(|r| !r.is_empty());
        let keeps = spatial && asked && system.spatial.len() <= FEW_SPATIAL;
        let kept = keeps.then(|| own.to_vec());
        let before = system.columns.len();
        let mut normal = std::mem::take(&mut impulses[D * c]);
        let mut tangential = vec![];
        for k in 1..D {
            let mu = law.coefficient((k - 1) / rows_of_disk);
            let coefficient = exact(mu);
            if mu == 0.0 {
                let u = system.unit(row(k), 1);
                system.free.push(u);
                tangential.push((coefficient, (Exact::ZERO, vec![])));
                continue;
            }
            // With σ± = mu r_N ± r_T ≥ 0: r_T = σ⁺ − mu r_N, and σ⁺ + σ⁻ = 2 mu r_N in a row of its own.
            let along = std::mem::take(&mut impulses[D * c + k]);
            normal.extend(along.iter().map(|(i, x)| (*i, -(&coefficient * x))));
            let bound = system.row(Exact::ZERO);
            normal.push((bound, Exact::from(2u8) * &coefficient));
            let plus = system.column([along, vec![(bound, -Exact::ONE)]].concat());
            let minus = system.unit(bound, -1);
            system.slack_rows.push((bound, [plus, minus]));
            if D == 2 {
                let (a, b) = (system.unit(row(k), 1), system.unit(row(k), -1));
                system.pairs.extend([[a, plus], [b, minus]]);
            } else {
                let u = system.unit(row(k), 1);
                system.free.push(u);
                system.rays.extend([plus, minus]);
                system.complete = false;
            }
            tangential.push((coefficient, (Exact::ZERO, vec![(plus, Exact::ONE)])));
        }
        let pair = [system.unit(row(0), 1), system.column(normal)];
        system.pairs.push(pair);
        if let Some(impulses) = kept {
            let own = (before..system.columns.len()).collect();
            system.spatial.push(Spatial { row: row(0), mu, impulses, own });
        }
        unknowns.push(just(pair[1]));
        for (coefficient, mut t) in tangential {
            if !t.1.is_empty() {
                t.1.push((pair[1], -&coefficient));
            }
            unknowns.push(t);
        }
    }
    if system.spatial.len() > FEW_SPATIAL {
        system.spatial.clear();
    }
    unknowns
}

/// The columns of A times −1, its rows moved down by `row`.
pub(crate) fn opposite(a: &Csc, row: usize, system: &ConeSystem) -> Vec<Column> {
    let mut out = vec![Column::new(); a.ncols()];
    for (i, j, x) in a.triplets() {
        if system.wants(row + i) {
            out[j].push((row + i, exact(-x)));
        }
    }
    out
}

/// Adds the columns of the second to those of the first.
pub(crate) fn under(first: Vec<Column>, second: Vec<Column>) -> Vec<Column> {
    first.into_iter().zip(second).map(|(a, b)| [a, b].concat()).collect()
}
