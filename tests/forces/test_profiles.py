"""Moves, rises of cams and sweeps against textbooks and SciPy; derivatives against finite differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

import jaxmbs as mbs
from jaxmbs.forces import CamRise, Chirp, Multisine, Trapezoid

SIZE = st.floats(0.05, 20.0)
LAWS = ("cycloidal", "modified sine", "3-4-5", "4-5-6-7")


@jax.jit
def _sampled(signal, t):
    first = jax.grad(signal)
    return tuple(jax.vmap(f)(t) for f in (signal, first, jax.grad(first)))


def sampled(signal, t):
    """Value and the first two rates at times."""
    return tuple(map(np.asarray, _sampled(signal, jnp.asarray(t))))


@jax.jit
def along(signal, t):
    return jax.vmap(signal)(jnp.asarray(t))


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(distance=SIZE, speed=SIZE, acceleration=SIZE, jerk=st.none() | SIZE, way=st.sampled_from([1.0, -1.0]))
def test_a_move_ends_at_its_distance_within_its_limits_and_touches_one(distance, speed, acceleration, jerk, way):
    move = Trapezoid(way * distance, speed, acceleration, jerk, start=0.3, before=2.0)
    end = float(move.duration)
    t = 0.3 + end * (np.arange(2000) + 0.5) / 2000
    x, v, a = sampled(move, t)
    assert np.all(way * v >= -1e-9 * speed) and np.all(np.abs(v) <= speed * (1 + 1e-9))
    assert np.all(np.abs(a) <= acceleration * (1 + 1e-9))
    np.testing.assert_allclose(x + x[::-1], 4.0 + way * distance, rtol=0, atol=1e-9 * distance)  # symmetric in time
    np.testing.assert_allclose(move(0.3 + 1e6 * end), 2.0 + way * distance, rtol=1e-15)
    np.testing.assert_allclose(move(0.0), 2.0)
    if jerk is None:
        least = (
            distance / speed + speed / acceleration
            if distance * acceleration > speed**2
            else 2 * np.sqrt(distance / acceleration)
        )
        np.testing.assert_allclose(end, least, rtol=1e-12)
    else:
        assert np.max(np.abs(np.diff(a))) <= jerk * end / 2000 * (1 + 1e-6)
        touched = np.max(np.abs(v)) / speed, np.max(np.abs(a)) / acceleration
        alone = distance * jerk**2 <= 2 * acceleration**3 * (1 + 1e-9) or speed * jerk <= acceleration**2 * (1 + 1e-9)
        assert alone or max(touched) > 0.98


def test_a_move_of_a_day_keeps_its_digits():
    """A long piece at its speed: ten kilometres at a tenth of a metre a second."""
    for jerk in (None, 3.0):
        move = Trapezoid(1e4, 0.1, 1.0, jerk)
        end = float(move.duration)
        x, v, a = sampled(move, np.linspace(0.2, end - 0.2, 1001))
        np.testing.assert_allclose(v[5:-5], 0.1, rtol=1e-12)
        np.testing.assert_allclose(x[500], 5e3, rtol=1e-14)
        np.testing.assert_allclose(a[5:-5], 0.0, atol=1e-12)


def test_an_s_curve_takes_the_time_of_the_textbook():
    """Biagiotti and Melchiorri (2008), example 3.9: 10 from rest with limits 5, 10 and 30 takes 2.8333 s."""
    np.testing.assert_allclose(Trapezoid(10.0, 5.0, 10.0, 30.0).duration, 2.0 + 0.5 + 1 / 3, rtol=1e-12)


@pytest.mark.parametrize("law, most_speed, most_acceleration, most_jerk", [
    ("cycloidal", 2.0, 2 * np.pi, 4 * np.pi**2),
    ("modified sine", 1.7596, 5.5280, 69.466),
    ("3-4-5", 1.875, 5.7735, 60.0),
    ("4-5-6-7", 2.1875, 7.5132, 52.5),
])  # fmt: skip
def test_rises_of_cams_have_the_peaks_of_the_handbook(law, most_speed, most_acceleration, most_jerk):
    t = np.linspace(0.0, 1.0, 40001)
    x, v, a = sampled(CamRise(1.0, 1.0, law), t)
    j = np.gradient(a, t)
    found = np.max(v), np.max(a), np.max(np.abs(j))
    np.testing.assert_allclose(found, (most_speed, most_acceleration, most_jerk), rtol=2e-4)
    np.testing.assert_allclose([x[0], x[-1], x[20000]], [0.0, 1.0, 0.5], atol=1e-12)
    assert np.all(np.diff(x) > -1e-13)


@pytest.mark.parametrize("is_logarithmic", [False, True])
def test_a_chirp_is_that_of_scipy(is_logarithmic):
    t = np.linspace(0.0, 3.0, 501)
    ours = Chirp(2 * np.pi * 1.5, 2 * np.pi * 20.0, 3.0, phase=np.pi / 2, is_logarithmic=is_logarithmic)
    theirs = scipy.signal.chirp(t, 1.5, 3.0, 20.0, method="logarithmic" if is_logarithmic else "linear")
    np.testing.assert_allclose(along(ours, t), theirs, atol=1e-10)


def test_a_chirp_goes_on_with_its_frequencies():
    signal, two = Chirp(3.0, 9.0, 2.0, start=1.0), np.array([0.2, 3.7])
    rates = [jax.grad(lambda t: jnp.unwrap(jnp.stack([jnp.arcsin(signal(t))]))[0])(t) for t in two]
    np.testing.assert_allclose(np.abs(rates), [3.0, 9.0], rtol=1e-9)


def test_a_multisine_of_schroeders_phases_is_flat():
    omegas = 2 * np.pi * np.arange(1, 33)
    t = np.linspace(0.0, 1.0, 4096, endpoint=False)
    x = np.asarray(along(Multisine(omegas), t))
    crest = np.max(np.abs(x)) / np.sqrt(np.mean(x**2))
    assert crest < 2.0  # 8 of equal phases
    ramp = Multisine(omegas, 1.0 / np.arange(1, 33), 0.0, mean=0.5)
    np.testing.assert_allclose(along(ramp, t), 0.5 + np.sin(np.outer(t, omegas)) @ (1 / np.arange(1, 33)), atol=1e-10)


MADE = {
    "trapezoid": lambda p: Trapezoid(p[0], p[1], p[2], None, p[3], p[4]),
    "short trapezoid": lambda p: Trapezoid(-p[0], 9.0 * p[1], p[2], None, p[3], p[4]),
    "s-curve": lambda p: Trapezoid(p[0], p[1], p[2], 9.0 * p[2], p[3], p[4]),
    "short s-curve": lambda p: Trapezoid(p[0], 9.0 * p[1], p[2], 9.0 * p[2], p[3], p[4]),
    "shortest s-curve": lambda p: Trapezoid(p[0], 9.0 * p[1], 9.0 * p[2], p[2], p[3], p[4]),
    **{law: lambda p, law=law: CamRise(p[0], p[1] + p[2], law, p[3], p[4]) for law in LAWS},
    "chirp": lambda p: Chirp(p[0], p[1], p[2], p[3], p[4]),
    "logarithmic chirp": lambda p: Chirp(p[0], p[1], p[2], p[3], p[4], is_logarithmic=True),
    "multisine": lambda p: Multisine(p[:2], p[1:3], None, p[3]),
}


@pytest.mark.parametrize("name", MADE)
def test_derivatives_by_every_number(name):
    p = np.array([0.8, 0.5, 1.1, 0.2, 0.4])
    t = jnp.asarray([0.33, 0.71, 1.27, 1.9, 6.0])
    value = lambda p: along(MADE[name](p), t)
    found = jax.jacfwd(value)(jnp.asarray(p))
    np.testing.assert_allclose(found, jax.jacrev(value)(jnp.asarray(p)), rtol=1e-12, atol=1e-13)
    steps = 1e-6 * np.eye(5)
    differences = np.stack([(value(p + s) - value(p - s)) / 2e-6 for s in steps], axis=-1)
    np.testing.assert_allclose(found, differences, atol=2e-8, rtol=1e-7)


def test_a_move_of_nothing_has_the_slope_of_its_end():
    moved = lambda distance: Trapezoid(distance, 1.0, 2.0, 30.0)(1.0)
    np.testing.assert_allclose(jax.grad(moved)(0.0), 1.0)


@pytest.mark.slow
def test_a_driven_slide_follows_an_s_curve():
    b = mbs.SystemBuilder()
    b.body("table", 10.0)
    move = Trapezoid(0.4, 0.5, 2.0, 40.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "table", drive=move)
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 1.4, 15))
    x, _, a = sampled(move, np.asarray(motion.states.t))
    np.testing.assert_allclose(mbs.position(system, motion.states, "table")[:, 0], x, atol=1e-12)
    force = mbs.reactions(system, motion)["slide"].effort
    np.testing.assert_allclose(np.ravel(force), 10.0 * a, atol=1e-9)


@pytest.mark.parametrize("make, words", [
    (lambda: Trapezoid(1.0, -1.0, 2.0), "speed must be positive"),
    (lambda: CamRise(1.0, 0.0), "duration must be positive"),
    (lambda: Chirp(1.0, -2.0, 3.0, is_logarithmic=True), "must differ and have one sign"),
])  # fmt: skip
def test_numbers_out_of_range_are_named(make, words):
    assert any(words in fault for fault in make().faults())


def test_unknown_law_of_a_cam():
    with pytest.raises(ValueError, match="'cycloidal', 'modified sine', '3-4-5', '4-5-6-7'"):
        CamRise(1.0, 1.0, "harmonic")


@pytest.mark.parametrize("name", MADE)
def test_a_model_file_keeps_it(name, tmp_path):
    b = mbs.SystemBuilder()
    b.body("table", 10.0)
    signal = MADE[name](np.array([0.8, 0.5, 1.1, 0.2, 0.4]))
    b.joint("slide", mbs.Prismatic("x"), "ground", "table", drive=signal)
    mbs.save_model(b, tmp_path / "model.json")
    system = mbs.load_model(tmp_path / "model.json").build()
    at = mbs.position(system, mbs.State.at(system, t=0.7), "table")[0]
    np.testing.assert_allclose(at, signal(0.7), rtol=1e-14, atol=1e-14)
