"""The Python side of an exported FMU, stored in it as `resources/runtime.py`: it needs jax and numpy, not jaxmbs.

The shared library keeps the numbers of an instance in one block of float64, which `open_instance` is given a view of:
z = (time, states, inputs, parameters, hidden coordinates), results (rates of states, outputs, hidden coordinates,
gap), seed, sensitivity, nominal values.  The programs are StableHLO with versions, not code of Python.
"""

import hashlib
import json
import sys
import threading
import traceback
from pathlib import Path
from types import ModuleType
from typing import Any

import jax
import jax.export
import numpy as np

OK, DISCARD, ERROR = 0, 2, 3
_SHARED = "_jaxmbs_fmu_programs"  # compiled programs of this process, in a module that all instances see
_lock = threading.RLock()


def open_instance(resources: str, block: Any, message: Any, is_co_simulation: int) -> "FmuInstance | None":
    """An instance on a block of numbers; None with a message where its programs cannot be used here."""
    try:
        about = json.loads((Path(resources) / "about.json").read_text(encoding="utf-8"))
        return FmuInstance(Path(resources), about, np.frombuffer(block), message, bool(is_co_simulation))
    except Exception:  # noqa: BLE001 - the host of an FMU gets messages, not exceptions
        _write(message, f"the programs of this FMU cannot be used: {traceback.format_exc(limit=-3)}")
        return None


class FmuInstance:
    """One instance; methods return a status of FMI, with a message where it is not 0."""

    def __init__(self, resources, about, block, message, is_co_simulation):
        names = "z", "results", "seed", "sensitivity"
        sizes = [about["sizes"][name] for name in names]
        self.parts = dict(zip(names, np.split(block[: sum(sizes)], np.cumsum(sizes)[:-1]), strict=True))
        self.resources, self.about, self.message = resources, about, message
        self.z, self.results = self.parts["z"], self.parts["results"]
        self.seed, self.sensitivity = self.parts["seed"], self.parts["sensitivity"]
        self.z[:] = about["start"]
        block[sum(sizes) :] = about["nominals"]
        self.known, self.unknown = about["num_known"], about["num_unknown"]
        self.cpu = jax.devices("cpu")[0]
        self.at = self.program("instant")
        if is_co_simulation:
            self.program("step")
        elif about["ends"]:
            self.program("margins")

    def program(self, name):
        """A compiled program of one array, shared by all instances of the process."""
        options = None
        if f"{name}_kernel" in self.about["sha256"] and self.about["jax"] == jax.__version__:
            name, options = f"{name}_kernel", self.about["kernel_options"]
        digest = self.about["sha256"][name]
        with _lock:
            shared = sys.modules.setdefault(_SHARED, ModuleType(_SHARED)).__dict__
            if digest not in shared:
                content = (self.resources / f"{name}.bin").read_bytes()
                if hashlib.sha256(content).hexdigest() != digest:
                    raise ValueError(f"{name}.bin is damaged")
                call = jax.jit(jax.export.deserialize(bytearray(content)).call)
                with jax.enable_x64(True), jax.default_device(self.cpu):
                    argument = jax.ShapeDtypeStruct((self.about["arguments"][name],), np.float64)
                    shared[digest] = call.lower(argument).compile(compiler_options=options)
            return shared[digest]

    def run(self, program, argument):
        """The result of a program, as an array of NumPy."""
        if jax.config.read("jax_enable_x64"):  # to enter the context costs a fifth of a small call
            return np.asarray(program(argument))
        with jax.enable_x64(True):
            return np.asarray(program(argument))

    def evaluate(self):
        """Results of z.  Where the loops do not close from the last accepted step, the last pose found serves."""
        try:
            results = self.run(self.at, self.z)
            if not results[-1] <= self.about["closed"] and np.all(np.isfinite(self.results[self.unknown : -1])):
                again = self.z.copy()
                again[self.known :] = self.results[self.unknown : -1]
                results = self.run(self.at, again)
            if not results[-1] <= self.about["closed"]:
                return self.refuse(results)
            self.results[:] = results
            return OK
        except Exception:  # noqa: BLE001
            return self.report_error()

    def directional(self):
        """Sensitivity (unknowns,) to the seed (knowns,)."""
        return self.differentiate("directional", self.known, self.unknown)

    def adjoint(self):
        """Sensitivity (knowns,) to the seed (unknowns,)."""
        return self.differentiate("adjoint", self.unknown, self.known)

    def differentiate(self, name, num_seeds, number):
        try:
            slopes = self.run(self.program(name), np.concatenate([self.z, self.seed[:num_seeds]]))
            if not np.all(np.isfinite(slopes)):
                return self.say(f"derivatives at t = {self.z[0]:g} are not finite", DISCARD)
            self.sensitivity[:number] = slopes
            return OK
        except Exception:  # noqa: BLE001
            return self.report_error()

    def step(self):
        """z after a step of the length seed[0]; where it fails z stays."""
        try:
            numbers = self.run(self.program("step"), np.append(self.z, self.seed[0]))
            if numbers[-1] != 0:
                words = self.about["results"].get(str(int(numbers[-1])), "the motion failed")
                if numbers[-1] == self.about["outside"]:
                    words = self.faults(numbers[:-1]) or self.faults(self.z) or words
                return self.say(f"the step of {self.seed[0]:g} s from t = {self.z[0]:g} failed: {words}", DISCARD)
            self.z[:] = numbers[:-1]
            return OK
        except Exception:  # noqa: BLE001
            return self.report_error()

    def judge(self):
        """Refuse z where a part of the model is beyond the end of its range."""
        try:
            faults = self.faults(self.z)
            return self.say(f"outside of the model's validity: {faults}", DISCARD) if faults else OK
        except Exception:  # noqa: BLE001
            return self.report_error()

    def faults(self, z):
        """Parts that are beyond the ends of their models at z, by how much and when; "" where there are none."""
        values = self.run(self.program("margins"), z)
        told = zip(self.about["ends"], values, strict=True)
        return "; ".join(f"{what}, by {-x:.3g} {unit}, at {z[0]:.6g} s" for (what, unit), x in told if x < 0)

    def refuse(self, results):
        """The message of results that are not finite, or of loops that do not close."""
        bad = [name for name, x in zip(self.about["unknowns"], results, strict=False) if not np.isfinite(x)]
        given = [name for name, x in zip(self.about["knowns"], self.z, strict=False) if not np.isfinite(x)]
        if given:
            text = f"{', '.join(given)}: not finite"
        elif np.isfinite(results[-1]):
            text = f"the loops do not close at t = {self.z[0]:g}: a residual of {results[-1]:.1e} remains"
        else:
            text = f"not finite at t = {self.z[0]:g}: {', '.join(bad) or 'the closing of the loops'}"
        return self.say(text, DISCARD)

    def report_error(self):
        return self.say(traceback.format_exc(limit=-3), ERROR)

    def say(self, text, status):
        _write(self.message, text)
        return status


def _write(message, text):
    """Text with a zero at its end in the buffer of the shared library."""
    line = text.encode("utf-8", "replace")[: len(message) - 1]
    message[: len(line) + 1] = line + b"\0"
