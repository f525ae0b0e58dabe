"""Steps saved as coordinates and velocities, which the projection has found anyway, in place of momenta.

A formulation would find the velocities of its saved rows by a solve with the mass matrix each; here they are there.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from ..assembly._state import State
from ..math._nan import masked
from ..ode._problem import LoopState


class SavedStep(NamedTuple):
    """The end of a step on the constraints: coordinates (nq,), velocities (nv,) and after them the internal states of
    force elements, work of each element (n,)."""

    coordinates: Array
    velocities: Array
    work: Array


def with_saved_steps(state: LoopState, start: SavedStep, early: Array, moved: Array) -> LoopState:
    """The loop's final state with y, and the saved rows of it, as coordinates, velocities and work.

    Args:
        start: the row of the times up to the start, `early` (T,).
        moved: () True if a step was taken, so that the final step was projected.
    """
    ys = jax.tree.map(lambda x, x0: masked(early, x, x0[None]), state.ys, tuple(start))
    velocities = jnp.where(moved, SavedStep(*state.projected).velocities, start.velocities)
    return eqx.tree_at(lambda s: (s.ys, s.y), state, (ys, (state.y[0], velocities, state.y[2])))


def with_internal_values(state: State) -> Array:
    """Velocities (nv,) of a state, and its internal states after them."""
    if state.internal is None:
        return state.velocities
    return jnp.concatenate([state.velocities, state.internal.values])
