"""Interface of ports: the place where a force law acts on the mechanism, a 1-junction of the paper's elements.

A port defines the displacement that the law's potential depends on, the flow along which its effort acts, and the
rate of the displacement for a flow.  Effort times flow is power.  Efforts, energies, stiffness and bond graphs use
ports only and no law.  Methods treat one element, except `gather` and `spread`.  Source: S2 (56)-(76).
"""

import abc
import dataclasses
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
from jax import Array

from ._validity import Margin


@dataclasses.dataclass(frozen=True)
class AbstractPort(abc.ABC):
    """One kind of port; it has no numbers of its own."""

    num_flows: ClassVar[int | None]  # None: as many as velocities
    is_on_joint: ClassVar[bool] = False  # its element acts on a joint, its flow is this one's velocity
    is_on_line: ClassVar[bool] = False  # its element acts along the line between two points
    modulus: ClassVar[str] = "G"  # symbol of the transformer to its flow, S2 (56)

    @abc.abstractmethod
    def gather(self, group, at, V, u) -> tuple:
        """Inputs of `displacement` and `flow` for all elements, from the twists V (frames, 6) of the frames' bodies
        and the velocities u (nv,)."""

    def frames_of(self, group, k: int) -> tuple[int, ...]:
        """Frames that element k acts on; none of a joint or of the whole system."""
        return (group.first[k], group.second[k])

    def reference(self, *seen) -> tuple[Array, Array]:
        """Axes (3, 3) and place (3,) from the common origin of what a law says in space; those of its arguments."""
        raise NotImplementedError(f"a law on a {type(self).__name__} acts at no place")

    @abc.abstractmethod
    def still(self, num_coordinates: int, num_velocities: int) -> tuple:
        """Arguments of the effort before the time, at rest where it starts: for their shapes."""

    @abc.abstractmethod
    def displacement(self, *seen) -> tuple:
        """Arguments of the potential."""

    @abc.abstractmethod
    def flow(self, *seen) -> Array:
        """Flow (num_flows,), linear in V and u."""

    @abc.abstractmethod
    def rate(self, displacement, flow) -> tuple:
        """Rate of the displacement."""

    @abc.abstractmethod
    def arguments(self, displacement, flow) -> tuple[tuple, tuple]:
        """Displacement and velocity as the methods of a law take them."""

    @abc.abstractmethod
    def effort(self, law, displacement, flow, t) -> Array:
        """Effort (num_flows,) on the system."""

    @abc.abstractmethod
    def spread(self, group, seen, efforts, owners, num_velocities):
        """Loads of the efforts (n, num_flows): wrenches about the origin, summed on `owners`, a `WrenchTargets`, and
        efforts (nv,) on velocities; None where there are none."""

    def reading(self, seen, effort) -> tuple[Array, Array | None, Array | None]:
        """Results for the user from an effort (num_flows,): the effort in public order, and force and moment (3,) in
        world axes on the frame that it acts on, about its origin; None where it acts on no frame."""
        return effort, None, None

    def potential(self, law, displacement, t) -> Array:
        """Stored energy [J]."""
        return law.potential(*displacement, t)

    def storage_power(self, law, displacement, flow, t) -> Array:
        """Power [W] that goes into the stored energy at constant time."""
        potential = lambda *x: self.potential(law, x, t)
        return jax.jvp(potential, displacement, self.rate(displacement, flow))[1]

    def effort_and_storage_power(self, law, displacement, flow, t) -> tuple[Array, Array]:
        """Both, where they share costly parts in one evaluation: equal parts of two would not be merged in a loop."""
        return self.effort(law, displacement, flow, t), self.storage_power(law, displacement, flow, t)

    def stored_effort(self, law, displacement, flow, t) -> Array:
        """Part (num_flows,) of the effort that derives from the potential; only the shape of the flow is used."""
        return -jax.grad(lambda flow: self.storage_power(law, displacement, flow, t))(jnp.zeros_like(flow))

    def law_and_arguments(self, law, displacement, flow) -> tuple[Any, tuple]:
        """The law as it acts now, and the arguments of its effort before the time."""
        x, v = self.arguments(displacement, flow)
        return law, (*x, *v)

    def validity(self, law, displacement, flow, t) -> dict[str, Margin]:
        """Margins of the law by name."""
        law, arguments = self.law_and_arguments(law, displacement, flow)
        return law.validity(*arguments, t)

    def potential_and_validity(self, law, displacement, flow, t) -> tuple[Array, dict[str, Margin]]:
        """Both, where they share costly parts in one evaluation."""
        return self.potential(law, displacement, t), self.validity(law, displacement, flow, t)

    def slope(self, law, displacement, flow, t) -> Array:
        """Minus the derivative (num_flows, num_flows) of the stored effort along the flows of the element."""
        effort = lambda *x: self.stored_effort(law, x, flow, t)
        along = lambda column: jax.jvp(effort, displacement, self.rate(displacement, column))[1]
        return -jax.vmap(along, 1, 1)(jnp.eye(flow.size, dtype=flow.dtype))

    def stiffness(self, law, displacement, flow, t) -> Array:
        """Part of `slope` from the curvature of the law's potential; the rest is due to an effort that rotates with
        its element.  Zero for loads, which are sources."""
        return jnp.zeros((flow.size, flow.size), flow.dtype)
