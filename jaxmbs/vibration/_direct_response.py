"""Direct frequency response: one solution with the dynamic stiffness per frequency, block-sparse or dense."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex

from ..blocksparse import BlockMatrix, Plan, analyse, factor, solve
from ..checks import require_numbers
from ..linear._block_statics import factor_kind
from ..linear._storage import dtype_of
from ..runtime import as_dtype, jit
from ..typing import AnyArray, ArrayLike
from . import _refined_solve as refined_solve


def dynamic_stiffness(stiffness, damping, mass, omega):
    """Dynamic stiffness `K + i w C - w^2 M` at one angular frequency [rad/s], of arrays or of block matrices.

    Args: stiffness: may be complex (structural damping); damping: may be None.  Source: S1 (40)-(41).
    """
    dtype = np.result_type(dtype_of(stiffness), np.complex64)
    Z = stiffness.astype(dtype) + (-(omega**2) * mass).astype(dtype)
    return Z if damping is None else Z + lax.complex(jnp.zeros_like(omega), omega) * damping.astype(dtype)


def direct_response(
    *,
    K: BlockMatrix,
    M: BlockMatrix,
    load: AnyArray,
    omega: ArrayLike,
    C: BlockMatrix | None = None,
    select: Callable | None = None,
    chunk: int = 32,
    plan: Plan | None = None,
) -> Any:
    """Displacements x of `(K + i w C - w^2 M) x = f` at every frequency, from block matrices.

    Args:
        K, M, C: on one pattern.
        load: (blocks, size) or (blocks, size, columns), real or complex, the same at all frequencies.
        omega: (frequencies,) angular frequencies [rad/s].
        select: function of x that returns the part to keep; default all of it.
        chunk: frequencies solved together.  Memory grows with this and not with their number, in the gradient too,
            which factorises once more instead of keeping factors.
        plan: of `blocksparse.analyse`, default made here.

    Returns: (frequencies, ...) complex, the results of `select`.  Source: S1 (40)-(41).
    """
    plan, kind = analyse(K.pattern) if plan is None else plan, factor_kind(K, C, M)
    keep = (lambda x: x) if select is None else select

    @jax.checkpoint
    def at(w):
        Z = dynamic_stiffness(K, C, M, w)
        return keep(solve(factor(Z, kind, plan), load))

    return lax.map(at, as_dtype(omega, M.diagonal.dtype), batch_size=chunk)


@jit
def dense_response(
    *,
    K: AnyArray,
    M: AnyArray,
    load: AnyArray,
    omega: ArrayLike,
    C: AnyArray | None = None,
    loss: ArrayLike = 0.0,
    out: AnyArray | None = None,
    chunk: int = 32,
) -> Complex[Array, "frequencies outputs columns"]:
    """Displacements x of `(K (1 + i loss) + i w C - w^2 M) x = f` at every frequency, from dense matrices.

    It holds for any damping, unsymmetric matrices and coordinates without mass.  `receptance` is cheaper at many
    frequencies, the block-sparse `direct_response` for large structures.

    Args:
        load: (n, columns) the same at all frequencies.
        omega: (frequencies,) angular frequencies [rad/s].
        out: (outputs, n) output matrix, default the identity.
        chunk: frequencies solved together: memory grows with this and not with their number.

    Returns: (frequencies, outputs, columns) complex.  Source: S1 (40)-(41).
    """
    require_numbers(omega=omega, loss=loss)
    dtype = np.result_type(K.dtype, np.complex64)
    loss = jnp.asarray(loss, M.dtype)
    elastic = K.astype(dtype) * lax.complex(jnp.ones_like(loss), loss)
    rows = jnp.eye(len(K), dtype=dtype) if out is None else out.astype(dtype)

    @jax.checkpoint
    def at(w):
        return rows @ refined_solve.refined_solve(dynamic_stiffness(elastic, C, M, w), load.astype(dtype))

    return lax.map(at, jnp.asarray(omega, M.dtype), batch_size=chunk)
