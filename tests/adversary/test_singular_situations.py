"""Singular and bad situations: what each gives, a motion, a status or an error that names the joints."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN, four_bar, four_bar_angles, four_bar_state


def loop_at(A=0.7, **changes):
    system = four_bar(**changes)
    _, B, D = four_bar_angles(A)
    return system, {"A": A, "B": B, "D": D}


def driven_past_its_reach():
    """A rocker driven beyond the angle that crank and coupler can follow: the loop tears open at C."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name, length in {"crank": 0.3, "coupler": 0.9, "rocker": 0.7}.items():
        b.body(name, mass=1.0, com=(length / 2, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(0.3, 0.0, 0.0))
    start = float(four_bar_angles(0.7)[2])
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0.0, 0.0), drive=lambda t: start + t)
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
    system = b.build()
    guess = dict(zip("ABD", four_bar_angles(0.7), strict=True))
    return mbs.simulate(system, mbs.State.at(system, guess=guess), ts=jnp.linspace(0.0, 2.0, 21))


def cannot_be_assembled():
    system, _ = loop_at()
    far = four_bar((1.88, 0.3, 0.9, 0.7), like=system)
    return mbs.State.at(far, A=0.7)


def held_rates_contradict():
    system, guess = loop_at()
    return mbs.State.at(system, A=0.7, guess=guess, velocities={"A": 1.0, "D": -5.0})


def loop_that_never_closes():
    return four_bar((3.0, 0.3, 0.9, 0.7))


def branch_without_inertia():
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.3, 0.0, 0.0), inertia=0.1)
    b.body("pointer", mass=0.0)
    b.joint("shoulder", PIN, "ground", "arm")
    b.joint("needle", PIN, "arm", "pointer", parent_frame=(0.5, 0.0, 0.0))
    return b.build()


def point_mass_spun_about_itself():
    b = mbs.SystemBuilder()
    b.body("bead", mass=1.0)
    b.joint("spin", PIN, "ground", "bead")
    return b.build()


def dependent_set_asked_for():
    """The passive pin of a driven loop cannot determine the motion."""
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.3, 0.0, 0.0), inertia=0.1)
    b.joint("driven", PIN, "ground", "arm", drive=mbs.Ramp(0.0, 1.0))
    return b.build(independent=["driven"])


def nothing_to_balance():
    b = mbs.SystemBuilder()
    b.body("stone", mass=1.0, inertia=0.1)
    b.joint("fall", mbs.Prismatic(axis="z"), "ground", "stone")
    system = b.build()
    return mbs.equilibrium(system, mbs.State.at(system))


def state_of_a_cut_joint():
    system, _ = loop_at()
    return mbs.State.at(system, C=0.3)


def free_joint_in_a_loop():
    b = mbs.SystemBuilder()
    for name in ("one", "two"):
        b.body(name, mass=1.0, inertia=0.1)
    b.joint("first", PIN, "ground", "one")
    b.joint("second", PIN, "one", "two")
    b.joint("loose", mbs.Free(), "ground", "two")
    return b.build(cut=["loose"])


def disk_laid_flat():
    """The touching point of a flat disk is undetermined: no assembly is found there."""
    b = mbs.SystemBuilder()
    b.body("disk", mass=1.0, inertia=0.1)
    b.joint("free", mbs.Free(), "ground", "disk")
    b.constraint("contact", mbs.joints.RollingDisk(0.3, axle="z"), between=("ground", "disk"))
    system = b.build()
    return mbs.State.at(system, free=np.array([0.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0]))


RAISING = [
    (cannot_be_assembled, mbs.AssemblyError, "cannot be assembled.*\n.*C"),
    (held_rates_contradict, mbs.AssemblyError, "given velocities contradict.*\n.*C"),
    (loop_that_never_closes, mbs.ModelError, "cannot be closed.*C"),
    (branch_without_inertia, mbs.ModelError, "needle moves no inertia"),
    (point_mass_spun_about_itself, mbs.ModelError, "spin moves no inertia"),
    (dependent_set_asked_for, mbs.ModelError, "driven"),
    (nothing_to_balance, mbs.SimulationError, "no equilibrium"),
    (state_of_a_cut_joint, mbs.AssemblyError, "C: "),
    (free_joint_in_a_loop, mbs.ModelError, "loose"),
    (disk_laid_flat, mbs.AssemblyError, "contact"),
]


