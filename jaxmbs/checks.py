"""Checks of values before anything is traced: are they concrete, and are they admissible?"""

import difflib
from collections.abc import Callable, Iterable
from typing import Any

import jax
import numpy as np

from .errors import UnknownNameError

#: Numbers from here on have squares that are not finite.
LARGEST = 1e150


def is_concrete(*values: Any) -> bool:
    """True if no number in these pytrees is traced, so that all can be read."""
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(values))


def may_be_nonzero(*values: Any) -> bool:
    """True if some number is other than zero, or traced."""
    return not is_concrete(*values) or any(np.any(np.asarray(value) != 0) for value in values)


def shape_of(value: Any) -> tuple[int, ...]:
    """Shape of a number, an array, or lists of numbers, traced ones among them."""
    return np.shape(value) if is_concrete(value) else jax.numpy.asarray(value).shape


def any_concrete(condition: Callable[..., Any], *values: Any) -> bool:
    """True if `condition` holds anywhere for these values; False while any of them is traced."""
    return is_concrete(*values) and bool(np.any(condition(*map(np.asarray, values))))


def faults_if(*checks: tuple[bool, str]) -> list[str]:
    """Messages of the checks that failed."""
    return [message for failed, message in checks if failed]


def negative(value: Any) -> bool:
    """True if any concrete entry is negative."""
    return any_concrete(lambda x: x < 0, value)


def not_positive(value: Any) -> bool:
    """True if any concrete entry is zero or negative."""
    return any_concrete(lambda x: x <= 0, value)


def number_faults(what: str, value: Any, positive: bool = False) -> list[str]:
    """A sentence if the value is not one real number, finite and not negative; or positive.

    Of a traced value its shape and type are known.
    """
    wanted = f"{what} must be one {'positive' if positive else 'finite'} number"
    if np.shape(value) or isinstance(value, str | None):
        return [f"{wanted}, not {value!r}" if isinstance(value, str | None) else f"{wanted}, not {np.shape(value)}"]
    if jax.numpy.iscomplexobj(value):
        return [f"{wanted}, not a complex one"]
    if any_concrete(lambda x: ~np.isfinite(x) | (x < 0) | (positive & (x == 0)), value):
        return [f"{wanted}{'' if positive else ', not negative'}; it is {value}"]
    return []


def in_range(values: Any) -> bool:
    """True if all concrete numbers are finite and their squares, too."""
    return bool(np.all(np.abs(np.asarray(values, float)) < LARGEST))


def not_increasing(points: Any) -> bool:
    """True if concrete abscissae do not increase strictly."""
    return any_concrete(lambda x: np.diff(x) <= 0, points)


def are_axes(rows: Any) -> bool:
    """True if (..., 3, 3) has unit rows, orthogonal and right-handed; or if it is traced and cannot be read."""
    if not is_concrete(rows):
        return True
    rows = np.asarray(rows)
    if rows.shape[-2:] != (3, 3):
        return False
    unit = np.allclose(rows @ np.swapaxes(rows, -1, -2), np.eye(3), rtol=0, atol=1e-5)
    return bool(unit and np.all(np.linalg.det(rows) > 0))


def refuse_complex(value: Any) -> None:
    """TypeError for complex numbers, whose imaginary part a conversion would drop in silence."""
    if any(np.iscomplexobj(leaf) for leaf in jax.tree.leaves(value)):
        raise TypeError("real numbers are needed, got complex ones")


def no_such(what: str, name: Any, among: Iterable[str]) -> str:
    """A sentence: nothing of this kind has that name; the nearest names, or all where none is near."""
    names = [str(other) for other in among]
    near = difflib.get_close_matches(str(name), names, n=3)
    if near:
        return f"there is no {what} {name!r}: did you mean {' or '.join(map(repr, near))}?"
    return f"there is no {what} {name!r}; there are: {', '.join(names) or 'none'}"


def place_of(what: str, name: Any, among: Iterable[str]) -> int:
    """Index of a name.  Raises: UnknownNameError, with the names near it."""
    names = list(among)
    if name not in names:
        raise UnknownNameError(no_such(what, name, names))
    return names.index(name)
