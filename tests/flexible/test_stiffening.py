"""The stiffening by rotation that elastic bodies leave out is said, and by how much it would count."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.flexible import stiffening
from tests.flexible.beams import chain_of_beams
from tests.marks import cases

FIRST = 3.51601526824726  # of a cantilever, in units of sqrt(EI / m) / l^2
#: First lag frequencies of rotating cantilevers by dimensionless speed: Wright, Smith, Thresher and Wang (1982).
LAG = {0.25: 3.5177, 1.0: 3.543236269740054, 2.0: 3.6217969639893766}
UNIT = np.sqrt(7e10 * 1.5e-8 / (2700.0 * 4e-4))  # [rad/s] of the beams of `elastic_beam`


@pytest.fixture(scope="module")
def blade():
    """One elastic body that turns about its root."""
    return chain_of_beams(1, mbs.Revolute("z"), num_modes=2, elements=8)[0]


def spinning(system, speed):
    return mbs.State.at(system, velocities={"root": speed * UNIT})


@pytest.mark.parametrize("speed", cases(LAG, long=[0.25], rest=pytest.mark.slow))
def test_estimate_against_the_frequencies_of_blades(blade, speed):
    """Without stiffening the squared lag frequency is `w_1^2 - Omega^2`; the estimate is what lacks, to a quarter."""
    estimate = stiffening(blade, spinning(blade, speed))["part0"]
    exact = 1 - np.sqrt(FIRST**2 - speed**2) / LAG[speed]
    np.testing.assert_allclose(estimate, exact, rtol=0.25)


@pytest.mark.long
def test_a_fast_blade_is_said(blade):
    """By `linearise`, `modes` and `simulate`, with the body's name; not within a trace, where the field says it."""
    fast, slow = spinning(blade, 2.0), spinning(blade, 0.25)
    with pytest.warns(UserWarning, match=r"stiffening by rotation.* 'part0' by about 24 %.* divide them"):
        linear = mbs.linearise(blade, fast)
    np.testing.assert_allclose(linear.stiffening["part0"], stiffening(blade, fast)["part0"], rtol=1e-12)
    with pytest.warns(UserWarning, match="'part0'"):
        motion = mbs.simulate(blade, fast, ts=np.array([1e-4, 2e-4]), dt=1e-4)
    assert motion.diagnostics.stiffening["part0"].shape == (2,)
    np.testing.assert_allclose(motion.diagnostics.stiffening["part0"], stiffening(blade, fast)["part0"], rtol=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mbs.linearise(blade, slow)
        found = jax.jit(lambda s: mbs.linearise(blade, s).stiffening["part0"])(fast)
    np.testing.assert_allclose(found, linear.stiffening["part0"], rtol=1e-12)
    assert np.all(
        np.isfinite(jax.grad(lambda w: stiffening(blade, spinning(blade, w))["part0"] + w)(jnp.asarray(1.0)))
    )


@pytest.mark.long
def test_a_blade_cut_in_four_is_fast_for_none_of_its_parts():
    """Each part is sixteen times as stiff for its length: the estimate falls by 4^4."""
    whole, cut = (chain_of_beams(n, mbs.Revolute("z"), num_modes=0, elements=1)[0] for n in (1, 4))
    one, four = (stiffening(system, spinning(system, 2.0)) for system in (whole, cut))
    assert len(four) == 4
    np.testing.assert_allclose(list(four.values()), float(one["part0"]) / 4**4, rtol=1e-6)
