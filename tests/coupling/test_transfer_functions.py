"""Coupling by more pairs than are needed: a pair twice, rings, held rings; against the pairs that suffice."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import coupling
from jaxmbs.coupling._transfer_functions import independent_pairs, signed_interface
from jaxmbs.errors import ModelError
from jaxmbs.experiment import decouple
from jaxmbs.linear._transfer import TransferFunctions
from jaxmbs.vibration import dense_response
from tests.structural_matrices import chain

OMEGA = jnp.array([0.3, 1.4, 2.9])
couple, interface_forces = eqx.filter_jit(coupling.couple_transfer), eqx.filter_jit(coupling.coupling_forces)


@eqx.filter_jit
def parts(t=1.0):
    """Three damped chains of three masses."""
    found = {}
    for k, name in enumerate("pqr"):
        K, M = chain(3, t * (1.0 + k), 1.0 + 0.3 * k, ends=1)
        found[name] = TransferFunctions(
            OMEGA, dense_response(K=K, M=M, load=jnp.eye(3), omega=OMEGA, C=0.05 * K), list("abc"), list("abc")
        )
    return found


RING = [("p a", "q a"), ("q a", "r a"), ("p a", "r a")]
TREE = RING[:2]


@pytest.mark.parametrize(
    ("pairs", "enough"),
    [
        pytest.param(RING, TREE, marks=pytest.mark.long),
        pytest.param([*TREE, TREE[0]], TREE, marks=pytest.mark.long),
        pytest.param([("p a", "q a"), ("q a", "p a"), ("q a", "r a")], TREE, marks=pytest.mark.long),
        pytest.param([*TREE, ("p a", None), ("r a", None)], [*TREE, ("p a", None)], marks=pytest.mark.long),
        pytest.param(
            [*RING, ("p c", "q c"), ("q c", "r c"), ("r c", "p c")],
            [*TREE, ("p c", "q c"), ("q c", "r c")],
            marks=pytest.mark.long,
        ),
    ],
    ids=["ring", "twice", "turned round", "held ring", "two rings"],
)
def test_redundant_rigid_pairs(pairs, enough):
    """Values and derivatives of what the pairs that suffice give; forces add up to theirs, least squares."""
    found, expected = (couple(parts(), given).values for given in (pairs, enough))
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)

    def level(t, given):
        return jnp.sum(jnp.abs(couple(parts(t), given).values) ** 2)

    slopes = [
        jax.jit(lambda t, given=given: [d(lambda t: level(t, given))(t) for d in (jax.grad, jax.jacfwd)])(1.1)
        for given in (pairs, enough)
    ]
    np.testing.assert_allclose(*slopes, rtol=1e-9)
    found, expected = (np.asarray(interface_forces(parts(), given)) for given in (pairs, enough))
    names = [f"{n} {c}" for n in "pqr" for c in "abc"]
    B, few = (signed_interface(names, given) for given in (pairs, enough))
    sums = np.einsum("pc,wpi->wci", B, found), np.einsum("pc,wpi->wci", few, expected)
    np.testing.assert_allclose(*sums, rtol=1e-9, atol=1e-11)
    rings = independent_pairs(B)[1]
    np.testing.assert_allclose(B.T @ rings, 0.0, atol=1e-15)
    np.testing.assert_allclose(np.einsum("pr,wpi->wri", rings, found), 0.0, atol=1e-10)


def by_parts(t, S):
    """The ring's compliance as a matrix of springs between the first masses."""
    B = signed_interface([f"{n} {c}" for n in "pqr" for c in "abc"], RING)
    Z = np.zeros((len(OMEGA), 9, 9), complex)
    for k, Y in enumerate(parts(t).values()):
        Z[:, 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.linalg.inv(np.asarray(Y.values))
    return np.linalg.inv(Z + (B.T @ np.linalg.inv(S) @ B)[None])


@pytest.mark.long
def test_elastic_rings():
    """Springs in a ring share by their compliance; rigid ones among them too, as their limit."""
    S = np.array([[0.3, 0.05, 0.0], [0.05, 0.2, 0.02], [0.0, 0.02, 0.5]])
    np.testing.assert_allclose(couple(parts(), RING, S).values, by_parts(1.0, S), rtol=1e-9, atol=1e-12)
    every = jax.jit(lambda S: couple(parts(), RING, S).values)(jnp.asarray(np.stack([S, S, S])))
    np.testing.assert_allclose(every, by_parts(1.0, S), rtol=1e-9, atol=1e-12)
    rigid = couple(parts(), TREE).values
    for S in (np.zeros((3, 3)), np.diag([0.0, 0.0, 0.4])):
        np.testing.assert_allclose(couple(parts(), RING, S).values, rigid, rtol=1e-9, atol=1e-12)
    forces = interface_forces(parts(), RING, np.diag([0.0, 0.0, 0.4]))
    np.testing.assert_allclose(forces[:, 2], 0.0, atol=1e-12)
    one = np.diag([0.0, 0.4, 0.4])
    np.testing.assert_allclose(couple(parts(), RING, one).values, by_parts(1.0, one + 1e-9 * np.eye(3)), rtol=1e-5)

    def level(s, near):
        return jnp.sum(jnp.abs(couple(parts(), RING, s * jnp.asarray(one) + near * jnp.eye(3)).values) ** 2)

    slopes = [jax.jit(jax.grad(level))(1.0, near) for near in (0.0, 1e-8)]
    np.testing.assert_allclose(*slopes, rtol=1e-5)


@pytest.mark.long
def test_measured_rings_and_single_precision():
    """`regular` keeps no more singular values than the pairs have; single precision and a batch of designs."""
    exact = couple(parts(), TREE).values
    np.testing.assert_allclose(couple(parts(), RING, rcond=1e-14).values, exact, rtol=1e-8, atol=1e-10)
    single = {n: Y.with_values(Y.values.astype(jnp.complex64)) for n, Y in parts().items()}
    np.testing.assert_allclose(couple(single, RING).values, exact, rtol=2e-3, atol=1e-5)
    batch = jax.jit(jax.vmap(lambda t: couple(parts(t), RING).values))(jnp.array([1.0, 1.3]))
    np.testing.assert_allclose(batch[1], couple(parts(1.3), TREE).values, rtol=1e-9, atol=1e-12)


def test_a_channel_taken_off_twice():
    known = parts()["p"]
    with pytest.raises(ModelError, match="channels named twice: a"):
        decouple(known, known, ["a", "b", "a"])
