"""Beams of the builder: nodes, masses and rest, the elastica's closed form, derivatives, faults."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.builder._beams import _shares, _tangents
from jaxmbs.forces import BeamSection, Force, Torque
from jaxmbs.joints import Revolute, Weld
from jaxmbs.kinematics._poses import coordinate_rate, normalise, step_coordinates

SECTION = BeamSection([1e6, 1e6, 1e6, 1.0, 1.0, 1.0], 1.0, [2e-3, 1e-3, 1e-3])
ENDS = [(0, 0, 0), (1, 0, 0)]


def cantilever(section=SECTION, points=ENDS, elements=4, law=None, reference=(0, 1, 0)):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.beam("rod", section, points, elements, reference)
    b.joint("clamp", Weld(), "ground", "rod.0", at=points[0])
    b.force("load", law or Torque((0, 0, 0)), on=f"rod.{elements}")
    return b


def test_masses_of_the_nodes():
    """Sums of polynomials of third degree are exact: mass, first and second moment of a uniform beam."""
    nodes = np.linspace(0.0, 1.0, 6)
    shares = np.asarray(_shares(jnp.full(5, 0.2), jnp.ones(5)))
    np.testing.assert_allclose([shares @ nodes**k for k in range(3)], [1.0, 1 / 2, 1 / 3], rtol=1e-12)
    np.testing.assert_allclose(_shares(jnp.ones(1), jnp.ones(1)), [0.5, 0.5])
    heavy = np.asarray(_shares(jnp.ones(3), jnp.array([0.1, 10.0, 1.0])))
    np.testing.assert_allclose(heavy, [0.05, 5.05, 5.5, 0.5])


def test_tangents_of_a_circle_are_exact():
    angles = np.array([0.0, 0.2, 0.5, 0.6, 1.1])
    arc = np.stack([np.sin(angles), 1 - np.cos(angles), 0 * angles], 1)
    exact = np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1)
    np.testing.assert_allclose(jax.jit(_tangents)(jnp.array(arc)), exact, atol=1e-14)


@pytest.mark.long
def test_declared_parts():
    b = cantilever()
    names = [f"rod.{k}" for k in range(5)]
    assert list(b.declared.bodies) == names and list(b.declared.joints) == [*names[1:], "clamp"]
    assert sum(float(body.mass) for body in b.declared.bodies.values()) == pytest.approx(1.0)
    law = b.declared.forces["rod.2"].law
    np.testing.assert_allclose(law.screw, [0.25, 0, 0, 0, 0, 0], atol=1e-15)


@pytest.mark.long
def test_steps_and_rates_of_more_elements_have_no_more_equations():
    counts = []
    for elements in (4, 8):
        top = cantilever(elements=elements).build().topology
        psi, u = jnp.ones(top.num_coordinates), jnp.ones(top.num_velocities)
        maps = (lambda x, v, top=top: step_coordinates(top, x, v)), (lambda x, v, top=top: coordinate_rate(top, x, v))
        counts.append([len(jax.make_jaxpr(f)(psi, u).eqns) for f in (*maps, lambda x, v, top=top: normalise(top, x))])
    assert counts[0] == counts[1]


@pytest.mark.long
def test_roll_up_by_an_end_moment():
    """Case B5: an end moment of 2 pi E I / L, in steps, closes a circle: exact with six elements."""
    state = None
    for angle in np.linspace(0.0, 2 * np.pi, 13)[1:]:
        system = cantilever(elements=6, law=Torque((0, 0, angle))).build()
        state = mbs.equilibrium(system, mbs.State.at(system) if state is None else state).state
        exact = np.array([np.sin(angle), 1 - np.cos(angle), 0]) / angle
        np.testing.assert_allclose(mbs.position(system, state, "rod.6"), exact, atol=1e-7)


@pytest.mark.long
def test_spin_up_of_wu_and_haug():
    """Case B2: lag of the tip of an 8 m beam whose root turns faster and faster, largest 0.531858 m at 6.762 s."""
    length, EI, EA, mass, rate, end = 8.0, 566.0, 5.03e6, 0.201, 4.0, 15.0
    spins = mass * EI / EA * np.array([2.0, 1.0, 1.0])
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.beam("blade", BeamSection([EA, np.inf, np.inf, EI, EI, EI], mass, spins), [(0, 0, 0), (length, 0, 0)], 8)

    def angle(t):
        return rate / end * (t**2 / 2 + (end / (2 * np.pi)) ** 2 * (jnp.cos(2 * np.pi * t / end) - 1))

    b.joint("hub", Revolute("z"), "ground", "blade.0", drive=angle)
    system = b.build()
    times = np.array([0.0, 2.5, 5.0, 6.762467480147605])
    solver = mbs.ode.Rodas5P()
    motion = mbs.simulate(system, mbs.State.at(system), ts=times, solver=solver, rtol=1e-5, atol=1e-5)
    x, y, _ = np.asarray(jax.vmap(lambda state: mbs.position(system, state, "blade.8"))(motion.states)).T
    turn = np.asarray(angle(times))
    lag = np.cos(turn) * y - np.sin(turn) * x
    np.testing.assert_allclose(lag[1:3], [-0.1424087403337814, -0.4212096203824868], rtol=1e-3)
    np.testing.assert_allclose(lag[3], -0.5318576550977835, rtol=1e-3)


@pytest.mark.long
def test_elastica_under_an_end_force_and_its_derivatives():
    """Case B5, P = 10: the deflection and, by its scaling, the derivatives by length and bending stiffness."""
    system = cantilever(elements=8, law=Force((0, 10.0, 0))).build()

    def tip(length, bending, state=None, throw=True):
        section = BeamSection(jnp.stack([1e6, 1e6, 1e6, 1.0, bending, bending]), 1.0, [2e-3, 1e-3, 1e-3])
        ends = jnp.stack([jnp.zeros(3), jnp.stack([length, 0.0, 0.0])])
        again = cantilever(section, ends, 8, Force((0, 10.0, 0))).build(like=system)
        rest = mbs.equilibrium(again, mbs.State.at(again) if state is None else state, throw=throw)
        return mbs.position(again, rest.state, "rod.8"), rest.state

    place, state = tip(jnp.array(1.0), jnp.array(1.0))
    np.testing.assert_allclose(place, [1 - 0.5549955977537513, 0.8106090248802966, 0], atol=4e-5)
    slopes = jax.jit(jax.jacfwd(lambda l, e: tip(l, e, state)[0], (0, 1)))(jnp.array(1.0), jnp.array(1.0))
    h = 1e-4
    for k, slope in enumerate(slopes):
        ends = [tip(*(jnp.array(1.0 + s * h * (j == k)) for j in range(2)), state)[0] for s in (1, -1)]
        np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2 * h), rtol=1e-5, atol=1e-5)


@pytest.mark.long
def test_bend_of_45_degrees():
    """Case B4: the rod's converged digits, and the published -23.5, -13.4, 53.4 as far as these."""
    section = BeamSection([1e7, 5e6, 5e6, *[833333.3333333334] * 3], 1.0, [0.2, 0.1, 0.1])
    angles = np.linspace(0.0, np.pi / 4, 9)
    arc = 100 * np.stack([np.sin(angles), 1 - np.cos(angles), 0 * angles], 1)
    exact = {
        300: [-11.931555629252891, -7.044540936040271, 40.19189167049146],
        600: [-23.56023955440891, -13.604521345514812, 53.474858796238884],
    }
    for load, expected in exact.items():
        system = cantilever(section, arc, 8, Force((0, 0, load)), (0, 0, 1)).build()
        rest = mbs.equilibrium(system, mbs.State.at(system))
        moved = np.asarray(mbs.position(system, rest.state, "rod.8")) - arc[-1]
        np.testing.assert_allclose(moved, expected, atol=0.01)
    np.testing.assert_allclose(moved, [-23.5, -13.4, 53.4], atol=0.22)


