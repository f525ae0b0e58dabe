"""`export_fmu`: a mechanism as a Functional Mock-up Unit of FMI 3.0."""

import hashlib
import json
import uuid
import zipfile
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import jax
import jax.export
import jax.numpy as jnp
import numpy as np

from ...atomic_write import atomic_path
from ...checks import place_of
from ...errors import ModelError
from ...kinematics._internal_states import internal_scale
from ...kinematics._mobility import with_mobility_at
from ...kinematics._sampling import refuse_sampled
from ...kinematics._signal_names import check_input_fields, input_fields, signal_names
from ...kinematics._state import State
from ...model._entry_points import check_single_state, check_system
from ...model._signals import law_of
from ...model._system import System
from ...motion._accounts import CLOSED
from ...runtime import garbage_collection_paused, jaxpr_function, kernel_options, one_kernel, without_unused
from ...status import Status
from ...typing import WordedError
from ._description import Variable, build_description, model_description
from ._library import SOURCE, compile_library, compiler, platform_name, sizes_header
from ._parameters import Parameters
from ._program import FlatMechanism

_MOTION = ("dt", "rtol", "atol", "solver", "controller", "formulation", "max_steps")


def export_fmu(
    system: WordedError[System | Callable],
    inputs: WordedError[Sequence[str]],
    outputs: WordedError[Sequence[str] | Callable],
    path: WordedError[str | PathLike],
    kind: str = "ME",
    *,
    state: State | None = None,
    parameters: Sequence[str] | Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
    **motion: Any,
) -> Path:
    """Store a mechanism as an FMU of FMI 3.0, with directional and adjoint derivatives.

    The FMU runs Python with jax inside of the program that hosts it, on functions of flat arrays that are stored as
    StableHLO; it needs no jaxmbs and no code of yours.  It is for this platform and for the Python that exported it.

    Args:
        system: a System, or a function of `parameters` to one, whose structure is always the same.
        inputs: fields of force elements and blocks that are functions of time, "motor.voltage", or the name of an
            element with one such field; each is one number that the host sets.
        outputs: names of joints (their coordinates), measures, blocks and internal states; or a function of (system,
            state, time) to a dict of numbers and arrays.
        path: of the file; its stem, made a name of C, is that of the model.
        kind: "ME" for model exchange: the host integrates the independent coordinates, their velocities and the
            internal states of force elements; "CS" for co-simulation: steps by `simulate`, inputs held over each.
        state: start; default `State.at(system)`.
        parameters: tunable parameters: names of numbers in a System, "bob.mass", "strut.stiffness", "loop.kp"; of a
            function the dict of its start values.
        units: of inputs, outputs and parameters by name, "N m"; states have theirs.
        motion: of "CS": `dt`, `rtol`, `atol`, `solver`, `controller`, `formulation`, `max_steps` as of `simulate`.

    Returns: the path.

    Raises: ModelError with all faults by name: of kind, units, parameters; sampled blocks; single precision; a joint
    whose quaternion is independent in part; no C compiler.  UnknownNameError for inputs and outputs that are not
    there.  OSError where the file cannot be written.
    """
    _check_options(kind, motion, path)
    numbers = Parameters.of(system, parameters)
    base = numbers.system_at(jnp.asarray(numbers.start)) if callable(system) else system
    check_system(base)
    refuse_sampled(base, "export_fmu")
    state = State.at(base) if state is None else state
    check_single_state(base, state)
    base = with_mobility_at(base, state)
    inputs = _input_names(base, inputs)
    outputs = outputs if callable(outputs) else _output_names(base, outputs)
    flat = FlatMechanism(base, state, numbers, inputs, outputs, motion)
    start = flat.start(state, _input_values(base, inputs, state.t))
    variables = _variables(flat, start, dict(units or {}))
    programs = _programs(flat, start, kind)
    _write(Path(path), kind, flat, start, variables, programs)
    return Path(path)


