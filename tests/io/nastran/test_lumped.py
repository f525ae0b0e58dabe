"""Masses on the nodes and plates without transverse shear, as Nastran has them: its own answers and closed forms."""

import equinox as eqx
import jax
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs import fem
from jaxmbs.io import read_nastran

BAR = "MAT1,1,2.+11,8.+10,,7850.\nPBAR,1,1,1.-3,2.-7,1.-7,3.-7\nPBEAM,2,1,1.-3,2.-7,1.-7,,3.-7\n"


def deck(text, folder, **options):
    (folder / "deck.bdf").write_text(text)
    return read_nastran(folder / "deck.bdf", **options)


def eigenvalues(model):
    """Ascending, of the coordinates with mass."""
    system = model.system
    K, M = np.asarray(system.stiffness), np.asarray(system.mass)
    heavy = np.setdiff1d(np.arange(len(K)), model.massless)
    light = np.array(model.massless, int)
    if len(light):
        K = K - K[:, light] @ np.linalg.solve(K[np.ix_(light, light)], K[light])
    return scipy.linalg.eigh(K[np.ix_(heavy, heavy)], M[np.ix_(heavy, heavy)], eigvals_only=True)


#: Demonstration problem D02-03-1A of NASTRAN-95: 18 nodes, both ends held: some of the 24 eigenvalues of its print.
TRUSS_SQUARED = {5: 6.303828e5, 6: 1.015982e6, 8: 1.535740e6, 13: 2.490456e6, 20: 4.401530e6, 24: 5.563008e6}


def truss():
    grids = [(1 + j + 10 * i, 40.0 * i, 30.0 * (j - 1)) for i in range(6) for j in range(3)]
    text = "MAT1,1,10.+6,,.3,2.5-3\nPROD,1,1,.3\nGRDSET,,,,,,,3456\n"
    text += "".join(f"GRID,{one},,{x},{y},0.\n" for one, x, y in grids)
    lines = []
    for i in range(6):
        a = 10 * i
        lines += [(a + 1, a + 2), (a + 2, a + 3)]
        if i < 5:
            lines += [(a + j, a + j + 10) for j in (1, 2, 3)]
            lines += [(a + 2, a + 11), (a + 2, a + 13)]
    text += "".join(f"CROD,{k},1,{a},{b}\n" for k, (a, b) in enumerate(lines, start=1))
    return text + "SPC1,1,12,1,2,3,51,52,53\n"


@pytest.mark.long
def test_truss_of_rods_against_nastran(tmp_path):
    """Lumped is what it printed, to seven digits; consistent masses are up to 36 % away; the deck says which."""
    text = truss()
    found = eigenvalues(deck(text, tmp_path))
    assert len(found) == 24
    for mode, value in TRUSS_SQUARED.items():
        np.testing.assert_allclose(found[mode - 1], value, rtol=3e-6)
    consistent = deck(text + "PARAM,COUPMASS,1\n", tmp_path)
    assert eigenvalues(consistent)[-1] > 1.3 * found[-1]
    for model, word in ((deck(text, tmp_path), "lumped"), (consistent, "consistent")):
        assert model.notes[0].startswith(f"masses are {word}") and f"note: masses are {word}" in model.describe()
    both = [deck(text + param, tmp_path, masses="lumped") for param in ("", "PARAM,COUPMASS,1\n")]
    np.testing.assert_allclose(*map(eigenvalues, both), rtol=1e-12)
    assert deck(text + "PARAM,COUPMASS,-1\n", tmp_path).notes == both[0].notes
    with pytest.raises(ValueError, match="'lumped', 'consistent'"):
        deck(text, tmp_path, masses="diagonal")


@pytest.mark.long
def test_lumped_bars(tmp_path):
    """Halves at the ends of the offsets, none in rotation but about the axis of a CBEAM; NSM and WTMASS; by hand."""
    text = BAR.replace("3.-7\nPBEAM", "3.-7,2.\nPBEAM") + "GRID,1\nGRID,2,,2.,0.,0.\nPARAM,WTMASS,.5\n"
    bar = deck(text + "CBAR,1,1,1,2,0.,1.,0.\nSPC1,1,123456,1\n", tmp_path)
    half = 0.5 * (7.85 + 2.0) * 2 / 2
    np.testing.assert_allclose(bar.system.mass, np.diag([half] * 3 + [0.0] * 3), atol=1e-12)
    assert bar.massless == (3, 4, 5)
    beam = deck(text + "CBEAM,1,2,1,2,0.,1.,0.\nSPC1,1,123456,1\n", tmp_path).system.mass
    np.testing.assert_allclose(np.diag(beam)[3:], [0.5 * 7850.0 * 3e-7 * 2 / 2, 0, 0], rtol=1e-12)
    arm = deck(text + "CBAR,1,1,1,2,0.,1.,0.\n,,,0.,0.2,0.,0.,0.2,0.\nSPC1,1,123456,1\n", tmp_path).system.mass
    T = np.hstack([np.eye(3), -np.array([[0, 0, 0.2], [0, 0, 0], [-0.2, 0, 0]])])  # u + r x (0, 0.2, 0)
    expected = half * T.T @ T
    np.testing.assert_allclose(arm, expected, atol=1e-12)


