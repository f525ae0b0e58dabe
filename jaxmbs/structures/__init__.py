"""Structures of finite elements: assembly, loads, recovery; substructures and their checks."""

from .assembly import assemble_blocks as assemble_blocks
from .assembly import assemble_dense as assemble_dense
from .assembly import element_matrices as element_matrices
from .assembly import node_pattern as node_pattern
from .check import check as check
from .groups import Group as Group
from .histories import histories as histories
from .loads import body_load as body_load
from .loads import line_load as line_load
from .loads import nodal_load as nodal_load
from .loads import pressure_load as pressure_load
from .modal_response import modal_response as modal_response
from .outside import block_matrices as block_matrices
from .recovery import element_forces as element_forces
from .recovery import element_stresses as element_stresses
from .report import Check as Check
from .statics import StaticResponse as StaticResponse
from .statics import static_response as static_response
from .structure import Coordinates as Coordinates
from .structure import Structure as Structure
from .structure import collect as collect
from .structure import rigid_motions as rigid_motions
from .structure import spread as spread
from .substructure import Substructure as Substructure
