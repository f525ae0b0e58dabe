"""Base excitation of a component through its interface, exact for accelerations linear between samples."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..linear._free_motions import motion_with
from ..linear._system import LinearSystem
from ..quantities import Quantity, numbered
from ..reductions._base import interface_first
from ..reports import Report, Reported
from ..typing import ArrayLike
from ..vibration._modal_equations import modal_motion
from ..vibration._modal_response import modal_response


class BaseMotion(Reported, eqx.Module):
    """Motion of a component on a moving base, and the forces that move the base.

    Attributes:
        displacement, velocity, acceleration: (times, r) of the component, interface coordinates first.
        forces: (times, b) on the interface [N, N m].
    """

    displacement: Float[Array, "T r"]
    velocity: Float[Array, "T r"]
    acceleration: Float[Array, "T r"]
    forces: Float[Array, "T b"]

    def report(self) -> Report:
        own, base = (
            numbered(name, x.shape[-1]) for name, x in (("coordinate", self.displacement), ("base", self.forces))
        )
        return Report(
            [
                Quantity("force", self.forces, "N or N m", (base,)),
                Quantity("displacement", self.displacement, "m or rad", (own,)),
                Quantity("velocity", self.velocity, "m/s or rad/s", (own,)),
                Quantity("acceleration", self.acceleration, "m/s^2 or rad/s^2", (own,)),
            ]
        )


def base_motion(
    component: LinearSystem,
    acceleration: ArrayLike,
    step: ArrayLike,
    ratios: ArrayLike = 0.0,
    displacement: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
) -> BaseMotion:
    """Response of a component to given accelerations of its interface coordinates.

    The interior moves statically with the base and, relative to that, in the modes with the base fixed, from rest.

    Args:
        component: whole or reduced; its own damping is not used.
        acceleration: (times, b) of the interface coordinates [m/s^2, rad/s^2].
        step: time between samples [s].
        ratios: damping ratios of the modes with the base fixed, one number or (modes,).
        displacement, velocity: initial ones of the interface (b,), default 0.

    Raises: ValueError for accelerations that do not fit the interface; ModelError, if concrete, for coordinates that
    the interface does not hold.  Source: S1 (5)-(6), (42)-(43).
    """
    acceleration = jnp.asarray(acceleration)
    if acceleration.ndim != 2 or acceleration.shape[1] != component.num_interface:
        raise ValueError(f"accelerations have shape {acceleration.shape}, not (times, {component.num_interface})")
    c = interface_first(component)
    K, M, b = c.stiffness, c.mass, c.num_interface
    T = motion_with(c, tuple(range(b)))
    base = modal_motion(jnp.zeros(b, K.dtype), 0.0, acceleration, step, displacement, velocity)
    load = -(acceleration @ (M @ T)[b:].T)
    relative = modal_response(K=K[b:, b:], M=M[b:, b:], load=load, step=step, ratios=ratios)
    x, v, a = ((q @ T.T).at[:, b:].add(y) for q, y in zip(base, relative, strict=True))
    return BaseMotion(x, v, a, (a @ M.T + x @ K.T) @ T)
