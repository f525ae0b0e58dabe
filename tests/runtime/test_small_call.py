"""Loops marked to become one kernel: the same numbers, and nothing marked that no kernel can hold."""

import functools

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

import jaxmbs as mbs
from jaxmbs.runtime import _compiler_options as options
from jaxmbs.runtime import _jit as jit_module
from jaxmbs.runtime import _small_call as module
from jaxmbs.runtime import jit, without_tricks
from jaxmbs.runtime._small_call import MARKING, should_mark, small_call
from tests.zoo.mechanisms import four_bar, four_bar_state

pytestmark = pytest.mark.usefixtures("tricks_on")

X = jnp.array([0.3, 1.2])
MARK = "xla_cpu_small_call"


@pytest.fixture
def marked(monkeypatch):
    """Programs of the library are compiled with marks; the tests run with the flag that makes them needless."""
    monkeypatch.setattr(jit_module, "should_mark", lambda *_: True)


def three_times(step, x, loop=lambda loop: loop):
    """`step` of (x, count, whether one, nothing) three times, as a loop that carries all kinds."""
    body = lambda c: (step(c[0]), c[1] + 1, ~c[2], c[3])
    start = (x, jnp.zeros((), jnp.int32), jnp.asarray(True), jnp.zeros((0, 2)))
    return loop(functools.partial(lax.while_loop, lambda c: c[1] < 3, body))(start)


def text(function, x):
    with MARKING(True):
        return jax.jit(function).lower(x).as_text()


def test_values_and_derivatives_are_those_of_the_loop(marked):
    def run(x, loop):
        # XLA finds that the loop does not use this; as an argument of a marked call it would end the process
        unused, never = jnp.sin(x), jnp.zeros(2, bool)
        y, count, odd, empty = three_times(lambda y: jnp.where(never, unused, jnp.sin(y) * x[0]), x, loop)
        return y + count.astype(float) + odd.astype(float), empty

    found, plain = (jit(functools.partial(run, loop=loop)) for loop in (small_call, lambda loop: loop))
    assert MARK in text(found, X) and MARK not in text(plain, X)
    for f, g in ((found, plain), [jit(jax.jacfwd(h)) for h in (found, plain)]):
        jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-15), f(X), g(X))
    batch = jnp.stack([X, 2.0 * X])
    jax.tree.map(np.testing.assert_array_equal, jit(jax.vmap(found))(batch), jit(jax.vmap(plain))(batch))


@pytest.mark.parametrize(
    "step",
    [
        jnp.sort,
        lambda x: jnp.linalg.solve(jnp.eye(2) + x[:, None], x),
        lambda x: jnp.abs(jnp.fft.fft(x)),
        lambda x: lax.cond(x[0] > 0.0, jnp.sort, lambda x: x, x),
        lambda x: jax.pure_callback(lambda x: x, jax.ShapeDtypeStruct((2,), float), x),
        lambda x: jnp.sum(jnp.ones((65, 64)) @ jnp.ones((64, 2))) * x,
    ],
    ids=["sort", "LAPACK", "FFT", "in a branch", "callback", "large product"],
)
def test_what_no_kernel_holds_is_not_marked(marked, step):
    run = functools.partial(three_times, step, loop=small_call)
    assert MARK not in text(run, X)
    np.testing.assert_allclose(jit(run)(X)[0], three_times(step, X)[0], rtol=1e-14)


def test_whole_numbers_that_a_double_cannot_hold_are_not_marked():
    run = small_call(lambda big: lax.fori_loop(0, 3, lambda k, x: x + 1, big))
    assert MARK not in text(run, jnp.asarray(2**60 + 1))


@pytest.mark.parametrize("kind", ["full", "quick"])
def test_where_marks_are_set(monkeypatch, kind):
    monkeypatch.delenv("XLA_FLAGS", raising=False)
    given = dict(options._QUICK if kind == "quick" else options._FULL)
    assert should_mark("cpu", given) == jax.__version__.startswith("0.10.")
    assert not should_mark("gpu", {}) and not should_mark("cpu", {})
    with without_tricks("small_call"):
        assert not should_mark("cpu", given)
    monkeypatch.setattr(module, "_RELEASES", ("0.9.",))
    assert not should_mark("cpu", given)
    monkeypatch.undo()
    monkeypatch.setenv("XLA_FLAGS", f"--xla_backend_extra_options={options.SMALL_LOOPS}=1")
    assert not should_mark("cpu", given)


def test_no_marks_in_a_program_of_the_users(marked):
    run = jit(functools.partial(three_times, jnp.sin, loop=small_call))
    assert MARK not in jax.jit(run).lower(X).as_text()


def _cases():
    for solver in (diffrax.Dopri8(), mbs.ode.Gauss4(), diffrax.Kvaerno5()):
        for mode in ("value", "reverse", "forward"):
            name = f"{type(solver).__name__}-{mode}"
            yield pytest.param(solver, mode, marks=pytest.mark.long, id=name)


@pytest.mark.parametrize("solver, mode", list(_cases()))
def test_motions(monkeypatch, solver, mode):
    """A four-bar with springs and its derivative by a speed, marked and not."""
    system = four_bar()
    fixed = {"dt": 0.01} if isinstance(solver, mbs.ode.Gauss4) else {"rtol": 1e-8, "atol": 1e-8}
    way = "forward" if mode == "forward" else "reverse"

    def last(speed):
        state = four_bar_state(system, rate=speed)
        return mbs.simulate(system, state, t1=0.2, solver=solver, gradient=way, **fixed).states.coordinates[-1, 0]

    question = {"value": last, "reverse": jax.grad(last), "forward": jax.jacfwd(last)}[mode]
    assert (MARK in text(question, jnp.asarray(3.0))) == (mode != "forward")
    plain = jit(question)(jnp.asarray(3.0))
    monkeypatch.setattr(jit_module, "should_mark", lambda *_: True)
    np.testing.assert_allclose(jit(lambda x: question(x))(jnp.asarray(3.0)), plain, rtol=1e-11)
