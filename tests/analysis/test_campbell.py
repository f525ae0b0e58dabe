"""Campbell diagrams: whirl of an overhung disc (Stodola), a blade that stiffens, derivatives, critical speeds."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import jaxmbs as mbs
from jaxmbs import analysis, flexible, forces
from jaxmbs.forces import BeamSection
from tests.flexible.beams import beam_structure

BENDING, LENGTH, MASS, DIAMETRAL = 100.0, 0.5, 2.0, 0.02


def overhung_disc(polar=0.035, bending=BENDING, like=None):
    """A disc that turns freely at the end of a light shaft, which does not turn."""
    section = BeamSection(jnp.stack([1e7, jnp.inf, jnp.inf, 200.0, bending, bending]), 1e-6, [1e-6, 1e-6, 1e-6])
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.beam("shaft", section, [(0, 0, 0), (LENGTH, 0, 0)], 1)
    b.joint("clamp", mbs.Weld(), "ground", "shaft.0")
    b.body("disc", MASS, inertia=jnp.stack([polar, DIAMETRAL, DIAMETRAL]))
    b.joint("spin", mbs.Revolute("x"), "shaft.1", "disc")
    return b.build() if like is None else b.build(like=like)


def whirl_speeds(speed, polar=0.035, bending=BENDING):
    """Roots of `(k11 - m w^2)(k22 - I_d w^2 + I_p W w) - k12^2`: positive forward, negative backward."""
    k11, k12, k22 = 12 * bending / LENGTH**3, 6 * bending / LENGTH**2, 4 * bending / LENGTH
    product = np.polymul([-MASS, 0.0, k11], [-DIAMETRAL, polar * speed, k22])
    roots = np.roots(np.polysub(product, [k12**2]))
    return np.sort(roots.real[np.abs(roots.imag) < 1e-6])


@pytest.mark.long
def test_whirl_of_an_overhung_disc():
    system, speeds = overhung_disc(), np.linspace(0.0, 200.0, 9)
    found = analysis.campbell(system, speeds, "spin")
    assert np.all(found.ok)
    sense = np.asarray(found.whirl("shaft.1 y", "shaft.1 z"))
    for k, speed in enumerate(speeds[1:], 1):
        bends = np.abs(np.abs(sense[k]) - 1.0) < 1e-3  # axial and torsional modes do not whirl
        wanted = whirl_speeds(speed)
        assert bends.sum() == 4
        np.testing.assert_allclose(np.sort((sense[k] * found.roots[k].imag)[bends]), wanted, rtol=2e-4)
    np.testing.assert_allclose(found.damping_ratios, 0.0, atol=1e-6)
    lines = np.asarray(found.frequencies)
    forward = [m for m in range(lines.shape[1]) if np.allclose(sense[1:, m], 1.0, atol=1e-3)]
    assert len(forward) == 2 and np.all(np.diff(lines[:, forward], axis=0) > 0)
    critical = found.critical_speeds()[forward[0]]
    assert np.min(np.abs(whirl_speeds(float(critical)) - float(critical))) < 0.5


@pytest.mark.long
def test_derivative_by_the_shaft():
    system = overhung_disc()

    def first(bending):
        turning = overhung_disc(bending=bending, like=system)
        return jnp.sort(analysis.campbell(turning, [50.0, 100.0], "spin").roots[1].imag)[:2]

    slopes = jax.jit(jax.jacfwd(first))(jnp.array(BENDING))
    ends = [whirl_speeds(100.0, bending=BENDING + s * 0.1) for s in (1, -1)]
    ends = [np.sort(np.abs(e))[:2] for e in ends]
    np.testing.assert_allclose(slopes, (ends[0] - ends[1]) / 0.2, rtol=1e-3)


@pytest.mark.long
def test_blade_at_constant_speed_and_on_a_free_shaft():
    """Flap and lag at the speeds 2 and 6 (Wright et al. 1982); the shaft's momentum stays if nothing drives it."""
    section = {"young": 2.8e7, "area": 1.0, "density": 1.2, "shear_modulus": 1e7, "torsion": 1e-3}
    section |= {"inertia_y": 5e-4, "inertia_z": 5e-4, "reference": None}
    structure, unit = beam_structure(10.0, 8, **section), np.sqrt(1.2 * 10.0**4 / 1.4e4)
    frame = flexible.floating_frame(structure, ("0",), num_modes=4, stiffening=True)
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.elastic("blade", frame.body)
    b.joint("shaft", mbs.Revolute("z"), "ground", "blade.0")
    system = b.build()
    found = analysis.campbell(system, np.array([0.0, 2.0, 6.0]) / unit, "shaft")
    lines = np.sort(np.asarray(found.roots.imag) * unit, axis=1)[:, :2]
    np.testing.assert_allclose(lines[0], 3.5160, rtol=1e-3)
    np.testing.assert_allclose(lines[1:], [[3.6218, 4.1373], [4.2632, 7.3604]], rtol=0.01)
    free = analysis.campbell(system, np.array([2.0, 6.0]) / unit, "shaft", keep="momentum")
    steady = mbs.State.at(system, velocities={"shaft": 6.0 / unit})
    lin = mbs.linearise(system, mbs.equilibrium(system, steady, moving=["shaft"]).state)
    wanted = mbs.modes(lin, without=["shaft"]).roots.imag
    np.testing.assert_allclose(np.sort(free.roots[1].imag), np.sort(wanted)[4:], rtol=1e-8)


