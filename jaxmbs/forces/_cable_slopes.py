"""Derivatives of a cable's length by the poses of its frames, in closed form from its tangents.

A span of direction e adds `e . (v_end - v_start)` to the rate of the length, with the velocities of the points of
the bodies under its ends: the points of contact themselves are stationary where the path is the shortest one.  On a
sheave whose span leaves the plane of the wheel they are not, as the groove holds the cable: the length has the slope
`r (1 - e . u)` by the angle of contact, with the tangent u of the circle.  That angle follows from the condition
that the span is at right angles to the radius, whose multiplier adds a force along the radius.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..math._vector import Vectors, cross, dot
from ..runtime import constant_product


class _Contact(NamedTuple):
    """Ends of spans on circles.

    Attributes:
        place: ones (n, m) at the element of each.
        normal: unit vectors (m,) from the axis to the point; axis, radius: of the circle.
        arm: (m,) from the centre to the point, turned round where the span begins there.
        side: (m,) of sheaves 1 where the span begins, -1 where it ends; zero at what is none.
    """

    place: np.ndarray
    normal: Vectors
    axis: Vectors
    radius: Array
    arm: Vectors
    side: np.ndarray


def length_slopes(layout, path) -> tuple[Array, Array]:
    """Derivatives (n, 3) of the length by the places of the frames and by small turns of them, in world axes.

    Args: path: a `CablePath`.
    """
    contacts, pull = _contacts(layout, path), path.directions
    grooves: list[Vectors] = []
    if "sheave" in layout.kinds:
        multipliers = (_of_one if len(contacts) == 1 else _of_two)(contacts, path)
        grooves = [contact.normal * k for contact, k in zip(contacts, multipliers, strict=True)]
        for groove in grooves:
            pull = pull + groove
    turns = [cross(contact.arm, pull) for contact in contacts]
    if grooves:
        span = path.end - path.start
        turns = [turn + cross(groove, span) for turn, groove in zip(turns, grooves, strict=True)]
    if path.bypass is not None:
        share = layout.at_spans(path.bypass.wheel, 1.0)
        pull, turns = pull * share, [turn * share for turn in turns]
    on_places = constant_product(layout.reaches - layout.begins, pull.rows)
    if path.bypass is not None:
        past = path.bypass.directions * path.bypass.direct
        on_places = on_places + constant_product(layout.beside_free_wheels, past.rows)
    on_turns = (constant_product(contact.place, turn.rows) for contact, turn in zip(contacts, turns, strict=True))
    return on_places, sum(on_turns)  # type: ignore[return-value]


def _contacts(layout, path) -> list[_Contact]:
    """Both ends of the spans, or those on circles where no span has two."""
    (first, second), (n, m) = path.elements, path.normals
    begins, ends = layout.ends(layout.elements("sheave"))
    back, arm = first.place - path.start, path.end - second.place
    if layout.has_two_circles:
        return [
            _Contact(layout.begins, n, first.axis, first.radius, back, begins),
            _Contact(layout.reaches, m, second.axis, second.radius, arm, -ends),
        ]
    place = layout.begins * layout.leaves + layout.reaches * (1.0 - layout.leaves)
    radius, axis = first.radius + second.radius, first.axis + second.axis
    return [_Contact(place, n + m, axis, radius, back + arm, begins - ends)]


def _of_one(contacts: Sequence[_Contact], path) -> list[Array]:
    """Multipliers (m,) of the condition of each span, zero at points, cylinders and spheres."""
    (k,) = contacts
    u = cross(k.axis, k.normal)
    along = jnp.where(k.side != 0, dot(u, path.end - path.start), 1.0)
    slope = k.radius * k.side * (dot(path.directions, u) - 1.0)
    return [slope / jnp.where(along == 0, 1.0, along)]


def _of_two(contacts: Sequence[_Contact], path) -> list[Array]:
    """Multipliers (m,) of the two conditions of each span, zero at points, cylinders and spheres."""
    i, j = contacts
    span, e = path.end - path.start, path.directions
    u, v = cross(i.axis, i.normal), cross(j.axis, j.normal)
    r, q = i.radius * i.side, j.radius * j.side
    slope = r * (1.0 - dot(e, u)), q * (1.0 - dot(e, v))
    aa, bb = (jnp.where(k.side != 0, dot(t, span), 1.0) for k, t in ((i, u), (j, v)))
    ab, ba = np.abs(i.side) * -q * dot(i.normal, v), j.side * r * dot(j.normal, u)
    det = aa * bb - ab * ba
    safe = jnp.where(det == 0, 1.0, det)
    return [(ba * slope[1] - bb * slope[0]) / safe, (ab * slope[0] - aa * slope[1]) / safe]
