"""Nonsmooth mechanics: state, solve and judge frictional contact and complementarity problems; simulate bodies in contact.

>>> import numpy as np
>>> import nonsmooth as ns
>>> problem = ns.Friction(W=np.eye(3), q=[-1.0, 2.0, 1.5], mu=0.5)  # a box pressed down and pushed
>>> answer = ns.solve(problem)
>>> answer.status
<Status.SOLVED: 'solved'>
>>> answer.r.round(6).tolist()
[1.0, -0.4, -0.3]

The status is the judge's, who shares nothing with the solvers. Mistakes are :class:`Error`; numerics are statuses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._nonsmooth import VERSION as __version__
from ._nonsmooth import Error, Progress, Step
from .answers import Answer, Status, Table, Unsolved, solve
from .derivatives import Derivative, derivative
from .comparing import Runs, bench, read_runs
from .problems import HLCP, LCP, MCP, MLCP, VI, BoxLCP, Friction, Problem, read
from .sets import Ball, Box, Polyhedron, Product, SecondOrderCone, Set
from .settings import CLASSES as _CLASSES
from .settings import Settings, solvers
from .simulation import Picture, Run, Simulation, World, draw, load, simulate

if TYPE_CHECKING:
    from .settings import *  # noqa: F403

globals().update(_CLASSES)

# Where it is found again by who reads a pickled one.
Error.__module__ = __name__

__all__ = [
    "Answer",
    "Ball",
    "Box",
    "BoxLCP",
    "Derivative",
    "Error",
    "Friction",
    "HLCP",
    "LCP",
    "MCP",
    "MLCP",
    "Picture",
    "Polyhedron",
    "Problem",
    "Product",
    "Progress",
    "Run",
    "Runs",
    "SecondOrderCone",
    "Set",
    "Settings",
    "Simulation",
    "Status",
    "Step",
    "Table",
    "Unsolved",
    "VI",
    "World",
    "bench",
    "derivative",
    "draw",
    "load",
    "read",
    "read_runs",
    "simulate",
    "solve",
    "solvers",
    *_CLASSES,
]
