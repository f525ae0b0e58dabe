"""Declaration of the internal states of laws and blocks."""

from typing import Any, NamedTuple

import numpy as np

from ..typing import ScalarLike

#: Internal states of one element by name: arrays.
States = dict[str, Any]


class InternalState(NamedTuple):
    """Declaration of an internal state of a law.

    Attributes:
        shape: of its array, () for one number.
        unit: of its numbers, such as "Pa"; empty for none.
        scale: size of its numbers in use: the tolerances of a motion apply to the state divided by it.
        most: largest size at which it may rest, of a vector along the last axis its length: bristles slip beyond it,
            metal yields.
    """

    shape: tuple[int, ...] = ()
    unit: str = ""
    scale: ScalarLike = 1.0
    most: ScalarLike = np.inf


def internal_layout(part: Any) -> tuple[tuple[str, tuple[int, ...], str], ...]:
    """(name, shape, unit) of each internal state of a law or block."""
    return tuple((name, tuple(one.shape), one.unit) for name, one in part.internal_states.items())
