"""Recovery of displacements, interface forces and element loads from the motion of a reduced component.

Times, load cases or frequencies are the first axes, coordinates the last one.
"""

from collections.abc import Iterable

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..linear._condensation import interface_basis, partition
from ..linear._storage import as_inexact
from ..linear._system import LinearSystem
from ..math import _square as square
from ..typing import AnyArray, CoordinateLike
from ._craig_chang import inertia_relief


def harmonic_amplitudes(amplitudes: AnyArray, omega: AnyArray) -> tuple[AnyArray, Array, Array]:
    """Displacement, velocity and acceleration amplitudes of displacement amplitudes (frequencies, n).

    Args: omega: (frequencies,) [rad/s].
    """
    rate = lax.complex(jnp.zeros_like(omega), omega)[:, None]
    return amplitudes, rate * amplitudes, rate**2 * amplitudes


def mode_acceleration(
    system: LinearSystem, x: AnyArray, x_ddot: AnyArray, load: AnyArray | None = None, x_dot: AnyArray | None = None
) -> Array:
    """Mode acceleration: displacements of the interior from its balance of forces instead of the modes,
    `x_N = S x_i + K_NN^-1 (F_N - M_N x'' - C_N x')`; interface displacements x_i are kept.

    Args:
        x, x_ddot, x_dot: (..., n) by mode displacement, at any number of times, or complex amplitudes; without x_dot
            damping is left out.
        load: (..., n).

    The modes that were discarded then act statically.

    Returns: (..., n).  Source: S1 (31).
    """
    x, (inner, outer) = _check_coordinates(system, x), partition(system.num_rows, system.interface)
    force = _residual_forces(system, x_ddot, load, x_dot)[..., inner]
    dtype = np.result_type(x.dtype, force.dtype)
    x, force = x.astype(dtype), force.astype(dtype)
    K_NN = system.stiffness[inner][:, inner].astype(dtype)
    static = jnp.matmul(x[..., outer], interface_basis(system.stiffness, system.interface).T.astype(dtype))
    flat = square.solve(K_NN, force.reshape(-1, len(inner)).T).T
    return static.at[..., inner].add(flat.reshape(force.shape))


def mode_acceleration_free(
    system: LinearSystem,
    determinate: Iterable[CoordinateLike],
    x: AnyArray,
    x_ddot: AnyArray,
    load: AnyArray | None = None,
    x_dot: AnyArray | None = None,
) -> Array:
    """Mode acceleration of a free component: the rigid part of x is kept, the elastic one found by inertia relief.

    Args: determinate: names or numbers of coordinates that support it statically determinately; others as in
        `mode_acceleration`.

    Source: S1 (31).
    """
    held, force = system.rows(*determinate), _residual_forces(system, x_ddot, load, x_dot)
    x = _check_coordinates(system, x)
    dtype = np.result_type(x.dtype, force.dtype)
    x, force = x.astype(dtype), force.astype(dtype)
    R = interface_basis(system.stiffness, held).astype(dtype)
    K, M = (A.astype(dtype) for A in (system.stiffness, system.mass))
    columns, forces = (part.reshape(-1, part.shape[-1]).T for part in (x, force))
    carried = R @ square.solve(R.T @ M @ R, R.T @ (M @ columns))
    return (carried + inertia_relief(K, M, forces, held, R)).T.reshape(x.shape)


def interface_forces(
    system: LinearSystem, x: AnyArray, x_ddot: AnyArray, load: AnyArray | None = None, x_dot: AnyArray | None = None
) -> Array:
    """Forces (..., b) of the bonds on the interface of the component: `R_i = (K x + C x' + M x'' - F)_i`.

    Arguments are those of `mode_acceleration`, whose result is the x to use.  Source: S1 (3), (30).
    """
    x, (_, outer) = _check_coordinates(system, x), partition(system.num_rows, system.interface)
    return x @ system.stiffness[outer].T.astype(x.dtype) - _residual_forces(system, x_ddot, load, x_dot)[..., outer]


def _check_coordinates(system, x):
    """Convert x to a floating array.  Raises: ValueError for another number of coordinates."""
    if x.shape[-1:] != (system.num_rows,):
        raise ValueError(f"displacements have shape {x.shape}, not (..., {system.num_rows})")
    return as_inexact(x)


def element_loads(element_stiffness: AnyArray, element_map: AnyArray, x: AnyArray) -> AnyArray:
    """Element loads `F_e = k_e T_e x` (..., m) of an element with stiffness (m, m) and map (m, n).

    Source: S1 (30).
    """
    x, k_T = as_inexact(x), element_stiffness @ element_map
    dtype = np.result_type(x.dtype, k_T.dtype)
    return x.astype(dtype) @ k_T.T.astype(dtype)


def _residual_forces(system, x_ddot, load, x_dot):
    """Forces `F - M x'' - C x'` (..., n) that the stiffness balances."""
    x_ddot = as_inexact(x_ddot)
    force = -(x_ddot @ system.mass.T.astype(x_ddot.dtype))
    parts = [] if load is None else [load]
    if system.damping is not None and x_dot is not None:
        x_dot = as_inexact(x_dot)
        parts.append(-(x_dot @ system.damping.T.astype(x_dot.dtype)))
    dtype = np.result_type(force.dtype, *(part.dtype for part in parts))
    return sum((part.astype(dtype) for part in parts), force.astype(dtype))
