"""An axle in roll at constant load: its balance by virtual work, closed form of small roll, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles

from .test_suspensions import KINDS, rig

SPRING = mbs.SpringDamper(60e3, 0.0, 0.62)


def load(curves):
    return 60e3 * (0.62 - curves.strut) * curves.motion_ratio


@pytest.mark.long
def test_load_of_the_axle_stays():
    own, half = rig("double_wishbone"), np.array([-0.05, 0.0, 0.02, 0.05])
    found = vehicles.roll_curves(own, half, SPRING)
    rest = load(own.curves(0.0))
    left, right = load(found.left), load(found.right)
    np.testing.assert_allclose(left + right, 2 * rest, rtol=1e-12)
    np.testing.assert_allclose(found.left.travel - found.right.travel, 2 * half, atol=1e-15)
    y, z = (np.asarray(found.left.contact) - np.asarray(found.right.contact) * np.array([1.0, -1.0, 1.0])).T[1:]
    np.testing.assert_allclose(np.tan(found.angle), z / y, rtol=1e-12)
    np.testing.assert_allclose(found.moment[0], -found.moment[3], rtol=1e-12)
    assert found.heave[1] == 0.0 and np.all(np.abs(np.asarray(found.heave)[[0, 3]]) > 1e-4)
    # heave of small roll, -F'' d^2 / 2 F'
    h = 1e-3
    low, middle, high = (float(load(own.curves(z))) for z in (-h, 0.0, h))
    small = vehicles.roll_curves(own, 1e-3, SPRING)
    np.testing.assert_allclose(small.heave, -(high - 2 * middle + low) / (high - low) * h, rtol=1e-3)


@pytest.mark.long
def test_slopes_by_a_hardpoint():
    own, at = rig("double_wishbone"), jnp.asarray(KINDS["double_wishbone"]["UO"])
    steer = lambda UO: vehicles.roll_curves(own, 0.03, SPRING, hardpoints={"UO": UO}).left.toe
    slope, h = mbs.jit(jax.grad(steer))(at)[2], 1e-5
    ends = [float(steer(at.at[2].add(sign * h))) for sign in (1.0, -1.0)]
    np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2 * h), rtol=1e-5)


def test_what_is_refused():
    with pytest.raises(mbs.ModelError, match=r"rig must be one of kc_rig(.|\n)*spring must be a force law"):
        vehicles.roll_curves("rig", 0.01, 5e4)
