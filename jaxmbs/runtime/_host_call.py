"""Functions of one array that the host evaluates, with derivatives that the host gives."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_batching import custom_vmap
from jaxtyping import Array


def host_call(
    evaluate: Callable[[np.ndarray], np.ndarray],
    jacobian: Callable[[np.ndarray], np.ndarray] | None,
    size: int,
    refuse: Callable[[str], Exception],
) -> Callable[[Array], Array]:
    """A traceable function of z (n,) to (size,), whose values and slopes (size, n) functions of the host give.

    Under one `vmap` it is called for one row after the other, as a group of laws needs it; a second one and second
    derivatives are refused.

    Args: jacobian: None for a function without slopes; refuse: the error to raise, of "batch", "derivative" or
        "second derivative".
    """
    values = _in_order(evaluate, lambda n: (size,), refuse)
    slopes = None if jacobian is None else _in_order(jacobian, lambda n: (size, n), refuse)

    @jax.custom_jvp
    def slopes_once(z):
        if slopes is None:
            raise refuse("derivative")
        return slopes(z)

    @slopes_once.defjvp
    def _(primals, tangents):
        raise refuse("second derivative")

    @jax.custom_jvp
    def call(z):
        return values(z)

    @call.defjvp
    def _(primals, tangents):
        (z,), (z_dot,) = primals, tangents
        return call(z), slopes_once(z) @ z_dot

    return call


def _in_order(function, shape_of, refuse):
    """A callback that one `vmap` calls in order, and a second one refuses."""

    @custom_vmap
    def one(z):
        shape = jax.ShapeDtypeStruct(shape_of(z.shape[0]), z.dtype)
        return jax.pure_callback(lambda z: np.asarray(function(np.asarray(z)), z.dtype), shape, z)

    @one.def_vmap
    def _(size, batched, z):
        raise refuse("batch")

    @custom_vmap
    def each(z):
        return one(z)

    @each.def_vmap
    def _(size, batched, z):
        return jnp.stack([one(z[k]) for k in range(size)]), True

    return each
