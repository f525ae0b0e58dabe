"""The saddle system of a mechanism by the frontal method: work linear in its bodies, for trees whose loops are short.

`m M a + diag(w) a + A^T y = b`, `A a = c`, as `math.linalg.saddle_solve` solves it: rows eliminated with a small
compliance C, then proximal rounds.  With `H = m M + diag(w) + A^T C^-1 A` each round solves

    H da = b - m M a - w a - A^T (y - C^-1 (c - A a)),   a += da,   y += C^-1 (A a - c),

with the right-hand side on the nodes as wrenches, so that a round is one pass up the tree and one down.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..kinematics import _constraints as constraints
from ..kinematics._configuration import Configuration
from ..kinematics._node_parameters import NodeParameters, positions
from ..kinematics._tree import subtrees
from ..math import _components as components
from ..math._spatial import cross, dot, momentum, world_inertia
from ..model._system import System
from ..runtime import gather_static, small_call
from ._front_factor import FrontFactor, LocalKinematics, front_factor, solve_front
from ._front_plan import FrontPlan, front_plan
from ._saddle_operator import apply_mass, largest_of_element, loop_mobility, row_kinds, stop_gradients

#: Compliance C of the rows, relative to their mobility (double, single).
PROXIMAL_COMPLIANCE = {8: 3e-9, 4: 1e-5}
#: Proximal rounds.
ROUNDS = {8: 6, 4: 8}
_UPPER = np.zeros((6, 6), int)
for _k, (_i, _j) in enumerate(components.UPPER):
    _UPPER[_i, _j] = _UPPER[_j, _i] = _k


class FrontalMatrix(NamedTuple):
    """A saddle system at a configuration, factored; rows in their units, e closures of six rows or fewer.

    Attributes:
        plan, factor, local: of the front.
        compliance (e, 6), drive_compliance (d,): C of the rows of closures and drives.
        drive_unit (d,): unit of the rows of drives; columns (d,) that they prescribe.
        weight (n,): what is added to the diagonal of M.
    """

    plan: FrontPlan
    factor: FrontFactor
    local: LocalKinematics
    drive_stiffness: Array
    drive_unit: Array
    columns: np.ndarray
    weight: Array


def frontal_saddle(system: System, at: Configuration, rows, b, c, mass=1.0, weight=None):
    """Accelerations (nv,) and multipliers y (rows,) for b (nv,), c (rows,).

    Args:
        rows: `constraint_operator`; mass: (), factor of the mass matrix; weight: (nv,), default zero.
    """
    n = b.shape[0]
    weight = jnp.zeros(n, b.dtype) if weight is None else weight
    matrix = _factored(*stop_gradients((system, at, rows, mass, weight)))
    shapes = [D.shape[:2] for D in rows.directions]

    def whole(z):
        a, y = z[:n], z[n:]
        momenta = weight * a + rows.efforts(y)
        if at.J is not None:
            momenta = momenta + mass * apply_mass(system, at, a)
        return jnp.concatenate([momenta, rows.rates(a)])

    def solve(_, right):
        a, y, y_drive = _proximal_rounds(matrix, right[:n], *_by_closure(shapes, right[n:]))
        return jnp.concatenate([a, _by_row(shapes, y), y_drive])

    z = lax.custom_linear_solve(whole, jnp.concatenate([b, rows.unit * c]), solve, solve, symmetric=True)
    return z[:n], rows.unit * z[n:]


def _proximal_rounds(matrix, b, c, c_drive):
    """(a (n,), y (e, 6), y of the drives (d,)) of the saddle system, after a fixed number of rounds.

    Fixed, since a number that depends on the state would make the solution jump where the rounds have not converged,
    beside singular poses; an integrator then shortens its steps.
    """
    plan, local, dtype = matrix.plan, matrix.local, b.dtype
    ends, none = np.minimum(plan.ends, len(b) - 1), jnp.zeros((1, 6), dtype)  # directions on the ground are zero

    def closure_rates(v):
        a, b = (gather_static(v, end)[:, None] for end in ends.T)
        return jnp.sum(local.directions_b * b - local.directions_a * a, axis=2)

    def on_nodes(y):
        """Wrenches (n, 6) of multipliers y (e, 6)."""
        a, b = (jnp.sum(D * y[:, :, None], axis=1) for D in (-local.directions_a, local.directions_b))
        both = jnp.concatenate([jnp.stack([a, b], axis=1).reshape(-1, 6), none])
        return sum((both[touching] for touching in plan.touching.T), jnp.zeros((len(plan.order), 6), dtype))

    def all_rounds(start):
        b, c, c_drive = start

        def one_round(_, carry):
            a, v, y, y_drive = carry
            gap = c - closure_rates(v)
            gap_drive = c_drive - matrix.drive_unit * a[matrix.columns]
            wrenches = -jnp.sum(local.J * v[:, None], axis=2) - on_nodes(y - local.stiffness * gap)
            efforts = b - matrix.weight * a
            if len(matrix.columns):
                push = matrix.drive_unit * (y_drive - matrix.drive_stiffness * gap_drive)
                efforts = efforts.at[matrix.columns].add(-push)
            da, dv = solve_front(plan, matrix.factor, efforts[plan.order], wrenches[plan.order])
            da, dv = da[plan.step], dv[plan.step]
            y = y + local.stiffness * (closure_rates(dv) - gap)
            y_drive = y_drive + matrix.drive_stiffness * (matrix.drive_unit * da[matrix.columns] - gap_drive)
            return a + da, v + dv, y, y_drive

        zero = jnp.zeros_like(b), jnp.zeros((len(b), 6), dtype), jnp.zeros_like(c), jnp.zeros_like(c_drive)
        a, _, y, y_drive = lax.fori_loop(0, ROUNDS[dtype.itemsize], one_round, zero)
        return a, y, y_drive

    return small_call(all_rounds)((b, c, c_drive))


def _factored(system, at, rows, mass, weight):
    top, kinds, dtype = system.topology, row_kinds(system), at.psi.dtype
    length = system.length.astype(dtype)
    own, lent, J = weight, 0.0, jnp.zeros((top.num_velocities, 6, 6), dtype)
    if at.J is not None:
        J = mass * _own_inertias(at, length)
        own = own + mass * dot(at.S, momentum(subtrees(top.nodes, at.J), at.S))
        # a node without inertia may be held by its rows alone; the factor lends it some, the rounds take it back
        lent = 1e-14 * mass * jnp.sum(at.J[:, 0]) / top.num_velocities
    massless = own <= 1e-9 * jnp.max(own, initial=1e-30)
    mobility = jnp.where(massless, 0.0, 1.0 / jnp.where(massless, 1.0, own))
    sizes = loop_mobility(system, at, rows, mobility)
    C = PROXIMAL_COMPLIANCE[dtype.itemsize] * largest_of_element(sizes, constraints.row_scale(system).block)
    return _matrix(system, at, rows, C, kinds, length, J, weight, lent)


def _matrix(system, at, rows, C, kinds, length, J, weight, lent):
    plan, shapes = front_plan(system), [D.shape[:2] for D in rows.directions]
    stiffness, drive_stiffness = _by_closure(shapes, 1.0 / C)
    unit = _by_closure(shapes, rows.unit)[0]
    local = _local(plan, system, at, rows, unit, length, J, stiffness)
    drive_unit = rows.unit[kinds.drives]
    held = weight.at[kinds.columns].add(drive_unit**2 * drive_stiffness)
    lending = local._replace(J=J + lent * np.eye(6, dtype=J.dtype)[None], held=held)
    factor = front_factor(plan, lending)
    return FrontalMatrix(plan, factor, local, drive_stiffness, drive_unit, kinds.columns, weight)


def _local(plan, system, at, rows, unit, length, J, stiffness):
    nodes = system.topology.nodes
    x = jnp.concatenate([positions(at.W), jnp.zeros((1, 3), at.W.dtype)])
    parent = nodes.parent_or_size
    offset = (x[:-1] - x[parent]) / length
    offset = jnp.where((parent == nodes.size)[:, None], 0.0, offset)
    spin, speed = at.S[:, :3], at.S[:, 3:] - cross(x[:-1], at.S[:, :3])
    D = [jnp.pad(d, ((0, 0), (0, 6 - d.shape[1]), (0, 0))) for d in rows.directions]
    D = jnp.concatenate([*D, jnp.zeros((0, 6, 6), x.dtype)]) * unit[:, :, None]

    def about(node):
        moment = D[:, :, :3] - jnp.cross(x[node][:, None], D[:, :, 3:])
        there = jnp.concatenate([moment / length, D[:, :, 3:]], axis=2)
        return there * (node < nodes.size)[:, None, None]

    S = jnp.concatenate([spin * length, speed], axis=1)
    return LocalKinematics(S, offset, J, jnp.zeros_like(S[:, 0]), *map(about, plan.ends.T), stiffness)


def _own_inertias(at, length):
    """Inertias (n, 6, 6) of the nodes about their own points, angles in units of 1 / length."""
    parameters = NodeParameters(at.P)
    about = jnp.concatenate([at.W[:, :9], jnp.zeros_like(at.W[:, 9:])], axis=1)
    J = world_inertia(about, parameters.mass, parameters.com, parameters.inertia)
    full = components.pack(components.symmetric_matrix(components.unpack(J)))[:, _UPPER]
    unit = jnp.concatenate([jnp.full(3, 1.0 / length), jnp.ones(3)]).astype(J.dtype)
    return full * (unit[:, None] * unit[None])[None]


def _by_closure(shapes, x):
    """Numbers of rows: those of closures (e, 6), zero where there is none, and those of all further rows."""
    parts, first = [jnp.zeros((0, 6), x.dtype)], 0
    for e, k in shapes:
        parts.append(jnp.pad(x[first : first + e * k].reshape(e, k), ((0, 0), (0, 6 - k))))
        first += e * k
    return jnp.concatenate(parts), x[first:]


def _by_row(shapes, x):
    """Numbers (e, 6) of closures as numbers of their rows."""
    parts, first = [jnp.zeros(0, x.dtype)], 0
    for e, k in shapes:
        parts.append(x[first : first + e, :k].reshape(-1))
        first += e
    return jnp.concatenate(parts)
