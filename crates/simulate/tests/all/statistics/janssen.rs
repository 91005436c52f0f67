//! Grains in a square tube whose walls go slowly up, so that friction on the walls carries weight and is mobilised everywhere.
//!
//! With `σ_h = K σ_v` and friction `mu σ_h` on a perimeter 4 D of a section D² the balance of a slice, `σ_v' = ρ g − 4 mu K σ_v/D`, has Janssen's solution
//!
//! ```text
//! σ_v(s) = ρ g λ (1 − exp(−s/λ)),     λ = D/(4 mu K),     s below the surface.
//! ```
//!
//! K is that of the same run: the mean pressure on the walls over the mean vertical stress, so that what is tested is the law, and no figure of K enters.

use nonsmooth_scenes::vec3::Vec3;
use nonsmooth_simulate::{
    Body, Compliance, Control, Law, Motion, Shape, Simulation, StepReport, World, plane,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::statistics::{H, check, simulation};

const MU_WALL: f64 = 0.3;
/// At which the walls go up.
const SPEED: f64 = 0.1;
/// Rolling friction of walls along which no grain rolls: rolling grains leave part of the friction of the walls idle, or turn it sideways.
const ROUGH: f64 = 0.1;
/// What contacts give way by, which makes steps of a tall column a hundred times cheaper: the lowest grain sinks in by some thousandths of its size.
const SOFT: Compliance = Compliance { stiffness: 1e3, damping: 0.0 };
const SLICES: usize = 40;

/// λ of Janssen's law.
fn depth(side: f64, mu: f64, k: f64) -> f64 {
    side / (4.0 * mu * k)
}

/// The height of a column as heavy as what is carried at depth s.
fn carried(lambda: f64, s: f64) -> f64 {
    -lambda * (-s / lambda).exp_m1()
}

/// Means over time of what walls and floor carry, as shares of the weight, by height.
struct Silo {
    side: f64,
    height: f64,
    /// Vertical force through horizontal sections at `(k + ½) height/SLICES`.
    through: [f64; SLICES],
    /// Normal force and friction of walls in slices about these.
    normal: [f64; SLICES],
    friction: [f64; SLICES],
    floor: f64,
}

/// `count` grains fall into a tube of this side whose walls, with rolling friction `mu_r`, go up; means are taken from `from` until `until`.
fn silo(count: usize, side: f64, mu_r: f64, (from, until): (f64, f64)) -> Silo {
    let mut random = Pcg64::seed_from_u64(7);
    let mut world = World::new([0.0, 0.0, -1.0]).with_law(Law::friction(0.5));
    let rough = world.material("wall");
    world.pair(0, rough, Law { mu_r, ..Law::friction(MU_WALL) });
    for material in [0, rough] {
        world.comply(0, material, SOFT);
    }
    let half = 0.5 * side;
    let across = (side / 1.2).floor();
    let per = (across * across) as usize;
    for k in 0..count {
        let (i, j) = ((k % per) / across as usize, (k % per) % across as usize);
        let radius = random.random_range(0.4..0.6);
        let mut at =
            |i: usize| (i as f64 + 0.5) * side / across - half + random.random_range(-0.02..0.02);
        let place = [at(i), at(j), 0.6 + 1.21 * (k / per) as f64];
        world.add(Body::solid(Shape::Sphere { radius }, 1.0).unwrap().at(place));
    }
    let floor = world.add(Body::floor());
    for n in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]] {
        let wall = Body::fixed(vec![plane(n.map(|x: f64| -half * x), n).unwrap()]);
        let motion = Motion::Surface { linear: [0.0, 0.0, SPEED], angular: [0.0; 3] };
        world.add(Body { motion, ..wall.of(rough) });
    }
    let weight: f64 = world.bodies.iter().filter(|b| b.is_free()).map(|b| b.mass).sum();
    let mut simulation = simulation(world);
    check(&simulation.run(from, H, &mut ()).unwrap());

    let mut silo = Silo {
        side: 2.0 * half,
        height: surface(&simulation, count),
        through: [0.0; SLICES],
        normal: [0.0; SLICES],
        friction: [0.0; SLICES],
        floor: 0.0,
    };
    let mut steps = 0.0;
    let mut watch = |s: &Simulation, _: &StepReport| {
        steps += 1.0;
        silo.add(s, (count, floor.index()), 1.0 / (weight * H));
        Control::Continue
    };
    check(&simulation.run(until, H, &mut watch).unwrap());
    silo.scale(1.0 / steps);
    silo
}

/// Where a column of uniform density would end: twice the height of the mass centre.
fn surface(simulation: &Simulation, count: usize) -> f64 {
    let grains = simulation.world().bodies.iter().zip(&simulation.state().position).take(count);
    let (m, mz) = grains.fold((0.0, 0.0), |(m, mz), (b, x)| (m + b.mass, mz + b.mass * x[2]));
    2.0 * mz / m
}

