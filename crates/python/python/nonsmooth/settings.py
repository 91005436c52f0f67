"""Classes of settings, one for each solver and each prefix of the registry: made when the package is imported, of what the solvers say of themselves.

``nonsmooth.Nsgs(omega=0.9)`` is the solver ``nsgs`` with that setting; ``nonsmooth.Proximal(nonsmooth.Nsgs())`` is ``proximal/nsgs``. The
types are in ``settings.pyi``, which ``python -m nonsmooth.stubs`` writes.
"""

from __future__ import annotations

import inspect
import keyword
import textwrap
from typing import Any, ClassVar, Mapping, Optional, Union

import numpy as np

from . import _nonsmooth


def argument(key: str) -> str:
    """A setting's key as a keyword of Python: ``lambda`` is ``lambda_``."""
    return f"{key}_" if keyword.iskeyword(key) else key


def registered_key(name: str) -> str:
    """The key of a setting of which this is the keyword."""
    return name[:-1] if keyword.iskeyword(name[:-1]) and name.endswith("_") else name


def registered(settings: Mapping[str, object]) -> dict[str, object]:
    """Settings by the registry's keys, numbers of numpy as those of Python; one that is None is as if it were not given, if there is such a one."""
    keys = {registered_key(name): value for name, value in settings.items()}
    return {
        key: value.item() if isinstance(value, np.generic) else value
        for key, value in keys.items()
        if value is not None or not any(key in made.known for made in CLASSES.values())
    }


UNSAID = object()
"""In place of an argument that is not given."""


class Settings:
    """A solver with its settings: ``name`` and ``settings`` as :func:`nonsmooth.solve` takes them."""

    solver: ClassVar[str] = ""
    """The solver's name in the registry."""
    kinds: ClassVar[tuple[str, ...]] = ()
    """The kinds of problem that it solves."""
    known: ClassVar[Mapping[str, _nonsmooth.Setting]] = {}
    """Its settings by their keys; a default of None is one that each kind of problem has of its own."""

    name: str
    settings: dict[str, object]

    def __init__(self, **settings: object) -> None:
        self.name = self.solver
        self.settings = registered(settings)
        _nonsmooth.check(self.name, self.settings)

    def __getattr__(self, name: str) -> Any:
        key = registered_key(name)
        if key in type(self).known:
            return self.settings.get(key, type(self).known[key]["default"])
        raise AttributeError(f"{type(self).__name__} has no setting {name}")

    def __setattr__(self, name: str, value: object) -> None:
        key = registered_key(name)
        if key in type(self).known:
            changed = registered({**self.settings, key: value})
            _nonsmooth.check(self.name, changed)
            self.settings = changed
        elif name in ("name", "settings"):
            super().__setattr__(name, value)
        else:
            raise AttributeError(f"{type(self).__name__} has no setting {name}")

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Settings)
            and (self.name, self.settings) == (other.name, other.settings)
        )

    def __hash__(self) -> int:
        return hash((self.name, tuple(sorted(self.settings))))

    def __repr__(self) -> str:
        given = ", ".join(f"{argument(key)}={value!r}" for key, value in self.settings.items())
        return f"{type(self).__name__}({given})"


class Prefixed(Settings):
    """A solver behind a reformulation, with the settings of both."""

    usual: ClassVar[Optional[str]] = None
    """The solver where none is said; None: one has to be."""

    def __init__(self, solver: object = UNSAID, **settings: object) -> None:
        if solver is UNSAID:
            if self.usual is None:
                raise TypeError(f"{type(self).__name__}: expected a solver behind the prefix, found none")
            solver = self.usual
        if not isinstance(solver, (str, Settings)):
            raise _nonsmooth.Error(
                f"solver: expected a name or an object of settings (nonsmooth.Nsgs()), found {solver!r}"
            )
        inner = solver if isinstance(solver, str) else solver.name
        own = {} if isinstance(solver, str) else solver.settings
        self.name = f"{self.solver}/{inner}"
        self.settings = {**own, **registered(settings)}
        _nonsmooth.check(self.name, self.settings)

    def __repr__(self) -> str:
        given = "".join(f", {argument(key)}={value!r}" for key, value in self.settings.items())
        return f"{type(self).__name__}({self.name.split('/', 1)[1]!r}{given})"


def class_name(solver: str) -> str:
    """``newton_ac`` → ``NewtonAc``."""
    return "".join(part[:1].upper() + part[1:] for part in solver.split("_"))


def python_type(setting: _nonsmooth.Setting) -> str:
    """The type of a setting's values."""
    default = setting["default"]
    if setting["choices"]:
        return f"Literal[{', '.join(repr(choice) for choice in setting['choices'])}]"
    for kind in (bool, int, float, str):
        if isinstance(default, kind):
            return kind.__name__
    return "object"


