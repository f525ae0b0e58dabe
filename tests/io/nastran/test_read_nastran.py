"""Decks against Nastran's own answers, closed forms, and differences; pyYeti's test files (BSD-3) hold the former."""

import shutil
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs import fem, linear
from jaxmbs.errors import ModelError
from jaxmbs.io import read_nastran, read_op4
from jaxmbs.io.nastran._ignored_cards import HARMLESS
from tests.io.zoo_of_cards import ZOO

BAR = "MAT1,1,2.+11,8.+10,,7850.\nPBAR,1,1,1.-3,2.-7,1.-7,3.-7\n"


def deck(text, folder, masses="consistent"):
    (folder / "deck.bdf").write_text(text)
    return read_nastran(folder / "deck.bdf", masses=masses)


@jax.jit
def matrices(model):
    system = model.system
    return system.stiffness, system.mass


def frequencies(model):
    """[Hz], ascending; coordinates without mass have none."""
    K, M = map(np.asarray, matrices(model))
    shift = 1e-2 * np.trace(K) / np.trace(M)
    inverse = scipy.linalg.eigh(M, K + shift * M, eigvals_only=True)[::-1]
    inverse = inverse[inverse > 1e-14 * inverse[0]]
    return np.sqrt(np.maximum(1 / inverse - shift, 0.0)) / (2 * np.pi)


@pytest.fixture(scope="module")
def theirs():
    pyyeti = pytest.importorskip("pyyeti")
    folder = Path(pyyeti.__file__).parent / "tests"
    if not (folder / "nastran_gm_data").exists():
        pytest.skip("pyYeti without its test files")
    return folder


@pytest.mark.long
def test_space_station_truss_against_nastran(theirs, tmp_path):
    """S14 whole, 40 nodes and 117 bars in two files: 52 frequencies that Nastran found, one half of it reduced."""
    from pyyeti.nastran import op2

    folder = theirs / "cla_test_data"
    for name in ("inboard.blk", "outboard.blk"):
        shutil.copy(folder / name, tmp_path)
    (tmp_path / "deck.bdf").write_text("INCLUDE 'inboard.blk'\nINCLUDE 'outboard.blk'\n")
    model = read_nastran(tmp_path / "deck.bdf", polar=False, masses="consistent")
    data = op2.rdnas2cam(str(folder / "nas2cam"))
    exact = np.sqrt(data["lambda"][0][6 : int(data["rfmodes"][0][0])]) / (2 * np.pi)
    found = frequencies(model)
    assert len(model.names) == 48 and np.all(found[:6] < 1e-4)
    np.testing.assert_allclose(found[6:16], exact[:10], rtol=5e-7)
    assert np.all(found[6:26] < exact[:20] * (1 + 1e-7))  # its payload has 22 modes of many


@pytest.mark.long
def test_half_of_the_truss_on_its_interface(theirs):
    """What Nastran condensed on four nodes, one in a frame of its own: stiffness, rigid mass, 16 fixed modes."""
    folder = theirs / "cla_test_data"
    system = read_nastran(folder / "outboard.blk", polar=False, masses="consistent").assemble(
        interface=["GRID 3", "GRID 11", "GRID 19", "GRID 27"]
    )
    exact = read_op4(folder / "outboard.op4")
    K, M, Ke, Me = map(np.asarray, (system.stiffness, system.mass, exact.stiffness, exact.mass))
    outer, inner = np.array(system.interface), np.array(system.interior)
    T = np.zeros((len(K), 24))
    T[outer], T[inner] = np.eye(24), -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, outer)])
    T[:, 6:12] = T[:, 6:12].reshape(-1, 2, 3)[:, :, [1, 2, 0]].reshape(-1, 6)  # frame 10: its x y z are y z x
    np.testing.assert_allclose(T.T @ K @ T, Ke[:24, :24], rtol=0, atol=1e-8 * np.abs(Ke[:24, :24]).max())
    rigid = np.asarray(linear._rigid_motions.rigid_rows(system))[outer]
    rigid[6:12] = rigid[6:12].reshape(2, 3, 6)[:, [1, 2, 0]].reshape(6, 6)
    body = rigid.T @ T.T @ M @ T @ rigid
    np.testing.assert_allclose(body, rigid.T @ Me[:24, :24] @ rigid, rtol=0, atol=1e-7 * np.abs(body).max())
    fixed = scipy.linalg.eigh(M[np.ix_(inner, inner)], K[np.ix_(inner, inner)], eigvals_only=True)[::-1]
    np.testing.assert_allclose(1 / fixed[:16], np.diag(Ke)[24:40] / np.diag(Me)[24:40], rtol=5e-7)


