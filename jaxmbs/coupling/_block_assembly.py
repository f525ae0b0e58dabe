"""Coupling of thousands of components of few shapes in one program, by node numbers; `connect` joins by name.

The assembly is primal, once per node, so floating components are allowed; the reactions of the bonds are the residual
of each component's own equilibrium.  At every node they sum to the load on it: S1 (2), (25).
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from ..blocksparse import BlockMatrix, Pattern, Plan, assemble, factor, solve
from ..checks import require_numbers
from ..linear._storage import as_inexact
from ..linear._system import LinearSystem
from ..math import _square as square
from ..quantities import Quantity, entries
from ..reductions._base import interface_first
from ..reports import Report, Reported
from ..runtime import as_dtype
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible
from ._self_stresses import impedance


def _numbers(what):
    """Converter of a field, real or complex; what: its name."""

    def convert(value):
        require_numbers(**{what: value})
        return as_inexact(value)

    return convert


class Components(eqx.Module):
    """Components of one shape: interface coordinates first, node by node, then internal ones (modes, interior).

    Attributes:
        nodes: (components, k), the interface node of each of a component's k places; -1 is fixed to the ground.
        matrix: (components, n, n) stiffness, or dynamic stiffness (complex); symmetric.
        load: (components, n) loads on the coordinates.

    Raises: ValueError for components without nodes, or with different numbers of them.
    """

    nodes: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    matrix: Convertible[Inexact[Array, "components n n"]] = eqx.field(converter=_numbers("matrix"))
    load: Convertible[Inexact[Array, "components n"]] = eqx.field(converter=_numbers("load"))

    __repr__ = fields_repr

    def __check_init__(self):
        if not self.nodes or len({len(row) for row in self.nodes}) != 1:
            raise ValueError(f"nodes are those of one or more components, as many of each, not {self.nodes}")

    @classmethod
    def of(
        cls,
        components: Sequence[LinearSystem],
        nodes: Sequence[Sequence[int]],
        forces: Sequence,
        omega: ArrayLike | None = None,
    ) -> "Components":
        """Group linear systems of one shape whose interfaces are complete nodes.

        Args:
            components: linear systems, reduced or not.
            nodes: interface node of each place (components, k), -1 for the ground; the interface coordinates of a
                component are those of its places in turn.
            forces: (n_c,) on each component's own coordinates, None for none.
            omega: angular frequency [rad/s]; None for statics.

        Raises: ValueError for components of different shapes.  Source: S1 (1)-(3), (19), (41).
        """
        parts = [interface_first(c) for c in components]
        if len({(c.num_interface, c.num_rows) for c in parts}) > 1:
            raise ValueError(
                "the components of a group must have the same numbers of interface and "
                "inner coordinates: make two groups"
            )
        matrices = jnp.stack([impedance(c, omega) for c in parts])
        zero = jnp.zeros(matrices.shape[1], matrices.dtype)
        pairs = zip(parts, forces, strict=True)
        loads = [zero if f is None else (c.basis.T.astype(f.dtype) @ f).astype(matrices.dtype) for c, f in pairs]
        return cls(tuple(tuple(int(n) for n in row) for row in nodes), matrices, jnp.stack(loads))


class CoupledResponse(Reported, eqx.Module):
    """Displacements of coupled components and the forces of their bonds.

    Attributes:
        interface: (nodes, size) displacements of the interface nodes.
        internal: per group (components, n - k size), displacements of the internal coordinates.
        reactions: per group (components, k, size), the forces the bonds put on each component, S1 (3).
        residual: largest `|sum of reactions - load|` over the free nodes, S1 (2), relative to the largest reaction.
    """

    interface: Inexact[Array, "nodes size"]
    internal: tuple
    reactions: tuple
    residual: Array

    def report(self) -> Report:
        found = [Quantity("relative residual", self.residual), entries("interface node", self.interface, "m or rad")]
        found += [entries(f"group {k} internal", x, "m or rad") for k, x in enumerate(self.internal)]
        found += [entries(f"group {k} reaction", x, "N or N m") for k, x in enumerate(self.reactions)]
        return Report(found)


def interface_pattern(groups: Sequence[Components], num_nodes: int, size: int) -> Pattern:
    """Pattern of the interface nodes: the nodes of one component are coupled.

    Raises: ValueError for an unknown node, or a component with the same node twice.
    """
    edges = []
    for group in groups:
        nodes = np.array(group.nodes)
        for k, row in enumerate(nodes):
            if row.max() >= num_nodes or len(set(row[row >= 0])) < np.sum(row >= 0):
                raise ValueError(
                    f"component {k}: nodes {row.tolist()} must be distinct and among 0 ... {num_nodes - 1}"
                )
        for r in range(nodes.shape[1]):
            edges += [nodes[:, [r, s]] for s in range(r)]
    pairs = np.concatenate(edges) if edges else np.zeros((0, 2), int)
    return Pattern(num_nodes, size, pairs[np.all(pairs >= 0, axis=1)])


def coupled_response(
    groups: Sequence[Components], load: ArrayLike, kind: str = "cholesky", plan: Plan | None = None
) -> CoupledResponse:
    """Static or harmonic response of coupled components.

    Args:
        load: (nodes, size) forces on the interface nodes themselves.
        kind: "cholesky" for stiffnesses, "ldl" for dynamic stiffnesses.
        plan: of `blocksparse.analyse(interface_pattern(...))`, default made here.

    The coupled structure must be constrained; the components need not be.  Source: S1 (1)-(3), (5)-(6), (10)-(12).
    """
    load = jnp.asarray(load)
    nodes, size = load.shape
    pattern = interface_pattern(groups, nodes, size) if plan is None else plan.pattern
    condensed = [_condense(group, size) for group in groups]
    matrix, right = _zero_matrix(pattern, condensed[0][0].dtype), as_dtype(load, condensed[0][0].dtype)
    for group, (stiffness, force, _, _) in zip(groups, condensed, strict=True):
        matrix = matrix + _assemble(pattern, group, stiffness)
        right = _add_at_nodes(group, right, force)
    x = solve(factor(matrix, kind, plan), right)
    internal, reactions = [], []
    sums = -load.astype(x.dtype)
    for group, (stiffness, force, modes, fixed) in zip(groups, condensed, strict=True):
        u = _take_at_nodes(group, x)
        internal.append(jnp.einsum("smi,si->sm", modes, u.reshape(len(u), -1)) + fixed)
        reaction = jnp.einsum("sij,sj->si", stiffness, u.reshape(len(u), -1)).reshape(u.shape) - force
        reactions.append(reaction)
        sums = _add_at_nodes(group, sums, reaction)
    largest = jnp.max(jnp.stack([jnp.max(jnp.abs(r)) for r in reactions]))
    residual = jnp.max(jnp.abs(sums)) / jnp.where(largest > 0, largest, 1.0)
    return CoupledResponse(x, tuple(internal), tuple(reactions), residual)


def _condense(group, size):
    """Stiffness and force at the interface, constraint modes `-K_NN^-1 K_Ni` and interior at a fixed interface."""
    k = len(group.nodes[0]) * size
    K, f = group.matrix, as_dtype(group.load, group.matrix.dtype)
    inner = K[:, k:, k:]
    both = jax.vmap(square.solve)(inner, jnp.concatenate([K[:, k:, :k], f[:, k:, None]], axis=2))
    modes, fixed = -both[:, :, :k], both[:, :, k]
    stiffness = K[:, :k, :k] + K[:, :k, k:] @ modes
    force = f[:, :k] + jnp.einsum("smi,sm->si", modes, f[:, k:])
    return stiffness, force.reshape(len(K), -1, size), modes, fixed


def _zero_matrix(pattern, dtype):
    b = pattern.size
    return BlockMatrix(
        pattern, jnp.zeros((pattern.num_blocks, b, b), dtype), jnp.zeros((pattern.num_edges, b, b), dtype)
    )


def _assemble(pattern, group, stiffness):
    """Assemble the stiffnesses of a group; places fixed to the ground add to no node."""
    nodes, b = np.array(group.nodes), pattern.size
    s, k = nodes.shape
    blocks = stiffness.reshape(s, k, b, k, b).transpose(0, 1, 3, 2, 4)
    matrix = _zero_matrix(pattern, stiffness.dtype)
    for held in np.unique(nodes < 0, axis=0):
        rows, free = np.nonzero(np.all((nodes < 0) == held, axis=1))[0], np.nonzero(~held)[0]
        if len(free):
            part = blocks[rows][:, free][:, :, free]
            matrix = matrix + assemble(pattern, nodes[np.ix_(rows, free)], part)
    return matrix


def _add_at_nodes(group, total, forces):
    nodes = np.array(group.nodes)
    padded = jnp.concatenate([total, jnp.zeros((1, total.shape[1]), total.dtype)])
    return padded.at[np.where(nodes < 0, len(total), nodes)].add(forces)[:-1]


def _take_at_nodes(group, x):
    nodes = np.array(group.nodes)
    return jnp.concatenate([x, jnp.zeros((1, x.shape[1]), x.dtype)])[np.where(nodes < 0, len(x), nodes)]
