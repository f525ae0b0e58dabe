"""Motions of the base and forces of a linear system, by input."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array
from scipy.sparse.csgraph import connected_components

from ..checks import is_concrete, number_faults
from ..errors import ModelError
from ..linear._free_motions import motion_with, name_some
from ..linear._rigid_flags import rigid_flags
from ..math._nan import nan_where
from ._inputs import BaseAcceleration, RandomForce


class InputExcitation(NamedTuple):
    """Motion of the base per input, and forces.

    Attributes: base: rows that are moved; carried: (n, inputs) motion with the base; inertia: (n, inputs) forces in
    its unit accelerations; ground: (3, inputs) motion of the ground in x, y, z; elastic: as in `Terms`; forces: (n,
    inputs); given: forces by name of each input.
    """

    base: tuple[int, ...]
    carried: Array
    inertia: Array
    ground: Array
    elastic: bool
    forces: Array
    given: tuple


def input_faults(system, inputs, ratios, loss):
    """Faults of the inputs and the damping."""
    faults = [] if inputs else ["no input is given"]
    wrong = [name for name, given in inputs.items() if not isinstance(given, BaseAcceleration | RandomForce)]
    faults += [f"input {name!r} must be a BaseAcceleration or a RandomForce" for name in wrong]
    bases = {given.at for given in inputs.values() if isinstance(given, BaseAcceleration)}
    if len(bases) > 1:
        faults.append("the accelerations must have the same `at`: one base, whose directions are the inputs")
    if ratios is not None and system.damping is not None:
        faults.append("the system has damping of its own: leave out `ratios`, or `system.with_damping(None)`")
    return faults + number_faults("loss", loss)


def excitation_of(system, inputs):
    """Motions of the base and forces (n, inputs) of all inputs.

    Raises: ModelError for coordinates that do not move by themselves, and for what nothing holds to the base.
    """
    moved = [given for given in inputs.values() if isinstance(given, BaseAcceleration)]
    n, dtype = system.num_rows, system.dtype
    base = _moved_rows(system, moved[0].at) if moved and moved[0].at is not None else ()
    T = motion_with(system, base) if base else None
    carried, inertia, ground, forces, given = [], [], [], [], []
    for name, one in inputs.items():
        pattern = load = jnp.zeros(n, dtype)
        along = jnp.zeros(3, dtype)
        if isinstance(one, BaseAcceleration):
            pattern = one.pattern(system)
            pattern = _held_motion(system, name, pattern) if T is None else T @ pattern[np.array(base)]
            load = system.mass @ pattern
            if T is None:
                load, along = load + one.ground_load(system), one.translation(dtype)
        carried.append(pattern)
        inertia.append(load)
        ground.append(along)
        is_force = isinstance(one, RandomForce)
        forces.append(system.load(one.pattern) if is_force else jnp.zeros(n, dtype))
        given.append(one.pattern if is_force else None)
    parts = (jnp.stack(part, 1) for part in (carried, inertia, ground))
    return InputExcitation(base, *parts, bool(base), jnp.stack(forces, 1), tuple(given))


def _held_motion(system, name, pattern):
    """The motion (n,) with the ground, NaN where it strains nothing and so moves nothing.

    Raises: ModelError, if concrete, with the coordinates of each part that nothing holds to the ground.
    """
    parts = _connected_parts(system) if is_concrete(system) else [np.arange(system.num_rows)]
    carried = jnp.stack([jnp.zeros_like(pattern).at[rows].set(pattern[rows]) for rows in parts], 1)
    moves = jnp.any(system.mass @ carried != 0, axis=0)
    for A in (system.stiffness, system.damping):
        if A is not None:
            moves = moves & rigid_flags(A, jnp.sum(carried * (A @ carried), axis=0), carried)
    if is_concrete(moves) and np.any(np.asarray(moves)):
        rows = np.concatenate([part for part, free in zip(parts, np.asarray(moves), strict=True) if free])
        names = name_some(system.coordinates, rows[np.asarray(pattern)[rows] != 0])
        raise ModelError(
            [
                f"input {name!r} moves the ground, and nothing holds {names} to it in this direction: give springs "
                "to the ground, or name the coordinates that are moved, BaseAcceleration(..., at=[...])"
            ],
            "the question",
        )
    return nan_where(jnp.any(moves), pattern)


def _connected_parts(system):
    """Rows of the parts that no stiffness, damping or mass connects."""
    matrices = [np.asarray(A) for A in (system.mass, system.stiffness, system.damping) if A is not None]
    count, part = connected_components(np.any([A != 0 for A in matrices], axis=0), directed=False)
    return [np.flatnonzero(part == k) for k in range(count)]


def _moved_rows(system, at):
    """Rows of the coordinates that are moved.  Raises: ModelError where names do not stand for single rows."""
    if at == ("interface",) and system.num_interface:
        return tuple(system.interface)
    with jax.ensure_compile_time_eval():  # names are known, also where the matrices are traced
        rows = system.outputs(*at)[0]
    if not is_concrete(rows):
        raise ModelError(["the moved coordinates must be known before tracing"], "the inputs")
    rows = np.asarray(rows)
    if not np.all((np.sum(rows != 0, axis=1) == 1) & (np.sum(rows, axis=1) == 1)):
        raise ModelError(
            ["`at` must name coordinates that move by themselves, not ones of rigid bodies"], "the inputs"
        )
    return tuple(np.argmax(rows, axis=1).tolist())


def loads_of(system, excitation, inner):
    """Loads (inner, inputs) of unit inputs, and of their integrals or None."""
    first = (excitation.forces - excitation.inertia)[inner]
    if system.damping is None or not excitation.elastic:
        return first, None
    second, size = system.damping @ excitation.carried, jnp.abs(system.damping) @ jnp.abs(excitation.carried)
    tiny = jnp.abs(second) <= 1e3 * jnp.finfo(second.dtype).eps * size
    return first, -jnp.where(tiny, second - lax.stop_gradient(second), second)[inner]
