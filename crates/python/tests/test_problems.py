"""Problems in and out: shapes, types, sparse matrices, files."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import local, spd

import nonsmooth as ns

W = spd(6)
Q = np.array([-1.0, 0.3, 0.1, -2.0, 0.0, 0.5])
FORMATS = ["csr", "csc", "coo", "bsr", "dok", "lil", "dia"]


def test_friction_local_and_its_parts():
    problem = ns.Friction(W=W, q=Q, mu=0.4)
    assert (problem.contacts, problem.dimension, problem.unknowns) == (2, 3, 6)
    assert problem.kind == "friction_local_3d"
    np.testing.assert_array_equal(problem.q, Q)
    np.testing.assert_array_equal(problem.mu, [0.4, 0.4])
    np.testing.assert_array_equal(problem.W.toarray(), W)
    with pytest.raises(AttributeError, match="expected one of the parts W, q, mu, found H"):
        problem.H


@pytest.mark.parametrize("format", FORMATS)
def test_sparse_matrices_of_any_format_state_the_same(format):
    matrix = sp.csr_matrix(W)
    matrix = matrix.tobsr(blocksize=(3, 3)) if format == "bsr" else matrix.asformat(format)
    problem = ns.Friction(W=matrix, q=Q, mu=0.4)
    np.testing.assert_array_equal(problem.W.toarray(), W)
    lcp = ns.LCP(matrix, Q)
    np.testing.assert_array_equal(lcp.M.toarray(), W)
    assert ns.solve(lcp).solved


def test_the_sparse_arrays_of_scipy_and_long_indices_are_taken():
    coo = sp.coo_array(W)
    assert ns.solve(ns.LCP(coo, Q)).solved
    csr = sp.csr_matrix(W)
    csr.indices, csr.indptr = csr.indices.astype(np.int64), csr.indptr.astype(np.int64)
    np.testing.assert_array_equal(ns.LCP(csr, Q).M.toarray(), W)


def disordered(matrix, rng):
    """The same matrix with the entries of each line in disorder, some of them in two halves."""
    indptr, indices, data = [0], [], []
    for start, end in zip(matrix.indptr[:-1], matrix.indptr[1:]):
        which = rng.permutation(np.repeat(np.arange(start, end), 2))
        indices.extend(matrix.indices[which])
        data.extend(0.5 * matrix.data[which])
        indptr.append(len(indices))
    made = type(matrix)((np.array(data), np.array(indices), np.array(indptr)), shape=matrix.shape)
    made.has_sorted_indices = made.has_canonical_format = False
    return made


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_every_way_into_blocks_and_columns_gives_the_same(seed, dimension):
    rng = np.random.default_rng(seed)
    n = 5 * dimension
    dense = np.where(rng.random((n, n)) < 0.2, rng.integers(1, 9, (n, n)), 0) + 4.0 * np.eye(n)
    csr, block = sp.csr_matrix(dense), (dimension, dimension)
    ways = [csr, csr.tocsc(), csr.tocoo(), csr.tobsr(block), csr.tobsr((1, 1)), csr.tobsr((n, 1))]
    ways += [disordered(csr, rng), disordered(csr.tocsc(), rng), disordered(csr.tobsr(block), rng)]
    long = csr.copy()
    long.indices, long.indptr = long.indices.astype(np.int64), long.indptr.astype(np.int64)
    # Room behind the last entry, as scipy leaves it.
    roomy = csr.tocsc()
    roomy.indices = np.append(roomy.indices, [0, 0]).astype(np.int32)
    roomy.data = np.append(roomy.data, [7.0, 7.0])
    for matrix in (*ways, long, roomy, dense, np.asfortranarray(dense)):
        W = ns.Friction(W=matrix, q=-np.ones(n), mu=0.3, dimension=dimension).W
        np.testing.assert_array_equal(W.toarray(), dense)
        M = ns.LCP(matrix, -np.ones(n)).M
        np.testing.assert_array_equal(M.toarray() if sp.issparse(M) else M, dense)


def test_what_is_given_stays_the_callers():
    csr, q = sp.csr_matrix(W), Q.copy()
    problem = ns.Friction(W=csr, q=q, mu=0.4)
    csr.data[:] = 0.0
    q[:] = 0.0
    np.testing.assert_array_equal(problem.W.toarray(), W)
    np.testing.assert_array_equal(problem.q, Q)
    problem.q[:] = 0.0
    np.testing.assert_array_equal(problem.q, Q)


def test_duplicate_and_unsorted_entries_are_added():
    coo = sp.coo_matrix(([1.0, 2.0, 3.0], ([1, 0, 1], [1, 0, 1])), shape=(2, 2))
    np.testing.assert_array_equal(ns.LCP(coo, [-1, -1]).M.toarray(), np.diag([2.0, 4.0]))


@pytest.mark.parametrize("dtype", ["f4", "f8", "i4", "i8", "u1", "b1", ">f8"])
def test_numbers_of_any_type_are_taken(dtype):
    m = np.eye(3).astype(dtype)
    np.testing.assert_array_equal(ns.LCP(m, [1, 2, 3]).M, np.eye(3))


def test_layouts_are_taken():
    m = np.asfortranarray(spd(4))
    big = np.zeros((8, 8))
    big[::2, ::2] = m
    q = -np.ones(8)[::2]
    readonly = m.copy()
    readonly.flags.writeable = False
    astray = np.frombuffer(b"\0" + m.tobytes(), dtype=float, offset=1).reshape(m.shape)
    assert not astray.flags.aligned
    for matrix in (m, big[::2, ::2], readonly, m.tolist(), astray):
        np.testing.assert_array_equal(ns.LCP(matrix, q).M, m)


def test_a_column_is_a_vector_by_contacts():
    column = ns.Friction(W=np.eye(3), q=[[-1.0], [2.0], [1.5]], mu=0.5)
    assert column.contacts == 1 and column.q.tolist() == [-1.0, 2.0, 1.5]


def test_contacts_by_rows_and_in_the_plane():
    problem = ns.Friction(W=np.eye(4), q=[[-1.0, 2.0], [-1.0, 0.1]], mu=[0.5, 0.5])
    assert problem.dimension == 2
    assert ns.Friction(W=np.eye(4), q=[-1, 2, -1, 0.1], mu=[0.5, 0.5]).dimension == 2
    assert ns.Friction(W=np.eye(6), q=Q, mu=0.5, dimension=2).contacts == 3
    answer = ns.solve(problem).raise_if_unsolved()
    assert list(answer.contacts["status"]) == ["slip", "stick"]


def test_friction_global_with_rows():
    # Two boxes of 2 kg; a rope of the first one's fourth coordinate.
    M = sp.diags([2.0] * 6).tocsc()
    H = sp.identity(6, format="csr")
    f = np.array([-2.0, 4.0, 0.0, -2.0, 0.0, 0.0])
    problem = ns.Friction(
        M=M, H=H, f=f, w=np.zeros(6), mu=[0.5, 0.5], G=np.eye(6)[:, 1:2], b=[0.0], lower=0.0
    )
    answer = ns.solve(problem).raise_if_unsolved()
    assert answer.l.shape == (1,) and answer.v.shape == (6,)
    np.testing.assert_allclose(problem.M @ answer.v, H @ answer.r + f + answer.l[0] * np.eye(6)[1])
    bilateral = ns.Friction(M=M, H=H, f=f, w=np.zeros(6), mu=0.5, G=np.eye(6)[:, 1:2], b=[0.0])
    assert abs(ns.solve(bilateral).raise_if_unsolved().v[1]) < 1e-9


def test_rows_alone_are_a_problem():
    problem = ns.Friction(R=[[2.0]], s=[-1.0], lower=0.0)
    assert ns.solve(problem).raise_if_unsolved().l == pytest.approx([0.5])


def test_complementarity_problems():
    answer = ns.solve(ns.LCP([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0]))
    np.testing.assert_allclose(answer.z, [4 / 3, 7 / 3])
    np.testing.assert_allclose(answer.w, 0, atol=1e-8)

    m = ns.MLCP([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0], free=1)
    np.testing.assert_allclose(ns.solve(m).u, [4 / 3])
    blocks = ns.MLCP(A=[[2.0]], C=[[1.0]], D=[[1.0]], B=[[2.0]], a=[-5.0], b=[-6.0])
    np.testing.assert_allclose(ns.solve(blocks).v, [7 / 3])

    h = ns.solve(ns.HLCP(Q=np.eye(2), R=-np.eye(2), q=[1.0, -1.0]))
    np.testing.assert_allclose((h.x, h.s), ([1, 0], [0, 1]), atol=1e-9)

    b = ns.solve(ns.BoxLCP(np.eye(2), [-5.0, 5.0], [-1, -1], [1, 1]))
    # One bound for all, or none said.
    once = ns.BoxLCP(np.eye(2), [-5.0, 5.0], -1, 1)
    assert once.lower.tolist() == [-1, -1] and once.upper.tolist() == [1, 1]
    unsaid = ns.BoxLCP(np.eye(2), [-5.0, 5.0])
    assert unsaid.lower.tolist() == [0, 0] and unsaid.upper.tolist() == [np.inf, np.inf]
    np.testing.assert_allclose(b.z, [1, -1])


def test_expressions_and_variational_inequalities():
    mcp = ns.MCP(["x1^2 - 2"], x0=[1.0])
    np.testing.assert_allclose(ns.solve(mcp).x, [2**0.5])
    disk = ns.VI(["x1 - 3", "x2 - 4"], ns.Ball([0.0, 0.0], 1.0), [0.0, 0.0])
    np.testing.assert_allclose(ns.solve(disk).x, [0.6, 0.8], atol=1e-7)
    sets = ns.Product([ns.Box([0.0], [1.0]), ns.SecondOrderCone(2), ns.Polyhedron([[1.0]], [2.0])])
    f = ns.VI(lambda x: x - 5, sets, np.zeros(4))
    np.testing.assert_allclose(ns.solve(f).x, [1, 5, 5, 2], atol=1e-6)


def test_update_keeps_the_problem_and_the_session():
    problem = local(20)
    first = ns.solve(problem)
    q = problem.q * 0.5
    problem.update(q=q)
    second = ns.solve(problem)
    assert second.solved
    # Impulses are homogeneous in q.
    np.testing.assert_allclose(second.r, first.r / 2, atol=1e-7)
    np.testing.assert_array_equal(first._native.parts()["r"], first.r)
    with pytest.raises(ns.Error, match="q: expected 60 entries"):
        problem.update(q=[1.0])
    with pytest.raises(ns.Error, match="expected one of the parts"):
        problem.update(nonsense=1.0)
    np.testing.assert_array_equal(problem.q, q)
    lcp = ns.LCP(np.eye(2), [-1.0, -2.0])
    lcp.update(q=[-3.0, 1.0])
    np.testing.assert_allclose(ns.solve(lcp).z, [3, 0])
    mcp = ns.MCP(lambda x: x - 2, [0.0])
    mcp.update(upper=[1.0])
    np.testing.assert_allclose(ns.solve(mcp).x, [1.0])


def test_files_of_contacts(tmp_path):
    problem = local(3)
    answer = ns.solve(problem)
    problem.save(tmp_path / "p.hdf5", answer)
    again = ns.read(tmp_path / "p.hdf5")
    assert isinstance(again, ns.Friction) and repr(again).startswith("<Friction")
    np.testing.assert_array_equal(again.q, problem.q)
    np.testing.assert_array_equal(again.solution["r"], answer.r)
    problem.save(tmp_path / "p.csv", answer)
    assert (tmp_path / "p.csv").read_text().startswith("contact,status,r_n,r_t1")


@pytest.mark.parametrize("name", ["p.toml", "p.mtx"])
def test_files_of_complementarity(tmp_path, name):
    problem = ns.LCP(sp.csc_matrix(spd(4)), -np.ones(4))
    problem.save(tmp_path / name)
    again = ns.read(tmp_path / name)
    assert isinstance(again, ns.LCP)
    np.testing.assert_array_equal(again.M.toarray(), problem.M.toarray())


def test_models_of_ampl(tmp_path):
    problem = ns.MCP(["x1^2 + x2 - 2", "x2 - x1"], x0=[1.0, 1.0])
    problem.save(tmp_path / "m.nl")
    again = ns.MCP.from_nl(tmp_path / "m.nl")
    np.testing.assert_allclose(ns.solve(again).x, ns.solve(problem).x)
    local(1).save(tmp_path / "c.hdf5")
    with pytest.raises(ns.Error, match="expected a problem mcp, found friction_local_3d"):
        ns.MCP.from_nl(tmp_path / "c.hdf5")


def test_mistakes_in_files_say_place_expected_and_found(tmp_path):
    with pytest.raises(ns.Error, match="nothing.toml"):
        ns.read(tmp_path / "nothing.toml")
    (tmp_path / "bad.toml").write_text("kind = 'lcp'\nq = [1, 'x']\n")
    with pytest.raises(ns.Error, match="bad.toml"):
        ns.read(tmp_path / "bad.toml")
    with pytest.raises(ns.Error, match="unknown.xyz"):
        local(1).save(tmp_path / "unknown.xyz")


def test_the_kinds_of_the_library_have_classes():
    kinds = {kind["kind"] for kind in ns._nonsmooth.kinds()}
    classes = {cls._kind: cls for cls in (ns.LCP, ns.MLCP, ns.HLCP, ns.BoxLCP, ns.MCP, ns.VI)}
    assert kinds == set(classes)


def test_pictures_in_notebooks(box):
    assert "mu" in box._repr_html_() and "<table>" in box._repr_html_()
    answer = ns.solve(box)
    assert "solved" in answer._repr_html_()
    assert "0 <= z" in ns.LCP(np.eye(2), [1, 1])._repr_html_().replace("&lt;", "<")


def test_plots(box):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert len(ns.solve(box).plot().axes) == 3
    assert len(ns.solve(ns.LCP(np.eye(2), [-1.0, 1.0])).plot().axes) == 1
    assert "W, 3 × 3" in box.spy().get_title()


def test_rolling_friction_has_five_rows_a_contact() -> None:
    """A ball that rolls slows down by (5/7) mu_r g/R."""
    mass, radius, g, h, mu_r = 2.0, 0.1, 9.81, 1e-3, 0.004
    inertia = 0.4 * mass * radius**2
    start = np.array([1.0, 0, 0, 0, 1.0 / radius, 0])
    M = np.diag([mass] * 3 + [inertia] * 3)
    H = np.zeros((6, 5))
    H[2, 0] = H[0, 1] = H[1, 2] = H[3, 3] = H[4, 4] = 1.0
    H[4, 1], H[3, 2] = -radius, radius
    f = M @ start + h * np.array([0, 0, -mass * g, 0, 0, 0])
    problem = ns.Friction(M=M, H=H, f=f, w=np.zeros(5), mu=0.5, mu_r=mu_r)
    assert problem.dimension == 5 and problem.contacts == 1
    answer = ns.solve(problem, tol=1e-12).raise_if_unsolved()
    assert abs((start[0] - answer.v[0]) / h / (5 / 7 * mu_r * g / radius) - 1) < 1e-8
    row = answer.contacts[0]
    assert row["status"] == "roll" and abs(row["r_r2"]) > 0 and row["r_r1"] == 0
    problem.update(mu_r=0.0)
    free = ns.solve(problem, tol=1e-12).raise_if_unsolved()
    assert abs(free.v[0] - start[0]) < 1e-12
    with pytest.raises(ns.Error, match="mu_r"):
        ns.Friction(M=M, H=H, f=f, w=np.zeros(5), mu=0.5, mu_r=-1.0)
    with pytest.raises(ns.Error, match="5 for each"):
        ns.Friction(W=np.eye(3), q=np.zeros(3), mu=0.5, mu_r=0.1)


def test_copies_are_problems_of_their_own():
    problem = ns.Friction(W=W, q=Q, mu=0.4)
    for copied in (copy.copy(problem), copy.deepcopy(problem)):
        copied.update(mu=0.0)
        np.testing.assert_array_equal(copied.mu, [0.0, 0.0])
        np.testing.assert_array_equal(problem.mu, [0.4, 0.4])
        assert type(copied) is ns.Friction and ns.solve(copied).solved


def test_problems_are_pickled_as_they_are():
    h, mu = np.vstack([np.eye(3), -np.eye(3)]).reshape(6, 3), 0.4
    contacts = ns.Friction(M=np.eye(6), H=h, f=np.arange(6.0), w=[-0.1, 0.2, 1 / 3], mu=mu)
    for problem in (
        ns.Friction(W=W, q=Q, mu=mu),
        contacts,
        ns.LCP(spd(3), -np.ones(3)),
        ns.MCP(["x1^3 - 1/3"], [0.5], lower=[-1.0], upper=[np.inf]),
        ns.VI(["x1 - 2", "x2"], ns.Ball([0.0, 0.1], 1.0), [0.0, 0.5]),
    ):
        again = pickle.loads(pickle.dumps(problem))
        assert type(again) is type(problem) and again.parts.keys() == problem.parts.keys()
        first, second = ns.solve(problem), ns.solve(again)
        for name, part in first.parts.items():
            np.testing.assert_array_equal(second.parts[name], part)
    with pytest.raises(TypeError, match="MCP cannot be pickled: .*values only"):
        pickle.dumps(ns.MCP(lambda x: x - 1, [0.0]))


def test_answers_are_pickled_without_their_problems(tmp_path):
    problem = ns.Friction(W=W, q=Q, mu=0.4)
    answer = ns.solve(problem, tol=1e-10)
    again = pickle.loads(pickle.dumps(answer))
    assert again.status is ns.Status.SOLVED and again.solved and repr(again) == repr(answer)
    for name in ("residual", "message", "account", "residuals", "counts", "worst", "certificate"):
        assert getattr(again, name) == getattr(answer, name)
    for name, part in answer.parts.items():
        np.testing.assert_array_equal(getattr(again, name), part)
    with pytest.raises(ValueError, match="read-only"):
        again.r[0] = 1.0
    assert again.contacts.dtype == answer.contacts.dtype and len(again.history) == len(answer.history)
    # It is a point as any other.
    assert problem.judge(again)["solved"] and ns.solve(problem, warm_start=again).iterations == 0
    problem.save(tmp_path / "solved.hdf5", again)
    np.testing.assert_array_equal(ns.read(tmp_path / "solved.hdf5").solution["r"], answer.r)
    with pytest.raises(ns.Error, match="warm_start"):
        ns.derivative(problem, again)
    for copied in (copy.copy(answer), copy.deepcopy(answer), pickle.loads(pickle.dumps(again))):
        np.testing.assert_array_equal(copied.r, answer.r)
    with pytest.raises(ns.Unsolved):
        pickle.loads(pickle.dumps(ns.solve(problem, max_iter=0, tol=1e-10))).raise_if_unsolved()


def test_other_processes_solve():
    problems = [ns.Friction(W=W, q=Q, mu=mu) for mu in (0.1, 0.4)]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        answers = pool.map(ns.solve, problems)
    for problem, answer in zip(problems, answers):
        np.testing.assert_array_equal(answer.r, ns.solve(problem).r)


def test_settings_take_numbers_of_numpy():
    assert ns.Nsgs(seed=np.int64(3)) == ns.Nsgs(seed=3)
    assert ns.Proximal("nsgs", seed=np.int64(3)).settings == {"seed": 3}
    changed = ns.Nsgs()
    changed.omega = np.float32(0.5)
    assert changed == ns.Nsgs(omega=0.5)


def test_parts_of_answers_stay_as_they_are():
    answer = ns.solve(ns.Friction(W=W, q=Q, mu=0.4))
    with pytest.raises(ValueError, match="read-only"):
        answer.r[0] = 1.0
    assert type(answer.contacts["r_n"]) is np.ndarray
    with pytest.raises(AttributeError, match="contacts: expected a problem of contacts, found lcp"):
        ns.solve(ns.LCP(spd(3), -np.ones(3))).contacts


def test_velocities_that_are_not_given_follow_from_the_impulses(tmp_path):
    problem = ns.Friction(M=np.eye(3), H=np.eye(3), f=[-1.0, 0.9, 0.0], w=np.zeros(3), mu=[0.5])
    answer = ns.solve(problem)
    assert np.allclose(answer.v, [0.0, 0.4, 0.0])
    assert problem.judge(answer.r)["solved"] and problem.judge({"r": answer.r})["solved"]
    assert not problem.judge({"r": answer.r, "v": np.zeros(3)})["solved"]
    problem.save(tmp_path / "slides.hdf5", answer.r)
    assert np.allclose(ns.read(tmp_path / "slides.hdf5").solution["v"], answer.v)


def test_what_is_saved_beside_a_point_is_of_the_problem_as_it_is(tmp_path):
    problem = ns.Friction(W=np.eye(3), q=[-1.0, 2.0, 1.5], mu=0.5)
    answer = ns.solve(problem)
    other = ns.Friction(W=np.eye(3), q=[1.0, 0.0, 0.0], mu=0.5)
    problem.update(q=[-3.0, 1.0, 1.0])
    for now in (problem, other):
        now.save(tmp_path / "p.hdf5", answer)
        again = ns.read(tmp_path / "p.hdf5")
        np.testing.assert_allclose(again.solution["u"], answer.r + now.q, atol=1e-12)
        now.save(tmp_path / "p.csv", answer)
        now.save(tmp_path / "r.csv", answer.r)
        assert (tmp_path / "p.csv").read_text() == (tmp_path / "r.csv").read_text()
    lcp = ns.LCP(np.eye(2), [-1.0, 1.0])
    found = ns.solve(lcp)
    lcp.update(q=[-5.0, 1.0])
    lcp.save(tmp_path / "p.toml", found)
    assert ns.read(tmp_path / "p.toml").solution["w"].tolist() == [-4.0, 1.0]


@pytest.mark.parametrize("make", [np.array, sp.csc_matrix])
def test_blocks_are_changed_by_blocks(make):
    rng = np.random.default_rng(0)
    A, B, C, D = (rng.normal(size=shape) for shape in ((2, 2), (3, 3), (2, 3), (3, 2)))
    parts = dict(A=make(A), B=make(B), C=make(C), D=make(D), a=[1.0, 2.0], b=[-1.0, 3.0, -2.0])
    problem = ns.MLCP(**parts)

    def whole(part):
        return part.toarray() if sp.issparse(part) else part

    for change in (dict(a=[3.0, 4.0]), dict(B=make(2 * B), b=[1.0, 1.0, 1.0]), dict(C=make(3 * C)), dict(A=make(A + 1), D=make(D - 1))):
        problem.update(**change)
        parts.update(change)
        made = ns.MLCP(**parts)
        assert problem.q.tolist() == made.q.tolist() and type(problem.M) is type(made.M)
        np.testing.assert_array_equal(whole(problem.M), whole(made.M))
    with pytest.raises(ns.Error, match="either M, q and free, or A, B, C, D, a and b"):
        problem.update(a=[1.0, 2.0], q=np.ones(5))
    with pytest.raises(ns.Error, match="A: expected"):
        problem.update(a=[1.0])
    # One of another size.
    problem.update(A=[[2.0]], B=[[2.0]], C=[[0.0]], D=[[0.0]], a=[1.0], b=[-1.0])
    assert (problem.free, problem.unknowns) == (1, 2)


def test_names_are_dropped_where_there_are_more_variables(tmp_path):
    (tmp_path / "p.toml").write_text('kind = "lcp"\nnames = ["a", "b"]\nq = [-1.0, 1.0]\nM = [[1.0, 0.0], [0.0, 1.0]]\n')
    problem = ns.read(tmp_path / "p.toml")
    problem.update(q=[1.0, 1.0])
    assert problem.names == ["a", "b"]
    problem.update(M=np.eye(3), q=np.ones(3))
    assert problem.names == [] and pickle.loads(pickle.dumps(problem)).unknowns == 3


def work(k):
    """What ends in an exception, in another process."""
    problem = ns.LCP([[0.0]], [-1.0])
    return ns.solve(problem).raise_if_unsolved() if k == 0 else ns.solve(problem, "nonsense")


def test_exceptions_come_from_another_process():
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        with pytest.raises(ns.Unsolved, match="infeasible") as caught:
            pool.submit(work, 0).result()
        assert caught.value.answer.status is ns.Status.INFEASIBLE
        with pytest.raises(ns.Error, match="unknown solver `nonsense`"):
            pool.submit(work, 1).result()
    with pytest.raises(ns.Error) as caught:
        work(1)
    for again in (copy.copy(caught.value), copy.deepcopy(caught.value), pickle.loads(pickle.dumps(caught.value))):
        assert type(again) is ns.Error and again.args == caught.value.args
    assert (ns.Error.__module__, ns.Error.__qualname__) == ("nonsmooth", "Error")


def test_every_contact_is_drawn():
    pytest.importorskip("matplotlib").use("Agg")
    from nonsmooth import plots

    # Pushed just as much as friction holds: it rests at the limit.
    edge = ns.Friction(W=np.eye(6), q=[-1.0, 0.5, 0.0, -1.0, 0.1, 0.0], mu=0.5)
    answer = ns.solve(edge, tol=1e-12)
    assert set(answer.contacts["status"]) == {"stick at limit", "stick"}
    for colours in (plots.COLOURS, {}):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(plots, "COLOURS", colours)
            *statuses, cone = plots.cone(answer).lines
        assert sorted(line.get_label() for line in statuses) == ["stick (1)", "stick at limit (1)"]
        assert sum(len(line.get_xdata()) for line in statuses) == 2


def test_names_of_digits_are_names(tmp_path):
    names = ["007", "²", "1"]
    ns.LCP(np.eye(3), -np.ones(3)).save(tmp_path / "p.toml")
    text = (tmp_path / "p.toml").read_text()
    (tmp_path / "p.toml").write_text(f"names = {names}\n".replace("'", '"') + text)
    named = ns.read(tmp_path / "p.toml")
    assert named.names == names
    table = ns.solve(named).table
    assert table["name"].tolist() == names and table["variable"].tolist() == [0, 1, 2]


def test_parts_are_changed_as_they_are_given_at_first():
    for problem in (
        ns.MCP(["x1 - 2", "x2"], [0.0, 0.0]),
        ns.MCP(lambda x: x - 2, [0.0, 0.0]),
        ns.BoxLCP(np.eye(2), [1.0, 1.0]),
    ):
        problem.update(lower=-3.0, upper=np.float64(1.5))
        assert problem.lower.tolist() == [-3.0, -3.0] and problem.upper.tolist() == [1.5, 1.5]
    larger = ns.BoxLCP(np.eye(2), [1.0, 1.0])
    larger.update(M=np.eye(3), q=np.ones(3), lower=-1.0, upper=1.0)
    assert larger.lower.tolist() == [-1.0] * 3
    rows = ns.Friction(R=np.eye(2), s=[-1.0, -1.0], lower=0.0)
    rows.update(upper=0.5)
    assert rows.lower.tolist() == [0.0, 0.0] and rows.upper.tolist() == [0.5, 0.5]
    for problem in (ns.MCP(lambda x: x, [0.0]), ns.VI(["x1"], ns.Ball([0.0], 1.0), [0.0])):
        problem.update(x0=[0.25])
        assert problem.start.tolist() == [0.25]
