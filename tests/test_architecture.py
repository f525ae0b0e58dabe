"""The house: imports go down the floors, extras stay optional, files small, public names documented."""

import ast
import functools
import graphlib
import importlib
import inspect
import json
import re
import statistics
import subprocess
import sys

import pytest

from .sources import PACKAGE, ROOT, files, nodes, tree

FLOORS = [  # a room imports rooms of lower floors, and of its own floor those to its left
    [
        "errors",
        "lazy",
        "typing",
        "status",
        "checks",
        "arguments",
        "tables",
        "named_arrays",
        "quantities",
        "datasets",
        "reports",
        "palette",
        "drawings",
        "atomic_write",
        "runtime",
        "math",
        "ode",
        "blocksparse",
    ],
    [
        "joints",
        "friction",
        "forces",
        "contact",
        "blocks",
        "hydraulics",
        "elements",
        "model",
        "fatigue",
        "probability",
    ],
    ["linear", "vibration", "kinematics", "constraints", "signal_flow", "assembly", "builder", "fem"],
    ["statics", "dynamics", "reaction", "reductions", "coupling", "flexible"],
    [
        "analysis",
        "motion",
        "cycles",
        "rotors",
        "engines",
        "bondgraph",
        "batching",
        "design",
        "identification",
        "experiment",
        "studies",
        "qualification",
        "verbs",
        "vehicles",
    ],
    ["io", "viz", "documents", "adapters", "demo", "doctor", "cli", "__main__"],
]
DOORS = set(FLOORS[-1])
HEIGHT = {room: (floor, place) for floor, rooms in enumerate(FLOORS) for place, room in enumerate(rooms)}
EXTRAS = {
    *("matplotlib", "networkx", "mujoco", "pinocchio", "xarray", "zarr", "filelock", "dask", "distributed"),
    *("pyyeti", "pyuff", "meshio", "skfem", "nlopt", "viser", "scipy.optimize"),
    *("openmdao", "tesseract_core", "control", "fmpy"),
}
LAZY = {
    **{room: {"xarray"} for room in ("motion", "reaction", "linear", "vibration", "batching", "qualification")},
    "bondgraph": {"networkx"},
    "datasets": {"xarray"},
    "design": {"scipy.optimize", "nlopt", "xarray"},
    "identification": {"scipy.optimize"},
    "studies": {"xarray", "filelock", "distributed"},
}  # besides the doors


def _module_name(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = files()
MODULES = {_module_name(path): path for path in FILES}
PACKAGES = {_module_name(path.parent / "__init__.py") for path in FILES}


def _statements(body, lazy=False):
    """The statements that importing a module runs (functions and type checking left out); of a lazy room's face
    those that it runs when asked, too."""
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test) and not lazy:
            continue
        yield node
        blocks = [getattr(node, name, []) for name in ("body", "orelse", "finalbody")]
        blocks += [handler.body for handler in getattr(node, "handlers", [])]
        for block in blocks:
            yield from _statements(block, lazy)


def _targets(path, nodes):
    """Full dotted names that the import statements among the nodes name."""
    here = _module_name(path).split(".")
    package = here if path.name == "__init__.py" else here[:-1]
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def _imports_at_top(path):
    return list(_targets(path, _statements(tree(path).body, lazy=path.name == "__init__.py")))


def _module_of(name):
    """The module of this package that a dotted name lies in, or None."""
    if name.split(".")[0] != "jaxmbs":
        return None
    return name if name in MODULES or name in PACKAGES else name.rpartition(".")[0]


def _room(module):
    return module.split(".")[1] if "." in module else ""


def _named(name, extras):
    return {extra for extra in extras if name == extra or name.startswith(extra + ".")}


def _faults(check):
    """What a check of one file says of all of them, a line each."""
    return [f"{_module_name(path)}: {fault}" for path in FILES for fault in check(path)]


def test_imports_go_down_or_left():
    assert not _faults(_wrong_ways)


def _wrong_ways(path):
    room = _room(_module_name(path))
    if not room:
        return  # the front door of the package shows every room
    if room not in HEIGHT:
        yield f"give the room {room!r} a floor in FLOORS"
        return
    for name in _targets(path, nodes(path)):
        module = _module_of(name)
        if module is None or _room(module) == room:
            continue
        if not _room(module):
            if room not in DOORS:
                yield f"imports {name} through the front door; import its own module"
        elif HEIGHT[_room(module)] >= HEIGHT[room]:
            yield f"{room} may not import {name}"


