"""The paper's spring: vector, net displacement and KIC, by the geometry of a pendulum on a cart and of a loop."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import dynamics
from tests.models import LENGTHS, OnCart, four_bar, four_bar_angles, four_bar_state, slopes

HAND = OnCart()
FROM, POINT, FREE, STIFFNESS = np.array([0.5, 0.8, 0.1]), (0.05, -0.4, 0.02), 0.3, 80.0
PHI = np.array([0.3, 0.6])


@jax.jit
def asked(system, state, point):
    ends = ("ground", FROM), ("bob" if "bob" in system.topology.frame_index else "coupler", point)
    return {
        "vector": dynamics.spring_vector(system, state, *ends),
        "displacement": dynamics.spring_displacement(system, state, *ends, FREE),
        "at its free length": dynamics.spring_displacement(
            system, state, *ends, np.linalg.norm(HAND.place(PHI, POINT) - FROM)
        ),
        "G_C": dynamics.spring_kic(system, state, *ends),
        "second": dynamics.spring_kic_second(system, state, *ends),
        "e_C": dynamics.compliance_effort(system, state),
        "stiffness": mbs.stiffness(system, state),
    }


@pytest.fixture(scope="module")
def on_cart():
    law = mbs.SpringDamper(stiffness=STIFFNESS, free_length=FREE)
    where = {"between": (("ground", FROM), ("bob", POINT))}
    system = HAND.build(forces=[("spring", law, where)], weightless=True)
    return asked(system, mbs.State.at(system, slide=PHI[0], swing=PHI[1]), np.array(POINT))


def vector(phi):
    return HAND.place(phi, POINT) - FROM


def length(phi):
    return np.linalg.norm(vector(phi))


def displacement(phi):
    return (1 - FREE / length(phi)) * vector(phi)


def along(phi):
    """G_C (3, 2) as (65) has it, the slope of the length by differences."""
    return np.outer(vector(phi) / length(phi), slopes(length, phi))


@pytest.mark.long
def test_vector_and_displacement(on_cart):
    q_C, G_hat = on_cart["vector"]
    np.testing.assert_allclose(q_C, vector(PHI), rtol=1e-12)
    np.testing.assert_allclose(G_hat, slopes(vector, PHI), atol=1e-10)
    dq_C, slope = on_cart["displacement"]
    np.testing.assert_allclose(dq_C, displacement(PHI), rtol=1e-12)
    np.testing.assert_allclose(slope, slopes(displacement, PHI), atol=1e-10)


@pytest.mark.slow
def test_kic_is_the_slope_of_the_length_along_the_spring(on_cart):
    """Which is the slope (66) of the net displacement at the free length, and only there."""
    np.testing.assert_allclose(on_cart["G_C"], along(PHI), atol=1e-10)
    np.testing.assert_allclose(on_cart["at its free length"][0], 0.0, atol=1e-12)
    np.testing.assert_allclose(on_cart["at its free length"][1], on_cart["G_C"], atol=1e-12)
    assert np.max(np.abs(on_cart["displacement"][1] - on_cart["G_C"])) > 0.05


@pytest.mark.long
def test_efforts_by_either_kic(on_cart):
    """(59) and (64), the slope of the energy."""
    energy = lambda phi: STIFFNESS / 2 * (length(phi) - FREE) ** 2
    dq_C = on_cart["displacement"][0]
    for G in (on_cart["vector"][1], on_cart["G_C"]):
        np.testing.assert_allclose(-STIFFNESS * G.T @ dq_C, -slopes(energy, PHI), atol=1e-8)
    np.testing.assert_allclose(on_cart["e_C"], -slopes(energy, PHI), atol=1e-8)


@pytest.mark.long
def test_tensor_of_the_antagonistic_stiffness(on_cart):
    """Planes are columns of G_C; with the net displacement it is the antagonistic share, beside K G_C^T G_C."""
    second, G_C, dq_C = on_cart["second"], on_cart["G_C"], on_cart["displacement"][0]
    np.testing.assert_allclose(second, np.swapaxes(slopes(along, PHI, h=1e-3), 0, 1), atol=1e-7)
    antagonistic = STIFFNESS * np.einsum("c,lcn->ln", dq_C, second)
    np.testing.assert_allclose(on_cart["stiffness"].elastic, STIFFNESS * G_C.T @ G_C, rtol=1e-10)
    np.testing.assert_allclose(on_cart["stiffness"].antagonistic, antagonistic, rtol=1e-10)
    assert np.max(np.abs(antagonistic)) > 1.0


@pytest.mark.long
def test_ends_that_coincide_have_no_direction():
    system = HAND.build()
    state, ends = mbs.State.at(system), ("ground", "cart")
    assert not np.any(dynamics.spring_kic(system, state, *ends))
    assert np.all(np.isfinite(dynamics.spring_kic_second(system, state, *ends)))
    dq_C, slope = dynamics.spring_displacement(system, state, *ends, 0.0)
    np.testing.assert_array_equal(dq_C, np.zeros(3))
    np.testing.assert_array_equal(slope, dynamics.spring_vector(system, state, *ends)[1])
    with pytest.raises(mbs.UnknownNameError, match="there is no body or frame 'bobb'"):
        dynamics.spring_kic(system, state, "ground", "bobb")


@pytest.mark.long
def test_in_a_loop():
    """A point of the coupler of a four-bar, by plane geometry."""
    system = four_bar(independent=["A"])
    found = asked(system, four_bar_state(system), np.array([0.45, 0.1, 0.0]))

    def vector(x):
        A, B, _ = four_bar_angles(x[0])
        c, s = np.cos(A + B), np.sin(A + B)
        crank = LENGTHS[1] * np.array([np.cos(A), np.sin(A)])
        return np.append(crank + np.array([[c, -s], [s, c]]) @ [0.45, 0.1], 0.0) - FROM

    def along(x):
        return np.outer(vector(x) / np.linalg.norm(vector(x)), slopes(lambda x: np.linalg.norm(vector(x)), x))

    np.testing.assert_allclose(found["vector"][1], slopes(vector, [0.7]), atol=1e-8)
    np.testing.assert_allclose(found["G_C"], along([0.7]), atol=1e-8)
    np.testing.assert_allclose(found["second"], np.swapaxes(slopes(along, [0.7], h=1e-3), 0, 1), atol=1e-6)
