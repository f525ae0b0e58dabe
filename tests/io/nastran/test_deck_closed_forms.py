"""What single cards do to small decks, against closed forms of bars.

A bar of two metres along x, clamped at node 1 unless a row says otherwise: its tip, or the node that a row names.
"""

import numpy as np
import pytest

import jaxmbs as mbs

E, G, A, I1, I2, L, RHO = 2e11, 2e11 / 2.6, 1e-3, 2e-8, 5e-8, 2.0, 7850.0
W = 2 * np.pi
STUFF = "MAT1,1,2.+11,,.3,7850.,1.-5,20.\nMAT1,2,2.+11,,.3\n" + "".join(
    f"PBAR,{k},{k},.001,2.-8,5.-8,3.-8\n" for k in (1, 2)
)
NODES = "GRID,1\nGRID,2,,2.,0.,0.\nGRID,3,,0.,0.,1.\nGRID,4,,0.,5.,0.\nSPC1,1,123456,4\n"
FREE = NODES + "CBAR,1,1,1,2,0.,1.,0.\n"  # node 1 and node 3 are held by the rows
BAR = FREE + "SPC1,1,123456,1,3\n"
LIGHT = BAR.replace("CBAR,1,1", "CBAR,1,2")
RIGID = FREE + "RBE2,5,3,123456,1\n"
Y, Z = "FORCE,7,2,,100.,0.,1.,0.\n", "FORCE,7,2,,100.,0.,0.,1.\n"
BENT = 100 * L**3 / 3 / E / I1
#: Node 2 unless a row ends with another one: what stands before the bulk data, bulk data, direction, displacement.
ROWS = {
    "plane 1 has I1": ("", BAR + Y, 1, BENT),
    "plane 2 has I2": ("", BAR + Z, 2, 100 * L**3 / 3 / E / I2),
    "node in plane 1": ("", BAR.replace("0.,1.,0.", "3") + Z, 2, BENT),
    "two forces at a node add": ("", BAR + Y + Y, 1, 2 * BENT),
    "FORCE1 from node 1 to 4": ("", BAR + "FORCE1,7,2,100.,1,4\n", 1, BENT),
    "MOMENT1 from node 1 to 3": ("", BAR + "MOMENT1,7,2,100.,1,3\n", 1, 100 * L**2 / 2 / E / I1),
    "FORCE2 along z x x": ("", BAR + "FORCE2,7,2,100.,1,3,1,2\n", 1, BENT),
    "MOMENT2 along x x y": ("", BAR + "MOMENT2,7,2,100.,1,2,1,4\n", 1, 100 * L**2 / 2 / E / I1),
    "SLOAD at a GRID": ("", BAR + "SLOAD,7,2,100.\n", 0, 100 * L / E / A),
    "load per projected length": (
        "",  # an inclined bar, twice as long as seen from above
        BAR.replace("2.,0.,0.", "1.,0.,1.73205080756887729") + "PLOAD1,7,1,FZ,FRPR,0.,10.,1.,10.\n",
        2,
        5 * L**4 / 8 / E / I2 * 0.25 + 10 * 0.5 * L**2 / 2 / E / A * 0.75,
    ),
    "PIN PB frees rz": ("", BAR + "SPC1,1,6,2\n" + Y, 1, BENT / 4),
    "PIN PB": ("", BAR.replace("0.,1.,0.", "0.,1.,0.\n,,6") + "SPC1,1,6,2\n" + Y, 1, BENT),
    "offsets W": (
        "",
        BAR.replace("0.,1.,0.", "0.,1.,0.\n,,,0.,.1,0.,0.,.1,0.") + "FORCE,7,2,,100.,1.,0.,0.\n",
        0,
        100 * L / E / A + 100 * 0.01 * L / E / I1,
    ),
    "offsets W in frames of the ends": (
        "",
        "CORD2R,9,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n"
        + BAR.replace("GRID,1\n", "GRID,1,,,,,9\n")
        .replace("2.,0.,0.", "2.,0.,0.,9")
        .replace("0.,1.,0.\nSPC", "1.,0.,0.\n,,,.1,0.,0.,.1,0.,0.\nSPC")
        + "FORCE,7,2,,100.,1.,0.,0.\n",
        0,
        100 * L / E / A + 100 * 0.01 * L / E / I1,
    ),
    "D of an SPC at the master of an RBE2": ("", RIGID + "SPC,1,3,5,.01\nSPC1,1,12346,3\n", 2, -0.02),
    "SPCD at the master of an RBE2": ("SPC = 1\n", RIGID + "SPC1,1,123456,3\nSPCD,7,3,1,.01\n", 0, 0.01),
    "SPCD stands over D": ("SPC=1\n", FREE + "SPC1,1,123456,3\nSPC,1,1,123456,.01\nSPCD,7,1,1,.03\n", 0, 0.03),
    "MPC from an enforced place": (
        "SPC=1\nMPC=1\n",
        FREE + "MPC,1,1,1,1.,3,1,-2.\nSPC1,1,23456,1\nSPC1,1,23456,3\nSPC,1,3,1,.01\n",
        0,
        0.02,
    ),
    "WTMASS in the case control": (
        "PARAM, WTMASS, 2.\n",
        BAR + "PARAM,COUPMASS,1\nGRAV,7,,9.81,0.,0.,-1.\n",
        2,
        -2 * RHO * A * 9.81 * L**4 / 8 / E / I2,
    ),
    "spin of lumped masses": ("", BAR + "RFORCE,7,1,,1.,0.,0.,1.\n", 0, RHO * W**2 * L**3 / 2 / E),
    "spin of consistent masses": (
        "",
        BAR + "PARAM,COUPMASS,1\nRFORCE,7,1,,1.,0.,0.,1.\n",
        0,
        RHO * W**2 * L**3 / 3 / E,
    ),
    "spin of a mass beside its node": (
        "",
        LIGHT + "CONM2,7,2,,3.,.5\nRFORCE,7,1,,1.,0.,0.,1.\n",
        0,
        3 * W**2 * 2.5 * L / E / A,
    ),
    "spin of an inertia": (
        "",  # moment -spin x J spin about y, of J xx alone and a spin along x + z
        LIGHT + "CONM2,7,2,,0.\n,4.\nRFORCE,7,1,,1.,1.,0.,1.\n",
        2,
        4 * W**2 * L**2 / 2 / E / I2,
    ),
    "spin of a bar beside its nodes": (
        "",
        BAR.replace("0.,1.,0.", "0.,1.,0.\n,,,.5,0.,0.,.5,0.,0.") + "RFORCE,7,1,,1.,0.,0.,1.\n",
        0,
        RHO * L / 2 * W**2 * 2.5 * L / E,
    ),
    "repeated cards": (
        "",
        STUFF + "GRID,1\nGRID,5,,1.,0.,0.\n=,*(-3),=,*(1.),==\nCBAR,1,1,1,5,0.,1.,0.\n"
        "=,*1,=,*4,*(-3),==\nSPC1,1,123456,1\n" + Y,
        1,
        BENT,
    ),
}


