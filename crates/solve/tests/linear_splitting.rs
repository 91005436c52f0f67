use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::planted::{JournalBearing, Membrane, energy, torsion};
use nonsmooth_problem::{BoxLcp, Lcp, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings;
use nonsmooth_solve::{Limits, Outcome};

fn solve<P: Registered + Problem<Point = LcpPoint>>(
    p: &P,
    name: &str,
    texts: &[&str],
    tol: f64,
    max: usize,
) -> (Outcome, Vec<f64>) {
    let settings = settings::from_texts(texts).unwrap();
    let mut s = registry::session::<P>(name, &settings).unwrap();
    let mut point = p.origin();
    let limits = Limits { tolerance: tol, max_iterations: max, ..Limits::default() };
    let o = s.solve(p, &mut point, &limits, &mut |_| {}).unwrap();
    (o, point.z)
}

#[test]
fn explore() {
    for n in [4usize, 10, 23, 32] {
        let m = Membrane { nx: n - 2, ny: n - 2, rim: 0.5, ..Membrane::default() };
        let p = m.between(|x, y| (3.2 * y).sin() * (3.3 * x).sin(), |_, _| 2000.0);
        let (o, z) = solve(&p, "mprgp", &[], 1e-10, 10000);
        println!("OBSTCLAE {n} {} {} {:?}", o.status, energy(&p.M, &p.q, &z), o.iterations);
        let p = m.between(
            |x, y| ((9.2 * y).sin() * (9.3 * x).sin()).powi(3),
            |x, y| 0.02 + ((9.2 * y).sin() * (9.3 * x).sin()).powi(2),
        );
        let (o, z) = solve(&p, "mprgp", &[], 1e-10, 10000);
        println!("OBSTCLBL {n} {} {} {:?}", o.status, energy(&p.M, &p.q, &z), o.iterations);
    }
    for q in [2usize, 5, 11] {
        let p = torsion(2 * q - 2, 5.0);
        let (o, z) = solve(&p, "mprgp", &[], 1e-10, 10000);
        println!("TORSION {q} {} {} {:?}", o.status, energy(&p.M, &p.q, &z), o.iterations);
    }
    for (nx, ny) in [(20, 20), (50, 50), (50, 75)] {
        let p = JournalBearing { nx, ny, ..JournalBearing::default() }.lcp();
        for (name, t) in [
            ("mprgp", vec![]),
            ("pgs", vec![]),
            ("psor", vec!["omega=1.8"]),
            ("psor", vec!["adapt=true"]),
            ("rpgs", vec![]),
            ("rpsor", vec![]),
            ("splitting_ls", vec![]),
            ("splitting_ls", vec!["sweep=jacobi"]),
        ] {
            let (o, z) = solve(&p, name, &t, 1e-10, 100000);
            println!(
                "JB {nx}x{ny} {name} {t:?} {} {} zeros {} it {:?} {:.3}s",
                o.status,
                energy(&p.M, &p.q, &z),
                z.iter().filter(|z| **z == 0.0).count(),
                o.iterations,
                o.seconds
            );
        }
    }
    let m = Membrane { nx: 50, ny: 50, ..Membrane::default() };
    let p = m.between(
        |x, y| ((9.2 * x).sin() * (9.3 * y).sin()).powi(3),
        |x, y| 0.2 + ((9.2 * x).sin() * (9.3 * y).sin()).powi(2),
    );
    let (o, z) = solve(&p, "mprgp", &[], 1e-10, 10000);
    println!(
        "P12 {} {} {:?} lower {} upper {}",
        o.status,
        energy(&p.M, &p.q, &z),
        o.iterations,
        (0..2500).filter(|&i| z[i] == p.lower[i]).count(),
        (0..2500).filter(|&i| z[i] == p.upper[i]).count()
    );
}
