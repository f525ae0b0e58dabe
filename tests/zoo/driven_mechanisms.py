"""Three mechanisms with a drive and a nonlinear coupler, among them balls, rolling, a blade, a loop; with states."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

SPIN, WHEEL, DISK = 1.3, 0.3, 0.3  # torque on the pinion [N m], angle of the wheel [rad], radius of the disk [m]
DRIVE = mbs.Harmonic(0.3, 0.4, 2.0)  # [rad or m]


def pinion(wheel):
    """The coordinate of the pinion by that of the wheel."""
    return 2.0 * wheel + 0.2 * jnp.sin(wheel)


def carrier(b, kind):
    """A driven table, and on it two coupled shafts with a motor and a brake."""
    b.body("table", 3.0, com=(0.05, 0.02, 0.0), inertia=(0.2, 0.3, 0.4))
    b.joint("base", kind, "ground", "table", drive=DRIVE)
    for name, inertia, at in (("pinion", 0.01, 0.2), ("wheel", 0.04, -0.2)):
        b.body(name, 0.5, com=(0.02, 0.03, 0.01), inertia=(inertia, 0.02, 0.03))
        b.joint(name, mbs.Revolute("x"), "table", name, parent_frame=(0.0, at, 0.1))
    b.constraint("gear", mbs.Coupler({"pinion": 1, "wheel": 1}, function=lambda p, w: p - pinion(w)))
    b.force("motor", mbs.Torque((SPIN, 0.0, 0.0), axes="body"), on="pinion")
    b.force("brake", mbs.SpringDamper(damping=0.3), joint="wheel")


def bob(b, kind, parent, at, spring):
    b.body("bob", 0.6, com=(0.02, 0.0, -0.15), inertia=(0.004, 0.005, 0.001))
    b.joint("hang", kind, parent, "bob", parent_frame=at)
    b.force("spring", mbs.SpringDamper(40.0, 0.7, 0.2), between=spring)


def lively(system, state, seed):
    """The state with velocities in all directions that the rows leave free."""
    A = np.asarray(mbs.constraints.constraint_jacobian(system, state))
    more = np.random.default_rng(seed).normal(size=A.shape[1])
    return eqx.tree_at(
        lambda s: s.velocities, state, state.velocities + more - np.linalg.pinv(A, rcond=1e-12) @ (A @ more)
    )


def quaternions(spring):
    """A disk that rolls on a driven turntable, and a bob on a ball joint at its middle."""
    b = mbs.SystemBuilder(gravity=(0.3, -0.4, -9.81))
    carrier(b, mbs.Revolute("z"))
    b.body("disk", 2.0, inertia=(0.045, 0.09, 0.045))
    b.joint("free", mbs.Free(), "ground", "disk")
    b.constraint("contact", mbs.joints.RollingDisk(DISK), between=("table", "disk"))
    bob(b, mbs.Spherical(), "disk", (0.0, 0.0, 0.0), spring)
    system, lean = b.build(), 0.3
    place = (0.4, 0.2, DISK * np.cos(lean), np.cos(lean / 2), np.sin(lean / 2), 0.0, 0.0)
    turned = np.array([0.8, -0.2, 0.3, 0.4]) / np.linalg.norm([0.8, -0.2, 0.3, 0.4])
    return system, lively(system, mbs.State.at(system, free=place, hang=turned, wheel=WHEEL, t=0.3), 0)


def blade(spring):
    """A sleigh whose blade cuts a driven table, with a bob on a hinge."""
    b = mbs.SystemBuilder(gravity=(0.3, -0.4, -9.81))
    carrier(b, mbs.Prismatic("x"))
    b.body("disk", 1.2, com=(0.3, 0.0, 0.1), inertia=(0.1, 0.12, 0.15))
    b.joint("free", mbs.Planar(), "ground", "disk")
    b.constraint("contact", mbs.joints.KnifeEdge(), between=("table", "disk"))
    bob(b, mbs.Revolute("y"), "disk", (0.1, 0.0, 0.2), spring)
    system = b.build()
    return system, lively(system, mbs.State.at(system, free=(0.3, -0.2, 0.4), hang=0.5, wheel=WHEEL, t=0.3), 1)


def loop(spring):
    """A bob on a cross on the driven table, held by a strut to the ground."""
    b = mbs.SystemBuilder(gravity=(0.3, -0.4, -9.81))
    carrier(b, mbs.Prismatic("x"))
    bob(b, mbs.Universal(), "table", (0.1, 0.0, 0.2), spring)
    b.constraint(
        "contact", mbs.joints.Distance(0.9), between=(("ground", (-0.4, 0.5, 0.4)), ("bob", (0.1, 0.1, -0.3)))
    )
    system = b.build()
    return system, lively(system, mbs.State.at(system, wheel=WHEEL, t=0.3, guess={"hang": (0.5, 0.3)}), 2)


def rolls(v):
    """Velocity of the touching point of the disk less that of the table there."""
    R, x = v["rotations"]["disk"], v["places"]["disk"]
    down = R[:, 1] * R[2, 1] - np.eye(3)[2]
    at = x + DISK * down / np.linalg.norm(down)
    on_disk = v["velocities"]["disk"] + np.cross(v["turning"]["disk"], at - x)
    return on_disk - v["velocities"]["table"] - np.cross(v["turning"]["table"], at - v["places"]["table"])


def cuts(v):
    """Speed of the sleigh's blade across itself, seen from the table."""
    R, arm = v["rotations"]["disk"], v["places"]["disk"] - v["origin"]
    speed = v["velocities"]["disk"] - np.cross(v["turning"]["disk"], arm) - v["velocities"]["table"]
    return R[:, 1] @ speed


def holds(v):
    """Rate of the strut's length."""
    return v["end"][1] @ (v["end"][0] - [-0.4, 0.5, 0.4])
