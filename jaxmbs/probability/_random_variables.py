"""`RandomVariables`: several random numbers with correlation, as functions of independent standard normal ones."""

import functools
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Float

from ..checks import is_concrete, no_such
from ..errors import ModelError
from ..forces._fields import number
from ..math._newton import newton_root
from ..runtime import jit, lapack
from ._distribution import AbstractDistribution
from ._map_alike import row_alike

_NODES = 40  # of Gauss-Hermite's rule: correlations of lognormal numbers to ten digits
_MANY, _LARGEST = 2401, 12.0  # nodes, and the largest one, of the trapezoidal rule
_DEGREES = 400  # of polynomials with it: correlations of 0.99 to three digits
_STRONGEST = 1.0 - 1e-7  # correlation of normal numbers that is still solved for


class RandomVariables(eqx.Module):
    """Random numbers by name: distributions, and correlations of pairs of them (the Nataf transformation).

    Args:
        distributions: by name.
        correlation: of pairs of names, `{("width", "height"): 0.6}`, linear correlation coefficients of the numbers
            themselves; pairs that are not there are independent.

    Each number is that function of a standard normal one which gives it its distribution; the normal ones are
    correlated so that the numbers have the correlation asked.  Source: Liu and Der Kiureghian 1986, Multivariate
    distribution models with prescribed marginals and covariances.

    Raises: ModelError for names without a distribution, correlations that such numbers cannot have, or that no set of
    numbers has.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    pairs: tuple[tuple[str, str], ...] = eqx.field(static=True)
    _distributions: tuple[AbstractDistribution, ...]  # a dict would come out of a program in another order
    _correlations: tuple[Array, ...]

    def __init__(self, distributions: Mapping[str, Any], correlation: Mapping | None = None) -> None:
        faults = _faults(distributions, correlation)
        if faults:
            raise ModelError(faults, "the set of random variables")
        self.names, self._distributions = tuple(distributions), tuple(distributions.values())
        self.pairs = tuple(correlation or {})
        self._correlations = tuple(number(value) for value in (correlation or {}).values())
        if self.pairs and is_concrete(self._distributions, self._correlations):
            _check_correlation(self)

    def __repr__(self) -> str:
        parts = [f"{name}: {one!r}" for name, one in self.distributions.items()]
        parts += [f"correlation of {' and '.join(pair)}: {float(x):.4g}" for pair, x in self.correlation.items()]
        return f"RandomVariables({', '.join(parts)})"

    @property
    def distributions(self) -> dict[str, AbstractDistribution]:
        """Distribution of each variable, by name."""
        return dict(zip(self.names, self._distributions, strict=True))

    @property
    def correlation(self) -> dict[tuple[str, str], Array]:
        """Correlation of each pair of correlated variables."""
        return dict(zip(self.pairs, self._correlations, strict=True))

    def factor(self) -> Float[Array, "n n"] | None:
        """Cholesky's factor L of the correlation of the normal numbers; None where all are independent."""
        return lapack.cholesky(self.normal_correlation()) if self.pairs else None

    def normal_correlation(self) -> Float[Array, "n n"]:
        """Correlation matrix of the normal numbers."""
        R = jnp.eye(len(self.names))
        for (one, other), wanted in self.correlation.items():
            i, j = self.names.index(one), self.names.index(other)
            found = _normal_correlation(self.distributions[one], self.distributions[other], wanted)
            R = R.at[[i, j], [j, i]].set(found)
        return R

    def from_normal(self, u: Float[Array, " n"], factor: Array | None = None) -> dict[str, Array]:
        """The random numbers by name, of independent standard normal ones.

        Args: factor: `factor()`, if it is known.
        """
        row = self.row_from_normal(u, factor)
        return dict(zip(self.names, jnp.unstack(row), strict=True))

    def row_from_normal(self, u: Float[Array, " n"], factor: Array | None = None) -> Float[Array, " n"]:
        """The random numbers in the order of their names; arguments as of `from_normal`."""
        if self.pairs:
            own = self.factor() if factor is None else factor
            assert own is not None  # there are pairs
            u = own @ u
        return row_alike(lambda one, u: one.from_normal(u), self._distributions, u)


class _PairCorrelation(eqx.Module):
    """Residual (1,) of the correlation of two normal numbers: that of the random ones less the one asked."""

    products: Array  # of the coefficients of both numbers
    wanted: Array

    def __call__(self, rho):
        return (_of_powers(self.products, rho[0]) - self.wanted)[None]


def _normal_correlation(one, other, wanted):
    """Correlation () of the normal numbers by Newton's method."""
    start = lax.stop_gradient(jnp.clip(wanted, -0.99, 0.99))[None]
    pair = _PairCorrelation(_products(one, other), wanted)
    return newton_root(pair, start, jnp.ones(1), None, 1e-13, 50)[0][0]


