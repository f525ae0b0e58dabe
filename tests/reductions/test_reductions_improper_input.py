"""What reductions of large components and named bonds must refuse: unsymmetric matrices, negative stiffness, axes."""

import jax.numpy as jnp
import numpy as np
import pytest
import scipy.sparse

from jaxmbs import blocksparse as bs
from jaxmbs.coupling import bushing, connect, hinge, rigid_bond
from jaxmbs.errors import ModelError
from jaxmbs.linear import LinearSystem
from jaxmbs.reductions import CraigBampton, Hurty, reduce
from tests.structural_matrices import beam, chain, component

INTERFACE = (0, 1)


@pytest.mark.parametrize("num", [0, 3])
def test_sparse_matrices(num):
    """Both matrices symmetric; an interior of negative stiffness, or without any, is no component to reduce."""
    K, M = (np.asarray(A) for A in chain(12))
    reduce(component(*map(scipy.sparse.csr_matrix, (K, M)), INTERFACE), CraigBampton(num))
    uneven = np.zeros_like(K)
    uneven[0, 1] = 0.2
    for wrong, said in (
        ((K + uneven, M), "the stiffness is unsymmetric"),
        ((K, M + uneven), "the mass is unsymmetric"),
        ((K - 1.5 * np.diag(np.arange(12) == 7), M), "is singular .a mechanism inside. or negative"),
        ((np.where(np.arange(12)[:, None] == 5, 0.0, np.where(np.arange(12) == 5, 0.0, K)), M), "mechanism"),
    ):
        with pytest.raises(ValueError, match=said):
            reduce(component(*map(scipy.sparse.csr_matrix, wrong), INTERFACE), CraigBampton(num))
    order = np.random.default_rng(0).permutation(12)
    free = chain(12, ends=0)[0] + 0.0
    free = np.asarray(free).copy()
    free[7, 8] = free[8, 7] = 0.0
    free[7, 7] = free[8, 8] = 1.0  # the far part floats
    with pytest.raises(ValueError, match="mechanism"):
        reduce(
            component(
                *map(scipy.sparse.csr_matrix, (free[order][:, order], M)), (int(np.flatnonzero(order == 0)[0]),)
            ),
            CraigBampton(num),
        )


@pytest.mark.long
def test_block_matrices():
    pattern = bs.Pattern(6, 2, [(i, i + 1) for i in range(5)])
    K = bs.BlockMatrix(pattern, jnp.tile(4 * jnp.eye(2), (6, 1, 1)), jnp.tile(-jnp.eye(2), (5, 1, 1)))
    M = bs.BlockMatrix(pattern, jnp.tile(jnp.eye(2), (6, 1, 1)), jnp.zeros((5, 2, 2)))
    reduce(component(K, M, INTERFACE), CraigBampton(1))
    uneven = bs.BlockMatrix(pattern, M.diagonal.at[0, 0, 1].set(0.3), M.upper)
    for wrong, said in (((K + uneven, M), "the stiffness is unsymmetric"), ((K, uneven), "the mass is unsymmetric")):
        with pytest.raises(ValueError, match=said):
            reduce(component(*wrong, INTERFACE), CraigBampton(1))


def test_axes_of_bonds():
    """Rows that are no axes would scale the forces; left-handed ones turn moments round."""
    part = LinearSystem(mass=np.eye(6), stiffness=np.eye(6), interface=["n"], coordinates=NODE)
    for axes in (2 * np.eye(3), -np.eye(3), np.ones((3, 3))):
        for bond in (hinge("part", free="x", axes=axes), bushing("part", stiffness=np.ones(6), axes=axes)):
            with pytest.raises(ModelError, match="its axes must be three right-handed orthogonal unit vectors"):
                connect({"part": part}, {"bond": bond})


NODE = [("n", d) for d in ("x", "y", "z", "rx", "ry", "rz")]


def test_determinate_coordinates_that_do_not_hold():
    """One coordinate cannot hold a free beam."""
    K, M = beam(6)
    with pytest.raises(ValueError, match="singular with the determinate coordinates fixed"):
        reduce(component(K, M, (0, 1, 12)), Hurty(2, determinate=(0,)))


def test_redundancy_of_negative_interfaces():
    part = component(jnp.diag(jnp.array([-1.0, 2.0])), jnp.eye(2), (0, 1))
    with pytest.raises(ValueError, match="interface is negative"):
        connect({"part": part}, {"wall": rigid_bond("part")}).determinacy()
