"""From section, material and length through elements, reduction, motion and reactions: derivatives and batches."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.flexible.beams import elastic_beam

DESIGN = {
    "length": np.array(0.8),
    "young": np.array(7e10),
    "inertia_z": np.array(1.5e-8),
    "area": np.array(4e-4),
    "tool": np.array(0.5),
}


def outcome(design):
    """State and hub reaction after a few steps of an arm that starts bent and turning, a tool on its tip."""
    d = dict(design)
    tool = d.pop("tool")
    frame = elastic_beam(elements=2, num_modes=1, damping_ratio=0.01, **d)
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body, motions={"2": mbs.Planar("z")})
    b.body("tool", mass=tool, inertia=1e-3)
    b.joint("hub", mbs.Revolute(axis="z"), "ground", "arm.0")
    b.joint("tip", mbs.Weld(), "arm.2", "tool")
    system = b.build()
    start = {"hub": 0.3, "arm.2": jnp.array([1e-5, 2e-3, 3e-3])}
    state = mbs.State.at(system, start, velocities={"hub": 5.0})
    motion = mbs.simulate(system, state, ts=jnp.array([1e-4]), dt=2e-5, solver=diffrax.Euler())
    last = jax.tree.map(lambda x: x[-1], motion.states)
    hub = mbs.reactions(system, last)["hub"]
    return jnp.concatenate([last.velocities, 1e-2 * hub.force, 1e-1 * hub.moment])


WEIGHTS = np.random.default_rng(3).normal(size=11)


@pytest.fixture(scope="module")
def value_and_gradient():
    return jax.jit(jax.value_and_grad(lambda design: jnp.dot(jnp.asarray(WEIGHTS), outcome(design))))


def as_jax(design):
    return {name: jnp.asarray(value) for name, value in design.items()}


@pytest.mark.long
def test_gradient_against_central_differences(value_and_gradient):
    _, found = value_and_gradient(as_jax(DESIGN))
    for name, x in DESIGN.items():

        def at(factor, name=name, x=x):
            return float(value_and_gradient(as_jax(DESIGN | {name: x * factor}))[0])

        h = 1e-3
        wanted = (8 * (at(1 + h) - at(1 - h)) - (at(1 + 2 * h) - at(1 - 2 * h))) / (12 * h)
        assert abs(wanted) > 1e-4, f"{name} has no influence"
        np.testing.assert_allclose(found[name] * x, wanted, rtol=1e-6, atol=1e-7, err_msg=name)


@pytest.mark.long
def test_a_batch_of_designs_is_single_runs(value_and_gradient):
    factors = jnp.array([0.9, 1.0, 1.2])
    designs = {name: x * factors for name, x in as_jax(DESIGN).items()}
    batch = jax.jit(jax.vmap(outcome))(designs) @ WEIGHTS
    singles = [value_and_gradient({n: v[k] for n, v in designs.items()})[0] for k in range(3)]
    np.testing.assert_allclose(batch, np.array(singles), rtol=1e-9)