@pytest.mark.long
def test_a_failed_motion_says_where():
    """The message names the joint that stands open and when; what was computed is kept."""
    with pytest.raises(mbs.SimulationError, match=r"last saved state at t = .*\bC\b") as caught:
        driven_past_its_reach()
    assert caught.value.motion is not None


@pytest.mark.slow
@pytest.mark.parametrize("situation, error, words", RAISING, ids=[s.__name__ for s, *_ in RAISING])
def test_situations_that_are_refused(situation, error, words):
    with pytest.raises(error, match=words):
        situation()


@pytest.mark.long
def test_a_locked_mechanism_rests():
    """A triangle of bars has no freedom: the motion is evaluated, its reactions are those of a truss."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("left", mass=1.0, com=(0.5, 0.0, 0.0), inertia=0.1)
    b.body("right", mass=1.0, com=(0.5, 0.0, 0.0), inertia=0.1)
    b.joint("A", PIN, "ground", "left")
    b.joint("B", PIN, "ground", "right", parent_frame=(1.0, 0.0, 0.0))
    b.joint("top", PIN, "left", "right", parent_frame=(1.0, 0.0, 0.0), child_frame=(1.0, 0.0, 0.0))
    system = b.build()
    assert system.topology.mobility == 0
    state = mbs.State.at(system, guess={"A": np.pi / 3, "B": 2 * np.pi / 3})
    motion = mbs.simulate(system, state, ts=jnp.array([0.0, 1.0]))
    assert motion.status is mbs.Status.SUCCESS
    np.testing.assert_allclose(motion.states.coordinates[-1], state.coordinates, atol=1e-12)
    loads = mbs.reactions(system, state)
    np.testing.assert_allclose(float(loads["A"].force[1] + loads["B"].force[1]), 2 * 9.81, rtol=1e-9)


@pytest.mark.long
def test_redundant_drives_that_agree_are_followed():
    """Both pins of a parallelogram driven alike: redundant, named, and the motion is theirs."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name, length in {"left": 0.5, "bar": 1.0, "right": 0.5}.items():
        b.body(name, mass=1.0, com=(length / 2, 0.0, 0.0), inertia=0.1)
    angle = mbs.forces.Polynomial([0.5, 2.0])
    b.joint("A", PIN, "ground", "left", drive=angle)
    b.joint("B", PIN, "left", "bar", parent_frame=(0.5, 0.0, 0.0))
    b.joint("D", PIN, "ground", "right", parent_frame=(1.0, 0.0, 0.0), drive=angle)
    b.joint("C", PIN, "bar", "right", parent_frame=(1.0, 0.0, 0.0), child_frame=(0.5, 0.0, 0.0))
    system = b.build()
    assert system.topology.analysis.redundant == 4  # three of the planar loop in space, one of the drives
    state = mbs.State.at(system, guess={"A": 0.5, "B": -0.5, "D": 0.5})
    motion = mbs.simulate(system, state, ts=jnp.linspace(0.0, 3.0, 13))  # through both flat poses
    np.testing.assert_allclose(motion.states.coordinates[:, 0], 0.5 + 2.0 * np.asarray(motion.ts), atol=1e-9)


@pytest.mark.long
def test_an_independent_set_that_turns_singular_is_not_believed():
    """The rocker stands still where it turns back: momenta of its angle end there, say so, and are right before."""
    system = four_bar(independent=["D"])
    state = four_bar_state(system, rate=6.0)
    options = {"t1": 1.5, "max_steps": 3000, "throw": False}
    motion = mbs.simulate(system, state, formulation="independent", **options)
    assert str(motion.status) == "maximum number of steps reached"
    crank = np.asarray(motion.states.coordinates)[:, 0]
    reached = np.isfinite(crank)
    assert 0.2 < np.mean(reached) < 0.8
    canonical = mbs.simulate(system, state, **options)
    assert bool(canonical.ok)
    np.testing.assert_allclose(crank[reached], np.asarray(canonical.states.coordinates)[reached, 0], atol=1e-6)
