"""Small mechanisms that several tests share; every number may be traced."""

import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

import jaxmbs as mbs

DOWN_Y = (0.0, -9.81, 0.0)
PIN = mbs.Revolute(axis="z")
LENGTHS = (1.0, 0.3, 0.9, 0.7)  # ground, crank, coupler, rocker [m]


def pendulum(com=(0.0, 0.0, -1.0), joint="y", body="bob", pin="pin", gravity=(0.0, 0.0, -9.81), like=None, **numbers):
    """A body of 1 kg on one joint, by default a hinge about `joint`; `numbers` are other arguments of the body."""
    b = mbs.SystemBuilder(gravity=gravity)
    b.body(body, **{"mass": 1.0, "com": com} | numbers)
    b.joint(pin, mbs.Revolute(joint) if isinstance(joint, str) else joint, "ground", body)
    return b.build(like=like)


def bar(joint=PIN, pin="pin", mass=1.0):
    """A level bar of 1 m on a hinge about z."""
    return pendulum((0.5, 0.0, 0.0), joint, "bar", pin, DOWN_Y, mass=mass, inertia=(0.01, 0.1, 0.1))


def chain_of_bars(n, drive=lambda k: None):
    """Bars of 1 m and 1 kg, each on a hinge about z at the end of the one before.

    Args: drive: of the k-th hinge.
    """
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for k in range(n):
        b.body(f"link{k}", 1.0, (0.5, 0.0, 0.0), (0.01, 0.1, 0.1))
        before, place = f"link{k - 1}" if k else "ground", (float(k > 0), 0.0, 0.0)
        b.joint(f"pin{k}", PIN, before, f"link{k}", parent_frame=place, drive=drive(k))
    return b.build()


def four_bar_builder(lengths=LENGTHS, masses=(1.0, 1.0, 1.0), inertia=mbs.inertia.rod, **drives):
    """Three rods in the plane z = 0 on pins A (crank), B, D (rocker); C closes the loop, with three redundant rows.

    Args: inertia: function of mass and length; drives: by the names of pins.
    """
    ground, *links = lengths
    b, x = mbs.SystemBuilder(gravity=DOWN_Y), np.array([1.0, 0.0, 0.0])
    for name, mass, length in zip(("crank", "coupler", "rocker"), masses, links, strict=True):
        b.body(name, mass, x * length / 2.0, inertia(mass, length))
    crank, coupler, rocker = (x * length for length in links)
    b.joint("A", PIN, "ground", "crank", drive=drives.get("A"))
    b.joint("B", PIN, "crank", "coupler", parent_frame=crank)
    b.joint("D", PIN, "ground", "rocker", parent_frame=x * ground)
    b.joint("C", PIN, "coupler", "rocker", parent_frame=coupler, child_frame=rocker)
    return b


def _slender(mass, length):
    return mass * length**2 / 12.0 * jnp.array([0.01, 1.0, 1.0])


def four_bar(
    lengths=LENGTHS,
    masses=(1.0, 2.0, 1.5),
    stiffness=0.0,
    load=0.0,
    drive=None,
    like=None,
    cut=None,
    independent=None,
    guess=None,
):
    """The four-bar with a spring on the rocker's pin and a load at the end of the coupler."""
    b = four_bar_builder(lengths, masses, _slender, A=drive)
    b.force("spring", mbs.SpringDamper(stiffness=stiffness), joint="D")
    b.force(
        "load",
        mbs.Force(jnp.stack([0.0 * jnp.asarray(load, float), load, 0.0 * jnp.asarray(load, float)])),
        on=("coupler", (lengths[2], 0.0, 0.0)),
    )
    return b.build(like=like, cut=cut, independent=independent, guess=guess)


def four_bar_angles(crank_angle, lengths=LENGTHS):
    """Joint coordinates (A, B, D) of the open branch (C above the ground) by the crossing of two circles."""
    ground, a, b, c = lengths
    B = a * np.array([np.cos(crank_angle), np.sin(crank_angle)])
    to_D = np.array([ground, 0.0]) - B
    d = np.linalg.norm(to_D)
    along = (b**2 - c**2 + d**2) / (2.0 * d)
    e = to_D / d
    C = B + along * e + np.sqrt(b**2 - along**2) * np.array([-e[1], e[0]])
    coupler = np.arctan2(*(C - B)[::-1])
    rocker = np.arctan2(C[1], C[0] - ground)
    return np.array([crank_angle, coupler - crank_angle, rocker])


