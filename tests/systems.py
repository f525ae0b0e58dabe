"""Small systems that several tests share."""

import jax.numpy as jnp

import jaxmbs as mbs


def four_bar(lengths=(0.12, 0.4, 0.3), ground=0.36, springs=True, like=None, masses=(0.6, 1.1, 0.9)):
    """Planar four-bar in space (three redundant rows) with a spring, a damper and a motor torque."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name, mass, length in zip(("crank", "coupler", "rocker"), masses, lengths, strict=True):
        com = jnp.stack([jnp.asarray(length) / 2, jnp.zeros(()), jnp.zeros(())])
        b.body(name, mass, com=com, inertia=mbs.inertia.rod(mass, length))
    pin = mbs.Revolute("z")

    def end(length):
        return jnp.stack([jnp.asarray(length, float), jnp.zeros(()), jnp.zeros(())])

    b.joint("main", pin, "ground", "crank")
    b.joint("knee", pin, "crank", "coupler", parent_frame=end(lengths[0]))
    b.joint("base", pin, "ground", "rocker", parent_frame=end(ground))
    b.joint("wrist", pin, "coupler", "rocker", parent_frame=end(lengths[1]), child_frame=end(lengths[2]))
    if springs:
        spring = mbs.SpringDamper(stiffness=300.0, damping=2.0, free_length=0.2)
        b.force("spring", spring, between=(("ground", (0.1, 0.4, 0.1)), ("coupler", (0.15, 0.02, 0.0))))
        b.force("torsion", mbs.SpringDamper(stiffness=1.5, damping=0.05, free_length=0.2), joint="base")
        b.force("motor", mbs.Torque((0.1, 0.2, 0.7)), on="crank")
    return b.build(like=like, independent=None if like is not None else ["main"])


def four_bar_state(system, angle=0.5, rate=2.0):
    """The state with the coupler above the crank."""
    return mbs.State.at(system, main=angle, velocities={"main": rate}, guess={"knee": 0.1, "base": 1.4})


def spatial_loop():
    """Two freedoms: a universal-spherical-spherical-prismatic spatial chain closed on the ground."""
    b = mbs.SystemBuilder()
    b.body("arm", 1.2, com=(0.2, 0.05, 0.0), inertia=(0.01, 0.02, 0.025))
    b.body("rod", 0.7, com=(0.3, 0.0, 0.02), inertia=(0.004, 0.03, 0.03))
    b.body("block", 2.0, com=(0.01, 0.0, 0.03), inertia=(0.01, 0.01, 0.02))
    b.joint("cross", mbs.Universal(), "ground", "arm")
    b.joint("elbow", mbs.Universal(("y", "z")), "arm", "rod", parent_frame=(0.4, 0.0, 0.1))
    b.joint("slide", mbs.Prismatic((1.0, 0.3, 0.2)), "ground", "block", parent_frame=(0.5, 0.1, -0.2))
    b.joint("tip", mbs.Spherical(), "rod", "block", parent_frame=(0.6, 0.0, 0.0))
    b.force("spring", mbs.SpringDamper(stiffness=80.0, damping=1.0, free_length=0.3), between=("arm", "block"))
    return b.build(cut=["tip"])


def spatial_tree():
    """A branching tree of revolute, prismatic, screw, cylindrical and universal joints in general directions."""
    b = mbs.SystemBuilder()
    R = mbs.Revolute((0.2, 1.0, -0.3))
    b.body("a", 1.5, com=(0.1, 0.2, -0.1), inertia=(0.02, 0.03, 0.04))
    b.body("b", 0.8, com=(0.0, 0.1, 0.2), inertia=(0.01, 0.02, 0.015))
    b.body("c", 0.5, com=(0.2, 0.0, 0.1), inertia=(0.01, 0.01, 0.01))
    b.body("d", 0.9, com=(-0.1, 0.1, 0.0), inertia=(0.012, 0.02, 0.03))
    b.joint("one", R, "ground", "a", parent_frame=(0.0, 0.1, 0.0))
    b.joint(
        "two", mbs.Prismatic((1.0, 0.5, 0.2)), "a", "b", parent_frame=(0.3, 0.0, 0.1), child_frame=(0.0, 0.1, 0.0)
    )
    b.joint("three", mbs.Screw((0.0, 0.6, 0.8), pitch=0.07), "b", "c", parent_frame=(0.0, 0.2, 0.2))
    b.joint("four", mbs.Universal(), "a", "d", parent_frame=(-0.2, 0.1, 0.0), child_frame=(0.05, 0.0, 0.1))
    b.force("spring", mbs.SpringDamper(stiffness=50.0, damping=0.5, free_length=0.2), between=("c", "d"))
    return b.build()


def general_state(system, seed=0):
    """A state with random coordinates (trees only) and rates."""
    import numpy as np

    random = np.random.default_rng(seed)
    n = system.topology.num_velocities
    psi = jnp.asarray(random.normal(size=system.topology.num_coordinates))
    return mbs.State(jnp.asarray(0.3), psi, jnp.asarray(random.normal(size=n)))
