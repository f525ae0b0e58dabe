"""The flow of a mechanism: the state after a time, by `simulate` with one set of options."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..assembly._state import State
from ..model._system import System
from ..motion._motion import Motion
from ..motion._simulate import simulate
from ..typing import AnyArray


class Flow(eqx.Module):
    """CycleOptions with which motions are simulated, see `simulate`."""

    solver: Any
    rtol: AnyArray
    atol: AnyArray
    event: Any
    formulation: Any = eqx.field(static=True)
    max_steps: int = eqx.field(static=True)

    def motion(self, system: System, state: State, ts: Array, gradient: str = "forward") -> Motion:
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
            progress=False,
            throw=False,
        )

    def end(self, system: System, state: State, t1: Array, gradient: str = "forward", least: int = 1) -> State:
        """The state at a time t1 () [s].  Args: least: number of equal intervals, at whose ends a step ends."""
        if least == 1:
            return self.motion(system, state, t1[None], gradient).end
        share = jnp.asarray(np.arange(1, least + 1) / least, t1.dtype)
        return self.motion(system, state, state.t + (t1 - state.t) * share, gradient).end
