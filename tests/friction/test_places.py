"""A model moved from place to place keeps its curve: the coefficient that each place measures is the model's own."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.contact import Contact, HuntCrossley, SphereOnPlane
from jaxmbs.errors import ModelError
from jaxmbs.forces import (
    Attachment,
    Cable,
    FrictionForce,
    PathKinematics,
    Sheave,
    WormGear,
)
from jaxmbs.forces._cable_friction import tension_ratios
from jaxmbs.friction import AbstractFriction, BearingFriction, BrownMcPhee, LuGre, SmoothCoulomb

SPEEDS = (1e-3, 0.01, 0.02, 0.3)
EYE, NONE, G = jnp.eye(3), jnp.zeros(3), 10.0


class Logarithmic(AbstractFriction):
    """A model of a user's."""

    slope: jax.Array

    def coefficient(self, speed):
        return self.slope * jnp.log1p(speed / 0.01)


MODELS = {
    "coulomb": SmoothCoulomb(0.3, 0.4, 0.01),
    "brown-mcphee": BrownMcPhee(0.3, 0.4, 0.01),
    "bearing": BearingFriction(0.2, transition_speed=0.01),
    "user": Logarithmic(jnp.asarray(0.1)),
    "lugre": LuGre(0.3, 1e4, 10.0, 0.2, 0.4, 0.01),
}
SMOOTH = [name for name in MODELS if name != "lugre"]


def steady(model, speed):
    """Bend of bristles that slip steadily."""
    return (model.coefficient(speed) - model.sigma2 * speed) / model.sigma0


def of_a_law(model, speed):
    if model.has_bristles:
        s = {"bristle": jnp.asarray(steady(model, speed))}
        return -FrictionForce(model, 50.0, 0.2).effort(0.0, 5.0 * speed, s, 0.0) / 50.0 / 0.2
    return -FrictionForce(model, 50.0, 0.2).effort(0.0, 5.0 * speed, 0.0) / 50.0 / 0.2


def of_a_contact(model, speed):
    parts = SphereOnPlane(0.1), HuntCrossley(1e5, 1.0)
    along = speed * jnp.array([0.6, 0.8, 0.0])
    motion = EYE, jnp.array([0.0, 0.0, 0.099]), NONE, along
    if model.has_bristles:
        s = {"bristle": (steady(model, speed) * along / speed)[None]}
        found = Contact(*parts, model).point_forces(*motion, s)
    else:
        found = Contact(*parts, model).point_forces(*motion)
    return -jnp.dot(found.friction[0], along) / speed / found.normal[0]


def of_a_cable(model, speed):
    wrap, share = jnp.array([0.0, np.pi, 0.0]), jnp.array([0.5, 0.5])
    parting = speed * jnp.array([-1.0, 1.0])
    ratios = tension_ratios((None, model, None), wrap, share, parting, 0.0, False)
    return jnp.log(ratios[1]) / np.pi


def of_a_belt(model, speed):
    """Two wheels of equal wrap, which slip by as much in turn: their tensions agree once around."""
    wrap, share = jnp.array([2.0, 2.0]), jnp.array([0.5, 0.5])
    ratios = tension_ratios((model, model), wrap, share, 2.0 * speed * jnp.array([1.0, -1.0]), 0.0, True)
    return jnp.abs(jnp.log(ratios[1])) / 2.0


def of_a_worm(model, speed):
    numbers = {"pressure_angle": 0.35, "stiffness": 1e7, "transition": 1e-9}
    law, smooth = (WormGear(2, 30, 4e-3, 0.02, friction=m, **numbers) for m in (model, None))
    rotations = jnp.stack([EYE, jnp.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])])
    places = jnp.array([[0.0, 0, 0], [float(law.centre_distance), 0, 0]])
    spin = speed / (law.radius * jnp.cos(law.lead_angle)) * jnp.array([[0.0, 0, 1.0], [0.0, 0, 0]])
    angle = 1e-3
    turn = jnp.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    at = PathKinematics(rotations.at[0].set(turn), places, spin, jnp.zeros((2, 3)))
    rubbing, plain = law.wrench(at, 0.0)[0][1], smooth.wrench(at, 0.0)[0][1]
    return jnp.linalg.norm(rubbing - plain) / jnp.linalg.norm(plain)


PLACES = {"law": of_a_law, "contact": of_a_contact, "cable": of_a_cable, "worm": of_a_worm}
CASES = [(place, name) for place in PLACES for name in MODELS if name in SMOOTH or place in ("law", "contact")]


@pytest.mark.parametrize("place, name", CASES)
def test_a_place_has_the_curve_of_the_model(place, name):
    model = MODELS[name]
    for speed in SPEEDS:
        np.testing.assert_allclose(PLACES[place](model, speed), model.coefficient(speed), rtol=1e-8)


