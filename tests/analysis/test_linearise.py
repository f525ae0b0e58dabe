"""Small motions: closed forms, the benchmark bicycle, quarter and half car, differences of the equations."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.kinematics._poses import step_coordinates
from tests.cases import models
from tests.models import four_bar, four_bar_angles

G = 9.81
QUARTER_CAR = np.array((-1.4318178582151293 + 6.913960032282237j, -8.568182141784856 + 57.57019776700937j))
TRANSMISSIBILITY = {
    0.5: 1.2431223795026294,
    1.0: 2.607804313445154,
    2.0: 0.5824903322135094,
    5.0: 0.1606653563520087,
    10.0: 0.1445099700925674,
    20.0: 0.006745684411326245,
}
HALF_CAR = np.array(
    (
        -5.641037756093821 + 7.384986546038576j,
        -4.4843982145201435 + 9.103208407724658j,
        -24.731877439117333 + 46.805475681908746j,
        -32.25565180027871 + 43.06561355870292j,
    )
)


def upper_half(linear):
    values = np.asarray(mbs.modes(linear).roots)
    return np.sort_complex(values[values.imag > 0])


@pytest.mark.long
def test_quarter_car_eigenvalues():
    system = models.quarter_car(road=0.0)
    linear = mbs.linearise(system, mbs.State.at(system))
    np.testing.assert_allclose(upper_half(linear), np.sort_complex(QUARTER_CAR), rtol=0, atol=1e-9)
    np.testing.assert_allclose(linear.stiffness, [[190e3, 0.0], [0.0, 16e3]], atol=1e-6)


@pytest.mark.long
def test_half_car_eigenvalues():
    system = models.half_car(road_front=0.0)
    linear = mbs.linearise(system, mbs.State.at(system))
    np.testing.assert_allclose(upper_half(linear), np.sort_complex(HALF_CAR), rtol=0, atol=1e-9)


@pytest.mark.long
def test_half_car_transmissibility():
    """Heave and pitch over the road under the front wheel: the tyre's spring times the response to a force."""
    system = models.half_car(road_front=0.0)
    linear = mbs.linearise(system, mbs.State.at(system), inputs=("tyre_front",), outputs=("heave", "pitch"))
    omega = 2 * np.pi * np.array([0.5, 1.3, 4.0, 11.0, 25.0])
    found = 182470.0 * np.asarray(mbs.frequency_response(linear.state_space, omega))[..., 0]
    # by hand: heave, pitch, front and rear wheel; the struts' stretches
    front, rear = np.array([-1.0, 1.15, 1.0, 0.0]), np.array([-1.0, -1.65, 0.0, 1.0])
    M, C = np.diag([568.0, 1200.0, 63.0, 60.0]), 3921.0 * np.outer(front, front) + 2936.0 * np.outer(rear, rear)
    K = 36297.0 * np.outer(front, front) + 19620.0 * np.outer(rear, rear) + 182470.0 * np.diag([0.0, 0.0, 1.0, 1.0])
    load = np.array([0.0, 0.0, 182470.0, 0.0])
    expected = [np.linalg.solve(K + 1j * w * C - w**2 * M, load)[:2] for w in omega]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


