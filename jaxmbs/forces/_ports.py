"""Ports on two points, two frames, one frame, several, a joint coordinate, and the whole system; see `_port.py`.

Source: S2 (56)-(67), (72) on points, (76) at one frame.
"""

import abc
import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..math._linalg import direction, safe_norm, skew
from ..math._spatial import cross, to_public_order
from ..runtime import gather_static, segment_sum_static
from ._base import AbstractBodyLaw, AbstractPathLaw, AbstractPoseLaw, AbstractScalarLaw, PathKinematics
from ._port import AbstractPort
from ._state_laws import AbstractBodyStateLaw, AbstractPoseStateLaw, AbstractScalarStateLaw


class FrameMotion(NamedTuple):
    """A frame: rotation (3, 3), position (3,) and twist (6,) of its body, all about one origin."""

    R: Array
    x: Array
    V: Array

    @property
    def spin(self):
        return self.V[:3]

    @property
    def velocity(self):
        """Velocity of the frame's own origin."""
        return self.V[3:] + skew(self.V[:3]) @ self.x


class _BetweenFrames(AbstractPort):
    """Ports on frames; their law's wrench acts on the body of B, the opposite one on that of A."""

    def gather(self, group, at, V, u):
        return tuple(_frame_motions(side, at, V) for side in (group.first, group.second))

    @abc.abstractmethod
    def wrench(self, a, b, effort):
        """Wrenches (6,) on the frames A and B about the origin."""

    def spread(self, group, seen, efforts, owners, num_velocities):
        on_a, on_b = jax.vmap(self.wrench)(*seen, efforts)
        return owners.collect((*group.first, *group.second), jnp.concatenate([on_a, on_b])), None


class LinePort(_BetweenFrames):
    """Two points: the flow is the velocity of B from A, the effort the force on B."""

    num_flows = 3

    def displacement(self, a, b):
        return (b.x - a.x,)

    def flow(self, a, b):
        return b.velocity - a.velocity

    def rate(self, displacement, flow):
        return (flow,)

    def arguments(self, displacement, flow):
        (d,) = displacement
        return (safe_norm(d),), (jnp.dot(direction(d), flow),)

    def effort(self, law, displacement, flow, t):
        return law.line_force(*displacement, flow, t)

    def potential(self, law, displacement, t):
        return law.line_potential(*displacement, t)

    def reading(self, seen, effort):
        a, b = seen
        return jnp.dot(direction(b.x - a.x), effort)[None], effort, jnp.zeros_like(effort)

    def wrench(self, a, b, effort):
        wrench = _wrench_at(b.x, jnp.zeros_like(effort), effort)
        return -wrench, wrench

    def stiffness(self, law, displacement, flow, t):
        (d,) = displacement
        n = direction(d)
        return _curvature(law, safe_norm(d), t) * jnp.outer(n, n)


class PosePort(_BetweenFrames):
    """Two frames: the flow is the twist of B from A in the axes of A, rotation first."""

    num_flows = 6

    def displacement(self, a, b):
        return a.R.T @ b.R, a.R.T @ (b.x - a.x)

    def flow(self, a, b):
        slide = b.velocity - a.velocity - skew(a.spin) @ (b.x - a.x)
        return jnp.concatenate([a.R.T @ (b.spin - a.spin), a.R.T @ slide])

    def rate(self, displacement, flow):
        return skew(flow[:3]) @ displacement[0], flow[3:]

    def arguments(self, displacement, flow):
        return displacement, (flow[:3], flow[3:])

    def effort(self, law, displacement, flow, t):
        return _moment_first(law.wrench(*displacement, flow[:3], flow[3:], t))

    def reading(self, seen, effort):
        R = seen[0].R
        return to_public_order(effort), R @ effort[3:], R @ effort[:3]

    def wrench(self, a, b, effort):
        wrench = _wrench_at(b.x, a.R @ effort[:3], a.R @ effort[3:])
        return -wrench, wrench

    def stiffness(self, law, displacement, flow, t):
        return self.slope(law, displacement, flow, t)


