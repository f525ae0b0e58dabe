"""Hamilton's equations on the independent coordinates: a pendulum on a cart by hand, a loop by geometry, a drive."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import dynamics
from jaxmbs.dynamics import _hamilton as hamilton
from jaxmbs.kinematics._configuration import configuration
from jaxmbs.kinematics._poses import node_parameters
from tests.models import LENGTHS, OnCart, four_bar, four_bar_angles, four_bar_state, slopes

HAND = OnCart()
CLOSE = {"rtol": 1e-9, "atol": 1e-11}


@jax.jit
def asked(system, state, p):
    """What the tests ask of a system with one program."""
    return {
        "H": dynamics.hamiltonian(system, state, p),
        "own": dynamics.hamiltonian(system, state),
        "slopes": dynamics.hamiltonian_slopes(system, state, p),
        "own slopes": dynamics.hamiltonian_slopes(system, state),
        "p": dynamics.generalised_momentum(system, state),
        "Q": dynamics.total_effort(system, state),
        "u_dot": mbs.forward_dynamics(system, state)[0],
    }


@pytest.mark.long
def test_value_and_slopes_of_a_pendulum_on_a_cart():
    """At momenta that are not those of the state, and at its own."""
    system, phi, u, p = HAND.build(), np.array([0.3, 0.6]), np.array([1.1, -2.0]), np.array([0.8, -0.5])
    state = mbs.State.at(system, slide=phi[0], swing=phi[1], velocities={"slide": u[0], "swing": u[1]})
    found = asked(system, state, p)

    def by_hand(phi, p):
        return 0.5 * p @ np.linalg.solve(HAND.field(phi[1]), p)

    own = HAND.field(phi[1]) @ u
    for value, slope, momenta in (("H", "slopes", p), ("own", "own slopes", own)):
        np.testing.assert_allclose(found[value], by_hand(phi, momenta), **CLOSE)
        np.testing.assert_allclose(found[slope][0], slopes(lambda x, m=momenta: by_hand(x, m), phi), **CLOSE)
        np.testing.assert_allclose(found[slope][1], np.linalg.solve(HAND.field(phi[1]), momenta), **CLOSE)
    lagrangian = lambda phi: 0.5 * u @ HAND.field(phi[1]) @ u
    np.testing.assert_allclose(found["own slopes"][0], -slopes(lagrangian, phi), **CLOSE)  # (48)
    I_dot = slopes(lambda x: HAND.field(x[0]), phi[1:])[..., 0] * u[1]
    p_dot = HAND.field(phi[1]) @ found["u_dot"] + I_dot @ u
    np.testing.assert_allclose(-found["own slopes"][0] + HAND.weight(phi[1]), p_dot, **CLOSE)  # (47)
    assert abs(found["own slopes"][0][1]) > 0.1


def field_of_four_bar(angle):
    """I* of the four-bar of `mechanisms`: masses and inertias of rods at the velocities of their middles."""
    _, a, b, c = LENGTHS

    def middles(x):
        A, B, D = four_bar_angles(x[0])
        e = lambda s: np.array([np.cos(s), np.sin(s)])
        places = a / 2 * e(A), a * e(A) + b / 2 * e(A + B), np.array([LENGTHS[0], 0.0]) + c / 2 * e(D)
        return np.stack([np.append(place, turn) for place, turn in zip(places, (A, A + B, D), strict=True)])

    rates, masses = slopes(middles, [angle])[..., 0], np.array([1.0, 2.0, 1.5])
    weights = np.stack([masses, masses, masses * np.array([a, b, c]) ** 2 / 12.0], axis=1)
    return np.sum(weights * rates**2)


@pytest.mark.long
def test_a_loop_takes_its_dependent_coordinates_along():
    """H = p^2 / 2 I*(phi), I* by plane geometry; and p_dot = -dH/dphi + Q = GR phi_dot + Q."""
    system = four_bar(stiffness=3.0, load=5.0, independent=["A"])
    state = four_bar_state(system)
    I, I_slope = field_of_four_bar(0.7), slopes(lambda x: field_of_four_bar(x[0]), [0.7])[0]
    found, p = asked(system, state, np.array([0.4])), np.array([0.4])
    np.testing.assert_allclose(found["H"], p[0] ** 2 / (2 * I), rtol=1e-8)
    np.testing.assert_allclose(found["slopes"][0], [-0.5 * (p[0] / I) ** 2 * I_slope], rtol=1e-7)
    np.testing.assert_allclose(found["slopes"][1], p / I, rtol=1e-8)
    p_dot = I * found["u_dot"][0] + I_slope * 2.0**2
    np.testing.assert_allclose((-found["own slopes"][0] + found["Q"])[0], p_dot, rtol=1e-7)
    turned = dynamics.gyristor_field(system, state) @ jnp.array([2.0])
    np.testing.assert_allclose(turned, -found["own slopes"][0], rtol=1e-9)


def moved(t):
    return 0.2 * t + 0.7 * t**2


@pytest.mark.long
def test_a_driven_cart():
    """p of the total velocities, H with the drive's speed in it, and still p_dot = -dH/dphi + Q, phi_dot = dH/dp."""
    system, t, angle, rate = HAND.build(drive=moved), 0.5, 0.6, -2.0
    state = mbs.State.at(system, swing=angle, velocities={"swing": rate}, t=t)
    v, a, ml = 0.2 + 1.4 * t, 1.4, HAND.mass * HAND.length
    field = HAND.field(angle)
    p = field[1, 1] * rate + field[0, 1] * v
    found = asked(system, state, np.array([p]))
    np.testing.assert_allclose(found["p"], [p], **CLOSE)

    def by_hand(x):
        I = HAND.field(x[0])
        return (p - I[0, 1] * v) ** 2 / (2 * I[1, 1]) - 0.5 * I[0, 0] * v**2

    np.testing.assert_allclose([found["H"], found["own"]], by_hand([angle]), **CLOSE)
    np.testing.assert_allclose(found["slopes"][0], slopes(by_hand, [angle]), **CLOSE)
    np.testing.assert_allclose(found["slopes"][1], [rate], **CLOSE)
    turning = (HAND.weight(angle)[1] - field[0, 1] * a) / field[1, 1]
    p_dot = field[1, 1] * turning + field[0, 1] * a - ml * np.sin(angle) * rate * v
    np.testing.assert_allclose(-found["slopes"][0][0] + found["Q"][0], p_dot, **CLOSE)


