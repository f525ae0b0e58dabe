"""Ports over several frames, such as those of a cable; see `_port.py`."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from ..math._linalg import skew
from ..math._spatial import cross, to_public_order
from ._base import PathKinematics
from ._frame_motion import frame_motions
from ._port import AbstractPort


@dataclasses.dataclass(frozen=True)
class PathPort(AbstractPort):
    """Several frames: the flow is the angular velocity and the velocity of the origin of each, in world axes."""

    num_frames: int = 2

    @property
    def num_flows(self):
        return 6 * self.num_frames

    def frames_of(self, group, k):
        return group.frames[k]

    def still(self, num_coordinates, num_velocities):
        n = self.num_frames
        poses = jnp.broadcast_to(jnp.eye(3), (n, 3, 3)), jnp.zeros((n, 3))
        return (PathKinematics(*poses, jnp.zeros((n, 3)), jnp.zeros((n, 3))),)

    def reference(self, frames, *drum):
        return jnp.eye(3, dtype=frames.x.dtype), jnp.zeros_like(frames.x[0])

    def gather(self, group, at, V, u):
        return (frame_motions(group.frames, at, V),)

    def displacement(self, frames):
        return frames.R, frames.x

    def flow(self, frames):
        spin = frames.V[:, :3]
        return jnp.concatenate([spin, frames.V[:, 3:] + cross(spin, frames.x)], axis=1).reshape(-1)

    def rate(self, displacement, flow):
        spin, velocity = _spins_and_velocities(flow)
        return jax.vmap(skew)(spin) @ displacement[0], velocity

    def arguments(self, displacement, flow):
        return displacement, _spins_and_velocities(flow)

    def effort(self, law, displacement, flow, t):
        law, frames = self.law_and_motion(law, displacement, flow)
        return _moments_first(law.wrench(frames, t))

    def storage_power(self, law, displacement, flow, t):
        law, frames = self.law_and_motion(law, displacement, flow)
        return law.storage_power(frames, t)

    def effort_and_storage_power(self, law, displacement, flow, t):
        law, frames = self.law_and_motion(law, displacement, flow)
        wrench, storing = law.wrench_and_storage_power(frames, t)
        return _moments_first(wrench), storing

    def law_and_arguments(self, law, displacement, flow):
        law, frames = self.law_and_motion(law, displacement, flow)
        return law, (frames,)

    def potential_and_validity(self, law, displacement, flow, t):
        law, frames = self.law_and_motion(law, displacement, flow)
        return law.potential_and_validity(frames, t)

    def law_and_motion(self, law, displacement, flow):
        """The law as it acts now, and the motion of its frames."""
        return law, PathKinematics(*displacement, *_spins_and_velocities(flow))

    def reading(self, seen, effort):
        return jax.vmap(to_public_order)(effort.reshape(-1, 6)).reshape(-1), None, None

    def spread(self, group, seen, efforts, owners, num_velocities):
        wrenches = efforts.reshape(-1, 6)
        places = seen[0].x.reshape(-1, 3)
        moments, forces = wrenches[:, :3], wrenches[:, 3:]
        about_origin = jnp.concatenate([moments + cross(places, forces), forces], axis=1)
        return owners.collect(np.asarray(group.frames).reshape(-1), about_origin), None

    def stiffness(self, law, displacement, flow, t):
        return self.slope(law, displacement, flow, t)


@dataclasses.dataclass(frozen=True)
class WinchPort(PathPort):
    """The frames of a path and the joint of a drum, whose angle and rate come last in displacement and flow.

    Attributes:
        velocity, coordinate: places of the joint's own.
    """

    velocity: int = 0
    coordinate: int = 0

    @property
    def num_flows(self):
        return 6 * self.num_frames + 1

    def gather(self, group, at, V, u):
        drum = jnp.stack([at.psi[self.coordinate], u[self.velocity]])
        return *super().gather(group, at, V, u), jnp.broadcast_to(drum, (len(group.names), 2))

    def displacement(self, frames, drum):
        return *super().displacement(frames), drum[0]

    def flow(self, frames, drum):
        return jnp.append(super().flow(frames), drum[1])

    def rate(self, displacement, flow):
        return *super().rate(displacement[:2], flow[:-1]), flow[-1]

    def arguments(self, displacement, flow):
        return displacement, (*_spins_and_velocities(flow[:-1]), flow[-1])

    def law_and_motion(self, law, displacement, flow):
        *poses, turned = displacement
        return law.paid_out(turned, flow[-1]), PathKinematics(*poses, *_spins_and_velocities(flow[:-1]))

    def potential(self, law, displacement, t):
        *poses, turned = displacement
        return law.paid_out(turned, jnp.zeros_like(turned)).potential(*poses, t)

    def effort(self, law, displacement, flow, t):
        return self.effort_and_storage_power(law, displacement, flow, t)[0]

    def storage_power(self, law, displacement, flow, t):
        return self.effort_and_storage_power(law, displacement, flow, t)[1]

    def effort_and_storage_power(self, law, displacement, flow, t):
        now, frames = self.law_and_motion(law, displacement, flow)
        pull = now.pull(frames, t)
        drum = law.drum_radius * pull.each_tension[0]
        storing = pull.elastic * (pull.rate - law.drum_radius * flow[-1])
        return jnp.append(_moments_first(pull.wrench(law.layout)), drum), storing

    def reading(self, seen, effort):
        on_frames = super().reading(seen, effort[:-1])[0]
        return jnp.append(on_frames, effort[-1]), None, None

    def spread(self, group, seen, efforts, owners, num_velocities):
        on_frames, _ = super().spread(group, seen, efforts[:, :-1], owners, num_velocities)
        return on_frames, jnp.zeros(num_velocities, efforts.dtype).at[self.velocity].add(jnp.sum(efforts[:, -1]))


def _spins_and_velocities(flow):
    """Angular velocities (n, 3) and velocities (n, 3) of the frames of a path."""
    twists = flow.reshape(-1, 6)
    return twists[:, :3], twists[:, 3:]


def _moments_first(wrench):
    """Wrenches of all frames of a path (6 n,), moment first, from forces and moments (n, 3)."""
    force, moment = wrench
    return jnp.concatenate([moment, force], axis=1).reshape(-1)
