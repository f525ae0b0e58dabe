"""Points spread over a box, or about a design."""

import math
from collections.abc import Callable

import jax
import numpy as np
from jaxtyping import PyTree

from ..checks import refuse_complex
from ._variables import read_variables


def sobol_points(dimension: int, number: int, seed: int) -> np.ndarray:
    """(number, dimension) of Sobol's sequence, scrambled, within 0 and 1; even for powers of two."""
    from scipy.stats import qmc

    return qmc.Sobol(dimension, seed=seed).random_base2(math.ceil(math.log2(number)))[:number]


def normal_points(dimension: int, number: int, seed: int) -> np.ndarray:
    """(number, dimension) of independent normal numbers, spread as Sobol's sequence."""
    from scipy.stats import norm

    return norm.ppf(np.clip(sobol_points(dimension, number, seed), 1e-12, 1.0 - 1e-12))


def read_deviations(design: PyTree, widths: PyTree, what: str) -> tuple[np.ndarray, np.ndarray, Callable]:
    """(design (n,), widths (n,), the way back to a pytree).

    Raises: ValueError for widths of another structure or shape, or negative ones; `what` names them.
    """
    variables = read_variables(design, None)
    if jax.tree.structure(widths) != jax.tree.structure(design):  # type: ignore[operator]
        raise ValueError(f"{what} must have the structure of the design")
    refuse_complex(widths)
    pairs = zip(jax.tree.leaves(widths), jax.tree.leaves(design), strict=True)
    try:
        flat = np.concatenate([np.broadcast_to(np.asarray(w, float), np.shape(leaf)).ravel() for w, leaf in pairs])
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} are numbers in the shapes of the design: {widths}") from error
    if not np.all((flat >= 0.0) & np.isfinite(flat)):
        raise ValueError(f"{what} must not be negative or infinite: {widths}")
    return variables.start, flat, variables.unravel