def four_bar_state(system, crank_angle=0.7, rate=2.0, lengths=LENGTHS):
    """Assembled state on the open branch."""
    _, B, D = four_bar_angles(crank_angle, lengths)
    return mbs.State.at(system, A=crank_angle, velocities={"A": rate}, guess={"B": B, "D": D})


def rotation_about(axis, angle):
    """Rotation matrix (3, 3) about an axis of any length."""
    axis = np.asarray(axis, float)
    return Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()


def bennett(a=1.0, alpha=0.6, b=0.7, beta=None):
    """Bennett's spatial four-bar of revolutes: it moves only when `a sin beta = b sin alpha`."""
    beta = np.arcsin(b * np.sin(alpha) / a) if beta is None else beta
    dimensions = [(a, alpha), (b, beta), (a, alpha), (b, beta)]
    return closed_chain(dimensions)


def closed_chain(dimensions):
    """Loop of revolutes from Denavit-Hartenberg pairs (length, twist) along x; the last link is the ground."""
    build = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    n = len(dimensions)
    for k in range(n - 1):
        build.body(f"link_{k}", mass=1.0, com=(0.5 * dimensions[k][0], 0.0, 0.0), inertia=(0.1, 0.12, 0.15))
    place, previous = None, "ground"
    for k in range(n - 1):
        build.joint(f"J{k}", PIN, previous, f"link_{k}", parent_frame=place)
        length, twist = dimensions[k]
        place, previous = mbs.Pose((length, 0.0, 0.0), rotation_about((1, 0, 0), twist)), f"link_{k}"
    length, twist = dimensions[-1]
    last = mbs.Pose((-length, 0.0, 0.0), rotation_about((1, 0, 0), -twist))
    build.joint(f"J{n - 1}", PIN, previous, "ground", parent_frame=place, child_frame=last)
    return build


class OnCart:
    """A pendulum on a cart, by hand: coordinates x and the angle from hanging down; the places of its points."""

    cart, mass, length, inertia, gravity = 2.0, 0.7, 0.4, 0.03, 9.81

    def field(self, angle):
        """I* (2, 2)."""
        c, J = self.mass * self.length * np.cos(angle), self.mass * self.length**2 + self.inertia
        return np.array([[self.cart + self.mass, c], [c, J]])

    def weight(self, angle):
        """Efforts (2,) of gravity."""
        return np.array([0.0, -self.mass * self.gravity * self.length * np.sin(angle)])

    def turned(self, angle):
        """Rotation (3, 3) of the pendulum."""
        return rotation_about((0, 0, 1), angle)

    def place(self, phi, point):
        """World place (3,) of a point of the pendulum."""
        return np.array([phi[0], 0.0, 0.0]) + self.turned(phi[1]) @ np.asarray(point, float)

    def build(self, drive=None, forces=(), weightless=False, like=None):
        b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0) if weightless else (0.0, -self.gravity, 0.0))
        b.body("cart", mass=self.cart)
        b.body("bob", mass=self.mass, com=(0.0, -self.length, 0.0), inertia=self.inertia)
        b.joint("slide", mbs.Prismatic("x"), "ground", "cart", drive=drive)
        b.joint("swing", PIN, "cart", "bob")
        for name, law, where in forces:
            b.force(name, law, **where)
        return b.build(like=like)


def slopes(function, x, h=1e-4):
    """Derivative (..., n) of a NumPy function by x (n,), of the fourth order in h."""
    x = np.asarray(x, float)
    columns = []
    for e in np.eye(len(x)) * h:
        near, far = (np.asarray(function(x + s * e)) - np.asarray(function(x - s * e)) for s in (1, 2))
        columns.append((8 * near - far) / (12 * h))
    return np.stack(columns, axis=-1)
