"""Ends of models: a thing of each kind inside and beyond its range, by closed forms; its name, margin and unit."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import contact, forces
from jaxmbs import hydraulics as hyd
from jaxmbs.forces import Attachment, Sheave


def slider(law=None, joint="z", **contact_pair):
    """A body that slides along z, with a law on its joint."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("m", 1.0, inertia=1.0)
    b.joint("z", mbs.Prismatic("z"), "ground", "m")
    if law is not None:
        b.force("law", law, joint=joint)
    if contact_pair:
        b.contact(
            "law", contact_pair["pair"], "m", "ground", contact.HuntCrossley(1e6), max_depth=contact_pair["most"]
        )
    return b.build()


def wheels(law, tilt=0.0):
    """Two wheels whose second slides across; its axis may tilt."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name, kind in (("a", mbs.Revolute("z")), ("b", mbs.Prismatic("x"))):
        b.body(name, 1.0, inertia=1.0)
        b.joint(name, kind, "ground", name)
    turned = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    b.force("law", law, between=("a", ("b", mbs.Pose((0, 0, 0), turned))))
    return b.build()


def oil(element):
    """A node of a circuit behind an orifice."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("m", 1.0)
    b.joint("z", mbs.Prismatic("z"), "ground", "m")
    b.hydraulic("law", element)
    b.hydraulic("tank", hyd.Tank())
    b.hydraulic("hole", hyd.Orifice(1e-6), ports={"a": "law", "b": "tank"})
    return b.build()


def bent_beam(angle):
    """A beam of one element whose end is turned about y; and the system."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    section = forces.BeamSection([1e6, 1e5, 1e5, 1.0, 1.0, 1.0], 1.0, [0.1, 0.1, 0.1])
    b.beam("law", section, [(0, 0, 0), (1, 0, 0)], elements=1)
    b.joint("root", mbs.Weld(), "ground", "law.0")
    system = b.build()
    half = angle / 2
    state = mbs.State.at(system, {"law.1": [1.0, 0, 0, np.cos(half), 0, np.sin(half), 0]})
    return system, state


GEAR = forces.GearPair((20, 30), 2e-3, stiffness=1e8)
CYLINDER = forces.HydraulicCylinder([1e-3, 8e-4], [1e-4, 1e-4], 1e9, varying=True)


def at(system, internal=None, **coordinates):
    return system, mbs.State.at(system, coordinates, internal=internal)


def beyond_the_stroke(x):
    """States are not made where rates are not finite, as they are without a chamber, but motions may get there."""
    system, state = at(slider(CYLINDER), z=0.0)
    return system, eqx.tree_at(lambda s: s.coordinates, state, jnp.array([x]))


INSIDE_AND_BEYOND = {  # a state inside and one beyond the end, its name, the part, and the margin beyond
    "depth of a contact": (
        lambda x: at(slider(pair=contact.SphereOnPlane(0.05), most=1e-3), z=x),
        (0.0495, 0.048),
        ("law", "depth", -1e-3),
    ),
    "centres of spheres": (
        lambda x: at(slider(pair=contact.SphereOnSphere(0.05, 0.05), most=None), z=x),
        (0.01, 0.0),
        ("law", "centres", -1e-4),
    ),
    "height of a gas": (
        lambda x: at(slider(forces.AirSpring(1e-3, 1e5, 0.1)), z=x),
        (-0.09, -0.11),
        ("law", "height", -0.01),
    ),
    "pressure of a chamber": (
        lambda p: at(slider(CYLINDER), {"law.p0": p}, z=0.0),
        (-1e5, -1.1e5),
        ("law", "p0", 101325.0 - 1.1e5),
    ),
    "volume of a chamber": (beyond_the_stroke, (0.1, 0.15), ("law", "volume", -2e-5)),
    "pressure of a volume": (
        lambda p: at(oil(hyd.Volume(1e-3, pressure=p)), z=0.0),
        (-1e5, -1.1e5),
        ("law", "pressure", 101325.0 - 1.1e5),
    ),
    "pressure of an accumulator": (
        lambda p: at(oil(hyd.Accumulator(1e-3, 1e6, pressure=p)), z=0.0),
        (-1e5, -1.1e5),
        ("law", "pressure", 101325.0 - 1.1e5),
    ),
    "wheels that are apart": (lambda x: at(wheels(GEAR), b=x), (0.0501, 0.0545), ("law", "reach", -5e-4)),
    "wheels without a line of action": (
        lambda x: at(wheels(GEAR), b=x),
        (0.0499, 0.046),
        ("law", "base circles", 0.046 - 0.05 * np.cos(np.pi / 9)),
    ),
    "axes that tilt": (lambda x: at(wheels(GEAR, tilt=x), b=0.05), (0.05, 0.15), ("law", "tilt", -0.05)),
    "turn of a beam element": (bent_beam, (2.9, 3.1), ("law.1", "turn", -0.1)),
}


@pytest.mark.parametrize(("make", "values", "wanted"), INSIDE_AND_BEYOND.values(), ids=list(INSIDE_AND_BEYOND))
def test_a_part_says_where_its_model_ends(make, values, wanted):
    part, name, excess = wanted
    inside, beyond = (mbs.dynamics.validity(*make(x)) for x in values)
    assert inside.ok and not inside.faults()
    assert not beyond.ok
    margin = beyond.margins[part][name]
    np.testing.assert_allclose(jnp.min(margin.value), excess, rtol=1e-6, atol=1e-12)
    (fault, *_) = beyond.faults()
    assert fault.startswith(f"{part!r} {margin.end}") and f" {margin.unit}, first at 0 s" in fault


def strap(inextensible=False):
    """A weight on a cable over a wheel, pulled up by a mass on the other side; the first may be pushed."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    for name, x in (("a", -0.1), ("b", 0.1)):
        b.body(name, 1.0)
        b.joint(name, mbs.Prismatic("z"), "ground", name, parent_frame=(x, 0, -1.0))
    over = [Attachment("a"), Sheave("ground", 0.1, axis="y"), Attachment("b")]
    law = {"inextensible": True} if inextensible else {"stiffness": 1e4}
    b.cable("rope", over, free_length=2.0 + 0.1 * np.pi, **law)
    b.force("push", forces.Force((0, 0, 50.0)), on="a")
    b.force("lift", forces.Force((0, 0, 50.0)), on="b")
    return b.build()


