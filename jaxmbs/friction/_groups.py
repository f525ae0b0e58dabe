"""Models of many surfaces: those of one structure are stacked and mapped, whatever their number."""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..runtime import gather_static, segment_sum_static
from ..typing import RowsLike
from ._base import AbstractFriction


class ModelGroup(eqx.Module):
    """Models of one structure, stacked, and the numbers of their surfaces."""

    model: AbstractFriction
    surfaces: tuple[int, ...] = eqx.field(static=True)


Groups = tuple[ModelGroup, ...]


def group_models(models: Sequence[AbstractFriction], stack: Callable) -> Groups:
    """The models of surfaces in groups of one structure; stack: numbers of one shape to an array."""
    places: dict = {}
    for k, model in enumerate(models):
        leaves, structure = jax.tree.flatten(model)
        places.setdefault((structure, tuple(map(jnp.shape, leaves))), []).append(k)
    return tuple(
        ModelGroup(jax.tree.map(lambda *x: stack(x, float), *(models[k] for k in mine)), tuple(mine))
        for mine in places.values()
    )


def at_surfaces(x: Array, places: RowsLike) -> Array:
    """Rows of x at static places."""
    return x if list(places) == list(range(len(x))) else gather_static(x, np.array(places))


def joined(parts: Sequence[Array], places: Sequence[RowsLike]) -> Array:
    """One array of the rows of all parts, each of which has the rows of its places."""
    if len(parts) == 1:
        return parts[0]
    order = np.argsort(np.concatenate([np.array(p, int) for p in places]))
    return at_surfaces(jnp.concatenate(list(parts)), order.tolist())


def values_of(groups: Groups, number: Callable, dtype) -> Array:
    """A number () of each model, for all surfaces (n,)."""
    of = jax.vmap(lambda model: jnp.asarray(number(model), dtype))
    return joined([of(group.model) for group in groups], [group.surfaces for group in groups])


def resistances(groups: Groups, square: Array) -> tuple[Array, Array | None]:
    """Friction over load and slip (n,) [s/m], one for bristles, and friction over slip that follows no load (n,)
    [N s/m], None where no model has any, from squared slips (n,)."""
    places = [group.surfaces for group in groups]
    slips = [at_surfaces(square, mine) for mine in places]

    def of_group(group, square):
        if group.model.has_bristles:
            return jnp.ones_like(square)
        return jax.vmap(lambda model, s: model.resistance(s))(group.model, square)

    grip = joined([of_group(group, s) for group, s in zip(groups, slips, strict=True)], places)
    drags = [jax.vmap(lambda model, s: model.drag(s))(group.model, s) for group, s in zip(groups, slips, strict=True)]
    if all(drag is None for drag in drags):
        return grip, None
    filled = [jnp.zeros_like(s) if drag is None else drag for drag, s in zip(drags, slips, strict=True)]
    return grip, joined(filled, places)


def signed_coefficients(groups: Groups, slip: Array) -> Array:
    """Friction over load (n,) with the sign of the slips (n,), zero for surfaces of no group; without bristles."""
    of = jax.vmap(lambda model, v: v * model.resistance(v * v))
    parts = [of(group.model, at_surfaces(slip, group.surfaces)) for group in groups]
    places = np.concatenate([np.array(group.surfaces, int) for group in groups])
    if len(places) == len(slip):
        return joined(parts, [group.surfaces for group in groups])
    return segment_sum_static(jnp.concatenate(parts), places, len(slip))
