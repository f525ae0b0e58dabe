"""Mechanisms as blocks of flat arrays: closed forms, whole turns of a crank, derivatives, faults."""

import re

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs import blocks
from tests.adapters.fmi.mechanisms import pendulum, slider_crank


@pytest.mark.long
def test_a_pendulum_is_its_closed_form():
    """Rates, output and names; the motor's torque is the input."""
    block = mbs.as_block(*pendulum()[:1], ["motor"], ["pin", "height"], pendulum()[1])
    assert block.state_names == ("pin", "rate of pin") and block.output_names == ("pin", "height")
    assert block.inputs == ("motor.function",) and block.units == {"pin": "rad", "rate of pin": "rad/s"}
    np.testing.assert_allclose(block.initial_state, [0.3, 0.0])
    dx, y = block(0.0, [0.4, 1.5], 0.7)
    torque = 0.7 - 2.0 * 0.4 - 0.1 * 1.5 + 9.81 * 0.5 * np.cos(0.4)
    np.testing.assert_allclose(dx, [1.5, torque / (0.01 + 0.25)], rtol=1e-12)
    np.testing.assert_allclose(y, [0.4, -0.5 * np.sin(0.4)], rtol=1e-12)


@pytest.mark.long
def test_a_crank_turns_round():
    """Two turns by SciPy: the piston by the closed form of the crank's angle, the crank as by `simulate`."""
    system, state = slider_crank()
    block = mbs.as_block(system, ["motor"], ["slide"], state)
    assert block.state_names[:2] == ("A", "rate of A") and set(block.state_names[2:]) >= {"B", "slide"}
    call = eqx.filter_jit(block)
    found = solve_ivp(
        lambda t, x: np.asarray(call(t, x, 6.0)[0]), (0.0, 2.0), block.initial_state, "DOP853", rtol=1e-9, atol=1e-9
    )
    a, y = found.y[0, -1], call(2.0, found.y[:, -1], 6.0)[1]
    assert abs(a) > 4 * np.pi
    np.testing.assert_allclose(y[0], 0.2 * np.cos(a) + np.sqrt(0.25 - (0.2 * np.sin(a)) ** 2), atol=1e-9)
    pushed = mbs.as_block(system, (), lambda system, state, t: {"A": state.coordinates[0]}, state)
    motion = mbs.simulate(system, state, ts=[0.0, 0.2], rtol=1e-11, atol=1e-11)
    still = solve_ivp(
        lambda t, x: np.asarray(pushed(t, x)[0]), (0.0, 0.2), block.initial_state, "DOP853", rtol=1e-10, atol=1e-10
    )
    np.testing.assert_allclose(pushed.outputs(0.2, still.y[:, -1])[0], motion.end.coordinates[0], atol=1e-8)


