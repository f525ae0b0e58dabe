"""Cards by dimensions, scalar points, defaults, long lines; what is not read or not there is said once."""

import re

import numpy as np
import pytest

from jaxmbs.errors import ModelError
from jaxmbs.io import read_nastran
from jaxmbs.io.nastran._sections import SECTIONS
from tests.marks import cases

BAR = "MAT1,1,2.+11,8.+10,,7850.\nPBAR,1,1,1.-3,2.-7,1.-7,3.-7\nGRID,1\nGRID,2,,1.,0.,0.\n"


def deck(text, folder, **options):
    (folder / "deck.bdf").write_text(text)
    return read_nastran(folder / "deck.bdf", **options)


def faults(text, folder, **options):
    with pytest.raises(ModelError) as told:
        deck(text, folder, **options)
    return told.value.faults


def matrices(model):
    system = model.system
    return np.asarray(system.stiffness), np.asarray(system.mass), system.damping


def drawn(name, sizes, n=1200):
    """Area and both moments of a section by counting points of a grid; the drawing of the format."""
    s = sizes
    span = 1.05 * s[0] if name in ("ROD", "TUBE", "TUBE2") else 0.7 * max(s)
    axis = (np.arange(n) + 0.5) / n * 2 * span - span
    z, y = np.meshgrid(axis, axis, indexing="ij")
    r = np.hypot(z, y)
    bar = lambda w, h, at=0.0, up=0.0: (abs(z - at) < w / 2) & (abs(y - up) < h / 2)
    shape = {
        "ROD": lambda: r < s[0],
        "TUBE": lambda: (r < s[0]) & (r >= s[1]),
        "TUBE2": lambda: (r < s[0]) & (r >= s[0] - s[1]),
        "BAR": lambda: bar(s[0], s[1]),
        "BOX": lambda: bar(s[0], s[1]) & ~bar(s[0] - 2 * s[3], s[1] - 2 * s[2]),
        "I": lambda: bar(s[1], s[4], up=(s[4] - s[0]) / 2) | bar(s[3], s[0]) | bar(s[2], s[5], up=(s[0] - s[5]) / 2),
        "I1": lambda: bar(s[0] + s[1], s[3]) & ~(bar(s[0] + s[1], s[2]) & ~bar(s[1], s[2])),
        "H": lambda: bar(s[0], s[3]) | (bar(s[0] + s[1], s[2]) & ~bar(s[0], s[2])),
        "T": lambda: bar(s[0], s[2], up=(s[1] - s[2]) / 2) | bar(s[3], s[1]),
        "T2": lambda: bar(s[0], s[2], up=(s[2] - s[1]) / 2) | bar(s[3], s[1]),
        "CHAN": lambda: bar(s[0], s[1]) & ~bar(s[0], s[1] - 2 * s[3], at=s[2]),
    }[name]()
    cell = (2 * span / n) ** 2
    area = shape.sum() * cell
    return area, ((y[shape] - y[shape].mean()) ** 2).sum() * cell, ((z[shape] - z[shape].mean()) ** 2).sum() * cell


SIZES = {
    **{"ROD": (1.0,), "TUBE": (1.0, 0.7), "TUBE2": (1.0, 0.3), "BAR": (1.0, 2.0), "BOX": (2.0, 3.0, 0.2, 0.3)},
    **{"I": (3.0, 2.0, 1.5, 0.2, 0.3, 0.25), "I1": (1.6, 0.4, 2.0, 2.6), "H": (1.5, 0.8, 2.0, 0.4)},
    **{"T": (2.0, 3.0, 0.3, 0.4), "T2": (2.0, 3.0, 0.3, 0.4), "CHAN": (1.5, 3.0, 0.3, 0.2)},
}


