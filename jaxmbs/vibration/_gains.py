"""Rates of receptances, and acceleration gains."""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..typing import AnyArray, ArrayLike, Number


def mobility(receptance: AnyArray, omega: ArrayLike) -> Array:
    """Velocity per force, `i w B`; omega (frequencies,) [rad/s] along the first axis.  Source: S1 (40)."""
    return harmonic_rate(omega, receptance) * receptance


def accelerance(receptance: AnyArray, omega: ArrayLike) -> Array:
    """Acceleration per force, `-w^2 B`; omega (frequencies,) [rad/s] along the first axis.  Source: S1 (40)."""
    return harmonic_rate(omega, receptance) ** 2 * receptance


def harmonic_rate(omega: ArrayLike, like: AnyArray) -> Array:
    """`i w` (frequencies, 1, ...) for arrays like (frequencies, ...)."""
    w = jnp.asarray(omega, like.real.dtype)
    return lax.complex(jnp.zeros_like(w), w).reshape(-1, *[1] * (like.ndim - 1))


def acceleration_gain(acceleration: Number | complex, reference: Number | complex) -> Number | complex:
    """`k_g = q'' / x_C''`, of complex amplitudes or sizes.  Source: S1 (45)."""
    return acceleration / reference


def mobility_from_gain(gain: Number | complex, total_mass: Number, omega: Number) -> Number | complex:
    """`B = k_g w_C / kbar`, `kbar = M w_C^2`: size of the mobility behind a gain at a mode omega w_C [rad/s].

    The force is that of the whole mass M moving with the reference.  Source: S1 (44).
    """
    return gain * _match_dtype(gain, omega / generalised_stiffness(total_mass, omega))


def gain_from_mobility(mobility: Number | complex, total_mass: Number, omega: Number) -> Number | complex:
    """`k_g = kbar B / w_C` at a mode omega [rad/s]: the inverse of `mobility_from_gain`.  Source: S1 (45)."""
    return mobility * _match_dtype(mobility, generalised_stiffness(total_mass, omega) / omega)


def generalised_stiffness(total_mass: Number, omega: Number) -> Number:
    """`kbar = M w_C^2` [N/m] at a mode omega [rad/s].  Source: S1 (44)-(45)."""
    return total_mass * omega**2


def _match_dtype(value, factor):
    """A real factor in the type of complex arrays."""
    return jnp.asarray(factor, value.dtype) if hasattr(value, "dtype") and jnp.iscomplexobj(value) else factor


def superpose(shapes: AnyArray, coordinates: AnyArray) -> AnyArray:
    """`q_i = sum_k Phi_ik q_k` (n, ...).  Source: S1 (43)."""
    dtype = np.result_type(shapes.dtype, coordinates.dtype)
    return shapes.astype(dtype) @ coordinates.astype(dtype)
