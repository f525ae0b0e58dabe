"""Fixtures for tests of the tricks themselves."""

import pytest

from jaxmbs.runtime._tricks import OFF


@pytest.fixture
def tricks_on():
    """All tricks are on, whatever `JAXMBS_TRICKS` says of the other tests."""
    with OFF(frozenset()):
        yield
