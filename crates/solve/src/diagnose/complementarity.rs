//! Of a linear complementarity problem.

use nonsmooth_analysis::{Class, Classes, rank};
use nonsmooth_linalg::Matrix;
use nonsmooth_problem::check::Existence;
use nonsmooth_problem::{Complementarity, Problem, Stated, with_complementarity};

use super::{Finding, easy, hard, one_of_each};
use crate::complementarity::guarantees::guaranteed;
use crate::core::register::Registered;
use crate::{Limits, existence};

/// What there is to say; matrices of up to so many rows have their rank counted.
pub(super) fn findings(
    problem: &Complementarity,
    rows: usize,
    most: impl Fn() -> Limits,
) -> (Vec<Finding>, Existence) {
    let matrices = matrices(problem);
    let mut findings = vec![size(problem)];
    // The classes speak of one square matrix and variables with bounds.
    let classes = with_complementarity!(problem, p => p.classified()).map(existence::classes);
    if let Some(classes) = &classes {
        findings.push(class(classes, matches!(problem, Complementarity::Lcp(_))));
    }
    for (name, m) in &matrices {
        findings.extend(deficiency(name, m, rows, classes.as_ref()));
    }
    findings.extend(scale(&matrices));
    let existence = existence::classified(problem, classes, &most());
    findings.push(of_existence(&existence));
    (findings, existence)
}

fn matrices(problem: &Complementarity) -> Vec<(&'static str, &Matrix)> {
    with_complementarity!(problem, p => p.matrices())
}

/// The default and the first solver of each family.
fn all_families<P: Registered>(_: &P) -> Vec<&'static str> {
    one_of_each::<P>(None)
}

/// Up to so many unknowns a dense factorisation is nothing; up to so many it is a second.
const SMALL: usize = 200;
const MIDDLE: usize = 3000;

fn size(problem: &Complementarity) -> Finding {
    let (kind, n) = with_complementarity!(problem, p => (p.kind().name(), p.unknowns()));
    let dense = matrices(problem).iter().any(|(_, m)| matches!(m, Matrix::Dense(_)));
    let stored = if dense { "dense" } else { "sparse" };
    let says = format!("{kind} of {n} unknowns, {stored}");
    let means = match () {
        _ if n <= SMALL => "Small: every solver's step is cheap.",
        _ if !dense => {
            "Sparse: sweeps and sparse factorisations are cheap; pivoting keeps a factorised basis."
        }
        _ if n <= MIDDLE => "Of middle size: dense factorisations take milliseconds to a second.",
        _ => "Large and dense: each factorisation takes seconds or more.",
    };
    let suits = with_complementarity!(problem, p => all_families(p));
    Finding { suits, ..easy("size", says, means) }
}

/// The classes that a diagnosis names besides the one that promises most; `nonsmooth info` names all.
const TELLING: [Class; 4] = [Class::Symmetric, Class::PositiveDefinite, Class::K, Class::HPlus];

/// The classes that promise something, the strongest first, and what they promise of an LCP.
const PROMISES: [(Class, &str); 7] = [
    (Class::P, "Every q has exactly one solution."),
    (
        Class::StrictlyCopositive,
        "Every q has a solution, perhaps several; Lemke's method cannot end in a ray.",
    ),
    (
        Class::PositiveSemidefinite,
        "Monotone: the solutions form a convex set; interior points, Lemke's and Keller's method decide it.",
    ),
    (
        Class::Sufficient,
        "The solutions form a convex set; criss-cross and Lemke's method decide it.",
    ),
    (
        Class::CopositivePlus,
        "Lemke's method decides it: a solution, or a ray that proves that there is none.",
    ),
    (Class::Copositive, "Solutions may be many; a ray of Lemke's method proves nothing."),
    (Class::P0, "Solutions may be many; few methods are guaranteed to work."),
];

fn class(classes: &Classes, is_lcp: bool) -> Finding {
    let promised = PROMISES.iter().find(|(class, _)| classes.is(*class));
    let telling = TELLING.into_iter().filter(|&class| classes.is(class));
    let is: Vec<_> = telling.chain(promised.map(|p| p.0)).map(|class| class.to_string()).collect();
    let says = match &is[..] {
        [] => "M is in none of the known classes, as far as could be told".into(),
        all => format!("M is {}", all.join(", ")),
    };
    let mut suits: Vec<&'static str> = vec![];
    if is_lcp {
        for guarantee in guaranteed(classes) {
            if !suits.contains(&guarantee.solver) {
                suits.push(guarantee.solver);
            }
        }
    }
    match promised {
        Some((_, means)) => Finding { suits, ..easy("class", says, means) },
        None => hard(
            "class",
            says,
            "No theorem says that there is a solution, one or several, nor which method finds one; few pairs can be enumerated.",
            suits,
        ),
    }
}

/// What a rank below the full one means, beside what is proved of M as it is stored: rounding decides the rank, not the class.
fn singular(classes: Option<&Classes>) -> &'static str {
    let proved = |class| classes.is_some_and(|classes| classes.is(class));
    if proved(Class::P) {
        "As a P-matrix M is nonsingular, by less than rounding: a block that a method inverts may be singular to it."
    } else if proved(Class::StrictlyCopositive) {
        "Singular: solutions may be many; a block that a method inverts may be singular."
    } else {
        "Singular: solutions may be many or none; a block that a method inverts may be singular."
    }
}

fn deficiency(name: &str, m: &Matrix, rows: usize, classes: Option<&Classes>) -> Option<Finding> {
    let a = m.to_csc()?;
    let rank = rank(&a, rows.saturating_mul(rows))?;
    let least = m.nrows().min(m.ncols());
    let says = format!("{name} has rank {rank} of {least}, up to rounding");
    Some(match rank < least {
        true => hard("rank", says, singular(classes), vec![]),
        false => easy("rank", says, ""),
    })
}

/// Above this ratio of the sizes of rows, differences between them are a difficulty of their own.
const SPREAD: f64 = 1e6;

fn scale(matrices: &[(&'static str, &Matrix)]) -> Option<Finding> {
    let mut largest = vec![0.0_f64; matrices.first()?.1.nrows()];
    for (_, m) in matrices {
        m.for_each(|i, _, x| largest[i] = largest[i].max(x.abs()));
    }
    let sizes = || largest.iter().copied().filter(|x| *x > 0.0);
    let (least, most) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    let zero = largest.len() - sizes().count();
    if zero > 0 {
        let says = format!("{zero} rows without an entry");
        return Some(hard("scale", says, "Their law holds by q alone or not at all.", vec![]));
    }
    let says = format!("rows of size {least:.1e} to {most:.1e}");
    Some(match most > SPREAD * least {
        true => hard(
            "scale",
            says,
            "Widely spread: the judge's error is componentwise, so small rows count as much as large ones, but methods that know one step size for all get slow.",
            vec![],
        ),
        false => easy("scale", says, ""),
    })
}

fn of_existence(existence: &Existence) -> Finding {
    let says = existence.to_string();
    match existence {
        Existence::NoSolution { .. } => hard(
            "existence",
            says,
            "No solver can succeed: look at the signs of M and q, or at the units of a row.",
            vec![],
        ),
        Existence::NearlyNoSolution { .. } => {
            hard("existence", says, "Most likely no solver can succeed.", vec![])
        }
        found if found.is_proved() => {
            easy("existence", says, "A solver that fails has failed; the problem is sound.")
        }
        _ => easy("existence", says, ""),
    }
}
