"""Samples of the loop against the exact recursion of a linear plant under a sampled controller."""

from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array
from scipy.signal import cont2discrete

from jaxmbs.ode import Gauss4
from jaxmbs.ode._events import Events
from jaxmbs.ode._integrate import Arguments, end_of_motion, integrate_equations, saved_rows
from jaxmbs.ode._options import make_options
from tests.marks import cases

PERIOD, END = 0.1, 1.05
START = (jnp.array([0.4, -0.2]), jnp.array([0.0, 0.3, 0.0]), jnp.zeros(0))
PLANT = np.array([[-2.0, 3.0], [-0.5, -1.0]]), np.array([[0.7], [0.2]])
GAINS = jnp.array([1.5, 4.0, 0.8])


class Plant(NamedTuple):
    """x' = A x + B (u + w), u held by a PI law of 1 - x1, w held by another law, of x2 and every second as long."""

    gains: Array
    periods: Array

    def rate(self, t, y):
        x, (u, _, w), none = y
        A, B = map(jnp.asarray, PLANT)
        return A @ x + B[:, 0] * (u + w), jnp.zeros(3), none

    def sample(self, t, y, due):
        x, (u, s, w), none = y
        kp, ki, kw = self.gains
        error = jnp.cos(t) - x[0]
        fast = jnp.stack([kp * error + ki * s, s + self.periods[0] * error])
        u, s = jnp.where(due[0], fast, jnp.stack([u, s]))
        if len(self.periods) == 2:
            w = jnp.where(due[1], -kw * x[1], w)
        return x, jnp.stack([u, s, w]), none

    def state_at(self, t, y):
        return y

    def after_action(self, t, y, number):
        return y[0] * jnp.array([-0.5, 1.0]), *y[1:]


def options(solver=None, dt=None, gradient="reverse", lands=True, periods=(PERIOD,), span=(0.0, END), actions=None):
    found = make_options(
        diffrax.Dopri8() if solver is None else solver,
        None,
        span=span,
        dt=dt,
        rtol=1e-11,
        atol=1e-12,
        gradient=gradient,
        max_steps=4000,
        lands_on_times=lands,
        progress=False,
        has_event=actions is not None,
        max_actions=actions or 0,
        periods=np.array(periods),
    )
    return jax.tree.map(lambda x: jnp.asarray(x) if isinstance(x, np.ndarray) else x, found)


def march(gains, y0, times, periods, chosen, events=None):
    """(rows, y at the end, its time, final state of the loop)."""
    t0, ts, t1 = times
    args = Arguments(Plant(gains, periods), events)
    problem, final, y0 = integrate_equations(args, y0, (t0, ts, t1), jnp.asarray(True), chosen, periods=periods)
    t, y, _ = end_of_motion(final, y0, t1, args)
    return saved_rows(final, ts, (t, y), args)[1], y, t, final


def recursion(gains, y0, times, periods):
    """States at sorted times by SciPy's exact discretisation, those at a sample before it."""
    (x, (u, s, w), _), (kp, ki, kw) = jax.tree.map(np.asarray, y0), np.asarray(gains)
    t0, ts, t1 = times
    instants = [(t0 + n * p, k) for k, p in enumerate(periods) for n in range(2000) if t0 + n * p < t1 - 1e-9]
    marks = sorted({round(t, 12) for t, _ in instants} | {round(float(t), 12) for t in ts} | {float(t1)})
    rows, t = {}, t0
    for mark in marks:
        if mark > t:
            Ad, Bd, *_ = cont2discrete((*PLANT, np.eye(2), np.zeros((2, 1))), mark - t)
            x, t = Ad @ x + Bd[:, 0] * (u + w), mark
        rows[mark] = np.array([*x, u, s, w])
        due = [k for when, k in instants if abs(when - mark) < 1e-9]
        error, x2 = np.cos(t) - x[0], x[1]
        if 0 in due:
            u, s = kp * error + ki * s, s + periods[0] * error
        if 1 in due:
            w = -kw * x2
    return np.stack([rows[round(float(t), 12)] for t in ts]), rows[float(t1)]


def flat(y):
    return jnp.concatenate(y, axis=-1)


CASES = {
    "lands": {},
    "interpolates": {"lands": False},
    "two periods": {"periods": (0.1, 0.3)},
    "fixed": {"solver": diffrax.Dopri8(), "dt": 0.03},
    "fixed, of the samples": {"solver": Gauss4(), "dt": 0.0025},
    "implicit": {"solver": diffrax.Kvaerno5()},
}


@pytest.mark.parametrize("case", cases(CASES, long={*CASES} - {"two periods"}))
def test_rows_are_those_of_the_recursion(case):
    """One of each sample among them, where the state before it is saved."""
    periods = jnp.array(CASES[case].get("periods", (PERIOD,)))
    times = 0.0, jnp.linspace(0.0, END, 22), END
    chosen = options(**CASES[case])
    rows, y, t, final = jax.jit(lambda: march(GAINS, START, jax.tree.map(jnp.asarray, times), periods, chosen))()
    wanted, end = recursion(GAINS, START, times, np.asarray(periods))
    assert t == END and diffrax.is_successful(final.result) and np.ptp(wanted[:, 2]) > 1.0
    assert int(final.tried) <= {"lands": 23, "fixed": 51, "fixed, of the samples": 421}.get(case, 60)
    limit = 1e-12 if case in ("lands", "two periods", "fixed") else 1e-8
    np.testing.assert_allclose(flat(rows), wanted, atol=limit)
    np.testing.assert_allclose(flat(y), end, atol=limit)