class FramePort(_BetweenFrames):
    """A load at one frame: the flow is its twist in world axes, rotation first."""

    num_flows = 6

    def gather(self, group, at, V, u):
        return _frame_motions(group.first, at, V), gather_static(at.x, np.asarray(group.first)) + at.origin[None]

    def displacement(self, a, place):
        return a.R, place

    def flow(self, a, place):
        return jnp.concatenate([a.spin, a.velocity])

    def rate(self, displacement, flow):
        return skew(flow[:3]) @ displacement[0], flow[3:]

    def arguments(self, displacement, flow):
        return displacement, (flow[:3], flow[3:])

    def effort(self, law, displacement, flow, t):
        return _moment_first(law.wrench(*displacement, flow[:3], flow[3:], t))

    def reading(self, seen, effort):
        return to_public_order(effort), effort[3:], effort[:3]

    def wrench(self, a, place, effort):
        wrench = _wrench_at(a.x, effort[:3], effort[3:])
        return wrench, jnp.zeros_like(wrench)


class JointPort(AbstractPort):
    """One joint coordinate and its velocity."""

    num_flows = 1

    def gather(self, group, at, V, u):
        return gather_static(at.psi, np.asarray(group.second)), gather_static(u, np.asarray(group.first))

    def displacement(self, q, v):
        return (q,)

    def flow(self, q, v):
        return v[None]

    def rate(self, displacement, flow):
        return (flow[0],)

    def arguments(self, displacement, flow):
        return displacement, (flow[0],)

    def effort(self, law, displacement, flow, t):
        return law.effort(*displacement, flow[0], t)[None]

    def spread(self, group, seen, efforts, owners, num_velocities):
        return None, segment_sum_static(efforts[:, 0], group.first, num_velocities)

    def stiffness(self, law, displacement, flow, t):
        return _curvature(law, *displacement, t)[None, None]


class SystemPort(AbstractPort):
    """All coordinates and velocities of a system."""

    num_flows = None

    def gather(self, group, at, V, u):
        n = len(group.names)
        return jnp.broadcast_to(at.psi, (n, *at.psi.shape)), jnp.broadcast_to(u, (n, *u.shape))

    def displacement(self, psi, u):
        return (psi,)

    def flow(self, psi, u):
        return u

    def rate(self, displacement, flow):
        return (jnp.zeros_like(displacement[0]),)

    def arguments(self, displacement, flow):
        return displacement, (flow,)

    def potential(self, law, displacement, t):
        return jnp.zeros((), displacement[0].dtype)

    def effort(self, law, displacement, flow, t):
        return law.effort(*displacement, flow, t)

    def spread(self, group, seen, efforts, owners, num_velocities):
        return None, jnp.sum(efforts, axis=0)


@dataclasses.dataclass(frozen=True)
class PathPort(AbstractPort):
    """Several frames: the flow is the angular velocity and the velocity of the origin of each, in world axes."""

    num_frames: int = 2

    @property
    def num_flows(self):
        return 6 * self.num_frames

    def gather(self, group, at, V, u):
        return (_frame_motions(group.frames, at, V),)

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

    def validity(self, law, displacement, flow, t):
        law, frames = self.law_and_motion(law, displacement, flow)
        return law.validity(frames, t)

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
        return jnp.append(_moments_first(pull.wrench(law.layout, frames)), drum), storing

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


def port_of(law) -> AbstractPort:
    """The port of a law that acts on frames or on the whole system."""
    if isinstance(law, AbstractPathLaw):
        return PathPort(law.num_frames)
    kinds = (
        ((AbstractScalarLaw, AbstractScalarStateLaw), LinePort),
        ((AbstractPoseLaw, AbstractPoseStateLaw), PosePort),
        ((AbstractBodyLaw, AbstractBodyStateLaw), FramePort),
    )
    return next((port() for kind, port in kinds if isinstance(law, kind)), SystemPort())


def _moments_first(wrench):
    """Wrenches of all frames of a path (6 n,), moment first, from forces and moments (n, 3)."""
    force, moment = wrench
    return jnp.concatenate([moment, force], axis=1).reshape(-1)


def _moment_first(wrench):
    """Wrench (moment, force) (6,), the order inside the library, from the pair (force, moment) of a law."""
    force, moment = wrench
    return jnp.concatenate([moment, force])


def _frame_motions(side, at, V):
    """The frames of all elements on one side."""
    return FrameMotion(*(gather_static(part, np.asarray(side)) for part in (at.R, at.x, V)))


def _wrench_at(x, moment, force):
    """Wrench about the origin of a force and moment at the point x."""
    return jnp.concatenate([moment + skew(x) @ force, force])


def _curvature(law, x, t):
    """Second derivative of a scalar law's potential."""
    return jax.grad(jax.grad(law.potential))(x, t)
