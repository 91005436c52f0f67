"""Problems, by the letters of their statements."""

from __future__ import annotations

import html
import os
import tempfile
from typing import TYPE_CHECKING, Any, Callable, ClassVar, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _nonsmooth, arguments

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .answers import Answer
    from .sets import Set

Vector = npt.NDArray[np.float64]
Numbers = npt.ArrayLike
"""What numpy makes an array of real numbers of."""
Matrix = Any
"""An array of two dimensions, or a sparse matrix of scipy (csr, csc, bsr, coo, or what has ``tocsc``)."""
Path = Union[str, "os.PathLike[str]"]
Function = Callable[[Vector], Numbers]
"""x to the n values of F(x); NaN where F is not defined."""
Jacobian = Callable[[Vector], Matrix]
"""x to JF(x), n × n, with all entries or sparse."""


class Problem:
    """A problem of any kind. Its parts are attributes by their letters (``problem.q``), copies of what is there."""

    __slots__ = ("_native",)
    _native: _nonsmooth.Problem
    _kind: ClassVar[str] = ""

    def __init__(self) -> None:
        kinds = ", ".join(kind.__name__ for kind in Problem.__subclasses__())
        raise TypeError(f"Problem: expected one of its kinds ({kinds}), or nonsmooth.read")

    def __copy__(self) -> Problem:
        return Problem._of(self._native.copy())

    def __deepcopy__(self, memo: object) -> Problem:
        return self.__copy__()

    def __reduce__(self) -> Any:
        # As its file has it, to the last bit.
        ending = ".hdf5" if "friction" in self.kind else ".toml"
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "problem" + ending)
            try:
                self.save(path)
            except _nonsmooth.Error as error:
                raise TypeError(f"{type(self).__name__} cannot be pickled: {error}") from None
            with open(path, "rb") as file:
                return _unpickled, (ending, file.read())

    @classmethod
    def _of(cls, native: _nonsmooth.Problem) -> Problem:
        problem: Problem = object.__new__(_BY_KIND[native.kind])
        problem._native = native
        return problem

    def update(self, **parts: Any) -> None:
        """Puts other parts in the place of those that are there: ``problem.update(q=q)``.

        What a solver has found out of the pattern of the matrices is kept for the next solve with it.
        Parts have the names that the constructor has, and bounds may be one number for all. Where the number of unknowns is another one, names of variables are dropped. Cost: a copy of the problem. Raises :class:`Error` where the
        parts do not fit; then nothing is changed.
        """
        if "x0" in parts and "start" not in parts and self.kind in ("mcp", "vi"):
            parts["start"] = parts.pop("x0")
        bounds = {"lower", "upper"} & parts.keys()
        if bounds and "friction" not in self.kind:
            others = [parts[name] for name in ("q", "F", "start") if name in parts]
            sizes = (len(p) for p in others if isinstance(p, (list, tuple)) or getattr(p, "ndim", 0) == 1)
            n = next(sizes, self.unknowns)
            parts.update({name: _all(parts[name], n) for name in bounds})
        self._native.update(parts)

    def save(self, path: Path, answer: object = None) -> None:
        """Writes the problem in the format of the extension (.hdf5, .toml, .mtx, .nl, .csv), with a solution: an answer, or a point as :meth:`judge` takes it.

        What follows from the point (u, w, F, statuses) is that of the problem as it is now. What F raises is raised, and nothing is written.
        """
        from .answers import Answer

        self._native.save(arguments.path("path", path), answer._point if isinstance(answer, Answer) else answer)

    def judge(self, point: object, tol: float = 1e-8) -> dict[str, Any]:
        """What the judge says of a point: an answer, a dictionary of its parts, or the array z (x; of contacts the impulses r).

        Velocities v that are not given follow from the impulses r, and with them, of a global problem, the multipliers l of bilateral constraints. Of a local problem nothing
        follows: l that are not given are zero. What F raises is raised.
        """
        from .answers import Answer

        given = point._point if isinstance(point, Answer) else point
        return self._native.judge(given, arguments.real("tol", tol))

    @property
    def kind(self) -> str:
        """The kind's name in files and reports."""
        return self._native.kind

    @property
    def unknowns(self) -> int:
        """The number of scalar unknowns."""
        return self._native.unknowns

    @property
    def names(self) -> list[str]:
        """The names of the variables, if the file has any."""
        return self._native.names

    @property
    def title(self) -> Optional[str]:
        """The title in the file."""
        return self._native.title

    @property
    def solution(self) -> Optional[dict[str, Vector]]:
        """The solution that the file has, by its parts. Nobody has judged it."""
        return self._native.solution()

    @property
    def parts(self) -> dict[str, Any]:
        """All parts by their letters."""
        return {name: self._part(name) for name in self._native.letters()}

    def _part(self, name: str) -> Any:
        part = self._native.part(name)
        if isinstance(part, dict):
            from scipy.sparse import csc_matrix

            return csc_matrix(
                (part["data"], part["indices"], part["indptr"]), shape=part["shape"]
            )
        return part

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        part = self._part(name)
        if part is None:
            letters = ", ".join(self._native.letters())
            raise AttributeError(
                f"{type(self).__name__}: expected one of the parts {letters}, found {name}"
            )
        return part

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._native.letters()]

    def __repr__(self) -> str:
        title = f" {self.title!r}" if self.title else ""
        return f"<{type(self).__name__}{title}: {self._native.size}, {self.unknowns} unknowns>"

    def _repr_html_(self) -> str:
        rows = [("kind", self.kind), ("size", f"{self._native.size}, {self.unknowns} unknowns")]
        statement = STATEMENTS.get(self.kind)
        if statement:
            rows.insert(1, ("statement", statement))
        for name in self._native.letters():
            rows.append((name, _described(self._native.part(name))))
        return _table(self.title or type(self).__name__, rows)

    def spy(self, ax: Optional[Axes] = None) -> Axes:
        """Draws where the entries of the matrix of the problem are (W, M, Q), with matplotlib."""
        from .plots import spy

        return spy(self, ax)


