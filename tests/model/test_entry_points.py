"""Every public question refuses the state of another system, before anything is traced."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.bondgraph._equations import graph_state_equations
from jaxmbs.constraints import _kic_second as kic_second
from jaxmbs.dynamics.paper import _fields as fields
from jaxmbs.dynamics.paper import _ports as ports
from tests.models import bar, four_bar

QUESTIONS = [
    mbs.forward_dynamics,
    mbs.mass_matrix,
    mbs.reactions,
    mbs.reaction.reaction_bonds,
    mbs.dynamics.kinetic_energy,
    mbs.dynamics.potential_energy,
    mbs.equilibrium,
    mbs.linearise,
    mbs.stiffness,
    mbs.constraints.constraint_residual,
    mbs.constraints.constraint_jacobian,
    mbs.constraints.kic,
    mbs.constraints.kic_second,
    mbs.bondgraph.bond_powers,
    graph_state_equations,
    fields.inertia_field,
    fields.state_equations,
    fields.independent_rates,
    ports.total_effort,
    ports.source_effort,
    kic_second.internal_kic_second,
    lambda system, state: mbs.inverse_dynamics(system, state, jnp.zeros(1)),
    lambda system, state: mbs.simulate(system, state, 1.0),
    lambda system, state: mbs.position(system, state, "bar"),
    lambda system, state: mbs.dynamics.acceleration(system, state, "bar"),
    lambda system, state: mbs.kinematics.jacobian(system, state, "bar"),
    lambda system, state: system.coordinates(state),
    lambda system, state: system.velocities(state),
]


@pytest.mark.parametrize("question", QUESTIONS)
def test_sizes_are_compared(question):
    with pytest.raises(mbs.ModelError, match=r"coordinates of shape \(2,\); this system has 1, of the joints pin"):
        question(bar(), mbs.State(0.0, jnp.zeros(2), jnp.zeros(2)))


@pytest.mark.parametrize("question", QUESTIONS)
def test_joints_are_compared(question):
    other = mbs.State.at(bar(mbs.Prismatic("x")))
    with pytest.raises(mbs.ModelError, match=r"another system: it has the joints pin \(Prismatic\), this one"):
        question(bar(), other)


@pytest.mark.slow
def test_states_fit_all_systems_of_one_structure():
    state = mbs.State.at(bar(), pin=0.3)
    np.testing.assert_allclose(mbs.forward_dynamics(bar(mass=2.0), state)[0].shape, (1,))
    by_hand = mbs.State(0.0, np.array([0.3]), [0.0])
    for system in (bar(), bar(pin="hinge")):
        np.testing.assert_array_equal(mbs.forward_dynamics(system, by_hand)[0], mbs.forward_dynamics(bar(), state)[0])
    assert mbs.State.at(four_bar(), A=0.3).structure == four_bar((1.0, 0.31, 0.9, 0.7)).topology.structure


@pytest.mark.slow
def test_a_motion_remembers_its_system():
    motion = mbs.simulate(bar(), mbs.State.at(bar(), pin=0.3), ts=[0.0, 0.1])
    assert motion.states.structure == motion.end.structure == bar().topology.structure
    other = bar(mbs.Prismatic("x"))
    for question in (
        mbs.reactions,
        lambda s, m: mbs.motion.peak(s, m, lambda state: state.t),
        mbs.bondgraph.bond_powers,
    ):
        with pytest.raises(mbs.ModelError, match="another system"):
            question(other, motion)
