"""Programs under a user's own derivative run at once, as three programs; every mode and order is JAX's."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

import jaxmbs as mbs
from jaxmbs.runtime import _tape_program as tapes
from jaxmbs.runtime import jit
from tests.models import pendulum

X = np.array([0.3, -0.7, 1.2])


def plain(x, k, name="sine", scale=2.0):
    """Two results in floating point, a whole number, and what is no array."""
    y = jnp.sin(x[k]) * scale * x
    return {"y": y, "sum": jnp.sum(y**3), "place": jnp.argmax(y), "name": name}


PROGRAM = jit(plain, compile="tape")


def loss(function):
    def of(x):
        found = function(x * x, jnp.asarray([2, 0, 1]), scale=x[0])
        return found["sum"] + jnp.sum(found["y"]) * found["y"][found["place"]]

    return of


OURS, JAXS = loss(PROGRAM), loss(plain)
MODES = {
    "grad": jax.grad,
    "value and gradient": jax.value_and_grad,
    "jvp": lambda f: lambda x: jax.jvp(f, (x,), (x + 1.0,)),
    "jacfwd": jax.jacfwd,
    "jacrev": jax.jacrev,
    "gradient of a gradient": lambda f: jax.grad(lambda x: jnp.sum(jax.grad(f)(x) ** 2)),
    "forward over reverse": jax.hessian,
    "reverse over forward": lambda f: jax.jacrev(jax.jacfwd(f)),
    "lanes": lambda f: lambda x: jax.vmap(jax.grad(f))(jnp.stack([x, 2.0 * x])),
    "gradient of lanes": lambda f: jax.grad(lambda x: jnp.sum(jax.vmap(f)(jnp.stack([x, 2.0 * x])))),
    "compiled": lambda f: jax.jit(jax.grad(f)),
    "checkpoint": lambda f: jax.grad(jax.checkpoint(f)),
    "linearized": lambda f: lambda x: jax.linearize(f, x)[1](x),
    "linearized and compiled": lambda f: lambda x: jax.jit(jax.linearize(f, x)[1])(x),
    "linearized in lanes": lambda f: lambda x: jax.vmap(jax.linearize(f, x)[1])(jnp.eye(3)),
    "derivative of linearized": lambda f: lambda x: jax.jvp(jax.linearize(f, x)[1], (x,), (x,)),
    "cotangents in lanes": lambda f: lambda x: jax.vmap(jax.vjp(f, x)[1])(jnp.arange(3.0)),
    "two of them": lambda f: lambda x: jax.grad(lambda x: f(x) * f(jnp.flip(x)))(x),
}


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
def test_every_mode_is_that_of_jax(mode):
    for a, b in zip(*(jax.tree.leaves(MODES[mode](f)(X)) for f in (OURS, JAXS)), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14)


def test_nothing_of_it_is_compiled(monkeypatch):
    """Value, tangents and cotangents are programs of tapes, traced once; results that are no arrays come through."""
    monkeypatch.setattr("jaxmbs.runtime._jit.compiler_options", lambda *_: pytest.fail("compiled"))
    count = []

    @jit(compile="tape")
    def f(x, name):
        count.append(name)
        return jnp.sum(jnp.sin(x) ** 2), name

    for _ in range(3):
        slope, name = jax.grad(lambda x: f(x, "static"), has_aux=True)(jnp.asarray(X))
        assert name == "static"
        np.testing.assert_allclose(slope, np.sin(2.0 * X), rtol=1e-14)
    assert count == ["static"]
    with jax.enable_x64(False):
        monkeypatch.undo()
        assert jax.grad(lambda x: f(x, "single")[0])(jnp.float32(0.5)).dtype == jnp.float32


def test_what_tapes_do_not_have_is_compiled():
    f = jit(lambda x: jnp.sum(jax.lax.top_k(x, 2)[0] ** 2), compile="tape")
    np.testing.assert_allclose(jax.grad(f)(jnp.asarray(X)), [0.6, 0.0, 2.4])


def test_errors_of_the_function_come_through():
    def wrong(x):
        raise ValueError("in words")

    with pytest.raises(ValueError, match="in words"):
        jax.grad(jit(wrong, compile="tape"))(0.5)


@pytest.mark.slow
def test_the_gradient_of_a_motion_needs_no_program_around_it():
    """The same digits as with `mbs.jit` around it, and those of differences."""

    def load(mass):
        system = pendulum(mass=mass)
        motion = mbs.simulate(system, mbs.State.at(system, pin=0.3 * mass), ts=np.linspace(0.0, 0.3, 3))
        return jnp.sum(mbs.reactions(system, motion)["pin"].force ** 2)

    before = len(tapes._PROGRAMS)
    value, slope = jax.value_and_grad(load)(1.3)
    wanted = mbs.jit(jax.value_and_grad(load))(1.3)
    np.testing.assert_allclose([value, slope], wanted, rtol=1e-9)
    check_grads(load, (1.3,), 1, ["rev"], atol=1e-5, rtol=1e-5)
    assert len(tapes._PROGRAMS) >= before


@pytest.mark.slow
def test_forward_derivatives_of_motions_are_refused_in_words():
    system = pendulum()
    end = lambda mass: mbs.simulate(pendulum(mass=mass), mbs.State.at(system, pin=0.3), t1=0.1).energy[-1]
    with pytest.raises(TypeError, match='gradient="forward"'):
        jax.jvp(end, (1.3,), (1.0,))


def test_a_function_that_closes_over_the_number_differentiated_by():
    """It is no argument of the program, so the program is part of the derivative's trace."""

    def product(a):
        return mbs.jit(lambda x: jnp.sin(a) * x)(2.0)

    def nested(a):
        def inner(x):
            return a * x

        return mbs.jit(functools.partial(lambda f, x: f(x) ** 2, inner))(2.0)

    assert np.isclose(jax.grad(product)(0.3), 2.0 * np.cos(0.3))
    assert np.isclose(jax.grad(nested)(3.0), 24.0)
