"""Errors of functions that need the values of numbers while they are compiled, in words of the user's."""

import contextlib
import traceback
from collections.abc import Iterator
from pathlib import Path

import jax

_HERE = Path(__file__).resolve().parent.parent
#: Errors of functions that ask a traced number for its value, the more special ones first, and the way out.
_WAYS_OUT = (
    (
        jax.errors.TracerBoolConversionError,
        "decides by a number that is not known while it is compiled: write jnp.where(condition, a, b) in place of "
        "if, jnp.maximum in place of max, & in place of and",
    ),
    (
        jax.errors.TracerArrayConversionError,
        "gives NumPy a number that is not known while it is compiled: write jnp.sin in place of np.sin (import "
        "jax.numpy as jnp)",
    ),
    (
        (jax.errors.ConcretizationTypeError, jax.errors.TracerIntegerConversionError),
        "makes a Python number of one that is not known while it is compiled: leave out float() and int(), which "
        "x.astype(int) replaces, and index arrays of jnp in place of lists",
    ),
)
TRACER_ERRORS = (jax.errors.ConcretizationTypeError, jax.errors.TracerArrayConversionError)
TRACER_ERRORS += (jax.errors.TracerIntegerConversionError,)


@contextlib.contextmanager
def tracer_errors_in_words() -> Iterator[None]:
    """Raises: TypeError with the function's name, its line and the way out, for what JAX cannot compile."""
    try:
        yield
    except TRACER_ERRORS as error:
        if not _frames_of_user(error):  # the library's own question; the public call says it
            raise
        raise TypeError(explain_error(error)) from error


def explain_error(error: Exception) -> str:
    """A sentence for an error of a function of the user's: its kind and its first line, or what is to be changed."""
    for kinds, words in _WAYS_OUT:
        if isinstance(error, kinds):
            return f"{_place_of(error)} {words}"
    return f"{type(error).__name__}: {str(error).strip().splitlines()[0] if str(error).strip() else 'no words'}"


def _place_of(error) -> str:
    """Name and line of the last function of the user's that led to an error."""
    frames = _frames_of_user(error)
    if not frames:
        return "a function"
    last = frames[-1]
    return f"{last.name} ({Path(last.filename).name}:{last.lineno})"


def _frames_of_user(error):
    return [frame for frame in traceback.extract_tb(error.__traceback__) if _is_own(frame.filename)]


def _is_own(file) -> bool:
    path = Path(file)
    is_library = "site-packages" in path.parts or _HERE in path.parents
    return not is_library and path.name not in ("contextlib.py", "functools.py", "threading.py")
