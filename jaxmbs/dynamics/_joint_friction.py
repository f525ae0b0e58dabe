"""Friction in joints from the loads that the joints carry: reactions are affine in the friction of all of them.

A surface takes the load N = |R|, summed over its patches, and rubs with mu N against the slip; its friction changes
the accelerations and the reactions R of all joints, which are affine in the loads, `R = R0 + G N`.  One factor of the
saddle system serves R0 and a column of G for each surface.  Newton's method solves the few equations |R0 + G N| = N;
their derivative is that of the implicit function, so derivatives of every order are those of the solution.

Loads have no unique solution where the map from N to |R0 + G N| does not contract: the joint jams.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..constraints import _closures as closures
from ..constraints import _rows as constraint_rows
from ..friction._bristles import with_tractions
from ..friction._groups import resistances
from ..friction._joint_friction import JointFriction
from ..friction._normal_loads import LoadMap, NormalLoads, normal_loads
from ..friction._surfaces import surface_rows
from ..kinematics._configuration import VelocityKinematics
from ..kinematics._slips import slips_of
from ..kinematics._wrench_targets import node_targets
from ..math._linalg import few_columns
from ..math._spatial import cross
from ..model._system import System
from ..runtime import gather_static, segment_sum_static
from ._loads import Loads
from ._shared_loads import shared_multipliers, still_and_moving


class Rubbing(NamedTuple):
    """Surfaces at a configuration.  Friction is resistance times a unit, which for the smooth models is the slip and
    for bristles what their bend and its rate give per unit load.

    Attributes:
        bears: (loads, 6) components of the loads per world wrench of the joint on its child.
        wrench: (n, 6) world wrench of the friction on the child per unit resistance.
        efforts: (n, nv) of it on the columns of the tree.
        power: (n,) of it, per unit resistance.
        grip: (n,) resistance over load; own: (n,) resistance that follows no load, None where there is none.
        thread: (n,) what friction adds to the normal load of a screw's thread, per unit resistance, zero for others;
            None without screws.
    """

    bears: Array
    wrench: Array
    efforts: Array
    power: Array
    grip: Array
    own: Array | None
    thread: Array | None

    def resistance(self, total: Array) -> Array:
        """Resistance (n,) under loads (n,) with their preloads."""
        return self.grip * total if self.own is None else self.grip * total + self.own


class FrictionSolution(NamedTuple):
    """Motion with friction: accelerations (nv,), multipliers (rows,), gaps (rows,) of the rows, loads of the surfaces
    and their verdict, wrenches (n, 6) on the children, efforts (n, nv) on columns, and powers (n,)."""

    accelerations: Array
    multipliers: Array
    gaps: Array
    surfaces: Rubbing
    loads: NormalLoads
    total: Array
    wrench: Array
    efforts: Array
    powers: Array


def rubbing(system: System, at: VelocityKinematics) -> Rubbing:
    """The surfaces of all joints at a configuration with velocities."""
    f, dtype, found = system.joint_friction, at.u.dtype, slips_of(system, at)
    on, number = found.rows.surface_of_slip, len(f.joints)
    grip, own = resistances(f.models, found.square)
    unit = -found.slip if at.bends is None else with_tractions(f, at.bends, found.slip, -found.slip)
    wrench = segment_sum_static(unit[:, None] * found.directions, on, number)
    path = jnp.asarray(_paths(system.topology, f.children) - _paths(system.topology, f.parents), dtype)
    efforts = jnp.sum(wrench[:, None, :] * at.S[None], axis=2) * path
    # the axial force is that of the thread's normal and of its friction: n = F / cos - f tan
    is_thread = found.rows.is_thread.any()
    thread = -segment_sum_static(unit, on, number) * found.tangent if is_thread else None
    power = segment_sum_static(unit * found.slip, on, number)
    return Rubbing(found.bears, wrench, efforts, power, grip, own, thread)


def joint_axes(f: JointFriction, at, wrench):
    """Moments about the surfaces' points and forces (n, 3), in their axes, from world wrenches (n, 6)."""
    R = gather_static(at.R, f.axes) @ f.basis.astype(wrench.dtype)
    moment = wrench[:, :3] - cross(gather_static(at.x, f.points), wrench[:, 3:])
    return jnp.einsum("nji,nj->ni", R, moment), jnp.einsum("nji,nj->ni", R, wrench[:, 3:])


def _paths(top, frames):
    """(n, columns): 1 where a column moves the frame."""
    path = np.vstack([top.nodes.path, np.zeros((1, top.nodes.size), bool)]).astype(float)
    return path[np.asarray(top.frame_node)[np.asarray(frames)]]


class _Carriers(NamedTuple):
    """Static maps to the wrenches of the rubbing joints: (n, nodes) from what nodes lack, (n, elements) from the
    wrenches of closures, (n, n) from the friction of each surface; and the mask (n,) of cut joints."""

    lack: np.ndarray
    closures: np.ndarray
    friction: np.ndarray
    is_cut: np.ndarray