def slopes_and_differences(value, at, gradient):
    """(slope, difference) of a function along a random way in each of its arguments."""
    slope = jax.jit(jax.grad(value) if gradient == "reverse" else jax.jacfwd(value))(at)
    run, (leaves, tree), rng, h = jax.jit(value), jax.tree.flatten(at), np.random.default_rng(3), 1e-5
    for k, leaf in enumerate(leaves):
        way = jnp.asarray(rng.normal(size=leaf.shape)) if leaf.ndim else jnp.ones(())

        def moved(h, k=k, way=way):
            return run(jax.tree.unflatten(tree, [x + h * way if j == k else x for j, x in enumerate(leaves)]))

        difference = (8 * (moved(h) - moved(-h)) - (moved(2 * h) - moved(-2 * h))) / (12 * h)
        yield jnp.sum(jax.tree.leaves(slope)[k] * way), difference


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("gradient", ["reverse", "forward"])
def test_derivatives(case, gradient):
    """By gains, the start's state and time, saved times, the end and the periods, against differences."""
    chosen = options(**CASES[case], gradient=gradient)
    periods = jnp.array(CASES[case].get("periods", (PERIOD,)))
    ts, weights = 0.03 + 0.163 * jnp.arange(6.0), jnp.arange(1.0, 6.0)  # times off the samples

    def value(x):
        gains, y0, start, ts, end, share = x
        rows, y, *_ = march(gains, y0, (start, ts, end), share * periods, chosen)
        return jnp.sum(jnp.sin(flat(rows)) @ weights) + flat(y) @ weights

    at = GAINS, START, jnp.asarray(0.0), ts, jnp.asarray(END), jnp.asarray(1.0)
    for slope, difference in slopes_and_differences(value, at, gradient):
        np.testing.assert_allclose(slope, difference, rtol=2e-5, atol=1e-6)


@pytest.mark.long
def test_reverse_and_forward_derivatives_agree():
    """Also where the log is full and steps are taken again."""
    ts, weights = 0.03 + 0.163 * jnp.arange(6.0), jnp.arange(1.0, 6.0)

    def value(gains, gradient, checkpoints=512):
        chosen = options(gradient=gradient)._replace(checkpoints=checkpoints)
        times = jnp.asarray(0.0), ts, jnp.asarray(END)
        rows, y, *_ = march(gains, START, times, jnp.array([PERIOD]), chosen)
        return jnp.sum(jnp.sin(flat(rows)) @ weights) + flat(y) @ weights

    forth = jax.jit(jax.jacfwd(lambda k: value(k, "forward")))(GAINS)
    back, tight = (jax.jit(jax.grad(lambda k, n=n: value(k, "reverse", n)))(GAINS) for n in (512, 8))
    np.testing.assert_allclose(back, forth, rtol=1e-10)
    np.testing.assert_allclose(tight, forth, rtol=1e-10)
    assert np.all(np.abs(forth[:2]) > 0.1)


@pytest.mark.long
@pytest.mark.parametrize("acts, gradient", [(True, "reverse"), (False, "forward")])
def test_events_beside_samples(acts, gradient):
    """One that ends the motion, and one that acts several times; its time moves with what it depends on."""
    events = Events((lambda y: y[0][0] - 0.55,), (1,), (acts,), 20 * acts)
    chosen = options(actions=20 * acts, gradient=gradient)
    ts, weights = 0.03 + 0.163 * jnp.arange(6.0), jnp.arange(1.0, 6.0)

    def run(x):
        gains, y0, start, share = x
        return march(gains, y0, (start, ts, jnp.asarray(END)), share * jnp.array([PERIOD]), chosen, events)

    def value(x):
        rows, y, t, _ = run(x)
        return flat(y) @ weights + 3.0 * t

    at = GAINS, START, jnp.asarray(0.0), jnp.asarray(1.0)
    _, _, t, final = jax.jit(run)(at)
    assert int(final.bracket.actions) == (3 if acts else 0) and (t == END) == acts
    for slope, difference in slopes_and_differences(value, at, gradient):
        np.testing.assert_allclose(slope, difference, rtol=1e-4, atol=1e-5)


@pytest.mark.long
def test_a_motion_goes_on_from_a_sample():
    """From the state that was saved there, as if it had not been stopped; several side by side."""

    def run(gains, y0, start, end):
        return march(gains, y0, (start, end[None], end), jnp.array([PERIOD]), options())[1]

    run = jax.jit(jax.vmap(run, (0, 0, None, None)))
    gains, y0 = jax.tree.map(lambda x: jnp.stack([x, 1.5 * x]), (GAINS, START))
    middle = run(gains, y0, jnp.asarray(0.0), jnp.asarray(0.5))
    end = run(gains, middle, jnp.asarray(0.5), jnp.asarray(END))
    np.testing.assert_allclose(flat(end), flat(run(gains, y0, jnp.asarray(0.0), jnp.asarray(END))), atol=1e-12)
    still = run(gains, y0, jnp.asarray(0.0), jnp.asarray(0.0))
    np.testing.assert_array_equal(flat(still), flat(y0))
