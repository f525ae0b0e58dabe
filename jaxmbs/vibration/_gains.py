"""Mobilities and accelerances from receptances, and acceleration gains."""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..checks import require_numbers
from ..typing import AnyArray, ArrayLike, Number


def mobility(receptance: AnyArray, omega: ArrayLike) -> Array:
    """Mobility `i w B` (velocity per force) of receptances B; omega (frequencies,) [rad/s] along the first axis.

    Source: S1 (40).
    """
    require_numbers(receptance=receptance, omega=omega)
    return harmonic_rate(omega, receptance) * receptance


def accelerance(receptance: AnyArray, omega: ArrayLike) -> Array:
    """Accelerance `-w^2 B` (acceleration per force) of receptances B; omega (frequencies,) [rad/s] along the first
    axis.

    Source: S1 (40).
    """
    require_numbers(receptance=receptance, omega=omega)
    return harmonic_rate(omega, receptance) ** 2 * receptance


def harmonic_rate(omega: ArrayLike, like: AnyArray) -> Array:
    """Factor `i w` of a time derivative, shaped (frequencies, 1, ...) for arrays (frequencies, ...)."""
    w = jnp.asarray(omega, like.real.dtype)
    return lax.complex(jnp.zeros_like(w), w).reshape(-1, *[1] * (like.ndim - 1))


def acceleration_gain(acceleration: Number | complex, reference: Number | complex) -> Number | complex:
    """Acceleration gain `k_g = q'' / x_C''` of complex amplitudes or of magnitudes.  Source: S1 (45)."""
    require_numbers(acceleration=acceleration, reference=reference)
    return acceleration / reference


def mobility_from_gain(gain: Number | complex, total_mass: Number, omega: Number) -> Number | complex:
    """Mobility `B = k_g w_C / kbar`, `kbar = M w_C^2`, from the gain of a mode of angular frequency omega [rad/s].

    The force is the inertia of the whole mass M moving with the reference.  Source: S1 (44).
    """
    require_numbers(gain=gain, total_mass=total_mass, omega=omega)
    return gain * _match_dtype(gain, omega / generalised_stiffness(total_mass, omega))


def gain_from_mobility(mobility: Number | complex, total_mass: Number, omega: Number) -> Number | complex:
    """Gain `k_g = kbar B / w_C` of a mode of omega [rad/s]: the inverse of `mobility_from_gain`.  Source: S1 (45)."""
    require_numbers(mobility=mobility, total_mass=total_mass, omega=omega)
    return mobility * _match_dtype(mobility, generalised_stiffness(total_mass, omega) / omega)


def generalised_stiffness(total_mass: Number, omega: Number) -> Number:
    """Generalised stiffness `kbar = M w_C^2` [N/m] of a mode of omega [rad/s].  Source: S1 (44)-(45)."""
    require_numbers(total_mass=total_mass, omega=omega)
    return total_mass * omega**2


def _match_dtype(value, factor):
    """Convert a real factor to the data type of a complex value that it multiplies."""
    return jnp.asarray(factor, value.dtype) if hasattr(value, "dtype") and jnp.iscomplexobj(value) else factor


def superpose(shapes: AnyArray, coordinates: AnyArray) -> AnyArray:
    """Superposition `q_i = sum_k Phi_ik q_k` (n, ...) of modal coordinates (m, ...) by shapes (n, m).

    Source: S1 (43).
    """
    require_numbers(shapes=shapes, coordinates=coordinates)
    dtype = np.result_type(shapes.dtype, coordinates.dtype)
    return shapes.astype(dtype) @ coordinates.astype(dtype)
