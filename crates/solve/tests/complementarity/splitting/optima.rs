//! Published optima of CUTEst and MCPLIB, and a file of Siconos.

use nonsmooth_linalg::Matrix;
use nonsmooth_problem::planted::{JournalBearing, Membrane, Torsion, energy};
use nonsmooth_problem::{Lcp, LcpPoint, Problem};
use nonsmooth_solve::registry::Registered;

use super::{distance, solved};
use crate::common::{corpus, siconos_lcp};

/// Solves with three methods that share nothing but rows; the energy must be the published one to its last digit.
fn optimum<P>(
    title: &str,
    problem: &P,
    m: &Matrix,
    q: &[f64],
    published: f64,
    digits: i32,
) -> Vec<f64>
where
    P: Registered + Problem<Point = LcpPoint>,
{
    let (a, _) = solved(problem, "psor");
    let (b, _) = solved(problem, "mprgp");
    let (c, _) = solved(problem, "tnnmg");
    for z in [&a, &b, &c] {
        let found = energy(m, q, z);
        let last = 10f64.powi(-digits);
        assert!((found - published).abs() < 1.01 * last, "{title}: {found} for {published}");
    }
    assert!(distance(&a, &b) < 1e-7, "{title}");
    assert!(distance(&c, &b) < 1e-7, "{title}");
    b
}

#[test]
fn obstacle_problems_of_cutest() {
    let one = |x: f64, y: f64| (3.3 * x).sin() * (3.2 * y).sin();
    let two = |x: f64, y: f64| (9.3 * x).sin() * (9.2 * y).sin();
    // Points a side with the rim; OBSTCLAE, OBSTCLBL.
    let published = [
        (4, 0.753659753, -0.0081108),
        (10, 1.397897560, 2.87503823),
        (23, 1.678027027, 6.51932527),
        (32, 1.748270031, 6.88708670),
    ];
    for (side, a, b) in published {
        let membrane = Membrane { rim: 0.5, ..Membrane::square(side - 2) };
        let above = membrane.between(one, |_, _| 2000.0);
        optimum("OBSTCLAE", &above, &above.M, &above.q, a, 8);
        let between = membrane.between(|x, y| two(x, y).powi(3), |x, y| two(x, y).powi(2) + 0.02);
        optimum("OBSTCLBL", &between, &between.M, &between.q, b, 7);
    }
}

#[test]
fn elastic_plastic_torsion_of_cutest() {
    for (q, published) in [(2, -5.1851852e-1), (5, -4.9234185e-1), (11, -4.5608771e-1)] {
        let problem = Torsion { n: 2 * q - 2, load: 5.0 }.boxed();
        optimum("TORSION1", &problem, &problem.M, &problem.q, published, 8);
    }
}

#[test]
fn journal_bearings() {
    for (nx, ny, published, digits, zeros) in
        [(20, 20, -0.17997935, 8, 130), (50, 50, -0.180488, 6, 824), (50, 75, -0.18067495, 8, 1236)]
    {
        let problem = JournalBearing { nx, ny, ..JournalBearing::default() }.lcp();
        let z = optimum("bearing", &problem, &problem.M, &problem.q, published, digits);
        assert_eq!(z.iter().filter(|z| **z == 0.0).count(), zeros);
    }
}

#[test]
fn the_obstacle_problem_of_mcplib() {
    let s = |x: f64, y: f64| (9.2 * x).sin() * (9.3 * y).sin();
    let problem =
        Membrane::square(50).between(|x, y| s(x, y).powi(3), |x, y| s(x, y).powi(2) + 0.2);
    let z = optimum("obstacle", &problem, &problem.M, &problem.q, 5.8308523184, 9);
    let at = |bound: &[f64]| z.iter().zip(bound).filter(|(z, b)| z == b).count();
    assert_eq!((at(&problem.lower), at(&problem.upper)), (137, 294));
}

#[test]
fn the_corpus_problem_mmc() {
    let Some(files) = corpus("lcp") else { return };
    let (_, text) = files.iter().find(|(name, _)| name == "lcp_mmc.dat").expect("lcp_mmc.dat");
    let dense = siconos_lcp(text).expect("a dense matrix");
    let problem = Lcp::new(dense.M.to_csc().unwrap(), dense.q).unwrap();
    let (z, _) = solved(&problem, "mprgp");
    for label in ["pgs", "psor", "rpsor", "rpgs"] {
        assert!(distance(&solved(&problem, label).0, &z) < 1e-6, "{label}");
    }
}
