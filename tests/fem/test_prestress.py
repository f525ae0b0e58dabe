"""Buckling and stiffness under load against closed forms."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import jaxmbs as mbs
from jaxmbs import elements, fem
from jaxmbs.errors import ModelError
from jaxmbs.vibration import natural_modes

N = 16
PLANE = {k: "z rx ry" for k in range(N + 1)}


def column(held, n=N, **numbers):
    """Beam of unit length along x."""
    section = {"young": 1.0, "shear_modulus": 1.0, "area": 1e4, "inertia_y": 1.0, "inertia_z": 1.0, "torsion": 2.0}
    element = elements.Beam(**{**section, "density": 1e-4, "reference": (0.0, 1.0, 0.0), **numbers})
    x = np.linspace(0.0, 1.0, n + 1)
    return fem.Structure(
        np.stack([x, 0 * x, 0 * x], axis=1), {"beam": (element, [(k, k + 1) for k in range(n)])}, held=held
    )


def factors(structure, nodal, num=1):
    load = np.zeros((structure.num_nodes, 6))
    for node, values in nodal.items():
        load[node] = values
    return fem.buckling(structure, fem.gather_rows(structure, load), num=num).factors


EULER = {  # Timoshenko and Gere (1961): how the ends are held, and P_cr l^2 / EI
    "pinned": ({0: "x y z rx ry", N: "y z rx ry"}, [9.869604401089358, 39.47841760435743]),
    "clamped, free": ({0: "all"}, [2.4674011002723395, 22.206609902451056]),
    "clamped, pinned": ({0: "all", N: "y z rx ry"}, [20.19072855642663, 59.67951594410941]),
    "clamped": ({0: "all", N: "y z rx ry rz"}, [39.47841760435743, 80.76291422570652]),
}


@pytest.mark.long
@pytest.mark.parametrize("ends", list(EULER))
def test_columns_of_euler(ends):
    held, expected = EULER[ends]
    found = factors(column({**PLANE, **held}), {N: [-1.0, 0, 0, 0, 0, 0]}, num=2)
    np.testing.assert_allclose(found, expected, rtol=1e-3)


@pytest.mark.long
def test_a_column_under_its_own_weight():
    """Clamped below, free above: `q L^3 / EI = 7.837347`, a root of a Bessel function (case B6)."""
    held = {k: "z rx ry" for k in range(2 * N + 1)} | {0: "all"}
    structure = column(held, 2 * N)  # of mass 1 per length
    weight = fem.gather_rows(structure, fem.body_load(structure, (-1.0, 0.0, 0.0)))
    np.testing.assert_allclose(fem.buckling(structure, weight).factors[0], 7.837347438943481, rtol=1e-3)


@pytest.mark.long
def test_lateral_buckling_of_narrow_beams():
    """Uniform moment `pi sqrt(EI GJ) / l`; force across the free end `4.0126 sqrt(EI GJ) / l^2`."""
    narrow = {"inertia_z": 1e4}
    simple = column({0: "x y z rx", N: "y z rx"}, **narrow)
    moments = {0: [0, 0, 0, 0, 0, -1.0], N: [0, 0, 0, 0, 0, 1.0]}
    np.testing.assert_allclose(factors(simple, moments), np.pi * np.sqrt(2.0), rtol=3e-3)
    cantilever = column({0: "all"}, **narrow)
    np.testing.assert_allclose(factors(cantilever, {N: [0, -1.0, 0, 0, 0, 0]}), 4.0126 * np.sqrt(2.0), rtol=3e-3)


@pytest.mark.long
def test_a_load_that_pulls_never_buckles_and_the_factor_grows_with_the_modulus():
    held = {**PLANE, 0: "all"}
    assert np.isinf(factors(column(held), {N: [1.0, 0, 0, 0, 0, 0]})).all()

    def lowest(young):
        return factors(column(held, young=young), {N: [-1.0, 0, 0, 0, 0, 0]})[0]

    np.testing.assert_allclose(jax.jit(jax.grad(lowest))(1.3), 2.4674011002723395, rtol=1e-3)


@pytest.mark.long
def test_frequencies_of_a_beam_under_tension():
    """Pinned beam, tension of -0.5 and 5 Euler loads: `w_n = n pi sqrt(n^2 pi^2 + T)` (case B6)."""
    structure = column({**PLANE, 0: "x y z rx ry", N: "y z rx ry"})
    K, M = fem.assemble_dense(structure)
    unit = np.zeros((N + 1, 6))
    unit[N, 0] = 1.0
    pulled = jnp.linalg.solve(K, fem.gather_rows(structure, unit))
    for share, expected in (
        (-0.5, [6.978864199638879, 36.9286782118726]),
        (5.0, [24.17549474579609, 59.21762640653615]),
    ):
        stressed = K + fem.geometric_stiffness(structure, share * np.pi**2 * pulled)
        found = natural_modes(K=stressed, M=M, num=2).omega
        np.testing.assert_allclose(found, expected, rtol=1e-3)


def plate(kind, m, load):
    """Simply supported square plate of unit side, `D = 1`; factors over pi^2."""
    x, y = (g.ravel() for g in np.meshgrid(np.linspace(0, 1, m + 1), np.linspace(0, 1, m + 1)))
    number = lambda i, j: j * (m + 1) + i
    squares = [
        (number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)) for j in range(m) for i in range(m)
    ]
    thickness = 0.01
    element = kind(12.0 * (1 - 0.3**2) / thickness**3, 0.3, thickness, 1.0)
    if kind is elements.Triangle:
        squares = [t for a, b, c, d in squares for t in ((a, b, c), (a, c, d))]
    held = {k: "z" for k in range(len(x)) if x[k] in (0, 1) or y[k] in (0, 1)}
    held |= {number(0, 0): "x y z", number(m, 0): "y z"}
    nodal, share = np.zeros((len(x), 6)), np.r_[0.5, np.ones(m - 1), 0.5] / m
    for j, w in enumerate(share):
        if load == "compression":
            nodal[number(0, j), 0] += w
            nodal[number(m, j), 0] -= w
        else:
            nodal[number(m, j), 1] += w
            nodal[number(0, j), 1] -= w
            nodal[number(j, m), 0] += w
            nodal[number(j, 0), 0] -= w
    structure = fem.Structure(np.stack([x, y, 0 * x], axis=1), {"plate": (element, squares)}, held=held)
    return fem.buckling(structure, fem.gather_rows(structure, nodal)).factors[0] / np.pi**2


@pytest.mark.long
@pytest.mark.parametrize("kind", [elements.Quadrilateral, elements.Triangle])
@pytest.mark.parametrize(
    "load, expected", [("compression", 4.0 / (1.0 + 2.0 * np.pi**2 / 3.5e4)), ("shear", 9.324535)]
)
def test_square_plates(kind, load, expected):
    """Timoshenko and Gere (1961), case B6: the error of second order in the size of the elements, extrapolated.

    Compressed by what transverse shear of stiffness 3.5e4 leaves of the load: that of a thin plate is less by 6e-4.
    """
    coarse, fine = plate(kind, 8, load), plate(kind, 16, load)
    np.testing.assert_allclose((4 * fine - coarse) / 3, expected, rtol=1e-2)
    assert abs(fine - expected) < 0.35 * abs(coarse - expected)


def test_a_string_of_rods():
    """Masses on a string under tension: `w_k = 2 sqrt(T / (m h)) sin(k pi / 2 n)` (case B6 with other numbers)."""
    n, tension, mass = 10, 50.0, 0.06
    rod = elements.Rod(1e9, 1e-4, mass * n / 2.0 / 1e-4, lumped=True)
    x = np.linspace(0.0, 2.0, n + 1)
    held = {k: "z" for k in range(n + 1)} | {0: "x y z", n: "x y z"}
    structure = fem.Structure(
        np.stack([x, 0 * x, 0 * x], axis=1), {"rod": (rod, [(k, k + 1) for k in range(n)])}, held=held
    )
    stretched = np.zeros((n + 1, 6))
    stretched[:, 0] = x * tension / (1e9 * 1e-4)
    K, M = fem.assemble_dense(structure)
    stiffness = K + fem.geometric_stiffness(structure, stretched)
    across = [i for i, (_, d) in enumerate(structure.labels) if d == "y"]
    m = np.asarray(M)[across[0], across[0]]
    values = np.linalg.eigvalsh(np.asarray(stiffness)[np.ix_(across, across)]) / m
    k = np.arange(1, n)
    np.testing.assert_allclose(
        np.sqrt(values), 2 * np.sqrt(tension / (m * 0.2)) * np.sin(k * np.pi / 2 / n), rtol=1e-9
    )


@pytest.mark.parametrize("kind", ["Rod", "Beam", "Triangle", "Quadrilateral", "Hexahedron"])
def test_geometric_stiffness_of_every_element(kind):
    """Symmetric, linear in the displacements, and without effort for translations."""
    nodes, element = ELEMENTS[kind]
    random = np.random.default_rng(1)
    u, v = (1e-3 * random.normal(size=(len(nodes), element.coordinates)) for _ in range(2))
    of = jax.jit(lambda nodes, u: element.geometric_stiffness(nodes, u))
    K, both = of(nodes, u), of(nodes, u + 2.0 * v)
    np.testing.assert_allclose(K, K.T, atol=1e-9 * np.abs(K).max())
    np.testing.assert_allclose(both, K + 2.0 * of(nodes, v), atol=1e-9 * np.abs(both).max())
    for axis in np.eye(3):
        shift = np.zeros((len(nodes), element.coordinates))
        shift[:, :3] = axis
        np.testing.assert_allclose(K @ shift.ravel(), 0.0, atol=1e-9 * np.abs(K).max())


ELEMENTS = {
    "Rod": (np.array([[0.0, 0, 0], [1, 2, 0.5]]), elements.Rod(1e5, 1e-2, 1.0)),
    "Beam": (
        np.array([[0.0, 0, 0], [1, 2, 0.5]]),
        elements.Beam(1e5, 4e4, 1e-2, 2e-5, 1e-5, 2e-5, 1.0, reference=(0.0, 0.0, 1.0)),
    ),
    "Triangle": (np.array([[0.0, 0, 0], [1, 0.2, 0], [0.3, 1.1, 0.4]]), elements.Triangle(1e5, 0.3, 0.02, 1.0)),
    "Quadrilateral": (
        np.array([[0.0, 0, 0], [1, 0.2, 0], [1.2, 1.1, 0], [0.1, 0.9, 0]]),
        elements.Quadrilateral(1e5, 0.3, 0.02, 1.0),
    ),
    "Hexahedron": (
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1.1], [1.2, 1, 1], [0, 1, 0.9]]),
        elements.Hexahedron(1e5, 0.3, 1.0),
    ),
}


def test_bad_input():
    with pytest.raises(ValueError, match="rows, got a load of shape"):
        fem.buckling(column({0: "all"}, n=2), np.zeros(3))


@pytest.mark.parametrize(
    ("held", "names"),
    [
        ({}, "'0' x, '0' y"),
        pytest.param({0: "x y z"}, "'0' rx", marks=pytest.mark.long),
        pytest.param({0: "x y z rx", N: "y"}, "'0' ry", marks=pytest.mark.long),
    ],
    ids=["nothing", "a ball", "a hinge"],
)
def test_what_moves_without_strain_is_named(held, names):
    """A column that is free as a body, or turns about its supports, is unstable under any compression."""
    structure = column(held)
    end = np.zeros((structure.num_nodes, 6))
    end[N, 0] = -1.0
    load = fem.gather_rows(structure, end)
    for question in (fem.buckling, lambda structure, load: fem.assemble(structure, preload=load)):
        with pytest.raises(ModelError, match=f"nothing holds {names}.*motions without strain"):
            question(structure, load)
    assert np.isnan(jax.jit(lambda load: fem.buckling(structure, load).factors)(load)).all()


@pytest.mark.long
def test_modes_of_a_structure_under_a_preload():
    """A pinned column under P: `w^2 = w_0^2 (1 - P / P_cr)`, its slope by P, and a load beyond buckling."""
    structure = column({**PLANE, 0: "x y z rx ry", N: "y z rx ry"})
    end = jnp.zeros((structure.num_nodes, 6)).at[N, 0].set(-1.0)

    def squared(P):
        system = fem.assemble(structure, preload=fem.gather_rows(structure, P * end))
        return mbs.modes(system, num=1).values[0]

    free, critical = np.pi**4, np.pi**2
    for P in (-5.0, 0.0, 5.0, 9.0):
        np.testing.assert_allclose(squared(P), free * (1.0 - P / critical), rtol=1e-3)
    np.testing.assert_allclose(jax.jit(jax.grad(squared))(5.0), -free / critical, rtol=1e-3)
    with pytest.raises(mbs.ModelError, match=r"preload: the structure buckles under 0\.98\d* times this load"):
        squared(10.0)
    system = jax.jit(lambda P: fem.assemble(structure, preload=fem.gather_rows(structure, P * end)))(10.0)
    assert bool(mbs.modes(system, num=1).is_unstable)
    with pytest.raises(ValueError, match="a preload needs dense matrices"):
        fem.assemble(structure, blocks=True, preload=fem.gather_rows(structure, end))


def shaft_under_torque(k, turn):
    """Size of the determinant of a shaft on two bearings under the torque `k EI / L`, whose moment turns by a share
    `turn` of the tilt of its end: with the deflection `w = y + i z` zero and `w'' = turn i k w'` at both ends."""
    rows = []
    for x in (0.0, 1.0):
        e = np.exp(1j * k * x)
        rows.append([1, x, x**2, e])
        rows.append([0, -1j * turn * k, 2 - 2j * turn * k * x, (turn - 1) * k**2 * e])
    return abs(np.linalg.det(np.array(rows)))


def test_torque_of_a_shaft_is_semi_tangential():
    """4.911 on two bearings, where Greenhill's axial torque is 2 pi; twice the root of tan x = x between clamps."""
    roots = []
    for turn, low, high in ((0.5, 4.6, 5.2), (0.0, 6.0, 6.6), (1.0, 6.0, 6.6)):
        size = partial(shaft_under_torque, turn=turn)
        roots.append(minimize_scalar(size, bounds=(low, high), method="bounded", options={"xatol": 1e-9}).x)
    np.testing.assert_allclose(roots, [4.911, 2 * np.pi, 2 * np.pi], rtol=1e-4)
    bearings, clamps = {0: "x y z rx", N: "y z"}, {0: "all", N: "y z ry rz"}
    torque = {N: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]}
    np.testing.assert_allclose(factors(column(bearings), torque), roots[:1], rtol=2e-4)
    np.testing.assert_allclose(factors(column(clamps), torque), [8.986818915818128], rtol=2e-4)
