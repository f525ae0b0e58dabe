"""Variables of a design: a pytree of numbers as one vector with names and bounds."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, PyTree

from ..checks import no_such, require_reals
from ..errors import UnknownNameError

#: A variable nearer to its bound than this share of its scale is at it; optimisers clip to bounds, the rest is
#: rounding.
AT_BOUND = 1e-9


class Variables(NamedTuple):
    """The n scalar variables of a design.

    Attributes:
        names: path of each variable in the pytree, with its index in an array.
        start: the first design (n,).
        lower: lower bounds (n,), minus infinity without one.
        upper: upper bounds (n,), infinity without one.
        scale: width between the bounds (n,); without both bounds the size of the first value, or one.
        unravel: function from a vector (n,) to the pytree.
    """

    names: tuple[str, ...]
    start: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    scale: np.ndarray
    unravel: Callable[[Array], PyTree]

    def clip(self, x: np.ndarray) -> Array:
        """A host vector clipped to the bounds, in the type of the design."""
        return jnp.asarray(np.clip(x, self.lower, self.upper), float)

    @property
    def is_bounded(self) -> np.ndarray:
        """True (n,) for variables that have both bounds."""
        return np.isfinite(self.upper - self.lower)

    def move_scale(self, x: np.ndarray) -> np.ndarray:
        """Length of a large move (n,) from x: the scale; without both bounds the variable's size if larger."""
        return np.where(self.is_bounded, self.scale, np.maximum(self.scale, np.abs(x)))

    def predicted_decrease(self, x: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """Decrease of the objective (n,), to first order, if one variable moves by its scale or up to its bound."""
        distance = np.where(gradient > 0, x - self.lower, self.upper - x)
        return np.abs(gradient) * np.minimum(distance, self.move_scale(x))


def read_variables(design0: PyTree, bounds: PyTree | None) -> Variables:
    """Read and check a first design and its bounds.

    Raises:
        TypeError: for a leaf that is not a number or an array of numbers.
        ValueError: naming the variable, for bounds that do not match or cross, or a start outside of them.
    """
    paths, structure = jax.tree_util.tree_flatten_with_path(design0)
    labels = [_label(path) for path, _ in paths]
    leaves = [_as_floats(label, leaf) for label, (_, leaf) in zip(labels, paths, strict=True)]
    by_leaf = bounds_by_leaf(design0, structure, bounds)
    pairs = [_broadcast_bounds(*row) for row in zip(labels, leaves, by_leaf, strict=True)]
    if not sum(leaf.size for leaf in leaves):
        raise ValueError("design0 has no variables")
    names = tuple(name for label, leaf in zip(labels, leaves, strict=True) for name in _entry_names(label, leaf))
    lower, upper = (_flatten([pair[side] for pair in pairs]) for side in (0, 1))
    start = _flatten(leaves)
    size = _flatten([np.full(leaf.shape, np.max(np.abs(leaf), initial=0.0) or 1.0) for leaf in leaves])
    width = upper - lower
    scale = np.where(np.isfinite(width) & (width > 0), width, size)
    arrays = [jnp.asarray(leaf, float) for leaf in leaves]
    _, unravel = ravel_pytree(jax.tree_util.tree_unflatten(structure, arrays))
    variables = Variables(names, start, lower, upper, scale, unravel)
    _check(variables)
    return variables


def _as_floats(label: str, leaf) -> np.ndarray:
    values = np.asarray(leaf)
    if values.dtype.kind not in "fiu" and not jnp.issubdtype(values.dtype, jnp.floating):
        raise TypeError(f"{label} is not a number or an array of numbers: {leaf!r}")
    return values.astype(float)


def _entry_names(label: str, leaf: np.ndarray) -> list[str]:
    if leaf.ndim == 0:
        return [label]
    return [f"{label}[{','.join(map(str, index))}]" for index in np.ndindex(leaf.shape)]


def units_by_name(names: Sequence[str], units: Mapping[str, str], others: Sequence[str] = ()) -> tuple[str, ...]:
    """Unit of each of the names, then of each of the others: by their own name, or by that of their array without
    its index; empty where none is given.

    Raises: UnknownNameError; TypeError for a unit that is no word.
    """
    known = [*names, *(name.partition("[")[0] for name in names), *others]
    wrong = [no_such("variable", name, list(dict.fromkeys(known))) for name in units if name not in known]
    if wrong:
        raise UnknownNameError("; ".join(wrong))
    for name, unit in units.items():
        if not isinstance(unit, str):
            raise TypeError(f"the unit of {name!r} is a word such as 'mm', not {unit!r}")
    return tuple(units.get(name, units.get(name.partition("[")[0], "")) for name in (*names, *others))


def _label(path) -> str:
    return jax.tree_util.keystr(path, simple=True, separator=".") or "design"


def bounds_by_leaf(design0: PyTree, structure, bounds: PyTree | None) -> list:
    """The bounds given for each leaf, in their order."""
    if bounds is None:
        return [None] * structure.num_leaves
    try:
        return structure.flatten_up_to(bounds)
    except ValueError as error:
        message = "bounds must have the structure of design0, with (lower, upper) or None for each variable"
        is_pair = lambda x: x is None or (isinstance(x, tuple | list) and not any(isinstance(y, tuple) for y in x))
        raise ValueError(f"{message}: {structure_words(design0, bounds, is_pair)}") from error


def structure_words(design: PyTree, given: PyTree, is_leaf: Callable | None = None) -> str:
    """Words on the variables that only one of a design and a pytree that should have its structure has."""
    known = [_label(path) for path, _ in jax.tree_util.tree_leaves_with_path(design)]
    named = [_label(path) for path, _ in jax.tree_util.tree_leaves_with_path(given, is_leaf=is_leaf)]
    faults = [no_such("variable", name, known) for name in named if name not in known]
    missing = [name for name in known if name not in named]
    faults += [f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"] if missing else []
    return "; ".join(faults) or "their containers are of other kinds"


def _broadcast_bounds(label: str, leaf: np.ndarray, pair) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bounds of one leaf, in its shape."""
    if pair is None:
        pair = (None, None)
    if not isinstance(pair, tuple | list) or len(pair) != 2:
        raise ValueError(f"{label}: bounds must be (lower, upper) or None, not {pair!r}")
    lower, upper = (default if x is None else x for x, default in zip(pair, (-np.inf, np.inf), strict=True))
    try:
        require_reals((lower, upper))
        lower, upper = (np.broadcast_to(np.asarray(x, float), leaf.shape) for x in (lower, upper))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{label}: bounds {pair!r} do not fit the shape {leaf.shape}") from error
    return lower, upper


def _flatten(arrays: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.ravel(array) for array in arrays])


def _check(variables: Variables) -> None:
    faults = []
    for name, x, lower, upper in zip(*variables[:4], strict=True):
        if not lower <= upper:
            faults.append(f"{name}: the bounds cross, {lower:g} > {upper:g}")
        elif not lower <= x <= upper or not np.isfinite(x):
            faults.append(f"{name}: {x:g} lies outside its bounds [{lower:g}, {upper:g}]")
    if faults:
        raise ValueError("; ".join(faults))
