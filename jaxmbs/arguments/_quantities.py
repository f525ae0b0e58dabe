"""Quantities of the package pint as arguments: numbers of base units (m, kg, s, rad) from the door on."""

import sys
from collections.abc import Callable, Mapping
from typing import Any

from ..errors import ModelError

#: Dimension, in pint's words, of arguments that have one whatever they are asked for.
_DIMENSIONS = {
    "mass": "[mass]",
    "com": "[length]",
    "gravity": "[length] / [time] ** 2",
    **dict.fromkeys(("t1", "ts", "dt", "step", "duration", "start", "time_constant"), "[time]"),
}


def may_have_quantities() -> bool:
    """True once somebody has imported pint."""
    return "pint" in sys.modules


def in_base_units(
    names: Callable[[], list[str]], args: tuple, options: Mapping[str, Any]
) -> tuple[tuple, Mapping[str, Any]]:
    """The arguments with numbers in place of quantities, also in lists, tuples and dicts.

    Args: names: gives those of the arguments by position.

    Raises: ModelError for a mass in metres, and other dimensions that an argument of that name cannot have.
    """
    if not any(map(_has_quantity, (*args, *options.values()))):
        return args, options
    own = names()
    own += [""] * (len(args) - len(own))
    return (
        tuple(_converted(x, name) for x, name in zip(args, own, strict=False)),
        {name: _converted(x, name) for name, x in options.items()},
    )


def _is_quantity(x):
    return hasattr(x, "to_base_units") and hasattr(x, "magnitude")


def _has_quantity(x):
    if isinstance(x, list | tuple):
        return any(map(_has_quantity, x))
    return any(map(_has_quantity, x.values())) if type(x) is dict else _is_quantity(x)


def _converted(x, name):
    if type(x) in (list, tuple):
        return type(x)(_converted(part, name) for part in x)
    if type(x) is dict:
        return {key: _converted(part, str(key)) for key, part in x.items()}
    if not _is_quantity(x):
        return x
    wanted = _DIMENSIONS.get(name)
    if wanted is not None and not x.check(wanted):
        raise ModelError([f"{name} = {x} has the dimension {x.dimensionality}, not {wanted}"], "the call")
    return x.to_base_units().magnitude