@pytest.mark.long
@pytest.mark.parametrize("case", [pytest.param("4", marks=pytest.mark.long), "1", "3", "um_1", "um_2", "um_3"])
def test_rbe3_against_nastran(case, theirs, tmp_path):
    """The matrix of dependent by independent directions, nodes in nine nested coordinate systems of all kinds."""
    from scipy.io import loadmat

    name = f"make_gm_nx9_rbe3_{case}"
    model = read_nastran(theirs / "nastran_gm_data" / f"{name}.dat")
    exact = loadmat(theirs / "nastran_gm_data" / f"{name}.mat")["gm"][0][0][0]
    column = {pair: k for k, pair in enumerate(model.coordinates.free)}
    dependent, given = model.coordinates.tied(model.positions, column)
    others = [(n, d) for n in range(len(model.names)) for d in range(6) if (n, d) not in dependent]
    found = np.zeros(exact.shape)
    rows = np.array([sorted(dependent).index(pair) for pair in dependent])
    found[np.ix_(rows, [others.index(pair) for pair in model.coordinates.free])] = given
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-7 * np.max(np.abs(exact)))


@pytest.mark.long
def test_mass_properties_against_nastran(theirs):
    """CBEAM, CONM2 with inertia, PARAM WTMASS: mass, centre, inertia of the grid point weight generator."""
    from pyyeti.nastran import op2

    folder = theirs / "nastran_op2_data"
    model, exact = read_nastran(folder / "rdop2gpwg_1.dat"), op2.OP2(str(folder / "rdop2gpwg_1.op2")).rdop2gpwg()
    found = linear.check(model.system, about=np.zeros(3))
    weight = 0.00259  # its table is in units of weight, and in single precision
    np.testing.assert_allclose(found.mass / weight, exact["mass"], rtol=1e-6)
    np.testing.assert_allclose(found.centre, exact["cg"], rtol=1e-6)
    np.testing.assert_allclose(found.inertia / weight, exact["m66"][3:, 3:], rtol=2e-4, atol=1e-3)


@pytest.mark.long
def test_zoo_of_cards(tmp_path):
    """Every card that is read: symmetric matrices, total mass by hand, no stiffness against rigid motions."""
    frame = deck(ZOO["frame"], tmp_path)
    K, M = map(np.asarray, matrices(frame))
    np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-6 * np.abs(K).max())
    assert np.linalg.eigvalsh(M).min() > -1e-9 and np.linalg.eigvalsh(K).min() > -1e-6 * np.abs(K).max()
    assert frame.coordinates.turned and set(frame.coordinates.ties) == {"MPC 1", "RBE2 21"}
    plate = deck(ZOO["plate"].replace("SPC1", "$"), tmp_path)
    motion = np.zeros((len(plate.coordinates.free), 3))
    for row, (_, direction) in enumerate(plate.system.coordinates):
        if direction in ("x", "y", "z"):
            motion[row, "xyz".index(direction)] = 1.0
    K, M = map(np.asarray, matrices(plate))
    mass = 7850.0 * (1 + 2 * 0.01) + 100.0
    np.testing.assert_allclose(K @ motion, 0.0, atol=1e-6 * np.abs(K).max())
    np.testing.assert_allclose(motion.T @ M @ motion, mass * np.eye(3), rtol=1e-12, atol=1e-9)


