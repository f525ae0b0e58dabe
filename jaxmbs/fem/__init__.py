"""Finite-element structures: assembly, loads, recovery of forces and stresses."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._assembly import assemble_blocks, assemble_dense, element_matrices, node_pattern
    from ._groups import Group
    from ._history import recover_history
    from ._linear_system import assemble
    from ._loads import body_load, line_load, nodal_load, pressure_load
    from ._prestress import Buckling, buckling, geometric_stiffness
    from ._recovery import element_forces, element_stresses
    from ._structure import CoordinateTable, Structure, gather_rows, scatter_rows

__all__ = [
    "Buckling",
    "CoordinateTable",
    "Group",
    "Structure",
    "assemble",
    "assemble_blocks",
    "assemble_dense",
    "body_load",
    "buckling",
    "element_forces",
    "element_matrices",
    "element_stresses",
    "gather_rows",
    "geometric_stiffness",
    "line_load",
    "nodal_load",
    "node_pattern",
    "pressure_load",
    "recover_history",
    "scatter_rows",
]

import_when_asked(__name__, explain_arguments)
