"""Efforts given directly along the velocities of the system."""

from collections.abc import Callable
from typing import Any

import equinox as eqx

from ._fields import function, number
from .base import AbstractSystemLaw


class GeneralisedEffort(AbstractSystemLaw):
    """Efforts from `function(t, coordinates, velocities)`; their power counts as input.

    Source: S2 (76), the external efforts Q*.

    Attributes:
        function: gives (nv,) [N or N m]; the arrays of an `eqx.Module` are leaves, a plain function is
            static.
    """

    function: Callable[..., Any] = eqx.field(converter=function)

    def effort(self, t, coordinates, velocities):
        """The function's (nv,). Source: S2 (76)."""
        return number(self.function(t, coordinates, velocities))
