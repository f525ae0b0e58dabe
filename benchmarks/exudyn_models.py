"""The closed-loop cases in Exudyn, for the table of `closed_loop.py`; imported only where Exudyn is installed.

Planar cases use its planar bodies and revolute joints.  Each model returns (system, read), where `read()` gives the
compared quantity at the end of a run.
"""

import exudyn as exu
import numpy as np
from cases import models
from exudyn.itemInterface import (
    Force,
    GenericJoint,
    MarkerBodyPosition,
    MarkerBodyRigid,
    NodePoint2DSlope1,
    NodeRigidBody2D,
    ObjectANCFCable2D,
    ObjectConnectorSpringDamper,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
    SensorNode,
    Torque,
)

GRAVITY = 9.81


class Plane:
    """A planar Exudyn system: bodies by name, pins between points in body axes."""

    def __init__(self):
        self.system = exu.SystemContainer().AddSystem()
        self.bodies = {"ground": self.system.AddObject(ObjectGround())}
        self.pose = {"ground": np.zeros(3)}

    def body(self, name, mass, inertia, com, origin, angle, velocity=(0.0, 0.0, 0.0), gravity=0.0):
        """A body whose axes have their origin (x, y) and angle in the starting pose; `velocity` of its com."""
        com = np.asarray(com, float)
        turned = _turn(angle) @ com
        node = NodeRigidBody2D(
            referenceCoordinates=[*(np.asarray(origin) + turned), angle], initialVelocities=list(velocity)
        )
        node = self.system.AddNode(node)
        body = ObjectRigidBody2D(physicsMass=mass, physicsInertia=inertia, nodeNumber=node)
        self.bodies[name] = self.system.AddObject(body)
        self.pose[name] = com
        if gravity:
            weight = Force(markerNumber=self.marker(name, com), loadVector=[0.0, -mass * gravity, 0.0])
            self.system.AddLoad(weight)
        return node

    def marker(self, name, point):
        """A marker at a point in the body's axes."""
        local = np.zeros(3)
        local[:2] = np.asarray(point, float)[:2] - self.pose[name][:2]
        return self.system.AddMarker(MarkerBodyPosition(bodyNumber=self.bodies[name], localPosition=list(local)))

    def pin(self, a, point_a, b, point_b):
        markers = [self.marker(a, point_a), self.marker(b, point_b)]
        self.system.AddObject(ObjectJointRevolute2D(markerNumbers=markers))

    def coordinates(self, node):
        """Displacements (x, y, angle) of a node from its starting pose."""
        return np.array(self.system.GetNodeOutput(node, exu.OutputVariableType.Coordinates))


def _turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def n_four_bar(n):
    """A02; cranks up, B0 moves with 1 m/s.  Reads x, y of B0."""
    plane = Plane()
    first = None
    for i in range(n + 1):
        rod = plane.body(f"crank_{i}", 1.0, 1 / 12, (0, 0.5), (i, 0), 0.0, (0.5, 0.0, -1.0), GRAVITY)
        first = rod if i == 0 else first
        plane.pin("ground", (i, 0), f"crank_{i}", (0, 0))
    for i in range(n):
        plane.body(f"coupler_{i}", 1.0, 1 / 12, (0.5, 0), (i, 1), 0.0, (1.0, 0.0, 0.0), GRAVITY)
        plane.pin(f"crank_{i}", (0, 1), f"coupler_{i}", (0, 0))
        plane.pin(f"coupler_{i}", (1, 0), f"crank_{i + 1}", (0, 1))
    plane.system.Assemble()

    def read():
        angle = plane.coordinates(first)[2]
        return np.array([-np.sin(angle), np.cos(angle)])

    return plane.system, read


