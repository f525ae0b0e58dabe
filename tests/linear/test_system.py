"""Substructures from arrays, sparse matrices and files; what the check finds."""

from io import StringIO

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.io
import scipy.sparse

from jaxmbs.elements import Beam, PointMass, Spring
from jaxmbs.errors import ModelError
from jaxmbs.fem import Structure, assemble
from jaxmbs.io import read_dmig, read_matrix_market, read_op4
from jaxmbs.linear import LinearSystem, block_matrices, check, rigid_motions
from jaxmbs.reductions import CraigBampton, fixed_interface_modes, reduce
from jaxmbs.vibration._mode_shapes import effective_masses

CHAIN = 2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)


def beam(held=None, releases=()):
    """Ten-kilogram beam of five pieces along x from (1, 2, 3); the last two may have a release."""
    element = Beam(2e11, 8e10, 1e-3, 1e-7, 2e-7, 3e-7, 5000.0, reference=(0, 1, 0))
    loose = Beam(2e11, 8e10, 1e-3, 1e-7, 2e-7, 3e-7, 5000.0, reference=(0, 1, 0), releases=releases)
    nodes = np.array([1.0, 2, 3]) + np.linspace(0, 2, 6)[:, None] * np.eye(3)[0]
    pieces = [(i, i + 1) for i in range(5)]
    return Structure(nodes, {"near": (element, pieces[:3]), "far": (loose, pieces[3:])}, held)


def test_from_arrays_and_sparse():
    sparse = scipy.sparse.csr_matrix(CHAIN)
    sub = LinearSystem(
        mass=np.eye(4),
        stiffness=sparse,
        damping=0.1 * CHAIN,
        interface=["tip"],
        coordinates=["a x", "b x", "c x", "tip"],
    )
    assert (sub.interface, sub.interior, sub.label(1), sub.num_rows) == ((3,), (0, 1, 2), "b x", 4)
    np.testing.assert_array_equal(sub.stiffness, CHAIN)
    assert sub.rows("b", ("c", "x")) == (1, 2)
    trace = jax.jit(jax.grad(lambda s: jnp.trace(s.stiffness @ s.mass)))(sub)
    np.testing.assert_array_equal(trace.stiffness, np.eye(4))


@pytest.mark.slow
def test_from_elements():
    damped = {"mount": (Spring((1.0,) * 6, damper=(2.0,) * 6), [("a", "b")]), "mass": (PointMass(1.0), [("b",)])}
    sub = assemble(Structure({"a": (0.0, 0, 0), "b": (0.0, 0, 1)}, damped), interface=["a"])
    assert sub.interface == tuple(range(6)) and sub.damping is not None
    np.testing.assert_allclose(sub.damping, 2 * sub.stiffness)
    assert assemble(beam()).damping is None


FAULTS = [
    (dict(mass=np.eye(3), stiffness=CHAIN), "mass has 3 rows, not 4"),
    (dict(mass=np.ones((2, 3)), stiffness=CHAIN), "mass must be a square matrix, got shape (2, 3)"),
    (
        dict(mass=np.eye(4), stiffness=np.where(CHAIN > 1, np.nan, CHAIN)),
        "stiffness is not finite at row 0, column 0",
    ),
    (dict(mass=np.eye(4), stiffness=CHAIN, interface=["q"]), "there is no coordinate or node 'q'"),
    (dict(mass=np.eye(4), stiffness=CHAIN, interface=[4]), "there is no coordinate or node 4"),
    (dict(mass=np.eye(4), stiffness=CHAIN, interface=[1, 1]), "stands there twice"),
    (dict(mass=np.eye(4), stiffness=CHAIN, coordinates=["a", "b", "b", "c"]), "coordinates named twice: b"),
    (
        dict(mass=np.eye(4), stiffness=CHAIN, coordinates=["a", "b"]),
        "2 coordinates are named, but the matrices have 4",
    ),
    (dict(mass=np.eye(4), stiffness=CHAIN, coordinates=[("a", "up")] * 4), "unknown directions up"),
    (
        dict(mass=np.eye(4), stiffness=CHAIN, coordinates=["a x", "b x", "c", "d"], positions={"a": np.zeros(3)}),
        "positions of nodes are missing: b",
    ),
]


@pytest.mark.parametrize(("given", "message"), FAULTS, ids=[message for _, message in FAULTS])
def test_faults(given, message):
    with pytest.raises(ModelError) as error:
        LinearSystem(**given)
    assert message in str(error.value)


def test_another_damping_is_stored_as_the_first():
    plain = LinearSystem(mass=np.eye(4), stiffness=CHAIN)
    damped = plain.with_damping((0.1 * CHAIN).tolist())
    assert isinstance(damped.damping, jax.Array) and damped.with_damping(None).damping is None
    np.testing.assert_array_equal(damped.damping, 0.1 * CHAIN)
    with pytest.raises(ModelError, match="damping has 3 rows, not 4"):
        plain.with_damping(np.eye(3))
    with pytest.raises(ModelError, match="either all or none of them must be block matrices"):
        plain.with_damping(*block_matrices(CHAIN, size=2))


