"""Long records by short motions: a chaotic one whose parameters a single motion cannot find."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

import jaxmbs as mbs
from jaxmbs.errors import ModelError
from jaxmbs.identification import identify, multiple_shooting

TS = np.linspace(0.0, 10.0, 201)
TRUTH, FIRST = {"sigma": 10.0, "rho": 28.0}, {"sigma": 8.0, "rho": 25.0}


def lorenz(u, start, ts):
    """Lorenz's attractor (times, 3), Runge and Kutta."""

    def rate(s):
        x, y, z = s
        return jnp.stack([u["sigma"] * (y - x), x * (u["rho"] - z) - y, x * y - 8.0 / 3.0 * z])

    def step(s, h):
        for _ in range(2):
            a = rate(s)
            b = rate(s + h / 4 * a)
            c = rate(s + h / 4 * b)
            s = s + h / 12 * (a + 2 * b + 2 * c + rate(s + h / 2 * c))
        return s, s

    last, states = lax.scan(step, start, jnp.diff(ts))
    return jnp.concatenate([start[None], states]), last


@pytest.mark.long
def test_a_chaotic_record():
    clean, _ = lorenz(TRUTH, jnp.array([1.0, 1.0, 20.0]), jnp.asarray(TS))
    data = np.asarray(clean) + 0.1 * np.random.default_rng(1).normal(size=clean.shape)

    def single(u):
        return lorenz(u, u["start"], jnp.asarray(TS))[0]

    def several(u):
        record, gaps = multiple_shooting(lambda s, ts: lorenz(u, s, ts), u["starts"], TS)
        return {"record": record, "gaps": gaps}

    starts = data[:-1:5]
    blind = identify(single, data, FIRST | {"start": data[0]}, deviations=0.1)
    zeros, noise = np.zeros((39, 3)), {"record": 0.1, "gaps": 1e-4}
    found = identify(several, {"record": data, "gaps": zeros}, FIRST | {"starts": starts}, deviations=noise)
    assert blind.chi_squared > 100 * blind.freedom
    assert found.ok and 0.8 < found.chi_squared / found.freedom < 1.2
    assert found.freedom == 603 - 5  # the gaps make up for the starts
    for name, value in TRUTH.items():
        assert abs(found.unknowns[name] - value) < 4 * found.standard_error(name) < 0.01 * value


@pytest.mark.long
def test_segments_of_a_motion_are_one_motion():
    clean, _ = lorenz(TRUTH, jnp.array([1.0, 1.0, 20.0]), jnp.asarray(TS))
    whole, gaps = multiple_shooting(lambda s, ts: lorenz(TRUTH, s, ts), clean[:-1:5], TS)
    np.testing.assert_allclose(whole, clean, rtol=1e-9)
    np.testing.assert_allclose(gaps, 0.0, atol=1e-9)


@pytest.mark.long
def test_a_double_pendulum():
    """Both lengths of a double pendulum that turns over, from its angles over eight seconds."""

    def build(u, like=None):
        b = mbs.SystemBuilder()
        b.body("upper", mass=1.0, com=(0, 0, -u["upper"]))
        b.body("lower", mass=0.5, com=(0, 0, -u["lower"]))
        b.joint("top", mbs.Revolute("y"), "ground", "upper")
        b.joint("middle", mbs.Revolute("y"), "upper", "lower", parent_frame=mbs.Pose((0, 0, -u["upper"])))
        return b.build(like=like)

    truth, first = {"upper": 1.0, "lower": 0.8}, {"upper": 1.1, "lower": 0.7}
    like, ts = build(first), np.linspace(0.0, 8.0, 161)

    def segment(u, start, ts):
        state = mbs.State(ts[0], start[:2], start[2:])
        motion = mbs.simulate(build(u, like), state, ts=ts, rtol=1e-8, atol=1e-8, gradient="forward")
        states = jnp.concatenate([motion.states.coordinates, motion.states.velocities], axis=1)
        return states[:, :2], states[-1]

    clean = np.asarray(segment(truth, jnp.array([2.5, 0.5, 0.0, 0.0]), jnp.asarray(ts))[0])
    data = clean + 0.005 * np.random.default_rng(0).normal(size=clean.shape)
    rates = np.gradient(data, ts, axis=0)
    starts = np.concatenate([data, rates], axis=1)[:-1:20]

    def predict(u):
        record, gaps = multiple_shooting(lambda s, t: segment(u, s, t), u["starts"], ts)
        return {"angles": record, "gaps": gaps}

    zeros = np.zeros((7, 4))
    noise = {"angles": 0.005, "gaps": 1e-5}
    found = identify(
        predict, {"angles": data, "gaps": zeros}, first | {"starts": starts}, deviations=noise, largest=1e3
    )
    # a rate that is nearly zero is never known to its own size
    assert found.ok and 0.8 < found.chi_squared / found.freedom < 1.2
    for name, value in truth.items():
        assert abs(found.unknowns[name] - value) < 4 * found.standard_error(name) < 0.01 * value


def test_faults():
    segment = lambda s, ts: (ts, s)
    for starts, ts in ((np.zeros((3, 2)), np.zeros(8)), (0.0, np.zeros(4)), (np.zeros(2), np.zeros((3, 3)))):
        with pytest.raises(ModelError, match="segments of equal counts"):
            multiple_shooting(segment, starts, ts)
    record, gaps = jax.jit(lambda s: multiple_shooting(segment, s, np.arange(5.0)))(jnp.zeros(2))
    assert record.tolist() == [0, 1, 2, 3, 4] and gaps.shape == (1,)
