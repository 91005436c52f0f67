"""Solving, and what comes of it."""

from __future__ import annotations

import copy
import enum
import html
from functools import cached_property
from typing import TYPE_CHECKING, Any, Callable, Mapping, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _nonsmooth, arguments
from ._nonsmooth import Progress
from .problems import Problem, Vector, _table
from .settings import Settings, registered

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


class Status(str, enum.Enum):
    """Whether a problem is solved and, if not, why the solve stopped. ``SOLVED`` is the judge's word, never the solver's."""

    SOLVED = "solved"
    """The judge accepts the point at the tolerance asked for."""
    INFEASIBLE = "infeasible"
    """There is no solution: proved, in exact arithmetic on the stored data."""
    NEARLY_INFEASIBLE = "nearly_infeasible"
    """There is no solution for data that differ from those stored by rounding."""
    NO_CONCLUSION = "no_conclusion"
    """The solver ended on a ray that the judge does not accept as a proof."""
    ITERATION_LIMIT = "iteration_limit"
    """``max_iter`` steps were done."""
    TIME_LIMIT = "time_limit"
    """``time_limit`` seconds have passed."""
    CANCELLED = "cancelled"
    """The callback said so."""
    STALLED = "stalled"
    """The solver could not go on."""

    def __str__(self) -> str:
        return str(self.value)


class Unsolved(RuntimeError):
    """An answer that the judge does not accept; see :meth:`Answer.raise_if_unsolved`."""

    def __init__(self, answer: Answer) -> None:
        failing = _failing(answer)
        super().__init__(
            f"{answer.message}; relative residual {answer.residual:.3g}" + (f"; fails {failing}" if failing else "")
        )
        self.answer = answer

    def __reduce__(self) -> Any:
        return Unsolved, (self.answer,)


def _failing(answer: Answer) -> str:
    """What else than the relative residual the judge does not accept, in the words of the command line."""
    return ", ".join(f"{what} {value:.3g}" for what, value in answer._native.failing)


class Table(np.ndarray[Any, np.dtype[np.void]]):
    """A structured array: a row for each contact or variable, columns by name."""

    def __getitem__(self, key: Any) -> Any:
        found = super().__getitem__(key)
        # A column is an array like any other.
        if isinstance(found, Table) and found.dtype.names is None:
            return found.view(np.ndarray)
        return found

    def to_pandas(self) -> pandas.DataFrame:
        """The same as a DataFrame; of a column with several components a column for each: ``r_0``, ``r_1``, ``r_2``."""
        import pandas

        columns: dict[str, npt.NDArray[Any]] = {}
        for name in self.dtype.names or ():
            column = np.asarray(self[name])
            if column.ndim == 1:
                columns[name] = column
            else:
                columns.update((f"{name}_{k}", column[:, k]) for k in range(column.shape[1]))
        return pandas.DataFrame(columns)


def _tabled(columns: Mapping[str, Any]) -> Table:
    arrays = {name: np.asarray(column) for name, column in columns.items()}
    # Contacts and variables are counted; names are words, of digits too.
    for name, column in columns.items():
        if name != "name" and isinstance(column, list) and column == [str(k) for k in range(len(column))]:
            arrays[name] = np.arange(len(column))
    size = max((a.size for a in arrays.values()), default=0)
    kinds = [(name, a.dtype if a.size else np.dtype(float)) for name, a in arrays.items()]
    made = np.empty(size, dtype=kinds)
    for name, a in arrays.items():
        made[name] = a
    return made.view(Table)


class Recorded:
    """What an answer says, without its problem: what :mod:`pickle` takes to another process."""

    FACTS = ("kind", "status", "solved", "message", "residual", "failing", "iterations", "factorisations", "seconds", "account")
    FOUND = ("parts", "residuals", "counts", "worst", "history", "certificate", "table")

    def __init__(self, native: Union[_nonsmooth.Answer, Recorded]) -> None:
        self.__dict__.update((name, getattr(native, name)) for name in self.FACTS)
        self._found = {name: getattr(native, name)() for name in self.FOUND}

    def __getattr__(self, name: str) -> Any:
        if name not in self.FOUND:
            raise AttributeError(name)
        return lambda: copy.copy(self._found[name])


