"""Functions of Python in problems: values, Jacobians, patterns, exceptions."""

from __future__ import annotations

import contextvars
import copy
import gc
import threading
import time
import weakref

import numpy as np
import pytest
import scipy.sparse as sp

import nonsmooth as ns


def josephy(x):
    a, b, c, d = x
    return [
        3 * a * a + 2 * a * b + 2 * b * b + c + 3 * d - 6,
        2 * a * a + a + b * b + 3 * c + 2 * d - 2,
        3 * a * a + a * b + 2 * b * b + 2 * c + 3 * d - 1,
        a * a + 3 * b * b + 2 * c + 3 * d - 3,
    ]


def jacobian(x):
    a, b, c, d = x
    return np.array(
        [
            [6 * a + 2 * b, 2 * a + 4 * b, 1, 3],
            [4 * a + 1, 2 * b, 3, 2],
            [6 * a + b, a + 4 * b, 2, 3],
            [2 * a, 6 * b, 2, 3],
        ]
    )


@pytest.mark.parametrize(
    "jac",
    [None, jacobian, lambda x: sp.csr_matrix(jacobian(x)), lambda x: jacobian(x).tolist()],
)
def test_josephys_problem(jac):
    x0 = [1.0, 0.5, 0.5, 0.5]
    answer = ns.solve(ns.MCP(josephy, x0, jac=jac)).raise_if_unsolved()
    F = np.array(josephy(answer.x))
    assert (F > -1e-6).all() and (answer.x > -1e-6).all() and abs(F @ answer.x) < 1e-6
    np.testing.assert_allclose(answer.F, F, atol=1e-9)


def test_patterns():
    n = 50
    # −x'' + x³ = 1 with 0 ≤ x
    L = sp.diags([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1]).tocsr() * n**2
    calls = []

    def F(x):
        calls.append(1)
        return L @ x + x**3 - 1

    by_differences = ns.MCP(F, np.zeros(n), pattern=L)
    x = ns.solve(by_differences).raise_if_unsolved().x
    # Three colours, not n columns.
    assert len(calls) < 400
    exact = ns.MCP(F, np.zeros(n), jac=lambda x: L + sp.diags(3 * x**2))
    np.testing.assert_allclose(ns.solve(exact).raise_if_unsolved().x, x, atol=1e-7)


def test_a_jacobian_of_the_wrong_pattern_is_refused():
    with pytest.raises(ns.Error, match=r"jac\(x\)\[0, 1\]: expected zero, as the pattern says"):
        ns.MCP(lambda x: x, [1.0, 1.0], jac=lambda x: np.ones((2, 2)), pattern=np.eye(2))
    with pytest.raises(ns.Error, match=r"jac\(x\): expected 2 × 2"):
        ns.MCP(lambda x: x, [1.0, 1.0], jac=lambda x: np.ones((2, 3)))
    with pytest.raises(ns.Error, match="pattern: expected 2 × 2"):
        ns.MCP(lambda x: x, [1.0, 1.0], pattern=np.eye(3))
    with pytest.raises(ns.Error):
        ns.MCP(lambda x: x, [1.0, 1.0], jac=lambda x: [[1.0, float("nan")], [0, "x"]])


@pytest.mark.parametrize("n", [2, 400])
def test_what_a_function_raises_is_raised(n):
    failing = False

    def F(x):
        if failing:
            raise ZeroDivisionError("by nothing")
        return x**2 - 2

    problem = ns.MCP(F, np.ones(n), jac=lambda x: sp.diags(2 * x).tocsr())
    failing = True
    with pytest.raises(ZeroDivisionError, match="by nothing"):
        ns.solve(problem)
    # The problem is whole all the same.
    failing = False
    assert ns.solve(problem).solved


def test_what_is_raised_while_a_pattern_is_looked_for_ends_it():
    calls = 0

    def F(x):
        nonlocal calls
        calls += 1
        # As Ctrl-C does: once.
        if calls == 4:
            raise KeyboardInterrupt
        return x**2 - 2

    with pytest.raises(KeyboardInterrupt):
        ns.MCP(F, np.ones(30))
    assert calls == 4


def test_a_solve_hardly_asks_at_a_point_again():
    seen = []

    def F(x):
        seen.append(tuple(x))
        return x**2 - 2

    problem = ns.MCP(F, np.ones(3), jac=lambda x: np.diag(2 * x))
    for _ in range(2):
        seen.clear()
        assert ns.solve(problem).solved
        assert seen[0] == (1.0, 1.0, 1.0) and len(seen) <= 1.5 * len(set(seen))


