"""Ride of a half car: the delay of the wheelbase exactly, against quadrature over frequency; what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles

FRONT, REAR, LEVEL, SPEED = 1.2, -1.4, 2.56e-4, 20.0


def half_car():
    """Front and rear wheels on plates of the road, a beam on struts; coordinates are counted from the plates."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name in ("front", "rear"):
        b.body(f"plate {name}", mass=1.0)
        b.body(f"wheel {name}", mass=40.0)
        b.body(f"top {name}", mass=300.0 if name == "front" else 250.0)
        b.joint(f"road {name}", mbs.Prismatic("z"), "ground", f"plate {name}", drive=mbs.forces.Constant(0.0))
        b.joint(f"tyre {name}", mbs.Prismatic("z"), f"plate {name}", f"wheel {name}")
        b.joint(f"strut {name}", mbs.Prismatic("z"), f"wheel {name}", f"top {name}")
        b.force(f"tyre {name}", mbs.SpringDamper(stiffness=2e5), joint=f"tyre {name}")
        b.force(f"strut {name}", mbs.SpringDamper(stiffness=2e4, damping=1500.0), joint=f"strut {name}")
    return b.build()


SYSTEM = half_car()


def outputs(state, accelerations):
    """Travels and tyre loads of both ends, the acceleration of the middle."""
    a = accelerations
    middle = (jnp.sum(a[:3]) + jnp.sum(a[3:6])) / 2
    q = state.coordinates
    return jnp.stack([q[2], q[5], 2e5 * q[1], q[2] + q[5], middle])


def linear():
    return mbs.linearise(SYSTEM, mbs.State.at(SYSTEM), inputs=["road front", "road rear"], outputs=outputs)


WHEELS = {"road front": (FRONT, "left"), "road rear": (REAR, "left")}


@pytest.mark.long
def test_delay_of_the_wheelbase_against_quadrature():
    model, road = linear(), vehicles.RandomRoad(LEVEL)
    exact = vehicles.ride(model, road, SPEED, WHEELS).rms
    places = {name: (x, 0.0) for name, (x, _) in WHEELS.items()}
    inputs, coherence = vehicles.wheel_inputs(road, SPEED, places, 1e-3, 3e4)
    banded = mbs.random_response(model, inputs, coherence=coherence, order=64).rms
    np.testing.assert_allclose(exact, banded, rtol=2e-4)
    together = vehicles.ride(model, road, SPEED).rms
    apart = vehicles.ride(model, road, SPEED, {"road front": (FRONT, "a"), "road rear": (REAR, "b")}).rms
    np.testing.assert_allclose(exact[:3], together[:3], rtol=1e-9)  # ends by themselves see one road
    assert abs(exact[4] / together[4] - 1) > 0.1 and abs(exact[4] / apart[4] - 1) > 1e-3
    swapped = vehicles.ride(model, road, SPEED, {"road rear": (REAR, "left"), "road front": (FRONT, "left")}).rms
    np.testing.assert_allclose(exact, swapped, rtol=1e-12)


@pytest.mark.long
def test_slopes_by_speed_and_wheelbase():
    model = linear()
    rms = mbs.jit(
        lambda v, x: vehicles.ride(model, vehicles.RandomRoad(LEVEL), v, {**WHEELS, "road rear": (x, "left")}).rms
    )
    slopes = mbs.jit(jax.jacfwd(rms, (0, 1)))(SPEED, REAR)
    for k, h in enumerate((1e-4, 1e-6)):
        step = np.array([h, 0.0]) if k == 0 else np.array([0.0, h])
        up, down = (rms(SPEED + s * step[0], REAR + s * step[1]) for s in (1, -1))
        np.testing.assert_allclose(slopes[k], (up - down) / (2 * h), rtol=1e-5, atol=1e-9)


@pytest.mark.long
def test_what_is_refused():
    model, road = linear(), vehicles.RandomRoad(LEVEL)
    with pytest.raises(mbs.ModelError, match="waviness 2"):
        vehicles.ride(model, vehicles.RandomRoad(LEVEL, 2.5), SPEED)
    with pytest.raises(mbs.ModelError, match="road rear"):
        vehicles.ride(model, road, SPEED, {"road front": (1.0, "left")})
    with pytest.raises(mbs.ModelError, match="speed must be positive"):
        vehicles.ride(model, road, 0.0)
    with pytest.raises(mbs.ModelError, match="linearise it first"):
        vehicles.ride(SYSTEM, road, SPEED)
    with pytest.raises(ValueError, match="weighting"):
        vehicles.ride(model, road, SPEED, weightings={model.output_names[0]: "Wx"})
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name in ("plate", "wheel"):
        b.body(name, mass=1.0)
    b.joint("road", mbs.Prismatic("z"), "ground", "plate", drive=mbs.forces.Constant(0.0))
    b.joint("wheel", mbs.Prismatic("z"), "ground", "wheel")
    b.force(
        "tyre",
        mbs.SpringDamper(stiffness=1e4, damping=10.0, free_length=0.3),
        between=("plate", ("wheel", (0.0, 0.0, 0.3))),
    )
    system = b.build()
    absolute = mbs.linearise(system, mbs.State.at(system), inputs=["road"], outputs=["wheel"])
    with pytest.raises(mbs.ModelError, match="heights of the road move 'rate of wheel'"):
        vehicles.ride(absolute, road, SPEED)


@pytest.mark.slow
def test_an_output_that_follows_the_noise_is_infinite():
    model = mbs.linearise(
        SYSTEM,
        mbs.State.at(SYSTEM),
        inputs=["road front", "road rear"],
        outputs=lambda s, a: jnp.stack([a[1], s.velocities[1]]),
    )
    rms = vehicles.ride(model, vehicles.RandomRoad(LEVEL), SPEED).rms
    assert np.all(np.isinf(rms))
