"""Places of friction: what a user gives there as a model, and the models that a place cannot take."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..checks import may_be_nonzero
from ._base import AbstractFriction
from ._coulomb import SmoothCoulomb

#: Speeds of slip [m/s] at which the friction of a belt is compared.
_SPEEDS = np.geomspace(1e-7, 1e3, 400)
#: Part of the largest coefficient by which rounding may lower one.
_ROUNDING = 1e-6


def as_friction(value: Any) -> AbstractFriction:
    """A model: the one given, or `SmoothCoulomb` of a coefficient.

    Raises: TypeError for what is neither.
    """
    if isinstance(value, AbstractFriction):
        return value
    if isinstance(value, str | bool | type) or callable(value) or not isinstance(value, _NUMBERS):
        raise TypeError(f"friction must be a coefficient or a model of jaxmbs.friction, got {value!r}")
    return SmoothCoulomb(value)


_NUMBERS = (jax.Array, np.ndarray, np.generic, int, float, list, tuple)


def as_optional_friction(value: Any) -> AbstractFriction | None:
    """`as_friction`, or None where there is none."""
    return None if value is None else as_friction(value)


def place_faults(model: Any, place: str, bristles: bool = True, drag: bool = True) -> list[str]:
    """Sentences about a model that does not go with a place; those about its numbers are its own `faults`.

    Args:
        place: "a cable", for the sentences; bristles, drag: True if it takes models with bristles, and friction that
            follows no load.
    """
    if not isinstance(model, AbstractFriction):
        return [f"friction must be a coefficient or a model of jaxmbs.friction, not {model!r}"]
    name = type(model).__name__
    if model.has_bristles and not bristles:
        return [f"{place} has no state for the bristles of {name}; take a model without, such as SmoothCoulomb"]
    leaves = [leaf for leaf in jax.tree.leaves(model) if eqx.is_array(leaf)]
    if shapes := {jnp.shape(leaf) for leaf in leaves} - {()}:
        return [f"every number of {name} must be one number, got shape {next(iter(shapes))}"]
    if not drag and not _follows_load(model):
        return [
            f"{place} takes friction that follows its load alone; {name} has a part that does not (viscous, seal): "
            "leave it out, or give it to a joint or a force law"
        ]
    return []


def _follows_load(model):
    """True if no part of the friction is there without load, or that is traced."""
    if type(model).drag is AbstractFriction.drag:
        return True
    drag = model.drag(1.0)
    return drag is None or isinstance(drag, jax.core.Tracer) or not may_be_nonzero(drag)


def grows_with_slip(model: AbstractFriction) -> bool:
    """True if the coefficient never falls as the slip grows, or is traced: a belt has one speed."""
    values = jax.vmap(model.coefficient)(jnp.asarray(_SPEEDS))
    if isinstance(values, jax.core.Tracer):
        return True
    values = np.asarray(values)
    return bool(np.all(np.diff(values) >= -_ROUNDING * np.max(np.abs(values), initial=0.0)))
