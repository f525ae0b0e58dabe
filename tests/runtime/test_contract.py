"""The contract with JAX and XLA: each of their inner parts that the library uses works here as it is meant.

A release that renames an option, a primitive, an event or a field fails here by its name; nothing is lost in silence.
What a release is known not to have, the registry reports as not available.  Diffrax's inner parts: `tests/ode`.
"""

import gc

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from jax.extend.core import jaxpr_as_fun

from jaxmbs.runtime import _compile_log as compile_log
from jaxmbs.runtime import _compiler_options as options
from jaxmbs.runtime import (
    any_in_batch,
    compile_batch,
    fusion_barrier,
    garbage_collection_paused,
    gather_static,
    lapack,
    lazy_where,
    map_chunked,
    not_tracing,
    remat,
    sets_marks,
    small_call,
    trick_states,
    without_tricks,
    working_bytes,
)
from jaxmbs.runtime._jaxpr import equations
from jaxmbs.runtime._small_call import _CALLS, MARKING, is_marked
from jaxmbs.runtime._small_products import expand_small_products
from jaxmbs.runtime._tricks import OFF

pytestmark = pytest.mark.usefixtures("tricks_on")

X = jnp.array([0.3, 1.2])
STATES = {trick.name: trick for trick in trick_states()}


def names(function, *args):
    """Primitives of a traced function."""
    return {equation.primitive.name for equation in equations(jax.make_jaxpr(function)(*args))}


def text(function, *args):
    return jax.jit(function).lower(*args).as_text()


# ------------------------------------------------------------------------------------------------ options and marks
@pytest.mark.parametrize("trick", options.OPTIONS)
def test_xla_knows_the_option(trick):
    """Or is known to have dropped it, which the registry reports."""
    option = options.OPTIONS[trick]
    is_gone = jax.__version_info__ >= options.GONE.get(option, (99,))
    assert (option in options.known_options("cpu")) != is_gone
    assert not is_gone or (STATES[trick].state == "not available" and option in STATES[trick].reason)


def test_xla_refuses_an_option_that_it_does_not_know():
    assert not options._is_known({"xla_no_such_option": 1})


def loop(x):
    return lax.fori_loop(0, 5, lambda _, x: jnp.sin(x) * x, x)


def test_marks_reach_xla_where_the_registry_says_so():
    with MARKING(True):
        jaxpr = jax.make_jaxpr(small_call(loop))(X)
        assert [is_marked(equation) for equation in equations(jaxpr)].count(True) == 1
        lowered = jax.jit(small_call(loop)).lower(X)
    assert "xla_cpu_small_call" in lowered.as_text()
    if sets_marks(jax.__version__):
        given = {options.OPTIONS["fusion_emitters"]: False, options.OPTIONS["ynn_fusion"]: ""}
        compiled = lowered.compile(given)
        assert 'xla_cpu_small_call="true"' in compiled.as_text()
        np.testing.assert_allclose(compiled(X), loop(X), rtol=1e-15)
    else:
        assert STATES["small_call"].state == "not available" and jax.__version__ in STATES["small_call"].reason


_SQUARE = jnp.eye(3) + 0.1
_OUTSIDE = {  # what no kernel holds
    "sort": lambda: jnp.sort(X),
    "top_k": lambda: lax.top_k(X, 1),
    "FFT": lambda: jnp.fft.fft(X),
    "Cholesky": lambda: jnp.linalg.cholesky(_SQUARE),
    "LU": lambda: lax.linalg.lu(_SQUARE),
    "QR": lambda: jnp.linalg.qr(_SQUARE),
    "singular values": lambda: jnp.linalg.svd(_SQUARE),
    "symmetric eigenvalues": lambda: jnp.linalg.eigh(_SQUARE),
    "eigenvalues": lambda: jnp.linalg.eig(_SQUARE),
    "Schur": lambda: lax.linalg.schur(_SQUARE),
    "triangular": lambda: lax.linalg.triangular_solve(_SQUARE, _SQUARE),
    "callback": lambda: jax.pure_callback(lambda: X, X),
    "debug": lambda: jax.debug.callback(lambda: None),
}


@pytest.mark.parametrize("operation", _OUTSIDE)
def test_calls_out_of_a_kernel_have_the_names_that_are_looked_for(operation):
    assert names(_OUTSIDE[operation]) & _CALLS


