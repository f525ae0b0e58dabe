"""Curves in files: round trips, pyuff, spectra, and what is wrong with a file by its line."""

import numpy as np
import pytest

from jaxmbs.errors import ModelError, ModelFileError, UnknownNameError
from jaxmbs.fatigue import psd_table
from jaxmbs.io import Curves, read_curves, read_psd, write_curves, write_psd

RNG = np.random.default_rng(5)
EVEN, ROUGH = 0.25 + 1e-3 * np.arange(40), np.array([0.0, 0.1, 0.25, 0.7])


def history(times=EVEN):
    values = 1e3 * RNG.standard_normal((len(times), 2))
    return Curves(times, values, "time", ("bolt x", "bolt, y"), ("N", ""))


@pytest.mark.parametrize("name", ["a.csv", "a.uff"])
@pytest.mark.parametrize("times", [EVEN, ROUGH])
def test_round_trip(tmp_path, name, times):
    sent = history(times)
    write_curves(tmp_path / name, sent)
    back = read_curves(tmp_path / name)
    assert (back.names, back.units, back.quantity) == (sent.names, sent.units, "time")
    np.testing.assert_allclose(back.axis, times, rtol=1e-6)
    np.testing.assert_allclose(back.values, sent.values, rtol=1e-11)
    np.testing.assert_array_equal(back["bolt, y"], back.values[:, 1])
    with pytest.raises(UnknownNameError, match="bolt z"):
        back["bolt z"]
    if times is EVEN:
        assert back.step == pytest.approx(1e-3, rel=1e-5)
    else:
        with pytest.raises(ValueError, match="not even"):
            back.step  # noqa: B018


@pytest.mark.parametrize("name", ["a.csv", "a.unv"])
@pytest.mark.parametrize("unit", ["g^2/Hz", "(m/s^2)^2/Hz"])
def test_round_trip_of_a_spectrum(tmp_path, name, unit):
    table = psd_table([20, 50, 800, 2000], [0.026, 0.16, 0.16, 0.026], "g^2/Hz")
    write_psd(tmp_path / name, table, unit=unit)
    back = read_psd(tmp_path / name)
    assert back.quantity == "acceleration"
    np.testing.assert_allclose(back.rms, table.rms, rtol=1e-9)
    assert read_psd(tmp_path / name, unit="any").quantity == "any"
    with pytest.raises(ModelError, match="N\\^2/Hz"):
        write_psd(tmp_path / name, table, unit="N^2/Hz")


@pytest.mark.parametrize("times", [EVEN, ROUGH])
def test_pyuff_reads_the_file(tmp_path, times):
    pyuff = pytest.importorskip("pyuff")
    sent = history(times)
    write_curves(tmp_path / "a.uff", sent)
    found = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    assert [one["func_type"] for one in found] == [1, 1]
    np.testing.assert_allclose(found[1]["x"], times, rtol=1e-6)
    np.testing.assert_allclose(found[1]["data"], sent.values[:, 1], rtol=1e-11)
    assert found[0]["ordinate_axis_units_lab"].strip() == "N"


def test_a_file_of_pyuff(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    f, levels = np.array([20.0, 50.0, 800.0]), np.array([0.026, 0.16, 0.16])
    one = pyuff.prepare_58(
        **dict(func_type=9, rsp_node=4, rsp_dir=3, ref_node=0, ref_dir=0, x=f, data=levels, binary=0),
        **dict(id1="NONE", id4="NONE", id5="NONE", abscissa_spacing=0, abscissa_spec_data_type=18),
        **dict(
            ordinate_spec_data_type=12,
            ordinate_axis_units_lab="g^2/Hz",
            z_axis_spec_data_type=0,
            orddenom_spec_data_type=0,
        ),
    )
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets([one], mode="overwrite")
    assert read_curves(tmp_path / "a.uff").names == ("4 z",)
    np.testing.assert_allclose(read_psd(tmp_path / "a.uff").rms, psd_table(f, levels, "g^2/Hz").rms, rtol=1e-9)


def test_csv_of_others(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("# logger 7\n\nTime [ms]; a [g]\n0; 1.5\n2; -2\n", encoding="utf-8-sig")
    found = read_curves(path)
    np.testing.assert_allclose(found.axis, [0.0, 2e-3])
    np.testing.assert_allclose(found["a"], [1.5, -2.0])


@pytest.mark.parametrize(
    "text, fault",
    [
        ("", "empty"),
        ("0,1\n1,2\n", "line 1: names and units are missing"),
        ("time,a\n0,1\n1,2\n", r"time \[\]"),
        ("time [h],a\n0,1\n1,2\n", r"time \[h\]"),
        ("depth [m],a\n0,1\n1,2\n", "line 1: the first column is 'depth'"),
        ("time [s]\n0\n", "line 1: one column alone"),
        ("time [s],a\n0,1\n1\n", "line 3: it has 1 columns"),
        ("time [s],a\n0,1\n1,b\n", "line 3: 'a' is 'b', no number"),
        ("time [s],a\n0,1\n1,2\n\n1,3\n", "line 5: the time 1 does not rise"),
        ("time [s],a\n0,1\n1,nan\n", "line 3: 'a' is not finite"),
        ("time [s],a,a\n0,1,1\n1,2,2\n", "two curves are named 'a'"),
        ("time [s],a\n0,1\n", "fewer than two points"),
        ("time [s],a\n", "no numbers"),
    ],
)
def test_faults_by_line(tmp_path, text, fault):
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(ModelFileError, match=fault) as found:
        read_curves(path)
    assert "wrong.csv" in str(found.value)


def test_faults_of_spectra(tmp_path):
    path = tmp_path / "a.csv"
    for text, fault in (
        ("time [s],a [g^2/Hz]\n0,1\n1,2\n", "over time"),
        ("frequency [Hz],a [g^2/Hz],b\n1,1,1\n2,2,2\n", "several"),
        ("frequency [Hz],a [g]\n1,1\n2,2\n", "'g'"),
        ("frequency [Hz],a [g^2/Hz]\n0,1\n2,2\n", "0 Hz"),
        ("frequency [Hz],a [g^2/Hz]\n1,0\n2,2\n", "positive"),
    ):
        path.write_text(text)
        with pytest.raises(ModelFileError, match=fault):
            read_psd(path)


def test_faults_of_universal_files(tmp_path):
    path = tmp_path / "a.uff"
    write_curves(path, history())
    whole = path.read_text().splitlines()
    path.write_text("\n".join(whole[:20]))
    with pytest.raises(ModelFileError):
        read_curves(path)
    path.write_text("\n".join([whole[0], f"{151:6d}", "nothing", "    -1"]) + "\n")
    with pytest.raises(ModelFileError, match="no curves"):
        read_curves(path)


@pytest.mark.parametrize("name", ["a.csv", "a.uff"])
def test_names_that_a_file_cannot_hold(tmp_path, name):
    wrong = Curves(ROUGH, np.zeros((4, 1)), "time", (" a",), ("N",))
    with pytest.raises(ModelError, match="blanks"):
        write_curves(tmp_path / name, wrong)
    assert not (tmp_path / name).exists()
