"""The saddle system of a mechanism by the frontal method: work linear in its bodies, for trees whose loops are short.

`m M a + diag(w) a + A^T y = b`, `A a = c`, as `math.linalg.saddle_solve` solves it: rows eliminated with a small
compliance C, then proximal rounds.  With `H = m M + diag(w) + A^T C^-1 A` each round solves

    H da = b - m M a - w a - A^T (y - C^-1 (c - A a)),   a += da,   y += C^-1 (A a - c),

with the right-hand side on the nodes as wrenches, so that a round is one pass up the tree and one down.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..kinematics import _tree as tree
from ..kinematics._configuration import Configuration
from ..kinematics._node_parameters import NodeParameters, positions
from ..math import _components as components
from ..math._linalg import conjugate_rounds, relative
from ..math._spatial import cross, dot, momentum, world_inertia
from ..math._spd import spd_inverse
from ..model._system import System
from ..runtime import chunked_vmap, gather_static, small_call
from . import _constraints as constraints
from ._frontal_factor import FrontalFactor, LocalKinematics, eliminate, frontal_factor, frontal_solve
from ._frontal_plan import FrontalPlan, frontal_plan
from ._saddle_operator import (
    ConstraintOperator,
    largest_of_element,
    loop_entries,
    loop_mobility,
    row_kinds,
    stop_gradients,
)

#: Compliance C of the rows, relative to their mobility (double, single).  At a given state the smallest one that the
#: factor bears: accelerations of a row of ten four-bars err 3e-13 at 1e-3 rad from its singular pose, 7e-8 at 1e-4
#: (3e-9: 7e-8 and 0.07).  Less leaves less digits to loads that statics does not determine.
PROXIMAL_COMPLIANCE = {8: 3e-11, 4: 1e-5}
#: The same within motions.  Beside a singular pose their coordinates, which err by the tolerance, decide which way
#: the rows lead on; there C must hide rows smaller than that.  Angle of a row of forty after 10 s and twelve singular
#: poses, at tolerances of 1e-10 and 1e-11: 1e-7 and 9e-8 with C = 1e-6, 1e-8 and 5e-8 with 1e-7, 7e-9 and 1e-6 with
#: 3e-8 in 780 to 2500 steps; the dense solver 4e-9 in 3000 to 5500 steps.
MOTION_COMPLIANCE = {8: 1e-7, 4: 1e-5}
#: Least compliance of rows that may read any column: taking them in by a border loses 1e-16 / C of the solution.
BORDER_COMPLIANCE = {8: 1e-7, 4: 1e-4}
#: Proximal rounds.
ROUNDS = {8: 6, 4: 8}
#: Inertia lent to every node, relative to the mean mass.
LENT_INERTIA = {8: 1e-14, 4: 1e-8}
#: Share of a pivot that may be rounding before C grows by `SOFTENING`, at most to `SOFTEST` times its size.
LOST_DIGITS = {8: 1e-2, 4: 0.5}
SOFTENING, SOFTEST = 1e3, 1e6
_UPPER = np.zeros((6, 6), int)
for _k, (_i, _j) in enumerate(components.UPPER):
    _UPPER[_i, _j] = _UPPER[_j, _i] = _k


class Border(NamedTuple):
    """Rows that may read any column, k of them: couplers and the user's; they should be few.

    Attributes:
        rows B (k, n); velocities (k, n) and twists (k, n, 6) of `H^-1 B^T`, in the order of the nodes.
        middle (k, k): inverse of `C + B H^-1 B^T`; stiffness (k,): 1 / C.
    """

    rows: Array
    velocities: Array
    twists: Array
    middle: Array
    stiffness: Array


class FrontalMatrix(NamedTuple):
    """A saddle system at a configuration, factored; rows in their units.

    Attributes:
        plan, factor, local: of the front.
        columns (d,): that drives prescribe; drive_unit, drive_stiffness (d,): unit and 1 / C of their rows.
        border: all other rows; weight (n,): what is added to the diagonal of M.
    """

    plan: FrontalPlan | None
    factor: FrontalFactor
    local: LocalKinematics
    columns: np.ndarray | None
    drive_unit: Array
    drive_stiffness: Array
    border: Border
    weight: Array


class Multipliers(NamedTuple):
    """Numbers of the rows: closures (e, 6), zero where an element has fewer rows; drives (d,); others (k,)."""

    closures: Array
    drives: Array
    others: Array


def frontal_saddle(
    system: System,
    at: Configuration,
    rows: ConstraintOperator,
    b,
    c,
    mass=1.0,
    weight=None,
    compliance=PROXIMAL_COMPLIANCE,
    fading: bool = False,
):
    """Accelerations (nv,) and multipliers y (rows,) for b (nv,), c (rows,).

    Args:
        mass: (), factor m of the mass matrix; weight: w (nv,), default zero.
        compliance: of the rows, by the size of a number [bytes]; fading: rows that nearly vanish are satisfied too.

    Source: S2 (28)-(29), (40) solved for accelerations.
    """
    n = b.shape[0]
    weight = jnp.zeros(n, b.dtype) if weight is None else weight
    matrix = _factored(*stop_gradients((system, at, rows, mass, weight, compliance[b.dtype.itemsize])))

    def whole(z):
        a, y = z[:n], z[n:]
        momenta = weight * a + rows.efforts(y)
        if at.J is not None:
            momenta = momenta + mass * tree.apply_mass(system.topology.nodes, at.S, at.J, a)
        return jnp.concatenate([momenta, rows.rates(a)])

    def rounds(right):
        a, y = _proximal_rounds(matrix, right[:n], _by_kind(system, rows, right[n:]))
        return jnp.concatenate([a, _by_row(system, rows, y)])

    def solve(_, right):
        gap = lambda left, z: relative(jnp.abs(left), jnp.abs(right) + jnp.abs(z))
        return conjugate_rounds(right, rounds, whole, gap) if fading else rounds(right)

    z = lax.custom_linear_solve(whole, jnp.concatenate([b, rows.unit * c]), solve, solve, symmetric=True)
    return z[:n], rows.unit * z[n:]


def _proximal_rounds(matrix: FrontalMatrix, b, c: Multipliers):
    """(a (n,), y) of the saddle system, after a fixed number of rounds.

    Fixed, since a number that depends on the state would make the solution jump where the rounds have not converged,
    beside singular poses; an integrator then shortens its steps.
    """
    known = matrix.plan, matrix.columns

    def all_rounds(matrix, b, c):
        matrix = matrix._replace(plan=known[0], columns=known[1])
        stiffness = Multipliers(matrix.local.stiffness, matrix.drive_stiffness, matrix.border.stiffness)

        def one_round(_, carry):
            a, v, y = carry
            gap = jax.tree.map(jnp.subtract, c, _rates(matrix, a, v))
            push = jax.tree.map(lambda y, k, gap: y - k * gap, y, stiffness, gap)
            da, dv = _solve(matrix, *_left_over(matrix, b, a, v, push))
            y = jax.tree.map(lambda push, k, rate: push + k * rate, push, stiffness, _rates(matrix, da, dv))
            return a + da, v + dv, y

        zero = jnp.zeros_like(b), jnp.zeros((len(b), 6), b.dtype), jax.tree.map(jnp.zeros_like, c)
        a, _, y = lax.fori_loop(0, ROUNDS[b.dtype.itemsize], one_round, zero)
        return a, y

    # a batch of factors is too large for the cache: all rounds of a few of them before those of the next
    return chunked_vmap(lambda *given: small_call(lambda x: all_rounds(*x))(given))(
        matrix._replace(plan=None, columns=None), b, c
    )


def _rates(matrix, a, v):
    """Rates of the rows for velocities a (n,) and twists v (n, 6) of the nodes."""
    ends = np.minimum(matrix.plan.ends, len(a) - 1)  # directions on the ground are zero
    first, second = (gather_static(v, end)[:, None] for end in ends.T)
    closures = jnp.sum(matrix.local.directions_b * second - matrix.local.directions_a * first, axis=2)
    return Multipliers(closures, matrix.drive_unit * a[matrix.columns], matrix.border.rows @ a)


def _left_over(matrix, b, a, v, y):
    """`b - m M a - w a - A^T y` as efforts (n,) on the columns and wrenches (n, 6) on the nodes."""
    local, plan = matrix.local, matrix.plan
    first, second = (jnp.sum(D * y.closures[:, :, None], axis=1) for D in (-local.directions_a, local.directions_b))
    both = jnp.concatenate([jnp.stack([first, second], axis=1).reshape(-1, 6), jnp.zeros((1, 6), b.dtype)])
    wrenches = -jnp.sum(local.J * v[:, None], axis=2) - sum(both[touching] for touching in plan.touching.T)
    efforts = b - matrix.weight * a - y.others @ matrix.border.rows
    return efforts.at[matrix.columns].add(-matrix.drive_unit * y.drives), wrenches


def _solve(matrix, efforts, wrenches):
    """Velocities (n,) and twists (n, 6) of `(H + B^T C^-1 B) u = efforts + J^T wrenches`."""
    a, v = _on_nodes(matrix.plan, matrix.factor, efforts, wrenches)
    border = matrix.border
    if len(border.rows):
        taken = border.middle @ (border.rows @ a)
        a, v = a - taken @ border.velocities, v - jnp.tensordot(taken, border.twists, 1)
    return a, v


def _on_nodes(plan, factor, efforts, wrenches):
    """`frontal_solve` in the order of the nodes."""
    a, v = frontal_solve(plan, factor, efforts[plan.order], wrenches[plan.order])
    return a[plan.step], v[plan.step]


def frontal_damped_solver(system: System, at: Configuration, rows: ConstraintOperator, damping):
    """Function that solves with `diag(damping) + A^T A` for right-hand sides (nv,), in one pass; no derivative."""
    system, at, rows, damping = stop_gradients((system, at, rows, damping))
    one = jnp.ones(system.topology.num_rows, damping.dtype)
    still = jnp.zeros((len(damping), 6, 6), damping.dtype)
    matrix = _with_factor(system, at, rows, damping, still, still[0], damping, one, softens=False)
    return lambda b: _solve(matrix, b, still[:, 0])[0]


def _factored(system, at, rows, mass, weight, compliance):
    top, dtype = system.topology, at.psi.dtype
    own, lent, J = weight, jnp.zeros((), dtype), jnp.zeros((top.num_velocities, 6, 6), dtype)
    if at.J is not None:
        J = mass * _own_inertias(at, system.length.astype(dtype))
        own = own + mass * dot(at.S, momentum(tree.subtrees(top.nodes, at.J), at.S))
        # a node without inertia may be held by its rows alone; the factor lends it some, the rounds take it back
        lent = LENT_INERTIA[dtype.itemsize] * mass * jnp.sum(at.J[:, 0]) / top.num_velocities
    C = _compliances(system, at, rows, own, compliance)
    return _with_factor(system, at, rows, weight, J, lent * np.eye(6, dtype=dtype), own, C)


def _compliances(system, at, rows, own, compliance):
    """Compliances C (rows,): a share of the mobility of the rows, as inertias `own` (nv,) of the columns give it."""
    massless, kinds = own <= 1e-9 * jnp.max(own, initial=1e-30), row_kinds(system)
    mobility = jnp.where(massless, 0.0, 1.0 / jnp.where(massless, 1.0, own))
    sizes = loop_mobility(system, loop_entries(system, at), rows, mobility)
    sizes = sizes.at[kinds.others].set(_other_rows(system, rows) ** 2 @ mobility)
    share = np.full(system.topology.num_rows, compliance)
    share[kinds.others] = max(compliance, BORDER_COMPLIANCE[own.dtype.itemsize])
    return jnp.asarray(share, own.dtype) * largest_of_element(sizes, constraints.row_scale(system).block, mobility)


def _other_rows(system, rows):
    """Rows (k, nv) that may read any column."""
    others = row_kinds(system).others
    return jax.vmap(rows.efforts)(jnp.asarray(np.eye(system.topology.num_rows)[others], rows.unit.dtype))


def _with_factor(system, at, rows, weight, J, lent, own, C, softens=True):
    """The system with its factor, whose rows soften where it would lose too many digits."""
    kinds, plan, B = row_kinds(system), frontal_plan(system), _other_rows(system, rows)
    stiffness, unit = (_by_kind(system, rows, x) for x in (1.0 / C, rows.unit))
    if rows.free is not None:
        unit = unit._replace(drives=unit.drives * rows.free[kinds.columns])
    local = _local(system, at, rows, unit.closures, system.length.astype(J.dtype), J, stiffness.closures)
    on_drives = jnp.zeros_like(own).at[kinds.columns].add(unit.drives**2 * stiffness.drives)
    held = local._replace(J=J + lent[None], held=weight)
    if softens:
        entries = loop_entries(system, at)
        on_columns = _on_columns(entries, rows.unit**2 / C, len(own)) + on_drives
        softening, eliminated = chunked_vmap(partial(_eliminated, plan))(held, own, on_drives, on_columns)
    else:
        softening, eliminated = 1.0, eliminate(plan, held._replace(held=weight + on_drives))
    stiffness = jax.tree.map(lambda k: k / softening, stiffness)
    factor = frontal_factor(plan, local, eliminated)
    border = _border(plan, factor, B, stiffness.others)
    local = local._replace(stiffness=stiffness.closures)
    return FrontalMatrix(plan, factor, local, kinds.columns, unit.drives, stiffness.drives, border, weight)


def _on_columns(entries, stiffness, n):
    """Part of the closures' rows in the diagonal of H (n,)."""
    return jax.ops.segment_sum(entries.value**2 * stiffness[entries.row], jnp.asarray(entries.column), n)


