"""What a simulation returns: states at the saved times, how it ended, and its accounts."""

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float, Int

from ..kinematics.state import State
from ..status import Status, succeeded


class Diagnostics(eqx.Module):
    """Accounts of a motion, per saved time (T,) unless said otherwise.

    Attributes:
        kinetic, potential: energies [J].
        work: done on the system up to each time beside stored energy, by force element [J], negative when dissipated;
            "drives" holds that of driven joints and moving constraints.
        energy_residual: kinetic + potential - their start - all work [J].
        constraint_drift: largest residual of the positions.
        velocity_drift: largest residual of the velocities.
        num_steps, num_rejected: of the integrator ().
    """

    kinetic: Float[Array, " times"]
    potential: Float[Array, " times"]
    work: dict
    energy_residual: Float[Array, " times"]
    constraint_drift: Float[Array, " times"]
    velocity_drift: Float[Array, " times"]
    num_steps: Int[Array, ""]
    num_rejected: Int[Array, ""]


class Motion(eqx.Module):
    """States at the times `ts` (T,), the result code () and diagnostics; a pytree, so it can be batched.

    `end` is the state that the integrator reached, at its time `end.t` [s].  Of a motion that failed the states saved
    before are kept; those after it are NaN, and so is every result and derivative that follows from them.  Where only
    the energy account is off all states are kept.
    """

    ts: Float[Array, " times"]
    states: State
    result: Int[Array, "..."]
    diagnostics: Diagnostics
    end: State

    @property
    def status(self) -> Status:
        """How the motion ended, `str` of it in words (concrete motions of one design)."""
        return Status(int(np.asarray(self.result)))

    @property
    def ok(self) -> jax.Array:
        """Whether the motion ended as asked (traceable)."""
        return succeeded(self.result)
