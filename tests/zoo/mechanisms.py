"""The mechanisms of the zoo, and states of them."""

import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

from ..flexible.beams import elastic_beam, random_state


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


def spatial_loop_state(system):
    guess = {"elbow": (0.1, 0.4)}
    return mbs.State.at(system, cross=(0.2, -0.3), velocities={"cross": (0.7, -0.4)}, guess=guess)


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


def floating_base():
    """A free body that carries another on a ball joint, with a bushing between them, a stay and a load."""
    b = mbs.SystemBuilder(gravity=(0.3, -0.5, -9.81))
    b.body("base", 2.0, com=(0.05, 0.0, 0.1), inertia=(0.05, 0.07, 0.06))
    b.body("bob", 0.7, com=(0.2, 0.05, 0.0), inertia=(0.01, 0.02, 0.025))
    b.joint("free", mbs.Free(), "ground", "base")
    b.joint("ball", mbs.Spherical(), "base", "bob", parent_frame=(0.3, 0.1, 0.0))
    b.force(
        "mount", mbs.Bushing(stiffness=(3.0, 20.0), damping=(0.1, 0.5)), between=("base", ("bob", (0.1, 0.0, 0.0)))
    )
    b.force(
        "stay", mbs.SpringDamper(40.0, 1.0, 0.5), between=(("ground", (0.1, 0.2, 1.0)), ("base", (0.0, 0.1, 0.2)))
    )
    b.force("wind", mbs.Force((1.0, 2.0, 0.5)), on=("bob", (0.3, 0.0, 0.1)))
    return b.build()


def floating_state(system):
    place = np.concatenate([(0.2, -0.1, 0.4), unit(0.9, 0.1, -0.3, 0.2)])
    rates = {"free": (0.3, -0.5, 0.2, 0.8, 0.4, -0.6), "ball": (0.5, -1.0, 0.8)}
    return mbs.State.at(system, free=place, ball=unit(0.8, -0.2, 0.3, 0.4), velocities=rates)


def unit(*x):
    return np.array(x) / np.linalg.norm(x)


def chain(n=8):
    """Links on pins whose axes alternate, with damping in the pins and a torque on the last link."""
    b = mbs.SystemBuilder()
    for k in range(n):
        b.body(f"link{k}", 0.5, com=(0.1, 0.0, 0.02), inertia=(0.001, 0.002, 0.003))
        ends = (f"link{k - 1}" if k else "ground", f"link{k}")
        b.joint(f"pin{k}", mbs.Revolute("zy"[k % 2]), *ends, parent_frame=(0.2 * (k > 0), 0.0, 0.0))
        b.force(f"grease{k}", mbs.SpringDamper(damping=0.02), joint=f"pin{k}")
    b.force("screw", mbs.Torque((0.02, 0.05, 0.01)), on=f"link{n - 1}")
    return b.build()


def turning(t):
    return 0.3 + 2.0 * t + jnp.sin(3.0 * t)