def _check_options(kind, motion, path):
    faults = []
    if kind not in ("ME", "CS"):
        faults.append(f"kind must be 'ME' (model exchange) or 'CS' (co-simulation), not {kind!r}")
    faults += [
        f"{name!r} is no option of a step; there are {', '.join(_MOTION)}" for name in motion if name not in _MOTION
    ]
    if motion and kind == "ME":
        faults.append(f"{', '.join(motion)}: options of a step are those of kind='CS'; in 'ME' the host integrates")
    if not isinstance(path, str | PathLike):
        faults.append(f"path must be the name of a file, not {path!r}")
    if not jax.config.read("jax_enable_x64"):
        faults.append(
            "numbers of FMI are in double precision: jax.config.update('jax_enable_x64', True) before the system is built"
        )
    if faults:
        raise ModelError(faults, "export_fmu")
    compiler()
    platform_name()


def _input_names(system, names):
    """Fields; the name of an element with one field stands for it."""
    if isinstance(names, str):
        raise ModelError([f"inputs are names in a list: [{names!r}]"], "export_fmu")
    fields, found = input_fields(system), []
    for name in names:
        own = [field for field in fields if field.rpartition(".")[0] == name]
        found.append(own[0] if len(own) == 1 else name)
    check_input_fields(system, found)
    return tuple(found)


def _output_names(system, names):
    if isinstance(names, str):
        raise ModelError([f"outputs are names in a list: [{names!r}]"], "export_fmu")
    for name in names:
        place_of("joint or signal", name, [*system.topology.joint_names, *signal_names(system)])
    return tuple(names)


def _input_values(system, names, t):
    """Values of fields at the start, those that are functions of time; 0 of others."""
    found = []
    for name in names:
        element, _, field = name.rpartition(".")
        laws = [
            jax.tree.map(lambda x, g=g: x[g.names.index(element)], law_of(g.law))
            for g in system.forces
            if element in g.names
        ]
        (part,) = laws + [block.block for block in system.blocks if block.name == element]
        try:
            found.append(float(getattr(part, field)(t)))
        except TypeError:  # a function of (x, v, t)
            found.append(0.0)
    return np.array(found)


def _variables(flat, start, units):
    """All variables.  Raises: ModelError for names given twice, and for units of what is not there."""
    top, base = flat.base.topology, flat.base
    states, rates = _state_names(flat), []
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
    faults = [f"the name {name!r} is given twice" for name in dict.fromkeys(names) if names.count(name) > 1]
    known = {*flat.inputs, *flat.parameters.names, *flat.output_names}
    known |= {name.partition("[")[0] for name in known}
    faults += [f"units: there is no input, output or parameter {name!r}" for name in units if name not in known]
    if faults:
        raise ModelError(faults, "export_fmu")
    assert top.num_velocities == base.topology.num_velocities
    return found


def _state_names(flat):
    """(name, unit) of every state."""
    top, found = flat.base.topology, []
    for k in flat.coordinates:
        joint = next(j for j in top.joints if j.coordinates.start <= k < j.coordinates.stop)
        place = k - joint.coordinates.start
        label = joint.labels[place] if joint.labels else str(place)
        is_ball = label in ("w", "x", "y", "z") and joint.num_coordinates != joint.num_velocities
        node = [n for n, c in enumerate(top.node_coordinate) if c == k and top.node_kind[n] != "ball"]
        unit = (
            "" if is_ball and not node else ("m" if top.node_kind[node[0]] == "prismatic" else "rad") if node else ""
        )
        found.append((joint.name if joint.num_coordinates == 1 else f"{joint.name} {label}", unit))
    for k in flat.columns:
        joint = next(j for j in top.joints if j.velocities.start <= k < j.velocities.stop)
        unit = "m/s" if top.node_kind[k] == "prismatic" else "rad/s"
        found.append(
            (
                f"rate of {joint.name}" + ("" if joint.num_velocities == 1 else f" {k - joint.velocities.start + 1}"),
                unit,
            )
        )
    for record in top.internal:
        unit = "" if " or " in record.unit else record.unit
        found += [(entry, unit) for entry in record.entries]
    return found


def _per_second(unit):
    if not unit:
        return ""
    return f"{unit}2" if unit.endswith("/s") else f"{unit}/s"