@pytest.mark.long
def test_rigid_body_is_a_beam_with_an_offset(tmp_path):
    """RBE2 and the offsets of CBAR say the same; a node that only the RBE2 joins moves as it must."""
    held = "SPC1,1,123456,1\n"
    grids = "GRID,1\nGRID,2,,1.,0.,0.\nGRID,3,,1.,.3,.2\n"
    by_offset = deck(BAR + grids + "CBAR,1,1,1,3,0.,1.,0.\n,,,0.,0.,0.,0.,-.3,-.2\nCONM2,2,3,,50.\n" + held, tmp_path)
    tied = deck(BAR + grids + "CBAR,1,1,1,2,0.,1.,0.\nCONM2,2,3,,50.\nRBE2,5,3,123456,2\n" + held, tmp_path)
    assert tied.system.coordinates == tuple(("GRID 3", d) for d in ("x", "y", "z", "rx", "ry", "rz"))
    for a, b in zip(matrices(by_offset), matrices(tied), strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-9 * np.abs(a).max())
    u = tied.displacements(jnp.arange(6.0))
    np.testing.assert_allclose(u[1, :3], u[2, :3] + jnp.cross(u[2, 3:], tied.positions[1] - tied.positions[2]))
    np.testing.assert_allclose(u[1, 3:], u[2, 3:])


@pytest.mark.long
def test_spring_on_an_incline(tmp_path):
    """A mass held across a turned frame slides along it: sqrt(k cos^2 / m); AUTOSPC holds what has no stiffness."""
    angle = 0.4
    c, s = np.cos(angle), np.sin(angle)
    text = f"GRID,1\nGRID,2,,1.,0.,0.,5\nCORD2R,5,,0.,0.,0.,0.,0.,1.\n,{c:.15g},{s:.15g},0.\nCONM2,1,2,,3.\n"
    model = deck(
        text + "CELAS2,2,700.,2,1\nMAT1,1,1.,,.3\nPROD,1,1,100.\nCROD,3,1,1,2\nSPC1,1,2,2\nSPC1,1,123,1\n", tmp_path
    )
    assert model.weak == ("GRID 2 z", "GRID 2 rx", "GRID 2 ry", "GRID 2 rz")
    assert model.system.coordinates == (("GRID 2, 1 of frame 5", ""),)
    np.testing.assert_allclose(frequencies(model), np.sqrt((700.0 + 100.0 * c**2) / 3.0) / (2 * np.pi), rtol=1e-12)
    u = model.displacements(jnp.ones(1))
    np.testing.assert_allclose(u[1], [c, s, 0, 0, 0, 0], atol=1e-12)
    times = model.displacements(np.array([[[1.0], [2.0j]]]))
    np.testing.assert_allclose(times[0, 1], 2.0j * np.asarray(u), atol=1e-12)
    with pytest.raises(ValueError, match="have shape"):
        model.displacements(jnp.ones(2))


@pytest.mark.long
def test_gear_of_two_masses(tmp_path):
    """MPC u1 = 3 u2 in a cylindrical frame: k / (m2 + 9 m1), and a ring of ties is refused."""
    text = "CORD2C,1,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRID,1,1,1.,90.,0.,1\nGRID,2,1,1.,0.,0.,1\nCELAS2,1,800.,2,2\n"
    text += "CONM2,2,1,,2.\nCONM2,3,2,,5.\nSPC1,7,13456,1,2\nMPC,8,1,2,-1.,2,2,3.\n"
    np.testing.assert_allclose(frequencies(deck(text, tmp_path)), np.sqrt(800.0 / 23.0) / (2 * np.pi), rtol=1e-12)
    with pytest.raises(ModelError, match="GRID 1, direction 2: depends on MPC 1 and on MPC 2"):
        deck(text + "MPC,8,1,2,1.,2,2,1.\n", tmp_path)
    with pytest.raises(ModelError, match="in a cycle"):
        deck(text + "MPC,8,2,2,3.,1,2,-1.\n", tmp_path)


