"""Craig-Bampton in blocks against the dense one, where modes repeat; its derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import blocksparse as bs
from jaxmbs.elements import Hexahedron
from jaxmbs.structures import Structure, assemble_blocks
from jaxmbs.structures.block_modes import lowest_modes
from jaxmbs.structures.modes import natural_modes
from jaxmbs.substructures import craig_bampton
from jaxmbs.substructures.large import large_craig_bampton, parts_of

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
COUNTS, NUM = (3, 2, 2), 5  # bending twice, torsion, bending twice: no pair is cut
SHAPE = tuple(n + 1 for n in COUNTS)
INDEX = np.arange(np.prod(SHAPE)).reshape(SHAPE)
NODES = np.stack(np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij"), axis=-1).reshape(-1, 3) * [1.0, 0.4, 0.4]
BRICKS = np.stack([INDEX[a : a + 3, b : b + 2, c : c + 2].ravel() for a, b, c in CORNERS], axis=1)
FACE = tuple(int(i) for i in INDEX[-1].ravel()[::-1])  # not in the order of the nodes
ROWS = [3 * i + d for i in FACE for d in range(3)]


def matrices(stretch):
    """A square bar, longer and softer with `stretch`."""
    scale = jnp.stack([stretch, jnp.ones_like(stretch), 1 / stretch])
    nodes = jnp.asarray(NODES, scale.dtype) * scale[None]
    return assemble_blocks(Structure(nodes, {"b": (Hexahedron(70 / stretch, 0.3, 2.7), BRICKS)}))


def reduced(stretch, dense):
    if dense:
        return craig_bampton(*(A.dense() for A in matrices(stretch)), ROWS, NUM)
    return large_craig_bampton(*matrices(stretch), FACE, NUM, chunk=8)


def condensed(stretch, dense):
    """What does not depend on the choice of modes in a pair."""
    r, k = reduced(stretch, dense), len(ROWS)
    weights = jnp.cos(jnp.arange(k * k, dtype=r.mass.dtype).reshape(k, k))
    projector = r.basis[:, k:] @ r.basis[:, k:].T
    spread = jnp.sum(jnp.sin(jnp.arange(projector.size).reshape(projector.shape)).astype(r.mass.dtype) * projector)
    coupled = r.mass[:k, k:] @ r.mass[k:, :k] + r.mass[:k, :k] + r.stiffness[:k, :k] / 100
    return jnp.sum(weights * coupled) + jnp.trace(r.stiffness[k:, k:]) + spread


@pytest.mark.parametrize("stretch", [1.0, 1.2])
def test_it_is_the_dense_reduction(stretch):
    """At 1 the bar is square and its bending modes come in pairs."""
    large, small = (jax.jit(reduced, static_argnums=1)(jnp.asarray(stretch), dense) for dense in (False, True))
    k = len(ROWS)
    np.testing.assert_allclose(large.stiffness, small.stiffness, atol=1e-10 * np.max(small.stiffness))
    np.testing.assert_allclose(large.mass[:k, :k], small.mass[:k, :k], atol=1e-10)
    np.testing.assert_allclose(large.connection @ jnp.ones(k + NUM), jnp.ones(k))
    for matrix in ("mass", "basis"):
        chosen = [getattr(r, matrix)[: k if matrix == "mass" else None, k:] for r in (large, small)]
        np.testing.assert_allclose(*(a @ a.T for a in chosen), atol=1e-9)
    assert large.labels == small.labels


@pytest.mark.parametrize("mode", [jax.grad, pytest.param(jax.jacfwd, marks=pytest.mark.slow)])
def test_derivatives_where_modes_repeat(mode):
    at = jnp.asarray(1.0)
    exact = jax.jit(jax.grad(condensed), static_argnums=1)(at, True)
    np.testing.assert_allclose(jax.jit(mode(condensed), static_argnums=1)(at, False), exact, rtol=1e-7)


def test_lowest_modes_in_single_precision_and_where_they_do_not_converge():
    K, M = matrices(jnp.asarray(1.2))
    inner = parts_of(K.pattern, FACE).blocks[0]
    held = np.zeros(K.pattern.num_blocks)
    held[np.setdiff1d(np.arange(K.pattern.num_blocks), inner)] = 1e3
    K = bs.BlockMatrix(K.pattern, K.diagonal + jnp.asarray(held)[:, None, None] * jnp.eye(3)[None], K.upper)
    exact = natural_modes(K.dense(), M.dense(), NUM).frequencies
    K, M = K.astype(jnp.float32), M.astype(jnp.float32)
    modes = jax.jit(lambda K, M, sweeps: lowest_modes(bs.factor(K), M, NUM, sweeps), static_argnums=2)
    found = modes(K, M, 20)
    assert found.shapes.dtype == jnp.float32
    np.testing.assert_allclose(found.frequencies, exact, rtol=1e-3)
    assert np.all(np.isnan(modes(K, M, 0).values))