@pytest.mark.long
def test_a_rope_that_would_have_to_push():
    """Both weights of 9.81 N are lifted by 50 N: the tension of the constraint is 9.81 - 50 N."""
    system = strap(inextensible=True)
    found = mbs.dynamics.validity(system, mbs.State.at(system, a=0.0))
    np.testing.assert_allclose(found.margins["rope"]["tension"].value, 9.81 - 50.0, rtol=1e-9)
    assert not found.ok and "'rope' would have to push" in found.faults()[0]
    elastic = strap()
    assert mbs.dynamics.validity(elastic, mbs.State.at(elastic, a=0.0, b=0.0)).ok


def test_a_system_without_ends_and_states_of_a_motion():
    system = slider()
    states = jax.vmap(lambda z: mbs.State.at(system, z=z))(jnp.linspace(0.0, 1.0, 3))
    found = mbs.dynamics.validity(system, states)
    assert not found.margins and found.ok.shape == (3,) and found.ok.all()
    bounded = slider(pair=contact.SphereOnPlane(0.05), most=1e-3)
    states = jax.vmap(lambda z: mbs.State.at(bounded, z=z))(jnp.array([0.06, 0.048, 0.047]))
    found = mbs.dynamics.validity(bounded, states)
    np.testing.assert_array_equal(found.ok, [True, False, False])
    assert "by 0.002 m" in found.faults()[0]


@pytest.mark.long
def test_reactions_and_batches_of_them_have_the_status():
    system = slider(pair=contact.SphereOnPlane(0.05), most=1e-3)
    heights = jnp.array([0.06, 0.048])
    loads = mbs.reactions(system, jax.vmap(lambda z: mbs.State.at(system, z=z))(heights))
    np.testing.assert_array_equal(loads.result, [mbs.Status.SUCCESS, mbs.Status.VALIDITY])
    assert loads.status == mbs.Status.VALIDITY and "'law' is pressed deeper" in repr(loads)
    found = mbs.batch(lambda z: mbs.reactions(system, mbs.State.at(system, z=z)), heights, progress=False)
    np.testing.assert_array_equal(found.ok, [True, False])
    free = slider()
    assert mbs.reactions(free, mbs.State.at(free)).validity is None


def test_margins_have_derivatives():
    """As a limit of a design asks them: 1 for the depth, and by differences at a slack pose and at a pole."""
    system = slider(pair=contact.SphereOnPlane(0.05), most=1e-3)
    left = lambda z: mbs.dynamics.validity(system, mbs.State.at(system, z=z)).margins["law"]["depth"].value
    np.testing.assert_allclose(mbs.jit(jax.grad(left))(jnp.asarray(0.048)), 1.0, rtol=1e-12)
    tilted = lambda x: mbs.dynamics.validity(*at(wheels(GEAR), b=x)).margins["law"]
    slopes = mbs.jit(jax.jacfwd(lambda x: {name: margin.value for name, margin in tilted(x).items()}))(
        jnp.asarray(0.05)
    )
    for name, slope in (("reach", -1.0), ("base circles", 1.0), ("tilt", 0.0)):
        np.testing.assert_allclose(slopes[name], slope, atol=1e-9)


def test_an_equilibrium_beyond_a_model_says_so():
    """A ball pressed on a plane by twice the load that its bound of depth carries; by half of it the model holds."""

    def pressed(load):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.body("m", 1.0, inertia=1.0)
        b.joint("z", mbs.Prismatic("z"), "ground", "m")
        law = contact.HuntCrossley(1e6, exponent=1.0)
        b.contact("foot", contact.SphereOnPlane(0.1), "m", "ground", law, max_depth=1e-3)
        b.force("load", mbs.Force(jnp.array([0.0, 0.0, -load])), on="m")
        system = b.build()
        return system, mbs.State.at(system, z=0.1 - load / 1e6)

    with pytest.warns(UserWarning, match="'foot' is pressed deeper than its max_depth, by 0.001 m"):
        found = mbs.equilibrium(*pressed(2000.0))
    assert found.ok and found.status == mbs.Status.VALIDITY and "'foot' is pressed deeper" in repr(found)
    found = mbs.equilibrium(*pressed(500.0))
    assert found.ok and found.status == mbs.Status.SUCCESS and found.faults() == []