@pytest.mark.parametrize("name", cases(SECTIONS, slow=["ROD", "TUBE", "TUBE2", "BAR"]))
def test_sections_by_their_dimensions(name, tmp_path):
    """Area and moments against the drawing; torsion of those that have a closed form; what makes no section."""
    sizes = SIZES[name]
    dims = ",".join(map(str, sizes))
    found = deck(BAR + f"PBARL,9,1,,{name}\n,{dims},2.5\nCBAR,1,9,1,2,0.,1.,0.\n", tmp_path).properties["PBARL 9"]
    np.testing.assert_allclose([found.area, found.inertia_1, found.inertia_2], drawn(name, sizes), rtol=2e-2)
    assert found.line_mass == 2.5 and np.all(np.asarray(found.shear) > 0)
    exact = {"ROD": np.pi / 2, "TUBE": np.pi / 2 * (1 - 0.7**4), "BAR": 0.229 * 2.0}
    np.testing.assert_allclose(found.torsion, exact.get(name, found.torsion), rtol=2e-3)
    wrong = ",".join(["-1."] + [str(size) for size in sizes[1:]])
    assert (
        f"do not make a valid {name}"
        in faults(BAR + f"PBARL,9,1,,{name}\n,{wrong}\nCBAR,1,9,1,2,0.,1.,0.\n", tmp_path)[0]
    )


def test_beams_by_their_dimensions(tmp_path):
    beam = "CBEAM,1,9,1,2,0.,1.,0.\n"
    found = deck(BAR + "PBEAML,9,1,,BAR\n,1.,2.,0.5,YES,1.,1.,2.,0.5\n" + beam, tmp_path).properties["PBEAML 9"]
    np.testing.assert_allclose([found.area, found.inertia_1, found.line_mass], [2.0, 8 / 12, 0.5])
    tapered = deck(BAR + "PBEAML,9,1,,BAR\n,1.,2.,0.5,YES,1.,1.,4.,1.5\n" + beam, tmp_path).properties["PBEAML 9"]
    np.testing.assert_allclose([tapered.area, tapered.inertia_1, tapered.line_mass], [3.0, (8 + 64) / 24, 1.0])
    for row, words in (
        ("BAR\n,1.,2.,0.5,YES,1.,1.,-3.", "the station at X/XB = 1 is not a valid BAR"),
        ("T\n,2.,3.,.3,.4", "shear centre off its centroid"),
        ("L\n,2.,3.,.3,.4", "section 'L' is not supported; supported are ROD, TUBE"),
    ):
        assert words in faults(BAR + f"PBEAML,9,1,,{row}\n{beam}", tmp_path)[0]


def test_t_upside_down_and_shear_in_one_plane_only(tmp_path):
    """A T2 bends as a T; a plane without K has no shear beside one that has it; E and G of bars may be any."""
    beam = "CBAR,1,9,1,2,0.,1.,0.\n"
    made = [
        deck(BAR + f"PBARL,9,1,,{name}\n,2.,3.,.3,.4\n" + beam, tmp_path).properties["PBARL 9"]
        for name in ("T", "T2")
    ]
    for name in ("area", "inertia_1", "inertia_2", "torsion"):
        np.testing.assert_allclose(getattr(made[1], name), getattr(made[0], name), rtol=1e-12)
    bar = "PBAR,9,1,1.-3,2.-7,1.-7,3.-7\n,\n,.8,0.\n" + beam
    np.testing.assert_allclose(deck(BAR + bar, tmp_path).properties["PBAR 9"].shear, [0.8, 1e6])
    odd = "MAT1,7,2.+7,5.8+5,16.8\n"
    deck(BAR + odd + bar.replace("PBAR,9,1", "PBAR,9,7"), tmp_path)
    plate = "PSHELL,9,7,.1,7\nGRID,3,,1.,1.\nCTRIA3,5,9,1,2,3\n"
    assert "E and G of MAT1 7 make a Poisson's ratio" in faults(BAR + odd + plate, tmp_path)[0]


