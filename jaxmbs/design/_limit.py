"""Limits on the values of a design; each entry becomes one constraint c <= 0, relative to its bound."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..checks import no_such, require_numbers
from ..errors import UnknownNameError
from ..probability import RandomVariables
from ..typing import AnyArray, ArrayLike
from ._chance_limit import check_chance, limit_reliability, value_with_probability
from ._reliability_result import Reliability
from ._worst import Worst


@dataclasses.dataclass(frozen=True)
class Limit:
    """A limit that a design must satisfy, `Limit("main bearing", load, upper=4e3)`.

    Attributes:
        name: for tables and messages.
        value: function of the design to a number or an array of any shape (joints, times, load cases), which the
            limit sees alone: of a motion the saved times, and `motion.peak` between them; a `Worst` of one counts
            as that; or the name of an entry of the dict that the objective returns beside its value, where
            one simulation serves all.
        lower, upper: bounds of every entry: numbers, or arrays that broadcast to the value's shape.
        sharpness: None: every entry is a constraint by itself.  A number: one smooth constraint for all of them (the
            Kreisselmeier-Steinhauser function), on the safe side of the worst entry by at most log(entries) /
            sharpness of the limit; the table shows by how much.
        scale: size of a violation that counts as one (default: the bound itself, one where it is zero).
        unit: of the value, such as "N", for tables.
        probability: that the bound may be passed with, of each entry by itself: `value` is then a function of the
            design and a dict of random numbers, and what is compared with the bound is its `percentile`.
        variables: the random numbers of a limit with a probability: distributions by name, `RandomVariables`, or a
            function of the design to these, where a number that scatters is a variable of the design.
        samples: values of a limit with a probability that are to confirm it at the end of a search, which is not `ok`
            otherwise; 0 for none, where they cost too much: no design is `ok` that such a limit holds.
    """

    name: str
    value: Callable[..., Any] | str
    lower: ArrayLike | None = None
    upper: ArrayLike | None = None
    sharpness: float | None = None
    scale: float | None = None
    unit: str = ""
    probability: float | None = None
    variables: Mapping[str, Any] | RandomVariables | Callable[[PyTree], Any] | None = None
    samples: int = 2000

    def __post_init__(self):
        if not isinstance(self.unit, str):
            raise TypeError(f"limit {self.name!r}: unit is a word such as 'N', not {self.unit!r}")
        if isinstance(self.value, Worst):
            if self.lower is not None:
                raise ValueError(f"limit {self.name!r}: the largest of many numbers has an upper bound only")
            entries = self.value.numbers
            object.__setattr__(self, "value", lambda design: entries(design)[0])
        if self.lower is None and self.upper is None:
            raise ValueError(f"limit {self.name!r} needs a lower or an upper bound")
        bounds = {name: x for name in ("lower", "upper") if (x := getattr(self, name)) is not None}
        require_numbers(**bounds)
        if len(bounds) == 2 and np.all(np.asarray(self.lower, float) > np.asarray(self.upper, float)):
            raise ValueError(f"limit {self.name!r}: its bounds cross, {self.lower} > {self.upper}")
        for name in ("sharpness", "scale"):
            number = getattr(self, name)
            if number is not None and not (np.isfinite(number) and number > 0.0):
                raise ValueError(f"limit {self.name!r}: {name} must be positive, got {number}")
        check_chance(self)

    def of_design(self, design: PyTree, gradient: str = "reverse") -> Any:
        """Value of a limit that names no answer, as it is compared with the bounds."""
        assert callable(self.value)
        return self.value(design) if self.probability is None else value_with_probability(self, design, gradient)

    def reliability(self, design: PyTree, method: str = "samples", **options: Any) -> Reliability:
        """Probability that a design passes a limit with a probability, by any method of `design.reliability`.

        The first order, by which `minimise` searches, is judged by samples of the function itself, a million of them
        by default, or by "pce", samples of a polynomial that says how good it is.  Entries are a system in series.
        """
        return limit_reliability(self, design, method, options)


class OneSidedConstraint(NamedTuple):
    """Constraints `c = sign * (x - bound) / size <= 0` on the entries (k,) of a flat value.

    The sign is +1 for upper bounds and -1 for lower ones.
    """

    sign: float
    entries: np.ndarray
    bound: np.ndarray
    size: np.ndarray

    def evaluate(self, x: Any) -> Any:
        """Constraints (k,) of a flat value."""
        return self.sign * (x[self.entries] - self.bound) / self.size


class BoundConstraint(NamedTuple):
    """A limit bound to the shape of its value."""

    limit: Limit
    shape: tuple[int, ...]
    sides: tuple[OneSidedConstraint, ...]

    @property
    def size(self) -> int:
        """Number of constraints that `evaluate` returns."""
        return 1 if self.limit.sharpness else sum(len(side.entries) for side in self.sides)

    def evaluate_entries(self, value: Any) -> Array:
        """Constraints of every entry and side, not aggregated."""
        x = jnp.ravel(value)
        return jnp.concatenate([side.evaluate(x) for side in self.sides])

    def evaluate(self, value: Any) -> Array:
        """Constraints (size,), of which none is positive where the limit is satisfied."""
        found = self.evaluate_entries(value)
        if not self.limit.sharpness:
            return found
        return (jax.nn.logsumexp(self.limit.sharpness * found) / self.limit.sharpness)[None]


def bind(limit: Limit, value: jax.ShapeDtypeStruct) -> BoundConstraint:
    """Bind a limit to the shape of its value.

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
        raise ValueError(
            f"limit {limit.name!r}: a lower bound of infinity or an upper one of minus infinity cannot be met"
        )
    if not np.any(np.isfinite(bounds)):
        raise ValueError(f"limit {limit.name!r} has infinite bounds only: leave it out")
    sides = []
    for sign, bound in zip((-1.0, 1.0), bounds, strict=True):
        index = np.flatnonzero(np.isfinite(bound))
        size = np.abs(bound[index]) if limit.scale is None else np.full(len(index), limit.scale)
        sides.append(OneSidedConstraint(sign, index, bound[index], np.where(size > 0.0, size, 1.0)))
    return BoundConstraint(limit, value.shape, tuple(sides))


def limit_values(
    limits: Sequence[Limit], design: PyTree, answers: Mapping | None, gradient: str = "reverse"
) -> list[Any]:
    """The value of every limit; answers: the dict that the objective returned beside its value; gradient: the mode in
    which percentiles are searched."""
    found = []
    for limit in limits:
        if callable(limit.value):
            value = limit.of_design(design, gradient)
        elif answers is None:
            raise ValueError(
                f"limit {limit.name!r} names the answer {limit.value!r}, but the objective returns no dict of answers"
            )
        elif limit.value not in answers:
            raise UnknownNameError(f"limit {limit.name!r}: {no_such('answer', limit.value, list(answers))}")
        else:
            value = answers[limit.value]
        if not isinstance(value, AnyArray | float | int):
            raise TypeError(f"the value of limit {limit.name!r} must be a real number or array, it is {value!r}")
        found.append(jnp.asarray(value))
    return found
