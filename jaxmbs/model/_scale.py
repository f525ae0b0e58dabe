"""Numbers far out of a model's own scale, as of millimetres among metres or degrees among radians, in sentences."""

from collections.abc import Iterator

import numpy as np

from ..checks import is_concrete
from ..errors import warn
from ..tables import format_number

#: How many times the next smaller one a length or a mass is before it is doubted: units differ by a thousand.
_FAR = {"length": 100.0, "mass": 1e5}
_FEWEST = {"length": 3, "mass": 4}  # numbers that have a scale


def scale_lines(system) -> list[str]:
    """A sentence for each number that is doubted; of a traced model none."""
    if not is_concrete(system) or np.ndim(system.mass) != 1:  # traced, or of a batch
        return []
    masses = zip(
        (f"the mass of body {n!r}" for n in system.topology.body_names), np.asarray(system.mass), strict=True
    )
    return [
        *_outliers(list(_lengths(system)), "length", "m", "millimetres"),
        *_outliers(list(masses), "mass", "kg", "grams"),
        *_swings(system),
    ]


def warn_of_scale(system) -> None:
    """Warn of numbers that are far out of the model's own scale."""
    for line in scale_lines(system):
        warn(line)


def _lengths(system) -> Iterator[tuple[str, float]]:
    top = system.topology
    for name, point in zip(top.body_names, np.asarray(system.com), strict=True):
        yield f"the centre of mass of body {name!r}", float(np.linalg.norm(point))
    bodies = ("ground", *top.body_names)
    for name, body, point in zip(top.frame_names, top.frame_body, np.asarray(system.frames.position), strict=True):
        yield f"frame {name!r} of {bodies[body + 1]!r}", float(np.linalg.norm(point))
    for group in system.forces:
        lengths = getattr(group.law, "free_length", None)  # of a rope it may be a function of time
        if group.port.is_on_line and hasattr(lengths, "dtype"):
            yield from (
                (f"the free length of {n!r}", float(x)) for n, x in zip(group.names, np.asarray(lengths), strict=True)
            )


def _outliers(found, kind, unit, other):
    """The one number that is far above all others, if they have a scale."""
    found = sorted((x for x in found if x[1] > 0), key=lambda x: x[1])
    if len(found) < _FEWEST[kind]:  # too few for a scale
        return
    (name, most), (_, next_one) = found[-1], found[-2]
    if most > _FAR[kind] * next_one:
        number = f"{format_number(most)} {unit}, {format_number(most / next_one)} times"
        yield f"{name} is {number} the next largest {kind}: is it in {other}?"


def _swings(system):
    """Drives of angles that swing by more than a turn."""
    top = system.topology
    for group in system.rows:
        amplitude = getattr(getattr(group.law, "signal", None), "amplitude", None)
        for name, size in zip(group.names, np.reshape(() if amplitude is None else amplitude, -1), strict=False):
            joint = top.joints[top.joint_index[name]] if name in top.joint_index else None
            if joint is not None and joint.units == ("rad",) and abs(size) > 2 * np.pi:
                yield f"the drive of joint {name!r} swings by {format_number(abs(size))} rad: angles are in radians"
