"""Tables of bearings: SciPy's cubic splines by speed, constant beyond."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline

from jaxmbs import rotors

RNG = np.random.default_rng(1)
SPEEDS = np.array([50.0, 300.0, 600.0, 900.0])
STIFFNESS, DAMPING = 1e6 * RNG.normal(size=(4, 2, 2)), 1e2 * RNG.normal(size=(4, 2, 2))


def test_tables_are_splines():
    bearing = rotors.BearingTable(0, SPEEDS, STIFFNESS, DAMPING)
    found = jax.jit(jax.vmap(bearing.coefficients))(jnp.array([0.0, 120.0, 450.0, 900.0, 2000.0]))
    for values, table in zip(found, (STIFFNESS, DAMPING), strict=True):
        spline = CubicSpline(SPEEDS, table, bc_type="natural")
        np.testing.assert_allclose(values, spline([50.0, 120.0, 450.0, 900.0, 900.0]), rtol=1e-10)
