"""Forces at hardpoints of a linearised corner whose chassis is lifted: an acceleration makes what weight makes."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles

from .test_parts import SPRING, rest
from .test_suspensions import rig as rig_of


def corner(gravity, like=None):
    """Five links and a spring under a chassis that is driven up and down."""
    b = mbs.SystemBuilder(gravity=jnp.stack([0.0 * gravity, 0.0 * gravity, -gravity]))
    b.body("chassis", 100.0, inertia=10.0)
    b.joint("chassis", mbs.Prismatic("z"), "ground", "chassis", drive=mbs.forces.Constant(0.0))
    own = rig_of("five_link").suspension
    parts = vehicles.mount_suspension(b, own, "front", "chassis", spring=SPRING)
    b.force("load", mbs.Force((0.0, 0.0, 3000.0)), on=(parts.bodies["upright"], own.hardpoints["AO"]))
    return b.build(like=like), parts


@pytest.mark.long
def test_a_slow_acceleration_is_weight():
    system, parts = corner(jnp.asarray(9.81))
    state = rest(system)
    linear = vehicles.linearise_hardpoints(system, state, ["chassis"], {"front": parts}, "chassis")
    points, slow = list(parts.points), 0.01j
    assert linear.output_names[:3] == tuple(f"front {points[0]} {axis}" for axis in "xyz")
    A, B, C, D = map(np.asarray, linear.state_space)
    gain = (D + C @ np.linalg.solve(slow * np.eye(len(A)) - A, B)).reshape(-1, 3)
    h, ends = 0.05, []
    for g in (9.81 + h, 9.81 - h):
        heavy = corner(jnp.asarray(g), like=system)[0]
        ends.append(vehicles.hardpoint_loads(heavy, rest(heavy), parts, "chassis"))
    slopes = np.stack([(np.asarray(ends[0][name]) - np.asarray(ends[1][name])) / (2 * h) for name in points])
    assert np.abs(slopes).max() > 10.0
    np.testing.assert_allclose(gain.real, slopes, atol=1e-4 * np.abs(slopes).max())
    whole = mbs.linearise(system, state, inputs=["chassis"], loads=["chassis"])
    A, B, C, D = map(np.asarray, whole.state_space)
    gain = (D + C @ np.linalg.solve(slow * np.eye(len(A)) - A, B))[:3, 0]
    np.testing.assert_allclose(gain.real, [0.0, 0.0, 130.0], atol=1e-2)  # all masses, though the upright floats
