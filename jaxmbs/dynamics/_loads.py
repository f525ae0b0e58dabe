"""Momenta and loads of a mechanism: on its nodes or bodies, and on its velocity columns."""

import equinox as eqx
from jax import Array

from ..kinematics._tree import subtrees
from ..math._spatial import dot
from ..model._system import System


class Loads(eqx.Module):
    """Wrenches (owners, 6) about the origin and entries (nv,) of velocity columns; None where there are none."""

    wrench: Array | None = None
    column: Array | None = None

    def __add__(self, other: "Loads") -> "Loads":
        return Loads(_add_optional(self.wrench, other.wrench), _add_optional(self.column, other.column))

    def __sub__(self, other: "Loads") -> "Loads":
        return Loads(_subtract_optional(self.wrench, other.wrench), _subtract_optional(self.column, other.column))


def _add_optional(a, b):
    return a if b is None else b if a is None else a + b


def _subtract_optional(a, b):
    return a if b is None else -b if a is None else a - b


def on_columns(system: System, at, loads: Loads) -> Array:
    """Generalised efforts (nv,) of loads on nodes: `S . subtrees(wrench)`, plus the entries of the columns."""
    efforts = dot(at.S, subtrees(system.topology.nodes, loads.wrench))
    return efforts if loads.column is None else efforts + loads.column
