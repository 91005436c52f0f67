//! Classes of matrices: known matrices, brute force on small integers, planted classes of all sizes, invariance, consistency.

use nonsmooth_analysis::Class::*;
use nonsmooth_analysis::{Class, Classes, Effort, Finding, How, Why, Witness};
use nonsmooth_linalg::{Csc, Dense, Matrix, Operator};
use nonsmooth_problem::planted::{PlantedClass, PlantedLcp};
use proptest::prelude::*;

fn dense(rows: &[Vec<f64>]) -> Matrix {
    Dense::from_rows(rows).unwrap().into()
}

fn of(m: &Matrix) -> Classes {
    let found = Classes::of(m, Effort::default());
    assert!(found.verify(m), "{found}");
    coherent(&found);
    found
}

/// Answers do not contradict each other.
fn coherent(c: &Classes) {
    for (a, b) in [
        (PositiveDefinite, PositiveSemidefinite),
        (PositiveDefinite, P),
        (PositiveDefinite, StrictlyCopositive),
        (PositiveSemidefinite, P0),
        (PositiveSemidefinite, CopositivePlus),
        (PositiveSemidefinite, Sufficient),
        (P, P0),
        (P, Sufficient),
        (P, S),
        (K, Z),
        (K, P),
        (K, HPlus),
        (HPlus, P),
        (StrictlyCopositive, CopositivePlus),
        (CopositivePlus, Copositive),
        (Sufficient, ColumnSufficient),
        (Sufficient, RowSufficient),
        (ColumnSufficient, P0),
        (RowSufficient, P0),
    ] {
        assert!(!c.is(a) || c.is(b), "{a} without {b}\n{c}");
        assert!(!c.is_not(b) || c.is_not(a), "not {b}, but perhaps {a}\n{c}");
    }
}

fn expect(m: &Matrix, proven: &[Class], refuted: &[Class]) -> Classes {
    let found = of(m);
    for class in proven {
        assert!(found.is(*class), "{class}\n{found}");
    }
    for class in refuted {
        assert!(found.is_not(*class), "{class}\n{found}");
    }
    found
}

fn rows<const N: usize>(entries: [[f64; N]; N]) -> Matrix {
    dense(&entries.map(|r| r.to_vec()))
}

/// The transpose of the matrix of Murty's exponential example.
fn upper(n: usize) -> Matrix {
    Dense::from_fn(n, n, |i, j| {
        if i == j {
            1.0
        } else if j > i {
            2.0
        } else {
            0.0
        }
    })
    .into()
}

// ------------------------------------------------------------------------------------------- known matrices

#[test]
fn the_classics() {
    for n in [2, 6, 16, 40, 300] {
        let c = expect(&upper(n), &[P, HPlus, Sufficient, S], &[Symmetric, Z, K, PositiveDefinite]);
        // U + Uᵀ = 2 e eᵀ.
        assert!(c.is(Copositive) && c.is(StrictlyCopositive), "{c}");
    }
    let kostreva = rows([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]]);
    let c = expect(&kostreva, &[P, Sufficient, StrictlyCopositive], &[HPlus, PositiveDefinite, Z]);
    assert_eq!(c.get(P), &Finding::Proven { how: How::Minors });
    let csizmadia: Vec<Vec<f64>> = (0..7)
        .map(|i| {
            (0..7)
                .map(|j| {
                    if i == j {
                        1.0
                    } else if j < i {
                        -1.0
                    } else {
                        0.0
                    }
                })
                .collect()
        })
        .collect();
    expect(&dense(&csizmadia), &[P, Z, K, HPlus, Sufficient], &[Copositive, PositiveSemidefinite]);
    // Fathi: condition and all.
    let fathi = Dense::from_fn(9, 9, |i, j| {
        if i == j { 4.0 * i as f64 + 1.0 } else { 4.0 * i.min(j) as f64 + 2.0 }
    });
    expect(&fathi.into(), &[Symmetric, PositiveDefinite, P, StrictlyCopositive], &[Z, HPlus]);
    // Bimatrix of CPS_3 has a zero diagonal and positive blocks.
    let game = rows([
        [0.0, 0.0, 10.0, 20.0],
        [0.0, 0.0, 30.0, 15.0],
        [10.0, 20.0, 0.0, 0.0],
        [30.0, 15.0, 0.0, 0.0],
    ]);
    expect(&game, &[Copositive, S], &[P0, CopositivePlus, PositiveSemidefinite, Sufficient]);
    // Pang: not P0.
    let pang = rows([[0.0, -1.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]);
    expect(&pang, &[], &[P0, Copositive, Sufficient]);
    // Murty 2.2.
    expect(&rows([[-2.0, 1.0], [1.0, -2.0]]), &[Symmetric], &[P0, Copositive, S, Z]);
    expect(&rows([[-1.0]]), &[Symmetric, Z], &[P0, Copositive, S, PositiveDiagonal]);
    expect(&rows([[2.0]]), &Class::ALL, &[]);
    let zero = rows([[0.0]]);
    expect(
        &zero,
        &[PositiveSemidefinite, P0, CopositivePlus, Sufficient],
        &[P, StrictlyCopositive, S],
    );
}

