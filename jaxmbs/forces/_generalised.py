"""Efforts given directly along the velocities of the system."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
from jaxtyping import Array

from ..typing import ArrayLike, Convertible, ScalarLike
from ._base import AbstractSystemLaw
from ._fields import as_law_function, number


class GeneralisedEffort(AbstractSystemLaw):
    """Efforts from `function(coordinates, velocities, t)`; their power counts as input.

    Source: S2 (76), the external efforts Q*.

    Attributes:
        function: gives (nv,) [N or N m]; the arrays of an `eqx.Module` are leaves, a plain function is
            static.
    """

    function: Convertible[Callable[..., Any]] = eqx.field(converter=as_law_function)

    def effort(self, coordinates: ArrayLike, velocities: ArrayLike, t: ScalarLike) -> Array:
        """The function's (nv,). Source: S2 (76)."""
        return number(self.function(coordinates, velocities, t))