def read(folder, text):
    file = folder / "deck.bdf"
    file.write_text(text)
    return mbs.io.read_nastran(file)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROWS)
def test_displacement_is_the_closed_form(name, tmp_path):
    before, bulk, direction, wanted = ROWS[name]
    deck = read(tmp_path, before + "BEGIN BULK\n" + (bulk if "MAT1" in bulk else STUFF + bulk))
    u = deck.statics("LOAD 7" if "LOAD 7" in deck.loads else "", "")
    np.testing.assert_allclose(u[deck.names.index("GRID 2"), direction], wanted, rtol=1e-9)


@pytest.mark.parametrize(
    ("bulk", "words"),
    [
        ("SPCD,7,2,1,.03\n", "GRID 2, direction 1: no SPC holds it"),
        ("CORD2C,9,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRAV,7,9,9.81,1.,0.,0.\n", "CID 9 is not rectangular"),
        ("FORCE2,7,2,100.,1,2,1,2\n", "give no direction"),
    ],
)
def test_loads_that_cannot_be_used_say_why(bulk, words, tmp_path):
    deck = read(tmp_path, "SPC = 1\nBEGIN BULK\n" + STUFF + BAR + bulk)
    with pytest.raises(mbs.ModelError, match=words):
        deck.load("LOAD 7")


def test_temperatures_with_gradients_are_refused_where_they_are_asked_for(tmp_path):
    deck = read(tmp_path, "BEGIN BULK\n" + STUFF + BAR + "TEMPD,5,120.\nTEMPRB,5,1,220.,220.,0.,0.\n")
    with pytest.raises(mbs.ModelError, match="TEMPRB is not read"):
        deck.statics("", "TEMPERATURE 5")


@pytest.mark.parametrize(
    ("before", "bulk", "words"),
    [
        ("DEFORM = 4\n", "DEFORM,4,1,.01\n", "DEFORM is not read, and the case control chooses it"),
        ("", "PARAM,CK1,2.\n", "multiplies a whole matrix"),
        ("", "CBAR,8,1,1,2,0.,1.,0.\n,,6\n=,*1,==\n", "cards of one line are repeated"),
    ],
)
def test_what_changes_the_answer_is_refused(before, bulk, words, tmp_path):
    with pytest.raises(mbs.ModelError, match=words):
        read(tmp_path, before + "BEGIN BULK\n" + STUFF + BAR + bulk)


def test_the_mass_factor_of_the_case_control_stands_over_that_of_the_bulk_data(tmp_path):
    deck = read(tmp_path, "PARAM WTMASS 4.\nBEGIN BULK\nPARAM,WTMASS,9.\n" + STUFF + LIGHT + "CONM2,7,2,,3.\n")
    assert float(deck.mass) == 4.0
