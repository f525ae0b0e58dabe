"""Modes of universal files: those that pyuff writes, the format by hand, and spoilt ones."""

import re
import warnings

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.errors import ModelFileError
from jaxmbs.io import read_uff_modes

HEAD = "    -1\n    55\nmade here\nNONE\nNONE\nNONE\nNONE\n"
NORMAL = (
    HEAD
    + """         1         2         2         8         2         3
         2         4         1         1
  1.21800E+01  1.00000E+00  1.00000E-02  0.00000E+00
         3
  0.00000E+00  0.00000E+00  7.10000E-01
        12
  0.00000E+00  0.00000E+00 -1.50000E-01
    -1
"""
)
SECOND = NORMAL.replace("1.21800E+01", "2.94100E+01").replace("         1\n  2", "         2\n  2")
SECOND = SECOND.replace("7.10000E-01", "2.00000E+00").replace("1.00000E-02  0.00000E+00", "0.00000E+00  6.00000E-02")
COMPLEX = (
    HEAD
    + """         1         3         3        11         5         6
         2         6         1         1
 -3.00000E+00  4.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00
        12
  1.00000E+00-2.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00
  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  3.00000E+00  1.00000E+00
    -1
"""
)
MM = f"    -1\n   164\n{5:10d}{'mm (milli newton)':>20}{2:10d}\n{1e3:25.17E}{1e3:25.17E}{1.0:25.17E}\n    -1\n"


def read(content, folder):
    (folder / "a.uff").write_text(content)
    return read_uff_modes(folder / "a.uff")


