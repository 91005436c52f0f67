//! Rolling friction in motion: a ball that comes to rest, slopes, what turns, a ball upon another one; and the energy of each step.

use nonsmooth_simulate::{Body, Impact, Law, MoreauJean, Motion, Part, Shape, Simulation, World};

use super::{G, ball, simulation};

const RADIUS: f64 = 0.1;

/// A ball on a slope, which is the plane z = 0 under a gravity that is turned, rolling down at a speed.
fn rolling(law: Law, slope: f64, speed: f64) -> (Simulation, usize) {
    let (s, c) = f64::atan(slope).sin_cos();
    let mut world = World::new([G * s, 0.0, -G * c]).with_law(law);
    world.add(Body::floor());
    let body = ball(RADIUS).at([0.0, 0.0, RADIUS]);
    let id = world.add(body.moving([speed, 0.0, 0.0], [0.0, speed / RADIUS, 0.0]));
    (simulation(world), id.index())
}

fn law(mu_r: f64) -> Law {
    Law { mu: 0.5, mu_r, ..Law::default() }
}

/// `dv/dt = −(5/7) mu_r g/R` until it rests, and then it rests.
#[test]
fn a_rolling_ball_comes_to_rest() {
    let (mu_r, v, h) = (0.002, 0.5, 1e-3);
    let (mut simulation, ball) = rolling(law(mu_r), 0.0, v);
    let slower = 5.0 / 7.0 * mu_r * G / RADIUS;
    let end = v / slower;
    let mut rolled = 0;
    let mut worst: f64 = 0.0;
    let steps = (1.2 * end / h) as usize;
    for k in 1..=steps {
        let report = simulation.step(h).unwrap();
        assert!(report.status.is_solved(), "{report:?}");
        worst = worst.max(report.energy.relative_imbalance());
        let t = k as f64 * h;
        let expected = (v - slower * t).max(0.0);
        let now = simulation.state().velocity[ball][0];
        if (t - end).abs() > 2.0 * h {
            assert!((now - expected).abs() < 1e-8, "t = {t}: {now} {expected}");
        }
        rolled += usize::from(report.counts.roll > 0);
    }
    assert!(worst <= 1e-12, "{worst:e}");
    assert!((rolled as f64 * h - end).abs() < 3.0 * h, "{rolled} steps");
    // v²/2a.
    let far = simulation.state().position[ball][0];
    assert!((far - v * v / (2.0 * slower)).abs() < 2.0 * v * h, "{far}");
    let spin = simulation.state().spin[ball];
    assert!(spin.iter().all(|x| x.abs() < 1e-10), "{spin:?}");
}

#[test]
fn a_ball_rests_on_a_slope_up_to_mu_r_over_radius() {
    let mu_r = 0.002;
    for (share, rests) in [(0.5, true), (0.99, true), (1.01, false), (3.0, false)] {
        let slope = share * mu_r / RADIUS;
        let (mut simulation, ball) = rolling(law(mu_r), slope, 0.0);
        let (h, steps) = (1e-3, 200);
        for _ in 0..steps {
            assert!(simulation.step(h).unwrap().status.is_solved());
        }
        let v = simulation.state().velocity[ball][0];
        assert_eq!(v.abs() < 1e-12, rests, "{share}: {v}");
        if !rests {
            let (s, c) = f64::atan(slope).sin_cos();
            let expected = 5.0 / 7.0 * G * (s - mu_r / RADIUS * c) * h * f64::from(steps);
            assert!((v / expected - 1.0).abs() < 1e-8, "{v} {expected}");
        }
    }
}

/// A ball that cannot roll stands on a table that turns, and goes in a circle with it.
#[test]
fn what_turns_takes_part() {
    let mut world = World::new([0.0, 0.0, -G]).with_law(law(1.0));
    let table = Motion::Surface { linear: [0.0; 3], angular: [0.0, 0.0, 2.0] };
    world.add(Body { motion: table, ..Body::floor() });
    let body = ball(RADIUS).at([0.5, 0.0, RADIUS]).moving([0.0, 1.0, 0.0], [0.0, 0.0, 2.0]);
    let id = world.add(body);
    let mut simulation = simulation(world);
    for _ in 0..200 {
        let report = simulation.step(1e-3).unwrap();
        assert!(report.status.is_solved() && report.energy.relative_imbalance() <= 1e-12);
    }
    let [x, y, _] = simulation.state().position[id.index()];
    assert!((x.hypot(y) - 0.5).abs() < 2e-3, "{x} {y}");
    assert!((y.atan2(x) - 0.4).abs() < 2e-3, "{x} {y}");
}

