"""A mechanism at an instant, as the function of a measure sees it."""

import functools
from typing import Any

import jax.numpy as jnp
from jax import Array

from ..checks import place_of
from ..model._system import System, coordinates_by_joint, velocities_by_joint
from ._configuration import VelocityKinematics
from ._poses import frame_twists

_REFUSED = {
    "accelerations": "measure the velocity and filter it: TransferFunction([1, 0], [tau, 1]) has its rate",
    "acceleration": "measure the velocity and filter it: TransferFunction([1, 0], [tau, 1]) has its rate",
    "reactions": "put a stiff spring or a Bushing in place of the joint and measure what it yields",
    "reaction": "put a stiff spring or a Bushing in place of the joint and measure what it yields",
    "efforts": "measure the displacement of the element, and its internal states",
}


class Instant:
    """A mechanism at a time, with its coordinates, velocities and internal states.

    Attributes:
        t: time [s].
        coordinates, velocities: by joint, () for one freedom, else (n,); joints of the tree.
        internal: internal states of force elements and blocks by name, `instant.internal["motor.current"]`.
    """

    def __init__(self, system: System, at: VelocityKinematics) -> None:
        self._system, self._at = system, at
        self.t = at.t

    @functools.cached_property
    def coordinates(self) -> dict[str, Array]:
        return coordinates_by_joint(self._system.topology, self._at.psi)

    @functools.cached_property
    def velocities(self) -> dict[str, Array]:
        return velocities_by_joint(self._system.topology, self._at.u)

    @functools.cached_property
    def internal(self) -> dict[str, Array]:
        return internal_values(self._system)

    def position(self, frame: str) -> Array:
        """World position (3,) of the origin of a frame or body [m].  Raises: UnknownNameError."""
        return self._at.x[self._place(frame)] + self._at.origin

    def rotation(self, frame: str) -> Array:
        """Axes (3, 3) of a frame or body in world axes.  Raises: UnknownNameError."""
        return self._at.R[self._place(frame)]

    def velocity(self, frame: str) -> Array:
        """World velocity (3,) of the origin of a frame or body [m/s].  Raises: UnknownNameError."""
        omega, v = self._twist(frame)
        return v + jnp.cross(omega, self._at.x[self._place(frame)])

    def angular_velocity(self, frame: str) -> Array:
        """World angular velocity (3,) of a frame or body [rad/s].  Raises: UnknownNameError."""
        return self._twist(frame)[0]

    def _twist(self, frame):
        twist = self._twists[self._place(frame)]
        return twist[:3], twist[3:]

    @functools.cached_property
    def _twists(self):
        return frame_twists(self._system, self._at.V)

    def _place(self, frame):
        return place_of("frame", frame, self._system.topology.frame_names)

    def __getattr__(self, name: str) -> Any:
        if name in _REFUSED:
            raise AttributeError(
                f"a signal cannot be one of the {name}, which follow from what blocks drive at the same instant (an "
                f"algebraic loop): {_REFUSED[name]}"
            )
        raise AttributeError(f"an instant has no {name!r}; see jaxmbs.kinematics.Instant")


def internal_values(system: System) -> dict[str, Array]:
    """Internal states by name of a system whose laws and blocks are at them."""
    found: dict[str, Array] = {}
    for group in system.forces:
        for k, element in enumerate(group.names):
            found |= {f"{element}.{name}": group.law.s[name][k] for name, *_ in group.internal}
    for block in system.blocks:
        found |= {f"{block.name}.{name}": value for name, value in (block.s or {}).items()}
    return found
