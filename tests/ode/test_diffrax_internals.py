"""Contract with diffrax: the inner parts of it that the adjoint reads are there and mean what they did."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
import pytest

from jaxmbs.ode._diffrax_internals import (
    butcher_arrays,
    has_explicit_stages,
    is_diagonally_implicit,
    stage_increments,
    with_scan_kind,
)

NEWTON = optimistix.Newton(rtol=1e-12, atol=1e-12)
EXPLICIT = ("Euler", "Heun", "Midpoint", "Ralston", "Bosh3", "Tsit5", "Dopri5", "Dopri8")
IMPLICIT = ("ImplicitEuler", "Kvaerno3", "Kvaerno4", "Kvaerno5")


@pytest.mark.parametrize("name", EXPLICIT)
def test_explicit_methods_are_known_by_their_stages(name):
    """Were one not recognised, every gradient by it would silently take the slow way through the whole step."""
    solver = getattr(diffrax, name)()
    if name == "Euler":  # no Runge-Kutta method in diffrax's classes: differentiated as a whole
        assert not has_explicit_stages(solver)
        return
    assert has_explicit_stages(solver) and not is_diagonally_implicit(solver)


@pytest.mark.parametrize("name", IMPLICIT)
def test_implicit_methods_are_known(name):
    solver = getattr(diffrax, name)(root_finder=NEWTON)
    assert is_diagonally_implicit(solver) and not has_explicit_stages(solver)


def test_a_derived_step_is_not_taken_for_diffrax_s_own():
    class Own(diffrax.Tsit5):
        def step(self, *args):
            return super().step(*args)

    assert not has_explicit_stages(Own())


@pytest.mark.parametrize("name", ["Tsit5", "Dopri8", "ImplicitEuler", "Kvaerno3"])
def test_dense_output_has_the_ends_and_the_increments(name):
    """y1 = y0 + sum b_i k_i and k_i = h f(t0 + c_i h, y0 + sum a_ij k_j), from the tableau and the dense output."""
    solver = getattr(diffrax, name)()
    if name in IMPLICIT:
        solver = getattr(diffrax, name)(root_finder=NEWTON)
    solver, h, y0 = with_scan_kind(solver, "lax"), 0.1, jnp.array([1.0, -0.5])
    term = diffrax.ODETerm(lambda t, y, args: jnp.stack([y[1] + t, -3.0 * y[0] * y[1]]))
    memory = solver.init(term, 0.0, h, y0, None)
    y1, _, dense, _, _ = jax.jit(lambda t, jumped: solver.step(term, t, t + h, y0, None, memory, jumped))(0.0, True)
    assert set(dense) - {"k"} == {"y0", "y1"}
    np.testing.assert_array_equal(dense["y1"], y1)
    A, b, c = butcher_arrays(solver)
    k = np.asarray(stage_increments(solver, dense))
    np.testing.assert_allclose(y0 + b @ k, y1, rtol=1e-12)
    for a, time, increment in zip(A, c, k, strict=True):
        np.testing.assert_allclose(h * term.vf(time * h, y0 + a @ k, None), increment, rtol=1e-8, atol=1e-10)


def test_the_kind_of_the_loop_over_stages_can_be_set():
    assert with_scan_kind(diffrax.Dopri8(), "checkpointed").scan_kind == "checkpointed"
