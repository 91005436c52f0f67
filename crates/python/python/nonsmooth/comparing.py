"""Comparing solvers: runs, their files, and performance profiles."""

from __future__ import annotations

import json
import pathlib
import platform
import time
import uuid
from typing import TYPE_CHECKING, Any, Iterable, Mapping, Optional, Sequence, Union

import numpy as np

from . import _nonsmooth, arguments
from .answers import solve
from .problems import Path, Problem, read
from .settings import Settings

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Problems = Union[Mapping[str, Problem], Iterable[Union[Problem, str, pathlib.Path]]]
"""Problems by names, or problems and files one after the other."""


class Profile:
    """Performance profiles (Dolan and Moré): for each solver the share of problems solved within τ times the cost of the best, as steps (τ, share)."""

    def __init__(self, curves: dict[str, list[tuple[float, float]]], cost: str) -> None:
        self.curves = curves
        self.cost = cost

    def at(self, solver: str, tau: float) -> float:
        """The share at τ ≥ 1."""
        curve, tau = self.curves[arguments.one_of("solver", self.curves, solver)], arguments.real("tau", tau)
        return max((y for x, y in curve if x <= tau), default=0.0)

    def plot(self, ax: Optional[Axes] = None) -> Axes:
        """Draws them, with matplotlib."""
        from .plots import profiles

        return profiles(self, ax)

    def __repr__(self) -> str:
        best = ", ".join(f"{name} {self.at(name, 1.0):.0%}" for name in self.curves)
        return f"<Profile by {self.cost}, the best on: {best}>"


