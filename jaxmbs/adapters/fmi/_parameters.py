"""Tunable parameters of an exported mechanism: a vector of numbers, and the system at it."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from jax import Array

from ...checks import distinct_names, no_such
from ...design._variables import read_variables
from ...errors import ModelError
from ...model._internal_states import replace_field
from ...model._system import System


class Parameters:
    """Names and start values (p,) of the parameters, and `system_at(values)`."""

    def __init__(self, names: tuple[str, ...], start: np.ndarray, system_at: Callable[[Array], System]) -> None:
        self.names, self.start, self.system_at = names, start, system_at

    @classmethod
    def of(cls, system: System | Callable, parameters: Any) -> "Parameters":
        """Parameters of a function of them, a dict of numbers; or of a system, names of numbers in it.

        Raises: ModelError, TypeError, ValueError for what is none.
        """
        if not callable(system):
            return cls._of_names(system, () if parameters is None else parameters)
        if not isinstance(parameters, Mapping):
            raise ModelError(
                ["a system that is a function needs `parameters`, the dict of numbers that it takes"], "export_fmu"
            )
        variables = read_variables(dict(parameters), None)
        return cls(tuple(variables.names), np.asarray(variables.start, float), lambda p: system(variables.unravel(p)))

    @classmethod
    def _of_names(cls, system, names):
        names, numbers = distinct_names("parameters", names), named_numbers(system)
        faults = [no_such("parameter", name, numbers) for name in names if name not in numbers]
        if faults:
            raise ModelError(faults, "export_fmu")

        def system_at(p):
            found = system
            for name, value in zip(names, p, strict=True):
                found = numbers[name][1](found, value)
            return found

        return cls(names, np.array([numbers[name][0] for name in names], float), system_at)


def named_numbers(system: System) -> dict[str, tuple[float, Callable]]:
    """Value and setter of every single number with a name: "body.mass", "strut.stiffness", "loop.kp"."""
    found: dict[str, tuple[float, Callable]] = {}
    for k, body in enumerate(system.topology.body_names):
        found[f"{body}.mass"] = float(system.mass[k]), _set_mass(k)
    for g, group in enumerate(system.forces):
        for field, values in vars(group.law).items():
            if _is_numbers(values) and np.shape(values) == (len(group.names),):
                for k, name in enumerate(group.names):
                    found[f"{name}.{field}"] = float(values[k]), _set_law(g, field, k)
    for g, group in enumerate(system.blocks):
        for field, values in vars(group.block).items():
            if _is_numbers(values) and np.shape(values) == (len(group.names),):
                for k, name in enumerate(group.names):
                    found[f"{name}.{field}"] = float(values[k]), _set_block(g, field, k)
    return found


def _is_numbers(value):
    return hasattr(value, "dtype") and np.issubdtype(np.dtype(value.dtype), np.floating)


def _set_mass(k):
    return lambda system, value: replace_field(system, "mass", system.mass.at[k].set(value))


def _set_law(g, field, k):
    def set_law(system, value):
        groups = list(system.forces)
        law = groups[g].law
        values = getattr(law, field).at[k].set(value)
        groups[g] = replace_field(groups[g], "law", replace_field(law, field, values))
        return replace_field(system, "forces", tuple(groups))

    return set_law


def _set_block(g, field, k):
    def set_block(system, value):
        blocks = list(system.blocks)
        values = getattr(blocks[g].block, field).at[k].set(value)
        blocks[g] = replace_field(blocks[g], "block", replace_field(blocks[g].block, field, values))
        return replace_field(system, "blocks", tuple(blocks))

    return set_block
