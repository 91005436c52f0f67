"""Problems that several tests have."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns


def spd(n: int, seed: int = 0, weight: float = 1.0) -> np.ndarray:
    """A symmetric positive definite matrix."""
    a = np.random.default_rng(seed).normal(size=(n, n))
    return a @ a.T / n + weight * np.eye(n)


def local(contacts: int, seed: int = 0, mu: float = 0.6, dimension: int = 3) -> ns.Friction:
    """A local problem with regular W."""
    n = contacts * dimension
    rng = np.random.default_rng(seed + 1)
    return ns.Friction(W=spd(n, seed), q=rng.normal(size=n) - 0.3, mu=np.full(contacts, mu))


def long(contacts: int) -> ns.Friction:
    """A hyperstatic problem, on which Gauss–Seidel takes thousands of sweeps to nowhere at a tolerance of 1e-300."""
    n = 3 * contacts
    H = np.random.default_rng(7).normal(size=(n // 2, n))
    return ns.Friction(W=H.T @ H, q=H.T @ np.ones(n // 2) - 1.0, mu=np.full(contacts, 0.9))


@pytest.fixture
def box() -> ns.Friction:
    """A box of 1 kg, pressed down and pushed beyond what friction holds."""
    return ns.Friction(W=np.eye(3), q=[-1.0, 2.0, 0.0], mu=0.5)
