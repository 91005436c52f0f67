"""Derivatives against finite differences at nondegenerate solutions."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import local, spd

import nonsmooth as ns

TOL = 1e-13
H = 1e-6


def point(problem):
    answer = ns.solve(problem, tol=TOL)
    assert answer.residual < 1e-10
    return answer


def parts(answer):
    return (answer.r, answer.u) if "r" in answer.parts else (answer.z, answer.w)


def differences(make, data, direction):
    """Central differences of x and y in a direction of the data."""
    ends = [parts(point(make(data + s * H * direction))) for s in (1, -1)]
    return [(a - b) / (2 * H) for a, b in zip(*ends)]


def close(found, differenced):
    scale = max(np.abs(differenced).max(), 1e-3)
    np.testing.assert_allclose(found, differenced, atol=1e-6 * scale)


def lcp(seed):
    rng = np.random.default_rng(seed)
    return spd(8, seed), rng.normal(size=8)


@pytest.mark.parametrize("seed", range(4))
def test_linear_complementarity(seed):
    M, q = lcp(seed)
    M = M + 0.3 * np.triu(np.ones_like(M), 1)
    problem, rng = ns.LCP(M, q), np.random.default_rng(seed + 100)
    answer = point(problem)
    by_q = ns.derivative(problem, answer)
    assert by_q.degenerate == 0 and 0 < answer.counts["inside"] < 8
    d = rng.normal(size=8)
    for found, seen in zip(by_q.jvp(d), differences(lambda q: ns.LCP(M, q), q, d)):
        close(found, seen)
    by_M = ns.derivative(problem, answer, "M")
    D = rng.normal(size=(8, 8))
    for found, seen in zip(by_M.jvp(D), differences(lambda M: ns.LCP(M, q), M, D)):
        close(found, seen)
    np.testing.assert_allclose(by_q.matrix @ d, by_q.jvp(d)[0], atol=1e-12)
    np.testing.assert_allclose(np.einsum("kij,ij", by_M.matrix, D), by_M.jvp(D)[0], atol=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_contacts(seed, dimension):
    problem = local(6, seed, mu=0.3, dimension=dimension)
    W, q, mu = problem.W.toarray(), problem.q, problem.mu
    answer, rng = point(problem), np.random.default_rng(seed + 50)
    assert answer.counts["slip"] > 0 and answer.counts["degenerate"] == 0

    def made(W=W, q=q, mu=mu):
        return ns.Friction(W=W, q=q, mu=mu, dimension=dimension)

    for letter, make, data in (
        ("q", lambda q: made(q=q), q),
        ("mu", lambda mu: made(mu=mu), mu),
        ("W", lambda W: made(W=W), W),
    ):
        by = ns.derivative(problem, answer, letter)
        assert by.degenerate == 0
        d = rng.normal(size=data.shape)
        dx, dy = by.jvp(d)
        for found, seen in zip((dx, dy), differences(make, data, d)):
            close(found, seen)
        # ⟨g, D d⟩ = ⟨Dᵀ g, d⟩
        gx, gy = rng.normal(size=(2, q.size))
        assert np.vdot(by.vjp(gx, gy), d) == pytest.approx(gx @ dx + gy @ dy, rel=1e-10)


def test_degenerate_solutions_are_flagged():
    problem = ns.LCP(np.eye(2), [-1.0, 0.0])
    assert ns.derivative(problem, ns.solve(problem)).degenerate == 1
    at_limit = ns.Friction(W=np.eye(3), q=[-1.0, 0.5, 0.0], mu=0.5)
    assert ns.derivative(at_limit, ns.solve(at_limit)).degenerate == 1


def test_what_has_no_derivative_says_so():
    # Two contacts of one body at one place share their load as they like.
    W = np.kron(np.ones((2, 2)), np.eye(2))
    problem = ns.Friction(W=W, q=[-1.0, 0.0] * 2, mu=0.5, dimension=2)
    with pytest.raises(ns.Error, match="others beside it"):
        ns.derivative(problem, ns.solve(problem, warm_start=[0.5, 0.0, 0.5, 0.0]))
    lcp = ns.LCP(np.eye(2), [-1.0, -2.0])
    with pytest.raises(ns.Error, match="with_respect_to: expected one of q, M, found mu"):
        ns.derivative(lcp, ns.solve(lcp), "mu")
    box = ns.BoxLCP(np.eye(1), [1.0], [0.0], [1.0])
    with pytest.raises(ns.Error, match="derivative: expected a linear complementarity problem"):
        ns.derivative(box, ns.solve(box))
    with pytest.raises(ns.Error, match="the point: expected a solution"):
        ns.derivative(local(5), ns.solve(local(5), "nsgs", max_iter=1, tol=1e-12))
    with pytest.raises(ns.Error, match="dq: expected 2 entries, found 3"):
        ns.derivative(lcp, ns.solve(lcp)).jvp([1.0, 2.0, 3.0])


def test_gradients_through_torch():
    torch = pytest.importorskip("torch")

    class Solve(torch.autograd.Function):
        @staticmethod
        def forward(context, q):
            problem = ns.LCP(np.eye(2), q.detach().numpy())
            context.at = ns.derivative(problem, ns.solve(problem))
            return torch.from_numpy(context.at._native.point())

        @staticmethod
        def backward(context, g):
            return torch.from_numpy(context.at.vjp(g.numpy()))

    q = torch.tensor([-1.0, 1.0], dtype=torch.float64, requires_grad=True)
    Solve.apply(q).sum().backward()
    assert q.grad.tolist() == [-1.0, 0.0]
