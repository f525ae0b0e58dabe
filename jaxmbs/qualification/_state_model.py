"""Transfer functions of a state space, and of a network with measured components."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..math import _square as square
from ..runtime import lapack
from ._modal_transfer import imaginary_rates


class StateModel(eqx.Module):
    """A state space between named inputs and outputs.

    Attributes: A, B, C, D: matrices; names, inputs, units: of outputs, inputs, and outputs where known (static).
    """

    A: Float[Array, "n n"]
    B: Float[Array, "n inputs"]
    C: Float[Array, "outputs n"]
    D: Float[Array, "outputs inputs"]
    names: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True, default=())

    def poles(self) -> tuple[Array, Array]:
        """Resonances and halfwidths [Hz]; constants."""
        roots = lapack.eig(lax.stop_gradient(self.A))[0]
        return jnp.abs(roots.imag) / (2 * jnp.pi), jnp.abs(roots.real) / (2 * jnp.pi)

    def transfer(self, frequencies) -> Array:
        """Outputs (frequencies, outputs, inputs) for unit inputs at frequencies [Hz]."""
        s = imaginary_rates(frequencies, self.A.dtype)
        A, B, C, D = (part.astype(s.dtype) for part in (self.A, self.B, self.C, self.D))
        eye = jnp.eye(len(A), dtype=s.dtype)
        return jax.vmap(lambda s: C @ square.solve(s * eye - A, B) + D)(s)

    def unbounded_parts(self) -> tuple:
        """Nothing: see `ModalModel`."""
        return ()

    def state_space(self) -> tuple[Array, Array, Array, Array]:
        """Matrices A, B, C, D."""
        return self.A, self.B, self.C, self.D


class MeasuredModel(eqx.Module):
    """Transfer functions on a grid of frequencies, straight between them.

    Attributes: frequencies: (points,) [Hz]; values: (points, outputs, inputs); names, inputs, units: static.
    """

    frequencies: Float[Array, " points"]
    values: Array
    names: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True, default=())

    def transfer(self, frequencies) -> Array:
        """Outputs (frequencies, outputs, inputs) for unit inputs at frequencies [Hz] within the grid."""
        f = jnp.asarray(frequencies, self.frequencies.dtype)
        k = jnp.clip(jnp.searchsorted(self.frequencies, f) - 1, 0, len(self.frequencies) - 2)
        low, high = self.frequencies[k], self.frequencies[k + 1]
        part = ((f - low) / (high - low)).astype(self.values.dtype)[:, None, None]
        return self.values[k] * (1 - part) + self.values[k + 1] * part
