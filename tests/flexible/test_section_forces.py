"""Section forces of exact beams: statics of bent cantilevers and spinning rods, derivatives, names."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import flexible
from jaxmbs.forces import BeamSection, Force

ENDS = [(0, 0, 0), (1, 0, 0)]


def cantilever(section, load, elements):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.beam("rod", section, ENDS, elements)
    b.joint("clamp", mbs.Weld(), "ground", "rod.0")
    b.force("load", Force(load), on=f"rod.{elements}")
    return b.build()


@pytest.mark.long
def test_balance_of_a_cantilever_in_large_bending():
    """At every section the load and its moment about the section, in the axes of the section."""
    load = np.array([0.3, 4.0, 1.0])
    section = BeamSection([1e4, 4e3, 4e3, 1.0, 1.0, 2.0], 1.0, [2e-3, 1e-3, 1e-3])
    system = cantilever(section, load, 4)
    rest = mbs.equilibrium(system, mbs.State.at(system))
    found = flexible.section_forces(system, rest.state, "rod")
    assert found.shape == (4, 2, 6)
    tip = mbs.position(system, rest.state, "rod.4")
    for k in range(4):
        for end in (0, 1):
            R, x = (f(system, rest.state, f"rod.{k + end}") for f in (mbs.rotation, mbs.position))
            wanted = np.concatenate([R.T @ load, R.T @ np.cross(tip - x, load)])
            np.testing.assert_allclose(found[k, end], wanted, atol=1e-6)


@pytest.mark.long
def test_slopes_by_stiffness_and_names():
    """Derivative of the root's moment by the bending stiffness: the lever of the load shortens with bending."""
    system = cantilever(BeamSection([1e4, 1e4, 1e4, 1.0, 1.0, 1.0], 1.0, [2e-3, 1e-3, 1e-3]), (0, 3.0, 0), 3)
    state = mbs.equilibrium(system, mbs.State.at(system)).state

    def moment(bending):
        section = BeamSection(jnp.stack([1e4, 1e4, 1e4, 1.0, bending, bending]), 1.0, [2e-3, 1e-3, 1e-3])
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.beam("rod", section, ENDS, 3)
        b.joint("clamp", mbs.Weld(), "ground", "rod.0")
        b.force("load", Force((0, 3.0, 0)), on="rod.3")
        again = b.build(like=system)
        rest = mbs.equilibrium(again, state, throw=False)
        return flexible.section_forces(again, rest.state, "rod")[0, 0, 5]

    value = jax.jit(moment)
    slope = (value(1.0 + 1e-4) - value(1.0 - 1e-4)) / 2e-4
    assert slope > 0.1
    np.testing.assert_allclose(jax.jit(jax.jacfwd(moment))(jnp.array(1.0)), slope, rtol=1e-5)
    with pytest.raises(mbs.UnknownNameError, match="no exact beam 'rope'"):
        flexible.section_forces(system, state, "rope")
