"""`Cycle`: a motion over one period that comes back to its start."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from ..checks import place_of
from ..errors import ModelError
from ..model._system import System
from ..motion._motion import Motion
from ..motion._peaks import peak
from ..quantities import Axis, Quantity, numbered
from ..reports import Report
from ..tables import format_number
from ._chart import displacement

#: Errors of multipliers: of rounding, and of those that are nearly 1 twice, in a family of cycles or at a fold.
_ROUNDING, _OF_DOUBLE = 1e-9, 1e-5


class Cycle(Motion):
    """A periodic motion: a `Motion` over one period, which every question of a motion takes.

    Attributes:
        period: () [s], of all that repeats: of `periods=3` three times that of the drives.
        multipliers: (n,) of Floquet, the largest first: factors by which small deviations change over the period.
        num_trivial: how many of them, the nearest to 1, are 1 for any such cycle: along a free period (static).
        residual: () by which the ends of the segments miss the next begins, over the size of the motion.
        rate_residual: () the same of the rates at the end beside those at the start.
        is_singular: () true where a multiplier that is not trivial is 1: the cycle is one of many, or at a fold, and
            its derivatives are NaN.
        repeats: () times that the motion repeats within the period, up to eight: more than 1 where `periods=` found
            no subharmonic, or a free period is a multiple of the machine's own.
        segments: of the multiple shooting (static).
    """

    period: Float[Array, "..."] = eqx.field(kw_only=True)
    multipliers: Complex[Array, "... n"] = eqx.field(kw_only=True)
    residual: Float[Array, "..."] = eqx.field(kw_only=True)
    rate_residual: Float[Array, "..."] = eqx.field(kw_only=True)
    is_singular: Bool[Array, "..."] = eqx.field(kw_only=True)
    repeats: Int[Array, "..."] = eqx.field(kw_only=True)
    num_trivial: int = eqx.field(static=True, kw_only=True)
    segments: int = eqx.field(static=True, kw_only=True)

    def report(self) -> Report:
        found = super().report()
        own = [
            Quantity("period", self.period, "s"),
            Quantity("multiplier", self.multipliers, "", (numbered("multiplier", self.multipliers.shape[-1]),)),
        ]
        if powers := self.mean_powers:
            values = np.stack([np.asarray(power) for power in powers.values()], axis=-1)
            own.append(Quantity("mean power", values, "W", (Axis("element", list(powers)),)))
        if self.period.ndim:
            return Report([*own, *found.quantities], fault=found.fault, t=self.ts)
        largest = format_number(np.max(np.abs(np.asarray(self.multipliers)), initial=0.0))
        words = "stable" if bool(self.stable) else "not stable"
        summary = f"period {format_number(self.period)} s, {words}, largest multiplier {largest}; {found.summary}"
        return found._replace(quantities=[*own, *found.quantities], summary=summary)

    @property
    def stable(self) -> Bool[Array, "..."]:
        """True if all multipliers but the one along a free period are smaller than 1: small deviations die out, but
        for a shift in time (traceable).  A cycle that is one of many is not, nor is one at a fold."""
        others = without_trivial(self.multipliers, min(self.num_trivial, 1))
        is_double = self.is_singular | (self.num_trivial > 1)
        margin = jnp.where(is_double, _OF_DOUBLE, _ROUNDING)
        return jnp.all(jnp.abs(others) < 1.0 - margin[..., None], axis=-1)

    @property
    def frequency(self) -> Float[Array, "..."]:
        """Cycles in a second [Hz]."""
        return 1.0 / self.period

    @property
    def mean_powers(self) -> Mapping[str, Array]:
        """Mean power (...) [W] of each force element over the cycle, "drives" that of all drives; negative where it
        takes energy out."""
        return {name: (w[..., -1] - w[..., 0]) / self.period for name, w in self.diagnostics.work.items()}

    def mean_speed(self, system: System, joint: str) -> Float[Array, ""]:
        """Mean velocity () of a joint of one freedom over the cycle [rad/s, m/s], by the way that it has made.

        Raises: UnknownNameError; ModelError for a joint of several freedoms.
        """
        moved = displacement(system.topology, self.states.coordinates[0], self.states.coordinates[-1])
        return moved[_column(system, joint)] / self.period

    def fluctuation(self, system: System, joint: str) -> Float[Array, ""]:
        """Coefficient of fluctuation () of the speed of a joint: largest less least velocity, over the mean one.

        Raises: as `mean_speed`.  Source: Shigley and Uicker, Theory of machines and mechanisms, 14.
        """
        column = _column(system, joint)
        mean = self.mean_speed(system, joint)
        both = peak(system, self, lambda s: jnp.stack([1.0, -1.0]) * s.velocities[column]).value
        return jnp.sum(both) / jnp.abs(mean)


def without_trivial(multipliers: Array, number: int) -> Array:
    """Multipliers (..., n - number) without those nearest to 1."""
    if number == 0:
        return multipliers
    order = jnp.argsort(jax.lax.stop_gradient(jnp.abs(multipliers - 1.0)), axis=-1)
    return jnp.take_along_axis(multipliers, order[..., number:], axis=-1)


def _column(system, joint):
    """Velocity column of a joint of one freedom."""
    top = system.topology
    place_of("joint", joint, top.joint_names)
    part = top.joints[top.joint_index[joint]]
    if part.num_velocities != 1:
        fault = f"joint {joint!r} has {part.num_velocities} velocities, a mean speed is that of one"
        raise ModelError([fault], "the question")
    return part.first_velocity
