"""Inputs and outputs of a linearisation by name: joints, signals, and fields of force elements and blocks."""

from collections.abc import Callable, Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..assembly._state import State
from ..checks import place_of
from ..constraints._kic import independent_columns
from ..kinematics._configuration import Configuration, with_velocities
from ..model._system import System
from ..reaction._solve import reactions_of_freedoms
from ..signal_flow._signal_names import check_input_fields, input_fields, signal_names
from ..signal_flow._signals import signals_at


def check_inputs_and_outputs(system: System, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> tuple[str, ...]:
    """The inputs that are fields and no joints.

    Raises: UnknownNameError; ModelError for a field that a block drives.
    """
    joints = system.topology.joint_names
    fields = tuple(name for name in inputs if name not in joints)
    what = "joint" if not input_fields(system) else "joint or input"
    for name in fields:
        if "." in name or name in input_fields(system):
            check_input_fields(system, [name])
        else:
            place_of(what, name, [*joints, *input_fields(system)])
    signals = signal_names(system)
    for name in outputs:
        place_of("joint or signal" if signals else "joint", name, [*joints, *signals])
    return fields


class NamedOutputs(eqx.Module):
    """Outputs by name: columns of the coordinates of joints, or names of signals."""

    parts: tuple[tuple[int, int] | str, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, system: System, names) -> "NamedOutputs":
        """Outputs of checked names; a joint comes before a signal of its name."""
        top = system.topology
        found = [top.joints[top.joint_index[name]] if name in top.joint_index else name for name in names]
        return cls(tuple(x if isinstance(x, str) else (x.coordinates.start, x.coordinates.stop) for x in found))

    def at(self, system: System, at: Configuration, state: State) -> Array:
        """Values (m,) at a state and its configuration."""
        signals: Mapping[str, Array] = {}
        if any(isinstance(part, str) for part in self.parts):
            signals = signals_at(system, with_velocities(system, at, state.velocities))
        values = [
            signals[part].reshape(-1) if isinstance(part, str) else state.coordinates[part[0] : part[1]]
            for part in self.parts
        ]
        return jnp.concatenate([jnp.zeros(0), *values])


class LoadOutputs(eqx.Module):
    """Other outputs, and after them force and moment of joints in their own axes, on the child.

    Attributes:
        others: `NamedOutputs` or a function of the state and all accelerations.
        joints: names of the joints.
        columns: independent velocities, whose efforts make accelerations other than those of the motion.
    """

    others: NamedOutputs | Callable
    joints: tuple[str, ...] = eqx.field(static=True)
    columns: tuple[int, ...] = eqx.field(static=True)

    def at(self, system: System, at: Configuration, state: State, accelerations: Array) -> Array:
        """Values (m,) at a state, its configuration and all accelerations (nv,)."""
        if isinstance(self.others, NamedOutputs):
            values = self.others.at(system, at, state)
        else:
            values = jnp.ravel(self.others(state, accelerations))
        if not self.joints:
            return values
        found = reactions_of_freedoms(system, state, accelerations, self.columns, "joint")
        loads = [part for name in self.joints for part in (found[name].force, found[name].moment)]
        return jnp.concatenate([values, *loads])


def load_names(joints: tuple[str, ...]) -> tuple[str, ...]:
    """Names "pin force x" of the loads of joints."""
    return tuple(f"{name} {kind} {d}" for name in joints for kind in ("force", "moment") for d in "xyz")


def with_loads(system, outputs, joints):
    """Outputs with the loads of joints.  Raises: UnknownNameError."""
    if not joints:
        return outputs
    top = system.topology
    for name in joints:
        place_of("joint", name, top.joint_names)
    return LoadOutputs(outputs, joints, tuple(int(k) for k in independent_columns(system)))


def output_names(system, outputs, count):
    """Names of the rows of outputs."""
    loads = load_names(outputs.joints) if isinstance(outputs, LoadOutputs) else ()
    outputs = outputs.others if isinstance(outputs, LoadOutputs) else outputs
    count -= len(loads)
    if not isinstance(outputs, NamedOutputs):
        return (*(f"output {k}" for k in range(count)), *loads)
    names = {j.coordinates.start: j.name for j in system.topology.joints if j.num_coordinates}  # no cut joints
    sizes = [1 if isinstance(part, str) else part[1] - part[0] for part in outputs.parts]
    found = [part if isinstance(part, str) else names[part[0]] for part in outputs.parts]
    if sum(sizes) != count:  # signals of several values
        return (*(f"output {k}" for k in range(count)), *loads)
    return (*number_repeats(np.repeat(np.asarray(found, dtype=object), sizes)), *loads)


def number_repeats(names):
    """Names, those given several times with a number."""
    names = [str(name) for name in names]
    return [name if names.count(name) == 1 else f"{name} {names[:k].count(name)}" for k, name in enumerate(names)]