@pytest.mark.long
def test_derivatives_by_states_inputs_and_the_system():
    """Against central differences; by a mass, the block built inside of the trace."""
    system, state = slider_crank()
    block = mbs.as_block(system, ["motor"], ["slide"], state)
    x, u, h = block.initial_state, jnp.array([3.0]), 1e-5
    ((A, B), (C, D)) = jax.jit(jax.jacfwd(block, argnums=(1, 2)))(0.0, x, u)
    reverse = jax.jit(jax.jacrev(block, argnums=(1, 2)))(0.0, x, u)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-11), ((A, B), (C, D)), reverse)
    for k in range(2):
        up, down = (block(0.0, x.at[k].add(s), u) for s in (h, -h))
        np.testing.assert_allclose(A[:, k], (up[0] - down[0]) / (2 * h), rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(C[:, k], (up[1] - down[1]) / (2 * h), rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(A[:, 2:], 0.0)  # of coordinates that follow
    up, down = (block(0.0, x, u + s)[0] for s in (h, -h))
    np.testing.assert_allclose(B[:, 0], (up - down) / (2 * h), rtol=1e-7, atol=1e-8)

    def rate(mass):
        heavier = eqx.tree_at(lambda s: s.mass, system, system.mass.at[1].set(mass))
        return mbs.as_block(heavier, ["motor"], ["slide"], state)(0.0, x, u)[0][1]

    slope = jax.jit(jax.grad(rate))(0.5)
    np.testing.assert_allclose(slope, (rate(0.5 + h) - rate(0.5 - h)) / (2 * h), rtol=1e-7)
    many = jax.vmap(lambda x: block(0.0, x, u)[0])(jnp.stack([x, x.at[1].add(1.0)]))
    np.testing.assert_allclose(many[0], block(0.0, x, u)[0], rtol=1e-12)


@pytest.mark.long
def test_loops_that_do_not_close_are_no_numbers():
    """From a pose that is no number."""
    system, state = slider_crank()
    block = mbs.as_block(system, ["motor"], ["slide"], state)
    assert np.all(np.isfinite(block(0.0, block.initial_state, 0.0)[0]))
    assert np.all(np.isnan(block(0.0, block.initial_state.at[2:].set(jnp.nan), 0.0)[0]))


@pytest.mark.long
def test_a_diagram_on_jax():
    """The slope of a closed loop's end by its gain."""
    system, state = pendulum()
    block = mbs.as_block(system, ["motor"], ["pin"], state)

    def end(gain):
        field = diffrax.ODETerm(lambda t, x, k: block.derivatives(t, x, k * (0.5 - block.outputs(t, x, 0.0))))
        steps = diffrax.PIDController(rtol=1e-9, atol=1e-9)
        return diffrax.diffeqsolve(
            field, diffrax.Tsit5(), 0.0, 0.5, 0.01, block.initial_state, gain, stepsize_controller=steps
        ).ys[-1, 0]

    value_and_grad = jax.jit(jax.value_and_grad(end))
    slope = value_and_grad(4.0)[1]
    np.testing.assert_allclose(slope, (end(4.001) - end(3.999)) / 2e-3, rtol=1e-5)


FAULTS = {
    "no system": (lambda s: mbs.as_block(3), TypeError, "System"),
    "input": (lambda s: mbs.as_block(s, ["moter"]), mbs.UnknownNameError, "moter"),
    "output": (lambda s: mbs.as_block(s, [], ["hight"]), mbs.UnknownNameError, "hight"),
    "text": (lambda s: mbs.as_block(s, "motor"), mbs.ModelError, "names are given in a list"),
    "text of outputs": (lambda s: mbs.as_block(s, [], "pin"), mbs.ModelError, "names are given in a list"),
    "states": (lambda s: mbs.as_block(s)(0.0, [1.0]), ValueError, re.escape("(1,), not (2,): pin, rate of pin")),
    "inputs": (lambda s: mbs.as_block(s)(0.0, [1.0, 2.0], [1.0]), ValueError, re.escape("(1,), not (0,): none")),
    "no dict": (lambda s: mbs.as_block(s, [], lambda *a: 1.0), mbs.ModelError, "returns a dict"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults(name):
    call, error, message = FAULTS[name]
    with pytest.raises(error, match=message):
        call(pendulum()[0])


def test_sampled_blocks_are_refused():
    b = mbs.SystemBuilder()
    b.body("bob", mass=1.0, com=(0.5, 0.0, 0.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("motor", mbs.Actuator(0.0), joint="pin")
    b.measure("angle", joint="pin", of="position")
    b.block("loop", blocks.PI(1.0, 0.0), reads="angle", drives="motor", every=0.01)
    with pytest.raises(mbs.ModelError, match="as_block"):
        mbs.as_block(b.build())


@pytest.mark.long
def test_states_have_the_names_of_a_linearisation():
    """Of joints with several velocities too; coordinates of a quaternion are its four numbers, not small turns."""
    kinds = {
        "cross": mbs.Universal(),
        "sleeve": mbs.Cylindrical("z"),
        "table": mbs.Planar("z"),
        "free": mbs.Free(),
    }
    b = mbs.SystemBuilder()
    for name, kind in kinds.items():
        b.body(f"{name} body", 1.0, com=(0.1, 0.2, 0.3), inertia=(1.0, 1.0, 1.0))
        b.joint(name, kind, "ground", f"{name} body")
    system = b.build()
    found, linear = mbs.as_block(system).state_names, mbs.linearise(system, mbs.State.at(system)).state_names
    assert "rate of table x" in found and "rate of free rx" in found and "cross second" in found
    speeds = [name for name in linear if name.startswith("rate of ")]
    assert speeds == [name for name in found if name.startswith("rate of ")]
    without = [name for name in linear if "free r" not in name]
    assert without == [name for name in found if "free q" not in name and "rate of free r" not in name]
