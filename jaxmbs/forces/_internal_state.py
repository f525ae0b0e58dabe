"""Declaration of the internal states of laws and blocks."""

from typing import Any, NamedTuple

from ..typing import ScalarLike

#: Internal states of one element by name: arrays.
States = dict[str, Any]


class InternalState(NamedTuple):
    """Declaration of an internal state of a law.

    Attributes:
        shape: of its array, () for one number.
        unit: of its numbers, such as "Pa"; empty for none.
        scale: size of its numbers in use: the tolerances of a motion apply to the state divided by it.
        most: of a state that rests at any value of a band and gives way beyond, the largest size at which it rests,
            of a vector along the last axis its length: bristles slip, metal yields; infinite where not known.
            None of all others, also of those that rest at any value but do not give way, as trapped oil.
    """

    shape: tuple[int, ...] = ()
    unit: str = ""
    scale: ScalarLike = 1.0
    most: ScalarLike | None = None


def internal_layout(part: Any) -> tuple[tuple[str, tuple[int, ...], str], ...]:
    """(name, shape, unit) of each internal state of a law or block."""
    return tuple((name, tuple(one.shape), one.unit) for name, one in part.internal_states.items())
