"""The closed curve of cams against SciPy's periodic spline: points, feet and curvatures, half way too."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from jaxmbs import contact as C


def cam(n=12):
    t = 2 * np.pi * np.arange(n) / n
    radius = 0.03 + 0.006 * np.cos(t) + 0.003 * np.sin(2 * t)
    points = radius[:, None] * np.c_[np.cos(t), np.sin(t)]
    return C.ClosedCurve(points), CubicSpline(np.arange(n + 1), np.r_[points, points[:1]], bc_type="periodic")


def test_curvatures_at_the_points_and_half_way():
    curve, spline = cam()
    s = np.arange(24) / 2
    (x1, y1), (x2, y2) = spline(s, 1).T, spline(s, 2).T
    np.testing.assert_allclose(curve.curvatures(), (x1 * y2 - y1 * x2) / np.hypot(x1, y1) ** 3, rtol=1e-10)


@pytest.mark.parametrize("place", [(0.06, 0.01), (-0.02, 0.05), (0.01, -0.05), (0.03, 0.0)])
def test_distance_and_its_derivatives(place):
    curve, spline = cam()
    tried = np.linspace(0.0, 12.0, 2001)
    at = tried[np.argmin(np.hypot(*(spline(tried) - place).T))]
    away = lambda s: np.hypot(*(spline(s % 12.0) - place))
    foot = minimize_scalar(away, bounds=(at - 0.01, at + 0.01), method="bounded", options={"xatol": 1e-12}).x % 12.0
    tangent = spline(foot, 1)
    normal = np.array([tangent[1], -tangent[0]]) / np.hypot(*tangent)
    wanted = (np.asarray(place) - spline(foot)) @ normal
    distance = lambda x: curve.distance(x)[0]
    np.testing.assert_allclose(distance(jnp.asarray(place)), wanted, rtol=1e-10)
    np.testing.assert_allclose(jax.grad(distance)(jnp.asarray(place)), normal, atol=1e-7)
