"""Reactions of every joint: subtree sums on trees, multipliers in loops, compliances where statics cannot decide.

Source: S1 (26)-(29); the wrench a joint carries is the momentum rate of all that hangs on it, less other loads.
"""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float

from ..checks import known, no_such
from ..errors import UnknownNameError
from ..kinematics import constraints
from ..kinematics.configuration import at_state, moving, node_accelerations
from ..kinematics.state import HasStates, State
from ..kinematics.tree import subtrees
from ..math.jit import jit
from ..math.linalg import relative, skew
from ..math.rows import over_rows, summed, take
from ..math.spatial import pack, world_inertia
from ..model.question import check_fits
from ..model.system import System
from .distribution import distributed
from .efforts import body_owner, efforts, gravity_wrench
from .elastic import needed_loads
from .newton_euler import accelerations, momentum_rates
from .sparse_saddle import constraint_rows

_BALANCED = {8: 1e-6, 4: 1e-2}  # of the largest load: what may be left over


class JointReaction(eqx.Module):
    """The wrench a joint transmits, with all that acts inside it (drives, joint springs).

    Attributes:
        force [N], moment [N m]: (..., 3), the moment about the origin of the joint's frame on that side.
        effort: (..., n) along the joint's freedoms [N or N m]: drive, motor and spring efforts.
        unique_force, unique_moment: (3,) bool in the joint's axes: whether statics alone determines the component.
    """

    force: Float[Array, "... 3"]
    moment: Float[Array, "... 3"]
    effort: Float[Array, "... n"]
    undetermined: tuple[bool, ...] = eqx.field(static=True)

    @property
    def unique_force(self) -> np.ndarray:
        return ~np.array(self.undetermined[:3])

    @property
    def unique_moment(self) -> np.ndarray:
        return ~np.array(self.undetermined[3:])


class Reactions(eqx.Module):
    """Reactions by joint or constraint name, `loads["main"].force`.

    Attributes:
        multipliers: (..., rows) efforts along the constraint rows; a drive's multiplier is its effort.
        residual: (...) largest unbalanced effort `M u_dot + bias - Q - A^T lambda` of the solve.
        ok: (...) whether they are those of an assembled state, finite, balance all loads but for 1e-6 of them, and
            belong to accelerations that keep the constraints as well (1e-2 in single precision).
        hidden: welds inside bodies that the builder split; found by name, not listed.
    """

    joints: dict
    multipliers: Float[Array, "... rows"]
    residual: Float[Array, "..."]
    ok: Bool[Array, "..."]
    hidden: tuple[str, ...] = eqx.field(static=True, default=())

    def __getitem__(self, name: str) -> JointReaction:
        if name not in self.joints:
            raise UnknownNameError(no_such("joint or constraint", name, self))
        return self.joints[name]

    def __iter__(self):
        return (name for name in self.joints if name not in self.hidden)

    def items(self) -> list[tuple[str, JointReaction]]:
        """Pairs of name and reaction."""
        return [(name, self.joints[name]) for name in self]


def body_rates(system: System, at, V_dot):
    """Momentum rates and inertias (bodies, 6), (bodies, 10) of single bodies, for twist rates V_dot (nodes, 6)."""
    top = system.topology
    own, node = slice(1, top.bodies.size + 1), np.asarray(top.body_node, int)
    upper = np.array([0, 1, 2, 4, 5, 8])
    inertia = system.inertia.reshape(-1, 9)[:, upper]
    J = pack(
        world_inertia(
            tuple(at.R[own].reshape(-1, 9).T), tuple(at.x[own].T), system.mass, tuple(system.com.T), tuple(inertia.T)
        )
    )
    pad = jnp.zeros((1, 6), V_dot.dtype)
    V, V_dot = (take(jnp.concatenate([v, pad]), node % (len(v) + 1)) for v in (at.V, V_dot))
    return momentum_rates(J, V, V_dot), J


def _on_nodes(topology, wrenches):
    """Wrenches of bodies (bodies, 6) on the nodes that carry them."""
    return summed(wrenches, np.asarray(topology.body_node, int) % (topology.nodes.size + 1), topology.nodes.size)


def _cut_wrenches(system, multipliers, known):
    """Wrench of all loop rows on every body (bodies, 6), and of every element on its frame B (elements, 6)."""
    n = system.topology.bodies.size
    if not system.closures:
        return jnp.zeros((n, 6), multipliers.dtype), jnp.zeros((0, 6), multipliers.dtype)
    wrenches = constraints.closure_wrenches(system, known, multipliers)
    return constraints.sum_on_carriers(system, wrenches, system.topology.frame_body, n), jnp.concatenate(wrenches)