@pytest.mark.slow
def test_rods_bars_and_defaults_say_the_same_as_others(tmp_path):
    """CONROD as CROD with PROD, RBAR as RBE2, BAROR as what it spares, a long line as its continuations."""
    grids = BAR + "GRID,3,,1.,1.,.2\nGRID,4,,1.5,.5,.3\nGRID,5,,.3,.2,.1\n"
    pairs = [
        ("CONROD,7,1,2,1,2.-4,,,3.\n", "PROD,8,1,2.-4,,,3.\nCROD,7,8,1,2\n"),
        ("CBAR,1,1,1,2,0.,1.,0.\nRBAR,3,2,3,123456\n", "CBAR,1,1,1,2,0.,1.,0.\nRBE2,3,2,123456,3\n"),
        ("CBAR,1,1,1,2,0.,1.,0.\nRBAR,3,3,2,,123456,12\n", "CBAR,1,1,1,2,0.,1.,0.\nRBE2,3,2,12,3\n"),
        (
            "BAROR,,1,,,0.,1.,0.\nCBAR,1,,1,2\nCBAR,2,,2,3,1.,0.,0.\n",
            "CBAR,1,1,1,2,0.,1.,0.\nCBAR,2,1,2,3,1.,0.,0.\n",
        ),
        (
            "CBAR,1,1,1,2,0.,1.,0.\nRBE2,3,2,123456,3,4,5\nSPC1,1,123456,1,3,4,5,2,1,1,1,1,1\n",
            "CBAR,1,1,1,2,0.,1.,0.\nRBE2,3,2,123456,3,4,5\nSPC1,1,123456,1,3,4,5,2,1\n,1,1,1,1\n",
        ),
    ]
    for one, other in pairs[:4]:
        for A, B in zip(matrices(deck(grids + one, tmp_path)), matrices(deck(grids + other, tmp_path)), strict=True):
            np.testing.assert_array_equal(A, B)
    said = [faults(grids + text, tmp_path)[0] for text in pairs[4]]
    assert said[0] == said[1]  # all nodes are held: the same directions depend on the RBE2 as well
    assert "CNA or CNB must be 123456" in faults(grids + "CBAR,1,1,1,2,0.,1.,0.\nRBAR,3,2,3,123,456\n", tmp_path)[0]


@pytest.mark.slow
def test_scalar_points_masses_and_dampers(tmp_path):
    """A chain of scalar points in the four forms of cards, and one that hangs on a GRID; WTMASS; by hand."""
    text = "SPOINT,1,THRU,2\nGRID,3,,,,,,23456\nPARAM,WTMASS,2.\nPELAS,5,100.\nPMASS,6,3.\nPDAMP,7,4.\n"
    text += "CELAS1,11,5,1,,2\nCELAS2,12,50.,2,0,3,1\nCELAS3,13,5,1\nCELAS4,14,20.,8,2\n"
    text += "CMASS1,21,6,1\nCMASS2,22,1.,2,,3,1\nCMASS3,23,6,2\nCMASS4,24,5.,8\nCMASS2,25,7.,3,1\n"
    text += "CDAMP1,31,7,1,,2\nCDAMP2,32,9.,3,1\nCDAMP3,33,7,8\nCDAMP4,34,1.,8,1\n"
    model = deck(text, tmp_path)
    system = model.system
    assert [system.label(k) for k in range(4)] == ["SPOINT 1 x", "SPOINT 2 x", "GRID 3 x", "SPOINT 8 x"]
    K, M, C = matrices(model)
    np.testing.assert_allclose(
        K, [[200, -100, 0, 0], [-100, 170, -50, -20], [0, -50, 50, 0], [0, -20, 0, 20]], atol=1e-12
    )
    np.testing.assert_allclose(
        M, 2 * np.array([[3, 0, 0, 0], [0, 4, -1, 0], [0, -1, 8, 0], [0, 0, 0, 5.0]]), atol=1e-12
    )
    np.testing.assert_allclose(C, [[5, -4, 0, -1], [-4, 4, 0, 0], [0, 0, 9, 0], [-1, 0, 0, 5]], atol=1e-12)
    held = deck(text + "SPC,1,8,0\nMPC,1,2,0,1.,3,1,-2.\n", tmp_path)
    assert held.held == ("GRID 3 y", "GRID 3 z", "GRID 3 rx", "GRID 3 ry", "GRID 3 rz", "SPOINT 8 x")
    T = np.array([[1, 0], [0, 2], [0, 1.0]])
    np.testing.assert_allclose(matrices(held)[0], T.T @ K[:3, :3] @ T, rtol=1e-12)
    assert "a scalar point has the same number" in faults(text + "GRID,8\n", tmp_path)[0]


NOT_READ = {
    "CPYRAM is not read": "CPYRAM,5,9,1,2,3,4\nPSOLID,9,1\nGRID,3,,1.,1.\nGRID,4,,1.,1.,1.\n",
    "CQUADX is not read": "CQUADX,5,9,1,2,3,4\nPSHELL,9,1,.1,1\n",
    "MAT10 is not read": "MAT10,9,1.,1.\nPSOLID,7,9\nGRID,3,,1.,1.\nGRID,4,,1.,1.,1.\nCTETRA,5,7,1,2,3,4\n",
    "PBCOMP is not read": "PBCOMP,9,1\nCBEAM,5,9,1,2,0.,1.,0.\nCBEAM,6,9,2,1,0.,1.,0.\n",
}


