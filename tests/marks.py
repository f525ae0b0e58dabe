"""Cases of parametrised tests, some of which are slow or long ones."""

from collections.abc import Iterable

import pytest


def cases(values: Iterable, long: Iterable = (), slow: Iterable = (), rest=()) -> list:
    """Values for `parametrize`: those among `long` and `slow` have that mark, the others the marks `rest`."""
    long, slow = list(long), list(slow)
    marks = lambda value: pytest.mark.long if value in long else pytest.mark.slow if value in slow else rest
    return [pytest.param(value, marks=marks(value)) for value in values]
