"""Bevel and worm gears whose shafts tilt and move: all their force but friction is the derivative of their energy."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import BevelGear, PathKinematics, WormGear
from jaxmbs.math._rotation import rotation_matrix
from tests.forces.test_bevel_gear import about

WORM = WormGear(2, 30, module=4e-3, radius=0.02, stiffness=1e7, backlash=1e-5, damping=200.0)
BEVEL = BevelGear((20, 40), 2e-3, stiffness=1e7, backlash=1e-5, damping=200.0)
CASES = {
    "bevel": (BEVEL, about("y", 1.2) @ about("z", jnp.pi), jnp.zeros(3)),
    "bevel for an angle": (
        BevelGear((20, 30), 2e-3, stiffness=1e7, shaft_angle=1.2),
        about("y", 1.2) @ about("z", jnp.pi),
        jnp.zeros(3),
    ),
    "worm": (WORM, jnp.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]]).T, jnp.array([WORM.centre_distance, 0, 0])),
}


def placed(p, case):
    """Poses of both wheels, displaced by p (12,): turns and shifts of each."""
    _, R, x = CASES[case]
    turned = [rotation_matrix(p[3 * k : 3 * k + 3]) @ base for k, base in enumerate((jnp.eye(3), R))]
    return jnp.stack(turned), jnp.stack([p[6:9], x + p[9:12]])


@functools.cache
def slopes(case):
    """Differences (12,) of the energy by small turns and shifts of wheels that are displaced by p (12,)."""
    law = CASES[case][0]

    def energy(q, p):
        R, x = placed(p, case)
        R = jnp.stack([rotation_matrix(q[3 * k : 3 * k + 3]) @ R[k] for k in range(2)])
        return law.potential(R, x + q[6:].reshape(2, 3), 0.0)

    steps = jnp.eye(12) * 1e-7
    return jax.jit(lambda p: jax.vmap(lambda e: (energy(e, p) - energy(-e, p)) / 2e-7)(steps))


@pytest.mark.parametrize("case", list(CASES))
@pytest.mark.parametrize("seed", range(2))
def test_forces_and_moments_are_the_derivative_of_the_energy(case, seed):
    law = CASES[case][0]
    random = np.random.default_rng(seed)
    turns, shifts = 2e-3 * random.normal(size=6), 3e-5 * random.normal(size=6)
    turns[2] += 5e-3
    p = jnp.asarray(np.concatenate([turns, shifts]))
    v = jnp.asarray(random.normal(size=(4, 3)))

    slope = np.asarray(slopes(case)(p))
    wrench, still = jax.jit(lambda *moving: law.wrench(PathKinematics(*moving), 0.0)), jnp.zeros((2, 3))
    force, moment = wrench(*placed(p, case), still, still)
    size = np.abs(force).max()
    assert size > 10.0
    np.testing.assert_allclose(-slope[6:].reshape(2, 3), force, atol=1e-4 * size)
    np.testing.assert_allclose(-slope[:6].reshape(2, 3), moment, atol=1e-5 * size)
    # dampers take power, whatever moves
    moving = PathKinematics(*placed(p, case), v[:2], 1e-2 * v[2:])
    power = moving.power(*wrench(*moving)) + law.storage_power(moving, 0.0)
    assert power <= 1e-9 * size


@pytest.mark.parametrize("angle", [np.pi / 2, 1.2, 2.0])
def test_moments_on_shafts_are_those_of_forces_at_the_pitch_point(angle):
    """The textbook's three forces at the mean radius bend both shafts, of gears cut for the angle of their frames."""
    alpha, module, teeth = np.radians(20.0), 2e-3, (20, 40)
    R = np.stack([np.eye(3), np.asarray(about("y", angle) @ about("z", jnp.pi))])
    law = BevelGear(teeth, module, alpha, 1e7, transition=1e-9).in_place(jnp.asarray(R), jnp.zeros((2, 3)))
    np.testing.assert_allclose(law.shaft_angle, angle, rtol=1e-12)
    turned = R.copy()
    turned[0] = np.asarray(about("z", 1e-5))
    still = jnp.zeros((2, 3))
    force, moment = law.wrench(PathKinematics(jnp.asarray(turned), still, still, still), 0.0)
    cone = np.arctan2(np.sin(angle), teeth[1] / teeth[0] + np.cos(angle))
    point = module / 2 * teeth[0] * np.array([1.0, 0.0, 1.0 / np.tan(cone)])
    np.testing.assert_allclose(moment, np.cross(point, force), rtol=1e-6, atol=1e-9 * np.abs(moment).max())


def tilting(seed, spring=2e3):
    """Bevel gears between two shafts, each in a frame that tilts about two axes against springs, spinning."""
    random = np.random.default_rng(seed)
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    side = mbs.Pose((0, 0, 0), np.asarray(about("y", np.pi / 2)))
    for name, frame in (("a", (0, 0, 0)), ("b", side)):
        b.body(f"frame {name}", 1.0, inertia=(2e-3, 2e-3, 2e-3))
        b.body(f"wheel {name}", 0.5, inertia=(3e-4, 3e-4, 5e-4))
        b.joint(f"tilt {name}", mbs.Universal(("x", "y")), "ground", f"frame {name}", parent_frame=frame)
        b.joint(f"spin {name}", mbs.Revolute("z"), f"frame {name}", f"wheel {name}")
        place = mbs.Pose((0, 0, 0), np.eye(3)) if name == "a" else side
        b.force(
            f"hold {name}", mbs.forces.Bushing([0.0] * 3 + [spring] * 3), between=(("ground", place), f"frame {name}")
        )
    law = BevelGear((20, 30), 3e-3, stiffness=1e6, phase=30 * np.pi)
    b.force("mesh", law, between=("wheel a", "wheel b"))
    system = b.build()
    speed = 20.0
    rates = {"spin a": speed, "spin b": -speed * 20 / 30, "tilt a": 10.0 * random.normal(size=2)}
    return system, mbs.State.at(system, velocities=rates)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(2))
def test_gears_on_tilting_shafts_keep_their_energy(seed):
    system, start = tilting(seed)
    motion = mbs.simulate(system, start, ts=np.linspace(0.0, 0.02, 41), rtol=1e-9, atol=1e-11)
    assert motion.ok
    accounts = motion.diagnostics
    (joint,) = (joint for joint in system.topology.joints if joint.name == "tilt a")
    assert np.ptp(np.asarray(motion.states.coordinates)[:, joint.coordinates], axis=0).max() > 1e-3
    energy = accounts.kinetic + accounts.potential
    np.testing.assert_allclose(energy, energy[0], rtol=1e-6)
    np.testing.assert_allclose(accounts.work.get("mesh", 0.0), 0.0, atol=1e-9)
