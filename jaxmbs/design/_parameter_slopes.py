"""Derivatives by the parameters of distributions, by their means and deviations, and by correlations."""

import dataclasses

import jax
import jax.numpy as jnp
from jax import Array

from ..probability import RandomVariables
from ..probability._map_alike import map_alike, row_alike
from ..runtime import lapack


def parameter_slopes(variables: RandomVariables, by_leaf: RandomVariables) -> list[dict[str, Array]]:
    """Derivatives of a number by parameter, from those by the leaves of the variables.

    Returns: for each variable: "mean" and "deviation", with which a distribution stays in its family and keeps its
    ends where it has some, and its parameters; then for each correlated pair the "correlation".
    """

    def of_moments(one, leaves):
        _, pull = jax.vjp(lambda *moments: _arrays(one.with_moments(*moments)), *one.moments())
        mean, deviation = pull(_arrays(leaves))
        own = {key: getattr(leaves, key) for key in one.parameters if key not in ("mean", "deviation")}
        return {"mean": mean, "deviation": deviation, **own}

    found = map_alike(of_moments, *([*each.distributions.values()] for each in (variables, by_leaf)))
    return [*found, *({"correlation": slope} for slope in by_leaf.correlation.values())]


def named_slopes(variables: RandomVariables, rows: list, factor: float = 1.0) -> dict[str, dict[str, float]]:
    """Derivatives out of a program as numbers, times a factor, in the order of the variables."""
    found = {}
    for name, row in zip((*variables.names, *map(", ".join, variables.pairs)), rows, strict=True):
        keys = sorted(row, key=lambda key: (key not in ("mean", "deviation"), key == "deviation"))
        found[name] = {key: factor * float(row[key]) for key in keys}
    return found


def _arrays(distribution):
    """The numbers of a distribution, in the order of its fields."""
    values = [getattr(distribution, field.name) for field in dataclasses.fields(distribution)]
    return [jnp.asarray(value) for value in values if isinstance(value, Array)]


def index_slopes(variables: RandomVariables, u: Array, gradient: Array) -> RandomVariables:
    """Derivatives of the reliability index by the leaves of the variables: the envelope theorem.

    The numbers that belong to the design point move with the parameters, and the limit state with them; its gradient
    in normal space has all that is needed of it.

    Args: u (n,) the design point; gradient (n,) of the limit state there.
    """
    z, slopes, by_number = _at_point(variables, u, gradient)

    def moved(variables):
        return by_number @ variables.row_from_normal(u) / jnp.sqrt(gradient @ gradient)

    return jax.grad(moved)(variables)


def _at_point(variables, u, gradient):
    """Correlated normal numbers, slopes of the random ones by them, and the gradient by the random ones."""
    factor = variables.factor()
    z = u if factor is None else factor @ u
    along = gradient if factor is None else lapack.solve_triangular(factor, gradient, transposed=True)
    slopes = row_alike(_slope, [*variables.distributions.values()], z)
    return z, slopes, jnp.where(slopes > 0.0, along / jnp.where(slopes > 0.0, slopes, 1.0), 0.0)


def _slope(distribution, z):
    return jax.jvp(distribution.from_normal, (z,), (jnp.ones_like(z),))[1]


def importances(variables: RandomVariables, u: Array, gradient: Array) -> Array:
    """Importances (n,) of the variables for the index, which add to one.

    Squares of the direction cosines of the design point; where variables are correlated those of the normal numbers
    whose slopes are the limit state's by the correlated ones, in units of their deviations.  Source: Der Kiureghian
    2005, First- and second-order reliability methods, 14.4.
    """
    factor = variables.factor()
    along = gradient if factor is None else lapack.solve_triangular(factor, gradient, transposed=True)
    return along**2 / jnp.sum(along**2)


def log_density(variables: RandomVariables, at: RandomVariables, u: Array) -> Array:
    """Logarithm of the density of the random numbers at the point u of the variables `at`, as a function of the
    variables: its derivatives by their leaves are right where the two are equal.

    A number that stays belongs to another normal number when the parameters move.
    """
    factor, own = at.factor(), variables.factor()
    z = u if factor is None else factor @ u

    def moved(one, base, z):
        """The normal number, and the logarithm of the density of it that is the number's."""
        slope = _slope(base, z)
        is_steep = slope > 0.0
        change = (one.from_normal(z) - base.from_normal(z)) / jnp.where(is_steep, slope, 1.0)
        normal = z - jnp.where(is_steep, change, 0.0)
        return normal, -jnp.log(jnp.where(is_steep, _slope(one, normal), 1.0))

    rows = ([*each.distributions.values()] for each in (variables, at))
    normal, logs = (jnp.stack(part) for part in zip(*map_alike(moved, *rows, jnp.unstack(z)), strict=True))
    total = jnp.sum(logs)
    if own is None:
        return total - 0.5 * normal @ normal
    white = lapack.solve_triangular(own, normal)
    return total - 0.5 * white @ white - jnp.sum(jnp.log(jnp.diagonal(own)))
