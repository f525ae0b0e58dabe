"""Wrong arguments made of right ones, and what counts as an honest answer to them.

An `Example` is a valid call.  From each of its arguments come the misuses that make sense for its kind; the answer
is an error in words, or a result that shows what is wrong: NaN, infinite, or `ok` that is false.  Numbers in single
precision or whole ones give the number of the valid call, or an error.
"""

import inspect
import re
import traceback
import warnings
from collections.abc import Callable, Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxmbs import ModelError, System, UnknownNameError

LONGEST = 2000  # characters of a message: more are pages of a compiler's text
RAW = (
    AttributeError,
    IndexError,
    OverflowError,
    ZeroDivisionError,
    AssertionError,
    NameError,
    RecursionError,
    np.linalg.LinAlgError,
)
UNTOLD = re.compile(  # the words of Python, NumPy and JAX
    r"unsupported operand|not subscriptable|is not iterable|has no len|must be real number|bad operand"
    r"|Cannot interpret|dot_general|incompatible (shapes|types|function)|not callable"
    r"|valid JAX (array )?type|int too large"
    r"|cannot be interpreted|could not convert|inhomogeneous|setting an array|could not be broadcast"
    r"|not supported between|invalid literal|object is not",
    re.IGNORECASE,
)
SINGLE = 2e-3  # relative
ENORMOUS = 10**400  # what no float and no index holds
KINDS = ("swapped", "no function", "number for a name")  # another kind of thing: Python's own error will do


class Example(NamedTuple):
    """A valid call; `fine`: "argument misuse" -> why that is no misuse here, "*" for all arguments or misuses."""

    function: Callable
    args: tuple
    options: dict
    fine: Mapping[str, str]
    positive: tuple[str, ...] = ()

    def excuses(self, argument: str, misuse: str) -> bool:
        names = {f"{a} {m}" for a in (argument, "*") for m in (misuse, "*")}
        return bool(names & set(self.fine))


class Attempt(NamedTuple):
    """One misuse: its argument and kind, the call, and for numbers in another type the right answer."""

    argument: str
    misuse: str
    call: Callable
    right: Callable | None = None


def call(*args, **options):
    """The arguments of an example."""
    return args, options


def attempts(example: Example):
    """Every attempt on an example but those that it excuses."""
    signature = inspect.signature(example.function)
    bound = signature.bind(*example.args, **example.options)
    for attempt in (
        *_swapped(example),
        *_whole_calls(example),
        *_of_arguments(example, bound),
        *_negative(example, bound),
    ):
        if not example.excuses(attempt.argument, attempt.misuse):
            yield attempt


def _of_arguments(example, bound):
    for name, value in bound.arguments.items():
        kind = bound.signature.parameters[name].kind
        if kind in (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD):
            continue
        for misuse, wrong in misuses(value):
            yield Attempt(name, misuse, _with(example.function, bound, name, wrong))


def _negative(example, bound):
    for name in example.positive:
        given = {**example.options, **bound.arguments}
        wrong = -0.5 - np.abs(np.asarray(given[name]))
        yield Attempt(name, "minus", _with(example.function, bound, name, wrong if wrong.ndim else float(wrong)))


def _with(function, bound, name, value):
    options = {} if name in bound.arguments else {name: value}
    given = inspect.BoundArguments(bound.signature, {**bound.arguments, name: value})
    return lambda: function(*given.args, **given.kwargs | options)


def _swapped(example):
    """The first two arguments in each other's place, where they are not of one kind."""
    if len(example.args) > 1 and type(example.args[0]) is not type(example.args[1]):
        first, second, *rest = example.args
        yield Attempt("*", "swapped", lambda: example.function(second, first, *rest, **example.options))


def _whole_calls(example):
    """All numbers of the call in single precision; all that are whole as integers."""
    right = lambda: example.function(*example.args, **example.options)  # noqa: E731
    given = example.args, example.options
    for misuse, change in (("single", _in_single), ("integer", _as_integers)):
        changed = _numbers_changed(given, change)
        if changed is not None:
            yield Attempt("*", misuse, lambda c=changed: example.function(*c[0], **c[1]), right)


