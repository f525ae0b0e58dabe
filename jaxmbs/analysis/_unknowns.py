"""Unknowns of an equilibrium: the coordinates of a mechanism and, after them, the internal states of its elements,
divided by their scales.  Steps are displacements of the velocity columns, then changes of those states.
"""

import jax.numpy as jnp

from ..kinematics._poses import coordinate_rate, normalise, step_coordinates
from ..model._internal_states import InternalStates
from ..model._system import System
from ..signal_flow._internal_states import internal_scale


def unknowns_of(system: System, state):
    """Unknowns (nq + ns,) at a state."""
    if state.internal is None:
        return state.coordinates
    return jnp.concatenate([state.coordinates, state.internal.values / internal_scale(system)])


def at_unknowns(system: System, x):
    """Coordinates (nq,), and internal states or None."""
    top = system.topology
    if not top.internal:
        return x, None
    internal = InternalStates(x[top.num_coordinates :] * internal_scale(system), top.internal)
    return x[: top.num_coordinates], internal


def after_step(system: System, x, step):
    """Unknowns after a step (nv + ns,)."""
    return _by_parts(system, step_coordinates, jnp.add, x, step)


def rate_of_step(system: System, x, step):
    """Rate (nq + ns,) of the unknowns along a step (nv + ns,)."""
    return _by_parts(system, coordinate_rate, lambda _, step: step, x, step)


def normalised(system: System, x):
    """Unknowns with quaternions of unit length."""
    top = system.topology
    if not top.internal:
        return normalise(top, x)
    end = top.num_coordinates
    return jnp.concatenate([normalise(top, x[:end]), x[end:]])


def _by_parts(system, of_coordinates, of_internal, x, step):
    top = system.topology
    if not top.internal:
        return of_coordinates(top, x, step)
    nq, nv = top.num_coordinates, top.num_velocities
    return jnp.concatenate([of_coordinates(top, x[:nq], step[:nv]), of_internal(x[nq:], step[nv:])])