def test_functions_of_no_use_are_refused_at_once():
    with pytest.raises(ns.Error, match=r"F\(x\): expected 2 values, found 1"):
        ns.MCP(lambda x: [1.0], [1.0, 1.0])
    with pytest.raises(ns.Error, match=r"F\(x\): expected an array of real numbers"):
        ns.MCP(lambda x: ["a", "b"], [1.0, 1.0])
    with pytest.raises(ns.Error, match=r"F\(x\)"):
        ns.MCP(lambda x: None, [1.0])
    with pytest.raises(TypeError):
        ns.MCP(lambda: [1.0], [1.0])
    with pytest.raises(ns.Error, match="x0: expected where to begin"):
        ns.MCP(lambda x: x)
    with pytest.raises(ns.Error, match="jac: expected a function"):
        ns.MCP(lambda x: x, [1.0], jac=np.eye(1))
    with pytest.raises(ns.Error, match=r"x0\[1\]: expected a finite number, found inf"):
        ns.MCP(lambda x: x, [1.0, np.inf])


def test_a_function_may_be_undefined_somewhere():
    problem = ns.MCP(lambda x: np.log(x) - 1 if x[0] > 0 else [np.nan], [0.5], lower=-np.inf)
    with np.errstate(invalid="ignore"):
        assert ns.solve(problem).x == pytest.approx([np.e])


def test_a_function_may_solve_a_problem():
    def F(x):
        inner = ns.solve(ns.LCP(np.eye(1), [-x[0]]))
        return inner.z - 2

    # With a pattern nobody looks for one with NaN.
    assert ns.solve(ns.MCP(F, [1.0], pattern=[[1]])).x == pytest.approx([2.0])


def test_no_jacobian_makes_errors_small():
    # A billion times too large, all terms of the row are.
    answer = ns.solve(ns.MCP(lambda x: x**3 - 1, [3.0, 3.0], jac=lambda x: 1e9 * np.eye(2)), max_iter=100)
    assert not answer.solved
    assert ns.solve(ns.MCP(lambda x: x**3 - 1, [3.0, 3.0], jac=lambda x: np.diag(3 * x**2))).solved
    box = ns.Box([-10.0, -10.0], [10.0, 10.0])
    assert not ns.solve(ns.VI(lambda x: x**3 - 1, box, [3.0, 3.0], jac=lambda x: 1e9 * np.eye(2)), max_iter=100).solved


def test_no_start_makes_errors_small():
    for jac in [None, lambda x: np.diag(np.exp(x))]:
        problem = ns.MCP(lambda x: np.exp(x) - 2, [50.0], lower=-np.inf, jac=jac)
        answer = ns.solve(problem)
        assert answer.solved and answer.x == pytest.approx(np.log(2), abs=1e-6)
        assert problem.judge([0.0])["solved"] is False


def test_where_a_function_fails_the_judge_looks_in_vain():
    import math

    asked = []

    def F(x):
        asked.append(x[0])
        return [math.exp(x[0]) - 2 if x[0] > 1e-4 else 1 / 0]

    # Near zero only the judge asks: no step of Newton's from 50 comes there.
    answer = ns.solve(ns.MCP(F, [50.0], lower=-np.inf, pattern=[[1]]))
    assert answer.x == pytest.approx([math.log(2)], abs=1e-6) and 0 < min(asked) < 1e-4


@pytest.mark.parametrize("n", [3, 400])
def test_nothing_is_called_after_what_was_raised(n):
    calls = failing = failed = 0

    def F(x):
        nonlocal calls
        calls += 1
        return x**3 + x - 2

    def jac(x):
        nonlocal failed
        if failing:
            failed = calls
            raise ZeroDivisionError("by nothing")
        return sp.diags(3 * x**2 + 1).tocsr()

    problem = ns.MCP(F, np.zeros(n), jac=jac)
    calls, failing = 0, 1
    with pytest.raises(ZeroDivisionError, match="by nothing"):
        ns.solve(problem)
    assert 0 < failed == calls


def test_a_step_that_leaves_the_domain_is_shortened():
    import math

    def F(x):
        return [4 * math.sqrt(x[0]) - 0.4]

    for jac in [None, lambda x: [[2 / math.sqrt(x[0])]]]:
        problem = ns.MCP(F, [4.0], lower=-np.inf, jac=jac)
        for solver in ("auto", "path", "semismooth", "newton_fb"):
            assert ns.solve(problem, solver).x == pytest.approx([0.01], abs=1e-6)
    box = ns.VI(F, ns.Box([-1.0], [5.0]), [4.0])
    assert ns.solve(box, "extragradient").x == pytest.approx([0.01], abs=1e-6)


def test_a_function_may_fail_at_probes_for_a_pattern():
    # int(nan) raises.
    problem = ns.MCP(lambda x: [x[0] - int(x[1] * 0) - 3, x[1] - 0.5 * x[0]], [0.0, 0.0], lower=-np.inf)
    assert ns.solve(problem).x == pytest.approx([3.0, 1.5])