PLATE = (
    BAR
    + "PSHELL,2,1,.02,1,,1,,4.\n"
    + "".join(f"GRID,{1 + i + 3 * j},,{0.5 * i},{0.4 * j},{0.05 * i * j}\n" for i in range(3) for j in range(3))
)
CORNERS = [(1 + i + 3 * j) for j in range(2) for i in range(2)]
PLATE += "".join(f"CQUAD4,{k},2,{a},{a + 1},{a + 4},{a + 3}\n" for k, a in enumerate(CORNERS, start=1))
PLATE += "GRID,10,,1.6,.5,.1\nRBE3,30,,10,123456,1.,123,3,5\n,9\nCONM2,40,10,,20.,.1,.2,0.\n,.5,,.5,,,.5\n"
PLATE += "SPC1,1,123456,1,4,7\nCBAR,50,1,3,9,0.,0.,1.\nCELAS2,60,1.+5,6,3\n"
LEAVES = {
    "thickness": lambda d: d.properties["PSHELL 2"].thickness,
    "young": lambda d: d.materials["MAT1 1"].young,
    "density": lambda d: d.materials["MAT1 1"].density,
    "section": lambda d: d.properties["PBAR 1"].inertia_1,
    "mass": lambda d: d.elements["CONM2 with inertia"].mass,
    "rate": lambda d: d.elements["CELAS2 to ground"].rate,
    "positions": lambda d: d.positions,
}


@pytest.mark.long
def test_gradients_by_every_number(tmp_path):
    """The lowest eigenvalues by thickness, E, rho, section, masses, springs, nodes: against differences."""
    model = deck(PLATE, tmp_path)
    free = matrices(model)
    _, shapes = scipy.linalg.eigh(*map(np.asarray, free), subset_by_index=[0, 2])
    shapes = jnp.asarray(shapes)

    @jax.jit
    def energy(model):
        K, M = matrices(model)
        return jnp.sum(shapes * (K @ shapes)) + 1e3 * jnp.sum(shapes * (M @ shapes))

    slope = jax.jit(jax.grad(energy))(model)
    forward = jax.jit(lambda at, along: jax.jvp(energy, (at,), (along,))[1])
    chance = np.random.default_rng(0)
    for name, leaf in LEAVES.items():
        value = np.asarray(leaf(model))
        step = 1e-6 * np.abs(value).max() * chance.normal(size=value.shape)
        ends = [energy(eqx.tree_at(leaf, model, jnp.asarray(value + sign * step))) for sign in (1, -1)]
        found = np.sum(np.asarray(leaf(slope)) * step)
        np.testing.assert_allclose(found, (ends[0] - ends[1]) / 2, rtol=2e-4, err_msg=name)
        tangent = eqx.tree_at(leaf, jax.tree.map(jnp.zeros_like, model), jnp.asarray(step))
        np.testing.assert_allclose(forward(model, tangent), found, rtol=1e-8, err_msg=name)
        assert found != 0, name


