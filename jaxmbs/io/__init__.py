"""Readers and writers of files; each format imports its libraries when it is called."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._matrices import read_dmig, read_matrix_market, read_op4
    from ._meshes import Mesh, read_mesh
    from .curves import Curves, read_curves, read_psd, write_curves, write_psd
    from .model_file import load_model, model_schema, register, save_model
    from .nastran import Deck, read_nastran
    from .robots import Imported, JointLimits, read_mjcf, read_sdf, read_urdf
    from .sid import read_sid, write_sid
    from .universal import read_uff, read_uff_modes, write_uff

__all__ = [
    "Curves",
    "Deck",
    "Imported",
    "JointLimits",
    "Mesh",
    "load_model",
    "model_schema",
    "read_curves",
    "read_dmig",
    "read_matrix_market",
    "read_mesh",
    "read_mjcf",
    "read_nastran",
    "read_op4",
    "read_psd",
    "read_sdf",
    "read_sid",
    "read_uff",
    "read_uff_modes",
    "read_urdf",
    "register",
    "save_model",
    "write_curves",
    "write_psd",
    "write_sid",
    "write_uff",
]

import_when_asked(__name__, explain_arguments)
