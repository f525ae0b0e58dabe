"""Four posts: responses against closed forms, a car that stands on them, heights that follow a road."""

import diffrax
import equinox as eqx
import jax
import numpy as np
import pytest
import scipy.signal

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


PLACES = {name: (1.2 if "front" in name else -1.4, 0.75 if "left" in name else -0.75) for name in CORNERS}
ROAD, SPEED = vehicles.RandomRoad.of_class("A"), 20.0


def braked_car(posts, relaxes=True, like=None):
    """A car whose wheels are held on four posts, in horizontal restraints, and its spring forces."""
    model = vehicles.LinearTyre(9e4, 6e4, nominal_load=4e3, radius=0.32, stiffness=2e5, vertical_damping=500.0)
    tyre, brake = vehicles.Tyre(model, has_relaxation=relaxes), mbs.SpringDamper(1e4, 1e2)
    axles = (wishbones(x)._replace(tyres=(tyre, tyre), brakes=(brake, brake)) for x in (1.2, -1.4))
    b, _ = vehicles.car(*axles, 1000.0, (0.0, 0.0, 0.5), (400.0, 1500.0, 1700.0), posts=posts)
    law = mbs.Bushing((1e4, 1e4, 0, 0, 0, 1e4), (1e3, 1e3, 0, 0, 0, 1e3))
    b.force("restraint", law, between=("ground", "chassis"))
    for name in CORNERS:
        b.measure(f"{name} spring", force=f"{name} spring")
    return b.build(linear_solver="dense", like=like)


def record(seconds, key):
    """Heights of the posts on a drive that starts on a smooth road."""
    x = np.arange(0.0, SPEED * seconds + 3.0, 0.1)
    tracks = np.asarray(ROAD.profile(x, jax.random.PRNGKey(key), (0.75, -0.75), lines=600))
    start = jax.vmap(mbs.forces.Step(3.0, 10.0))(x)
    wheels = {name: (along, "left" if side > 0 else "right") for name, (along, side) in PLACES.items()}
    return vehicles.post_heights(x, start[:, None] * tracks, SPEED, wheels)


def linear_response(block, heights, seconds):
    """Times and outputs of a block that is driven by the accelerations of the posts, straight between the points."""
    t = np.arange(0.0, seconds, 0.1 / SPEED)
    bends = [jax.vmap(jax.grad(jax.grad(heights[name])))(t) for name in CORNERS]
    matrices = [np.asarray(x) for x in (block.A, block.B, block.C, block.D)]
    return t, scipy.signal.lsim(matrices, np.stack(bends, axis=1), t)[1]


@pytest.mark.long
def test_a_car_in_time_beside_its_random_response():
    """A real car follows its linearisation, which on a long road has the root mean squares of its spectra."""
    dry = braked_car(lambda _: mbs.forces.Constant(0.0), relaxes=False)  # with relaxation any shift is a rest
    rest = mbs.equilibrium(dry, mbs.State.at(dry))
    still = braked_car(lambda _: mbs.forces.Constant(0.0))
    state = eqx.tree_at(lambda s: s.coordinates, mbs.State.at(still), rest.state.coordinates)
    springs = [f"{name} spring" for name in CORNERS]
    linear = mbs.linearise(still, state, inputs=[f"{name} post" for name in CORNERS], outputs=springs)

    heights = record(4.0, 0)
    t, wanted = linear_response(linear.state_space, heights, 4.0)
    driven = braked_car(heights.get, like=still)
    options = {"dt": t[1], "solver": diffrax.Tsit5(), "formulation": "velocity"}
    forces = mbs.signals(driven, mbs.simulate(driven, state, ts=t, **options))
    found = np.stack([forces[name] - forces[name][0] for name in springs], axis=1)
    assert np.all(np.std(found - wanted, axis=0) < 0.01 * np.std(wanted, axis=0))

    _, on_road = linear_response(linear.state_space, record(160.0, 1), 160.0)
    inputs, coherence = vehicles.wheel_inputs(ROAD, SPEED, {f"{n} post": at for n, at in PLACES.items()}, 0.05, 99.0)
    rms = mbs.random_response(linear, inputs, coherence=coherence).rms
    np.testing.assert_allclose(np.std(on_road[2000:], axis=0), rms, rtol=0.06)
