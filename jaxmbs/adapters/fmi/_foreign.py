"""An FMU of model exchange, read by fmpy: its description, which runs nothing, and its one instance in a process."""

import functools
import hashlib
import math
import shutil
import tempfile
import threading
import weakref
import zipfile
from ctypes import c_double
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from ...checks import no_such
from ...errors import ModelError


class Interface(NamedTuple):
    """A law's use of an FMU; hashable, the same for the same content of the file.

    Attributes:
        path, sha256: of the file.
        model: its identifier; token: of its instances.
        states: names of the continuous states, with value references and start values.
        rates: value references of their rates; effort: of the output.
        inputs: value references of displacement and velocity, None for one that the FMU does not take.
        parameters: (value reference, value) of those that are set.
        has_derivatives: True if it gives directional derivatives.
    """

    path: str
    sha256: str
    model: str
    token: str
    states: tuple[str, ...]
    places: tuple[int, ...]
    starts: tuple[float, ...]
    scales: tuple[float, ...]
    units: tuple[str, ...]
    rates: tuple[int, ...]
    effort: int
    inputs: tuple[int | None, int | None]
    parameters: tuple[tuple[int, float], ...]
    has_derivatives: bool


def fmpy_module():
    """The package fmpy.  Raises: ImportError that says how to install it."""
    try:
        import fmpy
    except ImportError as error:
        raise ImportError("FMUs as laws need the package fmpy: pip install 'jaxmbs[fmi]'") from error
    return fmpy


def read_interface(path, effort, displacement, velocity, parameters, start) -> Interface:
    """The use of a file, from its description alone: none of its code is run.

    Raises: ModelError with all faults by name; OSError where the file cannot be read; ImportError without fmpy.
    """
    fmpy = fmpy_module()
    content = Path(path).read_bytes()
    try:
        description = fmpy.read_model_description(str(path))
    except Exception as error:  # noqa: BLE001 - a file that is none raises whatever its reader meets
        raise ModelError([f"{path} is no FMU that fmpy reads: {error}"], "Fmu") from error
    variables = {variable.name: variable for variable in description.modelVariables}
    faults = _kind_faults(path, description)
    faults += _name_faults(variables, effort, displacement, velocity, parameters)
    if faults:
        raise ModelError(faults, "Fmu")
    rates = [unknown.variable for unknown in description.derivatives]
    states = [rate.derivative for rate in rates]
    values = {state.name: start.get(state.name, state.start) for state in states}
    faults = [
        f"the state {name!r} of {path} has no start value in its description: give it, start={{{name!r}: ...}}"
        for name, value in values.items()
        if value is None
    ]
    faults += [no_such("state of the FMU", name, values) for name in start if name not in values]
    if faults:
        raise ModelError(faults, "Fmu")
    place = lambda name: None if name is None else variables[name].valueReference
    return Interface(
        path=str(path),
        sha256=hashlib.sha256(content).hexdigest(),
        model=description.modelExchange.modelIdentifier,
        token=description.instantiationToken,
        states=tuple(state.name for state in states),
        places=tuple(state.valueReference for state in states),
        starts=tuple(float(value) for value in values.values()),
        scales=tuple(float(state.nominal or 1.0) for state in states),
        units=tuple(state.unit or "" for state in states),
        rates=tuple(rate.valueReference for rate in rates),
        effort=variables[effort].valueReference,
        inputs=(place(displacement), place(velocity)),
        parameters=tuple((variables[name].valueReference, float(value)) for name, value in parameters.items()),
        has_derivatives=_gives_derivatives(path),
    )


def _gives_derivatives(path):
    """True for an FMU with directional derivatives, of which fmpy does not tell."""
    with zipfile.ZipFile(path) as file:
        root = ElementTree.fromstring(file.read("modelDescription.xml"))
    return root.find("ModelExchange").get("providesDirectionalDerivatives") in ("true", "1")  # type: ignore[union-attr]


def _kind_faults(path, description):
    if not description.fmiVersion.startswith("3."):
        return [f"{path} is of FMI {description.fmiVersion}, and a law is one of FMI 3.0: export it as such"]
    if description.modelExchange is None:
        return [f"{path} is an FMU of co-simulation, which takes steps of its own: a law is one of model exchange"]
    if description.numberOfEventIndicators:
        return [
            f"{path} has {description.numberOfEventIndicators} event indicators: steps of a motion do not end at the "
            "events of an FMU, whose effort would be wrong there"
        ]
    return []


