"""Several experiments side by side: the same answer as of one long record, gaps, failures by number, pendulums."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.errors import ModelError
from jaxmbs.identification import identify

X = np.linspace(0.0, 1.0, 7)
INPUTS = {"slope": np.array([1.0, 2.0, -1.0]), "shift": np.array([0.0, 0.3, 0.1])}


def response(u, experiment):
    line = experiment["slope"] * X
    return {"y": u["a"] * line + u["b"], "z": jnp.exp(jax.lax.complex(0 * X, (u["b"] + experiment["shift"]) * X))}


def data():
    rng = np.random.default_rng(0)
    line = INPUTS["slope"][:, None] * X
    y = 2.0 * line + 0.5 + 0.01 * rng.normal(size=(3, 7))
    z = np.exp(1j * (0.5 + INPUTS["shift"][:, None]) * X) + 0.01 * rng.normal(size=(3, 7))
    y[1, 3], z[2, 5] = np.nan, np.nan
    return {"y": y, "z": z}


@pytest.mark.parametrize("gradient", ["forward", "reverse"])
def test_as_one_long_record(gradient):
    measured, first = data(), {"a": 1.0, "b": 0.2}
    options = {"deviations": 0.01, "gradient": gradient}
    found = identify(response, measured, first, experiments=INPUTS, **options)

    def together(u):
        rows = [response(u, {name: x[k] for name, x in INPUTS.items()}) for k in range(3)]
        return {name: jnp.stack([row[name] for row in rows]) for name in ("y", "z")}

    whole = identify(together, measured, first, **options)
    np.testing.assert_allclose(found.values, whole.values, rtol=1e-12)
    np.testing.assert_allclose(found.covariance, whole.covariance, rtol=1e-10)
    assert found.freedom == whole.freedom == 20 + 40 - 2
    for name in ("y", "z"):
        np.testing.assert_allclose(found.prediction[name], whole.prediction[name], rtol=1e-12)
        np.testing.assert_allclose(found.prediction_band()[name], whole.prediction_band()[name], rtol=1e-9)
    assert np.isnan(found.prediction["y"][1, 3]) and found.prediction["z"].shape == (3, 7)


def test_faults():
    with pytest.raises(ModelError, match="not of 3 experiments"):
        identify(response, {"y": X, "z": X + 0j}, {"a": 1.0, "b": 0.2}, experiments=INPUTS)
    with pytest.raises(ModelError, match="experiments 2 fail"):
        identify(lambda u, e: jnp.sqrt(u["a"] * e), np.ones(3), {"a": 1.0}, experiments=np.array([1.0, 2.0, -1.0]))


@pytest.mark.long
def test_pendulums_with_filter_delay_and_pose_of_the_sensor():
    """Accelerations of a point at an unknown radius, late and filtered, of three swings: six unknowns."""

    def build(u, like=None):
        b = mbs.SystemBuilder()
        b.body("bob", mass=1.0, com=(0, 0, -u["length"]))
        b.joint("pin", mbs.Revolute("y"), "ground", "bob")
        b.force("air", mbs.SpringDamper(damping=u["damping"]), joint="pin")
        return b.build(like=like)

    truth = {"length": 1.2, "damping": 0.3, "radius": 0.7, "offset": 0.02, "delay": 0.05, "lag": 0.08}
    first = {"length": 1.0, "damping": 0.1, "radius": 0.5, "offset": 0.0, "delay": 0.0, "lag": 0.04}
    like, ts = build(first), np.linspace(0.1, 4.0, 80)
    fine = np.linspace(0.0, 4.0, 401)

    def rate_of(u, angle):
        state = mbs.State.at(build(u, like), pin=angle)
        motion = mbs.simulate(build(u, like), state, ts=fine, rtol=1e-8, atol=1e-8, gradient="forward")
        speed = u["radius"] * motion.states.velocities[:, 0]
        share = jnp.exp(-0.01 / u["lag"])  # a filter of first order, step by step
        kernel = (1 - share) * share ** jnp.arange(401.0)
        filtered = jnp.convolve(speed, kernel)[:401]
        return jnp.interp(ts - u["delay"], fine, filtered) + u["offset"]

    angles = np.array([0.5, 1.0, 2.0])
    clean = np.stack([np.asarray(rate_of(truth, angle)) for angle in angles])
    noisy = clean + 0.005 * np.random.default_rng(2).normal(size=clean.shape)
    found = identify(rate_of, noisy, first, deviations=0.005, experiments=angles)
    assert found.ok and 0.8 < found.chi_squared / found.freedom < 1.2
    for name, value in truth.items():
        assert abs(found.unknowns[name] - value) < 4 * found.standard_error(name) < 0.5 * value
