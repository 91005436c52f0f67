"""Runs, their files, profiles."""

from __future__ import annotations

import json

import numpy as np
import pytest
from conftest import local, spd

import nonsmooth as ns
from nonsmooth.comparing import Profile


@pytest.fixture(scope="module")
def runs():
    problems = {f"p{k}": local(5 + k, k) for k in range(3)}
    return ns.bench(problems, ["nsgs", ns.Psor(omega=0.8), "condense/nsgs"], tol=[1e-4, 1e-8], repeats=1)


def test_runs_are_rows(runs):
    frame = runs.to_pandas()
    assert len(frame) == len(runs) == 18
    assert set(frame["solver"]) == {"nsgs", "psor:omega=0.8", "condense/nsgs"}
    assert (frame[frame.solver == "nsgs"].ending == "solved").all()
    # A local problem cannot be condensed: no failure, a refusal.
    assert (frame[frame.solver == "condense/nsgs"].ending == "refused").all()
    assert (frame[frame.solver == "nsgs"].relative <= frame[frame.solver == "nsgs"].tolerance).all()
    assert "18 runs" in repr(runs) and "<table" in runs._repr_html_()


def test_profiles_are_those_of_the_library(runs):
    profile = runs.profile("iterations", tol=1e-8)
    rows = {(r["problem"], r["solver"]): r["iterations"] for r in runs.rows if r["tolerance"] == 1e-8 and r["ending"] == "solved"}
    best = {p: min(v for (q, _), v in rows.items() if q == p) for p, _ in rows}
    fastest = np.mean([rows[p, "nsgs"] == best[p] for p in best])
    assert profile.at("nsgs", 1.0) == pytest.approx(fastest)
    assert profile.at("nsgs", 1e9) == 1.0
    assert repr(profile).startswith("<Profile by iterations, the best on: ") and "nsgs" in repr(profile)
    pytest.importorskip("matplotlib").use("Agg")
    assert profile.plot().get_ylabel() == "share of problems solved"
    with pytest.raises(ns.Error, match="cost: expected one of seconds, iterations, factorisations"):
        runs.profile("money")
    with pytest.raises(ns.Error, match="kind: expected a kind of the runs .friction_local_3d., found 'foo'"):
        runs.profile(kind="foo")
    assert len(ns.bench([local(3)], "nsgs", repeats=0)) == 1


def test_files_of_runs(runs, tmp_path):
    runs.save(tmp_path / "runs.jsonl")
    again = ns.read_runs(tmp_path / "runs.jsonl")
    assert again.rows == runs.rows
    (tmp_path / "bad.jsonl").write_text("{}\n")
    with pytest.raises(ns.Error, match="bad.jsonl"):
        ns.read_runs(tmp_path / "bad.jsonl")


def test_problems_from_files_and_mistakes(tmp_path):
    ns.LCP(spd(3), -np.ones(3)).save(tmp_path / "a.toml")
    runs = ns.bench([tmp_path / "a.toml", ns.LCP(spd(2), -np.ones(2))], ["lemke"], repeats=0)
    assert [row["problem"] for row in runs.rows] == ["a", "problem1"]
    with pytest.raises(ns.Error, match="did you mean `lemke`"):
        ns.bench([], ["lemk"])


def lines(*runs):
    """A file of runs on one kind of problem."""
    head = {"line": "campaign", "format": "nonsmooth-runs", "version": 1, "id": "c", "program": "p", "machine": {"cpu": "x"}}
    usual = {"line": "run", "campaign": "c", "family": "f", "kind": "lcp", "contacts": 2, "tolerance": 1e-8}
    usual.update(ending="solved", seconds=1.0, iterations=3)
    return "".join(json.dumps(line) + "\n" for line in [head, *({**usual, **run} for run in runs)])


def test_who_does_not_report_a_cost_is_in_no_profile_of_it(tmp_path):
    both = [{"problem": f"f/{k}", "solver": s} for k in range(2) for s in "AB"]
    counted = [{**run, "factorisations": 2} if run["solver"] == "A" else run for run in both]
    (tmp_path / "runs.jsonl").write_text(lines(*counted))
    runs = ns.read_runs(tmp_path / "runs.jsonl")
    assert list(runs.profile("factorisations").curves) == ["A"]
    assert set(runs.profile("iterations").curves) == {"A", "B"}


def test_a_profile_is_at_a_tolerance_of_the_runs(runs):
    with pytest.raises(ns.Error, match=r"tol: expected a tolerance of the runs .1e-8, 1e-4., found 1e-5"):
        runs.profile(tol=1e-5)
    with pytest.raises(ns.Error, match="tol: expected a number, found 'a'"):
        runs.profile(tol="a")


@pytest.mark.parametrize("many", [2, 30])
def test_profiles_begin_at_one_and_names_do_not_hide_them(many):
    pytest.importorskip("matplotlib").use("Agg")
    profile = Profile({f"solver{k}": [(1.5, 0.5), (2.0 + k, 1.0)] for k in range(many)}, "seconds")
    axes = profile.plot()
    for line in axes.lines:
        assert (line.get_xdata()[0], line.get_ydata()[0]) == (1.0, 0.0)
    axes.figure.canvas.draw()
    names, box = axes.get_legend().get_window_extent(), axes.get_window_extent()
    assert (names.x0 > box.x1) == (many == 30) and names.x1 <= axes.figure.bbox.x1
    assert box.width > 300


def test_runs_have_the_words_of_the_command_line(tmp_path):
    mixed = ns.MLCP([[2.0, 1.0], [1.0, 2.0]], [-1.0, -1.0], 1)
    contact = ns.Friction(W=np.eye(3), q=[-1.0, 2.0, 1.5], mu=0.5)
    solvers = (solver for solver in (ns.Auto(interior=False), "auto"))
    runs = ns.bench([mixed, contact], solvers, repeats=0)
    assert len(runs) == 4
    assert {row["solver"] for row in runs.rows} == {"auto:interior=false", "auto"}
    # Pairs, not variables.
    assert [row["contacts"] for row in runs.rows] == [1, 1, 1, 1]
    assert "residuals" not in runs.to_pandas() and "relative" in runs.to_pandas()