@pytest.mark.slow
def test_check_of_a_free_beam():
    """Rigid motions, mass properties about a point and about the centre in closed form."""
    report = check(assemble(beam(), interface=["0"]), about=(1.0, 2.0, 3.0), throw=True)
    assert (report.grounded, report.free_motions, report.faults, report.warnings) == ("free", 6, (), ())
    assert np.all(report.rigid_energy < 1e-14)
    np.testing.assert_allclose(report.mass, 10.0, rtol=1e-12)
    np.testing.assert_allclose(report.centre, [2.0, 2.0, 3.0], rtol=1e-12)
    roll = 5000.0 * 3e-7 * 2.0
    np.testing.assert_allclose(report.inertia, np.diag([roll, 40 / 3, 40 / 3]), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(report.central_inertia, np.diag([roll, 10 / 3, 10 / 3]), rtol=1e-9, atol=1e-9)
    assert "mass [kg]" in str(report) and "centre of mass [m]" in str(report)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_check_of_a_reduced_beam_against_pyyeti():
    """Mass properties about the origin and the centre, fixed-interface frequencies, effective masses of `cbcheck`."""
    cb, nastran = pytest.importorskip("pyyeti.cb"), pytest.importorskip("pyyeti.nastran")
    whole, ends = assemble(beam(), interface=["0", "5"]), np.array([[1.0, 2.0, 3.0], [3.0, 2.0, 3.0]])
    reduced = reduce(whole, CraigBampton(6))
    report = check(reduced, throw=True)
    grids = nastran.n2p.addgrid(None, [1, 2], "b", 0, ends, 0)
    M, K = np.asarray(reduced.mass), np.asarray(reduced.stiffness)
    found = cb.cbcheck(StringIO(), M, K, np.arange(12), np.arange(6), grids)
    total = found.rbg.T @ found.m[:12, :12] @ found.rbg
    assert (report.grounded, report.free_motions, report.size) == ("free", 6, 18)
    np.testing.assert_allclose(report.mass, total[0, 0], rtol=1e-9)
    np.testing.assert_allclose(report.centre, [total[1, 5] / 10, total[2, 3] / 10, total[0, 4] / 10], rtol=1e-9)
    np.testing.assert_allclose(report.inertia, total[3:, 3:], rtol=1e-9, atol=1e-8)
    inner, motions = np.array(whole.interior), np.asarray(rigid_motions(whole.positions)).reshape(-1, 6)
    modes = fixed_interface_modes(whole, 6)
    np.testing.assert_allclose(modes.frequencies, found.cb_frq, rtol=1e-9)
    moved = np.asarray(effective_masses(modes, whole.mass[inner], motions))
    shares = 100 * moved / np.diag(motions.T @ np.asarray(whole.mass) @ motions)
    np.testing.assert_allclose(shares, found.effmass_percent, atol=1e-6)


@pytest.mark.slow
def test_check_of_a_held_beam_and_of_its_mechanism():
    held = check(assemble(beam({"0": "all"})))
    assert (held.grounded, held.free_motions, held.faults) == ("held", 0, ())
    assert not any("are strained" in text for text in held.warnings)  # it is supported, and "held" says so
    assert any("mass differs by direction" in text for text in held.warnings)
    loose = assemble(beam({"0": "all"}, releases=("rz1",)))
    report = check(loose)
    assert report.free_motions == 2  # two pieces, each pinned at its first end
    with pytest.raises(ModelError, match="mechanism: a motion without strain that is not rigid, largest at .*rz"):
        check(loose, throw=True)


def test_check_of_matrices_from_elsewhere():
    """Unsymmetric, massless, slack and negative entries are named."""
    crooked = CHAIN.copy()
    crooked[1, 2] *= 1.02
    report = check(LinearSystem(mass=np.diag([1.0, 1, 1, 0]), stiffness=crooked, coordinates=["a", "b", "c", "d"]))
    np.testing.assert_allclose(report.asymmetry["stiffness"], 0.01, rtol=1e-9)
    assert any("unsymmetric by 1.0e-02, most between b and c" in text for text in report.faults)
    assert report.massless == ("d",) and "coordinates without mass: d" in report.warnings
    slack = CHAIN * np.outer([1, 1, 1, 0], [1, 1, 1, 0])
    report = check(LinearSystem(mass=np.diag([1.0, -1, 1, 1]), stiffness=slack))
    assert report.slack == ("3",) and "coordinates without stiffness: 3" in report.warnings
    assert any("mass is negative" in text and "at 1" in text for text in report.faults)
    idle = check(LinearSystem(mass=np.diag([1.0, 1, 1, 0]), stiffness=slack))
    assert "coordinates with neither mass nor stiffness: 3" in idle.faults
    with pytest.raises(ModelError, match="stiffness is negative"):
        check(LinearSystem(mass=np.eye(4), stiffness=CHAIN - 2 * np.diag([0, 0, 0, 1.0])), throw=True)


@pytest.mark.slow
def test_check_finds_a_spring_to_ground():
    """A soft spring to ground on one rotation is named by the energy of the rigid motions."""
    sub = assemble(beam())
    K = np.asarray(sub.stiffness).copy()
    row = sub.rows(("4", "rz"))[0]
    K[row, row] *= 1.001
    report = check(
        LinearSystem(mass=sub.mass, stiffness=K, coordinates=sub.coordinates, positions=(sub.nodes, sub.positions))
    )
    assert report.grounded == "held in part"
    assert any("rz are strained, most at 4 rz" in text for text in report.warnings)


def test_matrix_market(tmp_path):
    for name, matrix in (("m", np.eye(4)), ("k", scipy.sparse.coo_matrix(CHAIN))):
        scipy.io.mmwrite(tmp_path / f"{name}.mtx", matrix)
    sub = read_matrix_market(tmp_path / "m.mtx", tmp_path / "k.mtx", interface=[3])
    np.testing.assert_array_equal(sub.stiffness, CHAIN)
    assert sub.interface == (3,)


def test_scikit_fem():
    """Its sparse matrices as they are: a block of bricks has six motions without strain and its mass."""
    skfem = pytest.importorskip("skfem")
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh = skfem.MeshHex.init_tensor(np.linspace(0, 2, 3), np.linspace(0, 1, 2), np.linspace(0, 1, 2))
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=3)
    K = linear_elasticity(*lame_parameters(1e3, 0.3)).assemble(basis)

    @skfem.BilinearForm
    def inertia(u, v, w):
        return 3.0 * sum(u[d] * v[d] for d in range(3))

    labels = [(str(n), d) for n in range(mesh.p.shape[1]) for d in "xyz"]
    positions = {str(n): mesh.p[:, n] for n in range(mesh.p.shape[1])}
    report = check(
        LinearSystem(mass=inertia.assemble(basis), stiffness=K, coordinates=labels, positions=positions), throw=True
    )
    assert (report.grounded, report.free_motions) == ("free", 6)
    np.testing.assert_allclose(report.mass, 6.0, rtol=1e-12)
    np.testing.assert_allclose(report.centre, [1.0, 0.5, 0.5], rtol=1e-12)


