"""Blocks: controllers, filters and delays that read signals of a mechanism and drive its force elements."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._base import AbstractBlock
    from ._controllers import PI, PID
    from ._linear import Delay, FirstOrder, StateSpace, TransferFunction
    from ._nonlinear import Function, LookUp, RateLimit, Saturation

__all__ = [
    "PI",
    "PID",
    "AbstractBlock",
    "Delay",
    "FirstOrder",
    "Function",
    "LookUp",
    "RateLimit",
    "Saturation",
    "StateSpace",
    "TransferFunction",
]

import_when_asked(__name__, explain_arguments)
