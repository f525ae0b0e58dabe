"""The paper's own state equations, momenta of an independent set, against the canonical ones: motions, gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

from ..mechanisms import OnCart, four_bar, four_bar_state

HAND = OnCart()


def loop(stiffness):
    system = four_bar(stiffness=stiffness, load=5.0, like=LOOP)
    return system, four_bar_state(system)


def lift(t):
    return 0.2 * t + 0.1 * jnp.sin(3.0 * t)


def driven_cart(stiffness):
    """A pendulum on a cart that a drive moves."""
    spring = ("spring", mbs.SpringDamper(stiffness, 0.2), {"joint": "swing"})
    system = HAND.build(drive=lift, forces=[spring], like=DRIVEN)
    return system, mbs.State.at(system, swing=0.6, velocities={"swing": -1.0})


def sleigh(stiffness, like=None):
    """A body on an edge that it cannot slip across, tied to a post by a spring."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("sleigh", mass=2.0, com=(0.2, 0.05, 0.0), inertia=0.1)
    b.joint("plane", mbs.Planar("z"), "ground", "sleigh")
    b.constraint("edge", mbs.KnifeEdge(), between=("ground", "sleigh"))
    b.force(
        "tie",
        mbs.SpringDamper(stiffness, 0.1, 0.3),
        between=(("ground", (0.4, 0.5, 0.0)), ("sleigh", (0.3, 0.0, 0.0))),
    )
    return b.build(like=like)


def nonholonomic(stiffness):
    system = sleigh(stiffness, SLEIGH)
    return system, mbs.State.at(system, plane=(0.0, 0.1, 0.3), velocities={"plane": (0.8, 0.8 * np.tan(0.3), 1.2)})


LOOP, SLEIGH = four_bar(stiffness=3.0, load=5.0), sleigh(3.0)
DRIVEN = HAND.build(drive=lift, forces=[("spring", mbs.SpringDamper(3.0, 0.2), {"joint": "swing"})])
TS = np.linspace(0.0, 0.4, 5)


@pytest.mark.slow
@pytest.mark.parametrize("mechanism", [loop, driven_cart, nonholonomic])
def test_motions_and_gradients_are_the_canonical_ones(mechanism):
    def places(stiffness, formulation):
        system, state = mechanism(stiffness)
        solver = mbs.Gauss4()
        motion = mbs.simulate(system, state, ts=TS, dt=1e-3, solver=solver, formulation=formulation)
        return jnp.concatenate([motion.states.coordinates[-1], motion.states.velocities[-1]])

    def both(stiffness):
        return [places(stiffness, name) for name in ("independent", "canonical")]

    values, slopes = jax.jit(both)(3.0), jax.jit(jax.jacfwd(both))(3.0)
    for independent, canonical in (values, slopes):
        np.testing.assert_allclose(independent, canonical, rtol=1e-9, atol=1e-9)
        assert np.max(np.abs(canonical)) > 1e-3
