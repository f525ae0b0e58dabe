"""Stresses of decks under warming, spin and pressure on faces, against closed forms."""

import numpy as np
import pytest

from jaxmbs.io import read_nastran

E, NU, ALPHA, RHO = 2e11, 0.3, 1.2e-5, 7850.0
STEEL = f"MAT1,1,{E:.1e},,{NU},{RHO},{ALPHA},20.\n"
BRICK = "GRID,1\nGRID,2,,1.,0.,0.\nGRID,3,,1.1,1.,0.\nGRID,4,,0.,.9,0.\n"
BRICK += "GRID,5,,0.,0.,.5\nGRID,6,,1.,0.,.5\nGRID,7,,1.1,1.,.5\nGRID,8,,0.,.9,.5\n"
MIXED = STEEL + BRICK + "PSHELL,1,1,.01,1,,1\nPSOLID,2,1\nPROD,3,1,.01\n"
MIXED += "CQUAD4,1,1,1,2,3,4\nCTRIA3,2,1,1,2,3\nCHEXA,3,2,1,2,3,4,5,6\n,7,8\nCROD,4,3,1,2\nTEMPD,5,120.\n"


def read(folder, text, **options):
    (folder / "deck.bdf").write_text("BEGIN BULK\n" + text + "ENDDATA\n")
    return read_nastran(folder / "deck.bdf", **options)


@pytest.mark.long
def test_held_and_free_warming(tmp_path):
    """Held: -E a dT, with 1 / (1 - nu) in the plane and 1 / (1 - 2 nu) in space; free: no stress at all."""
    deck = read(tmp_path, MIXED + "SPC1,1,123456,1\nSPC1,1,23,2\nSPC1,1,3,4\n")
    stress = E * ALPHA * 100.0
    plane, space = [-stress / (1 - NU)] * 2 + [0.0], [-stress / (1 - 2 * NU)] * 3 + [0.0] * 3
    still = np.zeros((8, 6))
    held, corners = deck.stresses(still, "TEMPERATURE 5"), deck.corner_stresses(still, "TEMPERATURE 5")
    for name in ("CQUAD4 1", "CTRIA3 1"):
        np.testing.assert_allclose(held[name][0], plane * 2, rtol=1e-9, atol=1e-3 * stress * 1e-6)
        np.testing.assert_allclose(corners[name][0, -1], plane * 2, rtol=1e-9, atol=1e-3 * stress * 1e-6)
    np.testing.assert_allclose(held["CHEXA 2"][0], space, rtol=1e-9, atol=1e-9 * stress)
    np.testing.assert_allclose(corners["CHEXA 2"][0], [space] * 8, rtol=1e-9, atol=1e-9 * stress)
    np.testing.assert_allclose(deck.forces(still, "TEMPERATURE 5")["CROD 3"][0, 0], -0.01 * stress, rtol=1e-9)
    u = deck.statics("", "TEMPERATURE 5")
    np.testing.assert_allclose(u[:, :3], ALPHA * 100.0 * np.asarray(deck.positions), atol=1e-12)
    for values in [*deck.stresses(u, "TEMPERATURE 5").values(), *deck.corner_stresses(u, "TEMPERATURE 5").values()]:
        assert np.abs(values).max() < 1e-7 * stress


@pytest.mark.long
def test_warmed_layers_bend(tmp_path):
    """Timoshenko's bimetal (J. Opt. Soc. Am. 11 (1925) 233-255), free; moments of its ply stresses are zero."""
    soft = "MAT1,2,1.+11,,.3,,2.4-5\n"
    text = STEEL + soft + BRICK.split("GRID,5")[0] + "PCOMP,1,,,,,20.\n,2,.001,0.,,1,.002,90.\n"
    deck = read(tmp_path, text + "CQUAD4,1,1,1,2,3,4\nTEMPD,5,70.\nSPC1,1,123456,1\n")
    m, n, h = 0.5, 0.5, 0.003  # thickness and modulus of the lower layer over those of the upper one
    curvature = 6 * (2.4e-5 - ALPHA) * 50 * (1 + m) ** 2 / h
    curvature /= 3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))
    u = np.asarray(deck.statics("", "TEMPERATURE 5"))
    square = np.sum(np.asarray(deck.positions) ** 2, axis=1)
    np.testing.assert_allclose(u[:, 2], 0.5 * curvature * square, rtol=1e-6)
    plies = np.asarray(deck.ply_stresses(u, "TEMPERATURE 5")["CQUAD4 1"])[0]
    assert np.abs(plies[0]).max() > 1e6
    np.testing.assert_allclose(
        [0.001, 0.002] @ plies[:, 1, :2], 0.0, atol=1e-6
    )  # mean stresses, fibres at right angles
    np.testing.assert_allclose(plies[1, 2, 0], plies[1, 2, 1], rtol=1e-9)
    with pytest.raises(KeyError, match="TEMPERATURE 6"):
        deck.stresses(u, "TEMPERATURE 6")