def test_the_map_in_contributing_has_these_floors():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \d [^|]+\|([^|]+)\|", text, re.MULTILINE)
    assert [re.findall(r"`(\w+)`", row) for row in rows] == [
        [room for room in floor if room != "__main__"] for floor in FLOORS
    ]


INNER = ("jax.extend", "jax.interpreters", "jax.experimental", "jax._src", "jax.lib", "jaxlib", "equinox.internal")
TRICKY = {  # public in JAX, but there for the compiler's sake: `runtime` has a function for each
    *("make_user_context", "optimization_barrier", "custom_vmap", "sequential_vmap", "platform_dependent"),
    *("clear_caches", "compiler_options", "memory_analysis", "monitoring", "make_mlir", "XLA_FLAGS"),
}


def test_one_door_to_the_compiler():
    """Only `runtime` knows JAX's inner parts; the others import from its face and never from its modules."""
    assert not _faults(_other_doors)


def _other_doors(path):
    room, face = _room(_module_name(path)), _face("runtime")
    if _module_name(path) == "jaxmbs.adapters.fmi._runtime":
        return  # a file of exported FMUs, which runs where there is no jaxmbs
    names = list(_targets(path, nodes(path)))
    if room == "runtime":
        below = {"typing", "checks", "errors", "atomic_write", "runtime"}
        yield from {_room(_module_of(name) or "jaxmbs.runtime") for name in names} - below
        return
    for name in names:
        if _named(name, INNER):
            yield f"{name}: `jaxmbs.runtime` is the door to JAX's inner parts"
        if name.startswith("jaxmbs.runtime.") and name.removeprefix("jaxmbs.runtime.") not in face:
            yield f"{name} is not in the `__all__` of jaxmbs.runtime"
    words = {getattr(node, "attr", getattr(node, "id", getattr(node, "arg", ""))) for node in nodes(path)}
    words |= {node.value for node in nodes(path) if isinstance(node, ast.Constant) and _is_word(node.value)}
    yield from (f"{word}: put it into `jaxmbs.runtime`" for word in words & TRICKY)


@functools.cache
def _face(room):
    """The names in the `__all__` of a room."""
    nodes = [node for node in tree(PACKAGE / room / "__init__.py").body if isinstance(node, ast.Assign)]
    return next(ast.literal_eval(node.value) for node in nodes if ast.unparse(node.targets[0]) == "__all__")


def _is_word(value):
    return isinstance(value, str) and value.isidentifier()


SHOWN = {
    "io",
    "viz",
    "bondgraph",
    "tables",
    "quantities",
    "datasets",
    "reports",
    "cli",
    "demo",
    "documents",
    "arguments",
}  # rooms that count lines, letters and names, not work
BOUNDS = {"MAX_DENSE_ROWS", "8"}  # a matrix too large to be made dense; names in a message


def test_tuned_sizes_live_in_one_file():
    """Sizes are compared with `runtime.tuning`, not with constants beside or numbers above 6 (freedoms of a body)."""
    assert not _faults(_sizes_elsewhere)


def _sizes_elsewhere(path):
    if _room(_module_name(path)) in SHOWN:
        return
    for node in nodes(path):
        sides = (node.left, *node.comparators) if isinstance(node, ast.Compare) else ()
        if not any(_is_size(side) and ast.unparse(side) not in BOUNDS for side in sides):
            continue
        text = ast.unparse(node)
        if any(size in text for size in (".size", ".shape", "len(", "num_")):
            yield f"{text}: put it into runtime/_tuning.py"


def _is_size(side):
    """True for a number above 6 or a constant."""
    is_number = isinstance(side, ast.Constant) and isinstance(side.value, int) and side.value > 6
    return is_number or isinstance(side, ast.Name) and len(name := side.id.strip("_")) > 1 and name.isupper()


def test_no_import_cycles():
    graph = {}
    for name, path in MODULES.items():
        found = {_module_of(target) for target in _imports_at_top(path)}
        graph[name] = found - {None, name}
    tuple(graphlib.TopologicalSorter(graph).static_order())  # CycleError names the modules


