"""Bearings in groups whose coefficients are computed at once, so that many cost no more equations than one."""

import copy
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from ..typing import ScalarLike
from ._parts import Bearing, BearingTable
from ._plain_bearing import PlainBearing

#: Kinds whose coefficients do not depend on their station.
_ALIKE = Bearing, BearingTable, PlainBearing


def coefficients_of(
    bearings: Sequence[Any], speed: ScalarLike, omega: ScalarLike | None
) -> list[tuple[list[int], tuple[Array, Array]]]:
    """Numbers of the bearings of each group, and their stiffness and damping (b, 2, 2).

    Bearings of one kind with tables of one shape are a group; those of other kinds than the ones here are one each.

    Args: speed: () [rad/s]; omega: () of the whirl [rad/s], None for that of the speed.
    """
    groups: dict[Any, list[int]] = {}
    for k, bearing in enumerate(bearings):
        groups.setdefault(_key(bearing) if type(bearing) in _ALIKE else k, []).append(k)

    def own(bearing):
        by_both = getattr(bearing, "depends_on_frequency", False) and omega is not None
        return bearing.coefficients(speed, omega) if by_both else bearing.coefficients(speed)

    found = []
    for numbers in groups.values():
        if type(bearings[numbers[0]]) in _ALIKE:
            alike = [_at_first_station(bearings[k]) for k in numbers]
            both = jax.vmap(own)(jax.tree.map(lambda *x: jnp.stack(x), *alike))
        else:
            both = jax.tree.map(lambda x: jnp.asarray(x)[None], own(bearings[numbers[0]]))
        found.append((numbers, both))
    return found


def _key(bearing):
    leaves, kind = jax.tree.flatten(_at_first_station(bearing))
    return kind, tuple((x.shape, jnp.result_type(x)) for x in leaves)


def _at_first_station(bearing):
    """A copy whose station is 0: stations are static, and tell bearings apart that are alike otherwise."""
    moved = copy.copy(bearing)
    object.__setattr__(moved, "station", 0)
    return moved
