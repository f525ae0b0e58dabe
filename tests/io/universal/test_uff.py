"""Universal files: out and in again."""

import numpy as np
import pytest

from jaxmbs.errors import ModelError
from jaxmbs.io import read_uff, write_uff
from jaxmbs.linear._transfer import TransferFunctions

pyuff = pytest.importorskip("pyuff")


def example(outputs, inputs, kind="accelerance"):
    r = np.random.default_rng(1)
    shape = (12, len(outputs), len(inputs))
    values = 1e-3 * (r.normal(size=shape) + 1j * r.normal(size=shape))
    return TransferFunctions(np.linspace(10.0, 900.0, 12) ** 1.1, values, outputs, inputs, kind)


@pytest.mark.parametrize("kind", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize(
    ("outputs", "inputs"),
    [(["12 x", "12 -rz", "7 y"], ["12 x", "3 z"]), (["wing tip x", "mast"], ["a shaker with a long name z"])],
)
def test_round_trip(tmp_path, outputs, inputs, kind):
    sent = example(outputs, inputs, kind)
    write_uff(tmp_path / "a.uff", sent)
    back = read_uff(tmp_path / "a.uff")
    assert (back.outputs, back.inputs, back.kind) == (sent.outputs, sent.inputs, sent.kind)
    np.testing.assert_allclose(back.values, sent.values, rtol=1e-10)
    np.testing.assert_allclose(back.omega, sent.omega, rtol=1e-5)
    raw = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    if outputs[0] == "12 x":
        assert [(s["rsp_node"], s["rsp_dir"]) for s in raw[::2]] == [(12, 1), (12, -6), (7, 2)]


def test_a_file_of_others(tmp_path):
    """No names in the ID lines: node and direction; and what is missing is told."""
    path = tmp_path / "b.uff"
    f = np.array([1.0, 2.0, 3.0])
    sets = [
        pyuff.prepare_58(
            func_type=4,
            **dict(rsp_node=n, rsp_dir=d, ref_node=5, ref_dir=-2, x=f, data=(n + 1j) * f),
            **dict(ordinate_spec_data_type=12, orddenom_spec_data_type=13, abscissa_spec_data_type=18),
            **dict(id1="NONE", id4="NONE", id5="NONE", abscissa_spacing=1, binary=0, z_axis_spec_data_type=0),
        )
        for n, d in ((1, 3), (2, 1))
    ]
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
    found = read_uff(path)
    assert (found.outputs, found.inputs, found.kind) == (("1 z", "2 x"), ("5 -y",), "accelerance")
    np.testing.assert_allclose(found.values[:, 1, 0], (2 + 1j) * f)
    np.testing.assert_allclose(found.omega, 2 * np.pi * f)
    other = dict(sets[0], ref_node=6)
    pyuff.UFF(str(path)).write_sets([*sets, other, dict(sets[1])], mode="overwrite")
    with pytest.raises(ModelError, match="2 x by 6 -y is missing") as told:
        read_uff(path)
    assert any("2 times" in fault for fault in told.value.faults)


def test_long_names_are_told(tmp_path):
    with pytest.raises(ModelError, match="longer than 70"):
        write_uff(tmp_path / "c.uff", example(["x" * 71], ["a"]))
