"""G5: a four-bar with a spring and a damper on every hinge, so that the builder cuts a body open; reference in one
coordinate.  Also with a coupler without mass, and with dampers a hundred times stronger."""

import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN

from .reading import along, check

CASE = json.loads((Path(__file__).parent / "G5_four_bar_springs_dampers.json").read_text())
NUMBERS = CASE["parameters"]


def build(variant, sprung="ABCD", like=None):
    a, b_, c, d = (NUMBERS[name] for name in "abcd")
    masses, inertias = (np.array(NUMBERS[name]) for name in ("m", "J"))
    if variant == "massless coupler":
        masses[1] = inertias[1] = 0.0
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name, mass, J, com in zip(("crank", "coupler", "rocker"), masses, inertias, NUMBERS["com"], strict=True):
        b.body(name, mass, (*com, 0.0), J * np.array([0.5, 0.5, 1.0]))
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(a, 0.0, 0.0))
    b.joint("D", PIN, "ground", "rocker", parent_frame=(d, 0.0, 0.0))
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(b_, 0.0, 0.0), child_frame=(c, 0.0, 0.0))
    angles = first("angles of crank, coupler, rocker rad", variant)
    relaxed = dict(A=angles[0], B=angles[1] - angles[0], C=angles[2] - angles[1], D=angles[2])
    for name in sprung:
        law = mbs.SpringDamper(
            stiffness=NUMBERS["spring_Nm_rad"][name],
            damping=NUMBERS["damper_Nms_rad"][name] * (100.0 if variant == "stiff" else 1.0),
            free_length=relaxed[name],
        )
        b.force(f"spring {name}", law, joint=name)
    system = b.build(like=like)
    guess = {name: relaxed[name] for name in ("B", "C", "D") if not _is_cut(system, name)}
    return system, mbs.State.at(system, A=0.8, velocities={"A": 9.0}, guess=guess)


def _is_cut(system, name):
    return name in system.topology.cut_joints


def outputs(variant):
    """(quantity, time) -> (value, tolerance)."""
    rows = [o for o in CASE["outputs"] if o["quantity"].startswith(f"{variant}: ")]
    return {(o["quantity"].split(": ")[1], o["time"]): (np.array(o["value"]), o["tol"]) for o in rows}


def first(quantity, variant):
    return outputs(variant)[quantity, 0.0][0]


def bars(turn):
    """Of crank, coupler and rocker, from their angular velocity or acceleration vectors."""
    return lambda system, state: jnp.stack([turn(system, state, n)[2] for n in ("crank", "coupler", "rocker")])


def angles(system, state):
    R = [mbs.rotation(system, state, name) for name in ("crank", "coupler", "rocker")]
    return jnp.stack([jnp.arctan2(r[1, 0], r[0, 0]) for r in R])


def pins(system, state):
    """Forces on the bodies as the case has them: A, D from the ground, B on the coupler, C on the rocker."""
    loads = mbs.reactions(system, state)
    return jnp.stack([loads[name].force[:2] for name in "ABCD"])


@pytest.mark.parametrize(
    "variant",
    [
        pytest.param("full", marks=pytest.mark.long),
        pytest.param("massless coupler", marks=pytest.mark.long),
        pytest.param("stiff", marks=pytest.mark.long),
    ],
)
def test_motion_and_loads(variant):
    system, state = build(variant)
    assert system.topology.mobility == 1
    expected = outputs(variant)
    times = sorted({time for _, time in expected})
    motion = mbs.simulate(system, state, ts=times, rtol=1e-11, atol=1e-11)
    found = {
        "angles of crank, coupler, rocker rad": along(angles, system, motion),
        "rates rad/s": along(bars(mbs.kinematics.angular_velocity), system, motion),
        "accelerations rad/s2": along(bars(mbs.dynamics.angular_acceleration), system, motion),
        "pin forces N at A, B, C, D (x,y each)": along(pins, system, motion),
    }
    for (quantity, time), (value, tol) in expected.items():
        if quantity in found:
            check(found[quantity][times.index(time)], value, tol)


@pytest.mark.parametrize(
    "tolerance", [pytest.param(1e-9, marks=pytest.mark.long), pytest.param(1e-11, marks=pytest.mark.long)]
)
def test_a_massless_twin_costs_no_steps(tolerance):
    """Dampers on three hinges and on four, where the fourth needs a twin without mass: nearly the same steps."""
    steps = {}
    for sprung in ("ABD", "ABCD"):
        system, state = build("full", sprung)
        motion = mbs.simulate(system, state, ts=[0.0, 1.0], rtol=tolerance, atol=tolerance)
        steps[sprung] = int(motion.diagnostics.num_steps + motion.diagnostics.num_rejected)
    assert steps["ABCD"] <= 1.2 * steps["ABD"], steps


@pytest.mark.long
@pytest.mark.parametrize("formulation", ["canonical", "independent", "velocity"])
def test_formulations_take_a_massless_coupler(formulation):
    system, state = build("massless coupler", "ABD")
    motion = mbs.simulate(system, state, ts=[0.0, 0.3], formulation=formulation)
    reference = mbs.simulate(system, state, ts=[0.0, 0.3], rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(motion.states.coordinates, reference.states.coordinates, atol=1e-7)
    assert motion.diagnostics.num_steps < 1000