def _described(part: Any) -> str:
    if isinstance(part, dict):
        m, n = part["shape"]
        return f"{m} × {n}, {len(part['data'])} entries"
    if isinstance(part, np.ndarray):
        if part.ndim == 1:
            shown = ", ".join(f"{x:.4g}" for x in part[:6])
            return f"[{shown}{', …' if part.size > 6 else ''}] ({part.size})"
        return " × ".join(map(str, part.shape))
    if isinstance(part, list):
        return "; ".join(part[:4]) + ("; …" if len(part) > 4 else "")
    return str(part)


def _table(title: str, rows: Sequence[tuple[str, str]]) -> str:
    cells = "".join(
        f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
        f"<td style='text-align:left'>{html.escape(text)}</td></tr>"
        for name, text in rows
    )
    return f"<table><caption>{html.escape(title)}</caption>{cells}</table>"


class Friction(Problem):
    """Unilateral contacts with Coulomb friction.

    For each contact ``K* ∋ u + mu ‖u_T‖ e_N ⟂ r ∈ K``, ``K = {‖r_T‖ ≤ mu r_N}``; entries by contact, ``[N, T]`` or ``[N, T1, T2]``.

    *Local form*, ``u = W r + q``: ``Friction(W=, q=, mu=)``. W is D·nc × D·nc in 1/kg, q in m/s.
    Scalar rows ``c = Vᵀ r + R λ + s`` with ``lower ≤ λ ≤ upper``: V, R, s, lower, upper.

    *Global form*, ``M v = H r + f``, ``u = Hᵀ v + w``: ``Friction(M=, H=, f=, w=, mu=)``. M is n × n in kg, H is n × D·nc,
    f in N·s, w in m/s. Scalar rows ``c = Gᵀ v + b``: G, b, lower, upper.

    *Rolling friction*: with ``mu_r=``, a length in m, contacts have five rows, ``[N, T1, T2, R1, R2]``, u_R in rad/s and r_R in N·m·s, and
    ``K = {‖r_T‖ ≤ mu r_N, ‖r_R‖ ≤ mu_r r_N}``.

    ``mu`` and ``mu_r`` are one number for all contacts or one for each. q and w may be given as nc × D. ``dimension`` is 2 or 3 where it does not
    follow from the shapes (a single mu: 3); with ``mu_r`` it is 5. Rows without bounds are bilateral constraints, ``c = 0``.
    """

    __slots__ = ()

    def __init__(
        self,
        *,
        mu: Optional[Numbers] = None,
        mu_r: Optional[Numbers] = None,
        W: Optional[Matrix] = None,
        q: Optional[Numbers] = None,
        V: Optional[Matrix] = None,
        R: Optional[Matrix] = None,
        s: Optional[Numbers] = None,
        M: Optional[Matrix] = None,
        H: Optional[Matrix] = None,
        f: Optional[Numbers] = None,
        w: Optional[Numbers] = None,
        G: Optional[Matrix] = None,
        b: Optional[Numbers] = None,
        lower: Optional[Numbers] = None,
        upper: Optional[Numbers] = None,
        dimension: Optional[int] = None,
    ) -> None:
        parts = dict(
            mu=mu, mu_r=mu_r, W=W, q=q, V=V, R=R, s=s, M=M, H=H, f=f, w=w, G=G, b=b, lower=lower, upper=upper
        )
        known = (2, 3) if mu_r is None else (5,)
        if dimension is not None and (np.ndim(dimension) != 0 or np.asarray(dimension).item() not in known):
            what = "5, as of all contacts with mu_r" if mu_r is not None else "one of 2, 3"
            raise arguments.mistake("dimension", what, dimension)
        given = None if dimension is None else arguments.whole("dimension", np.asarray(dimension).item())
        self._native = _nonsmooth.Problem.friction(parts, given)

    @property
    def contacts(self) -> int:
        """The number of contacts."""
        return self._native.contacts or 0

    @property
    def dimension(self) -> int:
        """The components of each contact: 2, 3, or 5 with rolling friction."""
        return self._native.dimension


