"""Loads of a mechanism's motion on the finite elements of its rigid bodies."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.elements import PointMass
from jaxmbs.fem import Structure, assemble, body_load, gather_rows
from jaxmbs.flexible import carried_loads, mass_properties
from jaxmbs.flexible._floating_frame import rigid_basis
from jaxmbs.linear import LinearSystem, check
from tests.flexible.beams import beam_structure, chain_of_beams, random_state
from tests.models import rotation_about

TILT = np.array([[2.0, 0.3, -0.2], [0.3, 1.0, 0.1], [-0.2, 0.1, 1.5]]) * 1e-2
LENGTH, LAST = 0.5, "3"


def piece(scale=1.0, bob=True):
    """A beam along x; its second node carries an eccentric mass with inertia of its own."""
    beam = beam_structure(LENGTH, 3, area=4e-4 * scale)
    mass = PointMass(0.7, offset=(0.02, 0.1, -0.05), inertia=TILT)
    groups = {"beam": (beam.groups["beam"].element, [(0, 1), (1, 2), (2, 3)])}
    return Structure(beam.positions, groups | ({"bob": (mass, [(1,)])} if bob else {}))


@eqx.filter_jit
def assembled(scale=1.0, bob=True):
    return assemble(piece(scale, bob))


def arm(components, turn=None):
    """Two pieces welded together, on a ball joint; a tool on a pin with a motor."""
    b = mbs.SystemBuilder(gravity=(0.3, -9.81, 0.5))
    for k, component in enumerate(components):
        mass, centre, inertia = mass_properties(component)
        b.body(f"piece{k}", mass=mass, com=centre, inertia=inertia)
    b.body("tool", mass=1.3, com=(0.1, 0.05, 0.0), inertia=(0.01, 0.02, 0.03))
    end = (LENGTH, 0.0, 0.0)
    b.joint("hub", mbs.Spherical(), "ground", "piece0")
    b.joint("weld", mbs.Weld(), "piece0", "piece1", parent_frame=end if turn is None else mbs.Pose(end, turn))
    b.joint("wrist", mbs.Revolute("y"), "piece1", "tool", parent_frame=end, child_frame=(0.0, 0.02, 0.0))
    b.force("motor", mbs.Actuator(lambda x, v, t: 3.0), joint="wrist")
    return b.build()


PLACES = {
    "piece0": {"hub": ("piece0", "0"), "weld": ("piece0", LAST)},
    "piece1": {"weld": ("piece1", "0"), "wrist": ("piece1", LAST)},
}


@pytest.mark.long
@pytest.mark.parametrize("body", list(PLACES))
@pytest.mark.parametrize("method", ["dense", "block-sparse"])
def test_loads_of_a_body_are_in_balance(body, method):
    """Fast spatial motion, axes turned against each other: weight, inertia and all joints sum to nothing."""
    component = assembled()
    system = arm([component, component], rotation_about((1.0, 2.0, -1.0), 0.9))
    state = random_state(system, speed=5.0)
    load = carried_loads(system, state, {body: component}, PLACES[body], method)[body]
    free = carried_loads(system, state, {body: component})[body]
    motions = rigid_basis(component, jnp.array([0.1, 0.2, 0.3]))
    assert np.abs(motions.T @ free).min() > 0.5
    np.testing.assert_allclose(motions.T @ load, 0.0, atol=1e-10)


@pytest.mark.long
def test_bonds_of_the_pieces_carry_the_reactions_of_the_joints():
    """The pieces coupled at the weld and held at the hub: the bond forces are those of multibody dynamics."""
    component = assembled()
    system = arm([component, component])
    state = random_state(system, size=0.3, speed=4.0)
    pair = {"piece0": component, "piece1": component}
    loads = carried_loads(system, state, pair, {"wrist": ("piece1", LAST)})
    one = component.with_interface("0", LAST)
    bonds = {"hub": rigid_bond("piece0.0"), "weld": rigid_bond("piece1.0", f"piece0.{LAST}")}
    net = connect({"piece0": one, "piece1": one.translate((LENGTH, 0.0, 0.0))}, bonds)
    found, reactions = mbs.reactions(net, mbs.equilibrium(net, loads)), mbs.reactions(system, state, frame="joint")
    assert found.ok
    for name, bond in found.items():
        wanted = np.concatenate([reactions[name].force, reactions[name].moment])
        np.testing.assert_allclose(bond.on_first, wanted, atol=1e-8 * np.abs(wanted).max())


@pytest.mark.long
def test_at_rest_the_load_is_the_weight():
    structure = piece()
    component = assembled()
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    mass, centre, inertia = mass_properties(component)
    b.body("part", mass=mass, com=centre, inertia=inertia)
    b.joint("clamp", mbs.Weld(), "ground", "part")
    system = b.build()
    load = carried_loads(system, mbs.State.at(system), {"part": component})["part"]
    wanted = gather_rows(structure, body_load(structure, jnp.array([0.0, 0.0, -9.81])))
    np.testing.assert_allclose(load, wanted, atol=1e-12)


@pytest.mark.long
def test_mass_properties_against_the_check_of_the_substructure():
    component = assembled()
    mass, centre, inertia = mass_properties(component)
    report = check(component, about=np.asarray(centre))
    np.testing.assert_allclose(mass, report.mass, rtol=1e-12)
    np.testing.assert_allclose(centre, report.centre, atol=1e-12)
    np.testing.assert_allclose(inertia, report.inertia, atol=1e-12)


@pytest.mark.long
def test_a_load_along_a_motion_and_its_gradient():
    def bending(scale):
        component = assembled(scale)
        system = arm([component, component])
        state = random_state(system, speed=3.0)
        states = jax.tree.map(lambda x: jnp.stack([x, x]), state)
        joints = {"hub": ("piece0", "0")}
        load = carried_loads(system, states, {"piece0": component}, joints)["piece0"]
        return jnp.sum(load[1] ** 2)

    h = 1e-5
    both = jax.jit(jax.value_and_grad(bending))
    slope = (both(1.0 + h)[0] - both(1.0 - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(both(1.0)[1], slope, rtol=1e-7)


@pytest.mark.long
def test_wrong_names_are_refused_in_one_report():
    component = assembled(bob=False)
    bare = LinearSystem(mass=component.mass, stiffness=component.stiffness, coordinates=component.coordinates)
    system = arm([component, component])
    state = mbs.State.at(system)
    joints = {"hub": ("piece1", "0"), "elbow": ("piece1", "9"), "weld": ("piece7", "0")}
    with pytest.raises(mbs.ModelError) as report:
        carried_loads(system, state, {"piece1": component, "tool": bare, "nobody": component}, joints)
    told = (
        "'hub' is not on the body of 'piece1'",
        "no node of its component '9'",
        "no joint",
        "'piece7'",
        "'nobody'",
    )
    for words in told:
        assert words in str(report.value)
    assert "needs the positions" in str(report.value)
    with pytest.raises(mbs.ModelError, match="positions of the nodes"):
        mass_properties(bare)


@pytest.mark.long
def test_frames_of_elastic_bodies_are_refused():
    system, _ = chain_of_beams(2, mbs.Revolute("y"))
    component = assembled(bob=False)
    with pytest.raises(mbs.ModelError, match="'part1.8' is on an elastic body"):
        carried_loads(system, mbs.State.at(system), {"part1.8": component})
