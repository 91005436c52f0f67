"""Solving: settings, statuses, starts, callbacks, limits."""

from __future__ import annotations

import inspect
import pathlib
import pickle
import re
from fractions import Fraction

import numpy as np
import pytest
from conftest import local, long, spd

import nonsmooth as ns
from nonsmooth import stubs


def test_the_answer_of_a_sliding_box(box):
    answer = ns.solve(box)
    assert answer.status is ns.Status.SOLVED and answer.status == "solved" and answer.solved
    np.testing.assert_allclose(answer.r, [1.0, -0.5, 0.0], atol=1e-8)
    np.testing.assert_allclose(answer.u, [0.0, 1.5, 0.0], atol=1e-8)
    assert answer.residual <= 1e-8 and answer.residuals["relative"] == answer.residual
    assert answer.counts["slip"] == 1 and answer.counts["open"] == 0
    assert answer.contacts["contact"].tolist() == [0]
    assert answer.contacts["status"][0] == "slip" and answer.contacts["mu"][0] == 0.5
    assert answer.contacts.to_pandas().loc[0, "r_n"] == pytest.approx(1.0)
    assert answer.iterations >= 0 and answer.seconds >= 0 and answer.certificate is None
    assert answer.raise_if_unsolved() is answer
    assert "solved" in repr(answer) and "r" in dir(answer)
    assert set(answer.history.dtype.names) == {"iteration", "seconds", "residual"}
    with pytest.raises(AttributeError, match="expected one of the parts r, u, l, found z"):
        answer.z


def test_settings_are_typed_and_documented(box):
    nsgs = ns.Nsgs(omega=0.9)
    assert nsgs.omega == 0.9 and nsgs.seed == 0 and repr(nsgs) == "Nsgs(omega=0.9)"
    assert ns.solve(box, nsgs).solved
    assert ns.solve(box, "nsgs", omega=0.9).iterations == ns.solve(box, nsgs).iterations
    assert ns.solve(box, "nsgs", omega=np.float64(0.9)).solved
    assert "in (0, 2)" in ns.Nsgs.__doc__ and "JourdanAlartJean1998" in ns.Nsgs.__doc__
    assert inspect.signature(ns.Nsgs).parameters["omega"].default == 1.0
    with pytest.raises(ns.Error, match="did you mean `omega`"):
        ns.Nsgs(omga=1.0)
    with pytest.raises(ns.Error, match=r"omega: expected a number in \(0, 2\), found 2.5"):
        ns.Nsgs(omega=2.5)
    with pytest.raises(ns.Error, match="did you mean `nsgs`"):
        ns.solve(box, "ngs")
    with pytest.raises(ns.Error, match="did you mean `omega`"):
        ns.solve(box, "nsgs", omgea=1)


def test_defaults_are_those_of_the_kind():
    # By contacts armijo, by pairs nonmonotone.
    assert ns.NewtonFb().line_search is None and ns.NewtonFb().rho == 1.0
    assert inspect.signature(ns.NewtonFb).parameters["line_search"].default is None
    assert "'nonmonotone'\n    for lcp, mlcp" in ns.NewtonFb.__doc__
    solver = ns.NewtonFb(line_search="armijo", rho=None)
    assert solver.settings == {"line_search": "armijo"}
    solver.line_search = None
    assert solver == ns.NewtonFb()
    # Each default may be said.
    for made in ns.settings.CLASSES.values():
        for name, parameter in inspect.signature(made).parameters.items():
            if parameter.default is not inspect.Parameter.empty and not issubclass(made, ns.settings.Prefixed):
                assert getattr(made(**{name: parameter.default}), name) == parameter.default
    problem = ns.LCP(spd(6), -np.ones(6))
    assert ns.solve(problem, "newton_fb", line_search=None).iterations == ns.solve(problem, "newton_fb").iterations
    with pytest.raises(ns.Error, match="line_search"):
        ns.solve(problem, "newton_fb", linesearch=None)


def test_prefixes_are_objects_too(box):
    proximal = ns.Proximal(ns.Nsgs(omega=0.9), prox_rule="residual")
    assert proximal.name == "proximal/nsgs" and ns.solve(box, proximal).solved
    assert ns.Condense("nsgs").name == "condense/nsgs"
    with pytest.raises(ns.Error):
        ns.Condense("nonsense")


def test_every_solver_of_the_registry_has_a_class():
    names = {cls.solver for cls in ns.settings.CLASSES.values()}
    for offer in ns._nonsmooth.offers():
        for name in offer["names"]:
            assert set(name.split("/")) <= names, name
    assert "condense/nsgs" in ns.solvers("friction_global_3d")
    assert ns.solvers(ns.LCP(np.eye(1), [1.0])) == ns.solvers("lcp")


def test_the_stubs_are_those_of_the_registry():
    path = pathlib.Path(ns.__file__).with_name("settings.pyi")
    assert path.read_text(encoding="utf-8") == stubs.text(), "python -m nonsmooth.stubs renews it"


def test_the_status_is_the_judges():
    problem = local(30, mu=0.9)
    answer = ns.solve(problem, "nsgs", max_iter=1, tol=1e-12)
    assert answer.status is ns.Status.ITERATION_LIMIT and not answer.solved
    with pytest.raises(ns.Unsolved, match="iteration limit") as caught:
        answer.raise_if_unsolved()
    assert caught.value.answer is answer
    assert problem.judge(answer, 1e-12)["solved"] is False
    good = ns.solve(problem, tol=1e-10)
    assert problem.judge(good)["solved"] and problem.judge(good.r)["solved"]
    assert not problem.judge(np.zeros(90))["solved"]


