"""Direct frequency response: one block-sparse solve of the dynamic stiffness per frequency, in chunks."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import BlockMatrix, Plan, analyse, factor, solve


def dynamic_stiffness(stiffness: BlockMatrix, damping: BlockMatrix | None, mass: BlockMatrix, omega) -> BlockMatrix:
    """`K + i w C - w^2 M` at one angular frequency [rad/s]; K may be complex (structural damping).

    Source: S1 (40)-(41).
    """
    dtype = np.result_type(stiffness.diagonal.dtype, np.complex64)
    Z = stiffness.astype(dtype) + (-(omega**2) * mass).astype(dtype)
    return Z if damping is None else Z + lax.complex(jnp.zeros_like(omega), omega) * damping.astype(dtype)


def direct_response(
    stiffness: BlockMatrix,
    damping: BlockMatrix | None,
    mass: BlockMatrix,
    load,
    omega,
    select=None,
    chunk: int = 32,
    plan: Plan | None = None,
):
    """x with `(K + i w C - w^2 M) x = f` at every frequency.

    Args:
        stiffness, damping, mass: symmetric, on one pattern.
        load: (blocks, size) or (blocks, size, columns), of either kind, the same at all frequencies.
        omega: (frequencies,) angular frequencies [rad/s].
        select: function of x, what to keep of it; default all of it.
        chunk: frequencies solved together: memory grows with this and not with their number, in the gradient too,
            which factorises once more instead of keeping factors.

    Returns: (frequencies, ...) complex, of what `select` keeps.  Source: S1 (40)-(41).
    """
    plan = analyse(stiffness.pattern) if plan is None else plan
    keep = (lambda x: x) if select is None else select

    @jax.checkpoint
    def at(w):
        Z = dynamic_stiffness(stiffness, damping, mass, w)
        return keep(solve(factor(Z, "ldl", plan), load))

    return lax.map(at, jnp.asarray(omega, mass.diagonal.dtype), batch_size=chunk)
