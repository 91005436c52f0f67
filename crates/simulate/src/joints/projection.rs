//! Direct projection onto the equations of joints: the smallest correction of the configuration in the norm of the masses,
//!
//! ```text
//! min ½ ‖Δ‖²_M   s.t.   φ(q ⊕ Δ) = 0      by Newton's method:   Gᵀ M⁻¹ G κ = −φ,   Δ = M⁻¹ G κ;
//! ```
//!
//! after a step φ is of third order in its length, so one iteration comes to rounding. Velocities likewise, `min ½ ‖δ‖²_M s.t. Gᵀ (v + δ) = 0` at the new
//! configuration: a row on the mean velocity leaves them off by O(h²), with a sign that changes from step to step and a size that grows where a mechanism
//! passes a singular position. What that takes of the energy, O(h⁴), is counted as numerical dissipation.
//!
//! Reference: Acary2013 for positions. Cost: a factorisation of `Gᵀ M⁻¹ G` an iteration, and one for the velocities; of redundant equations the least-squares solution.

use nonsmooth_linalg::{Csc, Inverse, RankLu, Refine};
use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Vec3, add, apply, dot, norm, scale};

use super::equations::Equation;
use super::rows::{Joints, is_limit};
use crate::rotation::{apply_transposed, cayley, inverse, unit};
use crate::state::State;
use crate::{BodyId, MoreauJean, Motion, Stabilisation, World};

/// Violations below this share of the size of a joint are rounding, and rates below this share of the largest terms.
const ROUNDING: f64 = 1e-14;
const ITERATIONS: usize = 8;

/// A rate beyond this share of its terms is more than rounding.
const FITS: f64 = 1e-9;
/// Where velocities drift, one beyond this share is what an impact has left.
const STOPPED: f64 = 0.05;

/// Of a body and a row: force, moment, and what these make of the body.
type Effect = (u32, usize, Vec3, Vec3, Vec3, Vec3);

/// `Gᵀ M⁻¹ G`, φ and its rates.
struct System {
    matrix: Csc,
    phi: Vec<f64>,
    rates: Vec<f64>,
    levers: Vec<Effect>,
}

impl System {
    /// κ with `Gᵀ M⁻¹ G κ = −residual`; none where it is not to be had or not finite.
    fn answer(&self, residual: &[f64]) -> Option<Vec<f64>> {
        let inverse = Inverse::of_multipliers(&self.matrix, "R").ok()?;
        let mut kappa: Vec<f64> = residual.iter().map(|x| -x).collect();
        let mut scratch = vec![0.0; inverse.scratch_len()];
        inverse.solve_with(&mut kappa, &mut scratch, Refine::Fully);
        kappa.iter().all(|x| x.is_finite()).then_some(kappa)
    }
}

/// What all rows of a body make of it.
fn summed(effects: &[Effect], kappa: &[f64]) -> (Vec3, Vec3) {
    let zero = ([0.0; 3], [0.0; 3]);
    effects.iter().fold(zero, |(slide, turn), (_, row, _, _, s, t)| {
        (add(slide, scale(kappa[*row], *s)), add(turn, scale(kappa[*row], *t)))
    })
}

/// By how much the rate of an equation is off, and the sizes of its terms together.
fn rate(world: &World, state: &State, equation: &Equation) -> (f64, f64) {
    let start = (-equation.target, equation.target.abs());
    equation.gradient.iter().fold(start, |(rate, terms), r| {
        let motion = &world.bodies[r.body as usize].motion;
        let (v, omega) = match motion {
            Motion::Free => {
                (state.velocity[r.body as usize], state.angular_velocity(BodyId(r.body)))
            }
            _ => (motion.velocity(state.t), [0.0; 3]),
        };
        let (slide, turn) = (dot(r.force, v), dot(r.moment, omega));
        (rate + slide + turn, terms + norm(r.force) * norm(v) + norm(r.moment) * norm(omega))
    })
}

/// Whether something pushed in the last step that may have stopped what moved: a contact, or the end of a coordinate.
fn has_stopped(state: &State) -> bool {
    let memory = &state.memory;
    memory.contacts.iter().any(|contact| contact.impulse != [0.0; 3])
        || memory.impulses.iter().any(|((_, row), x)| *x != 0.0 && is_limit(*row))
}

impl Joints {
    /// Moves the bodies onto the joints. Returns the largest violation of each joint that is left.
    pub fn project(&self, world: &World, state: &mut State) -> Vec<f64> {
        let mut best = self.violations(world, state);
        for _ in 0..ITERATIONS {
            if best.1 <= 1.0 {
                break;
            }
            let kept = (state.position.clone(), state.rotation.clone());
            if self.correct(world, state).is_none() {
                break;
            }
            let now = self.violations(world, state);
            if now.1.is_nan() || now.1 >= best.1 {
                (state.position, state.rotation) = kept;
                break;
            }
            best = now;
        }
        best.0
    }

    /// The largest violation of each joint, and the largest of all in units of rounding.
    pub fn violations(&self, world: &World, state: &State) -> (Vec<f64>, f64) {
        let mut each = vec![0.0_f64; self.linkages.len()];
        let mut worst: f64 = 0.0;
        for (j, Equation { value: phi, gradient: reach, .. }) in
            self.equations(world, state, |k| state.pose(k as usize))
        {
            let is_turn = reach.iter().all(|r| r.force == [0.0; 3]);
            let unit = if is_turn { 1.0 } else { self.linkages[j].size() };
            each[j] = each[j].max(phi.abs());
            worst = worst.max(phi.abs() / (ROUNDING * unit));
        }
        (each, worst)
    }

