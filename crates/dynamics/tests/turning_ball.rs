//! The ball on a plane: the time stepping against the exact motion, and what facets do to it.
#[path = "../../solve/tests/plain_lemke/mod.rs"]
mod plain_lemke;
use nonsmooth_dynamics::TurningBall;
use nonsmooth_problem::FrictionLocal;
use nonsmooth_solve::reform::*;
use nonsmooth_solve::{Driver, Limits, Via, registry};

#[test]
fn show() {
    for velocity in [[4.0, 0.0], [0.0, 0.0], [2.0, 0.0], [0.0, 4.0]] {
        let ball = TurningBall { velocity, ..TurningBall::default() };
        let e = ball.exact(3, 1).last().copied().unwrap();
        println!("exact {e:?}");
        let limits = Limits { tolerance: 1e-12, max_iterations: 100, ..Limits::default() };
        for steps in [250, 500, 1000] {
            let mut session = registry::session::<FrictionLocal<3>>("nsgs", &Default::default()).unwrap();
            let p = ball.path(&mut *session, &limits, 3, steps).unwrap();
            let p = p.last().unwrap();
            println!("nsgs {steps} {:?} {:e}", p.position, (p.position[0] - e.position[0]).hypot(p.position[1] - e.position[1]));
        }
        for facet_angle in [0.0, 0.1, 0.3] {
        for facets in [4, 6, 8, 16, 32, 64] {
            let f = Facets { facets, facet_angle };
            let mut a = Driver::new(Via { reformulation: FacetInner::<3>(f), solver: plain_lemke::PlainLemke });
            let mut b = Driver::new(Via { reformulation: FacetOuter::<3>(f), solver: plain_lemke::PlainLemke });
            let p = ball.path(&mut a, &limits, 3, 500).unwrap().last().copied().unwrap().position;
            let o = ball.path(&mut b, &limits, 3, 500).unwrap().last().copied().unwrap().position;
            let d = |p: [f64; 2]| (p[0] - e.position[0]).hypot(p[1] - e.position[1]);
            println!("angle {facet_angle} facets {facets} inner {p:?} {:.3e} outer {o:?} {:.3e}", d(p), d(o));
        }}
    }
}
