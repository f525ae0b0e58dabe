"""The constraint rows of a mechanism as a linear operator, by walks of the tree; no matrix is formed."""

import dataclasses
from functools import lru_cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..kinematics._configuration import ClosureDirections, Configuration, node_motion
from ..kinematics._poses import frame_twists
from ..math._linalg import NOISE
from ..model._rows import drives
from ..model._system import System
from ..runtime import gather_static
from . import _closures as closures
from . import _constraints as constraints
from . import _rows


class ConstraintOperator(NamedTuple):
    """The constraint rows A at a configuration as a linear operator, scaled to one unit.

    Columns where `free` (nv,) is zero are left out; None for none.
    """

    system: System
    at: Configuration
    unit: Array
    free: Array | None = None

    @property
    def directions(self) -> tuple:
        """Directions (elements, rows, 6) of every group of closures."""
        return closures.directions(self.system, self.at)

    def masked(self, active) -> "ConstraintOperator":
        """The operator with the rows that are not active (rows,) set to zero."""
        return self._replace(unit=jnp.where(active, self.unit, 0.0))

    def rates(self, a):
        """Rates of the rows `A a` (rows,) for accelerations a (nv,)."""
        a = a if self.free is None else self.free * a
        system, parts, twist = self.system, [jnp.zeros(0, a.dtype)], frame_twists(self.system, self.twists(a))
        for group, D in zip(system.closures, self.directions, strict=True):
            relative = gather_static(twist, group.second) - gather_static(twist, group.first)
            parts.append(jnp.einsum("erk,ek->er", D, relative).reshape(-1))
        if system.rows:
            parts.append(_rows.rates(system, _rows.slopes(system, self.at), twist, a))
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
            slopes = _rows.magnitudes(_rows.slopes(system, self.at))
            parts.append(_rows.rates(system, slopes, twist, jnp.abs(a)))
        return self.unit * jnp.concatenate(parts)

    def efforts(self, y):
        """Generalised efforts `A^T y` (nv,) of multipliers y (rows,)."""
        return jax.linear_transpose(self.rates, jnp.zeros(self.at.S.shape[0], y.dtype))(y)[0]


def constraint_operator(system: System, at: Configuration) -> ConstraintOperator:
    """The operator of the rows at a configuration."""
    values = ClosureDirections(closures.directions(system, at), _rows.slopes(system, at))
    unit = jnp.asarray(constraints.row_scale(system).unit, at.psi.dtype)
    return ConstraintOperator(system, dataclasses.replace(at, directions=values), unit)


def stop_gradients(tree):
    """A pytree whose arrays pass no derivative."""
    return jax.tree.map(lambda x: lax.stop_gradient(x) if isinstance(x, Array) else x, tree)


class RowKinds(NamedTuple):
    """Number of closure rows; indices of drive rows and the columns that they prescribe; indices of all other
    rows."""

    closures: int
    drives: np.ndarray
    columns: np.ndarray
    others: np.ndarray


def row_kinds(system: System) -> RowKinds:
    """Classify the constraint rows: closures, drives, others."""
    first = sum(len(group.names) * group.kind.num_rows for group in system.closures)
    driven = dict(pair for row in drives(system.rows) for pair in zip(row.places, row.columns, strict=True))
    others = np.setdiff1d(np.arange(first, system.topology.num_rows), list(driven))
    return RowKinds(first, np.array(list(driven), int), np.array(list(driven.values()), int), others.astype(int))


def largest_of_element(sizes, block, mobility):
    """Sizes (rows,) of `A diag(mobility) A^T` where all rows of an element get the largest size among them.

    Elements whose rows hold rounding alone get the largest mobility of a column, so that they count as none.
    """
    if not len(block):
        return sizes
    largest, most = jax.ops.segment_max(sizes, jnp.asarray(block), int(block.max()) + 1)[block], jnp.max(mobility)
    largest = jnp.where(largest > NOISE[sizes.dtype.itemsize] * most, largest, jnp.maximum(most, 1e-18))
    # rows that vanish at a singular pose fade out, but not to a division by zero
    return jnp.maximum(largest, 1e-12 * jnp.max(sizes, initial=1e-18))


class LoopEntries(NamedTuple):
    """Entries of the rows of closures in the columns of their loops, one after another.

    The columns between the frames of each closure are listed, so that far from the origin nothing cancels.

    Attributes: row, column (c,): of each entry; value (c,): its derivative of the row, [m or rad] per unit.
    """

    row: np.ndarray
    column: np.ndarray
    value: Array


def loop_entries(system: System, at: Configuration) -> LoopEntries:
    """The entries at a configuration."""
    column, element, sign = _loop_columns(system)
    values, first = [jnp.zeros(0, at.S.dtype)], 0
    for D in closures.directions(system, at):
        chosen = (element >= first) & (element < first + len(D))
        along = jnp.einsum("crk,ck->cr", D[element[chosen] - first], at.S[column[chosen]])
        values.append((along * jnp.asarray(sign[chosen], D.dtype)[:, None]).reshape(-1))
        first += len(D)
    rows, columns = closure_pattern(system)
    return LoopEntries(rows, columns, jnp.concatenate(values))


def closure_pattern(system: System):
    """Rows and columns (c,) of the `loop_entries`."""
    column, element, _ = _loop_columns(system)
    row, on, first, first_row = [np.zeros(0, int)], [np.zeros(0, int)], 0, 0
    for group in system.closures:
        e, k = len(group.names), group.kind.num_rows
        chosen = (element >= first) & (element < first + e)
        row.append((first_row + (element[chosen] - first)[:, None] * k + np.arange(k)).reshape(-1))
        on.append(np.repeat(column[chosen], k))
        first, first_row = first + e, first_row + e * k
    return np.concatenate(row), np.concatenate(on)


def loop_mobility(system: System, entries: LoopEntries, rows: ConstraintOperator, mobility):
    """Diagonal (rows,) of A diag(mobility) A^T for the rows of closures and drives; zero for all others."""
    kinds = row_kinds(system)
    of_entries = entries.value**2 * mobility[entries.column]
    sizes = jax.ops.segment_sum(of_entries, jnp.asarray(entries.row), system.topology.num_rows) * rows.unit**2
    return sizes.at[kinds.drives].set(rows.unit[kinds.drives] ** 2 * mobility[kinds.columns])


def _loop_columns(system):
    top = system.topology
    ends = [end for group in system.closures for end in zip(group.first, group.second, strict=True)]
    return _columns_between(top.nodes.parent, tuple((top.frame_node[a], top.frame_node[b]) for a, b in ends))


@lru_cache(maxsize=64)
def _columns_between(parent, ends):
    """(columns, elements, signs): the nodes between both ends of every closure, + where they move end B."""
    columns, elements, signs = [], [], []
    for e, (a, b) in enumerate(ends):
        while a != b:  # a parent has the lower number
            columns.append(max(a, b))
            elements.append(e)
            signs.append(1.0 if b > a else -1.0)
            a, b = (parent[a], b) if a > b else (a, parent[b])
    return np.array(columns, int), np.array(elements, int), np.array(signs)
