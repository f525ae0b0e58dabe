"""Structures of finite elements: assembly, loads, recovery."""

from .assembly import assemble as assemble
from .assembly import assemble_blocks as assemble_blocks
from .assembly import assemble_dense as assemble_dense
from .assembly import element_matrices as element_matrices
from .assembly import node_pattern as node_pattern
from .groups import Group as Group
from .histories import histories as histories
from .loads import body_load as body_load
from .loads import line_load as line_load
from .loads import nodal_load as nodal_load
from .loads import pressure_load as pressure_load
from .recovery import element_forces as element_forces
from .recovery import element_stresses as element_stresses
from .structure import Coordinates as Coordinates
from .structure import Structure as Structure
from .structure import collect as collect
from .structure import spread as spread
