"""Quasi-random samples of designs: Sobol's sequence in the unit cube and in normal coordinates (SciPy)."""

import math

import numpy as np
from jaxtyping import Float


def sobol_points(dimension: int, number: int, seed: int) -> Float[np.ndarray, "n d"]:
    """Scrambled Sobol points (number, dimension) between 0 and 1; balanced for powers of two."""
    from scipy.stats import qmc

    return qmc.Sobol(dimension, seed=seed).random_base2(math.ceil(math.log2(number)))[:number]


def normal_points(dimension: int, number: int, seed: int) -> Float[np.ndarray, "n d"]:
    """Independent standard normal numbers (number, dimension), spread as Sobol's sequence."""
    from scipy.stats import norm

    # a coordinate of exactly 0 or 1 would be infinite; 1e-12 is seven standard deviations
    return norm.ppf(np.clip(sobol_points(dimension, number, seed), 1e-12, 1.0 - 1e-12))
