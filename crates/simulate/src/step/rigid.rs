//! The rigid motions of an elastic solid that nothing holds, apart from its strains.
//!
//! Stiffness K has no answer to them, `K φ = 0`, but in rounding: of a solid that has moved far `K x` would be a force back to where it began, and of one that is stiff for the step, `h² K ≫ M`,
//! the factor of M̂ would lose momentum. Therefore K is asked of strains alone, and what a solve gives to the rigid motions is put right: `φᵀ M̂ = (1 + h θ α) φᵀ M`.

use nonsmooth_linalg::{Csc, dot};
use nonsmooth_scenes::vec3::{Vec3, add, cross, scale, sub};

/// Three translations and three small turns φ with `φᵢᵀ M φⱼ = δᵢⱼ`, and `M φ`.
pub(super) struct Rigid {
    modes: [Vec<f64>; 6],
    momenta: [Vec<f64>; 6],
}

impl Rigid {
    /// Those of nodes at `places`, three unknowns each. Cost: 36 passes over the unknowns, once.
    pub fn new(mass: &Csc, places: &[Vec3]) -> Self {
        let count = places.len().max(1) as f64;
        let centre = scale(1.0 / count, places.iter().fold([0.0; 3], |sum, x| add(sum, *x)));
        let mut made = Self { modes: Default::default(), momenta: Default::default() };
        for i in 0..6 {
            let mut axis = [0.0; 3];
            axis[i % 3] = 1.0;
            let at = |x: &Vec3| if i < 3 { axis } else { cross(axis, sub(*x, centre)) };
            let mut mode: Vec<f64> = places.iter().flat_map(at).collect();
            // Gram and Schmidt, twice for all digits.
            for _ in 0..2 {
                for k in 0..i {
                    subtract(dot(&made.momenta[k], &mode), &made.modes[k], &mut mode);
                }
            }
            let mut momentum = vec![0.0; mode.len()];
            mass.mul_add(1.0, &mode, &mut momentum);
            let size = dot(&mode, &momentum).sqrt();
            mode.iter_mut().chain(&mut momentum).for_each(|x| *x /= size);
            (made.modes[i], made.momenta[i]) = (mode, momentum);
        }
        made
    }

    /// Takes the rigid part out of x, a displacement or a velocity, and returns its coordinates.
    pub fn remove(&self, x: &mut [f64]) -> [f64; 6] {
        let part = self.momenta.each_ref().map(|momentum| dot(momentum, x));
        part.iter().zip(&self.modes).for_each(|(part, mode)| subtract(*part, mode, x));
        part
    }

    /// `φᵀ f`: what a force or an impulse makes of the rigid motions.
    pub fn of_force(&self, f: &[f64]) -> [f64; 6] {
        self.modes.each_ref().map(|mode| dot(mode, f))
    }

    /// Gives x the rigid part with these coordinates.
    pub fn set(&self, part: [f64; 6], x: &mut [f64]) {
        let has = self.momenta.each_ref().map(|momentum| dot(momentum, x));
        for ((part, has), mode) in part.iter().zip(has).zip(&self.modes) {
            subtract(has - part, mode, x);
        }
    }
}

/// `y − a x` for y.
fn subtract(a: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y -= a * x);
}