FAULTS = {
    "section must be a BeamSection": {"section": 3.0},
    "stiffness must be symmetric and positive": {"section": BeamSection([-1.0, 1, 1, 1, 1, 1], 1.0, [1, 1, 1])},
    "2 sections, but 4 elements": {"section": [SECTION, SECTION]},
    "vectors of three numbers": {"points": [(0, 0), (1, 0)]},
    "at one place": {"points": [(0, 0, 0), (0, 0, 0)]},
    "elements is a whole number": {"elements": 2.5},
    "one element": {"elements": 0},
    "leave elements out": {"points": [(0, 0, 0), (1, 0, 0), (2, 0, 0)]},
    "lies along the line": {"reference": (1, 0, 0)},
    "bends by more than 1.6 rad": {"points": [(0, 0, 0), (1, 0, 0), (0.9, 0.1, 0), (-1, 0, 0), (0, 0, 0)]},
}


@pytest.mark.parametrize("message", FAULTS)
def test_faults_are_reported_by_name(message):
    b = mbs.SystemBuilder()
    arguments = {"section": SECTION, "points": ENDS, "elements": 4} | FAULTS[message]
    b.beam("rod", **arguments)
    with pytest.raises(mbs.ModelError, match=message) as caught:
        b.build()
    assert "beam 'rod'" in str(caught.value)


@pytest.mark.long
def test_energy_and_derivatives_of_a_swinging_beam():
    """A soft beam falls about a pin: energy drifts by no more than the tolerance asks and less with a finer one, and
    the place of its end has derivatives by EA and EI that differences confirm."""

    def pinned(EA, EI, like=None):
        b = mbs.SystemBuilder()
        section = BeamSection(jnp.stack([EA, EA, EA, EI, EI, EI]), 1.0, [2e-2, 1e-2, 1e-2])
        b.beam("rod", section, ENDS, 2)
        b.joint("pin", Revolute("y"), "ground", "rod.0")
        return b.build() if like is None else b.build(like=like)

    base = jnp.array([2e3, 3.0])
    system, ts, solver = pinned(*base), np.array([0.0, 0.15, 0.3]), mbs.ode.Rodas5P()

    def motion(sections, tolerance):
        again = pinned(*sections, like=system)
        options = {"solver": solver, "rtol": tolerance, "atol": tolerance, "gradient": "forward"}
        return again, mbs.simulate(again, mbs.State.at(again), ts=ts, throw=False, **options)

    @jax.jit
    def tip(sections):
        again, moved = motion(sections, 1e-9)
        return mbs.position(again, jax.tree.map(lambda x: x[-1], moved.states), "rod.2")

    drift = jax.jit(lambda tolerance: jnp.max(jnp.abs(motion(base, tolerance)[1].diagnostics.energy_residual)))
    coarse, fine = float(drift(jnp.array(1e-4))), float(drift(jnp.array(1e-7)))
    assert coarse < 1e-2 and fine < 1e-5 and fine < coarse / 30
    slopes = jax.jit(jax.jacfwd(tip))(base)
    for k, size in enumerate((1.0, 1e-3)):
        step = size * jnp.eye(2)[k]
        np.testing.assert_allclose(
            slopes[:, k], (tip(base + step) - tip(base - step)) / (2 * size), atol=1e-7, rtol=1e-3
        )
