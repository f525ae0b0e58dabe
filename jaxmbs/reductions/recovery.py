"""From the motion of a reduced component back to all of it: displacements, interface forces, element loads.

Times, cases or frequencies come first, coordinates last.
"""

from collections.abc import Iterable

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from ..linear.condensation import interface_basis, partition
from ..linear.storage import inexact
from ..linear.system import LinearSystem
from ..math import square
from ..typing import AnyArray, CoordinateLike
from .craig_chang import inertia_relief


def harmonic(amplitudes: AnyArray, omega: AnyArray) -> tuple[AnyArray, Array, Array]:
    """Displacement, velocity, acceleration amplitudes of (frequencies, n) at omega (frequencies,) [rad/s]."""
    rate = lax.complex(jnp.zeros_like(omega), omega)[:, None]
    return amplitudes, rate * amplitudes, rate**2 * amplitudes


def mode_acceleration(
    system: LinearSystem, x: AnyArray, x_ddot: AnyArray, load: AnyArray | None = None, x_dot: AnyArray | None = None
) -> Array:
    """Interior from the balance of forces in place of the modes:
    `x_N = S x_i + K_NN^-1 (F_N - M_N x'' - C_N x')`, x_i as it is.

    Args:
        x, x_ddot, x_dot: (..., n) of mode displacement, at any number of times or complex amplitudes; without x_dot
            damping is left out.
        load: (..., n).

    What modes were left out then acts statically.  Source: S1 (31).
    """
    x, (inner, outer) = inexact(x), partition(system.num_rows, system.interface)
    force = _inertial(system, x_ddot, load, x_dot)[..., inner]
    K_NN = system.stiffness[inner][:, inner].astype(x.dtype)
    static = jnp.matmul(x[..., outer], interface_basis(system.stiffness, system.interface).T.astype(x.dtype))
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
    """Mode acceleration of a free component: the rigid part of x as it is, the elastic one by inertia relief.

    Args: determinate: names or numbers of coordinates that just hold it; the rest as in `mode_acceleration`.

    Source: S1 (31).
    """
    x, held = inexact(x), system.rows(*determinate)
    R = interface_basis(system.stiffness, held).astype(x.dtype)
    K, M = (A.astype(x.dtype) for A in (system.stiffness, system.mass))
    force = _inertial(system, x_ddot, load, x_dot)
    columns, forces = (part.reshape(-1, part.shape[-1]).T for part in (x, force))
    carried = R @ square.solve(R.T @ M @ R, R.T @ (M @ columns))
    return (carried + inertia_relief(K, M, forces, held, R)).T.reshape(x.shape)


def interface_forces(
    system: LinearSystem, x: AnyArray, x_ddot: AnyArray, load: AnyArray | None = None, x_dot: AnyArray | None = None
) -> Array:
    """Forces (..., b) that the bonds put on the component: `R_i = (K x + C x' + M x'' - F)_i`.

    As good as x: take x of `mode_acceleration`, whose arguments these are.  Source: S1 (3), (30).
    """
    x, (_, outer) = inexact(x), partition(system.num_rows, system.interface)
    return x @ system.stiffness[outer].T.astype(x.dtype) - _inertial(system, x_ddot, load, x_dot)[..., outer]


def element_loads(element_stiffness: AnyArray, element_map: AnyArray, x: AnyArray) -> AnyArray:
    """`F_e = k_e T_e x` (..., m) of an element with stiffness (m, m) and map (m, n).  Source: S1 (30)."""
    x = inexact(x)
    return x @ (element_stiffness @ element_map).T.astype(x.dtype)


def _inertial(system, x_ddot, load, x_dot):
    """`F - M x'' - C x'`."""
    x_ddot = inexact(x_ddot)
    force = -(x_ddot @ system.mass.T.astype(x_ddot.dtype))
    if system.damping is not None and x_dot is not None:
        x_dot = inexact(x_dot)
        force = force - x_dot @ system.damping.T.astype(x_dot.dtype)
    return force if load is None else force + load.astype(force.dtype)
