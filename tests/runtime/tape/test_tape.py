"""Tapes compute what XLA does, in every operation that they have."""

import concurrent.futures

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

import jaxmbs as mbs
from jaxmbs.runtime import jit
from jaxmbs.runtime.tape import Limits, Tape, TooLargeError, UnsupportedError, is_available
from jaxmbs.runtime.tape._opcodes import CODE

from .programs import PROGRAMS, X

pytestmark = pytest.mark.skipif(not is_available(), reason="this installation was made without a C compiler")
TAPES = {}


def tape_of(name):
    if name not in TAPES:
        function, args = PROGRAMS[name]
        with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
            TAPES[name] = Tape(jax.make_jaxpr(function)(*args))
    return TAPES[name]


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_is_that_of_xla(name):
    """Twice, so that nothing of the first run is left in the arena; infinities, NaN and signs of zero too."""
    function, args = PROGRAMS[name]
    tape = tape_of(name)
    tape(*(np.ones_like(arg) for arg in args))
    found = tape(*args)
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        want = [np.asarray(x) for x in jax.tree.leaves(jax.jit(function)(*args))]
    for a, b in zip(found, want, strict=True):
        assert (a.shape, a.dtype) == (b.shape, b.dtype)
        np.testing.assert_allclose(
            a, b, rtol=1e-12, atol=1e-14 * np.max(np.abs(b), initial=0.0, where=np.isfinite(b))
        )


def test_the_programs_have_every_operation():
    used = {code for name in PROGRAMS for code in tape_of(name).parts.code[:, 0]}
    assert {name for name, code in CODE.items() if code not in used} == set()


@pytest.mark.skipif(not hasattr(lax, "polynomial"), reason="an operation of JAX 0.12")
def test_a_polynomial():
    x = np.linspace(-2.0, 2.0, 9)
    function = lambda x: [lax.polynomial(x, [1.0, -5.0, 2.0, 0.25], unroll=4), lax.polynomial(x, [x, 3.0 * x])]
    tape = Tape(jax.make_jaxpr(function)(x))
    for a, b in zip(tape(x), function(x), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-14)


def test_a_loop_changes_its_log_in_place():
    """Nothing is copied: the log of a motion is written row by row, in loops and branches inside of each other."""

    def write(k, log):
        row = lambda log: lax.dynamic_update_slice(log, jnp.ones((1, 1000)) * k, (k, 0))
        return lax.cond(k % 2 == 0, row, lambda log: log, log)

    def run(x):
        log = jnp.zeros((64, 1000)) + x
        return lax.fori_loop(0, 8, lambda j, log: lax.fori_loop(0, 8, lambda k, log: write(8 * j + k, log), log), log)

    tape = Tape(jax.make_jaxpr(run)(1.0))
    np.testing.assert_array_equal(tape(1.0)[0], jax.jit(run)(1.0))
    assert tape.num_doubles < 1.2 * 64_000
    copies = tape.parts.code[tape.parts.code[:, 0] == CODE["COPY"]]
    assert sum(copies[:, 2] == 64_000) == 1  # the start, one number that is spread


@pytest.mark.parametrize(
    ("function", "arg", "reason"),
    [
        (lambda x: x + 1, np.float32(1.0), "float32"),
        (lambda x: x + x, np.ones(4, np.complex64), "complex64"),
        (lambda x: jax.random.normal(jax.random.key(x)), 1, "key|random|uint"),
        (lambda x: lax.top_k(x, 2), np.ones(4), "top_k"),
        (lambda x: lax.cumprod(x), np.ones(4, complex), "cumprod of complex numbers"),
        (lambda x: (jax.debug.print("{}", x), x)[1], 1.0, "callback"),
        (lambda x: x + jnp.int64(2**60 + 1), 1, "2.53"),
    ],
)
def test_what_tapes_do_not_have_is_named(function, arg, reason):
    with pytest.raises(UnsupportedError, match=reason):
        Tape(jax.make_jaxpr(function)(arg))


def test_threads_share_a_tape():
    function, _ = PROGRAMS["linear algebra"]
    S, b = np.eye(3) * 2.0, np.ones((3, 2))
    tape = Tape(jax.make_jaxpr(function)(S, b))
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda k: tape(S * k, b)[1], range(1, 200)))
    for k, x in zip(range(1, 200), found, strict=True):
        np.testing.assert_allclose(x, b / (2 * k), rtol=1e-13)


# ---------------------------------------------------------------------------------------------------- jit(compile=)
def test_jit_runs_on_a_tape(monkeypatch):
    """Arguments that are no arrays are static; results are arrays of JAX; derivatives work as ever."""
    count = []

    @jit(compile="tape")
    def f(x, name, scale=1.0):
        count.append(name)
        return {"value": scale * jnp.sum(jnp.sin(x)), "name": name}

    monkeypatch.setattr("jaxmbs.runtime._jit.compiler_options", lambda *_: pytest.fail("compiled"))
    for _ in range(3):
        found = f(X, "static", scale=jnp.asarray(2.0))
    assert isinstance(found["value"], jax.Array) and found["name"] == "static" and count == ["static"]
    np.testing.assert_allclose(found["value"], 2.0 * np.sum(np.sin(X)), rtol=1e-14)
    f(X[:2], "static")
    f(X, "another")
    assert count == ["static", "static", "another"]
    monkeypatch.undo()
    np.testing.assert_allclose(jax.grad(lambda x: f(x, "a")["value"])(X), np.cos(X), rtol=1e-14)
    np.testing.assert_allclose(jax.jit(lambda x: f(x, "a")["value"])(X), np.sum(np.sin(X)), rtol=1e-14)


