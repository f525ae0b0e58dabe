"""A mechanism as functions of flat arrays: rates and outputs at an instant, and a step of a motion.

States are the independent coordinates, their velocities and the internal states; the other coordinates are hidden:
they follow by closing the loops from where they were at the last accepted step.
"""

import functools
from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ...analysis._linearise import independent_positions
from ...analysis._named_outputs import NamedOutputs, output_names
from ...assembly._assembly import assemble_coordinates, closing_step
from ...assembly._state import State
from ...constraints import _closures as closures
from ...constraints import _constraints as constraints
from ...constraints._kic import independent_columns, motion_map
from ...dynamics._validity import has_ends, validity_at
from ...errors import ModelError
from ...kinematics._configuration import configuration, with_velocities
from ...kinematics._poses import node_parameters, normalise
from ...model._internal_states import InternalStates, replace_field
from ...model._system import System
from ...motion._accounts import CLOSED, gap
from ...motion._formulations import Velocity
from ...motion._simulate import simulate
from ...ode._loop import stop_gradients
from ...signal_flow._signals import with_inputs
from ._parameters import Parameters

#: Residual [m, rad] up to which Newton's steps close the loops without a search.
_NEAR = 1e-2
#: Residual of a step that needs no other: its own leaves the square.
_ROUNDING = 1e-9
#: Largest number of Newton's steps.
_PASSES = 8


def state_coordinates(system: System, asker: str) -> np.ndarray:
    """Places of the coordinates that are states.  Raises: ModelError for a ball that is independent in part."""
    top, chosen = system.topology, set(independent_positions(system).tolist())
    found, faults = [], []
    balls = {int(first + k): int(first) for first in top.balls for k in range(3)}
    for k in range(top.num_velocities):
        if k not in balls:
            found += [top.node_coordinate[k]] if k in chosen else []
        elif balls[k] == k:
            own = {k, k + 1, k + 2} & chosen
            if len(own) == 3:
                found += [top.node_coordinate[k] + i for i in range(4)]
            elif own:
                faults.append(
                    f"joint {top.column_joint_name[k]!r}: only {len(own)} of its 3 rotations are independent, so "
                    "that its quaternion is no state; name other joints by build(independent=[...])"
                )
    if faults:
        raise ModelError(faults, asker)
    return np.asarray(found, int)


