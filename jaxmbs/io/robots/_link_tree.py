"""A tree of links, as files of robots describe it, declared to a builder: moving links are bodies, fixed ones frames.

Poses are (rotation, position) pairs of NumPy arrays.
"""

from typing import Any, NamedTuple

import numpy as np

from ...builder import SystemBuilder
from ...builder._arrays import compose_poses
from ...joints import Weld
from ...model._pose import Pose

GROUND = "ground"
IDENTITY = (np.eye(3), np.zeros(3))


class LinkJoint(NamedTuple):
    """One joint of a link: it acts between a frame before it and one behind it, both given in the link."""

    name: str
    kind: Any
    before: tuple = IDENTITY
    behind: tuple = IDENTITY


class TreeLink(NamedTuple):
    """A link in its parent (None: the ground) at `place`, all its joints at zero.

    Inertia (3, 3) about its centre of mass `com`, in its own axes.
    """

    name: str
    parent: str | None
    place: tuple
    joints: tuple[LinkJoint, ...]
    mass: float
    com: np.ndarray
    inertia: np.ndarray

    @property
    def is_fixed(self) -> bool:
        """True if no joint moves it."""
        return all(isinstance(joint.kind, Weld) for joint in self.joints)

    @property
    def bodies(self) -> list[str]:
        """Itself behind its last joint, and massless bodies behind the others."""
        return [f"{self.name}.{joint.name}" for joint in self.joints[:-1]] + [self.name]


class LinkPlacement(NamedTuple):
    """Placement of a link in the mechanism: its body, and its pose in that body."""

    body: str
    pose: tuple


def declare_links(
    builder: SystemBuilder, links: list[TreeLink], welds: bool = False, any_inertia: bool = False
) -> dict[str | None, LinkPlacement]:
    """Bodies, joints and frames of links, parents before children; the home of every link, None that of the ground.

    Args: welds: a fixed link stays a body; else it is a frame of the body that carries it, its mass added there;
        any_inertia: inertias may break A + B >= C.
    """
    homes: dict[str | None, LinkPlacement] = {None: LinkPlacement(GROUND, IDENTITY)}
    parts: dict[str, list] = {}
    for link in links:
        carrier = homes[link.parent]
        fixed = link.is_fixed and not welds
        homes[link.name] = (
            LinkPlacement(carrier.body, compose_poses(carrier.pose, link.place))
            if fixed
            else LinkPlacement(link.name, IDENTITY)
        )
        body, (R, p) = homes[link.name]
        parts.setdefault(body, []).append((link.mass, R @ link.com + p, R @ link.inertia @ R.T))
    for link in links:
        if homes[link.name].body == link.name:
            for hidden in link.bodies[:-1]:
                builder.body(hidden, 0.0)
            builder.body(link.name, **combine_masses(parts[link.name]), any_inertia=any_inertia)
    for link in links:
        body, (rotation, position) = homes[link.name]
        if body == link.name:
            _declare_joints(builder, link, homes[link.parent])
        else:
            builder.frame(link.name, body, position, rotation)
    return homes


def _declare_joints(builder, link, carrier):
    ends = [carrier.body, *link.bodies]
    near = compose_poses(carrier.pose, link.place)
    for joint, parent, child in zip(link.joints, ends[:-1], ends[1:], strict=True):
        builder.joint(
            joint.name,
            joint.kind,
            parent,
            child,
            pose_of_pair(compose_poses(near, joint.before)),
            pose_of_pair(joint.behind),
        )
        near = IDENTITY


def pose_of_pair(pair) -> Pose:
    """A `Pose` from a pair."""
    return Pose(pair[1], pair[0])


def combine_masses(parts) -> dict:
    """Mass, centre and inertia about it of parts (mass, com, inertia), on the host; parts may have no mass."""
    if len(parts) == 1:
        return dict(zip(("mass", "com", "inertia"), parts[0], strict=True))
    mass = sum(m for m, _, _ in parts)
    com = sum((m * c for m, c, _ in parts), np.zeros(3)) / (mass or 1.0)
    inertia = np.zeros((3, 3))
    for m, c, own in parts:
        arm = c - com
        inertia = inertia + own + m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return {"mass": mass, "com": com, "inertia": inertia}
