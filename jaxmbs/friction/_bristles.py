"""Bristles of the rubbing surfaces of joints: their bends along the slips, group by group."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..runtime import segment_sum_static
from ._groups import ModelGroup, at_surfaces, joined
from ._joint_friction import JointFriction
from ._surfaces import SURFACES


class BristleRows(NamedTuple):
    """A group of surfaces with bristles, whose vectors have as many components as the largest slip among them.

    Attributes:
        group: their models.
        slips, bends: (m,) places of all their components among those of all slips, and of all bends.
        filled: (surfaces, k) of these components: the number of each, m where a slip has fewer than k.
    """

    group: ModelGroup
    slips: np.ndarray
    bends: np.ndarray
    filled: np.ndarray

    def padded(self, x: Array) -> Array:
        """Vectors (surfaces, k) of components (m,)."""
        whole = self.filled.size == len(self.slips)
        return x.reshape(self.filled.shape) if whole else jnp.append(x, 0.0)[self.filled]

    def flat(self, x: Array) -> Array:
        """Components (m,) of vectors (surfaces, k)."""
        return at_surfaces(x.reshape(-1), np.flatnonzero(self.filled.reshape(-1) < len(self.slips)).tolist())


def bristle_rows(f: JointFriction) -> list[BristleRows]:
    """The groups that have bristles (static)."""
    slips = np.cumsum([0, *(len(SURFACES[kind].slips) for kind in f.kinds)])
    bends = np.cumsum([0, *f.bristle_sizes])
    found = []
    for group in f.models:
        if group.model.has_bristles:
            sizes = [f.bristle_sizes[k] for k in group.surfaces]
            is_there = np.arange(max(sizes)) < np.array(sizes)[:, None]
            filled = np.where(is_there, np.cumsum(is_there).reshape(is_there.shape) - 1, sum(sizes))
            places = [np.arange(n) for n in sizes]
            of_slips, of_bends = (
                np.concatenate([first[k] + p for k, p in zip(group.surfaces, places, strict=True)])
                for first in (slips, bends)
            )
            found.append(BristleRows(group, of_slips, of_bends, filled))
    return found


def each_bristle(f: JointFriction, bends: Array, slip: Array, function: Callable) -> list[tuple[BristleRows, Array]]:
    """A function of model, bend (k,) and slip (k,) of every surface with bristles, by groups."""
    found = []
    for rows in bristle_rows(f):
        bend, along = rows.padded(at_surfaces(bends, rows.bends)), rows.padded(at_surfaces(slip, rows.slips))
        found.append((rows, jax.vmap(function)(rows.group.model, bend, along)))
    return found


def bristle_rates(f: JointFriction, bends: Array, slip: Array) -> Array:
    """Rates (ns,) of the bends (ns,) of all bristles [m/s]; slip: components of all slips."""
    found = each_bristle(f, bends, slip, lambda model, bend, along: model.rate(bend, along))
    return joined([rows.flat(x) for rows, x in found], [rows.bends for rows, _ in found])


def with_tractions(f: JointFriction, bends: Array, slip: Array, unit: Array) -> Array:
    """Components (slips,) of the unit of friction, with those of bristles: what bend and rate give over the load."""

    def against(model, bend, along):
        return -model.traction(bend, model.rate(bend, along), along)

    for rows, x in each_bristle(f, bends, slip, against):
        whole = np.array_equal(rows.slips, np.arange(len(unit)))
        unit = rows.flat(x) if whole else unit.at[rows.slips].set(rows.flat(x))
    return unit


def bristle_storage(f: JointFriction, bends: Array, slip: Array) -> Array:
    """Power (n,) over the load that bends the bristles of each surface [m/s], zero for those without."""

    def power(model, bend, along):
        return jax.jvp(model.energy, (bend,), (model.rate(bend, along),))[1]

    found = each_bristle(f, bends, slip, power)
    surfaces = np.concatenate([rows.group.surfaces for rows, _ in found]).astype(int)
    return segment_sum_static(jnp.concatenate([x for _, x in found]), surfaces, len(f.names))


def bend_scales(f: JointFriction) -> Array:
    """Scales (ns,) of all bends [m]."""
    parts = []
    for rows in bristle_rows(f):
        scale = jax.vmap(lambda model: model.bend_scale)(rows.group.model)
        parts.append(rows.flat(jnp.broadcast_to(scale[:, None], rows.filled.shape)))
    return joined(parts, [rows.bends for rows in bristle_rows(f)])
