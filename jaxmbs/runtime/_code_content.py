"""Contents of functions and classes: code, defaults, closures, and the globals that code reads.

A library's functions count by their names, since its version is known.  What reads more than its arguments and what
stands here (files, clocks, random numbers, the environment) has no content that decides what it does.
"""

import builtins
import dataclasses
import dis
import re
import sys
import types
from collections.abc import Iterator
from typing import Any

import numpy as np

_LIBRARIES = tuple(
    "jax jaxlib jaxmbs numpy scipy equinox diffrax optax lineax optimistix jaxtyping typing_extensions".split()
)
#: Modules of Python whose functions give the same for the same arguments.
_PURE = frozenset(
    "abc bisect builtins cmath collections contextlib copy dataclasses decimal enum fractions functools heapq "
    "inspect itertools math numbers operator re statistics string textwrap types typing warnings".split()
)
#: Names in a library, "" of Python's own, of what reads or writes more than its arguments.
_IMPURE = {
    "": "open|input|print|eval|exec|compile|globals|locals|vars|id|hash|breakpoint|__import__",
    "numpy": "random|load|loadtxt|genfromtxt|fromfile|fromregex|memmap|save|savez|savetxt|ctypeslib|frompyfunc",
    "scipy": "io|datasets",
    "jax": "config|distributed|profiler|debug|io_callback|pure_callback",
    "jaxmbs": "io|stl|cache|export|tuning|(read|load|save|write)_.*",
}
#: Instructions of Python that read a global, of functions and of bodies of classes.
_LOADS_GLOBAL = frozenset(
    "LOAD_GLOBAL LOAD_NAME LOAD_FROM_DICT_OR_GLOBALS LOAD_CLASSDEREF LOAD_FROM_DICT_OR_DEREF".split()
)
_LOADS_ENTRY = ("LOAD_ATTR", "LOAD_METHOD")
#: Entries of a class that say nothing on what it does, or say it again.
_MADE = frozenset(
    "__module__ __dict__ __weakref__ __doc__ __abstractmethods__ _abc_impl __abstractvars__ __abstractclassvars__ "
    "__dataclass_params__ __match_args__ __qualname__ __annotations__ __firstlineno__ __static_attributes__ "
    "__annotate__ __annotate_func__ __annotations_cache__ __orig_bases__ __parameters__ __dataclass_fields__".split()
)


class UnknownContentError(Exception):
    """Something whose behaviour cannot be read off."""


def function_parts(function: types.FunctionType, strict: bool) -> list:
    """Code, defaults, closure and the globals that are read; of a library's function its name, and the closure."""
    code, place = function.__code__, str(function.__globals__.get("__name__"))
    if is_constant_module(function.__module__) and _stands_in_module(function):
        place, names = function.__module__, function.__qualname__
        if strict:
            _refuse_impure(place, [function.__name__], f"{place}.{names}")
        return [place, names]
    if place == "reprlib":  # what Python 3.13 puts about the repr of a dataclass, against endless ones
        return [place, code.co_qualname, getattr(function, "__wrapped__", None)]
    defaults = [function.__defaults__, function.__kwdefaults__]
    if _is_library(place):
        if strict:
            _refuse_impure(place, [code.co_name], f"{place}.{code.co_qualname}")
        return [place, code.co_qualname, code.co_firstlineno, *defaults, *_closure(function).values()]
    if strict:
        _refuse_effects(code)
    return [code, *defaults, *_read(function, strict), *_attributes(function)]


def _stands_in_module(function):
    """True if a function is what its module has under its name, whatever it is made of."""
    found: Any = sys.modules.get(function.__module__)
    for name in function.__qualname__.split("."):
        found = getattr(found, "__dict__", {}).get(name)
    return found is function


def _closure(function):
    """Contents of the cells by name; of one that is empty still, its name."""
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    return {name: cell.cell_contents if cell != types.CellType() else name for name, cell in cells}


def _read(function, strict):
    """Names and values of what code reads outside of it; of a user's module the entries that it may read."""
    code, closure = function.__code__, _closure(function)
    names = sorted(set(_names(code)))
    for name in sorted({*_globals(code), *closure}):
        if name in closure or name in function.__globals__:
            value = closure[name] if name in closure else function.__globals__[name]
            if strict and isinstance(value, types.ModuleType):
                _refuse_hidden_entries(code, name, names)
            yield name
            yield from _module_entries(value, code, names, strict) if isinstance(value, types.ModuleType) else [value]
        elif strict and hasattr(builtins, name):
            _refuse_impure("", [name], f"{name}(), called in {function.__qualname__},")


def _attributes(function):
    return [part for name, part in sorted(vars(function).items()) if name != "__wrapped__" for part in (name, part)]


def _module_entries(module, code, names, strict):
    """Entries of a module that code with these names may read."""
    yield module.__name__
    if is_constant_module(module.__name__):
        if strict:
            _refuse_impure(module.__name__, names, f"{module.__name__} in a function")
        return
    if strict and not hasattr(module, "__file__"):
        raise UnknownContentError(f"module {module.__name__}, whose entries may change")
    for name in names:
        value = vars(module).get(name)
        if strict and isinstance(value, types.ModuleType):
            _refuse_hidden_entries(code, name, names)
        yield name
        yield from _module_entries(value, code, names, strict) if isinstance(value, types.ModuleType) else [value]


