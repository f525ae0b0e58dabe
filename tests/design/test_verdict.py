"""Designs outside of a model's validity at the end of a search."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.contact import HuntCrossley, SphereOnPlane

STIFFNESS, RADIUS = 1e6, 0.05


def ball(deepest):
    """A sphere on its way into a floor at 1 m/s: it sinks in by a millimetre."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("ball", 1.0)
    b.joint("z", mbs.Prismatic("z"), "ground", "ball")
    b.contact("floor", SphereOnPlane(RADIUS), "ball", "ground", HuntCrossley(STIFFNESS, 1.0), max_depth=deepest)
    return b.build()


def begin(system, speed):
    return mbs.State.at(system, z=RADIUS, velocities={"z": -speed})


@pytest.mark.slow
@pytest.mark.parametrize("deepest, outside", [(5e-4, True), (2e-3, False)])
@pytest.mark.parametrize("options", [{}, {"starts": 2}, {"optimiser": "SLSQP"}], ids=["one", "two", "SLSQP"])
def test_an_optimum_outside_of_validity_is_none(deepest, outside, options):
    system = ball(deepest)

    def cost(design):
        end = mbs.simulate(
            system, begin(system, design["speed"]), ts=np.array([1e-3, 1.6e-3]), rtol=1e-8, atol=1e-10
        ).states
        return (end.coordinates[0, 0] - RADIUS + 1e-3 * np.sin(1.0)) ** 2 * 1e6

    found = mbs.minimise(cost, {"speed": 0.7}, {"speed": (0.1, 2.0)}, progress=False, **options)
    np.testing.assert_allclose(found.design["speed"], 1.0, rtol=1e-3)
    assert found.ok is not outside and found.reason.startswith("outside of a model's validity") is outside


@pytest.mark.long
def test_a_status_in_a_derivative_or_a_batch_leaks_no_number():
    """What is noted inside of another trace is left out, not kept from it."""
    system = ball(5e-4)

    def depth(speed):
        return mbs.simulate(
            system, begin(system, speed), ts=np.array([1e-3]), rtol=1e-6, atol=1e-9
        ).states.coordinates[0, 0]

    cost = lambda d: jnp.sum(jax.vmap(depth)(d["speed"] * np.array([0.5, 1.0]))) ** 2
    found = mbs.minimise(cost, {"speed": 0.7}, {"speed": (0.1, 0.8)}, steps=1, progress=False)
    assert np.isfinite(found.value)


def test_what_is_printed_has_the_limits():
    limits = [mbs.Limit("stroke", "a", lower=1.0, unit="m"), mbs.Limit("height", "b", upper=3.0)]
    found = mbs.minimise(
        lambda d: (d["x"] ** 2, {"a": d["x"], "b": d["x"]}),
        {"x": 1.5},
        {"x": (0.0, 2.0)},
        limits=limits,
        progress=False,
    )
    stroke, height = (
        next(line for line in str(found).splitlines() if line.startswith(n)) for n in ("stroke", "height")
    )
    assert stroke.split() == ["stroke", "1.5", "1", "1", "m", "active,", "price", "2"]
    assert height.split() == ["height", "1.5", "1", "3", "-", "margin", "66.667%"]