class Answer:
    """What came of a solve: the best point found, whatever stopped it, and the judge's word on it.

    The parts of the point are attributes: ``r``, ``u`` (of global problems ``v`` too) and the multipliers ``l`` of contacts; ``z`` and ``w``, or ``x`` and
    ``F``, of complementarity problems. They are not to be written to; take a copy.
    """

    def __init__(self, native: Union[_nonsmooth.Answer, Recorded]) -> None:
        self._native = native

    def __reduce__(self) -> Any:
        # Without the problem, which a process that solves for another one was sent.
        return Answer, (Recorded(self._native),)

    def __copy__(self) -> Answer:
        return Answer(self._native)

    def __deepcopy__(self, memo: object) -> Answer:
        return self.__copy__()

    @property
    def _point(self) -> Union[_nonsmooth.Answer, dict[str, Vector]]:
        return self.parts if isinstance(self._native, Recorded) else self._native

    @property
    def status(self) -> Status:
        """Whether it is solved and, if not, why it stopped."""
        return Status(self._native.status)

    @property
    def solved(self) -> bool:
        """Whether the judge accepts the point."""
        return self._native.solved

    @property
    def message(self) -> str:
        """The status in a sentence."""
        return self._native.message

    @property
    def residual(self) -> float:
        """The relative residual, a pure number: the first of the judge's criteria.

        Bilateral constraints, the dynamics, and each contact by its own terms have criteria beside it (``residuals``): an answer may be unsolved though this is small. Which ones fail,
        its ``repr`` and :class:`Unsolved` say.
        """
        return self._native.residual

    @property
    def iterations(self) -> int:
        """Steps done."""
        return self._native.iterations

    @property
    def factorisations(self) -> int:
        """Matrices factorised that grow with the problem."""
        return self._native.factorisations

    @property
    def seconds(self) -> float:
        """Wall clock of the solve, s."""
        return self._native.seconds

    @property
    def account(self) -> list[str]:
        """What the solver says that it did."""
        return self._native.account

    @cached_property
    def parts(self) -> dict[str, Vector]:
        """The parts of the point by name: arrays that are not to be written to."""
        parts = self._native.parts()
        for part in parts.values():
            part.flags.writeable = False
        return parts

    @cached_property
    def residuals(self) -> dict[str, float]:
        """All residuals by name: absolute (m/s), relative, literature, siconos, primal, dual, complementarity, ..."""
        return self._native.residuals()

    @cached_property
    def counts(self) -> dict[str, int]:
        """How many contacts are open, stick and slip; how many rows are where."""
        return self._native.counts()

    @property
    def worst(self) -> list[tuple[int, float]]:
        """The contacts or rows with the largest residuals, worst first."""
        return self._native.worst()

    @cached_property
    def table(self) -> Table:
        """A row for each contact or variable: its status and its part of the point."""
        return _tabled(self._native.table())

    @property
    def contacts(self) -> Table:
        """A row for each contact: status, impulse r (N·s) and velocity u (m/s) by components, mu."""
        if "friction" not in self._native.kind:
            raise AttributeError("contacts")
        return self.table

    @cached_property
    def history(self) -> Table:
        """The visits of the judge on the way: iteration, seconds, residual."""
        rows = self._native.history()
        return _tabled(
            {"iteration": rows[:, 0].astype(int), "seconds": rows[:, 1], "residual": rows[:, 2]}
        )

    @property
    def certificate(self) -> Optional[dict[str, Any]]:
        """What the status rests on, where it says that there is no solution; of a proof also ``exact``: for each vector (row, fraction as text) of the entries that were verified in exact arithmetic."""
        return self._native.certificate()

    def raise_if_unsolved(self) -> Answer:
        """Itself, if the judge accepts the point; raises :class:`Unsolved` otherwise."""
        if not self.solved:
            raise Unsolved(self)
        return self

    def __getattr__(self, name: str) -> Vector:
        if name.startswith("_"):
            raise AttributeError(name)
        if name == "contacts":
            # What the property raised is lost on the way here.
            raise AttributeError(f"contacts: expected a problem of contacts, found {self._native.kind}")
        if name not in self.parts:
            parts = ", ".join(self.parts)
            raise AttributeError(f"Answer: expected one of the parts {parts}, found {name}")
        return self.parts[name]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.parts]

    def __repr__(self) -> str:
        failing = _failing(self)
        return (
            f"<Answer: {self.status}, residual {self.residual:.2e}, "
            + (f"fails {failing}, " if failing else "")
            + f"{self.iterations} iterations, {self.seconds:.3g} s>"
        )

    def _repr_html_(self) -> str:
        rows = [
            ("status", self.message),
            ("residual", f"{self.residual:.3e} (relative; the judge's)"),
            ("work", f"{self.iterations} iterations, {self.seconds:.3g} s"),
            ("counts", ", ".join(f"{n} {name}" for name, n in self.counts.items() if n)),
        ]
        if failing := _failing(self):
            rows.insert(2, ("fails", failing))
        said = "".join(f"<li>{html.escape(line)}</li>" for line in self.account)
        return _table("Answer", rows) + (f"<ul>{said}</ul>" if said else "")

    def plot(self) -> Figure:
        """Draws the history of the residual and, of contacts, the impulses and where they are in the cone; with matplotlib."""
        from .plots import plot

        return plot(self)