def _numbers_changed(given, change):
    """The arguments with their plain numbers and arrays changed; None where there are none to change."""
    leaves, tree = jax.tree.flatten(given, is_leaf=lambda x: x is None or _is_noun(x))
    new = [change(x) if _numeric(x) == "f" else x for x in leaves]
    if all(a is b for a, b in zip(new, leaves, strict=True)):
        return None
    return jax.tree.unflatten(tree, new)


def _in_single(x):
    return jnp.asarray(x, jnp.float32)


def _as_integers(x):
    whole = np.all(np.asarray(x) == np.round(np.asarray(x)))
    return (jnp.asarray(x, int) if np.ndim(x) else int(x)) if whole else x


def _is_noun(x):
    return isinstance(x, eqx.Module)


def _numeric(x):
    """ "f", "c", "i" for a number or an array of numbers, else None."""
    if isinstance(x, bool) or not isinstance(x, float | int | complex | np.ndarray | np.generic | jax.Array):
        return None
    if jnp.issubdtype(jnp.result_type(x), jax.dtypes.prng_key):
        return None
    kind = np.asarray(x).dtype.kind
    return {"f": "f", "c": "c", "i": "i", "u": "i"}.get(kind)


def misuses(value):
    """(kind, wrong value) of every misuse of an argument."""
    if value is None:
        return
    if isinstance(value, bool):
        yield "switch", "no"
        return
    if isinstance(value, list | tuple) and not hasattr(value, "_fields") and _is_rectangular(value):
        value = np.asarray(value)
        value = value.tolist() if value.dtype.kind == "i" else value  # rows
    kind = _numeric(value)
    if kind in ("f", "c"):
        yield from _of_numbers(value, kind)
    elif kind == "i" or _are_rows(value):
        yield from _of_integers(value)
    elif isinstance(value, str):
        yield from (("name", "nonesuch"), ("number for a name", 3.5), ("empty", ""))
    elif isinstance(value, Mapping):
        yield from _of_mapping(value)
    elif isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        yield "text", 3.5
        yield "empty", type(value)()
        if len(value) and isinstance(value[0], str):
            yield "twice", type(value)([value[0], *value])
            if len(value) > 1:
                yield "letters", "".join(map(str, value))
        first = misuses(value[0]) if len(value) else ()
        yield from ((misuse, type(value)([wrong, *value[1:]])) for misuse, wrong in first)
    elif callable(value) and not _is_noun(value):
        yield "no function", 3.5
    else:
        yield from (("text", "nonsense"), ("none", None))
        if any(map(eqx.is_inexact_array, jax.tree.leaves(value))):
            yield "nan inside", _spoiled(value)


def _of_numbers(value, kind):
    array = np.asarray(value)
    yield "text", "nonsense"
    yield "nan", _put(array, np.nan)
    yield "inf", _put(array, np.inf)
    if array.ndim:
        yield "empty", np.zeros((0, *array.shape[1:]))
    yield "digits", array.astype(str).tolist() if array.ndim else "0.3"
    yield "enormous", np.full(array.shape, ENORMOUS, object).tolist()
    yield "shape", np.ones(7) if array.ndim == 0 else np.concatenate([array, array[..., -1:]], axis=-1)
    if kind == "f":
        yield "complex", array * (1.0 + 0.5j) + 0.25j


def _of_integers(value):
    yield "text", "nonsense"
    many = not isinstance(value, int | np.integer) and np.ndim(value) > 0
    if not many:
        yield "digits", "3"  # in a list it may be a name
    for misuse, wrong in (("negative", -7), ("huge", 10**6), ("enormous", ENORMOUS)):
        yield misuse, type(value)([wrong, *value[1:]]) if many and not isinstance(value, np.ndarray) else wrong


def _of_mapping(value):
    yield from (("text", "nonsense"), ("empty", {}))
    first = next(iter(value), None)
    if first is None:
        return
    rest = {k: v for k, v in value.items() if k != first}
    yield "name", {"nonesuch": value[first], **rest}
    yield from ((misuse, {first: wrong, **rest}) for misuse, wrong in misuses(value[first]))


