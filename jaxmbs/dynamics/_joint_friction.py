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

from ..kinematics import _closures as closures
from ..kinematics._configuration import VelocityKinematics, node_accelerations
from ..kinematics._poses import frame_twists
from ..kinematics._wrench_targets import node_targets
from ..math._linalg import few_columns
from ..math._spatial import cross
from ..model._friction import JointFriction
from ..model._system import System
from ..runtime import gather_static, segment_sum_static
from ._bodies import inverse_dynamics_loads
from ._friction_surfaces import surface_rows
from ._loads import Loads
from ._normal_loads import LoadMap, NormalLoads, normal_loads

#: The bump of static friction fades over so many transition speeds, as that of `CoulombFriction`.
_BUMP = 10.0


class Rubbing(NamedTuple):
    """Surfaces at a configuration.

    Attributes:
        bears: (loads, 6) components of the loads per world wrench of the joint on its child.
        wrench: (n, 6) world wrench of the friction on the child per unit load.
        efforts: (n, nv) of it on the columns of the tree.
        slip: (slips,) components of the slip [m/s]; speed: (n,) their magnitudes squared; grip: (n,) friction over
            load, per unit slip [s/m].
        thread: (n,) what friction adds to the normal load of a screw's thread, per unit load; zero for all others.
    """

    bears: Array
    wrench: Array
    efforts: Array
    slip: Array
    speed: Array
    grip: Array
    thread: Array


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
    f, dtype = system.friction, at.u.dtype
    rows = surface_rows(f.kinds, dtype)
    arm = jnp.where(rows.is_thread, f.radius, 1.0)
    lean = jnp.hypot(arm, f.pitch)
    cosine, sine = arm / lean, f.pitch / lean  # of the angle of a thread; one and zero for all others
    of, on = rows.surface_of_load, rows.surface_of_slip
    bears = rows.load / gather_static(cosine, of)[:, None]
    bears = bears + rows.load_by_length / gather_static(f.length, of)[:, None]
    slips = rows.slip + gather_static(f.radius * cosine, on)[:, None] * rows.slip_by_radius
    slips = slips + gather_static(sine, on)[:, None] * (np.eye(1, 6, 5) * rows.is_thread[on][:, None]).astype(dtype)
    first, second = _in_world(f, at, np.concatenate([of, on]), jnp.concatenate([bears, slips]).astype(dtype))
    m = len(of)
    bears = jnp.concatenate([first[:m], second[:m] + cross(gather_static(at.x, _of(f.points, of)), first[:m])], 1)
    turns, slides = first[m:], second[m:]
    slips = jnp.concatenate([turns + cross(gather_static(at.x, _of(f.points, on)), slides), slides], axis=1)
    frames = frame_twists(system, at.V)
    twist = gather_static(frames, _of(f.children, on)) - gather_static(frames, _of(f.parents, on))
    slip = jnp.sum(slips * twist, axis=1)
    speed = segment_sum_static(slip * slip, on, len(f.joints))
    grip = _grip(f, speed)
    friction = -gather_static(grip, on) * slip
    wrench = segment_sum_static(friction[:, None] * slips, on, len(f.joints))
    path = jnp.asarray(_paths(system.topology, f.children) - _paths(system.topology, f.parents), dtype)
    efforts = jnp.sum(wrench[:, None, :] * at.S[None], axis=2) * path
    # the axial force is that of the thread's normal and of its friction: n = F / cos - f tan
    thread = -segment_sum_static(friction, on, len(f.joints)) * sine / cosine
    return Rubbing(bears, wrench, efforts, slip, speed, grip, thread)


def _of(frames, surfaces):
    """Frames of the surfaces."""
    return np.asarray(frames)[surfaces]


def _in_world(f: JointFriction, at, surfaces, rows):
    """World components of the two vectors (k, 3) of rows (k, 6) in the axes of their surfaces."""
    basis = gather_static(f.basis.astype(rows.dtype), surfaces)
    R = gather_static(at.R, _of(f.axes, surfaces))
    both = rows.reshape(-1, 2, 1, 3)
    inner = jnp.sum(basis[:, None] * both, axis=3)
    both = jnp.sum(R[:, None] * inner[:, :, None, :], axis=3)
    return both[:, 0], both[:, 1]


def joint_axes(f: JointFriction, at, wrench):
    """Moments about the surfaces' points and forces (n, 3), in their axes, from world wrenches (n, 6)."""
    R = gather_static(at.R, f.axes) @ f.basis.astype(wrench.dtype)
    moment = wrench[:, :3] - cross(gather_static(at.x, f.points), wrench[:, 3:])
    return jnp.einsum("nji,nj->ni", R, moment), jnp.einsum("nji,nj->ni", R, wrench[:, 3:])


