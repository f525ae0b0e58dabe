"""Tables that the measuring plugins of the tests print: CPU seconds, and parts of tolerances."""

import numpy as np
import pytest

from tests import compared, cpu_seconds


def test_seconds_by_folder(tmp_path, capsys):
    (tmp_path / "cpu.gw0").write_text("2.0 tests/motion/test_a.py::test_x\n4.0 tests/io/test_b.py::test_y[a b]\n")
    (tmp_path / "cpu.gw1").write_text("1.0 tests/motion/test_c.py::test_z\n")
    cpu_seconds.main(str(tmp_path / "cpu"))
    assert capsys.readouterr().out.splitlines() == ["| io | 1 | 4 |", "| motion | 2 | 3 |"]
    cpu_seconds.main(str(tmp_path / "cpu"), 1.5)
    dear = capsys.readouterr().out
    assert "test_x" in dear and "test_y[a b]" in dear and "test_z" not in dear


def test_parts_of_tolerances(tmp_path, capsys):
    compared._found.clear()
    compared._measured([1.0, 2.2, np.inf], [1.0, 2.0, np.inf], rtol=0.0, atol=0.5)
    assert compared._found == [(2, pytest.approx(0.4))]
    with pytest.raises(AssertionError):
        compared._measured(1.0, 2.0, rtol=0.1)
    compared._found.clear()
    (tmp_path / "log.main").write_text("3 0.5 tests/a.py::x\n4 0.25 tests/a.py::y[b c]\n1 0.9 tests/b.py::z\n")
    compared.main(str(tmp_path / "log"))
    rows = capsys.readouterr().out.splitlines()[2:]
    assert rows == [
        "| `tests/a.py` | 2 | 7 | 0.5 |",
        "| `tests/b.py` | 1 | 1 | 0.9 |",
    ]
