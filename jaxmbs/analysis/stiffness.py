"""Local stiffness on the independent coordinates, by cause: springs, their preload, gravity, loads.

`K = -dQ/dphi`, the total derivative along the constraints at rest.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..dynamics.efforts import stored_wrench
from ..dynamics.elastic import elastic_body_stiffness
from ..dynamics.ports import efforts_at_rest
from ..kinematics.configuration import Configuration, at_state
from ..kinematics.influence import velocity_map
from ..kinematics.influence_second import along_independent
from ..math.linalg import direction, safe_norm, skew
from ..model.question import question
from ..model.system import System


class Stiffness(eqx.Module):
    """Shares (N, N) of the local stiffness; rows are efforts, columns independent coordinates.

    Attributes:
        elastic: `sum K_i G_C^T G_C`, the springs' own rates seen through their KIC.
        antagonistic: `sum K_i dq_C^T . {dG_C/dphi}`, what preload makes of the changing geometry; any sign.
        gravity: -de_G/dphi.
        sources: -dQ*/dphi of loads and actuators at rest: preload of redundant actuation is here.
    """

    elastic: Float[Array, "n n"]
    antagonistic: Float[Array, "n n"]
    gravity: Float[Array, "n n"]
    sources: Float[Array, "n n"]

    @property
    def total(self):
        """K (N, N), the Hessian of the potential where all loads have one."""
        return self.elastic + self.antagonistic + self.gravity + self.sources


@question
def stiffness(system: System, state) -> Stiffness:
    """Local stiffness at a state, velocities taken as zero.

    `-d e_C/dphi` has plus on both terms; S2 (71) prints a stray minus.  Loops, redundant springs and redundant
    actuation included; for coordinates that are integrals of their velocities the spring shares are symmetric.

    Source: S2 (68)-(71).
    """
    at = at_state(system, state, inertias=False)
    slopes = along_independent(system, at, lambda at: efforts_at_rest(system, at))
    stored, gravity, sources = (-slope for slope in slopes)
    elastic = elastic_stiffness(system, at)
    return Stiffness(elastic, stored - elastic, gravity, sources)


def elastic_stiffness(system: System, at: Configuration):
    """`sum K_i G_C^T G_C` (N, N): each law at the rate of what it stores, geometry frozen.

    Source: S2 (68)-(71), first term.
    """
    Gamma, t = velocity_map(system, at)[0], at.t
    frames = _frame_jacobian(system, at, Gamma)
    total = jnp.zeros((Gamma.shape[1],) * 2, at.psi.dtype)
    for group in system.forces:
        a, b = np.asarray(group.first), np.asarray(group.second)
        if group.port == "line":
            d = at.x[b] - at.x[a]
            k = _rates(group.law, jax.vmap(safe_norm)(d), t)
            g = jnp.einsum("ec,ecn->en", jax.vmap(direction)(d), frames[b, 3:] - frames[a, 3:])
            total = total + jnp.einsum("e,en,em->nm", k, g, g)
        elif group.port == "joint":
            total = total + jnp.einsum("e,en,em->nm", _rates(group.law, at.psi[b], t), Gamma[a], Gamma[a])
        elif group.port == "pose":
            total = total + jnp.sum(
                jax.vmap(_pose_stiffness, (0, 0, 0, 0, None))(group.law, *_relative(at, frames, a, b), t), axis=0
            )
    return total + elastic_body_stiffness(system, at, Gamma)


def _rates(laws, x, t):
    """K (n,) of scalar laws at x (n,): the curvature of their potentials; servos have none, they are sources."""
    return jax.vmap(lambda law, x: jax.grad(jax.grad(law.potential))(x, t))(laws, x)


def _frame_jacobian(system, at, Gamma):
    """(frames, 6, N): angular velocity of every frame and velocity of its origin per independent velocity."""
    top = system.topology
    path = np.vstack([top.nodes.path, np.zeros((1, top.nodes.size), bool)])[np.asarray(top.frame_node)]
    twist = jnp.einsum("fk,kc,kn->fcn", jnp.asarray(path, Gamma.dtype), at.S, Gamma)
    moved = twist[:, 3:] + jnp.einsum("fij,fjn->fin", -jax.vmap(skew)(at.x), twist[:, :3])
    return jnp.concatenate([twist[:, :3], moved], axis=1)


def _relative(at, frames, a, b):
    """Pose of frame B in frame A, and its rate (6, N) per independent velocity, in A axes."""
    R_a, d = at.R[a], at.x[b] - at.x[a]
    turn = frames[b, :3] - frames[a, :3]
    move = frames[b, 3:] - frames[a, 3:] + jnp.einsum("eij,ejn->ein", jax.vmap(skew)(d), frames[a, :3])
    rate = jnp.concatenate([jnp.einsum("eji,ejn->ein", R_a, part) for part in (turn, move)], axis=1)
    return jnp.einsum("eji,ejk->eik", R_a, at.R[b]), jnp.einsum("eji,ej->ei", R_a, d), rate


def _pose_stiffness(law, R, d, G, t):
    """`G^T K G` of a law between two frames, K (6, 6) minus the slope of the wrench that it stores."""

    def slope(column):
        moved = (skew(column[:3]) @ R, column[3:])
        return jax.jvp(lambda R, d: stored_wrench(law, R, d, t), (R, d), moved)[1]

    return -G.T @ jax.vmap(slope, 1, 1)(G)
