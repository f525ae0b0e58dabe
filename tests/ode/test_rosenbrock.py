"""Rodas5P: its order, stiff motions with loops, derivatives, diffrax's own loop."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs.ode._rosenbrock import Rodas5P
from tests.models import DOWN_Y, PIN, four_bar, four_bar_state

SOLVER = Rodas5P()
START = (jnp.array([1.0]), jnp.array([0.5]), jnp.array([0.0]))


def rates(t, y, args):
    a, b, _ = y
    return b * jnp.cos(t) - a, -a * b + jnp.sin(3.0 * t), a * a


@pytest.fixture(scope="module")
def exact():
    """By SciPy's method of order eight."""
    found = solve_ivp(
        lambda t, y: np.concatenate([np.asarray(r) for r in rates(t, np.split(y, 3), None)]),
        (0.0, 1.0),
        np.concatenate(START),
        "DOP853",
        dense_output=True,
        rtol=1e-13,
        atol=1e-14,
    )
    return found.sol


def one_step(t, h, y):
    return SOLVER.step(diffrax.ODETerm(rates), t, t + h, y, None, None, False)


def test_order_of_steps_that_depend_on_time(exact):
    """Halved steps divide the error by 2^5, of the quadrature too."""

    @jax.jit
    def end(number):
        h = 1.0 / number
        return jax.lax.fori_loop(0, number, lambda k, y: one_step(k * h, h, y)[0], START)

    errors = np.array([np.abs(np.concatenate(end(n)) - exact(1.0)) for n in (16, 32, 64)])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 5.0, atol=0.4)


def test_order_of_the_interpolation_and_of_the_error(exact):
    """Both fall as h^5: the polynomial of order four, and the difference to the method of order four."""

    @jax.jit
    def inside(h):
        _, error, dense, _, _ = one_step(0.0, h, START)
        return SOLVER.interpolation_cls(t0=0.0, t1=h, **dense).evaluate(0.6 * h), error

    steps = (0.2, 0.1, 0.05)
    found = [inside(h) for h in steps]
    gaps = [np.max(np.abs(np.concatenate(y) - exact(0.6 * h))) for h, (y, _) in zip(steps, found, strict=True)]
    sizes = [np.max(np.abs(np.concatenate(error))) for _, error in found]
    for sequence in (gaps, sizes):
        assert np.all(np.log2(np.array(sequence[:-1]) / sequence[1:]) > 4.5)


def crawl(damping, gradient="reverse"):
    """(speed of the pin, motion) of a bar with a strong damper after half a second."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("bar", mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
    b.joint("pin", PIN, "ground", "bar")
    b.force("damper", mbs.SpringDamper(damping=damping), joint="pin")
    system = b.build()
    options = {"solver": SOLVER, "rtol": 1e-8, "atol": 1e-8, "gradient": gradient}
    motion = mbs.simulate(system, mbs.State.at(system, pin=0.3), ts=[0.5], **options)
    return motion.end.velocities[0], motion


@pytest.mark.long
def test_stiff_motion_and_its_gradients():
    """A creeping bar in few steps: its speed is weight over damper, gradients by central differences."""
    damping, step = 2000.0, 20.0
    (speed, motion), slope = jax.value_and_grad(crawl, has_aux=True)(damping)
    up, down = (float(crawl(c)[0]) for c in (damping + step, damping - step))
    np.testing.assert_allclose(slope, (up - down) / (2.0 * step), rtol=1e-3)
    np.testing.assert_allclose(jax.jacfwd(lambda c: crawl(c, "forward")[0])(damping), slope, rtol=1e-9)
    weight = 9.81 * 0.5 * np.cos(float(motion.end.coordinates[0]))
    np.testing.assert_allclose(speed, -weight / damping, rtol=1e-5)
    assert int(motion.diagnostics.num_steps) < 100


@pytest.mark.long
@pytest.mark.parametrize("loop", ["jaxmbs", "diffeqsolve"])
def test_closed_loop_in_either_loop(loop):
    """A four-bar's motion as the default has it, on its constraints."""
    system = four_bar()
    state, ts = four_bar_state(system), [0.2, 0.4]
    exact = mbs.simulate(system, state, ts=ts)
    motion = mbs.simulate(system, state, ts=ts, solver=SOLVER, rtol=1e-9, atol=1e-9, loop=loop)
    np.testing.assert_allclose(motion.states.coordinates, exact.states.coordinates, atol=1e-6)
    assert float(np.max(motion.diagnostics.constraint_drift)) < 1e-12