@pytest.mark.long
def test_lumped_plates_and_solids(tmp_path):
    """Total mass and weight by hand; nothing beside the diagonal; derivatives by thickness."""
    text = "MAT1,1,2.+11,,.3,7850.\nPSHELL,2,1,.02,1,,1,,4.\nPSOLID,3,1\n"
    text += "GRID,1\nGRID,2,,2.,0.,0.\nGRID,3,,1.5,1.,0.\nGRID,4,,0.,1.,0.\nGRID,5,,3.,.5,.2\n"
    text += "".join(f"GRID,{k + 10},,{x},{y},{z}\n" for k, (x, y, z) in enumerate(np.ndindex(2, 2, 2)))
    model = deck(text + "CQUAD4,1,2,1,2,3,4\nCTRIA3,2,2,2,5,3\nCHEXA,3,3,10,14,16,12,11,15\n,17,13\n", tmp_path)

    @jax.jit
    def masses(t):
        return eqx.tree_at(lambda d: d.properties["PSHELL 2"].thickness, model, t).system.mass

    area = 1.75 + 0.5 * np.linalg.norm(np.cross([1.0, 0.5, 0.2], [-0.5, 1.0, 0.0]))
    M, slope = jax.jvp(masses, (0.02,), (1.0,))
    assert np.count_nonzero(M - np.diag(np.diag(M))) == 0
    np.testing.assert_allclose(np.trace(M) / 3, 7850.0 * (1 + 0.02 * area) + 4.0 * area, rtol=1e-12)
    np.testing.assert_allclose(np.trace(slope) / 3, 7850.0 * area, rtol=1e-12)
    weight = np.asarray(fem.body_load(model.structure, (0, 0, -1.0)))[:, 2].sum()
    np.testing.assert_allclose(weight, -np.trace(M) / 3, rtol=1e-12)


@pytest.mark.slow
def test_an_element_with_nodes_on_edges_may_have_no_density(tmp_path):
    """A tetrahedron of ten nodes: zero masses, and the slope by the density is the volume."""
    places = ["0.,0.,0.", "1.,0.,0.", "0.,1.,0.", "0.,0.,1.", "0.5,0.,0.", "0.5,0.5,0.", "0.,0.5,0."]
    places += ["0.,0.,0.5", "0.5,0.,0.5", "0.,0.5,0.5"]
    text = "MAT1,1,2.+11,,.3\nPSOLID,1,1\nCTETRA,1,1,1,2,3,4,5,6\n,7,8,9,10\n"
    model = deck(text + "".join(f"GRID,{k},,{at}\n" for k, at in enumerate(places, start=1)), tmp_path)

    def total(density):
        changed = eqx.tree_at(lambda d: d.materials["MAT1 1"].density, model, density)
        return changed.elements["mass of CTETRA 1 of 10 nodes"].element(changed.numbers).value.sum()

    mass, slope = jax.jvp(total, (0.0,), (1.0,))
    assert mass == 0
    np.testing.assert_allclose(slope, 1 / 6, rtol=1e-12)


def plate(n, mid3):
    """A square simply supported, a tenth as thick as wide."""
    text = f"MAT1,1,2.+11,,.3,7850.\nPSHELL,1,1,.1,1,,{mid3}\n"
    at = np.arange(1, (n + 1) ** 2 + 1).reshape(n + 1, n + 1)
    text += "".join(f"GRID,{at[i, j]},,{i / n},{j / n},0.,,126\n" for i, j in np.ndindex(n + 1, n + 1))
    cells = enumerate(np.ndindex(n, n), start=1)
    text += "".join(
        f"CQUAD4,{k},1,{at[i, j]},{at[i + 1, j]},{at[i + 1, j + 1]},{at[i, j + 1]}\n" for k, (i, j) in cells
    )
    sides = (("34", at[:, [0, -1]].T), ("35", at[[0, -1]]))  # no rotation along the edge's normal
    text += "".join(
        f"SPC1,1,{d},{node}\n" for d, nodes in (("3", sides[0][1]), ("3", sides[1][1])) for node in np.ravel(nodes)
    )
    text += "".join(f"SPC1,1,5,{node}\n" for node in np.ravel(sides[0][1]))
    return text + "".join(f"SPC1,1,4,{node}\n" for node in np.ravel(sides[1][1]))


@pytest.mark.long
def test_plates_without_shear(tmp_path):
    """A blank MID3: the frequency goes to Kirchhoff's, with MID3 to Mindlin's, 3 % lower, without spins inertia."""
    E, nu, t, rho = 2e11, 0.3, 0.1, 7850.0
    D = E * t**3 / (12 * (1 - nu**2))
    thin = 2 * np.pi**2 * np.sqrt(D / (rho * t))
    thick = thin / np.sqrt(1 + 2 * np.pi**2 * D / (5 / 6 * t * E / (2 * (1 + nu))))
    assert thick < 0.975 * thin
    for mid3, exact in (("", thin), ("1", thick)):
        found = [np.sqrt(eigenvalues(deck(plate(n, mid3), tmp_path))[0]) for n in (8, 16)]
        np.testing.assert_allclose(found[1] + (found[1] - found[0]) / 3, exact, rtol=2e-3)
    notes = deck(plate(4, ""), tmp_path).notes
    assert any("CQUAD4 has no transverse shear" in note for note in notes)
    assert not any("shear" in note for note in deck(plate(4, "1"), tmp_path).notes)


@pytest.mark.long
def test_a_lumped_deck_answers(tmp_path):
    """Modes of a cantilever with rotations that have no mass, beside the closed form."""
    text = BAR + "".join(f"GRID,{k + 1},,{0.05 * k},0.,0.\n" for k in range(21))
    text += "".join(f"CBAR,{k},1,{k},{k + 1},0.,1.,0.\n" for k in range(1, 21)) + "SPC1,1,123456,1\n"
    modes = mbs.modes(deck(text, tmp_path).system, 2, damped=False)
    exact = 1.8751041**2 * np.sqrt(2e11 * np.array([1e-7, 2e-7]) / 7.85)
    np.testing.assert_allclose(modes.omega, exact, rtol=2e-3)
