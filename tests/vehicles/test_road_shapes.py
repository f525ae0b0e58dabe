"""Roads of known shape: heights and slopes, tandem cams on slopes and steps, a tyre on a wave."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.contact import HeightField
from jaxmbs.vehicles import CleatRoad, FlatRoad, LinearTyre, SineRoad, SurfaceRoad, TandemCams, Tyre

CAMS = {"base": 0.1, "half_length": 0.32, "half_height": 0.31}
AHEAD = jnp.array([1.0, 0.0])
SINE = SineRoad(0.02, 3.0, 0.4, 0.3)


@pytest.mark.slow
def test_waves_and_splines():
    x, y = 1.3, -0.6
    height = 0.02 * np.sin(2 * np.pi * x / 3 + 0.4 + 0.3 * y)
    np.testing.assert_allclose(SINE.height(x, y), height)
    np.testing.assert_allclose(SINE.slopes(x, y), jax.grad(SINE.height, (0, 1))(x, y), rtol=1e-12)
    places, sides = np.linspace(0.0, 3.0, 200), np.linspace(-1.0, 0.5, 7)
    angles = 2 * np.pi * places[:, None] / 3 + 0.4 + 0.3 * sides[None]
    field = HeightField(places, 0.02 * np.sin(angles), sides)
    spline = SurfaceRoad(field)
    np.testing.assert_allclose(spline.height(x, y), height, atol=1e-6)
    np.testing.assert_allclose(spline.slopes(x, y), SINE.slopes(x, y), atol=1e-4)
    point, normal = spline.plane(jnp.array([x, y]), AHEAD)
    np.testing.assert_allclose(point, [x, y, height], atol=1e-6)
    np.testing.assert_allclose(normal[:2] / -normal[2], SINE.slopes(x, y), atol=1e-4)


@pytest.mark.slow
def test_cams_on_a_flat_road_and_on_a_slope():
    """On a slope s the support of the outline `|x/a|^c + |z/b|^c = 1` is known; the slope is felt exactly."""
    point, normal = TandemCams(FlatRoad(), **CAMS).plane(jnp.array([1.0, 2.0]), AHEAD)
    np.testing.assert_allclose(point, [1.0, 2.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(normal, [0.0, 0.0, 1.0], atol=1e-15)
    slope = 0.3
    tilted = SurfaceRoad(HeightField([0.0, 1.0, 10.0], np.array([0.0, 1.0, 10.0]) * slope))
    cams = TandemCams(tilted, **CAMS, exponent=2.0)
    point, normal = cams.plane(jnp.array([4.0, 0.0]), AHEAD)
    above = np.sqrt(0.31**2 + (slope * 0.32) ** 2) - 0.31
    np.testing.assert_allclose(point[2], 4.0 * slope + above, rtol=1e-6)
    np.testing.assert_allclose(-normal[0] / normal[2], slope, rtol=1e-9)


@pytest.mark.slow
def test_cams_climb_a_bar_before_the_wheel_is_over_it():
    """A cam at distance d before the edge is lifted to where its outline goes through the edge."""
    cams = TandemCams(CleatRoad(1.0, 0.5, 0.02, 1e-6), **CAMS)
    at = lambda x: float(cams.plane(jnp.array([x, 0.0]), AHEAD)[0][2])
    outline = lambda d: max(0.0, 0.02 - 0.31 * (1.0 - (1.0 - (d / 0.32) ** 1.8) ** (1 / 1.8)))
    for x in (0.75, 0.88, 0.94):
        np.testing.assert_allclose(at(x), (outline(1.0 - x - 0.05) + outline(1.0 - x + 0.05)) / 2, atol=1e-5)
    np.testing.assert_allclose([at(0.5), at(1.25)], [0.0, 0.02], atol=1e-12)


@pytest.mark.slow
def test_slopes_of_felt_heights_are_those_of_the_outline():
    cams = TandemCams(CleatRoad(1.0, 0.5, 0.02, 0.01), **CAMS)
    heights = mbs.jit(jax.vmap(lambda x: cams.height(x, 0.0)))
    slopes = mbs.jit(jax.vmap(jax.grad(lambda x: cams.height(x, 0.0))))
    x, h = jnp.linspace(0.7, 1.9, 31), 1e-5
    np.testing.assert_allclose(slopes(x), (heights(x + h) - heights(x - h)) / (2 * h), atol=1e-3)
    assert np.max(np.abs(slopes(x))) > 0.05
    rise = mbs.jit(jax.grad(lambda r: TandemCams(CleatRoad(1.0, 0.5, r, 0.01), **CAMS).height(0.9, 0.0)))(0.02)
    ends = [float(TandemCams(CleatRoad(1.0, 0.5, 0.02 + s * h, 0.01), **CAMS).height(0.9, 0.0)) for s in (1, -1)]
    np.testing.assert_allclose(rise, (ends[0] - ends[1]) / (2 * h), rtol=1e-3)


@pytest.mark.slow
def test_a_tyre_on_a_wave():
    """Its load follows the height below it, its lever the slope."""
    model = LinearTyre(9e4, 6e4, nominal_load=4000.0, radius=0.3, stiffness=2e5)
    tyre = Tyre(model, SineRoad(1e-3, 3.0))
    still = jnp.zeros(3)
    for x in (0.2, 0.75, 2.0):
        height, slope = (float(value) for value in (tyre.road.height(x, 0.0), tyre.road.slopes(x, 0.0)[0]))
        states = {"along": 0.0, "across": 0.0}
        force, _ = tyre.wrench(jnp.eye(3), jnp.array([x, 0.0, 0.28]), still, still, states, 0.0)
        np.testing.assert_allclose(force[2], 2e5 * (0.02 + height), rtol=1e-3)
        np.testing.assert_allclose(force[0] / force[2], -slope, rtol=1e-2, atol=1e-6)


def test_a_wheel_beyond_the_measured_road_is_told():
    """The end of a profile, of a grid on both sides, and through the cams of a tyre."""
    profile = SurfaceRoad(HeightField([0.0, 1.0, 10.0], [0.0, 0.01, 0.0]))
    grid = SurfaceRoad(HeightField([0.0, 1.0, 10.0], np.zeros((3, 2)), [-2.0, 2.0]))
    cams = TandemCams(profile, 0.1, 0.3, 0.3)
    left = lambda road, *place: float(road.validity(jnp.array(place))["road"].value)
    np.testing.assert_allclose(
        [left(profile, 9.0, 50.0), left(cams, 10.5, 0.0), left(grid, 9.0, -1.5)], [1, -0.5, 0.5]
    )
    assert left(grid, 5.0, 2.5) < 0.0 and left(profile, -0.1, 0.0) < 0.0
    tyre = Tyre(LinearTyre(9e4, 6e4, nominal_load=4000.0, radius=0.3, stiffness=2e5), profile, has_relaxation=False)
    still, on, off = jnp.zeros(3), jnp.array([5.0, 0.0, 0.28]), jnp.array([12.0, 0.0, 0.28])
    margins = [tyre.validity(jnp.eye(3), place, still, still, 0.0)["road"] for place in (on, off)]
    np.testing.assert_allclose([m.value for m in margins], [5.0, -2.0], atol=0.01)
    assert margins[1].end == "rolls beyond the end of its measured road" and FlatRoad().validity(on[:2]) == {}


def test_wrong_roads_are_refused():
    assert SineRoad(0.02, 0.0).faults() == ["wavelength must be positive"]
    assert CleatRoad(1.0, 0.5, 0.02, 0.3).faults() == ["ramp must be at most half of the length"]
    assert "base must be positive" in TandemCams(FlatRoad(), 0.0, 0.3, 0.3).faults()
    with pytest.raises(TypeError, match="HeightField"):
        SurfaceRoad(0.0)
