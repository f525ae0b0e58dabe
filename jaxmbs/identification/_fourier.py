"""Periodic motions of several coordinates, by the coefficients of a Fourier series."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import number_faults
from ..errors import ModelError
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible


class FourierMotion(eqx.Module):
    """Periodic motion of n coordinates by H harmonics: `offset + sum_k (a_k sin(k w t) - b_k cos(k w t)) / (k w)`.

    Attributes:
        offset: (n,), in the coordinates' units; sines, cosines: (n, H), a and b, in units of the velocity.
        period: [s] (static).

    Raises: ModelError for a period that is not positive, and coefficients of other shapes.
    Source: Swevers et al., Optimal robot excitation and identification (1997).
    """

    offset: Convertible[Float[Array, " n"]] = eqx.field(converter=as_array)
    sines: Convertible[Float[Array, "n harmonics"]] = eqx.field(converter=as_array)
    cosines: Convertible[Float[Array, "n harmonics"]] = eqx.field(converter=as_array)
    period: float = eqx.field(static=True)

    __repr__ = fields_repr

    def __check_init__(self):
        shapes = [np.shape(x) for x in (self.offset, self.sines, self.cosines)]
        faults = number_faults("period", self.period, positive=True)
        # stacked motions have a leading axis of all three
        if shapes[1] != shapes[2] or shapes[1][:-1] != shapes[0]:
            faults.append(
                f"offset {shapes[0]}, sines {shapes[1]} and cosines {shapes[2]} are not (n,), (n, H), (n, H)"
            )
        if faults:
            raise ModelError(faults, "FourierMotion")

    def at(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Coordinates, velocities and accelerations, each (..., n), at times (...) [s]."""
        w = 2 * jnp.pi / self.period * jnp.arange(1.0, self.sines.shape[1] + 1)
        angle = jnp.tensordot(as_array(t), w, axes=0)
        s, c, w = jnp.sin(angle), jnp.cos(angle), w[:, None]
        a, b = self.sines.T, self.cosines.T
        x = s @ (a / w) - c @ (b / w)
        return x + jnp.broadcast_to(self.offset, x.shape), c @ a + s @ b, c @ (w * b) - s @ (w * a)

    def times(self, count: int) -> np.ndarray:
        """Times (count,) over one period, evenly [s]."""
        return np.arange(count) * (self.period / count)
