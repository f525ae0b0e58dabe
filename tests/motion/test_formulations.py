"""The paper's own state equations, momenta of an independent set, against the canonical ones: motions, gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import OnCart, four_bar, four_bar_state

HAND = OnCart()
TS = np.linspace(0.0, 0.4, 5)


def lift(t):
    return 0.2 * t + 0.1 * jnp.sin(3.0 * t)


def loop(stiffness, like=None):
    system = four_bar(stiffness=stiffness, load=5.0, like=like)
    return system, four_bar_state(system)


def driven_cart(stiffness, like=None):
    """A pendulum on a cart that a drive moves."""
    spring = ("spring", mbs.SpringDamper(stiffness, 0.2), {"joint": "swing"})
    system = HAND.build(drive=lift, forces=[spring], like=like)
    return system, mbs.State.at(system, swing=0.6, velocities={"swing": -1.0})


def sleigh(stiffness, like=None):
    """A body on an edge that it cannot slip across, tied to a post by a spring."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("sleigh", mass=2.0, com=(0.2, 0.05, 0.0), inertia=0.1)
    b.joint("plane", mbs.Planar("z"), "ground", "sleigh")
    b.constraint("edge", mbs.joints.KnifeEdge(), between=("ground", "sleigh"))
    ends = ("ground", (0.4, 0.5, 0.0)), ("sleigh", (0.3, 0.0, 0.0))
    b.force("tie", mbs.SpringDamper(stiffness, 0.1, 0.3), between=ends)
    system = b.build(like=like)
    speeds = 0.8 * np.array([np.cos(0.3), np.sin(0.3), 1.5])
    return system, mbs.State.at(system, plane=(0.0, 0.1, 0.3), velocities={"plane": speeds})


def stretched(psi, t):
    """A gear between two slides whose ratio grows."""
    return psi[:1] - (1.0 + 0.5 * t) * psi[1:2]


def growing_gear(stiffness, like=None):
    """Rows whose Jacobian has time in it."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for name, axis, mass in (("near", "x", 2.0), ("far", "y", 1.5)):
        b.body(name, mass=mass, inertia=0.1)
        b.joint(name, mbs.Prismatic(axis), "ground", name)
    b.constraint("gear", mbs.joints.PositionRows(stretched))
    b.force("spring", mbs.SpringDamper(stiffness, 0.2), joint="far")
    system = b.build(like=like)
    return system, mbs.State.at(system, far=0.3, velocities={"far": 1.0})


@pytest.mark.parametrize(
    "mechanism",
    [
        pytest.param(loop, marks=pytest.mark.long),
        pytest.param(growing_gear, marks=pytest.mark.long),
        pytest.param(driven_cart, marks=pytest.mark.long),
        pytest.param(sleigh, marks=pytest.mark.long),
    ],
)
def test_motions_and_gradients_are_the_canonical_ones(mechanism):
    """After a fixed number of steps of an eighth-order rule, at the end and in its slope by a spring's stiffness."""
    known, _ = mechanism(3.0)

    def places(stiffness, formulation):
        system, state = mechanism(stiffness, known)
        motion = mbs.simulate(system, state, ts=TS, dt=5e-3, gradient="forward", formulation=formulation)
        return jnp.concatenate([motion.states.coordinates[-1], motion.states.velocities[-1]])

    def both(stiffness):
        return [places(stiffness, name) for name in ("independent", "canonical")]

    values, slopes = jax.jit(lambda k: jax.jvp(both, (k,), (1.0,)))(3.0)
    for independent, canonical in (values, slopes):
        np.testing.assert_allclose(independent, canonical, rtol=1e-9, atol=1e-9)
        assert np.max(np.abs(canonical)) > 1e-3


def test_prescribed_motion_of_a_system_with_freedoms_is_refused():
    system, state = driven_cart(5.0)
    with pytest.raises(mbs.ModelError, match='formulation="prescribed": the rows leave 1 freedoms open'):
        mbs.simulate(system, state, ts=TS, formulation="prescribed")


@pytest.mark.slow
def test_velocities_between_steps_keep_the_rows():
    """Long steps over many saved times: velocities are projected as coordinates are."""
    system, state = driven_cart(5.0)
    options = {"formulation": "velocity", "interpolate": True, "rtol": 1e-4, "atol": 1e-4}
    motion = mbs.simulate(system, state, ts=np.linspace(0.0, 0.4, 33), **options)
    assert motion.ok and motion.diagnostics.num_steps < 16
    assert np.max(motion.diagnostics.velocity_drift) < 1e-13