@pytest.mark.slow
def test_a_warmed_ply(tmp_path):
    """A free ply of MAT8 at 90 degrees stretches by a2 along x and by a1 along y, without stress."""
    ply = "MAT8,8,140.+9,10.+9,.3,5.+9,4.+9,3.+9,1600.\n,1.-6,2.-5\n"
    text = ply + BRICK.split("GRID,5")[0] + "PCOMP,1\n,8,.001,90.\n"
    deck = read(tmp_path, text + "CTRIA3,1,1,1,2,3,0\nCTRIA3,2,1,1,3,4,0\nTEMPD,5,50.\nSPC1,1,123456,1\n")
    u = np.asarray(deck.statics("", "TEMPERATURE 5"))
    np.testing.assert_allclose(u[1, 0], 2e-5 * 50, rtol=1e-6)
    assert np.abs(np.asarray(deck.ply_stresses(u, "TEMPERATURE 5")["CTRIA3 1"])).max() < 1.0


def column(kind):
    """Bricks, or wedges, along x: 4 x 1 x 1 of a square section, without contraction; nodes in squares of four."""
    text = f"MAT1,1,{E:.1e},,0.,{RHO}\nPSOLID,2,1\n"
    square = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    text += "".join(f"GRID,{4 * i + k + 1},,{i}.,{y},{z}\n" for i in range(5) for k, (y, z) in enumerate(square))
    for i in range(4):
        a, b, c, d, e, f, g, h = range(4 * i + 1, 4 * i + 9)
        if kind == "CHEXA":
            text += f"CHEXA,{i + 1},2,{a},{b},{c},{d},{e},{f}\n,{g},{h}\n"
        else:
            text += f"CPENTA,{2 * i + 1},2,{a},{b},{c},{e},{f},{g}\nCPENTA,{2 * i + 2},2,{a},{c},{d},{e},{g},{h}\n"
    return text + "SPC1,1,123,1,2,3,4\n"


@pytest.mark.parametrize(
    "kind", [pytest.param("CHEXA", marks=pytest.mark.slow), pytest.param("CPENTA", marks=pytest.mark.long)]
)
def test_a_column_of_solids(kind, tmp_path):
    """RFORCE: rho w^2 l^3 / 3 E at its end, exact at the nodes; PLOAD4 on its end: the stress is the pressure."""
    ends = (
        ["PLOAD4,3,4,5.+6,,,,17,19\n"] if kind == "CHEXA" else ["PLOAD4,3,7,5.+6,,,,17\n", "PLOAD4,3,8,5.+6,,,,17\n"]
    )
    pushed = [end.replace("PLOAD4,3", "PLOAD4,4").rstrip() + ("\n" if end else "") + ",,0.,3.,4.\n" for end in ends]
    text = column(kind) + "RFORCE,2,,,2.,0.,0.,1.\n" + "".join([*ends, *pushed])
    deck = read(tmp_path, text, masses="consistent")
    u = np.asarray(deck.statics("LOAD 2", ""))
    w = 4 * np.pi
    np.testing.assert_allclose(u[16:, 0].mean(), RHO * w**2 * 4.0**3 / (3 * E), rtol=2e-2)
    root = deck.stresses(u)[f"{kind} 2"]
    np.testing.assert_allclose(np.asarray(root)[0, 0], RHO * w**2 * (16 - 0.25) / 2, rtol=2e-2)
    u = deck.statics("LOAD 3", "")
    for values in deck.corner_stresses(u).values():
        np.testing.assert_allclose(values[..., 0], -5e6, rtol=1e-9)
    total = np.asarray(deck.load("LOAD 4", "")).sum(axis=0)
    np.testing.assert_allclose(total[:3], [0.0, 3e6, 4e6], atol=1e-3)