def test_nastran_files(tmp_path):
    """OP4 and DMIG written by pyYeti."""
    nastran = pytest.importorskip("pyyeti.nastran")
    pandas = pytest.importorskip("pandas")
    nastran.op4.write(str(tmp_path / "a.op4"), {"mxx": np.eye(4), "kxx": CHAIN})
    np.testing.assert_allclose(read_op4(tmp_path / "a.op4").stiffness, CHAIN, rtol=1e-9)
    with pytest.raises(ModelError, match="no matrix 'kgg': it has kxx, mxx"):
        read_op4(tmp_path / "a.op4", stiffness="kgg")
    rows = pandas.MultiIndex.from_tuples([(1, 1), (1, 6), (7, 3), (9, 0)], names=["id", "dof"])
    frames = {name: pandas.DataFrame(a, rows, rows) for name, a in (("maax", np.eye(4)), ("kaax", CHAIN))}
    nastran.bulk.wtdmig(str(tmp_path / "a.pch"), frames)
    sub = read_dmig(tmp_path / "a.pch", interface=["1"])
    np.testing.assert_allclose(sub.stiffness, CHAIN, rtol=1e-9)
    assert sub.coordinates == (("1", "x"), ("1", "rz"), ("7", "z"), ("9", "")) and sub.interface == (0, 1)


@pytest.mark.slow
@pytest.mark.parametrize("even", [True, False])
def test_sparse_matrix_as_blocks(even):
    """A random sparse matrix in blocks of three: equal to itself, added to another, its symmetry noticed."""
    rng = np.random.default_rng(4)
    A = scipy.sparse.random(30, 30, 0.1, random_state=rng, format="csr")
    A = (A + A.T if even else A) + 10 * scipy.sparse.eye(30)
    blocks, one = block_matrices(A, scipy.sparse.eye(30), size=3)
    assert blocks.is_symmetric is even
    np.testing.assert_array_equal((blocks + 2.0 * one).to_dense(), A.toarray() + 2 * np.eye(30))
    b = rng.normal(size=(10, 3))
    np.testing.assert_allclose(blocks @ jnp.asarray(b), (A @ b.ravel()).reshape(10, 3), atol=1e-13)
    with pytest.raises(ValueError, match="blocks of 7"):
        block_matrices(A, size=7)


def test_check_of_negative_stiffness_is_not_free():
    """A point on springs that push gives energy back where it moves."""
    names = [("p", d) for d in ("x", "y", "z")]
    point = LinearSystem(
        mass=np.eye(3), stiffness=-2.0 * np.eye(3), coordinates=names, positions={"p": (0.0, 0.0, 0.0)}
    )
    report = check(point)
    assert report.grounded == "unstable" and str(report).count("unstable") == 1
    assert any("stiffness is negative" in text for text in report.faults)