class LCP(Problem):
    """The linear complementarity problem ``0 ≤ z ⟂ w = M z + q ≥ 0``, M n × n."""

    __slots__ = ()
    _kind = "lcp"

    def __init__(self, M: Matrix, q: Numbers) -> None:
        self._native = _nonsmooth.Problem.stated(self._kind, dict(M=M, q=q))


class MLCP(Problem):
    """The mixed one, ``A u + C v + a = 0``, ``0 ≤ v ⟂ D u + B v + b ≥ 0``.

    Either by blocks A, B, C, D, a, b, or as ``M z + q`` whose first ``free`` variables are free; the first ``equalities`` rows
    are then equalities (as many as there are free variables, where nothing else is said).
    """

    __slots__ = ()
    _kind = "mlcp"

    def __init__(
        self,
        M: Optional[Matrix] = None,
        q: Optional[Numbers] = None,
        free: Optional[int] = None,
        *,
        equalities: Optional[int] = None,
        A: Optional[Matrix] = None,
        B: Optional[Matrix] = None,
        C: Optional[Matrix] = None,
        D: Optional[Matrix] = None,
        a: Optional[Numbers] = None,
        b: Optional[Numbers] = None,
    ) -> None:
        parts = dict(M=M, q=q, free=free, equalities=equalities, A=A, B=B, C=C, D=D, a=a, b=b)
        self._native = _nonsmooth.Problem.stated(self._kind, parts)


class HLCP(Problem):
    """The horizontal one, ``Q x + R s = q``, ``0 ≤ x ⟂ s ≥ 0``."""

    __slots__ = ()
    _kind = "hlcp"

    def __init__(self, Q: Matrix, R: Matrix, q: Numbers) -> None:
        self._native = _nonsmooth.Problem.stated(self._kind, dict(Q=Q, R=R, q=q))


class BoxLCP(Problem):
    """``−(M z + q) ∈ N_[lower, upper](z)``; bounds are one number for all variables or one for each, and may be infinite. They are 0 and ∞ where nothing is said."""

    __slots__ = ()
    _kind = "box_lcp"

    def __init__(
        self,
        M: Matrix,
        q: Numbers,
        lower: Optional[Numbers] = None,
        upper: Optional[Numbers] = None,
    ) -> None:
        try:
            n: Optional[int] = np.size(q)
        except ValueError:
            n = 0  # What is wrong with q is said where it is read.
        lower = _all(0.0 if lower is None else lower, n)
        upper = _all(np.inf if upper is None else upper, n)
        parts = dict(M=M, q=q, lower=lower, upper=upper)
        self._native = _nonsmooth.Problem.stated(self._kind, parts)


