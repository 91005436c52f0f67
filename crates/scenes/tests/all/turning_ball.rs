//! The ball on a plane: time stepping with the exact cone against the closed form, and what facets do to it.

use nonsmooth_problem::FrictionLocal;
use nonsmooth_scenes::{BallState, TurningBall};
use nonsmooth_solve::{Limits, registry, settings};

/// The end of the path with the contact problems solved by the solver of this name.
fn end(ball: &TurningBall, solver: &str, texts: &[&str], steps: usize) -> BallState {
    let settings = settings::from_texts(texts).unwrap();
    let mut session = registry::session::<FrictionLocal<3>>(solver, &settings).unwrap();
    let limits = Limits { tolerance: 1e-12, max_iterations: 10_000, ..Limits::default() };
    *ball.path(&mut *session, &limits, 3, steps).unwrap().last().unwrap()
}

fn cone(ball: &TurningBall, steps: usize) -> BallState {
    end(ball, "nsgs", &[], steps)
}

fn inner(ball: &TurningBall, facets: usize) -> BallState {
    end(ball, "facet_inner/lemke", &[&format!("facets={facets}")], 1000)
}

fn outer(ball: &TurningBall, facets: usize) -> BallState {
    end(ball, "facet_outer/lemke", &[&format!("facets={facets}")], 1000)
}

fn distance(a: &BallState, b: &BallState) -> f64 {
    (a.position[0] - b.position[0]).hypot(a.position[1] - b.position[1])
}

fn launched() -> TurningBall {
    TurningBall { velocity: [4.0, 0.0], ..TurningBall::default() }
}

/// The scheme is of first order in the velocities; at 15 s the ball is at (15.004, 9.253).
#[test]
fn the_cone_follows_the_exact_path() {
    for velocity in [[4.0, 0.0], [0.0, 4.0], [-1.0, 0.5]] {
        let ball = TurningBall { velocity, ..TurningBall::default() };
        let exact = *ball.exact(3, 1).last().unwrap();
        let errors = [250, 500, 1000].map(|steps| distance(&cone(&ball, steps), &exact));
        assert!(errors[2] < 2e-2, "{errors:?}");
        for pair in errors.windows(2) {
            assert!((1.8..2.2).contains(&(pair[0] / pair[1])), "{errors:?}");
        }
    }
    let [x, y] = launched().exact(3, 1).last().unwrap().position;
    assert!((x - 15.0036).abs() < 1e-3 && (y - 9.2526).abs() < 1e-3, "{x} {y}");
}

/// The last step says how nearly it obeys Coulomb's law.
#[test]
fn residuals_tell_the_cone_from_its_facets() {
    let ball = launched();
    assert!(cone(&ball, 1000).residual < 1e-12);
    let at = |facets| inner(&ball, facets).residual;
    assert!(at(4) > 1e-3 && at(32) > 1e-6, "{:e} {:e}", at(4), at(32));
}

#[test]
fn fewer_facets_lead_the_ball_farther_away() {
    let ball = launched();
    let exact = *ball.exact(3, 1).last().unwrap();
    for path in [inner, outer] {
        let far = [4, 6, 8, 16, 32].map(|facets| distance(&path(&ball, facets), &exact));
        assert!(far.windows(2).all(|f| f[1] < f[0]), "{far:?}");
        assert!(far[0] > 4.0 && far[4] < 0.2, "{far:?}");
    }
}

/// The force never exceeds the friction that the cone allows; the inner polygon allows less, but for directions of its vertices. With ω = 6 the force
/// happens to point along vertices only.
#[test]
fn from_rest_only_the_inner_facets_let_the_ball_go() {
    let ball = TurningBall::default();
    let rest = BallState::default();
    assert!(distance(&cone(&ball, 1000), &rest) < 1e-9);
    for facets in [4, 8, 16, 32] {
        assert!(distance(&outer(&ball, facets), &rest) < 1e-9, "{facets}");
    }
    let far = [4, 8, 32, 128].map(|facets| distance(&inner(&ball, facets), &rest));
    assert!(far[0] > 3.0 && far[1] > 0.05 && far[2] < 0.1 && far[3] < 0.02, "{far:?}");
    assert!(distance(&inner(&ball, 6), &rest) < 1e-9);
}

/// With four facets everything can be followed by hand. At 60° the friction sits on the edge between two vertices: the ball slides along the diagonal with
/// `(√3 − 1)/4 a` along each axis. At 180° it stops there with −a along each axis, and rests, because the force points at a vertex. At 300° it slides along
/// the other diagonal as in the beginning.
#[test]
fn four_facets_by_hand() {
    let ball = TurningBall::default();
    let a = ball.mu * ball.gravity;
    let slow = (3.0_f64.sqrt() - 1.0) / 4.0 * a;
    let (slide, stop) = (0.5 * slow * 25.0, (5.0 * slow).powi(2) / (2.0 * a));
    let expected = [2.0 * slide + stop, stop];
    let found = inner(&ball, 4).position;
    assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-2), "{found:?} {expected:?}");
}