def carriers(system: System) -> _Carriers:
    """The maps of a system."""
    f, top = system.joint_friction, system.topology
    size, body_joint = top.nodes.size, np.asarray(top.body_joint)
    is_cut = np.array([top.joints[j].is_cut for j in f.joints], bool)
    lack = np.zeros((len(f.joints), size))
    for k, j in enumerate(f.joints):
        joint = top.joints[j]
        if not joint.is_cut:
            outward = 1.0 if joint.child == int(np.flatnonzero(body_joint == j)[0]) else -1.0
            lack[k] = outward * top.nodes.path[:, joint.first_velocity]
    names = [name for group in system.closures for name in group.names]
    ends = [np.array([e for g in system.closures for e in getattr(g, side)], int) for side in ("first", "second")]
    lacking: Any = np.hstack([lack, np.zeros((len(lack), 1))])  # frames on the ground are in no subtree
    node = np.asarray(top.frame_node)
    shares = lacking[:, node[ends[0]]] - lacking[:, node[ends[1]]]
    friction = lacking[:, node[np.asarray(f.parents)]] - lacking[:, node[np.asarray(f.children)]]
    for k, j in enumerate(f.joints):
        same = np.asarray(f.joints) == j
        friction[k, same] = 1.0 if is_cut[k] else 0.0  # a joint of the tree carries its own friction already
        if is_cut[k]:
            shares[k, names.index(top.joints[j].name)] = 1.0
    return _Carriers(lack, shares, friction, is_cut)


def solve_friction(
    system: System, at: VelocityKinematics, rub: Rubbing, lack, a, multipliers, compliance=None
) -> FrictionSolution:
    """Loads of all surfaces, and the motion with their friction.

    Args:
        at: `closures.with_directions`; lack (1 + n, nodes, 6): `wrenches_lacking` of the nodes.
        a (1 + n, nv), multipliers (1 + n, rows): of the motion without friction, and of each surface's friction alone
            per unit resistance; a (1, nv) where the accelerations are given.
        compliance: by which redundant constraints share the loads that statics leaves open, see `reactions`.
    """
    f, to, dtype = system.joint_friction, carriers(system), a.dtype
    targets, rows, parts = node_targets(system), surface_rows(f.kinds, dtype), [lack]
    if constraint_rows.has_frames(system):
        parts[0] = parts[0] - jax.vmap(lambda y: constraint_rows.wrenches_on(targets, system, at, y))(multipliers)
    if f.is_shared and system.closures:
        multipliers = shared_multipliers(system, at, rub.wrench, parts[0], a, multipliers, compliance)
    if system.closures:
        D = closures.directions(system, at)
        parts.append(jax.vmap(lambda y: jnp.concatenate(closures.wrenches(system, D, y)))(multipliers))
    # wrenches (n, 1 + n, 6) of the joint of each surface
    of = rows.surface_of_load
    parts = jnp.swapaxes(jnp.concatenate(parts, axis=1), 0, 1)
    maps = jnp.asarray(np.concatenate([to.lack, to.closures], axis=1)[of, : len(parts)], dtype)
    carried = few_columns(maps, parts.reshape(len(parts), -1)).reshape(len(maps), -1, 6)
    loads = jnp.sum(rub.bears[:, None] * carried, axis=2)
    own = jnp.sum(rub.bears[:, None] * rub.wrench[None], axis=2) * to.friction[of].astype(dtype)
    moved = loads[:, 1:] + own  # by each surface's unit resistance
    if rub.thread is not None:
        moved = moved + jnp.asarray(np.eye(len(f.joints))[of], dtype) * rub.thread[None]
    alone = loads[:, 0] if rub.own is None else loads[:, 0] + jnp.sum(moved * rub.own[None], axis=1)
    found = normal_loads(
        LoadMap.of(
            alone,
            moved * rub.grip[None],
            f.preload,
            np.arange(rows.patch_of_load.max() + 1)[:, None] == rows.patch_of_load[None],
            np.arange(len(f.joints))[:, None] == rows.surface_of_patch[None],
        )
    )
    total = found.load + f.preload
    resistance = rub.resistance(total)
    return FrictionSolution(
        a[0] + resistance @ a[1:] if len(a) > 1 else a[0],
        multipliers[0] + resistance @ multipliers[1:],
        jnp.zeros_like(multipliers[0]),
        rub,
        found,
        total,
        resistance[:, None] * rub.wrench,
        resistance[:, None] * rub.efforts,
        resistance * rub.power,
    )


def friction_of_motion(
    system: System, at: VelocityKinematics, lack, need, gamma, solve: Callable, compliance=None
) -> FrictionSolution:
    """Motion with friction, from `solve`: efforts (1 + n, nv) and rates of the rows (1 + n, rows) to accelerations
    and multipliers of the same shapes; need, gamma: of the motion without friction; lack (nodes, 6): what nodes need
    at zero accelerations."""
    rub = rubbing(system, at)
    b = jnp.concatenate([need[None], rub.efforts])
    c = jnp.concatenate([gamma[None], jnp.zeros((len(rub.efforts), len(gamma)), gamma.dtype)])
    a, multipliers = solve(b, c)
    lack = still_and_moving(system, at, node_targets(system), a, lack)
    return solve_friction(system, at, rub, lack, a, multipliers, compliance)


def friction_loads(system: System, solution: FrictionSolution, owners) -> Loads:
    """Friction as loads beside those of force elements: of cut joints on `owners`, of the tree's on columns."""
    f, is_cut = system.joint_friction, carriers(system).is_cut
    cut = jnp.where(is_cut[:, None], solution.wrench, 0.0)
    wrench = owners.collect((*f.children, *f.parents), jnp.concatenate([cut, -cut]))
    return Loads(wrench, jnp.sum(jnp.where(is_cut[:, None], 0.0, solution.efforts), axis=0))


def cut_friction(system: System, solution: FrictionSolution, names):
    """Wrenches (len(names), 6) of the friction of cut joints on their children, zero for all other joints."""
    f, is_cut = system.joint_friction, carriers(system).is_cut
    place = np.zeros((len(names), len(f.joints)))
    for k in np.flatnonzero(is_cut):
        place[names.index(system.topology.joints[f.joints[k]].name), k] = 1.0
    # a product would spread what is not a number
    return segment_sum_static(solution.wrench, np.where(is_cut, place.argmax(0), len(names)), len(names))
