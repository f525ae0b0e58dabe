"""What a motion says of its solver is no part of its structure."""

import jax
import numpy as np

import jaxmbs as mbs
from tests.models import pendulum


def test_motions_by_other_tolerances_are_of_one_kind():
    system = pendulum()
    start = mbs.State.at(system, {system.topology.joint_names[0]: 1.0})
    fine, coarse = (mbs.simulate(system, start, t1=0.5, rtol=r, atol=r) for r in (1e-10, 1e-6))
    words = (
        "Dopri8, steps that adapt, rtol = 1e-10, atol = 1e-10; chosen as nothing dies out much faster than the motion"
    )
    assert fine.solver == f"{words} lasts" != coarse.solver
    assert "rtol = 1e-06" in coarse.solver
    assert jax.tree.structure(fine) == jax.tree.structure(coarse)
    apart = jax.tree.map(lambda a, b: np.max(np.abs(a - b)), fine.states.coordinates, coarse.states.coordinates)
    assert 0 < apart < 1e-4
    fixed = mbs.simulate(system, start, t1=0.5, dt=0.01, solver=mbs.ode.Gauss4())
    assert fixed.solver == "Gauss4, fixed steps, dt = 0.01"
    assert jax.tree.structure(fixed) == jax.tree.structure(fine)


def test_a_function_of_motions_is_traced_once():
    system, traced = pendulum(), []
    start = mbs.State.at(system, {system.topology.joint_names[0]: 1.0})

    @jax.jit
    def last(motion):
        traced.append(1)
        return motion.states.coordinates[-1]

    for r in (1e-10, 1e-8, 1e-6):
        last(mbs.simulate(system, start, t1=0.5, rtol=r, atol=r))
    assert len(traced) == 1