@pytest.mark.long
def test_deck_answers_the_questions_of_a_structure(tmp_path):
    """Interface by name, check, modes, blocks where nothing is tied, forces of elements, a description."""
    text = BAR + "".join(f"GRID,{k + 1},,{0.5 * k},0.,0.\n" for k in range(5))
    text += "".join(f"CBAR,{k},1,{k},{k + 1},0.,1.,0.\n" for k in range(1, 5))
    text += "SPC1,1,123456,1\nFORCE,1,5,,1.,0.,1.\n"
    model = deck(text, tmp_path)
    system = model.assemble(interface=["GRID 5"])
    assert [system.label(row) for row in system.interface][:2] == ["GRID 5 x", "GRID 5 y"]
    assert not mbs.check(system).faults
    rest = mbs.equilibrium(system, {"GRID 5 y": 7.0})
    np.testing.assert_allclose(rest.displacement[system.rows("GRID 5 y")[0]], 7.0 * 8 / (3 * 2e11 * 2e-7), rtol=1e-8)
    forces = fem.element_forces(model.structure, model.displacements(rest.displacement))["CBAR 1"]
    np.testing.assert_allclose(forces[0, [1, 5]], [-7.0, -14.0], rtol=1e-8)
    blocks = model.assemble(blocks=True).to_dense()
    rows = np.array(blocks.rows(*[system.label(k) for k in range(system.num_rows)]))
    np.testing.assert_allclose(np.asarray(blocks.stiffness)[np.ix_(rows, rows)], system.stiffness, rtol=1e-12)
    assert model.elements["CBAR 1"].ids == (1, 2, 3, 4)
    assert model.describe().splitlines() == [
        "5 nodes, 24 free coordinates",
        "CBAR 1: 4 elements",
        "note: masses are consistent, as Nastran's are with PARAM COUPMASS 1; masses='lumped' takes the others",
        "ignored: FORCE: deck.bdf:13",
    ]


@pytest.mark.long
def test_rigid_body_in_turned_frames(tmp_path):
    """Frames of displacement change names, not the structure: all frequencies of a tied frame stay."""
    text = BAR + "GRID,1\nGRID,2,,1.,0.,0.{0}\nGRID,3,,1.,.3,.2{0}\nCBAR,1,1,1,2,{1}\nRBE2,5,3,123456,2\n"
    text += "CONM2,2,3,,50.,.1,.2,.05\n,1.,,2.,,,3.\nSPC1,1,123456,1\nCORD2C,4,,.3,.1,0.,.5,.2,1.\n,2.,.4,.1\n"
    plain = frequencies(deck(text.format("", "0.,1.,0."), tmp_path))
    turned = deck(text.format(",4", "0.,1.,0."), tmp_path)
    assert turned.system.coordinates[0] == ("GRID 3, 1 of frame 4", "")
    np.testing.assert_allclose(frequencies(turned), plain, rtol=1e-9)


@pytest.mark.slow
def test_mass_with_products_of_inertia(tmp_path):
    """CONM2 takes off-diagonal terms as products of inertia, whose signs the tensor reverses; CID turns them."""
    text = (
        BAR
        + "GRID,1\nGRID,2,,1.,0.,0.\nCBAR,1,1,1,2,0.,1.,0.\nSPC1,1,123456,1\nCORD2R,5,,0.,0.,0.,1.,0.,0.\n,0.,1.,0.\n"
    )
    text += "CONM2,9,2,{},7.,.1,.2,.3\n,4.,.5,5.,.6,.7,6.\n"
    for frame, turn in (("", np.eye(3)), ("5", np.eye(3)[[1, 2, 0]])):
        model = deck(text.format(frame), tmp_path)
        c, I = turn.T @ [0.1, 0.2, 0.3], np.array([[4.0, -0.5, -0.6], [-0.5, 5.0, -0.7], [-0.6, -0.7, 6.0]])
        about = turn.T @ I @ turn + 7.0 * (c @ c * np.eye(3) - np.outer(c, c))
        light = deck(text.split("CONM2")[0], tmp_path)
        found = np.asarray(matrices(model)[1]) - np.asarray(matrices(light)[1])
        np.testing.assert_allclose(found[3:, 3:], about, rtol=1e-9)