def solve(
    problem: Problem,
    solver: Union[str, Settings] = "auto",
    *,
    tol: float = 1e-8,
    time_limit: Optional[float] = None,
    max_iter: Optional[int] = None,
    threads: int = 1,
    warm_start: Union[Answer, npt.ArrayLike, Mapping[str, npt.ArrayLike], None] = None,
    callback: Optional[Callable[[Progress], object]] = None,
    **settings: object,
) -> Answer:
    """Solves a problem; the status is the judge's.

    ``solver`` is a name of ``nonsmooth.solvers(problem)``, perhaps behind prefixes (``"condense/nsgs"``), with its settings as further
    keywords, or an object of settings: ``nonsmooth.Nsgs(omega=0.9)``. ``tol`` is the relative residual to reach, in (0, 1].
    ``time_limit`` is in seconds of wall clock; ``max_iter`` is 1 000 000, or none where there is a limit of time.
    ``threads`` is how many may factorise a large matrix or sweep over a large pile, 0 for one a core; the results are the same, bit for bit.
    ``warm_start`` is an answer, a dictionary of parts, or the array z (x; of contacts the impulses r).
    ``callback`` is called after each step (of a large problem now and then) with a :class:`Progress`; if it returns something true, the solve
    ends with the best point so far; what it raises is raised here.

    The GIL is released. Ctrl-C raises KeyboardInterrupt, with the best point so far as its attribute ``answer``. Functions of the problem run in the present
    context (``contextvars``, ``numpy.errstate``), of large problems on another thread. What they raise ends the solve and is raised here, but where F is
    only asked whether it is defined (a step that may leave its domain): there it is the answer that it is not, of which an unsolved answer has the first in its
    ``account``. What F gives in another shape, MemoryError, RecursionError and NameError are raised there too. Raises :class:`Error` for what is a mistake; that there is no solution, or that none was found, is a status.
    """
    name, own = arguments.named(solver)
    every = {**own, **registered(settings)} if settings else own
    callback = arguments.function("callback", "a function of nonsmooth.Progress", callback)
    try:
        native = _nonsmooth.solve(
            arguments.problem(problem),
            name,
            every or None,
            arguments.real("tol", tol),
            arguments.seconds("time_limit", time_limit),
            None if max_iter is None else arguments.whole("max_iter", max_iter),
            arguments.whole("threads", threads),
            warm_start._point if isinstance(warm_start, Answer) else warm_start,
            callback,
        )
    except _nonsmooth.Error as error:
        raise arguments.meant(error, settings) from None
    except KeyboardInterrupt as stopped:
        best = getattr(stopped, "answer", None)
        if best is not None:
            setattr(stopped, "answer", Answer(best))
        raise
    return Answer(native)
