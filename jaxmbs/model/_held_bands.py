"""Bands of the internal states that hold at rest: bristles up to where they slip, metal up to where it yields."""

import jax
import jax.numpy as jnp
from jax import Array

from ._internal_states import InternalStates, group_states

#: Rounding of a search, over the end of a band.
_NEAR = 1e-6


def is_beyond_bands(system, internal: InternalStates | None) -> Array:
    """True where an internal state is larger than what its law holds at rest."""
    states, beyond = group_states(system, internal), jnp.zeros((), bool)
    for group, found in zip(system.forces, states.laws if states else (), strict=False):
        for name in group.law.holds:
            most = jax.vmap(lambda law, name=name: jnp.asarray(law.internal_states[name].most, float))(group.law)
            size = _sizes(found[name])
            beyond = beyond | jnp.any(size > (1.0 + _NEAR) * most.reshape(-1, *[1] * (size.ndim - 1)))
    return beyond


def _sizes(states):
    """Sizes of states (n, *shape), of vectors along the last axis."""
    return jnp.abs(states) if states.ndim == 1 else jnp.sqrt(jnp.sum(states * states, axis=-1))