def _eliminated(plan, local, own, on_drives, on_columns):
    """(softening, what `eliminate` returns): C grows by the softening while the factor loses too many digits.

    A pivot is what the columns before it leave of the diagonal of H, `own + on_columns / softening`: the less, the
    more digits are lost.  That is so where one link is far smaller or lighter than others.
    """
    most = LOST_DIGITS[own.dtype.itemsize] / np.finfo(own.dtype).eps

    def loses(carry):
        softening, (_, mobility) = carry
        ratio = (own + on_columns / softening)[plan.order] * mobility
        return (softening < SOFTEST) & ~jnp.all((ratio > 0.0) & (ratio <= most))

    def attempt(carry):
        softening = SOFTENING * carry[0]
        softer = local._replace(held=local.held + on_drives / softening, stiffness=local.stiffness / softening)
        return softening, eliminate(plan, softer)

    n = len(own)
    nothing = jnp.zeros((n, plan.width, 6), own.dtype), jnp.full(n, jnp.inf, own.dtype)
    return lax.while_loop(loses, attempt, (jnp.asarray(1.0 / SOFTENING, own.dtype), nothing))


def _border(plan, factor, B, stiffness):
    still = jnp.zeros((B.shape[1], 6), B.dtype)
    velocities, twists = jax.vmap(lambda b: _on_nodes(plan, factor, b, still))(B)
    middle = spd_inverse(jnp.diag(1.0 / stiffness) + B @ velocities.T) if len(B) else B @ B.T
    return Border(B, velocities, twists, middle, stiffness)


def _local(system, at, rows, unit, length, J, stiffness):
    plan, nodes = frontal_plan(system), system.topology.nodes
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
        return there * jnp.asarray(node < nodes.size, there.dtype)[:, None, None]

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


def _by_kind(system, rows, x):
    """Numbers (rows,) by the kind of their rows."""
    kinds, parts, first = row_kinds(system), [jnp.zeros((0, 6), x.dtype)], 0
    for e, k, _ in (D.shape for D in rows.directions):
        parts.append(jnp.pad(x[first : first + e * k].reshape(e, k), ((0, 0), (0, 6 - k))))
        first += e * k
    return Multipliers(jnp.concatenate(parts), x[kinds.drives], x[kinds.others])


def _by_row(system, rows, values):
    """Numbers (rows,) in the order of the rows."""
    kinds, parts, first = row_kinds(system), [], 0
    for e, k, _ in (D.shape for D in rows.directions):
        parts.append(values.closures[first : first + e, :k].reshape(-1))
        first += e
    order = np.argsort(np.concatenate([np.arange(kinds.closures), kinds.drives, kinds.others]))
    return jnp.concatenate([*parts, values.drives, values.others])[order]
