"""Ends of the model of a cable's path: tangents, spans without length, wheels that it cannot leave."""

import jax.numpy as jnp
import numpy as np

from ..math._vector import dot
from ..runtime import gather_static
from ._cable_path import LEAST_WRAP, CablePath, Circles, PathLayout
from ._validity import Margin

#: Length of a span, of that of the whole cable, that is taken for none.
_NO_LENGTH = 1e-9
#: Angle before the ends of the range of wraps, where one cannot be told from the other [rad].
_NEAR = 0.1
#: Wrap below zero that is rounding [rad].
_ROUNDING = 1e-6
#: Angle by which a cable may bend sideways in the groove of a wheel that it leaves [rad].
_SIDEWAYS = 0.02
#: Cosine of the angle between the axis of a great circle and the given one below which its side is not known.
_SIDE = 0.1


def path_margins(layout: PathLayout, circles: Circles, path: CablePath) -> dict[str, Margin]:
    """Margins of a path over circles by name: distances [m], angles [rad], a cosine."""
    spans = tuple(f"span after element {k}" for k in range(len(path.spans)))
    found = {
        "tangent": Margin(path.tangent_margin, "m", "finds no tangent between its wheels", spans),
        "span": Margin(path.spans - _NO_LENGTH * path.length, "m", "has two of its elements at one place", spans),
    }
    if len(layout.circles):
        found |= _wraps(layout, circles, path)
    if len(own := layout.free_wheels_of("sheave")):
        found["groove"] = Margin(_sideways(own, layout, path), "rad", "leaves a groove sideways", _elements(own))
    if len(own := np.flatnonzero(layout.elements("sphere"))):
        cosine = gather_static(dot(path.axes, circles.axis), own)
        side = jnp.where(gather_static(path.wrap, own) > 0, cosine, 1.0) - _SIDE
        found["side"] = Margin(
            side, "", "slips over the side of a sphere: its great circle is across `axis`", _elements(own)
        )
    return found


def _elements(own):
    return tuple(f"element {k}" for k in own)


def _wraps(layout, circles, path):
    """Wraps that are left to those that cannot be told from others, and to zero on wheels beside other wheels."""
    own = layout.circles
    wrap, turns = gather_static(path.wrap, own), gather_static(circles.turns, own)
    angle = wrap - 2 * np.pi * turns
    far = jnp.minimum(angle + LEAST_WRAP, 2 * np.pi - LEAST_WRAP - angle) - _NEAR
    found = {
        "angle": Margin(
            far, "rad", "turns by an angle of which a full turn more or less is not known", _elements(own)
        )
    }
    if len(fixed := np.setdiff1d(own, layout.free_wheels)):
        end = "has left a wheel beside another one, which would pull at it: leave it out, or put an Eyelet between"
        found["wrap"] = Margin(gather_static(path.wrap, fixed) + _ROUNDING, "rad", end, _elements(fixed))
    return found


def _sideways(own, layout, path):
    """Angle that is left to a bend in the direction of the axis, where the cable has left the wheel."""
    across = dot(path.axes, layout.after(path.directions) - layout.before(path.directions))
    left = gather_static(path.wrap, own) < 0
    return jnp.where(left, _SIDEWAYS - jnp.abs(gather_static(across, own)), _SIDEWAYS)
