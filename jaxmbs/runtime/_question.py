"""The question that is being answered, by the name that a user knows, for what is told of programs meanwhile."""

import contextlib
import contextvars
from collections.abc import Callable, Iterator
from pathlib import Path

_QUESTION: contextvars.ContextVar[str] = contextvars.ContextVar("question", default="")


def current_question() -> str:
    """Name of the public function that was called last from outside, "" for none."""
    return _QUESTION.get()


@contextlib.contextmanager
def question(name: str) -> Iterator[None]:
    """A context in which a question is answered; questions inside of it are parts of it."""
    token = None if _QUESTION.get() else _QUESTION.set(name)
    try:
        yield
    finally:
        if token is not None:
            _QUESTION.reset(token)


def name_of(function: Callable) -> str:
    """Name of a function of the user's; of a lambda its place."""
    name, code = getattr(function, "__name__", type(function).__name__), getattr(function, "__code__", None)
    if name != "<lambda>" or code is None:
        return name
    return f"the lambda in {Path(code.co_filename).name}, line {code.co_firstlineno}"
