"""`Worst`: the largest of many numbers as an objective or a limit."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, PyTree

from ..math._extremes import largest


@dataclasses.dataclass(frozen=True)
class Worst:
    """The largest of many numbers, as the objective of `minimise` or the value of a `Limit` with an upper bound.

    `minimise(design.Worst(torques), design0)` makes the largest entry least, exactly; the result has the numbers as a
    limit named `name`, whose prices say which of them hold the optimum: their sum is minus one.  Called with a design
    it is the largest number itself.

    Attributes:
        function: of a design to an array of numbers, of any shape (times, joints, load cases); `jnp.abs` inside of it
            for the largest in size.  As an objective it may return answers beside them, as other objectives do.
        name: of the limit in results.
    """

    function: Callable[[PyTree], Any]
    name: str = "worst"

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise TypeError(f"Worst takes a function of a design to numbers, not {self.function!r}")

    def __call__(self, design: PyTree) -> Any:
        """The largest number of a design, and its answers beside it where there are some."""
        numbers, answers = self.numbers(design)
        return largest(numbers) if answers is None else (largest(numbers), answers)

    def numbers(self, design: PyTree) -> tuple[Array, Any]:
        """(numbers, answers or None) of a design."""
        found = self.function(design)
        numbers, answers = found if isinstance(found, tuple) and len(found) == 2 else (found, None)
        return jnp.asarray(numbers), answers