class Runs:
    """Runs of solvers on problems, as the files of ``nonsmooth bench`` hold them."""

    def __init__(self, native: _nonsmooth.Runs) -> None:
        self._native = native

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The runs, a dictionary each: problem, solver, tolerance, ending, iterations, seconds, residuals, ..."""
        return self._native.runs()

    def to_pandas(self) -> pandas.DataFrame:
        """A row a run; the residuals have columns of their own."""
        import pandas

        flat = []
        for row in self.rows:
            residuals = row.pop("residuals", None) or {}
            flat.append({**row, **residuals})
        return pandas.DataFrame(flat)

    def profile(
        self, cost: str = "seconds", *, kind: Optional[str] = None, tol: Optional[float] = None
    ) -> Profile:
        """Performance profiles by seconds, iterations or factorisations, on the problems of a kind at a tolerance: those of most runs where nothing is said.

        A solver that solves and does not report the cost is left out: it would seem to fail.
        """
        kinds = dict(self._native.kinds())
        if kind is None and kinds:
            kind = max(kinds, key=lambda one: kinds[one])
        if kind is None or kind not in kinds:
            raise arguments.mistake("kind", f"a kind of the runs ({', '.join(kinds) or 'there are none'})", kind)
        if tol is None:
            tol = self._native.tolerance(kind)
        if tol is None:
            raise _nonsmooth.Error("tol: expected a tolerance at which there are runs, found none")
        return Profile(dict(self._native.profile(kind, arguments.real("tol", tol), cost)), cost)

    def save(self, path: Path) -> None:
        """Writes the runs as ``nonsmooth bench`` reads them (.jsonl)."""
        pathlib.Path(path).write_text(self._native.text(), encoding="utf-8")

    def __len__(self) -> int:
        return len(self._native.runs())

    def __repr__(self) -> str:
        solved = sum(row["ending"] in ("solved", "infeasible") for row in self.rows)
        return f"<Runs: {len(self)} runs, {solved} solved>"

    def _repr_html_(self) -> str:
        html: str = self.to_pandas().to_html(max_rows=20)
        return html


def read_runs(path: Path) -> Runs:
    """The runs in a file of ``nonsmooth bench run``."""
    return Runs(_nonsmooth.Runs.read(arguments.path("path", path)))


def _each(problems: Problems) -> Iterable[tuple[str, Problem]]:
    if isinstance(problems, Mapping):
        for name, one in problems.items():
            if not isinstance(name, str):
                raise arguments.mistake("problems", "names that are texts", name)
            arguments.problem(one, f"problems[{name!r}]")
            yield name, one
        return
    # A text is no list of files, though it is one of its letters.
    if isinstance(problems, str) or not isinstance(problems, Iterable):
        what = "a list of problems and paths of files, or a dictionary of problems by their names"
        raise arguments.mistake("problems", what, problems)
    for k, one in enumerate(problems):
        if isinstance(one, Problem):
            yield one.title or f"problem{k}", one
        else:
            path = arguments.path(f"problems[{k}]", one, "a problem, or the path of a file")
            yield pathlib.Path(path).stem, read(path)


def _label(solver: Union[str, Settings]) -> str:
    name, settings = arguments.named(solver)
    # As the command line has them: true, not True.
    said = ",".join(
        f"{key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in settings.items()
    )
    return f"{name}:{said}" if said else name


def bench(
    problems: Problems,
    solvers: Union[str, Settings, Iterable[Union[str, Settings]]] = ("auto",),
    *,
    tol: Union[float, Sequence[float]] = 1e-8,
    time_limit: float = 60.0,
    repeats: int = 3,
) -> Runs:
    """Solves all problems by all solvers to all tolerances, one after the other; the fastest of ``repeats`` timed solves counts.

    A solver that does not take a problem refuses it, which is no failure. All runs are in this process; for campaigns over hours, with limits of memory, there is
    ``nonsmooth bench run``, which starts a process each; their files are the same.
    """
    if isinstance(solvers, (str, Settings)):
        solvers = (solvers,)
    solvers = tuple(solvers)
    for solver in solvers:
        name, settings = arguments.named(solver)
        _nonsmooth.check(name, dict(settings))
    tolerances = [arguments.real("tol", one) for one in np.atleast_1d(tol).tolist()]
    for one in tolerances:
        if not 0 < one <= 1:
            raise _nonsmooth.Error(f"tol: expected a positive number of at most 1, found {one:g}")
    time_limit = arguments.real("time_limit", time_limit)
    repeats = arguments.whole("repeats", repeats)
    if not 0 <= time_limit < float("inf"):
        raise _nonsmooth.Error(f"time_limit: expected a number of seconds of at least 0, found {time_limit:g}")
    campaign = uuid.uuid4().hex[:12]
    plan = {
        "solvers": [_label(solver) for solver in solvers],
        "tolerances": tolerances,
        "time_limit": time_limit,
        "memory_limit": 0,
        "repeats": repeats,
        "repeat_below": time_limit,
        "trace": False,
        "jobs": 1,
    }
    lines: list[dict[str, Any]] = [
        {
            "line": "campaign",
            "format": "nonsmooth-runs",
            "version": 1,
            "id": campaign,
            "program": f"nonsmooth {_nonsmooth.VERSION} (Python)",
            "started": int(time.time()),
            "machine": {"cpu": platform.processor() or platform.machine(), "os": platform.platform()},
            "plan": plan,
        }
    ]
    named: dict[str, Problem] = {}
    for name, problem in _each(problems):
        while name in named:
            name += "'"
        named[name] = problem
    for name, problem in named.items():
        about = {
            "family": "",
            "kind": problem.kind,
            "contacts": problem._native.pairs,
        }
        lines.append({"line": "problem", "name": name, "unknowns": problem.unknowns, **about})
        for solver in solvers:
            for tolerance in tolerances:
                run = _run(problem, solver, tolerance, time_limit, repeats)
                head = {"line": "run", "campaign": campaign, "problem": name, "solver": _label(solver)}
                lines.append({**head, "tolerance": tolerance, **about, **run})
    return Runs(_nonsmooth.Runs.parse("".join(json.dumps(line) + "\n" for line in lines)))


def _run(
    problem: Problem, solver: Union[str, Settings], tol: float, time_limit: float, repeats: int
) -> dict[str, Any]:
    seconds = []
    try:
        # The first warms up; it counts where there is no other.
        answer = solve(problem, solver, tol=tol, time_limit=time_limit)
        if answer.seconds < time_limit:
            seconds = [
                solve(problem, solver, tol=tol, time_limit=time_limit).seconds for _ in range(repeats)
            ]
    except _nonsmooth.Error as refusal:
        return {"ending": "refused", "message": str(refusal)}
    seconds = sorted(seconds) or [answer.seconds]
    finite = {
        key: x for key, x in answer.residuals.items() if isinstance(x, float) and 0 <= x < float("inf")
    }
    return {
        "ending": str(answer.status),
        "message": None if answer.solved else answer.message,
        "iterations": answer.iterations,
        "factorisations": answer.factorisations,
        "seconds": seconds[0],
        "seconds_median": seconds[len(seconds) // 2],
        "seconds_max": seconds[-1],
        "repeats": len(seconds),
        "residuals": {**finite, "reached": finite.get("relative")},
    }
