"""Joint wrenches from the loads that the bodies require: sums over subtrees, multipliers in loops."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..kinematics._configuration import Configuration
from ..kinematics._tree import subtrees
from ..kinematics._wrench_targets import body_targets
from ..math._linalg import skew
from ..model._system import System
from ..runtime import gather_static
from . import _closures as closures
from . import _rows as rows


class JointWrenches(NamedTuple):
    """World wrenches (carriers, 6) about the origin, on the child of every joint, then on frame B of every two-frame
    constraint, as `reaction_map.carriers` has them; and efforts (nv,) along the columns."""

    wrench: Array
    effort: Array


def joint_wrenches(system: System, at: Configuration, lack, multipliers) -> JointWrenches:
    """Wrenches and efforts that the joints carry.

    Args: lack (bodies, 6): what every body needs beside what acts on it.
    """
    top = system.topology
    cut, each = _closure_wrenches(system, at, multipliers)
    if rows.has_frames(system):
        cut = cut + rows.wrenches_on(body_targets(system), system, at, multipliers)
    carried = subtrees(top.bodies, lack - cut)
    sign = np.array([1.0 if top.joints[j].child == k else -1.0 for k, j in enumerate(top.body_joint)])
    body_of = {j: k for k, j in enumerate(top.body_joint)}
    elements = [name for group in system.closures for name in group.names]
    place = body_of | {top.joint_index.get(name, name): len(body_of) + i for i, name in enumerate(elements)}
    extra = [name for name in elements if name not in top.joint_index]
    wrench = jnp.concatenate([carried * jnp.asarray(sign, carried.dtype)[:, None], each])
    wrench = gather_static(wrench, [place[key] for key in (*range(len(top.joints)), *extra)])
    column_body = [body_of[j] for j in top.node_joint]
    return JointWrenches(wrench, jnp.einsum("nk,nk->n", at.S, gather_static(carried, column_body)))


def _closure_wrenches(system, at, multipliers):
    """Wrench of all loop rows on every body (bodies, 6), and of every element on its frame B (elements, 6)."""
    if not system.closures:
        return jnp.zeros((system.topology.bodies.size, 6), multipliers.dtype), jnp.zeros((0, 6), multipliers.dtype)
    each = closures.wrenches(system, closures.directions(system, at), multipliers)
    return closures.accumulate_wrenches(body_targets(system), system, each), jnp.concatenate(each)


def wrenches_at_frames(wrench, R, x, axes, sign):
    """Forces and moments (n, 3) about the points x, in world axes or those of R, from world wrenches (n, 6)."""
    force, moment = wrench[:, 3:], wrench[:, :3] - jnp.einsum("nij,nj->ni", jax.vmap(skew)(x), wrench[:, 3:])
    if axes == "joint":
        force, moment = (jnp.einsum("nji,nj->ni", R, v) for v in (force, moment))
    return sign * force, sign * moment
