"""Contacts in Exudyn, for `contact.py`; imported only where it is installed.

Each model returns a function that runs it with a number of steps and gives the compared quantity.
"""

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    LoadCoordinate,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
    NodeGenericData,
    NodePointGround,
    ObjectConnectorCartesianSpringDamper,
    ObjectConnectorCoordinateSpringDamperExt,
    ObjectContactSphereSphere,
    ObjectGround,
)
from exudyn.utilities import InertiaSphere
from exudyn_models import Plane


def solve(system, end, steps, radius=1.0):
    """Generalised alpha without dissipation at a fixed step."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = end
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.generalizedAlpha.spectralRadius = radius
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWriteFileHeader = False
    system.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha)


def _stop(system, markers, stiffness):
    """A linear stop that keeps the second coordinate above the first."""
    data = system.AddNode(NodeGenericData(initialCoordinates=[0.0] * 3, numberOfDataCoordinates=3))
    system.AddObject(
        ObjectConnectorCoordinateSpringDamperExt(
            markerNumbers=list(markers), nodeNumber=data, limitStopsLower=0.0, limitStopsUpper=1e3,
            limitStopsStiffness=stiffness, useLimitStops=True,
        )
    )  # fmt: skip


def _coordinate(system, node):
    return system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))


def bouncing_ball(mass, stiffness, height, end):
    """A mass on one coordinate that falls on a stop; gives its height at the end."""

    def run(steps):
        system = exu.SystemContainer().AddSystem()
        node = system.AddNode(Node1D(initialCoordinates=[height]))
        system.AddObject(Mass1D(physicsMass=mass, nodeNumber=node))
        ground = system.AddNode(NodePointGround())
        markers = [_coordinate(system, ground), _coordinate(system, node)]
        _stop(system, markers, stiffness)
        system.AddLoad(LoadCoordinate(markerNumber=markers[1], load=-9.81 * mass))
        system.Assemble()
        solve(system, end, steps)
        return system.GetNodeOutput(node, exu.OutputVariableType.Coordinates)

    return run


def impact(mass, radius, stiffness, speed, restitution, end, model=1):
    """A sphere that hits a fixed one; gives its speed after that over the speed before."""

    def run(steps):
        system = exu.SystemContainer().AddSystem()
        body = system.CreateRigidBody(
            inertia=InertiaSphere(mass, radius), referencePosition=[0.0, 0.0, 2 * radius],
            initialVelocity=[0.0, 0.0, -speed],
        )  # fmt: skip
        ground = system.AddObject(ObjectGround())
        markers = [system.AddMarker(MarkerBodyRigid(bodyNumber=b)) for b in (ground, body)]
        data = system.AddNode(NodeGenericData(initialCoordinates=[1.0, 0.0, 0.0, 0.0], numberOfDataCoordinates=4))
        system.AddObject(
            ObjectContactSphereSphere(
                markerNumbers=markers, nodeNumber=data, spheresRadii=[radius, radius], contactStiffness=stiffness,
                contactStiffnessExponent=1.5, restitutionCoefficient=restitution, impactModel=model,
            )
        )  # fmt: skip
        system.Assemble()
        solve(system, end, steps)
        return system.GetObjectOutputBody(body, exu.OutputVariableType.Velocity)[2] / speed

    return run


def flat_follower(case, omega, end):
    """A follower on an eccentric whose motion is given; gives the force of the contact at the end."""

    def run(steps):
        system = exu.SystemContainer().AddSystem()
        cam = system.AddNode(Node1D())
        follower = system.AddNode(Node1D(initialCoordinates=[-case["depth"]]))
        system.AddObject(Mass1D(physicsMass=1.0, nodeNumber=cam))
        system.AddObject(Mass1D(physicsMass=case["mass"], nodeNumber=follower))
        ground = _coordinate(system, system.AddNode(NodePointGround()))
        markers = _coordinate(system, cam), _coordinate(system, follower)

        def lift(mbs, t, item, offset):
            return case["e"] * (1.0 - np.cos(omega * t))

        system.AddObject(CoordinateConstraint(markerNumbers=[ground, markers[0]], offsetUserFunction=lift))
        _stop(system, markers, case["stiffness"])
        system.AddObject(
            ObjectConnectorCoordinateSpringDamperExt(
                markerNumbers=[ground, markers[1]], stiffness=case["spring"], offset=-case["preload"] / case["spring"]
            )
        )
        system.Assemble()
        solve(system, end, steps)
        q = [float(system.GetNodeOutput(node, exu.OutputVariableType.Coordinates)) for node in (cam, follower)]
        return max(case["stiffness"] * (q[0] - q[1]), 0.0)

    return run


def slider_crank(case, end):
    """A slider-crank with clearance in its wrist pin, its force a function in Python; gives the mean and peak load.

    The crank's inertia is so large that it keeps its speed."""
    crank, rod, omega = case["crank"], case["rod"], case["speed"]

    def run(steps):
        plane = Plane()
        system = plane.system
        turning = -omega * crank / rod
        plane.body("crank", 1.0, 1e9, (0.0, 0.0), (0.0, 0.0), 0.0, (0.0, 0.0, omega))
        start = (0.0, omega * crank + turning * rod / 2, turning)
        plane.body("rod", case["rod_mass"], case["rod_inertia"], (rod / 2, 0.0), (crank, 0.0), 0.0, start)
        plane.body("slider", case["slider_mass"], 1e-4, (0.0, 0.0), (crank + rod, 0.0), 0.0)
        plane.pin("ground", (0.0, 0.0), "crank", (0.0, 0.0))
        plane.pin("crank", (crank, 0.0), "rod", (0.0, 0.0))
        plane.slide("ground", "slider")
        loads = []

        def force(mbs, t, item, u, v, k, d, offset):
            gap, parting = np.array(u[:2]), np.array(v[:2])
            distance = np.hypot(*gap)
            depth = distance - case["clearance"]
            if depth <= 0.0:
                return [0.0, 0.0, 0.0]
            factor = max(1.0 + case["damping"] * (gap @ parting) / distance, 0.0)
            return [*(case["stiffness"] * depth**1.5 * factor / distance * gap), 0.0]

        markers = [plane.marker("rod", (rod, 0.0)), plane.marker("slider", (0.0, 0.0))]
        pin = system.AddObject(
            ObjectConnectorCartesianSpringDamper(
                markerNumbers=markers, stiffness=[1.0] * 3, springForceUserFunction=force
            )
        )

        def sample(mbs, t):
            loads.append(np.hypot(*mbs.GetObjectOutput(pin, exu.OutputVariableType.Force)[:2]))
            return True

        system.SetPreStepUserFunction(sample)
        system.Assemble()
        solve(system, end, steps, 0.9)
        return np.mean(loads), np.max(loads)

    return run
