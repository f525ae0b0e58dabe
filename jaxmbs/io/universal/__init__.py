"""Universal files of test data: data sets, functions (58) in their units (164), transfer functions; modes (55)."""

from ._modes import read_uff_modes
from ._uff import read_uff, write_uff

__all__ = ["read_uff", "read_uff_modes", "write_uff"]
