"""Stresses of exact beams: a circle bent by an end moment, its envelope and derivative, sections at fault."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import elements, flexible
from jaxmbs.forces import BeamSection, Torque

YOUNG, SIDE, BEND = 2e9, 0.01, 0.3  # [Pa, m, 1/m]
CORNERS = np.array([(1, 1), (-1, 1), (1, -1), (-1, -1)]) * SIDE / 2
SECTION = elements.Beam(YOUNG, 8e8, SIDE**2, SIDE**4 / 12, SIDE**4 / 12, SIDE**4 / 6, fibres=CORNERS)


@pytest.fixture(scope="module")
def bent():
    """A rod of two elements bent to a circle: the system and its state at rest."""
    section = BeamSection.of_material(YOUNG, 8e8, 1000.0, SIDE**2, SIDE**4 / 12, SIDE**4 / 12)
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.beam("rod", section, [(0, 0, 0), (1, 0, 0)], elements=2)
    b.joint("clamp", mbs.Weld(), "ground", "rod.0")
    b.force("bend", Torque((0, 0, BEND * YOUNG * SIDE**4 / 12)), on="rod.2")
    system = b.build()
    return system, mbs.equilibrium(system, mbs.State.at(system)).state


@pytest.mark.long
def test_a_bent_rod_and_its_envelope(bent):
    """`E y / R` at every section of a rod bent to a circle: the inside is pushed, the outside pulled."""
    system, state = bent
    found = flexible.section_stresses(system, state, "rod", SECTION)
    exact = -BEND * YOUNG * np.tile(CORNERS[:, 0], 2)
    np.testing.assert_allclose(found.components["beam"], np.stack([exact] * 2), rtol=1e-6)
    np.testing.assert_allclose(found.envelope().peak, BEND * YOUNG * SIDE / 2, rtol=1e-6)
    np.testing.assert_allclose(found.structure.positions, [(0, 0, 0), (0.5, 0, 0), (1, 0, 0)], atol=1e-12)
    np.testing.assert_allclose(found.at_nodes(), BEND * YOUNG * SIDE / 2, rtol=1e-6)
    two = jax.tree.map(lambda x: jnp.stack([x, x]), state)
    again = flexible.section_stresses(system, two, "rod", [SECTION, SECTION])
    np.testing.assert_allclose(again.components["beam"][1], found.components["beam"], rtol=1e-12)


@pytest.mark.long
def test_slope_by_the_side_of_the_section(bent):
    """At a given moment the stress falls with the third power of the side."""
    system, state = bent

    def peak(factor):
        s = SIDE * factor
        beam = elements.Beam(
            YOUNG, 8e8, s**2, s**4 / 12, s**4 / 12, s**4 / 6, fibres=factor * jnp.asarray(CORNERS[:1])
        )
        return flexible.section_stresses(system, state, "rod", beam).envelope().peak

    value, slope = jax.jit(jax.value_and_grad(peak))(jnp.array(1.0))
    np.testing.assert_allclose(slope, -3 * value, rtol=1e-5)


@pytest.mark.long
def test_sections_at_fault(bent):
    system, state = bent
    for section in (3.0, [SECTION], ["x", "y"]):
        with pytest.raises(mbs.ModelError, match="one for each of the 2 elements of 'rod'"):
            flexible.section_stresses(system, state, "rod", section)
    with pytest.raises(mbs.UnknownNameError, match="no exact beam 'rope'"):
        flexible.section_stresses(system, state, "rope", SECTION)
