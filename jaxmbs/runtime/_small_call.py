"""Loops that XLA makes one kernel of on the CPU, in place of a call for each operation of each pass.

JAX 0.12 does so with every small loop.  JAX 0.10 does with loops of a kilobyte, or where XLA_FLAGS says so before the
process starts; here a loop asks for itself, by the mark that XLA's own pass sets on those that it finds small.
A four-bar's motion runs three times as fast, its gradient twice, for a tenth more to compile.
"""

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jax.experimental.xla_metadata import set_xla_metadata
from jax.extend.core import ClosedJaxpr, JaxprEqn, jaxpr_as_fun
from jaxtyping import PyTree

from . import _tuning as tuning
from ._compiler_options import SMALL_LOOPS, compiler_options, is_given
from ._jaxpr import equations
from ._packing import Packing
from ._tricks import is_on

#: Whether loops that are traced now get the mark; part of the key of JAX's caches.
MARKING = jax.make_user_context(False)
_RELEASES = ("0.10.",)  # of JAX, that take the mark
_MARK = {"xla_cpu_small_call": "true", "inlineable": "false"}
#: What no kernel holds: LAPACK, callbacks and what else XLA calls from outside of its own code.
_CALLS = frozenset(
    "approx_top_k cholesky custom_call debug_callback debug_print eig eigh fft ffi_call geqp3 geqrf hessenberg "
    "householder_product io_callback lu ormqr pure_callback qr schur sort svd top_k triangular_solve tridiagonal "
    "tridiagonal_solve".split()
)
_KEPT = (np.float64, np.float32, np.int32, np.uint32, np.bool_)  # exact in double precision


def sets_marks(jax_version: str) -> bool:
    """True for releases of JAX on which the library marks its small loops."""
    return jax_version.startswith(_RELEASES)


def should_mark(backend: str, options: dict) -> bool:
    """True if programs with these options of the compiler are to have marked loops.

    Not with XLA's newer emitters of fused loops and its library of kernels, which cannot be part of a kernel.
    """
    return can_mark(backend, options) and not is_given(SMALL_LOOPS)


def can_mark(backend: str, options: dict) -> bool:
    """True if programs with these options of the compiler may have marked loops."""
    newer = [
        options.get(name, True) for name in ("xla_cpu_use_fusion_emitters", "xla_cpu_experimental_ynn_fusion_type")
    ]
    return backend == "cpu" and sets_marks(jax.__version__) and not any(newer) and is_on("small_call")


def small_call(loop: Callable[[PyTree], PyTree]) -> Callable[[PyTree], PyTree]:
    """A loop, as a function of what it starts with, marked where that helps; it may close over traced arrays.

    What derives it in forward mode meets the loop as it is.
    """

    @functools.wraps(loop)
    def asked(start):
        if not MARKING.value:
            return loop(start)
        jaxpr, shape = jax.make_jaxpr(loop, return_shape=True)(start)
        given = [jnp.asarray(x) for x in (*jaxpr.consts, *jax.tree.leaves(start))]
        if not _fits(jaxpr) or not all(x.dtype in _KEPT for x in given):
            return loop(start)
        found = _marked(_of_all(jaxpr), given)(*given)
        return jax.tree.unflatten(jax.tree.structure(shape), found)

    return asked


def one_kernel(function: Callable[[jax.Array], jax.Array], marks: bool) -> Callable[[jax.Array], jax.Array]:
    """A function of one array (n,) as the body of a loop of one pass, which XLA makes one kernel of: without a call
    for every operation a small program runs two to three times as fast.

    Args: marks: ask for it by the mark; such a program compiles with `kernel_options` on this release of JAX alone.
    """

    def whole(z):
        shape = jax.eval_shape(function, z)
        end = jnp.where(z[0] > np.finfo(z.dtype).max, 2, 1).astype(jnp.int32)  # 1, but XLA does not know that

        def once(carried):
            k, z, _ = carried
            return k + jnp.int32(1), z, function(z)

        start = jnp.int32(0), z, jnp.zeros(shape.shape, shape.dtype)
        return jax.lax.while_loop(lambda carried: carried[0] < end, once, start)[2]

    def small_call(z):
        return whole(z)

    return (lambda z: set_xla_metadata(jax.jit(small_call)(z), **_MARK)) if marks else whole


def kernel_options() -> dict | None:
    """Options of the compiler for programs of `one_kernel` with marks; None where this release of JAX takes none."""
    options = compiler_options("full", "cpu")
    return options if can_mark("cpu", options) else None


def is_marked(equation: JaxprEqn) -> bool:
    """True for the call of a marked loop."""
    return equation.primitive.name == "jit" and equation.params["name"] == small_call.__name__


def _of_all(jaxpr):
    """The function of a jaxpr that takes what it closes over too, first."""
    number = len(jaxpr.consts)
    return lambda *parts: jaxpr_as_fun(ClosedJaxpr(jaxpr.jaxpr, parts[:number]))(*parts[number:])


def _marked(function, given):
    """A function of arrays like those given, as a marked program."""
    packing = Packing(given, np.dtype(np.float64))

    @jax.custom_jvp
    def marked(*given):
        # one argument, some of which is used: XLA ends the process at a marked call with an argument that is not
        def small_call(vector):  # by this name `is_marked` knows it
            return function(*packing.unpack(vector))

        return set_xla_metadata(jax.jit(small_call)(packing.pack(given)), **_MARK)

    @functools.partial(marked.defjvp, symbolic_zeros=True)
    def derived(given, dots):
        moves = [not isinstance(dot, SymbolicZero) for dot in dots]

        def of_moving(*moving):
            moving = iter(moving)
            return function(*(next(moving) if m else x for x, m in zip(given, moves, strict=True)))

        return jax.jvp(of_moving, *(tuple(x for x, m in zip(xs, moves, strict=True) if m) for xs in (given, dots)))

    return marked


def _fits(jaxpr):
    """True if one kernel can hold all operations of it."""
    found = ((equation.primitive.name, equation) for equation in equations(jaxpr))
    return not any(name in _CALLS or (name == "dot_general" and _is_dense(equation)) for name, equation in found)


def _is_dense(product):
    return max(x.aval.size for x in product.invars) > tuning.LIBRARY_PRODUCT
