//! What is said of problems, and what is advised.

use nonsmooth_linalg::{Csc, Dense};
use nonsmooth_problem::planted::{Planted, PlantedClass, PlantedLcp};
use nonsmooth_problem::{AnyProblem, Complementarity, Friction, Lcp};
use nonsmooth_solve::Limits;
use nonsmooth_solve::diagnose::{Diagnosis, Effort, Finding, diagnose};

fn of(problem: impl Into<AnyProblem>) -> Diagnosis {
    let effort = Effort { spectrum_limit: 500, limits: Limits::default() };
    diagnose(&problem.into(), None, &effort).unwrap()
}

fn says<'a>(diagnosis: &'a Diagnosis, about: &str) -> Option<&'a Finding> {
    diagnosis.findings.iter().find(|f| f.about == about)
}

#[test]
fn a_regular_problem_is_sound_and_a_hyperstatic_one_hard() {
    let regular = Planted { contacts: 8, dofs: 48, ..Planted::default() };
    let d = of(Friction::Local3(regular.local().0));
    assert!(!says(&d, "rank").unwrap().hard, "{d:?}");
    assert!(says(&d, "existence").unwrap().says.starts_with("proved"), "{d:?}");
    assert!(!d.suits.is_empty());
    let hyperstatic = Planted { contacts: 20, dofs: 30, ..Planted::default() };
    let d = of(Friction::Global3(hyperstatic.global().0));
    let finding = says(&d, "rank").unwrap();
    assert!(finding.hard && finding.says.contains("rank 30 of 60"), "{finding:?}");
    assert!(finding.says.contains("c = 2.00"), "{finding:?}");
}

#[test]
fn a_class_that_is_proved_stands_above_a_rank_that_is_rounded() {
    let matrix = |a: f64| Dense::from_rows(&[[1.0, 1.0], [1.0, a]]).unwrap();
    let means = |a: f64| {
        let d = of(Complementarity::Lcp(Lcp::new(matrix(a), vec![-1.0; 2]).unwrap()));
        let rank = says(&d, "rank").unwrap();
        assert!(rank.hard && rank.says.contains("rank 1 of 2"), "{rank:?}");
        (says(&d, "class").unwrap().means.clone(), rank.means.clone())
    };
    let (class, rank) = means(1.0 + f64::EPSILON);
    assert_eq!(class, "Every q has exactly one solution.");
    assert!(rank.contains("nonsingular") && !rank.contains("many"), "{rank}");
    // Entries above zero: strictly copositive, and singular.
    let (class, rank) = means(1.0);
    assert!(class.starts_with("Every q has a solution") && !rank.contains("none"), "{rank}");
}

#[test]
fn what_is_planted_is_found() {
    let case = Planted { contacts: 6, dofs: 36, mu: (0.0, 0.0), skew: 0.3, ..Planted::default() };
    let (mut p, _) = case.global::<3>();
    let d = of(Friction::Global3(p.clone()));
    assert!(says(&d, "asymmetry").unwrap().hard && says(&d, "duplicates").is_none());
    assert!(says(&d, "friction").unwrap().means.contains("convex"));
    // The second contact becomes a copy of the first, and is on a much lighter place.
    let h = p.H.triplets().filter(|e| !(3..6).contains(&e.1)).collect::<Vec<_>>();
    let copies = h.iter().filter(|e| e.1 < 3).map(|&(i, j, x)| (i, j + 3, 1e3 * x));
    p.H = Csc::from_triplets(36, 18, h.iter().copied().chain(copies)).unwrap();
    p.mu[2] = 1.5;
    let d = of(Friction::Global3(p));
    assert!(says(&d, "duplicates").unwrap().says.starts_with("2 contacts"), "{d:?}");
    assert!(says(&d, "mass ratio").unwrap().hard && says(&d, "friction").unwrap().hard);
}

#[test]
fn redundant_constraints_are_counted() {
    let (mut p, _) = Planted { bilateral: 3, ..Planted::default() }.global::<2>();
    let b = p.rows.as_mut().unwrap();
    let twice = b.G.triplets().flat_map(|(i, j, x)| [(i, j, x), (i, j + 3, -2.0 * x)]);
    b.G = Csc::from_triplets(b.G.nrows(), 6, twice).unwrap();
    let more: Vec<f64> = b.b.iter().map(|b| -2.0 * b).collect();
    b.b.extend(more);
    let d = of(Friction::Global2(p));
    assert!(says(&d, "bilateral").unwrap().says.contains("6 bilateral rows of rank 3"), "{d:?}");
}

/// Of complementarity problems the class of M speaks, and what it promises holds on trial.
#[test]
fn the_class_of_a_matrix_says_what_to_try() {
    for (class, word) in [(PlantedClass::P, "P"), (PlantedClass::Spd, "positive definite")] {
        let d = of(PlantedLcp { n: 12, class, ..PlantedLcp::default() }.lcp().0);
        let finding = says(&d, "class").unwrap();
        assert!(!finding.hard && finding.says.contains(word), "{finding:?}");
        assert!(says(&d, "existence").unwrap().says.starts_with("proved: M is"), "{d:?}");
        // The default and three others at most, all of which solved it.
        assert!(d.suits.contains(&"auto") && (2..=4).contains(&d.suits.len()), "{:?}", d.suits);
        let solved = |s: &&str| d.trials.iter().any(|t| t.solver == *s && t.status == "solved");
        assert!(d.suits.iter().all(solved), "{d:?}");
    }
    let none = Lcp::new(Dense::from_rows(&[[-1.0]]).unwrap(), vec![-1.0]).unwrap();
    let d = of(none);
    assert!(says(&d, "existence").unwrap().says.starts_with("none, proved"), "{d:?}");
    assert!(d.suits.is_empty() && d.trials.is_empty());
    let case = PlantedLcp { n: 8, class: PlantedClass::Psd, decades: 9.0, ..PlantedLcp::default() };
    let d = of(case.boxed().0);
    assert!(says(&d, "scale").unwrap().hard && says(&d, "rank").unwrap().hard, "{d:?}");
}
