"""What callers pass, read once: numbers and solvers, and in words what was expected where they are something else."""

from __future__ import annotations

import operator
from typing import Mapping, Optional, SupportsFloat, SupportsIndex

from . import _nonsmooth
from .problems import Problem
from .settings import Settings


def mistake(place: str, expected: str, found: object) -> _nonsmooth.Error:
    """The error that says what was expected at a place, and what was found."""
    return _nonsmooth.Error(f"{place}: expected {expected}, found {found!r}")


def real(place: str, value: object) -> float:
    """A number."""
    if isinstance(value, (SupportsFloat, SupportsIndex)) and not isinstance(value, (str, bytes)):
        try:
            return float(value)
        except (TypeError, ValueError, OverflowError):
            pass
    raise mistake(place, "a number", value)


def whole(place: str, value: object) -> int:
    """A whole number, not negative; 1e6 is one."""
    try:
        number = int(value) if isinstance(value, float) and value.is_integer() else operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise mistake(place, "a whole number of at least 0", value) from None
    # What is larger is no limit.
    if number >= 0:
        return min(number, 2**63 - 1)
    raise mistake(place, "a whole number of at least 0", value)


def seconds(place: str, value: object) -> Optional[float]:
    """A limit of time, or none."""
    return None if value is None else real(place, value)


def problem(value: object) -> _nonsmooth.Problem:
    """A problem of this package."""
    if isinstance(value, Problem):
        return value._native
    raise mistake("problem", "a problem (nonsmooth.LCP, Friction, ..., or nonsmooth.read)", value)


def named(solver: object) -> tuple[str, Mapping[str, object]]:
    """A solver's name and settings."""
    if isinstance(solver, str):
        return solver, {}
    if isinstance(solver, Settings):
        return solver.name, solver.settings
    if isinstance(solver, type) and issubclass(solver, Settings):
        raise mistake("solver", f"an object, nonsmooth.{solver.__name__}()", solver)
    raise mistake("solver", "a name or an object of settings (nonsmooth.Nsgs(omega=0.9))", solver)


# What other libraries call the arguments of solve.
_ELSEWHERE = {
    "tol": ("tolerance", "eps", "rtol", "atol"),
    "time_limit": ("timeout", "time", "max_time"),
    "max_iter": ("max_iterations", "maxiter", "iterations"),
    "warm_start": ("x0", "z0", "r0", "start", "initial"),
    "solver": ("method", "algorithm"),
    "threads": ("n_threads", "num_threads", "n_jobs"),
}


def meant(error: _nonsmooth.Error, settings: Mapping[str, object]) -> _nonsmooth.Error:
    """The error, with the argument of solve that was meant where it says that a setting is unknown."""
    for key in settings:
        if f"unknown key `{key}`" in str(error):
            for name, others in _ELSEWHERE.items():
                if key in others:
                    return _nonsmooth.Error(f"{error}; solve has the argument `{name}`")
    return error
