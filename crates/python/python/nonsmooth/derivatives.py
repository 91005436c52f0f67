"""Derivatives of solutions with respect to the data of their problems."""

from __future__ import annotations

from typing import Optional

import numpy as np
import numpy.typing as npt

from . import _nonsmooth, arguments
from .answers import Answer, Recorded
from .problems import Matrix, Problem, Vector


class Derivative:
    """The derivative of a solution with respect to one part of the data; of its parts by their names, as the answer has them.

    It comes from implicit differentiation on the active set: unknowns at a bound move with it, the equations of all others are linearised,
    ``(A + B S) dx = −B (dS x + dp) − c dmu``, ``dy = S dx + dS x + dp``. Where ``degenerate`` is not 0, so many pairs are zero on both sides or contacts at the border of two motions,
    and it is the derivative of one of the pieces that meet there: at best one element of the subdifferential.
    """

    def __init__(
        self, native: _nonsmooth.Derivative, letter: str, parameters: Optional[Matrix] = None
    ) -> None:
        self._native = native
        self._parameters = parameters
        self.with_respect_to = letter

    @property
    def degenerate(self) -> int:
        """The pairs or contacts at the border of two pieces."""
        return self._native.degenerate

    @property
    def parts(self) -> dict[str, int]:
        """The parts of the solution with their lengths: ``z, w``; ``x, F``; ``r, u`` (of global problems ``v`` too), ``l, c`` of scalar rows; ..."""
        return dict(self._native.solution)

    def jvp(self, direction: npt.ArrayLike) -> dict[str, Vector]:
        """How the parts of the solution change with the data in a direction, an array (or a sparse matrix) like the part: two triangular solves."""
        if self._parameters is not None:
            change, k = _nonsmooth.reals("dp", direction), self._parameters.shape[1]
            if change.shape not in ((k,), (k, 1)):
                raise _nonsmooth.Error(
                    f"dp: expected {k} entries (columns of parameters), found an array of {change.shape}"
                )
            return self._native.forward("F", self._parameters @ change)
        return self._native.forward(self.with_respect_to, direction)

    def vjp(self, **gradients: npt.ArrayLike) -> Vector:
        """The gradient with respect to the part of the data of a function of the solution, whose gradients with respect to parts of it are given: ``vjp(r=g)``.

        Two triangular solves, whatever the size of the part. Of a matrix it has all entries; see :meth:`factors` for large ones.
        """
        vectors, matrices = self._native.backward(gradients)
        if self._parameters is not None:
            pulled: Vector = self._parameters.T @ vectors["F"]
            return pulled
        if self.with_respect_to in vectors:
            return vectors[self.with_respect_to]
        first, *others = matrices[self.with_respect_to]
        whole: Vector = np.outer(*first)
        for a, b in others:
            whole += np.outer(a, b)
        return whole

    def factors(self, **gradients: npt.ArrayLike) -> list[tuple[Vector, Vector]]:
        """As :meth:`vjp` with respect to a matrix, which is ``Σ a bᵀ``: the pairs (a, b), of which an entry is ``Σ a[i] b[j]``."""
        _, matrices = self._native.backward(gradients)
        if self.with_respect_to not in matrices:
            raise _nonsmooth.Error(
                f"factors: expected a derivative with respect to a matrix, found {self.with_respect_to}"
            )
        return matrices[self.with_respect_to]

    def matrix(self, part: Optional[str] = None) -> Vector:
        """All derivatives of a part of the solution (of the first one: z, x, r or v), ``matrix[k, ...]`` with respect to the part of the data, which has the shape of that part.

        As many solves as the part has entries.
        """
        sizes = self.parts
        name = next(iter(sizes)) if part is None else arguments.one_of("part", sizes, part)
        return np.array([self.vjp(**{name: e}) for e in np.eye(sizes[name])])

    def __repr__(self) -> str:
        parts = ", ".join(self.parts)
        flag = f", {self.degenerate} degenerate" if self.degenerate else ""
        return f"<Derivative of {parts} with respect to {self.with_respect_to}{flag}>"


def derivative(
    problem: Problem,
    answer: Answer,
    with_respect_to: Optional[str] = None,
    *,
    parameters: Optional[Matrix] = None,
    tol: float = 1e-6,
    time_limit: Optional[float] = None,
) -> Derivative:
    """The derivative of the answer with respect to a part of the data, by its letter.

    ========================== ======================= ==============================================================
    problem                    parts of the solution   ``with_respect_to``
    ========================== ======================= ==============================================================
    LCP                        z, w                    q, M
    BoxLCP                     z, w                    q, lower, upper, M
    MLCP                       u, v, w                 q, M (of all rows and variables)
    HLCP                       x, s                    q, Q, R
    MCP, VI over a box         x, F                    F (a constant added to F), lower, upper, or ``parameters``
    VI over another set        x, F                    F, ``parameters``; lower, upper, b, d, centre, radius (of a product those of
                                                       its parts, one after the other); A, C of one polyhedron
    Friction, local form       r, u; l, c of rows      q, mu, W; s, lower, upper, V, R
    Friction, global form      v, r, u; l, c of rows   f, w, mu, M, H; b, lower, upper, G
    ========================== ======================= ==============================================================

    Where nothing is said: q; of nonlinear problems F, of the global form f. Where F depends on parameters p of your own, ``parameters`` is ∂F/∂p at the solution, n × k,
    and the derivative is one with respect to p. Entries of matrices are data each by itself: a change of a symmetric matrix has both of a pair.

    The judge has to accept the answer at ``tol`` (1e-6; the derivative has the accuracy of the answer, so solve with a small one). Cost: a sparse factorisation. Raises :class:`Error`
    where there is no derivative, as with impulses that are not unique, of rolling friction, of which none is known, and where ``time_limit`` seconds of wall clock have passed;
    Ctrl-C ends it too. What F and jac raise is raised here.
    """
    of = arguments.problem(problem)
    if not isinstance(answer, Answer):
        raise arguments.mistake("answer", "an answer of nonsmooth.solve", answer)
    if isinstance(answer._native, Recorded):
        raise _nonsmooth.Error("answer: expected one of this process, found one that was pickled; solve(problem, warm_start=answer) makes it one")
    native = _nonsmooth.Derivative(
        of, answer._native, arguments.real("tol", tol), arguments.seconds("time_limit", time_limit)
    )
    shapes = dict(native.data)
    if parameters is not None:
        if "F" not in shapes:
            raise _nonsmooth.Error(f"parameters: expected a problem with a function F, found {problem.kind}")
        if with_respect_to not in (None, "p"):
            raise _nonsmooth.Error(
                f"with_respect_to: expected nothing beside parameters, found {with_respect_to}"
            )
        sparse = hasattr(parameters, "tocsc")
        given: Matrix = parameters if sparse else _nonsmooth.reals("parameters", parameters)
        (n,) = shapes["F"]
        if given.ndim != 2 or given.shape[0] != n:
            raise _nonsmooth.Error(
                f"parameters: expected {n} rows (entries of F), found an array of {given.shape}"
            )
        if sparse:
            given = given.tocsc()
            _nonsmooth.reals("parameters.data", given.data)
        return Derivative(native, "p", given)
    letter = next(iter(shapes))
    if with_respect_to is not None:
        letter = arguments.one_of("with_respect_to", shapes, with_respect_to)
    return Derivative(native, letter)
