"""Bands of the internal states that hold at rest: bristles up to where they slip, metal up to where it yields."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ._internal_states import InternalStates, group_states

#: Rounding of a search, over the end of a band.
_NEAR = 1e-6


def band_places(system) -> np.ndarray:
    """True (ns,) for the internal states that rest at any value of a band."""
    found = np.zeros(sum(record.size for record in system.topology.internal), bool)
    first = 0
    for group in system.forces:
        bands = jax.eval_shape(jax.vmap(_bands), group.law) if group.internal else {}
        each = [np.full(math.prod(shape), name in bands) for name, shape, _ in group.internal]
        for one in each * len(group.names):
            found[first : first + len(one)] = one
            first += len(one)
    return found


def is_beyond_bands(system, internal: InternalStates | None) -> Array:
    """True where an internal state is larger than what its law holds at rest."""
    states, beyond = group_states(system, internal), jnp.zeros((), bool)
    for group, found in zip(system.forces, states.laws if states else (), strict=False):
        for name, most in (jax.vmap(_bands)(group.law) if group.internal else {}).items():
            size = _sizes(found[name])
            beyond = beyond | jnp.any(size > (1.0 + _NEAR) * most.reshape(-1, *[1] * (size.ndim - 1)))
    return beyond


def _bands(law):
    """The largest sizes () at rest of a law's states that have a band, by name."""
    return {name: jnp.asarray(one.most, float) for name, one in law.internal_states.items() if one.most is not None}


def _sizes(states):
    """Sizes of states (n, *shape), of vectors along the last axis."""
    return jnp.abs(states) if states.ndim == 1 else jnp.sqrt(jnp.sum(states * states, axis=-1))
