"""Gradients of accelerations, reactions and energy at special places: zero angles, rates and springs of no length,
aligned links, dead centres, a bifurcation, and designs of a batch that cannot close.

What the library promises: right derivatives wherever the answer is smooth, NaN where a design cannot be assembled.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jaxmbs as mbs
from jaxmbs.math._rotation import rotation_matrix
from tests.models import four_bar

from .slopes import Slopes

SEEDS = st.integers(0, 2**30)
FEW = settings(max_examples=3, deadline=None, derandomize=True)

# ------------------------------------------------------------------------------------------------------ a four-bar
# numbers: lengths of ground, crank, coupler, rocker; masses; stiffness, load; angle and rate that are held.
# guesses of all angles: no parameters, they choose the branch.
REGULAR = np.array([1.0, 0.3, 0.9, 0.7, 1.0, 2.0, 1.5, 3.0, 2.0, 0.7, 2.0, 0.7, -0.4, 1.4])
COUNT = 11
LOADS = np.random.default_rng(1).normal(size=9)


def at(**changes):
    """The regular numbers with some of them changed."""
    places = {"lengths": slice(0, 4), "stiffness": 7, "load": 8, "angle": 9, "rate": 10, "guess": slice(11, 14)}
    found = REGULAR.copy()
    for name, value in changes.items():
        found[places[name]] = value
    return found


@functools.cache
def like():
    return four_bar()


def loop_values(p, held="A"):
    """Accelerations of A, B, D and reactions in the plane of A, C, D, with one joint's angle and rate held."""
    system = four_bar(tuple(p[:4]), tuple(p[4:7]), p[7], p[8], like=like())
    guess = {name: p[11 + k] for k, name in enumerate("ABD") if name != held}
    state = mbs.State.at(system, {held: p[9]}, velocities={held: p[10]}, guess=guess)
    loads = mbs.reactions(system, state)
    forces = [loads[name].force[:2] for name in "ACD"]
    return jnp.concatenate([mbs.forward_dynamics(system, state)[0], *forces])


@functools.cache
def loop_slopes(held):
    like()  # a concrete build: not while something is traced
    return Slopes(lambda p: jnp.dot(LOADS, loop_values(p, held)), COUNT)


# The rocker turns back where crank and coupler are in line; a crank of limited reach where coupler and rocker are.
TURNING = float(np.arccos((1.0 + 1.2**2 - 0.7**2) / (2.0 * 1.2)))
STOPPED = (1.0, 0.6, 0.5, 0.4)
STOP = float(np.arccos((1.0 + 0.6**2 - 0.9**2) / (2.0 * 0.6)))
ROCKER = float(np.pi - np.arccos((1.0 + 0.9**2 - 0.6**2) / (2.0 * 0.9)))  # of the line from D through C to B
PARALLEL = (1.0, 0.4, 1.0, 0.4)
BY_CRANK = {
    "regular": REGULAR,
    "zero rate": at(rate=0.0),
    "zero angle": at(angle=0.0, guess=(0.0, 0.8, 1.6)),
    "all zero": at(angle=0.0, rate=0.0, stiffness=0.0, load=0.0, guess=(0.0, 0.8, 1.6)),
    "crank and coupler in line": at(angle=TURNING, guess=(TURNING, 0.0, 1.9)),
    "parallelogram": at(lengths=PARALLEL, angle=0.5, guess=(0.5, -0.5, 0.5)),
    "half a turn": at(angle=np.pi, guess=(np.pi, -2.8, 2.5)),
}
BY_ROCKER = {
    "dead centre of the crank": at(lengths=STOPPED, angle=ROCKER, rate=0.5, guess=(STOP, ROCKER - np.pi - STOP, 0.0)),
    "at rest there": at(lengths=STOPPED, angle=ROCKER, rate=0.0, guess=(STOP, ROCKER - np.pi - STOP, 0.0)),
}


@pytest.mark.long
def test_loop_by_its_crank():
    loop_slopes("A").check(BY_CRANK)


@pytest.mark.long
def test_loop_at_a_dead_centre():
    """Held by its rocker, a crank at its dead centre is as smooth as elsewhere."""
    loop_slopes("D").check(BY_ROCKER)


@pytest.mark.long
@FEW
@given(seed=SEEDS)
def test_loops_drawn(seed):
    """Random lengths and masses at rest, and crank and coupler in line."""
    random = np.random.default_rng(seed)
    drawn = REGULAR * np.r_[random.uniform(0.95, 1.05, 4), random.uniform(0.2, 5.0, 5), np.ones(5)]
    ground, crank, coupler, rocker = drawn[:4]
    line = np.arccos((ground**2 + (crank + coupler) ** 2 - rocker**2) / (2 * ground * (crank + coupler)))
    still, aligned = drawn.copy(), drawn.copy()
    still[10], aligned[9], aligned[11:] = 0.0, line, (line, 0.0, 1.9)
    names = ("drawn", "at rest", "in line", *BY_CRANK)[: len(BY_CRANK)]
    places = dict(zip(names, (drawn, still, aligned, *BY_CRANK.values()), strict=False))
    loop_slopes("A").check(places)


@pytest.mark.long
def test_designs_that_cannot_close_in_a_batch():
    """Their gradients are NaN in every number, forward and reverse; the others are what they are alone."""
    slopes = loop_slopes("A")
    short = at(lengths=(1.0, 0.3, 0.2, 0.3), angle=2.5)
    rows = np.array([*BY_CRANK.values()])
    mixed = rows.copy()
    mixed[[1, 4]] = short
    alone, beside = ([np.asarray(g) for g in slopes.gradients(r)] for r in (rows, mixed))
    for a, b in zip(alone, beside, strict=True):
        assert np.all(np.isnan(b[[1, 4]]))
        np.testing.assert_array_equal(np.delete(a, [1, 4], axis=0), np.delete(b, [1, 4], axis=0))


