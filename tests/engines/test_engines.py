"""Closed forms of engines: periodic pressures, inertia torques by orders, torsion of inertias, flywheels."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import engines

ANGLES = np.linspace(0.0, 4.0 * np.pi, 48, endpoint=False)


def test_pressure_repeats_and_is_smooth_at_its_seam():
    values = 2e5 + 1e5 * np.cos(ANGLES / 2.0) + 3e4 * np.sin(ANGLES)
    cylinder = engines.CylinderPressure(ANGLES, values, area=0.01, phase=0.3)
    for angle in (-20.0, -0.01, 0.0, 5.0, 4.0 * np.pi, 31.0):
        late = angle - 0.3
        wanted = 2e5 + 1e5 * np.cos(late / 2.0) + 3e4 * np.sin(late)
        np.testing.assert_allclose(cylinder.pressure(angle), wanted, atol=5.0)
    np.testing.assert_allclose(cylinder.force(0.3), -0.01 * (3e5 - 101325.0), rtol=1e-9)
    slope = jax.grad(cylinder.pressure)
    np.testing.assert_allclose(slope(0.3 - 1e-9), slope(0.3 + 1e-9), atol=1.0)
    np.testing.assert_allclose(slope(1.0), (cylinder.pressure(1.001) - cylinder.pressure(0.999)) / 0.002, rtol=1e-4)


def test_orders_of_an_inertia_torque():
    """Torque of a piston at steady speed, `-m a dx/dangle`, beside Taylor's series in r/l of its orders."""
    r, ratio, mass, speed = 0.04, 0.25, 0.6, 300.0
    angle = jnp.asarray(2.0 * np.pi * np.arange(256) / 256)
    place = lambda a: r * (jnp.cos(a) + jnp.sqrt(1.0 - (ratio * jnp.sin(a)) ** 2) / ratio)
    first, second = jax.vmap(jax.grad(place))(angle), jax.vmap(jax.grad(jax.grad(place)))(angle)
    found = engines.orders(-mass * speed**2 * second * first)
    unit = mass * (r * speed) ** 2
    b1 = ratio / 4.0 + ratio**3 / 16.0 + 15.0 * ratio**5 / 512.0  # Taylor, The internal combustion engine, II, 8
    b2 = -(0.5 + ratio**4 / 32.0 + ratio**6 / 32.0)
    np.testing.assert_allclose(-found.of(1.0).imag / unit, b1, rtol=1e-4)
    np.testing.assert_allclose(-found.of(2.0).imag / unit, b2, rtol=1e-4)
    np.testing.assert_allclose(engines.orders(jnp.cos(angle), turns=2).of(0.5), 1.0, atol=1e-12)
    with pytest.raises(mbs.ModelError, match="no order 0.7"):
        found.of(0.7)


def test_torsion_of_two_inertias():
    train = engines.CrankTrain([0.2, 0.5], [3e4])
    np.testing.assert_allclose(train.frequencies(), [np.sqrt(3e4 * (1 / 0.2 + 1 / 0.5))], rtol=1e-12)
    np.testing.assert_allclose(train.critical_speeds(2.0), train.frequencies() / 2.0)
    equal = engines.CrankTrain([0.1] * 3, [1e4] * 2)
    np.testing.assert_allclose(equal.frequencies() ** 2 * 0.1 / 1e4, [1.0, 3.0], rtol=1e-12)
    angle = jnp.asarray(2.0 * np.pi * np.arange(64) / 64)
    push = engines.orders(10.0 * jnp.cos(angle) + 4.0 * jnp.cos(3.0 * angle), count=4)
    angles = train.response(50.0, {0: push})
    for order, size in ((1, 10.0), (3, 4.0)):
        w = 50.0 * order
        twist = size / 0.2 / (3e4 * 7.0 - w**2)  # of the relative coordinate
        np.testing.assert_allclose(angles[order - 1, 0] - angles[order - 1, 1], twist, rtol=1e-10)
    np.testing.assert_allclose(train.shaft_torques(angles)[0, 0], -3e4 * (angles[0, 0] - angles[0, 1]), rtol=1e-12)


@pytest.mark.long
def test_flywheel_of_a_wheel_under_a_torque_that_changes():
    """`J w w' = T cos 2 a` of the angle: `w^2 = w0^2 + T sin(2 a) / J`."""
    like = wheel(1.0)

    def cycle_of(inertia):
        system = wheel(inertia, like)
        start = mbs.State.at(system, velocities={"shaft": 40.0})
        return system, mbs.periodic(
            system, np.pi / 40.0, start, free="period", turns={"shaft": 1}, held=["shaft", "rate of shaft"]
        )

    found = engines.flywheel(cycle_of, "shaft", 0.01, first=1.0)
    total = 0.2 + float(found.inertia)
    # w^2 = 40^2 + 30 sin(2 a) / J from a = 0 on
    w = np.sqrt(40.0**2 + 30.0 / total * np.sin(2.0 * np.linspace(0.0, 2.0 * np.pi, 4001)[:-1]))
    mean = 1.0 / np.mean(1.0 / w)
    np.testing.assert_allclose((w.max() - w.min()) / mean, 0.01, rtol=1e-6)
    np.testing.assert_allclose(found.fluctuation, 0.01, rtol=2e-7)
    with pytest.raises(mbs.ModelError, match="without a flywheel"):
        engines.flywheel(cycle_of, "shaft", 0.9, first=1.0)


def wheel(inertia, like=None):
    """A wheel with a flywheel of this inertia under a torque that changes with its angle."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("wheel", 1.0, inertia=(1.0, 1.0, 0.2))
    b.joint("shaft", mbs.Revolute("z"), "ground", "wheel")
    b.force("gas", mbs.Actuator(lambda a, v, t: 30.0 * jnp.cos(2.0 * a)), joint="shaft")
    b.body("flywheel", 1.0, inertia=(1.0, 1.0, inertia))
    b.joint("rim", mbs.Weld(), "wheel", "flywheel")
    return b.build(like=like)


def test_wrong_arguments_are_refused():
    for match, call in {
        "strokes": lambda: engines.CylinderPressure(ANGLES, ANGLES, 0.01, strokes=3),
        "sense": lambda: engines.CylinderPressure(ANGLES, ANGLES, 0.01, sense=0),
        "at least 8": lambda: engines.CylinderPressure([0.0, 1.0], [1.0, 1.0], 0.01),
        "less than the cycle": lambda: engines.CylinderPressure(ANGLES, ANGLES, 0.01, strokes=2),
        "must rise": lambda: engines.CylinderPressure(ANGLES[::-1], ANGLES, 0.01),
        "more than 48": lambda: engines.orders(np.ones(10)),
        "one for each shaft": lambda: engines.CrankTrain([1.0, 1.0], [1.0, 2.0]),
        "inertias must be positive": lambda: engines.CrankTrain([1.0, 0.0], [1.0]),
        "no inertia 5": lambda: engines.CrankTrain([1.0, 1.0], [1.0]).response(1.0, {5: engines.orders(np.ones(64))}),
        "fluctuation": lambda: engines.flywheel(lambda J: None, "shaft", -1.0, 1.0),
    }.items():
        with pytest.raises(mbs.ModelError, match=match):
            call()