def test_jit_compiles_what_a_tape_cannot_run():
    np.testing.assert_allclose(jit(lambda x: lax.top_k(x, 2)[0], compile="tape")(np.arange(4.0)), [3.0, 2.0])
    with jax.enable_x64(False):
        assert jit(lambda x: x + 1, compile="tape")(jnp.float32(1.0)).dtype == jnp.float32


def test_an_error_of_the_function_comes_through():
    def wrong(x):
        raise ValueError("in words")

    with pytest.raises(ValueError, match="in words"):
        jit(wrong, compile="tape")(X)


@pytest.mark.user
def test_motions_and_gradients_on_tapes_are_those_of_xla():
    """A pendulum's motion with its load, and the derivative by its mass and length."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("bob", mass=2.0, com=(0.5, 0, 0), inertia=0.01)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    system = b.build()

    def load(scale):
        places = lambda s: (s.mass, s.com)
        changed = eqx.tree_at(places, system, (system.mass * scale[0], system.com * scale[1]))
        motion = mbs.simulate(changed, mbs.State.at(system, pin=0.3), ts=jnp.linspace(0.0, 0.5, 5))
        return jnp.sum(mbs.reactions(changed, motion)["pin"].force ** 2)

    x = np.array([1.1, 0.9])
    value, slope = jit(jax.value_and_grad(load), compile="tape")(x)
    wanted, wanted_slope = jit(jax.value_and_grad(load), compile="quick")(x)
    np.testing.assert_allclose(value, wanted, rtol=1e-9)
    np.testing.assert_allclose(slope, wanted_slope, rtol=1e-8)


@pytest.mark.parametrize("number", [2**53 - 1, 2**53 + 1, -(2**53) - 1, 2**62 + 1])
def test_whole_numbers_that_doubles_do_not_have_are_kept(number):
    """By the compiler where they are given or constants; within 2^53 by the tape."""
    x = jnp.asarray([3, 5])
    as_constant = mbs.jit(lambda x: jnp.asarray(number) + 0 * x, compile="tape")
    as_argument = mbs.jit(lambda x, n: n - 1 + 0 * x, compile="tape")
    np.testing.assert_array_equal(as_constant(x), np.full(2, number))
    np.testing.assert_array_equal(as_argument(x, jnp.asarray(number)), np.full(2, number - 1))
    np.testing.assert_array_equal(as_argument(x, jnp.asarray(7)), [6, 6])


def _congruence(x):
    """A generator of Lehmer's: products of 62 bits."""
    step = lambda x, _: ((1103515245 * x + 12345) % 2**31,) * 2
    return lax.scan(step, x, None, length=6)[1]


@pytest.mark.parametrize("function, x", [
    (_congruence, 42),
    (lambda x: jnp.cumprod(jnp.arange(1, 21) * x), 1),
    (lambda x: jnp.prod(jnp.arange(1, 20) * x), 1),
    (lambda x: jnp.sum(x * jnp.ones(5, int)), 2**52 - 1),
    (lambda x: x * jnp.arange(3) - x, 2**52 - 1),
    (lambda x: jnp.dot(jnp.full(3, x), jnp.full(3, x)), 2**27 + 1),
    (lambda x: x**5, 2**13 + 1),
])  # fmt: skip
def test_whole_numbers_that_grow_beyond_doubles_are_the_compilers(function, x):
    x = jnp.asarray(x)
    tape, full = (mbs.jit(function, compile=kind) for kind in ("tape", "full"))
    for _ in range(2):
        np.testing.assert_array_equal(tape(x), full(x))


def test_numbers_of_fewer_bits_are_left_to_the_compiler():
    cut = lambda bits: jax.make_jaxpr(lambda x: jax.lax.reduce_precision(x, 11, bits))(np.ones(3) / 3.0)
    np.testing.assert_array_equal(Tape(cut(52))(np.ones(3) / 3.0)[0], np.ones(3) / 3.0)
    with pytest.raises(UnsupportedError, match="fewer bits"):
        Tape(cut(20))


@pytest.mark.parametrize("limits", [Limits(doubles=3000), Limits(work=3000)], ids=["numbers", "work"])
def test_a_program_beyond_its_limits_is_refused_before_it_is_written(limits):
    """Not after: the tables of a large one take longer to write than it takes to compile."""
    program = jax.make_jaxpr(lambda x: x[:, None] + (x @ x)[None])(np.ones((20, 20)))
    assert Tape(program, Limits(doubles=50_000, work=20_000)).num_doubles > 8000
    with pytest.raises(TooLargeError):
        Tape(program, limits)
