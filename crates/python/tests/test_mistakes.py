"""Bad input gets an exception with one clear sentence, whatever it is."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import nonsmooth as ns

EYE = np.eye(3)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ns.LCP(EYE, [1.0, 2.0]), "q: expected 3"),
        (lambda: ns.LCP(EYE[:2], [1.0, 2.0]), "M: expected 2 × 2"),
        (lambda: ns.LCP(EYE, [1.0, np.nan, 0.0]), r"q\[1\]: expected a finite number, found NaN"),
        (lambda: ns.LCP(np.full((3, 3), np.inf), [1.0, 1.0, 0.0]), r"M\[0, 0\]"),
        (lambda: ns.LCP(EYE + 1j, [1.0, 1.0, 0.0]), "M: expected an array of real numbers, found complex128"),
        (lambda: ns.LCP([["a"]], [1.0]), "M: expected an array of real numbers"),
        (lambda: ns.LCP([[1.0], [1.0, 2.0]], [1.0]), "M: expected an array of real numbers"),
        (lambda: ns.LCP(EYE, None), "q: expected this part, found nothing"),
        (lambda: ns.LCP(EYE, 1.0), "q: expected an array of one dimension, found a number"),
        (lambda: ns.LCP(EYE, EYE), "q: expected an array of one dimension, found an array of 3 × 3"),
        (lambda: ns.LCP([], []), "M: expected a matrix, found an array of 0"),
        (lambda: ns.LCP(np.zeros((0, 0)), []), "M: expected at least one row, found none"),
        (lambda: ns.LCP(object(), [1.0]), "M: expected an array of real numbers, found object"),
        (lambda: ns.Friction(W=EYE, q=[1, 2, 3], mu=-0.1), "mu"),
        (lambda: ns.Friction(W=EYE, q=[1, 2, 3], mu=[0.1] * 2), "q: expected 2 or 3 components"),
        (lambda: ns.Friction(W=EYE[:2], q=[1, 2, 3], mu=0.1), "W: expected rows and columns by 3"),
        (lambda: ns.Friction(W=np.eye(6), q=[1, 2, 3], mu=0.1), "W: expected 3 × 3"),
        (lambda: ns.Friction(W=EYE, q=[1, 2, 3]), "mu: expected this part"),
        (lambda: ns.Friction(W=np.eye(4), q=[1, 2, 3, 4], mu=0.1), "q: expected 3 components for each contact, or dimension=2"),
        (lambda: ns.Friction(M=EYE, H=EYE, f=[1.0] * 3, mu=0.1), "w: expected this part, found nothing"),
        (lambda: ns.Friction(M=EYE, H=EYE, f=[1.0] * 3, mu=[0.1]), "w: expected this part, found nothing"),
        (lambda: ns.Friction(M=EYE, H=EYE, f=[1.0] * 3, w=[1.0] * 3, mu=0.1, G=EYE), "b: expected this part beside G, found nothing"),
        (lambda: ns.Friction(W=EYE, q=[1, 2, 3], mu=0.1, R=EYE), "s: expected this part beside R, found nothing"),
        (lambda: ns.Friction(W=EYE, mu=0.3), "q: expected this part, found nothing"),
        (lambda: ns.Friction(W=EYE, M=EYE, q=[1, 2, 3], mu=0.1), "Friction: expected W, q and mu, or"),
        (lambda: ns.Friction(W=EYE, q=[1, 2, 3], mu=0.1, b=[1.0]), "b: expected one of the parts"),
        (lambda: ns.Friction(W=EYE, q=[1, 2, 3], mu=0.1, lower=0), "lower: expected a problem with scalar rows"),
        (lambda: ns.Friction(), "M: expected this part, found nothing"),
        (lambda: ns.Friction(W=EYE, q=[[[1]]], mu=0.1), "q: expected an array of one dimension, or"),
        (lambda: ns.MLCP(EYE, [1.0] * 3, free=-1), "free: expected a whole number of at least 0, found -1"),
        (lambda: ns.MLCP(EYE, [1.0] * 3, free=1, A=EYE), "expected either M, q and free, or"),
        (lambda: ns.BoxLCP(EYE, [1.0] * 3, [1] * 3, [0] * 3), "expected"),
        (lambda: ns.VI(["x1"], "disk"), "set: expected a set"),
        (lambda: ns.VI(["x1"], ns.Ball([0.0], -1.0)), "radius"),
        (lambda: ns.MCP(["x1 +"], [1.0]), "F"),
        (lambda: ns.MCP([1.0], [1.0]), r"F\[0\]: expected an expression, found 1.0"),
        (lambda: ns.VI(["x1", None], ns.Ball([0.0] * 2, 1.0)), r"F\[1\]: expected an expression, found None"),
        (lambda: ns.MCP("12"), "F: expected a function, or a list of expressions, found '12'"),
        (lambda: ns.VI("1", ns.Ball([0.0], 1.0)), "F: expected a function, or a list of expressions, found '1'"),
        (lambda: ns.MCP(None), "F: expected a function, or a list of expressions, found None"),
        (lambda: ns.VI(["x1"], ns.Polyhedron(None, [1.0])), "set.A: expected an array of real numbers"),
        (lambda: ns.VI(["x1"], ns.Polyhedron([["a"]], [1.0])), "set.A: expected an array of real numbers"),
        (lambda: ns.VI(["x1"], ns.Polyhedron([["5"]], [1.0])), "set.A: expected an array of real numbers"),
        (lambda: ns.VI(["x1"], ns.Polyhedron([1.0], [1.0])), "set.A: expected a matrix, found an array of 1"),
        (lambda: ns.VI(["x1"], ns.Product(5)), "set.sets: expected a list of sets, found int"),
        (lambda: ns.BoxLCP(np.eye(2), [[1], [2, 3]]), "q: expected an array of real numbers"),
        (lambda: ns.Friction(W=sp.csr_matrix([[np.nan, 0], [0, 1]]), q=[1, 2], mu=[0.1]), r"W\[0, 0\]: expected a finite number"),
        (lambda: ns.Friction(W=EYE, q=[1, 2, np.inf], mu=0.1), r"q\[2\]: expected a finite number"),
        (lambda: ns.Friction(W=EYE, q=[1, 2, 3], mu=np.nan), r"mu\[0\]"),
        (lambda: ns.BoxLCP(EYE, [1.0] * 3, [np.nan] * 3, [0] * 3), r"\[0\]"),
        (lambda: ns.HLCP(EYE, np.eye(2), [1.0] * 3), "R: expected 3 × 3 .as Q., found 2 × 2"),
        (lambda: ns.Friction(M=EYE, H=np.eye(2), f=[1.0] * 3, w=[1.0] * 3, mu=0.1), "H: expected 3 × 3"),
        (lambda: ns.Friction(M=EYE, H=EYE, f=[1.0] * 3, w=[1.0] * 3, mu=0.1, b=[0.0]), "G: expected this part"),
        (lambda: ns.LCP(sp.csr_matrix((0, 0)), []), "M: expected at least one row, found none"),
        (lambda: ns.LCP(sp.csr_matrix(EYE * 1j), [1.0] * 3), "M: expected an array of real numbers, found complex128"),
        (lambda: ns.LCP(np.array([[1.0, object()], [0, 1]]), [1.0] * 2), "M: expected an array of real numbers"),
        (lambda: ns.LCP(np.array(["2020-01-01"], dtype="M8[D]"), [1.0]), "M: expected an array of real numbers"),
    ],
)
def test_mistakes_are_one_sentence(make, said):
    with pytest.raises(ns.Error, match=said) as caught:
        make()
    assert "\n" not in str(caught.value) and isinstance(caught.value, ValueError)


@pytest.mark.parametrize(
    "layout", ["readonly", "strided", "reversed", "transposed", "swapped", "readonly csr", "strided csr"]
)
def test_layouts_of_arrays_are_taken(layout):
    m, q = np.arange(9.0).reshape(3, 3) + 9 * EYE, np.array([-1.0, 2.0, -3.0])
    if layout == "strided":
        m_given, q_given = np.repeat(np.repeat(m, 2, 0), 3, 1)[::2, ::3], np.repeat(q, 4)[::4]
    elif layout == "reversed":
        m_given, q_given = m[::-1, ::-1].copy()[::-1, ::-1], q[::-1].copy()[::-1]
    elif layout == "transposed":
        m_given, q_given = m.T.copy().T, q
    elif layout == "swapped":
        m_given, q_given = m.astype(">f8"), q.astype(">f4")
    elif layout == "strided csr":
        m_given, q_given = sp.csr_matrix(m), q
        m_given.data = np.repeat(m_given.data, 2)[::2]
        m_given.indices = np.repeat(m_given.indices, 2)[::2]
    else:
        m_given, q_given = (sp.csr_matrix(m) if "csr" in layout else m.copy()), q.copy()
        arrays = (m_given.data, m_given.indices, m_given.indptr) if "csr" in layout else (m_given,)
        for array in (*arrays, q_given):
            array.flags.writeable = False
    problem = ns.LCP(m_given, q_given)
    M = problem.M.toarray() if sp.issparse(problem.M) else problem.M
    np.testing.assert_array_equal(M, m)
    np.testing.assert_array_equal(problem.q, q)
    again = ns.Friction(W=m_given, q=q_given, mu=0.5)
    np.testing.assert_array_equal(again.W.toarray(), m)


@pytest.mark.parametrize(
    ("start", "said"),
    [
        ([1.0], "warm_start"),
        ([[1.0, 2.0, 3.0]], "warm_start"),
        ([np.nan, 0.0, 0.0], "finite"),
        (dict(w=[1.0, 2.0, 3.0]), "z: expected this part"),
        (dict(z=[1.0, 2.0, 3.0], zz=3), "warm_start: expected the parts z, w of a point, found zz"),
        ("here", "warm_start: expected an array of real numbers"),
    ],
)
def test_warm_starts_that_are_none_are_refused(start, said):
    with pytest.raises(ns.Error, match=said):
        ns.solve(ns.LCP(EYE, -np.ones(3)), warm_start=start)


def test_updates_that_do_not_fit_change_nothing():
    problem = ns.LCP(EYE, -np.ones(3))
    for parts in (dict(q=[1.0]), dict(q=[np.nan] * 3), dict(M=np.eye(2)), dict(r=[1.0] * 3)):
        with pytest.raises(ns.Error, match="expected"):
            problem.update(**parts)
    np.testing.assert_array_equal(problem.q, -np.ones(3))
    assert ns.solve(problem).z == pytest.approx(np.ones(3))


def test_damaged_sparse_matrices_are_refused():
    for damage in ("indptr", "indices", "data", "order"):
        matrix = sp.csr_matrix(EYE)
        if damage == "indptr":
            matrix.indptr = np.array([0, 2, 1, 3], dtype=np.int32)
        elif damage == "indices":
            matrix.indices = np.array([0, 7, 2], dtype=np.int32)
        elif damage == "data":
            matrix.data = np.ones(2)
        else:
            matrix.indices = np.array([0, -1, 2], dtype=np.int32)
        with pytest.raises(ns.Error, match="M"):
            ns.LCP(matrix, np.ones(3))


def test_wrong_objects_are_refused(tmp_path):
    with pytest.raises(ns.Error, match="problem: expected a problem"):
        ns.solve("a problem")
    for wrong in (3, None, b"p.toml"):
        for make in (ns.read, ns.read_runs, ns.load, ns.LCP(EYE, -np.ones(3)).save):
            with pytest.raises(ns.Error, match="path: expected the path of a file, found"):
                make(wrong)


kinds = hnp.scalar_dtypes()
arrays = hnp.arrays(
    dtype=kinds | st.just(np.dtype(float)),
    shape=hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)


@settings(max_examples=300, deadline=None)
@given(m=arrays, q=arrays)
def test_any_arrays_give_a_problem_or_an_error(m, q):
    try:
        problem = ns.LCP(m, q)
    except ns.Error as error:
        assert "expected" in str(error) and "\n" not in str(error)
        return
    assert m.ndim == 2 and m.shape[0] == m.shape[1] == q.size
    assert np.isfinite(problem.M).all() and np.isfinite(problem.q).all()
    np.testing.assert_array_equal(problem.M, m.astype(float))


@settings(max_examples=200, deadline=None)
@given(w=arrays, q=arrays, mu=arrays)
def test_any_arrays_give_contacts_or_an_error(w, q, mu):
    try:
        problem = ns.Friction(W=w, q=q, mu=mu)
    except ns.Error as error:
        assert "expected" in str(error) and "\n" not in str(error)
        return
    assert problem.unknowns == q.size and (problem.mu >= 0).all()


@settings(max_examples=200, deadline=None)
@given(
    n=st.integers(1, 4),
    found=arrays | st.none() | st.text(max_size=3) | st.lists(st.floats(), max_size=4),
    from_jac=st.booleans(),
)
def test_a_function_may_give_anything(n, found, from_jac):
    calls = [0]

    def late(good):
        calls[0] += 1
        return good if calls[0] == 1 else found

    F = (lambda x: x - 1) if from_jac else (lambda x: late(x - 1))
    jac = (lambda x: late(np.eye(n))) if from_jac else (lambda x: np.eye(n))
    problem_of = lambda: ns.MCP(F, np.full(n, 3.0), jac=jac, lower=-np.inf)  # noqa: E731
    try:
        answer = ns.solve(problem_of(), max_iter=20)
    except ns.Error as error:
        assert ("F(x)" in str(error) or "jac(x)" in str(error)) and "\n" not in str(error)
        return
    assert isinstance(answer.status, ns.Status)


# Entries of 1e-300 beside others of 1 are solved, but nothing says that all solvers do.
numbers = st.integers(-2000, 2000).map(lambda k: k / 1000)


@settings(max_examples=100, deadline=None)
@given(
    n=st.integers(1, 6),
    data=st.data(),
    layout=st.sampled_from(["C", "F", "strided", "csr", "csc", "coo"]),
)
def test_layouts_do_not_matter(n, data, layout):
    m = data.draw(hnp.arrays(float, (n, n), elements=numbers)) + 4 * n * np.eye(n)
    q = data.draw(hnp.arrays(float, n, elements=numbers))
    if layout == "strided":
        big = np.zeros((2 * n, 3 * n))
        big[::2, ::3] = m
        given_m = big[::2, ::3]
    elif layout in "CF":
        given_m = np.array(m, order=layout)
    else:
        given_m = sp.csr_matrix(m).asformat(layout)
    answer = ns.solve(ns.LCP(given_m, q))
    reference = ns.solve(ns.LCP(m, q))
    assert answer.solved and reference.solved
    # M is strictly diagonally dominant: one solution.
    np.testing.assert_allclose(answer.z, reference.z, atol=1e-6)


def test_points_have_the_shape_and_the_parts_of_the_problem():
    problem = ns.Friction(W=np.eye(12), q=np.arange(-12.0, 0.0), mu=0.3)
    for wrong in (
        lambda: problem.update(q=np.zeros((3, 4))),
        lambda: problem.judge(np.zeros((3, 4))),
        lambda: ns.solve(problem, warm_start=np.zeros((3, 4))),
        lambda: ns.Friction(W=np.eye(15), q=np.ones((5, 3)), mu=0.5, mu_r=0.1),
    ):
        with pytest.raises(ns.Error, match="components for each contact, found rows of"):
            wrong()
    for point in ({"R": np.zeros(12)}, {"r": np.zeros(12), "rr": np.zeros(12)}):
        with pytest.raises(ns.Error, match="expected the parts r, u, l of a point"):
            problem.judge(point)
    answer = ns.solve(problem)
    assert ns.solve(problem, warm_start=answer.parts).solved
    assert problem.judge({"r": answer.r.reshape(4, 3)})["solved"]


def test_what_does_not_fit_in_memory_is_refused():
    for n in (2**40, 2**60):
        huge = sp.coo_array(([1.0], ([0], [0])), shape=(n, n))
        with pytest.raises(ns.Error, match="fits in memory"):
            ns.LCP(huge, [1.0, 2.0])


def test_a_mask_is_not_passed_over():
    with pytest.raises(ns.Error, match="q: expected .* masked"):
        ns.LCP(np.eye(2), np.ma.masked_array([-1.0, -5.0], [0, 1]))


def test_settings_are_checked_where_they_are_set():
    solver = ns.Nsgs()
    solver.omega = 0.5
    assert solver.settings == {"omega": 0.5} and solver.omega == 0.5
    with pytest.raises(ns.Error, match="omega"):
        solver.omega = -1.0
    with pytest.raises(AttributeError, match="no setting omeag"):
        solver.omeag = 0.5
    assert solver.omega == 0.5


def test_tolerances_of_a_comparison_are_those_of_a_solve():
    problem = ns.LCP(np.eye(2), [-1.0, 1.0])
    for wrong in ({"tol": 2.0}, {"tol": 0.0}, {"tol": [1e-8, -1.0]}, {"time_limit": -1.0}):
        with pytest.raises(ns.Error, match="tol: expected|time_limit: expected"):
            ns.bench({"one": problem}, **wrong)
    assert ns.bench({"one": problem}, tol=np.float32(1e-4), repeats=1)


ONE = ns.LCP(EYE, [-1.0, -1.0, -1.0])
SOLVED = ns.solve(ONE)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: ns.solve(ONE, max_iter=-1), "max_iter: expected a whole number of at least 0, found -1"),
        (lambda: ns.solve(ONE, max_iter=1.5), "max_iter: expected a whole number of at least 0, found 1.5"),
        (lambda: ns.solve(ONE, threads=-1), "threads: expected a whole number"),
        (lambda: ns.solve(ONE, tol="a"), "tol: expected a number, found 'a'"),
        (lambda: ns.solve(ONE, tol=None), "tol: expected a number, found None"),
        (lambda: ns.solve(ONE, time_limit="1"), "time_limit: expected a number, found '1'"),
        (lambda: ns.solve(ONE, tolerance=1e-6), "unknown key `tolerance`.*; solve has the argument `tol`"),
        (lambda: ns.solve(ONE, timeout=1.0), "unknown key `timeout`.*; solve has the argument `time_limit`"),
        (lambda: ns.solve(ONE, None), "solver: expected a name or an object of settings"),
        (lambda: ns.solve(ONE, ns.Nsgs), r"solver: expected an object, nonsmooth.Nsgs\(\)"),
        (lambda: ns.solve(ONE, callback=3), "callback: expected a function"),
        (lambda: ns.solve(3), "problem: expected a problem"),
        (lambda: ns.solvers("foo"), "problem: expected a problem, or one of the kinds .*lcp.*, found 'foo'"),
        (lambda: ns.solvers(3), "problem: expected a problem, or one of the kinds"),
        (lambda: ns.bench([ONE], ["auto"], repeats=-1), "repeats: expected a whole number"),
        (lambda: ns.bench([ONE], [None]), "solver: expected a name"),
        (lambda: ns.bench([ONE], tol="a"), "tol: expected a number"),
        (lambda: ns.Simulation(ns.World(), h="a"), "h: expected a number"),
        (lambda: ns.Simulation(ns.World(), solver=3), "solver: expected a name"),
        (lambda: ns.Simulation(ns.World(), tol="a"), "tol: expected a number"),
        (lambda: ns.Simulation(ns.World(), settle="yes"), "settle: expected True or False, found 'yes'"),
        (lambda: ns.World(gravity="abc"), "gravity: expected an array of real numbers"),
        (lambda: ns.World(gravity=np.eye(3)), "gravity: expected an array of one dimension"),
        (lambda: ns.World().couple([1]), r"weights: expected a dictionary .*, found \[1\]"),
        (lambda: ONE.judge(np.ones(3), "x"), "tol: expected a number, found 'x'"),
        (lambda: ns.derivative(None, SOLVED), "problem: expected a problem .*, found None"),
        (lambda: ns.derivative(ONE, SOLVED.z), r"answer: expected an answer of nonsmooth.solve, found array"),
        (lambda: ns.derivative(ONE, SOLVED, tol="x"), "tol: expected a number, found 'x'"),
        (lambda: ns.derivative(ONE, SOLVED, time_limit="x"), "time_limit: expected a number, found 'x'"),
        (lambda: ns.derivative(ONE, SOLVED, ["q"]), r"with_respect_to: expected one of q, M, found \['q'\]"),
        (lambda: ns.derivative(ONE, SOLVED).matrix(["z"]), r"part: expected one of z, w, found \['z'\]"),
        (lambda: ns.bench(ONE), "problems: expected a list of problems .*, found <LCP"),
        (lambda: ns.bench("x.hdf5"), "problems: expected a list of problems .*, found 'x.hdf5'"),
        (lambda: ns.bench({1: ONE}), "problems: expected names that are texts, found 1"),
        (lambda: ns.bench({"one": 5}), r"problems\['one'\]: expected a problem .*, found 5"),
        (lambda: ns.bench([ONE, 5]), r"problems\[1\]: expected a problem, or the path of a file, found 5"),
        (lambda: ns.bench([ONE], repeats=0).profile().at("x", 1.0), "solver: expected one of auto, found x"),
        (lambda: ns.bench([ONE], repeats=0).profile().at("auto", "x"), "tau: expected a number, found 'x'"),
    ],
)
def test_arguments_are_named(call, said):
    with pytest.raises(ns.Error, match=said) as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"position": np.ma.array([0, 0, 1.0], mask=[0, 1, 0])}, "position: expected numbers, found a masked array"),
        ({"position": [0, np.ma.masked, 1]}, r"position\[1\]: expected numbers, found a masked number"),
        ({"position": [0, None, 1]}, r"position\[1\]: expected numbers .*found None"),
        ({"position": np.array([0, None, 1])}, "position: expected an array of numbers, found one of object"),
        ({"motion": {"amplitude": None}}, "amplitude|motion"),
        ({"groups": (word for word in "ab")}, "groups: expected numbers, words and lists, found generator"),
        ({"groups": {"a"}}, "groups: expected numbers, words and lists, found set"),
        ({"shape": {"kind": "sphere", "radius": object()}}, "radius: expected numbers, words and lists, found object"),
    ],
)
def test_what_a_table_holds_is_looked_at_where_it_is_given(table, said):
    with pytest.raises(ns.Error, match=said):
        world = ns.World()
        world.body(**{"shape": {"kind": "sphere", "radius": 0.1}, "density": 1.0, **table})
        ns.Simulation(world)


def test_whole_numbers_may_be_written_as_floats():
    assert ns.solve(ONE, max_iter=1e3, threads=np.int64(1)).solved
    assert ns.solve(ONE, max_iter=10**30, time_limit=np.float32(5.0)).solved


def test_points_are_looked_at_whole():
    contact = ns.Friction(W=EYE, q=[-1.0, 2.0, 1.5], mu=0.5)
    for point, said in (
        ({"u": [0.0, 0.0, 0.0]}, "r: expected this part"),
        ({}, "r: expected this part"),
        ({"r": np.ones(3), "v": 3}, "point: expected the parts r, u, l of a point, found v"),
        (None, "point: expected"),
    ):
        with pytest.raises(ns.Error, match=said):
            contact.judge(point)
    for tol in (np.inf, -1.0, np.nan, 0.0):
        with pytest.raises(ns.Error, match="tol"):
            contact.judge(np.ones(3), tol)


def test_wrong_objects_are_named():
    scene = ns.World()
    for make, said in (
        (lambda: ns.Simulation("a.toml"), "world: expected a nonsmooth.World"),
        (lambda: ns.draw(None), "scene: expected a nonsmooth.World"),
        (lambda: ns.Proximal(None), "solver: expected a name or an object of settings"),
        (lambda: ns.bench({}).profile(), "kind: expected a kind of the runs"),
    ):
        with pytest.raises(ns.Error, match=said):
            make()
    with pytest.raises(TypeError, match="expected one of its kinds"):
        ns.Problem()
    assert scene.copy() is not scene


AT_ONE = ns.MCP(["x1 - 1"], [0.0])


class Masked(np.ma.MaskedArray):
    """A class of its own."""


@pytest.mark.parametrize(
    "given",
    [
        np.ma.masked,
        np.ma.masked_array([0.1], [1]),
        Masked([0.1], mask=[1]),
        [np.ma.masked],
        (np.ma.masked_array(0.1, True),),
    ],
    ids=["masked", "array", "subclass", "list", "tuple"],
)
def test_masks_of_any_kind_are_refused(given):
    for make in (
        lambda: ns.Friction(W=EYE, q=[-1.0, 0.0, 0.0], mu=given),
        lambda: ns.BoxLCP([[1.0]], [1.0], given),
        lambda: ns.MCP(["x1"], [0.0], lower=given),
        lambda: ns.LCP([given], [1.0]),
        lambda: ns.VI(["x1"], ns.Polyhedron([given], [1.0])),
        lambda: ns.derivative(AT_ONE, ns.solve(AT_ONE), parameters=[given]),
    ):
        with pytest.raises(ns.Error, match=r"(mu|lower|M|set.A|parameters): expected .*, found a masked array"):
            make()


def test_dimensions_that_are_none_are_refused():
    for wrong in (7, "3", -1, 2.5, [2, 3]):
        with pytest.raises(ns.Error, match="dimension: expected one of 2, 3, found"):
            ns.Friction(W=EYE, q=[-1.0, 0.0, 0.0], mu=0.5, dimension=wrong)
    for wrong in (2, 3, 4):
        with pytest.raises(ns.Error, match=f"dimension: expected 5, as of all contacts with mu_r, found {wrong}"):
            ns.Friction(W=np.eye(15), q=-np.ones(15), mu=0.5, mu_r=0.1, dimension=wrong)
    assert ns.Friction(W=np.eye(15), q=-np.ones(15), mu=0.5, mu_r=0.1, dimension=5).contacts == 3
    assert ns.Friction(W=EYE, q=[-1.0, 0.0, 0.0], mu=0.5, dimension=3.0).dimension == 3
    assert ns.Friction(W=EYE, q=[-1.0, 0.0, 0.0], mu=0.5, dimension=np.int64(3)).dimension == 3


def test_a_prefix_without_a_usual_solver_asks_for_one():
    for offer in ns._nonsmooth.offers():
        for prefix in offer["prefixes"]:
            made = ns.settings.CLASSES[ns.settings.class_name(prefix["name"])]
            required = inspect.signature(made).parameters["solver"].default is inspect.Parameter.empty
            if required:
                with pytest.raises(TypeError, match="expected a solver behind the prefix"):
                    made()
            else:
                assert made().name == f"{prefix['name']}/auto"
            assert required == (made.__name__ not in ("Condense", "Glocker", "Multipliers", "Ncp"))
