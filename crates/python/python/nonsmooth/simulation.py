"""Worlds in motion."""

from __future__ import annotations

import base64
import copy
import html
import json
import math
import pathlib
from functools import cached_property
from typing import TYPE_CHECKING, Any, Callable, Iterator, Mapping, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _nonsmooth, arguments
from ._nonsmooth import Step
from .answers import Table
from .problems import Friction, Path, Problem, Vector
from .settings import Settings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Triple = Union[Sequence[float], npt.NDArray[np.float64]]
"""Three numbers."""
WORLD = "world"
"""What stands for the world where a joint asks for a body."""


def _number(value: object) -> object:
    """What JSON knows of what numpy has."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise _nonsmooth.Error(f"scene: expected numbers, words and lists, found {type(value).__name__}")


def _own(table: Mapping[str, object]) -> dict[str, Any]:
    """What is said in a table, and stays so whatever the caller does with its arrays; nothing is said by None."""
    own: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            own[key] = _own(value)
        elif value is not None:
            _check(value, key)
            own[key] = copy.deepcopy(value)
    return own


def _check(value: object, place: str) -> None:
    """Refuses, by its place, what is no number, word or list of them."""
    if isinstance(value, (list, tuple)):
        for k, one in enumerate(value):
            _check(one, f"{place}[{k}]")
    elif isinstance(value, Mapping):
        for key, one in value.items():
            _check(one, f"{place}.{key}")
    elif value is None:
        raise _nonsmooth.Error(f"{place}: expected numbers (infinite ones where there is no limit), found None")
    elif isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        found = "a masked array (filled() says what stands for what is masked)" if value.ndim else "a masked number"
        raise _nonsmooth.Error(f"{place}: expected numbers, found {found}")
    elif isinstance(value, (np.ndarray, np.generic)):
        if value.dtype.kind not in "biufU":
            raise _nonsmooth.Error(f"{place}: expected an array of numbers, found one of {value.dtype}")
    elif not isinstance(value, (bool, int, float, str)):
        raise _nonsmooth.Error(f"{place}: expected numbers, words and lists, found {type(value).__name__}")


def _infinite(value: object, place: str) -> Iterator[tuple[str, float]]:
    """The numbers that are not finite, with their places."""
    value = _number(value) if isinstance(value, (np.generic, np.ndarray)) else value
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _infinite(part, f"{place}.{key}")
    elif isinstance(value, (list, tuple)):
        for k, part in enumerate(value):
            yield from _infinite(part, f"{place}[{k}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield place, value


class World:
    """Bodies, the laws of their contacts and their joints: a scene, as a file of ``nonsmooth simulate`` states it.

    The methods add to it and give back the names by which joints and forces speak of bodies. What they take beyond what is named here is what tables
    of scene files have (docs/simulation): ``density`` or ``mass`` and ``inertia``, ``position``, ``rotation``, ``velocity``, ``angular_velocity``, ``material``,
    ``fixed``, ``motion``, ``force``, ``torque``, ``groups``, ``collides_with`` of bodies. SI units. ``document`` is all of it.

    With ``dimension=2`` a world of the plane of the first two axes: vectors have two components, what turns has one. Where no gravity is given it is 9.81 m/s²
    against the last axis.
    """

    def __init__(self, gravity: Optional[Triple] = None, name: str = "", *, dimension: int = 3) -> None:
        self.document: dict[str, Any] = {
            "format": "nonsmooth-scene",
            "version": 1,
            "name": name,
            "time": {"h": 1e-3, "end": 1.0},
        }
        if dimension != 3:
            self.document["dimension"] = arguments.whole("dimension", dimension)
        down = [-9.81 * x for x in self._upwards()]
        self.document["gravity"] = down if gravity is None else arguments.vector("gravity", gravity).tolist()
        self.warnings: list[str] = []

    def _list(self, name: str) -> list[Any]:
        made: list[Any] = self.document.setdefault(name, [])
        return made

    def _named(self, name: str, kind: str, *lists: str) -> str:
        """The name that is given, else the first that is free from the number of those in the first list on."""
        if name:
            return name
        taken = {entry.get("name") for others in lists for entry in self.document.get(others, [])}
        k = len(self.document.get(lists[0], []))
        while f"{kind}{k}" in taken:
            k += 1
        return f"{kind}{k}"

    def body(self, shape: Optional[Mapping[str, object]] = None, *, name: str = "", **table: object) -> str:
        """Adds a body with a shape (``{"kind": "sphere", "radius": 0.1}``), or ``shapes``; its name, made where none is given."""
        bodies = self._list("bodies")
        name = self._named(name, "body", "bodies", "elastic")
        entry = {"name": name, **_own(table)}
        if shape is not None:
            entry["shape"] = _own(shape)
        bodies.append(entry)
        return name

    def _upwards(self) -> list[float]:
        return [0.0, 1.0] if self.document.get("dimension", 3) == 2 else [0.0, 0.0, 1.0]

    def plane(self, normal: Optional[Triple] = None, *, name: str = "", **table: object) -> str:
        """A half space below a plane through ``position``, whose normal points upwards where none is given; fixed unless it has a ``motion``."""
        shape = {"kind": "plane", "normal": self._upwards() if normal is None else list(normal)}
        fixed = {} if table.get("motion") is not None else {"fixed": True}
        return self.body(shape, name=name, **{**fixed, **table})

    def sphere(self, radius: float, *, name: str = "", **table: object) -> str:
        """A ball, radius in m."""
        return self.body({"kind": "sphere", "radius": radius}, name=name, **table)

    def box(self, half: Triple, *, name: str = "", **table: object) -> str:
        """A box by its half sides, m."""
        return self.body({"kind": "box", "half": list(half)}, name=name, **table)

    def capsule(self, half_length: float, radius: float, *, name: str = "", **table: object) -> str:
        """All points within the radius of a segment on the third axis, m."""
        shape = {"kind": "capsule", "half_length": half_length, "radius": radius}
        return self.body(shape, name=name, **table)

    def cylinder(self, half_length: float, radius: float, *, name: str = "", **table: object) -> str:
        """A cylinder about the third axis, m."""
        shape = {"kind": "cylinder", "half_length": half_length, "radius": radius}
        return self.body(shape, name=name, **table)

    def cone(self, half_length: float, radius: float, *, name: str = "", **table: object) -> str:
        """A cone about the third axis, its point above, m."""
        shape = {"kind": "cone", "half_length": half_length, "radius": radius}
        return self.body(shape, name=name, **table)

    def polyhedron(
        self, vertices: npt.ArrayLike, faces: Sequence[Sequence[int]], *, name: str = "", **table: object
    ) -> str:
        """A convex polyhedron: vertices (m), and the vertices of each face counterclockwise from outside."""
        shape = {"kind": "polyhedron", "vertices": np.asarray(vertices), "faces": faces}
        return self.body(shape, name=name, **table)

    def mesh(
        self, vertices: npt.ArrayLike, triangles: npt.ArrayLike, *, name: str = "", **table: object
    ) -> str:
        """A surface of triangles: vertices (m), and three of them by number, counterclockwise from outside."""
        shape = {"kind": "mesh", "vertices": np.asarray(vertices), "triangles": np.asarray(triangles)}
        return self.body(shape, name=name, **table)

    def disc(self, radius: float, *, name: str = "", **table: object) -> str:
        """A disc of a world in the plane, radius in m."""
        return self.body({"kind": "disc", "radius": radius}, name=name, **table)

    def polygon(self, vertices: npt.ArrayLike, *, name: str = "", **table: object) -> str:
        """A convex polygon of a world in the plane: vertices (m), counterclockwise."""
        return self.body({"kind": "polygon", "vertices": np.asarray(vertices)}, name=name, **table)

    def elastic(
        self, half: Triple, divisions: Sequence[int], young: float, *, name: str = "", **table: object
    ) -> str:
        """An elastic box by its half sides (m), its elements along each axis and Young's modulus (Pa); further ``poisson``, ``density`` or ``material``, ``damping``, ``held``, ..."""
        solids = self._list("elastic")
        name = self._named(name, "elastic", "elastic", "bodies")
        entry = {"name": name, "half": list(half), "divisions": list(divisions), "young": young}
        solids.append({**entry, **_own(table)})
        return name

    def generate(self, scene: str, *, name: Optional[str] = None, **settings: object) -> None:
        """Adds the bodies of a family of ``nonsmooth gen``: ``world.generate("wall", rows=4)``."""
        entry: dict[str, object] = {"scene": scene, "set": _own(settings)}
        if name is not None:
            entry["name"] = name
        self._list("generate").append(entry)

    def material(self, name: str, density: Optional[float] = None) -> str:
        """Adds a material; density in kg/m³."""
        table = {} if density is None else {"density": density}
        self.document.setdefault("materials", {})[name] = table
        return name

    def pair(
        self, a: str, b: Optional[str] = None, *, mu: float, e: float = 0.0, **table: object
    ) -> None:
        """The law of contact of two materials; of ``"default"`` alone that of all pairs that are not listed. Two materials that may meet need one; what names no material is of ``"default"``."""
        if a == "default" and b is None:
            self.document["pairs_default"] = {"mu": mu, "e": e, **_own(table)}
        else:
            self._list("pairs").append({"between": [a, b or a], "mu": mu, "e": e, **_own(table)})

    def joint(self, kind: str, a: str, b: str, *, name: str = "", **table: object) -> str:
        """Adds a joint between two bodies, or a body and ``"world"``; its name.

        ``kind``: fixed, revolute, prismatic, cylindrical, screw, spherical, universal, planar, point_on_line, point_on_plane, distance. ``table``: ``anchor``, ``axis``
        (in the frame of the world), ``limits`` (a pair, or a table), ``spring``, ``friction``, ``motor``, ``motion``, ...
        """
        joints = self._list("joints")
        name = self._named(name, "joint", "joints")
        entry = _own(table)
        limits = entry.get("limits")
        if isinstance(limits, (tuple, list, np.ndarray)):
            if len(limits) != 2:
                raise _nonsmooth.Error(f"{name}: limits: expected a pair (lower, upper), found {len(limits)} entries")
            # A limit at infinity is none.
            pair = zip(("lower", "upper"), limits, (-math.inf, math.inf))
            entry["limits"] = {key: limit for key, limit, none in pair if limit != none}
        joints.append({"kind": kind, "a": a, "b": b, "name": name, **entry})
        return name

    def revolute(
        self, a: str, b: str, *, anchor: Triple, axis: Triple, name: str = "", **table: object
    ) -> str:
        """A hinge about an axis through an anchor."""
        return self.joint("revolute", a, b, name=name, anchor=list(anchor), axis=list(axis), **table)

    def prismatic(self, a: str, b: str, *, axis: Triple, name: str = "", **table: object) -> str:
        """A slide along an axis."""
        return self.joint("prismatic", a, b, name=name, axis=list(axis), **table)

    def spherical(self, a: str, b: str, *, anchor: Triple, name: str = "", **table: object) -> str:
        """A ball in a socket at an anchor."""
        return self.joint("spherical", a, b, name=name, anchor=list(anchor), **table)

    def couple(self, weights: Mapping[str, float], *, name: str = "") -> None:
        """Keeps a weighted sum of coordinates of joints constant, by the names of the joints: gears, racks, pulleys."""
        if not isinstance(weights, Mapping):
            raise arguments.mistake("weights", "a dictionary of weights by the names of joints", weights)
        terms = [{"joint": joint, "weight": weight} for joint, weight in weights.items()]
        self._list("couplings").append({"name": name, "terms": terms})

    def force(self, body: str, force: Triple, **table: object) -> None:
        """A force (N) on a body, perhaps ``at`` a point of it, ``from`` a time ``until`` another."""
        self._list("forces").append({"body": body, "force": list(force), **_own(table)})

    def json(self) -> str:
        """The scene as a JSON document, which ``nonsmooth simulate`` takes."""
        try:
            return json.dumps(self.document, default=_number, allow_nan=False)
        except _nonsmooth.Error:
            raise
        except ValueError:
            place, found = next(_infinite(self.document, "scene"), ("scene", "one that is not"))
            raise _nonsmooth.Error(f"{place}: expected a finite number, found {found}") from None

    def save(self, path: Path) -> None:
        """Writes the scene: with every default as TOML (.toml), else as JSON."""
        target = pathlib.Path(path)
        text = _nonsmooth.Simulation(self.json(), False).toml() if target.suffix == ".toml" else self.json()
        target.write_text(text, encoding="utf-8")

    def copy(self) -> World:
        """A world like this one."""
        return copy.deepcopy(self)

    def __repr__(self) -> str:
        counted = ((name, len(self.document.get(name, []))) for name in ("bodies", "joints", "generate"))
        return f"<World: {', '.join(f'{n} {name}' for name, n in counted if n) or 'empty'}>"

    def _repr_html_(self) -> str:
        try:
            return draw(self).text
        except _nonsmooth.Error as unfinished:
            return f"<pre>{html.escape(f'{self!r}: {unfinished}')}</pre>"


