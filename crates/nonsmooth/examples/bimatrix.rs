//! The equilibria of a game of two players, by Lemke–Howson's complementary pivots.
//!
//! `cargo run --release -p nonsmooth --example bimatrix`
//!
//! In the battle of the sexes both prefer to be together, each at the place of their own: two equilibria in pure strategies, one in mixed ones. Lemke–Howson finds
//! one for each label that is dropped first; some labels lead to the same. That it is one is then checked by what an equilibrium is: no pure strategy does
//! better against the other player's. The game is an LCP, too: its solutions are the equilibria, scaled.

use nonsmooth_linalg::Dense;
use nonsmooth_solve::complementarity::pivoting::{Equilibrium, lemke_howson};

/// The most that a player gains by leaving the equilibrium alone.
fn regret(a: &Dense, b: &Dense, e: &Equilibrium) -> f64 {
    let mut rows = vec![0.0; a.nrows()];
    a.mul_add(1.0, &e.y, &mut rows); //               A y
    let mut columns = vec![0.0; b.ncols()];
    b.mul_transpose_add(1.0, &e.x, &mut columns); //  Bᵀ x
    let gain = |payoffs: &[f64], strategy: &[f64]| {
        let now: f64 = payoffs.iter().zip(strategy).map(|(p, s)| p * s).sum();
        payoffs.iter().fold(0.0_f64, |best, p| best.max(p - now))
    };
    gain(&rows, &e.x).max(gain(&columns, &e.y))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// Its name, and the payoffs of the row and of the column player.
    type Game = (&'static str, Vec<Vec<f64>>, Vec<Vec<f64>>);
    let games: [Game; 3] = [
        (
            "battle of the sexes",
            vec![vec![2.0, 0.0], vec![0.0, 1.0]],
            vec![vec![1.0, 0.0], vec![0.0, 2.0]],
        ),
        (
            "rock, paper, scissors",
            vec![vec![0.0, -1.0, 1.0], vec![1.0, 0.0, -1.0], vec![-1.0, 1.0, 0.0]],
            vec![vec![0.0, 1.0, -1.0], vec![-1.0, 0.0, 1.0], vec![1.0, -1.0, 0.0]],
        ),
        (
            "inspection",
            vec![vec![-1.0, 1.0], vec![3.0, -2.0], vec![1.0, 0.0]],
            vec![vec![2.0, -1.0], vec![-3.0, 1.0], vec![0.0, 0.5]],
        ),
    ];
    for (name, a, b) in games {
        let a = Dense::from_rows(&a).ok_or("rows of one length")?;
        let b = Dense::from_rows(&b).ok_or("rows of one length")?;
        println!("{name}");
        let mut found: Vec<Equilibrium> = vec![];
        for label in 0..a.nrows() + a.ncols() {
            let Some(e) = lemke_howson(&a, &b, label)? else { continue };
            let off = regret(&a, &b, &e);
            println!("  label {label}: x = {:.4?}, y = {:.4?}, regret {off:.0e}", e.x, e.y);
            let near = |o: &Equilibrium| {
                let pairs = o.x.iter().chain(&o.y).zip(e.x.iter().chain(&e.y));
                pairs.into_iter().all(|(p, q)| (p - q).abs() < 1e-9)
            };
            if !found.iter().any(near) {
                found.push(e);
            }
        }
        println!("  {} found\n", found.len());
    }
    Ok(())
}
