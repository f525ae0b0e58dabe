"""`mbs.jit` of functions that are defined again, as cells of a notebook do."""

import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs.runtime import _user_jit


def test_a_function_defined_again_is_the_same_program(monkeypatch):
    """One of the same code and numbers; another number is another program."""
    made, library_jit, matrix = [], _user_jit.library_jit, np.ones((30, 30))
    monkeypatch.setattr(_user_jit, "_PROGRAMS", {})
    monkeypatch.setattr(_user_jit, "library_jit", lambda f, **kwargs: made.append(f) or library_jit(f, **kwargs))

    def cell(k):
        names = {"jnp": jnp, "matrix": matrix, "k": k}
        exec("def total(x):\n    return jnp.sum(matrix @ matrix * x) * k\n", names)
        return mbs.jit(names["total"])

    results = [float(cell(k)(2.0)) for k in (3.0, 3.0, 4.0, 3.0)]
    np.testing.assert_allclose(results, 30**3 * 2.0 * np.array([3.0, 3.0, 4.0, 3.0]))
    assert len(made) == 2


def test_what_a_function_reads_counts_as_it_is_at_its_first_call():
    names = {"k": 3.0}
    exec("def scaled(x):\n    return k * x\n", names)
    first = mbs.jit(names["scaled"])
    names["k"] = 5.0
    assert first(2.0) == 10.0
