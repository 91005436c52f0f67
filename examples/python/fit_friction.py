"""Which friction made a body slide as it was seen to? Least squares with exact derivatives of each step.

A body of 1 kg is thrown over the floor and its places are measured. A step of Moreau and Jean is one contact problem, ``u = r/m + v + h g``, whose solution has a
derivative with respect to mu and to the velocity before; the derivative of the whole motion is their product, step by step.

    python examples/python/fit_friction.py
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

import nonsmooth as ns

H, STEPS, GRAVITY = 0.01, 60, 9.81
Vector = npt.NDArray[np.float64]


def motion(mu: float) -> tuple[Vector, Vector]:
    """Places along the floor after each step, and their derivatives with respect to mu."""
    v, dv = np.array([0.0, 2.0, 1.0]), np.zeros(3)
    x, dx = np.zeros(2), np.zeros(2)
    places, changes = [], []
    problem = ns.Friction(W=np.eye(3), q=np.zeros(3), mu=mu)
    for _ in range(STEPS):
        problem.update(q=v - [H * GRAVITY, 0.0, 0.0])
        answer = ns.solve(problem, tol=1e-12)
        by_velocity = ns.derivative(problem, answer, "q").jvp(dv)
        by_friction = ns.derivative(problem, answer, "mu").jvp([1.0])
        v, dv = answer.u, by_velocity["u"] + by_friction["u"]
        x, dx = x + H * v[1:], dx + H * dv[1:]
        places.append(x)
        changes.append(dx)
    return np.concatenate(places), np.concatenate(changes)


TRUE = 0.23
noise = 1e-4 * np.random.default_rng(0).normal(size=2 * STEPS)
measured = motion(TRUE)[0] + noise


def distance(mu: Vector) -> Vector:
    return motion(mu[0])[0] - measured


def slope(mu: Vector) -> Vector:
    return motion(mu[0])[1][:, None]


fit = least_squares(distance, [0.5], jac=slope)
print(f"mu = {fit.x[0]:.5f} (the truth is {TRUE}), {fit.nfev} motions")
assert abs(fit.x[0] - TRUE) < 1e-3

places, changes = motion(0.3)
differences = (motion(0.3 + 1e-6)[0] - motion(0.3 - 1e-6)[0]) / 2e-6
print(f"derivatives and differences agree to {np.abs(changes - differences).max():.1e} m")
assert np.abs(changes - differences).max() < 1e-6
