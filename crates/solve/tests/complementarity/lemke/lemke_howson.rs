//! Equilibria of bimatrix games.

use nonsmooth_linalg::Dense;
use rand::RngExt;

use super::{assert_close, rng};

#[test]
fn games_have_their_equilibria() {
    use nonsmooth_solve::complementarity::pivoting::{game, lemke_howson};
    let dense = |rows: &[[f64; 2]]| Dense::from_rows(rows).unwrap();
    // Two pure equilibria, and a mixed one that no label reaches from the artificial one.
    let (a, b) = (dense(&[[2.0, 0.0], [0.0, 1.0]]), dense(&[[1.0, 0.0], [0.0, 2.0]]));
    let mut pure = [false; 2];
    for label in 0..4 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        let which = usize::from(e.x == [0.0, 1.0]);
        assert_eq!(e.x, e.y);
        assert_eq!(e.x[which], 1.0);
        pure[which] = true;
    }
    assert_eq!(pure, [true; 2]);
    // Matching pennies, and a 3 × 2 game (von Stengel) with a mixed equilibrium (0, 1/3, 2/3), (1/3, 2/3).
    let (a, b) = (dense(&[[1.0, -1.0], [-1.0, 1.0]]), dense(&[[-1.0, 1.0], [1.0, -1.0]]));
    for label in 0..4 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        assert_close(&e.x, &[0.5, 0.5], "pennies");
        assert_close(&e.y, &[0.5, 0.5], "pennies");
    }
    let (a, b) = (
        dense(&[[3.0, 3.0], [2.0, 5.0], [0.0, 6.0]]),
        dense(&[[3.0, 2.0], [2.0, 6.0], [3.0, 1.0]]),
    );
    let known = [
        (vec![1.0, 0.0, 0.0], vec![1.0, 0.0]),
        (vec![0.8, 0.2, 0.0], vec![2.0 / 3.0, 1.0 / 3.0]),
        (vec![0.0, 1.0 / 3.0, 2.0 / 3.0], vec![1.0 / 3.0, 2.0 / 3.0]),
    ];
    for label in 0..5 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        let near = |x: &[f64], y: &[f64]| x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-12);
        assert!(known.iter().any(|(x, y)| near(x, &e.x) && near(y, &e.y)), "{label}: {e:?}");
    }
    assert!(lemke_howson(&a, &b, 5).is_err());
    // Larger ones, by what an equilibrium is; the last with a factorised basis.
    for n in [10, 45] {
        let mut rng = rng(n as u64);
        let a = Dense::from_fn(n, n, |_, _| rng.random_range(-3.0..5.0));
        let b = Dense::from_fn(n, n, |_, _| rng.random_range(0.0..1.0));
        let e = lemke_howson(&a, &b, 3).unwrap().unwrap();
        let (mut rows, mut columns) = (vec![0.0; n], vec![0.0; n]);
        a.mul_add(1.0, &e.y, &mut rows);
        b.mul_transpose_add(1.0, &e.x, &mut columns);
        for (payoff, s) in [(rows, &e.x), (columns, &e.y)] {
            let now: f64 = payoff.iter().zip(s).map(|(p, s)| p * s).sum();
            assert!(payoff.iter().all(|p| *p <= now + 1e-12), "{n}");
        }
        assert_eq!(game(&a, &b).unwrap().dim(), 2 * n);
    }
}

