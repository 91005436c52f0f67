//! The table of guarantees: what it says of known matrices, that its names and citations are real, and that it promises nothing of unknown matrices.

use nonsmooth_analysis::{Class, Classes};
use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::planted::{PlantedClass, PlantedLcp};
use nonsmooth_solve::guarantees::{guaranteed, likely};

fn classes(m: &Matrix) -> Classes {
    Classes::of(m, Default::default())
}

fn names(c: &Classes) -> Vec<&'static str> {
    guaranteed(c).iter().map(|g| g.solver).collect()
}

fn planted(class: PlantedClass) -> Classes {
    classes(&PlantedLcp { n: 12, class, seed: 1, ..PlantedLcp::default() }.lcp().0.M)
}

#[test]
fn classes_give_their_solvers() {
    let has = |class: PlantedClass, all: &[&str], none: &[&str]| {
        let found = names(&planted(class));
        for name in all {
            assert!(found.contains(name), "{class:?}: no {name} in {found:?}");
        }
        for name in none {
            assert!(!found.contains(name), "{class:?}: {name} in {found:?}");
        }
    };
    has(
        PlantedClass::Spd,
        &["psor", "pgs", "splitting_ls", "murty", "lemke", "qp", "ip_mty"],
        &["bard"],
    );
    has(
        PlantedClass::MMatrix,
        &["pgs", "projected_jacobi", "murty", "bard", "newton_min"],
        &["qp"],
    );
    has(PlantedClass::HPlus, &["pgs", "psor", "projected_jacobi", "lemke", "newton_fb"], &["bard"]);
    has(PlantedClass::P, &["murty", "lemke", "keller", "block_pivoting"], &["pgs", "qp"]);
    has(PlantedClass::Lcprand, &["ip_mehrotra", "keller", "criss_cross"], &["splitting_ls"]);
    has(PlantedClass::Bimatrix, &["enumeration"], &["lemke", "murty", "pgs", "ip_mty"]);
    assert!(planted(PlantedClass::Contact).is_not(Class::CopositivePlus));
}

#[test]
fn up_to_rounding_is_likely_and_not_guaranteed() {
    let c = planted(PlantedClass::Psd);
    let solvers = |all: Vec<nonsmooth_solve::guarantees::Guarantee>| {
        all.into_iter().map(|g| g.solver).collect::<Vec<_>>()
    };
    assert!(!solvers(guaranteed(&c)).contains(&"rpsor"));
    for name in ["rpsor", "qp", "keller", "ip_mehrotra", "lemke"] {
        assert!(solvers(likely(&c)).contains(&name), "{name}");
    }
}

#[test]
fn each_solver_once_with_its_strongest_reason() {
    let found = guaranteed(&planted(PlantedClass::Spd));
    let mut seen: Vec<_> = found.iter().map(|g| g.solver).collect();
    seen.sort_unstable();
    let all = seen.len();
    seen.dedup();
    assert_eq!(seen.len(), all);
    let psor = found.iter().find(|g| g.solver == "psor").unwrap();
    assert_eq!(psor.when, None);
    assert!(psor.to_string().starts_with("psor: M is positive definite; "), "{psor}");
    let h = guaranteed(&planted(PlantedClass::HPlus));
    let psor = h.iter().find(|g| g.solver == "psor").unwrap();
    assert_eq!(psor.when, Some("with omega at most 1"));
}

#[test]
fn nothing_is_promised_of_what_is_not_known() {
    let large = Dense::from_fn(40, 40, |i, j| ((i * 7 + j * 13) as f64).sin());
    assert_eq!(guaranteed(&classes(&large.into())), []);
    let flat = Matrix::from(Dense::zeros(2, 3));
    assert!(names(&classes(&flat)).len() <= 1);
}

#[test]
fn citations_are_in_the_bibliography() {
    let bibliography = include_str!("../../../../docs/refs.bib");
    for class in PlantedClass::ALL {
        for guarantee in likely(&planted(class)) {
            assert!(!guarantee.cites.is_empty());
            for key in guarantee.cites {
                assert!(bibliography.contains(&format!("{{{key},")), "{key}");
            }
        }
    }
}
