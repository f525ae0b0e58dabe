"""Files of matrices: what SciPy and pyYeti write, and files that are spoilt."""

import os
import warnings

import numpy as np
import pytest
import scipy.io
import scipy.sparse

import jaxmbs as mbs
from jaxmbs.io._matrix_market import parse_matrix_market

op4 = pytest.importorskip("pyyeti.nastran").op4
K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -0.5], [0.0, -0.5, 1.5]])
DMIG = "".join(
    f"DMIG    {name}           0       6       2       0                       1\n"
    f"DMIG*   {name}                           1               1\n*                      1               1 2.0D+00\n"
    for name in ("KAAX", "MAAX")
)
READERS = {
    "a.op4": (lambda path: op4.write(str(path), {"mxx": np.eye(3), "kxx": K}, binary=False), mbs.io.read_op4),
    "b.op4": (lambda path: op4.write(str(path), {"mxx": np.eye(3), "kxx": K}, binary=True), mbs.io.read_op4),
    "a.pch": (lambda path: path.write_text(DMIG), mbs.io.read_dmig),
    "a.mtx": (
        lambda path: scipy.io.mmwrite(str(path), K, symmetry="symmetric"),
        lambda path: mbs.io.read_matrix_market(path, path),
    ),
    "b.mtx": (
        lambda path: scipy.io.mmwrite(str(path), scipy.sparse.coo_matrix(K)),
        lambda path: mbs.io.read_matrix_market(path, path),
    ),
}


@pytest.mark.parametrize("form", [np.asarray, scipy.sparse.coo_matrix])
@pytest.mark.parametrize("symmetry", ["general", "symmetric", "skew-symmetric"])
def test_matrix_market_beside_scipy(form, symmetry, tmp_path):
    random = np.random.default_rng(0)
    A = random.normal(size=(5, 5)) * (random.random((5, 5)) < 0.7)
    A = {"general": A[:, :4], "symmetric": A + A.T, "skew-symmetric": A - A.T}[symmetry]
    scipy.io.mmwrite(str(tmp_path / "a.mtx"), form(A), symmetry=symmetry, precision=17)
    found = parse_matrix_market(str(tmp_path / "a.mtx"))
    np.testing.assert_allclose(found if form is np.asarray else found.toarray(), A, rtol=1e-15)


@pytest.mark.parametrize("name", READERS)
def test_spoilt_files_have_worded_errors(name, tmp_path):
    """Empty, zeros, text, cut off, a folder, and forty changes."""
    write, read = READERS[name]
    path = tmp_path / name
    write(path)
    assert read(path).num_rows in (1, 3)
    good, random = path.read_bytes(), np.random.default_rng(0)
    for content in (b"", bytes(300), b"garbage text\n" * 10, good[: len(good) // 3]):
        path.write_bytes(content)
        with pytest.raises(mbs.ModelFileError, match=name):
            read(path)
    for _ in range(40):
        content = bytearray(good)
        at = random.integers(0, len(content))
        content[at : at + random.integers(0, 20)] = random.bytes(random.integers(0, 4))
        path.write_bytes(content)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                read(path)
            except mbs.ModelError:
                pass
    with pytest.raises(mbs.ModelFileError, match="no regular file|directory"):
        read(tmp_path)
    with pytest.raises(mbs.ModelFileError, match="No such file"):
        read(tmp_path / "none")


@pytest.mark.parametrize(
    "read",
    [
        *(mbs.io.read_op4, mbs.io.read_dmig, mbs.io.read_uff, mbs.io.read_urdf, mbs.io.read_mjcf, mbs.load_model),
        *(mbs.io.read_mesh, mbs.io.read_nastran, lambda path: mbs.io.read_matrix_market(path, path)),
    ],
)
def test_pipes_are_not_waited_for(read, tmp_path):
    path = tmp_path / "pipe.msh"
    os.mkfifo(path)
    with pytest.raises(mbs.ModelError, match="no regular file"):
        read(path)
