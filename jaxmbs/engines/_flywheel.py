"""Flywheels for a given coefficient of fluctuation, by the cycles of the machine."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..checks import number_faults
from ..cycles._cycle import Cycle
from ..errors import ModelError, SimulationError
from ..model._system import System
from ..quantities import Quantity
from ..reports import Report, Reported
from ..runtime import as_array
from ..typing import WordedError

_MOST_CYCLES = 25
_NONE = 1e-6  # of the first guess: no flywheel is needed
_CLOSE = 1e-7  # of the coefficient asked for


class Flywheel(Reported, eqx.Module):
    """A flywheel and the cycle with it.

    Attributes: inertia: () [kg m^2]; fluctuation: () of the joint's speed; cycle: with it; cycles: number of cycles
        that the search took (static).
    """

    inertia: Float[Array, ""]
    fluctuation: Float[Array, ""]
    cycle: Cycle
    cycles: int = eqx.field(static=True)

    def report(self) -> Report:
        found = [Quantity("inertia", self.inertia, "kg m^2"), Quantity("fluctuation", self.fluctuation, "")]
        return Report(found, f"found by {self.cycles} cycles")


def flywheel(
    cycle_of: Callable[[Any], tuple[System, Cycle]],
    joint: str,
    fluctuation: WordedError[float],
    first: WordedError[float],
) -> Flywheel:
    """The flywheel with which the speed of a joint has a given coefficient of fluctuation.

    Args:
        cycle_of: function of its inertia () [kg m^2] that gives the machine and its cycle.
        fluctuation: largest less least speed, over the mean one.
        first: a first guess of the inertia [kg m^2].

    The fluctuation is nearly inverse to the inertia, so that a secant on its inverse ends within a few cycles; no
    constant speed is assumed, as the usual formula `energy / (coefficient speed^2)` does.  Saved states must be close
    enough for the peaks of the speed (`steps=` of `periodic`).

    Raises: ModelError for numbers that are not positive, and where the machine is as even without a flywheel;
        SimulationError where the search does not end.

    Source: Shigley and Uicker, Theory of machines and mechanisms, 14.
    """
    faults = number_faults("fluctuation", fluctuation, positive=True) + number_faults("first", first, positive=True)
    if faults:
        raise ModelError(faults, "the flywheel")

    def evenness(inertia):
        """Inverse of the fluctuation, and the cycle."""
        system, cycle = cycle_of(as_array(inertia))
        return 1.0 / float(cycle.fluctuation(system, joint)), cycle

    wanted, a = 1.0 / float(fluctuation), float(first)
    even_a, cycle = evenness(a)
    b, even_b = a, even_a
    for number in range(1, _MOST_CYCLES):
        if abs(even_b / wanted - 1.0) <= _CLOSE:
            return Flywheel(as_array(b), as_array(1.0 / even_b), cycle, number)
        plain = even_b / b  # of a machine whose own inertia is small
        slope = plain if number == 1 else (even_b - even_a) / (b - a)
        slope = slope if np.isfinite(slope) and 0.3 * plain < slope < 3.0 * plain else plain
        a, even_a, b = b, even_b, b + (wanted - even_b) / slope
        if b <= _NONE * float(first):
            raise ModelError([f"the coefficient is below {fluctuation} without a flywheel"], "the flywheel")
        even_b, cycle = evenness(b)
    raise SimulationError(f"no flywheel was found: with {b:.4g} kg m^2 the coefficient is {1.0 / even_b:.4g}")
