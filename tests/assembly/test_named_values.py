"""Values by name: several numbers of which some are traced, and those that do not fit together."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs


def test_parts_of_several_coordinates_may_be_traced():
    b = mbs.SystemBuilder()
    b.body("sleeve", mass=1.0, inertia=1.0)
    b.joint("slide", mbs.Cylindrical("z"), "ground", "sleeve")
    system = b.build()

    def numbers(x):
        state = mbs.State.at(system, {"slide": (0.1, x)}, velocities={"slide": [x, 0.2]}, guess={"slide": (x, 0.0)})
        return state.coordinates, state.velocities

    for found, wanted in zip(jax.jit(numbers)(0.3), ([0.1, 0.3], [0.3, 0.2]), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-15)
    with pytest.raises(mbs.ModelError, match="joint 'slide' takes real numbers of one shape"):
        jax.eval_shape(lambda x: mbs.State.at(system, {"slide": (x, "far")}), 0.3)
    with pytest.raises(mbs.ModelError, match="t must be one finite time"):
        jax.eval_shape(lambda x: mbs.State.at(system, t=(x, x)), 0.3)
