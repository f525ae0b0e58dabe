"""Meshes of Gmsh and scikit-fem: mass and volume of distorted meshes, a plate's frequencies, sets by name."""

import jax
import numpy as np
import pytest
import scipy.linalg

from jaxmbs import fem
from jaxmbs.elements import Hexahedron, Quadrilateral, Triangle
from jaxmbs.errors import ModelError, UnknownNameError
from jaxmbs.io import Mesh, read_mesh
from tests.adversary.test_spoilt_decks import MSH2, MSH4

meshio, skfem = pytest.importorskip("meshio"), pytest.importorskip("skfem")
assembled = jax.jit(fem.assemble_dense)


@pytest.mark.parametrize(("text", "kind"), [pytest.param(MSH4, "quad", marks=pytest.mark.slow), (MSH2, "triangle")])
def test_physical_groups_are_sets(text, kind, tmp_path):
    """A square of area 1 by both versions of the format; the set of its edge is an interface."""
    (tmp_path / "mesh.msh").write_text(text)
    mesh = read_mesh(tmp_path / "mesh.msh")
    assert mesh.nodes("edge") == [0, 1] and mesh.nodes("skin") == [0, 1, 2, 3] and set(mesh.cells) == {"line", kind}
    shells = Quadrilateral(2e11, 0.3, 0.01, 7850.0), Triangle(2e11, 0.3, 0.01, 7850.0)
    structure = mesh.structure({"skin": shells[kind == "triangle"]}, held={"edge": "x y", "skin": "z"})
    system = fem.assemble(structure, interface=mesh.nodes("edge"))
    assert [system.label(row) for row in system.interface] == [f"{n} {d}" for n in (0, 1) for d in ("rx", "ry", "rz")]
    load = np.asarray(fem.body_load(structure, (1.0, 0.0, 0.0)))
    np.testing.assert_allclose(load[:, 0].sum(), 0.01 * 7850.0, rtol=1e-12)
    with pytest.raises(UnknownNameError, match="did you mean 'edge'"):
        mesh.nodes("edges")
    with pytest.raises(ModelError, match=f"no element for its cells of kind '{kind}'"):
        mesh.structure({"skin": shells[kind != "triangle"]})


def test_plate_of_scikit_fem():
    """A simply supported square plate: pi^2 / a^2 sqrt(D / rho t) (m^2 + n^2) / 2 pi, its edge named there."""
    along = np.linspace(0, 1, 15)
    source = skfem.MeshQuad.init_tensor(along, along)
    mesh = read_mesh(source.with_boundaries({"rim": lambda x: (x[0] * (1 - x[0]) * x[1] * (1 - x[1])) < 1e-9}))
    mesh.node_sets["all"] = np.arange(len(mesh.points))
    E, nu, t, rho = 2e11, 0.3, 0.01, 7850.0
    structure = mesh.structure(Quadrilateral(E, nu, t, rho), held={"rim": "z", "all": "x y rz"})
    K, M = map(np.asarray, assembled(structure))
    found = np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True, subset_by_index=[0, 3])) / (2 * np.pi)
    unit = np.pi / 2 * np.sqrt(E * t**3 / 12 / (1 - nu**2) / (rho * t))
    np.testing.assert_allclose(found / unit, [2, 5, 5, 8], rtol=0.03)


def test_solids_of_scikit_fem():
    """Volume and centre of a block of distorted bricks; its order of nodes is not ours."""
    source = skfem.MeshHex().refined(1)
    p = source.p.copy()
    p[:, np.all(np.abs(p - 0.5) < 1e-9, axis=0)] += 0.07
    source = skfem.MeshHex(p * np.array([[2.0], [1.0], [3.0]]), source.t).with_subdomains(
        {"low": lambda x: x[2] < 1.5}
    )
    mesh = read_mesh(source)
    weights = [
        np.asarray(fem.body_load(mesh.structure(elements), (0.0, 0.0, 1.0)))[:, 2]
        for elements in (Hexahedron(1.0, 0.3, 5.0), {"low": Hexahedron(1.0, 0.3, 5.0)})
    ]
    np.testing.assert_allclose(weights[0].sum(), 30.0, rtol=1e-12)
    np.testing.assert_allclose(weights[1].sum(), 15.0, rtol=0.1)
    assert set(np.flatnonzero(weights[1])) == set(mesh.nodes("low"))


def test_what_has_no_element_is_refused():
    """Tetrahedra, and meshes of nothing that we know."""
    tetra = read_mesh(skfem.MeshTet())
    with pytest.raises(ModelError, match="no element for its cells of kind 'tetra'"):
        tetra.structure(Hexahedron(1.0, 0.3))
    mixed = Mesh(np.eye(4, 3), {"triangle": np.array([[0, 1, 2]]), "quad": np.array([[0, 1, 2, 3]])})
    with pytest.raises(ModelError, match="kind 'triangle'"):
        mixed.structure(Quadrilateral(1.0, 0.3, 1.0))
    with pytest.raises(ModelError, match="name nodes that are not there"):
        read_mesh(meshio.Mesh(np.zeros((2, 3)), [("line", np.array([[0, 5]]))]))
    with pytest.raises(TypeError, match="a mesh is the path"):
        read_mesh(7)


def test_sets_of_meshio():
    """Node sets and cell sets of a mesh made by hand, triangles beside quadrilaterals in one set."""
    cells = [("quad", np.array([[0, 1, 2, 3]])), ("triangle", np.array([[1, 4, 2]]))]
    points = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [2, 0]])
    sets = {"skin": [np.array([0]), np.array([0])]}
    mesh = read_mesh(meshio.Mesh(points, cells, cell_sets=sets, point_sets={"tip": np.array([4])}))
    shells = [Quadrilateral(1.0, 0.3, 1.0, 2.0), Triangle(1.0, 0.3, 1.0, 2.0)]
    structure = mesh.structure({"skin": shells}, held={"tip": "all"})
    assert set(structure.groups) == {"skin quad", "skin triangle"} and mesh.nodes("tip") == [4]
    np.testing.assert_allclose(np.asarray(fem.body_load(structure, (0.0, 1.0, 0.0)))[:, 1].sum(), 3.0)