def test_faults_are_said():
    b = mbs.SystemBuilder()
    b.body("disc", 1.0, inertia=1.0)
    b.joint("spin", mbs.Revolute("x"), "ground", "disc")
    b.joint("ball", mbs.Spherical(), "disc", "other")
    b.body("other", 1.0, inertia=1.0)
    system = b.build()
    for spin, keep, message in (
        ("spn", "speed", "no joint 'spn'"), ("ball", "speed", "has 3 velocities"), ("spin", "pace", "keep = 'pace'"),
    ):  # fmt: skip
        with pytest.raises(mbs.ModelError, match=message):
            analysis.campbell(system, [1.0, 2.0], spin, keep=keep)
    for joint, message in ((mbs.Prismatic("x"), "'only' slides"), (mbs.Revolute("x"), "nothing is free")):
        b = mbs.SystemBuilder()
        b.body("disc", 1.0, inertia=1.0)
        b.joint("only", joint, "ground", "disc")
        with pytest.raises(mbs.ModelError, match=message):
            analysis.campbell(b.build(), [1.0, 2.0], "only")
    with pytest.raises(ValueError, match="at least two in order"):
        analysis.campbell(system, [2.0, 1.0], "spin")


def mass_on_a_turning_disc(axis):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("disc", 1.0, inertia=1.0)
    b.body("mass", 1.0, inertia=1.0)
    b.joint("spin", mbs.Revolute("z"), "ground", "disc")
    b.joint("out", mbs.Prismatic(axis), "disc", "mass")
    return b


@pytest.mark.long
def test_no_steady_motion_at_any_speed_is_an_error():
    """A mass that falls along the shaft."""
    with pytest.raises(mbs.SimulationError, match=r"no steady motion .* moving=\['spin'\]"):
        analysis.campbell(mass_on_a_turning_disc("z").build(), [1.0, 2.0], "spin")


@pytest.mark.long
def test_bristles_hold_a_mass_on_a_turning_disc():
    """They leave its place open within their force; at each the bristles are a spring beside the other one."""
    b, speeds, stiffness, bristles, damping = mass_on_a_turning_disc("x"), np.array([1.0, 2.0]), 100.0, 1e5, 1.0
    b.force("spring", mbs.SpringDamper(stiffness, free_length=0.5), joint="out")
    b.force("rub", forces.FrictionForce(mbs.friction.LuGre(1.0, bristles, damping)), joint="out")
    found = analysis.campbell(b.build(), speeds, "spin")
    root = -damping / 2 + 1j * np.sqrt(stiffness + bristles - speeds**2 - damping**2 / 4)
    np.testing.assert_allclose(found.roots[:, 0], root, rtol=1e-9)


def diagram(speeds, frequencies):
    """A diagram of given frequencies (S, m)."""
    roots, speeds = 1j * jnp.asarray(frequencies, complex), jnp.asarray(speeds, float)
    count = roots.shape[1]
    return analysis.CampbellDiagram(
        speeds, roots, jnp.ones((len(speeds), 1, count), complex), jnp.ones(len(speeds), bool), ("x",)
    )


