"""Mechanisms that the tests of FMUs export, and the interface of FMI to one instance."""

import contextlib
import shutil
from ctypes import c_double

import numpy as np
import pytest

import jaxmbs as mbs


def pendulum(parameters=None, like=None):
    """A bar on a pin with a motor and a spring."""
    p = {"mass": 1.0, "stiffness": 2.0} | (parameters or {})
    b = mbs.SystemBuilder()
    b.body("bob", mass=p["mass"], com=(0.5, 0.0, 0.0), inertia=0.01)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("motor", mbs.Actuator(0.0), joint="pin")
    b.force("spring", mbs.SpringDamper(p["stiffness"], 0.1), joint="pin")
    b.measure("height", on=("bob", (0.5, 0.0, 0.0)), axis="z")
    system = b.build(like=like)
    return system, mbs.State.at(system, pin=0.3)


def slider_crank():
    """A closed loop of one freedom: crank, rod and piston with a spring."""
    b = mbs.SystemBuilder()
    b.body("crank", mass=1.0, com=(0.1, 0.0, 0.0), inertia=0.01)
    b.body("rod", mass=0.5, com=(0.25, 0.0, 0.0), inertia=0.02)
    b.body("piston", mass=0.7, inertia=0.01)
    b.joint("A", mbs.Revolute("y"), "ground", "crank")
    b.joint("B", mbs.Revolute("y"), "crank", "rod", parent_frame=(0.2, 0.0, 0.0))
    b.joint("slide", mbs.Prismatic("x"), "ground", "piston")
    b.joint("C", mbs.Revolute("y"), "rod", "piston", parent_frame=(0.5, 0.0, 0.0))
    b.force("motor", mbs.Actuator(1.0), joint="A")
    b.force("spring", mbs.SpringDamper(20.0, 1.0), joint="slide")
    system = b.build(guess={"A": 0.5, "B": -0.8}, independent=["A"])
    return system, mbs.State.at(system, A=0.5, velocities={"A": 2.0}, guess={"B": -0.8, "slide": 0.6})


def cart(force=0.0):
    """A cart with a pendulum, pushed by a force."""
    b = mbs.SystemBuilder()
    b.body("cart", mass=2.0, inertia=0.1)
    b.body("bob", mass=0.5, com=(0.0, 0.0, -0.4), inertia=0.01)
    b.joint("rail", mbs.Prismatic("x"), "ground", "cart")
    b.joint("pin", mbs.Revolute("y"), "cart", "bob")
    b.force("push", mbs.Actuator(force), joint="rail")
    system = b.build()
    return system, mbs.State.at(system, pin=0.2)


def compiler_or_skip():
    """Skip, by name, without a C compiler."""
    if not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        pytest.skip("no C compiler")


def needs_compiler():
    """The package fmpy; skip, by name, without it or a C compiler."""
    compiler_or_skip()
    return pytest.importorskip("fmpy")


@contextlib.contextmanager
def instance(path, kind="ME", start=None):
    """(instance of fmpy, value references by name) of an FMU that is initialised with start values."""
    fmpy = needs_compiler()
    from fmpy.fmi3 import FMU3Model, FMU3Slave

    description, folder = fmpy.read_model_description(str(path)), fmpy.extract(str(path))
    interface = description.modelExchange if kind == "ME" else description.coSimulation
    fmu = (FMU3Model if kind == "ME" else FMU3Slave)(
        guid=description.instantiationToken,
        unzipDirectory=folder,
        modelIdentifier=interface.modelIdentifier,
        instanceName="one",
    )
    places = {variable.name: variable.valueReference for variable in description.modelVariables}
    try:
        fmu.instantiate()
        fmu.enterInitializationMode()
        for name, value in (start or {}).items():
            fmu.setFloat64([places[name]], [value])
        fmu.exitInitializationMode()
        if kind == "ME":
            fmu.enterContinuousTimeMode()
        yield fmu, places
        fmu.freeInstance()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def rates(fmu, x):
    """Rates of continuous states at x."""
    given, found = (c_double * len(x))(*x), (c_double * len(x))()
    fmu.setContinuousStates(given, len(x))
    fmu.getContinuousStateDerivatives(found, len(x))
    return np.array(found)
