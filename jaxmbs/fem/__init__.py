"""Structures of finite elements: assembly, loads, recovery."""

from .assembly import assemble, assemble_blocks, assemble_dense, element_matrices, node_pattern
from .groups import Group
from .loads import body_load, line_load, nodal_load, pressure_load
from .over_time import histories
from .recovery import element_forces, element_stresses
from .structure import Coordinates, Structure, collect, spread

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