def _put(array, value):
    """The array, one entry of it replaced."""
    array = np.array(array)
    array[(array.ndim and array.size // 2 and np.unravel_index(array.size // 2, array.shape)) or ...] = value
    return jnp.asarray(array) if array.ndim else array[()]


def _is_rectangular(value):
    """Whether nested lists hold numbers only and make an array."""
    leaves = jax.tree.leaves(value)
    if not leaves or not all(_numeric(x) for x in leaves):
        return False
    try:
        return np.asarray(value).dtype.kind in "fci"
    except ValueError:
        return False


def _are_rows(value):
    return isinstance(value, list | tuple) and bool(value) and all(isinstance(x, int | np.integer) for x in value)


def _spoiled(value):
    """A noun whose every number is NaN."""
    return jax.tree.map(lambda x: jnp.full_like(x, jnp.nan) if eqx.is_inexact_array(x) else x, value)


def verdict(attempt: Attempt) -> str | None:
    """None for an honest answer, else what is wrong with it."""
    try:
        with warnings.catch_warnings(), jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
            warnings.simplefilter("ignore")  # a warning is no refusal
            found = attempt.call()
    except Exception as error:  # noqa: BLE001 - what it says is judged
        if _is_raw(error, attempt.misuse):
            return None if attempt.misuse in KINDS else f"raw {type(error).__name__}: {str(error)[:120]}"
        if type(error).__module__.startswith(("jaxlib", "equinox")) or type(error).__name__ == "JaxRuntimeError":
            return f"raw {type(error).__name__}: {str(error)[:120]}"
        is_long = len(str(error)) > LONGEST and not str(error).startswith(
            "Type-check error"
        )  # of the tests themselves
        return f"{len(str(error))} characters: {str(error)[:120]}" if is_long else None
    if attempt.right is not None:
        return _differs(found, attempt.right())
    if attempt.misuse == "complex" and any(np.any(np.imag(x)) for x in numbers(found)):
        return None
    if attempt.misuse == "empty" or (attempt.misuse, attempt.argument) == ("enormous", "seed"):
        return None  # nothing asked of nothing; any number is a seed
    return None if says_no(found) else f"taken: {str(found)[:120]}"


def _is_raw(error, misuse):
    """True for an error without words of the library, where it is not of the tests' own functions."""
    last = traceback.extract_tb(error.__traceback__)[-1].filename
    if isinstance(error, ModelError | UnknownNameError) or "/tests/" in last:
        return False
    if isinstance(error, TypeError | ValueError):
        return misuse != "shape" and bool(UNTOLD.search(str(error).split("\n")[0]))
    return isinstance(error, (*RAW, KeyError))


def numbers(found):
    """The arrays of floats in a result."""
    leaves = jax.tree.leaves(found)
    return [np.asarray(x) for x in leaves if _numeric(x) in ("f", "c")]


def _all_numbers(found):
    """The arrays of numbers in a result; loads that it keeps may be whole ones."""
    return [np.asarray(x) for x in jax.tree.leaves(found) if _numeric(x)]


def says_no(found) -> bool:
    """Whether a result shows that it is none; a model that holds what is not finite should not have been built."""
    if isinstance(found, System):
        return False
    if any(not np.all(np.isfinite(x)) for x in numbers(found)):
        return True
    ok = getattr(found, "ok", True)
    return not np.all(np.asarray(ok)) if not callable(ok) else False


def _differs(found, right):
    pairs = list(zip(_all_numbers(found), _all_numbers(right), strict=False))
    size = max((np.max(np.abs(b), initial=0.0, where=np.isfinite(b)) for _, b in pairs), default=0.0)
    for a, b in pairs:
        if a.shape != b.shape:
            return f"shape {a.shape} instead of {b.shape}"
        where = np.isfinite(b)
        if where.any() and not np.allclose(a[where], b[where], rtol=SINGLE, atol=1e-2 * SINGLE * size):
            return f"off by {np.nanmax(np.abs(a - b)):.3g} of {np.max(np.abs(b[where])):.3g}"
    return None
