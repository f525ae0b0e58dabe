"""Eigenvalues, frequencies, damping ratios and shapes of a linearised mechanism."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from ..math.eigen import eig
from .linearise import Linearisation


class Modes(eqx.Module):
    """Eigenvalues of the state matrix by size, conjugate pairs side by side, positive imaginary part first.

    Attributes:
        eigenvalues: (m,) [1/s].
        frequencies: `|eigenvalue| / 2 pi` (m,) [Hz], undamped.
        damping_ratios: `-Re / |eigenvalue|` (m,), zero for a zero eigenvalue.
        shapes: (n + N, m) coordinates, then velocities of each mode, largest entry 1; no derivative.
    """

    eigenvalues: Complex[Array, " m"]
    shapes: Complex[Array, "states m"]

    @property
    def frequencies(self) -> Float[Array, " m"]:
        return _size(self.eigenvalues) / (2.0 * jnp.pi)

    @property
    def damping_ratios(self) -> Float[Array, " m"]:
        size = _size(self.eigenvalues)
        return jnp.where(size > 0, -self.eigenvalues.real / jnp.where(size > 0, size, 1.0), 0.0)


def _size(z):
    square = z.real**2 + z.imag**2
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def modes(linear: Linearisation) -> Modes:
    """Modes of the small motions; on the CPU, where LAPACK's general eigenproblem lives.

    Eigenvalues have derivatives where they are simple or their vectors complete; at a defective one (a free motion's
    pair of zeros) no derivative exists, and zero is returned.
    """
    values, shapes, _ = eig(linear.state_space.A)
    shapes = jax.lax.stop_gradient(shapes)
    largest = jnp.take_along_axis(shapes, jnp.argmax(jnp.abs(shapes), axis=0)[None], axis=0)
    return Modes(values, shapes / largest)
