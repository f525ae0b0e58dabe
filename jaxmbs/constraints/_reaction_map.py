"""Reactions of joints and two-frame constraints per unit multiplier of the loops' rows.

Source: S1 (27)-(28), the homogeneous family of the loops.
"""

import jax
import jax.numpy as jnp
import numpy as np

from ..kinematics._configuration import Configuration
from ..math._linalg import skew
from ..model._system import System
from ..runtime import gather_static
from ._closures import directions


def reaction_carriers(system: System):
    """Names and frames A and B of all that carry reactions: every joint, then every two-frame constraint."""
    top = system.topology
    elements = [e for g in system.closures for e in zip(g.names, g.first, g.second, strict=True)]
    return [(j.name, *j.frames) for j in top.joints] + [e for e in elements if e[0] not in top.joint_index]


def reaction_map(system: System, at: Configuration):
    """Reactions per unit multiplier, (carriers, 6, rows): force then moment on the joint's child or on frame B.

    About the origin and in the axes of that frame.  Multipliers of drives and couplers act inside their joints and
    load no body from outside.
    """
    top, names = system.topology, [name for name, *_ in reaction_carriers(system)]
    num = len(names)
    out = jnp.zeros((num, 6, top.num_rows), at.x.dtype)
    if not system.closures:
        return out
    parts = []
    for group, D in zip(system.closures, directions(system, at), strict=True):
        weight = jnp.asarray(_reaction_weights(top, group, names), D.dtype)
        parts.append(jnp.einsum("ej,erk->jker", weight, D).reshape(num, 6, -1))
    rows = sum(part.shape[2] for part in parts)
    out = jnp.concatenate([*parts, out[:, :, rows:]], axis=2)
    own = np.array([b for *_, b in reaction_carriers(system)])
    R, x, moment, force = gather_static(at.R, own), gather_static(at.x, own), out[:, :3], out[:, 3:]
    # as a product of matrices the GPU's compiler of JAX 0.11.2 finds no kernel for it
    moment = moment - jnp.sum(jax.vmap(skew)(x)[..., None] * force[:, None], axis=2)
    return jnp.concatenate([jnp.einsum("jba,jbm->jam", R, part) for part in (force, moment)], axis=1)


def _reaction_weights(top, group, names):
    """(elements, carriers): share of an element's wrench that each joint or constraint carries; static."""
    weights = np.zeros((len(group.names), len(names)))
    for e, name in enumerate(group.names):
        a, b = (top.frame_body[end[e]] for end in (group.first, group.second))
        for k in range(top.bodies.size):
            below = float(b >= 0 and top.bodies.path[b, k]) - float(a >= 0 and top.bodies.path[a, k])
            joint = top.body_joint[k]
            weights[e, joint] = -below if top.joints[joint].child == k else below
        weights[e, names.index(name)] = 1.0
    return weights
