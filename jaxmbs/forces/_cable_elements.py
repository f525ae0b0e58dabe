"""Elements of a cable's path, as `SystemBuilder.cable` takes them: ends, eyelets, sheaves, cylinders and spheres."""

from typing import Any, NamedTuple

from ..typing import ArrayLike


class Attachment(NamedTuple):
    """An end of a cable, fixed at the origin of a frame.

    Attributes:
        at: body or frame name, (body, point) or (body, Pose).
    """

    at: Any


class Winch(NamedTuple):
    """The first end of a cable, on a drum that pays it out: its free length grows by the radius times the angle.

    The drum feels the tension times the radius about its joint, and the frame the pull of the cable.

    Attributes:
        at: frame where the cable leaves the drum, on the body that carries the drum: body or frame name, (body,
            point) or (body, Pose).
        joint: name of the drum's joint, of one coordinate.
        radius: of the drum and half the cable [m].
        side: "+" if a positive turn of the joint pays out, "-" if it winds in.
    """

    at: Any
    joint: str
    radius: ArrayLike
    side: str = "+"


class Eyelet(NamedTuple):
    """A point that a cable passes through.

    Attributes:
        at: body or frame name, (body, point) or (body, Pose).
        friction: coefficient against the cable; None takes that of the cable.
    """

    at: Any
    friction: ArrayLike | None = None


class Sheave(NamedTuple):
    """A grooved wheel: the cable lies on a circle in the plane of the wheel.

    Attributes:
        at: frame at the centre of the wheel: body or frame name, (body, point) or (body, Pose).
        radius: from the centre to the middle of the cable [m].
        side: "+" if the cable goes round it in the positive sense about the axis on its way, "-" for the other sense.
        axis: "x", "y", "z" or three numbers in the axes of the frame.
        turns: whole turns about it beside the wrap, which is found between -1/4 and 3/4 of a turn.
        friction: coefficient between wheel and cable; None takes that of the cable.
    """

    at: Any
    radius: ArrayLike
    side: str = "+"
    axis: str | ArrayLike = "z"
    turns: int = 0
    friction: ArrayLike | None = None


class WrapCylinder(NamedTuple):
    """A smooth cylinder between two points of the cable, which lies on it in a helix; attributes as of `Sheave`.

    Attributes:
        at: frame on the cylinder's axis.
        radius: of the cylinder and half the cable [m].
        side: "+" if the cable goes round it in the positive sense about the axis on its way, "-" for the other sense.
        axis: "x", "y", "z" or three numbers in the axes of the frame.
        turns: whole turns about it beside the wrap.
        friction: coefficient against the cable; None takes that of the cable.
    """

    at: Any
    radius: ArrayLike
    side: str = "+"
    axis: str | ArrayLike = "z"
    turns: int = 0
    friction: ArrayLike | None = None


class WrapSphere(NamedTuple):
    """A smooth sphere between two points of the cable, which lies on a great circle.

    Attributes:
        at: frame at the centre of the sphere.
        radius: of the sphere and half the cable [m].
        side: "+" if the cable goes round it in the positive sense about the axis on its way, "-" for the other sense.
        axis: "x", "y", "z" or three numbers in the axes of the frame, about along that of the great circle, which is
            at right angles to the plane of the centre and the two neighbours.
        friction: coefficient against the cable; None takes that of the cable.
    """

    at: Any
    radius: ArrayLike
    side: str = "+"
    axis: str | ArrayLike = "z"
    friction: ArrayLike | None = None
