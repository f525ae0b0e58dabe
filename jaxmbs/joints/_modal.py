"""Modal coordinates of an elastic body: freedoms that move no frame."""

import equinox as eqx

from ._base import AbstractJoint, Node


class Modal(AbstractJoint):
    """`count` coordinates of the state beside those of joints; made by `SystemBuilder.elastic`.

    Coordinates: amplitudes of fixed-interface modes of unit modal mass [m kg^1/2].
    """

    symbol = "none"

    count: int = eqx.field(static=True)

    @property
    def nodes(self):
        return (Node("prismatic"),) * self.count

    @property
    def units(self):
        return ("m kg^1/2",) * self.count

    @property
    def labels(self):
        return tuple(f"mode {k}" for k in range(self.count))
