"""Capstan friction of a cable: slip over its elements, and the ratios of the tensions of its spans."""

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..friction._groups import Groups, ModelGroup, group_models, signed_coefficients
from ..friction._places import as_friction, as_optional_friction, grows_with_slip, model_faults
from ._fields import number

#: Halvings of the interval that holds the speed of a belt, and steps of Newton after them.  Two that are
#: differentiated make derivatives up to the third exact.
_HALVINGS, _DIFFERENTIATED = 60, 2


def friction_of_elements(given: Any) -> Groups | None:
    """Models at elements in groups, from a list of models, of which None is none, or coefficients (n,).

    Raises: TypeError for what is neither.
    """
    if given is None or (isinstance(given, tuple) and all(isinstance(group, ModelGroup) for group in given)):
        return given
    if not isinstance(given, list | tuple) or all(isinstance(one, int | float) for one in given):
        model = as_friction(given)
        numbers = jax.tree.map(lambda x: jnp.broadcast_to(x, jnp.shape(model.breakaway)), model)
        return (ModelGroup(numbers, tuple(range(jnp.size(model.breakaway)))),)
    models = [as_optional_friction(one) for one in given]
    places = [k for k, model in enumerate(models) if model is not None]
    groups = group_models([models[k] for k in places], lambda x, _: jnp.stack([number(one) for one in x]))
    return tuple(ModelGroup(group.model, tuple(places[k] for k in group.surfaces)) for group in groups)


def friction_faults(friction: Groups | None, elements: int, closed: bool) -> list[str]:
    """Faults of the models at so many elements."""
    found: list[str] = []
    for group in friction or ():
        if max(group.surfaces, default=0) >= elements or jnp.ndim(jax.tree.leaves(group.model)[0]) != 1:
            return [f"friction has {elements} entries"]
        what = model_faults(group.model, "a cable", bristles=False, drag=False, shape=(len(group.surfaces),))
        what = what or [f"friction: {fault}" for fault in group.model.faults()]
        if closed and not what and not grows_with_slip(group.model):
            what = [
                f"the speed of a belt is not unique with this {type(group.model).__name__}, whose friction falls as "
                "the slip grows; take a model without static friction"
            ]
        found += what
    return found


def tension_ratios(friction: Groups, wrap, share, parting, paid, is_closed) -> Array:
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
    strain = share * (jnp.sum(parting) - paid) - parting
    slip = paid + jnp.concatenate([jnp.zeros(1, strain.dtype), jnp.cumsum(strain)])[: wrap.size]
    if is_closed:
        slip = slip + _speed_of_belt(friction, wrap, slip)
    step = wrap * signed_coefficients(friction, slip)
    ratios = jnp.exp(jnp.cumsum(step.at[0].set(0.0)))
    return ratios if is_closed else ratios[: share.size]


def _speed_of_belt(friction, wrap, slip):
    """Speed w that makes `sum of wrap mu(slip + w)` zero, so that tensions agree once around: there is one where
    friction grows with the slip."""

    def excess(w, friction=friction, wrap=wrap, slip=slip):
        return jnp.sum(wrap * signed_coefficients(friction, slip + w))

    fixed = lax.stop_gradient((friction, wrap, slip))

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
