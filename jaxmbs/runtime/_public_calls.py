"""What the compiler's room does around each call of a public function."""

import contextlib
from collections.abc import Iterator

from ..arguments import surround_calls
from ._eager import eager_on_tapes
from ._question import question


@contextlib.contextmanager
def _public_call(name: str, calls: Iterator[int]) -> Iterator[None]:
    """Name the question, and run its single operations on tapes."""
    with question(name), eager_on_tapes(calls):
        yield


surround_calls(_public_call)
