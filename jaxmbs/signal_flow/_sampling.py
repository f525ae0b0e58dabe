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
from ..kinematics._configuration import VelocityKinematics, with_internal
from ..model._internal_states import join_states
from ..model._signals import BlockGroup, drivers_of
from ..model._system import System
from ..runtime import gather_static
from ._signals import block_inputs, block_outputs, block_states, driven_block, measured_at, no_inputs, of_each


def sample_periods(system: System) -> Array | None:
    """Different periods (m,) [s] of the sampled blocks; None without such."""
    first = {}
    for group in reversed(system.blocks):
        if group.period is None:
            continue
        first |= {rhythm: group.period[k] for k, rhythm in reversed(list(enumerate(group.rhythms)))}
    return jnp.stack([first[k] for k in sorted(first)]) if first else None


def _sampled_names(system):
    return [name for group in system.blocks if group.period is not None for name in group.names]


def refuse_sampled(system: System, what: str) -> None:
    """Raises: ModelError if blocks of the system are sampled."""
    if names := ", ".join(map(repr, _sampled_names(system))):
        raise ModelError(
            [
                f"{what}: blocks {names} are sampled and have no rates between samples: build the system "
                "without every= for their continuous forms"
            ]
        )


def with_held_outputs(system: System, at: VelocityKinematics, values: Array, given: Iterable[str]) -> Array:
    """Internal states (ns,) of a start whose sampled blocks hold the outputs that these give, but for given ones."""
    periods = sample_periods(system)
    if periods is None:
        return values
    names = {f"{name}.output" for name in _sampled_names(system)}.difference(given)
    found = np.zeros(len(values), bool)
    for record in system.topology.internal:
        found[record.first : record.first + record.size] = record.name in names
    sampled = sampled_values(system, with_internal(system, at, values), values, jnp.ones(periods.shape, bool))
    return jnp.where(found, sampled, values)


def sampled_values(system: System, at: VelocityKinematics, values: Array, due: Array) -> Array:
    """Values (ns,) of the internal states after the samples of the periods that are due (m,).

    Args: at: at the internal states of these values.
    """
    signals, drivers, states = measured_at(system, at), drivers_of(system.blocks), []
    for k, group in enumerate(system.blocks):
        states.append(block_states(at, k))
        if not group.is_early and group.period is not None:
            states[k] = _next_states(group, states[k], drivers, signals, at, due)
        block = driven_block(group, drivers, signals)
        u = no_inputs(group, at) if group.is_early else block_inputs(group, signals, at.t)
        signals.add(group.names, block_outputs(group, block, u, states[-1], at))
    for k, group in enumerate(system.blocks):
        if group.is_early and group.period is not None:
            states[k] = _next_states(group, states[k], drivers, signals, at, due)
    found = [join_states(group, s) for group, s in zip(system.blocks, states, strict=True) if group.internal]
    first = len(values) - sum(part.size for part in found)
    return jnp.concatenate([values[:first], *found])


def _next_states(group: BlockGroup, s, drivers, signals, at, due) -> dict[str, Any]:
    """The states of sampled blocks, after their sample where it is due."""

    def of_one(block, u, s, period, due):
        output, new = block.sample(u, s, at.t, period)
        new = {**new, "output": jnp.reshape(output, group.shape)}

        def chosen(name):
            value = jnp.broadcast_to(jnp.asarray(new[name], s[name].dtype), s[name].shape)
            return jnp.where(due, value, s[name])

        return {name: chosen(name) for name in s}

    block, u = driven_block(group, drivers, signals), block_inputs(group, signals, at.t)
    return of_each(group, of_one, block, u, s, group.period, gather_static(due, group.rhythms))