class MCP(Problem):
    """The nonlinear mixed complementarity problem ``−F(x) ∈ N_[lower, upper](x)``.

    F is a function of an array, or a list of expressions in x1, x2, … (then values and Jacobian are exact and compiled). ``jac`` gives JF(x), n × n, with
    all entries or sparse; without it differences are taken, along ``pattern`` (a matrix, zero where JF is) where that is given; else F is called with NaN in some
    places to find out what depends on what, at four points: ``x0`` and three about it. What depends on more only elsewhere (``np.where``, ``max``) needs ``pattern`` or ``jac``:
    what was not seen is zero in the Jacobian. Where ``jac`` gives a sparse matrix and there is no pattern, the entries stored at ``x0`` are the pattern. ``x0`` is where solvers begin. Bounds are 0 and ∞ where nothing is said.

    An exception in F or jac ends the solve and is raised from it. Within a solve they are not called twice at the points last seen.
    """

    __slots__ = ()
    _kind = "mcp"

    def __init__(
        self,
        F: Union[Function, Sequence[str]],
        x0: Optional[Numbers] = None,
        *,
        jac: Optional[Jacobian] = None,
        lower: Optional[Numbers] = None,
        upper: Optional[Numbers] = None,
        pattern: Optional[Matrix] = None,
    ) -> None:
        read = arguments.functions("F", F)
        n = len(read) if isinstance(read, list) else None
        parts = dict(
            F=read,
            start=x0,
            jac=jac,
            lower=_all(lower, n),
            upper=_all(upper, n),
            pattern=pattern,
        )
        self._native = _nonsmooth.Problem.stated(self._kind, parts)

    @staticmethod
    def from_nl(path: Path) -> MCP:
        """The problem in a file of AMPL's format .nl, as AMPL and Pyomo write it."""
        problem = read(path)
        if not isinstance(problem, MCP):
            raise _nonsmooth.Error(f"{path}: expected a problem mcp, found {problem.kind}")
        return problem


class VI(Problem):
    """The variational inequality ``F(x)ᵀ (y − x) ≥ 0`` for all y of a convex set: find x in ``set``. F, jac and pattern as of :class:`MCP`."""

    __slots__ = ()
    _kind = "vi"

    def __init__(
        self,
        F: Union[Function, Sequence[str]],
        set: Set,
        x0: Optional[Numbers] = None,
        *,
        jac: Optional[Jacobian] = None,
        pattern: Optional[Matrix] = None,
    ) -> None:
        parts = dict(
            F=arguments.functions("F", F), set=set, start=x0, jac=jac, pattern=pattern
        )
        self._native = _nonsmooth.Problem.stated(self._kind, parts)


def _all(bound: Optional[Numbers], n: Optional[int]) -> Optional[Numbers]:
    """One bound for all n variables, where it is one."""
    # Of one that is masked it is said where it is read.
    if n is not None and bound is not None and np.ndim(bound) == 0 and not np.ma.isMaskedArray(bound):
        return np.full(n, bound)
    return bound


_STATED: tuple[type[Problem], ...] = (LCP, MLCP, HLCP, BoxLCP, MCP, VI)
_BY_KIND: dict[str, type[Problem]] = {
    **{kind._kind: kind for kind in _STATED},
    **{offer["kind"]: Friction for offer in _nonsmooth.offers() if "friction" in offer["kind"]},
}
STATEMENTS: dict[str, str] = {kind["kind"]: kind["statement"] for kind in _nonsmooth.kinds()}
"""The statements of complementarity problems by their kinds."""


def _unpickled(ending: str, content: bytes) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "problem" + ending)
        with open(path, "wb") as file:
            file.write(content)
        return read(path)


def read(path: Path) -> Any:
    """The problem in a file of any format: FCLIB (.hdf5), TOML, Matrix Market (.mtx), AMPL (.nl), Siconos' text (.dat).

    It is one of :class:`Friction`, :class:`LCP`, :class:`MLCP`, :class:`HLCP`, :class:`BoxLCP`, :class:`MCP`, :class:`VI`.
    """
    return Problem._of(_nonsmooth.Problem.read(arguments.path("path", path)))
