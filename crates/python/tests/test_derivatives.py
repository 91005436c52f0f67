"""Derivatives against finite differences at nondegenerate solutions."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import local, spd

import nonsmooth as ns

TOL = 1e-13
SLACK = float(os.environ.get("NONSMOOTH_SLACK", "1"))
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


@pytest.mark.parametrize("seed", range(3))
def test_inequalities_over_sets(seed):
    rng = np.random.default_rng(seed)
    n = 11
    M, q = unsymmetric(n, seed), 3 * rng.normal(size=n)

    def make(
        lower=np.full(2, -0.1),
        upper=np.full(2, 0.1),
        A=rng.normal(size=(3, 4)),
        b=rng.uniform(0.02, 0.1, size=3),
        C=rng.normal(size=(1, 4)),
        d=np.array([0.05]),
        centre=0.1 * rng.normal(size=2),
        radius=np.array([0.3]),
        q=q,
    ):
        sets = [ns.Box(lower, upper), ns.Polyhedron(A, b, C, d), ns.Ball(centre, radius[0]), ns.SecondOrderCone(3)]
        F = lambda x: M @ x + 0.5 * x**3 + q
        return ns.VI(F, ns.Product(sets), np.zeros(n), jac=lambda x: M + np.diag(1.5 * x**2))

    data = dict(zip(make.__code__.co_varnames, make.__defaults__))
    del data["q"]
    answer = check(make, data, seed)
    assert answer.counts["border"] > 0
    by = ns.derivative(make(), answer)
    d = rng.normal(size=n)
    ahead, behind = (point(make(q=q + s * H * d)) for s in (1, -1))
    np.testing.assert_allclose(by.jvp(d)["x"], (ahead.x - behind.x) / (2 * H), atol=1e-6)


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


@pytest.fixture(scope="module")
def grid():
    """A problem whose factorisation takes a second or more in one call, with its answer."""
    m = 32
    one = sp.diags([-np.ones(m - 1), 2 * np.ones(m), -np.ones(m - 1)], [-1, 0, 1])
    M = sp.csr_matrix(sp.kronsum(sp.kronsum(one, one), one) + sp.identity(m**3))
    problem = ns.LCP(M, -(M @ np.ones(m**3)))
    answer = ns.solve(problem, tol=1e-10)
    threads = native_threads()
    yield problem, answer
    # What was given up ends by itself, and takes memory until then: other tests measure that.
    begun = time.perf_counter()
    while native_threads() > threads and time.perf_counter() - begun < 120:
        time.sleep(0.05)
    assert native_threads() <= threads


def native_threads():
    tasks = "/proc/self/task"
    return len(os.listdir(tasks)) if os.path.exists(tasks) else 0


def test_a_derivative_has_a_time_limit(grid):
    begun = time.perf_counter()
    with pytest.raises(ns.Error, match="expected time for a factorisation, found its limit"):
        ns.derivative(*grid, time_limit=0.1)
    assert time.perf_counter() - begun < 0.11 + 0.2 * SLACK
    with pytest.raises(ns.Error, match="time_limit: expected a number of seconds of at least 0"):
        ns.derivative(*grid, time_limit=-1.0)


def test_one_ctrl_c_ends_a_derivative(grid):
    begun = time.perf_counter()
    timer = threading.Timer(0.1, os.kill, [os.getpid(), signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        ns.derivative(*grid)
    assert time.perf_counter() - begun < 0.11 + 0.2 * SLACK
    timer.join()


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


def test_parameters_and_their_directions_are_looked_at():
    problem = ns.MCP(["x1 - 1", "x2 - 2"], [0.0, 0.0])
    answer = ns.solve(problem)
    parameters = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 0.0]])
    for given in (parameters, parameters.tolist(), sp.coo_matrix(parameters)):
        by = ns.derivative(problem, answer, parameters=given)
        np.testing.assert_allclose(by.jvp([1.0, 2.0, 3.0])["x"], -parameters @ [1.0, 2.0, 3.0], atol=1e-9)
        np.testing.assert_allclose(by.vjp(x=[1.0, 1.0]), -parameters.sum(axis=0), atol=1e-9)
        with pytest.raises(ns.Error, match=r"dp: expected 3 entries \(columns of parameters\), found an array of \(1,\)"):
            by.jvp([1.0])
        with pytest.raises(ns.Error, match="dp: expected an array of real numbers"):
            by.jvp(["a"] * 3)
    for wrong in ([["1.0"], ["2.0"]], parameters * 1j, sp.csr_matrix(parameters * 1j)):
        with pytest.raises(ns.Error, match="parameters.*: expected an array of real numbers"):
            ns.derivative(problem, answer, parameters=wrong)
    with pytest.raises(ns.Error, match="parameters: expected 2 rows"):
        ns.derivative(problem, answer, parameters=np.eye(3))


def test_gradients_through_torch():
    torch = pytest.importorskip("torch")
    M, n = unsymmetric(8, 3), 8

    class Solve(torch.autograd.Function):
        @staticmethod
        def forward(context, q):
            problem = ns.LCP(M, q.detach().numpy())
            answer = ns.solve(problem, tol=TOL)
            context.at = ns.derivative(problem, answer, "q")
            return torch.from_numpy(answer.z), torch.from_numpy(answer.w)

        @staticmethod
        @torch.autograd.function.once_differentiable
        def backward(context, of_z, of_w):
            return torch.from_numpy(context.at.vjp(z=of_z.numpy(), w=of_w.numpy()))

    q = torch.tensor(np.random.default_rng(3).normal(size=n), requires_grad=True)
    assert 0 < int((Solve.apply(q)[0] > 0).sum()) < n
    assert torch.autograd.gradcheck(Solve.apply, (q,), eps=1e-6, atol=1e-6)
    # Through what torch has before and after it.
    loss = (Solve.apply(2.0 * q)[0] ** 2).sum()
    loss.backward()
    h = 1e-6
    d = torch.tensor(np.random.default_rng(4).normal(size=n))
    with torch.no_grad():
        ahead, behind = (((Solve.apply(2.0 * (q + s * h * d))[0]) ** 2).sum() for s in (1, -1))
    assert float(q.grad @ d) == pytest.approx(float(ahead - behind) / (2 * h), abs=1e-6)


def test_a_pattern_that_lacks_a_variable_at_the_solution_is_noticed():
    def f(x):
        return np.array([x[0] + 2 * max(0.0, x[1] - 10) - 3, x[1] - 12.0, x[2] + x[0] - 5])

    def make(**more):
        problem = ns.MCP(f, np.zeros(3), lower=-np.inf, **more)
        return problem, ns.solve(problem, tol=1e-12)

    with pytest.raises(ns.Error, match="row 1 of F: expected to depend at the solution on the variables of its pattern alone"):
        ns.derivative(*make(), "F")
    by_pattern = ns.derivative(*make(pattern=np.ones((3, 3))), "F").matrix("x")
    by_jacobian = ns.derivative(*make(jac=lambda x: np.array([[1, 2.0, 0], [0, 1, 0], [1, 0, 1.0]])), "F").matrix("x")
    np.testing.assert_allclose(by_pattern, by_jacobian, atol=1e-7)
    np.testing.assert_allclose(by_jacobian, [[-1, 2, 0], [0, -1, 0], [1, -2, -1]], atol=1e-12)


def test_near_the_tip_of_a_cone():
    A = np.array([[10.0, -4.0, -2.0], [-4.0, 5.0, 4.0], [-2.0, 4.0, 9.0]])
    F = np.array([0.9999999315138433, -0.9999999981764645, -2.2012579473350878e-10])
    problem = ns.VI(lambda x: A @ x + F, ns.SecondOrderCone(3), np.zeros(3), jac=lambda x: A)
    rough, fine = (ns.solve(problem, **how) for how in ({}, {"tol": 1e-15}))
    assert np.abs(fine.x).max() < 1e-7
    there = ns.derivative(problem, fine, tol=1e-13).matrix("x")
    np.testing.assert_allclose(ns.derivative(problem, rough).matrix("x"), there, atol=1e-5)
