"""Factor and solves of the frontal method: `H = M + A^T C^-1 A` of a tree with loops, linear in its nodes.

All twists are about the nodes' own points, all angles in units of 1 / length.  One step of the factor is the step of
the articulated-body algorithm on a front of open nodes: the closures that end on the node join as springs, its column
is eliminated by a rank-one update, and its slot merges into that of its parent.  A solve is two scans: wrenches up
the tree, twists down.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..math._spatial import cross
from ..runtime import fusion_barrier, small_call
from ._frontal_plan import FrontalPlan


class LocalKinematics(NamedTuple):
    """Kinematics and inertias about the nodes' points; n nodes, e closures of six rows or fewer.

    Attributes:
        S (n, 6): joint twists; offset (n, 3): from the parent's point, zero on the ground.
        J (n, 6, 6): inertias; held (n,): what is added to the diagonal of each column.
        directions_a, directions_b (e, 6, 6): of the rows by the twists of the nodes at both ends; zero where there is
            no row, or on the ground.
        stiffness (e, 6): of the rows, 1 / C.
    """

    S: Array
    offset: Array
    J: Array
    held: Array
    directions_a: Array
    directions_b: Array
    stiffness: Array


class FrontalFactor(NamedTuple):
    """Factor of H, in the order of the plan; w slots.

    Attributes:
        column (n, w, 6): wrenches on the front per unit effort of the node's joint.
        mobility (n,): inverse of the inertia that its joint sees; S (n, 6), offset (n, 3) as in `LocalKinematics`.
    """

    column: Array
    mobility: Array
    S: Array
    offset: Array


def frontal_factor(plan: FrontalPlan, local: LocalKinematics, eliminated) -> FrontalFactor:
    """The factor of H from what `eliminate` returned."""
    own, parent = (jnp.asarray(x, local.S.dtype) for x in (plan.own, plan.parent))
    S, offset = local.S[plan.order], local.offset[plan.order]
    U, mobility = eliminated
    on_own = jnp.sum(own[:, :, None] * U, axis=1)
    column = (1.0 - own)[:, :, None] * U + parent[:, :, None] * shift_wrenches(offset, on_own)[:, None]
    return FrontalFactor(column, mobility, S, offset)


def eliminate(plan: FrontalPlan, local: LocalKinematics):
    """(U (n, w, 6), mobility (n,)) of every step: `U = H[:, own] S` and the inverse of `S . U[own]`."""
    own, parent = (jnp.asarray(x, local.S.dtype) for x in (plan.own, plan.parent))
    S, offset = local.S[plan.order], local.offset[plan.order]
    stiffness = local.stiffness[:, :, None]
    a, b = local.directions_a, local.directions_b
    none = jnp.zeros((1, 6, 6), S.dtype)
    transposed = lambda x: jnp.swapaxes(x, 1, 2)
    pairs = transposed(a) @ (stiffness * a), transposed(b) @ (stiffness * b), -transposed(a) @ (stiffness * b)
    on_a, on_b, between = (jnp.concatenate([x, none]) for x in pairs)
    J, far, cross_terms = local.J[plan.order], [], []
    for e, is_b in zip(plan.closure.T, plan.is_end_b.T[:, :, None, None], strict=True):
        J = J + jnp.where(is_b, on_b[e], on_a[e])
        far.append(jnp.where(is_b, on_a[e], on_b[e]))
        cross_terms.append(jnp.where(is_b, transposed(between)[e], between[e]))
    hot = tuple(jnp.asarray(x, S.dtype) for x in np.moveaxis(plan.far, 1, 0))
    rows = (S, offset, J, local.held[plan.order], own, parent, tuple(far), tuple(cross_terms), hot)

    def step(H, row):
        s, r, J, held, own, parent, far, cross_terms, hot = row
        at_own = jnp.sum(own[:, None, None, None] * H, axis=0) + J[:, None, :] * own[None, :, None]
        for K, slot in zip(cross_terms, hot, strict=True):
            at_own = at_own + K[:, None, :] * slot[None, :, None]
        U = fusion_barrier(jnp.sum(at_own * s[:, None, None], axis=0))
        U_own = jnp.sum(own[:, None] * U, axis=0)
        mobility = fusion_barrier(1.0 / (jnp.sum(U_own * s) + held))
        left = at_own - (mobility * U_own)[:, None, None] * U[None]
        left = _shift_wrench(r, left)
        corner = _shift_wrench(r, jnp.sum(own[None, :, None] * left, axis=1).T)
        stays = 1.0 - own
        left = fusion_barrier(left * stays[None, :, None])
        H = _outer(stays, stays) * (H - (mobility * U)[:, :, None, None] * U[None, None])
        H = H + parent[:, None, None, None] * left[None]
        H = H + parent[None, None, :, None] * left.transpose(1, 2, 0)[:, :, None, :]
        H = H + _outer(parent, parent) * corner[None, :, None, :]
        for K, slot in zip(far, hot, strict=True):
            H = H + _outer(slot, slot) * K[None, :, None, :]
        return H, (U, mobility)

    start = jnp.zeros((plan.width, 6, plan.width, 6), S.dtype)
    return small_call(lambda rows: lax.scan(step, start, rows)[1])(rows)


def _outer(a, b):
    return a[:, None, None, None] * b[None, None, :, None]


def frontal_solve(plan: FrontalPlan, factor: FrontalFactor, efforts, wrenches):
    """Velocities (n,) and twists (n, 6) of `H u = efforts + J^T wrenches`, in the order of the plan.

    Args: efforts (n,) on the columns; wrenches (n, 6) on the nodes, about their points.
    """
    own, parent = (jnp.asarray(x, efforts.dtype) for x in (plan.own, plan.parent))
    column, mobility, S, offset = factor
    first = mobility * (efforts + jnp.sum(S * wrenches, axis=1))
    pull = mobility[:, None] * S

    def up(front, x):
        own, parent, column, pull, r, first, given = x
        on_own = jnp.sum(own[:, None] * front, axis=0)
        rate = first + jnp.sum(pull * on_own)
        moved = _shift_wrench(r, on_own) + given
        return (1.0 - own)[:, None] * front + parent[:, None] * moved[None] - column * rate, rate

    zero = jnp.zeros(column.shape[1:], efforts.dtype)
    _, rate = lax.scan(up, zero, (own, parent, column, pull, offset, first, shift_wrenches(offset, wrenches)))

    def down(front, x):
        own, parent, column, S, r, mobility, rate = x
        velocity = rate - mobility * jnp.sum(column * front)
        above = jnp.sum(parent[:, None] * front, axis=0)
        twist = jnp.concatenate([above[:3], above[3:] + _cross(above[:3], r)]) + S * velocity
        return (1.0 - own)[:, None] * front + own[:, None] * twist[None], (velocity, twist)

    return lax.scan(down, zero, (own, parent, column, S, offset, mobility, rate), reverse=True)[1]


def shift_wrenches(offset, wrenches):
    """Wrenches (n, 6) about the parents' points."""
    return jnp.concatenate([wrenches[:, :3] + cross(offset, wrenches[:, 3:]), wrenches[:, 3:]], axis=1)


def _cross(a, b):
    return jnp.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _shift_wrench(r, wrench):
    """A wrench (6, ...) about the parent's point."""
    m, f = wrench[:3], wrench[3:]
    moment = [r[1] * f[2] - r[2] * f[1], r[2] * f[0] - r[0] * f[2], r[0] * f[1] - r[1] * f[0]]
    return jnp.concatenate([m + jnp.stack(moment), f])
