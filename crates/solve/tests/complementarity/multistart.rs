//! All solutions from many starts.

use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::planted::{ClassicName, NonlinearClassic};
use nonsmooth_solve::{Found, Limit, Solve, multistart};

fn is_same(a: &LcpPoint, b: &LcpPoint) -> bool {
    a.z.iter().zip(&b.z).all(|(a, b)| (a - b).abs() <= 1e-6)
}

#[test]
fn both_solutions_of_kojima_and_shindo_are_found() {
    let classic = NonlinearClassic { name: ClassicName::KojimaShindo };
    let problem = classic.mcp();
    let found = multistart(&problem, &Solve::new().tolerance(1e-10), 30, 1).unwrap();
    assert_eq!(found.solutions.len(), 2, "{:?}", found.solutions);
    for known in classic.solutions() {
        assert!(found.solutions.iter().any(|(one, _)| is_same(&one.point, &known)));
    }
    let again = multistart(&problem, &Solve::new().tolerance(1e-10), 30, 1).unwrap();
    let points = |found: &Found| {
        found.solutions.iter().map(|(one, _)| one.point.clone()).collect::<Vec<_>>()
    };
    assert_eq!(points(&found), points(&again));
    let times: usize = found.solutions.iter().map(|(_, times)| times).sum();
    assert!(times <= found.starts && found.starts == 30 && found.limit.is_none());
}

#[test]
fn the_time_is_for_all_starts_together() {
    let problem = NonlinearClassic { name: ClassicName::Josephy }.mcp();
    let found = multistart(&problem, &Solve::new().time_limit(0.0), 100, 1).unwrap();
    assert!(found.starts <= 1 && found.limit == Some(Limit::Time), "{found:?}");
}
