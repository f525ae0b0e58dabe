"""Four posts: responses against closed forms, a car that stands on them, heights that follow a road."""

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles

from .test_parts import wishbones

CORNERS = {"front left": (1.3, 0.8), "front right": (1.3, -0.8), "rear left": (-1.3, 0.8), "rear right": (-1.3, -0.8)}
MASS, INERTIA, STIFFNESS, DAMPING = 1000.0, (400.0, 1600.0, 1800.0), 2e4, 1500.0


def plate_on_posts():
    """A rigid chassis on four springs, linearised about its rest; heave, pitch and roll are apart."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("slide", 1e-6, inertia=1e-6)
    b.body("pitching", 1e-6, inertia=1e-6)
    b.body("chassis", MASS, inertia=INERTIA)
    b.joint("heave", mbs.Prismatic("z"), "ground", "slide")
    b.joint("pitch", mbs.Revolute("y"), "slide", "pitching")
    b.joint("roll", mbs.Revolute("x"), "pitching", "chassis")
    vertical = mbs.Bushing((0, 0, STIFFNESS, 0, 0, 0), (0, 0, DAMPING, 0, 0, 0))
    for name, (x, y) in CORNERS.items():
        b.body(f"{name} post", 1.0)
        b.joint(f"{name} post", mbs.Prismatic("z"), "ground", f"{name} post", drive=mbs.forces.Constant(0.0))
        b.force(name, vertical, between=((f"{name} post", (x, y, 0)), ("chassis", (x, y, 0))))
    system = b.build()
    posts = [f"{name} post" for name in CORNERS]
    return mbs.linearise(system, mbs.State.at(system), inputs=posts, outputs=["heave", "pitch", "roll"])


@pytest.mark.slow
def test_heave_pitch_roll_and_warp_in_closed_form():
    f = np.array([0.2, 1.1, 4.0])
    found = vehicles.four_post(plate_on_posts(), f)
    s = 2j * np.pi * f
    k = 4 * (STIFFNESS + DAMPING * s)
    heave = k / (MASS * s**2 + k)
    pitch = -1.3 * k / (INERTIA[1] * s**2 + 1.3**2 * k)  # nose up is a negative turn about y
    roll = 0.8 * k / (INERTIA[0] * s**2 + 0.8**2 * k)
    wanted = np.zeros((3, 3, 4), complex)
    wanted[:, 0, 0], wanted[:, 1, 1], wanted[:, 2, 2] = heave, pitch, roll
    np.testing.assert_allclose(found.transfer, wanted, atol=2e-6)
    assert found.motions == ("heave", "pitch", "roll", "warp")
    with pytest.raises(mbs.ModelError, match="motion 'bounce'"):
        vehicles.four_post(plate_on_posts(), f, motions=["bounce"])


@pytest.mark.long
def test_a_car_on_posts_is_pressed_by_their_heights():
    """Posts of other heights: tyres carry more by their stiffness, with the wheels at the design position."""
    heights = dict(zip(CORNERS, (4e-3, 5e-3, 6e-3, 7e-3), strict=True))
    b, parts = vehicles.car(
        wishbones(1.2), wishbones(-1.4), 1000.0, (0, 0, 0.5), (400, 1500, 1700), posts=heights.get
    )
    system = b.build(linear_solver="dense")
    assert system.topology.mobility == 14 and len(parts) == 5
    readings = mbs.dynamics.element_reports(system, mbs.State.at(system)).results
    loads = {name: float(readings[f"{name} tyre"]["load"].value) for name in heights}
    for name, height in heights.items():
        more = loads[name] - loads["front left"]
        np.testing.assert_allclose(more, 2e5 * (height - heights["front left"]), rtol=5e-3, atol=1e-6)


def test_posts_follow_a_road():
    x = np.linspace(0.0, 30.0, 61)
    tracks = np.stack([np.sin(x), np.cos(x)], axis=1)
    wheels = {"front left": (1.2, "left"), "rear left": (-1.4, "left"), "rear right": (-1.4, "right")}
    posts = vehicles.post_heights(x, tracks, 10.0, wheels)
    t = 0.85
    np.testing.assert_allclose(posts["rear left"](t), np.sin(8.5), atol=1e-12)
    np.testing.assert_allclose(posts["rear right"](t), np.cos(8.5), atol=1e-12)
    np.testing.assert_allclose(posts["front left"](t), posts["rear left"](t + 0.26), atol=1e-12)
    with pytest.raises(mbs.ModelError, match="speed must be one positive number"):
        vehicles.post_heights(x, tracks, -1.0, wheels)
    with pytest.raises(mbs.ModelError, match="must be like"):
        vehicles.post_heights(x, tracks, 10.0, {"a": (0.0, "middle")})