def _refuse_hidden_entries(code, name, names):
    """Raises: UnknownContentError for code that may read other entries of a module than it names, since it hands the
    module on or looks entries up by text."""
    instructions = list(dis.get_instructions(code))
    after = [second for first, second in zip(instructions, instructions[1:], strict=False) if first.argval == name]
    if {"getattr", "__dict__"} & set(names) or any(second.opname not in _LOADS_ENTRY for second in after):
        raise UnknownContentError(f"module {name} in {code.co_qualname}, of which entries are read out of sight")
    for inner in _inside(code):
        _refuse_hidden_entries(inner, name, names)


def code_parts(code: types.CodeType, _: bool) -> list:
    """Instructions, names and constants."""
    names = code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars
    sizes = code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags
    return [code.co_code, code.co_exceptiontable, *names, *sizes, *code.co_consts]


def class_parts(kind: type, strict: bool) -> list:
    """Its name; of a user's class what its bases and functions do, and what else it holds."""
    found: list[Any] = [f"{kind.__module__}.{kind.__qualname__}"]
    if is_constant_module(kind.__module__) or _is_library(kind.__module__):
        return found
    if strict and not kind.__flags__ & (1 << 9):  # of Python, not of an extension in C
        raise UnknownContentError(f"{kind.__qualname__}, a class that is not written in Python")
    found += [type(kind), *kind.__bases__]
    for name, part in sorted(vars(kind).items()):
        is_slot = isinstance(part, types.MemberDescriptorType | types.GetSetDescriptorType)
        if name not in _MADE and not is_slot and not _is_generated(part):
            found += [name, part]
    fields = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
    for field in fields:
        factory = None if field.default_factory is dataclasses.MISSING else field.default_factory
        default = None if field.default is dataclasses.MISSING else field.default
        found += [field.name, default, factory, field.init, bool(field.kw_only), sorted(map(str, field.metadata))]
    return found


def _is_generated(part):
    """True for a method that `dataclasses` wrote from the fields."""
    code = getattr(part, "__code__", None)
    return code is not None and (code.co_filename == "<string>" or code.co_filename == dataclasses.__file__)


def builtin_parts(value: Any, strict: bool) -> list:
    """Name of a function in C, and what it is a method of."""
    owner = getattr(value, "__self__", None)
    place = str(getattr(value, "__module__", None) or "")
    if isinstance(value, np.ufunc):
        known = getattr(np, value.__name__, None) is value
        place = "numpy" if known else str(getattr(sys.modules.get("scipy.special"), value.__name__, "") is value)
        if strict and place == "False":
            raise UnknownContentError(f"{value!r}, made of a function")
    elif owner is not None and not isinstance(owner, types.ModuleType):
        return [value.__name__, owner]
    elif strict and not is_constant_module(place):
        raise UnknownContentError(f"{place}.{value.__name__}, which may read more than its arguments")
    if strict:
        _refuse_impure("" if place == "builtins" else place, [value.__name__], f"{place}.{value.__name__}")
    return [place, getattr(value, "__qualname__", value.__name__)]


def is_constant_module(name: str) -> bool:
    """True if a module is one whose entries do not change and which reads nothing from outside."""
    root = str(name).partition(".")[0]
    return _is_library(name) or root in _PURE


def _is_library(module) -> bool:
    return str(module).partition(".")[0] in _LIBRARIES


def _refuse_impure(module, names, what):
    """Raises: UnknownContentError if one of the names in this module is that of something impure."""
    pattern = _IMPURE.get(module.partition(".")[0], "")
    found = [name for name in names if re.fullmatch(pattern, name)]
    if found:
        raise UnknownContentError(f"{what} ({found[0]}), which may read more than its arguments")


def _refuse_effects(code):
    """Raises: UnknownContentError for code that imports what is not known, or writes globals and outer variables."""
    for instruction in dis.get_instructions(code):
        name, outer = instruction.argval, instruction.opname in ("STORE_DEREF", "DELETE_DEREF")
        if instruction.opname == "IMPORT_NAME" and not is_constant_module(name or "."):
            raise UnknownContentError(f"an import of {name} in {code.co_qualname}")
        if instruction.opname in ("STORE_GLOBAL", "DELETE_GLOBAL") or (outer and name in code.co_freevars):
            raise UnknownContentError(f"{code.co_qualname}, which sets {name} outside of it")
    for inner in _inside(code):
        _refuse_effects(inner)


def _globals(code) -> Iterator[str]:
    """Names of globals that code reads, that inside of it too."""
    for instruction in dis.get_instructions(code):
        if instruction.opname in _LOADS_GLOBAL:
            yield instruction.argval
    for inner in _inside(code):
        yield from _globals(inner)


def _names(code) -> Iterator[str]:
    """Names of globals and attributes that code reads, that inside of it too."""
    yield from code.co_names
    for inner in _inside(code):
        yield from _names(inner)


def _inside(code):
    """The code of functions in it."""
    return (constant for constant in code.co_consts if isinstance(constant, types.CodeType))
