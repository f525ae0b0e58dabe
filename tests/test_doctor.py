"""The report names what it should, and advises where there is something to say."""

import jax
import pytest

from jaxmbs import doctor


def test_report_names_versions_devices_and_settings(capsys):
    assert doctor.main() == 0
    text = capsys.readouterr().out
    for word in ("python", "jaxlib", jax.__version__, "equinox", "diffrax", "devices", "x64        on"):
        assert word in text


@pytest.mark.parametrize(("version", "advised"), [("0.10.2", True), ("0.11.2", True), ("0.12.0.1", False)])
def test_flag_is_advised_before_jax_0_12(monkeypatch, version, advised):
    monkeypatch.delenv("XLA_FLAGS", raising=False)
    monkeypatch.setattr(doctor, "_version", lambda name: version)
    monkeypatch.setattr(jax, "default_backend", lambda: "cpu")
    assert ("XLA_FLAGS" in doctor.report()) == advised


def test_bad_release_is_named(monkeypatch):
    monkeypatch.setattr(doctor, "_version", lambda name: "0.11.1")
    assert "jax 0.11.1 makes scans" in doctor.report()
