"""Craig-Bampton in blocks against the dense one, where modes repeat; its derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import blocksparse as bs
from jaxmbs.elements import Hexahedron
from jaxmbs.fem import Structure, assemble_blocks
from jaxmbs.reductions import CraigBampton, reduce
from jaxmbs.reductions._craig_bampton_blocks import interface_rows
from jaxmbs.vibration._lanczos import lowest_modes
from jaxmbs.vibration._modes import natural_modes
from tests.structural_matrices import component

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
COUNTS, NUM = (3, 2, 2), 6  # bending twice, torsion, tension, bending twice: no pair is cut
SHAPE = tuple(n + 1 for n in COUNTS)
INDEX = np.arange(np.prod(SHAPE)).reshape(SHAPE)
NODES = np.stack(np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij"), axis=-1).reshape(-1, 3) * [1.0, 0.4, 0.4]
BRICKS = np.stack([INDEX[a : a + 3, b : b + 2, c : c + 2].ravel() for a, b, c in CORNERS], axis=1)
FACE = INDEX[-1].ravel()[::-1]  # not in the order of the nodes; its middle may move along the bar
ROWS = [int(3 * i + d) for i in FACE for d in range(3) if (i, d) != (INDEX[-1, 1, 1], 0)]


def matrices(stretch):
    """A square bar, longer and softer with `stretch`."""
    scale = jnp.stack([stretch, jnp.ones_like(stretch), 1 / stretch])
    nodes = jnp.asarray(NODES, scale.dtype) * scale[None]
    return assemble_blocks(Structure(nodes, {"b": (Hexahedron(70 / stretch, 0.3, 2.7), BRICKS)}))


def reduced(stretch, dense):
    K, M = matrices(stretch)
    C = K * 1e-3 + M * 0.2
    if dense:
        return reduce(component(*(A.to_dense() for A in (K, M)), ROWS, C.to_dense()), CraigBampton(NUM))
    return reduce(component(K, M, ROWS, C), CraigBampton(NUM, chunk=8))


batch = jax.jit(jax.vmap(lambda stretch: reduced(stretch, False)))


def response(r):
    """A dynamic flexibility of the interface, which the choice of modes in a pair does not change."""
    Z = r.stiffness - 0.9 * r.mass
    return jnp.sum(jnp.linalg.inv(Z)[0, :9] * jnp.arange(1.0, 10.0)) + jnp.sum(jnp.sin(jnp.diagonal(r.damping)[:9]))


@pytest.mark.long
def test_a_short_bar_in_blocks_is_its_dense_reduction():
    """Two blocks of solids, one face the interface: frequencies, and statics to the last digit."""
    nodes = jnp.asarray(
        np.stack(np.meshgrid(*map(np.arange, (3.0, 2, 2)), indexing="ij"), -1).reshape(-1, 3) * [1, 1.3, 0.8]
    )
    index = np.arange(12).reshape(3, 2, 2)
    bricks = np.stack([index[a : a + 2].ravel()[[0, 4, 6, 2, 1, 5, 7, 3]] for a in range(2)])
    K, M = assemble_blocks(Structure(nodes, {"b": (Hexahedron(70.0, 0.3, 2.7), bricks)}))
    rows = [int(3 * i + d) for i in index[0].ravel() for d in range(3)]
    blocks = reduce(component(K, M, rows), CraigBampton(2))
    dense = reduce(component(K.to_dense(), M.to_dense(), rows), CraigBampton(2))
    np.testing.assert_allclose(blocks.basis[:, :12], dense.basis[:, :12], atol=1e-9)
    np.testing.assert_allclose(jnp.abs(blocks.mass), jnp.abs(dense.mass), atol=1e-8)  # signs of modes are free
    np.testing.assert_allclose(blocks.stiffness, dense.stiffness, atol=1e-8 * 70)


@pytest.mark.long
def test_it_is_the_dense_reduction():
    """A batch of two; at stretch 1 the bar is square and its bending modes come in pairs."""
    stretch = jnp.array([1.0, 1.2])
    batches = batch(stretch), jax.jit(jax.vmap(lambda s: reduced(s, True)))(stretch)
    k = len(ROWS)
    for i in range(2):
        large, small = (jax.tree.map(lambda leaf: leaf[i], found) for found in batches)  # noqa: B023
        np.testing.assert_allclose(large.basis[:, :k], small.basis[:, :k], atol=1e-9)
        np.testing.assert_allclose(*(r.basis[:, k:] @ r.basis[:, k:].T for r in (large, small)), atol=1e-9)
        for kind in ("stiffness", "mass", "damping"):
            one, other = (np.asarray(getattr(r, kind)) for r in (large, small))
            size = 1e-9 * np.max(np.abs(other))
            np.testing.assert_allclose(one[:k, :k], other[:k, :k], atol=size)
            np.testing.assert_allclose(one[:k, k:] @ one[k:, :k], other[:k, k:] @ other[k:, :k], atol=size)
            np.testing.assert_allclose(*(np.linalg.eigvalsh(A[k:, k:]) for A in (one, other)), rtol=1e-8)
        assert large.coordinates == small.coordinates


@pytest.mark.long
@pytest.mark.parametrize("mode", [jax.grad, jax.jacfwd])
def test_derivatives_where_modes_repeat(mode):
    """The stretch parts the pairs of bending modes, whose vectors are any before it; against differences."""
    found = batch(jnp.array([1.0 - 1e-4, 1.0 + 1e-4]))
    values = [response(jax.tree.map(lambda leaf: leaf[i], found)) for i in range(2)]  # noqa: B023
    slope = jax.jit(mode(lambda stretch: response(reduced(stretch, False))))(1.0)
    np.testing.assert_allclose(slope, (values[1] - values[0]) / 2e-4, rtol=1e-6)


@pytest.mark.long
def test_bad_input():
    K, M = matrices(jnp.asarray(1.0))
    with pytest.raises(ValueError, match="no coordinate or node 108"):
        reduce(component(K, M, [108]), CraigBampton(2))
    with pytest.raises(ValueError, match="must be between 0 and 105"):
        reduce(component(K, M, [0, 1, 2]), CraigBampton(106))
    padded = bs.Pattern(2, 3, [(0, 1)], sizes=[3, 1])
    with pytest.raises(ValueError, match=r"coordinates \[4\] do not exist: they are padding"):
        interface_rows(padded, [3, 4])


def held_matrices(stretch):
    """With springs at the face."""
    K, M = matrices(stretch)
    held = np.zeros(K.pattern.num_blocks)
    held[FACE] = 1e3
    return bs.BlockMatrix(K.pattern, K.diagonal + jnp.asarray(held)[:, None, None] * jnp.eye(3)[None], K.upper), M


@pytest.mark.long
def test_every_shape_has_its_derivative_where_values_differ():
    """Central differences of shapes times their own largest entries, which have no sign of their own."""

    def shapes(stretch):
        K, M = held_matrices(stretch)
        return lowest_modes(bs.factor(K), M, NUM).shapes

    at, h = jnp.asarray(1.2), 1e-4
    largest = np.argmax(np.abs(shapes(at)), axis=0)
    own = jax.jit(lambda s: (lambda X: X * X[largest, np.arange(NUM)][None])(shapes(s)))
    slope = jax.jvp(own, (at,), (jnp.ones(()),))[1]
    expected = (own(at + h) - own(at - h)) / (2 * h)
    np.testing.assert_allclose(slope, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.long
def test_lowest_modes_in_single_precision_and_where_they_do_not_converge():
    K, M = held_matrices(jnp.asarray(1.2))
    exact = natural_modes(K=K.to_dense(), M=M.to_dense(), num=NUM).frequencies
    K, M = K.astype(jnp.float32), M.astype(jnp.float32)
    modes = jax.jit(lambda K, M, sweeps: lowest_modes(bs.factor(K), M, NUM, sweeps), static_argnums=2)
    found = modes(K, M, 20)
    assert found.shapes.dtype == jnp.float32
    np.testing.assert_allclose(found.frequencies, exact, rtol=1e-3)
    assert np.all(np.isnan(modes(K, M, 0).values))
