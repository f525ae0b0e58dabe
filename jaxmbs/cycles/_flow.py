"""The flow of a mechanism: the state after a time, by `simulate` with one set of options."""

from typing import Any

import equinox as eqx
from jax import Array

from ..assembly._state import State
from ..model._system import System
from ..motion._motion import Motion
from ..motion._simulate import simulate
from ..typing import AnyArray


class Flow(eqx.Module):
    """Options with which motions are simulated, see `simulate`."""

    solver: Any
    rtol: AnyArray
    atol: AnyArray
    event: Any
    formulation: Any = eqx.field(static=True)
    max_steps: int = eqx.field(static=True)

    def motion(
        self,
        system: System,
        state: State,
        ts: Array,
        gradient: str = "forward",
        longest_step: Array | None = None,
    ) -> Motion:
        """The motion from a state, saved at times ts (T,) [s]."""
        return simulate(
            system,
            state,
            ts=ts,
            solver=self.solver,
            rtol=self.rtol,
            atol=self.atol,
            gradient=gradient,
            formulation=self.formulation,
            event=self.event,
            max_steps=self.max_steps,
            longest_step=longest_step,
            progress=False,
            throw=False,
        )

    def end(
        self, system: System, state: State, t1: Array, gradient: str = "forward", least: Array | int | None = None
    ) -> State:
        """The state at a time t1 () [s].  Args: least: number of steps, for deviations that tolerances
        do not see where the motion is at rest."""
        longest = None if least is None else (t1 - state.t) / least
        return self.motion(system, state, t1[None], gradient, longest).end
