"""Derivatives of a cable's length by the poses of its frames, in closed form from its tangents.

A span of direction e adds `e . (v_end - v_start)` to the rate of the length, with the velocities of the points of
the bodies under its ends: the points of contact themselves are stationary where the path is the shortest one.  On a
sheave whose span leaves the plane of the wheel they are not, as the groove holds the cable: the length has the slope
`r (1 - e . u)` by the angle of contact, with the tangent u of the circle.  That angle follows from the condition
that the span is at right angles to the radius, whose multiplier adds a force along the radius.
"""

import jax.numpy as jnp

from ..math._vector import Vectors, cross, dot


def length_slopes(layout, circles, path) -> tuple[Vectors, Vectors]:
    """Derivatives (n,) of the length by the places of the frames and by small turns of them, in world axes.

    Args:
        circles: the `Circles` of the path; path: the `CablePath` over them.
    """
    first, second = layout.ends(circles.place)
    pull, on_first, on_second = path.directions, None, None
    if "sheave" in layout.kinds:
        one, other = _contact_multipliers(layout, circles, path)
        n, m = path.normals
        span = path.end - path.start
        pull = pull + n * one + m * other
        on_first, on_second = cross(n * one, span), cross(m * other, span)
    if path.bypass is not None:
        share = layout.at_spans(path.bypass.wheel, 1.0)
        pull = pull * share
        on_first, on_second = (x if x is None else x * share for x in (on_first, on_second))
    turn_first, turn_second = cross(pull, path.start - first), cross(path.end - second, pull)
    if on_first is not None:
        turn_first, turn_second = turn_first + on_first, turn_second + on_second
    on_places = layout.before(pull) - layout.after(pull)
    if path.bypass is not None:
        past = path.bypass.directions * path.bypass.direct
        on_places = on_places + layout.at_elements(past, layout.after_free_wheels)
        on_places = on_places - layout.at_elements(past, layout.before_free_wheels)
    return on_places, layout.before(turn_second) + layout.after(turn_first)


def _contact_multipliers(layout, circles, path):
    """Multipliers (m,) of the two conditions of each span, zero at points, cylinders and spheres."""
    first, second = layout.ends(circles)
    own = layout.ends(layout.elements("sheave"))
    (n, m), span, e = path.normals, path.end - path.start, path.directions
    u, v = cross(first.axis, n), cross(second.axis, m)
    r, q = first.radius * own[0], second.radius * own[1]
    slope = r * (1.0 - dot(e, u)), q * (dot(e, v) - 1.0)
    aa, bb = (jnp.where(mask, dot(t, span), 1.0) for mask, t in zip(own, (u, v), strict=True))
    ab, ba = own[0] * q * dot(n, v), -own[1] * r * dot(m, u)
    det = aa * bb - ab * ba
    safe = jnp.where(det == 0, 1.0, det)
    return (ba * slope[1] - bb * slope[0]) / safe, (ab * slope[0] - aa * slope[1]) / safe
