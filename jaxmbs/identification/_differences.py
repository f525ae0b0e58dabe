"""Weighted differences of predictions and measurements, and their Jacobian, as compiled programs."""

import functools
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..runtime import jit
from ._measurements import Layout, Measurements


class Prior(NamedTuple):
    """Prior knowledge of k unknowns: their places, means and standard deviations (k,)."""

    places: np.ndarray
    means: np.ndarray
    deviations: np.ndarray


class Differences(eqx.Module):
    """`weight (prediction - data)`, then `(unknown - mean) / deviation` of the priors: n numbers, of p unknowns.

    The function of the user, and the layouts, are static: another record of the same kind compiles nothing anew.
    """

    predict: Callable = eqx.field(static=True)
    unknowns: Layout = eqx.field(static=True)
    data: Layout = eqx.field(static=True)
    values: Float[Array, " n"]
    weights: Float[Array, " n"]
    places: Array
    prior_places: Array
    prior_means: Float[Array, " k"]
    prior_deviations: Float[Array, " k"]
    gradient: str = eqx.field(static=True)
    compile: str = eqx.field(static=True)

    def at(self, x: np.ndarray) -> np.ndarray:
        """Differences (n + k,) at unknowns (p,)."""
        return np.asarray(_programs(self.gradient, self.compile)[0](jnp.asarray(x, float), self), float)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Their Jacobian (n + k, p)."""
        return np.asarray(_programs(self.gradient, self.compile)[1](jnp.asarray(x, float), self), float)


def differences_of(
    predict: Callable, unknowns: Layout, measured: Measurements, prior: Prior, gradient: str, compile: str
) -> Differences:
    """Differences from measurements and priors."""
    values, weights, means, deviations = (
        jnp.asarray(part, float) for part in (measured.values, measured.weights, prior.means, prior.deviations)
    )
    places, prior_places = np.flatnonzero(measured.kept), np.asarray(prior.places, int)
    given = (values, weights, jnp.asarray(places), jnp.asarray(prior_places), means, deviations)
    return Differences(predict, unknowns, measured.layout, *given, gradient, compile)


@functools.cache
def _programs(gradient, compile):
    derive = jax.jacfwd if gradient == "forward" else jax.jacrev
    return jit(_differences, compile=compile), jit(derive(_differences), compile=compile)


def _differences(x, question):
    found = question.data.flatten(question.predict(question.unknowns.unflatten(x)))[question.places]
    known = (x[question.prior_places] - question.prior_means) / question.prior_deviations
    return jnp.concatenate([(found - question.values) * question.weights, known])
