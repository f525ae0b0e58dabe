"""Events of a motion: functions of a state whose zeros end it, or act on it and let it go on."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..assembly._state import State
from ..checks import is_concrete
from ..lazy import is_instance
from ..model._entry_points import check_system
from ..model._system import System
from ..ode._events import Events, check_condition

if TYPE_CHECKING:
    import diffrax


class Event(eqx.Module):
    """A zero of a function of the state, which ends the motion or, with an action, changes it and lets it go on.

    Attributes:
        condition: function of a State to one number ().
        action: function of the State at the zero to the State after it, at the same time and pose or another:
            `lambda s: mbs.State(s.t, s.coordinates, -0.8 * s.velocities)` is an impact.  Velocities that break the
            constraints are projected, nearest in kinetic energy, as ideal constraints take up an impulse.  None: the
            event ends the motion, unless it has a `system`.
        direction: +1 where only a rising value counts, -1 where only a falling one does, 0 for both.
        system: the mechanism from the event on, of the same structure with other numbers (`build(like=system)` or
            `equinox.tree_at`): springs that latch, hooks that release, switches.  States after the event carry the
            numbers that differ, so that questions about the motion take the system that it was made with.
        name: in the account of work and in the record of the motion; default "event 0" by its place.

    Energy that the action adds, negative when lost, is an entry of the motion's account of work under that name.
    """

    condition: Callable
    action: Callable | None = None
    direction: int = eqx.field(static=True, default=0)
    system: System | None = None
    name: str | None = eqx.field(static=True, default=None)

    @property
    def acts(self) -> bool:
        """True if the motion goes on."""
        return self.action is not None or self.system is not None


#: Those that `simulate` takes.
if TYPE_CHECKING:
    EventLike: TypeAlias = Event | Callable | diffrax.Event
else:
    EventLike = Any  # diffrax is imported where a motion is traced


class Actions(eqx.Module):
    """Actions of the events, in their order, None for those without.

    Attributes:
        systems: numbers of the mechanism after each event; None where they stay, and for each that is the same.
        names: of the events.
    """

    actions: tuple[Callable | None, ...]
    systems: tuple[System | None, ...]
    names: tuple[str, ...] = eqx.field(static=True)


def acts(event: Any) -> bool:
    """True if the motion goes on after what was given as one event."""
    return isinstance(event, Event) and event.acts


def as_events(event: Any, system: System, state: State, max_events: Any) -> tuple[Events, Actions] | None:
    """The events that were asked for, in one form; None for none.

    Raises: TypeError for what is no event, a function that does not return one number, an action that does not return
        a State of the system; ValueError for a direction, for names that occur twice, for the system of an event that
        has another structure.
    """
    if event is None:
        return None
    several = list(event) if isinstance(event, list | tuple) else [event]
    found = [one for each in several for one in _as_list(each)]
    if not found:
        return None
    if not (isinstance(max_events, int | np.integer) and max_events >= 1):
        raise ValueError(f"max_events={max_events!r} must be a whole number from 1 on")
    names = tuple(f"event {k}" if one.name is None else one.name for k, one in enumerate(found))
    for name, one in zip(names, found, strict=True):
        _check_event(name, one, system, state)
    if len(set(names)) < len(names):
        raise ValueError(f"events need names of their own, got {', '.join(names)}")
    acts = tuple(one.acts for one in found)
    directions = tuple(int(one.direction) for one in found)
    events = Events(tuple(one.condition for one in found), directions, acts, int(max_events) * any(acts))
    systems = tuple(_other_numbers(system, one.system) for one in found)
    return events, Actions(tuple(one.action for one in found), systems, names)


def _as_list(event):
    """Events of what was given as one: several of a tree of functions in a `diffrax.Event`."""
    if isinstance(event, Event):
        return [event]
    if is_instance(event, "diffrax", "Event"):
        return _of_diffrax(event)
    if not callable(event):
        raise TypeError(
            f"event= takes a function of a State to one number, a jaxmbs.motion.Event, a diffrax.Event, or a list of "
            f"such, not {type(event).__name__}"
        )
    return [Event(event)]


def _of_diffrax(event):
    """Events of diffrax's: a tree of functions of (t, y, args), whose y is the State here."""
    conditions = jax.tree.leaves(event.cond_fn, is_leaf=callable)
    directions = jax.tree.leaves(event.direction, is_leaf=lambda x: x is None)
    sign = {None: 0, True: 1, False: -1}
    return [
        Event(_OfState(one), direction=sign[direction]) for one, direction in zip(conditions, directions, strict=True)
    ]


class _OfState(eqx.Module):
    """A condition of diffrax as a function of a State."""

    condition: Callable

    def __call__(self, state):
        return self.condition(state.t, state, None)


def _check_event(name, event, system, state):
    if not callable(event.condition) or not (event.action is None or callable(event.action)):
        raise TypeError(f"{name}: condition and action must be functions of a State")
    if event.direction not in (-1, 0, 1):
        raise ValueError(f"{name}: direction={event.direction!r} must be +1 (rising), -1 (falling) or 0 (both)")
    if isinstance(event.condition, _OfState):
        _check_condition_of_diffrax(name, event.condition, state)
    check_condition(event.condition, state, name)
    if event.action is not None:
        after = jax.eval_shape(event.action, state)
        fits = isinstance(after, State) and all(
            getattr(after, part).shape == getattr(state, part).shape for part in ("t", "coordinates", "velocities")
        )
        if not fits:
            raise TypeError(f"{name}: the action must return a State of the system, got {after}")
    if event.system is not None:
        check_system(event.system)
        _check_structure(name, event.system, system)


def _check_condition_of_diffrax(name, condition, state):
    """Raises: TypeError for a condition of diffrax that has no zero to find, or needs more than (t, y, args)."""
    wrong = f"{name}: simulate takes a diffrax.Event of a real function (t, y, args) of the State y"
    other = "run diffrax.diffeqsolve on jaxmbs.vector_field(system) for others"
    try:
        found = jax.eval_shape(condition, state)
    except (TypeError, KeyError, AttributeError) as error:
        raise TypeError(f"{wrong}; {other} ({error})") from error
    if getattr(found, "dtype", None) == jnp.bool_:
        raise TypeError(f"{wrong}, not of a truth value: its zero is located; {other}")


def _check_structure(name, other, system):
    """Raises: ValueError unless the two mechanisms differ in numbers alone."""
    kinds = lambda s: [(x.shape, x.dtype) for x in jax.tree.leaves(eqx.filter(s, eqx.is_array))]
    if jax.tree.structure(other) != jax.tree.structure(system) or kinds(other) != kinds(system):
        raise ValueError(
            f"{name}: its system has another structure: an event may change numbers alone, build(like=system); "
            "give what it locks or releases a stiffness that is zero on one side"
        )


def _other_numbers(system, other):
    """The numbers of another system, without those that are the same; None for no other system."""
    if other is None:
        return None
    return jax.tree.map(lambda a, b: None if _are_same(a, b) else b, system, other)


def _are_same(a, b):
    """True for one array, or two known ones of equal numbers; what is traced may have a derivative of its own."""
    return a is b or (is_concrete(a, b) and np.array_equal(np.asarray(a), np.asarray(b)))
