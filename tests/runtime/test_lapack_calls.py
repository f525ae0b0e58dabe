"""No program hands LAPACK a batch: two batches at once stop a process for good (`jaxmbs.runtime._lapack`)."""

import diffrax
import jax
import jax.numpy as jnp
import pytest

import jaxmbs as mbs
from tests.runtime.lapack_calls import HEAVY, SYSTEM, WITH, WITHOUT, at, compiled_calls, lapack_calls, motion

LANES = jnp.linspace(0.0, 0.01, 4)
ASKED = {**{name: (f, set()) for name, f in WITHOUT.items()}, **WITH}


def test_batches_are_seen():
    """The reading of programs itself: a batched call and a single one, lowered and compiled."""
    stack = jnp.broadcast_to(jnp.eye(3), (4, 3, 3))
    for argument, matrices in ((stack, 4), (stack[0], 1)):
        lowered = jax.jit(jnp.linalg.cholesky).lower(argument)
        assert lapack_calls(lowered.as_text()) == [("potrf", matrices)]
        assert compiled_calls(lowered.compile().as_text()) == [("potrf", matrices)]


LONG = ("equilibrium", "linearise", "simulate, Gauss", "simulate, implicit")
LONG += ("State.at", "reactions", "stiffness", "simulate", "modes", "block modes")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long if n in LONG else pytest.mark.slow) for n in ASKED]
)
def test_every_call_gets_one_matrix(name):
    function, allowed = ASKED[name]
    alone = [] if name in HEAVY else [(function, LANES[0])]
    for program, argument in [*alone, (jax.vmap(function), LANES)]:
        calls = lapack_calls(jax.jit(program).lower(argument).as_text())
        assert {routine for routine, _ in calls} <= allowed
        assert all(matrices == 1 for _, matrices in calls), calls


def _loads(t):
    return jnp.sum(mbs.reactions(SYSTEM, motion(t))["main"].force ** 2)


PROGRAMS = {
    "simulate and reactions": _loads,
    "equilibrium": lambda t: mbs.equilibrium(SYSTEM, at(t), throw=False),
    "linearise": lambda t: mbs.linearise(SYSTEM, at(t)),
}


def _check_compiled(function):
    calls = compiled_calls(jax.jit(jax.vmap(function)).lower(LANES).compile().as_text())
    assert all(matrices == 1 for _, matrices in calls), calls


@pytest.mark.long
@pytest.mark.parametrize("name", PROGRAMS)
def test_compiled_programs(name):
    _check_compiled(PROGRAMS[name])


@pytest.mark.long
def test_compiled_gradient():
    _check_compiled(jax.grad(_loads))


@pytest.mark.long
@pytest.mark.parametrize("solver", [diffrax.Kvaerno5(), diffrax.ImplicitEuler()], ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("mode", ["reverse", "forward"])
def test_gradients_of_implicit_motions(solver, mode):
    """By the library's own derivative of a step: diffrax's would hand LAPACK batches."""

    def end(t):
        return jnp.sum(motion(t, solver=solver, gradient=mode).states.coordinates)

    derivative = jax.grad(end) if mode == "reverse" else jax.jacfwd(end)
    assert not lapack_calls(jax.jit(jax.vmap(derivative)).lower(LANES).as_text())
