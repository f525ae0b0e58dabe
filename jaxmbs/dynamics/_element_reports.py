"""Reports of force elements and cables: the named results that every law gives of itself, and forces for arrows."""

import operator

import equinox as eqx
from jax import Array
from jaxtyping import Float

from ..assembly._state import HasStates, State
from ..forces._readings import Reading
from ..kinematics._configuration import at_state, with_velocities
from ..model._changes import with_changes
from ..model._entry_points import map_states, states_of
from ..model._system import System
from ..named_arrays import elements_of
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import jit
from ..signal_flow._signals import with_signals
from ._law_answers import force_answers, row_answers


class ElementReports(Reported, eqx.Module):
    """Results of force elements and cables at a state, or along a motion with leading axes.

    Attributes:
        t: (...) times [s].
        results: by name of the element, then of the result, `reports.results["rope"]["tension"].value` (..., places).
    """

    t: Float[Array, "..."]
    results: dict[str, dict[str, Reading]]

    def report(self) -> Report:
        found = [
            Quantity(f"{part} {name}", one.value, one.unit, (Axis("place", one.places),) if one.places else ())
            for part, results in self.results.items()
            for name, one in results.items()
        ]
        return Report(found, "" if found else "no force element has results of its own", t=self.t)


def element_reports(system: System, state: State | HasStates) -> ElementReports:
    """Named results of all force elements and cables whose laws have a `report`: contacts, cables, gears, a law of
    your own.

    Args:
        state: a State, a Motion, or states with leading axes, which the answer has too.
    """
    return _reports(system, states_of(system, state))


@jit(compile="tape")
def _reports(system, states):
    return map_states(lambda state: ElementReports(state.t, _at(system, state, "report")), states)


def element_arrows(system: System, state: State | HasStates) -> dict[str, tuple[Array, Array]]:
    """Places (..., k, 3) [m] and forces (..., k, 3) [N] by the names of contacts, cables and others whose laws have
    `arrows`, in world axes.

    Of a contact they are on the round part at each of its points, of a cable on the body of each of its elements.
    """
    return _arrows(system, states_of(system, state))


@jit(compile="tape")
def _arrows(system, states):
    return map_states(lambda state: _at(system, state, "arrows"), states)


def _at(system, state, method):
    """Answers of all elements by name at a state; points and forces in the world."""
    in_space = method == "arrows"
    has, ask = operator.attrgetter(f"has_{method}"), operator.attrgetter(method)
    here = with_changes(system, state)
    needs_loads = any(has(group.law) for group in here.rows)
    at = with_velocities(here, at_state(here, state, inertias=needs_loads), state.velocities)
    found = {}
    for answers in force_answers(here, with_signals(here, at), has, ask, in_space):
        found |= dict(elements_of(answers.names, _in_world(at, answers) if in_space else answers.values))
    for answers in row_answers(here, at, has, ask) if needs_loads else ():
        points = lambda values: (at.origin[None, None] + values.points, values.forces)
        found |= dict(elements_of(answers.names, points(answers.values) if in_space else answers.values))
    return found


def _in_world(at, answers):
    """Points and forces (n, k, 3) in world axes."""
    R, place = answers.reference
    turned = lambda vectors: vectors @ R.swapaxes(1, 2)
    points, forces = answers.values
    return (at.origin[None] + place)[:, None] + turned(points), turned(forces)
