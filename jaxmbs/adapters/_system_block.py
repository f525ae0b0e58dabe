"""`as_block`: a mechanism as a block of flat arrays, for programs of block diagrams and for integrators."""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..assembly._state import State
from ..constraints._mobility import with_mobility_at
from ..model._changes import with_changes
from ..model._entry_points import check_single_state, check_system
from ..model._system import System
from ..runtime import jit
from ..signal_flow._sampling import refuse_sampled
from ..tables import sentence_repr
from ..typing import ScalarLike, WordedError
from .fmi._parameters import Parameters
from .fmi._program import FlatMechanism
from .fmi._variables import hidden_names, input_names, output_names, state_names


class SystemBlock(eqx.Module):
    """A mechanism as a block: `block(t, x, u)` gives the rates of the states and the outputs.

    States x are the independent coordinates, their velocities and the internal states of force elements and blocks.
    Coordinates that loops make depend on them follow at the end: the loops are closed from these, so that a crank
    turns round, and results do not depend on their small errors.  Numbers of the system are leaves: the block works
    under `equinox.filter_jit`, `vmap` and all derivatives, by its system too; a call compiles at the first time.

    Attributes:
        system: the mechanism.
        t0: time of the start [s].
        initial_state: (n,).
        state_names, inputs, output_names: of the entries of x (n,), u (m,) and y (p,).
    """

    system: System
    t0: Float[Array, ""]
    initial_state: Float[Array, " n"]
    state_names: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    output_names: tuple[str, ...] = eqx.field(static=True)
    known_units: tuple[tuple[str, str], ...] = eqx.field(static=True, repr=False)
    asked: tuple[str, ...] | Callable[..., Any] = eqx.field(static=True, repr=False)

    __repr__, _repr_html_ = sentence_repr(
        lambda block: (
            f"states {', '.join(block.state_names) or 'none'}; inputs {', '.join(block.inputs) or 'none'}; "
            f"outputs {', '.join(block.output_names) or 'none'}"
        )
    )

    def __call__(self, t: ScalarLike, x: Any, u: Any = ()) -> tuple[Float[Array, " n"], Float[Array, " p"]]:
        """Rates (n,) of the states and outputs (p,) at the time [s], states (n,) and inputs (m,).

        NaN where the loops do not close.  Raises: ValueError for arrays of other sizes.
        """
        kind = self.initial_state.dtype
        t, x, u = jnp.asarray(t, kind), jnp.asarray(x, kind), jnp.atleast_1d(jnp.asarray(u, kind))
        for word, names, found in (("states", self.state_names, x), ("inputs", self.inputs, u)):
            if found.shape != (len(names),):
                told = ", ".join(names) or "none"
                raise ValueError(f"{word} have shape {found.shape}, not ({len(names)},): {told}")
        return _rates_and_outputs(self, t, x, u)

    @property
    def units(self) -> dict[str, str]:
        """Units of states and of coordinates among the outputs, by name; "" for numbers of a quaternion."""
        return dict(self.known_units)

    def derivatives(self, t: ScalarLike, x: Any, u: Any = ()) -> Float[Array, " n"]:
        """Rates (n,) of the states alone."""
        return self(t, x, u)[0]

    def outputs(self, t: ScalarLike, x: Any, u: Any = ()) -> Float[Array, " p"]:
        """Outputs (p,) alone."""
        return self(t, x, u)[1]


@jit
def _rates_and_outputs(block, t, x, u):
    return _flat(block.system, block.inputs, block.asked).block(t, x, u)


def _flat(system, inputs, asked):
    return FlatMechanism(system, Parameters((), np.zeros(0), lambda _: system), inputs, asked, {}, "as_block")


def as_block(
    system: WordedError[System],
    inputs: WordedError[Sequence[str]] = (),
    outputs: WordedError[Sequence[str] | Callable] = (),
    state: State | None = None,
) -> SystemBlock:
    """A mechanism as a block of flat arrays: `(t, x, u) -> (dx, y)`, for python-control, SciPy or a diagram on JAX.

    `mbs.vector_field` is the same with pytrees, momenta and a projection; `mbs.linearise` gives the four matrices at
    a state; `mbs.export_fmu` writes a block as a file.

    Args:
        inputs: fields of force elements and blocks that are functions of time, "motor.voltage", or the name of an
            element with one such field.
        outputs: names of joints (their coordinates), measures, blocks and internal states; or a function of (system,
            state, time) to a dict of numbers and arrays.
        state: start; default `State.at(system)`.

    Raises: TypeError for what is no system; ModelError for sampled blocks, or a joint whose quaternion is independent
    in part; UnknownNameError for inputs and outputs that are not there.
    """
    check_system(system)
    refuse_sampled(system, "as_block")
    state = State.at(system) if state is None else state
    check_single_state(system, state)
    system = with_mobility_at(with_changes(system, state), state)
    inputs = input_names(system, inputs)
    asked = outputs if callable(outputs) else output_names(system, outputs)
    flat = _flat(system, inputs, asked)
    states, followers = state_names(flat), hidden_names(flat)
    t, x, hidden = flat.split_state(state)
    names = tuple(name for name, _ in [*states, *followers])
    units = tuple([*states, *followers])
    return SystemBlock(system, t, jnp.concatenate([x, hidden]), names, inputs, flat.output_names, units, asked)
