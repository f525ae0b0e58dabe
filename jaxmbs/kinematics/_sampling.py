"""Sampled blocks at a configuration: at a sample their states and outputs get new values, which are then held.

A sampled block has its output as the internal state "output".  Of blocks that are sampled at the same instant each
sees the new outputs of those before it in the order of evaluation.
"""

from collections.abc import Iterable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..errors import ModelError
from ..model._internal_states import with_internal
from ..model._signals import BlockElement, drivers_of
from ..model._system import System
from ._configuration import VelocityKinematics
from ._signals import block_inputs, block_output, measured_at, no_inputs, with_driven_fields


def sample_periods(system: System) -> Array | None:
    """Different periods (m,) [s] of the sampled blocks; None without such."""
    first = {e.rhythm: e.period for e in reversed(system.blocks) if e.rhythm is not None and e.period is not None}
    return jnp.stack([jnp.asarray(first[k]) for k in sorted(first)]) if first else None


def refuse_sampled(system: System, what: str) -> None:
    """Raises: ModelError if blocks of the system are sampled."""
    names = [repr(element.name) for element in system.blocks if element.period is not None]
    if names:
        raise ModelError(
            [
                f"{what}: blocks {', '.join(names)} are sampled and have no rates between samples: build the system "
                "without every= for their continuous forms"
            ]
        )


def with_held_outputs(system: System, at: VelocityKinematics, values: Array, given: Iterable[str]) -> Array:
    """Internal states (ns,) of a start whose sampled blocks hold the outputs that these give, but for given ones."""
    periods = sample_periods(system)
    if periods is None:
        return values
    names = {f"{element.name}.output" for element in system.blocks if element.period is not None}.difference(given)
    found = np.zeros(len(values), bool)
    for record in system.topology.internal:
        found[record.first : record.first + record.size] = record.name in names
    sampled = sampled_values(with_internal(system, values), at, values, jnp.ones(periods.shape, bool))
    return jnp.where(found, sampled, values)


def sampled_values(system: System, at: VelocityKinematics, values: Array, due: Array) -> Array:
    """Values (ns,) of the internal states after the samples of the periods that are due (m,).

    Args: system: at the internal states of these values.
    """
    signals, drivers, states = measured_at(system, at), drivers_of(system), {}
    for element in system.blocks:
        if element.is_early or element.period is None:
            states[element.name] = element.s or {}
        else:
            states[element.name] = _next_states(element, drivers, signals, at, due)
        block = with_driven_fields(element, drivers, signals)
        u = no_inputs(element, at) if element.is_early else block_inputs(element, signals, at)
        signals[element.name] = block_output(element, block, u, states[element.name], at)
    for element in system.blocks:
        if element.is_early and element.period is not None:
            states[element.name] = _next_states(element, drivers, signals, at, due)
    found = [states[e.name][name].reshape(-1) for e in system.blocks for name, *_ in e.internal]
    first = len(values) - sum(part.size for part in found)
    return jnp.concatenate([values[:first], *found])


def _next_states(element: BlockElement, drivers, signals, at, due) -> dict[str, Any]:
    """The states of a sampled block, after its sample if it is due."""
    block, s = with_driven_fields(element, drivers, signals), element.s or {}
    output, new = block.sample(block_inputs(element, signals, at), s, at.t, element.period)
    new = {**new, "output": jnp.reshape(output, element.shape)}

    def chosen(name):
        value = jnp.broadcast_to(jnp.asarray(new[name], s[name].dtype), s[name].shape)
        return jnp.where(due[element.rhythm], value, s[name])

    return {name: chosen(name) for name in s}
