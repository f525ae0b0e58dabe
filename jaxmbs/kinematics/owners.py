"""What wrenches are summed on: nodes of the tree, each with all bodies welded to it, or single bodies."""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from ..math.rows import summed, take
from ..math.spatial import pack, world_inertia
from ..model.system import System

_UPPER = np.array([0, 1, 2, 4, 5, 8])  # of a symmetric (3, 3), row by row


class Owners(NamedTuple):
    """Owner of every frame (frames,), -1 for the ground; their number; and `masses(at, V_dot)`: their inertias
    (number, 10), twists and rates of twists (number, 6), from the rates V_dot (nodes, 6) of the nodes."""

    of_frame: np.ndarray
    number: int
    masses: Callable

    def collect(self, frames, wrenches):
        """Wrenches (n, 6) on frames (n,) summed on their owners (number, 6)."""
        return summed(wrenches, self.of_frame[np.asarray(frames)] % (self.number + 1), self.number)


def nodes(system: System) -> Owners:
    """The nodes of the tree."""
    top = system.topology
    return Owners(np.asarray(top.frame_node), top.nodes.size, lambda at, V_dot: (at.J, at.V, V_dot))


def single_bodies(system: System) -> Owners:
    """The bodies, welded ones too."""
    top = system.topology
    own, node = slice(1, top.bodies.size + 1), np.asarray(top.body_node, int)

    def masses(at, V_dot):
        inertia = system.inertia.reshape(-1, 9)[:, _UPPER]
        place = tuple(at.R[own].reshape(-1, 9).T), tuple(at.x[own].T)
        J = pack(world_inertia(*place, system.mass, tuple(system.com.T), tuple(inertia.T)))
        pad = jnp.zeros((1, 6), V_dot.dtype)
        return J, *(take(jnp.concatenate([v, pad]), node % (len(v) + 1)) for v in (at.V, V_dot))

    return Owners(np.asarray(top.frame_body), top.bodies.size, masses)
