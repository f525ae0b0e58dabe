"""Margins: signed distances of a thing to the ends of its model."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..math._extremes import largest
from ..tables import fields_repr

#: Angle between two axes up to which they count as parallel [rad].
MOST_TILT = 0.1


class Margin(eqx.Module):
    """Signed distance to an end of a model, positive inside.

    Attributes:
        value: one number (), or one at each of the `places` (k,).
        unit: of the value, such as "m" (static).
        end: predicate of a thing beyond it, "is pressed deeper than its max_depth" (static).
        places: names of the places (static), () for one number.
    """

    value: Float[Array, "..."]
    unit: str = eqx.field(static=True)
    end: str = eqx.field(static=True)
    places: tuple[str, ...] = eqx.field(static=True, default=())

    __repr__ = fields_repr


def tooth_margins(gears: Any, nearer: Array, approach: Array) -> dict[str, Margin]:
    """Margins of the teeth of two wheels.

    Args:
        gears: law with `module` and `pressure_angle`.
        nearer: distance by which the wheels are nearer than nominal [m]; two modules farther teeth pass freely.
        approach: of the flanks [m]; pressed by half a pitch they would be found one tooth on.
    """
    quarter = np.pi / 4 * gears.module * jnp.cos(gears.pressure_angle)
    pressed = "presses its teeth by more than a quarter of their pitch"
    return {
        "reach": Margin(nearer + 2.0 * gears.module, "m", "has its wheels so far apart that teeth do not touch"),
        "teeth": Margin(quarter - largest(approach), "m", pressed),
    }
