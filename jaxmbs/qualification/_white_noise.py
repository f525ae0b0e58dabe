"""White noise: a level at all frequencies."""

import equinox as eqx
from jaxtyping import Array, Float

from ..checks import faults_if, not_positive
from ..errors import ModelError
from ..runtime import as_array
from ..typing import ArrayLike


class WhiteNoise(eqx.Module):
    """White noise: one-sided level () in SI units squared per Hz at all frequencies from zero on.

    Its responses are solutions of a Lyapunov equation, and finite only of outputs that do not follow the input at
    high frequencies.

    Attributes: level: (); quantity: "acceleration" or "force" (static).

    Raises: ModelError for a level that is not positive, and another quantity.
    """

    level: Float[Array, ""]
    quantity: str = eqx.field(static=True)

    def __init__(self, level: ArrayLike, quantity: str = "acceleration") -> None:
        self.level, self.quantity = as_array(level), quantity
        faults = faults_if(
            (not_positive(self.level), f"the level of white noise must be positive, not {level}"),
            (self.level.ndim != 0, f"the level of white noise is one number, not of shape {self.level.shape}"),
            (
                quantity not in ("acceleration", "force"),
                f"quantity = {quantity!r} must be 'acceleration' or 'force'",
            ),
        )
        if faults:
            raise ModelError(faults, "the white noise")
