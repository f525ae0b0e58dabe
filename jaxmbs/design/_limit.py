"""Limits on what a design makes: each entry of a value as one number that may not be positive."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..checks import no_such
from ..errors import UnknownNameError
from ..typing import AnyArray, ArrayLike


@dataclasses.dataclass(frozen=True)
class Limit:
    """What a design has to keep, `Limit("main bearing", load, upper=4e3)`.

    Attributes:
        name: for tables and messages.
        value: function of the design to a number or an array of any shape (joints, times, load cases); or the name
            of an entry of the dict that the objective returns beside its value, where one simulation serves all.
        lower, upper: what every entry keeps: numbers, or arrays that broadcast to the value's shape.
        sharpness: None: every entry is a limit by itself.  A number: one smooth limit for all of them (that of
            Kreisselmeier and Steinhauser), on the safe side of the worst entry by at most log(entries) / sharpness
            of the limit; the table shows by how much.
        scale: what an excess is measured by (default: the size of the limit itself, one where it is zero).
    """

    name: str
    value: Callable[[PyTree], Any] | str
    lower: ArrayLike | None = None
    upper: ArrayLike | None = None
    sharpness: float | None = None
    scale: float | None = None

    def __post_init__(self):
        if self.lower is None and self.upper is None:
            raise ValueError(f"limit {self.name!r} has neither lower nor upper")
        for name in ("sharpness", "scale"):
            number = getattr(self, name)
            if number is not None and not (np.isfinite(number) and number > 0.0):
                raise ValueError(f"limit {self.name!r}: {name} must be positive, got {number}")


class OneSidedConstraint(NamedTuple):
    """The entries (k,) of a flat value that are held from one side: by `sign * (x - bound) / size <= 0`."""

    sign: float
    places: np.ndarray
    bound: np.ndarray
    size: np.ndarray

    def excess(self, x):
        return self.sign * (x[self.places] - self.bound) / self.size


class BoundConstraint(NamedTuple):
    """One limit on a value of a known shape."""

    limit: Limit
    shape: tuple[int, ...]
    sides: tuple[OneSidedConstraint, ...]

    @property
    def size(self) -> int:
        """How many numbers of `excess` it makes."""
        return 1 if self.limit.sharpness else sum(len(side.places) for side in self.sides)

    def entries(self, value) -> Array:
        """Excess of every entry and side, not aggregated."""
        x = jnp.ravel(value)
        return jnp.concatenate([side.excess(x) for side in self.sides])

    def excess(self, value) -> Array:
        """(size,) none of them positive where the limit is kept."""
        found = self.entries(value)
        if not self.limit.sharpness:
            return found
        return (jax.nn.logsumexp(self.limit.sharpness * found) / self.limit.sharpness)[None]


def bind(limit: Limit, value: jax.ShapeDtypeStruct) -> BoundConstraint:
    """A limit on values of a shape.

    Raises: ValueError for bounds that do not fit the value, cross or are NaN; TypeError for a value that is not real.
    """
    if not isinstance(value, jax.ShapeDtypeStruct) or not jnp.issubdtype(value.dtype, jnp.floating):
        raise TypeError(f"the value of limit {limit.name!r} must be a real number or array, it is {value}")
    bounds = []
    for bound, other in ((limit.lower, -np.inf), (limit.upper, np.inf)):
        try:
            bounds.append(np.broadcast_to(np.asarray(other if bound is None else bound, float), value.shape).ravel())
        except (TypeError, ValueError) as error:
            fault = f"limit {limit.name!r}: {bound!r} does not fit a value of shape {value.shape}"
            raise ValueError(fault) from error
    if not np.all(bounds[0] <= bounds[1]):
        raise ValueError(f"limit {limit.name!r}: its bounds cross or are NaN")
    if not bounds[0].size:
        raise ValueError(f"limit {limit.name!r}: its value is empty, of shape {value.shape}")
    if np.any(bounds[0] == np.inf) or np.any(bounds[1] == -np.inf):
        raise ValueError(f"limit {limit.name!r}: no number lies above infinity or below minus infinity")
    if not np.any(np.isfinite(bounds)):
        raise ValueError(f"limit {limit.name!r} limits nothing, its bounds are infinite: leave it out")
    sides = []
    for sign, bound in zip((-1.0, 1.0), bounds, strict=True):
        index = np.flatnonzero(np.isfinite(bound))
        size = np.abs(bound[index]) if limit.scale is None else np.full(len(index), limit.scale)
        sides.append(OneSidedConstraint(sign, index, bound[index], np.where(size > 0.0, size, 1.0)))
    return BoundConstraint(limit, value.shape, tuple(sides))


def limit_values(limits: Sequence[Limit], design: PyTree, answers: Mapping | None) -> list[Any]:
    """The value of every limit; answers: what the objective returned beside its value."""
    found = []
    for limit in limits:
        if callable(limit.value):
            value = limit.value(design)
        elif answers is None:
            raise ValueError(f"limit {limit.name!r} names {limit.value!r}: the objective returns no dict of answers")
        elif limit.value not in answers:
            raise UnknownNameError(f"limit {limit.name!r}: {no_such('answer', limit.value, list(answers))}")
        else:
            value = answers[limit.value]
        if not isinstance(value, AnyArray | float | int):
            raise TypeError(f"the value of limit {limit.name!r} must be a real number or array, it is {value!r}")
        found.append(jnp.asarray(value))
    return found
