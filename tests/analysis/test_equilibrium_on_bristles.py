"""Rests of what stands on bristles: of all of them the nearest, with its derivatives."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import contact, vehicles
from jaxmbs.friction import LuGre
from tests.vehicles.tyres import COEFFICIENTS, VERTICAL

FEET = [(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)]
MU, SIGMA, G = 0.5, 1e4, 9.81


def block(slope=0.0, mass=2.0, like=None):
    """A block on four round feet on a slope."""
    b = mbs.SystemBuilder(gravity=(G * jnp.sin(slope), 0.0, -G * jnp.cos(slope)))
    b.body("block", mass, inertia=(0.02, 0.02, 0.03))
    b.joint("free", mbs.Free(), "ground", "block")
    foot = contact.Contact(contact.SphereOnPlane(0.01), contact.HuntCrossley(1e5), LuGre(MU, SIGMA))
    for k, (x, y) in enumerate(FEET):
        b.force(f"foot {k}", foot, between=("ground", ("block", (x, y, -0.05))))
    return b.build() if like is None else b.build(like=like)


START = {"free": [0.0, 0.0, 0.059, 1.0, 0.0, 0.0, 0.0]}  # a millimetre deep
system = functools.cache(block)


def rest(slope, mass=2.0, throw=False):
    b = block(slope, mass, like=system())
    return mbs.equilibrium(b, mbs.State.at(b, START), throw=throw)


@functools.cache
def rests():
    system()  # before a trace
    return mbs.jit(rest)


@pytest.mark.long
@pytest.mark.parametrize("slope", [0.0, 0.3, 0.9 * np.arctan(MU)])
def test_a_block_rests_on_a_slope(slope):
    """Loads of the four feet by statics; bristles bend by tan(slope) / sigma; it does not move along the slope."""
    found = rests()(slope)
    assert found.ok and found.stable
    bends = np.array([found.state.internal[f"foot {k}.bristle"][0] for k in range(4)])
    tilt = float(found.state.coordinates[5]) * 2.0  # about y, for small turns
    np.testing.assert_allclose(bends[:, 0], np.tan(slope) / SIGMA, atol=1e-3 * (1e-12 + np.abs(tilt)))
    np.testing.assert_allclose(bends[:, 1:], 0.0, atol=1e-6 / SIGMA)
    np.testing.assert_allclose(found.state.coordinates[:2], 0.0, atol=1e-12)
    b = block(slope, like=system())
    loads = [mbs.dynamics.contact_load(b, found.state, f"foot {k}") for k in range(4)]
    normal = np.array([float(load.normal_force[0]) for load in loads])
    along = np.array([float(load.friction[0, 0]) for load in loads])
    np.testing.assert_allclose(normal.sum(), 2.0 * G * np.cos(slope), rtol=1e-8)
    np.testing.assert_allclose(along.sum(), -2.0 * G * np.sin(slope), atol=1e-7)
    # moment of the weight about the plane, between the feet at +-0.1 m
    height = float(found.state.coordinates[2])
    moment = 0.1 * (normal[:2].sum() - normal[2:].sum())
    np.testing.assert_allclose(moment, 2.0 * G * np.sin(slope) * height, rtol=2e-2)


@pytest.mark.long
def test_beyond_the_angle_of_friction_nothing_rests():
    assert not rests()(1.02 * np.arctan(MU)).ok
    assert rests()(0.98 * np.arctan(MU)).ok
    with pytest.raises(mbs.SimulationError, match="no equilibrium"):
        rest(1.02 * np.arctan(MU), throw=True)


@pytest.mark.long
def test_a_rest_is_a_rest_in_time():
    """A motion from it stays there, also with bristles that were bent before."""
    found = rests()(0.3)
    b = block(0.3, like=system())
    motion = mbs.simulate(b, found.state, ts=np.array([0.0, 0.05]), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(motion.states.coordinates[-1], found.state.coordinates, atol=1e-8)
    bent = {f"foot {k}.bristle": [[1e-5, 2e-5 * (-1) ** k, 0.0]] for k in range(4)}
    again = mbs.equilibrium(system(), mbs.State.at(system(), START, internal=bent), throw=False)
    assert again.ok
    sizes = [float(again.state.internal[f"foot {k}.bristle"][0, 0]) for k in range(4)]
    np.testing.assert_allclose(sum(sizes), 0.0, atol=1e-9)


@pytest.mark.long
def test_slopes_of_a_rest():
    """Of pose and bristles by slope and mass, beside differences."""

    def found(x):
        state = rest(x[0], x[1]).state
        return jnp.concatenate([state.coordinates, state.internal.values])

    system()
    at, x = mbs.jit(found), jnp.array([0.3, 2.0])
    slopes = mbs.jit(jax.jacfwd(found))(x)
    for k, h in enumerate((1e-3, 1e-2)):
        step = h * np.eye(2)[k]
        difference = (8.0 * (at(x + step) - at(x - step)) - at(x + 2 * step) + at(x - 2 * step)) / (12.0 * h)
        np.testing.assert_allclose(slopes[:7, k], difference[:7], atol=1e-6)
        np.testing.assert_allclose(slopes[7:, k], difference[7:], rtol=1e-5, atol=1e-11)
    assert np.abs(slopes[:7, 1]).max() > 1e-5 and slopes[7, 0] > 1e-4
    reverse = mbs.jit(jax.grad(lambda x: jnp.sum(found(x)[7:] ** 2) / 1e-8))(x)
    forward = np.sum(2e8 * at(x)[7:, None] * slopes[7:], axis=0)
    np.testing.assert_allclose(reverse, forward, rtol=1e-6, atol=1e-9)


POINTS = {
    **{"LF": (0.3, 0.3, 0.1), "LR": (-0.3, 0.3, 0.1), "LO": (0.0, 0.75, 0.1)},
    **{"UF": (0.3, 0.3, 0.5), "UR": (-0.3, 0.3, 0.5), "UO": (0.0, 0.75, 0.5)},
    **{"TI": (-0.15, 0.35, 0.3), "TO": (-0.15, 0.75, 0.3), "AI": (0.0, 0.7, 0.3), "AO": (0.0, 0.75, 0.3)},
    "S": (0.0, 0.75, 0.9),
}


def car(mass, like=None):
    """A car of wishbones on tyres with relaxation, at standstill."""
    numbers = COEFFICIENTS | VERTICAL | {"VERTICAL_DAMPING": 4000.0}
    tyres = tuple(vehicles.Tyre(vehicles.MagicFormula(numbers, "5.2", mirrored=m)) for m in (False, True))
    own, spring = vehicles.double_wishbone(POINTS, 0.3, arms=False), mbs.SpringDamper(3e4, 3e3, 0.85)
    axle = lambda x: vehicles.CarAxle(own, (x, 0.0, 0.0), tyres, spring, 20.0, 15.0, ((0.2,) * 3, (0.6, 1.0, 0.6)))
    b, _ = vehicles.car(axle(1.2), axle(-1.4), mass, (0.0, 0.0, 0.5), (500.0, 1500.0, 1600.0))
    return b.build(linear_solver="dense") if like is None else b.build(like=like)


@pytest.mark.long
def test_a_car_stands_on_tyres_with_relaxation():
    """Loads by statics, unbent treads, slopes by mass beside differences."""
    system = car(1000.0)
    start = mbs.State.at(system)
    found = mbs.equilibrium(system, start)
    assert found.ok and found.stable
    np.testing.assert_allclose(found.state.internal.values, 0.0, atol=1e-9)
    tyres = [f"{axle} {side} tyre" for axle in ("front", "rear") for side in ("left", "right")]
    reports = mbs.dynamics.element_reports(system, found.state).results
    loads = [float(reports[tyre]["load"].value) for tyre in tyres]
    np.testing.assert_allclose(sum(loads), 9.81 * (1000.0 + 4 * 35.0 + 4.0), rtol=1e-2)
    np.testing.assert_allclose(loads[::2], loads[1::2], rtol=1e-9)

    def place(mass):
        other = car(mass, like=system)
        return mbs.equilibrium(other, start, follow=False).state.coordinates

    slope = mbs.jit(jax.jacfwd(place))(1000.0)
    place = mbs.jit(place)
    np.testing.assert_allclose(slope, (place(1001.0) - place(999.0)) / 2.0, atol=1e-11)
    assert float(slope[2]) < -5e-5
