"""Linearisations by signals against transfer functions, a linearisation as a block, and equilibria with integrals."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks, forces
from tests import motor_loop


@pytest.mark.long
def test_closed_poles_and_the_response_from_target_to_signals():
    system = motor_loop.build()
    state = mbs.State.at(system)
    found = mbs.linearise(
        system, state, inputs=("loop.target", "pin"), outputs=("speed", "loop", "motor.current", "pin")
    )
    A, b = motor_loop.matrices()
    roots = np.roots(np.poly(A))
    poles = np.linalg.eigvals(np.asarray(found.state_space.A))
    np.testing.assert_allclose(np.sort_complex(poles[np.abs(poles) > 1e-9]), np.sort_complex(roots), rtol=1e-10)
    assert found.state_names[2:] == ("motor.current", "loop.integral")
    omega = np.array([0.5, 7.0])
    response = mbs.frequency_response(found.state_space, omega)
    for k, w in enumerate(omega):
        x = np.linalg.solve(1j * w * np.eye(3) - A, b)
        output = motor_loop.NUMBERS["kp"] * (1.0 - x[0]) + x[2]
        np.testing.assert_allclose(response[k, :, 0], [x[0], output, x[1], x[0] / (1j * w)], rtol=1e-10)
        torque = np.linalg.solve(1j * w * np.eye(3) - A, [1.0 / motor_loop.NUMBERS["J"], 0.0, 0.0])
        np.testing.assert_allclose(response[k, :3, 1], [torque[0], -torque[0] + torque[2], torque[1]], rtol=1e-10)


def test_names_of_inputs_and_outputs_are_checked():
    system = motor_loop.build()
    state = mbs.State.at(system)
    with pytest.raises(mbs.ModelError, match="block 'loop' drives it"):
        mbs.linearise(system, state, inputs=("motor.voltage",))
    with pytest.raises(mbs.UnknownNameError, match="did you mean 'loop.target'"):
        mbs.linearise(system, state, inputs=("loop.targets",))
    with pytest.raises(mbs.UnknownNameError, match="did you mean 'speed'"):
        mbs.linearise(system, state, outputs=("sped",))


def pendulum(target=0.5, like=None, observer=None):
    b = mbs.SystemBuilder()
    b.body("arm", mass=2.0, com=(0.4, 0.0, 0.0), inertia=(0.0, 0.1, 0.1))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.force("motor", forces.Motor(0.0, 1.0, 0.1, 2.0), joint="pin")
    b.measure("angle", joint="pin")
    b.block("loop", blocks.PID(8.0, 6.0, target=target, kd=1.0, filter=0.05), reads="angle", drives="motor")
    if observer is not None:
        b.block(
            "difference", blocks.Function(lambda u, t: u), reads=mbs.Harmonic(0.0, 1e-4, 3.0), drives="loop.target"
        )
        b.declared.blocks["loop"].block = blocks.PID(8.0, 6.0, kd=1.0, filter=0.05)
        b.block("observer", observer, reads="difference")
    return b.build(like=like)


@pytest.mark.long
def test_an_integral_holds_the_weight_at_rest_with_derivatives():
    like = pendulum()

    def rest(target):
        system = pendulum(target, like)
        found = mbs.equilibrium(system, mbs.State.at(system, pin=0.4, internal={"loop.integral": -3.0}))
        return jnp.stack([found.state.coordinates[0], found.state.internal["loop.integral"]])

    weight = lambda angle: -2.0 * 9.81 * 0.4 * np.cos(angle) / 2.0  # of the current, at 1 ohm and 2 N m/A
    np.testing.assert_allclose(rest(0.5), [0.5, weight(0.5)], rtol=1e-8)
    np.testing.assert_allclose(jax.jacfwd(rest)(0.5), [1.0, (weight(0.5001) - weight(0.4999)) / 2e-4], rtol=1e-6)


@pytest.mark.long
def test_a_linearisation_serves_as_a_block():
    system = pendulum(0.0)
    rest = mbs.equilibrium(
        system, mbs.State.at(system, internal={"loop.integral": -3.9, "motor.current": -3.9})
    ).state
    space = mbs.linearise(system, rest, inputs=("loop.target",), outputs=("angle",)).state_space
    assert not space.is_feedthrough
    both = pendulum(observer=space)
    names = {name: value for name, value in rest.internal.named().items()}
    state = mbs.State.at(both, pin=rest.coordinates[0], internal=names)
    motion = mbs.simulate(both, state, ts=np.array([0.5, 1.0, 2.0]))
    found = mbs.signals(both, motion)
    np.testing.assert_allclose(found["angle"], found["observer"], atol=5e-9)
    assert np.max(np.abs(found["observer"])) > 5e-5