def test_critical_speeds_from_above_and_from_below_at_speeds_and_twice():
    up, down = [0.5, 1.9, 3.6, 5.0], [3.0, 2.5, 2.0, 1.5]
    there_and_back = [2.0, 1.5, 3.5, 3.0]  # crosses between 1 and 2, 2 and 3, 3 and 4
    on_speed, touch, above = [2.0, 2.0, 2.0, 2.0], [2.0, 2.0, 4.0, 5.0], [2.0, 3.0, 4.0, 5.0]
    columns = np.array([up, down, there_and_back, on_speed, touch, above, [0.0, 0.0, 0.0, 0.0]]).T
    found = diagram([1.0, 2.0, 3.0, 4.0], columns)
    wanted = [2 + 0.1 / 0.7, 2 + 0.5 / 1.5, 1 + 1.0 / 1.5, 2.0, 2.0, np.nan, np.nan]
    np.testing.assert_allclose(found.critical_speeds(), wanted, rtol=1e-14)
    crossings = np.asarray(found.crossings())
    np.testing.assert_allclose(crossings[:, 2], [1 + 1.0 / 1.5, 2.5, 3 + 0.5 / 1.5], rtol=1e-14)
    assert np.isnan(crossings[1:, 3]).all() and np.isfinite(crossings[0, 3])
    np.testing.assert_allclose(found.critical_speeds(order=0.5)[:2], [1.0, 3.5])  # one at the first speed
    standing = diagram([0.0, 1.0, 2.0], np.array([[0.0, 0.5, 1.0], [0.0, 2.0, 1.0]]).T)
    np.testing.assert_allclose(standing.critical_speeds(), [np.nan, 1.5])  # no mode at rest


def test_all_crossings_of_smooth_curves_against_brentq():
    """Random polynomials as frequencies: as many crossings as SciPy finds, and their slope by the speeds' scale."""
    speeds, rng = np.linspace(0.5, 10.0, 4001), np.random.default_rng(0)
    for order in (1.0, 2.0, 7.0):
        curve = np.polynomial.Polynomial.fit([0, 3, 5, 7, 10.5], order * rng.uniform(0, 10.0, 5), 4)
        over = lambda s: curve(s) - order * s  # noqa: B023
        ends = [(a, b) for a, b in zip(speeds[:-1], speeds[1:], strict=True) if over(a) * over(b) < 0]
        wanted = [brentq(over, a, b) for a, b in ends]
        found = np.asarray(diagram(speeds, curve(speeds)[:, None]).crossings(order)[:, 0])
        np.testing.assert_allclose(found[np.isfinite(found)], wanted, rtol=1e-5)
    slope = jax.grad(lambda a: diagram([1.0, 5.0], jnp.array([[0.5], [2.5]]) * a + 1.0).critical_speeds()[0])(1.5)
    np.testing.assert_allclose(slope, 1.0 / (1.0 - 0.5 * 1.5) ** 2 * 0.5, rtol=1e-9)  # 1 / (1 - a / 2)


@pytest.mark.parametrize("keep", ["speed", "momentum"])
@pytest.mark.parametrize("what", ["spring", "gravity"])
def test_what_depends_on_the_angle_is_refused(keep, what):
    """A rotor with a spring to the ground, or with its centre of mass beside the axis under gravity."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81) if what == "gravity" else (0, 0, 0))
    b.body("bearing", mass=0.5, inertia=0.01)
    b.body("disc", mass=5.0, com=(0, 0.02 if what == "gravity" else 0, 0), inertia=(0.05, 0.03, 0.03))
    b.joint("float", mbs.Planar("x"), "ground", "bearing")
    b.joint("spin", mbs.Revolute("x"), "bearing", "disc")
    b.force("mount", mbs.Bushing([1e5] * 3 + [1e3] * 3), between=("ground", "bearing"))
    if what == "spring":
        spring = mbs.SpringDamper(2e4, free_length=0.1)
        b.force("spring", spring, between=(("ground", (0, 0.5, 0)), ("disc", (0, 0.1, 0))))
    with pytest.raises(mbs.ModelError, match="'spin' is not a cyclic coordinate: the stiffness depends on it"):
        mbs.analysis.campbell(b.build(), np.linspace(1.0, 100.0, 3), spin="spin", keep=keep)


@pytest.mark.slow
def test_a_blade_turns_at_a_pose_that_is_not_the_start():
    """Undeformed it is pulled outwards, which is no dependence on the angle of the spin; gravity across is one."""

    def blade(gravity):
        b = mbs.SystemBuilder(gravity=gravity)
        b.beam(
            "blade",
            mbs.forces.BeamSection([8.0, 4.0, 4.0, 2.0, 1.0, 1.0], 2.0, [0.5, 0.25, 0.25]),
            [(0, 0, 0), (1, 0, 0)],
            1,
        )
        b.joint("pin", mbs.Revolute("y"), "ground", "blade.0")
        return b.build()

    assert np.all(mbs.analysis.campbell(blade((0.0, 0.0, 0.0)), np.array([0.25, 0.5]), "pin").ok)
    with pytest.raises(mbs.ModelError, match="'pin' is not a cyclic coordinate"):
        mbs.analysis.campbell(blade((0.0, 0.0, -9.81)), np.array([0.25, 0.5]), "pin")
