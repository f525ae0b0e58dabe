"""Programs for many designs at once, compiled ahead of their first run."""

import math
from collections.abc import Callable, Sequence

import jax
from jax.core import ShapedArray
from jax.extend.core import ClosedJaxpr, jaxpr_as_fun

from . import _tuning as tuning
from ._compiler_options import compiler_options
from ._jaxpr import equations
from ._jit import compile_kind
from ._small_products import expand_small_products
from ._tricks import is_on


def compile_batch(
    function: Callable, columns: Sequence[jax.ShapeDtypeStruct], compile: str, often: bool, name: str
) -> jax.stages.Compiled:
    """The compiled program of a function of arrays.

    Args:
        columns: shapes and types of the arguments.
        compile, often: as `compiler_options`; name: of the program, in XLA's messages.
    """
    with compile_kind(compile):
        lowered = _with_sums(function, columns, name).lower(*columns)
    return lowered.compile(compiler_options(compile, jax.default_backend(), often))


def _with_sums(function, columns, name):
    """`function`, to be compiled for these columns; on the CPU with its small products as sums."""
    if jax.default_backend() != "cpu" or not is_on("small_products"):
        return jax.jit(function)
    program = jaxpr_as_fun(expand_small_products(jax.make_jaxpr(function)(*columns)))

    def lean(*columns):
        return program(*columns)

    lean.__name__ = name
    return jax.jit(lean)


def is_motion(jaxpr: ClosedJaxpr) -> bool:
    """True for a traced function with a loop that ends by a condition."""
    return any(equation.primitive.name == "while" for equation in equations(jaxpr))


def bytes_of_arrays(jaxpr: ClosedJaxpr) -> int:
    """Bytes of all arrays that a traced function makes, one after another; some 20 times what it holds at once."""
    arrays = [out.aval for equation in equations(jaxpr) for out in equation.outvars]
    return sum(math.prod(x.shape) * x.dtype.itemsize for x in arrays if isinstance(x, ShapedArray))


def bytes_for_chunk() -> float:
    """Bytes that the intermediate and returned arrays of one chunk may take: two run at once on an accelerator."""
    if jax.default_backend() == "cpu":
        return float(tuning.CHUNK_BYTES)
    memory = jax.devices()[0].memory_stats()
    return memory["bytes_limit"] / 4 if memory else math.inf


def working_bytes(program: jax.stages.Compiled) -> int:
    """Bytes of the intermediate and returned arrays of a compiled program; 0 where the backend does not say."""
    memory = program.memory_analysis()
    return 0 if memory is None else memory.temp_size_in_bytes + memory.output_size_in_bytes
