"""A law with values of its internal states, called as a law without them."""

import functools
import inspect
from typing import Any

import equinox as eqx
import jax

from ..typing import Scalar, ScalarLike
from ._internal_state import States


class LawAt(eqx.Module):
    """A law and values of its internal states: its methods take the arguments of a law without states."""

    law: Any
    s: States

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in ("law", "s"):
            raise AttributeError(name)
        method = inspect.getattr_static(type(self.law), name, None)
        if not inspect.isfunction(method):
            return getattr(self.law, name)
        place = _place_of_states(method)
        if place is None:  # it calls others of its methods
            return functools.partial(method, self)
        return lambda *args: method(self.law, *args[:place], self.s, *args[place:])

    def state_power(self, x: tuple, rates: States, t: ScalarLike) -> Scalar:
        """Power [W] that goes into the stored energy by the rates of the states, at constant x and time."""
        return jax.jvp(lambda s: LawAt(self.law, s).potential(*x, t), (self.s,), (rates,))[1]


@functools.cache
def _place_of_states(method):
    """Number of arguments before the internal states of a method, None of one that does not take them."""
    names = [name for name in inspect.signature(method).parameters if name != "self"]
    if "s" in names:
        return names.index("s")
    is_open = any(p.kind is p.VAR_POSITIONAL for p in inspect.signature(method).parameters.values())
    return -1 if is_open else None
