"""Random responses of linearised mechanisms, joint loads among them, and of measured networks."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.errors import ModelError
from jaxmbs.fatigue import psd_table
from jaxmbs.qualification import BaseAcceleration, BondForces, Coordinates, RandomForce

from .test_random_response import DAMPERS, GSFC, SPRINGS, chain, held_chain

pytestmark = pytest.mark.long


def carriage(k=4e4, c=20.0, like=None):
    """A driven table, on it a mass on a spring."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("table", mass=5.0)
    b.body("mass", mass=2.0)
    b.joint("drive", mbs.Prismatic("z"), "ground", "table")
    b.joint("slide", mbs.Prismatic("z"), "table", "mass")
    b.force("spring", mbs.SpringDamper(stiffness=k, damping=c), joint="slide")
    b.drive("drive", lambda t: 0.0 * t)
    return b.build(like=like)


def response_of_carriage(k, like=None):
    system = carriage(k, like=like)
    lin = mbs.linearise(system, mbs.State.at(system), inputs=["drive"], outputs=["slide"], loads=["slide", "drive"])
    return mbs.random_response(lin, {"drive": BaseAcceleration(GSFC)})


def test_loads_of_joints_of_a_mechanism():
    """The joint carries the inertia of the mass, `m a`, with the absolute acceleration of an oscillator."""
    found = response_of_carriage(4e4)
    system = mbs.LinearSystem(
        mass=jnp.eye(1) * 2.0,
        stiffness=jnp.eye(1) * 4e4,
        damping=jnp.eye(1) * 20.0,
        coordinates=["m z"],
        positions={"m": (0, 0, 0)},
    )
    out = {"a": Coordinates("m z"), "x": Coordinates("m z", "displacement")}
    exact = mbs.random_response(system, {"base": BaseAcceleration(GSFC, "z")}, out)
    rms = dict(zip(found.names, np.asarray(found.rms), strict=True))
    np.testing.assert_allclose(rms["slide"], exact.rms[1], rtol=1e-10)
    np.testing.assert_allclose(rms["slide force z"], 2.0 * exact.rms[0], rtol=1e-10)
    assert abs(rms["slide force x"]) < 1e-9 and rms["drive force z"] > rms["slide force z"]


def test_gradient_through_a_linearisation():
    like = carriage()

    def rms(k):
        return response_of_carriage(k, like).rms[3]

    h = 40.0
    secant = (8 * (rms(4e4 + h) - rms(4e4 - h)) - (rms(4e4 + 2 * h) - rms(4e4 - 2 * h))) / 12 / h
    np.testing.assert_allclose(jax.grad(rms)(4e4), secant, rtol=1e-7)


def measured_chain(points):
    omega = 2 * np.pi * np.linspace(20.0, 400.0, points)
    free = held_chain()
    labels = ["foot z", "a z", "b z", "c z"]
    values = mbs.frequency_response(free, omega, into=labels, out=labels)
    return connect({"chain": values}, {"bolt": rigid_bond("chain.foot", "ground")})


def straight(points):
    """RMS of the acceleration of c under a force on b, by brute force from receptances straight between points."""
    D = np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1]])
    K, C = (D.T @ np.diag(np.asarray(s)) @ D for s in (SPRINGS, DAMPERS))
    grid, f = np.linspace(20.0, 400.0, points), np.linspace(25.0, 390.0, 400_001)
    w = 2 * np.pi * grid[:, None, None]
    H = -(w[:, 0, 0] ** 2) * np.linalg.inv(K + 1j * w * C - w**2 * np.diag([1.0, 2.0, 0.5]))[:, 2, 1]
    level = (f / 25.0) ** (np.log(3.0) / np.log(390.0 / 25.0))
    return np.sqrt(np.trapezoid(level * np.abs(np.interp(f, grid, H.real) + 1j * np.interp(f, grid, H.imag)) ** 2, f))


def test_measured_network_and_its_grid():
    """Exact for straight lines between the points, whose error falls with the square of their distance: the first
    resonance is 0.43 Hz wide, the points are 0.095 and 0.0475 Hz apart."""
    force = {"f": RandomForce(psd_table([25.0, 390.0], [1.0, 3.0], "N^2/Hz"), {"chain.b z": 1.0})}
    out = {"a": Coordinates("chain.c z"), "bolt": BondForces("bolt")}
    coarse, fine = (mbs.random_response(measured_chain(n), force, out, tolerance=0.05) for n in (4001, 8001))
    exact = mbs.random_response(
        chain(SPRINGS, DAMPERS), {"f": RandomForce(force["f"].spectrum, {"b z": 1.0})}, {"a": Coordinates("c z")}
    )
    np.testing.assert_allclose([coarse.rms[0], fine.rms[0]], [straight(4001), straight(8001)], rtol=1e-6)
    np.testing.assert_allclose(fine.rms[0] + (fine.rms[0] - coarse.rms[0]) / 3, exact.rms[0], rtol=1e-4)
    assert fine.rms[1] > 0
    with pytest.raises(ModelError, match="too coarse for"):
        mbs.random_response(measured_chain(40), force, out)


def test_a_mechanism_must_be_linearised():
    with pytest.raises(ModelError, match="linearise it first"):
        mbs.random_response(carriage(), {"drive": BaseAcceleration(GSFC)})
