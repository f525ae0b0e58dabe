"""Estimate of the rotational (centrifugal) stiffening that the linear elastic bodies neglect."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..assembly._state import HasStates, State
from ..checks import is_concrete
from ..errors import warn
from ..kinematics._configuration import VelocityKinematics, at_state, with_velocities
from ..kinematics._elastic import interface_rates
from ..model._changes import with_changes
from ..model._entry_points import states_of
from ..model._system import System
from ..runtime import jit, lapack

#: Southwell's coefficient of a uniform cantilever: `w^2 = w_1^2 + 1.19 Omega^2` across the plane of rotation.
SOUTHWELL = 1.19
#: Relative error of the first frequency from which users are warned.
WARNING_LEVEL = 0.01


def stiffening(system: System, motion: State | HasStates) -> dict[str, Array]:
    """Estimated relative errors (...) of the first frequency of each elastic body by the neglected stiffening.

    Strains are linear, so tension by rotation does not stiffen a body.  The estimate is that of a uniform cantilever,
    `1.19 Omega^2 / (2 w_1^2)`, with the angular speed of the floating frame and the first frequency of the body with
    its first interface fixed.  It includes rotation about the body's own axis, but not the tension by attached
    bodies. Above 0.01 `simulate` and `linearise` warn; a body divided into several has higher frequencies, and its
    frames
    follow the deformation.

    Returns: by elastic body without stiffening of its own, for a state () or along a motion (times,); without
    derivative.
    Source: Southwell and Gough (1921); Wright et al. (1982).
    """
    states = states_of(system, motion)

    def at(state):
        here = with_changes(system, state)
        moving = with_velocities(here, at_state(here, state, inertias=False), state.velocities)
        return stiffening_errors(here, squared_spins(here, moving))

    return jit(at if states.coordinates.ndim == 1 else jax.vmap(at))(states)


def squared_spins(system: System, at: VelocityKinematics) -> tuple[Array, ...]:
    """Squared angular speeds (bodies,) of the floating frames, by group of elastic bodies."""
    return tuple(
        jnp.sum(interface_rates(system, group, at.V, at.u)[0][:, 0, :3] ** 2, axis=-1) for group in system.elastic
    )


def stiffening_errors(system: System, spins: tuple[Array, ...]) -> dict[str, Array]:
    """Estimated errors by name, from squared angular speeds (..., bodies) of every group; see `stiffening`."""
    found = {}
    for group, spin in zip(system.elastic, spins, strict=True):
        if group.body.stiffening is not None:
            continue
        softness = lax.stop_gradient(SOUTHWELL / 2 / jax.vmap(_first_eigenvalue)(group.body))
        found |= {name: lax.stop_gradient(spin)[..., k] * softness[k] for k, name in enumerate(group.names)}
    return found


def _first_eigenvalue(body):
    """Square of the first angular frequency () with the first interface held; infinite without deformations."""
    m = body.num_deformations
    if m == 0:
        return jnp.full((), jnp.inf, body.stiffness.dtype)
    K, M = lax.stop_gradient((body.stiffness, body.inertia[-m:, -m:]))
    unit = jnp.sqrt(jnp.diagonal(K))  # displacements and rotations in one unit
    units = unit[:, None] * unit[None, :]
    L = lapack.cholesky(K / units)
    softness = lapack.solve_factor(L, lapack.solve_factor(L, M / units).T)
    return 1 / lapack.eigh((softness + softness.T) / 2)[0][-1]


def warn_of_stiffening(errors: Mapping[str, Array]) -> None:
    """Warn of elastic bodies that rotate too fast to neglect stiffening, if the errors are concrete."""
    if not is_concrete(*errors.values()):
        return
    worst = {name: float(np.max(np.nan_to_num(np.asarray(e)), initial=0.0)) for name, e in errors.items()}
    fast = {name: error for name, error in worst.items() if error > WARNING_LEVEL}
    if fast:
        listed = ", ".join(f"{name!r} by about {100 * error:.2g} %" for name, error in list(fast.items())[:6])
        more = f" and {len(fast) - 6} more" if len(fast) > 6 else ""
        warn(
            f"elastic bodies neglect stiffening by rotation; at this speed it would change the first frequency of "
            f"{listed}{more}: divide them into several bodies (flexible.stiffening gives the estimate)"
        )