class Picture:
    """A drawing as SVG, which notebooks show."""

    def __init__(self, text: str) -> None:
        self.text = text

    def save(self, path: Path) -> None:
        """Writes it."""
        pathlib.Path(path).write_text(self.text, encoding="utf-8")

    def _repr_svg_(self) -> str:
        return self.text


def draw(scene: Union[World, Run], frame: int = -1) -> Picture:
    """A picture on paper of a world as it begins, or of a frame of a run."""
    if isinstance(scene, Run):
        return scene.draw(frame)
    if not isinstance(scene, World):
        raise arguments.mistake("scene", "a nonsmooth.World or a run", scene)
    return Picture(_nonsmooth.draw(scene.json()))


def load(path: Path) -> World:
    """The world of a scene file (TOML or JSON), with its meshes, of a robot (URDF, or a model of MuJoCo), or of a scene of Siconos (its mechanics HDF5). What was left out is in ``warnings``."""
    text, warnings = _nonsmooth.read_scene(arguments.path("path", path))
    world = World()
    world.document, world.warnings = json.loads(text), warnings
    return world


class Simulation:
    """A world in motion by Moreau–Jean time stepping; each step states a frictional contact problem, which is solved and judged.

    ``h`` is the step in s (that of the world's file where nothing is said); ``solver`` a name or an object of settings for local problems in space; ``tol`` the residual that
    the judge is content with. ``settle`` moves bodies apart that overlap at the start, in place of refusing them. ``integrator`` takes what the
    table ``integrator`` of scene files has. Raises :class:`Error` for a world that is not possible.
    """

    def __init__(
        self,
        world: World,
        h: Optional[float] = None,
        *,
        solver: Union[str, Settings, None] = None,
        tol: Optional[float] = None,
        settle: bool = False,
        **integrator: object,
    ) -> None:
        if not isinstance(world, World):
            raise arguments.mistake("world", "a nonsmooth.World (nonsmooth.load reads one)", world)
        world = world.copy()
        document = world.document
        if h is not None:
            document["time"]["h"] = arguments.real("h", h)
        if integrator:
            document["integrator"] = {**document.get("integrator", {}), **integrator}
        table = document.setdefault("solver", {})
        if solver is not None:
            name, settings = arguments.named(solver)
            table["name"], table["settings"] = name, dict(settings)
        if tol is not None:
            table["tol"] = arguments.real("tol", tol)
        self.h = float(document["time"]["h"])
        self._world = world
        self._native = _nonsmooth.Simulation(world.json(), arguments.flag("settle", settle))

    @property
    def t(self) -> float:
        """The time, s."""
        return self._native.t

    @property
    def bodies(self) -> list[str]:
        """The names of the bodies, in their order."""
        return self._native.bodies

    @property
    def warnings(self) -> list[str]:
        """What is to be said of the world."""
        return [*self._world.warnings, *self._native.warnings]

    @property
    def position(self) -> Vector:
        """Mass centres as they are now, bodies × 3, m."""
        return self._native.state()["position"]

    @property
    def rotation(self) -> Vector:
        """Unit quaternions [w, x, y, z], bodies × 4."""
        return self._native.state()["rotation"]

    @property
    def velocity(self) -> Vector:
        """Velocities of the mass centres, bodies × 3, m/s."""
        return self._native.state()["velocity"]

    @property
    def angular_velocity(self) -> Vector:
        """bodies × 3, rad/s, in the frame of the world."""
        return self._native.state()["angular_velocity"]

    def problem(self) -> Optional[Friction]:
        """The contact problem of the next step; None where nothing touches and no joint holds."""
        native = self._native.problem(self.h)
        problem = None if native is None else Problem._of(native)
        assert problem is None or isinstance(problem, Friction)
        return problem

    def run(
        self,
        until: float,
        *,
        every: int = 1,
        on_step: Optional[Callable[[Step], object]] = None,
    ) -> Run:
        """Moves on until the time ``until`` (s), a frame every so many steps.

        ``on_step`` is called with each :class:`Step`; if it returns something true the run ends there; what it raises is raised here. Ctrl-C raises
        KeyboardInterrupt. Either way the simulation is whole, and goes on from the last step.
        """
        until, every = arguments.real("until", until), arguments.whole("every", every)
        on_step = arguments.function("on_step", "a function of nonsmooth.Step", on_step)
        if until < 0.0:
            raise arguments.mistake("until", f"a time of at least 0 s (it is {self.t:g} s)", until)
        return Run(self._native.run(until, self.h, every, on_step), self)

    def step(
        self, *, forces: Optional[npt.ArrayLike] = None, torques: Optional[npt.ArrayLike] = None
    ) -> Step:
        """Moves on by one step of ``h``, and returns what it came to; its ``status`` is "solved" where the judge accepts it.

        ``forces`` (N, at the mass centres) and ``torques`` (N·m, about them), bodies × 3 in the frame of the world, act in this step alone, beside those of the world: what a
        controller asks for. Bodies that stand or are moved do not feel them. No trajectory is kept; :meth:`run` keeps one. Ctrl-C raises KeyboardInterrupt, with the
        simulation as it was before the step.
        """
        wrenches = (self._rows("forces", forces), self._rows("torques", torques))
        return self._native.step(self.h, *wrenches)

    def _rows(self, place: str, value: Optional[npt.ArrayLike]) -> Optional[Vector]:
        """A vector of the space for each body."""
        if value is None:
            return None
        rows = np.ascontiguousarray(_nonsmooth.reals(place, value))
        if rows.shape != (len(self.bodies), 3):
            raise arguments.mistake(place, f"finite numbers, bodies × 3 = {len(self.bodies)} × 3", rows.shape)
        if not np.isfinite(rows).all():
            body, axis = np.argwhere(~np.isfinite(rows))[0]
            raise arguments.mistake(f"{place}[{body}, {axis}]", "a finite number", float(rows[body, axis]))
        return rows

    def checkpoint(self) -> bytes:
        """All that the next step depends on, to be kept; :meth:`restore` goes on from it, bit for bit, in any simulation of the same world."""
        return self._native.checkpoint()

    def restore(self, checkpoint: bytes) -> None:
        """Goes back, or on, to a checkpoint of the same world."""
        if not isinstance(checkpoint, (bytes, bytearray)):
            raise arguments.mistake("checkpoint", "bytes, of Simulation.checkpoint", type(checkpoint).__name__)
        self._native.restore(bytes(checkpoint))