/// B Bᵀ with rows of B that add to nothing, in units that take products of pivots out of the range of doubles.
#[test]
fn units_make_nothing_definite() {
    for n in [3_usize, 6, 10, 12] {
        let chosen = |i: usize, j: usize| ((7 * i + 5 * j + i * j * j) % 3) as f64 - 1.0;
        let b = |i: usize, j: usize| match i + 1 == n {
            true => -(0..i).map(|k| chosen(k, j)).sum::<f64>(),
            false => chosen(i, j),
        };
        for exponent in [-300, -60, -40, 0, 40, 60, 300] {
            let unit = f64::from(exponent).exp2();
            let entry = |i, j| (0..n).map(|k| b(i, k) * b(j, k)).sum::<f64>() * unit;
            let c = of(&Dense::from_fn(n, n, entry).into());
            for class in [PositiveDefinite, P, StrictlyCopositive] {
                assert!(!c.is(class), "{n}, 2^{exponent}, {class}: {c}");
            }
        }
    }
}

#[test]
fn singular_and_semidefinite() {
    // e eᵀ.
    for n in [2, 5, 12] {
        let m = Dense::from_fn(n, n, |_, _| 1.0).into();
        let semi = [PositiveSemidefinite, P0, CopositivePlus, StrictlyCopositive, Sufficient, S];
        expect(&m, &semi, &[PositiveDefinite, P, Z]);
    }
    let segment = rows([[1.0, -1.0], [-1.0, 1.0]]);
    let semi = [PositiveSemidefinite, P0, CopositivePlus, Sufficient, Z];
    expect(&segment, &semi, &[PositiveDefinite, P, K, StrictlyCopositive]);
    // An oscillator: skew, and the optimality conditions of a program (Murty 2.8).
    let skew = rows([[0.0, 1.0], [-1.0, 0.0]]);
    expect(
        &skew,
        &[PositiveSemidefinite, P0, CopositivePlus, Sufficient],
        &[PositiveDefinite, P, Symmetric],
    );
    let program = rows([
        [1.0, -1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0, -1.0],
        [1.0, 1.0, 2.0, 0.0],
        [1.0, 1.0, 0.0, 2.0],
    ]);
    expect(&program, &[PositiveSemidefinite, Sufficient, CopositivePlus], &[P, PositiveDefinite]);
    // Known up to rounding only: a Gram matrix of numbers that are not exact.
    let g: Vec<f64> = (0..24).map(|k| (k as f64 * 0.7).sin()).collect();
    let gram = Dense::from_fn(8, 8, |i, j| (0..3).map(|k| g[3 * i + k] * g[3 * j + k]).sum());
    let c = of(&gram.into());
    assert_eq!(c.get(PositiveSemidefinite), &Finding::Unknown { why: Why::UpToRounding }, "{c}");
    assert!(c.is_likely(P0) && c.is_likely(Sufficient) && c.is_likely(CopositivePlus), "{c}");
    assert!(!c.is(P0) && !c.is_not(PositiveDefinite) || c.is_not(P), "{c}");
}

