"""The products of a matrix and a three-dimensional tensor that S2 defines in its appendix.

A tensor B of shape (k, m, l) is a stack of k planes B_i of shape (m, l).
"""

import jax.numpy as jnp
from jaxtyping import Array, Float


def plane_mix(matrix: Float[Array, "n k"], tensor: Float[Array, "k m l"]) -> Float[Array, "n m l"]:
    """Mix the planes of a tensor: C_i = sum_j A_ij B_j, the paper's A (+) B.

    Source: S2 (77)-(78). The print sums to n; the sum runs over the k planes of B.
    """
    return jnp.einsum("ij,jml->iml", matrix, tensor)


def quadratic(vector: Float[Array, " m"], tensor: Float[Array, "k m m"]) -> Float[Array, " k"]:
    """Quadratic form of every plane: a_k = b^T B_k b, the paper's b^T (.) B (.) b.

    Source: S2 (79)-(80).
    """
    return jnp.einsum("m,kmn,n->k", vector, tensor, vector)


def left_product(matrix: Float[Array, "n m"], tensor: Float[Array, "k m l"]) -> Float[Array, "k n l"]:
    """Multiply every plane from the left: C_i = A B_i, the paper's A (.) B.

    Source: S2 (81)-(82).
    """
    return jnp.einsum("nm,kml->knl", matrix, tensor)


def right_product(tensor: Float[Array, "k n m"], matrix: Float[Array, "m l"]) -> Float[Array, "k n l"]:
    """Multiply every plane from the right: C_i = B_i A, the paper's B (.) A.

    Source: S2 (83)-(84).
    """
    return jnp.einsum("knm,ml->knl", tensor, matrix)
