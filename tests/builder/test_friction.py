"""Friction of joints as declared: a model of a user's is taken, what is none is refused, and earlier names warn."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces
from jaxmbs.errors import ModelError
from jaxmbs.friction import AbstractFriction, BearingFriction, BrownMcPhee, LuGre, SmoothCoulomb

SPEED, MASS = 0.02, 2.0


class Quadratic(AbstractFriction):
    """A model of a user's: the coefficient grows with the square of the slip."""

    curvature: jax.Array

    def coefficient(self, speed):
        return self.curvature * speed**2


def block(*args, **options):
    b = mbs.SystemBuilder(gravity=(0, 0, -10.0))
    b.body("block", MASS)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block")
    b.friction("rub", "slide", *args, **options)
    return b.build()


def friction_of(*args, **options):
    system = block(*args, **options)
    state = mbs.State.at(system, velocities={"slide": SPEED})
    return float(mbs.dynamics.joint_friction(system, state).efforts["slide"][0])


def test_a_model_of_a_user_is_evaluated():
    np.testing.assert_allclose(friction_of(Quadratic(jnp.asarray(100.0))), -MASS * 10.0 * 100.0 * SPEED**2)


@pytest.mark.parametrize(
    "wrong, said",
    [
        ("coulomb", "a coefficient or a model of jaxmbs.friction, got 'coulomb'"),
        (SmoothCoulomb, "a coefficient or a model"),
        (SmoothCoulomb(-0.1), "dynamic must not be negative"),
        (SmoothCoulomb(np.ones(2)), "every number of SmoothCoulomb must be one number"),
        (None, "give friction="),
    ],
)
def test_what_is_no_model_is_refused(wrong, said):
    with pytest.raises(ModelError, match=f"friction 'rub': .*{said}"):
        block(wrong)


OLD = {  # arguments as they were, and the model that they are
    "mu": ({"mu": 0.1}, SmoothCoulomb(0.1, transition_speed=0.01)),
    "ratio": ({"mu": 0.1, "static_ratio": 1.4, "transition_speed": 0.02}, SmoothCoulomb(0.1, 0.14, 0.02)),
    "brown": (lambda: {"mu": 0.1, "model": forces.BrownMcPhee()}, BrownMcPhee(0.1, transition_speed=0.01)),
    "smooth": (lambda: {"mu": 0.1, "model": forces.SmoothCoulomb()}, SmoothCoulomb(0.1, transition_speed=0.01)),
    "bearing": (
        lambda: {"mu": 0.1, "model": forces.BearingFriction(5.0, 0.7)},
        BearingFriction(0.1, transition_speed=0.01, viscous=5.0, seal=0.7),
    ),
    "lugre": (
        lambda: {"mu": 0.1, "static_ratio": 1.2, "model": forces.JointLuGre(1e4, 30.0, 2.0)},
        LuGre(0.1, 1e4, 30.0, 2.0, 0.12, 0.01),
    ),
    "new model by its old keyword": ({"model": LuGre(0.1, 1e4)}, LuGre(0.1, 1e4)),
}


@pytest.mark.parametrize("name", OLD)
def test_earlier_names_warn_and_are_the_same(name):
    old, new = OLD[name]
    with pytest.warns(DeprecationWarning, match="deprecated"):
        system = block(**(old() if callable(old) else old))
    leaves, structure = jax.tree.flatten(system.friction.models)
    others, same = jax.tree.flatten(block(new).friction.models)
    assert structure == same
    np.testing.assert_allclose(leaves, others, rtol=1e-12)


def test_two_models_are_refused():
    with pytest.warns(DeprecationWarning), pytest.raises(ModelError, match="has its own numbers"):
        block(SmoothCoulomb(0.1), transition_speed=0.1)


def test_the_earlier_base_of_models_is_refused_with_the_new_one():
    with pytest.raises(ModelError, match="Own: .* is friction.AbstractFriction now"):
        type("Own", (mbs.forces.AbstractJointFriction,), {})