@pytest.mark.long
def test_quarter_car_transmissibility():
    """The drive of the road is released; the heights over its own follow from the state space."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    up = mbs.Prismatic(axis="z")
    b.body("road", mass=0.0)
    b.body("wheel", mass=60.0)
    b.body("car", mass=300.0)
    b.joint("road", up, "ground", "road", drive=mbs.forces.Polynomial([0.0]))
    b.joint("tyre", up, "road", "wheel")
    b.joint("strut", up, "wheel", "car")
    b.force("tyre", mbs.SpringDamper(stiffness=190e3), joint="tyre")
    b.force("strut", mbs.SpringDamper(stiffness=16e3, damping=1000.0), joint="strut")
    system = b.build()
    linear = mbs.linearise(system, mbs.State.at(system), inputs=("road",), outputs=("road", "tyre", "strut"))
    hertz = np.array(list(TRANSMISSIBILITY))
    response = np.asarray(mbs.frequency_response(linear.state_space, 2 * np.pi * hertz))[..., 0]
    car = np.abs(response.sum(axis=1) / response[:, 0])
    np.testing.assert_allclose(car, list(TRANSMISSIBILITY.values()), rtol=0, atol=1e-10)
    load = 190e3 * np.abs(response[:, 1] / response[:, 0])[[1, 4]]
    np.testing.assert_allclose(load, [33137.73822515322, 608080.53672417], atol=1e-6)


def bicycle():
    """The benchmark bicycle of Meijaard, Papadopoulos, Ruina and Schwab (2007), z upwards here."""
    flip = np.diag([1.0, -1.0, -1.0])

    def inertia(xx, yy, zz, xz=0.0):
        return flip @ np.array([[xx, 0, xz], [0, yy, 0], [xz, 0, zz]]) @ flip

    head, tilt = np.array([1.02 + 0.08, 0.0, 0.0]), np.pi / 10  # where the steering axis meets the ground
    b = mbs.SystemBuilder()
    b.body("frame", mass=85.0, com=(0.3, 0.0, 0.9), inertia=inertia(9.2, 11.0, 2.8, 2.4))
    b.body("rear", mass=2.0, inertia=(0.0603, 0.12, 0.0603))
    b.body("fork", mass=4.0, com=np.array([0.9, 0.0, 0.7]) - head, inertia=inertia(0.05892, 0.06, 0.00708, -0.00756))
    b.body("front", mass=3.0, inertia=(0.1405, 0.28, 0.1405))
    b.joint("free", mbs.Free(), "ground", "frame")
    b.joint("rear_hub", mbs.Revolute(axis="y"), "frame", "rear", parent_frame=(0.0, 0.0, 0.3))
    b.joint("steer", mbs.Revolute(axis=(-np.sin(tilt), 0.0, np.cos(tilt))), "frame", "fork", parent_frame=head)
    b.joint("front_hub", mbs.Revolute(axis="y"), "fork", "front", parent_frame=np.array([1.02, 0, 0.35]) - head)
    b.constraint("rear_contact", mbs.joints.RollingDisk(0.3), between=("ground", "rear"))
    b.constraint("front_contact", mbs.joints.RollingDisk(0.35), between=("ground", "front"))
    return b.build()


@pytest.mark.long
def test_the_benchmark_bicycle():
    """Weave, capsize and castering eigenvalues at 5 m/s, published to 14 digits."""
    system = bicycle()
    assert system.topology.mobility == 3 and len(system.topology.analysis.independent_positions) == 7
    place = {"free": np.array([0.0, 0, 0, 1, 0, 0, 0]), "steer": 0.0}
    state = mbs.State.at(system, place, velocities={"free": np.array([5.0, 0, 0, 0, 0, 0]), "steer": 0.0})
    found = np.asarray(mbs.modes(mbs.linearise(system, state)).roots)[-4:]
    weave = -0.77534188219585 + 4.46486771378823j
    expected = [-14.07838969279822, weave.conjugate(), weave, -0.32286642900409]
    np.testing.assert_allclose(np.sort_complex(found), expected, rtol=0, atol=1e-8)


def governor():
    """An arm on a turning shaft with a ball-jointed tip, springs and dampers."""
    b = mbs.SystemBuilder()
    b.body("shaft", mass=1.0, inertia=0.05)
    b.body("arm", mass=2.0, com=(0.0, 0.0, -0.4), inertia=(0.02, 0.03, 0.01))
    b.body("ball", mass=0.5, com=(0.0, 0.1, -0.1), inertia=0.01)
    b.joint("spin", mbs.Revolute(axis="z"), "ground", "shaft")
    b.joint("swing", mbs.Revolute(axis="y"), "shaft", "arm", parent_frame=(0.1, 0.0, 0.0))
    b.joint("tip", mbs.Spherical(), "arm", "ball", parent_frame=(0.0, 0.0, -0.5))
    b.force("spring", mbs.SpringDamper(stiffness=30.0, damping=0.7), joint="swing")
    b.force("rod", mbs.SpringDamper(stiffness=50.0, damping=0.2, free_length=0.3), between=("shaft", "ball"))
    return b.build()


@pytest.mark.long
def test_state_matrix_is_the_derivative_of_the_motion():
    """A quaternion joint in motion: A against differences of the equations over steps of the coordinates."""
    system = governor()
    state = mbs.State.at(
        system,
        {"spin": 0.2, "swing": -0.5, "tip": np.array([0.9, 0.1, -0.3, 0.3]) / np.linalg.norm([0.9, 0.1, -0.3, 0.3])},
        velocities={"spin": 2.0, "swing": 0.3, "tip": np.array([0.4, -0.2, 0.7])},
    )
    A = np.asarray(mbs.linearise(system, state).state_space.A)
    nv = system.topology.num_velocities

    @jax.jit
    def flow(x):
        psi = step_coordinates(system.topology, state.coordinates, x[:nv])
        moved = mbs.State(state.t, psi, state.velocities + x[nv:])
        return mbs.forward_dynamics(system, moved)[0]

    lower = np.asarray(jax.jacfwd(flow)(jnp.zeros(2 * nv)))
    np.testing.assert_allclose(A[nv:], lower, atol=1e-9 * np.abs(lower).max())
    turn = np.array([0.4, -0.2, 0.7])
    cross = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
    expected = np.zeros((nv, 2 * nv))
    expected[:, nv:] = np.eye(nv)
    expected[2:5, 2:5] = -cross  # a rotation seen in the turning child
    np.testing.assert_allclose(A[:nv], expected, atol=1e-12)


@pytest.mark.long
def test_gradient_of_an_eigenvalue():
    """d(Im lambda)/dk of the quarter car against central differences, and no NaN at a free mass."""

    def frequency(k):
        system = models.quarter_car(spring=k, road=0.0)
        return mbs.modes(mbs.linearise(system, mbs.State.at(system))).roots[0].imag

    value = jax.jit(frequency)
    found, h = jax.jit(jax.grad(frequency))(16e3), 1.0
    np.testing.assert_allclose(found, (value(16e3 + h) - value(16e3 - h)) / (2 * h), rtol=1e-6)
    assert np.isfinite(jax.jit(jax.grad(frequency))(0.0))


@pytest.mark.long
def test_effort_input_and_acceleration_output():
    """Two masses pushed by a joint's effort: D is 1/m, C the efforts of springs and damper over the masses."""
    system = models.quarter_car(road=0.0)
    state = mbs.State.at(system)
    linear = mbs.linearise(system, state, inputs=("suspension",), outputs=lambda s, a: jnp.cumsum(a))
    np.testing.assert_allclose(linear.state_space.D[:, 0], [-1 / 60.0, 1 / 300.0], rtol=1e-12)
    wheel, car = np.array([-190e3, 16e3, 0.0, 1e3]) / 60.0, np.array([0.0, -16e3, 0.0, -1e3]) / 300.0
    np.testing.assert_allclose(linear.state_space.C, [wheel, car], rtol=1e-12, atol=1e-9)


