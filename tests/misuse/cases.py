"""What a table of examples is made of."""

from collections.abc import Callable
from typing import NamedTuple


class Case(NamedTuple):
    """`arguments(zoo)` of a valid call; `fine`: what looks like a misuse and is none; `through`: called instead of
    the public name, for classes whose values are judged where they are used; `positive`: numbers that must not be
    negative."""

    arguments: Callable
    fine: dict[str, str]
    through: Callable | None
    positive: tuple[str, ...] = ()


def case(arguments: Callable, *fine: str, through: Callable | None = None, positive: str = "") -> Case:
    """An example; fine: "argument misuse: why", "*" for all of them."""
    return Case(arguments, dict(line.split(": ", 1) for line in fine), through, tuple(positive.split()))
