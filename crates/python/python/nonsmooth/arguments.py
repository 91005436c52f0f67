"""What callers pass, read once: numbers and solvers, and in words what was expected where they are something else."""

from __future__ import annotations

import operator
import os
from typing import Callable, Collection, Iterable, Mapping, Optional, SupportsFloat, SupportsIndex, TypeVar, Union

import numpy as np

from . import _nonsmooth
from .settings import Settings

Called = TypeVar("Called", bound=Callable[..., object])


def mistake(place: str, expected: str, found: object) -> _nonsmooth.Error:
    """The error that says what was expected at a place, and what was found, in a line."""
    first, *others = repr(found).splitlines() or [""]
    return _nonsmooth.Error(f"{place}: expected {expected}, found {first}{' …' if others else ''}")


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


def vector(place: str, value: object) -> _nonsmooth.Vector:
    """An array of one dimension."""
    array = _nonsmooth.reals(place, value)
    if array.ndim == 1:
        return array
    raise mistake(place, "an array of one dimension", value)


def flag(place: str, value: object) -> bool:
    """Whether something is so."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise mistake(place, "True or False", value)


def function(place: str, what: str, value: Optional[Called]) -> Optional[Called]:
    """A function, or none."""
    if value is None or callable(value):
        return value
    raise mistake(place, what, value)


def functions(place: str, value: Union[Called, Iterable[str]]) -> Union[Called, list[str]]:
    """F: a function, or its expressions. A text is no list of them, though it is one of its letters."""
    if callable(value):
        return value
    if isinstance(value, Iterable) and not isinstance(value, (str, bytes)):
        return list(value)
    raise mistake(place, "a function, or a list of expressions", value)


def path(place: str, value: object, what: str = "the path of a file") -> str:
    """The path of a file."""
    found = os.fspath(value) if isinstance(value, (str, os.PathLike)) else None
    if isinstance(found, str):
        return found
    raise mistake(place, what, value)


def one_of(place: str, names: Collection[str], value: object) -> str:
    """One of some names."""
    if isinstance(value, str) and value in names:
        return value
    raise _nonsmooth.Error(f"{place}: expected one of {', '.join(names)}, found {value}")


def problem(value: object, place: str = "problem") -> _nonsmooth.Problem:
    """A problem of this package."""
    # Its module reads its arguments here.
    from .problems import Problem

    if isinstance(value, Problem):
        return value._native
    raise mistake(place, "a problem (nonsmooth.LCP, Friction, ..., or nonsmooth.read)", value)


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
