"""Linearisation, modes and equilibrium of mechanisms whose force elements have internal states."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import eigvals

import jaxmbs as mbs
from jaxmbs import forces as F
from tests.models import four_bar_builder
from tests.state_laws import Lag, Servo

SPRUNG, UNSPRUNG, TYRE, SPRING, SERIES, OIL = 250.0, 35.0, 1.5e5, 1.6e4, 4e4, 1.5e3


def quarter_car(series=SERIES, oil=OIL, like=None):
    """A wheel on its tyre, a body on a spring beside Maxwell's element."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("wheel", mass=UNSPRUNG)
    b.body("body", mass=SPRUNG)
    b.joint("hub", mbs.Prismatic("z"), "ground", "wheel")
    b.joint("strut", mbs.Prismatic("z"), "wheel", "body")
    b.force("tyre", mbs.SpringDamper(TYRE), joint="hub")
    b.force("spring", mbs.SpringDamper(SPRING), joint="strut")
    b.force("damper", F.Maxwell(series, oil), joint="strut")
    return b.build(like=like)


def quarter_car_matrix(k=SERIES, c=OIL):
    """Of (hub, strut, their rates, stretch); the masses act on the absolute displacements hub and hub + strut."""
    M = np.array([[UNSPRUNG + SPRUNG, SPRUNG], [SPRUNG, SPRUNG]])
    K, pull = np.diag([TYRE, SPRING]), np.array([[0.0], [k]])
    A = np.zeros((5, 5))
    A[:2, 2:4] = np.eye(2)
    A[2:4, :2], A[2:4, 4:] = np.linalg.solve(M, -K), np.linalg.solve(M, -pull)
    A[4, 3], A[4, 4] = 1.0, -k / c
    return A


@pytest.mark.long
def test_quarter_car_against_its_matrix():
    system = quarter_car()
    linear = mbs.linearise(system, mbs.State.at(system), inputs=["strut"], outputs=["hub"])
    assert linear.state_names == ("hub", "strut", "rate of hub", "rate of strut", "damper.stretch")
    np.testing.assert_allclose(linear.state_space.A, quarter_car_matrix(), rtol=1e-10, atol=1e-9)
    assert linear.state_space.B.shape == (5, 1) and linear.state_space.C.shape == (1, 5) and linear.ok
    roots = np.sort_complex(np.asarray(mbs.modes(linear).roots))
    np.testing.assert_allclose(roots, np.sort_complex(eigvals(quarter_car_matrix())), rtol=1e-9)
    with pytest.raises(mbs.errors.ModelError, match="internal states is no LinearSystem"):
        _ = linear.system


@pytest.mark.long
def test_the_real_pole_has_the_name_of_its_state():
    """A hard spring on a soft damper: the pole near -k/c belongs to the stretch."""
    system = quarter_car(oil=10.0)
    modes = mbs.modes(system, mbs.State.at(system))
    k = int(np.argmax(-np.asarray(modes.roots).real))
    assert abs(modes.roots[k].imag) == 0.0
    names = np.asarray(modes.coordinates)
    assert names[np.argmax(np.abs(np.asarray(modes.shapes[:, k])))] in ("damper.stretch", "rate of strut")


@pytest.mark.long
def test_derivatives_of_the_response_by_the_element():
    """Transfer function by numbers of the element, against differences of the matrix's own."""
    system = quarter_car()
    numbers = jnp.array([SERIES, OIL])

    def gain(numbers):
        new = quarter_car(*numbers, like=system)
        linear = mbs.linearise(new, mbs.State.at(new), inputs=["hub"], outputs=["strut"])
        return jnp.abs(mbs.frequency_response(linear, 20.0)[0, 0])

    def truth(k, c):
        A = quarter_car_matrix(k, c)
        M = np.array([[UNSPRUNG + SPRUNG, SPRUNG], [SPRUNG, SPRUNG]])
        B = np.concatenate([np.zeros(2), np.linalg.solve(M, [1.0, 0.0]), [0.0]])
        return abs(np.linalg.solve(20j * np.eye(5) - A, B)[1])

    np.testing.assert_allclose(gain(numbers), truth(SERIES, OIL), rtol=1e-9)
    steps = np.array([SERIES, OIL]) * 1e-5
    slopes = [(truth(*(numbers + d)) - truth(*(numbers - d))) / (2.0 * d.sum()) for d in np.diag(steps)]
    np.testing.assert_allclose(jax.grad(gain)(numbers), slopes, rtol=1e-6)


