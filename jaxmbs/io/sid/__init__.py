"""Standard input data of flexible bodies (SID, text): elastic bodies to and from other multibody programs."""

from ._read_sid import read_sid
from ._write_sid import write_sid

__all__ = ["read_sid", "write_sid"]
