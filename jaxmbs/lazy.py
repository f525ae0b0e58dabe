"""Rooms whose files are imported when a name of theirs is first asked for (PEP 562, SPEC 1).

The `__init__.py` of a room imports its public names under `if TYPE_CHECKING:`, where people, type checkers and tools
look for them, and ends with `import_when_asked(__name__)`, which reads the same lines.
"""

import ast
import contextlib
import functools
import gc
import importlib
import importlib.util
import sys
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from .errors import warn


class Room(types.ModuleType):
    """A package that imports the file of a public name when the name is first asked for."""

    def __getattr__(self, name: str) -> Any:
        absent = AttributeError(f"module {self.__name__!r} has no attribute {name!r}", name=name, obj=self)
        if name.startswith("__") or not name.isidentifier():
            raise absent
        if name in vars(self)["_moved"]:
            return self._from_its_room(name)
        file, original = origins(self).get(name, (f"{self.__name__}.{name}", ""))
        try:
            with _collection_paused():
                module = importlib.import_module(file)
        except ModuleNotFoundError as error:
            if error.name != file:
                raise
            raise absent from None
        if original:
            setattr(self, name, getattr(module, original))
            self._prepare(self, [name] if name in self.__all__ else [])
        return vars(self)[name]

    def _from_its_room(self, name: str) -> Any:
        """A name that another room has now, with a warning."""
        room = vars(self)["_moved"][name]
        text = f"{self.__name__}.{name} is deprecated; it is {room}.{name}"
        warn(text, DeprecationWarning)
        return getattr(importlib.import_module(room), name)

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute; Python sets one for each file that it has loaded, before anyone takes names from it."""
        super().__setattr__(name, value)
        if isinstance(value, types.ModuleType):
            self._prepare(value, self.__all__)

    def __dir__(self) -> list[str]:
        return sorted(self.__all__)

    def _prepare(self, module: types.ModuleType, names: Sequence[str]) -> None:
        """Give public names of a module to the function that the room has for them."""
        prepare = vars(self)["_prepare_names"]
        if prepare:
            prepare(vars(module), names)


def import_when_asked(
    room: str,
    prepare: Callable[[dict[str, Any], Sequence[str]], None] | None = None,
    moved: Mapping[str, str] | None = None,
) -> None:
    """Let a room, given by its `__name__`, import its files when their names are asked for.

    Args:
        prepare: a function that is called with the variables of each file that was loaded, and the public names.
        moved: names that used to be this room's, with the room that has each now: here they come with a warning.
    """
    vars(sys.modules[room]).update(_prepare_names=prepare, _moved=moved or {})
    sys.modules[room].__class__ = Room


def is_instance(thing: Any, module: str, name: str) -> bool:
    """True for an object of a class of this module; while nobody has imported that, there are none."""
    kind = getattr(sys.modules.get(module), name, None)
    return isinstance(kind, type) and isinstance(thing, kind)


@contextlib.contextmanager
def _collection_paused() -> Iterator[None]:
    """Pause Python's garbage collector while files are imported: hardly anything that they make is garbage, and
    looking for it takes a tenth of the time."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


@functools.cache
def origins(room: types.ModuleType) -> dict[str, tuple[str, str]]:
    """The module that each name of a room comes from, and its name there, from the imports under `TYPE_CHECKING`."""
    source = room.__spec__.loader.get_source(room.__name__)  # type: ignore[union-attr]
    if source is None:
        raise ImportError(f"{room.__name__} is installed without its sources, which its names are read from")
    found = {}
    for block in ast.parse(source).body:
        for line in block.body if isinstance(block, ast.If) else ():
            if isinstance(line, ast.ImportFrom) and line.module:
                file = importlib.util.resolve_name("." * line.level + line.module, room.__name__)
                found |= {alias.asname or alias.name: (file, alias.name) for alias in line.names}
    return found
