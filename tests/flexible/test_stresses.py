"""Stresses over a motion: spinning and dropped rods, cantilevers, blades, fatigue of a link; closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import elements, fatigue, fem, flexible
from tests.flexible.beams import beam_structure

LENGTH, AREA, YOUNG, DENSITY, IY, IZ, OUTER = 1.0, 4e-4, 7e10, 2700.0, 1.2e-8, 1.5e-8, 0.01
FIBRES = [(OUTER, 0.0), (-OUTER, 0.0)]


def rod(count=3, interfaces=("0",), modes=2, **options):
    structure = beam_structure(LENGTH, count, fibres=FIBRES)
    return structure, flexible.floating_frame(structure, interfaces, modes, **options)


def machine(frame, joint, load=None, gravity=(0, 0, 0)):
    b = mbs.SystemBuilder(gravity=gravity)
    b.elastic("rod", frame.body)
    joint(b)
    if load is not None:
        b.force("load", mbs.Force(load), on=f"rod.{frame.body.interfaces[-1]}")
    return b.build()


def spinning(speed):
    return lambda b: b.joint("hub", mbs.Revolute("z"), "ground", "rod.0", drive=lambda t: speed * t)


def sliding(acceleration=0.0):
    return lambda b: b.joint("hub", mbs.Prismatic("y"), "ground", "rod.0", drive=lambda t: acceleration * t**2 / 2)


def falling(b):
    b.joint("hub", mbs.Prismatic("y"), "ground", "rod.0")


@pytest.mark.long
def test_spinning_rod():
    """Tension of the rest of the rod, `rho w^2 (L^2 - x^2) / 2`, at both ends of each of three elements."""
    structure, frame = rod()
    system = machine(frame, spinning(50.0))
    found = flexible.stresses(system, mbs.State.at(system), "rod", frame, structure)
    x = np.linspace(0.0, LENGTH, 4)
    exact = DENSITY * 50.0**2 * (LENGTH**2 - x**2) / 2
    ends = np.stack([exact[:-1], exact[:-1], exact[1:], exact[1:]], axis=1)
    np.testing.assert_allclose(found.components["beam"], ends, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(found.at_nodes(), exact, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(found.forces["beam"][:, 6], AREA * exact[1:], rtol=1e-9, atol=1e-8)


def test_envelope_of_given_values():
    """Two instants: extremes, times and peak; tensors of a shell have two points, of a solid one."""
    structure = beam_structure(LENGTH, 1, fibres=FIBRES)
    values = jnp.array([[[1.0, -2.0, 3.0, 0.0]], [[-4.0, 1.0, 2.0, 0.0]]])

    @jax.jit
    def everything(values):
        found = flexible.Stresses(structure, jnp.array([0.5, 0.75]), {"beam": values}, {})
        nodes, last = found.at_nodes("signed_von_mises"), found.measure("last_principal")["beam"]
        shell, solid = elements.Triangle(1.0, 0.3, 1.0), elements.Hexahedron(1.0, 0.3)
        tensors = shell.stress_tensors(jnp.arange(6.0)), solid.stress_tensors(jnp.arange(6.0))
        return found.tensors["beam"], found.envelope("signed_von_mises"), found.envelope().peak, nodes, last, tensors

    tensors, envelope, peak, nodes, last, others = everything(values)
    assert tensors.shape == (2, 1, 4, 6)
    np.testing.assert_array_equal(envelope.highest["beam"], [[1.0, 1.0, 3.0, 0.0]])
    np.testing.assert_array_equal(envelope.lowest["beam"], [[-4.0, -2.0, 2.0, 0.0]])
    np.testing.assert_array_equal(envelope.at_highest["beam"], [[0.5, 0.75, 0.5, 0.5]])
    np.testing.assert_array_equal(envelope.at_lowest["beam"], [[0.75, 0.5, 0.75, 0.5]])
    assert envelope.peak == 3.0 and peak == 4.0
    np.testing.assert_array_equal(last, np.minimum(values, 0.0))
    np.testing.assert_array_equal(nodes, [[-2.0, 3.0], [-4.0, 2.0]])
    np.testing.assert_array_equal(others[0], [[0, 1, 0, 2, 0, 0], [3, 4, 0, 5, 0, 0]])
    np.testing.assert_array_equal(others[1], [np.arange(6.0)])
    with pytest.raises(ValueError, match="no measure of stress 'mises'"):
        flexible.Stresses(structure, jnp.zeros(()), {}, {}).measure("mises")


@pytest.mark.long
def test_another_structure_is_refused():
    _, frame = rod(1)
    system = machine(frame, falling)
    with pytest.raises(mbs.ModelError, match="the structure is not that of the substructure, which has no 2 x"):
        flexible.stresses(system, mbs.State.at(system), "rod", frame, beam_structure(LENGTH, 2))


@pytest.mark.long
def test_dropped_and_pushed_beam():
    """Nothing is stressed in free fall; pushed, the clamp bears `m a L / 2`, and weight does what a push does."""
    structure, frame = rod()
    x = np.linspace(0.0, LENGTH, 4)
    bending = DENSITY * AREA * 30.0 * (LENGTH - x) ** 2 / 2 * OUTER / IZ
    cases = [(falling, -30.0, 0.0), (sliding(30.0), 0.0, -1.0), (sliding(), -30.0, -1.0)]
    for joint, gravity, sign in cases:
        system = machine(frame, joint, gravity=(0, gravity, 0))
        state = mbs.State.at(system)
        if sign:  # the vibration has died out
            state = mbs.equilibrium(system, state).state
        found = flexible.stresses(system, state, "rod", frame, structure).components["beam"]
        exact = -sign * np.stack([bending[:-1], -bending[:-1], bending[1:], -bending[1:]], axis=1)
        np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-7 * bending[0])


@pytest.mark.long
def test_cantilever_under_a_load_at_its_tip():
    structure, frame = rod(interfaces=("0", "3"))
    system = machine(frame, sliding(), load=(0, 5.0, 0))
    rest = mbs.equilibrium(system, mbs.State.at(system))
    found = flexible.stresses(system, rest.state, "rod", frame, structure)
    bending = 5.0 * (LENGTH - np.linspace(0.0, LENGTH, 4)) * OUTER / IZ
    np.testing.assert_allclose(found.at_nodes(), bending, rtol=1e-9, atol=1.0)
    np.testing.assert_allclose(found.components["beam"][:, 0], -bending[:-1], rtol=1e-9)


@pytest.mark.long
def test_tension_relieves_a_bent_blade():
    """The root's moment of one body with stiffening is that of twelve exact beams: 21.24 N m and not 30."""
    section = mbs.forces.BeamSection.of_material(YOUNG, 2.6e10, DENSITY, AREA, IY, IZ, shear=None)
    moments = []
    for exact in (True, False):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        structure, frame = rod(6, ("0", "6"), modes=4, stiffening=True)
        if exact:
            b.beam("rod", section, [(0, 0, 0), (LENGTH, 0, 0)], 12)
        else:
            b.elastic("rod", frame.body)
        b.joint("hub", mbs.Revolute("z"), "ground", "rod.0", drive=lambda t: 60.0 * t)
        b.force("tip", mbs.Force((0, 0, 30.0)), on="rod.12" if exact else "rod.6")
        system = b.build()
        rest = mbs.equilibrium(system, mbs.State.at(system))
        if exact:
            moments.append(-flexible.section_forces(system, rest.state, "rod")[0, 0, 4])
        else:
            moments.append(flexible.stresses(system, rest.state, "rod", frame, structure).forces["beam"][0, 4])
    np.testing.assert_allclose(moments[1], moments[0], rtol=3e-3)
    assert 15.0 < moments[1] < 22.0