# -------------------------------------------------------------------------------------------------------- tracing
def test_programs_can_be_rewritten():
    A = jnp.asarray(np.random.default_rng(0).normal(size=(4, 3, 3)))
    program = jax.make_jaxpr(lambda A: lax.fori_loop(0, 3, lambda _, x: A @ x, A))(A)
    assert "dot_general" in {equation.primitive.name for equation in equations(program)}
    changed = expand_small_products(program)
    assert "dot_general" not in {equation.primitive.name for equation in equations(changed)}
    np.testing.assert_allclose(jaxpr_as_fun(changed)(A)[0], jaxpr_as_fun(program)(A)[0], rtol=1e-12)


def test_switches_are_part_of_the_key_of_compiled_programs():
    function = jax.jit(lambda x: x + float("remat" in OFF.value))
    with OFF(frozenset()):
        assert float(function(0.0)) == 0.0
        with without_tricks("remat"):
            assert float(function(0.0)) == 1.0
        assert float(function(0.0)) == 0.0


def test_traces_are_noticed():
    seen = []
    assert not_tracing()
    for transformed in (jax.jit, jax.grad, jax.vmap):
        argument = X if transformed is jax.vmap else 1.0
        transformed(lambda x: seen.append(not_tracing()) or 2.0 * x)(argument)
    assert seen == [False] * 3 and not_tracing()


def test_a_condition_of_all_lanes_is_no_batch():
    assert jax.vmap(any_in_batch, out_axes=None)(jnp.array([False, True])).shape == ()
    assert not jax.vmap(any_in_batch, out_axes=None)(jnp.array([False, False]))


def test_lanes_that_are_good_are_left_alone():
    value = lambda good, x: lazy_where(good, x, lambda x: 2.0 * x, x)
    found = jax.jit(jax.vmap(value))(jnp.array([True, False]), jnp.stack([X, X]))
    np.testing.assert_array_equal(found, jnp.stack([X, 2.0 * X]))
    np.testing.assert_array_equal(value(jnp.asarray(False), X), 2.0 * X)


def test_events_of_compilation_arrive():
    heard = {}

    def listen(event, seconds, **about):
        heard.setdefault(event, about)

    jax.monitoring.register_event_duration_secs_listener(listen)
    try:
        jax.jit(lambda x: jnp.cos(x) * 0.123456).lower(X).compile()
    finally:
        jax.monitoring.unregister_event_duration_listener(listen)
    assert compile_log._LOWERED in heard and compile_log._COMPILED in heard
    assert "fun_name" in heard[compile_log._LOWERED]


def test_solutions_of_linear_systems_are_saved():
    solve = lambda x: lax.custom_linear_solve(lambda y: x * y, jnp.sin(x), lambda _, b: b / x, symmetric=True)
    saved = jax.make_jaxpr(jax.grad(lambda x: jnp.sum(remat(lambda x: solve(x) ** 3)(x))))(X)
    assert [equation.primitive.name for equation in equations(saved)].count("custom_linear_solve") == 2


def test_the_collector_rests_while_a_program_is_traced():
    assert gc.isenabled()
    with garbage_collection_paused():
        assert not gc.isenabled()
    assert gc.isenabled()


# ------------------------------------------------------------------------------------------------ rows and programs
def test_rows_at_constant_places_have_no_scatter_in_their_derivative():
    slope = jax.grad(lambda x: jnp.sum(gather_static(x, [3, 4, 0]) ** 2))
    assert "scatter" not in text(slope, jnp.arange(5.0))
    with without_tricks("static_gathers"):
        assert "scatter" in text(jax.grad(lambda x: jnp.sum(gather_static(x, [3, 4, 0]) ** 2)), jnp.arange(5.0))


def test_maps_go_in_chunks():
    mapped = lambda x: map_chunked(jnp.sin, x)
    assert "scan" in names(mapped, jnp.arange(20.0))
    with without_tricks("chunked_maps"):
        assert "scan" not in names(lambda x: map_chunked(jnp.sin, x), jnp.arange(20.0))


def test_barriers_are_in_the_program():
    assert "optimization_barrier" in text(lambda x: fusion_barrier(x + 1.0), X)


def test_lapack_takes_one_matrix_at_a_time_where_it_must():
    A = jnp.stack([_SQUARE, 2.0 * _SQUARE])
    assert "while" in text(lambda A: jax.vmap(lapack.eigvalsh)(A), A)
    with without_tricks("sequential_lapack"):
        together = text(lambda A: jax.vmap(lapack.eigvalsh)(A), A)
    assert ("while" in together) == (STATES["sequential_lapack"].state == "needed")


def test_memory_of_a_compiled_program_is_told():
    column = jax.ShapeDtypeStruct((64, 3), jnp.float64)
    program = compile_batch(lambda x: jnp.sort(x * 2.0), [column], "full", False, "batch")
    assert working_bytes(program) >= 64 * 3 * 8
