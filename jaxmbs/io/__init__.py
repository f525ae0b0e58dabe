"""Files in and out; each format imports what it needs when it is called."""

from .matrices import read_dmig, read_matrix_market, read_op4
from .meshes import Mesh, read_mesh
from .nastran import Deck, read_nastran
from .uff import read_uff, write_uff

__all__ = [
    "Deck",
    "Mesh",
    "read_dmig",
    "read_matrix_market",
    "read_mesh",
    "read_nastran",
    "read_op4",
    "read_uff",
    "write_uff",
]
