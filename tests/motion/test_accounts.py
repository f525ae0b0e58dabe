"""The account of energy with every kind of port in one model, and what each port's work must be."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import PIN, rotation_about

pytestmark = pytest.mark.long

STIFF = np.diag([40.0, 50.0, 30.0, 2.0, 3.0, 1.0])
STIFF[0, 3] = STIFF[3, 0] = 1.5


def _motor(x, v, t):
    return 0.8 * jnp.cos(3.0 * t) - 0.1 * x


def _swing(t):
    return 0.3 * jnp.sin(4.0 * t)


def _swirl(rotation, position, angular_velocity, velocity, t):
    return -0.2 * velocity, 0.1 * jnp.cos(t) * jnp.ones_like(velocity)


def declare():
    """A driven arm with a free pendulum on it, a mounted body, and a chain of joints with laws."""
    b = mbs.SystemBuilder(gravity=(0.4, 0.0, -9.81))
    b.body("driven", mass=1.0, com=(0.2, 0.0, 0.0), inertia=np.array([0.1, 0.2, 0.2]))
    b.joint("drive", mbs.Revolute(axis="y"), "ground", "driven", drive=_swing)
    b.body("tail", mass=0.7, com=(0.3, 0.1, 0.0), inertia=np.array([0.05, 0.04, 0.06]))
    b.joint("tail", mbs.Universal(), "driven", "tail", parent_frame=(0.4, 0.0, 0.1))
    b.force("line", mbs.SpringDamper(30.0, 0.3, 0.4, 2.0), between=("ground", ("tail", (0.5, 0.0, 0.2))))
    b.body("mounted", mass=2.0, com=(0.05, 0.0, 0.02), inertia=np.array([0.1, 0.12, 0.15]))
    b.joint("mounted", mbs.Free(), "ground", "mounted", parent_frame=(2.0, 0.0, 0.0))
    seat = ("ground", mbs.Pose((2.0, 0.1, 0.0), rotation_about((1, 2, 0), 0.3)))
    damping = np.diag([0.5, 0.4, 0.3, 0.02, 0.03, 0.04])
    b.force("mount", mbs.Bushing(STIFF, damping, np.array([1.0, 0.0, 2.0, 0.1, 0.0, 0.2])), between=(seat, "mounted"))
    b.force("swirl", mbs.forces.Wrench(_swirl), on=("mounted", (0.1, 0.2, 0.0)))
    b.force("wind", mbs.Force((0.3, -0.2, 0.1), axes="body"), on="mounted")
    b.body("first", mass=1.0, com=(0.1, 0.2, 0.0), inertia=np.array([0.1, 0.1, 0.1]))
    b.joint("first", PIN, "ground", "first", parent_frame=(0.0, 3.0, 0.0))
    b.body("second", mass=0.5, com=(0.0, 0.1, 0.1), inertia=np.array([0.1, 0.1, 0.1]))
    b.joint("second", mbs.Prismatic(axis=(1.0, 1.0, 0.5)), "first", "second", parent_frame=(0.3, 0.0, 0.0))
    b.force("spring", mbs.SpringDamper(2.0, 0.05, 0.2, 0.3), joint="first")
    b.force("motor", mbs.Actuator(_motor), joint="first")
    b.force(
        "friction",
        mbs.forces.FrictionForce(mbs.friction.BearingFriction(0.6, 0.78, 0.05, viscous=0.1)),
        joint="second",
    )
    b.force("stop", mbs.BumpStop(500.0, lower=-0.1, upper=0.1, damping=0.2), joint="second")
    b.force("servo", mbs.PD(_swing, kp=5.0, kd=0.5), joint="second")
    return b.build()


@pytest.fixture(scope="module")
def motion():
    system = declare()
    rates = {"first": 3.0, "second": 0.5, "tail": (1.0, -0.5), "mounted": (0.3, 0.0, 0.0, 1.0, 2.0, 0.0)}
    state = mbs.State.at(system, velocities=rates)
    return mbs.simulate(system, state, ts=jnp.linspace(0.0, 0.6, 7), rtol=1e-10, atol=1e-10)


def test_the_account_closes(motion):
    """Energy changes by joules; what is unaccounted for is rounding and the tolerance of the integrator."""
    found = motion.diagnostics
    energy = np.asarray(found.kinetic + found.potential)
    assert np.ptp(energy) > 0.5
    assert np.max(np.abs(np.asarray(found.energy_residual))) < 2e-7


PORTS = ("line", "mount", "swirl", "wind", "spring", "motor", "friction", "stop", "servo", "drives")


def test_every_port_is_in_the_account(motion):
    assert set(motion.diagnostics.work) == set(PORTS)


@pytest.mark.parametrize("port", PORTS)
def test_no_port_is_idle(motion, port):
    assert np.max(np.abs(np.asarray(motion.diagnostics.work[port]))) > 1e-4


@pytest.mark.parametrize("port", ["line", "mount", "spring", "friction", "stop"])
def test_dampers_and_friction_only_take(motion, port):
    work = np.asarray(motion.diagnostics.work[port])
    assert np.all(np.diff(work) <= 1e-12)


def test_the_drive_is_followed(motion):
    t = np.asarray(motion.ts)
    np.testing.assert_allclose(motion.states.coordinates[:, 0], 0.3 * np.sin(4 * t), atol=1e-12)
    np.testing.assert_allclose(motion.states.velocities[:, 0], 1.2 * np.cos(4 * t), atol=1e-10)
