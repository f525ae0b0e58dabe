"""Programs that bind every primitive of tapes with several values of each of its parameters."""

from ._algebra import ALGEBRA
from ._arrays import ARRAYS
from ._numbers import NUMBERS
from ._places import PLACED
from ._reasons import ELSEWHERE, REASONS

#: Functions and arguments by primitive.
CASES = {**NUMBERS, **ARRAYS, **PLACED, **ALGEBRA}
