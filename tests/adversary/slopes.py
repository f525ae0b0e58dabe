"""Gradients against differences: one compiled function for all places, all steps and all parameters."""

import jax
import jax.numpy as jnp
import numpy as np

STEPS = (1e-2, 1e-3, 1e-4)


class Slopes:
    """Value, reverse and forward gradient of a scalar function of (n,) numbers, compiled once for rows of places.

    Args:
        function: of (n,) numbers, as reverse mode takes it; `forward` the same as forward mode takes it.
        count: how many of the numbers, from the first on, are parameters.
    """

    def __init__(self, function, count, forward=None):
        forward = function if forward is None else forward
        self.count = count
        self.values = jax.jit(jax.vmap(function))
        self.reverse = jax.jit(jax.vmap(jax.grad(function)))
        self.forward = jax.jit(jax.vmap(jax.jacfwd(forward)))

    def gradients(self, places):
        """(reverse, forward) gradients (places, count)."""
        places = jnp.asarray(places, float)
        return (np.asarray(g(places))[:, : self.count] for g in (self.reverse, self.forward))

    def differences(self, places):
        """Central differences of fourth order (steps, places, count)."""
        places, n = np.asarray(places, float), self.count
        unit = np.eye(places.shape[1])[:n]
        shifts = np.array([-2.0, -1.0, 1.0, 2.0])
        steps = np.array(STEPS)[:, None, None] * np.maximum(np.abs(places[None, :, :n]), 1.0)
        moved = places[None, :, None, None] + steps[..., None, None] * shifts[:, None] * unit[:, None]
        f = np.asarray(self.values(jnp.asarray(moved.reshape(-1, places.shape[1])))).reshape(moved.shape[:-1])
        return (8 * (f[..., 2] - f[..., 1]) - (f[..., 3] - f[..., 0])) / (12 * steps)

    def check(self, places: dict, tolerance=1e-6, agreement=1e-8):
        """Both gradients agree with each other and, at the best step, with differences; every number matters."""
        rows = np.array(list(places.values()), float)
        reverse, forward = self.gradients(rows)
        differences = self.differences(rows)
        for k, name in enumerate(places):
            size = np.max(np.abs(reverse[k]))
            assert np.all(np.isfinite(reverse[k])) and np.all(np.isfinite(forward[k])), name
            gap = np.max(np.abs(reverse[k] - forward[k])) / size
            assert gap < agreement, f"{name}: reverse and forward mode differ by {gap:.1e}"
            errors = np.min(np.abs(differences[:, k] - reverse[k]), axis=0) / size
            worst = int(np.argmax(errors))
            assert errors[worst] < tolerance, f"{name}: number {worst} differs by {errors[worst]:.1e}"
