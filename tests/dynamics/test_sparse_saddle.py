"""Reactions by the block-sparse solvers against the dense one: all kinds of systems, whole motions, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests import random_systems as rs
from tests.cases import models
from tests.flexible.beams import chain_of_beams, random_state
from tests.models import DOWN_Y, PIN, bennett, closed_chain, four_bar, four_bar_angles, four_bar_state
from tests.zoo import SPECIMENS


def planar_loop(**options):
    system = four_bar(load=5.0, stiffness=3.0, **options)
    _, B, D = four_bar_angles(0.7)
    if options.get("drive") is not None:
        return system, mbs.State.at(system, guess={"A": 0.7, "B": B, "D": D})
    return system, four_bar_state(system)


def slider_crank(drive=None):
    system = models.slider_crank(drive=drive, gas_force=-50.0)
    held = {} if drive else {"main": 0.6}
    guess = models.slider_crank_guess(0.6)
    return system, mbs.State.at(system, held, guess=guess, velocities={} if drive else {"main": 3.0})


def windows(n, rate=1.0):
    """All cranks in one line at rest in the build: a singular pose of the joints' rows, and redundant."""
    system = models.n_four_bar(n)
    return system, mbs.State.at(system, velocities={"A0": rate})


def flat_four_bar():
    """A parallelogram laid flat: two branches meet, the loop loses a rank beside its redundant rows."""
    system = four_bar((1.0, 0.5, 1.0, 0.5), load=5.0)
    return system, mbs.State.at(system, A=0.0, velocities={"A": 1.0}, guess={"B": 0.0, "D": 0.0})


def table(support):
    """On four feet, the centre of mass off the middle."""
    b = mbs.SystemBuilder()
    b.body("table", mass=10.0, com=(0.3, 0.1, 0.3), inertia=np.ones(3))
    if support == "plane":
        b.joint("floats", mbs.Free(), "ground", "table")
    for k, (x, y) in enumerate([(1.0, 0.5), (1.0, -0.5), (-1.0, 0.5), (-1.0, -0.5)]):
        foot = (x, y, 0.0)
        if support == "plane":
            b.constraint(f"foot_{k}", mbs.joints.PointOnPlane(), between=("ground", ("table", foot)))
        else:
            b.joint(f"foot_{k}", mbs.Spherical(), "ground", "table", parent_frame=foot, child_frame=foot)
    system = b.build()
    return system, mbs.State.at(system)


def two_motors():
    """On one shaft, one declared from the shaft to the ground."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("shaft", mass=2.0, com=(0.3, 0.0, 0.5), inertia=(0.02, 0.02, 0.01))
    b.joint("front", PIN, "shaft", "ground", drive=lambda t: 0.0 * t)
    b.joint("back", PIN, "ground", "shaft", parent_frame=(0.0, 0.0, 1.0), child_frame=(0.0, 0.0, 1.0))
    b.force("motor", mbs.Torque((0.0, 0.0, 1.0)), on="shaft")
    system = b.build()
    return system, mbs.State.at(system)


def geared_loop():
    """A four-bar whose outer pins are geared besides: a coupler that bends with the loop, and one drive less."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name in ("one", "two", "idler"):
        b.body(name, mass=1.0, com=(0.1, 0.0, 0.0), inertia=(0.2, 0.2, 0.3))
    b.joint("a", PIN, "ground", "one")
    b.joint("b", PIN, "one", "two", parent_frame=(0.5, 0.0, 0.0))
    b.joint("c", PIN, "ground", "idler", parent_frame=(1.0, 0.0, 0.0))
    b.constraint("gear", mbs.Coupler({"a": 1.0, "c": 2.0}))
    b.constraint("belt", mbs.Coupler({"b": 1.0, "c": 1.0}, function=lambda b, c: jnp.sin(b) + c))
    system = b.build()
    return system, mbs.State.at(system, a=0.4, velocities={"a": 1.0})


def massless_cross():
    """A chain whose middle bodies have no inertia of their own, closed at its end by a rod."""
    b = mbs.SystemBuilder()
    b.body("arm", 1.2, com=(0.2, 0.05, 0.0), inertia=(0.01, 0.02, 0.025))
    b.body("cross", 0.0)
    b.body("tool", 0.7, com=(0.3, 0.0, 0.02), inertia=(0.004, 0.03, 0.03))
    b.joint("root", mbs.Revolute("y"), "ground", "arm")
    b.joint("first", mbs.Revolute("y"), "arm", "cross", parent_frame=(0.4, 0.0, 0.0))
    b.joint("second", mbs.Revolute("z"), "cross", "tool")
    ends = (("ground", (0.8, 0.3, -0.5)), ("tool", (0.6, 0.0, 0.0)))
    b.constraint("rod", mbs.joints.Distance(0.9), between=ends)
    system = b.build()
    return system, mbs.State.at(system, root=0.2, velocities={"root": 0.5})


