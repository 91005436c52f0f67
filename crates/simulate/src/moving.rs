//! A body during a step: its poses, its velocities before and after, and what acts on it.

use nonsmooth_scenes::vec3::{Mat3, Vec3, add, apply, cross, dot, norm, scale, sub};

use crate::rotation::{Pose, apply_transposed, cayley, hat, inverse, product};
use crate::{Gyroscopic, MoreauJean};

/// A body during a step. `spin` is Ω in the body frame, or ω in the world frame where the inertia is isotropic.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moving {
    /// Its number among bodies and elastic solids: of a node that of its solid.
    pub owner: u32,
    pub free: bool,
    pub isotropic: bool,
    pub mass: f64,
    pub inertia: Mat3,
    pub inverse: Mat3,
    pub radius: f64,
    pub start: Pose,
    pub v: Vec3,
    pub spin: Vec3,
    /// `h (m g + F)` and `h τ`, in the world frame.
    pub push: Vec3,
    pub twist: Vec3,
    /// `m g`.
    pub weight: Vec3,
    pub middle: Pose,
    pub end: Pose,
    /// Of a body that is moved: `linear + angular × (p − x)`, at the beginning and the end.
    pub linear: [Vec3; 2],
    pub angular: Vec3,
    /// Takes a torque of the world into the frame of `spin`.
    pub frame: Mat3,
    /// The same for velocities at the end of the step.
    pub frame_end: Mat3,
    /// Velocities after the step.
    pub v_new: Vec3,
    pub spin_new: Vec3,
    /// Velocities of the pass without contacts.
    pub v_free: Vec3,
    pub spin_free: Vec3,
    /// The sum of impulses and of their moments, in the world frame.
    pub impulse: Vec3,
    pub moment: Vec3,
}

impl Moving {
    /// The angular velocity in the world frame that belongs to `spin`, of the beginning of the step or weighted by θ.
    pub fn omega(&self, spin: Vec3) -> Vec3 {
        if self.isotropic { spin } else { apply(&self.start.r, spin) }
    }

    /// The velocity of its point p at the beginning of the step.
    pub fn velocity_at(&self, p: Vec3) -> Vec3 {
        let (v, omega) = match self.free {
            true => (self.v, self.omega(self.spin)),
            false => (self.linear[0], self.angular),
        };
        add(v, cross(omega, sub(p, self.start.x)))
    }

    /// Its kinetic energy with these velocities.
    pub fn kinetic(&self, v: Vec3, spin: Vec3) -> f64 {
        0.5 * (self.mass * dot(v, v) + dot(spin, apply(&self.inertia, spin)))
    }

    /// The mean of its poses before and after the step, as the last pass has it; that of rotations is no rotation.
    pub fn mean_pose(&self, scheme: &MoreauJean, h: f64) -> Pose {
        if !self.free {
            return self.middle;
        }
        let x = add(self.start.x, scale(0.5 * h, scheme.mean(self.v, self.v_new)));
        let turn = cayley(scale(h, scheme.mean(self.spin, self.spin_new))).matrix();
        let end = match self.isotropic {
            true => product(&turn, &self.start.r),
            false => product(&self.start.r, &turn),
        };
        let r = std::array::from_fn(|i| {
            std::array::from_fn(|j| 0.5 * (self.start.r[i][j] + end[i][j]))
        });
        Pose { x, r }
    }

    /// The frames and the free velocities of a pass, about the rotation found last.
    pub fn pass(&mut self, scheme: &MoreauJean, h: f64) {
        if !self.free {
            return;
        }
        self.v_free = add(self.v, scale(1.0 / self.mass, self.push));
        if self.isotropic {
            self.frame = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            self.frame_end = self.frame;
            self.spin_free = add(self.spin, apply(&self.inverse, self.twist));
            return;
        }
        let mean = scheme.mean(self.spin, self.spin_new);
        let r = self.start.r;
        let back: Mat3 = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
        let mut turn = hat(scale(-0.5 * h, mean));
        (0..3).for_each(|i| turn[i][i] += 1.0);
        self.frame = product(&turn, &back);
        let end = self.end.r;
        self.frame_end = std::array::from_fn(|i| std::array::from_fn(|j| end[j][i]));
        let gyroscopic = match scheme.gyroscopic {
            Gyroscopic::Split => scale(h, cross(mean, apply(&self.inertia, mean))),
            Gyroscopic::Off => [0.0; 3],
        };
        let torque = sub(apply(&self.frame, self.twist), gyroscopic);
        self.spin_free = add(self.spin, apply(&self.inverse, torque));
    }

    /// Velocities after the step with the impulses and moments that it has: of rotation by Newton's method on the implicit rule.
    pub fn rotate(&mut self, scheme: &MoreauJean, h: f64) {
        self.v_new = add(self.v, scale(1.0 / self.mass, add(self.push, self.impulse)));
        let total = add(self.twist, self.moment);
        if self.isotropic {
            self.spin_new = add(self.spin, apply(&self.inverse, total));
            return;
        }
        let (theta, j) = (scheme.theta, &self.inertia);
        let l = apply_transposed(&self.start.r, total);
        let gyroscopic = f64::from(u8::from(scheme.gyroscopic == Gyroscopic::Split));
        let mut x = self.spin_new;
        for _ in 0..30 {
            let mean = scheme.mean(self.spin, x);
            let momentum = apply(j, mean);
            let inertial = apply(j, sub(x, self.spin));
            let turning = scale(gyroscopic * h, cross(mean, momentum));
            let residual = add(add(inertial, turning), sub(scale(0.5 * h, cross(mean, l)), l));
            let (wj, jw, lh) = (product(&hat(mean), j), hat(momentum), hat(l));
            let derivative: Mat3 = std::array::from_fn(|i| {
                std::array::from_fn(|k| {
                    let turning = gyroscopic * (wj[i][k] - jw[i][k]) - 0.5 * lh[i][k];
                    j[i][k] + h * theta * turning
                })
            });
            let step = apply(&inverse(&derivative), residual);
            x = sub(x, step);
            let moved = norm(step);
            if moved <= 1e-15 * norm(x).max(norm(self.spin)) || !moved.is_finite() {
                break;
            }
        }
        self.spin_new = x;
    }
}
