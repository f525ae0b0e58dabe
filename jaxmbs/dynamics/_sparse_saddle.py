"""The saddle system of a mechanism solved on the graph of its bodies: work linear in their number.

`M a + A^T y = b`, `A a = c` for the accelerations of the tree's joints, as `math.linalg.saddle_solve` does it: rows
eliminated with a small compliance, proximal iterations, refinement against the whole system.  No matrix of the tree
is formed: products with M and A are walks of the tree, and `M + A^T C^-1 A` is inverted by `body_matrix`.
"""

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from .. import blocksparse
from ..kinematics import _closures as closures
from ..kinematics import _constraints as constraints
from ..kinematics import _coordinate_rows as coordinate_rows
from ..kinematics._configuration import ClosureDirections, Configuration, node_motion, with_velocities
from ..kinematics._poses import frame_twists
from ..kinematics._tree import ancestors, subtrees
from ..math._linalg import proximal_rounds, relative
from ..math._spatial import dot, momentum
from ..math._spd import spd_inverse
from ..model._rows import Drive
from ..model._system import System
from ..runtime import gather_static
from ._bodies import body_momenta
from ._body_graph import body_graph
from ._body_matrix import body_matrix, joint_maps
from ._loads import on_columns
from ._modal_condensation import condense_modes, lumped_inertia, solve_with_modes

#: Compliance C of the rows, relative to their mobility.  Errors of the factor, 1e-16 / C, reach the multipliers as
#: 1e-16 / C^2: the 3e-10 of `saddle_solve`, whose inverse is better, leads to divergence on redundant loops.
PROXIMAL_COMPLIANCE = {8: 3e-7, 4: 2e-3}
#: Refinements of each solve: each multiplies the error of the multipliers by about 1e-16 / C^2 = 1e-3.
REFINEMENTS = 2


class ConstraintOperator(NamedTuple):
    """The constraint rows A at a configuration as a linear operator, scaled to one unit."""

    system: System
    at: Configuration
    unit: Array

    @property
    def directions(self) -> tuple:
        """Directions (elements, rows, 6) of every group of closures."""
        return closures.directions(self.system, self.at)

    def rates(self, a):
        """Rates of the rows `A a` (rows,) for accelerations a (nv,)."""
        system, parts, twist = self.system, [jnp.zeros(0, a.dtype)], frame_twists(self.system, self.twists(a))
        for group, D in zip(system.closures, self.directions, strict=True):
            relative = gather_static(twist, group.second) - gather_static(twist, group.first)
            parts.append(jnp.einsum("erk,ek->er", D, relative).reshape(-1))
        if system.rows:
            parts.append(coordinate_rows.rates(system, self.at.psi, self.at.t, a))
        return self.unit * jnp.concatenate(parts)

    def twists(self, a):
        """Rates (nodes, 6) of the nodes' twists from accelerations a (nv,) alone."""
        return node_motion(self.system.topology, self.at.S, a)

    def sizes(self, twists, a):
        """Magnitude (rows,) of what adds up in `rates`, from the rates of twists (nodes, 6)."""
        system, parts, twist = self.system, [jnp.zeros(0, a.dtype)], frame_twists(self.system, jnp.abs(twists))
        for group, D in zip(system.closures, self.directions, strict=True):
            both = gather_static(twist, group.second) + gather_static(twist, group.first)
            parts.append(jnp.einsum("erk,ek->er", jnp.abs(D), both).reshape(-1))
        if system.rows:
            parts.append(jnp.abs(coordinate_rows.rates(system, self.at.psi, self.at.t, a)))
        return self.unit * jnp.concatenate(parts)

    def efforts(self, y):
        """Generalised efforts `A^T y` (nv,) of multipliers y (rows,)."""
        return jax.linear_transpose(self.rates, jnp.zeros(self.at.S.shape[0], y.dtype))(y)[0]


def constraint_operator(system: System, at: Configuration) -> ConstraintOperator:
    """The operator of the rows at a configuration."""
    values = ClosureDirections(closures.directions(system, at), None)
    unit = jnp.asarray(constraints.row_scale(system).unit, at.psi.dtype)
    return ConstraintOperator(system, dataclasses.replace(at, directions=values), unit)


def sparse_saddle(system: System, at: Configuration, rows: ConstraintOperator, b, c):
    """Accelerations (nv,) and multipliers y (rows,) for b (nv,), c (rows,); see `saddle_solve`."""
    n = b.shape[0]
    C, inverse = _penalty_inverse(*_stop_gradients((system, at, rows)))
    right = jnp.concatenate([b, rows.unit * c])

    def apply(z, C):
        a, y = z[:n], z[n:]
        return jnp.concatenate([_apply_mass(system, at, a) + rows.efforts(y), rows.rates(a) - C * y])

    def eliminated(right):
        a = inverse(right[:n] + rows.efforts(right[n:] / C))
        return jnp.concatenate([a, (rows.rates(a) - right[n:]) / C])

    def improved(left):
        step = lambda _, z: z + eliminated(left - apply(z, C))  # noqa: E731
        return lax.fori_loop(0, 1 + REFINEMENTS, step, jnp.zeros_like(left))  # one copy of the solver is compiled

    def whole(z):
        return apply(z, jnp.zeros_like(C))

    def solve(_, right):
        def gap(left, z):
            return relative(left[n:], rows.sizes(rows.twists(z[:n]), z[:n]) + jnp.abs(right[n:]))

        return proximal_rounds(right, improved, whole, gap)

    z = lax.custom_linear_solve(whole, right, solve, solve, symmetric=True)
    return z[:n], rows.unit * z[n:]


def _stop_gradients(tree):
    return jax.tree.map(lambda x: lax.stop_gradient(x) if isinstance(x, Array) else x, tree)


