"""Loads of a deck against closed forms and the printed resultants of a published deck."""

import numpy as np
import pytest

import jaxmbs as mbs

EI, EA, L = 2.1e11 * 3.2e-9, 2.1e11 * 2.4e-4, 1.0
ARM = """SOL 101
CEND
SPC = 1
SUBCASE 1
LOAD = 9
SUBCASE 2
TEMPERATURE(LOAD) = 5
BEGIN BULK
MAT1,1,2.1+11,,.3,7850.,1.2-5,20.
PBAR,10,1,2.4-4,7.2-9,3.2-9,7.5-9
GRID,1,,0.,0.,0.
GRID,2,,0.5,0.,0.
GRID,3,,1.,0.,0.
CBAR,1,10,1,2,0.,1.,0.
CBAR,2,10,2,3,0.,1.,0.
SPC1,1,123456,1
FORCE,7,3,,10.,0.,0.,1.
MOMENT,6,3,,2.,0.,1.,0.
GRAV,8,,9.81,0.,0.,-1.
LOAD,9,.5,2.,7,4.,8
ACCEL1,4,,1.,1.,0.,0.
,1
PLOAD1,10,1,FZ,FR,0.,6.,1.,6.
PLOAD1,10,2,FZE,LE,0.,6.,.5,6.
TEMPD,5,120.
ENDDATA
"""
#: Of the models of pyNastran (BSD-3), real/loads/loads.bdf: totals of its f06 about the origin.
PLATE = """BEGIN BULK
PLOAD4, 1001, 500, 3.
FORCE,  1002, 15, 0, 1., 0., 0., 1.
LOAD, 2, 1., 1., 1001, 1., 1002
PLOAD,  1003, 9., 1, 2, 7, 6
PLOAD,  1004, 9., 1, 2, 6
GRID, 1,  0, 0., 0., 0.,,123456
GRID, 2,  0, 1., 0., 0.
GRID, 6,  0, 0., 1., 0.,,123456
GRID, 7,  0, 1., 1., 0.
GRID, 11, 0, 0., 2., 0.,,123456
GRID, 12, 0, 1., 2., 0.
GRID, 15, 0, 4., 2., 0.
CQUAD4, 100, 1000, 1, 2, 7, 6
CQUAD4, 500, 1000, 6, 7, 12, 11
PSHELL, 1000, 10000, 0.1, 10000
MAT1,   10000, 1e7, , 0.3
"""
TOTALS = {"LOAD 1001": (0, 0, 3, 4.5, -1.5, 0), "LOAD 2": (0, 0, 4, 6.5, -5.5, 0)}


def read(folder, text):
    file = folder / "deck.bdf"
    file.write_text(text)
    return mbs.io.read_nastran(file)


@pytest.mark.slow
def test_closed_forms(tmp_path):
    deck = read(tmp_path, ARM)
    assert deck.cases == ((1, "LOAD 9", ""), (2, "", "TEMPERATURE 5"))
    np.testing.assert_allclose(deck.statics("LOAD 7")[2, 2], 10 * L**3 / (3 * EI), rtol=1e-9)
    np.testing.assert_allclose(deck.statics("LOAD 6")[2, 2], -2 * L**2 / (2 * EI), rtol=1e-9)
    lumped = 7850 * 2.4e-4 * 9.81 * L**4 / EI * (5 / 96 + 1 / 12)  # half in the middle, a quarter at the tip
    np.testing.assert_allclose(deck.statics("LOAD 8")[2, 2], -lumped, rtol=1e-9)
    np.testing.assert_allclose(deck.statics("LOAD 10")[2, 2], 6 * L**4 / (8 * EI), rtol=1e-9)
    np.testing.assert_allclose(deck.load(), deck.load("LOAD 7") + 2 * deck.load("LOAD 8"), rtol=1e-12)
    np.testing.assert_allclose(deck.statics("", "TEMPERATURE 5")[:, 0], 1.2e-3 * np.array([0, 0.5, 1.0]), rtol=1e-9)
    with pytest.raises(mbs.ModelError, match="ACCEL1 is not read"):
        deck.load("LOAD 4")
    with pytest.raises(mbs.UnknownNameError, match="LOAD 3"):
        deck.load("LOAD 3")


