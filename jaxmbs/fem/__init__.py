"""Structures of finite elements: assembly, loads, recovery."""

from ._assembly import assemble, assemble_blocks, assemble_dense, element_matrices, node_pattern
from ._groups import Group
from ._loads import body_load, line_load, nodal_load, pressure_load
from ._over_time import histories
from ._recovery import element_forces, element_stresses
from ._structure import Coordinates, Structure, collect, spread

__all__ = [
    "Coordinates",
    "Group",
    "Structure",
    "assemble",
    "assemble_blocks",
    "assemble_dense",
    "body_load",
    "collect",
    "element_forces",
    "element_matrices",
    "element_stresses",
    "histories",
    "line_load",
    "nodal_load",
    "node_pattern",
    "pressure_load",
    "spread",
]
