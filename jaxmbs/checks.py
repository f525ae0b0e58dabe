"""Checks of values before anything is traced: are they concrete, and are they admissible?"""

import difflib
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import jax
import numpy as np

from .errors import ModelError, UnknownNameError, warn
from .lazy import is_instance

#: Numbers from here on have squares that are not finite.
LARGEST = 1e150


def is_concrete(*values: Any) -> bool:
    """True if no number in these pytrees is traced, so that all can be read."""
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(values))


def may_be_nonzero(*values: Any) -> bool:
    """True if some number is other than zero, or traced."""
    return not is_concrete(*values) or any(np.any(np.asarray(value) != 0) for value in values)


def is_sparse(value: Any) -> bool:
    """True for a sparse array of SciPy."""
    return is_instance(value, "scipy.sparse", "sparray")


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
    """True if any concrete entry is negative, or NaN."""
    return any_concrete(lambda x: ~(x >= 0), value)


def not_positive(value: Any) -> bool:
    """True if any concrete entry is zero, negative or NaN."""
    return any_concrete(lambda x: ~(x > 0), value)


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


def as_flag(what: str, value: Any) -> bool:
    """The value of a switch.  Raises: ModelError for what is neither true nor false, as the text "no"."""
    if not is_flag(value):
        raise ModelError([flag_fault(what, value)], "the question")
    return bool(value)


def flag(what: str) -> Callable[[Any], bool]:
    """Converter of a field that is a switch; what: its name."""
    return lambda value: as_flag(what, value)


def is_flag(value: Any) -> bool:
    """True for the values of a switch: true, false, and the whole numbers 1 and 0."""
    return np.shape(value) == () and not isinstance(value, float | str | bytes) and value in (False, True)


def flag_fault(what: str, value: Any) -> str:
    """A sentence: a switch has no such value."""
    return f"{what} must be True or False, not {value!r}"


#: Whole numbers from here on are no counts of anything: arrays of so many entries cannot be.
LARGEST_COUNT = 2**31
#: Whole numbers from here on are no arrays' and no floats'.
HUGE_INTEGER = 2**63


def count_faults(what: str, value: Any, least: int = 0) -> list[str]:
    """A sentence if the value is no whole number from `least` on that can count something."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        return [f"{what} must be a whole number, not {value!r}"]
    if value < least:
        return [f"{what} must be a whole number of at least {least}, not {value}"]
    return [f"{what} is too large: {count_text(int(value))}"] if value >= LARGEST_COUNT else []


def check_count(what: str, value: Any, least: int = 0) -> None:
    """Raises: ModelError for what is no whole number from `least` on."""
    faults = count_faults(what, value, least)
    if faults:
        raise ModelError(faults, "the question")


def count_text(value: int) -> str:
    """A whole number as text; of one with many digits the number of these."""
    size = value.bit_length() * np.log10(2.0)
    return str(value) if size < 30 else f"a number of {int(size) + 1} digits"


def in_range(values: Any) -> bool:
    """True if all concrete numbers are finite and their squares, too."""
    return bool(np.all(np.abs(np.asarray(values, float)) < LARGEST))


def not_increasing(points: Any) -> bool:
    """True if concrete abscissae do not increase strictly."""
    return any_concrete(lambda x: ~(np.diff(x) > 0), points)


def are_axes(rows: Any) -> bool:
    """True if (..., 3, 3) has unit rows, orthogonal and right-handed; or if it is traced and cannot be read."""
    if not is_concrete(rows):
        return True
    rows = np.asarray(rows)
    if rows.shape[-2:] != (3, 3):
        return False
    unit = np.allclose(rows @ np.swapaxes(rows, -1, -2), np.eye(3), rtol=0, atol=1e-5)
    return bool(unit and np.all(np.linalg.det(rows) > 0))


def require_numbers(**values: Any) -> None:
    """Raises: TypeError with the argument's name for None, text and other things than numbers; ValueError for whole
    numbers that no float holds.  Numbers may be complex, or traced."""
    for name, value in values.items():
        leaves = jax.tree.leaves(value)
        if value is None or any(not _is_number(leaf) for leaf in leaves):
            raise TypeError(f"{name} must be numbers, not {value!r}")
        for leaf in leaves:
            if isinstance(leaf, int) and abs(leaf) >= 2**1023:
                raise ValueError(f"{name} must be finite numbers, not {count_text(leaf)}")


def _is_number(leaf):
    kind = getattr(getattr(leaf, "dtype", None), "kind", None)
    return kind not in ("S", "U", "O") if kind else isinstance(leaf, int | float | complex)


def require_reals(value: Any) -> None:
    """Refuse what a conversion to real numbers would take in silence, or fail on without words.

    Raises: TypeError for complex numbers, whose imaginary part would be dropped, and for text, "0.3"; ValueError for
    whole numbers that no float holds.
    """
    for leaf in jax.tree.leaves(value):
        if np.iscomplexobj(leaf):
            raise TypeError("real numbers are needed, got complex ones")
        if isinstance(leaf, str | bytes) or getattr(getattr(leaf, "dtype", None), "kind", None) in ("S", "U"):
            raise TypeError(f"real numbers are needed, got the text {leaf!r}")
        if isinstance(leaf, int) and abs(leaf) >= 2**1023:
            raise ValueError(f"a finite number is needed, got {count_text(leaf)}")


def no_such(what: str, name: Any, among: Iterable[str]) -> str:
    """A sentence: nothing of this kind has that name; the nearest names, or all where none is near."""
    names = [str(other) for other in among]
    near = difflib.get_close_matches(str(name), names, n=3)
    if near:
        return f"there is no {what} {name!r}: did you mean {' or '.join(map(repr, near))}?"
    return f"there is no {what} {name!r}; there are: {', '.join(names) or 'none'}"


def repeated(names: Iterable[Any]) -> list:
    """Names that are given more than once, each once."""
    names = list(names)
    try:
        counts = Counter(names)
    except TypeError:  # lists, which cannot be counted by their hashes
        return [name for k, name in enumerate(names) if names.count(name) > 1 and name not in names[:k]]
    return [name for name, count in counts.items() if count > 1]


#: A unit that nobody gave, where one must be said.
UNSAID = ""


def said_unit(call: str, unit: Any, before: str) -> Any:
    """The unit that was given; where none was, the one that was taken without a word before, with a warning."""
    if unit != UNSAID:
        return unit
    warn(f"{call}: no unit was given, {before!r} is taken; say unit={before!r}, or yours", DeprecationWarning)
    return before


def list_faults(what: str, names: Any) -> list[str]:
    """A sentence if a list of names is one text, which would be read by its letters, or no list, or has one twice."""
    if isinstance(names, str | bytes):
        return [f"{what}: names are given in a list, {[names]!r}"]
    if not isinstance(names, Iterable):
        return [f"{what}: names are given in a list, not {names!r}"]
    twice = ", ".join(map(repr, repeated(names)[:5]))
    return [f"{what}: {twice} stands there twice; give each name once"] if twice else []


def distinct_names(what: str, names: Any) -> tuple:
    """The names of a question, each of them once.

    Raises: ModelError for one text, for what is no list, and for a name that is given twice.
    """
    given = tuple(names) if isinstance(names, Iterable) and not isinstance(names, str | bytes) else ()
    faults = list_faults(what, given or names)
    if faults:
        raise ModelError(faults, "the question")
    return given


def place_of(what: str, name: Any, among: Iterable[str]) -> int:
    """Index of a name.  Raises: UnknownNameError, with the names near it."""
    names = list(among)
    if name not in names:
        raise UnknownNameError(no_such(what, name, names))
    return names.index(name)
