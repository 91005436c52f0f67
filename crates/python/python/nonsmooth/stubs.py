"""Writes ``settings.pyi``: ``python -m nonsmooth.stubs > settings.pyi``. A test sees to it that the file in the package is this."""

from __future__ import annotations

from .settings import Entry, argument, entries, python_type

HEAD = '''"""Settings of the solvers. Written by `python -m nonsmooth.stubs`."""

from typing import Any, ClassVar, Literal, Mapping, Union

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
    def __init__(self, solver: Union[str, Settings] = "auto", **settings: object) -> None: ...

class Entry:
    name: str
    is_prefix: bool
    kinds: list[str]
    settings: dict[str, _nonsmooth.Setting]
    def doc(self) -> str: ...

CLASSES: dict[str, type[Settings]]

def argument(key: str) -> str: ...
def registered(settings: Mapping[str, object]) -> dict[str, object]: ...
def class_name(solver: str) -> str: ...
def python_type(setting: _nonsmooth.Setting) -> str: ...
def entries() -> dict[str, Entry]: ...
def solvers(problem: object = None) -> list[str]: ...
'''


def _class(name: str, entry: Entry) -> str:
    # What is nowhere said may be anything of its type.
    arguments = [
        f"        {argument(key)}: {python_type(setting)} = ...,"
        for key, setting in entry.settings.items()
    ]
    first = ["        solver: Union[str, Settings] = \"auto\","] if entry.is_prefix else []
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
