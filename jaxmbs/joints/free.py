"""Free joint: six freedoms, for bodies held by forces or constraints only."""

from .base import AbstractJoint, Node


class Free(AbstractJoint):
    """All motions.

    Coordinates: position x, y, z [m] of the child frame in the parent frame, then its quaternion (w, x, y, z);
    velocities: rates of the position [m/s] (parent axes), then the angular velocity [rad/s] in child axes.
    """

    nodes = (Node("prismatic", "x"), Node("prismatic", "y"), Node("prismatic", "z"), Node("ball"))
    labels = ("x", "y", "z", "qw", "qx", "qy", "qz")
