"""Free joint: six freedoms, for bodies held by forces or constraints only."""

from ._base import AbstractJoint, Node


class Free(AbstractJoint):
    """Joint that restricts nothing.

    Coordinates: position x, y, z [m] of the child frame in the parent frame, positive along the parent's axes, then
    its quaternion (w, x, y, z), (1, 0, 0, 0) where the frames agree.  Velocities: rates of the position [m/s] in
    parent axes, then the angular velocity [rad/s] in child axes.  Efforts: forces in parent axes [N], then moments
    about child axes [N m].
    """

    nodes = (Node("prismatic", "x"), Node("prismatic", "y"), Node("prismatic", "z"), Node("ball"))
    labels = ("x", "y", "z", "qw", "qx", "qy", "qz")
    symbol = "free"
