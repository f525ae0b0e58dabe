"""Implicit stages with internal states of laws and blocks, against exponentials and explicit steps."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import jaxmbs as mbs
from jaxmbs import blocks
from jaxmbs import forces as F
from jaxmbs.motion._implicit_stages import eliminated_states
from tests.state_laws import Lag

TIMES = np.linspace(0.05, 0.8, 6)
NUMBERS = {"mass": 2.0, "series": 150.0, "oil": 9.0, "tau": 0.15, "gain": -8.0, "filter": 0.2}
WEIGHTS = np.array([1.0, 0.3, 3.0, 0.1, 0.2])
NAMES = ("rubber 0.stretch", "motor.force", "filter.value")


def controlled(numbers=NUMBERS, like=None, reads=("speed", "pull")):
    """A block on four equal elements of Maxwell and a motor; a brake follows the speed and the motor's force late."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=numbers["mass"])
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    for k in range(4):
        b.force(f"rubber {k}", F.Maxwell(numbers["series"] / 4, numbers["oil"] / 4), joint="x")
    b.force("motor", Lag(numbers["tau"]), joint="x")
    b.force("brake", F.Actuator(0.0), joint="x")
    b.measure("speed", joint="x", of="velocity")
    b.measure("pull", lambda instant: instant.internal["motor.force"])
    b.block("sum", blocks.Function(lambda u, t: jnp.sum(jnp.atleast_1d(u))), reads=list(reads))
    b.block("filter", blocks.FirstOrder(numbers["filter"], numbers["gain"]), reads="sum", drives="brake")
    return b.build(like=like)


def begin(system, x=0.3):
    internal = {"motor.force": 2.0, "filter.value": -1.0}
    return mbs.State.at(system, x=x, velocities={"x": -0.5}, internal=internal)


def exact(numbers, times):
    """(x, v, stretch, force, value) at times (T,)."""
    m, s, c, tau, gain, late = (float(numbers[name]) for name in NUMBERS)
    A = np.array(
        [
            [0, 1, 0, 0, 0],
            [0, 0, -s / m, 1 / m, 1 / m],
            [0, 1, -s / c, 0, 0],
            [0, 0, 0, -1 / tau, 0],
            [0, gain / late, 0, gain / late, -1 / late],
        ]
    )
    return np.array([expm(A * t) @ [0.3, -0.5, 0.0, 2.0, -1.0] for t in times])


def found(motion):
    parts = motion.states.coordinates[:, 0], motion.states.velocities[:, 0]
    return jnp.stack([*parts, *(motion.internal(name) for name in NAMES)], axis=1)


@pytest.mark.parametrize(
    ("reads", "number"),
    [
        pytest.param(("speed", "pull"), 4, id="motor by a measure"),
        pytest.param(("speed", "motor.force"), 4, id="motor by a block"),
        pytest.param(("speed", "rubber 2.stretch"), 0, id="rubber by a block"),
    ],
)
def test_states_that_signals_read_stay(reads, number):
    """Those of laws that no signal reads are eliminated, if they are more than coordinates and velocities."""
    system = controlled(reads=reads)
    wanted = [record.name.startswith("rubber") and number > 0 for record in system.topology.internal]
    assert eliminated_states(system).tolist() == wanted and sum(wanted) == number


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "atol"),
    [
        pytest.param({}, 1e-7, id="explicit"),
        pytest.param({"solver": diffrax.Kvaerno5()}, 3e-7, id="Kvaerno5"),
        pytest.param({"solver": diffrax.Kvaerno3(), "rtol": 1e-8, "atol": 1e-8}, 1e-6, id="Kvaerno3"),
        pytest.param({"solver": mbs.ode.ImplicitMidpoint(), "dt": 2e-4}, 1e-5, id="midpoint"),
    ],
)
def test_against_the_exponential(options, atol):
    system = controlled()
    motion = mbs.simulate(system, begin(system), ts=TIMES, **options)
    np.testing.assert_allclose(found(motion), exact(NUMBERS, TIMES), atol=atol)
    assert np.abs(motion.diagnostics.energy_residual).max() < 1e-4


@pytest.mark.long
@pytest.mark.parametrize("mode", ["reverse", "forward"])
def test_gradients_through_blocks(mode):
    system = controlled()

    def loss(numbers):
        new = controlled(numbers, like=system)
        motion = mbs.simulate(new, begin(new), ts=TIMES, gradient=mode, solver=diffrax.Kvaerno5())
        return jnp.sum(found(motion) @ WEIGHTS)

    def truth(numbers):
        return np.sum(exact(numbers, TIMES) @ WEIGHTS)

    numbers = {name: jnp.asarray(value) for name, value in NUMBERS.items()}
    slopes = (jax.grad if mode == "reverse" else jax.jacfwd)(loss)(numbers)
    for name, value in NUMBERS.items():
        h = 1e-5 * value
        up, down = ({**NUMBERS, name: value + k * h} for k in (1, -1))
        wanted = (truth(up) - truth(down)) / (2.0 * h)
        np.testing.assert_allclose(slopes[name], wanted, rtol=1e-5, err_msg=name)


@pytest.mark.long
def test_bristles_of_a_joint_beside_a_law_with_many_states():
    """Bristles are no states of a law: they follow the stage with the mechanism."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("block", mass=1.0, inertia=0.1)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.friction("floor", "x", mbs.friction.LuGre(0.3, 2e3, 20.0, stribeck_speed=0.01))
    b.force("pull", mbs.Actuator(lambda x, v, t: 5.0 * t - 2.0 * x), joint="x")
    b.force("rubber", F.Prony(1.0, 2.0 * np.ones(6), np.geomspace(0.01, 1.0, 6)), joint="x")
    system = b.build()
    run = lambda **kw: mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.2, 1.6, 8), **kw)
    explicit, implicit = run(rtol=1e-9, atol=1e-9), run(rtol=1e-8, atol=1e-8, solver=diffrax.Kvaerno5())
    assert explicit.states.coordinates[-1, 0] > 0.1  # it has slipped
    np.testing.assert_allclose(implicit.states.coordinates, explicit.states.coordinates, atol=1e-6)
    np.testing.assert_allclose(implicit.internal("floor.bristle"), explicit.internal("floor.bristle"), atol=1e-8)
