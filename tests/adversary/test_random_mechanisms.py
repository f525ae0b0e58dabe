"""Random trees and loops of all joints against the judge in absolute coordinates, and trees against Pinocchio."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate
from hypothesis import given, settings
from hypothesis import strategies as st

import jaxmbs as mbs

from . import judged, reference
from . import random_models as rm

QUICK = (0, 1, 2, 3)  # a topology of each shape but that of trees with joints doubled
DOUBLED = (4, 9, 14)
TREES = tuple(range(0, 50, 5))
SEEDS = st.integers(0, 2**30)
FEW = settings(max_examples=4, deadline=None, derandomize=True)
LANES = 8
SINGULAR = 1e-3  # least singular value of the rows below which a pose counts as singular, and nothing is asked
TOLERANCE = 1e-8


def check(draws, found, in_energy=False):
    """Every lane finite, closed and as the judge says; the worst errors.  With `in_energy` those of accelerations are
    measured by the mass matrix."""
    worst = dict.fromkeys(judged.ERRORS, 0.0)
    for k, draw in enumerate(draws):
        lane = judged.rows(found, k)
        gaps, truth = judged.errors(draw, lane, in_energy)
        if truth.conditioning < SINGULAR:
            continue
        assert truth.gap < 1e-9
        assert lane["ok"], f"lane {k} is closed, but its state counts as open by {lane['open']:.1e}"
        assert truth.mobility == judged.like(draw.top).topology.mobility
        np.testing.assert_array_equal(judged.marks(draw.top), truth.unique)
        for name, gap in gaps.items():
            assert gap < TOLERANCE, f"lane {k}: {name} differ by {gap:.1e}"
            worst[name] = max(worst[name], gap)
    return worst


def check_topology(seed, first, setting="plain", assembled=True):
    top = rm.topology(seed)
    draws, numbers = judged.drawn(top, first, LANES, setting)
    return check(draws, judged.compiled(top, assembled)(numbers))


@pytest.mark.parametrize("seed", [pytest.param(s, marks=pytest.mark.long) for s in QUICK])
@FEW
@given(first=SEEDS)
def test_accelerations_reactions_and_mobility(seed, first):
    """Also: which reactions are unique, closed states (of planar loops by assembly), small residuals."""
    check_topology(seed, first, assembled=seed == 1)


@pytest.mark.long
@pytest.mark.parametrize("seed", DOUBLED)
def test_joints_doubled(seed):
    """A tree with some joints doubled in line, like a door on two hinges, moves as if they were single."""
    check_topology(seed, 5)


@pytest.mark.long
@pytest.mark.parametrize("seed", [s for s in range(5, 25) if s % 5 != 4])
@FEW
@given(first=SEEDS, setting=st.sampled_from(["plain", "fast"]))
def test_more_topologies(seed, first, setting):
    check_topology(seed, first, setting)


SETTINGS = ("masses", "positions", "far")
WIDE = [(seed, setting) for seed in QUICK for setting in SETTINGS]


@pytest.mark.long
@pytest.mark.parametrize("seed, setting", WIDE)
def test_wide_numbers(seed, setting):
    """Masses over twelve decades, positions over six, and all of it 10 km from the origin: right, or not ok.

    Of the accelerations of light links before heavy ones, in trees, the energy is right and not every digit: rounding
    times the ratio of masses, as in every engine in joint coordinates.
    """
    draws, numbers = judged.drawn(rm.topology(seed), 5, LANES, setting)
    found = judged.compiled(rm.topology(seed))(numbers)
    good = [k for k in range(LANES) if found["ok"][k]]
    assert len(good) >= LANES - 1
    in_energy = (seed, setting) == (0, "masses")
    check([draws[k] for k in good], {name: value[np.array(good)] for name, value in found.items()}, in_energy)


def tree_gaps(seed, first, setting="plain", lanes=LANES):
    """Worst relative gaps to Pinocchio: of the mass matrix by its diagonal, of efforts by the size of their terms,
    and what the accelerations leave of the equations by the size of theirs."""
    top = rm.topology(seed)
    draws, numbers = judged.drawn(top, first, lanes, setting)
    numbers = numbers | {"law": np.zeros_like(numbers["law"])}
    n = judged.like(top).topology.num_velocities
    a = np.random.default_rng(first).normal(size=(lanes, n))
    found, worst = judged.tree_answers(top)(numbers, jnp.asarray(a)), np.zeros(3)
    for k, draw in enumerate(draws):
        lane, truth = judged.rows(found, k), judged.tree_truth(draw, a[k])
        M, size = truth["mass"], np.sqrt(np.diag(truth["mass"]))
        bias = truth["inverse"] - M @ a[k]
        left = M @ lane["forward"] + bias
        gaps = (
            np.abs(lane["mass"] - M) / np.outer(size, size),
            np.abs(lane["inverse"] - truth["inverse"]) / (np.abs(M) @ np.abs(a[k]) + np.abs(bias)),
            np.abs(left) / (np.abs(M) @ np.abs(lane["forward"]) + np.abs(bias)),
        )
        assert all(np.all(np.isfinite(g)) for g in gaps)
        worst = np.maximum(worst, [g.max(initial=0.0) for g in gaps])
    return worst


@pytest.mark.long
@pytest.mark.parametrize("seed", TREES)
@FEW
@given(first=SEEDS, setting=st.sampled_from(["plain", "fast"]))
def test_trees_against_pinocchio(seed, first, setting):
    assert np.all(tree_gaps(seed, first, setting) < 1e-9)


@pytest.mark.long
@pytest.mark.parametrize("seed, setting", [(seed, setting) for seed in TREES[:4] for setting in SETTINGS])
def test_trees_of_wide_numbers(seed, setting):
    assert np.all(tree_gaps(seed, 5, setting) < 1e-9)


# ------------------------------------------------------------------------------------------------------ motions
def judged_motion(draw, t1):
    """Joint rates at t1 by the judge's own integration of all bodies."""
    m, n = draw.mechanism, draw.top.bodies
    parts = (9 * n, 12 * n)

    def pose(y):
        R, c, twist = np.split(y, parts)
        R, c = R.reshape(n, 3, 3), c.reshape(n, 3)
        moved = dataclasses.replace(m, rotation=R, position=c - np.einsum("nij,nj->ni", R, m.com))
        return moved, twist.reshape(n, 6)

    def rate(_, y):
        moved, twist = pose(y)
        turning = reference.skew(twist[:, 3:]) @ moved.rotation
        return np.concatenate([turning.ravel(), twist[:, :3].ravel(), reference.answer(moved, twist).bodies.ravel()])

    start = np.concatenate([m.rotation.ravel(), m.centres.ravel(), draw.twist.ravel()])
    end = scipy.integrate.solve_ivp(rate, (0.0, t1), start, method="DOP853", rtol=1e-9, atol=1e-10).y[:, -1]
    return reference.joint_rates(*pose(end))


