"""One spring between two points, as the paper writes it: its vector, its net displacement, and their KIC.

World axes; a frame is a body or frame name, or (name, point).  Points that coincide have no direction: n is zero.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...assembly._state import State
from ...checks import negative
from ...constraints._kic import velocity_map
from ...constraints._kic_second import point_kic
from ...constraints._mobility import independent_state_function
from ...kinematics._configuration import at_state
from ...kinematics._points import jacobian, locate_frame, position
from ...math._linalg import direction, safe_norm
from ...model._system import System
from ...typing import FrameLike, ScalarLike, Vector3


@independent_state_function
def spring_vector(
    system: System, state: State, frame_a: FrameLike, frame_b: FrameLike
) -> tuple[Vector3, Float[Array, "3 N"]]:
    """q_C (3,) [m] from A to B, and its KIC `G_hat = d q_C / dphi` (3, N).

    Raises: UnknownNameError.  Source: S2 (56)-(57), (61)-(63).
    """
    for frame in (frame_a, frame_b):
        locate_frame(system, frame)
    ends = [jacobian(system, state, frame)[:3] for frame in (frame_a, frame_b)]
    q_C = position(system, state, frame_b) - position(system, state, frame_a)
    Gamma = velocity_map(system, at_state(system, state, inertias=False))[0]
    return q_C, (ends[1] - ends[0]) @ Gamma


@independent_state_function
def spring_displacement(
    system: System, state: State, frame_a: FrameLike, frame_b: FrameLike, free_length: ScalarLike
) -> tuple[Vector3, Float[Array, "3 N"]]:
    """Net displacement `dq_C = (|q_C| - q0) n` (3,) [m] of a spring of free length q0, and `d dq_C / dphi` (3, N).

    (66) sets this derivative equal to `spring_kic`; so it is at the free length, elsewhere n turns as well:
    `d dq_C / dphi = G_C + (|q_C| - q0) dn/dphi`.

    Raises: UnknownNameError.  Source: S2 (58), (60), (66).
    """
    q_C, G_hat = spring_vector(system, state, frame_a, frame_b)
    if negative(free_length):
        raise ValueError(f"free_length = {free_length} must not be negative")
    n, length = direction(q_C), safe_norm(q_C)
    G_C = jnp.outer(n, n @ G_hat)
    turned = jnp.where(length > 0, 1.0 - free_length / jnp.where(length > 0, length, 1.0), 1.0)
    return q_C - free_length * n, G_C + turned * (G_hat - G_C)


@independent_state_function
def spring_kic(system: System, state: State, frame_a: FrameLike, frame_b: FrameLike) -> Float[Array, "3 N"]:
    """`G_C = n d|q_C|/dphi` (3, N): what of `G_hat` is along the spring; `e_C = -K G_C^T dq_C`.

    Raises: UnknownNameError.  Source: S2 (63)-(65), (67).
    """
    q_C, G_hat = spring_vector(system, state, frame_a, frame_b)
    n = direction(q_C)
    return jnp.outer(n, n @ G_hat)


@independent_state_function
def spring_kic_second(system: System, state: State, frame_a: FrameLike, frame_b: FrameLike) -> Float[Array, "N 3 N"]:
    """The tensor `{dG_C/dphi}` (N, 3, N): plane l, column n is `d G_C[:, l] / dphi_n`, from second-order KIC.

    `K dq_C^T . {dG_C/dphi}` is the antagonistic stiffness of the spring (the print has a stray minus).

    Raises: UnknownNameError.  Source: S2 (69)-(71).
    """
    q_C, G_hat = spring_vector(system, state, frame_a, frame_b)
    n, length = direction(q_C), safe_norm(q_C)
    along = n @ G_hat
    turning = (G_hat - jnp.outer(n, along)) / jnp.where(length > 0, length, 1.0)  # dn/dphi
    H = point_kic(system, state, frame_b)[1][:, :3] - point_kic(system, state, frame_a)[1][:, :3]
    slope = G_hat.T @ turning + jnp.einsum("c,lcn->ln", n, H)
    return along[:, None, None] * turning[None] + n[None, :, None] * slope[:, None, :]
