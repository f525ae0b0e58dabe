"""Equilibria followed from no load, of a suspension; thin beams from straight; verdicts and refusals."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_bvp

import jaxmbs as mbs
from jaxmbs.forces import BeamSection, Force
from jaxmbs.status import Status

POINTS = {
    "LF": (0.15, 0.35, 0.20),
    "LR": (-0.15, 0.35, 0.20),
    "LO": (0.0, 0.70, 0.19),
    "UF": (0.10, 0.42, 0.46),
    "UR": (-0.14, 0.42, 0.46),
    "UO": (-0.03, 0.66, 0.48),
    "TI": (-0.14, 0.36, 0.26),
    "TO": (-0.14, 0.68, 0.25),
    "W": (0.0, 0.75, 0.30),
    "ST": (0.0, 0.45, 0.62),
    "SF": (0.0, 0.60, 0.20),
}


def wishbone(load, like=None):
    """A double wishbone with a bump stop under a load of its road."""
    p = {name: np.array(point) for name, point in POINTS.items()}
    strut = float(np.linalg.norm(p["ST"] - p["SF"]))
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("lower", mass=5.0, com=(p["LF"] + p["LR"] + p["LO"]) / 3, inertia=0.05)
    b.body("upper", mass=3.0, com=(p["UF"] + p["UR"] + p["UO"]) / 3, inertia=0.03)
    b.body("upright", mass=40.0, com=p["W"], inertia=0.8)
    b.joint("lower pivot", mbs.Revolute("x"), "ground", "lower", at=(p["LF"] + p["LR"]) / 2)
    b.joint("lower ball", mbs.Spherical(), "lower", "upright", at=p["LO"])
    b.joint("upper pivot", mbs.Revolute("x"), "ground", "upper", at=(p["UF"] + p["UR"]) / 2)
    b.joint("upper ball", mbs.Spherical(), "upper", "upright", at=p["UO"])
    rod = mbs.joints.Distance(float(np.linalg.norm(p["TO"] - p["TI"])))
    b.constraint("tie rod", rod, between=(("ground", p["TI"]), ("upright", p["TO"])))
    b.frame("wheel", on="upright", position=p["W"])
    b.frame("foot", on="lower", position=p["SF"])
    ends = (("ground", p["ST"]), "foot")
    b.force("spring", mbs.SpringDamper(40e3, 2.5e3, free_length=strut + 0.11), between=ends)
    b.force("stop", mbs.BumpStop(2e7, lower=strut - 0.05), between=ends)
    b.force("road", Force(jnp.stack([0.0 * load, 0.0 * load, load])), on="wheel")
    return b.build(like=like)


def travel(system, state):
    return 1e3 * (mbs.position(system, state, "wheel")[2] - 0.3)


@pytest.mark.long
def test_a_wishbone_from_its_drawing():
    """Under 3 g, the rest that is also found by way of 1 g; without following an unstable one, which is said."""
    one, three = (wishbone(jnp.asarray(g * 400 * 9.81)) for g in (1, 3))
    by_way = mbs.equilibrium(three, mbs.equilibrium(one, mbs.State.at(one)).state)
    assert not bool(by_way.followed) and by_way.status == Status.SUCCESS
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = mbs.equilibrium(three, mbs.State.at(three))
    np.testing.assert_allclose(travel(three, found.state), travel(three, by_way.state), atol=1e-6)
    np.testing.assert_allclose(travel(three, found.state), 104.983, atol=1e-3)
    assert bool(found.ok & found.stable & found.followed) and found.status == Status.SUCCESS
    assert "following the loads" in found.reason and found.reason in " ".join(repr(found).split())
    with pytest.warns(UserWarning, match="unstable"):
        first = mbs.equilibrium(three, mbs.State.at(three), follow=False)
    assert bool(first.ok) and not bool(first.stable) and first.status == Status.UNSTABLE
    assert "UNSTABLE" in repr(first) and "UNSTABLE" in first._repr_html_()
    assert "UNSTABLE" in repr(mbs.reactions(three, first)) and "UNSTABLE" not in repr(mbs.reactions(three, found))
    np.testing.assert_array_equal(
        mbs.reactions(three, first)["lower ball"].force, mbs.reactions(three, first.state)["lower ball"].force
    )


@pytest.mark.long
def test_traces_follow_where_they_are_asked_to():
    """The same rest within a trace, its derivative by the load against differences; by default only the status."""
    first = wishbone(jnp.asarray(9e3))

    def rest(load, follow):
        system = wishbone(load, like=first)
        found = mbs.equilibrium(system, mbs.State.at(system), throw=False, follow=follow)
        return travel(system, found.state), found.result

    followed = mbs.jit(jax.vmap(jax.value_and_grad(lambda f: rest(f, True), has_aux=True)), compile="quick")
    loads = jnp.array([400 * 9.81, 1200 * 9.81, 1200 * 9.81 + 1.0, 1200 * 9.81 - 1.0])
    (found, code), slopes = followed(loads)
    assert np.all(code == Status.SUCCESS)
    np.testing.assert_allclose(found[1], 104.983, atol=1e-3)
    np.testing.assert_allclose(slopes[1], (found[2] - found[3]) / 2.0, rtol=1e-5)
    assert mbs.jit(lambda f: rest(f, None)[1], compile="quick")(loads[1]) == Status.UNSTABLE


def thin_cantilever(ratio, load, elements=8, like=None):
    """A beam of EI = 1 N m^2 and 1 m, clamped at its left end, EA L^2 / EI = ratio, a force at its right end."""
    section = BeamSection([ratio, np.inf, np.inf, 1.0, 1.0, 1.0], 1.0, [2e-3, 1e-3, 1e-3])
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.beam("rod", section, [(0, 0, 0), (1, 0, 0)], elements, (0, 1, 0))
    b.joint("clamp", mbs.Weld(), "ground", "rod.0", at=(0, 0, 0))
    b.force("load", Force(jnp.array([0.0, 0.0, -1.0]) * load), on=f"rod.{elements}")
    return b.build(like=like)


def elastica(load):
    """Tip (x, -z) of the inextensible cantilever, `theta'' = -P cos(theta)`, by SciPy."""
    s = np.linspace(0.0, 1.0, 101)
    ends = lambda a, b: np.array([a[0], b[1]])
    slope = lambda s, y: np.stack([y[1], -load * np.cos(y[0])])
    theta = solve_bvp(slope, ends, s, np.stack([np.sin(1.5 * s), 1.5 - s]), tol=1e-8, max_nodes=100_000).sol
    x, weight = np.polynomial.legendre.leggauss(60)
    angle = theta(0.5 * (x + 1.0))[0]
    return np.array([np.cos(angle) @ weight, np.sin(angle) @ weight]) / 2.0


@pytest.mark.long
@pytest.mark.parametrize("load", [3.2, 30.0])
def test_thin_beams_from_straight(load):
    """Up to EA L^2 / EI = 1e10 in the same few steps, at the tip of the elastica."""
    steps, tips = [], []
    for ratio in (1e4, 1e6, 1e8, 1e10):
        system = thin_cantilever(ratio, load)
        found = mbs.equilibrium(system, mbs.State.at(system))
        assert bool(found.stable) and found.status == Status.SUCCESS
        steps.append(int(found.steps))
        tips.append(mbs.position(system, found.state, "rod.8")[np.array([0, 2])])
    assert max(steps) <= 12
    np.testing.assert_allclose(np.abs(tips[-1]), elastica(load), atol=1e-4)  # eight elements
    np.testing.assert_allclose(tips[-1], tips[-2], atol=1e-6)


@pytest.mark.long
def test_a_steel_wire():
    """Of 2 mm and 1 m under 0.5 N at its end, more elements nearer to the elastica."""
    area, inertia = np.pi * 1e-6, np.pi / 4 * 1e-12
    section = BeamSection.of_material(2e11, 8e10, 7850.0, area, inertia, inertia)
    errors, exact = [], elastica(0.5 / (2e11 * inertia))
    for elements in (6, 12):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.beam("wire", section, [(0, 0, 0), (1, 0, 0)], elements, (0, 1, 0))
        b.joint("clamp", mbs.Weld(), "ground", "wire.0", at=(0, 0, 0))
        b.force("load", Force((0, 0, -0.5)), on=f"wire.{elements}")
        system = b.build()
        found = mbs.equilibrium(system, mbs.State.at(system))
        assert int(found.steps) <= 60 and bool(found.stable)
        x, _, z = mbs.position(system, found.state, f"wire.{elements}")
        errors.append(np.max(np.abs(np.array([x, -z]) - exact)))
    assert errors[1] < 0.4 * errors[0] < 4e-3


@pytest.mark.long
def test_derivatives_of_a_thin_beam():
    """Of the tip by the load, at EA L^2 / EI = 1e8, forward and reverse, against differences."""
    first = thin_cantilever(1e8, 3.2)

    def tip(load):
        system = thin_cantilever(1e8, load, like=first)
        found = mbs.equilibrium(system, mbs.State.at(first), throw=False)
        return mbs.position(system, found.state, "rod.8")[2]

    value, forward, reverse = (mbs.jit(f, compile="quick") for f in (tip, jax.jacfwd(tip), jax.grad(tip)))
    difference = (value(3.2 + 1e-4) - value(3.2 - 1e-4)) / 2e-4
    np.testing.assert_allclose([forward(3.2), reverse(3.2)], difference, rtol=1e-5)


def pendulum(angle, stiffness=0.0):
    b = mbs.SystemBuilder()
    b.body("bob", mass=2.0, com=(0.0, 0.0, -0.8), inertia=0.001)
    b.joint("swing", mbs.Revolute("y"), "ground", "bob")
    b.force("spring", mbs.SpringDamper(stiffness=stiffness, free_length=0.0), joint="swing")
    system = b.build()
    return system, mbs.State.at(system, swing=angle)


@pytest.mark.slow
@pytest.mark.parametrize("angle", [np.pi, np.pi - 0.3])
def test_a_pendulum_that_stands_is_said_to_be_unstable(angle):
    system, state = pendulum(angle)
    with pytest.warns(UserWarning, match="unstable") as told:
        found = mbs.equilibrium(system, state)
    assert len(told) == 1 and bool(found.ok) and found.status == Status.UNSTABLE
    np.testing.assert_allclose(found.state.coordinates, np.pi, atol=1e-9)
    assert "UNSTABLE" in repr(found)


@pytest.mark.slow
def test_a_motion_without_stiffness_is_not_unstable():
    """A cart on a level track: neither stable nor unstable, no warning."""
    b = mbs.SystemBuilder()
    b.body("cart", mass=1.0, inertia=0.1)
    b.joint("track", mbs.Prismatic("x"), "ground", "cart")
    system = b.build()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = mbs.equilibrium(system, mbs.State.at(system, track=0.3))
    assert bool(found.ok) and not bool(found.stable) and found.status == Status.SUCCESS
    assert "indifferent" in repr(found)


@pytest.mark.long
def test_what_nothing_holds_is_named():
    b = mbs.SystemBuilder()
    b.body("table", mass=1.0, inertia=0.1)
    b.joint("column", mbs.Prismatic("z"), "ground", "table")
    b.force("leg", mbs.SpringDamper(1e3), joint="column")
    b.body("stone", mass=1.0, inertia=0.1)
    b.joint("fall", mbs.Prismatic("z"), "table", "stone")
    system = b.build()
    with pytest.raises(mbs.SimulationError, match="nothing holds 'fall' against the loads"):
        mbs.equilibrium(system, mbs.State.at(system))
    found = mbs.equilibrium(system, mbs.State.at(system), throw=False)
    assert found.status == Status.NO_EQUILIBRIUM and str(Status.NO_EQUILIBRIUM) in repr(found)
    assert np.isnan(found.stiffness).all() and not bool(found.is_unstable)


@pytest.mark.slow
def test_a_batch_of_equilibria_has_their_statuses():
    system, _ = pendulum(0.0)
    rests = mbs.batch(
        lambda angle: mbs.equilibrium(system, mbs.State.at(system, swing=angle), throw=False),
        np.array([0.3, 3.1]),
        progress=False,
        compile="quick",
    )
    assert list(rests.status) == [Status.SUCCESS, Status.UNSTABLE]
    np.testing.assert_allclose(rests.values.state.coordinates[:, 0], [0.0, np.pi], atol=1e-9)
