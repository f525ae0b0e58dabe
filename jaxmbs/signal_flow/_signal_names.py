"""Signals by name: their values at states, and the names that signals and inputs have."""

from collections.abc import Iterable

import jax
import jax.numpy as jnp
from jax import Array

from ..checks import place_of
from ..errors import ModelError
from ..kinematics._configuration import at_state, with_velocities
from ..model._entry_points import state_function
from ..model._signals import block_named, drivers_of
from ..model._system import AbstractState, System
from ._signals import signals_at


@state_function
def signals(system: System, state: AbstractState) -> dict[str, Array]:
    """Values of all measures and outputs of blocks by name, at a state or along a motion.

    Returns: arrays (...) of signals of one number, (..., n) of several, with the leading axes of the states.
    """
    at = with_velocities(system, at_state(system, state, inertias=False), state.velocities)
    values = signals_at(system, at)
    return {name: values[name] for name in _own_names(system)}


def signal_names(system: System) -> list[str]:
    """Names of all signals: measures, blocks, internal states."""
    return _own_names(system) + [record.name for record in system.topology.internal]


def _own_names(system):
    return [name for group in (*system.measures, *system.blocks) for name in group.names]


def input_fields(system: System) -> list[str]:
    """Names of all fields that may be inputs, "motor.voltage"; those that a block drives are none."""
    laws = [(name, group.law) for group in system.forces for name in group.names]
    parts = laws + [(name, group.block) for group in system.blocks for name in group.names]
    drivers = drivers_of(system.blocks)
    found = [f"{name}.{field}" for name, part in parts for field in part.inputs]
    return [name for name in found if name not in drivers]


def check_input_fields(system: System, names: Iterable[str]) -> None:
    """Raises: UnknownNameError; ModelError for a field that a block drives."""
    drivers, fields = drivers_of(system.blocks), input_fields(system)
    for name in names:
        if name in drivers:
            raise ModelError([f"input {name!r}: block {drivers[name][0]!r} drives it; take an input of that block"])
        place_of("input", name, fields)
        if _shape_of_field(system, name):
            raise ModelError([f"input {name!r}: its values have several entries; an input is one number"])


def _shape_of_field(system, name):
    """Shape of the values of a field that is a function of time alone, () of others."""
    element, _, field = name.rpartition(".")
    groups = [group for group in system.forces if element in group.names]
    laws = [jax.tree.map(lambda x, g=g: x[g.names.index(element)], g.law) for g in groups]
    (part,) = laws + [found.block for found in block_named(system.blocks, element)]
    try:
        return jax.eval_shape(lambda t: jnp.asarray(getattr(part, field)(t), float), jnp.zeros(())).shape
    except TypeError:  # a function of (x, v, t)
        return ()
