"""Functions of arrays that are traced once, and only if no stored program spares it."""

import functools
from collections.abc import Callable
from typing import Any

import jax

from ._jaxpr import jaxpr_function, without_unused
from ._jit import compile_kind
from ._store_key import question_key
from ._stored_program import read_shapes, write_shapes


class TracedFunction:
    """A function of arrays as its traced equations, so that values and derivatives come from the same ones.

    A call gives the list of its results' arrays.  The trace waits for the first call, and does not come where the
    store knows the programs that would have it in them; `shape` is known from there too.

    Args: example: the arrays; compile: as of `jit`, of the programs that it will be part of.
    """

    def __init__(self, function: Callable, *example: Any, compile: str = "auto"):
        self._function, self._example, self._compile = function, example, compile

    @functools.cached_property
    def shape(self) -> Any:
        """Shapes and types of the results."""
        if "_traced" in vars(self):
            return self._traced[1]
        key = question_key(["shape", self], self._example, (None,) * len(self._example))
        found = None if key is None else read_shapes(key)
        if found is None:
            found = self._traced[1]
            if key is not None:
                write_shapes(key, found)
        return found

    def __call__(self, *arrays: Any) -> list:
        return self._traced[0](*arrays)

    @functools.cached_property
    def _traced(self):
        with jax.ensure_compile_time_eval(), compile_kind(self._compile):  # as if no trace were under way
            traced, shape = jax.make_jaxpr(self._function, return_shape=True)(*self._example)
        return jaxpr_function(without_unused(traced)), shape

    def __content__(self) -> list:
        """What it does, for the key of programs that have it in them."""
        return [self._function, [(x.shape, str(x.dtype)) for x in self._example], self._compile == "full"]
