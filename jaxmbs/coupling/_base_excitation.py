"""Base excitation: a component whose interface is moved, exact for accelerations straight between samples."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..linear._condensation import interface_basis
from ..linear._system import LinearSystem
from ..reductions._base import interface_first
from ..typing import ArrayLike
from ..vibration._modal_equations import modal_motion
from ..vibration._modal_response import modal_response


class BaseMotion(eqx.Module):
    """Motion of a component and the forces that move its base.

    Attributes:
        displacement, velocity, acceleration: (T, r) of the component, interface coordinates first.
        forces: (T, b) on the interface.
    """

    displacement: Float[Array, "T r"]
    velocity: Float[Array, "T r"]
    acceleration: Float[Array, "T r"]
    forces: Float[Array, "T b"]


def base_motion(
    component: LinearSystem,
    acceleration: ArrayLike,
    step: ArrayLike,
    ratios: ArrayLike = 0.0,
    displacement: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
) -> BaseMotion:
    """The response to accelerations of the interface coordinates, each its own.

    The rest moves statically with the base and, relative to that, in the modes of the held base, from rest.

    Args:
        component: whole or reduced; its own damping is not used.
        acceleration: (T, b) of the interface coordinates [m/s^2, rad/s^2].
        step: between samples [s].
        ratios: damping of the modes of the held base, one number or one for each.
        displacement, velocity: of the interface at the start (b,), default 0.

    Raises: ValueError for accelerations that do not fit the interface.  Source: S1 (5)-(6), (42)-(43).
    """
    acceleration = jnp.asarray(acceleration)
    if acceleration.ndim != 2 or acceleration.shape[1] != component.num_interface:
        raise ValueError(f"accelerations have shape {acceleration.shape}, not (times, {component.num_interface})")
    c = interface_first(component)
    K, M, b = c.stiffness, c.mass, c.num_interface
    T = interface_basis(K, tuple(range(b)))
    base = modal_motion(jnp.zeros(b, K.dtype), 0.0, acceleration, step, displacement, velocity)
    load = -(acceleration @ (M @ T)[b:].T)
    relative = modal_response(K=K[b:, b:], M=M[b:, b:], load=load, step=step, ratios=ratios)
    x, v, a = ((q @ T.T).at[:, b:].add(y) for q, y in zip(base, relative, strict=True))
    return BaseMotion(x, v, a, (a @ M.T + x @ K.T) @ T)
