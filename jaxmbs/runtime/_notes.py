"""Notes of questions for the trace of a function around them: the status of an answer."""

import contextlib
import contextvars
from collections.abc import Callable, Iterator
from typing import Any

from jax.extend.core import get_opaque_trace_state

_LISTS: contextvars.ContextVar[tuple[Any, list] | None] = contextvars.ContextVar("notes", default=None)


@contextlib.contextmanager
def take_notes() -> Iterator[list]:
    """A list of what is noted while this trace goes on; inside of a `vmap`, a loop or a derivative nothing is, since
    its numbers are of that trace."""
    found: list[Any] = []
    token = _LISTS.set((get_opaque_trace_state(), found))
    try:
        yield found
    finally:
        _LISTS.reset(token)


def note(value: Callable[[], Any]) -> None:
    """Leave a value, which is asked for then, for the trace around, if one takes notes."""
    taken = _LISTS.get()
    if taken is not None and taken[0] == get_opaque_trace_state():
        taken[1].append(value())
