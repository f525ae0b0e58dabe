"""Ends of the models of a mechanism: which of its parts are beyond theirs at a state, by what and where.

Force elements, blocks and elastic bodies say where their models end by margins, positive inside
(`AbstractLaw.validity`).  Motions evaluate them at every saved time and at the end, where all kinematics are at hand.
"""

import operator
from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Bool, Float

from ..assembly._state import HasStates, State
from ..forces._validity import Margin
from ..kinematics._configuration import VelocityKinematics, at_state, with_velocities
from ..model._changes import with_changes
from ..model._entry_points import map_states, states_of
from ..model._system import System
from ..named_arrays import NamedRows
from ..quantities import Axis, Quantity
from ..reports import Report, Reported, faults_in_short
from ..runtime import jit
from ..signal_flow._signals import block_states
from ._bodies import bodies_of
from ._law_answers import force_answers, row_answers


class Validity(Reported, eqx.Module):
    """Margins of a mechanism at a state, or along a motion with leading axes.

    Attributes:
        t: (...) times [s].
        margins: by name of the part, then of the margin, `validity.margins["strap"]["wrap"].value` (..., places).
    """

    t: Float[Array, "..."]
    margins: Mapping[str, dict[str, Margin]]

    def report(self) -> Report:
        found = [
            Quantity(
                f"{part} {name}", margin.value, margin.unit, (Axis("place", margin.places),) if margin.places else ()
            )
            for part, margins in self.margins.items()
            for name, margin in margins.items()
        ]
        summary = "margins to the ends of models, negative outside" if found else "no part has an end of its model"
        return Report(found, summary, faults_in_short(self.faults()), self.t)

    @property
    def ok(self) -> Bool[Array, "..."]:
        """True (...) where every model holds; false for margins that are NaN."""
        return jnp.all(self.values >= 0, axis=-1)

    @property
    def is_outside(self) -> Bool[Array, "..."]:
        """True (...) where a part is beyond the end of its model; false for margins that are NaN."""
        return jnp.any(self.values < 0, axis=-1)

    @property
    def values(self) -> Float[Array, "... n"]:
        """All margins (..., n), in the order of `ends`."""
        shape = jnp.shape(self.t)
        parts = [
            margin.value.reshape(*shape, -1)
            for _, part in sorted(self.margins.items())
            for _, margin in sorted(part.items())
        ]
        return jnp.concatenate([jnp.zeros((*shape, 0)), *parts], axis=-1)

    def ends(self) -> list[tuple[str, str]]:
        """Sentence about a part beyond each end, and the unit of its margin, in the order of `values`."""
        return [
            end
            for name, part in sorted(self.margins.items())
            for _, margin in sorted(part.items())
            for end in _ends(name, margin)
        ]

    def faults(self) -> list[str]:
        """Parts that are beyond the end of their model, a sentence each with the time where that is first so and the
        largest excess."""
        return [
            sentence
            for name, part in self.margins.items()
            for margin in part.values()
            for sentence in _sentences(name, margin, np.asarray(self.t))
        ]


def _sentences(name, margin, t):
    values = np.asarray(margin.value).reshape(t.size, -1)
    for k, (what, unit) in enumerate(_ends(name, margin)):
        if not np.any(beyond := values[:, k] < 0):
            continue
        first, most = t.reshape(-1)[np.argmax(beyond)], -np.min(values[beyond, k])
        yield f"{what}, by {most:.3g} {unit}, first at {first:.6g} s"


def _ends(name, margin):
    """Sentence about a part that is beyond an end, and the unit of the excess, at each place of a margin."""
    return [(f"{name!r} {margin.end}{place and f' ({place})'}", margin.unit) for place in margin.places or ("",)]


def validity(system: System, state: State | HasStates) -> Validity:
    """Margins to the ends of the models of all parts: cables, contacts, gears, oil, beams, elastic bodies.

    Args:
        state: a State, a Motion, or states with leading axes, which the answer has too.
    """
    return _validity(system, states_of(system, state))


@jit(compile="tape")
def _validity(system, states):
    def of_one(state):
        here = with_changes(system, state)
        return validity_at(here, with_velocities(here, at_state(here, state), state.velocities))

    return map_states(of_one, states)


def validity_at(system: System, at: VelocityKinematics, multipliers: Array | None = None) -> Validity:
    """Margins by name at a configuration.

    Args: multipliers: (rows,) of the motion, where they are found already.
    """
    found = [(names, margins) for names, margins in margins_at(system, at, multipliers) if margins]
    return Validity(at.t, NamedRows.of(found))


def has_ends(system: System) -> bool:
    """True if some part of the system has margins (static)."""
    laws = any(group.law.has_ends for group in system.forces)
    blocks = any(group.block.has_ends for group in system.blocks)
    return laws or blocks or bool(system.elastic) or any(group.law.has_ends for group in system.rows)


def is_outside(system: System, at: VelocityKinematics, ends: list) -> Array:
    """True () if some part is beyond the end of its model; no derivative.

    Args: ends: margins of force elements and bodies, as `energies` finds them.
    """
    parts = ends + _of_blocks(system, at) + _of_rows(system, at)
    values = [margin.value for _, margins in parts for margin in margins.values()]
    return jnp.any(jnp.concatenate([jnp.ravel(lax.stop_gradient(x)) for x in values]) < 0)


def margins_at(system: System, at: VelocityKinematics, multipliers: Array | None = None) -> list:
    """(names, margins by name, stacked (parts, ...)) of all parts."""
    found = [answers[:2] for answers in force_answers(system, at, _has_ends, _validity_of)]
    found += [bodies.validity(system, at) for bodies in bodies_of(system)]
    return found + _of_blocks(system, at) + _of_rows(system, at, multipliers)


def _of_blocks(system, at):
    def margins(k, group):
        margins_of = lambda block, s: block.validity(s, at.t)
        return jax.vmap(margins_of, axis_size=len(group.names))(group.block, block_states(at, k))

    return [(group.names, margins(k, group)) for k, group in enumerate(system.blocks) if group.block.has_ends]


def _of_rows(system, at, multipliers=None):
    """Margins of rows such as inextensible cables, whose tensions are multipliers of the motion."""
    return [answers[:2] for answers in row_answers(system, at, _has_ends, _validity_of, multipliers)]


_has_ends, _validity_of = operator.attrgetter("has_ends"), operator.attrgetter("validity")