@pytest.mark.long
def test_rates_of_a_tree():
    """The same equations by recursion, as `simulate` integrates them."""
    system, phi, p = HAND.build(), np.array([0.3, 0.6]), np.array([0.8, -0.5])
    P = node_parameters(system)
    rate = jax.jit(
        lambda psi, p: hamilton.canonical_rate(system, configuration(system, P, psi, jnp.zeros(())), p)[:2]
    )
    psi_dot, p_dot = rate(phi, p)
    along_phi = slopes(lambda x: 0.5 * p @ np.linalg.solve(HAND.field(x[1]), p), phi)
    np.testing.assert_allclose(psi_dot, np.linalg.solve(HAND.field(phi[1]), p), **CLOSE)
    np.testing.assert_allclose(p_dot, -along_phi + HAND.weight(phi[1]), **CLOSE)


@pytest.mark.long
def test_derivatives_by_parameters_and_momenta():
    """Of the slope, which is itself a derivative: d2H/dphi dp against differences by hand."""
    system, phi, p = HAND.build(), np.array([0.3, 0.6]), jnp.array([0.8, -0.5])
    state = mbs.State.at(system, slide=phi[0], swing=phi[1])
    found = jax.jit(jax.jacfwd(lambda p: dynamics.hamiltonian_slopes(system, state, p)[0]))(p)
    by_hand = lambda p: slopes(lambda x: 0.5 * p @ np.linalg.solve(HAND.field(x[1]), p), phi)
    np.testing.assert_allclose(found, slopes(by_hand, p), rtol=1e-7, atol=1e-9)


def test_another_number_of_momenta_is_refused():
    system = HAND.build()
    with pytest.raises(ValueError, match=r"must have shape \(2,\), one for each independent velocity, not \(3,\)"):
        dynamics.hamiltonian(system, mbs.State.at(system), np.ones(3))