/// Games as the complementarity problems that people state, of any order of the strategies and scale of the rows.
#[test]
fn games_are_recognised_and_solved_as_problems() {
    use nonsmooth_linalg::Csc;
    use nonsmooth_problem::check::Judged;
    use nonsmooth_problem::planted::{PlantedClass, PlantedLcp};
    use nonsmooth_problem::{Lcp, Mlcp};
    use nonsmooth_solve::Solve;
    let by = |solver: &str| Solve::new().solver(solver).tolerance(1e-10);
    for n in [4, 11, 40, 90] {
        let class = PlantedClass::Bimatrix;
        let case = PlantedLcp { n, class, decades: 2.0, seed: n as u64, ..PlantedLcp::default() };
        let (lcp, _) = case.lcp();
        // The strategies of both players in any order, as rows and columns.
        let place = |i: usize| (7 * i + 3) % n;
        let m = lcp.M.to_csc().unwrap();
        let entries = m.triplets().map(|(i, j, x)| (place(i), place(j), x));
        let mixed = Csc::from_triplets(n, n, entries.collect::<Vec<_>>().into_iter()).unwrap();
        let mut q = vec![0.0; n];
        (0..n).for_each(|i| q[place(i)] = lcp.q[i]);
        let shuffled = if n % 7 == 0 { lcp.clone() } else { Lcp::new(mixed, q).unwrap() };
        for problem in [lcp, shuffled] {
            for solver in ["lemke_howson", "auto"] {
                let answer = by(solver).run(&problem).unwrap();
                assert!(answer.is_solved(), "{n} {solver}: {}", answer.status);
            }
        }
    }
    // The mixed form: values v₁, v₂, then x and y; payoffs of any sign.
    for (m, n) in [(2, 2), (5, 3), (30, 20)] {
        let mut rng = rng((m + n) as u64);
        let size = 2 + m + n;
        let mut entries = vec![];
        for i in 0..m {
            entries.extend([(0, 2 + i, 2.0), (2 + i, 0, 0.5)]);
            entries.extend((0..n).map(|j| (2 + i, 2 + m + j, rng.random_range(-2.0..2.0))));
        }
        for j in 0..n {
            entries.extend([(1, 2 + m + j, 1.0), (2 + m + j, 1, -1.0)]);
            entries.extend((0..m).map(|i| (2 + m + j, 2 + i, rng.random_range(-2.0..2.0))));
        }
        let matrix = Csc::from_triplets(size, size, entries.into_iter()).unwrap();
        let mut q = vec![0.0; size];
        (q[0], q[1]) = (-2.0, -1.0);
        let problem = Mlcp::new(matrix, q, 2).unwrap();
        for label in [0, m + n - 1] {
            let answer = by("lemke_howson").set("label", label).run(&problem).unwrap();
            assert!(answer.is_solved(), "{m} {n} {label}: {}", answer.status);
            assert!(problem.judge(&answer.point, 1e-12).unwrap().solved);
        }
        assert!(by("auto").run(&problem).unwrap().account[0].starts_with("lemke_howson"));
    }
    // What is none is refused.
    let (spd, _) = PlantedLcp { n: 6, ..PlantedLcp::default() }.lcp();
    let said = by("lemke_howson").run(&spd).unwrap_err().to_string();
    assert!(said.contains("a bimatrix game"), "{said}");
}

/// Strategies that cost nothing by their own row, or by those of the other player.
#[test]
fn games_side_by_side_are_told_from_other_problems() {
    use nonsmooth_solve::{Limits, registry};
    let said = |m: [[f64; 4]; 4]| {
        let m = Dense::from_rows(&m).unwrap();
        let problem = nonsmooth_problem::Lcp::new(m, vec![-1.0; 4]).unwrap();
        let mut session =
            registry::session::<nonsmooth_problem::Lcp>("lemke_howson", &Default::default())
                .unwrap();
        let mut point = nonsmooth_problem::LcpPoint { z: vec![0.0; 4] };
        let solved = session.solve(&problem, &mut point, &Limits::default(), &mut |_| {});
        solved.unwrap_err().to_string()
    };
    let [a, b] = [[0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]];
    let two = said([a, b, [0.0, 0.0, 0.0, 2.0], [0.0, 0.0, 1.0, 0.0]]);
    assert!(two.contains("found games that have no strategy in common"), "{two}");
    // A row that meets no other, and a circle of three.
    for rest in [[[0.0; 4]; 2], [[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]]] {
        let other = said([a, [1.0, 0.0, 1.0, 0.0], rest[0], rest[1]]);
        assert!(other.contains("found another problem"), "{other}");
    }
}

#[test]
fn zero_rows_and_columns_are_part_of_a_game() {
    use nonsmooth_problem::Lcp;
    use nonsmooth_solve::{Solve, Status};
    let solve = |rows: &[[f64; 5]; 5]| {
        let lcp = Lcp::new(Dense::from_rows(rows).unwrap(), vec![-1.0; 5]).unwrap();
        Solve::new().solver("lemke_howson").run(&lcp).unwrap()
    };
    let mut rows = [
        [0.0, 0.0, 2.0, 1.0, 0.0],
        [3.0, 0.0, 0.0, 0.0, 0.0],
        [3.0, 0.0, 0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0, 0.0, 0.0],
        [3.0, 0.0, 0.0, 0.0, 0.0],
    ];
    let answer = solve(&rows);
    assert_eq!(answer.status, Status::Solved, "{:?}", answer.account);
    // A strategy that costs nothing whatever the other player does cannot cost 1.
    rows[1] = [0.0; 5];
    rows[0][1] = 1.0;
    assert!(matches!(solve(&rows).status, Status::Infeasible(_)));
}
