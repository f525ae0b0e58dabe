"""Cases of parametrised tests, some of which are long ones."""

from collections.abc import Iterable

import pytest


def cases(values: Iterable, long: Iterable = (), rest=()) -> list:
    """Values for `parametrize`: those among `long` are long tests, the others have the mark `rest`."""
    long = list(long)
    return [pytest.param(value, marks=pytest.mark.long if value in long else rest) for value in values]
