"""Static response, held and free, against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.linear._static_response import static_response
from tests.structural_matrices import beam

LENGTH, EI, RHO_A, FORCE = 2.0, 3.0, 0.7, 5.0


@pytest.mark.slow
def test_free_beam_pushed_in_the_middle():
    """Its inertia is a uniform load: the ends lag by F l^3 / 128 EI; another case beside it."""
    n = 8
    K, M = beam(n, EI, RHO_A, LENGTH)
    x = np.linspace(0.0, LENGTH, n + 1) - 0.3
    rigid = jnp.asarray(np.stack([np.stack([1 + 0 * x, 0 * x], 1).ravel(), np.stack([x, 1 + 0 * x], 1).ravel()], 1))
    load = jnp.zeros((2, 2 * n + 2)).at[0, n].set(FORCE).at[1].set(M @ rigid[:, 0])

    @jax.jit
    def respond(scale):
        found = static_response(K=scale * K, load=load, M=M, rigid=rigid)
        return found, found.displacement[0, n] - found.displacement[0, 0]

    found, lag = respond(1.0)
    np.testing.assert_allclose(lag, FORCE * LENGTH**3 / (128 * EI), rtol=1e-9)
    np.testing.assert_allclose(found.acceleration[0], [FORCE / (RHO_A * LENGTH), 0.0], atol=1e-9)
    np.testing.assert_allclose(found.acceleration[1], [1.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(found.displacement[1], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.displacement @ M @ rigid, 0.0, atol=1e-9)
    slope = jax.jit(jax.grad(lambda s: respond(s)[1]))(1.0)
    np.testing.assert_allclose(slope, -lag, rtol=1e-9)
    with pytest.raises(ValueError, match="mass and rigid motions are not given"):
        static_response(K=K, load=load)
    with pytest.raises(ValueError, match="other than those given"):
        static_response(K=K, load=load, M=M, rigid=rigid[:, :1])
    with pytest.raises(ValueError, match="give M"):
        static_response(K=K, load=load, rigid=rigid)


def test_held_beam():
    K, _ = beam(3, EI, RHO_A, LENGTH, fixed=2)
    found = static_response(K=K, load=jnp.zeros(6).at[4].set(FORCE))
    np.testing.assert_allclose(found.displacement[4], FORCE * LENGTH**3 / (3 * EI), rtol=1e-9)
    assert found.acceleration.shape == (0,)
