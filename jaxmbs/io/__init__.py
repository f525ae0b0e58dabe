"""Files in and out; each format imports what it needs when it is called."""

from .matrices import read_dmig, read_matrix_market, read_op4
from .model_file import load_model, model_schema, register, save_model
from .robots import Imported, JointLimits, read_mjcf, read_urdf
from .uff import read_uff, write_uff

__all__ = [
    "Imported",
    "JointLimits",
    "load_model",
    "model_schema",
    "read_dmig",
    "read_matrix_market",
    "read_mjcf",
    "read_op4",
    "read_uff",
    "read_urdf",
    "register",
    "save_model",
    "write_uff",
]
