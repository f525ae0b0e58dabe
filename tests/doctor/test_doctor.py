"""The report names what it should, and advises where there is something to say."""

import jax
import pytest

from jaxmbs import doctor
from jaxmbs.doctor._compiler_check import WrongProgram
from jaxmbs.runtime._compiler_options import SMALL_LOOPS
from jaxmbs.runtime._tricks import TRICKS


@pytest.fixture(autouse=True)
def right_compiler(monkeypatch):
    """The programs of the check have tests of their own."""
    monkeypatch.setattr(doctor, "wrong_programs", lambda: iter(()))


def test_report_names_versions_devices_and_settings(capsys):
    assert doctor.main() == 0
    text = capsys.readouterr().out
    for word in (
        "python",
        "jaxlib",
        jax.__version__,
        "equinox",
        "diffrax",
        "devices",
        "x64        on",
        "12 of 12",
        "tapes      leave programs with these operations to XLA: approx_top_k",
        *TRICKS,
    ):
        assert word in text


@pytest.mark.parametrize(
    ("version", "flag", "advised"),
    [
        ("0.10.2", "", True),  # the library marks loops of motions, the flag all
        ("0.10.2", SMALL_LOOPS, False),
        ("0.11.2", "", True),
        ("0.11.2", SMALL_LOOPS, False),
        ("0.12.0.1", "", False),
    ],
)
def test_flag_is_advised_only_where_it_helps(monkeypatch, version, flag, advised):
    monkeypatch.setenv("XLA_FLAGS", flag)
    monkeypatch.setattr(doctor, "_version", lambda name: version)
    monkeypatch.setattr(jax, "default_backend", lambda: "cpu")
    advice = doctor.report().split("\n\n")[-1]
    assert ("XLA_FLAGS" in advice) == advised
    assert not advised or ("motions" in advice) == (version == "0.11.2")


def test_bad_release_is_named(monkeypatch):
    monkeypatch.setattr(doctor, "_version", lambda name: "0.11.1")
    assert "jax 0.11.1 makes scans" in doctor.report()


def test_programs_compiled_wrongly_are_named(monkeypatch):
    monkeypatch.setattr(doctor, "wrong_programs", lambda: iter([WrongProgram("cumulative sum", "jax.jit", 3, 20)]))
    report = doctor.report()
    assert "11 of 12 small programs" in report and "cumulative sum (jax.jit): 3 of 20 numbers are wrong" in report
    assert "take another release" in report
