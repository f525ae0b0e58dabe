"""Property files: kinds, units, sides, comments; faults by line."""

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles

from .tyres import WHOLE, tir_text


def written(tmp_path, text):
    path = tmp_path / "tyre.tir"
    path.write_text(text)
    return path


def test_coefficients_come_as_they_are(tmp_path):
    file = vehicles.read_tir(written(tmp_path, tir_text()))
    assert file.fit == "5.2" and file.side == "left" and file.unused == ()
    assert file.coefficients == WHOLE


def test_a_header_tables_and_comments_are_left_alone(tmp_path):
    head = "$ first\n! header\n[MDI_HEADER]\nFILE_TYPE = 'tir' ! x\n[SHAPE]\n{radial width}\n 1.0 0.0\n 1.0 0.4\n"
    file = vehicles.read_tir(written(tmp_path, tir_text(head=head, model="PROPERTY_FILE_FORMAT='PAC2002'")))
    assert file.coefficients == WHOLE and file.fit == "5.2"


def test_units_of_a_file(tmp_path):
    units = "LENGTH = 'mm'\nFORCE = 'kN'\nANGLE = 'deg'\nTIME = 'second'\nPRESSURE = 'bar'"
    own = WHOLE | {"ALPMAX": 10.0, "LONGVL": 16600.0, "NOMPRES": 2.4, "PPFX1": 0.3}
    own |= {"UNLOADED_RADIUS": 344.0, "FNOMIN": 4.85, "VERTICAL_STIFFNESS": 0.2, "VERTICAL_DAMPING": 5e-5}
    found = vehicles.read_tir(written(tmp_path, tir_text(own, units=units))).coefficients
    for name in ("UNLOADED_RADIUS", "FNOMIN", "VERTICAL_STIFFNESS", "VERTICAL_DAMPING", "PKY1"):
        np.testing.assert_allclose(found[name], WHOLE[name], rtol=1e-14)
    np.testing.assert_allclose(found["ALPMAX"], np.deg2rad(10.0))
    np.testing.assert_allclose([found["LONGVL"], found["NOMPRES"], found["PPX1"]], [16.6, 2.4e5, 0.3])


@pytest.mark.parametrize(("code", "fit"), [(5, "5.2"), (6, "5.2"), (21, "5.2"), (61, "6.1"), (62, "6.2")])
def test_kinds_of_files(tmp_path, code, fit):
    assert vehicles.read_tir(written(tmp_path, tir_text(model=f"FITTYP = {code}"))).fit == fit


def test_sides(tmp_path):
    path = written(tmp_path, tir_text(model="FITTYP = 6\nTYRESIDE = 'Right'"))
    wanted = {None: False, "left": True, "right": False}
    for side, mirrored in wanted.items():
        tyre = vehicles.Tyre.from_tir(path, side=side)
        assert tyre.model.mirrored == mirrored
    left, right = (vehicles.Tyre.from_tir(path, side=side).forces(4000.0, 0.0, 0.02) for side in ("left", "right"))
    assert abs(left.fy - right.fy) > 10.0
    symmetric = written(tmp_path, tir_text(model="FITTYP = 6\nTYRESIDE = 'SYMMETRIC'"))
    assert not vehicles.Tyre.from_tir(symmetric, side="right").model.mirrored
    with pytest.raises(ValueError, match="side"):
        vehicles.Tyre.from_tir(path, side="top")


def test_axes_of_the_forces(tmp_path):
    """A wheel that slips to the left is pushed to the right, whatever the axes are called."""
    tyre = vehicles.Tyre.from_tir(written(tmp_path, tir_text()))
    iso, sae, adapted = (
        tyre.forces(4000.0, 0.0, alpha, axes=axes)
        for alpha, axes in ((0.05, "ISO"), (-0.05, "SAE"), (0.05, "adapted SAE"))
    )
    assert iso.fy < 0 and iso.mz > 0
    np.testing.assert_array_equal(np.array(sae), np.array(adapted))
    np.testing.assert_allclose(np.array(sae), np.array(iso) * [1, -1, 1, -1, -1])
    with pytest.raises(ValueError, match="adapted SAE"):
        tyre.forces(4000.0, axes="DIN")


FAULTY = {
    "line 6: 'FITTYP = 7'": ("FITTYP = 6", "FITTYP = 7", "line 6: FITTYP = 7 is none of"),
    "neither": ("FITTYP = 6", "", "neither FITTYP nor"),
    "unit": ("'meter'", "'metre'", "line 2: there is no unit 'METRE'"),
    "number": ("= 1.6411 ", "= 1.64x ", "PCX1 = '1.64x' is no finite number"),
    "infinite": ("= 1.6411 ", "= inf ", "PCX1 = 'inf' is no finite number"),
    "underscore": ("= 1.6411 ", "= 1_6 ", "is no finite number"),
    "words": ("[COEFF", "these are words\n[COEFF", "line 7: it is neither a section nor"),
    "section": ("[UNITS]", "[UNITS", "line 1: the section has no end"),
    "twice": ("[COEFF", "PKY1 = 3\n[COEFF", "PKY1 is given before, in line 7"),
    "name": ("[COEFF", "P KY = 3\n[COEFF", "line 7: 'P KY' is no name"),
    "missing": ("PKY2 ", "PKQ2 ", "it has no PKY2"),
    "side": ("FITTYP = 6", "FITTYP = 6\nTYRESIDE = 'TOP'", "line 7: TYRESIDE"),
}


@pytest.mark.parametrize("fault", FAULTY)
@pytest.mark.filterwarnings("ignore:tyre.tir")
def test_faults_by_line(tmp_path, fault):
    old, new, message = FAULTY[fault]
    text = tir_text()
    assert old in text
    with pytest.raises(mbs.ModelFileError) as raised:
        vehicles.read_tir(written(tmp_path, text.replace(old, new, 1)))
    assert message in str(raised.value)


def test_numbers_that_no_formula_reads_are_told(tmp_path):
    with pytest.warns(UserWarning, match="no formula here reads PDXP1"):
        file = vehicles.read_tir(written(tmp_path, tir_text(WHOLE | {"PDXP1": 0.4, "PDXP2": 0.0})))
    assert file.unused == ("PDXP1",)


def test_no_file(tmp_path):
    with pytest.raises(mbs.ModelFileError, match="no such file"):
        vehicles.read_tir(tmp_path / "none.tir")
    with pytest.raises(mbs.ModelFileError, match="no such file"):
        vehicles.read_tir(tmp_path)
