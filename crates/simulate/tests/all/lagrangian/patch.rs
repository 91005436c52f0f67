//! The patch test of contact: a uniform pressure goes through matching meshes as it is.

use nonsmooth_linalg::Csc;
use nonsmooth_scenes::{ElasticBox, Material};
use nonsmooth_simulate::{
    Activation, LagrangianScheme, LagrangianSimulation, Law, LinearContact, LinearSystem,
};

use crate::lagrangian::{near, theta};

const ELEMENTS: [usize; 3] = [4, 3, 2];
const PRESSURE: f64 = 2e4;

/// The share of each node of a layer in the area of the layer: 1 inside, ½ on an edge, ¼ at a corner, over all.
fn shares() -> Vec<f64> {
    let [nx, ny, _] = ELEMENTS;
    let end = |i: usize, n: usize| if i == 0 || i == n { 0.5 } else { 1.0 };
    let all = (0..=ny).flat_map(|j| (0..=nx).map(move |i| end(i, nx) * end(j, ny)));
    all.map(|x| x / (nx * ny) as f64).collect()
}

#[test]
fn a_pressure_goes_through_two_boxes_as_it_is() {
    let material = Material { density: 2000.0, young: 1e7, poisson: 0.3, alpha: 0.0, beta: 0.0 };
    let sides = [0.4, 0.3, 0.2];
    let lower = ElasticBox::new(sides, ELEMENTS, material).unwrap().at([0.0, 0.0, 0.1]);
    let upper = ElasticBox::new(sides, ELEMENTS, material).unwrap().at([0.0, 0.0, 0.3]);
    let below = LinearSystem::elastic(&lower, [0.0; 3]).unwrap();
    let smooth = Law::default();
    let below = below.against_plane(&lower, ([0.0, 0.0, 1.0], 0.0), 1e-9, smooth);
    let above = LinearSystem::elastic(&upper, [0.0; 3]).unwrap();
    let (n, layer) = (lower.dofs(), shares().len());
    let both = |a: &Csc, b: &Csc| {
        let shifted = b.triplets().map(|(i, j, x)| (n + i, n + j, x));
        Csc::from_triplets(2 * n, 2 * n, a.triplets().chain(shifted)).unwrap()
    };
    let mut system = LinearSystem::<3> {
        mass: both(&below.mass, &above.mass),
        damping: both(&below.damping, &above.damping),
        stiffness: both(&below.stiffness, &above.stiffness),
        load: [below.load.clone(), above.load.clone()].concat(),
        contacts: below.contacts.clone(),
        limits: vec![],
    };
    // The top layer of the lower box under the bottom layer of the upper one, node on node.
    let first = lower.nodes() - layer;
    for k in 0..layer {
        let (a, b) = (3 * (first + k), n + 3 * k);
        let along = |d: usize| vec![(b + d, 1.0), (a + d, -1.0)];
        system.contacts.push(LinearContact {
            gap: 0.0,
            directions: [along(2), along(0), along(1)],
            law: smooth,
        });
    }
    let force = PRESSURE * sides[0] * sides[1];
    for (k, share) in shares().iter().enumerate() {
        system.load[n + 3 * (first + k) + 2] -= force * share;
    }
    // Steps far longer than waves take, at θ = 1, come to rest.
    let still = vec![0.0; 2 * n];
    const H: f64 = 0.5;
    let activation = Activation::Forecast { gamma: 0.5, slack: 1e-9 };
    let scheme = LagrangianScheme { activation, ..theta(1.0) };
    let mut simulation = LagrangianSimulation::new(system, scheme, &still, &still).unwrap();
    for _ in 0..12 {
        assert!(simulation.step(H).unwrap().status.is_solved());
    }
    for interface in simulation.contacts().chunks(layer) {
        for (contact, share) in interface.iter().zip(shares()) {
            near(contact.impulse[0] / H / (force * share), 1.0, 1e-6);
        }
    }
    // Uniform strain: the top is lower by p L/E, and the sides are wider by ν p/E.
    let q = &simulation.state().q;
    let strain = PRESSURE / material.young;
    for k in 0..layer {
        near(q[n + 3 * (first + k) + 2] / (-strain * 0.4), 1.0, 1e-6);
    }
    near((q[3] - q[0]) / (0.3 * strain * sides[0] / ELEMENTS[0] as f64), 1.0, 1e-6);
}
