"""Capstan friction of a cable: slip over its elements, and the ratios of the tensions of its spans."""

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..friction import AbstractFriction
from ..friction._groups import Groups, ModelGroup, group_models, signed_coefficients
from ..friction._places import as_optional_friction, grows_with_slip, place_faults
from ..runtime import as_array

Models = tuple[AbstractFriction | None, ...]  # of the elements of a cable, None where there is none

#: Halvings of the interval that holds the speed of a belt, and steps of Newton after them.  Two that are
#: differentiated make derivatives up to the third exact.
_HALVINGS, _DIFFERENTIATED = 60, 2


def friction_of_elements(given: Any) -> Models | None:
    """Models of elements, from a list of models or coefficients, of which None is none, or an array of coefficients.

    Raises: TypeError for what is none of these.
    """
    if given is None:
        return None
    if not isinstance(given, list | tuple):
        given = as_array(given)
        if given.ndim != 1:
            raise TypeError(f"friction is one coefficient for each element, got shape {given.shape}")
    return tuple(as_optional_friction(one) for one in given)


def cable_friction_faults(friction: Models | None, elements: int, closed: bool) -> list[str]:
    """Faults of the models of so many elements."""
    if friction is not None and len(friction) != elements:
        return [f"friction has {elements} entries"]
    found: dict[str, None] = {}
    for model in friction or ():
        if model is None:
            continue
        what = place_faults(model, "a cable", bristles=False, drag=False)
        if closed and not what and not grows_with_slip(model):
            what = [
                f"the speed of a belt is not unique with this {type(model).__name__}, whose friction falls as the "
                "slip grows; take a model without static friction"
            ]
        found |= dict.fromkeys([*what, *(f"friction: {fault}" for fault in model.faults())])
    return list(found)


def _stacked(friction: Models) -> Groups:
    """The models in groups, each by the numbers of its elements."""
    places = [k for k, model in enumerate(friction) if model is not None]
    groups = group_models([model for model in friction if model is not None], lambda x, _: jnp.stack(x))
    return tuple(ModelGroup(group.model, tuple(places[k] for k in group.surfaces)) for group in groups)


def tension_ratios(friction: Models, wrap, share, parting, paid, is_closed) -> Array:
    """Tensions (m,) of the spans over that of the first.

    The strain changes alike along the cable, so it slips over element k at the speed w_k towards the next one with
    `w_(k+1) = w_k - parting_k + share_k (sum of parting - paid)`; tensions grow along the slip.

    Args:
        friction: models at the elements; wrap: (n,) angle about each.
        share: (m,) of each span of the length, sum 1.
        parting: (m,) speeds at which the material points of contact at its ends part [m/s].
        paid: speed at which cable enters at the first element [m/s].
        is_closed: True for a belt, whose speed follows from the ratios once around.
    """
    groups = _stacked(friction)
    strain = share * (jnp.sum(parting) - paid) - parting
    slip = paid + jnp.concatenate([jnp.zeros(1, strain.dtype), jnp.cumsum(strain)])[: wrap.size]
    if is_closed:
        slip = slip + _speed_of_belt(groups, wrap, slip)
    step = wrap * signed_coefficients(groups, slip)
    ratios = jnp.exp(jnp.cumsum(step.at[0].set(0.0)))
    return ratios if is_closed else ratios[: share.size]


def _speed_of_belt(groups, wrap, slip):
    """Speed w that makes `sum of wrap mu(slip + w)` zero, so that tensions agree once around: there is one where
    friction grows with the slip."""

    def excess(w, groups=groups, wrap=wrap, slip=slip):
        return jnp.sum(wrap * signed_coefficients(groups, slip + w))

    fixed = lax.stop_gradient((groups, wrap, slip))

    def halve(_, interval):
        low, high = interval
        middle = (low + high) / 2
        rises = excess(middle, *fixed) < 0
        return jnp.where(rises, middle, low), jnp.where(rises, high, middle)

    low, high = lax.fori_loop(0, _HALVINGS, halve, (-jnp.max(fixed[2]), -jnp.min(fixed[2])))
    w = lax.stop_gradient((low + high) / 2)
    for _ in range(_DIFFERENTIATED):
        value, slope = jax.jvp(excess, (w,), (jnp.ones_like(w),))
        w = w - jnp.where(slope > 0, value / jnp.where(slope > 0, slope, 1.0), 0.0)
    return w
