"""Straight way of a cable past wheels that it has left.

A wheel between two points, about which the cable turns by an angle w, is left where w falls below zero: the way from
point to point is then the straight line.  The lengths of both ways, L over the wheel and l past it, agree at w = 0
with their first derivatives, as `L - l` is there as `w^2`; the second derivative jumps.  So that motions and their
derivatives pass, the length is rounded on a zone of a hundredth of a radian on the wheel, u = (L - l) / (ROUND l):

    length = l + (L - l) (1 - (1 - u)^4),    d length = a dL + b dl
    a = 1 - (1 - u)^3 (1 - 5 u),    b = 1 - a - 4 ROUND u^2 (1 - u)^3

for 0 < u < 1: twice differentiable, and exact beyond the zone, so that its work is that of the two ways.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..math._vector import Vectors, norm_and_unit
from ..runtime import gather_static

#: Length of the way over a wheel beyond the straight one up to which the passage is rounded, over the straight one.
ROUND = 1e-5


class Bypass(NamedTuple):
    """Straight ways past the wheels that stand between two points.

    Attributes:
        wheel, direct: (k,) shares of the way over the wheel and of the straight one in the derivative of the length.
        length: (k,) of the straight ways [m].
        directions: (k,) unit vectors along them.
        saved: () by which the cable is shorter than over all wheels [m].
    """

    wheel: Array
    direct: Array
    length: Array
    directions: Vectors
    saved: Array


def bypass(layout, places: Vectors, spans: Array, arc: Array, wrap: Array) -> Bypass:
    """The straight ways past the free wheels of a `Layout`.

    Args: places: (n,) of all elements; spans (m,), arc (n,), wrap (n,) of the way over all wheels.
    """
    own, before, after = layout.free_wheels, layout.before_free_wheels, layout.after_free_wheels
    first, second = (jax.tree.map(lambda x, k=k: gather_static(x, k), places) for k in (before, after))
    between = second - first
    length, directions = norm_and_unit(between)
    over = gather_static(spans, before) + gather_static(spans, own) + gather_static(arc, own)
    gain = over - length
    zone = ROUND * jnp.where(length > 0, length, 1.0)
    lies = (gather_static(wrap, own) > 0) & (gain > 0)
    u = jnp.where(lies, jnp.minimum(gain / zone, 1.0), 0.0)
    v = 1.0 - u
    cube = v * v * v
    wheel = 1.0 - cube * (1.0 - 5.0 * u)
    direct = 1.0 - wheel - 4.0 * ROUND * u * u * cube
    return Bypass(wheel, direct, length, directions, jnp.sum(gain * cube * v))
