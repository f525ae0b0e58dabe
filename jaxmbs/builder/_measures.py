"""Groups of the measures of a declared model."""

from ..blocks._readings import ForceReading, FrameReading, FunctionReading, JointReading, RelativeReading
from ..forces._fields import as_function
from ..joints._base import AbstractJoint
from ..model._signals import MeasureGroup
from ._declarations import Model, resolve_frame


def make_measures(model: Model, add_frame) -> tuple[MeasureGroup, ...]:
    """Measures of a model, those of one reading together; a function of the user stands alone.

    Args: add_frame: adds a frame of (name, body, pose) to those of the system.
    """
    groups: dict = {}
    for item in model.measures.values():
        if item.function is not None:
            reading, places, key = FunctionReading(as_function(item.function)), (), item.name
        elif item.joint is not None:
            reading, places = JointReading(item.of), (item.joint,)
            key = reading, _freedoms(model.joints[item.joint].kind)
        elif item.force is not None:
            reading, places = ForceReading(item.axis), (item.force,)
            key = reading, type(model.forces[item.force].law)
        else:
            places = tuple(_add_ends(item, model, add_frame))
            reading = (FrameReading if len(places) == 1 else RelativeReading)(item.of, item.axis)
            key = reading
        groups.setdefault(key, []).append((item.name, reading, places))
    return tuple(
        MeasureGroup(tuple(name for name, *_ in own), own[0][1], tuple(places for *_, places in own))
        for own in groups.values()
    )


def _freedoms(joint: AbstractJoint):
    """Kinds of the simple joints: joints with the same ones have as many coordinates and velocities."""
    return tuple(node.kind for node in joint.nodes)


def _add_ends(item, model, add_frame):
    """Names of the frames of a measure, which become frames of the system."""
    ends = item.between if item.between is not None else (item.on,)
    for side, end in zip("ab", ends, strict=False):
        name = f"{item.name}.{side}"
        add_frame(name, *resolve_frame(end, model.bodies, model.frames))
        yield name
