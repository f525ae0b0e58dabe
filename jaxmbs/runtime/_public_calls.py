"""The context of each call of a public function."""

import contextlib
from collections.abc import Iterator

from ._eager import eager_on_tapes
from ._question import question


@contextlib.contextmanager
def public_call(name: str, calls: Iterator[int]) -> Iterator[None]:
    """A context in which the question is named, and its single operations run on tapes.

    Args: name: of the function; calls: counts its calls.
    """
    with question(name), eager_on_tapes(calls):
        yield
