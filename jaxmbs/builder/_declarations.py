"""Declarations of a model: bodies, frames, joints, forces and constraints, before they become a system.

`Annotated[Any, kind]`: a declaration of another kind is refused by a message of `_validation`, not by a type error;
model files read the kind.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any

from jax import Array

from ..blocks import AbstractBlock
from ..forces._base import AbstractLaw
from ..friction import AbstractFriction
from ..hydraulics import AbstractHydraulicElement, AbstractNode
from ..joints import AbstractClosure, AbstractRows
from ..joints._base import AbstractJoint
from ..model._pose import Pose
from ..model._topology import CircuitRecord
from ..typing import ArrayLike, FrameLike

GROUND = "ground"


@dataclass
class Body:
    """A rigid body as declared; pose is its world pose in the reference pose, or None.

    `any_inertia`: True if its principal inertias may violate A + B >= C.
    """

    name: str
    mass: Annotated[Any, ArrayLike]
    com: Annotated[Any, ArrayLike]
    inertia: Annotated[Any, ArrayLike]
    pose: Pose | None
    any_inertia: bool = False


@dataclass
class Frame:
    """A named frame fixed in a body, or in another frame."""

    name: str
    body: str
    pose: Pose


@dataclass
class Joint:
    """A joint as declared.

    Its ends are references to bodies or frames, their frames None, a point, a Pose or the name of a frame; `at` is a
    world point or the name of a frame; `guess` are its coordinates in the pose of use.
    """

    name: str
    kind: Annotated[Any, AbstractJoint]
    parent: Annotated[Any, FrameLike]
    child: Annotated[Any, FrameLike]
    parent_frame: Annotated[Any, str | Pose | ArrayLike | None]
    child_frame: Annotated[Any, str | Pose | ArrayLike | None]
    at: Annotated[Any, str | ArrayLike | None]
    drive: Annotated[Any, Callable | ArrayLike | None] = None
    is_hidden: bool = False
    is_elastic: bool = False
    guess: Annotated[Any, ArrayLike | None] = None


@dataclass
class ForceElement:
    """A force element as declared, with its port."""

    name: str
    law: Annotated[Any, AbstractLaw]
    between: Annotated[Any, tuple | list | None]
    joint: str | None
    on: Annotated[Any, FrameLike | None]


@dataclass
class Friction:
    """Friction of a joint as declared."""

    name: str
    joint: str
    friction: Annotated[Any, AbstractFriction]
    radius: Annotated[Any, ArrayLike | None] = None
    preload: Annotated[Any, ArrayLike] = 0.0
    length: Annotated[Any, ArrayLike | None] = None


@dataclass
class Constraint:
    """Rows between two frames, of a cable over several, between joint coordinates, or given by the user."""

    name: str
    law: Annotated[Any, AbstractJoint | AbstractRows]
    between: Annotated[Any, tuple | list | None]


@dataclass
class Hydraulic:
    """An element or node of a hydraulic circuit, with the nodes at its ports."""

    name: str
    element: Annotated[Any, AbstractHydraulicElement | AbstractNode]
    ports: Annotated[Any, dict | None]
    signal: Annotated[Any, str | Callable | ArrayLike | None] = None
    shaft: str | None = None


@dataclass
class Measure:
    """A signal: of a joint, a force element, between two frames, of one frame, or a function of the instant."""

    name: str
    function: Annotated[Any, Callable | None] = None
    joint: str | None = None
    between: Annotated[Any, tuple | list | None] = None
    on: Annotated[Any, FrameLike | None] = None
    of: str = "position"
    axis: str | None = None
    force: str | None = None


@dataclass
class Block:
    """A block with what it reads and drives; `mix` are factors (inputs, entries) of what it reads in each input."""

    name: str
    block: Annotated[Any, AbstractBlock]
    reads: Annotated[Any, str | tuple | list | Callable]
    drives: Annotated[Any, str | tuple | list | None] = None
    every: Annotated[Any, ArrayLike | None] = None
    mix: tuple[tuple[int, ...], ...] | None = None


@dataclass
class Model:
    """All declarations of a model, by name; `circuits` are its hydraulic ones where they have become blocks."""

    gravity: Array
    bodies: dict[str, Body] = field(default_factory=dict)
    frames: dict[str, Frame] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    forces: dict[str, ForceElement] = field(default_factory=dict)
    constraints: dict[str, Constraint] = field(default_factory=dict)
    elastic: dict[str, Any] = field(default_factory=dict)
    hydraulics: dict[str, Hydraulic] = field(default_factory=dict)
    measures: dict[str, Measure] = field(default_factory=dict)
    blocks: dict[str, Block] = field(default_factory=dict)
    friction: dict[str, Friction] = field(default_factory=dict)
    circuits: tuple[CircuitRecord, ...] = ()


def as_pose(value) -> Pose:
    """A pose from None, a point or a pose."""
    if value is None:
        return Pose()
    return value if isinstance(value, Pose) else Pose(value)


def resolve_frame(reference, bodies, frames) -> tuple[str, Pose]:
    """Body name and pose in body axes of a reference: a body or frame name, or (body, point | Pose).

    Raises: KeyError with the unknown name.
    """
    if isinstance(reference, str):
        if reference == GROUND or reference in bodies:
            return reference, Pose()
        frame = frames[reference]
        return frame.body, frame.pose
    body, place = reference
    if body != GROUND and body not in bodies:
        raise KeyError(body)
    return body, as_pose(place)


def joint_frame(value: Any, frames: dict[str, Frame]) -> Pose:
    """Pose in body axes of a joint's frame: None, a point, a Pose, or the name of a frame."""
    if isinstance(value, str):
        return frames[value].pose
    return as_pose(value)


def has_one_coordinate(joint: Joint) -> bool:
    """True if a joint has one coordinate; joints of an invalid kind are reported elsewhere and pass."""
    if not isinstance(joint.kind, AbstractJoint) or isinstance(joint.kind, AbstractClosure):
        return True
    return len(joint.kind.nodes) == 1 and joint.kind.nodes[0].kind != "ball"
