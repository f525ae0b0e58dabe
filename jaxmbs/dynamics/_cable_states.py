"""Cables of a mechanism at a state: lengths, tensions, wrap angles, loads of sheaves."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..forces import Cable
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._element_flows import element_flows
from ..kinematics._state import HasStates, State
from ..model._entry_points import map_states, states_of
from ..model._system import System
from ._efforts import element_efforts


class CableResult(eqx.Module):
    """A cable at a state, or along a motion with leading axes.

    Attributes:
        length: () from end to end along the path, or around [m]; rate [m/s].
        tension: () of the elastic law and the damping, the mean along the cable [N].
        tensions: (m,) of each span between two elements, in order [N].
        wrap: (n,) angle about each element, zero at ends [rad].
        points: (m, 2, 3) world points where each span begins and ends [m].
        force, moment: (n, 3) load of each element on its body, in world axes [N, N m], the moment about the frame's
            origin: that of a sheave turns its wheel.
        sheaves: indices of the elements that are no points (static).
    """

    length: Float[Array, "..."]
    rate: Float[Array, "..."]
    tension: Float[Array, "..."]
    tensions: Float[Array, "... m"]
    wrap: Float[Array, "... n"]
    points: Float[Array, "... m 2 3"]
    force: Float[Array, "... n 3"]
    moment: Float[Array, "... n 3"]
    sheaves: tuple[int, ...] = eqx.field(static=True)

    @property
    def has_left(self) -> Array:
        """True (..., n) for sheaves that the path has left, where the law no longer holds: its wrap is negative, and
        the sheave would pull at the cable."""
        own = np.isin(np.arange(self.wrap.shape[-1]), self.sheaves)
        return (self.wrap < 0) & own

    @property
    def is_slack(self) -> Array:
        """True (...) where the cable has no tension."""
        return self.tension <= 0.0

    def faults(self) -> list[str]:
        """Sheaves that the cable has left, one sentence each, in words."""
        left = np.asarray(self.has_left).reshape(-1, self.wrap.shape[-1])
        lowest = np.asarray(self.wrap).reshape(left.shape).min(axis=0)
        return [
            f"element {k}: the cable has left it, its wrap falls to {lowest[k]:.4g} rad; give the path without it, "
            "or the other side"
            for k in np.flatnonzero(left.any(axis=0))
        ]


def cable_states(system: System, state: State | HasStates) -> dict[str, CableResult]:
    """All cables and belts of a system at a state, by name.

    Args:
        state: a State, a Motion, or states with leading axes, which the answers have too.
    """
    return map_states(lambda state: _of_one(system, state), states_of(system, state))


def _of_one(system, state):
    at = with_velocities(system, at_state(system, state, inertias=False), state.velocities)
    found = {}
    for group in system.forces:
        if not isinstance(group.law, Cable):
            continue
        _, displacement, flow = element_flows(system, group, at, at.V, at.u)
        effort = element_efforts(group, displacement, flow, at.t)[:, : 6 * group.port.num_frames]
        effort = effort.reshape(len(group.names), -1, 6)

        def read(law, x, flow, port=group.port):
            law, frames = port.law_and_motion(law, x, flow)
            return law.state(frames, at.t)

        seen = jax.vmap(read)(group.law, displacement, flow)
        seen = seen._replace(points=seen.points + at.origin[None, None, None])
        sheaves = tuple(int(k) for k in group.law.layout.circles)
        for i, name in enumerate(group.names):
            loads = (effort[i, :, 3:], effort[i, :, :3])
            found[name] = CableResult(*(jnp.asarray(part[i]) for part in seen), *loads, sheaves=sheaves)
    return found
