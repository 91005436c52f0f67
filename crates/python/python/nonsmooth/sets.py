"""The sets of variational inequalities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Box:
    """``{lower ≤ x ≤ upper}``; bounds may be infinite."""

    lower: npt.ArrayLike
    upper: npt.ArrayLike

    def _parts(self) -> dict[str, Any]:
        return {"kind": "box", "lower": self.lower, "upper": self.upper}


@dataclass(frozen=True)
class Polyhedron:
    """``{A x ≤ b, C x = d}``; without C there are no equations."""

    A: Any
    b: npt.ArrayLike
    C: Optional[Any] = None
    d: Optional[npt.ArrayLike] = None

    def _parts(self) -> dict[str, Any]:
        return {
            "kind": "polyhedron",
            "A": self.A,
            "b": self.b,
            "C": self.C,
            "d": np.zeros(0) if self.d is None else self.d,
        }


@dataclass(frozen=True)
class Ball:
    """``{‖x − centre‖ ≤ radius}``"""

    centre: npt.ArrayLike
    radius: float

    def _parts(self) -> dict[str, Any]:
        return {"kind": "ball", "centre": self.centre, "radius": self.radius}


@dataclass(frozen=True)
class SecondOrderCone:
    """``{x_1 ≥ ‖(x_2, …, x_n)‖}``"""

    dimension: int

    def _parts(self) -> dict[str, Any]:
        return {"kind": "second_order_cone", "dimension": self.dimension}


@dataclass(frozen=True)
class Product:
    """Of these sets, each in variables of its own, one after the other."""

    sets: Sequence[Set]

    def _parts(self) -> dict[str, Any]:
        return {"kind": "product", "sets": self.sets}


Set = Union[Box, Polyhedron, Ball, SecondOrderCone, Product]
"""What a variational inequality is stated over."""