#[test]
fn copositive_without_being_semidefinite() {
    // Horn's form is copositive, and neither semidefinite nor nonnegative nor a sum of such.
    let horn = Dense::from_fn(5, 5, |i, j| match (i + 5 - j) % 5 {
        0 => 1.0,
        1 | 4 => -1.0,
        _ => 1.0,
    });
    let c = expect(
        &horn.clone().into(),
        &[Copositive, Symmetric],
        &[PositiveSemidefinite, StrictlyCopositive],
    );
    assert_eq!(c.get(Copositive), &Finding::Proven { how: How::Submatrices });
    // (1, 1, 0, 0, 0) is a zero that moves nothing downwards but something upwards.
    assert!(c.is_not(CopositivePlus), "{c}");
    let mut less = horn.clone();
    less[(0, 0)] = 0.99;
    expect(&less.into(), &[], &[Copositive]);
    let mut more = horn;
    (0..5).for_each(|i| more[(i, i)] = 1.01);
    expect(&more.into(), &[StrictlyCopositive, CopositivePlus], &[PositiveSemidefinite]);
    // A zero of x₂ = x₀ + x₁ kind, with a null vector: semidefinite 2 × 2 part plus a nonnegative coupling.
    let plus = rows([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]]);
    expect(&plus, &[CopositivePlus, PositiveSemidefinite], &[StrictlyCopositive]);
    let not_plus = rows([[1.0, -1.0, 2.0], [-1.0, 1.0, 2.0], [0.0, 0.0, 1.0]]);
    expect(&not_plus, &[Copositive], &[CopositivePlus, PositiveSemidefinite]);
}

