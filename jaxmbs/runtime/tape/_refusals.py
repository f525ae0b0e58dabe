"""Errors of `eqx.error_if` on tapes: a function of the host that raises with their words, which a store can keep."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.extend.core import ClosedJaxpr, Primitive

#: A call of a function of `_host_functions`.
host = Primitive("tape_host")
host.multiple_results = True


@host.def_abstract_eval
def _(*args, shapes, **params):
    return list(shapes)


def refusing_program(equation: Any) -> ClosedJaxpr | None:
    """The program that replaces one of the two callbacks of an `eqx.error_if`; None for a callback of a user's."""
    function: Any = getattr(equation.params["callback"], "callback_func", None)
    if getattr(function, "__module__", None) != "equinox._errors":
        return None
    shapes = [jax.ShapeDtypeStruct(v.aval.shape, v.aval.dtype) for v in equation.invars]
    if function.__name__ == "tpu_msg":  # for devices that go on after the first one
        return jax.make_jaxpr(lambda *x: x[: len(equation.outvars)])(*shapes)
    words = _words(function)
    if words is None:
        return None
    return jax.make_jaxpr(lambda *x: _refused(words, equation.outvars))(*shapes)


def _words(function):
    """The one message of a callback that raises; None where it chooses among several."""
    parts = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
    messages = parts["msgs"].cell_contents if "msgs" in parts else ()
    return messages[0] if function.__name__ == "raises" and len(messages) == 1 else None


def _refused(words, results):
    """Arrays of the results, which no run arrives at."""
    codes = jnp.asarray(np.array([ord(letter) for letter in words], float))
    (nothing,) = host.bind(codes, name="refuse", mode=0, pairs=0, shapes=(jax.core.ShapedArray((), np.dtype(float)),))
    return [jnp.broadcast_to(lax.convert_element_type(nothing, v.aval.dtype), v.aval.shape) for v in results]