def _correlation(one, other, rho):
    """Correlation () of two random numbers whose normal ones have the correlation rho: by their Hermite polynomials,
    each of which is correlated by a power of rho (Mehler 1866)."""
    return _of_powers(_products(one, other), rho)


def _of_powers(products, rho):
    return jnp.sum(products * jnp.cumprod(jnp.broadcast_to(rho, products.shape)))


def _products(one, other):
    """Products (k,) of the coefficients of two numbers, the last one with those of all degrees beyond."""
    (own, rest), (others, more) = _hermite_shares(one), _hermite_shares(other)
    size = max(len(own), len(others))
    own, others = (jnp.pad(part, (0, size - len(part))) for part in (own, others))
    return (own * others).at[-1].add(lax.stop_gradient(jnp.sqrt(rest * more)))


def _hermite_shares(distribution):
    """Coefficients (k,) of a number in orthonormal Hermite polynomials of its normal one, over its deviation, and
    what their squares lack to one."""
    nodes, weights, degrees = _rule(distribution.has_gaps)
    values = distribution.from_normal(jnp.asarray(nodes))
    weighted = weights * (values - weights @ values)

    def next_one(pair, k):
        new = (nodes * pair[1] - jnp.sqrt(k - 1.0) * pair[0]) / jnp.sqrt(k)
        return (pair[1], new), weighted @ new

    first = (jnp.ones_like(nodes), jnp.asarray(nodes))
    found = jnp.append(weighted @ nodes, lax.scan(next_one, first, np.arange(2.0, degrees + 1.0))[1])
    found = found / jnp.sqrt(jnp.sum(weighted**2 / weights))
    return found, jnp.maximum(1.0 - found @ found, 0.0)


@functools.cache
def _rule(has_gaps):
    """Nodes (k,) and weights (k,) of integrals over the density of a normal number, and degrees of polynomials.

    Gauss and Hermite's rule; its few nodes do not see the gaps of measured numbers, which take hundreds of degrees.
    """
    if not has_gaps:
        nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
        return nodes, weights / np.sum(weights), _NODES - 1
    nodes = np.linspace(-_LARGEST, _LARGEST, _MANY)
    return nodes, np.exp(-0.5 * nodes**2) * (nodes[1] - nodes[0]) / np.sqrt(2.0 * np.pi), _DEGREES


def _faults(distributions, correlation):
    """Sentences on names that do not fit."""
    if not isinstance(distributions, Mapping) or not distributions:
        return [f"distributions must be a dict of name to distribution, not {distributions!r}"]
    faults = [
        f"{name!r} has no distribution, but {one!r}: a number that is certain is none of them"
        for name, one in distributions.items()
        if not isinstance(one, AbstractDistribution)
    ]
    if correlation is not None and not isinstance(correlation, Mapping):
        return [*faults, f"correlation must be a dict of pairs of names to numbers, not {correlation!r}"]
    seen: set[frozenset] = set()
    for pair, value in (correlation or {}).items():
        if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] == pair[1]:
            faults.append(f"correlation is of pairs of names, not of {pair!r}")
            continue
        faults += [no_such("variable", name, distributions) for name in pair if name not in distributions]
        if frozenset(pair) in seen:
            faults.append(f"the correlation of {pair[0]!r} and {pair[1]!r} is given twice")
        seen.add(frozenset(pair))
        if np.shape(value) != () or isinstance(value, str):
            faults.append(f"the correlation of {pair[0]!r} and {pair[1]!r} must be one number, not {value!r}")
        elif is_concrete(value) and not -1.0 < value < 1.0:
            faults.append(f"the correlation of {pair[0]!r} and {pair[1]!r} must lie between -1 and 1, not {value}")
    return faults


def _check_correlation(variables):
    """Raises: ModelError for correlations that the numbers cannot have."""
    faults = []
    for (one, other), wanted in variables.correlation.items():
        pair = variables.distributions[one], variables.distributions[other]
        low, high = (float(_attainable(*pair, jnp.asarray(end))) for end in (-_STRONGEST, _STRONGEST))
        if not low < float(wanted) < high:
            text = f"{one!r} and {other!r} cannot have the correlation {float(wanted):g}: with these distributions"
            faults.append(f"{text} it lies between {low:.4g} and {high:.4g}")
    if not faults and not np.all(np.isfinite(np.asarray(_factor(variables)))):
        faults.append("no numbers have these correlations: their matrix is not positive definite")
    if faults:
        raise ModelError(faults, "the set of random variables")


_attainable = jit(_correlation)
_factor = jit(lambda variables: variables.factor())
