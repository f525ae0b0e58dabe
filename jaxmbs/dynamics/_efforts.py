"""Efforts of force elements and strains on the tree, their stored energy and the power of each element.

The effort of every law becomes a world wrench on nodes or an effort on a velocity column, so a new law needs no
kinematics.  Source: S2 (56)-(76), total `Q = Q* + e_C + e_R + e_G`.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..kinematics._configuration import Configuration, VelocityKinematics, at_rest
from ..kinematics._element_flows import element_flows
from ..kinematics._wrench_targets import node_targets
from ..model._system import System
from ..signal_flow._acting_laws import acting_laws
from ..signal_flow._internal_states import group_rates
from ..signal_flow._signals import with_signals
from ._bodies import bodies_of, total
from ._loads import Loads


def element_efforts(group, law, displacement, flow, t):
    """Efforts (n, size) of a group's elements on the system; law: at the instant, see `acting_laws`."""
    return jax.vmap(lambda law, x, f: group.port.effort(law, x, f, t))(law, displacement, flow)


def efforts_and_storage_powers(group, law, displacement, flow, t):
    """Efforts (n, size) of a group's elements, and the powers (n,) that go into their stored energy."""
    both = lambda law, x, f: group.port.effort_and_storage_power(law, x, f, t)
    return jax.vmap(both)(law, displacement, flow)


class LawEffort(NamedTuple):
    """Inputs of the ports of a group, and the efforts (n, size) of its elements."""

    seen: tuple
    effort: Array


def efforts(system: System, at: VelocityKinematics, owners=None, found: list[LawEffort] | None = None):
    """Loads of all force elements: wrenches on nodes (nodes, 6) or other owners, efforts on columns (nv,), powers.

    The power is what an element feeds in beside the energy it stores: negative for dissipation, positive for
    sources that drive; in the order of `element_names`.  Gravity is not included.

    Args: found: a list to which the `LawEffort` of each group is appended.
    """
    at, owners = with_signals(system, at), owners or node_targets(system)
    loads, powers = Loads(jnp.zeros((owners.number, 6), at.psi.dtype), jnp.zeros_like(at.u)), []
    for group, law in acting_laws(system, at):
        seen, displacement, flow = element_flows(system, group, at, at.V, at.u)
        effort, storing = efforts_and_storage_powers(group, law, displacement, flow, at.t)
        if found is not None:
            found.append(LawEffort(seen, effort))
        loads = loads + Loads(*group.port.spread(group, seen, effort, owners, at.u.size))
        power = jnp.sum(effort * flow, axis=1) + storing
        powers.append(power + state_power(group, law, displacement, flow, at.t) if group.internal else power)
    for bodies in bodies_of(system):
        strain, power = bodies.strain_efforts(system, at, owners)
        loads, powers = loads + strain, [*powers, *power]
    return loads.wrench, loads.column, jnp.concatenate(powers) if powers else jnp.zeros(0, at.psi.dtype)


def state_power(group, law, displacement, flow, t):
    """Power (n,) that goes into the stored energy of a group by the rates of its internal states."""
    x = jax.vmap(lambda d, f: group.port.arguments(d, f)[0])(displacement, flow)
    rates = group_rates(group, law, displacement, flow, t)
    return jax.vmap(lambda law, x, rates: law.state_power(x, rates, t))(law, x, rates)


def element_names(system: System) -> tuple[str, ...]:
    """Names of the force elements in the order of their powers, then of the elastic bodies (their
    dampers), then of the surfaces that rub."""
    forces = tuple(name for group in system.forces for name in group.names)
    elastic = tuple(name for group in system.elastic for name in group.names)
    return forces + elastic + (() if system.friction is None else system.friction.names)


def stored_energy(system: System, at: Configuration, ends: list | None = None):
    """Potential energy [J] of all force elements and elastic bodies, without gravity.  Source: S2 (70), V.

    Args: ends: a list to which (names, margins) of each group that has margins are appended; with it `at` is a
        `VelocityKinematics`.
    """
    if ends is not None:
        return _stored_energy_and_ends(system, at, ends)
    stored, still = total(bodies.strain_energy(system, at) for bodies in bodies_of(system)), at_rest(system, at)
    for group, law in acting_laws(system, at):
        displacement = element_flows(system, group, at, still.V, still.u)[1]
        parts = jax.vmap(lambda law, x, port=group.port: port.potential(law, x, at.t))(law, displacement)
        stored = stored + jnp.sum(parts)
    return stored


def _stored_energy_and_ends(system, at, ends):
    parts = [bodies.strain_energy_and_validity(system, at) for bodies in bodies_of(system)]
    stored = total(energy for energy, _ in parts)
    ends += [margins for _, margins in parts]
    for group, law in acting_laws(system, at):
        _, displacement, flow = element_flows(system, group, at, at.V, at.u)
        if group.law.has_ends:
            both = lambda law, x, f, port=group.port: port.potential_and_validity(law, x, f, at.t)
            energy, margins = jax.vmap(both)(law, displacement, flow)
            ends.append((group.names, margins))
        else:
            energy = jax.vmap(lambda law, x, port=group.port: port.potential(law, x, at.t))(law, displacement)
        stored = stored + jnp.sum(energy)
    return stored
