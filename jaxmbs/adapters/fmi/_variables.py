"""Variables of an exported mechanism: names, units and start values of all that a host sees."""

from collections.abc import Iterable, Mapping

import numpy as np

from ...analysis._linearise import column_names
from ...checks import distinct_names, place_of, repeated
from ...errors import ModelError
from ...model._signals import block_named
from ...model._system import System
from ...named_arrays import element_of
from ...signal_flow._signal_names import check_input_fields, input_fields, signal_names
from ...typing import ScalarLike
from ._description import Variable
from ._program import FlatMechanism


def input_names(system: System, names: Iterable[str]) -> tuple[str, ...]:
    """Fields; the name of an element with one field stands for it.  Raises: ModelError, UnknownNameError."""
    fields, found = input_fields(system), []
    for name in distinct_names("inputs", names):
        own = [field for field in fields if field.rpartition(".")[0] == name]
        found.append(own[0] if len(own) == 1 else name)
    check_input_fields(system, found)
    return distinct_names("inputs", found)


def output_names(system: System, names: Iterable[str]) -> tuple[str, ...]:
    """Names of joints and signals that are there.  Raises: ModelError, UnknownNameError."""
    names = distinct_names("outputs", names)
    for name in names:
        place_of("joint or signal", name, [*system.topology.joint_names, *signal_names(system)])
    return names


def input_values(system: System, names: tuple[str, ...], t: ScalarLike) -> np.ndarray:
    """Values of fields at the start, those that are functions of time; 0 of others."""
    found = []
    for name in names:
        element, _, field = name.rpartition(".")
        laws = [_law_in(group, element) for group in system.forces if element in group.names]
        (part,) = laws + [found.block for found in block_named(system.blocks, element)]
        try:
            found.append(float(getattr(part, field)(t)))
        except TypeError:  # a function of (x, v, t)
            found.append(0.0)
    return np.array(found)


def _law_in(group, element):
    """The law of one element of a group."""
    k = group.names.index(element)
    return element_of(group.law, k)


def variables_of(flat: FlatMechanism, start: np.ndarray, units: Mapping[str, str]) -> list[Variable]:
    """All variables.  Raises: ModelError for names given twice, and for units of what is not there."""
    states, rates = state_names(flat), []
    found = [Variable("time", "time", 0, "s")]
    for k, (name, unit) in enumerate(states, start=1):
        found.append(Variable(name, "state", k, unit, start[k]))
        rates.append(Variable(f"der({name})", "rate", len(start) + k - 1, _per_second(unit), None, k))
    own = [*((name, "input") for name in flat.inputs), *((name, "parameter") for name in flat.parameters.names)]
    for k, (name, role) in enumerate(own, start=1 + len(states)):
        found.append(Variable(name, role, k, units.get(name, ""), start[k]))
    first = len(start) + len(states)
    taken = {variable.name for variable in found}
    for k, name in enumerate(flat.output_names, start=first):
        unit = units.get(name, units.get(name.partition("[")[0], dict(states).get(name, "")))
        shown = f"output {name}" if name in taken else name
        found.append(Variable(shown, "output", k, unit))
    found += rates
    names = [variable.name for variable in found]
    faults = [f"the name {name!r} is given twice" for name in repeated(names)]
    known = {*flat.inputs, *flat.parameters.names, *flat.output_names}
    known |= {name.partition("[")[0] for name in known}
    faults += [f"units: there is no input, output or parameter {name!r}" for name in units if name not in known]
    if faults:
        raise ModelError(faults, "export_fmu")
    return found


def state_names(flat: FlatMechanism) -> list[tuple[str, str]]:
    """(name, unit) of every state; velocities have the names of `Linearisation.state_names`."""
    top = flat.base.topology
    found = [_coordinate_name(top, k) for k in flat.coordinates]
    for k, name in zip(flat.columns, column_names(top, flat.columns), strict=True):
        found.append((f"rate of {name}", "m/s" if top.node_kind[k] == "prismatic" else "rad/s"))
    for record in top.internal:
        unit = "" if " or " in record.unit else record.unit
        found += [(entry, unit) for entry in record.entries]
    return found


def hidden_names(flat: FlatMechanism) -> list[tuple[str, str]]:
    """(name, unit) of every coordinate that follows from the states by closing the loops."""
    return [_coordinate_name(flat.base.topology, k) for k in flat.hidden]


def _coordinate_name(top, k):
    joint = next(j for j in top.joints if j.coordinates.start <= k < j.coordinates.stop)
    label = joint.labels[k - joint.coordinates.start] if joint.labels else str(k - joint.coordinates.start)
    kinds = [kind for kind, c in zip(top.node_kind, top.node_coordinate, strict=True) if c == k]
    is_number = not kinds or "ball" in kinds  # of a quaternion
    unit = "" if is_number else "m" if kinds[0] == "prismatic" else "rad"
    return (joint.name if joint.num_coordinates == 1 else f"{joint.name} {label}", unit)


def _per_second(unit):
    if not unit:
        return ""
    return f"{unit}2" if unit.endswith("/s") else f"{unit}/s"
