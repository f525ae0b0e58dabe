"""Links given by points: bodies whose frame is the world frame in the reference pose, with a frame at each point."""

from collections.abc import Mapping
from itertools import pairwise

import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, is_concrete
from ..math._linalg import safe_norm
from ..model import inertia as inertias
from ..model._pose import Pose
from ..runtime import as_array
from ._declarations import Body, Frame

_PLANES = ("xy", "yz", "xz")


def link_parts(name, mass, com, inertia, plane, points: Mapping) -> tuple[Body, list[Frame]]:
    """The body and the frames "name.point" of a link.

    Raises: ValueError, TypeError saying what is wrong with its points.
    """
    if plane not in _PLANES:
        raise ValueError(f"plane must be one of {', '.join(_PLANES)}, got {plane!r}")
    if not points:
        raise ValueError(f"it has no points: give them by name, as in b.link({name!r}, A=(0, 0), B=(1, 0))")
    places = {point: _space_point(point, place, plane) for point, place in points.items()}
    center, unit = _outline_bars(list(places.items()))
    com = center if com is None else _space_point("com", com, plane)
    inertia = mass * unit if inertia is None else inertia
    frames = [Frame(f"{name}.{point}", name, Pose(place)) for point, place in places.items()]
    return Body(name, mass, com, inertia, Pose()), frames


def _space_point(name, place, plane):
    """A point (3,) of two numbers in the plane, or of three."""
    numbers = [as_array(x) for x in place] if isinstance(place, tuple | list) or np.ndim(place) == 1 else []
    if len(numbers) not in (2, 3) or any(x.shape != () for x in numbers):
        raise ValueError(f"{name} must be two numbers in the plane {plane}, or three, got {place!r}")
    if any_concrete(lambda *x: ~np.isfinite(x), *numbers):
        raise ValueError(f"{name} is not finite: {place!r}")
    if len(numbers) == 2:
        numbers.insert("xyz".index(*set("xyz") - set(plane)), as_array(0.0))
    return (np.stack if is_concrete(numbers) else jnp.stack)(numbers)


def _outline_bars(places):
    """Centre of mass and inertia of 1 kg in thin bars along the outline, from point to point and back."""
    closed = [*places, places[0]] if len(places) > 2 else places
    bars = []
    for (first, a), (second, b) in pairwise(closed):
        if any_concrete(lambda a, b: np.all(a == b), a, b):
            raise ValueError(f"its points {first!r} and {second!r} are at one place")
        length = safe_norm(as_array(b - a))
        bars.append((length, (a + b) / 2, inertias.rod(length, length, axis=b - a)))
    if not bars:
        return places[0][1], as_array(np.zeros((3, 3)))
    whole = inertias.combine(bars)
    return whole["com"], whole["inertia"] / whole["mass"]
