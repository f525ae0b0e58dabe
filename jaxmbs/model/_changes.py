"""Numbers of a mechanism that events have changed: a state carries them, and every question takes them from it."""

from typing import Protocol, TypeVar, runtime_checkable

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, PyTree

from ..checks import is_concrete
from ..errors import ModelError

Mechanism = TypeVar("Mechanism")  # a system, or a pytree of its structure


class Changes(eqx.Module):
    """The numbers that events have changed by the time of a state; with leading axes for a motion.

    Attributes:
        values: of the leaves of the system that some event changes, as they are at the state.
        places: of those among all leaves; number: of all leaves (both static).
    """

    values: tuple[Array, ...]
    places: tuple[int, ...] = eqx.field(static=True)
    number: int = eqx.field(static=True)

    @classmethod
    def of(cls, system: PyTree, places: tuple[int, ...]) -> "Changes | None":
        """Those of a system in force, at these places; None without places."""
        leaves = jax.tree.leaves(system)
        return cls(tuple(leaves[k] for k in places), places, len(leaves)) if places else None

    def in_force(self, system: Mechanism) -> Mechanism:
        """The system with these numbers.  Raises: ModelError for one of another structure."""
        leaves, structure = jax.tree.flatten(system)
        if len(leaves) != self.number:
            raise ModelError(
                [
                    "the state is of a motion whose events change numbers of its system, and this system has another "
                    "structure: pass the one that the motion was made with, or make the state anew without changes="
                ]
            )
        for place, value in zip(self.places, self.values, strict=True):
            leaves[place] = value
        return jax.tree.unflatten(structure, leaves)


@runtime_checkable
class HasChanges(Protocol):
    """A state, as far as it says what has changed."""

    @property
    def changes(self) -> Changes | None: ...


def with_changes(system: Mechanism, state: HasChanges) -> Mechanism:
    """The system with the numbers that events have changed by the time of a state; the same one without events.

    Raises: ModelError for a system of another structure than that of the motion.
    """
    return system if state.changes is None else state.changes.in_force(system)


def check_in_force(system: PyTree, state: HasChanges) -> None:
    """Check that a motion may start from a state with a system: it has the numbers in force at the state, if they are
    known; inside of a trace those of the state are taken.

    Raises: ModelError for other numbers, which may be meant or not.
    """
    if state.changes is None or not is_concrete(system, state.changes):
        return
    pairs = zip(*map(jax.tree.leaves, (system, with_changes(system, state))), strict=True)
    if not all(a is b or np.array_equal(np.asarray(a), np.asarray(b)) for a, b in pairs):
        raise ModelError(
            [
                "an event of the motion that the state is of gave the mechanism other numbers than this system has: "
                "pass the system of that event to go on with it; to start with this one make the state anew, "
                "State(state.t, state.coordinates, state.velocities, internal=state.internal)"
            ]
        )
