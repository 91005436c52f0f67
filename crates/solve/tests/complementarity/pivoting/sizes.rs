//! Larger problems, by block pivoting and by Keller.

use nonsmooth_problem::Lcp;
use nonsmooth_solve::Outcome;
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::{close, p_matrix, planted, redundant, solve};
use crate::common::{laplacian, w_of};

/// An obstacle problem on a square, with a load that waves.
fn obstacle(side: usize) -> Lcp {
    let wave = |i: usize| ((i / side) as f64 * 0.37).sin() * ((i % side) as f64 * 0.23).cos();
    let q = (0..side * side).map(|i| 0.1 * wave(i) - 0.02).collect();
    Lcp::new(laplacian(side), q).unwrap()
}

#[test]
fn block_pivoting_takes_few_factorisations() {
    for side in [10, 30, 70] {
        let solved = solve("block_pivoting", &[], &obstacle(side));
        assert_eq!(solved.status(), "solved");
        assert!(solved.outcome.factorisations <= 20, "{}", solved.outcome.factorisations);
        println!("n = {}: {} factorisations", side * side, solved.outcome.factorisations);
    }
    let mut rng = Pcg64::seed_from_u64(9);
    let (problem, z) = planted(p_matrix(300, &mut rng), 0.1, &mut rng);
    let solved = solve("block_pivoting", &[], &problem);
    assert!(close(&solved.z, &z, 1e-8));
}

#[test]
#[ignore = "a minute"]
fn a_thousand_variables() {
    let mut rng = Pcg64::seed_from_u64(10);
    let (problem, z) = planted(p_matrix(1000, &mut rng), 0.1, &mut rng);
    for name in ["keller", "block_pivoting"] {
        let solved = solve(name, &[], &problem);
        let Outcome { seconds, factorisations, .. } = solved.outcome;
        println!(
            "{name}: {} pivots, {factorisations} factorisations, {seconds:.2} s",
            solved.pivots
        );
        assert_eq!(solved.status(), "solved");
        assert!(close(&solved.z, &z, 1e-7), "{name}");
    }
    let (problem, z) = planted(redundant(1000, &mut rng), 0.1, &mut rng);
    let solved = solve("keller", &[], &problem);
    println!("keller, semidefinite: {} pivots, {:.2} s", solved.pivots, solved.outcome.seconds);
    assert_eq!(solved.status(), "solved");
    assert!(close(&w_of(&problem, &solved.z), &w_of(&problem, &z), 1e-5));
    let solved = solve("block_pivoting", &[], &obstacle(300));
    println!("obstacle: {:?}", solved.outcome);
    assert_eq!(solved.status(), "solved");
}
