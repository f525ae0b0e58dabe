"""Characteristic constraint modes: few coordinates for a fine interface (Castanier, Tan and Pierre 2001)."""

import jax.numpy as jnp

from ..linear.modes import Modes, stable_modes
from .base import Reduced, check_num_modes, numbered, transformed


def characteristic_modes(reduced: Reduced, num: int) -> Modes:
    """The lowest modes of the interface coordinates alone, of a component or of an assembled structure.

    Raises: ValueError for negative stiffness, if concrete; under tracing that gives NaN.
    """
    b = reduced.num_interface
    check_num_modes(num, b)
    return stable_modes(reduced.stiffness[:b, :b], reduced.mass[:b, :b], num)


def characteristic(reduced: Reduced, num: int) -> Reduced:
    """The interface moving in its characteristic modes only; their amplitudes are what couples now.

    All b of them change nothing.  Components that meet must share one set: reduce after coupling, or carry the
    modes of one over.  Source: S1 (9), (12).
    """
    b, r = reduced.connection.shape
    explicit = reduced.explicit()
    shapes = characteristic_modes(explicit, num).shapes
    E = jnp.zeros((r, num + r - b), shapes.dtype).at[:b, :num].set(shapes)
    E = E.at[b:, num:].set(jnp.eye(r - b, dtype=shapes.dtype))
    labels = numbered("characteristic", num) + explicit.labels[b:]
    return transformed(explicit, E, jnp.eye(num, num + r - b, dtype=shapes.dtype), labels)
