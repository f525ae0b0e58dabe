"""Graphs of the block-sparse tests, and matrices on them."""

import jax.numpy as jnp
import numpy as np

from jaxmbs.blocksparse import BlockMatrix, Pattern


def chain(n):
    return n, [(i, i + 1) for i in range(n - 1)]


def star(n):
    return n, [(0, i) for i in range(1, n)]


def binary_tree(n):
    return n, [((i - 1) // 2, i) for i in range(1, n)]


def ladder(n):
    h = n // 2
    rungs = [(i, h + i) for i in range(h)]
    return 2 * h, [(s + i, s + i + 1) for s in (0, h) for i in range(h - 1)] + rungs


def ring(n):
    return n, [(i, (i + 1) % n) for i in range(n)]


def grid(n):
    index = np.arange(n * n).reshape(n, n)
    across = np.c_[index[:, :-1].ravel(), index[:, 1:].ravel()]
    return n * n, np.r_[across, np.c_[index[:-1].ravel(), index[1:].ravel()]].tolist()


def islands(n):
    """Two parts that do not couple, and a block alone."""
    return n, [(i, i + 1) for i in range(n // 2)] + [(i, i + 1) for i in range(n // 2 + 1, n - 2)]


def random_graph(n, seed=0):
    rng = np.random.default_rng(seed)
    tree = [(int(rng.integers(max(0, i - 6), i)), i) for i in range(1, n)]
    return n, tree + [tuple(map(int, rng.choice(n, 2, replace=False))) for _ in range(n // 5)]


GRAPHS = {
    "one block": (1, []),
    "chain": chain(23),
    "star": star(30),
    "binary tree": binary_tree(31),
    "ladder": ladder(24),
    "ring": ring(19),
    "grid": grid(6),
    "islands": islands(14),
    "random": random_graph(40),
}


def matrix(pattern: Pattern, kind="cholesky", dtype=float, seed=0) -> BlockMatrix:
    """Diagonally dominant: definite for "cholesky", of both signs for "ldl", unsymmetric for "lu"."""
    rng = np.random.default_rng(seed)
    n, b = pattern.shape

    def draw(*shape):
        x = rng.uniform(-0.5, 0.5, shape)
        return x + 1j * rng.uniform(-0.5, 0.5, shape) if np.issubdtype(dtype, np.complexfloating) else x

    degree = np.bincount(pattern.edges.ravel(), minlength=n)
    weight = 1.0 + 0.5 * b * (degree + 1)
    if kind != "cholesky":
        weight = weight * rng.choice([-1.0, 1.0], n)
    diagonal = draw(n, b, b)
    diagonal = 0.5 * (diagonal + diagonal.transpose(0, 2, 1)) if kind != "lu" else diagonal
    diagonal = diagonal + weight[:, None, None] * np.eye(b)
    diagonal[pattern.padding] = 0.0
    diagonal.transpose(0, 2, 1)[pattern.padding] = 0.0
    i, j = pattern.edges.T
    outside = pattern.padding[i][:, :, None] | pattern.padding[j][:, None, :]
    upper = np.where(outside, 0.0, draw(len(i), b, b))
    lower = (
        None if kind != "lu" else jnp.asarray(np.where(outside.transpose(0, 2, 1), 0.0, draw(len(i), b, b)), dtype)
    )
    return BlockMatrix(pattern, jnp.asarray(diagonal, dtype), jnp.asarray(upper, dtype), lower)
