"""Targets of wrenches: nodes of the tree, each with all bodies welded to it, or single bodies."""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from ..math._spatial import TRIANGLE, rows, world_inertia
from ..model._system import System
from ..runtime import gather_static, segment_sum_static


class WrenchTargets(NamedTuple):
    """Nodes or bodies on which wrenches are accumulated.

    Attributes:
        of_frame: target (frames,) of every frame, -1 for the ground.
        number: of targets.
        masses: function (at, V_dot) of the rates V_dot (nodes, 6) of the nodes' twists that gives the targets'
            inertias (number, 10), twists and rates of twists (number, 6).
    """

    of_frame: np.ndarray
    number: int
    masses: Callable

    def collect(self, frames, wrenches):
        """Sums (number, 6) of wrenches (n, 6) on frames (n,) by target."""
        return segment_sum_static(wrenches, self.of_frame[np.asarray(frames)] % (self.number + 1), self.number)


def node_targets(system: System) -> WrenchTargets:
    """The nodes of the tree."""
    top = system.topology
    return WrenchTargets(np.asarray(top.frame_node), top.nodes.size, lambda at, V_dot: (at.J, at.V, V_dot))


def body_targets(system: System) -> WrenchTargets:
    """The bodies, welded ones too."""
    top = system.topology
    own, node = slice(1, top.bodies.size + 1), np.asarray(top.body_node, int)
    if np.array_equal(node, np.arange(top.nodes.size)):
        return node_targets(system)._replace(of_frame=np.asarray(top.frame_body))

    def masses(at, V_dot):
        inertia = system.inertia.reshape(-1, 9)[:, TRIANGLE]
        W = jnp.concatenate([rows(at.R[own]), at.x[own]], axis=1)
        J = world_inertia(W, system.mass[:, None], system.com, inertia)
        pad = jnp.zeros((1, 6), V_dot.dtype)
        return J, *(gather_static(jnp.concatenate([v, pad]), node % (len(v) + 1)) for v in (at.V, V_dot))

    return WrenchTargets(np.asarray(top.frame_body), top.bodies.size, masses)
