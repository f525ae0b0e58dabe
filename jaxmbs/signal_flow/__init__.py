"""Signals of mechanisms at a configuration: measures, blocks and what they drive, samples, internal states."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._instant import Instant
    from ._signal_names import signals

__all__ = [
    "Instant",
    "signals",
]

import_when_asked(__name__, explain_arguments)
