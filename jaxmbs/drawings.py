"""Drawings: the shapes by which a thing says how it looks.

A law, a pair of surfaces, a cable, a constraint or an elastic body has a `drawing()`: shapes in the frames that it
acts on, which have the numbers 0, 1, ...; for a law on a joint these are the frames of its parent and its child.
Line drawings and scenes (`viz`) draw the shapes and know no thing.  Lengths are in metres, colours "#rrggbb", by
default that of the body.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from .typing import ArrayLike, ScalarLike

#: Symbols of elements between two frames, or along or about the axis of a joint; "maxwell" is a spring and a damper
#: in series.
SYMBOLS = ("spring", "damper", "maxwell", "actuator", "cylinder", "bushing", "rod", "beam")

#: Symbols of joints: pictures show a "point" by a ring alone, "free" and "none" not at all.
JOINT_SYMBOLS = ("pin", "screw", "cross", "ball", "plane", "slide", "sleeve", "weld", "point", "free", "none")


class Symbol(NamedTuple):
    """A symbol, one of `SYMBOLS`, from a frame to another one.

    On a joint it lies along the axis where this slides, and about it where this turns.  Several between the same
    frames stand side by side.
    """

    kind: str
    frames: tuple[int, int] = (0, 1)


class Ball(NamedTuple):
    """A ball about the origin of a frame; `is_clear` where one shall see through it."""

    radius: ScalarLike
    frame: int = 0
    is_clear: bool = False
    color: str = ""


class Box(NamedTuple):
    """A box of edges (3,) about the origin of a frame, along its axes."""

    size: ArrayLike
    frame: int = 0
    color: str = ""


class Cylinder(NamedTuple):
    """A cylinder about an axis (3,) of a frame, its origin in the middle."""

    radius: ScalarLike
    length: ScalarLike
    frame: int = 0
    axis: ArrayLike = (0.0, 0.0, 1.0)
    color: str = ""


class Wheel(NamedTuple):
    """A wheel about an axis (3,) of a frame, or of the joint (None); of width 0 it is as thick as bars are."""

    radius: ScalarLike
    width: ScalarLike = 0.0
    frame: int = 0
    axis: ArrayLike | None = (0.0, 0.0, 1.0)
    color: str = ""


class Gear(NamedTuple):
    """A toothed wheel about the axis z of a frame, of a pitch radius; a ring gear has its teeth inside.

    `first` is the angle of the middle of a tooth from the axis x [rad].
    """

    radius: ScalarLike
    width: ScalarLike
    teeth: int
    first: ScalarLike = 0.0
    frame: int = 0
    is_ring: bool = False
    color: str = ""


class Tube(NamedTuple):
    """The wall of a tube about the axis z of a frame, of no length as long as the other frames move in it."""

    radius: ScalarLike
    length: ScalarLike | None = None
    frame: int = 0


class Plane(NamedTuple):
    """The plane z = 0 of a frame, as large as the other frames move over it."""

    frame: int = 0


class Outline(NamedTuple):
    """A plate in the plane x y of a frame within points (n, 2), the first not repeated; clockwise: a wall."""

    points: ArrayLike
    frame: int = 0


class HeightSurface(NamedTuple):
    """A surface z = height(x, y) over a frame, between two values of x, as wide as the other frames move over it."""

    height: Callable[[Any, Any], Any]
    ends: tuple[ScalarLike, ScalarLike]
    frame: int = 0


class Path(NamedTuple):
    """A line through points (n, 3) of a frame."""

    points: ArrayLike
    frame: int = 0
    color: str = ""


class Rail(NamedTuple):
    """A straight line through the origin of a frame along its axis (3,), as long as the other frames move along it;
    `is_short`: a small part of the picture, as of a blade."""

    frame: int = 0
    axis: ArrayLike = (0.0, 0.0, 1.0)
    is_short: bool = False
    color: str = ""


class Thread(NamedTuple):
    """A line that moves with several frames, such as a rope.

    Attributes:
        course: `course(rotations (n, 3, 3), positions (n, 3))`, of all frames in world axes, gives both ends
            (m, 2, 3) of its straight parts, and points (k, 3) along all of it.
        ends: numbers of the frames where it is tied.
    """

    course: Callable[[Any, Any], tuple[Any, Any]]
    ends: tuple[int, ...] = ()


class Marks(NamedTuple):
    """Points where two frames touch: `points(R, d)` (k, 3) [m] in the axes of the first, from the rotation R (3, 3)
    and the place d (3,) of the second in it; NaN where they do not touch."""

    points: Callable[[Any, Any], Any]


#: Shapes of one thing.
Drawing = tuple[Any, ...]
