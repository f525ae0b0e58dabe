"""`eqx.error_if` on tapes: its words, from the tape and from its bytes, on both machines; nothing where it holds."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime.tape import Tape, UnsupportedError, _machine, machine_kind
from jaxmbs.runtime.tape._bytes import read_tape, write_tape

WORDS = "the number – of turns – is negative"


def checked(x):
    return eqx.error_if(2.0 * x, jnp.any(x < 0.0), WORDS)


def of_complex(x):
    z = jax.lax.complex(x, 1.0 + x)
    return jnp.abs(eqx.error_if(z, jnp.any(x < 0.0), WORDS))


PROGRAMS = {
    "real": checked,
    "complex": of_complex,
    "lanes": lambda x: jax.vmap(checked)(x),
    "reverse": lambda x: jax.grad(lambda y: jnp.sum(checked(y) ** 2))(x),
}


@pytest.mark.parametrize("kind", ["c", "numpy"])
@pytest.mark.parametrize("name", PROGRAMS)
def test_words_are_raised_where_it_does_not_hold(name, kind, monkeypatch):
    monkeypatch.setattr(_machine, "ASKED", kind if machine_kind() == "c" else "numpy")
    good, bad = np.array([1.0, 2.0, 3.0]), np.array([1.0, -2.0, 3.0])
    tape = Tape(jax.make_jaxpr(PROGRAMS[name])(good))
    for one in (tape, read_tape(write_tape(tape))):
        np.testing.assert_allclose(one(good)[0], jax.jit(PROGRAMS[name])(good), rtol=1e-15)
        with pytest.raises(eqx.EquinoxRuntimeError, match=WORDS):
            one(bad)
        np.testing.assert_allclose(one(good)[0], jax.jit(PROGRAMS[name])(good), rtol=1e-15)


def test_a_callback_of_a_user_is_the_compilers():
    shape = jax.ShapeDtypeStruct((), np.float64)
    with pytest.raises(UnsupportedError, match="callback"):
        Tape(jax.make_jaxpr(lambda x: jax.pure_callback(np.sin, shape, x))(1.0))
