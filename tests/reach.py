"""What a test leads to, read off the source: from its names through helpers, fixtures and functions of the library.

A definition leads to what the names in it stand for.  Names are resolved by the imports of their module, `room.name`
and names handed on by an `__init__` too; a string leads to the fixture of that name (`getfixturevalue`).  Methods are
not resolved: they count where their class is reached and their name is called.  Building a model and placing it lead
nowhere: every test does it.
"""

import ast
import functools

from . import sources
from .sources import ROOT

SETTING_UP = {("jaxmbs.builder._builder", "SystemBuilder"), ("jaxmbs.assembly._state", "State")}


@functools.cache
def modules():
    """Path by dotted name of every module of the library and of its tests."""
    paths = [path for room in ("jaxmbs", "tests") for path in (ROOT / room).rglob("*.py")]
    return {_dotted(path): path for path in paths}


def _dotted(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


class Module:
    """Definitions by name (functions, classes, constants), and what its imports name: a module or (module, name)."""

    def __init__(self, name):
        self.name, tree = name, sources.tree(modules()[name])
        self.definitions, self.imports = {}, {}
        for node in tree.body:
            for defined in _defined(node):
                self.definitions.setdefault(defined, []).append(node)
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                self.imports.update({(a.asname or a.name.split(".")[0]): a.name for a in node.names})
            elif isinstance(node, ast.ImportFrom):
                base = self._base(node)
                self.imports.update({a.asname or a.name: (base, a.name) for a in node.names})

    def _base(self, node):
        if not node.level:
            return node.module
        own = self.name.split(".")
        package = own if modules()[self.name].name == "__init__.py" else own[:-1]
        return ".".join([*package[: len(package) - node.level + 1], *([node.module] if node.module else [])])


def _defined(node):
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return [
        name.id for target in targets if target is not None for name in ast.walk(target) if isinstance(name, ast.Name)
    ]


module = functools.cache(Module)


def resolve(where, name):
    """The definition (module, name) that a name in a module stands for, or the name of a module, or None."""
    if where not in modules():
        return None
    if name in module(where).definitions:
        return where, name
    target = module(where).imports.get(name)
    if isinstance(target, tuple):
        base, original = target
        return f"{base}.{original}" if f"{base}.{original}" in modules() else resolve(base, original)
    if target in modules():
        return target
    return f"{where}.{name}" if f"{where}.{name}" in modules() else None


@functools.cache
def mentioned(where, name):
    """(definitions, attributes): what a definition's source stands for and the names after its dots."""
    found, attributes = set(), set()
    for node in (n for top in module(where).definitions[name] for n in ast.walk(top)):
        if isinstance(node, ast.JoinedStr):
            found |= _fixtures_that_begin(where, node.values[0])
        if isinstance(node, ast.Name):
            found.add(resolve(where, node.id))
        elif isinstance(node, ast.Attribute):
            attributes.add(node.attr)
            found.add(_dotted_name(where, node))
        elif isinstance(node, ast.arg) or (isinstance(node, ast.Constant) and isinstance(node.value, str)):
            found.add(_fixture(where, node.arg if isinstance(node, ast.arg) else node.value))
    return {f for f in found if isinstance(f, tuple)}, attributes


def _dotted_name(where, node):
    """What `room.name` stands for."""
    if isinstance(node.value, ast.Name):
        base = resolve(where, node.value.id)
    else:
        base = _dotted_name(where, node.value) if isinstance(node.value, ast.Attribute) else None
    return resolve(base, node.attr) if isinstance(base, str) else None


def _fixtures_that_begin(where, start):
    """Of the module, where a name such as f"of_{case}" is put together."""
    known = isinstance(start, ast.Constant) and where.startswith("tests")
    return {(where, name) for name in module(where).definitions if known and name.startswith(start.value)}


def _fixture(where, name):
    """The fixture of that name, of the module or of the `conftest` beside it."""
    for place in (where, where.rpartition(".")[0] + ".conftest"):
        if place.startswith("tests") and place in modules() and name in module(place).definitions:
            return place, name
    return None


@functools.cache
def reached(where, test):
    """(definitions, attributes) that a test leads to."""
    known, attributes, queue = set(), set(), [(where, test)]
    while queue:
        here = queue.pop()
        if here in known or here in SETTING_UP:
            continue
        known.add(here)
        found, own = mentioned(*here)
        attributes |= own
        queue += found
    return frozenset(known), frozenset(attributes)


def leads_to(test_file, test, file, dotted):
    """Whether a test leads to a function, class or method "Class.name" of a file."""
    known, attributes = reached(_dotted(ROOT / test_file), test)
    name, _, method = dotted.partition(".")
    return (_dotted(ROOT / file), name) in known and (not method or method in attributes)
