//! The suite's own arithmetic and its oracle, tested on what is known by hand.

use nonsmooth::{BoxLcp, Bsr, Dense, FrictionLocal, Hlcp, Lcp, LcpPoint, LocalPoint, Mlcp};

use crate::hostile::suite::exact::Dyadic;
use crate::hostile::suite::kinds::Hostile;
use crate::hostile::suite::oracle::Union;

fn dense<const N: usize>(rows: &[[f64; N]]) -> Dense {
    Dense::from_rows(rows).unwrap()
}

fn solvable(problem: &impl Hostile) -> bool {
    problem.union().expect("polyhedra").has_point()
}

#[test]
fn numbers_are_exact() {
    let d = |x: f64| Dyadic::from(x);
    for (a, b) in [(0.1, 0.2), (1e300, -1e-300), (-3.5, 7.25), (5e-324, 1.0), (0.0, -2.0)] {
        // What is added can be taken away again, whatever the sizes.
        assert_eq!(&(&d(a) + &d(b)) - &d(b), d(a));
        assert_eq!((&d(a) * &d(b)).over_divisor(&d(b)), d(a));
        assert_eq!(d(a).to_f64(), a);
    }
    assert!(&d(0.1) + &d(0.2) > d(0.3), "as stored");
    assert_eq!(d(2.0).sqrt().to_f64(), 2.0_f64.sqrt());
    assert_eq!(d(1e-300).over(&d(3.0)).to_f64(), 1e-300 / 3.0);
    assert_eq!(d(6.25e40).sqrt().to_f64(), 2.5e20);
}

#[test]
fn unions_are_decided() {
    // A half plane and its opposite, one of which is out of reach.
    let mut union = Union::new(2);
    let sum = union.form(&[(0, 1.0), (1, 1.0)], -1.0);
    let (x, y) = (union.form(&[(0, 1.0)], 0.0), union.form(&[(1, 1.0)], 0.0));
    union.zero.push(sum);
    union.pair(x, y);
    assert!(union.has_point());
    let less = union.form(&[(0, 1.0), (1, 1.0)], -2.0);
    union.zero.push(less);
    assert!(!union.has_point());
}

#[test]
fn complementarity_is_decided() {
    let lcp = |m: &[[f64; 2]], q: [f64; 2]| solvable(&Lcp::new(dense(m), q.to_vec()).unwrap());
    assert!(lcp(&[[2.0, 1.0], [1.0, 2.0]], [-1.0, -1.0]));
    assert!(!lcp(&[[-2.0, 1.0], [1.0, -2.0]], [-1.0, -1.0]));
    assert!(!lcp(&[[1.0, -1.0], [-1.0, 1.0]], [-1.0, -1.0]));
    // One unit in the last place of the diagonal decides.
    let plus = 1.0 + f64::EPSILON;
    assert!(lcp(&[[plus, -1.0], [-1.0, plus]], [-1.0, -1.0]));
    assert!(!lcp(&[[plus, -1.0], [-plus, 1.0]], [-1.0, -1.0]));
    // A skew game, a zero matrix.
    assert!(!lcp(&[[0.0, 1.0], [-1.0, 0.0]], [-1.0, -1.0]));
    assert!(lcp(&[[0.0; 2]; 2], [0.0, 1.0]));
    // Scaled by powers of two, and by a lot of them.
    let (a, b) = (2.0_f64.powi(60), 2.0_f64.powi(-200));
    assert!(!lcp(&[[-2.0 * a, b], [a * a, -2.0 * a * b]], [-1.0, -a]));

    let mlcp = |m: &[[f64; 2]], q: [f64; 2]| solvable(&Mlcp::new(dense(m), q.to_vec(), 1).unwrap());
    assert!(mlcp(&[[1.0, 1.0], [-1.0, 1.0]], [-1.0, 1.0]));
    assert!(!mlcp(&[[0.0, 0.0], [1.0, 1.0]], [1.0, -1.0]));

    let boxed = |l: f64, u: f64, q: f64| {
        solvable(&BoxLcp::new(dense(&[[0.0]]), vec![q], vec![l], vec![u]).unwrap())
    };
    assert!(boxed(-1.0, 1.0, 3.0) && boxed(2.0, 2.0, 3.0) && boxed(0.0, f64::INFINITY, 1.0));
    assert!(!boxed(0.0, f64::INFINITY, -1.0) && !boxed(f64::NEG_INFINITY, f64::INFINITY, 1.0));

    let hlcp =
        |q: f64, r: f64| solvable(&Hlcp::new(dense(&[[q]]), dense(&[[r]]), vec![1.0]).unwrap());
    assert!(hlcp(1.0, -1.0) && hlcp(-1.0, 1.0) && !hlcp(-1.0, -2.0) && !hlcp(0.0, 0.0));
}

fn plane(w: [[f64; 2]; 2], q: [f64; 2], mu: f64) -> FrictionLocal<2> {
    let w = Bsr::from_rows(1, &[vec![(0, w)]]);
    FrictionLocal::new(w, q.to_vec(), vec![mu]).unwrap()
}

#[test]
fn contacts_are_decided() {
    assert!(solvable(&plane([[1.0, 0.0], [0.0, 1.0]], [-1.0, 2.0], 0.5)));
    // Without friction nothing but r_N moves, and it leaves u_N alone.
    assert!(!solvable(&plane([[0.0, -2.0], [2.0, 1.0]], [-1.0, 0.0], 0.0)));
    assert!(solvable(&plane([[0.0, -2.0], [2.0, 1.0]], [-1.0, 0.0], 1.0)));
    assert!(!solvable(&plane([[0.0, 0.0], [0.0, 1.0]], [-1.0, 2.0], 0.5)));
}

#[test]
fn errors_are_measured() {
    let lcp = Lcp::new(dense(&[[2.0, 0.0], [0.0, 1e-20]]), vec![-2.0, -1e-20]).unwrap();
    let error = |z: [f64; 2]| lcp.error(&LcpPoint { z: z.to_vec() });
    assert_eq!(error([1.0, 1.0]), 0.0);
    // Small rows count in their own units.
    assert!((error([1.0, 0.5]) - 1.0 / 3.0).abs() < 1e-15);
    assert_eq!(error([1.0, 0.0]), 1.0);
    let slides = plane([[1.0, 0.0], [0.0, 1.0]], [-1.0, 2.0], 0.5);
    let error = |r: [f64; 2]| slides.error(&LocalPoint { r: r.to_vec(), lambda: vec![] });
    assert_eq!(error([1.0, -0.5]), 0.0);
    assert!(error([1.0, -0.4]) > 0.01 && error([0.0, 0.0]) > 0.1);
}