def test_extras_are_imported_late_and_at_the_doors():
    assert not _faults(_early_extras)


def _early_extras(path):
    room = _room(_module_name(path))
    for extra in {extra for name in _imports_at_top(path) for extra in _named(name, EXTRAS)}:
        yield f"import {extra} inside the function that needs it"
    anywhere = {extra for name in _targets(path, nodes(path)) for extra in _named(name, EXTRAS)}
    yield from () if room in DOORS else (f"{extra} is an extra" for extra in anywhere - LAZY.get(room, set()))


_PROBE = """
import json, os, sys
import jax, equinox, diffrax, optimistix, lineax, optax, jaxtyping, tqdm
def settings():
    return {name: repr(value) for name, value in sorted(jax.config.values.items())}
before, environment, loaded = settings(), dict(os.environ), set(sys.modules)
import jaxmbs
changed = [name for name, value in settings().items() if before[name] != value]
changed += [name for name in {**environment, **os.environ} if environment.get(name) != os.environ.get(name)]
print(json.dumps([changed, sorted(set(sys.modules) - loaded)]))
"""


@pytest.mark.long
def test_importing_changes_no_setting_and_loads_no_extra():
    done = subprocess.run([sys.executable, "-c", _PROBE], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    changed, loaded = json.loads(done.stdout)
    assert not changed
    assert not [name for name in loaded if _named(name, EXTRAS)]


def test_files_are_small():
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES}
    assert statistics.median(lengths.values()) <= 150
    assert not {str(path): length for path, length in lengths.items() if length > 400}


def test_public_names_have_docstrings():
    definitions = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    bare = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.name}"
        for path in FILES
        for node in tree(path).body
        if isinstance(node, definitions) and not node.name.startswith("_") and not ast.get_docstring(node)
        if not any(ast.unparse(decorator) == "overload" for decorator in node.decorator_list)
    ]
    assert not bare


def test_the_model_says_what_it_is_made_of():
    """No field, argument or result of the room `model` is of type Any."""
    own = [path for path in FILES if _room(_module_name(path)) == "model"]
    assert not [str(path) for path in own for node in nodes(path) if getattr(node, "id", "") == "Any"]


def test_every_class_has_a_name_of_its_own():
    places = {}
    for path in FILES:
        for node in tree(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places.setdefault(node.name, set()).add(path.relative_to(PACKAGE).as_posix())
    assert not {name: found for name, found in places.items() if len(found) > 1}


ASKING = ("viz", "bondgraph", "motion", "analysis/_equilibrium.py", "dynamics/_contact_load.py")
KINDS = {  # rooms of things, and the base classes of their kinds
    "forces": ("AbstractLaw", "AbstractSignal"),
    "forces._port": ("AbstractPort",),
    "contact": ("AbstractPair",),
    "vehicles": ("AbstractRoad", "AbstractTyreModel"),
    "friction": ("AbstractFriction",),
    "joints": ("AbstractJoint", "AbstractRows"),
    "blocks": ("AbstractBlock",),
}


def test_pictures_bond_graphs_and_statuses_know_no_kind_of_thing():
    """They ask the thing: its `drawing`, `report`, `validity`, `bonds`, `holds`."""
    bases = tuple(
        getattr(importlib.import_module(f"jaxmbs.{room}"), name) for room, names in KINDS.items() for name in names
    )
    rooms = {room.partition(".")[0] for room in KINDS} | {"hydraulics"}
    joints = {name for name in _face("joints") if name[0].isupper()} | {"Modal"}
    found = []
    for path in FILES:
        place = path.relative_to(PACKAGE).as_posix()
        if not place.startswith(ASKING) or place == "bondgraph/_circuits.py":  # a circuit is many blocks
            continue
        for name in _targets(path, nodes(path)):
            module, _, item = name.rpartition(".")
            if name.startswith("jaxmbs.") and name.split(".")[1] in rooms:
                thing = getattr(importlib.import_module(module), item, None)
                found += [f"{place}: {item}"] if inspect.isclass(thing) and issubclass(thing, bases) else []
        words = {node.value for node in nodes(path) if isinstance(node, ast.Constant)}
        found += [f"{place}: {word!r}" for word in words if isinstance(word, str) and word in joints]
    assert not found
