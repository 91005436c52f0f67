"""Derivatives of solutions with respect to the data of their problems."""

from __future__ import annotations

from typing import Optional

import numpy as np
import numpy.typing as npt

from . import _nonsmooth
from .answers import Answer
from .problems import Problem, Vector


class Derivative:
    """The derivative of a solution x (z; of contacts r) and of y (w; u) with respect to one part of the data.

    It comes from implicit differentiation on the active set. Where ``degenerate`` is not 0, so many pairs are zero on both sides or contacts at the border of two motions,
    and it is the derivative of one of the pieces that meet there.
    """

    def __init__(self, native: _nonsmooth.Derivative, letter: str) -> None:
        self._native = native
        self.with_respect_to = letter

    @property
    def degenerate(self) -> int:
        """The pairs or contacts at the border of two pieces."""
        return self._native.degenerate

    def jvp(self, direction: npt.ArrayLike) -> tuple[Vector, Vector]:
        """dx and dy of a change of the data in a direction, an array (or a sparse matrix) like the part."""
        key = {"q": "vector", "mu": "mu"}.get(self.with_respect_to, "matrix")
        return self._native.forward(**{key: direction})

    def vjp(self, x: Optional[npt.ArrayLike] = None, y: Optional[npt.ArrayLike] = None) -> Vector:
        """The gradient with respect to the part of a function whose gradients with respect to x and y are given (0 where nothing is): one solve, whatever the size of the part.

        For W and M it has all n × n entries, the outer product of the gradient with respect to q and of x.
        """
        point = self._native.point()
        zero = np.zeros_like(point)
        q, mu = self._native.backward(zero if x is None else x, zero if y is None else y)
        if self.with_respect_to == "q":
            return q
        return mu if self.with_respect_to == "mu" else np.outer(q, point)

    @property
    def matrix(self) -> Vector:
        """All derivatives of x: n × n for q, n × nc for mu; for W and M n × n × n, ``matrix[k, i, j]`` that of x_k with respect to the entry i, j."""
        point = self._native.point()
        rows = [self._native.backward(e, np.zeros_like(point)) for e in np.eye(point.size)]
        which = 1 if self.with_respect_to == "mu" else 0
        by = np.array([row[which] for row in rows])
        return by if self.with_respect_to in ("q", "mu") else np.einsum("ki,j->kij", by, point)


def derivative(
    problem: Problem,
    answer: Answer,
    with_respect_to: str = "q",
    *,
    tol: float = 1e-6,
) -> Derivative:
    """The derivative of the answer with respect to ``"q"``, ``"mu"``, or the matrix, ``"W"`` or ``"M"``.

    For linear complementarity problems and local problems of contacts without scalar rows. The judge has to accept the answer at ``tol`` (1e-6; the
    derivative has the accuracy of the answer, so solve with a small one). Raises :class:`Error` where there is no derivative: impulses that are not unique.
    """
    letters = problem._native.letters()
    if with_respect_to not in ("q", "mu", "W", "M") or with_respect_to not in letters:
        known = ", ".join(letter for letter in ("q", "mu", "W", "M") if letter in letters)
        raise _nonsmooth.Error(f"with_respect_to: expected one of {known}, found {with_respect_to}")
    native = _nonsmooth.Derivative(problem._native, answer._native, tol)
    return Derivative(native, with_respect_to)