def lift(target, stiffness=300.0, like=None):
    """A load on a spring, held by a motor that integrates the error and a jack that follows its command."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("load", mass=3.0)
    b.joint("z", mbs.Prismatic("z"), "ground", "load")
    b.force("spring", mbs.SpringDamper(stiffness), joint="z")
    b.force("jack", Lag(0.1, 12.0), joint="z")
    b.force("motor", Servo(50.0, jnp.atleast_1d(target), 20.0))
    return b.build(like=like)


@pytest.mark.long
def test_equilibrium_of_an_integrator():
    """The error vanishes, and the integral holds what is left of weight, spring and jack."""
    system = lift(0.2)
    found = mbs.equilibrium(system, mbs.State.at(system))
    assert found.ok and found.stiffness.shape == (1, 1)
    np.testing.assert_allclose(found.state.coordinates, [0.2], atol=1e-9)
    np.testing.assert_allclose(found.state.internal["jack.force"], 12.0, rtol=1e-9)
    holds = 3.0 * 9.81 + 300.0 * 0.2 - 12.0
    np.testing.assert_allclose(found.state.internal["motor.integral"], [holds], rtol=1e-9)
    np.testing.assert_allclose(mbs.forward_dynamics(system, found.state)[0], [0.0], atol=1e-7)

    def integral(target, stiffness):
        new = lift(target, stiffness, like=system)
        return mbs.equilibrium(new, mbs.State.at(new)).state.internal["motor.integral"][0]

    np.testing.assert_allclose(jax.grad(integral, argnums=(0, 1))(0.2, 300.0), (300.0, 0.2), rtol=1e-7)


class Trapped(F.AbstractScalarLaw):
    """A closed column of oil: its pressure keeps any value at rest."""

    area: float = 0.01
    bulk: float = 1e9
    volume: float = 1e-3

    @property
    def internal_states(self):
        return {"p": F.InternalState((), "Pa", 1e6)}

    def rate(self, x, v, s, t):
        return {"p": -self.bulk / self.volume * self.area * v}

    def effort(self, x, v, s, t):
        return self.area * s["p"]


@pytest.mark.long
def test_internal_states_that_are_held():
    """At rest the rate of the pressure vanishes whatever it is: it must be given."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("rod", mass=3.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "rod")
    b.force("spring", mbs.SpringDamper(1e5), joint="x")
    b.force("oil", Trapped(), joint="x")
    system = b.build()
    state = mbs.State.at(system, internal={"oil.p": 2e6})
    with pytest.raises(mbs.errors.SimulationError, match="held="):
        mbs.equilibrium(system, state)
    found = mbs.equilibrium(system, state, held=["oil.p"])
    np.testing.assert_allclose(found.state.coordinates, [0.2], rtol=1e-8)
    np.testing.assert_allclose(found.state.internal["oil.p"], 2e6)
    place = lambda p: mbs.equilibrium(
        system, mbs.State.at(system, internal={"oil.p": p}), held=["oil.p"]
    ).state.coordinates[0]
    np.testing.assert_allclose(jax.grad(place)(2e6), 0.01 / 1e5, rtol=1e-7)
    with pytest.raises(mbs.errors.ModelError, match="did you mean 'oil.p'"):
        mbs.equilibrium(system, state, held=["oil.q"])


@pytest.mark.long
def test_linearised_four_bar_against_differences():
    """A loop with elements on a joint and between points: A times a small displacement is the change of the rates."""
    b = four_bar_builder()
    b.force("a", F.Maxwell(50.0, 8.0), joint="A")
    b.force("b", F.Maxwell(70.0, 5.0), between=("ground", ("coupler", (0.2, 0.1, 0.0))))
    b.force("hold", mbs.SpringDamper(400.0, 5.0), joint="A")
    system = b.build(independent=["A"])
    at = lambda x, w, z: mbs.State.at(
        system, A=x, velocities={"A": w}, guess={"B": -0.2, "D": 1.2}, internal={"a.stretch": z[0], "b.stretch": z[1]}
    )
    linear = mbs.linearise(system, at(0.7, 1.5, (0.02, -0.03)))
    assert linear.state_names == ("A", "rate of A", "a.stretch", "b.stretch")
    field = mbs.motion.vector_field(system)

    def rates(x):
        state = at(x[0], x[1], x[2:])
        y = field.start(state)
        rate = field(0.0, y)
        return np.array([x[1], mbs.forward_dynamics(system, state)[0][0], *rate.momenta[-2:]])

    x = np.array([0.7, 1.5, 0.02, -0.03])
    slopes = np.stack([(rates(x + d) - rates(x - d)) / 2e-6 for d in 1e-6 * np.eye(4)], axis=1)
    np.testing.assert_allclose(linear.state_space.A, slopes, rtol=1e-6, atol=1e-6)
