"""Internal states of force elements and blocks at a configuration: their initial values and their rates."""

import dataclasses
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import is_concrete
from ..errors import ModelError
from ..friction._bristles import bend_scales, bristle_rates
from ..kinematics._configuration import VelocityKinematics, at_state, with_internal, with_velocities
from ..kinematics._element_flows import element_flows
from ..kinematics._slips import slips_of
from ..model._entry_points import map_states
from ..model._internal_states import (
    InternalStates,
    block_scales,
    declared_scales,
    group_size,
    join_states,
    stacked,
)
from ..model._system import System
from ..runtime import jit
from ._acting_laws import acting_laws
from ._sampling import with_held_outputs
from ._signals import block_rates, block_starts, with_signals


def group_rates(group, law, displacement, flow, t) -> dict[str, Array]:
    """Rates (n, *shape) of the internal states of a group by name; law: at its states."""

    def of_one(law, displacement, flow):
        x, v = group.port.arguments(displacement, flow)
        rates = law.rate(*x, *v, t)
        return {name: rates[name] for name, *_ in group.internal}

    return jax.vmap(of_one)(law, displacement, flow)


def internal_rates(system: System, at: VelocityKinematics) -> Array:
    """Rates (ns,) of all internal states at a configuration with them."""
    at = with_signals(system, at)
    rates = [] if at.signals is None else block_rates(at.signals.blocks, at)

    def of_group(group, law):
        _, displacement, flow = element_flows(system, group, at, at.V, at.u)
        return join_states(group, group_rates(group, law, displacement, flow, at.t))

    laws = [of_group(group, law) for group, law in acting_laws(system, at) if group.internal]
    bends = [] if at.bends is None else [bristle_rates(system.joint_friction, at.bends, slips_of(system, at).slip)]
    return stacked([*laws, *bends, *rates])


def _has_bristles(system):
    return system.friction is not None and any(system.friction.bristle_sizes)


def initial_states(system: System, at: VelocityKinematics) -> InternalStates:
    """The internal states that a system's laws and blocks start with."""

    def of_group(group):
        _, displacement, flow = element_flows(system, group, at, at.V, at.u)

        def of_one(law, displacement, flow):
            x, v = group.port.arguments(displacement, flow)
            given = law.start(*x, *v, at.t)
            return {
                name: jnp.broadcast_to(jnp.asarray(given.get(name, 0.0), at.psi.dtype), shape)
                for name, shape, _ in group.internal
            }

        return join_states(group, jax.vmap(of_one)(group.law, displacement, flow))

    values = [of_group(group) for group in system.forces if group.internal]
    if _has_bristles(system):
        values.append(jnp.zeros(sum(system.joint_friction.bristle_sizes), at.psi.dtype))
    if system.blocks:
        number = sum(len(group.names) * group_size(group) for group in system.blocks)
        at_laws = with_internal(system, at, jnp.concatenate([*values, jnp.zeros(number, at.psi.dtype)]))
        values += block_starts(system, at_laws)
    return InternalStates(stacked(values), system.topology.internal)


def internal_scale(system: System) -> Array:
    """Scales (ns,) of all internal states."""
    laws = [join_states(group, declared_scales(group)) for group in system.forces if group.internal]
    if _has_bristles(system):
        laws.append(bend_scales(system.joint_friction))
    return stacked([*laws, *(join_states(group, block_scales(group)) for group in system.blocks if group.internal)])


def with_start(system: System, state, given: Mapping[str, Array]):
    """The state with its internal states: those given by name, the others as their laws start; of states with leading
    axes, which may be NaN, those of each.

    Raises: ModelError for values or rates of one state that are not finite, where they can be seen.
    """
    internal, rates = _start_and_rates(system, state, dict(given))
    if is_concrete(internal, rates) and not state.t.ndim:
        _check_finite(internal, rates)
    return dataclasses.replace(state, internal=internal)


@jit(compile="tape")
def _start_and_rates(system, state, given):
    return map_states(lambda state: _start_of_one(system, state, given), state)


def _start_of_one(system, state, given):
    at = with_velocities(system, at_state(system, state, inertias=False), state.velocities)
    internal = initial_states(system, at)
    values = internal.values
    for record in internal.records:
        if record.name in given:
            part = given[record.name].astype(values.dtype).reshape(record.size)
            values = values.at[record.first : record.first + record.size].set(part)
    values = with_held_outputs(system, at, values, given)
    internal = InternalStates(values, internal.records)
    return internal, internal_rates(system, with_internal(system, at, internal))


def _check_finite(internal, rates):
    """Raises: ModelError with the names of the internal states whose values or rates are not finite."""
    faults = []
    for what, values in (("start at values", internal.values), ("have rates", rates)):
        bad = ~np.isfinite(np.asarray(values))
        names = [name for name, wrong in zip(internal.entries, bad, strict=True) if wrong]
        if names:
            faults.append(f"state: the internal states {', '.join(names)} {what} that are not finite")
    if faults:
        raise ModelError(faults)
