"""Assembly of states: the four-bar in closed form, branches, failures by name, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import LENGTHS, four_bar, four_bar_angles

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
    np.testing.assert_allclose(mbs.constraints.constraint_residual(system, state), 0.0, atol=1e-12)


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
    np.testing.assert_allclose(mbs.constraints.constraint_residual(system, state), 0.0, atol=1e-10)


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
    with pytest.raises(mbs.AssemblyError, match="given velocities contradict"):
        mbs.State.at(system, A=0.7, velocities={"A": 1.0, "D": -3.0}, guess={"B": B, "D": D})


def test_rates_follow_the_closed_form(system):
    h = 1e-6
    slope = (four_bar_angles(0.7 + h) - four_bar_angles(0.7 - h)) / (2 * h)
    state = mbs.State.at(system, A=0.7, velocities={"A": 2.0}, guess=GUESS)
    rates = system.velocities(state)
    np.testing.assert_allclose([rates[n] for n in ("A", "B", "D")], 2.0 * slope, atol=1e-8)
    np.testing.assert_allclose(mbs.constraints.constraint_jacobian(system, state) @ state.velocities, 0.0, atol=1e-12)


POINT = np.array([*LENGTHS, 0.7])


def solved(system, x):
    """Coordinates (B, D) by the four lengths and the crank angle."""
    state = mbs.State.at(four_bar(tuple(x[:4]), like=system), A=x[4], guess=GUESS)
    return state.coordinates[jnp.array([1, 2])]


def truth(x):
    return four_bar_angles(x[4], x[:4])[1:]


def central(f, h):
    return np.stack([(f(POINT + s) - f(POINT - s)) / (2 * h) for s in h * np.eye(5)], axis=-1)


@pytest.mark.long
def test_derivatives_of_assembled_coordinates(system):
    """Reverse mode for both angles, so vmap of the adjoint too."""
    both = jax.jit(lambda x: (solved(system, x), jax.jacrev(lambda y: solved(system, y))(x)))
    value, slope = both(jnp.asarray(POINT))
    np.testing.assert_allclose(value, truth(POINT), atol=1e-11)
    np.testing.assert_allclose(slope, central(truth, 1e-6), rtol=1e-7, atol=1e-8)


@pytest.mark.long
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


@pytest.mark.long
def test_traced_states_have_the_rates_of_their_drives():
    """In a trace as on the host: `A u = -f_t`."""
    b = mbs.SystemBuilder()
    b.body("block", mass=2.0, inertia=0.1)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block", drive=mbs.forces.Polynomial([0.1, 0.7, 0.5]))
    driven = b.build()
    for state in (jax.jit(lambda t: mbs.State.at(driven, t=t))(0.3), mbs.State.at(driven, t=0.3)):
        np.testing.assert_allclose(state.coordinates, 0.1 + 0.7 * 0.3 + 0.5 * 0.3**2, rtol=1e-12)
        np.testing.assert_allclose(state.velocities, 0.7 + 0.3, rtol=1e-12)


SIGNALS = {  # each reaches the angle at t = 1
    "function": lambda angle: jax.tree_util.Partial(jnp.multiply, angle),
    "ramp": lambda angle: mbs.forces.Polynomial((0.2, angle - 0.2)),
    "harmonic": lambda angle: mbs.Harmonic(angle - 0.1, 0.1, 0.5 * np.pi),
    "constant": lambda angle: mbs.forces.Constant(angle),
    "spline": lambda angle: mbs.Spline((0.0, 2.0), (0.0, 2.0 * angle)),
}


def slider_crank(drive=None, slide=None, like=None, angle=None):
    """Crank 0.3 m, rod 1 m; the slide may be a screw of 0.5 m a turn."""
    b = mbs.SystemBuilder()
    for name, length in (("crank", 0.3), ("rod", 1.0)):
        b.body(name, 1.0, (length / 2.0, 0.0, 0.0), mbs.inertia.rod(1.0, length))
    b.body("block", 1.0, inertia=0.1)
    b.joint("A", mbs.Revolute("z"), "ground", "crank", drive=drive)
    b.joint("B", mbs.Revolute("z"), "crank", "rod", parent_frame=(0.3, 0.0, 0.0))
    b.joint("S", mbs.Prismatic("x"), "ground", "block", drive=slide)
    b.joint("C", mbs.Revolute("z"), "rod", "block", parent_frame=(1.0, 0.0, 0.0))
    return b.build(like=like, cut=["C"])


def slider_truth(angle):
    """Angle of the rod to the crank, and the slide's place."""
    lean = np.arcsin(0.3 * np.sin(angle))
    return -lean - angle, 0.3 * np.cos(angle) + np.cos(lean)


@pytest.mark.long
@pytest.mark.parametrize("signal", SIGNALS)
def test_a_search_begins_where_the_drive_is(signal):
    """The others are guessed exactly; from a crank at zero five of these closed on the other branch."""
    first = slider_crank(SIGNALS[signal](jnp.asarray(1.0)))
    degrees = np.deg2rad([15.0, 75.0, 105.0, 135.0, 180.0, 225.0, 255.0, 285.0, 315.0, 345.0])

    def place(angle):
        B, S = (
            -jnp.arcsin(0.3 * jnp.sin(angle)) - angle,
            0.3 * jnp.cos(angle) + jnp.sqrt(1 - (0.3 * jnp.sin(angle)) ** 2),
        )
        system = slider_crank(SIGNALS[signal](angle), like=first)
        state = mbs.State.at(system, t=1.0, guess={"B": B, "S": S})
        return system.coordinates(state)["S"], state.coordinates

    wanted = slider_truth(degrees)[1]
    np.testing.assert_allclose(jax.vmap(place)(degrees)[0], wanted, atol=1e-9)
    on_host = degrees if signal == "function" else degrees[2:4]
    np.testing.assert_allclose([place(float(angle))[0] for angle in on_host], slider_truth(on_host)[1], atol=1e-9)