/// A ball stands off the top of another one where `tan β ≤ mu_r/R`, and rolls down where it is not held.
#[test]
fn a_ball_stands_upon_another_one() {
    for (share, stands) in [(0.0, false), (0.9, false), (1.1, true), (3.0, true)] {
        let beta: f64 = 0.2;
        let mu_r = share * RADIUS * beta.tan();
        let mut world = World::new([0.0, 0.0, -G]).with_law(law(mu_r));
        let below = Part::new(Shape::Sphere { radius: RADIUS });
        world.add(Body::fixed(vec![below]));
        let place = [2.0 * RADIUS * beta.sin(), 0.0, 2.0 * RADIUS * beta.cos()];
        let id = world.add(ball(RADIUS).at(place));
        let mut simulation = simulation(world);
        for _ in 0..500 {
            assert!(simulation.step(1e-3).unwrap().status.is_solved());
        }
        let [x, _, z] = simulation.state().position[id.index()];
        let far = (x - place[0]).hypot(z - place[2]);
        assert_eq!(far < 1e-6, stands, "{share}: {far}");
    }
}

/// A disc that rolls round on its rim, its centre at rest, has `E = (3/2) m g a sin α` and `Ω² = 4 g/(a sin α)`; rolling friction takes `mu_r m g Ω sin α cos α`. For small α,
/// while it loses little in a turn, √α falls evenly, and it lies flat after `(3 a/(2 mu_r)) √(α₀ a/g)`.
#[test]
fn a_disc_comes_to_rest_on_its_face() {
    let (mu_r, h) = (0.005, 2e-4);
    let (a, thin, alpha) = (RADIUS, 1e-6, 10f64.to_radians());
    let (s, c) = alpha.sin_cos();
    let rate = (4.0 * G / (a * s)).sqrt();
    let mut world = World::new([0.0, 0.0, -G]).with_law(Law { mu: 1.0, ..law(mu_r) });
    world.add(Body::floor());
    let j = a * a;
    let inertia = [[j / 4.0, 0.0, 0.0], [0.0, j / 4.0, 0.0], [0.0, 0.0, j / 2.0]];
    let disc = Part::new(Shape::Cylinder { half_length: thin, radius: a });
    let disc = Body::with_mass(1.0, inertia, vec![disc])
        .turned(nonsmooth_scenes::Rotation::about([0.0, 1.0, 0.0], alpha))
        .at([0.0, 0.0, a * s + thin * c])
        .moving([0.0; 3], [-rate * s * c, 0.0, rate * s * s]);
    let id = world.add(disc);
    // With 1e-10 a step may leave 2e-13 m/s, a spin of 2e-12.
    let mut simulation = simulation(world).with_tolerance(1e-12);
    let end = 1.5 * a / mu_r * (alpha * a / G).sqrt();
    // Shares of α₀ and of the time. It nods as it is braked all of a sudden, by what it sinks in a radian of its turn: 2 % of the time.
    let mut passed = [(0.25, 0.5), (0.01, 0.9)].into_iter().peekable();
    while simulation.state().t < 1.02 * end {
        assert!(simulation.step(h).unwrap().status.is_solved());
        let height = simulation.state().position[id.index()][2] - thin;
        if let Some((_, time)) = passed.next_if(|(share, _)| height < a * share * alpha) {
            let share = simulation.state().t / end;
            assert!((share - time).abs() < 2e-2, "{share} {time}");
        }
    }
    assert!(passed.next().is_none());
    let (v, spin) = (simulation.state().velocity[id.index()], simulation.state().spin[id.index()]);
    assert!(v.iter().chain(&spin).all(|x| x.abs() < 1e-12), "{v:?} {spin:?}");
}

/// A ball that is dropped as it slides: by Frémond's law no impact gains energy with rolling friction, and what is held does not turn to and fro.
#[test]
fn fremonds_law_gains_no_energy_with_rolling_friction() {
    for (mu_r, e) in [(0.1, 1.0), (0.1, 0.8), (0.1, 0.5), (0.01, 0.8), (0.1, 0.0)] {
        let law = Law { mu: 2.0, mu_r, e, ..Law::default() };
        let mut world = World::new([0.0, 0.0, -G]).with_law(law);
        world.add(Body::floor());
        let body = ball(RADIUS).at([0.0, 0.0, 0.15]).moving([3.0, 0.0, 0.0], [0.0; 3]);
        let id = world.add(body);
        let scheme = MoreauJean { impact: Impact::Fremond, ..MoreauJean::default() };
        let mut simulation = Simulation::new(world, scheme).unwrap();
        let (mut before, mut impacts) = (f64::INFINITY, 0);
        for _ in 0..400 {
            let report = simulation.step(1e-3).unwrap();
            let energy = report.energy;
            assert!(report.status.is_solved() && energy.relative_imbalance() <= 1e-12);
            let now = energy.kinetic + energy.potential;
            assert!(now <= before + 1e-8 * energy.scale, "{mu_r} {e}: {now} {before}");
            // There is one contact: its work is that of all.
            let work = energy.normal + energy.tangential;
            assert!(work <= 1e-8 * energy.scale, "{mu_r} {e}: {work}");
            impacts += usize::from(report.counts.active > 0);
            before = now;
        }
        assert!(impacts > 0);
        if e == 0.0 {
            let (v, spin) =
                (simulation.state().velocity[id.index()], simulation.state().spin[id.index()]);
            assert!(v.iter().chain(&spin).all(|x| x.abs() < 1e-9), "{v:?} {spin:?}");
        }
    }
}
