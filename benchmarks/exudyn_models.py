"""Mechanisms in Exudyn, for `closed_loop.py`, `solvers.py`, `hydraulic_arm.py`; imported only where it is installed.

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
    NodeGenericODE1,
    NodePoint2DSlope1,
    NodeRigidBody2D,
    ObjectANCFCable2D,
    ObjectConnectorHydraulicActuatorSimple,
    ObjectConnectorSpringDamper,
    ObjectGround,
    ObjectJointPrismatic2D,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
    SensorBody,
    SensorNode,
    Torque,
)
from exudyn.utilities import RigidBodyInertia

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

    def slide(self, a, b):
        """A prismatic joint along the x axis of body a, between the centres of mass."""
        markers = [
            self.system.AddMarker(MarkerBodyRigid(bodyNumber=self.bodies[name], localPosition=[0.0, 0.0, 0.0]))
            for name in (a, b)
        ]
        joint = ObjectJointPrismatic2D(
            markerNumbers=markers, axisMarker0=[1.0, 0.0, 0.0], normalMarker1=[0.0, 1.0, 0.0]
        )
        self.system.AddObject(joint)

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


def hanging_four_bar(four_bars):
    """The nominal four-bar of `four_bars.py` at rest, in its plane (x, -z).  Reads the crank's angle."""
    lengths, angle = four_bars.LENGTHS, four_bars.START
    tip = lengths["crank"] * np.array([np.cos(angle), np.sin(angle)])
    reach = np.array([lengths["ground"], 0.0]) - tip
    far, between = np.hypot(*reach), np.arctan2(reach[1], reach[0])
    cosine = (lengths["coupler"] ** 2 + far**2 - lengths["rocker"] ** 2) / (2.0 * lengths["coupler"] * far)
    coupler = between + np.arccos(cosine)
    joint = tip + lengths["coupler"] * np.array([np.cos(coupler), np.sin(coupler)])
    rocker = np.arctan2(joint[1], joint[0] - lengths["ground"])
    plane = Plane()
    starts = {"crank": ((0, 0), angle), "coupler": (tip, coupler), "rocker": ((lengths["ground"], 0), rocker)}
    nodes = {}
    for name, (origin, turned) in starts.items():
        mass = length = lengths[name]
        nodes[name] = plane.body(
            name, mass, mass * length**2 / 12.0, (length / 2, 0), origin, turned, gravity=-GRAVITY
        )
    plane.pin("ground", (0, 0), "crank", (0, 0))
    plane.pin("crank", (lengths["crank"], 0), "coupler", (0, 0))
    plane.pin("coupler", (lengths["coupler"], 0), "rocker", (lengths["rocker"], 0))
    plane.pin("ground", (lengths["ground"], 0), "rocker", (0, 0))
    plane.system.Assemble()
    return plane.system, lambda: np.array([angle + plane.coordinates(nodes["crank"])[2]])


def slider_crank():
    """C1 on its free run.  Reads the crank's angle."""
    angle, rate, r, rod_length = 0.4, 5.0, 0.15, 0.5
    rod, pin = -np.arcsin(r * np.sin(angle) / rod_length), r * np.array([np.cos(angle), np.sin(angle)])
    rod_rate = -r * rate * np.cos(angle) / (rod_length * np.cos(rod))
    speed = rate * np.array([-pin[1], pin[0]])
    side = np.array([-np.sin(rod), np.cos(rod)])
    place = pin + rod_length * np.array([np.cos(rod), np.sin(rod)])
    plane = Plane()
    of_rod = (*(speed + 0.25 * rod_rate * side), rod_rate)
    of_slider = (speed[0] + rod_length * rod_rate * side[0], 0.0, 0.0)
    crank = plane.body("crank", 1.2, 0.004, (0.075, 0), (0, 0), angle, (*(speed / 2), rate), GRAVITY)
    plane.body("rod", 2.0, 0.06, (0.25, 0), pin, rod, of_rod, GRAVITY)
    plane.body("slider", 3.0, 0.01, (0, 0), place, 0.0, of_slider, GRAVITY)
    plane.pin("ground", (0, 0), "crank", (0, 0))
    plane.pin("crank", (r, 0), "rod", (0, 0))
    plane.pin("rod", (rod_length, 0), "slider", (0, 0))
    plane.slide("ground", "slider")
    plane.system.Assemble()
    return plane.system, lambda: np.array([angle + plane.coordinates(crank)[2]])


def stiff_strut(stiffness, damping, length, mass):
    """A mass that swings on a stiff strut along a pinned sleeve.  Reads the sleeve's angle."""
    plane = Plane()
    sleeve = plane.body("sleeve", 0.1, 0.1 * 0.2**2 / 12.0, (0.1, 0), (0, 0), 0.0, gravity=GRAVITY)
    plane.body("mass", mass, 1e-3, (0, 0), (length, 0), 0.0, gravity=GRAVITY)
    plane.pin("ground", (0, 0), "sleeve", (0, 0))
    plane.slide("sleeve", "mass")
    ends = [plane.marker("ground", (0, 0)), plane.marker("mass", (0, 0))]
    law = {"stiffness": stiffness, "damping": damping, "referenceLength": length}
    plane.system.AddObject(ObjectConnectorSpringDamper(markerNumbers=ends, **law))
    plane.system.Assemble()
    return plane.system, lambda: np.array([plane.coordinates(sleeve)[2]])


