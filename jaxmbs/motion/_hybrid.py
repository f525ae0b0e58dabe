"""Equations of a motion with events that act: a hybrid system, smooth between its events.

Beside the coordinates and the second half, what is integrated holds a record of the events: numbers whose rate is
zero and that change in an action alone.  So it is saved, projected and differentiated as the rest is.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from ..assembly._state import State
from ..dynamics._energy import energies
from ..kinematics._configuration import configuration
from ..kinematics._poses import node_parameters
from ..model._changes import Changes
from ..model._internal_states import replace_field
from ..model._system import System
from ..ode._problem import Projection
from ._event import Actions
from ._formulation import Formulation, num_powers


class Account(NamedTuple):
    """Quadratures of a motion with events that act.

    Attributes:
        work: of every force element, and of all drives (n,) [J].
        jumps: energy that each event has added (events,) [J].
        mode: () number of the event since which the mechanism has other numbers, from 1 on; 0 from the start.
        times: of the actions (max_events,) [s], zero for those to come.
        numbers: of the events that acted (max_events,), from 1 on.
    """

    work: Array
    jumps: Array
    mode: Array
    times: Array
    numbers: Array


class Mode(NamedTuple):
    """Numbers of the mechanism after an event, and its tree parameters with them."""

    changes: Changes | None
    P: Array


class HybridEquations(eqx.Module):
    """A formulation, the actions of the events, and the numbers of the mechanism after each."""

    formulation: Formulation
    modes: tuple[Mode | None, ...]
    actions: Actions
    max_events: int = eqx.field(static=True)
    places: tuple[int, ...] = eqx.field(static=True)

    @classmethod
    def of(
        cls, formulation: Formulation, actions: Actions, max_events: int, places: tuple[int, ...]
    ) -> "HybridEquations":
        """The equations whose modes have the numbers of the actions' systems, which change leaves at some places."""

        def mode(numbers):
            system = eqx.combine(numbers, formulation.system)
            return Mode(Changes.of(system, places), node_parameters(system))

        modes = tuple(None if numbers is None else mode(numbers) for numbers in actions.systems)
        return cls(formulation, modes, actions, max_events, places)

    @property
    def system(self) -> System:
        """The mechanism at the start."""
        return self.formulation.system

    @property
    def follows_rows(self) -> bool:
        """That of the formulation."""
        return self.formulation.follows_rows

    @property
    def acting(self) -> tuple[int, ...]:
        """Numbers of the events that act."""
        pairs = enumerate(zip(self.actions.actions, self.modes, strict=True))
        return tuple(k for k, pair in pairs if any(part is not None for part in pair))

    @property
    def size(self) -> int:
        """Number of quadratures."""
        return num_powers(self.formulation.system) + len(self.modes) + 1 + 2 * self.max_events

    def account(self, quadratures: Array) -> Account:
        """The parts of the quadratures (..., size)."""
        n, events = num_powers(self.formulation.system), len(self.modes)
        ends = [n, n + events, n + events + 1, n + events + 1 + self.max_events]
        work, jumps, mode, times, numbers = jnp.split(quadratures, ends, axis=-1)
        return Account(work, jumps, mode[..., 0], times, numbers)

    def in_mode(self, quadratures: Array) -> Formulation:
        """The formulation with the numbers that the mechanism has by then."""
        mode = jnp.round(lax.stop_gradient(self.account(quadratures).mode))
        found = Mode(Changes.of(self.system, self.places), self.formulation.P)
        for number, other in enumerate(self.modes, 1):
            if other is not None:
                found = jax.tree.map(lambda a, b, own=mode == number: jnp.where(own, a, b), other, found)
        return self._with(found)

    def _with(self, mode: Mode) -> Formulation:
        """The formulation with the numbers of a mode."""
        if mode.changes is None:
            return self.formulation
        return type(self.formulation)(mode.changes.in_force(self.system), mode.P, self.formulation.scale)

    def rate(self, t: Array, y: tuple) -> tuple[Array, Array, Array]:
        """Rate of (coordinates, second half, quadratures)."""
        psi, p, powers = self.in_mode(y[2]).rate(t, self._without_record(y))
        return psi, p, jnp.zeros_like(y[2]).at[: powers.size].set(powers)

    def project(self, t: Array, y: tuple) -> Projection:
        """As the formulation does."""
        return self.in_mode(y[2]).project(t, y)._replace(saved=None)

    @property
    def projects_error(self) -> bool:
        """As of the formulation."""
        return self.formulation.projects_error

    def project_error(self, t: Array, y: tuple, error: tuple) -> tuple:
        """As the formulation does."""
        return self.in_mode(y[2]).project_error(t, y, error)

    def sample(self, t: Array, y: tuple, due: Array) -> tuple[Array, Array, Array]:
        """As of the formulation."""
        return self.in_mode(y[2]).sample(t, y, due)

    def state_at(self, t: Array, y: tuple) -> State:
        """The state that conditions and actions are functions of."""
        found = self.in_mode(y[2])
        return replace_field(found.state_at(t, y), "changes", Changes.of(found.system, self.places))

    def after_action(self, t: Array, y: tuple, number: int) -> tuple[Array, Array, Array]:
        """y after the action of an event at its time."""
        before, account = self.in_mode(y[2]), self.account(y[2])
        action, mode = self.actions.actions[number], self.modes[number]
        start = self.state_at(t, y)
        state = start if action is None else _with_own_internal(action(start), start)
        after = before if mode is None else self._with(mode)
        index = jnp.sum(account.numbers > 0.5, dtype=jnp.int32)
        psi, p = _of_state(after, t, state)
        energy = _energy(after, t, psi, p) - _energy(before, t, y[0], y[1])
        account = Account(
            account.work,
            account.jumps.at[number].add(energy),
            account.mode if mode is None else jnp.full_like(account.mode, number + 1),
            account.times.at[index].set(t),
            account.numbers.at[index].set(number + 1.0),
        )
        return psi, p, jnp.concatenate([jnp.atleast_1d(part) for part in account])

    def _without_record(self, y):
        return y[0], y[1], self.account(y[2]).work


def _with_own_internal(state, before):
    """The state of an action, with the internal states before it where it gives none."""
    return state if state.internal is not None else replace_field(state, "internal", before.internal)


def _of_state(formulation, t, state):
    """(coordinates, scaled second half) of a state, on the constraints."""
    system, P = formulation.system, formulation.P
    at = configuration(system, P, state.coordinates, t, internal=state.internal)
    p = formulation.join(formulation.second_of(at, state.velocities), state.internal)
    if not system.has_constraints:
        return state.coordinates, p
    return formulation.project(t, (state.coordinates, p, jnp.zeros(0, p.dtype))).y[:2]


def _energy(formulation, t, psi, p):
    """Kinetic and potential energy () [J]."""
    return sum(energies(formulation.system, formulation.at(t, psi, p)))