def andrews(start):
    """A03 from the angles (beta, Theta, gamma, Phi, delta, Omega, epsilon).  Reads beta."""
    beta, theta, gamma, phi, delta, omega, epsilon = start
    A, B, C = np.array([-0.06934, -0.00227]), np.array([-0.03635, 0.03273]), np.array([0.014, 0.072])
    points = {  # com, angle, pin to the parent and where it sits on it
        "K1": ((0.00092, 0.0), beta, "ground", (0.0, 0.0)),
        "K2": ((-0.0115, 0.0), beta + theta, "K1", (0.007, 0.0)),
        "K3": ((0.01043, -0.01874), gamma, "ground", B),
        "K5": ((0.02308, 0.00916), delta, "ground", A),
        "K4": ((0.0, -0.00579), phi + delta, "K5", (0.04, 0.0)),
        "K7": ((-0.00449, -0.01228), epsilon, "ground", A),
        "K6": ((0.00579, 0.0), omega + epsilon, "K7", (0.0, -0.04)),
    }
    numbers = dict(
        zip(
            ("K1", "K2", "K3", "K4", "K5", "K6", "K7"),
            zip(models.ANDREWS["masses"], models.ANDREWS["inertias"], strict=True),
            strict=True,
        )
    )
    plane, origin, angles, nodes = Plane(), {"ground": np.zeros(2)}, {"ground": 0.0}, {}
    for name, (com, angle, parent, at) in points.items():
        origin[name] = origin[parent] + _turn(angles[parent]) @ np.asarray(at)
        angles[name] = angle
        nodes[name] = plane.body(name, *numbers[name], com, origin[name], angle)
        plane.pin(parent, at, name, (0.0, 0.0))
    for name, end in (("K3", (0.0, -0.035)), ("K4", (0.0, -0.02)), ("K6", (0.02, 0.0))):
        plane.pin("K2", (-0.028, 0.0), name, end)
    markers = [plane.marker("ground", C), plane.marker("K3", (0.02, -0.018))]
    spring = ObjectConnectorSpringDamper(markerNumbers=markers, stiffness=4530.0, referenceLength=0.07785)
    plane.system.AddObject(spring)
    hub = plane.system.AddMarker(MarkerBodyRigid(bodyNumber=plane.bodies["K1"], localPosition=[0.0, 0.0, 0.0]))
    plane.system.AddLoad(Torque(markerNumber=hub, loadVector=[0.0, 0.0, 0.033]))
    plane.system.Assemble()
    return plane.system, lambda: np.array([beta + plane.coordinates(nodes["K1"])[2]])


def spinning_beam(elements, step, times):
    """The beam of `elastic_bodies.py` by ANCF cables: places (x, y) of its tip at the times."""
    system = exu.SystemContainer().AddSystem()
    length = 10.0 / elements
    places = [NodePoint2DSlope1(referenceCoordinates=[length * k, 0.0, 1.0, 0.0]) for k in range(elements + 1)]
    nodes = [system.AddNode(node) for node in places]
    cables = [
        system.AddObject(
            ObjectANCFCable2D(
                nodeNumbers=[nodes[k], nodes[k + 1]],
                length=length,
                massPerLength=1.2,
                bendingStiffness=1.4e4,
                axialStiffness=2.8e7,
                useReducedOrderIntegration=1,
            )
        )
        for k in range(elements)
    ]
    ends = [system.AddObject(ObjectGround()), cables[0]]
    markers = [system.AddMarker(MarkerBodyRigid(bodyNumber=end, localPosition=[0.0, 0.0, 0.0])) for end in ends]

    def spin(mbs, t, item, offset):
        return [0.0] * 5 + [0.4 * (0.5 * t**2 + (7.5 / np.pi) ** 2 * (np.cos(2 * np.pi * t / 15.0) - 1.0))]

    hub = GenericJoint(markerNumbers=markers, constrainedAxes=[1, 1, 0, 0, 0, 1], offsetUserFunction=spin)
    system.AddObject(hub)
    tip = SensorNode(
        nodeNumber=nodes[-1],
        outputVariableType=exu.OutputVariableType.Position,
        storeInternal=True,
        writeToFile=False,
    )
    tip = system.AddSensor(tip)
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = float(times[-1])
    settings.timeIntegration.numberOfSteps = round(float(times[-1]) / step)
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.absoluteTolerance = 1e-6
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 0.5 * step
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    system.SolveDynamic(settings)
    table = system.GetSensorStoredData(tip)
    return [table[np.argmin(np.abs(table[:, 0] - t)), 1:3] for t in times]


def solve(system, end, step, radius):
    """One run by the generalised alpha method with a fixed step."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = end
    settings.timeIntegration.numberOfSteps = round(end / step)
    settings.timeIntegration.generalizedAlpha.spectralRadius = radius
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWriteFileHeader = False
    system.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha)
