"""Elements of decks beside the element matrices that NX Nastran 2412 wrote: their eigenvalues.

Of `static_solid_shell_bar_kelm` in the models of pyNastran (BSD): E = 2.9e7, G = 1.1e7, nu = 0.32, one element each.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import elements as el

E, NU, G = 2.9e7, 0.32, 1.1e7
WEAK = 4e-4  # K6ROT = 100
TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
UP = np.array([0.0, 0, 1])
THIN = dict(drilling=WEAK, residual_bending=True)
THIN_SQUARE = dict(THIN, corner_drilling=True)
SHEAR = 5 / 6 * G / (E / 2 / (1 + NU))
CASES = {
    "CHEXA": (el.Hexahedron(E, NU), np.concatenate([SQUARE, SQUARE + UP])),
    "CPENTA": (el.Wedge(E, NU, side_shear=True), np.concatenate([TRIANGLE, TRIANGLE + UP])),
    "CQUAD4": (el.Quadrilateral(E, NU, 0.25, shear_factor=SHEAR, **THIN_SQUARE), SQUARE),
    "CTRIA3": (el.Triangle(E, NU, 0.25, shear_factor=SHEAR, **THIN), TRIANGLE),
    "thick CQUAD4": (el.Quadrilateral(E, NU, 1.0, shear_factor=SHEAR, **THIN_SQUARE), SQUARE),
    "thick CTRIA3": (el.Triangle(E, NU, 1.0, shear_factor=SHEAR, **THIN), TRIANGLE),
}
PRINTED = {
    "CHEXA": [1611111.11] * 3
    + [1830808.08] * 2
    + [3661616.16] * 3
    + [7107843.14] * 3
    + [7323232.32]
    + [10984848.5] * 5
    + [40277777.8],
    "CPENTA": [630161.814, 1968226.41, 2754459, 3031337.97, 3545753.35, 6117376.81]
    + [7280108.83, 8281726.93, 10175903.8, 10984848.5, 14250566.6, 39037808.1],
    "CQUAD4": [274.590005, 274.590005, 274.621212, 823.863636, 12586.8056, 12586.8056, 25374.7655, 28606.3763]
    + [55530.0245, 171507.855, 517111.428, 517111.428, 1546802.3, 2416941.32, 2416941.32, 5492424.24]
    + [5492424.24, 10661764.7],
    "CTRIA3": [274.621212, 274.621212, 892.485466, 10559.3612, 17207.4171, 34676.707, 65883.5464, 203401.92]
    + [1227550.15, 3459708.42, 5492630.24, 12694480.5],
    "thick CQUAD4": [1098.36002, 1098.36002, 1098.48485, 3295.45455, 758508.708, 805555.556, 805555.556]
    + [1566789.16, 1830808.08, 3553921.57, 7090597.29, 8925853.3, 8925853.3, 9667765.28, 9667765.28]
    + [21969697, 21969697, 42647058.8],
    "thick CTRIA3": [1098.48485, 1098.48485, 3569.94186, 218548.903, 1097643.79, 1820967.96, 4211417.57]
    + [4530104.43, 13838833.7, 14124358.7, 21970521, 50777922.1],
}


@jax.jit
def stiffness(element, nodes):
    return element.stiffness(nodes)


@pytest.mark.parametrize("name", [n if n[0] == "C" else pytest.param(n, marks=pytest.mark.long) for n in CASES])
def test_eigenvalues_that_nastran_wrote(name):
    """Of all motions but the six rigid ones; nine digits are known."""
    element, nodes = CASES[name]
    K = np.asarray(stiffness(element, jnp.asarray(nodes)))
    found = np.linalg.eigvalsh(K)
    assert np.max(np.abs(found[:6])) < 1e-8 * found[-1]
    np.testing.assert_allclose(found[6:], PRINTED[name], rtol=2e-8)


def test_wedges_shear_uniformly_only_in_regular_meshes():
    """With shear from the sides a wedge under uniform transverse shear needs other forces than its faces have; the
    wedge without it passes the patch test, see `test_solid`."""
    element, nodes = CASES["CPENTA"]
    own = el.Wedge(E, NU)
    u = np.zeros((6, 3))
    u[:, 0] = nodes[:, 2]
    forces = [np.asarray(stiffness(e, jnp.asarray(nodes))) @ u.ravel() for e in (element, own)]
    assert np.abs(forces[0] - forces[1]).max() > 0.2 * np.abs(forces[1]).max()
    both = [f.reshape(2, 3, 3).sum(axis=1) for f in forces]
    np.testing.assert_allclose(*both, rtol=1e-9, atol=1e-3)
