"""Orders of what changes over a cycle: its harmonics of the speed of rotation."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..checks import any_concrete, count_faults, faults_if
from ..errors import ModelError
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import as_array
from ..typing import ArrayLike

_MOST_TURNS = 10_000


class Orders(Reported, eqx.Module):
    """Harmonics of a quantity: it is `Re sum_k a_k exp(i n_k angle)`.

    Attributes: orders: (K,) n_k, cycles in a turn; amplitudes: (K,) complex a_k.
    """

    orders: Float[Array, " K"]
    amplitudes: Complex[Array, " K"]

    def report(self) -> Report:
        return Report([Quantity("amplitude", self.amplitudes, "", (Axis("order", np.asarray(self.orders)),))])

    def of(self, order: float) -> Complex[Array, ""]:
        """The amplitude () of one order.  Raises: ModelError."""
        found = np.flatnonzero(np.abs(np.asarray(self.orders) - order) < 1e-9)
        if not found.size:
            raise ModelError([f"no order {order}: they go by {float(self.orders[1]):g}"], "the orders")
        return self.amplitudes[int(found[0])]


def orders(values: ArrayLike, turns: int = 1, count: int = 24) -> Orders:
    """Orders of values over a cycle of so many turns.

    Args:
        values: (T,) at equal steps of the crank angle, without the end of the cycle.  Of steps in time the orders are
            those of time, which are the same where the speed is steady.
        count: number of orders beside the mean.

    Raises: ModelError for values that are no row, fewer than twice the count.
    """
    values = as_array(values)
    faults = count_faults("turns", turns, 1) + count_faults("count", count, 1)
    if not faults:
        faults = faults_if(
            (turns > _MOST_TURNS, f"turns must be at most {_MOST_TURNS}"),
            (values.ndim != 1 or values.size <= 2 * count, f"values must be a row of more than {2 * count}"),
            (any_concrete(lambda x: ~np.isfinite(x), values), "values must be finite"),
        )
    if faults:
        raise ModelError(faults, "the orders")
    harmonics = jnp.fft.fft(values)[: count + 1] / values.size
    scale = jnp.asarray([1.0] + [2.0] * count, harmonics.dtype)
    return Orders(jnp.asarray(np.arange(count + 1) / turns, values.dtype), scale * harmonics)
