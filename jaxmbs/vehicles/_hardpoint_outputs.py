"""Forces at hardpoints as outputs of a linearised vehicle."""

import dataclasses
from collections.abc import Iterable, Mapping

import jax.numpy as jnp

from ..analysis import Linearisation, linearise
from ..analysis._release_drives import release_drives
from ..assembly import State
from ..checks import distinct_names
from ..constraints._kic import independent_columns
from ..constraints._mobility import with_mobility_at
from ..errors import ModelError
from ..kinematics import rotation
from ..model import System
from ..model._changes import with_changes
from ..model._rows import drives
from ..reaction._solve import reactions_of_freedoms
from ..typing import WordedError
from ._parts import MountedParts, point_loads

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
        inputs: driven joints, of the road or the posts; efforts and fields would push beside the loads asked.
        parts: as a `mount_` function returned them, or several by name, as of `car`: then "front left LF x".
        carrier: body in whose axes the forces are given; its name, or "ground".

    Raises: ModelError for what are no parts, and for inputs that are no driven joints; those of `linearise`.
    """
    inputs, driven = distinct_names("inputs", inputs), {row.name for row in drives(system.rows)}
    by_name = parts if isinstance(parts, Mapping) else {"": parts}
    wrong = [f"input {name!r} is no driven joint" for name in inputs if name not in driven]
    odd = [own for own in by_name.values() if not isinstance(own, MountedParts)]
    wrong += [f"parts are what a mount_ function returns, got {own!r}" for own in odd]
    if wrong:
        raise ModelError(wrong, "the question")
    heads = {name: f"{name} " if name else "" for name in by_name}
    released = release_drives(with_mobility_at(with_changes(system, state), state), inputs, state)
    columns = tuple(int(k) for k in independent_columns(released))

    def forces(at, accelerations):
        loads, R = reactions_of_freedoms(released, at, accelerations, columns), rotation(released, at, carrier)
        found = [point_loads(loads, R, own) for own in by_name.values()]
        return jnp.concatenate([force for own in found for force in own.values()])

    found = linearise(system, state, inputs, forces)
    points = [f"{heads[name]}{point}" for name, own in by_name.items() for point in own.points]
    return dataclasses.replace(found, output_names=tuple(f"{point} {axis}" for point in points for axis in _AXES))
