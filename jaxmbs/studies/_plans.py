"""Designs of a study: full factorial grids, tables, and samples of a box or of a normal distribution (SciPy)."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import numpy as np

from ..batching._sampling import normal_points, sobol_points
from ..batching._table import num_designs, read_designs
from ..checks import require_reals
from ..design._deviations import read_deviations
from ..quantities import Axis, entries
from ..reports import Report, reported
from ..typing import ArrayLike


@reported
class Designs(NamedTuple):
    """The designs of a study.

    Attributes:
        designs: columns (B, ...) by name of the variable.
        axes: name and values of every dimension of the result; their lengths multiply to B.
    """

    designs: dict[str, np.ndarray]
    axes: tuple[tuple[str, np.ndarray], ...]

    def report(self) -> Report:
        count = len(next(iter(self.designs.values()), ()))
        design = Axis("design", np.arange(count))
        found = [entries(name, values, "", (design,)) for name, values in self.designs.items()]
        return Report(found, f"{count} designs over {' x '.join(name for name, _ in self.axes)}")

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the dimensions of the result."""
        return tuple(len(values) for _, values in self.axes)


def grid(**axes: ArrayLike) -> Designs:
    """All combinations of values (n,) by name of the variable; the result has one dimension for each.

    Raises: ValueError without variables, or for values that are no row of numbers.
    """
    require_reals(axes)
    rows = {name: np.asarray(values, float) for name, values in axes.items()}
    wrong = [name for name, values in rows.items() if values.ndim != 1 or values.size == 0]
    if wrong or not rows:
        raise ValueError(f"a grid needs one row of numbers for each variable: {', '.join(wrong) or 'none are given'}")
    every = np.meshgrid(*rows.values(), indexing="ij")
    return Designs({name: x.ravel() for name, x in zip(rows, every, strict=True)}, tuple(rows.items()))


def sobol(bounds: Mapping[str, tuple[float, float]], number: int, seed: int = 0) -> Designs:
    """Scrambled Sobol points between (lower, upper) of every variable; balanced for powers of two.

    Raises: ValueError for bounds that cross or are not finite, or a number below one.
    """
    lower, upper = _read_box(bounds, number)
    points = sobol_points(len(lower), number, seed)
    return read_plan(dict(zip(bounds, (lower + points * (upper - lower)).T, strict=True)))


def latin_hypercube(bounds: Mapping[str, tuple[float, float]], number: int, seed: int = 0) -> Designs:
    """Latin hypercube between (lower, upper) of every variable: one point in each of `number` slices of each
    variable.

    Raises: as `sobol`.
    """
    from scipy.stats import qmc

    lower, upper = _read_box(bounds, number)
    points = qmc.LatinHypercube(len(lower), seed=seed).random(number)
    return read_plan(dict(zip(bounds, (lower + points * (upper - lower)).T, strict=True)))


def normal(
    design: Mapping[str, ArrayLike], deviations: Mapping[str, ArrayLike], number: int, seed: int = 0
) -> Designs:
    """Normal, independent samples about a design, spread as Sobol's sequence.

    Args: design: numbers or arrays by name; deviations: their standard deviations, zero for what is certain.

    Raises: ValueError for deviations that do not fit the design or are negative, or a number below one.
    """
    if number < 1:
        raise ValueError(f"a study needs at least one design, not {number}")
    x, sigma, unravel = read_deviations(dict(design), dict(deviations), "deviations")
    points = x + sigma * normal_points(len(x), number, seed)
    return read_plan(jax.tree.map(np.asarray, jax.vmap(unravel)(points)))


def read_plan(designs: Any) -> Designs:
    """Read the designs of a study: a `Designs` unchanged, else columns, a list of dicts or a table.

    Their result has the dimension "design": the numbers of the designs, or the column of that name.

    Raises: as `mbs.batch`; TypeError for designs that have no names.
    """
    if isinstance(designs, Designs):
        return designs
    designs = read_designs(designs)
    if not isinstance(designs, dict):
        raise TypeError(
            "the variables of a study need names: give a dict of columns, a list of dicts, a table or a Designs"
        )
    numbers = designs.get("design", np.arange(num_designs(designs)))
    if np.ndim(numbers) != 1:
        raise ValueError("the variable 'design' has several numbers a design: give it another name")
    return Designs(designs, (("design", numbers),))


def _read_box(bounds, number):
    require_reals(dict(bounds))
    lower, upper = np.array(list(bounds.values()), float).reshape(-1, 2).T
    wrong = [name for name, a, b in zip(bounds, lower, upper, strict=True) if not (a <= b and np.isfinite(b - a))]
    if wrong or not bounds:
        raise ValueError(f"bounds must be finite (lower, upper): {', '.join(wrong) or 'none are given'}")
    if number < 1:
        raise ValueError(f"a study needs at least one design, not {number}")
    return lower, upper
