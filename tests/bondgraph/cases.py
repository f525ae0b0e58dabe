"""Mechanisms of the bond graph tests."""

import jax
import jax.numpy as jnp

import jaxmbs as mbs

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
