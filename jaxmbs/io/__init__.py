"""Files in and out; each format imports what it needs when it is called."""

from .matrices import read_dmig, read_matrix_market, read_op4
from .uff import read_uff, write_uff

__all__ = [
    "read_dmig",
    "read_matrix_market",
    "read_op4",
    "read_uff",
    "write_uff",
]