def test_the_format_by_hand(tmp_path):
    """Ascending, whatever their order; only the direction that was measured; a hysteretic ratio is halved."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read(SECOND + NORMAL, tmp_path)
    assert found.channels == ("3 z", "12 z")
    np.testing.assert_allclose(found.frequencies, [12.18, 29.41])
    np.testing.assert_allclose(found.shapes, [[0.71, 2.0], [-0.15, -0.15]])
    np.testing.assert_allclose(found.damping, [0.01, 0.03])
    assert read(NORMAL.replace("1.00000E-02", "0.00000E+00"), tmp_path).damping is None


def test_nodes_of_zeros_may_be_left_out(tmp_path):
    first = "".join(line for k, line in enumerate(NORMAL.splitlines(True)) if k not in (12, 13))
    found = read(first + SECOND, tmp_path)
    np.testing.assert_allclose(found.shapes, [[0.71, 2.0], [0.0, -0.15]])


@pytest.mark.parametrize("partner", ["none", "beside", "alone"])
def test_complex_eigenvalues(partner, tmp_path):
    """Of conjugates one; fields that touch; a rotation is in rad and a translation in m."""
    conjugate = COMPLEX.replace(" 4.00000E+00", "-4.00000E+00").replace("-2.00000E+00", " 2.00000E+00")
    conjugate = conjugate.replace("3.00000E+00  1.00000E+00", "3.00000E+00 -1.00000E+00")
    content = {"none": COMPLEX, "beside": conjugate + COMPLEX, "alone": conjugate}[partner]
    found = read(MM + content, tmp_path)
    assert found.channels == ("12 x", "12 rz")
    np.testing.assert_allclose(found.frequencies, [5.0 / (2 * np.pi)])
    np.testing.assert_allclose(found.damping, [0.6])
    np.testing.assert_allclose(found.shapes[:, 0], [1e-3 * (1 - 2j), 3 + 1j])


@pytest.mark.parametrize("is_complex", [False, True])
def test_files_of_pyuff(is_complex, tmp_path):
    """Five modes at three nodes in three directions, and a transfer function that is left out."""
    pyuff = pytest.importorskip("pyuff")
    random, roots = np.random.default_rng(2), np.array([[-0.3 + 20.0j * k] for k in range(1, 6)])
    shapes = random.normal(size=(5, 3, 3)) + (1j * random.normal(size=(5, 3, 3)) if is_complex else 0.0)
    sets = []
    for k, (root, shape) in enumerate(zip(roots[:, 0], shapes, strict=True)):
        own = {"eig": root} if is_complex else {"freq": abs(root) / (2 * np.pi), "modal_damp_vis": 0.02}
        sets.append(
            pyuff.prepare_55(
                **dict(model_type=1, analysis_type=3 if is_complex else 2, data_ch=2, spec_data_type=8),
                **dict(data_type=5 if is_complex else 2, n_data_per_node=3, load_case=1, mode_n=k + 1),
                **dict(r1=shape[:, 0], r2=shape[:, 1], r3=shape[:, 2], node_nums=[7, 3, 120]),
                **own,
            )
        )
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets(sets[::-1], mode="overwrite")
    found = read_uff_modes(tmp_path / "a.uff")
    assert found.channels == tuple(f"{node} {axis}" for node in (3, 7, 120) for axis in "xyz")
    np.testing.assert_allclose(found.frequencies, np.abs(roots[:, 0]) / (2 * np.pi), rtol=1e-5)
    np.testing.assert_allclose(found.damping, 0.3 / np.abs(roots[:, 0]) if is_complex else 0.02, rtol=1e-5)
    assert np.iscomplexobj(found.shapes) == is_complex
    np.testing.assert_allclose(found.shapes.T, shapes[:, [1, 0, 2]].reshape(5, 9), rtol=1e-5, atol=1e-5)


SPOILT = {
    r"data set 55 at line 1: node 12 has 2 numbers, not 3": lambda s: s.replace("-1.50000E-01", ""),
    r"has no end: the file is cut off": lambda s: s[:-8],
    r"line 1: 'nan' is not a number|node 12 are not finite": lambda s: s.replace("-1.50000E-01", " nan"),
    r"line 16.*: 'here' is not a number": lambda s: SECOND + s.replace("-1.50000E-01", "here"),
    r"1 values per node, of the characteristic 1": lambda s: s.replace(
        f"{2:10d}{8:10d}{2:10d}{3:10d}", f"{1:10d}{8:10d}{2:10d}{1:10d}"
    ),
    r"data type 4 is neither real": lambda s: s.replace(f"{8:10d}{2:10d}{3:10d}", f"{8:10d}{4:10d}{3:10d}"),
    r"node 3 is there twice": lambda s: s.replace(f"{12:10d}", f"{3:10d}"),
    r"where a node number should": lambda s: s.replace(f"{12:10d}", "    twelve"),
    r"at line 16: mode 1 of 12.18 Hz is there twice": lambda s: s + s,
    r"header of 8 lines is cut off": lambda s: "".join(s.splitlines(True)[:7]) + "    -1\n",
    r"its eigenvalue cannot be read": lambda s: s.replace("1.21800E+01", "        inf"),
    r"no modes .*: it has 1 x data of a frequency response analysis": lambda s: s.replace(
        f"{1:10d}{2:10d}{2:10d}", f"{1:10d}{5:10d}{2:10d}", 1
    ),
    r"no modes .*: it has 1 x shape of stress": lambda s: s.replace(f"{2:10d}{8:10d}", f"{2:10d}{2:10d}"),
    r"no modes .*: it has 1 x rigid": lambda s: s.replace("1.21800E+01", "0.00000E+00"),
    r"shapes of all its modes are zero": lambda s: "".join(s.splitlines(True)[:10]) + "    -1\n",
    r"it has no modes": lambda s: "",
}


@pytest.mark.parametrize("message", SPOILT)
def test_spoilt_files(message, tmp_path):
    spoilt = SPOILT[message](NORMAL)
    assert spoilt != NORMAL
    with pytest.raises(ModelFileError) as told:
        read(spoilt, tmp_path)
    assert re.search(message, "\n".join(told.value.faults))


def test_faults_are_in_one_report(tmp_path):
    twice = NORMAL.replace(f"{12:10d}", f"{3:10d}") + SECOND.replace("-1.50000E-01", "here")
    with pytest.raises(ModelFileError) as told:
        read(twice, tmp_path)
    assert len(told.value.faults) == 2


def test_the_rest_is_left_out_and_said(tmp_path):
    rigid = NORMAL.replace("1.21800E+01", "0.00000E+00")
    undamped = SECOND.replace("6.00000E-02", "0.00000E+00")
    with pytest.warns(UserWarning, match="1 x rigid or overdamped mode, 1 x damping, as some ratios"):
        found = read(MM + rigid + NORMAL + undamped, tmp_path)
    assert len(found.frequencies) == 2 and found.damping is None


def test_two_hundred_changed_bytes(tmp_path):
    """Modes, or an error of ours."""
    random, good, count = np.random.default_rng(0), (MM + NORMAL + COMPLEX).encode(), 0
    for _ in range(200):
        content = bytearray(good)
        at = random.integers(0, len(content))
        content[at : at + random.integers(1, 30)] = random.bytes(random.integers(0, 3))
        (tmp_path / "a.uff").write_bytes(content)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read_uff_modes(tmp_path / "a.uff")
        except mbs.ModelError:
            count += 1
    assert count > 40
