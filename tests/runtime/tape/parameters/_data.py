"""Arrays of all types, with the numbers at which operations differ, and how cases are made of them."""

import functools
import itertools
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

RNG = np.random.default_rng(7)
X, Y = RNG.normal(size=(3, 4)), RNG.normal(size=(3, 4))
Z, W = X + 1j * Y, Y - 1j * X[::-1]
CUBE = RNG.normal(size=(2, 3, 4))
COMPLEX_CUBE = CUBE + 1j * CUBE[::-1]
WITH_NAN = np.where(CUBE > 1.0, np.nan, CUBE)
A = RNG.normal(size=(4, 4))
C = A + 1j * RNG.normal(size=(4, 4))
SQUARES = RNG.normal(size=(2, 3, 3)) + 2.0 * np.eye(3)
POSITIVE = A @ A.T + np.eye(4)
_ENDS = [np.nan, -np.nan, -0.0, 0.0, 0.5, -0.5, 1.0, -1.0, 2.5, -2.5, 3.7, np.inf, -np.inf, 1e300, -1e300, 3e9, -3e9]
SPECIAL = np.array([*_ENDS, 1e19, -1e19, 2.0**53 + 2])
K32 = np.array([0, 1, -1, 2, -3, 7, 100_000, 2**31 - 1, -(2**31)], np.int32)
K64 = np.array([0, 1, -1, 2, -3, 7, 100_000, 2**31, -(2**40), 2**53], np.int64)
#: Sums of these are exact in whole numbers alone.
BEYOND_53 = np.array([2**53 - 1, 2, 1 - 2**53])
U32 = np.array([0, 1, 2, 3, 7, 100_000, 2**31, 2**32 - 1], np.uint32)
B = np.array([True, False, True, True, False])
PLACES, BEYOND = np.array([2, 0, 1]), np.array([1, -1, 3, 0])
EMPTY = np.zeros((0, 4))

Case = tuple[Callable, tuple]


def pairs_of(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of two numbers of an array."""
    x, y = np.meshgrid(numbers, numbers)
    return x.reshape(-1).copy(), y.reshape(-1).copy()


def of(function: Callable, *arrays: np.ndarray) -> list[Case]:
    """A function of one array, of each of these."""
    return [(function, (array,)) for array in arrays]


def of_pairs(function: Callable, *arrays: np.ndarray) -> list[Case]:
    """A function of two arrays, of all pairs of numbers of each of these."""
    return [(function, pairs_of(array)) for array in arrays]


def varied(function: Callable, arguments: Iterable[Any], **options: Iterable[Any]) -> list[Case]:
    """A function of each of some arguments, with every combination of its options."""
    choices = [dict(zip(options, values, strict=True)) for values in itertools.product(*options.values())]
    tuples = [args if isinstance(args, tuple) else (args,) for args in arguments]
    return [(functools.partial(function, **choice), args) for args in tuples for choice in choices]