class Entry:
    """A solver or prefix of the registry, of all kinds of problem that have it: what a class is made of."""

    def __init__(self, name: str, is_prefix: bool) -> None:
        self.name = name
        self.is_prefix = is_prefix
        self.kinds: list[str] = []
        self.summaries: dict[str, list[str]] = {}
        self.needs: list[str] = []
        self.cites: list[str] = []
        self.settings: dict[str, _nonsmooth.Setting] = {}
        self.defaults: dict[str, dict[str, Any]] = {}

    @property
    def usual(self) -> Optional[str]:
        """The solver behind a prefix where none is said."""
        try:
            _nonsmooth.check(f"{self.name}/auto", {})
        except _nonsmooth.Error:
            return None
        return "auto"

    def add(self, kind: str, about: Union[_nonsmooth.About, _nonsmooth.Prefix]) -> None:
        self.kinds.append(kind)
        self.summaries.setdefault(about["summary"], []).append(kind)
        for setting in about["settings"]:
            key, default = setting["key"], setting["default"]
            first = self.settings.setdefault(key, setting)
            self.defaults.setdefault(key, {})[kind] = default
            if first["default"] != default:
                self.settings[key] = {**first, "default": None}
        needs: list[str] = about.get("needs", [])  # type: ignore[assignment]
        self.needs += [need for need in needs if need not in self.needs]
        self.cites += [key for key in about["cites"] if key not in self.cites]

    def _by_kind(self, key: str) -> str:
        """The defaults of a setting, each with the kinds that have it."""
        kinds: dict[str, list[str]] = {}
        for kind, default in self.defaults[key].items():
            kinds.setdefault(repr(default), []).append(kind)
        return "; ".join(f"{default} for {', '.join(of)}" for default, of in kinds.items())

    def doc(self) -> str:
        """The docstring: what it is and needs, its settings with defaults and choices."""
        lines = []
        for summary, kinds in self.summaries.items():
            of = f" ({', '.join(kinds)})" if len(self.summaries) > 1 else ""
            lines += textwrap.wrap(f"{self.name}: {summary}{of}", 100)
        lines += ["", *textwrap.wrap(f"For problems {', '.join(self.kinds)}.", 100)]
        if self.needs:
            lines += ["", *textwrap.wrap(f"Needs {'; '.join(self.needs)}.", 100)]
        if self.settings:
            lines += ["", "Settings", "--------"]
        for setting in self.settings.values():
            default, said = repr(setting["default"]), setting["help"]
            if setting["default"] is None:
                default = "by kind"
                said += f" Default {self._by_kind(setting['key'])}."
            lines.append(f"{argument(setting['key'])} : {python_type(setting)}, default {default}")
            lines += textwrap.wrap(said, 96, initial_indent="    ", subsequent_indent="    ")
        lines += ["", *textwrap.wrap(f"References: {', '.join(self.cites)}.", 100)]
        return "\n".join(lines)


def entries() -> dict[str, Entry]:
    """All solvers and prefixes, by the names of their classes."""
    found: dict[str, Entry] = {}
    for offer in _nonsmooth.offers():
        for about in offer["solvers"]:
            entry = found.setdefault(class_name(about["name"]), Entry(about["name"], False))
            entry.add(offer["kind"], about)
        for prefix in offer["prefixes"]:
            name = class_name(prefix["name"])
            entry = found.setdefault(name, Entry(prefix["name"], True))
            entry.add(offer["kind"], prefix)
    return dict(sorted(found.items()))


def _made(name: str, entry: Entry) -> type[Settings]:
    base: type[Settings] = Prefixed if entry.is_prefix else Settings
    made = type(
        name,
        (base,),
        {
            "__doc__": entry.doc(),
            "__module__": "nonsmooth",
            "solver": entry.name,
            "kinds": tuple(entry.kinds),
            "known": entry.settings,
            **({"usual": entry.usual} if entry.is_prefix else {}),
        },
    )
    usual = getattr(made, "usual", None) or inspect.Parameter.empty
    first = [inspect.Parameter("solver", inspect.Parameter.POSITIONAL_OR_KEYWORD, default=usual)]
    keys = [
        inspect.Parameter(
            argument(key), inspect.Parameter.KEYWORD_ONLY, default=setting["default"]
        )
        for key, setting in entry.settings.items()
    ]
    signature = inspect.Signature((first if entry.is_prefix else []) + keys)
    setattr(made, "__signature__", signature)
    return made


CLASSES: dict[str, type[Settings]] = {name: _made(name, entry) for name, entry in entries().items()}
"""The classes by their names."""
globals().update(CLASSES)
__all__ = ["CLASSES", "Prefixed", "Settings", *CLASSES]


def solvers(problem: object = None) -> list[str]:
    """The names of the solvers that are listed for a problem, or for a kind by its name; of all kinds where nothing is said."""
    kind = problem if isinstance(problem, str) else getattr(problem, "kind", None)
    offers = _nonsmooth.offers()
    if problem is not None and kind not in [offer["kind"] for offer in offers]:
        kinds = ", ".join(offer["kind"] for offer in offers)
        raise _nonsmooth.Error(f"problem: expected a problem, or one of the kinds {kinds}, found {problem!r}")
    names: dict[str, None] = {}
    for offer in offers:
        if kind is None or kind == offer["kind"]:
            names.update(dict.fromkeys(offer["names"]))
    return list(names)
