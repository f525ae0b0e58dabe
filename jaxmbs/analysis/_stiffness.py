"""Local stiffness on the independent coordinates, by cause: springs, their preload, gravity, loads.

`K = -dQ/dphi`, the total derivative along the constraints at rest.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..assembly._state import State
from ..constraints._kic import velocity_map
from ..constraints._kic_second import along_independent
from ..constraints._mobility import independent_state_function
from ..dynamics._bodies import bodies_of, total
from ..dynamics._conservative_efforts import conservative_efforts, source_efforts
from ..dynamics.paper._ports import projected_gravity_effort
from ..friction._joint_friction import refuse_friction
from ..kinematics._configuration import Configuration, at_rest, at_state, node_motion
from ..kinematics._element_flows import element_flows
from ..model._system import System
from ..quantities import matrix
from ..reports import Report, Reported
from ..signal_flow._acting_laws import acting_laws
from ..signal_flow._signals import with_signals


class Stiffness(Reported, eqx.Module):
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

    def report(self) -> Report:
        shares = {name: getattr(self, name) for name in ("total", "elastic", "antagonistic", "gravity", "sources")}
        return Report([matrix(name, share, "N/m or N m") for name, share in shares.items()])

    @property
    def total(self) -> Float[Array, "n n"]:
        """K (N, N), the Hessian of the potential where all loads have one."""
        return self.elastic + self.antagonistic + self.gravity + self.sources


@independent_state_function
def stiffness(system: System, state: State) -> Stiffness:
    """Local stiffness at a state, velocities taken as zero.

    Every share is computed separately: the antagonistic one is the effect of the changing KIC at constant efforts of
    the springs.  `-d e_C/dphi` has plus on both terms; S2 (71) prints a stray minus.  Loops, redundant springs and
    redundant actuation included; for coordinates that are integrals of their velocities the spring shares are
    symmetric.

    Source: S2 (68)-(71).
    """
    refuse_friction(system, "stiffness", "at stick it has no slope of use; build the system without it")
    at = at_state(system, state, inertias=False)
    pull = conservative_efforts(system, at)

    def efforts(moved):
        Gamma = velocity_map(system, moved)[0]
        return (
            Gamma.T @ pull(moved),
            projected_gravity_effort(system, moved, Gamma),
            Gamma.T @ source_efforts(system, moved),
        )

    held, gravity, sources = (-slope for slope in along_independent(system, at, efforts))
    elastic, turning = spring_stiffness(system, at)
    return Stiffness(elastic, held + turning, gravity, sources)


def spring_stiffness(system: System, at: Configuration):
    """Shares (elastic, turning) of the stiffness (N, N) at frozen KIC: `sum K_i G_C^T G_C` with the curvature K_i of
    each law's potential, and the effect of efforts that rotate with their element, as a spring between two points.

    Source: S2 (68)-(70), first term.
    """
    Gamma = velocity_map(system, at)[0]
    elastic = total(bodies.strain_stiffness(system, at, Gamma) for bodies in bodies_of(system))
    turning = jnp.zeros_like(elastic)
    if not system.forces:
        return elastic, turning
    at = with_signals(system, at)
    twists, still = jax.vmap(lambda u: node_motion(system.topology, at.S, u), 1)(Gamma), at_rest(system, at)
    for group, law in acting_laws(system, at):
        flows = jax.vmap(lambda V, u, group=group: element_flows(system, group, at, V, u)[2], (0, 1), -1)
        G, (_, displacement, flow) = flows(twists, Gamma), element_flows(system, group, at, still.V, still.u)

        def both(law, x, f, port=group.port):
            K = port.stiffness(law, x, f, at.t)
            return K, port.slope(law, x, f, at.t) - K

        found = jax.vmap(both)(law, displacement, flow)
        own, turned = (jnp.einsum("eka,ekl,elb->ab", G, K, G) for K in found)
        elastic, turning = elastic + own, turning + turned
    return elastic, turning
