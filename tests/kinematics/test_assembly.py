"""Assembly of states: the four-bar in closed form, branches, failures by name, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.mechanisms import LENGTHS, four_bar, four_bar_angles

GUESS = {"B": -0.3, "D": 1.5}


@pytest.fixture(scope="module")
def system():
    return four_bar()


def coordinates(system, state):
    values = system.coordinates(state)
    return np.array([values[name] for name in ("A", "B", "D")])


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, -1.5])
def test_four_bar_by_two_circles(system, angle):
    expected = four_bar_angles(angle)
    near = {"B": expected[1] + 0.2, "D": expected[2] - 0.2}
    state = mbs.State.at(system, A=angle, guess=near)
    np.testing.assert_allclose(coordinates(system, state), expected, atol=1e-11)
    np.testing.assert_allclose(mbs.constraint_residual(system, state), 0.0, atol=1e-12)


def test_the_guess_chooses_the_branch(system):
    """The crossed branch is the mirror image in the line from B to D."""
    open_branch = four_bar_angles(0.7)
    B = LENGTHS[1] * np.array([np.cos(0.7), np.sin(0.7)])
    line = np.arctan2(-B[1], LENGTHS[0] - B[0])
    crossed = np.array([0.7, 2 * line - (open_branch[1] + 0.7) - 0.7, 2 * line - open_branch[2]])
    state = mbs.State.at(system, A=0.7, guess={"B": crossed[1] + 0.1, "D": crossed[2] - 0.1})
    found = coordinates(system, state)
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * crossed), atol=1e-10)
    assert mbs.position(system, state, ("coupler", (0.9, 0.0, 0.0)))[1] < 0.0


def test_held_coordinates_stay_held(system):
    expected = four_bar_angles(0.5)
    state = mbs.State.at(system, {"D": expected[2]}, guess={"A": 0.4, "B": expected[1]})
    np.testing.assert_allclose(coordinates(system, state), expected, atol=1e-10)


def test_no_guess_is_needed(system):
    state = mbs.State.at(system, A=0.7)
    np.testing.assert_allclose(mbs.constraint_residual(system, state), 0.0, atol=1e-10)


def test_unassemblable_names_the_joint_that_stays_open(system):
    far = four_bar((1.88, 0.3, 0.9, 0.7), like=system)  # closes with the crank near the ground line only
    with pytest.raises(mbs.AssemblyError, match="cannot be assembled") as caught:
        mbs.State.at(far, A=0.7, guess=GUESS)
    assert set(caught.value.residuals) == {"C"}
    B = 0.3 * np.array([np.cos(0.7), np.sin(0.7)])
    gap = np.hypot(1.88 - B[0], B[1]) - 1.6  # the pins come no nearer, and one axis sees 0.7 of it or more
    assert caught.value.residuals["C"] > 0.7 * gap


def test_contradicting_rates_are_refused(system):
    B, D = four_bar_angles(0.7)[1:]
    with pytest.raises(mbs.AssemblyError, match="velocities held contradict"):
        mbs.State.at(system, A=0.7, velocities={"A": 1.0, "D": -3.0}, guess={"B": B, "D": D})


def test_rates_follow_the_closed_form(system):
    h = 1e-6
    slope = (four_bar_angles(0.7 + h) - four_bar_angles(0.7 - h)) / (2 * h)
    state = mbs.State.at(system, A=0.7, velocities={"A": 2.0}, guess=GUESS)
    rates = system.velocities(state)
    np.testing.assert_allclose([rates[n] for n in ("A", "B", "D")], 2.0 * slope, atol=1e-8)
    np.testing.assert_allclose(mbs.constraint_jacobian(system, state) @ state.velocities, 0.0, atol=1e-12)


POINT = np.array([*LENGTHS, 0.7])


def solved(system, x):
    """Coordinates (B, D) by the four lengths and the crank angle."""
    state = mbs.State.at(four_bar(tuple(x[:4]), like=system), A=x[4], guess=GUESS)
    return state.coordinates[jnp.array([1, 2])]


def truth(x):
    return four_bar_angles(x[4], x[:4])[1:]


def central(f, h):
    return np.stack([(f(POINT + s) - f(POINT - s)) / (2 * h) for s in h * np.eye(5)], axis=-1)


@pytest.mark.slow
def test_derivatives_of_assembled_coordinates(system):
    """Reverse mode for both angles, so vmap of the adjoint too."""
    both = jax.jit(lambda x: (solved(system, x), jax.jacrev(lambda y: solved(system, y))(x)))
    value, slope = both(jnp.asarray(POINT))
    np.testing.assert_allclose(value, truth(POINT), atol=1e-11)
    np.testing.assert_allclose(slope, central(truth, 1e-6), rtol=1e-7, atol=1e-8)


@pytest.mark.slow
def test_second_derivatives_of_assembled_coordinates(system):
    """Forward over forward, along one direction of all parameters, against the closed form."""
    direction = np.array([0.3, 0.1, -0.2, 0.4, 1.0])

    @jax.jit
    def along(s):
        def first(s):
            return jax.jvp(lambda r: solved(system, POINT + r * direction), (s,), (1.0,))[1]

        return jax.jvp(first, (s,), (1.0,))

    slope, curvature = along(0.0)
    h = 1e-4
    line = [truth(POINT + k * h * direction) for k in (-1, 0, 1)]
    np.testing.assert_allclose(slope, (line[2] - line[0]) / (2 * h), rtol=1e-6)
    np.testing.assert_allclose(curvature, (line[2] - 2 * line[1] + line[0]) / h**2, rtol=1e-5, atol=1e-5)


def test_traced_states_have_the_rates_of_their_drives():
    """In a trace as on the host: `A u = -f_t`."""
    b = mbs.SystemBuilder()
    b.body("block", mass=2.0, inertia=0.1)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block", drive=mbs.Polynomial([0.1, 0.7, 0.5]))
    driven = b.build()
    for state in (jax.jit(lambda t: mbs.State.at(driven, t=t))(0.3), mbs.State.at(driven, t=0.3)):
        np.testing.assert_allclose(state.coordinates, 0.1 + 0.7 * 0.3 + 0.5 * 0.3**2, rtol=1e-12)
        np.testing.assert_allclose(state.velocities, 0.7 + 0.3, rtol=1e-12)
