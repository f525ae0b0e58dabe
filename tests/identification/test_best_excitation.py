"""Motions of experiments: closed forms of one joint, an arm's torques, limits that hold, and hidden directions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.errors import ModelError
from jaxmbs.identification import FourierMotion, best_excitation, identify


@pytest.mark.long
def test_fourier_motion_and_its_rates():
    rng = np.random.default_rng(0)
    motion = FourierMotion(jnp.array([0.1, -0.2]), *(jnp.asarray(x) for x in rng.normal(size=(2, 2, 3))), period=4.0)
    t, h = np.linspace(0.0, 4.0, 9), 1e-5
    x, v, a = motion.at(t)
    ahead, back = motion.at(t + h), motion.at(t - h)
    np.testing.assert_allclose(v, (ahead[0] - back[0]) / (2 * h), atol=1e-8)
    np.testing.assert_allclose(a, (ahead[1] - back[1]) / (2 * h), atol=1e-8)
    np.testing.assert_allclose(x[0], x[-1], atol=1e-14)
    np.testing.assert_allclose(np.mean(motion.at(motion.times(16))[0], axis=0), motion.offset, atol=1e-14)


def torque(u, motion):
    """Inertia, damping and an offset of the sensor."""
    _, v, a = motion.at(motion.times(40))
    return u["inertia"] * a[:, 0] + u["damping"] * v[:, 0] + u["offset"]


ONE = {"period": 2.0, "harmonics": 1, "deviations": 0.1, "progress": False}
UNKNOWNS = {"inertia": 2.0, "damping": 0.5, "offset": 1.0}


@pytest.mark.long
def test_one_harmonic_in_closed_form():
    """Inertia and damping are told by amplitudes alone: the stroke is used up."""
    found = best_excitation(
        torque, UNKNOWNS, ((-0.3,), (0.5,)), period=2.0, harmonics=1, deviations=0.1, progress=False
    )
    amplitude, w = 0.4, np.pi
    size = np.hypot(*(float(x[0, 0]) for x in (found.motion.sines, found.motion.cosines))) / w
    np.testing.assert_allclose(size, amplitude, rtol=1e-6)
    root = np.sqrt(20) * amplitude / 0.1
    errors = dict(zip(found.names, found.standard_errors, strict=True))
    np.testing.assert_allclose(errors["inertia"], 1 / (root * w**2), rtol=1e-6)
    np.testing.assert_allclose(errors["damping"], 1 / (root * w), rtol=1e-6)
    np.testing.assert_allclose(errors["offset"], 0.1 / np.sqrt(40), rtol=1e-6)
    assert found.unseen == () and "3 of 3 directions" in str(found)


@pytest.mark.long
def test_a_limit_of_load_and_what_is_known():
    """A torque limit takes effect; an experiment that is done shows what the motion cannot, and counts."""
    limit = mbs.Limit("torque", lambda m: torque(UNKNOWNS, m), -2.0, 2.5)
    found = best_excitation(torque, UNKNOWNS, ((-0.3,), (0.5,)), limits=limit, **ONE)
    assert found.optimum.ok and np.max(torque(UNKNOWNS, found.motion)) < 2.5 + 1e-6
    blind = lambda u, m: torque(u | {"offset": 0.0}, m)
    hidden = best_excitation(blind, UNKNOWNS, ((-1.0,), (1.0,)), **ONE)
    assert [set(one.coefficients) for one in hidden.unseen] == [{"offset"}] and "stays hidden" in str(hidden)
    still = identify(lambda u: u["offset"] * np.ones(9), np.ones(9), UNKNOWNS, deviations=0.1)
    both = best_excitation(blind, UNKNOWNS, ((-1.0,), (1.0,)), known=still, **ONE)
    assert both.unseen == () and len(still.unseen) == 2
    assert still.with_experiment(hidden.jacobian) == ()


@pytest.mark.long
@pytest.mark.parametrize("gradient", ["forward", "reverse"])
def test_an_arm_within_stroke_speed_and_acceleration(gradient):
    """More information than any of 200 random motions scaled to the same limits; of six numbers four are seen."""

    def arm(u, like=None):
        b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
        b.body("upper", mass=u["m1"], com=(u["c1"], 0, 0), inertia=(0.01, u["I1"], u["I1"]))
        b.body("fore", mass=u["m2"], com=(u["c2"], 0, 0), inertia=(0.01, u["I2"], u["I2"]))
        b.joint("shoulder", mbs.Revolute("y"), "ground", "upper")
        b.joint("elbow", mbs.Revolute("y"), "upper", "fore", parent_frame=mbs.Pose((0.5, 0, 0)))
        return b.build(like=like)

    values = {"m1": 3.0, "c1": 0.2, "I1": 0.1, "m2": 2.0, "c2": 0.25, "I2": 0.05}
    first = arm(values)

    def torques(u, motion):
        system = arm(u, first)
        effort = lambda q, v, a: mbs.inverse_dynamics(system, mbs.State(jnp.zeros(()), q, v), a)
        return jax.vmap(effort)(*motion.at(motion.times(60)))

    stroke, speed, acceleration = np.array([1.5, 2.0]), 3.0, 12.0
    options = {"period": 5.0, "harmonics": 4, "deviations": 0.05, "progress": False, "gradient": gradient}
    found = best_excitation(torques, values, (-stroke, stroke), speed, acceleration, compile="quick", **options)
    assert found.optimum.ok and len(found.unseen) == 2
    x, v, a = (np.max(np.abs(part), axis=0) for part in found.motion.at(np.linspace(0, 5, 500)))
    assert np.all(x < stroke + 1e-6) and np.all(v < speed + 1e-6) and np.all(a < acceleration + 1e-6)

    @jax.jit
    def information(motion):
        sizes = jnp.array([values[name] for name in found.names])
        tree = lambda w: torques(dict(zip(found.names, w, strict=True)), motion).ravel() / 0.05
        J = jax.jacfwd(tree)(sizes) * sizes[None, :]
        return 0.5 * jnp.linalg.slogdet(jnp.eye(6) + J.T @ J)[1]

    np.testing.assert_allclose(information(found.motion), found.information, rtol=1e-9)
    rng, best = np.random.default_rng(3), 0.0
    for _ in range(200):
        a, b = rng.normal(size=(2, 2, 4))
        trial = FourierMotion(jnp.zeros(2), jnp.asarray(a), jnp.asarray(b), 5.0)
        tops = [np.max(np.abs(part), axis=0) for part in trial.at(np.linspace(0, 5, 100))]
        factor = np.min([stroke / tops[0], speed / tops[1], acceleration / tops[2]], axis=0)[:, None]
        best = max(best, float(information(FourierMotion(jnp.zeros(2), factor * a, factor * b, 5.0))))
    assert found.information > best + 0.5


@pytest.mark.long
def test_a_search_with_more_limits_than_it_differentiates():
    """Of 384 limits some dozens are differentiated: the search takes in those that it would leave, and converges."""

    def friction(u, m):
        q, v, a = (x[:, 0] for x in m.at(m.times(40)))
        return u["I"] * a + u["d"] * v + u["f"] * jnp.tanh(v / 0.1) + u["g"] * jnp.sin(q) + u["k"] * q**3

    values = {"I": 2.0, "d": 0.5, "f": 1.0, "g": 3.0, "k": 1.0}
    options = {"period": 6.0, "harmonics": 8, "deviations": 0.1, "progress": False}
    found = best_excitation(friction, values, ((-1.0,), (1.0,)), 3.0, 12.0, **options)
    assert found.optimum.reason == "converged" and found.information > 21.3
    assert all(limit.ok for limit in found.optimum.limits)


FAULTS = {
    "stroke": (lambda: best_excitation(torque, UNKNOWNS, ((1.0,), (0.0,))), "the first below the second"),
    "speed": (lambda: best_excitation(torque, UNKNOWNS, ((0.0,), (1.0,)), speed=-1.0), "speed must be positive"),
    "noise": (lambda: best_excitation(torque, UNKNOWNS, ((0.0,), (1.0,)), deviations=-0.1), "deviations must be pos"),
    "parts": (
        lambda: best_excitation(torque, UNKNOWNS, ((0.0,), (1.0,)), deviations={"a": 1.0}),
        "parts of the pred",
    ),
    "harmonics": (lambda: best_excitation(torque, UNKNOWNS, ((0.0,), (1.0,)), harmonics=0), "harmonics"),
    "period": (lambda: best_excitation(torque, UNKNOWNS, ((0.0,), (1.0,)), period=0.0), "period"),
    "known": (
        lambda: best_excitation(
            torque, UNKNOWNS, ((0.0,), (1.0,)), known=identify(lambda u: u["b"] * np.ones(3), np.ones(3), {"b": 1.0})
        ),
        "known experiments",
    ),
}


@pytest.mark.parametrize("name", list(FAULTS))
def test_faults(name):
    call, message = FAULTS[name]
    with pytest.raises(ModelError, match=message):
        call()