impl Silo {
    /// Adds the contacts of a step of `count` grains, in units of an impulse.
    fn add(&mut self, simulation: &Simulation, (count, floor): (usize, usize), unit: f64) {
        let z = &simulation.state().position;
        let slice = self.height / SLICES as f64;
        for c in simulation.contacts().iter().filter(|c| c.active) {
            let (a, b) = (c.a.index(), c.b.index());
            let on_b = c.world_impulse().map(|x| unit * x);
            if a < count && b < count {
                // What the upper one feels goes through the sections between the centres.
                let (low, high) = (z[a][2].min(z[b][2]), z[a][2].max(z[b][2]));
                let up = if z[b][2] > z[a][2] { on_b[2] } else { -on_b[2] };
                for (k, through) in self.through.iter_mut().enumerate() {
                    let section = (k as f64 + 0.5) * slice;
                    if low < section && section <= high {
                        *through += up;
                    }
                }
                continue;
            }
            let (on_grain, other): (Vec3, usize) =
                if b < count { (on_b, a) } else { (on_b.map(|x| -x), b) };
            if other == floor {
                self.floor += on_grain[2];
                continue;
            }
            let k = (c.point[2] / slice).clamp(0.0, (SLICES - 1) as f64) as usize;
            self.normal[k] += unit * c.impulse[0];
            self.friction[k] += on_grain[2];
        }
    }

    fn scale(&mut self, by: f64) {
        let all = [&mut self.through, &mut self.normal, &mut self.friction];
        all.into_iter().flatten().for_each(|x| *x *= by);
        self.floor *= by;
    }

    /// Horizontal over vertical stress.
    fn k(&self) -> f64 {
        let through = self.through.iter().sum::<f64>() / SLICES as f64;
        self.normal.iter().sum::<f64>() * self.side / (4.0 * self.height * through)
    }

    /// The share of `mu_w` times the pressure on the walls by which these carry weight.
    fn mobilised(&self) -> f64 {
        self.friction.iter().sum::<f64>() / (MU_WALL * self.normal.iter().sum::<f64>())
    }

    /// Janssen's force through the section at depth s, as a share of the weight, with friction `mu`.
    fn janssen(&self, mu: f64, s: f64) -> f64 {
        carried(depth(self.side, mu, self.k()), s) / self.height
    }

    /// That forces balance, that the floor carries what Janssen's law has it carry within a share, and each section too, within a share of what is carried at depth.
    #[track_caller]
    fn compare(&self, mu: f64, floor: f64, section: f64) {
        let balance = self.floor + self.friction.iter().sum::<f64>();
        let law = self.janssen(mu, self.height);
        let off = (0..SLICES).map(|k| {
            let z = (k as f64 + 0.5) * self.height / SLICES as f64;
            // Within a grain from the floor and the surface there are no sections through contacts.
            let inner = z > 1.0 && z < self.height - 1.0;
            if inner {
                (self.through[k] - self.janssen(mu, self.height - z)).abs() / law
            } else {
                0.0
            }
        });
        let off = off.fold(0.0, f64::max);
        let figures = format!(
            "side {}, height {:.2}, K = {:.3}, mobilised {:.3}, floor {:.4} of {:.4}, sections off by {off:.3}, balance {balance:.4}",
            self.side,
            self.height,
            self.k(),
            self.mobilised(),
            self.floor,
            law
        );
        println!("{figures}");
        assert!((balance - 1.0).abs() < 0.01, "{figures}");
        assert!((self.floor / law - 1.0).abs() < floor && off < section, "{figures}");
        // Most of the weight is with the walls.
        assert!(self.floor < 0.4, "{figures}");
    }
}

/// With ρ = 1500 kg/m³, D = 1 m, mu = 0.4, K = 0.5; and the law is the balance of slices.
#[test]
fn a_silo_of_a_metre_carries_no_more_than_18394_pa() {
    let (weight, lambda) = (1500.0 * 9.81, depth(1.0, 0.4, 0.5));
    assert!((lambda - 1.25).abs() < 1e-15);
    let stress = |s: f64| weight * carried(lambda, s);
    assert!((stress(40.0 * lambda) - 18394.0).abs() < 0.5);
    let ds = 1e-4;
    for s in [0.1, 1.25, 5.0] {
        let slope = (stress(s + ds) - stress(s - ds)) / (2.0 * ds);
        let balance = weight - 4.0 * 0.4 * 0.5 * stress(s);
        assert!((slope - balance).abs() < 1e-8 * weight, "{slope} {balance}");
    }
}

#[test]
fn walls_of_a_tube_carry_the_weight_by_janssens_law() {
    let silo = silo(400, 5.0, ROUGH, (25.0, 45.0));
    assert!(silo.mobilised() > 0.98, "{}", silo.mobilised());
    silo.compare(MU_WALL, 0.15, 0.2);
}

/// Some minutes: 1500 grains; and where grains may roll along the walls, which carry less then, as much as friction is mobilised.
#[test]
#[ignore = "minutes"]
fn wider_tubes_too_and_by_what_is_mobilised_where_grains_roll() {
    let sticky = silo(1500, 7.1, ROUGH, (50.0, 90.0));
    assert!(sticky.mobilised() > 0.98, "{}", sticky.mobilised());
    sticky.compare(MU_WALL, 0.15, 0.2);
    let rolling = silo(1500, 7.1, 0.0, (50.0, 90.0));
    assert!((0.7..0.95).contains(&rolling.mobilised()), "{}", rolling.mobilised());
    rolling.compare(rolling.mobilised() * MU_WALL, 0.15, 0.2);
}
