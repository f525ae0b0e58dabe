"""The IFToMM cases in Exudyn, for `iftomm.py`; imported only where Exudyn is installed.

Each model returns the system and the sensor of the tracked point.  Where the mechanism has no loop it is a kinematic
tree of minimal coordinates, Exudyn's cheapest form; the loops are planar bodies, and Bricard's bodies in space.
"""

import exudyn as exu
import exudyn_models
import numpy as np
from cases import models
from exudyn.itemInterface import (
    MarkerKinematicTreeRigid,
    NodeGenericODE2,
    ObjectConnectorSpringDamper,
    ObjectKinematicTree,
    SensorBody,
    SensorKinematicTree,
)
from exudyn.utilities import RigidBodyInertia

POSITION = exu.OutputVariableType.Position
METHODS = {
    "generalised alpha": exu.DynamicSolverType.GeneralizedAlpha,
    "trapezoidal, index 2": exu.DynamicSolverType.TrapezoidalIndex2,
    "trapezoidal, tight Newton": exu.DynamicSolverType.TrapezoidalIndex2,
    "Runge-Kutta 4": exu.DynamicSolverType.RK44,
    "Runge-Kutta 6(7)": exu.DynamicSolverType.RK67,
}


def _tree(links, start, rates, gravity):
    """A kinematic tree on a new system; links: (joint type, parent, rotation and place of the joint, mass, com,
    inertia about the com)."""
    system = exu.SystemContainer().AddSystem()
    n = len(links)
    node = NodeGenericODE2(
        referenceCoordinates=[0.0] * n,
        initialCoordinates=list(start),
        initialCoordinates_t=list(rates),
        numberOfODE2Coordinates=n,
    )
    types, parents, places, masses, coms, inertias = zip(*links, strict=True)
    tree = ObjectKinematicTree(
        nodeNumber=system.AddNode(node),
        gravity=list(gravity),
        jointTypes=list(types),
        linkParents=list(parents),
        jointTransformations=exu.Matrix3DList([rotation for rotation, _ in places]),
        jointOffsets=exu.Vector3DList([offset for _, offset in places]),
        linkInertiasCOM=exu.Matrix3DList(list(inertias)),
        linkCOMs=exu.Vector3DList(list(coms)),
        linkMasses=list(masses),
    )
    return system, system.AddObject(tree)


def _tree_sensor(system, tree, link, point):
    sensor = SensorKinematicTree(
        objectNumber=tree,
        linkNumber=link,
        localPosition=point,
        outputVariableType=POSITION,
        storeInternal=True,
        writeToFile=False,
    )
    return system.AddSensor(sensor)


def _body_sensor(system, body, point):
    sensor = SensorBody(
        bodyNumber=body, localPosition=point, outputVariableType=POSITION, storeInternal=True, writeToFile=False
    )
    return system.AddSensor(sensor)


def simple_pendulum():
    """A01 as a kinematic tree."""
    at_origin = (np.eye(3), [0.0] * 3)
    links = [(exu.JointType.RevoluteZ, -1, at_origin, 1.0, [0.0, -1.0, 0.0], np.zeros((3, 3)))]
    system, tree = _tree(links, [-np.pi / 2], [0.0], models.DOWN_Y)
    sensor = _tree_sensor(system, tree, 0, [0.0, -1.0, 0.0])
    system.Assemble()
    return system, sensor


def n_four_bar(n):
    """A02; the point B0 at the top of the first crank."""
    system, _ = exudyn_models.n_four_bar(n)
    sensor = _body_sensor(system, 1, [0.0, 0.5, 0.0])
    system.Assemble()
    return system, sensor


def andrews(start):
    """A03; the pin F between K1 and K2."""
    system, _ = exudyn_models.andrews(start)
    sensor = _body_sensor(system, 1, [0.007 - 0.00092, 0.0, 0.0])
    system.Assemble()
    return system, sensor


