"""The events of a motion: functions of a state, and what their zeros do."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from ..runtime import tracer_errors_in_words


class Events(eqx.Module):
    """Several events, in their order.

    Attributes:
        conditions: functions of a state to one number each, whose zeros count.
        directions: +1 rising, -1 falling, 0 both.
        acts: True for those that act and go on; the others end the motion.
        max_actions: bound on the number of actions.
    """

    conditions: tuple[Callable, ...]
    directions: tuple[int, ...] = eqx.field(static=True)
    acts: tuple[bool, ...] = eqx.field(static=True)
    max_actions: int = eqx.field(static=True, default=0)

    @classmethod
    def ending(cls, condition: Callable | None) -> "Events | None":
        """One event that ends the motion at any zero of its function; None for none."""
        return None if condition is None else cls((condition,), (0,), (False,))

    def values(self, state: Any) -> Array:
        """Values (n,) at a state."""
        return jnp.stack([condition(state) for condition in self.conditions])

    def closed_over(self, state: Any) -> "Events":
        """The events with the arrays that their functions close over as arguments, which have derivatives."""
        conditions = tuple(eqx.filter_closure_convert(condition, state) for condition in self.conditions)
        return eqx.tree_at(lambda events: events.conditions, self, conditions)


def check_condition(condition: Any, state: Any, name: str = "the event") -> None:
    """Raises: TypeError unless it is a function of a state to one real number."""
    with tracer_errors_in_words():
        found = jax.eval_shape(lambda x: condition(x), state)
    if not (hasattr(found, "dtype") and found.shape == () and jnp.issubdtype(found.dtype, jnp.floating)):
        raise TypeError(f"{name} must return one real number (), got {found}")
