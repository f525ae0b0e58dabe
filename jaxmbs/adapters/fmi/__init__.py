"""FMI 3.0: a mechanism as a Functional Mock-up Unit, and a unit of others as a force law."""

from typing import TYPE_CHECKING

from ...arguments import explain_arguments
from ...lazy import import_when_asked

if TYPE_CHECKING:
    from ._export import export_fmu
    from ._law import Fmu

__all__ = ["Fmu", "export_fmu"]

import_when_asked(__name__, explain_arguments)
