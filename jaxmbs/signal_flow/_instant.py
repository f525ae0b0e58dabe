"""A mechanism at an instant, as the function of a measure sees it."""

import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import place_of
from ..forces._law_at import LawAt
from ..kinematics._configuration import VelocityKinematics
from ..kinematics._element_flows import element_flows
from ..kinematics._poses import frame_twists
from ..model._system import System, coordinates_by_joint, velocities_by_joint
from ..runtime import gather_static

_REFUSED = {
    "accelerations": "measure the velocity and filter it: TransferFunction([1, 0], [tau, 1]) has its rate",
    "acceleration": "measure the velocity and filter it: TransferFunction([1, 0], [tau, 1]) has its rate",
    "reactions": "put a stiff spring or a Bushing in place of the joint and measure what it yields",
    "reaction": "put a stiff spring or a Bushing in place of the joint and measure what it yields",
    "efforts": "`instant.effort(name)` has that of a force element that no block drives",
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
    def internal(self) -> Mapping[str, Array]:
        return InternalValues(self._system, self._at)

    def position(self, frame: str) -> Array:
        """World position (3,) of the origin of a frame or body [m].  Raises: UnknownNameError."""
        return self.positions([frame])[0]

    def rotation(self, frame: str) -> Array:
        """Axes (3, 3) of a frame or body in world axes.  Raises: UnknownNameError."""
        return self.rotations([frame])[0]

    def velocity(self, frame: str) -> Array:
        """World velocity (3,) of the origin of a frame or body [m/s].  Raises: UnknownNameError."""
        return self.origin_velocities([frame])[0]

    def angular_velocity(self, frame: str) -> Array:
        """World angular velocity (3,) of a frame or body [rad/s].  Raises: UnknownNameError."""
        return self.angular_velocities([frame])[0]

    def positions(self, frames: Sequence[str]) -> Array:
        """World positions (n, 3) of the origins of frames or bodies [m].  Raises: UnknownNameError."""
        return gather_static(self._at.x, self._places(frames)) + self._at.origin[None]

    def rotations(self, frames: Sequence[str]) -> Array:
        """Axes (n, 3, 3) of frames or bodies in world axes.  Raises: UnknownNameError."""
        return gather_static(self._at.R, self._places(frames))

    def origin_velocities(self, frames: Sequence[str]) -> Array:
        """World velocities (n, 3) of the origins of frames or bodies [m/s].  Raises: UnknownNameError."""
        places = self._places(frames)
        twists = gather_static(self._twists, places)
        return twists[:, 3:] + jnp.cross(twists[:, :3], gather_static(self._at.x, places))

    def angular_velocities(self, frames: Sequence[str]) -> Array:
        """World angular velocities (n, 3) of frames or bodies [rad/s].  Raises: UnknownNameError."""
        return gather_static(self._twists, self._places(frames))[:, :3]

    def of_joints(self, joints: Sequence[str], of: str) -> Array:
        """Coordinates or velocities, `of` "position" or "velocity", of joints of as many freedoms: (n,) for one,
        else (n, k)."""
        top = self._system.topology
        values, part = (self._at.psi, "coordinates") if of == "position" else (self._at.u, "velocities")
        places = np.array([np.r_[getattr(top.joints[top.joint_index[name]], part)] for name in joints])
        found = gather_static(values, places.reshape(-1))
        return found if places.shape[1] == 1 else found.reshape(places.shape)

    def effort(self, element: str) -> Array:
        """Effort of a force element [N, N m], () of one number, positive where two points are pushed apart, else
        (n,): that of `reactions(...).law(element)`.

        Raises: UnknownNameError, as for an inextensible cable, whose tension is a reaction; in a build ModelError for
        an element that a block drives, whose effort follows from it.
        """
        return self.efforts_of([element])[0]

    def efforts_of(self, elements: Sequence[str]) -> Array:
        """Efforts (n,), or (n, size), of force elements of one size [N, N m].  Raises: as `effort`."""
        groups = self._system.forces
        names = [(k, name) for k, group in enumerate(groups) for name in group.names]
        known, found = tuple(name for _, name in names), {}
        for k in {names[place_of("force element", element, known)][0] for element in elements}:
            rows = self._efforts_of_group(groups[k])
            found |= dict(zip(groups[k].names, rows[:, 0] if rows.shape[1] == 1 else rows, strict=True))
        return jnp.stack([found[element] for element in elements])

    def _efforts_of_group(self, group):
        port = group.port
        seen, displacement, flow = element_flows(self._system, group, self._at, self._at.V, self._at.u)
        states = {
            name: jnp.stack([self.internal[f"{element}.{name}"] for element in group.names])
            for name, *_ in group.internal
        }
        law = LawAt(group.law, states) if states else group.law
        own = lambda law, seen, x, f: jnp.atleast_1d(port.reading(seen, port.effort(law, x, f, self.t))[0])
        return jax.vmap(own)(law, seen, displacement, flow)

    @functools.cached_property
    def _twists(self):
        return frame_twists(self._system, self._at.V)

    def _places(self, frames):
        return [place_of("frame", frame, self._system.topology.frame_names) for frame in frames]

    def __getattr__(self, name: str) -> Any:
        if name in _REFUSED:
            raise AttributeError(
                f"a signal cannot be one of the {name}, which follow from what blocks drive at the same instant (an "
                f"algebraic loop): {_REFUSED[name]}"
            )
        raise AttributeError(f"an instant has no {name!r}; see jaxmbs.signal_flow.Instant")


class InternalValues(Mapping):
    """Internal states of laws and blocks by name, sliced where they are read."""

    def __init__(self, system: System, at: VelocityKinematics) -> None:
        groups: tuple[Any, ...] = (*system.forces, *system.blocks)
        states = () if at.s is None else (*at.s.laws, *at.s.blocks)
        self._places = {
            f"{element}.{name}": (value, k)
            for group, s in zip(groups, states, strict=False)
            for name, value in s.items()
            for k, element in enumerate(group.names)
        }

    def __getitem__(self, name: str) -> Array:
        values, k = self._places[name]
        return values[k]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)