#[test]
fn sufficient_on_one_side_only() {
    // [0 1; 0 1] is column sufficient, not row sufficient; the transpose the other way round.
    let one = rows([[0.0, 1.0], [0.0, 1.0]]);
    let c = expect(&one, &[P0], &[RowSufficient, Sufficient]);
    assert!(!c.is_not(ColumnSufficient), "{c}");
    let other = rows([[0.0, 0.0], [1.0, 1.0]]);
    let c = expect(&other, &[P0], &[ColumnSufficient, Sufficient]);
    assert!(!c.is_not(RowSufficient), "{c}");
    // P0, and neither.
    expect(&rows([[0.0, 1.0], [0.0, 0.0]]), &[P0], &[ColumnSufficient, RowSufficient]);
    // Sufficient, neither P nor semidefinite: [0 −2; 1 0], scaled skew.
    expect(&rows([[0.0, -2.0], [1.0, 0.0]]), &[Sufficient, P0], &[P, PositiveSemidefinite]);
    let c =
        expect(&rows([[0.0, -2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), &[Sufficient], &[P]);
    assert_eq!(c.get(RowSufficient), &Finding::Proven { how: How::Transforms });
}

#[test]
fn dominance_and_h_matrices() {
    let n = 12_usize;
    let tridiagonal = |lower: f64, middle: f64, upper: f64| -> Matrix {
        let entries = (0..n)
            .flat_map(move |i| [(i, i, middle), ((i + 1) % n, i, lower), (i, (i + 1) % n, upper)]);
        let inside = entries
            .filter(move |&(i, j, _): &(usize, usize, f64)| i.abs_diff(j) <= 1)
            .collect::<Vec<_>>();
        Csc::from_triplets(n, n, inside.into_iter()).unwrap().into()
    };
    let c = expect(&tridiagonal(-1.0, 4.0, -1.0), &Class::ALL, &[]);
    assert_eq!(c.get(StrictlyDominant), &Finding::Proven { how: How::Entries });
    // The Laplacian: irreducibly, not strictly.
    expect(
        &tridiagonal(-1.0, 2.0, -1.0),
        &[IrreduciblyDominant, K, PositiveDefinite],
        &[StrictlyDominant],
    );
    expect(&tridiagonal(1.0, 4.0, -2.0), &[StrictlyDominant, HPlus, P], &[Z, K]);
    expect(&tridiagonal(-6.0, 5.0, -1.0), &[P, Z], &[StrictlyDominant, IrreduciblyDominant]);
    // H₊ without dominance: columns scaled.
    let h = rows([[2.0, 10.0], [-0.1, 1.0]]);
    expect(&h, &[HPlus, P], &[StrictlyDominant, IrreduciblyDominant, Z]);
    let none = rows([[1.0, -2.0], [-1.0, 1.0]]);
    expect(&none, &[Z], &[HPlus, P0, K]);
    // Reducible, with weak dominance.
    let block = rows([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 1.0, 2.0]]);
    let c = expect(&block, &[P], &[IrreduciblyDominant]);
    assert!(
        matches!(c.get(IrreduciblyDominant).witness(), Some(Witness::Block { rows }) if *rows == [0, 1])
    );
}

#[test]
fn what_rounding_hides_is_unknown() {
    // The determinant is 1e-18 of its terms, whatever its sign.
    let m = rows([[0.1, 0.3], [0.1, 0.3]]);
    let c = of(&m);
    assert!(c.is_not(P) && c.is(P0), "exact zero\n{c}");
    let m = rows([[0.1, 0.3 * 0.7], [0.1 / 0.7, 0.3]]);
    let c = of(&m);
    assert!(!c.is(P) || !c.is_not(P), "{c}");
    let nearly = rows([[1.0, 0.1 + 0.2], [0.3, 1.0]]);
    assert_eq!(of(&nearly).get(Symmetric), &Finding::Unknown { why: Why::UpToRounding });
}

#[test]
fn witnesses_must_be_right() {
    let m = rows([[1.0, 2.0], [3.0, 1.0]]);
    let minor = |rows: &[usize]| Witness::Minor { rows: rows.to_vec() };
    assert!(minor(&[0, 1]).refutes(&m, P0) && !minor(&[0]).refutes(&m, P0));
    for wrong in [&[][..], &[1, 0], &[0, 0], &[2], &[0, 5]] {
        assert!(!minor(wrong).refutes(&m, P), "{wrong:?}");
    }
    assert!(!minor(&[0, 1]).refutes(&m, Copositive));
    let direction = |x: &[(usize, f64)]| Witness::Direction { x: x.to_vec() };
    assert!(direction(&[(0, 1.0), (1, -1.0)]).refutes(&m, PositiveSemidefinite));
    assert!(!direction(&[(0, 1.0), (1, -1.0)]).refutes(&m, Copositive));
    assert!(!direction(&[(0, 0.0)]).refutes(&m, PositiveDefinite));
    assert!(!direction(&[(0, f64::NAN)]).refutes(&m, PositiveDefinite));
    assert!(!direction(&[(7, 1.0)]).refutes(&m, PositiveDefinite));
    let entry = |row, column| Witness::Entry { row, column };
    assert!(entry(0, 1).refutes(&m, Symmetric) && !entry(0, 0).refutes(&m, Symmetric));
    assert!(
        entry(0, 1).refutes(&m, Z) && !entry(0, 0).refutes(&m, Z) && !entry(9, 0).refutes(&m, Z)
    );
    assert!(!Witness::Row { row: 9 }.refutes(&m, StrictlyDominant));
    assert!(!Witness::Block { rows: vec![0] }.refutes(&m, IrreduciblyDominant));
    assert!(!Witness::Transform { pivots: vec![0], pair: [0, 1] }.refutes(&m, ColumnSufficient));
    assert!(!Witness::Combination { y: vec![(0, 1.0)] }.refutes(&m, S));
    assert!(!Witness::Comparison { x: vec![(0, 1.0)] }.refutes(&m, HPlus));
    assert!(Witness::Comparison { x: vec![(0, 1.0), (1, 1.0)] }.refutes(&m, HPlus));
}

#[test]
fn nothing_is_said_without_entries() {
    #[derive(Debug)]
    struct Twice;
    impl Operator for Twice {
        fn nrows(&self) -> usize {
            2
        }
        fn ncols(&self) -> usize {
            2
        }
        fn mul(&self, x: &[f64], y: &mut [f64]) {
            y.iter_mut().zip(x).for_each(|(y, x)| *y = 2.0 * x);
        }
        fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
            self.mul(x, y);
        }
    }
    let operator = Matrix::Operator(std::sync::Arc::new(Twice));
    let none = Classes::of(&operator, Effort::default());
    assert!(none.iter().all(|(_, f)| *f == Finding::Unknown { why: Why::Operator }));
    let flat = Matrix::from(Dense::zeros(2, 3));
    assert!(Classes::of(&flat, Effort::default()).iter().all(|(_, f)| f.is_unknown()));
    let nan = rows([[f64::NAN, 0.0], [0.0, 1.0]]);
    assert!(Classes::of(&nan, Effort::default()).iter().all(|(_, f)| f.is_unknown()));
}

