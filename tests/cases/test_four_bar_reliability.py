"""The peak pin force of a driven four-bar with scatter in twelve numbers, beside the linkage's equations in NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.design import reliability
from jaxmbs.probability import Normal

FOUR_BAR = {
    "crank": 0.1, "coupler": 0.3, "rocker": 0.25, "ground": 0.28, "rise": 0.05,
    "crank mass": 0.5, "coupler mass": 1.2, "rocker mass": 1.0,
    "crank centre": 0.05, "coupler centre": 0.15, "rocker centre": 0.12, "speed": 60.0,
}  # fmt: skip
SCATTER = {name: Normal(value, 0.01 * value) for name, value in FOUR_BAR.items()}
FIRST_ANGLE = 0.3


def _build(x, like=None):
    builder = mbs.SystemBuilder(gravity=(0, -9.81, 0))

    def rod(name):
        mass, length, centre = x[f"{name} mass"], x[name], x[f"{name} centre"]
        about = mass * length**2 / 12
        builder.body(name, mass=mass, com=jnp.stack([centre, 0 * centre, 0 * centre]), inertia=(1e-6, about, about))
        return jnp.stack([length, 0 * length, 0 * length])

    ends = {name: rod(name) for name in ("crank", "coupler", "rocker")}
    drive = mbs.Ramp(FIRST_ANGLE, x["speed"])
    builder.joint("A", mbs.Revolute("z"), "ground", "crank", drive=drive)
    builder.joint("B", mbs.Revolute("z"), "crank", "coupler", parent_frame=ends["crank"])
    at_D = jnp.stack([x["ground"], x["rise"], 0 * x["rise"]])
    builder.joint("D", mbs.Revolute("z"), "ground", "rocker", parent_frame=at_D)
    builder.joint(
        "C", mbs.Revolute("z"), "coupler", "rocker", parent_frame=ends["coupler"], child_frame=ends["rocker"]
    )
    return builder.build(like=like)


def _peak(x, like, start=None):
    """Largest force of pin B within a turn."""
    system = _build(x, like)
    ts = jnp.linspace(0.0, 2 * np.pi, 49) / x["speed"]
    start = mbs.State.at(system) if start is None else start
    motion = mbs.simulate(system, start, ts=ts, gradient="forward")
    force = lambda state: jnp.linalg.norm(mbs.reactions(system, state)["B"].force)
    return mbs.motion.peak(system, motion, force).value


def _peak_by_hand(x, angles):
    """The same of columns of numbers (n, 1) over angles (k,): positions as complex numbers, then Newton and Euler."""
    cross = lambda u, v: (np.conj(u) * v).imag
    q, r, w, mass = x["coupler"], x["rocker"], x["speed"], x["coupler mass"]
    a = np.exp(1j * (FIRST_ANGLE + angles)) * x["crank"]
    span = x["ground"] + 1j * x["rise"] - a  # from pin B to pin D
    along = (q**2 - r**2 + abs(span) ** 2) / (2 * abs(span))
    b = span / abs(span) * (along - 1j * np.sqrt(q**2 - along**2))
    c = b - span  # coupler and rocker, to pin C, below
    bc = cross(b, c)
    wb, wc = w * cross(c, a) / bc, w * cross(b, a) / bc
    rest = -1j * (w**2 * a + wb**2 * b - wc**2 * c)
    ab, ac = -cross(c, rest) / bc, -cross(b, rest) / bc

    def moved(arm, speed, faster):
        return arm * (1j * faster - speed**2)

    at_b, at_c = b / q * x["coupler centre"], c / r * x["rocker centre"]
    coupler = moved(a, w, 0.0) + moved(at_b, wb, ab) + 9.81j  # acceleration of its centre, less gravity's
    rocker = moved(at_c, wc, ac) + 9.81j
    by_coupler = mass * (q**2 / 12 * ab + cross(at_b, coupler))  # moment about B
    by_rocker = x["rocker mass"] * (r**2 / 12 * ac + cross(at_c, rocker))  # about D
    force = (by_coupler * c + by_rocker * b) / bc  # of the rocker on the coupler
    return np.max(abs(mass * coupler - force), axis=-1)


def _sampled(allowed, number):
    """Share of designs with a higher peak, and its deviation, by plain samples of the equations by hand."""
    random, angles = np.random.default_rng(3), np.linspace(5.2, 6.2, 41)  # the peak is at 5.83 rad, +- 0.05
    failed = 0
    for _ in range(number // 10_000):
        x = {name: value * (1 + 0.01 * random.normal(size=(10_000, 1))) for name, value in FOUR_BAR.items()}
        failed += np.sum(_peak_by_hand(x, angles) > allowed)
    share = failed / number
    return share, np.sqrt(share / number)


@pytest.fixture(scope="module")
def like():
    return _build({name: jnp.asarray(value) for name, value in FOUR_BAR.items()})


@pytest.mark.long
def test_the_peak_of_a_pin_force_by_twelve_numbers(like):
    """Few gradients, and the share of designs that plain samples of the equations by hand have."""
    middle = {name: np.array([[value]]) for name, value in FOUR_BAR.items()}
    peak = float(_peak_by_hand(middle, np.linspace(0.0, 2 * np.pi, 9001))[0])
    nominal = float(mbs.jit(lambda x: _peak(x, like))(jax.tree.map(jnp.asarray, FOUR_BAR)))
    np.testing.assert_allclose(nominal, peak, rtol=1e-5)
    allowed = 1.08 * peak
    limit = lambda x: (allowed - _peak(x, like)) / 1000
    found = reliability(limit, SCATTER, samples=0, gradient="forward", compile="tape")
    assert found.faults == ("no samples confirm it",)
    assert found.gradients <= 15
    share, deviation = _sampled(allowed, 400_000)
    np.testing.assert_allclose(found.probability, share, atol=4 * deviation)
    for name in ("crank mass", "crank centre"):  # nothing of the crank's own mass passes through pin B
        assert found.importances[name] < 1e-12
    np.testing.assert_allclose(sum(found.importances.values()), 1.0, rtol=1e-9)


@pytest.mark.long
def test_a_linkage_that_is_not_mounted_anew_is_told(like):
    """The state of the first design closes no loop of another one: motions from it fail, which no kink is."""
    first = mbs.State.at(like)
    limit = lambda x: 2.0 - _peak(x, like, first) / 1000
    found = reliability(limit, SCATTER, samples=0, starts=1, gradient="forward", compile="tape")
    assert not found.ok and "not finite at points tried near the start" in found.faults[0]
