"""Driven mechanisms without freedom: they keep their branch, say where they lock, and honour the options."""

import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import PIN, four_bar, four_bar_angles

GUESS = {"A": 0.7, "B": -0.4, "D": 1.4}
CASE = json.loads((Path(__file__).parent.parent / "cases" / "G4_four_bars_1000_turns.json").read_text())


def driven(lengths=(1.0, 0.3, 0.9, 0.7), drive=None):
    system = four_bar(lengths, drive=drive)
    return system, mbs.State.at(system, guess=GUESS)


def rotating(link, start, rate):
    """The four-bar of case G4, links a, b, c on a ground of length d."""
    b = mbs.SystemBuilder()
    for name, length in (("crank", link["a"]), ("coupler", link["b"]), ("follower", link["c"])):
        b.body(name, mass=1.0, com=(length / 2, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
    b.joint("A", PIN, "ground", "crank", drive=mbs.Ramp(start, rate))
    b.joint("B", PIN, "crank", "coupler", parent_frame=(link["a"], 0.0, 0.0))
    b.joint("D", PIN, "ground", "follower", parent_frame=(link["d"], 0.0, 0.0))
    b.joint("C", PIN, "coupler", "follower", parent_frame=(link["b"], 0.0, 0.0), child_frame=(link["c"], 0.0, 0.0))
    return b.build(cut=["C"])


@pytest.mark.long
@pytest.mark.parametrize("name", CASE["linkages"])
def test_a_thousand_turns_on_one_branch(name):
    """Case G4: angles of coupler and follower from Freudenstein's equation, whole turns of the drag link included."""
    linkage = CASE["linkages"][name]
    system = rotating(linkage["links"], CASE["start_angle"], CASE["crank_rate"])
    times, angles = np.array(linkage["times"]), np.array(linkage["angles"])
    guess = {"A": CASE["start_angle"], "B": angles[0, 0] - CASE["start_angle"], "D": angles[0, 1]}
    motion = mbs.simulate(system, mbs.State.at(system, guess=guess), ts=times)
    A, B, D = np.asarray(motion.states.coordinates).T
    np.testing.assert_allclose(np.stack([A + B, D], axis=1), angles, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("rate", [100.0, 1.0])
def test_a_narrow_elbow_is_passed_on_its_branch(rate):
    """A crank-rocker whose elbow closes to 14 degrees, 60 turns at two speeds."""
    lengths = (1.0, 0.3, 0.75, 0.56)
    system, state = driven(lengths, mbs.Ramp(0.7, rate))
    motion = mbs.simulate(system, state, ts=jnp.linspace(0.1, 60.0, 60) * 2.0 * np.pi / rate)
    wanted = np.array([four_bar_angles(0.7 + rate * float(t), lengths) for t in motion.ts])
    difference = np.asarray(motion.states.coordinates) - wanted
    assert np.abs((difference + np.pi) % (2.0 * np.pi) - np.pi).max() < 1e-9


@pytest.mark.long
def test_a_drive_that_jumps_is_a_failure_at_its_time():
    system, state = driven(drive=lambda t: jnp.where(t < 0.5, 0.7, 3.9))
    motion = mbs.simulate(system, state, t1=1.0, throw=False)
    assert motion.status is mbs.Status.INCONSISTENT
    np.testing.assert_allclose(motion.end.t, 0.5, atol=1e-9)
    known = np.asarray(motion.ts) < 0.5
    assert np.all(np.isfinite(motion.states.coordinates[known]))
    assert np.all(np.isnan(motion.states.coordinates[~known]))


@pytest.mark.long
def test_a_mechanism_that_locks_says_when():
    """The crank cannot pass where coupler and rocker are in line: its angle there by the law of cosines."""
    lengths = (1.0, 0.8, 0.5, 0.6)
    system, state = driven(lengths, mbs.Ramp(0.7, 1.0))
    ground, crank, coupler, rocker = lengths
    limit = np.arccos((ground**2 + crank**2 - (coupler + rocker) ** 2) / (2.0 * ground * crank))
    with pytest.raises(mbs.SimulationError, match=f"it reached t = {limit - 0.7:.4g}") as failure:
        mbs.simulate(system, state, t1=2.0)
    np.testing.assert_allclose(failure.value.motion.end.t, limit - 0.7, atol=1e-6)


@pytest.mark.long
def test_an_event_ends_a_driven_motion():
    system, state = driven(drive=mbs.Ramp(0.7, 1.0))
    motion = mbs.simulate(system, state, t1=2.0, event=lambda s: s.coordinates[0] - 1.5)
    assert motion.status is mbs.Status.EVENT
    np.testing.assert_allclose(motion.end.t, 0.8, atol=1e-9)
    last = np.nonzero(np.isfinite(motion.ts))[0][-1]
    np.testing.assert_allclose(motion.states.coordinates[last], four_bar_angles(1.5), atol=1e-9)


@pytest.mark.long
def test_the_bound_on_steps_is_kept():
    system, state = driven(drive=mbs.Ramp(0.7, 1.0))
    motion = mbs.simulate(system, state, t1=100.0, max_steps=5, throw=False)
    assert motion.status is mbs.Status.MAX_STEPS and int(motion.diagnostics.num_steps) <= 5


@pytest.mark.long
def test_the_work_of_drives_between_coarse_saves():
    """Whole turns between the saved times: the account closes to the tolerance."""
    system, state = driven(drive=mbs.Ramp(0.7, 3.0))
    motion = mbs.simulate(system, state, ts=jnp.array([10.0, 40.0]))
    work = np.abs(np.asarray(motion.diagnostics.work["drives"])).max()
    assert work > 1.0
    assert np.abs(np.asarray(motion.diagnostics.energy_residual)).max() < 1e-7 * work
