"""Loads of rubbing joints that redundant constraints leave open: shared by least compliance, as `reactions` are."""

import jax
import jax.numpy as jnp
import numpy as np

from ..kinematics import _reaction_map as reaction_map
from ..kinematics._configuration import VelocityKinematics, node_accelerations
from ..kinematics._joint_wrenches import joint_wrenches
from ..kinematics._linear_solver import linear_solver
from ..kinematics._wrench_targets import body_targets
from ..model._system import System
from ..runtime import segment_sum_static
from ._bodies import inverse_dynamics_loads
from ._distribution import least_compliance_reactions
from ._efforts import efforts


def shared_multipliers(system: System, at: VelocityKinematics, wrench, a, multipliers, compliance=None):
    """Multipliers (1 + n, rows) changed along the self-stresses so that the complementary energy of all joints is
    least: of the motion without friction, and of each surface's friction alone.

    The least energy is affine in the loads, so that the sum of all shares is the share of the sum.

    Args:
        wrench (n, 6): world wrench of each surface's friction on the child per unit resistance.
        a (1 + n, nv), multipliers (1 + n, rows): as of `solve_friction`; compliance: by name, see `reactions`.
    Source: S1 (28).
    """
    f, top, owners = system.friction, system.topology, body_targets(system)
    names = [name for name, *_ in reaction_map.carriers(system)]
    is_cut = np.array([top.joints[j].is_cut for j in f.joints], bool)
    own = np.array([names.index(top.joints[j].name) for j in f.joints])
    none = jnp.zeros_like(a[0])

    def lack(a):
        return inverse_dynamics_loads(system, at, node_accelerations(top, at, a), a, owners).wrench

    still, moving = jax.vmap(lambda da: jax.jvp(lack, (none,), (da,)), out_axes=(None, 0))(a)
    moving = moving.at[0].add(still - efforts(system, at, owners)[0])
    # the friction of cut joints acts on the bodies; that of the tree's is inside of their columns
    alone = np.eye(len(a), len(f.joints), k=-1)[:, :, None] * np.where(is_cut, 1.0, 0.0)[None, :, None]
    cut = jnp.asarray(alone, a.dtype) * wrench[None]

    def shared(lack, cut, multipliers):
        acting = owners.collect((*f.children, *f.parents), jnp.concatenate([cut, -cut]))
        carried = joint_wrenches(system, at, lack - acting, multipliers).wrench
        carried = carried + segment_sum_static(cut, own, len(names))
        return least_compliance_reactions(system, at, carried, multipliers, compliance, linear_solver(system))

    return jax.vmap(shared)(moving, cut, multipliers)
