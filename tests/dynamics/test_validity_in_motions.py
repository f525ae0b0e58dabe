"""A penetration beyond the stated bound as a status: in batches, by explicit and implicit methods, with gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.contact import HuntCrossley, SphereOnPlane

pytestmark = pytest.mark.long
SPEEDS = np.array([0.2, 1.0])  # the first stays above the bound


def ball():
    """A sphere on its way into a floor: at a speed v it sinks in by v / 1000 s."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("ball", 1.0)
    b.joint("z", mbs.Prismatic("z"), "ground", "ball")
    b.contact("floor", SphereOnPlane(0.05), "ball", "ground", HuntCrossley(1e6, 1.0), max_depth=5e-4)
    return b.build()


SYSTEM = ball()
START = mbs.State.at(SYSTEM, {"z": 0.05}, {"z": -1.0})
TS = np.array([1e-3, np.pi / 2 * 1e-3, 4e-3])
SOLVERS = {"explicit": {}, "implicit": {"solver": mbs.ode.Rodas5P()}}


def motion(speed, **options):
    start = mbs.State(START.t, START.coordinates, -jnp.reshape(speed, 1), START.residual, START.structure)
    return mbs.simulate(SYSTEM, start, ts=TS, rtol=1e-8, atol=1e-10, **options)


@pytest.mark.parametrize("solver", SOLVERS)
def test_batch(solver):
    found = jax.jit(jax.vmap(lambda v: motion(v, **SOLVERS[solver]).result))(SPEEDS)
    np.testing.assert_array_equal(found, [mbs.Status.SUCCESS, mbs.Status.VALIDITY])
    batch = mbs.batch(lambda v: motion(v, **SOLVERS[solver]), SPEEDS, progress=False)
    assert list(np.asarray(batch.ok)) == [True, False]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("gradient", ["forward", "reverse"])
def test_gradients(solver, gradient):
    """Derivative of the depth after 1 ms, a sine of it; beyond the bound the numbers are kept beside the status."""
    depth = lambda v: 0.05 - motion(v, gradient=gradient, **SOLVERS[solver]).states.coordinates[0, 0]
    slope = (jax.jacfwd if gradient == "forward" else jax.grad)(depth)
    values, slopes = jax.jit(jax.vmap(lambda v: (depth(v), slope(v))))(SPEEDS)
    np.testing.assert_allclose(values, 1e-3 * np.sin(1.0) * SPEEDS, rtol=1e-6)
    np.testing.assert_allclose(slopes, 1e-3 * np.sin(1.0), rtol=1e-6)
