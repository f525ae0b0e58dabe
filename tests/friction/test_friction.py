"""Every model of friction: its curve by the formula of its source, slopes, faults, and stacks as one by one."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from jaxmbs.friction import AbstractFriction, BearingFriction, BrownMcPhee, LuGre, SmoothCoulomb
from jaxmbs.friction._groups import group_models, resistances, signed_coefficients
from jaxmbs.friction._places import as_friction, grows_with_slip, place_faults
from tests.marks import cases

SPEEDS = np.array([1e-5, 3e-4, 0.7e-2, 1e-2, 0.3, 2.0])


class Viscous(AbstractFriction):
    """A model of a user's: a coefficient that grows with the slip."""

    slope: jax.Array

    def coefficient(self, speed):
        return jnp.arctan(self.slope * speed)


def stribeck(w, fade=10.0):
    return 0.3 + 0.15 * np.exp(-((w / fade) ** 2))


W = SPEEDS / 1e-2
CURVES = {  # model and coefficient at the speeds
    "sliding": (SmoothCoulomb(0.3, transition_speed=1e-2), 0.3 * np.tanh(W)),
    "coulomb": (SmoothCoulomb(0.3, 0.45, 1e-2), stribeck(W) * np.tanh(W)),
    "stribeck": (SmoothCoulomb(0.3, 0.45, 1e-2, 0.05), stribeck(W, 5.0) * np.tanh(W)),
    "bearing": (BearingFriction(0.3, 0.45, 1e-2, viscous=2.0, seal=0.7), stribeck(W) * np.tanh(W)),
    "brown-mcphee": (BrownMcPhee(0.3, 0.45, 1e-2), 0.3 * np.tanh(4 * W) + 0.15 * W / (W**2 / 4 + 0.75) ** 2),
    "viscous": (Viscous(jnp.asarray(5.0)), np.arctan(5.0 * SPEEDS)),
    "lugre": (LuGre(0.3, 1e4, 10.0, 0.4, 0.45, 1e-2), stribeck(W, 1.0) + 0.4 * SPEEDS),
}
SMOOTH = [name for name in CURVES if name != "lugre"]


@pytest.mark.parametrize("name", CURVES)
def test_coefficients_by_their_formulas(name):
    model, expected = CURVES[name]
    np.testing.assert_allclose(jax.vmap(model.coefficient)(SPEEDS), expected, rtol=1e-13)
    if not model.has_bristles:
        np.testing.assert_allclose(jax.vmap(model.resistance)(SPEEDS**2) * SPEEDS, expected, rtol=1e-13)
    assert model.faults() == []


def test_the_top_of_brown_and_mcphee_is_at_the_transition_speed():
    np.testing.assert_allclose(CURVES["brown-mcphee"][0].coefficient(1e-2), 0.45, rtol=1e-3)


@pytest.mark.parametrize("name", cases(SMOOTH, long=["coulomb", "stribeck", "bearing", "brown-mcphee"]))
def test_derivatives_at_rest_and_at_the_end_of_the_series(name):
    """Of the friction by the velocity vector; by numbers of the model too."""
    model = CURVES[name][0]

    def force(v, model=model):
        return -model.resistance(jnp.sum(v * v)) * v

    slope = jax.jacfwd(force)
    at_rest = slope(jnp.zeros(3))
    np.testing.assert_allclose(at_rest, at_rest[0, 0] * np.eye(3), rtol=1e-12)
    np.testing.assert_allclose(at_rest[0, 0], -jax.grad(model.coefficient)(0.0), rtol=1e-9)
    for x in (np.sqrt(1e-3) * 1e-2, np.sqrt(1e-3) * 1e-2 / 4, 4e-3):
        v, h = jnp.array([0.6, 0.0, 0.8]) * x, 1e-8
        differences = np.stack([(force(v + h * e) - force(v - h * e)) / (2 * h) for e in np.eye(3)], 1)
        np.testing.assert_allclose(slope(v), differences, atol=1e-6 * abs(float(at_rest[0, 0])))
        numbers, like = ravel_pytree(model)
        by_numbers = jax.jacrev(lambda p, like=like, v=v: force(v, like(p)))(numbers)
        for k, number in enumerate(numbers):
            step = 1e-6 * number
            up, down = (like(numbers.at[k].add(sign * step)) for sign in (1.0, -1.0))
            difference = (force(v, up) - force(v, down)) / (2 * step)
            np.testing.assert_allclose(by_numbers[:, k], difference, rtol=1e-6, atol=1e-7)


