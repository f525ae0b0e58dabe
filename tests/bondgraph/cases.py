"""Mechanisms of the bond graph tests."""

import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

from ..flexible.beams import elastic_beam, random_state

PIN = mbs.Revolute(axis="z")


def slider_crank(stiffness=300.0):
    """Free slider-crank with a spring and damper on the slide, one between points and a motor."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("crank", mass=1.2, com=(0.075, 0.01, 0.0), inertia=(0.004, 0.004, 0.004))
    b.body("rod", mass=2.0, com=(0.25, 0.0, 0.0), inertia=(0.06, 0.06, 0.06))
    b.body("slider", mass=3.0)
    b.joint("main", PIN, "ground", "crank")
    b.joint("crank_pin", PIN, "crank", "rod", parent_frame=(0.15, 0.0, 0.0))
    b.joint("wrist", PIN, "rod", "slider", parent_frame=(0.5, 0.0, 0.0))
    b.joint("slide", mbs.Prismatic(axis="x"), "ground", "slider")
    b.force("buffer", mbs.SpringDamper(stiffness, 4.0, free_length=0.5), joint="slide")
    b.force("stay", mbs.SpringDamper(40.0, 1.0, free_length=0.1), between=(("ground", (0.2, 0.4, 0.0)), "rod"))
    b.force("motor", mbs.Torque((0.0, 0.0, 1.5)), on="crank")
    return b.build(cut=["wrist"], independent=["main"])


def slider_crank_state(system):
    return mbs.State.at(system, main=0.7, velocities={"main": 3.0}, guess={"crank_pin": -0.9, "slide": 0.6})


def _turning(t):
    return 0.3 + 2.0 * t + jnp.sin(3.0 * t)


def driven_arm():
    """A driven arm with a body on a ball joint (quaternion), a bushing, a pure damper, a load and an effort."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("arm", 1.5, com=(0.3, 0.0, 0.1), inertia=(0.01, 0.02, 0.03))
    b.body("tip", 0.8, com=(0.2, 0.05, 0.0), inertia=(0.01, 0.02, 0.025))
    b.joint("hinge", mbs.Revolute((0.1, 1.0, 0.0)), "ground", "arm", drive=_turning)
    b.joint("ball", mbs.Spherical(), "arm", "tip", parent_frame=(0.6, 0.0, 0.0))
    b.force("stay", mbs.SpringDamper(60.0, 1.0, 0.4), between=(("ground", (0.2, 0.3, 0.5)), ("tip", (0.4, 0.0, 0.0))))
    b.force("bushing", mbs.Bushing(stiffness=(3.0, 20.0)), between=("arm", ("tip", (0.1, 0.0, 0.0))))
    b.force("grease", mbs.SpringDamper(damping=0.4), joint="hinge")
    b.force("wind", mbs.Force((1.0, 2.0, 0.5)), on=("tip", (0.3, 0.0, 0.1)))
    b.force("push", mbs.GeneralisedEffort(effort), joint=None)
    return b.build()


def effort(coordinates, velocities, t):
    return jnp.array([0.3, -0.2, 0.1, 0.4]) * jnp.cos(t)


def driven_arm_state(system):
    ball = np.array([0.9, 0.2, -0.1, 0.35])
    ball = ball / np.linalg.norm(ball)
    return mbs.State.at(system, ball=ball, velocities={"ball": (0.5, -1.0, 0.8)}, guess={"hinge": 0.5}, t=0.2)


def elastic_arm():
    """A carrier that swings, on its driven hinge a damped elastic arm that bends, with a tool pinned to its tip."""
    beam = elastic_beam(elements=2, num_modes=1, damping_ratio=0.05)
    b = mbs.SystemBuilder(gravity=(0.5, -2.0, -9.81))
    b.body("carrier", 0.3, inertia=0.002)
    b.elastic("arm", beam.body, motions={"2": mbs.Planar("z")})
    b.body("tool", 0.5, com=(0.02, 0.01, 0.0), inertia=(1e-3, 2e-3, 2.5e-3))
    b.joint("swing", mbs.Revolute("x"), "ground", "carrier")
    b.joint("hinge", mbs.Revolute((0.1, 1.0, 0.3)), "carrier", "arm.0", (0.1, 0.2, 0.0), drive=_turning)
    b.joint("wrist", mbs.Revolute("y"), "arm.2", "tool", child_frame=(-0.1, 0.0, 0.0))
    b.force("grease", mbs.SpringDamper(3.0, 0.4, 0.2), joint="wrist")
    return b.build()


def elastic_arm_state(system):
    """Deformed by centimetres, with speeds of metres per second."""
    moved = random_state(system, size=0.03, speed=2.0)
    joints = {name: value for name, value in system.coordinates(moved).items() if name != "hinge"}
    speeds = {name: value for name, value in system.velocities(moved).items() if name != "hinge"}
    return mbs.State.at(system, joints, velocities=speeds, t=0.2)


def double_pendulum(inertia=0.02):
    """Planar double pendulum of rods, or of points."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name in ("upper", "lower"):
        b.body(name, mass=1.0, com=(0.5, 0.0, 0.0), inertia=inertia)
    b.joint("shoulder", PIN, "ground", "upper")
    b.joint("elbow", PIN, "upper", "lower", parent_frame=(1.0, 0.0, 0.0))
    return b.build()


def stacked(states):
    """States with a leading axis."""
    return jax.tree.map(lambda *x: jnp.stack(x), *states)
