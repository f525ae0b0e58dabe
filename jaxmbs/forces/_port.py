"""What a port is: where a force law meets the mechanism, a 1-junction of the paper's elements.

A port says what its law sees: the displacement that its potential depends on, the flow along which its effort acts,
and how the flow moves the displacement.  Effort times flow is power.  Efforts, energies, stiffness and bond graphs
ask the port and know no law.  Methods treat one element, but for `gather` and `spread`.  Source: S2 (56)-(76).
"""

import abc
import dataclasses
from typing import ClassVar

import jax
import jax.numpy as jnp
from jax import Array


@dataclasses.dataclass(frozen=True)
class AbstractPort(abc.ABC):
    """One kind of port; it has no numbers of its own."""

    num_flows: ClassVar[int | None]  # None: as many as velocities

    @abc.abstractmethod
    def gather(self, group, at, V, u) -> tuple:
        """What displacements and flows of all elements depend on: V (frames, 6) are the twists of the frames' bodies,
        u (nv,) the velocities."""

    @abc.abstractmethod
    def displacement(self, *seen) -> tuple:
        """Arguments of the potential."""

    @abc.abstractmethod
    def flow(self, *seen) -> Array:
        """(num_flows,), linear in V and u."""

    @abc.abstractmethod
    def rate(self, displacement, flow) -> tuple:
        """Rate of the displacement."""

    @abc.abstractmethod
    def effort(self, law, displacement, flow, t) -> Array:
        """(num_flows,) on the system."""

    @abc.abstractmethod
    def spread(self, group, seen, efforts, owners, num_velocities):
        """What efforts (n, num_flows) do: wrenches about the origin, summed on `kinematics.owners`, and efforts
        (nv,); None where there are none."""

    def reading(self, seen, effort) -> tuple[Array, Array | None, Array | None]:
        """What a user reads of an effort (num_flows,): it in public order; force and moment (3,) in world axes on the
        frame that it acts on, the moment about its origin; None where it acts on no frame."""
        return effort, None, None

    def potential(self, law, displacement, t) -> Array:
        """Stored energy [J]."""
        return law.potential(*displacement, t)

    def storage_power(self, law, displacement, flow, t) -> Array:
        """Power [W] that goes into the stored energy, time held."""
        potential = lambda *x: self.potential(law, x, t)  # noqa: E731
        return jax.jvp(potential, displacement, self.rate(displacement, flow))[1]

    def stored_effort(self, law, displacement, flow, t) -> Array:
        """The part (num_flows,) of the effort that the potential makes; of the flow only the shape counts."""
        return -jax.grad(lambda flow: self.storage_power(law, displacement, flow, t))(jnp.zeros_like(flow))

    def slope(self, law, displacement, flow, t) -> Array:
        """(num_flows, num_flows): how the stored effort falls as the element moves along its flows."""
        effort = lambda *x: self.stored_effort(law, x, flow, t)  # noqa: E731
        along = lambda column: jax.jvp(effort, displacement, self.rate(displacement, column))[1]  # noqa: E731
        return -jax.vmap(along, 1, 1)(jnp.eye(flow.size, dtype=flow.dtype))

    def stiffness(self, law, displacement, flow, t) -> Array:
        """The part of `slope` that the law makes at the rate of what it stores, the rest being an effort that turns
        with its element; none for loads, which are sources."""
        return jnp.zeros((flow.size, flow.size), flow.dtype)