def test_cases_choose_their_own_sets(tmp_path):
    """A combination of cases, and the temperatures of materials, are no loads of the case before them."""
    text = ARM.replace("LOAD = 9\nSUBCASE 2", "LOAD = 9\nTEMP(INITIAL) = 5\nSUBCOM 7\nTEMP(LOAD) = 5\nSUBCASE=2")
    deck = read(tmp_path, text)
    assert deck.cases == ((1, "LOAD 9", ""), (2, "", "TEMPERATURE 5")) and "begin at TREF" in deck.notes[-1]


def test_an_enforced_place(tmp_path):
    text = ARM.replace("SPC1,1,123456,1", "SPC1,1,123456,1\nSPC,1,3,3,.01")
    np.testing.assert_allclose(read(tmp_path, text).statics("", "")[1:, 2], [0.01 * 5 / 16, 0.01], rtol=1e-9)


#: Of the models of pyNastran (BSD-3), unit/pload4/pload1.bdf, and displacements of node 2 in its op2.
BAR = """SPC = 10
BEGIN BULK
GRID,1,,1.0,0.0,0.0
GRID,2,,2.0,1.0,0.0
CBAR,3,,1,2,1.0,1.0,1.0
PBAR,3,4,1.0,2.0,3.0,4.0,5.0
MAT1,4,3.0e7,,0.3
SPC,10,1,123456
PLOAD1,100,3,FX,FR,0.5,10.
PLOAD1,300,3,FZ,FR,0.5,10.
PLOAD1,500,3,MY,FR,0.5,3.
PLOAD1,800,3,MY,FR,0.5,10.,1.0
ENDDATA
"""
NODE_2 = {
    "LOAD 100": (1.342193e-7, 1.014829e-7, 0, 0, 0, -1.964185e-8),
    "LOAD 300": (0, 0, 4.910464e-8, 2.946278e-8, -2.946278e-8, 0),
    "LOAD 500": (0, 0, -2.65165e-8, 5.303302e-9, 4.065864e-8, 0),
    "LOAD 800": (0, 0, -3.645834e-8, 8.333335e-9, 6.388889e-8, 0),
}


@pytest.mark.slow
def test_loads_along_a_bar_as_nastran_wrote_them(tmp_path):
    """Forces and moments at the middle, and a moment that falls from there to the end."""
    deck = read(tmp_path, BAR)
    for name, wanted in NODE_2.items():
        np.testing.assert_allclose(deck.statics(name)[1], wanted, rtol=5e-7, atol=1e-16)


@pytest.mark.parametrize(
    ("card", "fault"),
    [
        ("PLOAD1,9,4,FX,FR,.5,1.", "there is no CBAR or CBEAM 4"),
        ("PLOAD1,9,3,F,FR,.5,1.", "TYPE F must be one of FX"),
        ("PLOAD1,9,3,FX,XX,.5,1.,1.,1.", "SCALE XX must be"),
    ],
)
def test_wrong_loads_along_bars_are_told(card, fault, tmp_path):
    with pytest.raises(mbs.ModelError, match=fault):
        read(tmp_path, BAR.replace("ENDDATA", card + "\nENDDATA")).load("LOAD 9")


def test_totals_of_a_printed_list(tmp_path):
    deck = read(tmp_path, PLATE)
    for name, wanted in TOTALS.items():
        f = np.asarray(deck.load(name))
        arms = np.cross(np.asarray(deck.positions), f[:, :3])
        np.testing.assert_allclose([*f[:, :3].sum(0), *(arms + f[:, 3:]).sum(0)], wanted, atol=1e-12)