def _programs(flat, start, kind):
    """Serialised programs by name, with the sizes of their arguments; those with "_kernel" are marked for this release
    of JAX."""
    z, known, unknown = len(start), flat.num_known, flat.num_states + len(flat.output_names)
    instant = _traced(flat.instant, z)
    at = lambda x: instant(x)[:unknown]  # noqa: E731
    along = lambda seed: jnp.concatenate([seed, jnp.zeros(z - known)])  # noqa: E731 - hidden coordinates follow
    functions = {
        "instant": (instant, [z]),
        "directional": (lambda x, seed: jax.jvp(at, (x,), (along(seed),))[1], [z, known]),
        "adjoint": (lambda x, seed: jax.vjp(at, x)[1](seed)[0][:known], [z, unknown]),
    }
    found = {}
    for name, (function, sizes) in functions.items():
        size, whole = (
            sum(sizes),
            function if name == "instant" else _traced(_of_one_array(function, sizes), sum(sizes)),
        )
        found[name] = _serialised(one_kernel(whole, marks=False), size)
        if kernel_options() is not None:
            found[f"{name}_kernel"] = _serialised(one_kernel(whole, marks=True), size)
    if kind == "CS":
        found["step"] = _serialised(_of_one_array(flat.step, [z, 1]), z + 1)
    return found


def _traced(function, size):
    """A function of one array that is traced once, for all that is made of it."""
    with garbage_collection_paused(), jax.default_matmul_precision("highest"):
        call = jaxpr_function(without_unused(jax.make_jaxpr(function)(jnp.zeros(size))))
    return lambda x: call(x)[0]


def _of_one_array(function, sizes):
    return lambda x: function(*jnp.split(x, np.cumsum(sizes)[:-1]))


def _serialised(function, size):
    """The bytes of a program of one array, and its size."""
    with garbage_collection_paused(), jax.default_matmul_precision("highest"):
        exported = jax.export.export(jax.jit(function), platforms=["cpu"])(jax.ShapeDtypeStruct((size,), np.float64))
    return bytes(exported.serialize()), size


def _write(path, kind, flat, start, variables, programs):
    identifier = _identifier(path.stem)
    known, states, outputs = flat.num_known, flat.num_states, len(flat.output_names)
    unknown, hidden = states + outputs, len(flat.hidden)
    seeds = max(known, unknown)
    digests = {name: hashlib.sha256(content).hexdigest() for name, (content, _) in programs.items()}
    scales = np.ones(states)
    if flat.base.topology.num_internal:
        scales[states - flat.base.topology.num_internal :] = np.asarray(internal_scale(flat.base))
    by_place = {variable.place: variable.name for variable in variables}
    about = {
        "sizes": {"z": len(start), "results": unknown + hidden + 1, "seed": seeds, "sensitivity": seeds},
        "num_known": known,
        "num_unknown": unknown,
        "start": start.tolist(),
        "nominals": scales.tolist(),
        "closed": CLOSED,
        "knowns": [by_place[k] for k in range(known)],
        "unknowns": [by_place[len(start) + k] for k in range(unknown)],
        "arguments": {name: size for name, (_, size) in programs.items()},
        "sha256": digests,
        "jax": jax.__version__,
        "kernel_options": kernel_options(),
        "results": {str(int(status)): str(status) for status in Status},
    }
    text = json.dumps(about, indent=1)
    token = "{" + str(uuid.uuid5(uuid.NAMESPACE_OID, identifier + kind + text + repr(variables))) + "}"
    sizes = {"NUM_X": states, "NUM_U": len(flat.inputs), "NUM_P": len(flat.parameters.names), "NUM_Y": outputs}
    sizes |= {"NUM_HIDDEN": hidden, "IS_ME": int(kind == "ME")}
    header, platform = sizes_header(sizes, token), platform_name()
    files = {
        "modelDescription.xml": model_description(identifier, token, kind, variables, start[0], _tool()),
        f"binaries/{platform}/{identifier}.so": compile_library(header),
        "sources/fmu.c": SOURCE.read_bytes(),
        "sources/sizes.h": header.encode(),
        "sources/buildDescription.xml": build_description(identifier, ["fmu.c"], platform),
        "resources/about.json": text.encode(),
        "resources/runtime.py": (SOURCE.parent / "_runtime.py").read_bytes(),
        **{f"resources/{name}.bin": content for name, (content, _) in programs.items()},
    }
    with atomic_path(path) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in files.items():
            file.writestr(name, content)


def _identifier(stem):
    """The stem of a file as a name of C."""
    name = "".join(char if char.isascii() and (char.isalnum() or char == "_") else "_" for char in stem) or "model"
    return name if not name[0].isdigit() else f"_{name}"


def _tool():
    return "jaxmbs"
