"""Life and 3 sigma loads as limits of a design, in the verbs of design; wrong conventions that are caught."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import jaxmbs as mbs
from jaxmbs import fatigue, qualification
from jaxmbs.errors import ModelError

GSFC = fatigue.psd_table([20.0, 50.0, 800.0, 2000.0], [0.026, 0.16, 0.16, 0.026], "g^2/Hz")
LENGTH, WIDTH, PAYLOAD = 0.06, 0.02, 0.2
CURVE = fatigue.SN(1e20, 8.0)  # stress in MPa


def answers(design):
    """A payload on a bracket of aluminium: mass, life and the 3 sigma shear force at its bolts."""
    t = design["thickness"]
    k = 7e10 * WIDTH * t**3 / (4 * LENGTH**3)
    system = mbs.LinearSystem(
        mass=jnp.full((1, 1), PAYLOAD),
        stiffness=jnp.reshape(k, (1, 1)),
        coordinates=["unit z"],
        positions={"unit": (0, 0, 0)},
    )
    rows = jnp.stack([k * 6 * LENGTH / (WIDTH * t**2) / 1e6, k])[:, None]
    out = {"bracket": qualification.Recovery(rows, ["stress", "bolt"])}
    inputs = {"base": qualification.BaseAcceleration(GSFC, "z")}
    found = mbs.random_response(system, inputs, out, ratios=0.05)
    stress = qualification.stress_spectrum(found, "bracket stress")
    life = 1 / fatigue.spectral_damage(stress, CURVE)
    return {"mass": 2700 * WIDTH * LENGTH * t, "life": life, "bolt": found.three_sigma[1]}


FIRST, BOUNDS = {"thickness": 6e-3}, {"thickness": (2e-3, 1.2e-2)}


@pytest.mark.long
def test_the_lightest_bracket_that_lives_an_hour():
    """The program of a user; the limit that acts is met as a root search finds it."""
    limits = [mbs.Limit("life", "life", lower=3600.0), mbs.Limit("bolt 3 sigma", "bolt", upper=150.0)]

    def objective(design):
        found = answers(design)
        return found["mass"], found

    best = mbs.minimise(objective, FIRST, BOUNDS, limits=limits, progress=False)
    assert best.ok
    only_life = brentq(lambda t: np.log(float(answers({"thickness": t})["life"]) / 3600), 2e-3, 1.2e-2, xtol=1e-12)
    at = answers({"thickness": only_life})
    assert at["bolt"] < 150.0
    np.testing.assert_allclose(best.design["thickness"], only_life, rtol=1e-5)


@pytest.mark.long
def test_sweep_pareto_and_tolerances():
    grid = {"thickness": np.linspace(3e-3, 9e-3, 4)}
    found = mbs.studies.sweep(answers, [{"thickness": t} for t in grid["thickness"]], progress=False)
    one = answers({"thickness": grid["thickness"][1]})
    np.testing.assert_allclose(found["life"].values[1], one["life"], rtol=1e-9)
    width = {"thickness": 1e-5}
    (only,) = mbs.design.tolerances(lambda d: jnp.log(answers(d)["life"]), FIRST, width)
    h = {"thickness": 1e-7}
    near = [jnp.log(answers({"thickness": FIRST["thickness"] + s * h["thickness"]})["life"]) for s in (1, -1)]
    slope = jax.grad(lambda d: jnp.log(answers(d)["life"]))(FIRST)["thickness"]
    np.testing.assert_allclose(slope, (near[0] - near[1]) / 2e-7, rtol=1e-6)
    front = mbs.design.pareto(
        lambda d: 100 * answers(d)["mass"], lambda d: -jnp.log(answers(d)["life"]), FIRST, BOUNDS, 3, progress=False
    )
    assert only.name == "thickness" and only.share == 1.0
    np.testing.assert_allclose(only.change, slope * width["thickness"], rtol=1e-9)
    assert len(front.first) == 3 and np.all(front.ok)
    lives = [jnp.log(answers({"thickness": t})["life"]) for t in front.designs["thickness"]]
    np.testing.assert_allclose(-front.second, lives, rtol=1e-9)
    thin, thick = (mass / (2700 * WIDTH * LENGTH) for mass in (front.first[0] / 100, front.first[-1] / 100))
    np.testing.assert_allclose(thin, 2e-3, rtol=1e-6)  # each end is that of one objective alone
    np.testing.assert_allclose(thick, 1.2e-2, rtol=1e-6)


def chain_life(k):
    """Logarithm of the life of the first spring of three oscillators, the last two equal and coupled by the spring
    k[3], whose stiffness may be zero: then two frequencies repeat."""
    D = np.array([[1.0, 0, 0], [-1, 1, 0], [-1, 0, 1], [0, -1, 1]])
    system = mbs.LinearSystem(
        mass=jnp.eye(3),
        stiffness=D.T @ jnp.diag(k) @ D,
        coordinates=["a z", "b z", "c z"],
        positions={"a": (0, 0, 0), "b": (0, 0, 1), "c": (0, 1, 1)},
    )
    rows = 1e-4 * k[0] * jnp.eye(3)[:1]
    inputs = {"base": qualification.BaseAcceleration(GSFC, "z")}
    found = mbs.random_response(system, inputs, {"s": qualification.Recovery(rows, ["x"])}, ratios=0.03)
    return -jnp.log(fatigue.spectral_damage(qualification.stress_spectrum(found, "s x"), CURVE, "dirlik"))


@pytest.mark.long
@pytest.mark.parametrize("coupling", [3e4, 0.0])
def test_gradient_of_a_life_by_every_stiffness(coupling):
    """Against differences of fourth order, with two uncoupled oscillators of one frequency among the cases."""
    k, life = jnp.array([3e5, 9e4, 9e4, coupling]), jax.jit(chain_life)
    found = jax.grad(life)(k)
    for j in range(4):
        h = 30.0 * jnp.eye(4)[j]
        secant = (8 * (life(k + h) - life(k - h)) - (life(k + 2 * h) - life(k - 2 * h))) / 360.0
        np.testing.assert_allclose(found[j], secant, rtol=1e-8, atol=1e-8 * float(jnp.max(jnp.abs(found))))


@pytest.mark.long
def test_gradient_of_a_life_by_thickness():
    life, t, h = jax.jit(lambda t: jnp.log(answers({"thickness": t})["life"])), FIRST["thickness"], 2e-6
    secant = (8 * (life(t + h) - life(t - h)) - (life(t + 2 * h) - life(t - 2 * h))) / (12 * h)
    np.testing.assert_allclose(jax.grad(life)(t), secant, rtol=1e-8)


TRAPS = {
    "levels per rad/s": lambda: fatigue.psd_table([10.0, 20.0], [1.0, 1.0], "g^2/(rad/s)"),
    "a point at 0 Hz": lambda: fatigue.psd_table([0.0, 20.0], [1.0, 1.0], "g^2/Hz"),
    "a level of zero on log-log paper": lambda: fatigue.psd_table([10.0, 20.0], [1.0, 0.0], "g^2/Hz"),
    "sides": lambda: fatigue.psd_table([10.0, 20.0], [1.0, 1.0], "g^2/Hz", sides=0),
    "a force spectrum on a base": lambda: qualification.BaseAcceleration(
        fatigue.psd_table([10.0, 20.0], [1.0, 1.0], "N^2/Hz")
    ),
    "a mean without ultimate strength": lambda: fatigue.damage(np.array([0.0, 1.0]), CURVE, "goodman"),
    "a knee without second slope": lambda: fatigue.SN(1e6, 3.0, knee=2.0),
    "oscillators above the sampling": lambda: mbs.shock_spectrum(np.ones(9), 1e-3, [900.0]),
    "damage of an acceleration": lambda: fatigue.spectral_damage(GSFC, CURVE),
}


@pytest.mark.parametrize("trap", TRAPS)
def test_wrong_conventions_are_refused(trap):
    with pytest.raises((ModelError, ValueError, TypeError)):
        TRAPS[trap]()


@pytest.mark.long
def test_conventions_that_are_converted():
    """Two-sided and angular spectra, ranges in place of amplitudes, a mean at the ultimate, a half cycle."""
    one = fatigue.psd_table([10.0, 20.0], [2.0, 4.0], unit=None)
    other = fatigue.psd_table(
        2 * np.pi * np.array([10.0, 20.0]), np.array([1.0, 2.0]) / 2 / np.pi, None, frequency_unit="rad/s", sides=2
    )
    np.testing.assert_allclose(other.moments((0, 2)), one.moments((0, 2)), rtol=1e-13)
    half = np.array([0.0, 2.0])  # half a cycle of amplitude 1
    np.testing.assert_allclose(fatigue.damage(half, fatigue.SN(1e3, 4.0)), 0.5e-3, rtol=1e-12)
    np.testing.assert_allclose(fatigue.damage(half, fatigue.SN(1e3, 4.0, ranges=True)), 8e-3, rtol=1e-12)
    assert np.isinf(fatigue.damage(half, CURVE, "goodman", 1.0))
    kink = fatigue.SN(1e6, 3.0, knee=2.0, second_slope=5.0)
    np.testing.assert_allclose(kink.damage(2.0 * (1 - 1e-12)), kink.damage(2.0), rtol=1e-9)
