"""The report names what it should, and advises where there is something to say."""

import jax
import pytest

from jaxmbs import doctor
from jaxmbs.runtime._compiler_options import SMALL_LOOPS
from jaxmbs.runtime._tricks import TRICKS


def test_report_names_versions_devices_and_settings(capsys):
    assert doctor.main() == 0
    text = capsys.readouterr().out
    for word in ("python", "jaxlib", jax.__version__, "equinox", "diffrax", "devices", "x64        on", *TRICKS):
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
