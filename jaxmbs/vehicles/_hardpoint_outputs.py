"""Forces at hardpoints as outputs of a linearised vehicle."""

import dataclasses
from collections.abc import Iterable, Mapping

import jax.numpy as jnp

from ..analysis import Linearisation, linearise
from ..assembly import State
from ..model import System
from ..typing import WordedError
from ._parts import MountedParts, hardpoint_loads

_AXES = "xyz"


def linearise_hardpoints(
    system: WordedError[System],
    state: WordedError[State],
    inputs: Iterable[str],
    parts: WordedError[MountedParts | Mapping[str, MountedParts]],
    carrier: str = "ground",
) -> Linearisation:
    """Linear equations about a state whose outputs are the forces at every hardpoint, "LF x", "LF y", "LF z" [N].

    Args:
        system: the built system.
        state: as of `linearise`.
        inputs: joints of the road or the posts, and other inputs of `linearise`.
        parts: as a `mount_` function returned them, or several by name, as of `car`: then "front left LF x".
        carrier: body in whose axes the forces are given; its name, or "ground".

    Raises: ModelError for what are no parts; those of `linearise`.
    """
    by_name = parts if isinstance(parts, Mapping) else {"": parts}
    heads = {name: f"{name} " if name else "" for name in by_name}

    def forces(at, accelerations):
        found = []
        for own in by_name.values():
            loads = hardpoint_loads(system, at, own, carrier, accelerations)
            found += [loads[point] for point in own.points]
        return jnp.concatenate(found)

    found = linearise(system, state, inputs, forces)
    points = [f"{heads[name]}{point}" for name, own in by_name.items() for point in own.points]
    return dataclasses.replace(found, output_names=tuple(f"{point} {axis}" for point in points for axis in _AXES))