@pytest.mark.long
@pytest.mark.parametrize("seed", QUICK)
def test_motions(seed, t1=0.1, lanes=4):
    """A short motion ends at the rates that the judge integrates to, on the constraints, its energy accounted for."""
    top = rm.topology(seed)
    draws, numbers = judged.drawn(top, 77, lanes)
    like = judged.like(top)

    def run(numbers):
        system = rm.build(top, numbers, like)
        return mbs.simulate(system, rm.state(system, top, numbers), ts=jnp.array([t1]))

    motions = jax.jit(jax.vmap(run))(numbers)
    assert np.all(motions.ok) and np.all(np.isfinite(motions.states.velocities))
    d = motions.diagnostics
    assert np.max(d.constraint_drift) < 1e-10 and np.max(d.velocity_drift) < 1e-9
    assert np.max(np.abs(d.energy_residual) / (np.abs(d.kinetic) + np.abs(d.potential))) < 1e-6
    for k, draw in enumerate(draws):
        wanted = judged_motion(draw, t1)
        for j, u in enumerate(wanted):
            place = judged.columns(top, j)
            if place is not None:
                np.testing.assert_allclose(motions.states.velocities[k, 0, place], u, atol=1e-6, rtol=1e-6)


# ------------------------------------------------------------------------------------------- ten thousand mechanisms
LONG = tuple(s for s in range(100, 175) if s % 5 != 4)
PER_TOPOLOGY = 170


def test_there_are_sixty_topologies():
    found = {(top.bodies, top.joints) for top in map(rm.topology, LONG)}
    assert len(found) >= 60 and len(LONG) * PER_TOPOLOGY >= 10_000


@pytest.mark.long
@pytest.mark.parametrize("seed", LONG)
def test_ten_thousand_mechanisms(seed):
    """Lanes of `batch`: no NaN under success, small residuals, every lane as the judge says."""
    top = rm.topology(seed)
    draws, numbers = judged.drawn(top, 1000 * seed, PER_TOPOLOGY)
    found = mbs.batch(judged.answers_of(top), numbers, progress=False)
    finite = [np.all(np.isfinite(v).reshape(PER_TOPOLOGY, -1), axis=1) for v in found.values.values()]
    assert np.all(np.all(finite, axis=0) | ~found.ok)
    check(draws, found.values)
    jax.clear_caches()  # the programs of sixty topologies exhaust a process's memory maps