def driven_arm():
    """A driven arm with a body on a ball joint (quaternion), a bushing, a pure damper, a load and an effort."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("arm", 1.5, com=(0.3, 0.0, 0.1), inertia=(0.01, 0.02, 0.03))
    b.body("tip", 0.8, com=(0.2, 0.05, 0.0), inertia=(0.01, 0.02, 0.025))
    b.joint("hinge", mbs.Revolute((0.1, 1.0, 0.0)), "ground", "arm", drive=turning)
    b.joint("ball", mbs.Spherical(), "arm", "tip", parent_frame=(0.6, 0.0, 0.0))
    b.force("stay", mbs.SpringDamper(60.0, 1.0, 0.4), between=(("ground", (0.2, 0.3, 0.5)), ("tip", (0.4, 0.0, 0.0))))
    b.force("bushing", mbs.Bushing(stiffness=(3.0, 20.0)), between=("arm", ("tip", (0.1, 0.0, 0.0))))
    b.force("grease", mbs.SpringDamper(damping=0.4), joint="hinge")
    b.force("wind", mbs.Force((1.0, 2.0, 0.5)), on=("tip", (0.3, 0.0, 0.1)))
    b.force("push", mbs.forces.GeneralisedEffort(effort), joint=None)
    return b.build()


def effort(coordinates, velocities, t):
    return jnp.array([0.3, -0.2, 0.1, 0.4]) * jnp.cos(t)


def driven_arm_state(system):
    rates = {"ball": (0.5, -1.0, 0.8)}
    return mbs.State.at(system, ball=unit(0.9, 0.2, -0.1, 0.35), velocities=rates, guess={"hinge": 0.5}, t=0.2)


def elastic_arm():
    """A carrier that swings, on its driven hinge a damped elastic arm that bends, with a tool pinned to its tip."""
    beam = elastic_beam(elements=2, num_modes=1, damping_ratio=0.05)
    b = mbs.SystemBuilder(gravity=(0.5, -2.0, -9.81))
    b.body("carrier", 0.3, inertia=0.002)
    b.elastic("arm", beam.body, motions={"2": mbs.Planar("z")})
    b.body("tool", 0.5, com=(0.02, 0.01, 0.0), inertia=(1e-3, 2e-3, 2.5e-3))
    b.joint("swing", mbs.Revolute("x"), "ground", "carrier")
    b.joint("hinge", mbs.Revolute((0.1, 1.0, 0.3)), "carrier", "arm.0", (0.1, 0.2, 0.0), drive=turning)
    b.joint("wrist", mbs.Revolute("y"), "arm.2", "tool", child_frame=(-0.1, 0.0, 0.0))
    b.force("grease", mbs.SpringDamper(3.0, 0.4, 0.2), joint="wrist")
    return b.build()


def elastic_arm_state(system):
    """Deformed by centimetres, with speeds of metres per second."""
    moved = random_state(system, size=0.03, speed=2.0)
    joints = {name: value for name, value in system.coordinates(moved).items() if name != "hinge"}
    speeds = {name: value for name, value in system.velocities(moved).items() if name != "hinge"}
    return mbs.State.at(system, joints, velocities=speeds, t=0.2)


def rolling_disk():
    """A disk that rolls with a pendulum on its axle, and beside it two geared shafts, one on a spring."""
    b = mbs.SystemBuilder(gravity=(0.2, -0.1, -9.81))
    b.body("disk", 2.0, inertia=(0.045, 0.09, 0.045))
    b.body("bob", 0.6, com=(0.02, 0.0, -0.15), inertia=(0.004, 0.004, 0.001))
    b.joint("free", mbs.Free(), "ground", "disk")
    b.joint("axle", mbs.Revolute("y"), "disk", "bob")
    b.constraint("contact", mbs.joints.RollingDisk(0.3), between=("ground", "disk"))
    for name, inertia in (("pinion", 0.1), ("wheel", 0.4)):
        b.body(name, 1.0, inertia=inertia)
        b.joint(name, mbs.Revolute("z"), "ground", name)
    b.constraint("gear", mbs.Coupler({"pinion": 1.0, "wheel": -2.0}))
    b.force("motor", mbs.Torque((0.0, 0.0, 1.5)), on="pinion")
    b.force("coil", mbs.SpringDamper(5.0, 0.1, 0.2), joint="wheel")
    return b.build()


def rolling_state(system):
    """The disk leans and turns; the velocity of its centre is what its contact asks for."""
    lean, spin = 0.3, np.array([0.1, 6.0, 0.5])
    place = np.concatenate([(0.0, 0.0, 0.3 * np.cos(lean)), (np.cos(lean / 2), np.sin(lean / 2), 0.0, 0.0)])
    state = mbs.State.at(system, free=place, axle=0.4, pinion=0.6)
    A = np.asarray(mbs.constraints.constraint_jacobian(system, state))[:, system.columns("free")]
    rolls = np.linalg.lstsq(A[:, :3], -A[:, 3:] @ spin, rcond=None)[0]
    rates = {"free": np.concatenate([rolls, spin]), "axle": -2.0, "pinion": 3.0}
    return mbs.State.at(system, free=place, axle=0.4, pinion=0.6, velocities=rates)


def general_state(system, seed=0):
    """A state with random coordinates (trees only) and rates."""
    random = np.random.default_rng(seed)
    n = system.topology.num_velocities
    psi = jnp.asarray(random.normal(size=system.topology.num_coordinates))
    return mbs.State(jnp.asarray(0.3), psi, jnp.asarray(random.normal(size=n)))