def _name_faults(variables, effort, displacement, velocity, parameters):
    wanted = {"effort": (effort, "output"), "displacement": (displacement, "input"), "velocity": (velocity, "input")}
    faults = []
    for role, (name, causality) in wanted.items():
        own = [x.name for x in variables.values() if x.causality == causality and x.type == "Float64" and not x.shape]
        if name is not None and name not in own:
            faults.append(f"{role}: {no_such(f'{causality} of one number', name, own)}")
    own = [x.name for x in variables.values() if x.causality == "parameter" and x.type == "Float64"]
    for name, value in parameters.items():
        if name not in own:
            faults.append(no_such("parameter of the FMU", name, own))
        elif not (isinstance(value, int | float) and math.isfinite(value)):
            faults.append(f"parameter {name!r} must be a finite number, not {value!r}: it has no derivative")
    return faults


class Instance:
    """The running FMU: values and slopes of (rates, effort) at z = (time, displacement, velocity, states)."""

    def __init__(self, interface: Interface) -> None:
        fmpy = fmpy_module()
        from fmpy.fmi3 import FMU3Model

        if hashlib.sha256(Path(interface.path).read_bytes()).hexdigest() != interface.sha256:
            raise ModelError([f"{interface.path} is another file than when the law was made: make it again"], "Fmu")
        folder = tempfile.mkdtemp(prefix="jaxmbs_fmu_")
        weakref.finalize(self, shutil.rmtree, folder, True)
        fmpy.extract(interface.path, unzipdir=folder)
        self.interface, self.lock = interface, threading.Lock()
        self.fmu: Any = FMU3Model(
            guid=interface.token, unzipDirectory=folder, modelIdentifier=interface.model, instanceName="law"
        )
        self.fmu.instantiate()
        self.fmu.enterInitializationMode()
        for place, value in interface.parameters:
            self.fmu.setFloat64([place], [value])
        self.fmu.exitInitializationMode()
        for _ in range(100):
            needs_more, terminates, _, _, has_next, _ = self.fmu.updateDiscreteStates()
            if terminates or has_next:
                raise ModelError([f"{interface.path} has events in time, or ends by itself: it is no law"], "Fmu")
            if not needs_more:
                break
        self.fmu.enterContinuousTimeMode()

    def values(self, z: np.ndarray) -> np.ndarray:
        """(rates, effort) (n + 1,) at z (3 + n,)."""
        with self.lock:
            self._set(z)
            number = len(self.interface.states)
            rates = (c_double * number)()
            if number:
                self.fmu.getContinuousStateDerivatives(rates, number)
            return np.array([*rates, *self.fmu.getFloat64([self.interface.effort])])

    def slopes(self, z: np.ndarray) -> np.ndarray:
        """Slopes (n + 1, 3 + n), column by column from the FMU's directional derivatives."""
        one = self.interface
        unknowns, knowns = [*one.rates, one.effort], [0, *one.inputs, *one.places]
        knowns[0] = self._time
        found = np.zeros((len(unknowns), len(knowns)))
        with self.lock:
            self._set(z)
            for k, known in enumerate(knowns):
                if known is not None:
                    found[:, k] = self.fmu.getDirectionalDerivative(unknowns, [known], [1.0])
        return found

    @functools.cached_property
    def _time(self):
        """Value reference of the independent variable."""
        variables = fmpy_module().read_model_description(self.interface.path).modelVariables
        return next(x.valueReference for x in variables if x.causality == "independent")

    def _set(self, z):
        one = self.interface
        self.fmu.setTime(float(z[0]))
        given = [(place, float(x)) for place, x in zip(one.inputs, z[1:3], strict=True) if place is not None]
        if given:
            self.fmu.setFloat64([place for place, _ in given], [x for _, x in given])
        if one.states:
            states = (c_double * len(one.states))(*(float(x) for x in z[3:]))
            self.fmu.setContinuousStates(states, len(one.states))


@functools.cache
def instance_of(interface: Interface) -> Instance:
    """The instance of this process; here the FMU's code begins to run."""
    return Instance(interface)
