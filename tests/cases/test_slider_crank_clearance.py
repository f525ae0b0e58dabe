"""A slider-crank with 0.2 mm clearance in its wrist pin: the pin's load beside SciPy and beside the ideal joint."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs.contact import HuntCrossley, JournalInBush, hertz_stiffness

CRANK, ROD, SPEED = 0.05, 0.12, 20.0 * np.pi  # [m], [rad/s]
ROD_MASS, ROD_INERTIA, SLIDER_MASS = 0.21, 2.5e-4, 0.14
RADIUS, CLEARANCE, DAMPING = 0.01, 2e-4, 5.0
STIFFNESS = float(hertz_stiffness((RADIUS, -RADIUS - CLEARANCE), (2.07e11, 2.07e11), (0.3, 0.3)))
TS = np.linspace(0.0, 0.2, 401)[1:]  # two turns

pytestmark = pytest.mark.long


def slider_crank(with_clearance=True, clearance=CLEARANCE, max_depth=None, like=None):
    """The pin is on the slider, its bush in the rod."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("crank", 0.3, inertia=1e-4)
    b.body("rod", ROD_MASS, com=(ROD / 2, 0.0, 0.0), inertia=ROD_INERTIA)
    b.body("slider", SLIDER_MASS, inertia=1e-4)
    b.joint("crank", mbs.Revolute("z"), "ground", "crank", drive=mbs.Ramp(0.0, SPEED))
    b.joint("rod", mbs.Revolute("z"), "crank", "rod", parent_frame=(CRANK, 0.0, 0.0))
    b.joint("slide", mbs.Prismatic("x"), "ground", "slider")
    if with_clearance:
        pair = JournalInBush(RADIUS, clearance, 0.02, sections=1)
        force = HuntCrossley(STIFFNESS, 1.5, DAMPING)
        b.contact("pin", pair, "slider", ("rod", (ROD, 0.0, 0.0)), force, max_depth=max_depth)
    else:
        b.joint("pin", mbs.Revolute("z"), "rod", "slider", parent_frame=(ROD, 0.0, 0.0))
    return b.build(like=like)


def start_of(system):
    """Stretched out, at the speed of the ideal mechanism, the pin in the middle of its bush."""
    given = {"rod": 0.0, "slide": CRANK + ROD}
    if system.closures:
        return mbs.State.at(system, given)
    return mbs.State.at(system, given, {"rod": -SPEED * (1.0 + CRANK / ROD), "slide": 0.0})


def load(system, tolerance, **options):
    """Load (times,) of the pin [N], and the motion."""
    options = {"ts": TS, "max_steps": 200_000} | options
    motion = mbs.simulate(system, start_of(system), rtol=tolerance, atol=1e-2 * tolerance, **options)
    return np.asarray(mbs.dynamics.contact_load(system, motion, "pin").normal_force)[:, 0], motion


def plane_rates(t, y, clearance):
    """Rates of the rod's angle, the slide and their speeds, by hand, and the load of the pin."""
    angle, x, turning, v = y
    wrist = CRANK * np.array([np.cos(SPEED * t), np.sin(SPEED * t)])
    along = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-along[1], along[0]])
    gap = np.array([x, 0.0]) - wrist - ROD * along
    parting = np.array([v, 0.0]) - SPEED * np.array([-wrist[1], wrist[0]]) - ROD * turning * across
    distance = np.hypot(*gap)
    depth, on_slider = max(distance - clearance, 0.0), np.zeros(2)
    if depth > 0.0:
        factor = 1.0 + DAMPING * gap @ parting / distance
        p = np.clip(0.5 + 10.0 * factor, 0.0, 1.0)  # the damping bends to zero where bodies would be drawn together
        factor = factor if p == 1.0 else 0.1 * p**4 * (2.5 - 3.0 * p + p**2)
        on_slider = -STIFFNESS * depth**1.5 * factor * gap / distance
    moment = ROD_MASS * ROD / 2 * SPEED**2 * across @ wrist - ROD * across @ on_slider
    rates = [turning, v, moment / (ROD_INERTIA + ROD_MASS * ROD**2 / 4), on_slider[0] / SLIDER_MASS]
    return rates, np.hypot(*on_slider)


