"""Ports on two points, two frames, one frame, several, a joint coordinate, and the whole system; see `_port.py`.

Source: S2 (56)-(67), (72) on points, (76) at one frame.
"""

import abc

import jax
import jax.numpy as jnp
import numpy as np

from ..math._linalg import direction, safe_norm, skew
from ..math._spatial import to_public_order
from ..runtime import gather_static, segment_sum_static
from ._base import AbstractBodyLaw, AbstractPathLaw, AbstractPoseLaw, AbstractScalarLaw
from ._frame_motion import frame_motions
from ._path_ports import PathPort
from ._port import AbstractPort


class _BetweenFrames(AbstractPort):
    """Ports on frames; their law's wrench acts on the body of B, the opposite one on that of A."""

    def gather(self, group, at, V, u):
        return tuple(frame_motions(side, at, V) for side in (group.first, group.second))

    @abc.abstractmethod
    def wrench(self, a, b, effort):
        """Wrenches (6,) on the frames A and B about the origin."""

    def spread(self, group, seen, efforts, owners, num_velocities):
        on_a, on_b = jax.vmap(self.wrench)(*seen, efforts)
        return owners.collect((*group.first, *group.second), jnp.concatenate([on_a, on_b])), None


class LinePort(_BetweenFrames):
    """Two points: the flow is the velocity of B from A, the effort the force on B."""

    num_flows = 3
    is_on_line = True

    def still(self, num_coordinates, num_velocities):
        return jnp.zeros(()), jnp.zeros(())

    def reference(self, a, b):
        return a.R, a.x

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

    def still(self, num_coordinates, num_velocities):
        return jnp.eye(3), jnp.zeros(3), jnp.zeros(3), jnp.zeros(3)

    def reference(self, a, b):
        return a.R, a.x

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

    def frames_of(self, group, k):
        return (group.first[k],)

    def still(self, num_coordinates, num_velocities):
        return jnp.eye(3), jnp.zeros(3), jnp.zeros(3), jnp.zeros(3)

    def reference(self, a, place):
        return jnp.eye(3, dtype=place.dtype), a.x - place

    def gather(self, group, at, V, u):
        return frame_motions(group.first, at, V), gather_static(at.x, np.asarray(group.first)) + at.origin[None]

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
    is_on_joint = True

    def frames_of(self, group, k):
        return ()

    def still(self, num_coordinates, num_velocities):
        return jnp.zeros(()), jnp.zeros(())

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
    modulus = "Gamma"

    def frames_of(self, group, k):
        return ()

    def still(self, num_coordinates, num_velocities):
        return jnp.zeros(num_coordinates), jnp.zeros(num_velocities)

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


def port_of(law) -> AbstractPort:
    """The port of a law that acts on frames or on the whole system."""
    if isinstance(law, AbstractPathLaw):
        return PathPort(law.num_frames)
    kinds = ((AbstractScalarLaw, LinePort), (AbstractPoseLaw, PosePort), (AbstractBodyLaw, FramePort))
    return next((port() for kind, port in kinds if isinstance(law, kind)), SystemPort())


def _moment_first(wrench):
    """Wrench (moment, force) (6,), the order inside the library, from the pair (force, moment) of a law."""
    force, moment = wrench
    return jnp.concatenate([moment, force])


def _wrench_at(x, moment, force):
    """Wrench about the origin of a force and moment at the point x."""
    return jnp.concatenate([moment + skew(x) @ force, force])


def _curvature(law, x, t):
    """Second derivative of a scalar law's potential."""
    return jax.grad(jax.grad(law.potential))(x, t)
