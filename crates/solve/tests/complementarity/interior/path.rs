//! The neighbourhoods of the central path.

use nonsmooth_linalg::Matrix;
use nonsmooth_problem::Lcp;
use nonsmooth_solve::Status;

use super::{Numbers, gram, planted, run};

#[test]
fn the_path_stays_in_its_neighbourhood() {
    let numbers = &mut Numbers(5);
    for n in [10, 50, 200] {
        let m = Matrix::from(gram(n, n / 2, 0.0, numbers));
        let (_, _, q) = planted(&m, 0.2, numbers);
        let problem = Lcp::new(m, q).unwrap();
        let narrow = run(&problem, "ip_mty", 1e-12);
        let wide = run(&problem, "ip_mehrotra", 1e-12);
        assert_eq!(
            (&narrow.outcome.status, &wide.outcome.status),
            (&Status::Solved, &Status::Solved)
        );
        println!(
            "n = {n}: {} and {} iterations",
            narrow.outcome.iterations, wide.outcome.iterations
        );
        let mut last = 0;
        for row in &narrow.path {
            // The first row of an iteration is the predictor's, the last one the corrector's.
            let theta = if row.iteration > last { 0.5 } else { 0.25 };
            assert!(row.delta <= theta + 1e-6, "{row:?}");
            last = row.iteration;
        }
        assert!(narrow.path.len() >= 2 * narrow.outcome.iterations);
        assert!(wide.path.iter().all(|row| row.least >= 1e-3 - 1e-9), "{:?}", wide.path);
        for path in [&narrow.path, &wide.path] {
            let end = path.last().unwrap();
            assert!(end.mu < 1e-3 * path[0].mu && end.residual < 1e-3, "{end:?}");
        }
    }
}
