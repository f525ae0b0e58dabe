"""Random responses of linearised mechanisms, and of networks with measured components."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..analysis._linearisation import Linearisation
from ..checks import is_concrete, no_such
from ..coupling._measured_network import MeasuredNetwork
from ..errors import ModelError
from ..linear._transfer import TransferFunctions
from ..runtime import as_array
from ..typing import ArrayLike
from ._inputs import BaseAcceleration, RandomForce
from ._outputs import KINDS, BondForces, Coordinates, motion_units, named_outputs
from ._quadrature import ORDER
from ._random_response import RandomResponse, respond
from ._state_model import MeasuredModel, StateModel


def random_response_of_mechanism(
    linearisation: Linearisation,
    inputs: Mapping[str, Any],
    coherence: Mapping | None = None,
    order: int = ORDER,
) -> RandomResponse:
    """Response of a linearised mechanism to stationary random inputs.

    Args:
        linearisation: `linearise(system, state, inputs=[...], outputs=[...], loads=[...])`: the outputs are its own.
        inputs: by name of its inputs, `BaseAcceleration(table)` for the acceleration of a driven joint,
            `RandomForce(table)` for an effort.
        coherence, order: as of a linear system.

    Raises: ModelError with every fault: a mechanism that is not linearised, unknown inputs.
    """
    if not isinstance(linearisation, Linearisation):
        raise ModelError(["a mechanism has a random response about a state: linearise it first"], "the question")
    known = linearisation.input_names
    faults = [no_such("input", name, known) for name in inputs if name not in known]
    faults += [] if inputs else ["no input is given"]
    wrong = [name for name, given in inputs.items() if not isinstance(given, BaseAcceleration | RandomForce)]
    faults += [f"input {name!r} must be a BaseAcceleration or a RandomForce" for name in wrong]
    faults += [] if linearisation.output_names else ["it has no outputs: linearise(..., outputs=[...], loads=[...])"]
    if faults:
        raise ModelError(faults, "the question")
    A, B, C, D = linearisation.state_space
    columns = np.array([known.index(name) for name in inputs], int)
    model = StateModel(A, B[:, columns], C, D[:, columns], linearisation.output_names, tuple(inputs))
    return respond(model, inputs, coherence, order)


def random_response_of_measured(
    network: MeasuredNetwork,
    inputs: Mapping[str, Any],
    out: Any,
    coherence: Mapping | None = None,
    loss: ArrayLike = 0.0,
    tolerance: float = 0.02,
    **regular: Any,
) -> RandomResponse:
    """Response of a network with measured components to random forces, from its grid of frequencies.

    Args:
        inputs: by name, `RandomForce(table, {"rig.foot z": 1.0})`, within the measured frequencies.
        out: by name, `Coordinates` or `BondForces`, or names of coordinates for their accelerations.
        loss, regular: as of its `frequency_response`.
        tolerance: of the RMS: every second frequency must give the same within it; the error is then about a third.

    Transfer functions are straight between the measured frequencies.

    Raises: ModelError, if concrete, for a grid that is too coarse, by the name of the output, and for tables beyond
    the measured frequencies.
    """
    outputs = named_outputs(out)
    _check_measured(network, inputs, outputs)
    names = list(dict.fromkeys(name for given in inputs.values() for name in given.pattern))
    asked = [name for o in outputs.values() if isinstance(o, Coordinates) for name in o.names]
    found = network.frequency_response(network.omega, into=names, out=asked or names, loss=loss, **regular)
    loads = None
    if any(isinstance(o, BondForces) for o in outputs.values()):
        loads = network.reactions(found, loss=loss, **regular)
    values, labels, units = [], [], list[str]()
    for name, output in outputs.items():
        part, own, kinds = _measured_values(output, found, loads, network, loss, regular)
        values.append(part)
        labels += [f"{name} {label}".strip() for label in own]
        units += kinds
    factors = jnp.stack([_pattern(given.pattern, found) for given in inputs.values()], 1)
    H = jnp.concatenate(values, axis=1)
    model = MeasuredModel(
        network.omega / (2 * jnp.pi), H @ factors.astype(H.dtype), tuple(labels), tuple(inputs), tuple(units)
    )
    response = respond(model, inputs, coherence, 4)
    _check_grid(response, model, inputs, coherence, tolerance)
    return response


def _check_measured(network, inputs, outputs):
    faults = [] if inputs else ["no input is given"]
    for name, given in inputs.items():
        if not isinstance(given, RandomForce) or not isinstance(given.pattern, dict):
            faults.append(f"input {name!r} must be a RandomForce with a pattern by name: bases are not measured")
    for name, output in outputs.items():
        if not isinstance(output, Coordinates | BondForces):
            faults.append(f"output {name!r} must be Coordinates or BondForces: the matrices are not known")
    grid = network.omega / (2 * jnp.pi)
    for name, given in inputs.items():
        table = getattr(given.spectrum, "frequencies", None)
        if table is None or not is_concrete(grid, table):
            continue
        if float(table[0]) < float(grid[0]) * (1 - 1e-9) or float(table[-1]) > float(grid[-1]) * (1 + 1e-9):
            faults.append(
                f"the table of {name!r} reaches from {float(table[0]):.4g} to {float(table[-1]):.4g} Hz, the "
                f"measurement from {float(grid[0]):.4g} to {float(grid[-1]):.4g} Hz"
            )
    if faults:
        raise ModelError(faults, "the question")


def _measured_values(output, found: TransferFunctions, loads, network, loss, regular):
    """Transfer functions (frequencies, k, columns) of an output, its labels and units."""
    if isinstance(output, BondForces):
        names = list(loads) if output.bonds is None else output.bonds
        labels = [f"{name} {d}" if len(names) > 1 else d for name in names for d in loads[name].labels]
        parts = [jnp.swapaxes(loads[name].on_first, 1, 2) for name in names]
        return jnp.concatenate(parts, axis=1), labels, output.units(labels)
    own = network.frequency_response(found.omega, into=found.inputs, out=output.names, loss=loss, **regular)
    rate = lax.complex(jnp.zeros_like(found.omega), found.omega).astype(found.values.dtype)
    labels = own.outputs if len(own.outputs) > 1 else ("",)
    return (
        own.values * (rate ** KINDS.index(output.kind))[:, None, None],
        labels,
        motion_units(own.outputs, output.kind),
    )


def _pattern(pattern, found):
    """Factors (columns,) of the inputs of transfer functions."""
    factors = jnp.zeros(len(found.inputs))
    for name, factor in pattern.items():
        columns = [k for k, one in enumerate(found.inputs) if one == name or one.startswith(f"{name} ")]
        factors = factors.at[np.array(columns)].set(as_array(factor))
    return factors


def _check_grid(response, model, inputs, coherence, tolerance):
    if not is_concrete(response):
        return
    last = len(model.frequencies) - 1
    some = np.unique(np.append(np.arange(0, last + 1, 2), last))
    half = MeasuredModel(model.frequencies[some], model.values[some], model.names, model.inputs, model.units)
    rms, other = np.asarray(response.rms), np.asarray(respond(half, inputs, coherence, 4).rms)
    error = np.abs(other - rms) / np.where(rms > 0, rms, 1.0)
    worst = int(np.argmax(error))
    if error[worst] > tolerance:
        raise ModelError(
            [
                f"the measured frequencies are too coarse for {model.names[worst]!r}: every second one changes its "
                f"RMS by {100 * error[worst]:.2g} %.  Measure finer, or allow it by `tolerance`"
            ],
            "the question",
        )
