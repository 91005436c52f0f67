"""Derivatives against finite differences at nondegenerate solutions."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import local, spd

import nonsmooth as ns

TOL = 1e-13
H = 1e-5


def point(problem):
    answer = ns.solve(problem, tol=TOL)
    assert answer.residual < 1e-11
    return answer


def check(make, data, seed=0):
    """The derivatives of the solution of ``make(**data)`` with respect to each part of the data, forwards against central differences, backwards against forwards."""
    problem, rng = make(**data), np.random.default_rng(seed)
    answer = point(problem)
    for letter, part in data.items():
        by = ns.derivative(problem, answer, letter, tol=1e-9)
        assert by.degenerate == 0
        part = np.asarray(part, dtype=float)
        d = rng.normal(size=part.shape)
        change = by.jvp(d)
        ahead, behind = (point(make(**{**data, letter: part + s * H * d})) for s in (1, -1))
        for name in set(change) & set(answer.parts):
            seen = (ahead.parts[name] - behind.parts[name]) / (2 * H)
            scale = np.abs(seen).max(initial=1e-2)
            np.testing.assert_allclose(change[name], seen, atol=1e-6 * scale, rtol=0)
        # ⟨g, D d⟩ = ⟨Dᵀ g, d⟩
        gradients = {name: rng.normal(size=n) for name, n in by.parts.items()}
        forwards = sum(g @ change[name] for name, g in gradients.items())
        assert np.vdot(by.vjp(**gradients), d) == pytest.approx(forwards, rel=1e-9, abs=1e-9)
        if part.ndim == 2:
            pairs = by.factors(**gradients)
            assert sum(a @ d @ b for a, b in pairs) == pytest.approx(forwards, rel=1e-9, abs=1e-9)
        name = next(iter(by.parts))
        whole = by.matrix(name)
        assert whole.shape == (by.parts[name], *part.shape)
        np.testing.assert_allclose(
            whole.reshape(len(whole), -1) @ d.ravel(), change[name], atol=1e-10
        )
    return answer


def unsymmetric(n, seed):
    return spd(n, seed) + 0.3 * np.triu(np.ones((n, n)), 1)


@pytest.mark.parametrize("seed", range(4))
def test_linear_complementarity(seed):
    q = np.random.default_rng(seed).normal(size=8)
    answer = check(ns.LCP, dict(M=unsymmetric(8, seed), q=q), seed)
    assert 0 < answer.counts["inside"] < 8


@pytest.mark.parametrize("seed", range(4))
def test_other_linear_problems(seed):
    n = 8
    rng = np.random.default_rng(seed)
    M, q = unsymmetric(n, seed), 2 * rng.normal(size=n)
    box = dict(M=M, q=q, lower=np.full(n, -0.2), upper=np.full(n, 0.3))
    answer = check(ns.BoxLCP, box, seed)
    assert answer.counts["lower"] > 0 and answer.counts["upper"] > 0
    check(lambda M, q: ns.MLCP(M, q, free=3), dict(M=M, q=q), seed)
    R = -np.eye(n) + 0.05 * rng.normal(size=(n, n))
    check(ns.HLCP, dict(Q=M, R=R, q=q), seed)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_contacts(seed, dimension):
    problem = local(6, seed, mu=0.3, dimension=dimension)
    data = dict(W=problem.W.toarray(), q=problem.q, mu=problem.mu)
    answer = check(lambda **parts: ns.Friction(**parts, dimension=dimension), data, seed)
    assert answer.counts["slip"] > 0


ROWS = dict(lower=np.array([-np.inf, 0.0, -0.1]), upper=np.array([np.inf, np.inf, 0.1]))


@pytest.mark.parametrize("seed", range(3))
def test_contacts_with_scalar_rows(seed):
    nc, p = 4, 3
    A, rng = spd(3 * nc + p, seed), np.random.default_rng(seed)
    W, V, R = A[:-p, :-p], A[:-p, -p:], A[-p:, -p:]
    q = rng.normal(size=3 * nc) - 0.4
    data = dict(W=W, q=q, mu=np.full(nc, 0.4), V=V, R=R, s=rng.normal(size=p), **ROWS)
    check(lambda **parts: ns.Friction(**parts), data, seed)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_global_contacts(seed, dimension):
    n, nc, p = 18, 4, 3
    rng = np.random.default_rng(seed)
    data = dict(
        M=spd(n, seed),
        H=rng.normal(size=(n, dimension * nc)),
        f=rng.normal(size=n),
        w=rng.normal(size=dimension * nc) - 0.5,
        mu=np.full(nc, 0.4),
        G=rng.normal(size=(n, p)),
        b=rng.normal(size=p),
        **ROWS,
    )
    answer = check(lambda **parts: ns.Friction(**parts, dimension=dimension), data, seed)
    assert set(answer.parts) == {"v", "r", "u", "l"}


def cubic(p):
    """F of parameters: a matrix of them, and a constant."""
    A, c = p[:36].reshape(6, 6), p[36:]

    def F(x):
        return A @ x + 0.5 * x**3 + c

    return F, lambda x: A + np.diag(1.5 * x**2)


@pytest.mark.parametrize("kind", ["mcp", "vi"])
@pytest.mark.parametrize("seed", range(3))
def test_nonlinear_problems(seed, kind):
    rng = np.random.default_rng(seed)
    p = np.concatenate([unsymmetric(6, seed).ravel(), rng.normal(size=6)])

    def make(lower=np.full(6, -0.1), upper=np.full(6, 0.2), p=p):
        F, jac = cubic(p)
        if kind == "vi":
            return ns.VI(F, ns.Box(lower, upper), np.zeros(6), jac=jac)
        return ns.MCP(F, np.zeros(6), jac=jac, lower=lower, upper=upper)

    check(make, dict(lower=np.full(6, -0.1), upper=np.full(6, 0.2)), seed)
    problem = make()
    answer = point(problem)
    d = rng.normal(size=p.size)
    ahead, behind = (point(make(p=p + s * H * d)) for s in (1, -1))
    seen = (ahead.x - behind.x) / (2 * H)
    by_p = np.hstack([np.kron(np.eye(6), answer.x), np.eye(6)])
    for parameters in (by_p, sp.csr_matrix(by_p)):
        by = ns.derivative(problem, answer, parameters=parameters)
        change = by.jvp(d)
        np.testing.assert_allclose(change["x"], seen, atol=1e-6 * np.abs(seen).max(initial=1e-2))
        g = rng.normal(size=6)
        assert by.vjp(x=g) @ d == pytest.approx(g @ change["x"], rel=1e-9, abs=1e-12)
    with pytest.raises(ns.Error, match="parameters: expected 6 rows"):
        ns.derivative(problem, answer, parameters=np.eye(2))


def test_an_exception_in_a_jacobian_is_raised():
    failing = False

    def jac(x):
        if failing:
            raise ZeroDivisionError("by nothing")
        return np.eye(2)

    problem = ns.MCP(lambda x: x - 1, np.zeros(2), jac=jac)
    answer = ns.solve(problem)
    failing = True
    with pytest.raises(ZeroDivisionError, match="by nothing"):
        ns.derivative(problem, answer)


def test_degenerate_solutions_are_flagged():
    problem = ns.LCP(np.eye(2), [-1.0, 0.0])
    by = ns.derivative(problem, ns.solve(problem))
    assert by.degenerate == 1 and repr(by).endswith("with respect to q, 1 degenerate>")
    at_limit = ns.Friction(W=np.eye(3), q=[-1.0, 0.5, 0.0], mu=0.5)
    assert ns.derivative(at_limit, ns.solve(at_limit)).degenerate == 1


def test_what_has_no_derivative_says_so():
    # Two contacts of one body at one place share their load as they like.
    W = np.kron(np.ones((2, 2)), np.eye(2))
    problem = ns.Friction(W=W, q=[-1.0, 0.0] * 2, mu=0.5, dimension=2)
    with pytest.raises(ns.Error, match="others beside it"):
        ns.derivative(problem, ns.solve(problem, warm_start=[0.5, 0.0, 0.5, 0.0]))
    ball = ns.VI(["x1 - 3", "x2 - 4"], ns.Ball([0.0, 0.0], 1.0), [0.0, 0.0])
    with pytest.raises(ns.Error, match="set: expected a box"):
        ns.derivative(ball, ns.solve(ball))
    with pytest.raises(ns.Error, match="the point: expected a solution"):
        ns.derivative(local(5), ns.solve(local(5), "nsgs", max_iter=1, tol=1e-12))
    lcp = ns.LCP(np.eye(2), [-1.0, -2.0])
    answer = ns.solve(lcp)
    for make, said in (
        (lambda: ns.derivative(lcp, answer, "mu"), "with_respect_to: expected one of q, M, found mu"),
        (lambda: ns.derivative(lcp, answer, tol=0.0), r"tol: expected a number in \(0, 1\], found 0"),
        (lambda: ns.derivative(lcp, answer, parameters=np.eye(2)), "parameters: expected a problem with a function F"),
        (lambda: ns.derivative(lcp, answer).jvp([1.0, 2.0, 3.0]), "dq: expected 2 entries, found 3"),
        (lambda: ns.derivative(lcp, answer).jvp([1.0, np.nan]), r"dq\[1\]: expected a finite number"),
        (lambda: ns.derivative(lcp, answer, "M").jvp(np.eye(3)), "dM: expected 2 × 2, found 3 × 3"),
        (lambda: ns.derivative(lcp, answer).vjp(r=[1.0, 2.0]), "expected one of z, w, found r"),
        (lambda: ns.derivative(lcp, answer).factors(z=[1.0, 2.0]), "factors: expected a derivative with respect to a matrix"),
        (lambda: ns.derivative(lcp, answer).matrix("r"), "part: expected one of z, w, found r"),
        (lambda: ns.derivative(local(5), answer), "expected"),
    ):
        with pytest.raises(ns.Error, match=said):
            make()


def test_gradients_through_torch():
    torch = pytest.importorskip("torch")

    class Solve(torch.autograd.Function):
        @staticmethod
        def forward(context, q):
            problem = ns.LCP(np.eye(2), q.detach().numpy())
            answer = ns.solve(problem)
            context.at = ns.derivative(problem, answer)
            return torch.from_numpy(answer.z)

        @staticmethod
        def backward(context, g):
            return torch.from_numpy(context.at.vjp(z=g.numpy()))

    q = torch.tensor([-1.0, 1.0], dtype=torch.float64, requires_grad=True)
    Solve.apply(q).sum().backward()
    assert q.grad.tolist() == [-1.0, 0.0]
