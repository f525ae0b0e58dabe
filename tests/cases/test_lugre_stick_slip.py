"""FR3, a mass on a rough floor that a spring pulls: it sticks and slips by bristles; SciPy's Radau, BDF and LSODA."""

import diffrax
import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces as F
from jaxmbs.friction import LuGre

from .reading import check, coordinates, rates, run

TIMES = np.array((2.0, 5.0, 7.0, 8.0, 9.0, 9.5, 10.0, 12.0, 15.0, 20.0))
X = (4.643555730556765e-06, 1.6459187125944168e-05, 4.052345462262923e-05, 0.07350830840577115, 0.4129397271784314)
X += (0.556110773603926, 0.6275831289808242, 0.6362928479408698, 0.9182797055524178, 1.2725964123236846)
V = (2.7256017309519747e-06, 5.991668212667624e-06, 2.984218761601088e-05, 0.24831675220642754, 0.34154614992614774)
V += (0.21961962930842815, 0.06780614092796854, 8.037657888818506e-06, 0.3695920352519039, 6.710689831749512e-05)
SLIPS, LARGEST_SPEED, LARGEST_FRICTION = (7.5404, 10.0645, 13.90315), 0.36981599889915817, 1.47657294425001
BRISTLES = LuGre(1.0, 1e5, np.sqrt(1e5), 0.4, static=1.5, stribeck_speed=1e-3)  # under a load of one
FRICTION = F.FrictionForce(BRISTLES)


def pulled():
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("mass", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "mass")
    b.force("spring", mbs.PD(mbs.Ramp(0.0, 0.1), kp=2.0), joint="x")
    b.force("friction", FRICTION, joint="x")
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize("solver", [diffrax.Dopri8(), diffrax.Tsit5(), diffrax.Kvaerno5()])
def test_stick_slip(solver):
    system = pulled()
    fine = np.unique(np.r_[TIMES, np.linspace(0.0, 20.0, 40001)])
    options = dict(rtol=1e-9, atol=1e-10, solver=solver, interpolate=True)
    motion = run(system, mbs.State.at(system, x=0.0), fine, **options)
    at = np.searchsorted(fine, TIMES)
    x, v = coordinates(system, motion, "x")[:, 0], rates(system, motion, "x")[:, 0]
    check(x[at], X, 1e-6)
    check(v[at], V, 1e-5)
    fast = v > 0.05
    turns = fine[1:][fast[1:] != fast[:-1]]
    check(turns[:2], SLIPS[:2], 5e-4)
    check(turns[2:3], SLIPS[2:], 1e-3)
    bristle = {"bristle": motion.internal("friction.bristle")}
    friction = -jax.vmap(lambda v, s: FRICTION.effort(0.0, v, s, 0.0))(motion.states.velocities[:, 0], bristle)
    check([v.max(), friction.max()], [LARGEST_SPEED, LARGEST_FRICTION], [1e-5, 1e-3])


@pytest.mark.long
def test_stick_slip_of_bristles_under_the_load_of_the_guide():
    """The same mass on a level guide whose own reaction presses the bristles."""
    weight = 9.81
    b = mbs.SystemBuilder(gravity=(0, 0, -weight))
    b.body("mass", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "mass")
    b.force("spring", mbs.PD(mbs.Ramp(0.0, 0.1), kp=2.0), joint="x")
    numbers = [x / weight for x in (1.0, 1e5, np.sqrt(1e5), 0.4, 1.5)]
    b.friction("friction", "x", LuGre(*numbers, stribeck_speed=1e-3))
    system = b.build()
    options = dict(rtol=1e-9, atol=1e-10, solver=diffrax.Kvaerno5())
    motion = run(system, mbs.State.at(system, x=0.0), np.r_[0.0, TIMES], **options)
    check(coordinates(system, motion, "x")[1:, 0], X, 1e-6)
    check(rates(system, motion, "x")[1:, 0], V, 1e-5)
    assert abs(float(motion.diagnostics.energy_residual[-1])) < 1e-6


@pytest.mark.long
def test_the_first_creep():
    """Two seconds of sticking: micrometres, and bristles that carry the spring."""
    system = pulled()
    motion = run(system, mbs.State.at(system, x=0.0), TIMES[:1], rtol=1e-8, atol=1e-10)
    check(coordinates(system, motion, "x")[:, 0], X[:1], 1e-9)
    np.testing.assert_allclose(motion.internal("friction.bristle"), 0.4 / 1e5, rtol=2e-3)
