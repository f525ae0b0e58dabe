"""A bound on how fast motions of a mechanism may die out, on the host and without its equations."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..model._system import System


def fastest_decay(system: System) -> float:
    """A bound on the rate [1/s] at which dampers take the speed of the bodies that they act on, each alone, and the
    damping of elastic bodies that of their deformations; infinite where a damper moves no inertia."""
    return float(max((*_of_laws(system), *_of_elastic_bodies(system)), default=0.0))


def _of_laws(system) -> Iterator[float]:
    damped = [(group, np.asarray(group.law.largest_damping)) for group in system.forces]
    damped = [(group, damping) for group, damping in damped if np.any(damping)]
    bodies = _Bodies.of(system) if damped else None
    for group, damping in damped:
        damping = np.broadcast_to(damping, len(group.names))
        yield from (c * _mobility(system.topology, bodies, group, k) for k, c in enumerate(damping) if c > 0)


class _Bodies(NamedTuple):
    """Per body one over its mass and over its largest principal inertia, zero without; its centre of mass (3,)."""

    moving: np.ndarray
    turning: np.ndarray
    com: np.ndarray
    frames: np.ndarray

    @classmethod
    def of(cls, system):
        mass, com = np.asarray(system.mass), np.asarray(system.com)
        inertia = np.linalg.norm(np.asarray(system.inertia), 2, axis=(1, 2))
        inertia = np.where(inertia > 0.0, inertia, mass * np.sum(com**2, axis=1))  # of a point that turns about a pin
        inverse = lambda x: np.divide(1.0, x, out=np.zeros_like(x), where=x > 0.0)
        return cls(inverse(mass), inverse(inertia), com, np.asarray(system.frames.position))


def _mobility(top, bodies, group, k) -> float:
    """Speed along an element over the impulse along it, of its bodies without their joints [1/kg or 1/(kg m^2)]."""
    if group.port.is_on_joint:
        place = group.first[k]
        joint = next(j for j in top.joints if j.velocities.start <= place < j.velocities.stop)
        own = bodies.turning if joint.units and joint.units[0] == "rad" else bodies.moving
        found = [own[b] for b in (joint.parent, joint.child) if b >= 0]
    else:
        places = [(top.frame_body[f], bodies.frames[f]) for f in group.port.frames_of(group, k)]
        found = [bodies.moving[b] + bodies.turning[b] * np.sum((x - bodies.com[b]) ** 2) for b, x in places if b >= 0]
    found = [x for x in found if x > 0.0]  # others move what has no inertia of its own
    return float(np.sum(found)) if found else np.inf


def _of_elastic_bodies(system) -> Iterator[float]:
    for group in system.elastic:
        damping, inertia = np.asarray(group.body.damping), np.asarray(group.body.inertia)
        if np.any(damping):
            m = damping.shape[-1]
            rates = np.linalg.eigvals(np.linalg.pinv(inertia[..., -m:, -m:]) @ damping)
            yield float(np.max(np.abs(rates)))