#[test]
fn sentences_and_json() {
    let c = of(&upper(3));
    let lines = c.lines();
    assert_eq!(lines.len(), Class::ALL.len());
    assert_eq!(lines[0], "symmetric: refuted by M[0, 1]");
    assert!(lines.contains(&"P: proven (follows from H+)".to_owned()), "{c}");
    assert_eq!(c.to_string(), lines.join("\n"));
    let c = of(&rows([[1.0, 0.0], [0.0, -1.0]]));
    assert!(c.lines().contains(&"copositive: refuted by x = e_1".to_owned()), "{c}");
    assert!(c.lines().contains(&"P0: refuted by the principal minor of {1}".to_owned()), "{c}");
    let json = serde_json::to_value(of(&upper(3))).unwrap();
    assert_eq!(json["p"]["verdict"], "proven");
    assert_eq!(json["h_plus"]["how"], "comparison");
    assert_eq!(json["z"]["witness"]["kind"], "entry");
    assert_eq!(json["k"]["of"], "z");
    assert_eq!(json["p"]["how"]["follows"]["from"][0], "h_plus");
}

// ---------------------------------------------------------------------------------------------- brute force

/// The determinant of a small matrix of integers, by expansion.
fn determinant(m: &[Vec<i64>]) -> i64 {
    if m.is_empty() {
        return 1;
    }
    (0..m.len())
        .map(|j| {
            let minor: Vec<Vec<i64>> = m[1..]
                .iter()
                .map(|r| r.iter().enumerate().filter(|(k, _)| *k != j).map(|(_, x)| *x).collect())
                .collect();
            m[0][j] * determinant(&minor) * if j % 2 == 0 { 1 } else { -1 }
        })
        .sum()
}

fn minors(m: &[Vec<i64>]) -> Vec<i64> {
    let n = m.len();
    (1..1_usize << n)
        .map(|set| {
            let at: Vec<_> = (0..n).filter(|i| set >> i & 1 == 1).collect();
            determinant(
                &at.iter().map(|&i| at.iter().map(|&j| m[i][j]).collect()).collect::<Vec<_>>(),
            )
        })
        .collect()
}

/// All vectors with entries in the range.
fn grid(n: usize, least: i64, most: i64) -> Vec<Vec<i64>> {
    (0..n).fold(vec![vec![]], |all, _| {
        all.iter().flat_map(|x| (least..=most).map(move |v| [&x[..], &[v]].concat())).collect()
    })
}

