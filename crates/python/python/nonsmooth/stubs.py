"""Writes ``settings.pyi``: ``python -m nonsmooth.stubs > settings.pyi``. A test sees to it that the file in the package is this."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .settings import Entry, argument, entries, python_type

if TYPE_CHECKING:
    from ._nonsmooth import Setting

HEAD = '''"""Settings of the solvers. Written by `python -m nonsmooth.stubs`."""

from typing import Any, ClassVar, Literal, Mapping, Optional, Union

from . import _nonsmooth

class Settings:
    solver: ClassVar[str]
    kinds: ClassVar[tuple[str, ...]]
    known: ClassVar[Mapping[str, _nonsmooth.Setting]]
    name: str
    settings: dict[str, object]
    def __init__(self, **settings: object) -> None: ...
    def __getattr__(self, key: str) -> Any: ...
    def __setattr__(self, key: str, value: object) -> None: ...

class Prefixed(Settings):
    usual: ClassVar[Optional[str]]
    def __init__(self, solver: Union[str, Settings] = ..., **settings: object) -> None: ...

class Entry:
    name: str
    is_prefix: bool
    kinds: list[str]
    settings: dict[str, _nonsmooth.Setting]
    @property
    def usual(self) -> Optional[str]: ...
    def doc(self) -> str: ...

CLASSES: dict[str, type[Settings]]

def argument(key: str) -> str: ...
def registered(settings: Mapping[str, object]) -> dict[str, object]: ...
def class_name(solver: str) -> str: ...
def python_type(setting: _nonsmooth.Setting) -> str: ...
def entries() -> dict[str, Entry]: ...
def solvers(problem: object = None) -> list[str]: ...
'''


def _optional(setting: Setting) -> str:
    """The type of an argument; None stands for a default that depends on the kind of problem."""
    kind = python_type(setting)
    return f"Optional[{kind}]" if setting["default"] is None else kind


def _class(name: str, entry: Entry) -> str:
    # What is nowhere said may be anything of its type.
    arguments = [
        f"        {argument(key)}: {_optional(setting)} = ...,"
        for key, setting in entry.settings.items()
    ]
    usual = f' = "{entry.usual}"' if entry.usual else ""
    first = [f"        solver: Union[str, Settings]{usual},"] if entry.is_prefix else []
    # A prefix passes on the settings of the solver behind it.
    rest = ["        **settings: object,"] if entry.is_prefix else []
    star = ["        *,"] if arguments else []
    doc = "\n".join(f"    {line}".rstrip() for line in entry.doc().splitlines())
    base = "Prefixed" if entry.is_prefix else "Settings"
    lines = [f"class {name}({base}):", f'    """{doc.strip()}', '    """', ""]
    if first or arguments:
        lines += ["    def __init__(", "        self,", *first, *star, *arguments, *rest]
        lines += ["    ) -> None: ..."]
    else:
        lines += ["    def __init__(self) -> None: ..."]
    return "\n".join(lines)


def text() -> str:
    """The text of the stubs."""
    classes = [_class(name, entry) for name, entry in entries().items()]
    return "\n".join([HEAD, "\n\n".join(classes), ""])


if __name__ == "__main__":
    print(text(), end="")
