"""Names, members and arguments of the public faces: `python -m tests.faces > tests/released_faces.txt` keeps them."""

import importlib
import inspect
import pkgutil

import jaxmbs


def rooms():
    """The package, and all modules in it that are public; the machine of tapes is not."""
    names = [m.name for m in pkgutil.walk_packages(jaxmbs.__path__, "jaxmbs.")]
    found = [name for name in names if "._" not in name and not name.startswith("jaxmbs.runtime.tape")]
    return [jaxmbs, *map(importlib.import_module, found)]


def arguments(thing):
    """Names of the arguments of a call, with stars where it takes any, or None of what has no signature."""
    try:
        parameters = inspect.signature(thing).parameters
    except (TypeError, ValueError):
        return None
    return [
        str(p.replace(default=p.empty, annotation=p.empty)) for n, p in parameters.items() if n not in ("self", "cls")
    ]


def members(kind):
    """Names of a class that it and its private bases define, with what they are."""
    for name in sorted(dir(kind)):
        owner = next((base for base in kind.__mro__ if name in vars(base)), object)
        inherited = owner is not kind and not owner.__name__.startswith("_")
        if name.startswith("_") or inherited or not owner.__module__.startswith("jaxmbs"):
            continue
        member = inspect.getattr_static(kind, name)
        yield name, member.__func__ if isinstance(member, staticmethod | classmethod) else member


def fields(kind):
    """Names that a class and its bases annotate: fields without a default are no attributes of a class."""
    return {name for base in kind.__mro__ for name in vars(base).get("__annotations__", {})}


def line(path, thing):
    """A name with its arguments, as it is kept."""
    names = arguments(thing) if callable(thing) else None
    return path if names is None else f"{path}({', '.join(names)})"


def lines():
    """All of them; members stand with the room where a class is written."""
    for room in rooms():
        for name in getattr(room, "__all__", ()):
            thing, path = getattr(room, name), f"{room.__name__}.{name}"
            if inspect.ismodule(thing):
                continue
            yield line(path, thing)
            if inspect.isclass(thing) and thing.__module__.startswith(room.__name__) and room is not jaxmbs:
                yield from (line(f"{path}.{own}", member) for own, member in members(thing))


GONE = object()


def today(path):
    """What a kept name is now, or `GONE`; a name that moved is found where it warns."""
    parts = path.split(".")
    for k in range(len(parts), 0, -1):
        try:
            thing = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for name in parts[k:]:
            if not hasattr(thing, name):
                return None if inspect.isclass(thing) and name in fields(thing) else GONE
            thing = inspect.getattr_static(thing, name) if inspect.isclass(thing) else getattr(thing, name)
            thing = thing.__func__ if isinstance(thing, staticmethod | classmethod) else thing
        return thing
    return GONE


if __name__ == "__main__":
    print("\n".join(sorted(set(lines()))))
