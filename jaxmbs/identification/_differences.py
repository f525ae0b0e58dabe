"""Weighted differences of predictions and measurements, and their Jacobian, by compiled programs."""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..batching import batch
from ..runtime import TracedFunction, jit
from ._measurements import LeafLayout, Measurements


class Prior(NamedTuple):
    """Prior knowledge of k unknowns: their places, means and standard deviations (k,)."""

    places: np.ndarray
    means: np.ndarray
    deviations: np.ndarray


class Predictions(NamedTuple):
    """Predictions of one experiment, or of E of them side by side, as numbers.

    Attributes:
        predict: function of the user; unknowns, data: layouts, of one experiment.
        experiments: pytree with a leading axis E, or None.
        gradient: "forward" or "reverse"; compile: as of `batch`.
    """

    predict: Callable
    unknowns: LeafLayout
    data: LeafLayout
    experiments: PyTree
    gradient: str
    compile: str

    def at(self, x: np.ndarray) -> np.ndarray:
        """Predictions (all,) at unknowns (p,)."""
        return self._run(x, None).reshape(-1)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Their derivatives (all, p)."""
        return self._run(x, self.gradient).reshape(-1, len(x))

    def _run(self, x, gradient):
        x = jnp.asarray(x, float)
        if self.experiments is None:
            program = _program(self.predict, self.unknowns, self.data, gradient, self.compile, len(x))
            return np.asarray(program(x), float)
        program = _program_of_experiment(self.predict, self.unknowns, self.data, gradient)
        count = len(jax.tree.leaves(self.experiments)[0])
        designs = (np.tile(np.asarray(x, float), (count, 1)), self.experiments)
        return np.asarray(batch(program, designs, progress=False, compile=self.compile).values, float)


class Differences(NamedTuple):
    """`weight (prediction - data)`, then `(unknown - mean) / deviation` of the priors: n + k numbers, p unknowns."""

    predictions: Predictions
    measured: Measurements
    prior: Prior

    def at(self, x: np.ndarray) -> np.ndarray:
        """Differences (n + k,) at unknowns (p,)."""
        found = self.predictions.at(x)[self.measured.kept]
        known = (x[self.prior.places] - self.prior.means) / self.prior.deviations
        return np.concatenate([(found - self.measured.values) * self.measured.weights, known])

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Their Jacobian (n + k, p)."""
        rows = self.predictions.jacobian(x)[self.measured.kept] * self.measured.weights[:, None]
        known = np.eye(len(x))[self.prior.places] / self.prior.deviations[:, None]
        return np.concatenate([rows, known])


_DERIVATIVES = {None: lambda f: f, "forward": jax.jacfwd, "reverse": jax.jacrev}


# The same functions give the same programs again: another record of the same kind compiles nothing anew.
@functools.lru_cache(maxsize=64)
def _program(predict, unknowns, data, gradient, compile, number):
    traced = _traced(predict, unknowns, data, compile, number)
    return jit(_DERIVATIVES[gradient](lambda x: traced(x)[0]), compile=compile)


@functools.lru_cache(maxsize=64)
def _traced(predict, unknowns, data, compile, number):
    """The predictions, traced once for their values and derivatives."""
    return TracedFunction(lambda x: data.flatten(predict(unknowns.unflatten(x))), jnp.zeros(number), compile=compile)


@functools.lru_cache(maxsize=64)
def _program_of_experiment(predict, unknowns, data, gradient):
    def of_experiment(design):
        x, experiment = design
        return _DERIVATIVES[gradient](lambda x: data.flatten(predict(unknowns.unflatten(x), experiment)))(x)

    return of_experiment