@pytest.mark.long
def test_mass_that_is_no_structure(tmp_path):
    """NSM of bars, rods and plates, times WTMASS; the inertia of a CBAR about its axis, and none without `polar`."""
    text = "MAT1,1,2.+11,,.3,7850.\nGRID,1\nGRID,2,,2.,0.,0.\nGRID,3,,2.,1.,0.\nGRID,4,,0.,1.,0.\nPARAM,WTMASS,.5\n"
    text += "PBAR,1,1,1.-3,2.-7,1.-7,3.-7,3.\nCBAR,1,1,1,2,0.,1.,0.\nPROD,2,1,2.-3,,,4.\nCROD,2,2,2,3\n"
    text += "PSHELL,3,1,.01,1,,1,,5.\nCQUAD4,3,3,1,2,3,4\n"
    exact = 0.5 * (2 * (7.85 + 3.0) + (2 * 7.85 + 4.0) + 2 * (78.5 + 5.0))
    np.testing.assert_allclose(linear.check(deck(text, tmp_path).system).mass, exact, rtol=1e-9)
    bar = BAR + "GRID,1\nGRID,2,,2.,0.,0.\nCBAR,1,1,1,2,0.,1.,0.\nSPC1,1,123456,1\n"
    np.testing.assert_allclose(matrices(deck(bar, tmp_path))[1][3, 3], 7850.0 * 3e-7 * 2 / 3, rtol=1e-9)
    light = read_nastran(tmp_path / "deck.bdf", polar=False, masses="consistent")
    assert light.massless == (3,) and matrices(light)[1][3, 3] == 0


@pytest.mark.long
def test_springs_and_bushes(tmp_path):
    """CELAS2 between turned directions, CELAS1, a grounded and a free CBUSH with dampers, by hand."""
    text = "CORD2R,5,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\nGRID,1,,0.,0.,0.,,13456\nGRID,2,,3.,0.,0.,5,23456\n"
    text += "CELAS2,1,700.,1,2,2,1\nPELAS,2,50.\nCELAS1,2,2,1,2\nPBUSH,3,K,90.,80.\n,,B,9.\nCBUSH,3,3,2,,,,,5\n"
    model = deck(text + "CONM2,7,1,,1.\nCONM2,8,2,,1.\n", tmp_path)
    system = model.system
    assert system.coordinates == (("GRID 1", "y"), ("GRID 2, 1 of frame 5", ""))
    np.testing.assert_allclose(system.stiffness, [[750.0, -700.0], [-700.0, 790.0]], rtol=1e-12)
    np.testing.assert_allclose(system.damping, [[0.0, 0.0], [0.0, 9.0]], rtol=1e-12)
    between = "GRID,1\nGRID,2,,0.,2.,0.\nPBUSH,3,K,90.,80.,70.\nCBUSH,3,3,1,2,0.,0.,1.\nSPC1,1,456,2\n"
    found = deck(between + "CONM2,8,2,,1.\nSPC1,1,123456,1\n", tmp_path).system
    np.testing.assert_allclose(found.stiffness, np.diag([70.0, 90.0, 80.0]), atol=1e-12)  # x along y, y along z


