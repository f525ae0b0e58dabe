"""Elastic bodies: momenta and loads on the nodes that carry their interfaces, and on their modes.

With flows `y = B u_e` of interface twists u_e, momenta `pi = dT/dy` and loads f on y, each body obeys
`pi_dot + g = f` with its gyroscopic loads g.  So its interfaces carry the momenta `h = B^T pi` and
`h_dot = B^T f + (B_dot^T pi - B^T g)`: elastic bodies add h and the loads on the right to those of rigid bodies.
Source: S2 (29), (38)-(42) for bodies that deform.
"""

import jax
import jax.numpy as jnp
import numpy as np

from ..errors import ModelError
from ..forces._validity import Margin
from ..kinematics._configuration import at_rest
from ..kinematics._elastic import (
    ElasticState,
    elastic_state,
    flow_map,
    flow_rate,
    interface_rates,
    interface_wrenches,
    pose_rates,
)
from ..kinematics._wrench_targets import node_targets
from ..model._elastic import ElasticGroup
from ..model._system import System
from ._body import AbstractBodies
from ._loads import Loads, on_columns

#: Mean deflection over the radius of gyration up to which a body deforms by little: a tenth of the length at the tip
#: of a cantilever.
MOST_DEFLECTION = 0.1


class ElasticBodies(AbstractBodies):
    """Elastic bodies of one shape."""

    group: ElasticGroup

    def mass(self, system):
        return jnp.sum(self.group.body.inertia[:, 3, 3])

    def momenta(self, system, at):
        return self._loads(lambda body, s: body.momenta(s.q, s.flow), system, at)

    def inertial_loads(self, system, at):
        """`B_dot^T pi - B^T g` and gravity."""

        def loads(body, s: ElasticState):
            pi = body.momenta(s.q, s.flow)
            turning = jax.jvp(lambda R, x, q: interface_wrenches(body, R, x, q, pi), (s.R, s.x, s.q), pose_rates(s))[
                1
            ]
            load = body.gravity_loads(s.q, system.gravity @ s.R) - body.gyroscopic_loads(s.q, s.flow)
            return jax.tree.map(jnp.add, turning, interface_wrenches(body, s.R, s.x, s.q, load))

        return self._summed(loads, system, at)

    def inverse_dynamics_loads(self, system, at, V_dot, u_dot, owners):
        def loads(body, s: ElasticState, V_dot, rates_dot):
            return inverse_dynamics_load(body, s, flow_rate(body, s, V_dot, rates_dot), system.gravity @ s.R)

        return self._loads(loads, system, at, owners, *interface_rates(system, self.group, V_dot, u_dot))

    def energies(self, system, at):
        body, s = self.group.body, elastic_state(system, self.group, at)
        kinetic = jnp.sum(jax.vmap(lambda body, s: body.kinetic_energy(s.q, s.flow))(body, s))
        moment = jnp.einsum("eij,ej->ei", s.R, jax.vmap(lambda body, q: body.first_moment(q))(body, s.q))
        return kinetic, body.inertia[:, 3, 3] @ (s.x[:, 0] + at.origin[None]) + jnp.sum(moment, axis=0)

    def validity(self, system, at):
        return self._margins(elastic_state(system, self.group, at).q)

    def _margins(self, q):
        """Root of the mean square deflection, by mass, that is left to a tenth of the radius of gyration about the
        floating frame [m], at deformations q (bodies, m)."""
        body, m = self.group.body, q.shape[1]
        mass = body.inertia[:, 3, 3]
        bent = jnp.einsum("ei,eij,ej->e", q, body.inertia[:, -m:, -m:], q) / mass
        size = jnp.trace(body.inertia[:, :3, :3], axis1=1, axis2=2) / (2.0 * mass)
        root = jnp.where(bent > 0, jnp.sqrt(jnp.where(bent > 0, bent, 1.0)), 0.0)
        end = "deforms by more than a tenth of its size, give it as several bodies or as a beam"
        return self.group.names, {"deflection": Margin(MOST_DEFLECTION * jnp.sqrt(size) - root, "m", end)}

    def weight(self, system, at, Gamma):
        still = at_rest(system, at)
        loads = self._loads(lambda body, s: body.gravity_loads(s.q, system.gravity @ s.R), system, still)
        return Gamma.T @ on_columns(system, at, loads)

    def strain_efforts(self, system, at, owners):
        """Source: S2 (56)-(57), (72) with the strains in place of springs."""
        s = elastic_state(system, self.group, at)
        rates = s.flow[:, 6:]
        power = -jnp.einsum("ek,ekl,el->e", rates, self.group.body.damping, rates)
        return self._collected(_carried(lambda body, s: body.strain_loads(s.q, s.flow)), system, s, owners), (power,)

    def frozen_strain_loads(self, system, at):
        """Source: S2 (59), (69) with the strains in place of springs."""
        s = elastic_state(system, self.group, at_rest(system, at))
        held = jax.vmap(lambda body, s: body.strain_loads(s.q, s.flow))(self.group.body, s)
        carry = lambda body, s, load: load
        return lambda moved: self._loads(carry, system, at_rest(system, moved), None, held)

    def strain_energy(self, system, at):
        """Source: S2 (70)."""
        return self._energy(elastic_state(system, self.group, at_rest(system, at)).q)

    def strain_energy_and_validity(self, system, at):
        q = elastic_state(system, self.group, at_rest(system, at)).q
        return self._energy(q), self._margins(q)

    def _energy(self, q):
        """Strain energy () of all bodies at deformations q (bodies, modes)."""
        if self.group.body.stiffening is not None:
            return jnp.sum(jax.vmap(lambda body, q: body.strain_energy(q))(self.group.body, q))
        return 0.5 * jnp.einsum("ek,ekl,el->", q, self.group.body.stiffness, q)

    def strain_stiffness(self, system, at, Gamma):
        """`sum G^T K G` with the rates of deformation G per independent velocity.  Source: S2 (68)-(71)."""
        s = elastic_state(system, self.group, at_rest(system, at))
        G = flow_map(system, self.group, at, s)[:, 6:] @ Gamma
        K = self.group.body.stiffness
        if self.group.body.stiffening is not None:
            K = jax.vmap(lambda body, q: jax.hessian(body.strain_energy)(q))(self.group.body, s.q)
        return jnp.einsum("ekn,ekl,elm->nm", G, K, G)

    def _loads(self, function, system, at, owners=None, *rates):
        """Loads on owners and columns from `function(body, state, *rates)`, loads (6 + m,) on the flow of a body."""
        return self._summed(_carried(function), system, at, owners, *rates)

    def _summed(self, function, system, at, owners=None, *rates):
        """Loads on owners (default: nodes) and columns from a function that returns, for a body, the wrenches on its
        interfaces and the efforts on its modes."""
        return self._collected(function, system, elastic_state(system, self.group, at), owners, *rates)

    def _collected(self, function, system, s, owners, *rates):
        """The same at the states s of the bodies."""
        frames, columns = np.array(self.group.frames), np.array(self.group.columns, int)
        wrench, column = jax.vmap(function)(self.group.body, s, *rates)
        wrench = (owners or node_targets(system)).collect(frames.reshape(-1), wrench.reshape(-1, 6))
        return Loads(wrench, jnp.zeros(system.topology.num_velocities, column.dtype).at[columns].add(column))


def _carried(function):
    """Wrenches on the interfaces and efforts on the modes by a function that gives the load on the flow of a body."""
    return lambda body, s, *rates: interface_wrenches(body, s.R, s.x, s.q, function(body, s, *rates))


def inverse_dynamics_load(body, s: ElasticState, rate, gravity):
    """Load (6 + m,) on the flow of one body that the flow's rate (6 + m,) requires beside gravity (3,), in floating
    axes."""
    pi_dot = jax.jvp(body.momenta, (s.q, s.flow), (s.flow[6:], rate))[1]
    return pi_dot + body.gyroscopic_loads(s.q, s.flow) - body.gravity_loads(s.q, gravity)


def require_rigid(system: System, what: str) -> None:
    """Refuse elastic bodies in a computation that is defined for rigid ones.  Raises: ModelError."""
    names = [name for group in system.elastic for name in group.names]
    if names:
        raise ModelError(
            [
                f"{what} are defined for rigid bodies only, but this system has elastic bodies: {', '.join(names)}; "
                "use mass_matrix, bond_graph or bond_powers, which include them"
            ]
        )
