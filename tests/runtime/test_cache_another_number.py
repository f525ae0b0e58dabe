"""A model with other numbers runs the programs that are there: its static parts hold structure only."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.runtime import without_tricks
from tests.compilations import is_waited_for
from tests.models import four_bar_builder


@pytest.fixture
def programs():
    """A list that grows by the name of every program that is compiled; nothing runs on tapes."""
    found = []
    listen = lambda event, *_, fun_name="", **__: found.append(fun_name) if is_waited_for(event) else None
    jax.clear_caches()  # of modules before this one
    jax.monitoring.register_event_duration_secs_listener(listen)
    with without_tricks("tape"):
        yield found
    jax.monitoring.unregister_event_duration_listener(listen)


def four_bar(ground, crank, coupler, rocker, mass, rate, spring=True):
    b = four_bar_builder((ground, crank, coupler, rocker), [mass * length for length in (crank, coupler, rocker)])
    if spring:
        b.force("spring", mbs.SpringDamper(stiffness=rate, damping=0.1), joint="D")
    return b.build(cut=["C"])


def answers(system, t1, rtol):
    state = mbs.State.at(system, A=0.7, guess={"B": -0.3, "D": 1.2})
    motion = mbs.simulate(system, state, ts=np.linspace(0.0, t1, 11), rtol=rtol, max_steps=int(1e5 + t1))
    return mbs.reactions(system, motion)["A"].force, mbs.forward_dynamics(system, state)


@pytest.mark.long
def test_ten_sets_of_numbers_share_one_set_of_programs(programs):
    """Built without `like`: lengths, masses, springs, times, tolerances."""
    random, counts, found = np.random.default_rng(3), [], []
    for _ in range(10):
        lengths = np.array([1.0, 0.3, 0.9, 0.7]) * random.uniform(0.9, 1.1, 4)
        system = four_bar(*lengths.tolist(), mass=random.uniform(0.5, 2.0), rate=random.uniform(1.0, 9.0))
        found.append(answers(system, t1=random.uniform(0.1, 0.3), rtol=10.0 ** -random.uniform(5.0, 9.0)))
        counts.append(len(programs))
    assert counts[0] > 0
    assert counts[1:] == counts[:1] * 9
    forces = np.array([force[-1] for force, _ in found])
    assert len(np.unique(forces[:, 0])) == 10 and np.all(np.isfinite(forces))


@pytest.mark.long
def test_a_fixed_step_of_another_size(programs):
    system = four_bar(1.0, 0.3, 0.9, 0.7, 1.0, 3.0)
    state = mbs.State.at(system, A=0.7, guess={"B": -0.3, "D": 1.2})
    ends, counts = [], []
    for dt in (0.02, 0.01, 0.005):
        motion = mbs.simulate(system, state, ts=np.array([0.0, 0.1]), dt=dt, solver=mbs.ode.ImplicitMidpoint())
        ends.append(float(motion.states.coordinates[-1, 0]))
        counts.append(len(programs))
    assert counts[1:] == counts[:1] * 2
    assert abs(ends[1] - ends[2]) < 0.3 * abs(ends[0] - ends[1])


@pytest.mark.long
def test_a_force_element_changes_no_program_that_needs_no_forces(programs):
    four_bar(1.0, 0.3, 0.9, 0.7, 1.0, 3.0, spring=False)
    system = four_bar(1.0, 0.3, 0.9, 0.7, 1.0, 3.0)
    state = mbs.State.at(system, A=0.7, guess={"B": -0.3, "D": 1.2})
    assert state.ok and float(jnp.abs(state.residual)) < 1e-9
    assert sum("_evaluation_program" in name for name in programs) == 1
