"""Deviations of the variables of a design: standard deviations or tolerances as one vector."""

from collections.abc import Callable

import jax
import numpy as np
from jaxtyping import PyTree

from ..checks import require_reals
from ._variables import read_variables, structure_words


def read_deviations(design: PyTree, widths: PyTree, what: str) -> tuple[np.ndarray, np.ndarray, Callable]:
    """Read a design and deviations of its variables: (design (n,), deviations (n,), function back to a pytree).

    Raises: ValueError for widths of another structure or shape, or negative ones; `what` names them.
    """
    variables = read_variables(design, None)
    if jax.tree.structure(widths) != jax.tree.structure(design):  # type: ignore[operator]
        raise ValueError(f"{what} must have the structure of the design: {structure_words(design, widths)}")
    require_reals(widths)
    pairs = zip(jax.tree.leaves(widths), jax.tree.leaves(design), strict=True)
    try:
        flat = np.concatenate([np.broadcast_to(np.asarray(w, float), np.shape(leaf)).ravel() for w, leaf in pairs])
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} must be numbers in the shapes of the design, not {widths}") from error
    if not np.all((flat >= 0.0) & np.isfinite(flat)):
        raise ValueError(f"{what} must not be negative or infinite: {widths}")
    return variables.start, flat, variables.unravel
