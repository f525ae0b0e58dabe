"""Forces and stresses of elements (30) in closed form, and of many instants at once."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.elements import Beam, GroundSpring, Rod, Spring
from jaxmbs.fem import Structure, element_forces, element_stresses, gather_rows, recover_history, scatter_rows
from tests.marks import cases

YOUNG, AREA, LENGTH = 3.0, 0.2, np.sqrt(2.0) * 1.5
PLACES = {"a": (0.0, 0.0, 0.0), "b": (1.5, 1.5, 0.0), "c": (2.0, 0.0, 0.0)}
BUSH = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
ELEMENTS = {
    "rod": (Rod(YOUNG, AREA, 1.0), [("a", "b")]),
    "bush": (Spring(BUSH), [("a", "c")]),
    "foot": (GroundSpring(BUSH), [("c",)]),
    "beam": (Beam(YOUNG, 1.1, AREA, 0.7, 0.5, 0.4, 1.0, reference=(0.0, 1.0, 0.0)), [("a", "c")]),
}
STRUCTURE = Structure({name: np.array(place) for name, place in PLACES.items()}, ELEMENTS)


def exact(u):
    """Forces of the four elements by hand for displacements (3, 6) of the nodes."""
    along = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    rod = YOUNG * AREA / LENGTH * ((u[1] - u[0])[:3] @ along)
    middle, near, far = (np.array(PLACES["a"]) + PLACES["c"]) / 2, u[0].copy(), u[2].copy()
    near[:3] += np.cross(near[3:], middle - PLACES["a"])  # the spring stands half way: what the nodes move there
    far[:3] += np.cross(far[3:], middle - PLACES["c"])
    EA, GJ, EIz, EIy, h = YOUNG * AREA, 1.1 * 0.4, YOUNG * 0.5, YOUNG * 0.7, 2.0
    d = u[2] - u[0]
    beam = np.zeros(12)
    beam[6], beam[9] = EA / h * d[0], GJ / h * d[3]
    for w, r, EI, sign in ((1, 5, EIz, 1.0), (2, 4, EIy, -1.0)):  # w' is +rz in the plane xy, -ry in xz
        shear = EI * (12 * d[w] / h**3 - sign * 6 * (u[0, r] + u[2, r]) / h**2)
        beam[6 + w] = shear
        beam[6 + r] = EI * (-sign * 6 * d[w] / h**2 + (2 * u[0, r] + 4 * u[2, r]) / h)
        beam[r] = EI * (-sign * 6 * d[w] / h**2 + (4 * u[0, r] + 2 * u[2, r]) / h)
    beam[:3], beam[3] = -beam[6:9], -beam[9]
    return {"rod": [rod], "bush": np.array(BUSH) * (far - near), "foot": np.array(BUSH) * u[2], "beam": beam}


@pytest.mark.parametrize("seed", cases(range(3), long=[0]))
def test_every_force_in_closed_form(seed):
    """A flipped sign, a factor and a forgotten stiffness change numbers that no balance shows."""
    u = np.random.default_rng(seed).standard_normal((3, 6))
    found = element_forces(STRUCTURE, jnp.asarray(u))
    for name, force in exact(u).items():
        np.testing.assert_allclose(found[name][0], force, rtol=1e-9, atol=1e-12, err_msg=name)
    stress = element_stresses(STRUCTURE, jnp.asarray(u))
    np.testing.assert_allclose(stress["rod"][0], np.array(exact(u)["rod"]) / AREA, rtol=1e-12)


@pytest.mark.long
def test_times_and_cases_come_first():
    """Rows or nodes, any axes before them, complex amplitudes: each instant as it is alone."""
    u = np.random.default_rng(5).standard_normal((2, 4, 3, 6))
    x = gather_rows(STRUCTURE, u)
    assert x.shape == (2, 4, STRUCTURE.index.num_rows)
    np.testing.assert_array_equal(gather_rows(STRUCTURE, scatter_rows(STRUCTURE, x)), x)
    for recover in (element_forces, element_stresses):
        found = recover(STRUCTURE, x)
        for other in (recover(STRUCTURE, scatter_rows(STRUCTURE, x)), recover_history(recover, STRUCTURE, x)):
            for name in found:
                np.testing.assert_allclose(found[name], other[name], rtol=1e-12, atol=1e-12)
        one = recover(STRUCTURE, x[1, 2])
        complex_ = recover(STRUCTURE, (1.0 - 2.0j) * np.asarray(x))
        for name in found:
            np.testing.assert_allclose(found[name][1, 2], one[name], rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(complex_[name], (1.0 - 2.0j) * np.asarray(found[name]), rtol=1e-12, atol=1e-12)
    for wrong in (np.ones(7), np.ones((4, 3, 5)), np.ones((2, 17))):
        with pytest.raises(ValueError, match="has the shape"):
            element_forces(STRUCTURE, jnp.asarray(wrong))
    with pytest.raises(ValueError, match="must be of shape"):
        scatter_rows(STRUCTURE, jnp.ones((2, 17)))