def _grip(f: JointFriction, speed):
    """Friction over load and slip (n,) from squared speeds (n,): mu tanh(s / v) (1 + bump) / s, smooth at rest."""
    square = speed / f.transition_speed**2
    small = square < 1e-4  # four terms are exact to rounding there
    root = jnp.sqrt(jnp.where(small, 1.0, square))
    series = 1.0 - square * (1.0 / 3.0 - square * (2.0 / 15.0 - square * (17.0 / 315.0)))
    along = jnp.where(small, series, jnp.tanh(root) / root) / f.transition_speed
    return f.mu * along * (1.0 + (f.static_ratio - 1.0) * jnp.exp(-square / _BUMP**2))


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
    f, top = system.friction, system.topology
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


def solve_friction(system: System, at: VelocityKinematics, rub: Rubbing, F, a, multipliers) -> FrictionSolution:
    """Loads of all surfaces, and the motion with their friction.

    Args:
        at: `closures.with_directions`; F (nodes, 6): wrenches of the force elements.
        a (1 + n, nv), multipliers (1 + n, rows): of the motion without friction, and of each surface's friction alone
            per unit load.
    """
    f, to, dtype = system.friction, carriers(system), a.dtype
    targets, top = node_targets(system), system.topology

    rows, none = surface_rows(f.kinds, dtype), jnp.zeros_like(a[0])

    def lack(a):
        return inverse_dynamics_loads(system, at, node_accelerations(top, at, a), a, targets).wrench

    still, moving = jax.vmap(lambda da: jax.jvp(lack, (none,), (da,)), out_axes=(None, 0))(a)
    first = np.eye(1, len(a), dtype=dtype)[0]
    parts = [moving + first[:, None, None] * (still - F)[None]]
    if system.closures:
        D = closures.directions(system, at)
        parts.append(jax.vmap(lambda y: jnp.concatenate(closures.wrenches(system, D, y)))(multipliers))
    # wrenches (loads, 1 + n, 6) of the joint of each component
    of = rows.surface_of_load
    parts = jnp.swapaxes(jnp.concatenate(parts, axis=1), 0, 1)
    maps = jnp.asarray(np.concatenate([to.lack, to.closures], axis=1)[of, : len(parts)], dtype)
    carried = few_columns(maps, parts.reshape(len(parts), -1)).reshape(len(of), -1, 6)
    loads = jnp.sum(rub.bears[:, None] * carried, axis=2)
    own = jnp.sum(rub.bears[:, None] * rub.wrench[None], axis=2) * to.friction[of].astype(dtype)
    thread = jnp.asarray(np.eye(len(f.joints))[of], dtype) * rub.thread[None]
    found = normal_loads(
        LoadMap.of(
            loads[:, 0],
            loads[:, 1:] + own + thread,
            f.preload,
            np.arange(rows.patch_of_load.max() + 1)[:, None] == rows.patch_of_load[None],
            np.arange(len(f.joints))[:, None] == rows.surface_of_patch[None],
        )
    )
    total = found.load + f.preload
    return FrictionSolution(
        a[0] + total @ a[1:],
        multipliers[0] + total @ multipliers[1:],
        jnp.zeros_like(multipliers[0]),
        rub,
        found,
        total,
        total[:, None] * rub.wrench,
        total[:, None] * rub.efforts,
        -total * rub.grip * rub.speed,
    )


def friction_of_motion(system: System, at: VelocityKinematics, F, need, gamma, solve: Callable) -> FrictionSolution:
    """Motion with friction, from `solve`: efforts (1 + n, nv) and rates of the rows (1 + n, rows) to accelerations
    and multipliers of the same shapes; need, gamma: of the motion without friction; F (nodes, 6): wrenches of force
    elements."""
    rub = rubbing(system, at)
    b = jnp.concatenate([need[None], rub.efforts])
    c = jnp.concatenate([gamma[None], jnp.zeros((len(rub.efforts), len(gamma)), gamma.dtype)])
    return solve_friction(system, at, rub, F, *solve(b, c))


def friction_loads(system: System, solution: FrictionSolution, owners) -> Loads:
    """Friction as loads beside those of force elements: of cut joints on `owners`, of the tree's on columns."""
    f, is_cut = system.friction, carriers(system).is_cut
    cut = jnp.where(is_cut[:, None], solution.wrench, 0.0)
    wrench = owners.collect((*f.children, *f.parents), jnp.concatenate([cut, -cut]))
    return Loads(wrench, jnp.sum(jnp.where(is_cut[:, None], 0.0, solution.efforts), axis=0))


def cut_friction(system: System, solution: FrictionSolution, names):
    """Wrenches (len(names), 6) of the friction of cut joints on their children, zero for all other joints."""
    f, is_cut = system.friction, carriers(system).is_cut
    place = np.zeros((len(names), len(f.joints)))
    for k in np.flatnonzero(is_cut):
        place[names.index(system.topology.joints[f.joints[k]].name), k] = 1.0
    # a product would spread what is not a number
    return segment_sum_static(solution.wrench, np.where(is_cut, place.argmax(0), len(names)), len(names))
