"""Friction of a given load: smooth models and bristles in steady sliding, heat, a hinge, and refusals."""

import jax
import numpy as np
import pytest

from jaxmbs import forces as F
from jaxmbs.friction import BearingFriction, BrownMcPhee, LuGre, SmoothCoulomb

SPEEDS = (-0.5, -0.003, 0.003, 0.02, 1.0)
LAW = F.FrictionForce(LuGre(0.5, 2.5e4, 75.0, 0.1, static=0.75, stribeck_speed=1e-2), 4.0)


@pytest.mark.parametrize("model", [SmoothCoulomb(0.3, 0.4), BrownMcPhee(0.3, 0.4), BearingFriction(0.3, seal=2.0)])
def test_efforts_are_coefficient_times_load(model):
    for v in SPEEDS:
        slip = 0.2 * v
        drag = 2.0 * np.tanh(slip / 1e-3) if isinstance(model, BearingFriction) else 0.0
        expected = -0.2 * (50.0 * np.sign(v) * model.coefficient(abs(slip)) + drag)
        law = F.FrictionForce(model, 50.0, 0.2)
        np.testing.assert_allclose(law.effort(0.0, v, 0.0), expected, rtol=1e-12)
        h = 1e-7
        difference = (law.effort(0.0, v + h, 0.0) - law.effort(0.0, v - h, 0.0)) / (2 * h)
        np.testing.assert_allclose(jax.grad(law.effort, 1)(0.0, v, 0.0), difference, rtol=1e-5, atol=1e-6)


def test_steady_sliding_is_the_stribeck_curve():
    for v in SPEEDS:
        limit = 2.0 * (1.0 + 0.5 * np.exp(-((v / 1e-2) ** 2)))
        s = {"bristle": np.asarray(np.sign(v) * limit / 1e5)}
        np.testing.assert_allclose(LAW.rate(0.0, v, s, 0.0)["bristle"], 0.0, atol=1e-12)
        np.testing.assert_allclose(LAW.effort(0.0, v, s, 0.0), -np.sign(v) * limit - 0.4 * v, rtol=1e-9)
        np.testing.assert_allclose(LAW.dissipated(0.0, v, s, 0.0), limit * abs(v) + 0.4 * v**2, rtol=1e-9)


def test_it_holds_at_rest():
    np.testing.assert_allclose(LAW.effort(0.0, 0.0, {"bristle": np.asarray(1e-5)}, 0.0), -1.0)


def test_a_hinge_rubs_at_its_radius():
    """The moment of bristles at a radius r is r times their force at the slip r w."""
    law, s = F.FrictionForce(LAW.friction, LAW.load, 0.1), {"bristle": np.asarray(1e-5)}
    np.testing.assert_allclose(law.effort(0.0, 0.3, s, 0.0), 0.1 * LAW.effort(0.0, 0.03, s, 0.0), rtol=1e-12)
    np.testing.assert_allclose(law.rate(0.0, 0.3, s, 0.0)["bristle"], LAW.rate(0.0, 0.03, s, 0.0)["bristle"])
    np.testing.assert_allclose(law.dissipated(0.0, 0.3, s, 0.0), LAW.dissipated(0.0, 0.03, s, 0.0), rtol=1e-12)


def test_faults():
    assert len(F.FrictionForce(LuGre(-1.0, 0.0, -1.0, -1.0, -2.0, 0.0), -1.0, 0.0).faults()) == 9
    with pytest.raises(TypeError, match="a model with bristles, got float"):
        F.BristleForce(0.3)


def test_what_it_has_follows_from_its_model():
    smooth = F.FrictionForce(0.3, 2.0)
    assert LAW.stores and LAW.has_bonds and LAW.holds == ("bristle",) and set(LAW.internal_states) == {"bristle"}
    assert not (smooth.stores or smooth.has_bonds or smooth.holds or smooth.internal_states)
    assert smooth.bonds(0.0, 1.0, 0.0) == smooth.rate(0.0, 1.0, {}, 0.0) == {} and smooth.potential(0.0, 0.0) == 0.0


def test_old_names_warn_and_are_the_same():
    with pytest.warns(DeprecationWarning, match="forces.FrictionForce"):
        old = F.CoulombFriction(5.0, 1.4, 0.01, 0.2, 0.5)
    new = F.FrictionForce(BearingFriction(1.0, 1.4, 0.01, 0.5, 0.2), 5.0)
    np.testing.assert_allclose(old.effort(0.0, 0.3, 0.0), new.effort(0.0, 0.3, 0.0), rtol=1e-12)
    with pytest.warns(DeprecationWarning, match="forces.FrictionForce"):
        assert type(F.BristleForce(LAW.friction, 4.0)) is F.FrictionForce
    with pytest.warns(DeprecationWarning, match="forces.FrictionForce"):
        bristles = F.LuGre(2.0, 1e5, 300.0, static_ratio=1.5, viscous=0.4, stribeck_speed=1e-2)
    s = {"bristle": np.asarray(1e-5)}
    np.testing.assert_allclose(bristles.effort(0.0, 0.02, s, 0.0), LAW.effort(0.0, 0.02, s, 0.0), rtol=1e-12)
