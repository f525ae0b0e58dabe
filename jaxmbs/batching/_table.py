"""Tables of designs: one pytree of columns, read from a dict, a list of dicts or a data frame."""

from collections.abc import Mapping
from numbers import Number
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, PyTree

from ..checks import is_concrete


def read_designs(designs: Any) -> PyTree:
    """Read designs as a pytree whose leaves are arrays with one leading axis of the same length B >= 1.

    Args:
        designs: a pytree of arrays or lists of numbers with a leading axis B, typically a dict of columns; a list
            of B dicts; or a table with `.columns` and `.to_dict("list")`, such as a pandas DataFrame.

    Raises:
        TypeError: naming the leaf that is not numeric.
        ValueError: naming the leaf without an axis of designs or of another length; without any design.
    """
    if hasattr(designs, "columns") and hasattr(designs, "to_dict"):
        designs = designs.to_dict("list")
    elif isinstance(designs, list) and all(isinstance(row, Mapping) for row in designs):
        designs = _stack_dicts(designs)
    paths, structure = jax.tree_util.tree_flatten_with_path(designs, is_leaf=_is_column)
    columns = {_label(path): _as_column(_label(path), leaf) for path, leaf in paths}
    _check_lengths(columns)
    return jax.tree.unflatten(structure, list(columns.values()))


def is_traced(designs: PyTree) -> bool:
    """True if some leaf is traced (jit, grad, vmap)."""
    return not is_concrete(designs)


def num_designs(designs: PyTree) -> int:
    """Number B of designs."""
    return jax.tree.leaves(designs)[0].shape[0]


def select_designs(designs: PyTree, index: np.ndarray) -> PyTree:
    """The designs (len(index), ...) at the given rows, on the host."""
    return jax.tree.map(lambda column: column[index], designs)


def design_shape(designs: PyTree) -> PyTree:
    """Shape and type of one design, as abstract arrays."""
    return jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape[1:], jax.dtypes.canonicalize_dtype(x.dtype)), designs)


def _stack_dicts(designs: list) -> PyTree:
    """Stack a list of dicts into a dict of columns."""
    if not designs:
        raise ValueError("there are no designs: the list is empty")
    first: Any = jax.tree.structure(designs[0])
    for k, design in enumerate(designs):
        if jax.tree.structure(design) != first:
            raise ValueError(f"design {k} has other entries than design 0: {sorted(design)}, {sorted(designs[0])}")
    return jax.tree.map(lambda *values: np.stack([np.asarray(value) for value in values]), *designs)


def _is_column(x: Any) -> bool:
    """True if a list is a column of numbers rather than a pytree of columns."""
    return isinstance(x, list) and all(isinstance(entry, Number | list | str) for entry in x)


def _label(path: tuple) -> str:
    return jax.tree_util.keystr(path, simple=True, separator=".") or "designs"


def _as_column(label: str, leaf: Any) -> np.ndarray | Array:
    """A column as an array; JAX arrays go to the host, traced ones stay."""
    if not is_concrete(leaf):
        return leaf
    column = np.asarray(leaf)
    if column.dtype.kind not in "fiubc" and not jax.dtypes.issubdtype(column.dtype, np.floating):
        raise TypeError(f"{label} is not a column of numbers: {leaf!r}")
    return column


def _check_lengths(columns: Mapping) -> None:
    if not columns:
        raise ValueError("the designs have no variables")
    for label, column in columns.items():
        if column.ndim == 0:
            raise ValueError(f"{label} is one number: it needs a leading axis, one entry for each design")
    (first, column), *others = columns.items()
    for label, other in others:
        if other.shape[0] != column.shape[0]:
            raise ValueError(f"{label} has {other.shape[0]} designs, {first} has {column.shape[0]}")
    if column.shape[0] == 0:
        raise ValueError("there are no designs: the columns are empty")