def test_what_else_than_the_residual_fails_is_named():
    # A row that no contact touches, where no step is done.
    problem = ns.Friction(W=np.eye(3), q=[1.0, 0.0, 0.0], mu=0.5, R=[[1.0]], s=[-1.0], lower=-0.1, upper=0.5)
    answer = ns.solve(problem, "psor", max_iter=0, tol=1e-2)
    assert not answer.solved
    assert answer.residual < 1e-2 and "fails bilateral constraints 1," in repr(answer)
    with pytest.raises(ns.Unsolved, match="; relative residual .*; fails bilateral constraints 1$") as caught:
        answer.raise_if_unsolved()
    again = pickle.loads(pickle.dumps(answer))
    assert repr(again) == repr(answer) and str(ns.Unsolved(again)) == str(caught.value)
    assert "fails</th>" in answer._repr_html_() and "bilateral constraints 1<" in answer._repr_html_()
    solved = ns.solve(problem)
    assert solved.solved and "fails" not in repr(solved) + solved._repr_html_()
    # Of a residual that is too large primal and dual ones are parts.
    large = ns.solve(local(30, mu=0.9), "nsgs", max_iter=1, tol=1e-12)
    assert "fails own residual" in repr(large) and not re.search(r"\b(primal|dual) ", repr(large))


def test_no_solution_is_a_status_with_a_certificate():
    answer = ns.solve(ns.LCP([[-2.0, 1.0], [1.0, -2.0]], [-1.0, -1.0]))
    assert answer.status is ns.Status.INFEASIBLE and answer.certificate is not None
    assert "proof" in answer.certificate
    # The fractions that were verified: y > 0 with yᵀ M < 0 and yᵀ q < 0.
    [vector] = answer.certificate["exact"]
    [a, b] = [Fraction(text) for _, text in vector]
    assert a > 0 and b > 0 and -2 * a + b < 0 and a - 2 * b < 0


def test_warm_starts(box):
    problem = local(40)
    first = ns.solve(problem, "nsgs", tol=1e-9)
    again = ns.solve(problem, "nsgs", tol=1e-8, warm_start=first)
    assert again.iterations < first.iterations
    assert ns.solve(problem, "nsgs", warm_start=first.r).iterations <= again.iterations + 1
    assert ns.solve(problem, "nsgs", warm_start={"r": first.r}).solved
    lcp = ns.LCP(spd(5), -np.ones(5))
    z = ns.solve(lcp).z
    assert ns.solve(lcp, warm_start=z).solved and ns.solve(lcp, warm_start={"z": z}).solved
    with pytest.raises(ns.Error, match="one of another kind"):
        ns.solve(lcp, warm_start=first)
    with pytest.raises(ns.Error, match="warm_start: expected 5 numbers, found 3"):
        ns.solve(lcp, warm_start=[1, 2, 3])
    with pytest.raises(ns.Error, match="r: expected 3"):
        ns.solve(box, warm_start=first.r)
    # As many numbers, of three contacts.
    rolling = ns.Friction(W=np.eye(15), q=-np.ones(15), mu=0.3, mu_r=0.2)
    sliding = ns.solve(ns.Friction(W=np.eye(15), q=-np.ones(15), mu=0.3))
    with pytest.raises(ns.Error, match="an answer to a problem rolling_friction_local_3d, found one to friction_local_3d"):
        ns.solve(rolling, warm_start=sliding)


@pytest.mark.parametrize("contacts", [20, 200])
def test_callbacks_see_the_steps_and_may_end_them(contacts):
    problem = long(contacts)
    seen = []

    def watch(progress):
        seen.append((progress.iteration, progress.residual, progress.best, progress.seconds))
        return len(seen) == 3

    answer = ns.solve(problem, "nsgs", tol=1e-300, callback=watch)
    assert answer.status is ns.Status.CANCELLED and len(seen) == 3
    assert [s[0] for s in seen] == sorted(s[0] for s in seen)
    # The best point so far, not nothing.
    assert answer.residual < 1


@pytest.mark.parametrize("contacts", [20, 200])
def test_what_a_callback_raises_is_raised(contacts):
    def watch(progress):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        ns.solve(long(contacts), "nsgs", tol=1e-300, callback=watch)


def test_callbacks_run_on_the_thread_that_asks():
    import threading

    threads = set()

    def watch(progress):
        threads.add(threading.get_ident())
        return len(threads)

    ns.solve(long(200), "nsgs", tol=1e-300, callback=watch)
    assert threads == {threading.get_ident()}


def test_limits(box):
    answer = ns.solve(long(600), "nsgs", tol=1e-300, time_limit=0.05)
    assert answer.status is ns.Status.TIME_LIMIT and answer.seconds < 2
    for tol in (0.0, -1.0, 2.0, float("nan")):
        with pytest.raises(ns.Error, match="tolerance: expected a positive number"):
            ns.solve(box, tol=tol)
    with pytest.raises(ns.Error, match="time limit"):
        ns.solve(box, time_limit=-1.0)
    with pytest.raises(ns.Error, match="max_iter: expected a whole number"):
        ns.solve(box, max_iter=-1)


def test_the_docstring_of_the_package_is_true():
    import doctest

    assert doctest.testmod(ns).failed == 0