def _apply_mass(system, at, a):
    """Product `M a` (nv,) by a walk of the tree."""
    return on_columns(system, at, body_momenta(system, with_velocities(system, at, a)))


class RowKinds(NamedTuple):
    """Number of closure rows; indices of drive rows and the columns that they prescribe; indices of all other
    rows."""

    closures: int
    drives: np.ndarray
    columns: np.ndarray
    others: np.ndarray


def row_kinds(system: System) -> RowKinds:
    """Classify the constraint rows: closures, drives, others."""
    top = system.topology
    first = at = sum(len(group.names) * group.kind.num_rows for group in system.closures)
    driven = {}
    for row in system.rows:
        if isinstance(row, Drive):
            driven[at] = row.columns[0]
        if not row.is_nonholonomic:
            at += sum(name == row.name for name in top.row_joint)
    others = np.setdiff1d(np.arange(first, top.num_rows), list(driven))
    return RowKinds(first, np.array(list(driven), int), np.array(list(driven.values()), int), others.astype(int))


def _penalty_inverse(system, at, rows):
    """Compliances C (rows,), and the function `(M + A^T C^-1 A)^-1` from efforts to accelerations (nv,).

    Rows of couplers and of the user, which may read any column, border the graph: they should be few.
    """
    top, graph, kinds, dtype = system.topology, body_graph(system), row_kinds(system), at.psi.dtype
    parts = condense_modes(system, at)
    composite = subtrees(top.nodes, lumped_inertia(system, at.J, parts))
    mobility = _mobility(system, at.S, composite, parts)
    B = jax.vmap(rows.efforts)(jnp.asarray(np.eye(top.num_rows)[kinds.others], dtype))
    closures = [u[..., None] * D for u, D in zip(_split_by_group(rows, rows.unit), rows.directions, strict=True)]
    sizes = [_closure_sizes(graph, at.S, top.nodes, mobility, closures), jnp.zeros(top.num_rows - kinds.closures)]
    sizes = jnp.concatenate([part.astype(dtype) for part in sizes])
    sizes = sizes.at[kinds.drives].set(rows.unit[kinds.drives] ** 2 * mobility[kinds.columns])
    sizes = sizes.at[kinds.others].set((B * B) @ mobility)
    C = PROXIMAL_COMPLIANCE[dtype.itemsize] * _largest_of_element(sizes, constraints.row_scale(system).block)

    maps = joint_maps(graph, at, system.length.astype(dtype))
    each = zip(closures, _split_by_group(rows, C), strict=True)
    springs = [jnp.einsum("era,er,erb->eab", D, 1.0 / c, D) for D, c in each]
    held = jnp.zeros_like(mobility).at[kinds.columns].add(rows.unit[kinds.drives] ** 2 / C[kinds.drives])
    matrix = body_matrix(graph, maps, at.J, composite, springs, held, [part.inertia for part in parts])
    factor = blocksparse.factor(matrix, "ldl")
    return C, _bordered_inverse(lambda r: solve_with_modes(system, graph, maps, parts, factor, r), B, C[kinds.others])


def _bordered_inverse(inverse, B, C):
    """`(H + B^T C^-1 B)^-1` from that of H; B (k, nv)."""
    if not len(B):
        return inverse
    Z = jax.vmap(inverse)(B)
    middle = spd_inverse(jnp.diag(C) + B @ Z.T)

    def bordered(r):
        x = inverse(r)
        return x - (middle @ (B @ x)) @ Z

    return bordered


def _split_by_group(rows, values):
    """Values of the closures' rows, (elements, rows) of every group."""
    shapes = [D.shape[:2] for D in rows.directions]
    ends = np.cumsum([0, *(a * b for a, b in shapes)])
    return [values[a:b].reshape(shape) for a, b, shape in zip(ends[:-1], ends[1:], shapes, strict=True)]


def _mobility(system, S, composite, parts):
    """Inverse diagonal (nv,) of the mass matrix; zero for columns without inertia, which must not set a scale."""
    size = dot(S, momentum(composite, S))
    for group, part in zip(system.elastic, parts, strict=True):
        size = size.at[np.array(group.columns, int)].set(jnp.diagonal(part.modal, axis1=1, axis2=2))
    # the same bound as in `math.linalg.saddle_solve`; 1e-30 keeps models without any mass finite
    massless = size <= 1e-9 * jnp.max(size, initial=1e-30)
    return jnp.where(massless, 0.0, 1.0 / jnp.where(massless, 1.0, size))


def _closure_sizes(graph, S, nodes, mobility, directions):
    """Diagonal of A diag(mobility) A^T, by sums of S S^T over the columns between the frames of each closure."""
    reach = ancestors(nodes, S[:, :, None] * S[:, None, :] * mobility[:, None, None])
    reach = jnp.concatenate([reach, jnp.zeros((1, 6, 6), reach.dtype)])
    a, b = np.append(graph.node, nodes.size)[graph.ends].T
    between = reach[a] + reach[b] - 2.0 * reach[graph.common_ancestor]
    sizes, first = [jnp.zeros(0, reach.dtype)], 0
    for D in directions:
        sizes.append(jnp.einsum("era,eab,erb->er", D, between[first : first + len(D)], D).reshape(-1))
        first += len(D)
    return jnp.maximum(jnp.concatenate(sizes), 0.0)


def _largest_of_element(sizes, block):
    """Sizes (rows,) where all rows of a closure element get the largest size among them."""
    if not len(block):
        return sizes
    largest = jax.ops.segment_max(sizes, jnp.asarray(block), int(block.max()) + 1)[block]
    # rows that vanish at a singular pose fade out, but not to a division by zero
    return jnp.maximum(largest, 1e-12 * jnp.max(sizes, initial=1e-18))
