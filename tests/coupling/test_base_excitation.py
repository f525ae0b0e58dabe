"""A chain between two bases that move differently, against SciPy's exact response of the assembled state space."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from jaxmbs.coupling._base_excitation import base_motion
from jaxmbs.reductions import Unreduced, reduce
from tests.structural_matrices import chain, component

K, M = chain(5, 40.0, 2.0, 0)
BASE, STEP, RATIO = (0, 4), 0.1, 0.03
TIMES = STEP * np.arange(80)
ACCELERATION = np.random.default_rng(2).normal(size=(2, 80))
START, SPEED = np.array([0.1, -0.2]), np.array([0.5, 0.3])


def by_scipy():
    """Displacements of base and interior and the forces on the base; relative motions are damped mode by mode."""
    inner, outer = np.arange(1, 4), np.array(BASE)
    k, m = np.asarray(K), np.asarray(M)
    K_NN, M_NN = k[np.ix_(inner, inner)], m[np.ix_(inner, inner)]
    S = -np.linalg.solve(K_NN, k[np.ix_(inner, outer)])
    w2, X = scipy.linalg.eigh(K_NN, M_NN)
    D = np.zeros((5, 3))  # relative motion from all
    D[inner], D[outer] = np.eye(3), -S.T
    C = D @ (M_NN @ X @ np.diag(2 * RATIO * np.sqrt(w2)) @ X.T @ M_NN) @ D.T
    solve = lambda A: -np.linalg.solve(M_NN, A[inner])
    A, B = np.zeros((10, 10)), np.zeros((10, 2))
    A[:5, 5:] = np.eye(5)
    A[5 + inner, :5], A[5 + inner, 5:] = solve(k), solve(C)
    B[5 + outer] = np.eye(2)
    start = np.concatenate([np.zeros(5), np.zeros(5)])
    start[outer], start[5 + outer] = START, SPEED
    start[inner], start[5 + inner] = S @ START, S @ SPEED
    _, _, y = scipy.signal.lsim((A, B, np.eye(10), np.zeros((10, 2))), ACCELERATION.T, TIMES, start)
    a = A[5:] @ y.T + B[5:] @ ACCELERATION
    return y[:, :5].T, (m @ a + C @ y[:, 5:].T + k @ y[:, :5].T)[outer]


@pytest.mark.long
def test_two_bases_against_scipy():
    """All modes of the interior: exact; the gradient by the stiffness against differences."""

    @jax.jit
    @partial(jax.value_and_grad, has_aux=True)
    def moved(scale):
        c = reduce(component(scale * K, M, BASE), Unreduced())
        found = base_motion(c, jnp.asarray(ACCELERATION.T), STEP, RATIO, jnp.asarray(START), jnp.asarray(SPEED))
        return jnp.sum(found.forces**2), (c.expand(found.displacement), found.forces)

    with pytest.raises(ValueError, match=r"shape \(2, 80\), not \(times, 2\)"):
        base_motion(component(K, M, BASE), jnp.asarray(ACCELERATION), STEP)
    (_, found), slope = moved(1.0)
    for part, exact in zip(found, by_scipy(), strict=True):
        np.testing.assert_allclose(part.T, exact, rtol=1e-8, atol=1e-7)
    np.testing.assert_allclose(slope, (moved(1 + 1e-5)[0][0] - moved(1 - 1e-5)[0][0]) / 2e-5, rtol=1e-6)