def test_what_is_raised_in_one_thread_is_raised_there():
    n = 3

    def F(x):
        if names.get() == "bad":
            raise ZeroDivisionError("by nothing")
        time.sleep(0.01)
        return x**3 + x - 2

    names = contextvars.ContextVar("names", default="")
    problem = ns.MCP(F, np.zeros(n), jac=lambda x: sp.diags(3 * x**2 + 1).tocsr())
    came = {}

    def run(name):
        names.set(name)
        try:
            came[name] = ns.solve(problem).solved
        except ZeroDivisionError as fault:
            came[name] = str(fault)

    threads = [threading.Thread(target=run, args=(name,)) for name in ("good", "bad")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert came == {"good": True, "bad": "by nothing"}


@pytest.mark.parametrize("n", [3, 400])
def test_functions_run_in_the_context_of_the_solve(n):
    seen = set()

    def F(x):
        seen.add(np.geterr()["divide"])
        return x**3 + x - 2

    problem = ns.MCP(F, np.zeros(n), jac=lambda x: sp.diags(3 * x**2 + 1).tocsr())
    with np.errstate(divide="raise"):
        seen.clear()
        assert ns.solve(problem).solved
    assert seen == {"raise"}


def test_shapes_are_looked_at_before_memory_is_taken():
    n = 40_000
    with pytest.raises(ns.Error, match=r"jac\(x\): expected 40000 × 40000 .*, found 2 × 2"):
        ns.MCP(lambda x: x, np.zeros(n), jac=lambda x: np.zeros((2, 2)))
    for shape in ((3, 2), (3, 0), (2, 3)):
        with pytest.raises(ns.Error, match="pattern: expected 3 × 3 "):
            ns.MCP(lambda x: x**3 + x - 1, np.zeros(3), pattern=np.ones(shape))


def test_a_full_pattern_is_found_in_few_calls():
    calls, n = 0, 300
    A = np.random.default_rng(0).normal(size=(n, n)) / n

    def F(x):
        nonlocal calls
        calls += 1
        return x**3 + A @ x - 1

    problem = ns.MCP(F, np.zeros(n))
    assert calls < 3 * n
    assert ns.solve(problem).solved


def test_sets_and_settings_within_themselves_are_refused():
    inner = []
    product = ns.Product(inner)
    inner.append(product)
    with pytest.raises(ns.Error, match="products at most 64 deep"):
        ns.VI(lambda x: x, product, [0.0, 0.0])
    deep = ns.Ball([0, 0, 0], 1)
    for _ in range(10_000):
        deep = ns.Product([deep])
    with pytest.raises(ns.Error, match="products at most 64 deep"):
        ns.VI(lambda x: x, deep, [0.0, 0.0, 0.0])
    endless = []
    endless.append(endless)
    with pytest.raises(ns.Error, match="omega: expected a value of a setting, found one that is too deep"):
        ns.Nsgs(omega=endless)
    for bad, said in ((np.nan, "omega: .* found nan"), (object(), "omega: .* found <object")):
        with pytest.raises(ns.Error, match=said):
            ns.Nsgs(omega=bad)
    with pytest.raises(ns.Error, match="set.dimension: expected a whole number of at least 0, found -1"):
        ns.VI(lambda x: x, ns.SecondOrderCone(-1), [0.0])
    with pytest.raises(ns.Error, match="set.radius: expected a number, found 'a'"):
        ns.VI(lambda x: x, ns.Ball([0, 0], "a"), [0.0, 0.0])


def tripping(fault, after=3):
    """A problem whose F fails once it has been called so often."""
    calls = 0

    def F(x):
        nonlocal calls
        calls += 1
        if calls > after:
            return fault()
        return x**3 - 1

    return ns.MCP(F, [5.0], jac=lambda x: np.diag(3 * x**2))


def raising(fault):
    raise fault


@pytest.mark.parametrize("solver", ["semismooth", "path", "auto", "newton_min"])
@pytest.mark.parametrize("after", range(1, 6))
def test_what_says_nothing_of_x_is_raised_wherever_it_comes_up(solver, after):
    for fault, kind, said in (
        (lambda: raising(MemoryError("none left")), MemoryError, "none left"),
        (lambda: raising(RecursionError("too deep")), RecursionError, "too deep"),
        (lambda: nobody_knows_this, NameError, "nobody_knows_this"),  # noqa: F821
        (lambda: np.zeros(7), ns.Error, r"F\(x\): expected 1 values, found 7"),
        (lambda: None, ns.Error, r"F\(x\): expected"),
    ):
        with pytest.raises(kind, match=said):
            ns.solve(tripping(fault, after), solver)


def test_an_unsolved_answer_names_the_first_point_that_was_none():
    def F(x):
        if x[0] != 4.0:
            raise ValueError("no such temperature\nindeed")
        return [0.5]

    problem = ns.MCP(F, [4.0], lower=-np.inf, jac=lambda x: [[1.0]])
    for solver in ("auto", "path", "semismooth"):
        answer = ns.solve(problem, solver)
        (said,) = [line for line in answer.account if "raised" in line]
        assert not answer.solved and said.startswith("F or jac raised at ")
        assert said.endswith("; first ValueError: no such temperature")


def test_where_numbers_become_complex_a_function_is_not_defined():
    def F(x):
        # Of Python's numbers, the root of a negative one.
        return [4 * float(x[0]) ** 0.5 - 0.4]

    problem = ns.MCP(F, [4.0], lower=-np.inf, pattern=[[1]])
    answer = ns.solve(problem)
    assert answer.x == pytest.approx([0.01], abs=1e-6)
    assert not [line for line in answer.account if "raised" in line]


def test_what_a_function_raises_is_raised_by_the_judge_too(tmp_path):
    fault = None

    def F(x):
        return x - 1 if fault is None else fault()

    problem, path = ns.MCP(F, np.zeros(2), jac=lambda x: np.eye(2)), tmp_path / "p.csv"
    answer = ns.solve(problem)
    for fault, kind, said in (
        (lambda: raising(ValueError("no such x")), ValueError, "no such x"),
        (lambda: raising(MemoryError("none left")), MemoryError, "none left"),
        (lambda: raising(KeyboardInterrupt()), KeyboardInterrupt, None),
        (lambda: nobody_knows_this, NameError, "nobody_knows_this"),  # noqa: F821
        (lambda: np.zeros(7), ns.Error, r"F\(x\): expected 2 values, found 7"),
    ):
        for ask in (
            lambda: problem.judge(answer),
            lambda: problem.judge(answer.x),
            lambda: problem.save(path, answer.x),
        ):
            with pytest.raises(kind, match=said):
                ask()
    assert not path.exists()
    fault = None
    assert problem.judge(answer)["solved"]


@pytest.mark.parametrize("n", [3, 400])
def test_what_is_raised_where_it_was_asked_ends_nothing_else(n):
    bad = contextvars.ContextVar("bad", default=False)
    asked, came = [], []

    def elsewhere(ask):
        def run():
            bad.set(True)
            try:
                ask()
            except ZeroDivisionError as fault:
                came.append(str(fault))

        thread = threading.Thread(target=run)
        thread.start()
        thread.join()

    def called(found):
        if bad.get():
            raise ZeroDivisionError("by nothing")
        if asked:
            elsewhere(asked.pop())
        return found

    problem = ns.MCP(
        lambda x: called(x**3 + x - 2), np.zeros(n), jac=lambda x: called(sp.diags(3 * x**2 + 1).tocsr())
    )
    answer = ns.solve(problem)
    judge, *_ = asks = (
        lambda: problem.judge(answer)["solved"],
        lambda: ns.solve(problem).solved,
        lambda: ns.derivative(problem, answer).degenerate == 0,
    )
    for mine in asks:
        # Two that are on threads of the library's own are not told apart.
        for other in asks if n < 300 or mine is judge else [judge]:
            asked.append(other)
            assert mine() and came.pop() == "by nothing"


class Model:
    """Holds a problem whose functions are its own."""

    def __init__(self):
        self.problem = ns.MCP(self.F, [0.0], jac=self.J)
        self.answer = self.copied = None

    def F(self, x):
        return x - 1

    def J(self, x):
        return np.eye(1)


@pytest.mark.parametrize("held", ["problem", "answer", "copy", "all"])
def test_an_object_whose_functions_are_its_problem_is_freed(held):
    gone = []
    for _ in range(5):
        model = Model()
        model.answer, model.copied = ns.solve(model.problem), copy.copy(model.problem)
        assert model.answer.solved and ns.solve(model.copied).solved
        # What is kept alone keeps the functions.
        if held in ("answer", "copy"):
            model.problem = None
            gc.collect()
        if held in ("problem", "copy"):
            model.answer = None
        if held in ("problem", "answer"):
            model.copied = None
        if held == "copy":
            assert ns.solve(model.copied).x == pytest.approx([1.0])
        gone.append(weakref.ref(model))
        del model
    gc.collect()
    assert [model() for model in gone] == [None] * 5
    # The problem alone keeps what it needs.
    problem = Model().problem
    gc.collect()
    assert ns.solve(problem).x == pytest.approx([1.0])