def by_hand(ts, clearance, **options):
    """Angle, slide and their speeds (4, times) by DOP853."""
    start = [0.0, CRANK + ROD, -SPEED * CRANK / ROD, 0.0]
    rates = lambda t, y: plane_rates(t, y, clearance)[0]
    return solve_ivp(
        rates, (0.0, ts[-1]), start, **{"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, **options}, t_eval=ts
    ).y


@functools.cache
def reference():
    """Load (times,) by hand; at a tolerance of 1e-11 its peak would be wrong by 4e-5."""
    states = by_hand(TS, CLEARANCE, rtol=1e-12, atol=1e-14)
    return np.array([plane_rates(t, y, CLEARANCE)[1] for t, y in zip(TS, states.T, strict=True)])


def error(found):
    """Root of the mean square error of a load over the mean load."""
    return np.sqrt(np.mean((found - reference()) ** 2)) / reference().mean()


def test_loads_converge_with_the_tolerance():
    """The whole curve of the load comes nearer to SciPy's, its peak and mean too."""
    system, wanted, errors = slider_crank(), reference(), []
    for tolerance in (1e-5, 1e-7, 1e-8, 1e-10):
        found, motion = load(system, tolerance)
        assert motion.ok
        errors.append(error(found))
    assert np.all(np.array(errors[1:]) < 0.6 * np.array(errors[:-1])), errors
    assert errors[-1] < 1e-3
    np.testing.assert_allclose(found.max(), wanted.max(), rtol=3e-6)
    np.testing.assert_allclose(found.mean(), wanted.mean(), rtol=1e-4)


def test_beside_the_ideal_joint():
    """The load hammers about that of the ideal joint: the same on average along the slide, with higher peaks."""
    ideal = slider_crank(with_clearance=False)
    motion = mbs.simulate(ideal, start_of(ideal), ts=TS, rtol=1e-9, atol=1e-11)
    true = np.linalg.norm(np.asarray(mbs.reactions(ideal, motion)["pin"].force), axis=-1)
    found, _ = load(slider_crank(), 1e-8)
    second = slice(len(TS) // 2, None)
    assert found[second].max() > 1.2 * true[second].max()
    np.testing.assert_allclose(found[second].mean(), true[second].mean(), rtol=0.1)


def test_an_implicit_method_agrees():
    found, motion = load(slider_crank(), 1e-9, solver=mbs.ode.Rodas5P())
    assert motion.ok
    assert error(found) < 5e-3


def test_statuses():
    """Too few steps, and a bound on the depth, by explicit and implicit methods."""
    with pytest.raises(mbs.SimulationError, match="maximum number of steps") as found:
        load(slider_crank(), 1e-8, max_steps=300)
    assert found.value.motion.status == mbs.Status.MAX_STEPS
    deep = slider_crank(max_depth=1e-6)
    for options in ({}, {"solver": mbs.ode.Rodas5P()}):
        with pytest.raises(mbs.SimulationError, match="'pin' is pressed deeper than its max_depth") as found:
            load(deep, 1e-5, **options)
        assert found.value.motion.status == mbs.Status.VALIDITY


@pytest.mark.parametrize("gradient", ["forward", "reverse"])
def test_gradient_by_the_clearance(gradient):
    """Slide and speed after the first contacts, beside differences of the motion by hand in small steps.

    The load begins with the power 3/2 of the depth, so that the derivative of a step across its beginning converges
    slowly: 2.7 % off at 1e-8, 0.2 % at 1e-10.
    """
    like = slider_crank()
    start, ts = start_of(like), np.array([0.005, 0.01])

    def end(clearance):
        system = slider_crank(clearance=clearance, like=like)
        motion = mbs.simulate(system, start, ts=ts, rtol=1e-10, atol=1e-12, max_steps=5_000, gradient=gradient)
        return jnp.stack([system.coordinates(motion.end)["slide"], system.velocities(motion.end)["slide"]])

    found = jax.jit((jax.jacfwd if gradient == "forward" else jax.jacrev)(end))(CLEARANCE)
    h, fine = 1e-8, {"rtol": 1e-12, "atol": 1e-14, "max_step": 5e-6}
    ahead, back = (by_hand(ts, CLEARANCE + s * h, **fine)[[1, 3], -1] for s in (1, -1))
    np.testing.assert_allclose(found, (ahead - back) / (2 * h), rtol=2e-3)