def bricard():
    """A04; rods in space, one redundant row."""
    system = exu.SystemContainer().AddSystem()
    corners, bodies = models.BRICARD_CORNERS, [system.CreateGround()]
    for start, end in zip(corners[:-1], corners[1:], strict=True):
        along = end - start
        rod = RigidBodyInertia(1.0, (np.eye(3) - np.outer(along, along)) / 12.0)
        middle = list((start + end) / 2.0)
        bodies.append(system.CreateRigidBody(referencePosition=middle, inertia=rod, gravity=list(models.DOWN_Y)))
    bodies.append(bodies[0])
    for i, (axis, corner) in enumerate(zip(models.BRICARD_AXES, corners, strict=True)):
        direction = [float(axis == name) for name in "xyz"]
        system.CreateRevoluteJoint(bodyNumbers=bodies[i : i + 2], position=list(corner), axis=direction, show=False)
    sensor = _body_sensor(system, bodies[4], [0.5, 0.0, 0.0])
    system.Assemble()
    return system, sensor


def flyball_governor(stiffness=8e5, damping=4e4):
    """A05 as a kinematic tree: shaft, slider, rods; their springs between links."""
    box = lambda mass, x, y, z: mass / 12.0 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
    at_origin, rods = (np.eye(3), [0.0] * 3), []
    for sign in (1.0, -1.0):
        com = np.array([sign * (0.3 * 0.5 + 5.0) / 5.3, 0.0, 0.0])
        arms = 0.3 * (com[0] - 0.5 * sign) ** 2 + 5.0 * (com[0] - sign) ** 2
        inertia = box(0.3, 1.0, 0.01, 0.01) + arms * np.diag([0.0, 1.0, 1.0])
        rods.append((exu.JointType.RevoluteY, 0, (np.eye(3), [0.05 * sign, 0.0, 1.0]), 5.3, com, inertia))
    shaft = (exu.JointType.RevoluteZ, -1, at_origin, 0.3, [0.0, 0.0, 0.5], box(0.3, 0.01, 0.01, 1.0))
    slider = (exu.JointType.PrismaticZ, 0, at_origin, 3.0, [0.0] * 3, box(3.0, 0.1, 0.1, 0.1))
    start = [0.0, 0.5, np.pi / 6, -np.pi / 6]
    system, tree = _tree([shaft, slider, *rods], start, [2 * np.pi, 0.0, 0.0, 0.0], (0.0, 0.0, -9.81))
    for link, sign in ((2, 1.0), (3, -1.0)):
        ends = ((1, [0.05 * sign, 0.0, 0.0]), (link, [0.5 * sign, 0.0, 0.0]))
        markers = [
            system.AddMarker(MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=number, localPosition=place))
            for number, place in ends
        ]
        spring = ObjectConnectorSpringDamper(
            markerNumbers=markers, stiffness=stiffness, damping=damping, referenceLength=0.5
        )
        system.AddObject(spring)
    sensor = _tree_sensor(system, tree, 1, [0.0] * 3)
    system.Assemble()
    return system, sensor


def path(model, method, step, ts, radius=0.9, redundant=False):
    """Times (T,) and places (T, 3) of the tracked point at the equally spaced times `ts`, by steps that land on them.

    Where Newton's method fails Exudyn shortens a step, and the times after it are a little later.
    """
    system, sensor = model
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime = float(ts[-1])
    integration.numberOfSteps = round(float(ts[-1]) / step)
    integration.generalizedAlpha.spectralRadius = radius
    integration.verboseMode = 0
    integration.newton.useModifiedNewton = True
    if method.endswith("tight Newton"):
        integration.newton.relativeTolerance, integration.newton.absoluteTolerance = 1e-10, 1e-12
    settings.solutionSettings.writeSolutionToFile = False
    # a little less than the period, or rounding of the time delays a sample by a step
    settings.solutionSettings.sensorsWritePeriod = (1.0 - 1e-9) * float(ts[1] - ts[0])
    if redundant:  # full pivoting finds the redundant row
        settings.linearSolverType = exu.LinearSolverType.EigenDense
        settings.linearSolverSettings.ignoreSingularJacobian = True
    elif len(system.systemData.GetODE2Coordinates()) > 60:
        settings.linearSolverType = exu.LinearSolverType.EigenSparse
    system.SolveDynamic(settings, solverType=METHODS[method])
    table = system.GetSensorStoredData(sensor)
    if len(table) != len(ts) or not np.all(np.isfinite(table)):
        raise RuntimeError(
            f"Exudyn saved {len(table)} times, {len(ts)} were asked for, or numbers that are not finite"
        )
    return table[:, 0], table[:, 1:4]
