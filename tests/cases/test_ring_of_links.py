"""A07, a ring of 200 links: accelerations and joint forces while it turns, free and hung on a pin."""

import json
from pathlib import Path

import numpy as np
import pytest

import jaxmbs as mbs

CASE = json.loads((Path(__file__).parent / "A07_ring_200_links.json").read_text())
N, LENGTH, RATE = 200, 0.1, 3.0
PIN = mbs.Revolute(axis="z")


def ring(masses, is_pinned, linear_solver="auto"):
    """The ring and its state; link i from vertex i to i + 1, counter-clockwise, vertex 0 on top."""
    angle = np.pi / 2 + 2 * np.pi * np.arange(N) / N
    corner = LENGTH / (2 * np.sin(np.pi / N)) * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    along = (np.roll(corner, -1, axis=0) - corner) / LENGTH
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for i in range(N):
        axes = np.stack([along[i], np.cross([0, 0, 1.0], along[i]), [0, 0, 1.0]], axis=1)
        rod = mbs.inertia.rod(masses[i], LENGTH, axis="x")
        b.frame(f"centre {i}", on=f"link {i}", position=(LENGTH / 2, 0, 0))
        b.body(f"link {i}", masses[i], (LENGTH / 2, 0, 0), rod, position=corner[i], rotation=axes)
    b.joint(
        "ground", PIN if is_pinned else mbs.Planar(), "ground", "link 0", at=corner[0] if is_pinned else (0, 0, 0)
    )
    for i in range(N):
        b.joint(f"vertex {(i + 1) % N}", PIN, f"link {i}", f"link {(i + 1) % N}", at=corner[(i + 1) % N])
    system = b.build(linear_solver=linear_solver)
    rate = {"ground": RATE if is_pinned else (0.0, 0.0, RATE)}
    still = {
        j.name: 0.0 for j in system.topology.joints if j.name != "ground" and j.name not in system.topology.cut_joints
    }
    return system, mbs.State.at(system, velocities=rate | still)


def turning(system, accelerations):
    """Angular accelerations (200,) of the links about z."""
    top = system.topology
    turns = np.where(np.asarray(top.spins) > 0, np.asarray(accelerations), 0.0)
    return np.array([top.nodes.path[top.body_node[top.body_names.index(f"link {i}")]] @ turns for i in range(N)])


@pytest.mark.long
@pytest.mark.parametrize(
    "which", ["free ring, unequal masses", "ring hung on a ground pin", "free ring, equal masses"]
)
def test_a_turning_ring(which):
    i = np.arange(N)
    unequal = 1 + 0.5 * np.sin(6 * np.pi * i / N) + 0.2 * np.cos(14 * np.pi * i / N)
    system, state = ring(np.ones(N) if which.endswith(" equal masses") else unequal, "pin" in which)
    assert system.topology.linear_solver == "frontal"
    loads, accelerations = mbs.reactions(system, state), mbs.forward_dynamics(system, state)[0]
    alpha = turning(system, accelerations)
    force = np.stack([np.asarray(loads[f"vertex {(k + 1) % N}"].force)[:2] for k in range(N)])
    outputs = [o for o in CASE["outputs"] if o["quantity"].startswith(which)]
    assert len(outputs) >= 3
    for output in outputs:
        quantity, value = output["quantity"], output["value"]
        if "acceleration of link" in quantity:
            links = [int(k) for k in value]
            at = [mbs.dynamics.acceleration(system, state, f"centre {k}")[:2] for k in links]
            found = np.concatenate([np.asarray(at), alpha[links][:, None]], axis=1)
            np.testing.assert_allclose(found, list(value.values()), atol=output["tol"])
        elif "force of link" in quantity:
            np.testing.assert_allclose(force[[int(k) for k in value]], list(value.values()), atol=output["tol"])
        elif "ground on link" in quantity:
            np.testing.assert_allclose(np.asarray(loads["ground"].force)[:2], value, atol=output["tol"])
        else:
            np.testing.assert_allclose([alpha @ alpha, np.sum(force**2)], value, rtol=1e-10, atol=1e-9)
