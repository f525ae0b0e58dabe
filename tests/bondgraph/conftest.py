"""Graphs that the tests of this room share."""

import pytest

import jaxmbs as mbs
from jaxmbs.bondgraph._views import VIEWS

from ..zoo import SPECIMENS
from . import cases


@pytest.fixture(scope="session")
def graphs():
    """All views of the cases, with their strokes, by "case view"."""
    systems = {
        "pendulum": cases.double_pendulum(),
        "points": cases.double_pendulum(0.0),
        "crank": cases.slider_crank(),
        "arm": SPECIMENS["driven"].system,
        "beam": SPECIMENS["elastic"].system,
    }
    return {
        f"{name} {view}": mbs.bondgraph.bond_graph(system, view) for name, system in systems.items() for view in VIEWS
    }
