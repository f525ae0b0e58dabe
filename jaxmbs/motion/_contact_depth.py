"""Contacts that are pressed deeper than their bound during a motion."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..dynamics._contact_load import contact_groups, contact_of, deepest
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._state import State
from ..model._entry_points import map_states
from ..model._system import System
from ..runtime import jit


def bounded_contacts(system: System) -> list:
    """Groups of contacts with a bound on their depth."""
    return [group for group in contact_groups(system) if contact_of(group.law).max_depth is not None]


def is_too_deep(system: System, states: tuple[State, ...]) -> Array:
    """True () if a contact is deeper than its bound in one of these states."""
    found = [map_states(lambda state: jnp.any(_excess(system, state) > 0), some) for some in states]
    return jnp.any(jnp.concatenate([jnp.ravel(x) for x in found]))


def deep_contacts(system: System, motion) -> list[str]:
    """Names and depths of the contacts that are deeper than their bound, of a concrete motion."""
    names = [name for group in bounded_contacts(system) for name in group.names]
    excess = np.concatenate([np.atleast_2d(_excess_of(system, some)) for some in (motion.states, motion.end)])
    largest = np.nanmax(excess, axis=0)
    return [f"{name!r} by {x:.3g} m more than its bound" for name, x in zip(names, largest, strict=True) if x > 0]


@jit(compile="quick")
def _excess_of(system, states):
    return map_states(lambda state: _excess(system, state), states)


def _excess(system, state):
    """Depth less the bound (contacts,) [m]; it has no derivative."""
    state = jax.lax.stop_gradient(state)
    at = with_velocities(system, at_state(system, state), state.velocities)
    return jnp.concatenate(
        [deepest(system, at, group) - contact_of(group.law).max_depth for group in bounded_contacts(system)]
    )
