"""Orthonormal polynomials of independent standard normal numbers: Hermite's, and Legendre's of their probabilities.

They do not depend on parameters of distributions: a uniform number is linear in the first of Legendre's, a normal one
in the first of Hermite's, whatever its mean and deviation.
"""

import itertools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.polynomial import hermite_e, legendre
from scipy.special import ndtr


class ChaosBasis(NamedTuple):
    """Products of polynomials.

    Attributes:
        orders: (terms, n) order of each polynomial in each term.
        is_uniform: (n,) True for Legendre's polynomials.
    """

    orders: Int[np.ndarray, "terms n"]
    is_uniform: tuple[bool, ...]

    def tables(self, u: Float[np.ndarray, "k n"]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Values and slopes (k, order + 1) of the polynomials of each number at points of normal space."""
        highest = np.max(self.orders, axis=0)
        return [
            polynomials(column, int(order), uniform)
            for column, order, uniform in zip(u.T, highest, self.is_uniform, strict=True)
        ]

    def values(self, u: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k terms"]:
        """Terms at points of normal space."""
        return _products([values for values, _ in self.tables(u)], self.orders)

    def values_and_slopes(self, u: Float[np.ndarray, "k n"]) -> tuple[np.ndarray, np.ndarray]:
        """Terms (k, terms), and their derivatives (k, n, terms) by the normal numbers."""
        tables = self.tables(u)
        values = [value for value, _ in tables]
        swapped = [[*values[:j], tables[j][1], *values[j + 1 :]] for j in range(len(values))]
        return _products(values, self.orders), np.stack([_products(row, self.orders) for row in swapped], axis=1)


def _products(tables, orders):
    found = tables[0][:, orders[:, 0]]
    for table, column in zip(tables[1:], orders.T[1:], strict=True):
        found = found * table[:, column]
    return found


def polynomials(u: Float[np.ndarray, " k"], order: int, uniform: bool) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal polynomials up to an order, and their derivatives by the normal number: (k, order + 1) each."""
    degrees = np.arange(order + 1)
    if uniform:
        v, size = 2.0 * ndtr(u) - 1.0, np.sqrt(2 * degrees + 1)
        slope = legendre.legvander(v, max(order - 1, 0)) @ _legendre_slopes(order)
        density = np.exp(-0.5 * u**2) / np.sqrt(2.0 * np.pi)
        return legendre.legvander(v, order) * size, 2.0 * density[:, None] * slope * size
    values = hermite_e.hermevander(u, order) / np.sqrt(np.cumprod(np.maximum(degrees, 1.0)))
    slopes = np.sqrt(degrees) * np.concatenate([np.zeros((len(u), 1)), values[:, :-1]], axis=1)
    return values, slopes


def _legendre_slopes(order):
    """Derivatives of Legendre's polynomials as sums of them: columns (max(order, 1), order + 1)."""
    rows, columns = np.indices((max(order, 1), order + 1))
    return np.where((rows < columns) & ((columns - rows) % 2 == 1), 2.0 * rows + 1.0, 0.0)


def total_degree(variables: int, degree: int) -> Int[np.ndarray, "terms n"]:
    """Orders of all terms up to a total degree."""
    chosen = (c for d in range(degree + 1) for c in itertools.combinations_with_replacement(range(variables), d))
    return np.array([[c.count(k) for k in range(variables)] for c in chosen])
