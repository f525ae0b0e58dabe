"""The products of a matrix and a three-dimensional tensor that S2 defines in its appendix.

A tensor B of shape (k, m, l) is a stack of k planes B_i of shape (m, l), as second influence coefficients are.
Raises: TypeError or ValueError, of JAX, for shapes that do not fit.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..typing import AnyArray


def plane_mix(matrix: AnyArray, tensor: AnyArray) -> Float[Array, "n m l"]:
    """Mix the planes of a tensor (k, m, l) by a matrix (n, k): C_i = sum_j A_ij B_j, the paper's A (+) B.

    Source: S2 (77)-(78). The print sums to n; the sum runs over the k planes of B.
    """
    return jnp.einsum("ij,jml->iml", matrix, tensor)


def quadratic(vector: AnyArray, tensor: AnyArray) -> Float[Array, " k"]:
    """Quadratic form of every plane of a tensor (k, m, m) with a vector (m,): a_k = b^T B_k b, b^T (.) B (.) b.

    Source: S2 (79)-(80).
    """
    return jnp.einsum("m,kmn,n->k", vector, tensor, vector)


def left_product(matrix: AnyArray, tensor: AnyArray) -> Float[Array, "k n l"]:
    """Every plane of a tensor (k, m, l) times a matrix (n, m) from the left: C_i = A B_i, the paper's A (.) B.

    Source: S2 (81)-(82).
    """
    return jnp.einsum("nm,kml->knl", matrix, tensor)


def right_product(tensor: AnyArray, matrix: AnyArray) -> Float[Array, "k n l"]:
    """Every plane of a tensor (k, n, m) times a matrix (m, l) from the right: C_i = B_i A, the paper's B (.) A.

    Source: S2 (83)-(84).
    """
    return jnp.einsum("knm,ml->knl", tensor, matrix)
