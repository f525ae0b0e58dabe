"""Elastic bodies in motion against the literature, other programs and rigid links with springs.

Numbers "Exudyn" are of its version 1.13.6 with ANCF cables, extrapolated in elements and steps; numbers of a "single
body" are of beam polynomials in the frame of the first end (SciPy, DOP853), written for this comparison.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.flexible import displacements
from tests.flexible.beams import chain_of_beams, elastic_beam

PIN = mbs.Revolute(axis="z")


def quintic(angle, start, duration):
    """A turn from rest to rest."""

    def law(t):
        x = jnp.clip((t - start) / duration, 0.0, 1.0)
        return angle * (10 * x**3 - 15 * x**4 + 6 * x**5)

    return law


# ------------------------------------------------------------------------------------- a round beam on two axes
ROUND = 7.85398163e-9
ROUND_BEAM = {"young": 7e10, "shear_modulus": 7e10 / 2.6, "area": 3.14159265e-4, "density": 2700.0, "reference": None}
ROUND_BEAM |= {"inertia_y": ROUND, "inertia_z": ROUND, "torsion": 2 * ROUND}
TURN_INNER, TURN_OUTER = quintic(1.5, 0.0, 0.4), quintic(-1.0, 0.1, 0.4)
TIMES = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
SINGLE = np.array(  # uy, uz [m] of the tip, Fy, Fz [N], My, Mz [N m] at the base
    [
        [-3.743545e-02, 0.0, 75.9367, 0.0, 0.0, 65.0550],
        [-7.541438e-03, -1.155074e-02, 14.8557, 22.4629, -19.5666, 12.8147],
        [3.580821e-02, 2.034636e-02, -72.4601, -41.6861, 35.4789, -62.2480],
        [4.841859e-04, 7.415578e-03, -0.9148, -14.6219, 12.8890, -0.8325],
        [4.526271e-03, -2.894207e-03, -8.7946, 5.6175, -5.0112, -7.8372],
    ]
)
EXUDYN = np.array(  # uy, uz
    [
        [-3.7220219e-02, 0.0],
        [-7.9947309e-03, -1.0875149e-02],
        [3.5162988e-02, 1.8897616e-02],
        [2.4887538e-03, 7.0806938e-03],
        [4.7861035e-03, -1.4673842e-03],
    ]
)


def turned_beam(parts, **options):
    """Deflections (times, 2) of the tip in base axes; the system and its motion."""
    frame = elastic_beam(1.0 / parts, **options, **ROUND_BEAM)
    first, last = frame.body.interfaces
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for name in ("yoke", "base"):
        b.body(name, mass=0.0)
    b.joint("outer", mbs.Revolute("y"), "ground", "yoke", drive=TURN_OUTER)
    b.joint("inner", mbs.Revolute("z"), "yoke", "base", drive=TURN_INNER)
    end = "base"
    for k in range(parts):
        b.elastic(f"part{k}", frame.body)
        b.joint(f"weld{k}", mbs.Weld(), end, f"part{k}.{first}")
        end = f"part{k}.{last}"
    b.body("tip", mass=0.5)
    b.joint("tip", mbs.Weld(), end, "tip")
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system), ts=TIMES, rtol=1e-8, atol=1e-9)
    R = jax.vmap(lambda s: mbs.rotation(system, s, "base"))(motion.states)
    x = jax.vmap(lambda s: mbs.position(system, s, "tip"))(motion.states)
    return np.einsum("tji,tj->ti", R, x)[:, 1:], system, motion


@pytest.mark.long
def test_one_body_turned_about_two_axes():
    deflection, system, motion = turned_beam(1, elements=8, num_modes=4)
    base = mbs.reactions(system, motion, frame="joint")["weld0"]
    loads = np.concatenate([base.force[:, 1:], base.moment[:, 1:]], axis=1)
    np.testing.assert_allclose(deflection, SINGLE[:, :2], atol=5e-4 * 0.0374)
    np.testing.assert_allclose(loads, SINGLE[:, 2:], atol=1e-3 * 75.9)


@pytest.mark.long
def test_a_body_cut_in_two_is_nearer_to_large_deformation():
    """Stiffening by rotation enters between bodies: the error of one body, 2.0e-3, falls with the square of their
    number (four bodies: 1.4e-4)."""
    deflection, *_ = turned_beam(2, elements=4, num_modes=2)
    error, single = (np.abs(u - EXUDYN).max() for u in (deflection, SINGLE[:, :2]))
    assert single > 1.8e-3
    assert error < 0.3 * single


# ---------------------------------------------------------------------------------------------- fast rotation
WHIP = {"length": 10.0, "young": 2.8e7, "area": 1.0, "density": 1.2, "shear_modulus": 1e7, "torsion": 1e-3}
WHIP |= {"inertia_y": 5e-4, "inertia_z": 5e-4, "reference": None}
UNIT = np.sqrt(1.2 * 10.0**4 / 1.4e4)  # makes angular frequencies dimensionless


def spin_up(t):
    """To 6 rad/s in 15 s."""
    ripple = (15.0 / (2 * jnp.pi)) ** 2 * (jnp.cos(2 * jnp.pi * t / 15.0) - 1.0)
    return jnp.where(t < 15.0, 0.4 * (0.5 * t**2 + ripple), 6.0 * t - 45.0)


@pytest.mark.long
def test_spin_up_of_a_beam():
    """The manoeuvre of Kane, Ryan and Banerjee (1987), with the beam of Simo and Vu-Quoc (1986); Exudyn's numbers.

    Four bodies: 0.3 % at 4 s, to fall with the square of their number (benchmarks/elastic_bodies.py has eight).
    """
    system, frame = chain_of_beams(4, PIN, motion=mbs.Planar("z"), drive=spin_up, elements=2, num_modes=1, **WHIP)
    motion = mbs.simulate(system, mbs.State.at(system), ts=jnp.array([2.0, 4.0]), rtol=1e-6, atol=1e-7)
    tip = jax.vmap(lambda s: mbs.position(system, s, f"part3.{frame.body.interfaces[1]}"))(motion.states)
    angle = spin_up(motion.ts)
    lag = -tip[:, 0] * jnp.sin(angle) + tip[:, 1] * jnp.cos(angle)
    np.testing.assert_allclose(lag[0], -0.10237244, rtol=1e-4)
    np.testing.assert_allclose(lag[1], -0.34225384, rtol=4e-3)


@pytest.mark.long
def test_flapping_of_a_rotating_beam():
    """First chordwise and flapwise frequency at the dimensionless speeds 2 and 6 of a beam cut in four.

    Wright et al., J. Appl. Mech. 49 (1982) 197-202.  With eight bodies the errors at the speed 6 are 4 % and 1.2 %;
    of one body, which does not stiffen, the frequencies are sqrt(3.5160^2 - speed^2) and 3.5160.
    """
    system, _ = chain_of_beams(4, PIN, elements=4, num_modes=1, **WHIP)
    column = system.topology.joints[system.topology.joint_index["root"]].first_velocity
    others = np.setdiff1d(np.asarray(system.topology.analysis.independent), [column])
    published = {2.0: (4.1373, 3.6218), 6.0: (7.3604, 4.2632)}
    for speed, (flap, chord) in published.items():
        start = mbs.State.at(system, velocities={"root": speed / UNIT})
        steady = mbs.equilibrium(system, start, moving=("root",))
        M = np.asarray(mbs.mass_matrix(system, steady.state))[np.ix_(others, others)]
        K = np.asarray(steady.stiffness)[np.ix_(others, others)]
        found = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[:2]) * UNIT
        np.testing.assert_allclose(found, [chord, flap], rtol=0.03 if speed == 2.0 else 0.2)


# --------------------------------------------------------------------------------------------- rigid links
@pytest.mark.long
def test_a_fine_chain_of_rigid_links_with_springs():
    """A falling elastic pendulum is a pendulum of 60 links on hinge springs E I / link; the errors of the links
    are of second order."""
    length, links, bending, line = 1.0, 60, 7e10 * 1.5e-8, 2700 * 4e-4
    link = length / links
    system, frame = chain_of_beams(1, PIN, gravity=(0.0, -9.81, 0.0), motion=mbs.Planar("z"), elements=8, num_modes=6)
    ts = jnp.array([0.01, 0.02, 0.03])
    motion = mbs.simulate(system, mbs.State.at(system), ts=ts, rtol=1e-7, atol=1e-8)
    root = motion.states.coordinates[:, 0]
    bent = system.coordinates(motion.states)["part0.8"][:, 1]

    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    rod = {"com": (link / 2, 0.0, 0.0), "inertia": mbs.inertia.rod(line * link, link)}
    for k in range(links):
        b.body(f"link{k}", mass=line * link, **rod)
        place = {"parent_frame": (link, 0.0, 0.0)} if k else {}
        b.joint(f"hinge{k}", PIN, f"link{k - 1}" if k else "ground", f"link{k}", **place)
        if k:
            b.force(f"spring{k}", mbs.SpringDamper(stiffness=bending / link), joint=f"hinge{k}")
    chain = b.build()
    fine = mbs.simulate(chain, mbs.State.at(chain), ts=ts, rtol=1e-7, atol=1e-8)
    angles = np.cumsum(np.asarray(fine.states.coordinates), axis=1)
    x, y = (link * np.sum(f(angles), axis=1) for f in (np.cos, np.sin))
    deflection = y * np.cos(angles[:, 0]) - x * np.sin(angles[:, 0])
    largest = np.abs(deflection).max()
    assert largest > 1e-4
    np.testing.assert_allclose(bent, deflection, atol=0.05 * largest)
    np.testing.assert_allclose(root, angles[:, 0], atol=2e-4)


# ------------------------------------------------------------------------------------------------------ a loop
def crank_angle(t):
    """From rest to 150 rad/s in 0.05 s."""
    x = jnp.clip(t / 0.05, 0.0, 1.0)
    return 150.0 * (0.05 * (2.5 * x**4 - 3.0 * x**5 + x**6) + jnp.maximum(t - 0.05, 0.0))


@pytest.mark.long
def test_slider_crank_with_an_elastic_rod():
    """The rod of Simeon, Math. Modelling of Systems 2 (1996) 1-18, started smoothly; numbers of a single body."""
    side = 0.008
    section = {"young": 2e11, "shear_modulus": 8e10, "area": side**2, "density": 7870.0, "torsion": 0.14 * side**4}
    section |= {"inertia_y": side**4 / 12, "inertia_z": side**4 / 12, "reference": None}
    frame = elastic_beam(0.3, elements=8, num_modes=6, **section)
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("crank", mass=0.36, com=(0.075, 0.0, 0.0), inertia=0.0027)
    b.elastic("rod", frame.body, motions={"8": mbs.Planar("z")})
    b.body("slider", mass=0.075552, inertia=1e-5)
    b.joint("main", PIN, "ground", "crank", drive=crank_angle)
    b.joint("big end", PIN, "crank", "rod.0", parent_frame=(0.15, 0.0, 0.0))
    b.joint("small end", PIN, "rod.8", "slider")
    b.joint("guide", mbs.Prismatic("x"), "ground", "slider")
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system), ts=jnp.array([0.01, 0.02, 0.03]), rtol=1e-7, atol=1e-9)
    x = np.asarray(displacements(system, motion, "rod", frame)).reshape(3, -1, 6)
    middle, end = x[:, 4, :2] + [0.15, 0.0], x[:, 8, :2] + [0.3, 0.0]
    along = end / np.linalg.norm(end, axis=1, keepdims=True)
    from_chord = middle[:, 1] * along[:, 0] - middle[:, 0] * along[:, 1]
    np.testing.assert_allclose(from_chord, [-1.36688e-4, -1.95670e-4, 8.60527e-4], atol=1e-2 * 8.6e-4)
    slider = jax.vmap(lambda s: mbs.position(system, s, "slider"))(motion.states)[:, 0]
    np.testing.assert_allclose(slider, [0.44993949, 0.44126436, 0.34823286], atol=2e-7)
    guide = mbs.reactions(system, motion)["guide"].force[:, 1]
    np.testing.assert_allclose(guide, [8.838, 1.442, -121.504], atol=0.4)
    assert np.max(np.abs(motion.diagnostics.energy_residual)) < 1e-4
