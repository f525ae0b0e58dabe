"""A sparse block matrix: values on a pattern, as a pytree; products, assembly from elements, dense form."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from ..checks import is_concrete
from ..runtime import jit
from ..tables import sentence_repr
from ..typing import ArrayLike
from ._pattern import Pattern


class BlockMatrix(eqx.Module):
    """Values on a `Pattern`.

    Attributes:
        diagonal: (blocks, size, size).
        upper: (edges, size, size), the blocks A[i, j] of the edges i < j.
        lower: the blocks A[j, i], or None: the transposes of `upper` (a symmetric matrix, complex ones too, where the
            diagonal blocks are symmetric).

    Raises: ValueError for shapes that are not those of the pattern.
    """

    pattern: Pattern = eqx.field(static=True)
    diagonal: Inexact[Array, "blocks size size"]
    upper: Inexact[Array, "edges size size"]
    lower: Inexact[Array, "edges size size"] | None = None

    __repr__, _repr_html_ = sentence_repr(
        lambda matrix: f"{'symmetric' if matrix.is_symmetric else 'unsymmetric'}, {matrix.pattern}"
    )

    def __check_init__(self):
        n, b = self.pattern.shape
        wanted = {"diagonal": (n, b, b), "upper": (self.pattern.num_edges, b, b)}
        for name, shape in (wanted | {"lower": wanted["upper"]}).items():
            if isinstance(getattr(self, name), list | tuple | str):
                raise TypeError(f"{name} must be an array, not {getattr(self, name)!r}")
            given = getattr(getattr(self, name), "shape", shape)
            if given != shape:
                raise ValueError(f"{name} has shape {given}; a matrix on {self.pattern} needs {shape}")

    @property
    def is_symmetric(self) -> bool:
        """True if there are no lower blocks; for the diagonal blocks see `asymmetry`."""
        return self.lower is None

    @property
    def asymmetry(self) -> Array:
        """Asymmetry () of the diagonal blocks relative to their largest entry."""
        part, size = (jnp.max(jnp.abs(A), initial=0.0) for A in (self.diagonal - _T(self.diagonal), self.diagonal))
        return jnp.where(size > 0, part / jnp.where(size > 0, size, 1.0), part)

    @property
    def T(self) -> "BlockMatrix":
        if self.lower is None:
            return BlockMatrix(self.pattern, _T(self.diagonal), self.upper)
        return BlockMatrix(self.pattern, _T(self.diagonal), _T(self.lower), _T(self.upper))

    @property
    def lower_blocks(self) -> Inexact[Array, "edges size size"]:
        """The blocks A[j, i] of the edges i < j."""
        return _T(self.upper) if self.lower is None else self.lower

    def __matmul__(self, x):
        """Product with x (blocks, size) or (blocks, size, columns)."""
        vector = x.ndim == 2
        X = x[..., None] if vector else x
        i, j = self.pattern.edges.T
        Y = self.diagonal @ X
        Y = Y.at[i].add(self.upper @ X[j]).at[j].add(self.lower_blocks @ X[i])
        return Y[..., 0] if vector else Y

    def __add__(self, other: "BlockMatrix") -> "BlockMatrix":
        if self.pattern != other.pattern:
            raise ValueError(f"matrices on different patterns: {self.pattern} and {other.pattern}")
        lower = None if self.lower is None and other.lower is None else self.lower_blocks + other.lower_blocks
        return BlockMatrix(self.pattern, self.diagonal + other.diagonal, self.upper + other.upper, lower)

    def __mul__(self, factor) -> "BlockMatrix":
        lower = None if self.lower is None else self.lower * factor
        return BlockMatrix(self.pattern, self.diagonal * factor, self.upper * factor, lower)

    __rmul__ = __mul__

    def astype(self, dtype: Any) -> "BlockMatrix":
        lower = None if self.lower is None else self.lower.astype(dtype)
        return BlockMatrix(self.pattern, self.diagonal.astype(dtype), self.upper.astype(dtype), lower)

    @jit
    def to_dense(self) -> Inexact[Array, "n n"]:
        """The full matrix (blocks * size, blocks * size)."""
        n, b = self.pattern.shape
        i, j = self.pattern.edges.T
        full = jnp.zeros((n, n, b, b), self.diagonal.dtype).at[np.arange(n), np.arange(n)].set(self.diagonal)
        full = full.at[i, j].set(self.upper).at[j, i].set(self.lower_blocks)
        return full.transpose(0, 2, 1, 3).reshape(n * b, n * b)


def assemble(pattern: Pattern, blocks: ArrayLike, elements: Array | np.ndarray) -> BlockMatrix:
    """Symmetric matrix from the matrices of elements, each on the blocks it touches.

    Args:
        blocks: (elements, k) int, the blocks of every element; every pair of one element must be an edge.
        elements: (elements, k, k, size, size), symmetric as a whole.

    Raises: ValueError where an element couples blocks that the pattern does not and, if concrete, for elements that
    are not symmetric.
    """
    blocks = np.asarray(blocks, np.int64)
    if is_concrete(elements):
        values = np.asarray(elements)
        part = np.max(np.abs(values - values.transpose(0, 2, 1, 4, 3)), initial=0.0)
        if not np.all(np.isfinite(values)):
            raise ValueError("elements are not finite")
        if part > np.finfo(values.dtype).eps ** 0.5 * np.max(np.abs(values), initial=0.0):
            raise ValueError(
                f"the element matrices are unsymmetric by {part:.1g}, but the assembled matrix is symmetric"
            )
    b = pattern.size
    diagonal = jnp.zeros((pattern.num_blocks, b, b), elements.dtype)
    upper = jnp.zeros((pattern.num_edges, b, b), elements.dtype)
    for r in range(blocks.shape[1]):
        diagonal = diagonal.at[blocks[:, r]].add(elements[:, r, r])
        for s in range(r + 1, blocks.shape[1]):
            edge, swapped = _edges_between(pattern, blocks[:, r], blocks[:, s])
            block = jnp.where(jnp.asarray(swapped)[:, None, None], elements[:, s, r], elements[:, r, s])
            upper = upper.at[edge].add(block)
    return BlockMatrix(pattern, diagonal, upper)


def constrain(matrix: BlockMatrix, held: np.ndarray, one: bool) -> BlockMatrix:
    """Constrain coordinates of a symmetric matrix: zero rows and columns, `one` or zero on the diagonal.

    Args: held: (blocks, size) bool.
    """
    i, j = matrix.pattern.edges.T
    free = jnp.asarray(~held, matrix.diagonal.dtype)
    diagonal = matrix.diagonal * free[:, :, None] * free[:, None, :]
    if one:
        diagonal = diagonal + jnp.eye(held.shape[1], dtype=free.dtype)[None] * (1.0 - free)[:, :, None]
    return BlockMatrix(matrix.pattern, diagonal, matrix.upper * free[i][:, :, None] * free[j][:, None, :])


def _edges_between(pattern, first, second):
    """Numbers of the edges between two lists of blocks, and where the first block is the larger."""
    low, high = np.minimum(first, second), np.maximum(first, second)
    n = pattern.num_blocks
    keys = pattern.edges[:, 0] * n + pattern.edges[:, 1]
    place = np.minimum(np.searchsorted(keys, low * n + high), max(len(keys) - 1, 0))
    if len(keys) == 0 or np.any(keys[place] != low * n + high):
        bad = np.nonzero(keys[place] != low * n + high)[0][0] if len(keys) else 0
        raise ValueError(f"an element couples blocks {low[bad]} and {high[bad]}, which have no edge in the pattern")
    return place, first > second


def _T(x):
    return jnp.swapaxes(x, -1, -2)
