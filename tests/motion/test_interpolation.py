"""States of a motion by number and between its saved times."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import four_bar, four_bar_state


@pytest.fixture(scope="module")
def swing():
    """A pendulum of small inertia, its states at every twentieth of a second, and beside them."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("bob", mass=1.0, com=(0.0, 0.0, -1.0), inertia=0.1)
    b.joint("socket", mbs.Spherical(), "ground", "bob")
    system = b.build()
    state = mbs.State.at(system, velocities={"socket": (1.0, 0.8, -0.4)})
    return system, state


def motion(system, state, ts):
    return mbs.simulate(system, state, ts=ts, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    "name", [pytest.param("swing", marks=pytest.mark.long), pytest.param("loop", marks=pytest.mark.long)]
)
def test_states_between_fall_with_the_sixth_power(name, request):
    system, state = request.getfixturevalue("swing") if name == "swing" else looped()
    start, halves = state.t, []
    between = start + np.array([0.013, 0.17, 0.31])
    exact = motion(system, state, between).states
    for step in (0.04, 0.02):
        found = motion(system, state, start + np.arange(0.0, 0.401, step)).at(system, between)
        assert found.coordinates.shape == exact.coordinates.shape
        halves.append(np.abs(found.coordinates - exact.coordinates).max())
        assert np.abs(mbs.constraints.constraint_residual(system, found)).max(initial=0.0) < 1e-12
    assert halves[0] < 1e-4 and halves[1] < halves[0] / 20


def looped():
    system = four_bar()
    return system, four_bar_state(system)


@pytest.mark.long
def test_states_by_number_and_their_ends(swing):
    system, state = swing
    ts = np.array([0.1, 0.2, 0.3])
    saved = motion(system, state, ts)
    assert len(saved) == 3 and len(list(saved)) == 3
    for k in (0, -1, np.int64(2)):
        np.testing.assert_array_equal(saved[k].coordinates, saved.states.coordinates[k])
        assert saved[k].t == ts[k]
    assert saved[1:].t.shape == (2,) and saved[np.array([0, 2])].coordinates.shape == (2, 4)
    for beyond in (3, -4, 0.5, "socket"):
        with pytest.raises(IndexError, match="3 saved states"):
            saved[beyond]
    both = jax.vmap(lambda scale: mbs.simulate(system, jax.tree.map(lambda x: x, state), ts=ts * scale))(jnp.ones(2))
    assert both[-1].coordinates.shape == (2, 4)
    at_saved = saved.at(system, ts[1])
    np.testing.assert_allclose(at_saved.velocities, saved.states.velocities[1], rtol=1e-12)
    with pytest.raises(ValueError, match="saved from 0.1 to 0.3 s"):
        saved.at(system, 0.31)
    assert np.isnan(jax.jit(lambda t: saved.at(system, t).coordinates)(0.31)).all()


@pytest.mark.long
def test_the_slope_by_the_time_is_the_rate(swing):
    system, state = swing
    saved = motion(system, state, np.arange(0.0, 0.41, 0.05))
    tip = ("bob", (0.0, 0.0, -1.0))
    slope = jax.jacfwd(lambda t: mbs.position(system, saved.at(system, t), tip))(0.233)
    np.testing.assert_allclose(slope, mbs.velocity(system, saved.at(system, 0.233), tip), rtol=1e-6)


@pytest.mark.long
def test_an_event_ends_what_there_is_between(swing):
    system, state = swing
    ended = mbs.simulate(system, state, ts=np.arange(0.0, 2.0, 0.05), event=lambda s: s.velocities[1] - 0.5)
    end = float(ended.end.t)
    np.testing.assert_allclose(ended.at(system, end).velocities[1], 0.5, atol=1e-9)
    with pytest.raises(ValueError, match="not at"):
        ended.at(system, end + 0.01)
