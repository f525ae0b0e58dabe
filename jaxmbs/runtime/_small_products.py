"""Products of many small matrices as sums, which XLA compiles together with what stands around them.

For each matrix of a batched product XLA's CPU programs call a library, at 0.1 to 0.3 microseconds apiece, and a
four-bar has hundreds of 3 to 8 rows.  With sums over a broadcast axis a batch of its motions with loads takes a tenth
less to run and to compile, one of wishbones' loads a sixth.
"""

import functools
import math

import jax
import jax.numpy as jnp
from jax.extend.core import ClosedJaxpr

from . import _tuning as tuning
from ._jaxpr import rewrite
from ._small_call import is_marked


def expand_small_products(jaxpr: ClosedJaxpr) -> ClosedJaxpr:
    """The same program with sums in place of its small batched products.

    Those of loops that are one kernel stay: there they are loops already, and a tree's gradient is slower with sums.
    """
    return rewrite(jaxpr, lambda equation: _sum_of(equation) if _is_small(equation) else equation, is_marked)


def _is_small(equation):
    """True for a batched product of small matrices."""
    if equation.primitive.name != "dot_general":
        return False
    (summed, _), (batched, _) = equation.params["dimension_numbers"]
    A, B, out = (x.aval for x in (*equation.invars, *equation.outvars))
    if not batched or not A.dtype == B.dtype == out.dtype or not jnp.issubdtype(A.dtype, jnp.inexact):
        return False
    return (
        0
        < math.prod(A.shape[axis] for axis in summed) * math.prod(out.shape[len(batched) :])
        <= tuning.EXPANDED_PRODUCT
    )


def _sum_of(equation):
    """The call of a sum in place of a product."""
    kinds = ((x.aval.shape, x.aval.dtype) for x in equation.invars)
    call = _call(equation.params["dimension_numbers"], *kinds)
    return call.replace(invars=equation.invars, outvars=equation.outvars)


@functools.cache
def _call(dimensions, *kinds):
    """The equation that calls a batched product of arrays of these shapes and types as a sum."""
    (summed, also_summed), (batched, also_batched) = dimensions

    @jax.jit
    def small_product(A, B):
        rows, columns = _others(A, summed + batched), _others(B, also_summed + also_batched)
        A, B = A.transpose(*batched, *rows, *summed), B.transpose(*also_batched, *columns, *also_summed)
        first = len(batched)
        A = jnp.expand_dims(A, tuple(range(first + len(rows), first + len(rows) + len(columns))))
        B = jnp.expand_dims(B, tuple(range(first, first + len(rows))))
        return jnp.sum(A * B, axis=tuple(range(-len(summed), 0)))

    return jax.make_jaxpr(small_product)(*(jax.ShapeDtypeStruct(*kind) for kind in kinds)).eqns[0]


def _others(x, axes):
    return [axis for axis in range(x.ndim) if axis not in axes]
