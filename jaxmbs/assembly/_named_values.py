"""Parse joint coordinates and velocities given by name into a request for a state."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, is_concrete, no_such
from ..errors import ModelError, warn
from ..kinematics._poses import neutral_coordinates
from ..model._rows import drives
from ..model._system import System
from ._cut_joints import can_prescribe


class StateRequest(NamedTuple):
    """A requested state.

    Attributes:
        coordinates, velocities, t: (nq,), (nv,), (); the given entries; all others are starting values of the search.
        held: velocity columns whose coordinates are given; `held_rates` those whose velocities are.
        cuts: values () of cut joints by name; `cut_guesses` what their search begins with.
        drives: names of joints that start at the values of their drives.
        has_guess: True if the user or the model gave guesses for joints in the tree.
        internal: internal states of force elements by name.
    """

    system: System
    coordinates: Any
    velocities: Any
    t: Any
    held: tuple[int, ...]
    held_rates: tuple[int, ...]
    cuts: dict
    cut_guesses: dict
    drives: tuple[str, ...]
    has_guess: bool
    internal: dict

    @property
    def numbers(self) -> tuple:
        return self.coordinates, self.velocities, self.t, self.cuts, self.cut_guesses, self.internal

    @property
    def free(self) -> tuple[np.ndarray, np.ndarray]:
        """One for columns that are found, zero for those given, of coordinates and of velocities (nv,)."""
        top, dtype = self.system.topology, self.coordinates.dtype
        return free_column_mask(top, self.held, dtype), free_column_mask(top, self.held_rates, dtype)


def parse_request(system: System, values, velocities, guess, t, internal=None) -> StateRequest:
    """A checked request from values by name.  Raises: ModelError with all faults."""
    top, faults, own = system.topology, [], set(guess or {})
    values, velocities, guess = (_as_arrays("joint", x, faults) for x in (values, velocities, guess))
    internal, t = _as_arrays("internal state", internal, faults), jnp.asarray(t) if isinstance(t, list | tuple) else t
    guess = {**{name: np.squeeze(x) for name, x in top.guess}, **(guess or {})}
    precision = jnp.result_type(float)
    (guess, cut_guesses), (values, cuts) = (
        split_cut_values(system, given, faults) for given in (guess, values or {})
    )
    psi = set_joint_values(top, neutral_coordinates(top).astype(precision), guess, "coordinates", faults)
    psi = set_joint_values(top, psi, values, "coordinates", faults)
    u = set_joint_values(top, np.zeros(top.num_velocities, precision), velocities or {}, "velocities", faults)
    if np.shape(t) != () or isinstance(t, str) or any_concrete(lambda t: ~np.isfinite(t), t):
        faults.append(f"state: t must be one finite time, got {t!r}")
    internal = _internal_values(top, internal or {}, faults)
    if faults:
        raise ModelError(faults)
    followed = tuple(row.name for row in drives(system.rows) if row.name not in {*own, *values})
    held, rates = (velocity_columns(top, given) for given in (values, velocities or {}))
    return StateRequest(system, psi, u, t, held, rates, cuts, cut_guesses, followed, bool(guess), internal)


def _as_arrays(what, given, faults):
    """Values by name, with an array for each list or tuple that has traced parts; faults are collected."""
    if not isinstance(given, Mapping):
        return given
    found = dict(given)
    for name, value in given.items():
        if isinstance(value, list | tuple) and not is_concrete(value):
            try:
                found[name] = jnp.asarray(value, float)
            except (TypeError, ValueError):
                faults.append(f"state: {what} {name!r} takes real numbers of one shape, got {value!r}")
                del found[name]
    return found


def _internal_values(top, given, faults):
    """Internal states by name as arrays; faults are collected."""
    records, found = {record.name: record for record in top.internal}, {}
    if not isinstance(given, Mapping):
        hint = '; the value of a joint called "internal" goes into State.at(system, {"internal": ...})'
        faults.append(f'state: internal= takes values by name, {{"boom.p0": 2e6}}, got {given!r}{hint}')
        return found
    for name, value in given.items():
        if name not in records:
            faults.append(f"state: {no_such('internal state', name, list(records))}")
        elif _is_not_real(value):
            faults.append(f"state: internal state {name!r} takes finite real numbers, got {value!r}")
        elif np.shape(value) != records[name].shape:
            shape = records[name].shape
            faults.append(f"state: internal state {name!r} has shape {shape}, got shape {np.shape(value)}")
        else:
            found[name] = jnp.asarray(value, float)
    return found


def split_cut_values(system, values, faults):
    """Values of joints in the tree, and those () of cut joints with one coordinate; faults are collected."""
    top = system.topology
    cut = [name for name in values if name in top.joint_index and top.joints[top.joint_index[name]].is_cut]
    own, cut = {}, [name for name in cut if can_prescribe(system, name)]
    for name in cut:
        if _is_not_real(values[name]) or np.shape(values[name]) not in ((), (1,)):
            faults.append(f"state: joint {name!r} takes one finite number, got {values[name]!r}")
        else:
            own[name] = jnp.reshape(jnp.asarray(values[name], float), ())
    return {name: value for name, value in values.items() if name not in cut}, own


def set_joint_values(top, array, values, part, faults):
    """`array` with the entries of the named joints set; faults are collected."""
    for name, value in values.items():
        if name not in top.joint_index:
            faults.append(f"state: {no_such('joint', name, top.joint_names)}")
            continue
        joint = top.joints[top.joint_index[name]]
        where = getattr(joint, part)
        if joint.is_cut:
            faults.append(
                f"state: joint {name!r} closes a loop and takes no {part}; give those of others in the loop, or cut "
                f"one of them: build(cut=[...]) with one of {', '.join(_joints_of_loop(top, joint))}"
            )
            continue
        if isinstance(value, str):
            faults.append(f"state: joint {name!r} takes numbers, got the text {value!r}")
            continue
        if _is_not_real(value):
            faults.append(f"state: joint {name!r} takes finite real numbers, got {value!r}")
            continue
        host = is_concrete(array, value)
        value = np.asarray(value, array.dtype) if host else jnp.asarray(value, float)
        size = where.stop - where.start
        _warn_about_degrees(name, joint, value, part)
        if value.shape not in (((), (1,)) if size == 1 else ((size,),)):
            faults.append(f"state: joint {name!r} takes {size} {part}, got shape {value.shape}")
            continue
        if host:
            array = array.copy()
            array[where] = np.reshape(value, (size,))
        else:
            array = jnp.asarray(array).at[where].set(jnp.reshape(value, (size,)))
    return array


def _is_not_real(value):
    """True for text, complex numbers, and concrete numbers that are not finite."""
    return isinstance(value, str) or np.iscomplexobj(value) or any_concrete(lambda x: ~np.isfinite(x), value)


def _joints_of_loop(top, joint):
    """Names of the joints between the ends of a cut joint, in the tree."""
    ends = [set(np.nonzero(top.bodies.path[body])[0]) if body >= 0 else set() for body in (joint.parent, joint.child)]
    return [top.joints[top.body_joint[k]].name for k in sorted(ends[0] ^ ends[1])]


def _warn_about_degrees(name, joint, value, part):
    """Warn of an angle of more than two turns: it may be in degrees."""
    turns = joint.kind == "Revolute" and part == "coordinates" and is_concrete(value)
    sizes = np.abs(np.asarray(value, float)) if turns else np.zeros(1)
    in_degrees = (sizes > 2.0 * np.pi) & (sizes % 5.0 == 0.0)  # nobody means ten radians to the last digit
    if turns and np.any(in_degrees | (sizes > 4.0 * np.pi)):
        angle = float(np.max(np.abs(value)))
        text = f"state: joint {name!r} is put at {angle:.6g} rad, {angle / 2.0 / np.pi:.1f} turns"
        warn(f"{text}; angles are in radians, not degrees")


def velocity_columns(top, names):
    """Velocity columns of joints in the tree."""
    joints = [top.joints[top.joint_index[name]] for name in names]
    return tuple(k for joint in joints for k in range(joint.velocities.start, joint.velocities.stop))


def free_column_mask(top, columns, dtype):
    """Mask (nv,) that is 1 for every column but the given ones."""
    free = np.ones(top.num_velocities, dtype)
    free[list(columns)] = 0.0
    return free


def coordinate_mask(top, columns):
    """Boolean mask (nq,) of the coordinates that belong to the given velocity columns."""
    mine, balls = np.zeros(top.num_coordinates, bool), set(top.balls)
    for k in columns:
        first = top.node_coordinate[k]
        mine[first : first + (4 if k in balls else 1)] = True
    return mine
