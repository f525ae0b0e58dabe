"""Friction of joints as declared: models of users are refused by name, as none evaluates them."""

import pytest

import jaxmbs as mbs
from jaxmbs import forces
from jaxmbs.errors import ModelError


class Own(forces.AbstractJointFriction):
    """A model of a user."""

    key = "own"


class Child(forces.SmoothCoulomb):
    """One that changes a model of the library."""

    def numbers(self):
        """Numbers that nobody reads."""
        return {"mu": 7.0}


@pytest.mark.parametrize(
    "model, said", [(Own(), "the class Own"), (Child(), "the class Child"), ("coulomb", "coulomb")]
)
def test_models_of_users_are_refused(model, said):
    b = mbs.SystemBuilder()
    b.body("block", 1.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block")
    b.friction("rub", "slide", mu=0.1, model=model)
    with pytest.raises(ModelError, match=rf"friction 'rub': model must be one of SmoothCoulomb.*{said}"):
        b.build()
