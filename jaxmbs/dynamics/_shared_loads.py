"""Loads of rubbing joints that redundant constraints leave open: shared by least compliance, as `reactions` are."""

import jax
import jax.numpy as jnp
import numpy as np

from ..constraints import _closures as closures
from ..constraints import _reaction_map as reaction_map
from ..constraints import _rows as rows
from ..constraints._linear_solver import linear_solver
from ..kinematics._configuration import VelocityKinematics, node_accelerations
from ..kinematics._wrench_targets import body_targets
from ..math._linalg import few_columns
from ..model._system import System
from ._bodies import acceleration_loads, inverse_dynamics_loads
from ._distribution import least_compliance_reactions
from ._efforts import efforts


def shared_multipliers(system: System, at: VelocityKinematics, wrench, lack, a, multipliers, compliance=None):
    """Multipliers (1 + n, rows) changed along the self-stresses so that the complementary energy of all joints is
    least: of the motion without friction, and of each surface's friction alone.

    The least energy is affine in the loads, so that the sum of all shares is the share of the sum.

    Args:
        wrench (n, 6): world wrench of each surface's friction on the child per unit resistance.
        lack (1 + n, nodes, 6): what every node needs beside the force elements on it; a (1 + n, nv),
            multipliers (1 + n, rows): as of `solve_friction`; compliance: by name, see `reactions`.
    Source: S1 (28).
    """
    of_bodies, of_closures, of_friction = _carried(system)
    if not np.array_equal(system.topology.body_node, np.arange(system.topology.nodes.size)):
        lack = _lack_of_bodies(system, at, a, multipliers)
    each = jax.vmap(lambda y: jnp.concatenate(closures.wrenches(system, closures.directions(system, at), y)))
    parts = jnp.swapaxes(jnp.concatenate([lack, each(multipliers)], axis=1), 0, 1)
    maps = jnp.asarray(np.concatenate([of_bodies, of_closures], axis=1), a.dtype)
    carried = few_columns(maps, parts.reshape(len(parts), -1)).reshape(len(maps), -1, 6)
    own = jnp.asarray(of_friction, a.dtype)[:, :, None] * wrench[None]
    carried = carried.at[:, 1:].add(own)
    return least_compliance_reactions(
        system, at, jnp.swapaxes(carried, 0, 1), multipliers, compliance, linear_solver(system)
    )


def _lack_of_bodies(system, at, a, multipliers):
    """Wrenches (1 + n, bodies, 6) that the bodies need beside force elements and cables, as `lack` of the nodes."""
    owners = body_targets(system)
    found = wrenches_lacking(system, at, owners, a, efforts(system, at, owners)[0], len(multipliers))
    if rows.has_frames(system):
        found = found - jax.vmap(lambda y: rows.wrenches_on(owners, system, at, y))(multipliers)
    return found


def wrenches_lacking(system: System, at: VelocityKinematics, owners, a, F, count):
    """Wrenches (count, n, 6) that the owners lack beside those of force elements F (n, 6), of the motion without
    friction and of each surface's friction alone.

    Args: a (count, nv), or (1, nv) where friction changes no acceleration.
    """
    first = a[0] if len(a) < count else jnp.zeros_like(a[0])
    V_dot = node_accelerations(system.topology, at, first)
    still = inverse_dynamics_loads(system, at, V_dot, first, owners).wrench - F
    if len(a) < count:
        return jnp.pad(still[None], ((0, count - 1), (0, 0), (0, 0)))
    return still_and_moving(system, at, owners, a, still)


def still_and_moving(system: System, at: VelocityKinematics, owners, a, still):
    """Wrenches (count, n, 6) that the owners lack at accelerations a (count, nv), from those at zero accelerations
    (n, 6), which the first has alone."""
    moving = jax.vmap(lambda a: acceleration_loads(system, at, a, owners).wrench)(a)
    return moving + np.eye(1, len(a), dtype=a.dtype)[0][:, None, None] * still[None]


def _carried(system):
    """Static maps to the wrenches of all carriers: (carriers, bodies) from what bodies lack, (carriers, elements)
    from the wrenches of closures, (carriers, n) from the friction of each surface on the child of a cut joint."""
    f, top = system.friction, system.topology
    names = [name for name, *_ in reaction_map.reaction_carriers(system)]
    below = np.zeros((len(names), top.bodies.size + 1))  # the ground, last, is below nothing
    for body, joint in enumerate(top.body_joint):
        outward = 1.0 if top.joints[joint].child == body else -1.0
        below[names.index(top.joints[joint].name), :-1] = outward * top.bodies.path[:, body]
    body_of = np.asarray(top.frame_body)
    elements = [element for g in system.closures for element in zip(g.names, g.first, g.second, strict=True)]
    of_closures = np.stack([below[:, body_of[i]] - below[:, body_of[j]] for _, i, j in elements], axis=1)
    for k, (name, *_) in enumerate(elements):
        of_closures[names.index(name), k] = 1.0
    of_friction = below[:, body_of[np.asarray(f.parents)]] - below[:, body_of[np.asarray(f.children)]]
    for k, j in enumerate(f.joints):
        if top.joints[j].is_cut:
            of_friction[names.index(top.joints[j].name), k] = 1.0
        else:
            of_friction[:, k] = 0.0  # inside of the tree's joint
    return below[:, :-1], of_closures, of_friction
