"""A forward derivative of `simulate` as it is by default, of either noun, says which option to give."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import pendulum
from tests.structural_matrices import chain, component

TS = np.array([0.0, 0.1])


def swing(gradient):
    def height(angle):
        system = pendulum()
        motion = mbs.simulate(system, mbs.State.at(system, pin=angle), ts=TS[1:], dt=0.05, gradient=gradient)
        return motion.states.coordinates[-1, 0]

    return height


def shake(gradient):
    def moved(scale):
        K, M = chain(2, scale, ends=1)
        motion = mbs.simulate(component(K, M, ()), (jnp.ones(2), None), ts=TS, gradient=gradient)
        return motion.displacement[-1, 0]

    return moved


@pytest.mark.long
@pytest.mark.parametrize("question", [swing, shake])
def test_the_default_is_refused_by_name(question):
    for forward in (jax.jacfwd(question("reverse")), jax.jit(jax.jacfwd(question("reverse")))):
        with pytest.raises(TypeError, match=r'give simulate\(..., gradient="forward"\)'):
            forward(0.4)
    slopes = [jax.jit(f)(0.4) for f in (jax.jacfwd(question("forward")), jax.grad(question("reverse")))]
    np.testing.assert_allclose(slopes[0], slopes[1], rtol=1e-6)