    /// Makes the velocities fit the joints; by how much that changes the kinetic energy, J.
    pub fn project_velocities(&self, world: &World, state: &mut State) -> f64 {
        let Some(system) = self.system(world, state) else { return 0.0 };
        let Some(kappa) = system.answer(&system.rates) else { return 0.0 };
        let mut change = 0.0;
        for same in system.levers.chunk_by(|a, b| a.0 == b.0) {
            let k = same[0].0 as usize;
            let (slide, turn) = summed(same, &kappa);
            let body = &world.bodies[k];
            let r = Rotation(state.rotation[k]).matrix();
            let turn = apply_transposed(&r, turn);
            // ½ ‖v + δ‖² − ½ ‖v‖² = δ · (v + ½ δ).
            let mean =
                (add(state.velocity[k], scale(0.5, slide)), add(state.spin[k], scale(0.5, turn)));
            change += body.mass * dot(slide, mean.0) + dot(apply(&body.inertia, turn), mean.1);
            state.velocity[k] = add(state.velocity[k], slide);
            state.spin[k] = add(state.spin[k], turn);
        }
        change
    }

    /// Finds velocities that fit the joints, where those at the beginning of a step do not: before the first step, because they were set, or, where nothing projects them, after an impact.
    pub fn fit(&mut self, scheme: &MoreauJean, world: &World, state: &State) {
        self.fitted = None;
        // Velocities that are not projected drift; to make them fit again and again would bring energy or take it.
        let drifts = scheme.stabilisation == Stabilisation::None && state.steps > 0;
        if self.is_empty() || drifts && !has_stopped(state) {
            return;
        }
        let least = if drifts { STOPPED } else { FITS };
        let equations = self.equations(world, state, |k| state.pose(k as usize));
        let rates: Vec<_> = equations.iter().map(|(_, e)| rate(world, state, e)).collect();
        let largest = rates.iter().fold(0.0_f64, |most, r| most.max(r.1));
        let fits =
            |(rate, terms): (f64, f64)| rate.abs() <= f64::max(least * terms, ROUNDING * largest);
        if !rates.into_iter().all(fits) {
            let mut fitted = state.clone();
            self.project_velocities(world, &mut fitted);
            self.fitted = Some(fitted);
        }
    }

    /// How many of how many equations follow from the others, where any do and they are few enough to tell.
    pub fn redundant(&self, world: &World, state: &State) -> Option<(usize, usize)> {
        const MANY: usize = 20_000;
        let System { matrix, .. } = self.system(world, state).filter(|s| s.phi.len() <= MANY)?;
        let mut factor = RankLu::default();
        factor.factorise(&matrix).ok()?;
        let found = factor.replaced().len();
        (found > 0).then_some((found, matrix.nrows()))
    }

    /// The equations at a state, `Gᵀ M⁻¹ G κ = −φ`.
    fn system(&self, world: &World, state: &State) -> Option<System> {
        let equations = self.equations(world, state, |k| state.pose(k as usize));
        let p = equations.len();
        let is_free = |k: u32| world.bodies[k as usize].is_free();
        let turned = |k: u32, moment: Vec3| -> Vec3 {
            let body = &world.bodies[k as usize];
            let r = Rotation(state.rotation[k as usize]).matrix();
            apply(&r, apply(&inverse(&body.inertia), apply_transposed(&r, moment)))
        };
        let mut levers = vec![];
        for (row, (_, equation)) in equations.iter().enumerate() {
            for r in equation.gradient.iter().filter(|r| is_free(r.body)) {
                let slide = scale(1.0 / world.bodies[r.body as usize].mass, r.force);
                levers.push((r.body, row, r.force, r.moment, slide, turned(r.body, r.moment)));
            }
        }
        levers.sort_by_key(|e| (e.0, e.1));
        let mut entries = vec![];
        for same in levers.chunk_by(|a, b| a.0 == b.0) {
            for (at, (_, i, force, moment, ..)) in same.iter().enumerate() {
                for (_, j, _, _, slide, turn) in &same[at..] {
                    let entry = dot(*force, *slide) + dot(*moment, *turn);
                    entries.push((*i, *j, entry));
                    if i != j {
                        entries.push((*j, *i, entry));
                    }
                }
            }
        }
        let matrix = Csc::from_triplets(p, p, entries.into_iter()).ok()?;
        let rates = equations.iter().map(|(_, e)| rate(world, state, e).0).collect();
        Some(System { matrix, phi: equations.iter().map(|e| e.1.value).collect(), rates, levers })
    }

    /// One iteration.
    fn correct(&self, world: &World, state: &mut State) -> Option<()> {
        let system = self.system(world, state)?;
        let kappa = system.answer(&system.phi)?;
        for same in system.levers.chunk_by(|a, b| a.0 == b.0) {
            let k = same[0].0 as usize;
            let (slide, turn) = summed(same, &kappa);
            if !(norm(slide) + norm(turn)).is_finite() {
                return None;
            }
            state.position[k] = add(state.position[k], slide);
            state.rotation[k] = unit(cayley(turn).after(Rotation(state.rotation[k]))).0;
        }
        Some(())
    }
}
