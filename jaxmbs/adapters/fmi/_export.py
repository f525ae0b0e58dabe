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
import jax.numpy as jnp
import numpy as np

from ...assembly._state import State
from ...atomic_write import atomic_path
from ...constraints._mobility import with_mobility_at
from ...errors import ModelError
from ...model._changes import with_changes
from ...model._entry_points import check_single_state, check_system
from ...model._system import System
from ...motion._accounts import CLOSED
from ...runtime import kernel_options
from ...signal_flow._internal_states import internal_scale
from ...signal_flow._sampling import refuse_sampled
from ...status import Status
from ...typing import WordedError
from ._description import build_description, model_description
from ._library import SOURCE, compile_library, compiler, platform_name, sizes_header
from ._parameters import Parameters
from ._program import FlatMechanism
from ._stored import serialised_programs
from ._variables import input_names, input_values, output_names, variables_of

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
    if state is not None and not callable(system):
        system = with_changes(system, state)
    numbers = Parameters.of(system, parameters)
    base = numbers.system_at(jnp.asarray(numbers.start)) if callable(system) else system
    check_system(base)
    refuse_sampled(base, "export_fmu")
    state = State.at(base) if state is None else state
    check_single_state(base, state)
    base = with_mobility_at(base, state)
    inputs = input_names(base, inputs)
    outputs = outputs if callable(outputs) else output_names(base, outputs)
    flat = FlatMechanism(base, numbers, inputs, outputs, motion)
    start = flat.start(state, input_values(base, inputs, state.t))
    variables = variables_of(flat, start, dict(units or {}))
    programs = serialised_programs(flat, start, kind)
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
            "numbers of FMI are in double precision: jax.config.update('jax_enable_x64', True) before the build"
        )
    if faults:
        raise ModelError(faults, "export_fmu")
    compiler()
    platform_name()


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
        "ends": flat.ends_of_models,
        "outside": int(Status.VALIDITY),
    }
    text = json.dumps(about, indent=1)
    token = "{" + str(uuid.uuid5(uuid.NAMESPACE_OID, identifier + kind + text + repr(variables))) + "}"
    sizes = {"NUM_X": states, "NUM_U": len(flat.inputs), "NUM_P": len(flat.parameters.names), "NUM_Y": outputs}
    sizes |= {"NUM_HIDDEN": hidden, "IS_ME": int(kind == "ME"), "HAS_ENDS": int(bool(flat.ends_of_models))}
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