fn times(m: &[Vec<i64>], x: &[i64]) -> Vec<i64> {
    m.iter().map(|r| r.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

fn transposed(m: &[Vec<i64>]) -> Vec<Vec<i64>> {
    (0..m.len()).map(|i| m.iter().map(|r| r[i]).collect()).collect()
}

fn square(largest: i64) -> impl Strategy<Value = Vec<Vec<i64>>> {
    (1_usize..=4).prop_flat_map(move |n| {
        // Diagonals that are not negative, else nothing is ever proven.
        prop::collection::vec(prop::collection::vec(-largest..=largest, n), n).prop_map(|mut m| {
            (0..m.len()).for_each(|i| m[i][i] = m[i][i].abs());
            m
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn small_integers_are_decided_and_rightly(m in square(2)) {
        let n = m.len();
        let matrix = dense(&m.iter().map(|r| r.iter().map(|&x| x as f64).collect()).collect::<Vec<_>>());
        let c = of(&matrix);
        let all = minors(&m);
        let twice: Vec<Vec<i64>> = (0..n).map(|i| (0..n).map(|j| m[i][j] + m[j][i]).collect()).collect();
        let symmetric = minors(&twice);
        let says = |class: Class, truth: bool| {
            prop_assert!(if truth { c.is(class) } else { c.is_not(class) }, "{}: {}\n{}", class, truth, c);
            Ok(())
        };
        says(P, all.iter().all(|d| *d > 0))?;
        says(P0, all.iter().all(|d| *d >= 0))?;
        says(PositiveDefinite, symmetric.iter().all(|d| *d > 0))?;
        says(PositiveSemidefinite, symmetric.iter().all(|d| *d >= 0))?;
        says(Symmetric, m == transposed(&m))?;
        says(Z, (0..n).all(|i| (0..n).all(|j| i == j || m[i][j] <= 0)))?;
        let compared: Vec<Vec<i64>> = (0..n)
            .map(|i| (0..n).map(|j| if i == j { m[i][j] } else { -m[i][j].abs() }).collect())
            .collect();
        let h = minors(&compared).iter().all(|d| *d > 0);
        says(HPlus, h)?;
        // A vector of small integers that shows something must not meet a proof to the contrary.
        let value = |x: &[i64]| times(&twice, x).iter().zip(x).map(|(a, b)| a * b).sum::<i64>();
        for x in grid(n, 0, 3).iter().filter(|x| x.iter().any(|v| *v > 0)) {
            let v = value(x);
            prop_assert!(v >= 0 || c.is_not(Copositive), "{:?}\n{}", x, c);
            prop_assert!(v > 0 || c.is_not(StrictlyCopositive), "{:?}\n{}", x, c);
            let moves = times(&twice, x).iter().any(|y| *y != 0);
            prop_assert!(v > 0 || !moves || c.is_not(CopositivePlus), "{:?}\n{}", x, c);
        }
        for (class, a) in [(ColumnSufficient, m.clone()), (RowSufficient, transposed(&m))] {
            for x in grid(n, -3, 3) {
                let products: Vec<_> = times(&a, &x).iter().zip(&x).map(|(a, b)| a * b).collect();
                let against = products.iter().all(|p| *p <= 0) && products.iter().any(|p| *p < 0);
                prop_assert!(!against || !c.is(class), "{}: {:?}\n{}", class, x, c);
            }
        }
        // Decided, and not merely not wrong.
        for class in [Copositive, StrictlyCopositive, CopositivePlus, Sufficient] {
            prop_assert!(!c.get(class).is_unknown(), "{}\n{}", class, c);
        }
    }

    #[test]
    fn storage_order_and_scales_do_not_matter(
        m in square(3),
        shift in 0_usize..4,
        powers in prop::collection::vec(-20_i32..20, 4),
    ) {
        let n = m.len();
        let entry = |i: usize, j: usize| m[i][j] as f64;
        let original = Matrix::from(Dense::from_fn(n, n, entry));
        let c = of(&original);
        let sparse = Matrix::from(original.to_csc().unwrap());
        let kinds = |c: &Classes| c.iter().map(|(_, f)| (f.is_proven(), f.is_refuted())).collect::<Vec<_>>();
        prop_assert_eq!(kinds(&of(&sparse)), kinds(&c));
        let turned = Matrix::from(Dense::from_fn(n, n, |i, j| entry((i + shift) % n, (j + shift) % n)));
        let t = of(&turned);
        for class in [P, P0, PositiveSemidefinite, Copositive, CopositivePlus, Sufficient, HPlus, Z] {
            prop_assert_eq!(t.is(class), c.is(class), "{}\n{}\n{}", class, t, c);
        }
        let d = |i: usize| f64::from(powers[i]).exp2();
        let scaled = Matrix::from(Dense::from_fn(n, n, |i, j| d(i) * entry(i, j) * d(j)));
        let s = of(&scaled);
        for class in [P, P0, PositiveDefinite, PositiveSemidefinite, Copositive, CopositivePlus, Sufficient] {
            prop_assert_eq!(s.is(class), c.is(class), "{}\n{}\n{}", class, s, c);
        }
    }
}

// ------------------------------------------------------------------------------------------ planted classes

/// What a planted matrix is by construction, and what small ones must be proven to be.
fn known(class: PlantedClass) -> (&'static [Class], &'static [Class]) {
    match class {
        PlantedClass::Spd => (&[Symmetric, PositiveDefinite, P], &[]),
        PlantedClass::MMatrix => (&[Z, K, HPlus, P, StrictlyDominant], &[]),
        PlantedClass::HPlus => (&[HPlus, P, StrictlyDominant], &[]),
        PlantedClass::P => (&[P, Sufficient], &[]),
        PlantedClass::Lcprand => (&[PositiveDefinite, P], &[]),
        PlantedClass::Psd => (&[Symmetric], &[P]),
        PlantedClass::Kkt => (&[], &[P]),
        PlantedClass::CopositivePlus => (&[], &[]),
        PlantedClass::Contact => (&[], &[CopositivePlus, P]),
        PlantedClass::Bimatrix => (&[Copositive, S], &[P0, CopositivePlus]),
    }
}

#[test]
fn planted_classes_are_recognised_at_all_sizes() {
    for class in PlantedClass::ALL {
        for (n, density) in [(6, 1.0), (12, 1.0), (60, 1.0), (60, 0.05), (300, 0.02), (3000, 0.001)]
        {
            if class == PlantedClass::Bimatrix && n > 300 {
                continue;
            }
            for seed in 0..3 {
                let case = PlantedLcp { n, class, density, seed, ..PlantedLcp::default() };
                let (problem, _) = case.lcp();
                let c = of(&problem.M);
                let (proven, refuted) = known(class);
                for k in
                    proven.iter().filter(|k| **k != StrictlyDominant || class != PlantedClass::Spd)
                {
                    assert!(c.is(*k), "{k} {case:?}\n{c}");
                }
                // Minors of repeated rows are lost in rounding.
                for k in refuted
                    .iter()
                    .filter(|_| !matches!(class, PlantedClass::Psd | PlantedClass::Kkt))
                {
                    assert!(c.is_not(*k), "{k} {case:?}\n{c}");
                }
                let semidefinite = matches!(class, PlantedClass::Psd | PlantedClass::Kkt);
                assert!(!semidefinite || c.is_likely(PositiveSemidefinite), "{case:?}\n{c}");
                let copositive =
                    matches!(class, PlantedClass::Contact | PlantedClass::CopositivePlus);
                assert!(!copositive || !c.is_not(Copositive), "{case:?}\n{c}");
            }
        }
    }
}

#[test]
fn large_matrices_take_the_time_of_a_factorisation() {
    // Two dimensions, five points: M-matrix, and the same with one weight changed so that nothing holds.
    let side = 316;
    let n = side * side;
    let mut entries = vec![];
    for i in 0..n {
        entries.push((i, i, 4.0));
        if i % side + 1 < side {
            entries.extend([(i, i + 1, -1.0), (i + 1, i, -1.0)]);
        }
        if i + side < n {
            entries.extend([(i, i + side, -1.0), (i + side, i, -1.0)]);
        }
    }
    let m = Matrix::from(Csc::from_triplets(n, n, entries.iter().copied()).unwrap());
    let c = of(&m);
    assert!(c.is(K) && c.is(PositiveDefinite) && c.is(IrreduciblyDominant), "{c}");
    assert_eq!(Classes::quick(&m).get(P), c.get(P));
    // Slightly less on the diagonal: still positive definite, no longer dominant.
    let weaker = entries.iter().map(|&(i, j, x)| (i, j, if i == j { 3.9999 } else { x }));
    let m = Matrix::from(Csc::from_triplets(n, n, weaker).unwrap());
    let c = of(&m);
    assert!(c.is(PositiveDefinite) && c.is(HPlus) && c.is(K), "{c}");
    assert_eq!(c.get(PositiveDefinite), &Finding::Proven { how: How::Cholesky });
    // Too little: a direction and a vector for the comparison matrix.
    let broken = entries.iter().map(|&(i, j, x)| (i, j, if i == j { 3.9 } else { x }));
    let m = Matrix::from(Csc::from_triplets(n, n, broken).unwrap());
    let c = of(&m);
    assert!(c.is_not(PositiveSemidefinite) && c.is_not(P) && c.is_not(HPlus), "{c}");
}

#[test]
fn a_pattern_that_fills_up_is_left_alone() {
    // A random graph: factors would be dense.
    for class in [PlantedClass::CopositivePlus, PlantedClass::Lcprand] {
        let case = PlantedLcp { n: 60_000, density: 8e-5, class, ..PlantedLcp::default() };
        let (problem, _) = case.lcp();
        let c = of(&problem.M);
        assert!(!c.is_not(Copositive), "{c}");
        if class == PlantedClass::Lcprand {
            let unknown = Finding::Unknown { why: Why::Operations };
            assert_eq!(c.get(PositiveDefinite), &unknown, "{c}");
        }
    }
}

#[test]
fn quick_never_says_otherwise() {
    for class in PlantedClass::ALL {
        let (problem, _) = PlantedLcp { n: 18, class, seed: 7, ..PlantedLcp::default() }.lcp();
        let (quick, full) = (Classes::quick(&problem.M), of(&problem.M));
        assert!(quick.verify(&problem.M));
        for ((k, a), (_, b)) in quick.iter().zip(full.iter()) {
            assert!(!(a.is_proven() && b.is_refuted() || a.is_refuted() && b.is_proven()), "{k}");
            assert!(a.is_unknown() || !b.is_unknown(), "{k}");
        }
    }
}