@pytest.mark.parametrize("name", ["bearing", "user"])
def test_a_belt_has_the_curve_of_a_model_that_grows(name):
    model = MODELS[name]
    for speed in SPEEDS:
        np.testing.assert_allclose(of_a_belt(model, speed), model.coefficient(speed), rtol=1e-8)


def test_joints_have_the_curves_of_their_models():
    """Blocks on level guides, of every model at once."""
    system = blocks(MODELS)
    for speed in SPEEDS[1:]:
        bend = {"rub lugre.bristle": float(steady(MODELS["lugre"], speed))}
        state = mbs.State.at(system, velocities=dict.fromkeys(MODELS, speed), internal=bend)
        found = mbs.dynamics.joint_friction(system, state)
        for name, model in MODELS.items():
            np.testing.assert_allclose(-found.efforts[name][0] / (2.0 * G), model.coefficient(speed), rtol=1e-9)


def blocks(models):
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    for name, model in models.items():
        b.body(name, 2.0)
        b.joint(name, mbs.Prismatic("x"), "ground", name)
        b.friction(f"rub {name}", name, model)
    return b.build()


REFUSED = {  # what is built, and the sentence
    "bristles on a cable": (lambda b: rope(b, LuGre(0.3, 1e4)), "a cable has no state for the bristles of LuGre"),
    "seals on a cable": (lambda b: rope(b, BearingFriction(0.3, seal=1.0)), "follows its load alone"),
    "seals on a contact": (lambda b: sole(b, BearingFriction(0.3, viscous=1.0)), "follows its load alone"),
    "text on a contact": (lambda b: sole(b, "rough"), "contact 'touch': friction must be a coefficient or a model"),
    "text on a cable": (lambda b: rope(b, "rough"), "a coefficient or a model"),
    "falling on a belt": (lambda b: belt(b, SmoothCoulomb(0.3, 0.4)), "speed of a belt is not unique"),
    "a wrong number": (lambda b: rope(b, SmoothCoulomb(0.3, 0.1)), "static must be at least dynamic"),
}


def rope(b, model):
    path = [
        Attachment(("ground", (-0.1, 0, -1.0))),
        Sheave(("ground", (0, 0, 0)), 0.1, axis="y"),
        Attachment("block"),
    ]
    b.cable("rope", path, stiffness=1e4, free_length=2.0, friction=model)


def belt(b, model):
    wheels = [Sheave(("ground", (x, 0, 0)), 0.1, axis="y") for x in (0.0, 0.6)]
    b.cable("belt", wheels, stiffness=1e4, free_length=1.8, closed=True, friction=model)


def sole(b, model):
    b.contact("touch", SphereOnPlane(0.1), "block", "ground", HuntCrossley(1e5), model)


@pytest.mark.parametrize("name", REFUSED)
def test_places_refuse_by_name(name):
    declare, said = REFUSED[name]
    b = mbs.SystemBuilder()
    b.body("block", 1.0)
    b.joint("slide", mbs.Prismatic("z"), "ground", "block", parent_frame=(0.1, 0, -1.0))
    declare(b)
    with pytest.raises(ModelError, match=said):
        b.build()


def test_elements_of_a_cable_have_models_of_their_own():
    """One sheave of each kind, and one without friction; an earlier keyword means the same."""
    ends = [Attachment(("ground", (-0.1, 0, -1.0))), Attachment(("block", (0.9, 0, -1.0)))]

    def built(kinds, **options):
        b = mbs.SystemBuilder()
        b.body("block", 1.0)
        b.joint("slide", mbs.Prismatic("z"), "ground", "block")
        wheels = [Sheave(("ground", (0.4 * k, 0, 0)), 0.1, axis="y", friction=m) for k, m in enumerate(kinds)]
        b.cable("rope", [ends[0], *wheels, ends[1]], stiffness=1e4, free_length=2.0, **options)
        return b.build().forces[0].law

    law = built([MODELS["user"], None, 0.2])
    assert [None if m is None else type(m).__name__ for m in law.friction] == [
        *(None, "Logarithmic", None, "SmoothCoulomb", None)
    ]
    with pytest.warns(DeprecationWarning, match="slip_speed of a cable"):
        old = built([None, 0.2], friction=0.3, slip_speed=0.02)
    new = built([None, SmoothCoulomb(0.2, transition_speed=0.02)], friction=SmoothCoulomb(0.3, transition_speed=0.02))
    assert jax.tree.structure(old) == jax.tree.structure(new)
    np.testing.assert_allclose(jax.tree.leaves(old.friction), jax.tree.leaves(new.friction))
    assert Cable(("point",), [], np.zeros((0, 3)), [], friction=[0.1]).friction[0].dynamic == 0.1
