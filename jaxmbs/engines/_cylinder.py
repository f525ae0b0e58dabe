"""Gas pressure of a cylinder by crank angle."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if
from ..errors import ModelError
from ..math._interpolation import hermite, spline_slopes
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import Convertible, ScalarLike

_LEAST = 8  # points of a cycle


class CylinderPressure(eqx.Module):
    """Pressure in a cylinder over the crank angle, by a periodic cubic spline, and the force that it makes.

    A block gives it to a machine: `b.measure("angle", joint="crank")`, `b.force("gas", mbs.Actuator(0.0),
    joint="slide")`, `b.block("cylinder", mbs.blocks.Function(pressure.force), reads="angle", drives="gas")`.

    Attributes:
        angles: (k,) [rad] rising, at least eight, over less than the cycle.
        pressures: (k,) [Pa], absolute.
        area: [m^2] of the piston; back: pressure on its other side [Pa].
        strokes: 2 or 4, a cycle of one turn or of two (static).
        phase: angle [rad] by which the cycle comes later, of the other cylinders of an engine.
        sense: 1 where the force pushes along the slide's coordinate, else -1 (static).

    Raises: ModelError for angles that do not rise within a cycle, numbers that are none.
    """

    angles: Convertible[Float[Array, " k"]] = eqx.field(converter=as_array)
    pressures: Convertible[Float[Array, " k"]] = eqx.field(converter=as_array)
    area: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    back: Convertible[Float[Array, ""]] = eqx.field(converter=as_array, default=101325.0)
    strokes: int = eqx.field(static=True, default=4)
    phase: Convertible[Float[Array, ""]] = eqx.field(converter=as_array, default=0.0)
    sense: int = eqx.field(static=True, default=-1)

    __repr__ = fields_repr

    def __check_init__(self) -> None:
        k = self.angles.size
        faults = faults_if(
            (self.strokes not in (2, 4), f"strokes={self.strokes!r} must be 2 or 4"),
            (self.sense not in (1, -1), f"sense={self.sense!r} must be 1 or -1"),
            (self.angles.ndim != 1 or k < _LEAST, f"angles must be a row of at least {_LEAST}"),
            (self.pressures.shape != self.angles.shape, "pressures must be as many as angles"),
            (any_concrete(lambda x: ~(np.diff(x) > 0), self.angles), "angles must rise"),
            *(
                (
                    x.ndim > 0 or any_concrete(lambda v: ~(np.isfinite(v) & (v >= 0)), x),
                    f"{n} must be one number >= 0",
                )
                for n, x in (("area", self.area), ("back", self.back))
            ),
        )
        if not faults and any_concrete(lambda x: ~(x[-1] - x[0] < self.cycle), self.angles):
            faults = [f"angles must span less than the cycle of {self.cycle:.4g} rad: it repeats by itself"]
        if faults:
            raise ModelError(faults, "the cylinder")

    @property
    def cycle(self) -> float:
        """Crank angle of a cycle [rad]."""
        return np.pi * self.strokes

    def pressure(self, angle: ScalarLike) -> Float[Array, ""]:
        """Pressure () [Pa] at a crank angle () [rad]."""
        shifts = self.cycle * np.arange(-1, 2)
        points = jnp.concatenate([self.angles + jnp.asarray(s, self.angles.dtype) for s in shifts])
        values = jnp.tile(self.pressures, 3)
        late = jnp.asarray(angle, points.dtype) - self.phase - self.angles[0]
        return hermite(points, values, spline_slopes(points, values), self.angles[0] + late % self.cycle)

    def force(self, angle: ScalarLike, t: ScalarLike = 0.0) -> Float[Array, ""]:
        """Force () [N] on the piston along the slide's coordinate; t is not used."""
        return self.sense * self.area * (self.pressure(angle) - self.back)
