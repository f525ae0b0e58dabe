"""Base excitation: a component whose interface is moved, exact for accelerations straight between samples."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..structures.modes import natural_modes
from ..structures.transient import modal_motion
from .base import Reduced
from .guyan import interface_basis


class BaseMotion(eqx.Module):
    """Motion of a component and the forces that move its base.

    Attributes:
        displacement, velocity, acceleration: (r, T) of the component's explicit coordinates, the interface first;
            `component.explicit().expand(...)` gives those of all coordinates.
        forces: (b, T) on the interface.
    """

    displacement: Float[Array, "r T"]
    velocity: Float[Array, "r T"]
    acceleration: Float[Array, "r T"]
    forces: Float[Array, "b T"]


def base_motion(component: Reduced, acceleration, step, ratios=0.0, displacement=None, velocity=None) -> BaseMotion:
    """The response to accelerations of the interface coordinates, each its own.

    The rest moves statically with the base and, relative to that, in the modes of the held base, from rest.

    Args:
        component: of any reduction, or `physical` for all coordinates; its own damping is not used.
        acceleration: (b, T) of the interface coordinates [m/s^2, rad/s^2].
        step: between samples [s].
        ratios: damping of the modes of the held base, one number or one for each.
        displacement, velocity: of the interface at the start (b,), default 0.

    Raises: ValueError for accelerations that do not fit the interface.  Source: S1 (5)-(6), (42)-(43).
    """
    if acceleration.ndim != 2 or len(acceleration) != component.num_interface:
        raise ValueError(f"accelerations have shape {acceleration.shape}, not ({component.num_interface}, times)")
    c = component.explicit()
    K, M, b = c.stiffness, c.mass, c.num_interface
    T = interface_basis(K, tuple(range(b)))
    modes = natural_modes(K[b:, b:], M[b:, b:], num_rigid=0)
    loads = jnp.concatenate([acceleration, -(modes.shapes.T @ (M @ T)[b:] @ acceleration)])
    w = jnp.concatenate([jnp.zeros(b, K.dtype), modes.angular_frequencies])
    start = [None if a is None else jnp.zeros_like(w).at[:b].set(a) for a in (displacement, velocity)]
    shapes = jnp.concatenate([T, jnp.zeros_like(M[:, b:]).at[b:].set(modes.shapes)], axis=1)
    x, v, a = (shapes @ q.T for q in modal_motion(w, jnp.zeros_like(w).at[b:].set(ratios), loads.T, step, *start))
    return BaseMotion(x, v, a, T.T @ (M @ a + K @ x))
