"""The loop over steps and its adjoint against diffrax's own, on an equation with a closed-form event."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
import pytest

import jaxmbs as mbs
from jaxmbs.ode._adjoint import integrate_with_adjoint
from jaxmbs.ode._loop import integrate
from jaxmbs.ode._problem import OdeProblem

START = (jnp.array([1.0, 0.2]), jnp.array([-0.3]))
TIMES = jnp.array([0.0, 0.3, 0.3, 0.7, 1.1, 1.6])
STIFFNESS = jnp.array([3.0, 0.4])
NEWTON = optimistix.Newton(rtol=1e-12, atol=1e-12)


def rate(t, y, args):
    """A driven, damped, hardening oscillator and a quadrature."""
    (x, v), (w,) = y
    k, c = args
    return jnp.stack([v, jnp.cos(t) - k * x - c * v * x**2]), jnp.stack([x * v - 0.1 * w])


class Verlet(diffrax.AbstractSolver):
    """A user's own: the midpoint rule, without diffrax's machinery."""

    term_structure = diffrax.AbstractTerm
    interpolation_cls = diffrax.LocalLinearInterpolation

    def order(self, terms):
        return 2

    def init(self, terms, t0, t1, y0, args):
        return None

    def step(self, terms, t0, t1, y0, args, solver_state, made_jump):
        h = terms.contr(t0, t1)
        half = jax.tree.map(lambda y, k: y + 0.5 * h * k, y0, terms.vf(t0, y0, args))
        y1 = jax.tree.map(lambda y, k: y + h * k, y0, terms.vf(t0 + 0.5 * h, half, args))
        return y1, None, {"y0": y0, "y1": y1}, None, diffrax.RESULTS.successful

    def func(self, terms, t0, y0, args):
        return terms.vf(t0, y0, args)


ADAPTIVE = [diffrax.Dopri8(), diffrax.Tsit5(), diffrax.Bosh3(), diffrax.Heun(), diffrax.Ralston(), diffrax.Midpoint()]
ADAPTIVE += [diffrax.Dopri5(), diffrax.Kvaerno3(root_finder=NEWTON), diffrax.Kvaerno5(root_finder=NEWTON)]
FIXED = [diffrax.Euler(), diffrax.Tsit5(), diffrax.ImplicitEuler(root_finder=NEWTON), Verlet()]
FIXED += [diffrax.LeapfrogMidpoint(), diffrax.ReversibleHeun()]
CASES = [(solver, None) for solver in ADAPTIVE] + [(solver, 0.07) for solver in FIXED]


def name(value):
    return type(value).__name__ if isinstance(value, diffrax.AbstractSolver) else str(value)


def cases():
    """Every solver, landing on the saved times and passing over them."""
    return [(solver, dt, lands) for lands in (True, False) for solver, dt in CASES]


def controller(dt):
    return diffrax.ConstantStepSize() if dt else diffrax.PIDController(rtol=1e-5, atol=1e-6, pcoeff=0.2, icoeff=0.4)


def problem(solver, dt=None, lands=True, **options):
    lands = lands and dt is None
    return OdeProblem(
        solver, controller(dt), TIMES, TIMES[-1], jnp.asarray(4096, jnp.int32), rate, lands_on_times=lands, **options
    )


def ours(way, args, y0, problem, dt=None):
    t0, first = jnp.zeros(()), jnp.asarray(dt or 0.01)
    return way((y0, args), problem, t0, first) if way is integrate_with_adjoint else way(problem, y0, t0, first, args)


def theirs(solver, dt, lands, args, y0):
    steps = controller(dt)
    if lands and dt is None:
        steps = diffrax.ClipStepSizeController(steps, step_ts=TIMES)
    save = diffrax.SaveAt(ts=TIMES)
    return diffrax.diffeqsolve(
        diffrax.ODETerm(rate), solver, 0.0, TIMES[-1], dt or 0.01, y0, args, saveat=save, stepsize_controller=steps
    )


def loss(ys):
    weights = jnp.arange(1.0, 1.0 + len(TIMES))
    return jnp.sum(weights[:, None] * jnp.sin(ys[0])) + jnp.sum(weights[:, None] * ys[1] ** 2)


@pytest.mark.long
@pytest.mark.parametrize("solver, dt, lands", cases(), ids=name)
def test_steps_states_and_gradients_are_those_of_diffrax(solver, dt, lands):
    found = jax.jit(lambda: ours(integrate, STIFFNESS, START, problem(solver, dt, lands), dt))()
    wanted = jax.jit(lambda: theirs(solver, dt, lands, STIFFNESS, START))()
    assert int(found.tried) == int(wanted.stats["num_steps"]) > 4
    assert int(found.rejected) == int(wanted.stats["num_rejected_steps"])
    assert int(found.saved) == len(TIMES) and diffrax.is_successful(found.result)
    for ours_, theirs_ in zip(found.ys, wanted.ys, strict=True):
        np.testing.assert_allclose(ours_, theirs_, rtol=0.0, atol=1e-10)

    back = jax.jit(jax.grad(lambda x: loss(ours(integrate_with_adjoint, *x, problem(solver, dt, lands), dt).ys)))
    forth = jax.jit(jax.jacfwd(lambda x: loss(ours(integrate, *x, problem(solver, dt, lands), dt).ys)))
    for a, b in zip(*map(jax.tree.leaves, (back((STIFFNESS, START)), forth((STIFFNESS, START)))), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-10)
    if isinstance(solver, diffrax.AbstractERK | diffrax.AbstractImplicitSolver):
        gradient = jax.jit(jax.grad(lambda x: loss(theirs(solver, dt, lands, *x).ys)))((STIFFNESS, START))
        np.testing.assert_allclose(back((STIFFNESS, START))[0], gradient[0], rtol=1e-10, atol=1e-11)


@pytest.mark.long
@pytest.mark.parametrize("lands", [True, False], ids=["lands", "interpolates"])
@pytest.mark.parametrize("solver", [diffrax.Bosh3(), diffrax.Kvaerno3(root_finder=NEWTON)], ids=name)
def test_a_full_log_takes_steps_again(solver, lands):
    """With few rows for many steps; one by one and side by side, with ends of their own."""

    def gradient(rows):
        return jax.grad(
            lambda x: loss(ours(integrate_with_adjoint, *x, problem(solver, None, lands, checkpoints=rows)).ys)
        )

    roomy, tight = (jax.jit(gradient(rows))((STIFFNESS, START)) for rows in (512, 16))
    assert 40 < int(ours(integrate, STIFFNESS, START, problem(solver, None, lands)).tried) < 256
    many = jnp.stack([STIFFNESS, 2.0 * STIFFNESS])
    lanes = jax.jit(jax.vmap(lambda k: gradient(16)((k, START))))(many)
    for a, b, c in zip(*map(jax.tree.leaves, (roomy, tight, lanes)), strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(c[0], a, rtol=1e-10, atol=1e-11)


@pytest.mark.long
def test_second_derivatives_forward_over_reverse():
    def value(way):
        return lambda k: loss(ours(way, k, START, problem(diffrax.Tsit5())).ys)

    twice = jax.jit(jax.jacfwd(jax.jacfwd(value(integrate))))(STIFFNESS)
    mixed = jax.jit(jax.jacfwd(jax.jacrev(value(integrate_with_adjoint))))(STIFFNESS)
    np.testing.assert_allclose(mixed, twice, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(mixed, mixed.T, rtol=1e-8)


@pytest.mark.long
def test_too_few_steps_and_nothing_to_do():
    short = eqx.tree_at(lambda m: m.max_steps, problem(diffrax.Tsit5()), jnp.asarray(7, jnp.int32))
    state = ours(integrate, STIFFNESS, START, short)
    assert state.result == diffrax.RESULTS.max_steps_reached and int(state.tried) == 7 and int(state.saved) < 6
    still = eqx.tree_at(lambda m: (m.t1, m.times), short, (jnp.zeros(()), 0.0 * TIMES))
    value = lambda y0: loss(ours(integrate_with_adjoint, STIFFNESS, y0, still).ys)
    for found, wanted in zip(  # noqa: B905
        jax.grad(value)(START), jax.grad(lambda y: loss([jnp.stack([a] * 6) for a in y]))(START)
    ):
        np.testing.assert_allclose(found, wanted, rtol=1e-14)


@pytest.mark.long
@pytest.mark.parametrize("falls", [True, False])
def test_an_event_ends_a_march_beside_the_zero(falls):
    """x = cos 2t passes a level; the last step ends within a millionth of itself."""
    level = 0.4 if falls else -2.0

    def swing(t, y, args):
        return (y[0][::-1] * jnp.array([1.0, -4.0]),)

    def crossing(t, y, args):
        return y[0][:1] - level

    one = OdeProblem(
        diffrax.Dopri8(),
        diffrax.PIDController(rtol=1e-10, atol=1e-10),
        TIMES,
        TIMES[-1],
        jnp.asarray(4096, jnp.int32),
        swing,
        event=crossing,
        lands_on_times=False,
    )
    state = integrate(one, (jnp.array([1.0, 0.0]),), jnp.zeros(()), jnp.asarray(0.01), None)
    if falls:
        assert state.result == diffrax.RESULTS.event_occurred
        np.testing.assert_allclose(state.t, np.arccos(0.4) / 2, atol=1e-6)
        assert int(state.saved) == 3 and int(state.rejected) < 12
    else:
        assert diffrax.is_successful(state.result) and state.t == TIMES[-1]


@pytest.mark.long
def test_curvature_of_a_loss_at_its_zero():
    """Where all residuals are zero the Hessian of half their square is that of Gauss and Newton."""
    setting = problem(diffrax.Tsit5(), 0.07)

    def end(k, way):
        return ours(way, jnp.stack([k, STIFFNESS[1]]), START, setting, 0.07).y[0]

    def loss(k):
        found = end(k, integrate_with_adjoint)
        return 0.5 * jnp.sum((found - jax.lax.stop_gradient(found)) ** 2)

    slope = jax.jacfwd(lambda k: end(k, integrate))(STIFFNESS[0])
    assert float(loss(STIFFNESS[0])) == 0.0
    np.testing.assert_allclose(jax.jacfwd(jax.grad(loss))(STIFFNESS[0]), jnp.sum(slope**2), rtol=1e-9)


def test_gradients_side_by_side_are_those_alone():
    """The steps that others of a batch have more are none of theirs."""

    def end(k):
        found = ours(integrate_with_adjoint, jnp.stack([k, STIFFNESS[1]]), START, problem(diffrax.Tsit5()))
        return jnp.sum(found.y[0]), found.tried

    gradient = jax.grad(end, has_aux=True)
    stiffness = jnp.array([3.0, 400.0, 40.0, 0.1])
    together, tried = mbs.jit(jax.vmap(gradient))(stiffness)
    assert np.ptp(tried) > 20
    one = mbs.jit(gradient)
    np.testing.assert_allclose(together, [one(k)[0] for k in stiffness], rtol=1e-12)