@pytest.mark.long
def test_driven_slides_begin_where_they_are_driven_and_guesses_come_first():
    system = slider_crank(slide=lambda t: 1.1 + 0.1 * t)
    for sign in (1.0, -1.0):
        angle = sign * np.arccos((1.2**2 + 0.3**2 - 1.0) / (2 * 1.2 * 0.3))
        state = mbs.State.at(system, t=1.0, guess={"A": angle, "B": slider_truth(angle)[0]})
        np.testing.assert_allclose(system.coordinates(state)["A"], angle, atol=1e-9)
    driven = slider_crank(lambda t: 2.0 * np.pi * t)
    state = mbs.State.at(driven, t=0.25, guess={"A": 1.5, "B": -1.5 - 0.3, "S": 0.9})
    np.testing.assert_allclose(driven.coordinates(state)["S"], slider_truth(0.5 * np.pi)[1], atol=1e-9)


@pytest.mark.long
def test_drives_are_followed_in_time():
    system = slider_crank(lambda t: 3.0 * t)
    rest = mbs.State.at(system, t=0.1, guess={"B": -0.4, "S": 1.2})
    times = np.linspace(0.0, 2.0, 41)
    states = jax.vmap(lambda t: mbs.State.at(system, t=t, near=rest))(times)
    np.testing.assert_allclose(system.coordinates(states)["S"], slider_truth(3.0 * times)[1], atol=1e-9)
    np.testing.assert_array_equal(mbs.State.at(system, near=rest).t, rest.t)
    slope = jax.grad(lambda t: system.coordinates(mbs.State.at(system, t=t, near=rest))["S"])(1.3)
    h = 1e-5
    wanted = (slider_truth(3.0 * (1.3 + h))[1] - slider_truth(3.0 * (1.3 - h))[1]) / (2 * h)
    np.testing.assert_allclose(slope, wanted, rtol=1e-7)


def test_rounded_coordinates_are_told_of_guesses(system):
    state = mbs.State.at(system, A=0.7, guess=GUESS)
    rounded = {name: round(float(value), 7) for name, value in system.coordinates(state).items()}
    with pytest.raises(mbs.AssemblyError, match=r"nearly close the loops, as rounded numbers do.*guess="):
        mbs.State.at(system, rounded)
    crank = rounded.pop("A")
    np.testing.assert_allclose(mbs.State.at(system, A=crank, guess=rounded).coordinates, state.coordinates, atol=1e-6)
    with pytest.raises(mbs.AssemblyError) as caught:
        mbs.State.at(system, A=0.7, D=3.0)
    assert "rounded" not in str(caught.value)


CONES = {
    "coupler": mbs.Coupler({"qx": 1, "qy": 1, "qz": 1}, function=lambda x, y, z: z - jnp.sqrt(x * x / 2 + y * y / 4)),
    "rows": mbs.joints.PositionRows(lambda q, t: q[2:] - jnp.sqrt(q[:1] ** 2 / 2 + q[1:2] ** 2 / 4)),
}


def on_axes(law):
    b = mbs.SystemBuilder()
    for name in "xyz":
        b.body(name, 1.0)
        b.joint(f"q{name}", mbs.Prismatic(name), "ground", name)
    b.constraint("cone", law)
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize("kind", CONES)
def test_rows_without_a_slope_where_all_is_zero(kind):
    """A cone, regular but at its tip."""
    system, height = on_axes(CONES[kind]), lambda x, y: np.sqrt(x * x / 2 + y * y / 4)
    assert system.topology.mobility == 2
    state = mbs.State.at(system, qx=0.5, qy=-0.3)
    np.testing.assert_allclose(system.coordinates(state)["qz"], height(0.5, -0.3), rtol=1e-12)
    somewhere = system.coordinates(mbs.State.at(system, qz=0.7))
    np.testing.assert_allclose(height(somewhere["qx"], somewhere["qy"]), 0.7, rtol=1e-9)
    traced = jax.jit(jax.vmap(lambda x: mbs.State.at(system, qx=x, qy=0.2)))(np.array([0.3, 0.0, -0.4]))
    np.testing.assert_allclose(system.coordinates(traced)["qz"], height(np.array([0.3, 0.0, -0.4]), 0.2), rtol=1e-9)
    with pytest.raises(mbs.AssemblyError, match="(?s)without a finite value or slope there.*cone: inf"):
        mbs.State.at(system, qx=0.0, qy=0.0)
    assert not jax.jit(lambda x: mbs.State.at(system, qx=x, qy=x).ok)(0.0)


def test_rows_that_never_have_a_slope_are_named():
    never = mbs.joints.PositionRows(lambda q, t: q[2:] - jnp.sqrt(q[:1] - 100.0))
    with pytest.raises(mbs.ModelError, match="slope of 'cone' is not finite at any pose"):
        on_axes(never)