class FlatMechanism:
    """The functions of flat arrays of one mechanism, and the sizes of their parts.

    Args: base: the system at the start values, counted at its state; inputs: fields; outputs: names, or a function of
        (system, state, time) to a dict of arrays; asker: function that faults name.
    """

    def __init__(
        self,
        base: System,
        parameters: Parameters,
        inputs: tuple[str, ...],
        outputs: tuple[str, ...] | Callable,
        motion: Mapping[str, Any],
        asker: str = "export_fmu",
    ) -> None:
        self.asker = asker
        self.base, self.parameters, self.inputs, self.motion = base, parameters, inputs, dict(motion)
        self.outputs = outputs if callable(outputs) else NamedOutputs.of(base, outputs)
        self.coordinates = state_coordinates(base, asker)
        self.columns = independent_columns(base)
        self.hidden = np.setdiff1d(np.arange(base.topology.num_coordinates), self.coordinates)
        free = np.ones(base.topology.num_velocities)
        free[independent_positions(base)] = 0.0
        self.free = free
        self.ends = np.cumsum([1, self.num_states, len(inputs), len(parameters.names)])

    @functools.cached_property
    def output_names(self) -> tuple[str, ...]:
        """Names of all outputs, arrays by their entries."""
        z = jax.ShapeDtypeStruct((self.num_known + len(self.hidden),), self.base.gravity.dtype)
        shape = jax.eval_shape(lambda z: self._outputs_of(*self._assembled(z)), z)
        if isinstance(self.outputs, NamedOutputs):
            return tuple(output_names(self.base, self.outputs, sum(int(np.prod(x.shape)) for x in shape.values())))
        return tuple(
            part for name, x in shape.items() for part in ([name] if x.shape == () else _entries(name, x.shape))
        )

    @property
    def num_states(self) -> int:
        return len(self.coordinates) + len(self.columns) + self.base.topology.num_internal

    @property
    def num_known(self) -> int:
        """Number of time, states, inputs and parameters together."""
        return int(self.ends[-1])

    def start(self, state: State, inputs: np.ndarray) -> np.ndarray:
        """z (nz,) of a state."""
        t, x, hidden = self.split_state(state)
        return np.concatenate([t[None], x, inputs, self.parameters.start, hidden]).astype(float)

    def split_state(self, state: State) -> tuple[Any, Any, Any]:
        """Time, states and hidden coordinates of a state."""
        internal = () if state.internal is None else (state.internal.values,)
        psi, u = state.coordinates, state.velocities
        return state.t, jnp.concatenate([psi[self.coordinates], u[self.columns], *internal]), psi[self.hidden]

    def _assembled(self, z):
        """System at z, configuration with closed loops, velocities and internal states there."""
        t, x, u, p, hidden = jnp.split(z, self.ends)
        t, top = t[0], self.base.topology
        phi, w, s = jnp.split(x, np.cumsum([len(self.coordinates), len(self.columns)]))
        system = self.parameters.system_at(p)
        system = replace_field(system, "topology", top)
        system = with_inputs(system, dict(zip(self.inputs, u, strict=True)), replace=True)
        internal = InternalStates(s, top.internal) if top.num_internal else None
        P = node_parameters(system)
        psi = jnp.zeros(top.num_coordinates, z.dtype)
        psi = psi.at[self.coordinates].set(phi).at[self.hidden].set(jax.lax.stop_gradient(hidden))
        psi = self._closed(system, P, normalise(top, psi), t)
        at = closures.with_directions(system, configuration(system, P, psi, t, internal=internal))
        velocities = motion_map(system, at)(w, -constraints.time_rate(system, at))
        return system, P, at, velocities, internal

    def _closed(self, system, P, psi, t):
        """Coordinates with closed loops, to rounding; the derivative is that of the closed loops.

        Newton's steps from the last accepted pose; from afar a search first.
        """
        if not system.has_constraints:
            return psi
        free = jnp.asarray(self.free, psi.dtype)
        system_, P_, psi_, t_ = stop_gradients((system, P, psi, t))
        found = _newton(
            lambda psi: closing_step(system_, P_, psi, t_, free),
            lambda psi: assemble_coordinates(system_, P_, psi, t_, free),
            psi_,
        )
        psi = psi.at[self.hidden].set(jax.lax.stop_gradient(found)[self.hidden])
        return assemble_coordinates(system, P, psi, t, free, search=False)

    def _state(self, at, velocities, internal):
        return State(at.t, at.psi, velocities, structure=self.base.topology.structure, internal=internal)

    def _outputs_of(self, system, P, at, velocities, internal):
        """Outputs by name."""
        state = self._state(at, velocities, internal)
        if isinstance(self.outputs, NamedOutputs):
            return {"": self.outputs.at(system, with_velocities(system, at, velocities), state)}
        found = self.outputs(system, state, at.t)
        if not isinstance(found, Mapping):
            raise ModelError(
                [f"the function of the outputs returns a dict of numbers and arrays, not {type(found).__name__}"],
                self.asker,
            )
        return {str(name): jnp.asarray(x, at.psi.dtype) for name, x in found.items()}

    def _unknowns(self, parts):
        """Rates of the states and outputs (nx + ny,)."""
        psi_rate, x_rate = self._rates(parts)
        return jnp.concatenate([psi_rate[self.coordinates], x_rate, self._flat_outputs(parts)])

    def _rates(self, parts):
        """Rates of all coordinates, and those of the independent velocities and of the internal states."""
        system, P, at, velocities, internal = parts
        second = velocities if internal is None else jnp.concatenate([velocities, internal.values])
        equations = Velocity(system, P, jnp.ones_like(second))
        psi_rate, rate, _ = equations.rate(at.t, (at.psi, second, jnp.zeros(0)))
        a, s_rate = jnp.split(rate, [len(velocities)])
        return psi_rate, jnp.concatenate([a[self.columns], s_rate])

    def _flat_outputs(self, parts):
        outputs = [jnp.ravel(x) for x in self._outputs_of(*parts).values()]
        return jnp.concatenate([jnp.zeros(0), *outputs])

    def block(self, t: Array, x: Array, u: Array) -> tuple[Array, Array]:
        """Rates and outputs at the states (nx + hidden,), those of the hidden coordinates behind; NaN where the loops
        do not close from these."""
        x, hidden = jnp.split(x, [self.num_states])
        parts = self._assembled(jnp.concatenate([t[None], x, u, jnp.asarray(self.parameters.start, x.dtype), hidden]))
        psi_rate, x_rate = self._rates(parts)
        dx = jnp.concatenate([psi_rate[self.coordinates], x_rate, psi_rate[self.hidden]])
        closed = gap(parts[0], parts[2]) <= jnp.maximum(CLOSED, 1e3 * jnp.finfo(x.dtype).eps)
        return jnp.where(closed, dx, jnp.nan), self._flat_outputs(parts)

    def instant(self, z: Array) -> Array:
        """Rates of the states, outputs, hidden coordinates and the gap of the loops at z (nz,).

        A gap that is NaN says that something is.  Hidden coordinates of z have no derivative.
        """
        parts = self._assembled(z)
        found, at = self._unknowns(parts), parts[2]
        opening = jnp.where(jnp.all(jnp.isfinite(found)) & jnp.all(jnp.isfinite(z)), gap(parts[0], at), jnp.nan)
        return jnp.concatenate([found, at.psi[self.hidden], opening[None]])

    @functools.cached_property
    def ends_of_models(self) -> list[tuple[str, str]]:
        """Sentence of each margin about a part beyond it, and its unit, in the order of `margins`."""
        if not has_ends(self.base):
            return []
        z = jax.ShapeDtypeStruct((self.num_known + len(self.hidden),), self.base.gravity.dtype)
        return jax.eval_shape(self._validity, z).ends()

    def margins(self, z: Array) -> Array:
        """Margins (m,) to the ends of the models of all parts at z (nz,)."""
        return self._validity(z).values

    def _validity(self, z):
        system, _, at, velocities, _ = self._assembled(z)
        return validity_at(system, with_velocities(system, at, velocities))

    def step(self, z: Array, length: Array) -> Array:
        """z after a step of the length (1,), its inputs held, and the status of the motion."""
        system, _, at, velocities, internal = self._assembled(z)
        end = at.t + length[0]
        motion = simulate(
            system, self._state(at, velocities, internal), ts=jnp.stack([at.t, end]), throw=False, **self.motion
        )
        psi, u = motion.states.coordinates[-1], motion.states.velocities[-1]
        s = [] if internal is None else [motion.states.internal.values[-1]]  # type: ignore[union-attr]
        inner = z[self.ends[1] : self.ends[3]]
        parts = [end[None], psi[self.coordinates], u[self.columns], *s, inner, psi[self.hidden]]
        result = jnp.where(gap(system, at) <= 1e-6, motion.result, 6).astype(z.dtype)  # 6: NOT_ASSEMBLED
        return jnp.concatenate([*parts, result[None]])


def _newton(step, search, psi):
    """psi after Newton's steps, until one gains less than half: the residual before each is what `step` returns.

    A start that is far goes through the search first; that it is far is known from the first step.
    """

    def is_open(carried):
        k, _, residual, before = carried
        return (k < _PASSES) & (residual > _ROUNDING) & (residual < 0.5 * before)

    def solve_anew(carried):
        k, psi, residual, _ = carried
        following, here = step(psi)
        is_far = (k == 0) & ~(here <= _NEAR)
        following = jax.lax.cond(is_far, search, lambda psi: following, psi)
        return k + 1, following, jnp.where(is_far, unknown, here), jnp.where(k > 0, residual, jnp.inf)

    unknown = jnp.asarray(1.0, psi.dtype)
    return jax.lax.while_loop(is_open, solve_anew, (jnp.int32(0), psi, unknown, jnp.inf * unknown))[1]


def _entries(name, shape):
    """Names of the entries of an array, from 1."""
    return [f"{name}[{','.join(str(i + 1) for i in index)}]" for index in np.ndindex(*shape)]
