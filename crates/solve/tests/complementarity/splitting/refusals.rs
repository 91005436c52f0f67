//! What a method needs it says; what is hopeless ends without a false answer.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::planted::Membrane;
use nonsmooth_problem::{Lcp, LcpPoint, Mlcp, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Status, settings};

use super::{Draw, SYMMETRIC, limits, solved, try_solve};

fn refusal<P>(problem: &P, label: &str) -> String
where
    P: Registered + Problem<Point = LcpPoint>,
{
    let error = try_solve(problem, label, &Limits::default()).expect_err(label);
    assert!(error.is_inapplicable(), "{label}: {error}");
    error.to_string()
}

#[test]
fn refusals_say_what_is_missing() {
    let lcp = |rows: &[&[f64]]| {
        Lcp::new(Dense::from_rows(rows).unwrap(), vec![-1.0; rows.len()]).unwrap()
    };
    let zero = lcp(&[&[1.0, 1.0], &[-1.0, 0.0]]);
    for label in ["pgs", "psor", "tnnmg"] {
        let text = refusal(&zero, label);
        assert!(text.contains("positive diagonal") && text.contains("M[1, 1] = 0"), "{text}");
        // Who can is found out by trial: a text does not know the problem.
        assert!(!text.contains("rpsor"), "{text}");
    }
    for label in ["splitting_ls", "mprgp"] {
        let text = refusal(&zero, label);
        assert!(text.contains("symmetric M") && text.contains("2.0e0"), "{text}");
    }
    let skew = lcp(&[&[1.0, 1.0], &[-1.0, 1.0]]);
    let text = refusal(&skew, "tnnmg");
    assert!(text.contains("symmetric M") && text.contains("2.0e0"), "{text}");
    let negative = lcp(&[&[1.0, 0.0], &[0.0, -1.0]]);
    for label in ["rpgs", "rpsor", "mprgp"] {
        let text = refusal(&negative, label);
        assert!(text.contains("M[1, 1] = -1"), "{text}");
    }
    let products = Membrane::square(5).above_by_products(|_, _| -1.0);
    for label in ["pgs", "psor", "rpgs", "rpsor", "splitting_ls", "tnnmg"] {
        let text = refusal(&products, label);
        assert!(text.contains("entries of M") && text.contains("operator"), "{text}");
    }
    let more = Mlcp::rectangular(
        Dense::from_rows(&[[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]).unwrap(),
        vec![1.0; 3],
        2,
        1,
    );
    for label in SYMMETRIC {
        let text = refusal(more.as_ref().unwrap(), label);
        assert!(text.contains("2 equalities and 1 free"), "{text}");
    }
    let free = Mlcp::new(Dense::from_rows(&[[0.0, 1.0], [-1.0, 1.0]]).unwrap(), vec![1.0; 2], 1);
    let text = refusal(&free.unwrap(), "psor");
    assert!(text.contains("nonzero diagonal of M at free variables"), "{text}");
    for wrong in [
        "psor omega=2",
        "rpsor rho=0",
        "rpsor fraction=1",
        "mprgp expansion=2",
        "pgs check_every=0",
    ] {
        let mut words = wrong.split(' ');
        let (name, text) = (words.next().unwrap(), words.next().unwrap());
        let settings = settings::from_texts(&[text]).unwrap();
        let error =
            registry::session::<Lcp>(name, &settings).map(|_| ()).expect_err(wrong).to_string();
        assert!(error.contains(text.split('=').next().unwrap()), "{error}");
    }
}

#[test]
fn hopeless_problems_end_without_a_false_answer() {
    // A cycle of PGS on a P-matrix (Kostreva), and divergence on a P-matrix that is not H.
    let kostreva = Dense::from_rows(&[[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]]).unwrap();
    let kostreva = Lcp::new(kostreva, vec![-1.0; 3]).unwrap();
    let mut draw = Draw::seeded(70);
    let a = draw.square(20);
    let turning =
        Dense::from_fn(20, 20, |i, j| 3.0 * (a[(i, j)] - a[(j, i)]) + f64::from(u8::from(i == j)));
    let (q, _) = draw.plant(&turning);
    let turning = Lcp::new(turning, q).unwrap();
    for problem in [&kostreva, &turning] {
        for label in ["projected_jacobi", "pgs", "psor"] {
            let (outcome, z) = try_solve(problem, label, &limits(1e-8, 5000)).unwrap();
            assert_ne!(outcome.status, Status::Solved, "{label}");
            assert!(z.iter().all(|z| z.is_finite()), "{label}: the best point is a point");
        }
        // Regularisation mends both.
        solved(problem, "rpgs");
    }
}