def test_unknown_names():
    system = models.quarter_car()
    with pytest.raises(mbs.UnknownNameError, match="there is no joint 'road'; there are: tyre, suspension"):
        mbs.linearise(system, mbs.State.at(system), inputs=("road",))


@pytest.mark.long
def test_the_drive_of_a_planar_loop_is_released():
    """Redundant out of its plane, yet its drive is not: the crank becomes the independent coordinate."""
    system = four_bar(drive=mbs.forces.Polynomial([0.7, 2.0]))
    state = mbs.State.at(system, guess=dict(zip("ABD", four_bar_angles(0.7), strict=True)))
    space = mbs.linearise(system, state, inputs=("A",), outputs=("D",)).state_space
    h = 1e-5
    slope = (four_bar_angles(0.7 + h)[2] - four_bar_angles(0.7 - h)[2]) / (2 * h)
    np.testing.assert_allclose(space.C, [[slope, 0.0]], atol=1e-8)
    np.testing.assert_allclose(space.A, [[0.0, 1.0], [0.0, 0.0]], atol=1e-12)


@pytest.mark.long
def test_modes_and_responses_take_what_is_at_hand():
    """A mechanism and a state, or what `linearise` made of them."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("bob", 1.0, com=(0.0, 0.0, -1.0), inertia=(0.1, 0.1, 0.1))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    system = b.build()
    state = mbs.State.at(system)
    linear = mbs.linearise(system, state, inputs=("pin",), outputs=("pin",))
    natural = np.sqrt(9.81 / 1.1)
    np.testing.assert_allclose(mbs.modes(system, state).omega, natural, rtol=1e-9)
    np.testing.assert_array_equal(mbs.modes(system, state).roots, mbs.modes(linear).roots)
    found = mbs.frequency_response(linear, [1.0])
    np.testing.assert_allclose(found[0, 0, 0], 1.0 / (1.1 * (natural**2 - 1.0)), rtol=1e-9)
    by_name = mbs.frequency_response(linear, [1.0], into=["pin"], out=["pin"])
    assert by_name.inputs == ("pin",)
    np.testing.assert_allclose(by_name.values, found, rtol=1e-9)
    with pytest.raises(mbs.UnknownNameError, match="pin"):
        mbs.frequency_response(linear, [1.0], into=["pim"], out=["pin"])
    with pytest.raises(mbs.ModelError, match="both"):
        mbs.frequency_response(linear, [1.0], into=["pin"])
    with pytest.raises(TypeError, match="need a state"):
        mbs.modes(system)


@pytest.mark.long
def test_gyroscopic_part_of_a_spinning_rotor():
    """Two gimbals and a spin W: `+-J W` between the gimbals' rates; the dampers are the other part of C."""
    b, J, W = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0)), 0.3, 20.0
    for name, inertia in (("outer", 0.0), ("inner", 0.0), ("rotor", (0.2, 0.2, J))):
        b.body(name, mass=float(name == "rotor"), inertia=inertia)
    for name, axis, parent, child in (
        ("a", "x", "ground", "outer"),
        ("b", "y", "outer", "inner"),
        ("c", "z", "inner", "rotor"),
    ):
        b.joint(name, mbs.Revolute(axis), parent, child)
        b.force(f"damper {name}", mbs.SpringDamper(damping=0.1 if name == "a" else 0.2), joint=name)
    system = b.build()
    linear = mbs.linearise(system, mbs.State.at(system, velocities={"c": W}))
    gyroscopic = np.array([[0.0, J * W, 0.0], [-J * W, 0.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(linear.gyroscopic, gyroscopic, atol=1e-12)
    np.testing.assert_allclose(linear.damping, gyroscopic + np.diag([0.1, 0.2, 0.2]), atol=1e-12)
    np.testing.assert_allclose(linear.mass, np.diag([0.2, 0.2, J]), atol=1e-12)


@pytest.mark.long
def test_a_support_that_accelerates():
    """A pendulum on a driven lift weighs `m (g + a)`: the drive's second derivative is in the stiffness."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -G))
    b.body("lift", mass=3.0)
    b.body("bob", mass=2.0, com=(0.0, 0.0, -0.8), inertia=0.01)
    b.joint("up", mbs.Prismatic("z"), "ground", "lift", drive=mbs.forces.Polynomial([0.1, 0.5, 1.5]))
    b.joint("swing", mbs.Revolute("y"), "lift", "bob")
    system = b.build()
    linear = mbs.linearise(system, mbs.State.at(system, t=0.4))
    np.testing.assert_allclose(linear.stiffness, [[2.0 * (G + 3.0) * 0.8]], rtol=1e-12)
    np.testing.assert_allclose(linear.mass, [[2.0 * 0.8**2 + 0.01]], rtol=1e-12)


@pytest.mark.long
def test_a_bead_on_a_rotor_that_is_driven():
    """Its spring holds it softer by `m Omega^2`: the rate of the drive is in the stiffness."""
    b, k, m, rate = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0)), 80.0, 2.0, 3.0
    b.body("rotor", mass=1.0, inertia=0.1)
    b.body("bead", mass=m, inertia=0.01)
    b.joint("shaft", mbs.Revolute("z"), "ground", "rotor", drive=mbs.Ramp(0.0, rate))
    b.joint("slide", mbs.Prismatic("x"), "rotor", "bead")
    b.force("spring", mbs.SpringDamper(k), joint="slide")
    system = b.build()
    linear = mbs.linearise(system, mbs.State.at(system))
    np.testing.assert_allclose(linear.stiffness, [[k - m * rate**2]], rtol=1e-12)


@pytest.mark.long
def test_ratio_and_frequency_of_a_damped_mass():
    b, k, c, m = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0)), 80.0, 3.0, 5.0
    b.body("mass", mass=m)
    b.joint("slide", mbs.Prismatic("x"), "ground", "mass")
    b.force("mount", mbs.SpringDamper(k, c), joint="slide")
    system = b.build()
    modes = mbs.modes(system, mbs.State.at(system))
    np.testing.assert_allclose(modes.damping_ratios, c / (2 * np.sqrt(k * m)), rtol=1e-9)
    np.testing.assert_allclose(modes.frequencies, np.sqrt(k / m) / (2 * np.pi), rtol=1e-9)


@pytest.mark.long
def test_states_and_modes_of_a_rolling_system_have_names():
    """A disk on the table, held by a spring across: more coordinates than velocities, each with its name."""
    b = mbs.SystemBuilder()
    b.body("disk", mass=1.0, inertia=(0.1, 0.2, 0.1))
    b.joint("free", mbs.Free(), "ground", "disk", parent_frame=(0.0, 0.0, 0.5))
    b.constraint("contact", mbs.joints.RollingDisk(0.5), between=("ground", "disk"))
    b.force("spring", mbs.SpringDamper(stiffness=30.0), between=(("ground", (0.0, 0.0, 0.5)), "disk"))
    system = b.build()
    linear = mbs.linearise(system, mbs.State.at(system))
    assert len(linear.positions) > len(linear.velocities)
    columns = dict(zip(("free x", "free y", "free z", "free rx", "free ry", "free rz"), range(6), strict=True))
    assert [columns[name] for name in linear.position_names] == list(linear.positions)
    assert [columns[name] for name in linear.names] == list(linear.velocities)
    assert len(linear.state_names) == len(linear.state_space.A)
    modes = mbs.modes(linear)
    assert modes.coordinates == linear.state_names
    rolling = np.argmax(modes.frequencies)
    np.testing.assert_allclose(modes.omega[rolling], np.sqrt(30.0 / (1.0 + 0.2 / 0.25)), rtol=1e-6)
    for name in linear.names:  # x' = w x, by name
        if name in linear.position_names:
            place, rate = modes.at(name)[0, rolling], modes.at(f"rate of {name}")[0, rolling]
            np.testing.assert_allclose(rate, modes.roots[rolling] * place, atol=1e-9)
    with pytest.raises(mbs.UnknownNameError, match="did you mean 'free x'"):
        modes.at("free xx")
    with pytest.raises(mbs.ModelError, match="state_names"):
        _ = linear.system


def test_modes_of_a_linear_system_are_found_by_name():
    chain = mbs.LinearSystem(mass=np.eye(3), stiffness=np.diag([3.0, 2.0, 1.0]), coordinates=["a x", "a y", "b x"])
    modes = mbs.modes(chain)
    np.testing.assert_allclose(np.abs(modes.at("a")), [[0, 0, 1], [0, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(np.abs(modes.select(slice(0, 1)).at("b x")), [[1]], atol=1e-12)