@pytest.mark.long
def test_held_at_the_edge_of_reach():
    """A crank held at its dead centre: the rocker's angle has no derivative there.  Just inside it is large, and
    at the edge itself nothing finite may look like an answer of ordinary size."""
    slopes = loop_slopes("A")
    inside, edge = (at(lengths=STOPPED, angle=STOP - d, rate=0.0, guess=(STOP, -2.0, 2.4)) for d in (1e-2, 0.0))
    rows = np.array([inside, edge, *list(BY_CRANK.values())[:5]])
    reverse, _ = slopes.gradients(rows)
    ordinary = np.max(np.abs(reverse[0]))
    assert np.isfinite(ordinary)
    assert not np.all(np.isfinite(reverse[1])) or np.max(np.abs(reverse[1])) > 1e2 * ordinary


# ---------------------------------------------------------------------------------------------------------- a tree
# numbers: two masses, inertia, position (3), turn (3), axis (3) of the hinge; spring k, c, free length, preload and
# anchor (3); stop k, exponent, edge; friction; bushing (2); angle, rates (4)
TREE = np.array(
    [1, 2, 1.0, 0.1, -0.2, 0.3, 0.2, 0.1, -0.3, 0.1, 1.0, 0.2, 20, 0.5, 0.3, 0.4, 0.2, 0.1, 0.4]
    + [30, 2.5, 0.2, 0.5, 3.0, 50.0, 0.4, 0.5, -0.4, 0.8, 1.0]
)


def tree_places():
    zero = TREE.copy()
    zero[6:9], zero[9:12], zero[25:] = 0.0, (0.0, 0.0, 1.0), 0.0
    no_length = zero.copy()
    no_length[13:16], no_length[16:19] = 0.0, np.array([0.2, -0.4, 0.6]) - 2.0 * TREE[3:6]
    edge = TREE.copy()
    edge[21] = edge[25]
    return {"regular": TREE, "zero angle, turn and rates": zero, "spring of no length": no_length, "stop": edge}


def tree(p):
    """Accelerations, reactions and energy of a ball-jointed body on a hinged arm, weighted."""
    b, box = mbs.SystemBuilder(), jnp.array([0.1, 0.12, 0.15])
    b.body("arm", mass=p[0], com=(0.1, 0.05, -0.3), inertia=p[2] * box)
    b.body("bob", mass=p[1], com=(0.2, 0.1, 0.1), inertia=0.5 * p[2] * box)
    place = mbs.Pose(p[3:6], rotation_matrix(p[6:9]))
    b.joint("hinge", mbs.Revolute(axis=p[9:12]), "ground", "arm", parent_frame=place)
    b.joint("ball", mbs.Spherical(), "arm", "bob", parent_frame=mbs.Pose(p[3:6]))
    ends = (("ground", np.array([0.2, -0.4, 0.6])), ("bob", p[16:19]))
    b.force("spring", mbs.SpringDamper(*p[12:16]), between=ends)
    b.force("stop", mbs.BumpStop(p[19], upper=p[21], exponent=p[20]), joint="hinge")
    b.force("friction", mbs.forces.FrictionForce(mbs.friction.SmoothCoulomb(p[22], 1.2 * p[22], 0.1)), joint="hinge")
    b.force("bushing", mbs.Bushing((p[24], p[23])), between=("arm", "bob"))
    system = b.build()
    state = mbs.State(jnp.zeros(()), jnp.concatenate([p[25:26], jnp.array([1.0, 0, 0, 0])]), p[26:30])
    loads = mbs.reactions(system, state)
    parts = [mbs.forward_dynamics(system, state)[0]]
    parts += [part for name in ("hinge", "ball") for part in (loads[name].force, loads[name].moment)]
    energy = mbs.dynamics.kinetic_energy(system, state) + mbs.dynamics.potential_energy(system, state)
    return jnp.dot(np.random.default_rng(1).normal(size=16), jnp.concatenate(parts)) + 0.1 * energy


@functools.cache
def tree_slopes():
    return Slopes(tree, len(TREE))


@pytest.mark.long
def test_tree():
    """At the edge of the stop differences are one-sided: an exponent of 2.5 is smooth enough for small steps."""
    tree_slopes().check(tree_places(), tolerance=1e-5)


@pytest.mark.long
def test_second_derivatives_of_a_tree():
    """Along one direction, against differences of the gradient.  Damper, free length and preload stay: at a spring of
    no length their forces have no direction, and the slopes by them jump there."""
    places = np.array(list(tree_places().values()))[:3]
    d = np.random.default_rng(3).normal(size=len(TREE))
    d[13:16] = 0.0
    smooth = np.delete(np.arange(len(TREE)), [13, 14, 15])
    product = jax.jit(jax.vmap(lambda x: jax.jvp(jax.grad(tree), (x,), (jnp.asarray(d),))[1]))
    found, best = np.asarray(product(jnp.asarray(places))), np.inf
    gradient = lambda x: np.asarray(tree_slopes().reverse(jnp.asarray(np.vstack([x, TREE]))))[:3]
    for h in (1e-2, 1e-3, 1e-4):
        near, far = (gradient(places + s * h * d) - gradient(places - s * h * d) for s in (1, 2))
        best = np.minimum(best, np.max(np.abs((8 * near - far) / (12 * h) - found)[:, smooth], axis=1))
    assert np.all(best < 1e-6 * np.max(np.abs(found), axis=1))
