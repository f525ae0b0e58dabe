"""The saddle system of a mechanism solved on the graph of its bodies: work linear in their number.

`m M a + diag(w) a + A^T y = b`, `A a = c` for the accelerations of the tree's joints, as `math.linalg.saddle_solve`
does it: rows eliminated with a small compliance, proximal iterations, refinement against the whole system.  No matrix
of the tree is formed: products with M and A are walks of the tree, and `m M + diag(w) + A^T C^-1 A` is inverted by
`body_matrix`.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from .. import blocksparse
from ..constraints import _constraints as constraints
from ..constraints._saddle_operator import (
    ConstraintOperator,
    largest_of_element,
    loop_entries,
    loop_mobility,
    row_kinds,
    stop_gradients,
)
from ..kinematics._configuration import Configuration
from ..kinematics._elastic import mass_operator
from ..kinematics._tree import subtrees
from ..math._linalg import proximal_rounds, relative
from ..math._spd import spd_inverse
from ..model._system import System
from ._body_graph import body_graph
from ._body_matrix import body_matrix, joint_maps
from ._modal_condensation import column_inertia, condense_modes, lumped_inertia, solve_with_modes

#: Compliance C of the rows, relative to their mobility.  Errors of the factor, 1e-16 / C, reach the multipliers as
#: 1e-16 / C^2: the 3e-10 of `saddle_solve`, whose inverse is better, leads to divergence on redundant loops.
PROXIMAL_COMPLIANCE = {8: 3e-7, 4: 2e-3}
#: Refinements of each solve: each multiplies the error of the multipliers by about 1e-16 / C^2 = 1e-3.
REFINEMENTS = 2


def sparse_saddle(system: System, at: Configuration, rows: ConstraintOperator, b, c, mass=1.0, weight=None):
    """Accelerations (nv,) and multipliers y (rows,) for b (nv,), c (rows,); see `saddle_solve`.

    Args: mass: (), factor m of the mass matrix; weight: w (nv,), default zero.
    """
    n = b.shape[0]
    weight = jnp.zeros_like(b) if weight is None else weight
    C, inverse = _penalty_inverse(*stop_gradients((system, at, rows, mass, weight)))
    right, momenta = jnp.concatenate([b, rows.unit * c]), mass_operator(system, at)

    def apply(z, C):
        a, y = z[:n], z[n:]
        return jnp.concatenate([mass * momenta(a) + weight * a + rows.efforts(y), rows.rates(a) - C * y])

    def eliminated(right):
        a = inverse(right[:n] + rows.efforts(right[n:] / C))
        return jnp.concatenate([a, (rows.rates(a) - right[n:]) / C])

    def improved(left):
        step = lambda _, z: z + eliminated(left - apply(z, C))
        return lax.fori_loop(0, 1 + REFINEMENTS, step, jnp.zeros_like(left))  # one copy of the solver is compiled

    def whole(z):
        return apply(z, jnp.zeros_like(C))

    def solve(_, right):
        def gap(left, z):
            return relative(left[n:], rows.sizes(rows.twists(z[:n]), z[:n]) + jnp.abs(right[n:]))

        return proximal_rounds(right, improved, whole, gap)

    z = lax.custom_linear_solve(whole, right, solve, solve, symmetric=True)
    return z[:n], rows.unit * z[n:]


def _penalty_inverse(system, at, rows, mass, weight):
    """Compliances C (rows,), and the function `(m M + diag(w) + A^T C^-1 A)^-1` from efforts to accelerations (nv,).

    Rows of couplers and of the user, which may read any column, border the graph: they should be few.
    """
    top, graph, kinds, dtype = system.topology, body_graph(system), row_kinds(system), at.psi.dtype
    parts, J, length = condense_modes(system, at, mass, weight), mass * at.J, system.length.astype(dtype)
    composite = subtrees(top.nodes, lumped_inertia(system, J, parts))
    mobility = _mobility(column_inertia(system, at.S, composite, parts) + weight)
    B = jax.vmap(rows.efforts)(jnp.asarray(np.eye(top.num_rows)[kinds.others], dtype))
    closures = [u[..., None] * D for u, D in zip(_split_by_group(rows, rows.unit), rows.directions, strict=True)]
    sizes = loop_mobility(system, loop_entries(system, at), rows, mobility).astype(dtype)
    sizes = sizes.at[kinds.others].set((B * B) @ mobility)
    C = PROXIMAL_COMPLIANCE[dtype.itemsize] * largest_of_element(sizes, constraints.row_scale(system).block, mobility)

    maps = joint_maps(graph, at, length)
    each = zip(closures, _split_by_group(rows, C), strict=True)
    springs = [jnp.einsum("era,er,erb->eab", D, 1.0 / c, D) for D, c in each]
    held = weight.at[kinds.columns].add(rows.unit[kinds.drives] ** 2 / C[kinds.drives])
    scale = jnp.max(composite[:, 0]) / len(graph.node) + jnp.max(weight) / length**2
    matrix = body_matrix(graph, maps, J, composite, springs, held, [part.inertia for part in parts], scale)
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


def _mobility(size):
    """Inverses (nv,) of inertias; zero for columns without inertia, which must not set a scale."""
    # the same bound as in `math.linalg.saddle_solve`; 1e-30 keeps models without any mass finite
    massless = size <= 1e-9 * jnp.max(size, initial=1e-30)
    return jnp.where(massless, 0.0, 1.0 / jnp.where(massless, 1.0, size))
