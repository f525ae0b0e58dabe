"""A complex array as two real ones."""

from typing import Any, NamedTuple

import jax
import numpy as np


class Pair(NamedTuple):
    """Real and imaginary part."""

    real: Any
    imag: Any

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the complex array."""
        return self.real.shape

    @property
    def dtype(self) -> np.dtype:
        """Its type."""
        return np.dtype(np.complex128)


def is_complex(x: Any) -> bool:
    """True for a description of an array of complex numbers in double precision."""
    return x.dtype == np.complex128


def parts(x: Any) -> range:
    """One for a real array, two for a complex one."""
    return range(2 if is_complex(x) else 1)


def pair_of(value: Any) -> Any:
    """A constant, complex ones as a pair."""
    if jax.dtypes.issubdtype(value.dtype, jax.dtypes.extended):
        return value
    value = np.asarray(value)
    if value.dtype == np.complex128:
        return Pair(np.real(value).copy(), np.imag(value).copy())
    return value