def _elements(system):
    """(name, frames A and B) of every closing joint and two-frame constraint, in the order of their wrenches."""
    return [row for group in system.closures for row in zip(group.names, group.first, group.second, strict=True)]


def _joint_wrenches(system, S, rate, loads, multipliers, known):
    """World wrench on the child of every joint (joints, 6) about the origin, efforts (nv,), elements' wrenches."""
    top = system.topology
    cut, each = _cut_wrenches(system, multipliers, known)
    carried = subtrees(top.bodies, rate - loads - cut)
    sign = np.array([1.0 if top.joints[j].child == k else -1.0 for k, j in enumerate(top.body_joint)])
    body_of = {j: k for k, j in enumerate(top.body_joint)}
    source = body_of | {
        top.joint_index[name]: len(body_of) + i
        for i, (name, *_) in enumerate(_elements(system))
        if name in top.joint_index
    }
    known = jnp.concatenate([carried * jnp.asarray(sign, carried.dtype)[:, None], each])
    wrench = take(known, [source[j] for j in range(len(top.joints))])
    column_body = [body_of[j] for j in top.node_joint]
    return wrench, jnp.einsum("nk,nk->n", S, take(carried, column_body)), each


def _at_frames(wrench, R, x, axes, sign):
    """(forces, moments) (n, 3) about the points x, in world axes or those of R."""
    force, moment = wrench[:, 3:], wrench[:, :3] - jnp.einsum("nij,nj->ni", jax.vmap(skew)(x), wrench[:, 3:])
    if axes == "joint":
        force, moment = (jnp.einsum("nji,nj->ni", R, v) for v in (force, moment))
    return sign * force, sign * moment


def _all_wrenches(system, joints, elements):
    """Wrenches (carriers, 6) of the joints, then of the constraints that are no joints."""
    extra = [i for i, (name, *_) in enumerate(_elements(system)) if name not in system.topology.joint_index]
    return jnp.concatenate([joints, take(elements, extra)]) if extra else joints


def _reactions(system: System, state: State, frame: str, side: str, compliance, method: str) -> Reactions:
    top = system.topology
    at = moving(system, at_state(system, state), state.velocities)
    loads, Q, _ = efforts(system, at, body_owner(system))
    known, _ = directions = constraints.moving_directions(system, at)
    a, multipliers, gaps = accelerations(system, at, method, (_on_nodes(top, loads), Q), directions)
    V_dot = node_accelerations(top, at, a)
    rate, bodies = body_rates(system, at, V_dot)
    loads = loads + gravity_wrench(bodies, system.gravity)
    if system.elastic:
        needed = needed_loads(system, at, V_dot, a, body_owner(system))
        rate, Q = rate + needed.wrench, Q - needed.column
    wrench, effort, others = _joint_wrenches(system, at.S, rate, loads, multipliers, known)
    if top.analysis is not None and top.analysis.redundant:
        multipliers = distributed(system, at, _all_wrenches(system, wrench, others), multipliers, compliance, known)
        wrench, effort, others = _joint_wrenches(system, at.S, rate, loads, multipliers, known)
    gap = effort - Q - constraints.coordinate_efforts(system, at.psi, at.t, multipliers)
    named = _named(system, _all_wrenches(system, wrench, others), effort, at, frame, side)
    residual = jnp.max(jnp.abs(gap), initial=0.0)
    hidden = tuple(joint.name for joint in top.joints if joint.is_hidden)
    size = jnp.max(jnp.abs(multipliers), initial=0.0) + jnp.max(jnp.abs(wrench), initial=0.0)
    least = _BALANCED[residual.dtype.itemsize]
    rate = _loads_over_mass(system, _all_wrenches(system, wrench, others), effort)
    missed = _missed(system, constraint_rows(system, at, known), V_dot, a, gaps, rate)
    balanced = (residual <= least * (size + 1e-3)) & (missed <= least)  # false for NaN
    return Reactions(named, multipliers, residual, state.ok & balanced, hidden)


