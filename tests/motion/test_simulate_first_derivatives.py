"""What users meet first: derivatives by numbers that the rows do not know, concrete states in compiled functions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs


def crank(mass, like=None):
    """A point mass on a driven arm of one metre."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("arm", mass, com=(1.0, 0.0, 0.0), inertia=(0.0, 0.0, 0.0))
    b.joint("s", mbs.Revolute("y"), "ground", "arm", drive=mbs.Ramp(rate=2.0))
    return b.build(like=like)


@pytest.mark.long
def test_the_rows_of_a_drive_do_not_know_the_mass():
    first = crank(1.0)

    def effort(mass):
        system = crank(mass, like=first)
        return mbs.reactions(system, mbs.State.at(system))["s"].effort[0]

    np.testing.assert_allclose(jax.grad(effort)(1.0), -9.81, rtol=1e-9)


@pytest.mark.long
def test_a_concrete_state_and_its_times_in_a_compiled_function():
    first = crank(1.0)
    start = mbs.State.at(first)

    @jax.jit
    def angles(mass):
        system = crank(mass, like=first)
        saved = mbs.simulate(system, start, ts=jnp.linspace(0.0, 1.0, 3)).states.coordinates[:, 0]
        fixed = mbs.simulate(system, start, t1=jnp.asarray(1.0), dt=0.5).end.coordinates
        return saved, fixed

    saved, fixed = angles(1.0)
    np.testing.assert_allclose(saved, [0.0, 1.0, 2.0], atol=1e-9)
    np.testing.assert_allclose(fixed, [2.0], atol=1e-9)


@pytest.mark.long
def test_a_loop_of_welds_is_no_mechanism():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("bar", 4.0, com=(0.5, 0.0, 0.0), inertia=0.1)
    b.joint("one", mbs.Weld(), "ground", "bar")
    b.joint("two", mbs.Weld(), "ground", "bar", parent_frame=(1.0, 0.0, 0.0), child_frame=(1.0, 0.0, 0.0))
    system = b.build()
    assert system.topology.mobility == 0 and system.topology.num_velocities == 0
    loads = mbs.reactions(system, mbs.State.at(system))
    np.testing.assert_allclose(loads["one"].force + loads["two"].force, [0.0, 0.0, 4.0 * 9.81], atol=1e-9)