class Run:
    """What a simulation left behind: of each step time, energies, residual and counts; of each frame the motion and the contacts."""

    def __init__(self, native: _nonsmooth.Run, simulation: Simulation) -> None:
        self._native = native
        self.simulation = simulation

    @property
    def solved(self) -> bool:
        """Whether the judge accepts every step and the run came to its end."""
        return self._native.solved

    @property
    def stopped(self) -> bool:
        """Whether it was ended before."""
        return self._native.stopped

    @property
    def deep(self) -> int:
        """Steps in which bodies overlapped by more than a tenth of the smaller one: shapes may have passed through each other, though every step is solved."""
        return self._native.deep

    @property
    def first_deep(self) -> Optional[float]:
        """When the first of these steps ended, s."""
        return self._native.first_deep

    @property
    def bodies(self) -> list[str]:
        """The names of the bodies."""
        return self._native.bodies

    @property
    def status(self) -> list[str]:
        """How each step ended."""
        return self._native.status

    @cached_property
    def _frames(self) -> dict[str, Vector]:
        return self._native.frames()

    @cached_property
    def steps(self) -> dict[str, Any]:
        """Of each step: time, h, residual, penetration, wall (s); energy and counts by name."""
        return self._native.steps()

    @property
    def t(self) -> Vector:
        """The times of the frames, s."""
        return self._frames["t"]

    @property
    def position(self) -> Vector:
        """Mass centres, frames × bodies × 3, m."""
        return self._frames["position"]

    @property
    def rotation(self) -> Vector:
        """Unit quaternions [w, x, y, z], frames × bodies × 4."""
        return self._frames["rotation"]

    @property
    def velocity(self) -> Vector:
        """frames × bodies × 3, m/s."""
        return self._frames["velocity"]

    @property
    def angular_velocity(self) -> Vector:
        """frames × bodies × 3, rad/s, in the frame of the world."""
        return self._frames["angular_velocity"]

    @property
    def energy(self) -> dict[str, Vector]:
        """Of each step, J: kinetic and potential, the works (gravity, forces, normal, tangential, drives, joints, numerical), and what the balance lacks."""
        energy: dict[str, Vector] = self.steps["energy"]
        return energy

    @property
    def residual(self) -> Vector:
        """The judge's relative residual of each step."""
        residual: Vector = self.steps["residual"]
        return residual

    @property
    def joints(self) -> list[str]:
        """The names of the joints."""
        return self._native.joints

    def joint(self, name: Union[str, int]) -> dict[str, Vector]:
        """What a joint, by its name or number, did in the step before each frame: ``angle`` (rad) and ``slide`` (m), ``impulse`` (N s) and ``moment`` (N m s) about the anchor on its second body, frames × 3 in the frame of the world, ``violation``."""
        joints = self.joints
        if isinstance(name, str) and name in joints:
            return self._native.joint(joints.index(name))
        if isinstance(name, str) or name not in range(len(joints)):
            raise _nonsmooth.Error(f"joint: expected one of {joints}, or its number, found {name!r}")
        return self._native.joint(name)

    def contacts(self, frame: int = -1) -> Table:
        """The contacts of a frame: bodies a and b, status, gap, mu, point, normal, r and u as [N, T1, T2], and the impulse on b in the frame of the world; of rolling friction mu_r, the relative angular velocity rolling about [T1, T2] (rad/s), and the moment on b in the frame of the world (N m s)."""
        columns = self._native.contacts(range(len(self.t))[frame])
        kinds = [
            (name, np.asarray(column).dtype, np.asarray(column).shape[1:])
            if len(column)
            else (name, "U5" if name == "status" else float, np.asarray(column).shape[1:])
            for name, column in columns.items()
        ]
        made = np.empty(len(columns["a"]), dtype=kinds)
        for name, column in columns.items():
            made[name] = column
        return made.view(Table)

    def html(self, path: Optional[Path] = None) -> str:
        """The page that plays the run in a browser, without a network; written where a path is given."""
        page = self._native.html()
        if path is not None:
            pathlib.Path(path).write_text(page, encoding="utf-8")
        return page

    def save(self, path: Path) -> None:
        """Writes the run: a trajectory (.h5), a table of the steps (.csv), a page (.html), for ParaView (.pvd) or Blender (.glb)."""
        target = pathlib.Path(path)
        if target.suffix.lower() == ".csv":
            target.write_text(self._native.csv(), encoding="utf-8")
        elif target.suffix.lower() == ".html":
            self.html(target)
        else:
            self._native.save(target)

    def draw(self, frame: int = -1) -> Picture:
        """A picture on paper of a frame."""
        return Picture(self._native.svg(range(len(self.t))[frame]))

    def plot(self, ax: Optional[Axes] = None) -> Axes:
        """Draws the energies, with matplotlib."""
        from .plots import energies

        return energies(self, ax)

    def __repr__(self) -> str:
        word = "solved" if self.solved else "stopped" if self.stopped else "not solved"
        steps = len(self.steps["time"])
        # The simulation may have gone on since.
        end = self.steps["time"][-1] if steps else self.t[-1]
        deep = f", but bodies overlap deeply in {self.deep} of them" if self.deep else ""
        return f"<Run: {len(self.bodies)} bodies, {steps} steps to t = {end:.6g} s, {word}{deep}>"

    def _repr_html_(self) -> str:
        page = base64.b64encode(self.html().encode()).decode()
        return (
            f"<p>{html.escape(repr(self))}</p><iframe style='width:100%;height:480px;border:0' "
            f"src='data:text/html;base64,{page}'></iframe>"
        )


def simulate(
    scene: Union[World, str, pathlib.Path], until: Optional[float] = None, **how: Any
) -> Run:
    """The run of a world, or of a scene file or robot, until a time (that of the scene where nothing is said)."""
    world = scene if isinstance(scene, World) else load(scene)
    every = how.pop("every", world.document.get("output", {}).get("every", 1))
    on_step = how.pop("on_step", None)
    end = world.document["time"]["end"] if until is None else until
    return Simulation(world, **how).run(end, every=every, on_step=on_step)
