"""Values of signals at an instant, one after another in a vector, so that many are read at once."""

import math
from collections.abc import Iterable, Iterator, Mapping

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..model._internal_states import stacked
from ..runtime import gather_static


class SignalValues(Mapping):
    """Signals by name in the order in which they are found; internal states of force elements where they are read.

    A group of blocks reads all its inputs by one gather, whatever their number.
    """

    def __init__(self, internal: Mapping[str, Array], dtype) -> None:
        self._internal, self._dtype = internal, dtype
        self._places: dict[str, tuple[int, tuple[int, ...]]] = {}
        self._pieces: list[Array] = []
        self._size = 0

    def add(self, names: Iterable[str], values: Array) -> None:
        """Add signals with their values (n, ...)."""
        values = jnp.asarray(values, self._dtype)
        size = math.prod(values.shape[1:])
        for k, name in enumerate(names):
            self._places[name] = self._size + k * size, values.shape[1:]
        self._pieces.append(values.reshape(-1))
        self._size += values.size

    def __contains__(self, name: object) -> bool:
        return name in self._places or name in self._internal

    def __iter__(self) -> Iterator[str]:
        return iter({**self._places, **dict.fromkeys(self._internal)})

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __getitem__(self, name: str) -> Array:
        first, shape = self._place(name)
        return self.take(np.arange(first, first + math.prod(shape))).reshape(shape)

    def entries(self, name: str, entry: int | None = None) -> np.ndarray:
        """Places of the numbers of a signal in the vector of all, or that of one of its entries."""
        first, shape = self._place(name)
        return np.arange(first, first + math.prod(shape)) if entry is None else np.array([first + entry])

    def shape(self, name: str) -> tuple[int, ...]:
        """Shape of a signal."""
        return self._place(name)[1]

    def _place(self, name):
        if name not in self._places:
            self.add([name], self._internal[name][None])
        return self._places[name]

    def take(self, places: np.ndarray) -> Array:
        """Numbers (m,) at places of the vector of all."""
        if not places.size:
            return jnp.zeros(0, self._dtype)
        first = 0
        for piece in self._pieces:
            if first <= places.min() and places.max() < first + piece.size:
                return gather_static(piece, places - first)
            first += piece.size
        self._pieces = [stacked(self._pieces)]
        return gather_static(self._pieces[0], places)
