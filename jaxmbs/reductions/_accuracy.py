"""Accuracy of a reduction: errors of frequencies and forces, number of modes for a frequency range."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import require_reals
from ..linear._condensation import partition
from ..linear._system import LinearSystem
from ..runtime import lapack
from ..typing import AnyArray, Scalar
from ..vibration._modes import complete_group, natural_modes
from ._base import Reduced
from ._recovery import interface_forces, mode_acceleration


def frequency_errors(system: LinearSystem, reduced: Reduced, num: int) -> Float[Array, " modes"]:
    """Estimated relative errors (num,) of the lowest frequencies of the free component `reduced` from `system`.

    The residual force of each mode, applied statically to the interior with the interface fixed, gives the missing
    part of the shape; its energy is twice the relative error of the frequency times that of the mode.  The
    frequencies are too high by it where the estimate is small; rigid modes give 0.
    """
    K, M = system.stiffness, system.mass
    modes = natural_modes(K=reduced.stiffness, M=reduced.mass, num=num)
    x = reduced.basis @ modes.shapes
    inner, _ = partition(len(K), system.interface)
    residual = (K @ x - (M @ x) * modes.values[None, :])[inner]
    missing = jnp.sum(residual * lapack.solve_positive(K[inner][:, inner], residual), axis=0)
    return jnp.where(modes.is_rigid, 0.0, missing / (2 * jnp.where(modes.is_rigid, 1.0, jnp.abs(modes.values))))


def force_errors(system: LinearSystem, x: AnyArray, x_ddot: AnyArray, load: AnyArray | None = None) -> Scalar:
    """Largest relative difference between the interface forces by mode displacement and by mode acceleration.

    Args: x, x_ddot: displacements and accelerations (..., n); load: (..., n).

    Returns: (), the error of mode displacement.  That of mode acceleration is smaller by about the squared ratio of
    the excitation frequency to the first discarded one.
    """
    better = mode_acceleration(system, x, x_ddot, load)
    forces = [interface_forces(system, y, x_ddot, load) for y in (x, better)]
    return jnp.max(jnp.abs(forces[0] - forces[1])) / jnp.max(jnp.abs(forces[1]))


def num_modes_below(system: LinearSystem, frequency: float, factor: float = 2.0) -> int:
    """Number of fixed-interface modes below `factor * frequency` [Hz], groups of equal frequencies kept complete.

    On the host.  A rule of thumb: with factor 1.5 the frequencies up to the given one were good to 1 % on a beam; see
    `frequency_errors` for the model at hand.

    Raises: ValueError for a frequency or a factor that is not positive and finite.
    """
    require_reals((frequency, factor))
    if not (np.isfinite(frequency) and frequency > 0 and np.isfinite(factor) and factor > 0):
        raise ValueError(f"frequency={frequency} and factor={factor} must be positive and finite")
    inner, _ = partition(system.num_rows, system.interface)
    modes = natural_modes(K=system.stiffness[inner][:, inner], M=system.mass[inner][:, inner])
    return complete_group(modes.values, int(np.sum(np.asarray(modes.frequencies) < factor * frequency)))
