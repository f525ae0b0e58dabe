"""Accounts of a motion: energies, work, residuals, numbers of steps."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
from jaxtyping import Array, Float, Int

from ..quantities import Quantity
from ..reports import Report, Reported


class Diagnostics(Reported, eqx.Module):
    """Accounts of a motion, per saved time (T,) unless said otherwise.

    Attributes:
        kinetic, potential: energies [J].
        work: done on the system up to each time beside stored energy, by force element [J], negative when dissipated;
            "drives" holds that of driven joints and moving constraints, the name of an event that of its actions.
        energy_residual: kinetic + potential - their start - all work [J].
        constraint_drift: largest residual of the positions, without derivative.
        velocity_drift: largest residual of the velocities, without derivative.
        num_steps, num_rejected: of the integrator ().
        stiffening: by elastic body, the estimated relative error of its first frequency by stiffening that is left
            out, see `flexible.stiffening`.
    """

    kinetic: Float[Array, " times"]
    potential: Float[Array, " times"]
    work: Mapping[str, Array]
    energy_residual: Float[Array, " times"]
    constraint_drift: Float[Array, " times"]
    velocity_drift: Float[Array, " times"]
    num_steps: Int[Array, ""]
    num_rejected: Int[Array, ""]
    stiffening: dict = eqx.field(default_factory=dict)

    def report(self) -> Report:
        found = {"kinetic": self.kinetic, "potential": self.potential, "energy residual": self.energy_residual}
        found |= {f"work of {name}": work for name, work in self.work.items()}
        counts = {"steps": self.num_steps, "rejected steps": self.num_rejected}
        return Report(
            [
                *(Quantity(name, values, "J") for name, values in found.items()),
                Quantity("drift of positions", self.constraint_drift, "m or rad"),
                Quantity("drift of velocities", self.velocity_drift, "m/s or rad/s"),
                *(Quantity(name, count) for name, count in counts.items()),
                *(Quantity(f"stiffening of {name}", x) for name, x in self.stiffening.items()),
            ]
        )

    def rows(self, index: Any) -> "Diagnostics":
        """The accounts at saved times of a number, a slice or an array of numbers."""
        return jax.tree.map(lambda x: x[index] if x.ndim else x, self)
