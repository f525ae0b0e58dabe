"""Derivatives of a polynomial's coefficients by parameters of the distributions, without the function.

A parameter of one number moves it at each point of normal space, as another point would: `dy/dp = (dy/du) w(u)` with
`w = (dx/dp) / (dx/du)`.  The change of a coefficient is the mean of that times its term, of which only the factor of
this number is no matter of orthogonality: an integral over one number.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..probability import AbstractDistribution, RandomVariables
from ..runtime import jit
from ._chaos_basis import ChaosBasis, polynomials

_POINTS = np.linspace(-8.2, 8.2, 821)  # of the trapezoidal rule, which has all digits for what dies out at its ends


def coefficient_slopes(
    basis: ChaosBasis, coefficients: np.ndarray, variables: RandomVariables
) -> dict[str, dict[str, np.ndarray]]:
    """Changes (terms,) of the coefficients (terms,) by variable and by "mean", "deviation" and each parameter."""
    weights = np.exp(-0.5 * _POINTS**2) / np.sqrt(2.0 * np.pi) * (_POINTS[1] - _POINTS[0])
    found = {}
    for k, (name, one) in enumerate(variables.distributions.items()):
        rest = np.delete(basis.orders, k, axis=1)
        orders = basis.orders[:, k]
        values, slopes = polynomials(_POINTS, int(np.max(orders)), basis.is_uniform[k])
        same = _same_rows(rest)
        found[name] = {
            key: (same * ((values * (weights * shift)[:, None]).T @ slopes)[np.ix_(orders, orders)]) @ coefficients
            for key, shift in _shifts(one).items()
        }
    return found


def _same_rows(rows):
    """Matrix (k, k) of ones where two rows are equal."""
    _, group = np.unique(rows, axis=0, return_inverse=True) if rows.shape[1] else (None, np.zeros(len(rows), int))
    group = np.ravel(group)
    return (group[:, None] == group[None]).astype(float)


def _shifts(one: AbstractDistribution) -> dict[str, np.ndarray]:
    """Changes (k,) of the normal number that do at `_POINTS` what a unit of a parameter does."""
    mean, deviation = one.moments()
    names = [name for name in one.parameters if name not in ("mean", "deviation")]
    own = jnp.stack([mean, deviation, *(one.parameters[name] for name in names)])

    def at(own):
        moved = one.with_moments(own[0], own[1]).from_normal(_POINTS)
        return [moved, *(_with(one, name, x).from_normal(_POINTS) for name, x in zip(names, own[2:], strict=True))]

    def shifts(own):
        changes = jax.jacfwd(at)(own)
        slope = jax.jvp(one.from_normal, (jnp.asarray(_POINTS),), (jnp.ones(len(_POINTS)),))[1]
        ratio = lambda change: jnp.where(slope > 0.0, change / jnp.where(slope > 0.0, slope, 1.0), 0.0)
        rows = [changes[0][:, 0], changes[0][:, 1], *(part[:, k + 2] for k, part in enumerate(changes[1:]))]
        return [ratio(row) for row in rows]

    found = jit(shifts)(own)
    return {name: np.asarray(row) for name, row in zip(("mean", "deviation", *names), found, strict=True)}


def _with(one, name, value):
    return eqx.tree_at(lambda x: getattr(x, name), one, value)