@pytest.mark.parametrize("words", NOT_READ)
def test_cards_that_are_not_read_make_one_fault(words, tmp_path):
    found = faults(BAR + NOT_READ[words], tmp_path)
    assert len(found) == 1 and found[0].startswith(words)


WRONG = {
    "there is no SPC set 9": "SPC1,8,123456,1\nSPCADD,7,8,9\n",
    "there is no SPC set 6, but a sum": "SPC1,8,123456,1\nSPCADD,6,8\nSPCADD,7,8,6\n",
    "SPCADD 7 .* it lists no sets": "SPCADD,7\n",
    "SPCADD 7 .* duplicate set": "SPC1,8,123456,1\nSPCADD,7,8\nSPCADD,7,8\n",
    "SPC1 7 .* it names no GRID": "SPC1,7,123456,50,THRU,60\n",
    "RBE2 7 .* it has no dependent GRID": "RBE2,7,1,123456,50,THRU,60\n",
    "there is no GRID 50": "RBAR,7,1,50,123456\n",
    "there is no PBAR 3 or PBARL 3": "CBAR,2,3,1,2,0.,1.,0.\nCBAR,3,3,2,1,0.,1.,0.\n",
    "there is no PROD 9": "CROD,5,9,1,2\nMPC,9,2,1,1.,1,1,-1.\n",  # a set of another card has its number
    "there is no PBAR 4 or PBARL 4, but a PBEAM 4": "PBEAM,4,1,1.,1.,1.,,1.\nCBAR,2,4,1,2,0.,1.,0.\n",
    "there is no MAT1 5": "CONROD,7,1,2,5,1.\n",
    "BAROR .* duplicate BAROR": "BAROR,,1\nBAROR,,1\n",
    "M must not be negative": "PMASS,3,-1.\n",
    "no number must|must not be negative": "CDAMP2,3,-1.,1,1\n",
}


@pytest.mark.parametrize("words", WRONG)
def test_references_to_nothing(words, tmp_path):
    found = faults(BAR + "CBAR,1,1,1,2,0.,1.,0.\n" + WRONG[words], tmp_path, spc=7 if "SPC" in words else None)
    assert len(found) == 1 and re.search(words, found[0]), found


def test_entries_that_share_a_card(tmp_path):
    """Two scalar elements, two springs, four masses on a card, and no GRID at all: a chain of the first forms."""
    text = "PELAS,5,100.,,,6,50.\nPMASS,1,1.,2,2.,3,3.,4,4.\nPDAMP,7,9.,8,8.\n"
    text += (
        "CELAS3,11,5,1,2,12,6,2,3\nCELAS4,13,7.,1,0\nCMASS3,21,1,1,,22,4,2\nCMASS3,23,3,3\nCDAMP3,31,7,1,,32,8,3\n"
    )
    K, M, C = matrices(deck(text, tmp_path))
    np.testing.assert_allclose(K, [[107, -100, 0], [-100, 150, -50], [0, -50, 50]], atol=1e-12)
    np.testing.assert_allclose(M, np.diag([1.0, 4.0, 3.0]), atol=1e-12)
    np.testing.assert_allclose(C, np.diag([9.0, 0.0, 8.0]), atol=1e-12)


def test_mpcadd_of_nothing(tmp_path):
    text = BAR + "CBAR,1,1,1,2,0.,1.,0.\nMPC,8,1,1,1.,2,1,-1.\nMPCADD,7,8,9\n"
    assert "there is no MPC set 9" in faults(text, tmp_path)[0]


def test_a_chosen_mpc_without_any_cards_is_noted(tmp_path):
    """Nastran runs such decks; three of the models of pyNastran have results of theirs."""
    text = "CEND\nMPC = 7\nBEGIN BULK\nGRID,1\nGRID,2,,1.,0.,0.\nMAT1,1,1.,,.3\nPROD,1,1,1.\nCROD,1,1,1,2\n"
    (tmp_path / "deck.bdf").write_text(text)
    assert any("chooses MPC 7, and the deck has no MPC" in note for note in read_nastran(tmp_path / "deck.bdf").notes)
