"""Sums of outputs of a circuit: flows into the chambers of a cylinder, the torque of a pump on a joint."""

from typing import Any

from jaxtyping import Array

from ..blocks import AbstractBlock
from ..forces._internal_state import States
from ..typing import ScalarLike


class Sum(AbstractBlock):
    """Sums of what it reads, by the factors that its declaration has."""

    def output(self, u: Any, s: States, t: ScalarLike) -> Array:
        """The sums."""
        return u