def test_bristles_in_steady_slip_have_the_coefficient():
    """Bends whose rate vanishes give `coefficient`, and what bends them is the slope of their energy."""
    model, _ = CURVES["lugre"]
    for speed in SPEEDS:
        slip = speed * jnp.array([0.6, 0.0, 0.8])
        steady = (model.coefficient(speed) - model.sigma2 * speed) / model.sigma0
        bend = steady * slip / speed
        np.testing.assert_allclose(model.rate(bend, slip), 0.0, atol=1e-12)
        traction = model.traction(bend, model.rate(bend, slip), slip)
        np.testing.assert_allclose(traction, model.coefficient(speed) * slip / speed, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(jax.grad(model.energy)(bend), model.sigma0 * bend, rtol=1e-12)
    np.testing.assert_allclose(model.traction(jnp.array([1e-5]), jnp.zeros(1), jnp.zeros(1)), 0.1)  # it holds at rest
    np.testing.assert_allclose(model.rate_apart(jnp.array([2.0])), -2.0 * 1e-2 * 1e4 / 0.3)


def test_models_of_one_structure_are_stacked():
    """Groups as one by one; models of another structure are a group of their own."""
    models = [SmoothCoulomb(0.1 * k, 0.2 * k, 0.01) for k in range(1, 4)]
    models.insert(1, BearingFriction(0.2, viscous=3.0, seal=0.5))
    models.append(CURVES["lugre"][0])
    groups = group_models(models, lambda x, dtype: jnp.stack([jnp.asarray(one, dtype) for one in x]))
    assert [group.surfaces for group in groups] == [(0, 2, 3), (1,), (4,)]
    square = np.array([1e-4, 2e-4, 0.0, 9e-4, 1.0])
    grip, drag = resistances(groups, jnp.asarray(square))
    for k, model in enumerate(models):
        alone = model.drag(square[k])
        np.testing.assert_allclose(grip[k], 1.0 if model.has_bristles else model.resistance(square[k]), rtol=1e-14)
        np.testing.assert_allclose(drag[k], 0.0 if alone is None else alone, rtol=1e-14)
    assert resistances(groups[:1], jnp.asarray(square[:4]))[1] is None
    slip = jnp.array([0.01, -0.02, 0.0, 0.03, 0.1])
    found = signed_coefficients(groups[:1], slip)
    expected = [np.sign(v) * models[k].coefficient(abs(v)) if k in (0, 2, 3) else 0.0 for k, v in enumerate(slip)]
    np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_equations_do_not_grow_with_the_number_of_surfaces():
    def equations(n):
        groups = group_models([SmoothCoulomb(0.1 * k, 0.2) for k in range(n)], lambda x, _: jnp.stack(x))
        return len(jax.make_jaxpr(lambda s: resistances(groups, s))(jnp.ones(n)).eqns)

    assert equations(40) == equations(1)


FAULTS = [
    (SmoothCoulomb(-0.1), "dynamic must not be negative"),
    (SmoothCoulomb(np.nan), "dynamic is not a number"),
    (SmoothCoulomb(np.inf), "dynamic is not finite"),
    (SmoothCoulomb(0.3, 0.2), "static must be at least dynamic"),
    (BrownMcPhee(0.3, transition_speed=0.0), "transition_speed must be positive"),
    (SmoothCoulomb(0.3, 0.4, stribeck_speed=-1.0), "stribeck_speed must be positive"),
    (BearingFriction(0.3, viscous=-1.0), "viscous must not be negative"),
    (BearingFriction(0.3, seal=-1.0), "seal must not be negative"),
    (LuGre(0.0, 1e3), "dynamic must be positive"),
    (LuGre(0.3, 0.0), "sigma0 must be positive"),
    (LuGre(0.3, 1e3, -1.0), "sigma1 must not be negative"),
    (LuGre(0.3, 1e3, 1.0, -1.0), "sigma2 must not be negative"),
]


@pytest.mark.parametrize("model, message", FAULTS)
def test_faults(model, message):
    assert model.faults() == [message]


def test_names_mean_the_same_in_every_model():
    """The table of the guide: a name is that of the same number, with one default."""
    meant = {
        "dynamic",
        "static",
        "transition_speed",
        "stribeck_speed",
        "viscous",
        "seal",
        "sigma0",
        "sigma1",
        "sigma2",
    }
    defaults: dict = {}
    for kind in (SmoothCoulomb, BearingFriction, BrownMcPhee, LuGre):
        for field in dataclasses.fields(kind):
            assert field.name in meant
            defaults.setdefault(field.name, set()).add(str(field.default))
    defaults["stribeck_speed"].discard("None")  # of `SmoothCoulomb` ten times its transition speed
    assert all(len(found) == 1 for found in defaults.values())


def test_what_a_place_takes():
    lugre, bearing = CURVES["lugre"][0], CURVES["bearing"][0]
    assert place_faults(lugre, "a joint") == [] and place_faults(bearing, "a joint") == []
    assert "a cable has no state for the bristles of LuGre" in place_faults(lugre, "a cable", bristles=False)[0]
    assert "a part that does not" in place_faults(bearing, "a contact", drag=False)[0]
    assert place_faults(BearingFriction(0.3), "a contact", drag=False) == []
    assert "must be one number, got shape (2,)" in place_faults(SmoothCoulomb(np.ones(2)), "a joint")[0]
    assert "a coefficient or a model" in place_faults("rough", "a joint")[0]
    assert as_friction(bearing) is bearing and as_friction(0.3).dynamic == 0.3
    for wrong in ("0.3", SmoothCoulomb, None, True, {}):
        with pytest.raises(TypeError, match="a coefficient or a model of jaxmbs.friction"):
            as_friction(wrong)


def test_friction_that_falls_with_the_slip():
    for grows in (SmoothCoulomb(0.3), Viscous(jnp.asarray(2.0)), SmoothCoulomb(0.3, 0.3), BrownMcPhee(0.3)):
        assert grows_with_slip(grows)
    for falls in (SmoothCoulomb(0.3, 0.4), BrownMcPhee(0.3, 0.4)):
        assert not grows_with_slip(falls)


def test_breakaway_and_creep():
    assert SmoothCoulomb(0.3).breakaway == 0.3 and SmoothCoulomb(0.3, 0.4).breakaway == 0.4
    assert Viscous(jnp.asarray(1.0)).breakaway is None and Viscous(jnp.asarray(1.0)).creep_speed == 0.0
    assert BearingFriction(0.3, seal=2.0).breakaway_drag == 2.0 and SmoothCoulomb(0.3).breakaway_drag == 0.0
    assert eqx.tree_at(lambda m: m.dynamic, SmoothCoulomb(0.3), jnp.asarray(0.5)).breakaway == 0.5
