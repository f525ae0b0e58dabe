"""Universal files of test data: data sets, functions (58) in their units (164), transfer functions made of them."""

from ._uff import read_uff, write_uff

__all__ = ["read_uff", "write_uff"]
