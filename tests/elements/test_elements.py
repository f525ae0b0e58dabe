"""Every element: symmetry, rigid motions, mass, patch tests, gradients, batches, single precision, assembly."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import elements as el
from jaxmbs.linear import rigid_motions

CUBE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
BUMPS = np.random.default_rng(3).uniform(-0.15, 0.15, (8, 3))
LINE = np.array([[0.1, -0.2, 0.3], [1.0, 0.5, 0.9]])
FLAT = np.array([[0.1, 0, 0.2], [1.3, 0.1, 0.3], [1.1, 1.2, 0.9], [-0.1, 0.9, 0.4]])
SHELL = dict(young=2.0, poisson=0.3, thickness=0.1, density=1.5)

ANY = np.random.default_rng(4).normal(size=(6, 12))
ABD = ANY @ ANY.T / 12 + np.eye(6)
LAYUP = el.ShellSection(ABD[:3, :3], ABD[3:, 3:], np.array([[0.6, 0.1], [0.1, 0.5]]), ABD[:3, 3:], 0.15, 0.02)


def bent(kind):
    """Nodes of a solid with curved edges."""
    return kind.rule.shapes.nodes + np.random.default_rng(6).uniform(-0.04, 0.04, (kind.num_nodes, 3))


def curved(kind):
    """Nodes of a shell with curved sides and surface."""
    plane = np.pad(kind.rule.shapes.nodes, ((0, 0), (0, 1)))
    return plane + np.random.default_rng(6).uniform(-0.04, 0.04, plane.shape)


CASES = {  # element, positions, mass
    "mass": (el.PointMass(2.0), LINE[:1], 2.0),
    "mass_with_arm": (el.PointMass(2.0, (0.1, 0.2, 0.3), np.diag([1.0, 2.0, 3.0])), LINE[:1], 2.0),
    "spring": (el.Spring((1.0, 2, 3, 4, 5, 6), damper=(6.0, 5, 4, 3, 2, 1)), LINE, 0.0),
    "ground_spring": (el.GroundSpring((1.0, 2, 3, 4, 5, 6)), LINE[:1], 0.0),
    "rod": (el.Rod(2.0, 0.3, 1.5), LINE, 0.45 * np.linalg.norm(LINE[1] - LINE[0])),
    "lumped_rod": (el.Rod(2.0, 0.3, 1.5, lumped=True), LINE, 0.45 * np.linalg.norm(LINE[1] - LINE[0])),
    "beam": (
        el.Beam(2.0, 0.8, 0.3, 0.4, 0.5, 0.6, 1.5, fibres=((0.1, 0.2),), line_mass=0.2),
        LINE,
        0.65 * np.linalg.norm(LINE[1] - LINE[0]),
    ),
    "thick_beam": (
        el.Beam(2.0, 0.8, 0.3, 0.4, 0.5, 0.6, 1.5, shear=(0.8, 0.7), reference=(0.0, 0, 1), offsets=BUMPS[:2]),
        LINE,
        0.45 * np.linalg.norm(LINE[1] + BUMPS[1] - LINE[0] - BUMPS[0]),
    ),
    "triangle": (el.Triangle(**SHELL), FLAT[:3], None),
    "quadrilateral": (el.Quadrilateral(**SHELL), FLAT, None),
    "weak_triangle": (el.Triangle(**SHELL, drilling=4e-4), FLAT[:3], None),
    "residual_quadrilateral": (
        el.Quadrilateral(**SHELL, drilling=4e-4, residual_bending=True, corner_drilling=True),
        FLAT,
        None,
    ),
    "residual_triangle": (el.Triangle(**SHELL, drilling=4e-4, residual_bending=True), FLAT[:3], None),
    "layered_triangle": (el.LayeredTriangle(LAYUP, 0.4), FLAT[:3], None),
    "layered_quadrilateral": (el.LayeredQuadrilateral(LAYUP, 0.4), FLAT, None),
    "shear_panel": (el.ShearPanel(2.0, 0.1, 1.5), FLAT, None),
    "quadratic_triangle": (el.QuadraticTriangle(LAYUP, 0.4), curved(el.QuadraticTriangle), None),
    "quadratic_quadrilateral": (el.QuadraticQuadrilateral(LAYUP, 0.4), curved(el.QuadraticQuadrilateral), None),
    "hexahedron": (el.Hexahedron(2.0, 0.3, 1.5), CUBE + BUMPS, None),
    "tetrahedron": (el.Tetrahedron(2.0, 0.3, 1.5), bent(el.Tetrahedron), None),
    "wedge": (el.Wedge(2.0, 0.3, 1.5), bent(el.Wedge), None),
    "side_wedge": (el.Wedge(2.0, 0.3, 1.5, side_shear=True), bent(el.Wedge), None),
    "quadratic_tetrahedron": (el.QuadraticTetrahedron(2.0, 0.3, 1.5), bent(el.QuadraticTetrahedron), None),
    "quadratic_wedge": (el.QuadraticWedge(2.0, 0.3, 1.5), bent(el.QuadraticWedge), None),
    "quadratic_hexahedron": (el.QuadraticHexahedron(2.0, 0.3, 1.5), bent(el.QuadraticHexahedron), None),
}
FREE = {name: 6 for name in CASES} | {"mass": 3, "rod": 5, "lumped_rod": 5, "ground_spring": 0}
FREE |= {"mass_with_arm": 6, "shear_panel": 11}


@jax.jit
def matrices(element, nodes):
    return element.stiffness(nodes), element.mass(nodes), element.damping(nodes)


def rigid(element, nodes):
    motions = np.asarray(rigid_motions(jnp.asarray(nodes)))[:, : element.coordinates]
    return motions.reshape(-1, 6)


def test_every_kind_is_here():
    assert {type(element) for element, _, _ in CASES.values()} == set(el.ALL)


@pytest.mark.parametrize("name", CASES)
def test_matrices(name):
    """Symmetric, semidefinite; rigid motions strain nothing and nothing else does; they have the right mass."""
    element, nodes, mass = CASES[name]
    K, M, C = (np.asarray(a) for a in matrices(element, jnp.asarray(nodes)))
    modes = rigid(element, nodes)
    for matrix in (K, M, C):
        np.testing.assert_allclose(matrix, matrix.T, atol=1e-14)
        assert np.linalg.eigvalsh(matrix).min() > -1e-14
    if name != "ground_spring":
        np.testing.assert_allclose(K @ modes, 0.0, atol=4e-15 * max(1.0, np.abs(K).max()))
        np.testing.assert_allclose(C @ modes, 0.0, atol=1e-14)
    values = np.linalg.eigvalsh(K)
    assert np.sum(values < 1e-8 * max(values.max(), 1e-3)) == FREE[name]
    total = modes.T @ M @ modes
    if mass is not None:
        np.testing.assert_allclose(total[:3, :3], mass * np.eye(3), atol=1e-14)


def test_mass_properties_of_a_rod_a_plate_and_a_brick():
    """Inertia by closed forms: line, square plate about its centre, brick."""
    beam = el.Beam(1.0, 1.0, 0.3, 0.01, 0.02, 1.0, 2.0, shear=(1.0, 1.0))
    ends = np.array([[-1.0, 0, 0], [1, 0, 0]])
    M = np.asarray(matrices(beam, jnp.asarray(ends))[1])
    R = rigid(beam, ends)
    m = 2.0 * 0.3 * 2.0
    line = m * 2.0**2 / 12
    np.testing.assert_allclose(
        np.diag(R.T @ M @ R)[3:],
        [2 * 2 * 0.03, line + 4 * 0.02, line + 4 * 0.01][:1] + [line + 2.0 * 2.0 * 0.01, line + 2.0 * 2.0 * 0.02],
        rtol=1e-12,
    )
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    plate = el.Quadrilateral(**SHELL)
    M, R = np.asarray(matrices(plate, jnp.asarray(square))[1]), rigid(plate, square)
    m = 1.5 * 0.1 * 4.0
    np.testing.assert_allclose(np.diag(R.T @ M @ R)[:5], [m, m, m, *[m / 12 * (4 + 0.01)] * 2], rtol=1e-12)
    brick = el.Hexahedron(1.0, 0.3, 1.5)
    M, R = np.asarray(matrices(brick, jnp.asarray(CUBE - 0.5))[1]), rigid(brick, CUBE - 0.5)
    np.testing.assert_allclose(np.diag(R.T @ M @ R), 1.5 * np.array([1, 1, 1, 1 / 6, 1 / 6, 1 / 6]), rtol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("name", ["thick_beam", *list(CASES)[8:]])
def test_gradients(name):
    """By every number of the element and every position, against differences."""
    element, nodes, _ = CASES[name]
    nodes = jnp.asarray(nodes)
    weights = [jnp.asarray(np.random.default_rng(i).normal(size=(element.size,) * 2)) for i in range(2)]
    leaves, tree = jax.tree.flatten((element, nodes))

    def total(flat):
        sizes = np.cumsum([leaf.size for leaf in leaves])[:-1]
        parts = [part.reshape(leaf.shape) for part, leaf in zip(jnp.split(flat, sizes), leaves, strict=True)]
        e, x = jax.tree.unflatten(tree, parts)
        return jnp.sum(weights[0] * e.stiffness(x)) + jnp.sum(weights[1] * e.mass(x))

    both = jax.jit(jax.value_and_grad(total))
    flat = jnp.concatenate([leaf.ravel() for leaf in leaves])
    slope = np.asarray(both(flat)[1])
    assert np.all(np.isfinite(slope))
    for direction in np.random.default_rng(5).normal(size=(3, len(flat))):
        d = (both(flat + 1e-6 * direction)[0] - both(flat - 1e-6 * direction)[0]) / 2e-6
        np.testing.assert_allclose(slope @ direction, d, rtol=2e-6)


@pytest.mark.long
def test_single_precision():
    for name in ("thick_beam", "triangle", "quadrilateral", "residual_triangle", "hexahedron", "side_wedge"):
        element, nodes, _ = CASES[name]
        single = jax.tree.map(lambda leaf: leaf.astype(jnp.float32), (element, jnp.asarray(nodes)))
        for matrix, full in zip(matrices(*single), matrices(element, jnp.asarray(nodes)), strict=True):
            assert matrix.dtype == jnp.float32
            np.testing.assert_allclose(matrix, full, atol=3e-6 * max(np.abs(full).max(), 1e-9))


STRAIN = np.array([[1.1, 0.3, 0.0], [0.3, -0.7, 0.0], [0.0, 0.0, 0.0]])
"""A uniform state of strain in the plane, without rotation."""


@pytest.mark.parametrize("name", ["triangle", "quadrilateral", "hexahedron"])
def test_constant_strain(name):
    """A distorted element in a linear field carries the exact uniform stress, and forces that do the exact work."""
    element, nodes, _ = CASES[name]
    nodes = nodes * np.array([1.0, 1.0, 0.0 if name != "hexahedron" else 1.0])
    strain = STRAIN if name != "hexahedron" else STRAIN + np.diag([0, 0, 0.4]) + 0.2 * (np.eye(3)[[2, 1, 0]] > 0.5)
    u = np.zeros((len(nodes), element.coordinates))
    u[:, :3] = nodes @ strain
    if name == "hexahedron":
        strain = (strain + strain.T) / 2
    K, M, _ = matrices(element, jnp.asarray(nodes))
    axes = np.eye(3) if name == "hexahedron" else np.asarray(element.axes(jnp.asarray(nodes)))
    e = axes @ strain @ axes.T
    E, nu = 2.0, 0.3
    if name == "hexahedron":
        s = E / (1 + nu) * (e + nu / (1 - 2 * nu) * np.trace(e) * np.eye(3))
        expected = [s[0, 0], s[1, 1], s[2, 2], s[0, 1], s[1, 2], s[0, 2]]
        volume = float(rigid(element, nodes)[:, 0] @ M @ rigid(element, nodes)[:, 0]) / 1.5
    else:
        s = E / (1 - nu**2) * ((1 - nu) * e[:2, :2] + nu * np.trace(e[:2, :2]) * np.eye(2))
        expected = 2 * [s[0, 0], s[1, 1], s[0, 1]]
        volume = float(rigid(element, nodes)[:, 0] @ M @ rigid(element, nodes)[:, 0]) / 1.5
        e = e[:2, :2]
    stress = jax.jit(lambda el, x, u: el.stresses(x, u))(element, jnp.asarray(nodes), jnp.asarray(u))
    np.testing.assert_allclose(stress, expected, atol=1e-13)
    work = u.ravel() @ np.asarray(K) @ u.ravel()
    np.testing.assert_allclose(work, volume * np.sum(s * e), rtol=1e-12)


@pytest.mark.parametrize("name", ["triangle", "quadrilateral"])
def test_constant_curvature(name):
    """w = a x^2 + b x y + c y^2 of a distorted flat shell: exact moments."""
    element, nodes, _ = CASES[name]
    nodes = nodes * np.array([1.0, 1.0, 0.0])
    a, b, c = 0.3, 0.5, -0.2
    x, y = nodes[:, 0], nodes[:, 1]
    u = np.zeros((len(nodes), 6))
    u[:, 2], u[:, 3], u[:, 4] = a * x**2 + b * x * y + c * y**2, b * x + 2 * c * y, -2 * a * x - b * y
    forces = jax.jit(lambda el, x, u: el.forces(x, u))(element, jnp.asarray(nodes), jnp.asarray(u))
    axes = np.asarray(element.axes(jnp.asarray(nodes)))[:2, :2]
    k = -axes @ np.array([[2 * a, b], [b, 2 * c]]) @ axes.T
    D, nu = 2.0 * 0.1**3 / 12 / (1 - 0.3**2), 0.3
    moments = [D * (k[0, 0] + nu * k[1, 1]), D * (k[1, 1] + nu * k[0, 0]), D * (1 - nu) * k[0, 1]]
    np.testing.assert_allclose(forces[:3], 0.0, atol=1e-15)
    if name == "triangle":
        np.testing.assert_allclose(forces[3:6], moments, atol=1e-14)
