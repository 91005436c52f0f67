//! Columns of discs whose wall is taken away.
//!
//! A column of width L and height H = a L collapses onto a rough floor; its front comes to rest at R. Experiments and simulations (StaronHinch2005, by contact dynamics as here) have
//! `(R − L)/L ∝ a` for low columns and `∝ a^(2/3)` to `a^0.7` for high ones, with prefactors that depend on friction and on how many grains there are: only exponents are tested.

use nonsmooth_scenes::vec3::Vec3;
use nonsmooth_simulate::{Body, Compliance, Law, Part, Shape, Simulation, World, plane};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::statistics::{H, check, simulation};

const MU: f64 = 0.5;
const SOFT: Compliance = Compliance { stiffness: 1e3, damping: 0.0 };

/// Discs in the plane y = 0, whose motion stays in it; floor, wall on the left and, if it has one, on the right.
fn world(discs: &[(f64, Vec3)], right: Option<f64>) -> World {
    let mut world = World::new([0.0, 0.0, -1.0]).with_law(Law::friction(MU));
    let smooth = world.material("smooth");
    world.pair(0, smooth, Law::default());
    for material in [0, smooth] {
        world.comply(0, material, SOFT);
    }
    for &(radius, at) in discs {
        let m = std::f64::consts::PI * radius * radius;
        let j = 0.5 * m * radius * radius;
        let inertia = [[j, 0.0, 0.0], [0.0, j, 0.0], [0.0, 0.0, j]];
        world.add(Body::with_mass(m, inertia, vec![Part::new(Shape::Sphere { radius })]).at(at));
    }
    world.add(Body::floor());
    let mut wall = |x: f64, n: f64| {
        let side = plane([x, 0.0, 0.0], [n, 0.0, 0.0]).unwrap();
        world.add(Body::fixed(vec![side]).of(smooth));
    };
    wall(0.0, 1.0);
    if let Some(x) = right {
        wall(x, -1.0);
    }
    world
}

/// Height over width, and run-out over width, of a column of about this aspect that comes to rest and collapses.
fn collapse(count: usize, aspect: f64, seed: u64) -> (f64, f64) {
    let mut random = Pcg64::seed_from_u64(seed);
    // A disc takes 0.93 of a square.
    let width = (0.93 * count as f64 / aspect).sqrt();
    let per = (width / 1.12).floor() as usize;
    let mut discs: Vec<(f64, Vec3)> = (0..count)
        .map(|k| {
            let (i, j) = ((k % per) as f64, (k / per) as f64);
            let radius = random.random_range(0.4..0.52);
            let x = (i + 0.5) * width / per as f64 + random.random_range(-0.02..0.02);
            (radius, [x, 0.0, 0.52 + 1.05 * j])
        })
        .collect();
    let mut filling = simulation(world(&discs, Some(width)));
    check(&filling.run(15.0 + 2.0 * discs[count - 1].1[2].sqrt(), H, &mut ()).unwrap());
    for (disc, x) in discs.iter_mut().zip(&filling.state().position) {
        assert!(x[1].abs() < 1e-9, "{x:?}");
        disc.1 = *x;
    }
    // A column of uniform density ends twice as high as its mass centre is.
    let (m, mz) = discs.iter().fold((0.0, 0.0), |(m, mz), (r, x)| (m + r * r, mz + r * r * x[2]));
    let height = 2.0 * mz / m;
    let mut falling = simulation(world(&discs, None));
    check(&falling.run(5.0 * (2.0 * height).sqrt(), H, &mut ()).unwrap());
    (height / width, front(&falling, &discs) / width - 1.0)
}

/// How far the heap reaches: to the first gap of two diameters between discs in the order of their places, beyond which single ones roll on.
fn front(s: &Simulation, discs: &[(f64, Vec3)]) -> f64 {
    let places = s.state().position.iter().zip(discs);
    let mut ends: Vec<f64> = places.map(|(x, (radius, _))| x[0] + radius).collect();
    ends.sort_by(f64::total_cmp);
    let last = ends.windows(2).position(|x| x[1] - x[0] > 2.0).unwrap_or(ends.len() - 1);
    assert!(last > ends.len() * 4 / 5, "{last} of {}", ends.len());
    ends[last]
}

/// The exponent of the run-out over these aspects.
fn exponent(count: usize, aspects: &[f64], seeds: u64) -> f64 {
    let runs = aspects.iter().flat_map(|&a| (1..=seeds).map(move |seed| (a, seed)));
    let logs: Vec<(f64, f64)> = runs
        .map(|(a, seed)| {
            let (a, out) = collapse(count, a, seed);
            println!("{count} discs, a = {a:.3}: run-out {out:.3}");
            (a.ln(), out.ln())
        })
        .collect();
    let n = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let (xy, xx) = logs
        .iter()
        .fold((0.0, 0.0), |s, p| (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x) * (p.0 - x)));
    println!("exponent {:.3}", xy / xx);
    xy / xx
}

#[test]
fn low_columns_run_out_in_proportion_to_their_height_and_high_ones_by_a_power() {
    let (low, high) = (exponent(300, &[0.5, 2.0], 3), exponent(300, &[3.0, 12.0], 3));
    assert!((low - 1.0).abs() < 0.2, "{low}");
    assert!((0.55..0.8).contains(&high), "{high}");
}

/// Some minutes: 1000 discs, three columns of each aspect.
#[test]
#[ignore = "minutes"]
fn columns_of_more_discs_have_the_same_exponents() {
    let low = exponent(1000, &[0.5, 0.75, 1.0, 1.5, 2.0], 3);
    let high = exponent(1000, &[3.0, 4.5, 6.0, 9.0, 12.0, 16.0], 3);
    assert!((low - 1.0).abs() < 0.2, "{low}");
    assert!((0.6..0.75).contains(&high), "{high}");
}
