"""Bars of steps: text in a terminal; in a notebook one output of HTML, without widgets, that changes."""

import sys

import IPython
import pytest
from IPython.display import display as shown

from jaxmbs.runtime import _step_bar
from jaxmbs.runtime._step_bar import step_bar


@pytest.fixture
def outputs(monkeypatch):
    """What a notebook is given to show: (bundle, place, whether it changes what is shown)."""
    found: list = []

    def display(bundle, *, raw, display_id, update):
        assert raw
        found.append((bundle, display_id, update))

    monkeypatch.setattr(_step_bar, "is_notebook", lambda: True)
    monkeypatch.setattr(IPython.display, "display", display)
    assert shown is not display
    return found


def test_a_notebook_keeps_one_output(outputs, capfd):
    with step_bar(3, "minimise <x>", unit=" designs") as bar:
        bar.mininterval = 0.0
        for _ in range(3):
            bar.update()
    bundles, places, updates = zip(*outputs, strict=True)
    assert len(set(places)) == 1 and updates == (False,) + (True,) * (len(updates) - 1)
    assert 'value="3" max="3"' in bundles[-1]["text/html"] and "100%" in bundles[-1]["text/plain"]
    assert "minimise &lt;x&gt;" in bundles[-1]["text/html"] and "3/3" in bundles[-1]["text/html"]
    assert capfd.readouterr() == ("", "")


def test_nothing_is_shown_where_it_is_not_wanted(outputs, capfd):
    with step_bar(3, "sweep", is_wanted=False) as bar:
        bar.update()
    assert not outputs and capfd.readouterr() == ("", "")


def test_a_terminal_gets_text(capfd):
    assert not _step_bar.is_notebook() or "ipykernel" in sys.modules
    with step_bar(2, "sweep") as bar:
        bar.update(2)
    assert "sweep: 100%" in capfd.readouterr().err