def log_damage(depth, like=None):
    """Damage (log) of an arm of this depth that swings for a second; without `like` its system."""
    beam = elements.Beam(
        YOUNG, 2.6e10, 0.02 * depth, 0.02**3 * depth / 12, 0.02 * depth**3 / 12, 1e-8, density=DENSITY,
        fibres=jnp.stack([jnp.stack([0.5 * depth, 0.0 * depth])]), reference=(0.0, 1.0, 0.0),
    )  # fmt: skip
    x = np.linspace(0.0, LENGTH, 4)
    mesh = fem.Structure(np.stack([x, 0 * x, 0 * x], axis=1), {"arm": (beam, [(0, 1), (1, 2), (2, 3)])})
    frame = flexible.floating_frame(mesh, ("0",), num_modes=1, damping_ratio=0.05)
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body)
    b.joint("pin", mbs.Revolute("z"), "ground", "arm.0", drive=lambda t: 0.8 * jnp.sin(2 * jnp.pi * t))
    if like is None:
        return b.build()
    options = {"rtol": 1e-7, "atol": 1e-9, "gradient": "forward", "throw": False}
    system = b.build(like=like)
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 1.0, 41), **options)
    history = flexible.stresses(system, motion, "arm", frame, mesh).measure("signed_von_mises")["arm"][:, 0, 0]
    return jnp.log(fatigue.damage(history, fatigue.SN(1e24, 3.0)))


@pytest.fixture(scope="module")
def log_damage_of():
    """Damage (log) of an arm over its depth, compiled once, and the system."""
    system = log_damage(jnp.array(0.03))
    return mbs.jit(lambda depth: log_damage(depth, system), compile="quick"), system


@pytest.mark.long
def test_damage_of_a_link_over_its_duty_cycle(log_damage_of):
    """Derivative of the damage by the depth of an arm, as for a limit of life, against differences."""
    change, system = log_damage_of
    depth, h = jnp.array(0.03), 1e-5
    slope = mbs.jit(jax.jacfwd(lambda depth: log_damage(depth, system)), compile="quick")(depth)
    np.testing.assert_allclose(slope, (change(depth + h) - change(depth - h)) / (2 * h), rtol=1e-3)
    assert slope < -1.0


@pytest.mark.long
def test_life_of_a_link_as_a_limit(log_damage_of):
    """The thinnest arm whose life is that of one of 24 mm has 24 mm; the search starts from 35 mm."""
    change, system = log_damage_of
    allowed = float(change(jnp.array(0.024)))
    best = mbs.minimise(
        lambda design: (design["depth"], {"damage": log_damage(design["depth"], system)}),
        {"depth": jnp.array(0.035)},
        bounds={"depth": (0.015, 0.05)},
        limits=[mbs.Limit("damage (log)", "damage", upper=allowed)],
        gradient="forward",
        compile="quick",
        tolerance=1e-6,
        steps=20,
        progress=False,
    )
    assert best.ok and best.limit("damage (log)").active
    np.testing.assert_allclose(best.design["depth"], 0.024, rtol=1e-5)