def _loads_over_mass(system, wrench, effort):
    """What the loads of the joints would do to the heaviest body [rad/s^2 and lengths/s^2]: at rest, where every
    acceleration is rounding, the rows' gaps are measured by it."""
    top, length = system.topology, system.length
    force = jnp.max(jnp.abs(wrench[:, 3:]), initial=0.0)
    force = force + jnp.max(jnp.abs(effort) / jnp.where(np.asarray(top.spins) > 0, length, 1.0), initial=0.0)
    heaviest = jnp.maximum(jnp.max(system.mass, initial=0.0), jnp.finfo(force.dtype).tiny)
    return (jnp.sqrt(jnp.sum(system.gravity**2)) + force / heaviest) / length


def _missed(system, rows, V_dot, a, gaps, rate):
    """The largest of the gaps (rows,) of the rows' accelerations, of `rate` and the largest that adds up in them."""
    if not system.has_constraints:
        return jnp.zeros_like(rows.at.t)
    return relative(rows.unit * gaps, rows.sizes(V_dot, a) + lax.stop_gradient(rate))


def _named(system, wrench, effort, at, frame, side):
    """`JointReaction` by name from the wrenches (carriers, 6): of joints and of two-frame constraints."""
    top, (sign, end) = system.topology, (1.0, 1) if side == "child" else (-1.0, 0)
    carriers = constraints.carriers(system)
    efforts = [effort[j.velocities] for j in top.joints] + [jnp.zeros(0)] * (len(carriers) - len(top.joints))
    marks = top.analysis.undetermined if top.analysis else [(False,) * 6] * len(carriers)
    own = [c[1 + end] for c in carriers]
    force, moment = _at_frames(wrench, take(at.R, own), take(at.x, own), frame, sign)
    return {name: JointReaction(force[i], moment[i], efforts[i], marks[i]) for i, (name, *_) in enumerate(carriers)}


@jit
def _reactions_jit(system, states, frame, side, batched, compliance, method):
    one = lambda s: _reactions(system, s, frame, side, compliance, method)  # noqa: E731
    return over_rows(one, states) if batched else one(states)


def _compliance(name, value, dtype):
    """The compliances (6,) of one joint; ValueError where they are known and negative, not finite, or not six."""
    value = jnp.asarray(value, dtype)
    if value.shape not in ((), (6,)):
        raise ValueError(f"compliance of {name!r} must be one number or six, got shape {value.shape}")
    if known(value) and not np.all(np.isfinite(value) & (np.asarray(value) >= 0.0)):
        raise ValueError(f"compliance of {name!r} must be finite and not negative, got {np.asarray(value)}")
    return value


def reactions(
    system: System,
    motion: State | HasStates,
    frame: str = "world",
    side: str = "child",
    compliance: Mapping | None = None,
    method: str = "dense",
) -> Reactions:
    """Reactions of all joints at a state or along a motion.

    Args:
        motion: a State, a Motion, or a State with one leading axis.
        frame: "world" axes, or "joint": those of the joint's frame on that side.
        side: "child": the wrench the parent applies on the child; "parent": the opposite one on the parent.
        compliance: name -> (6,), of joints and two-frame constraints for force x, y, z [m/N] and moment x, y, z
            [rad/(N m)] in their own axes on the child's side; default 1 and 1 / length^2 for those not named.
        method: how loops and drives are solved, with equal results: "dense" in the tree's velocities, or
            "block-sparse" on the graph of bodies, linear in their number.

    Returns: Reactions by joint name, and of two-frame constraints by theirs (on frame B, or A for the parent side).

    Redundant loops: components that statics cannot determine have `unique_force` or `unique_moment` False.  They are
    shared so that the complementary energy `1/2 sum w.C w` of the compliances is least; by default that is the least
    norm, moments over the system's characteristic length `system.length`.

    Raises: ValueError for an unknown frame, side, method or name.  Source: S1 (26)-(29).
    """
    if frame not in ("world", "joint") or side not in ("child", "parent"):
        raise ValueError(f"frame must be 'world' or 'joint' and side 'child' or 'parent', got {frame!r}, {side!r}")
    if method not in ("dense", "block-sparse"):
        raise ValueError(f"method must be 'dense' or 'block-sparse', got {method!r}")
    states = motion if isinstance(motion, State) else motion.states
    check_fits(system, states)
    compliance = {} if compliance is None else dict(compliance)
    names = [name for name, *_ in constraints.carriers(system)]
    for name in compliance:
        if name not in names:
            raise UnknownNameError(f"compliance: {no_such('joint or constraint', name, names)}")
    compliance = {name: _compliance(name, c, states.coordinates.dtype) for name, c in compliance.items()}
    return _reactions_jit(system, states, frame, side, states.coordinates.ndim == 2, compliance, method)