def closed_ring(n):
    """n links in a ring hung on two pins: one long loop, redundant out of its plane."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    angles = np.linspace(np.pi, 2 * np.pi, n + 1)
    points = n / np.pi * np.c_[np.cos(angles), np.sin(angles), np.zeros(n + 1)]
    for k in range(n):
        middle = 0.5 * (points[k + 1] - points[k])
        length = 2.0 * np.linalg.norm(middle)
        b.body(f"link_{k}", 1.0, com=tuple(middle), inertia=length**2 / 12 * np.ones(3), position=tuple(points[k]))
    for k in range(n + 1):
        parent, child = (f"link_{i}" if 0 <= i < n else "ground" for i in (k - 1, k))
        b.joint(f"pin_{k}", PIN, parent, child, at=tuple(points[k]))
    system = b.build()
    return system, mbs.State.at(system)


def random_loop(seed=3):
    """A random tree of all joints with two rods across it, in motion."""
    kinds = [
        mbs.Spherical(),
        mbs.Revolute((1.0, 0.2, -0.4)),
        mbs.Cylindrical("x"),
        mbs.Universal(),
        mbs.Prismatic("y"),
    ]
    links = rs.random_links(seed, kinds)
    tree = rs.build(links)
    state = rs.random_state(tree, seed)
    b = mbs.SystemBuilder(gravity=rs.GRAVITY)
    for k, link in enumerate(links):
        b.body(f"b{k}", mass=link.mass, com=link.com, inertia=link.inertia)
    for k, link in enumerate(links):
        parent = "ground" if link.parent < 0 else f"b{link.parent}"
        frames = {"parent_frame": rs.as_pose(link.parent_frame), "child_frame": rs.as_pose(link.child_frame)}
        b.joint(f"j{k}", link.kind, parent, f"b{k}", **frames)
    places = [np.asarray(mbs.position(tree, state, f"b{k}")) for k in range(len(links))]
    for k, (x, y) in enumerate([(0, 3), (1, 4)]):
        length = float(np.linalg.norm(places[x] - places[y]))
        b.constraint(f"rod_{k}", mbs.joints.Distance(length), between=(f"b{x}", f"b{y}"))
    return b.build(), state


def car_axis():
    system = models.car_axis()
    return system, mbs.State.at(
        system, guess={"left": jnp.array([0.0, 0.5, 0.0]), "right": jnp.array([1.0, 0.5, 0.0])}
    )


def rolling(make):
    system = make()
    return system, mbs.State.at(system, velocities={"plane": jnp.array([0.7, 0.0, 0.4])})


def bricard_with_arm():
    """A Bricard mechanism of six links that carries an arm of two."""
    b = closed_chain([(1.0, np.pi / 2 * (-1) ** k) for k in range(6)])
    for name, carrier in (("arm", "link_2"), ("hand", "arm")):
        b.body(name, mass=0.7, com=(0.2, 0.0, 0.1), inertia=(0.02, 0.03, 0.04))
        b.joint(f"{name} pin", mbs.Revolute(axis="y"), carrier, name, parent_frame=(0.4, 0.0, 0.0))
    system = b.build()
    rates = {"J0": 1.0, "arm pin": 0.5, "hand pin": -0.8}
    return system, mbs.State.at(system, {"arm pin": 0.3, "hand pin": -0.4}, velocities=rates)


SYSTEMS = {
    "four-bar in motion": lambda: planar_loop(),
    "drives that share": two_motors,
    "geared": geared_loop,
    "massless": massless_cross,
    "driven": lambda: planar_loop(drive=mbs.forces.Polynomial([0.7, 2.0, 1.5])),
    "singular pose": flat_four_bar,
    "random": random_loop,
    "beams": lambda: _with(chain_of_beams(2, PIN, gravity=DOWN_Y, drive=lambda t: t * t, elements=2)[0]),
    "springs and motor": lambda: (SPECIMENS["four_bar"].system, SPECIMENS["four_bar"].state),
    "spatial": lambda: (SPECIMENS["spatial_loop"].system, SPECIMENS["spatial_loop"].state),
    "open tree": lambda: (SPECIMENS["tree"].system, SPECIMENS["tree"].state),
    "Bennett": lambda: (lambda s: (s, mbs.State.at(s, J0=0.8, velocities={"J0": 1.0}, guess={"J1": 0.5})))(
        bennett().build()
    ),
    "Bricard with an arm": bricard_with_arm,
    "slider-crank": slider_crank,
    "slider-crank, driven": lambda: slider_crank(lambda t: 0.6 + 3.0 * t),
    "one window": lambda: windows(1),
    "five windows": lambda: windows(5, rate=0.0),
    "table on planes": lambda: table("plane"),
    "table on balls": lambda: table("ball"),
    "Gough platform": lambda: (lambda s: (s, mbs.State.at(s, guess={"platform": models.gough_pose()})))(
        models.gough_platform()
    ),
    "half car": lambda: (lambda s: (s, mbs.State.at(s, velocities={"heave": 0.3})))(models.half_car()),
    "car axis": car_axis,
    "knife edge": lambda: rolling(models.knife_edge_incline),
    "sleigh": lambda: rolling(models.chaplygin_sleigh),
    "ring of 12": lambda: closed_ring(12),
    "beams that fly": lambda: _with(chain_of_beams(3, mbs.Spherical(), gravity=DOWN_Y, elements=2)[0]),
}
ELASTIC = ("beams", "beams that fly")

#: Where the dense way itself has fewer digits: its residual there is 1e-7 of the load on the ring, ours 1e-14.
LOOSER = {"singular pose": 1e-8, "ring of 12": 1e-6}


def _with(system):
    return system, random_state(system, size=1e-3)


def assert_same(system, motion, rtol=1e-9, method="block-sparse", **options):
    """Wrenches, efforts and multipliers agree to `rtol` of the largest load; the marks are the same."""
    dense = mbs.reactions(system, motion, method="dense", **options)
    sparse = mbs.reactions(system, motion, method=method, **options)
    assert list(dense) == list(sparse)
    scale = max(float(jnp.max(jnp.abs(x), initial=0.0)) for x in jax.tree.leaves(dense))
    for one, other in zip(jax.tree.leaves(dense), jax.tree.leaves(sparse), strict=True):
        np.testing.assert_allclose(other, one, atol=rtol * scale)
    for name, load in dense.items():
        np.testing.assert_array_equal(load.unique_force, sparse[name].unique_force)
        np.testing.assert_array_equal(load.unique_moment, sparse[name].unique_moment)
    assert np.all(sparse.residual <= 1e-9 * scale)


def _cases():
    for name in SYSTEMS:
        for method in ("frontal", "multifrontal"):
            if method == "multifrontal" or name not in ELASTIC:
                yield name, method


@pytest.mark.long
@pytest.mark.parametrize("name, method", list(_cases()))
def test_as_the_dense_way(name, method):
    assert_same(*SYSTEMS[name](), rtol=LOOSER.get(name, 1e-9), method=method)


@pytest.mark.long
def test_methods_that_are_refused():
    with pytest.raises(ValueError, match="method must be one of 'auto', .*, got 'sparse'"):
        mbs.reactions(*planar_loop(), method="sparse")
    with pytest.raises(ValueError, match="'frontal' is for rigid bodies"):
        mbs.reactions(SPECIMENS["elastic"].system, SPECIMENS["elastic"].state, method="frontal")


def force_at_D(masses, state, system, method):
    """Squared size of a redundant reaction, for designs of other masses; states stay assembled."""
    load = mbs.reactions(four_bar(masses=masses, load=5.0, like=system), state, method=method)["D"]
    return jnp.sum(load.force**2) + jnp.sum(load.moment**2)


@pytest.mark.long
def test_gradients_and_batches_of_designs():
    system, state = planar_loop()
    masses = jnp.array([1.0, 2.0, 1.5])
    slopes = {}
    for method in ("dense", "multifrontal", "frontal"):
        value = jax.jit(lambda m, method=method: force_at_D(m, state, system, method))
        slopes[method] = jax.jit(jax.grad(value))(masses)
    np.testing.assert_allclose(slopes["frontal"], slopes["dense"], rtol=1e-9)
    np.testing.assert_allclose(slopes["multifrontal"], slopes["dense"], rtol=1e-9)
    step = 1e-4 * np.eye(3)
    central = [(value(masses + d) - value(masses - d)) / 2e-4 for d in step]
    np.testing.assert_allclose(slopes["frontal"], central, rtol=1e-6)
    designs = jnp.stack([masses, 2.0 * masses])
    together = jax.jit(jax.vmap(jax.grad(value)))(designs)
    np.testing.assert_allclose(together[0], slopes["dense"], rtol=1e-9)


@pytest.mark.long
def test_whole_motion():
    """Five states of a fall through the pose where all cranks are level with the couplers, and the bonds of each."""
    system, state = planar_loop()
    motion = mbs.simulate(system, state, ts=jnp.linspace(0.0, 0.2, 5))
    assert_same(system, motion)
    bonds, loads = mbs.reaction.reaction_bonds(system, motion, method="block-sparse")
    found = jax.vmap(mbs.statics.bond_reactions)(bonds, loads)
    reactions = mbs.reactions(system, motion, frame="joint")
    for k, name in enumerate(bonds.network.bonds):
        np.testing.assert_allclose(found.components[:, k, :3], reactions[name].force, atol=1e-7, err_msg=name)


@pytest.mark.long
def test_a_long_ring_is_in_balance():
    """A ring of 100 links: the dense inverse has no digits left there."""
    system, state = closed_ring(100)
    loads = mbs.reactions(system, state, method="block-sparse")
    assert loads.residual < 1e-7
    forces = np.stack([loads[f"pin_{k}"].force for k in range(101)])
    np.testing.assert_allclose(forces[::-1] * [1.0, -1.0, 1.0], forces, atol=1e-5)  # left and right are alike
    assert 300.0 < forces[0, 1] < 981.0 / 2.0  # the ring falls: its pins carry less than its weight