@pytest.mark.slow
def test_places_in_coordinate_systems(tmp_path):
    """CORD1S on three nodes, one of which stands in a cylindrical system behind it in the deck; GRDSET; by hand."""
    text = "GRID,4,1,2.,90.,90.\nCORD1S,1,1,2,3\nGRID,1,5,1.,90.,0.\nGRID,2,,0.,1.,3.\nGRID,3,,7.,1.,0.\n"
    text += "CORD2C,5,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRDSET,,,,,,5,456\nELEMENTS\n"
    text = text.replace("ELEMENTS", "MAT1,1,1.,,.3\nPROD,1,1,1.\nCROD,1,1,1,4\nCROD,2,1,2,3")
    model = deck(text, tmp_path)
    np.testing.assert_allclose(model.positions[0], [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(model.positions[3], [0.0, 3.0, 0.0], atol=1e-15)  # theta from z, phi from x
    assert [name for name in model.held if name.startswith("GRID 4")] == ["GRID 4 rx", "GRID 4 ry", "GRID 4 rz"]
    assert model.weak  # each rod holds one direction only


def test_planar_truss_keeps_its_plane(tmp_path):
    """A tilted triangle of rods, 9 directions, 3 stiff: AUTOSPC holds what no rod stiffens, in basic axes."""
    text = "MAT1,1,2.+11,,.3,7850.\nPROD,1,1,1.-4\nGRID,1\nGRID,2,,1.,0.,0.\nGRID,3,,.5,.6,.8\n"
    text += "CROD,1,1,1,2\nCROD,2,1,2,3\nCROD,3,1,3,1\n"
    model = deck(text, tmp_path)
    assert model.weak == ("GRID 1 y", "GRID 2 y", "GRID 3 y")
    free = deck(text + "PARAM,AUTOSPC,NO\n", tmp_path)
    assert len(free.coordinates.free) == 9 and not free.weak


CASE = "SOL 101\nCEND\n{}\nBEGIN BULK\n"


def test_case_control_decides_autospc_and_supports(tmp_path):
    """AUTOSPC there stands over PARAM; a set that acts though none is chosen is told, as Nastran takes none."""
    text = "MAT1,1,2.+11,,.3,7850.\nPROD,1,1,1.-4\nGRID,1\nGRID,2,,1.,0.,0.\nCROD,1,1,1,2\nSPC1,4,123456,1\n"
    counts = [
        len(deck(CASE.format(f"SPC = 4\nAUTOSPC{own}") + text, tmp_path).weak) for own in ("(NOPRINT) = NO", "=YES")
    ]
    assert counts == [0, 2]
    assert not any("acts" in note for note in deck(CASE.format("SPC = 4") + text, tmp_path).notes)
    assert not any("acts" in note for note in deck(text, tmp_path).notes)
    told = deck(CASE.format("DISPLACEMENT = ALL") + text, tmp_path)
    assert any(note.startswith("SPC 4 acts, the only one") for note in told.notes) and len(told.coordinates.free) == 1


@pytest.mark.parametrize(
    ("cards", "fault"),
    [
        ("PBARL,1,1,,ROD\n,.01\nCBAR,2,1,2,1,0.,1.,0.\n", "CBAR 1 .*PBAR 1 and PBARL 1 have the same number"),
        ("MAT8,1,1.+11,1.+10,.3,5.+9\nPSHELL,7,1,.1\n", "PSHELL 7 .*MAT1 1 and MAT8 1 have the same number"),
    ],
)
def test_numbers_that_name_two_things(cards, fault, tmp_path):
    """One fault for all that refer to them."""
    with pytest.raises(ModelError, match=fault) as error:
        deck(BAR + FREE + cards, tmp_path)
    assert len(error.value.faults) == 1


def test_fields_that_change_answers_and_are_read_over_are_noted(tmp_path):
    """Mean normals of shells, integration of solids; a beam without shear modulus has no torsion to stiffen."""
    noted = deck(BAR + FREE + "PARAM,SNORM,20.\nPSOLID,5,1,,TWO,,FULL\nPSOLID,6,1,,BUBBLE,,REDUCED\n", tmp_path).notes
    assert any(note.startswith("PARAM SNORM") for note in noted)
    assert sum("IN or ISOP" in note and "times" not in note for note in noted) == 1
    soft = deck(BAR.replace("8.+10", "") + FREE + "SPC1,1,123456,1\n", tmp_path)
    assert soft.weak == ("GRID 2 rx",)


FREE = "GRID,1\nGRID,2,,1.,0.,0.\nCBAR,1,1,1,2,0.,1.,0.\n"


def test_cards_that_change_neither_mass_nor_stiffness_are_listed(tmp_path):
    """All at once; a material and a property that nothing refers to, too."""
    cards = "".join(f"{name},5,1,2\n" for name in sorted(HARMLESS)) + "MAT10,50,1.,1.\nPLSOLID,60,50\n"
    plain, full = deck(BAR + FREE, tmp_path), deck(BAR + FREE + cards, tmp_path)
    for ours, theirs in zip(jax.tree.leaves(full.system), jax.tree.leaves(plain.system), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    listed = {line.partition(":")[0] for line in full.ignored}
    assert listed >= HARMLESS and "PLSOLID, which nothing refers to" in listed
    assert full.system.coordinates == plain.system.coordinates


@pytest.mark.parametrize(
    "card",
    ["SNORM,1,,0.,0.,1.", "CGAP,9,9,1,2", "SPCOFF,1,1", "GENEL,7", "RELEASE,1,123", "CORD3G,9,E313"],
)
def test_cards_that_may_change_them_are_refused(card, tmp_path):
    with pytest.raises(ModelError, match=f"{card.partition(',')[0]} is not read"):
        deck(BAR + FREE + card + "\n", tmp_path)


@pytest.mark.parametrize(
    ("card", "command"),
    [("NSM1,5,PBAR,1,1.,1", "NSM = 5"), ("DMIG,K,0,6,1,0", "K2GG = K"), ("MATT1,1,3", "TEMP(MATERIAL) = 4")]
    + [("MATS1,1,3", "NLPARM = 2"), ("ROTORG,1,1,2", "RGYRO = 3"), ("BCTSET,3", "BCSET = 3"), ("TF,2", "TFL = 2")],
)
def test_cards_that_act_where_the_case_control_chooses_them(card, command, tmp_path):
    """They are refused there, read over with a line elsewhere; a temperature as a load chooses no material."""
    name = card.partition(",")[0]
    case = "SOL 101\nCEND\n{}\nBEGIN BULK\n" + BAR + FREE + card + "\n"
    for other in ("", "TEMP(LOAD) = 4"):
        found = deck(case.format(other), tmp_path)
        assert any(line.startswith(f"{name}, which nothing chooses: deck.bdf:") for line in found.ignored)
    with pytest.raises(ModelError, match=f"{name} is not read, and the case control chooses it by"):
        deck(case.format(command), tmp_path)


def test_cards_that_the_user_answers_for(tmp_path):
    """Left out, with a line that says on whose word; a text in place of a sequence is refused."""
    (tmp_path / "deck.bdf").write_text(BAR + FREE + "CGAP,9,9,1,2\nPGAP,9\n")
    found = read_nastran(tmp_path / "deck.bdf", ignore=("CGAP", "PGAP"))
    assert "CGAP, as ignore= says: deck.bdf:6" in found.ignored
    with pytest.raises(ModelError, match="PGAP is not read"):
        read_nastran(tmp_path / "deck.bdf", ignore=["PELAS"])
    with pytest.raises(ValueError, match="sequence of names"):
        read_nastran(tmp_path / "deck.bdf", ignore="CGAP")


def test_included_files_of_folders_that_the_caller_allows(tmp_path):
    inside, beside = tmp_path / "model", tmp_path / "shared"
    inside.mkdir(), beside.mkdir()
    (beside / "grids.bdf").write_text("GRID,1\nGRID,2,,1.,0.,0.\n")
    (inside / "deck.bdf").write_text(BAR + "CBAR,1,1,1,2,0.,1.,0.\nINCLUDE '..\\shared\\grids.bdf'\n")
    with pytest.raises(ModelError, match="in the folder of the deck; folders="):
        read_nastran(inside / "deck.bdf")
    assert read_nastran(inside / "deck.bdf", folders=[beside]).names == ("GRID 1", "GRID 2")


def test_the_first_of_many_supports_acts(tmp_path):
    case = "SOL 101\nCEND\nSUBCASE 1\nSPC = 2\nSUBCASE 2\nSPC = 1\nBEGIN BULK\n" + BAR + FREE
    found = deck(case + "SPC1,1,123456,1\nSPC1,2,123456,2\n", tmp_path)
    assert found.held[0] == "GRID 2 x" and any(note.startswith("SPC 2, the first that") for note in found.notes)
