"""Runs that are given up since the compiler does them sooner."""

import contextlib
import contextvars
from collections.abc import Iterator

#: True while a run may be given up, since the compiler can do it.
LIMITED: contextvars.ContextVar[bool] = contextvars.ContextVar("LIMITED", default=False)


@contextlib.contextmanager
def time_limit(is_limited: bool) -> Iterator[None]:
    """Give runs of the NumPy machine up, by OvertimeError, once they have cost more than compiling."""
    token = LIMITED.set(is_limited)
    try:
        yield
    finally:
        LIMITED.reset(token)


class OvertimeError(Exception):
    """A run that has cost more than compiling its program."""
