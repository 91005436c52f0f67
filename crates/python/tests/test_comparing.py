"""Runs, their files, profiles."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import local, spd

import nonsmooth as ns


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
