"""FMI 3.0: a mechanism as a Functional Mock-up Unit, and a unit of others as a force law."""

from ...arguments import explain_arguments
from ._export import export_fmu
from ._law import Fmu

__all__ = ["Fmu", "export_fmu"]

explain_arguments(globals())