def flyball_governor(stiffness=8e5, damping=4e4):
    """A05.  Reads the slider's height on its shaft."""
    system, spin = exu.SystemContainer().AddSystem(), [0.0, 0.0, 2.0 * np.pi]
    tilt = np.pi / 6

    def body(mass, inertia, place, rotation):
        velocity = np.cross(spin, place)
        return system.CreateRigidBody(
            inertia=RigidBodyInertia(mass, np.diag(inertia)),
            referencePosition=list(place),
            referenceRotationMatrix=rotation,
            initialVelocity=list(velocity),
            initialAngularVelocity=spin,
            gravity=[0, 0, -GRAVITY],
        )

    box = lambda mass, x, y, z: mass / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    shaft = body(0.3, box(0.3, 0.01, 0.01, 1.0), [0.0, 0.0, 0.5], np.eye(3))
    slider = body(3.0, box(3.0, 0.1, 0.1, 0.1), [0.0, 0.0, 0.5], np.eye(3))
    ground = system.CreateGround()
    z_axis, y_axis = [0, 0, 1], [0, 1, 0]
    local = {"useGlobalFrame": False}
    system.CreateRevoluteJoint(bodyNumbers=[ground, shaft], position=[0, 0, 0], axis=z_axis, **local)
    system.CreatePrismaticJoint(bodyNumbers=[shaft, slider], position=[0, 0, 0], axis=z_axis, **local)
    for sign in (1.0, -1.0):
        mass, com = 5.3, (0.3 * 0.5 + 5.0) / 5.3  # rod and tip
        inertia = box(0.3, 1.0, 0.01, 0.01) + (0.3 * (com - 0.5) ** 2 + 5.0 * (1.0 - com) ** 2) * np.array([0, 1, 1])
        along = np.array([sign * np.cos(tilt), 0.0, -np.sin(tilt)])
        rotation = np.column_stack([sign * along, [0.0, 1.0, 0.0], np.cross(sign * along, [0.0, 1.0, 0.0])])
        hinge = np.array([0.05 * sign, 0.0, 1.0])
        rod = body(mass, inertia, hinge + com * along, rotation)
        system.CreateRevoluteJoint(bodyNumbers=[shaft, rod], position=[0.05 * sign, 0, 0.5], axis=y_axis, **local)
        system.CreateSpringDamper(
            bodyNumbers=[slider, rod],
            localPosition0=[0.05 * sign, 0, 0],
            localPosition1=[(0.5 - com) * sign, 0, 0],
            referenceLength=0.5,
            stiffness=stiffness,
            damping=damping,
        )
    height = SensorBody(
        bodyNumber=slider, outputVariableType=exu.OutputVariableType.Position, storeInternal=False, writeToFile=False
    )
    height = system.AddSensor(height)
    system.Assemble()
    return system, lambda: np.array([system.GetSensorValues(height)[2]])


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


def hydraulic_arm(start):
    """HY1 from the pressures (2,); its valve is set at the beginning of each step.  Reads the norm of the case."""
    plane, length = Plane(), np.sqrt(2 * 0.25**2)
    node = plane.body("arm", 120.0, 10.0, (0.5, 0), (0, 0), 0.0, gravity=GRAVITY)
    plane.pin("ground", (0, 0), "arm", (0, 0))
    system, oil = (
        plane.system,
        NodeGenericODE1(referenceCoordinates=[0.0, 0.0], initialCoordinates=list(start), numberOfODE1Coordinates=2),
    )
    oil = system.AddNode(oil)
    cylinder = ObjectConnectorHydraulicActuatorSimple(
        markerNumbers=[plane.marker("ground", (0, -0.25)), plane.marker("arm", (0.25, 0))],
        nodeNumbers=[oil],
        offsetLength=length,
        strokeLength=0.1,
        **{f"chamberCrossSection{k}": 0.01 for k in (0, 1)},
        **{f"hoseVolume{k}": 1.0 for k in (0, 1)},
        actuatorDamping=2e5,
        oilBulkModulus=1e11,
        nominalFlow=2e-5,
        systemPressure=2e7,
    )
    cylinder = system.AddObject(cylinder)

    def valve(mbs, t):
        wanted = (min(max(1.0 - np.cos(np.pi * t), 0.5), 1.5) - 0.5) * 0.1 + length
        opening = 2.0 * (wanted - mbs.GetObjectOutput(cylinder, exu.OutputVariableType.Distance))
        mbs.SetObjectParameter(cylinder, "valveOpening0", opening)
        mbs.SetObjectParameter(cylinder, "valveOpening1", -opening)
        return True

    system.SetPreStepUserFunction(valve)
    system.Assemble()

    def read():
        pressures = system.GetNodeOutput(oil, exu.OutputVariableType.Coordinates)
        return np.linalg.norm(plane.coordinates(node)) + 1e-6 * np.linalg.norm(pressures)

    return system, read
