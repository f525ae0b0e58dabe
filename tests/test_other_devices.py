"""Answers on another device than the first CPU: those of that CPU, for every kind of thing and of question.

Where there is an accelerator it is that one:
`JAX_PLATFORMS=cuda,cpu python -m pytest -m long tests/test_other_devices.py`.
Elsewhere `XLA_FLAGS=--xla_force_host_platform_device_count=2` gives a second device;
`test_on_two_processors` asks a few questions of it.
"""

import os
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import design
from jaxmbs.probability import Gumbel, Normal
from tests.cycles.oscillators import duffing
from tests.models import chain_of_bars
from tests.test_program_size import KINDS
from tests.test_user_programs import answers, scaled
from tests.zoo import SPECIMENS

DESIGNS = np.array([[1.0, 1.0], [1.1, 0.9], [0.8, 1.05]])
TIMES = np.array([0.01, 0.02])
OTHER = jax.devices()[0] if jax.default_backend() != "cpu" else jax.devices()[-1]


@pytest.fixture(autouse=True)
def _needs_two_devices():
    if jax.devices("cpu")[0] == OTHER:
        pytest.skip("this process has one device alone")


LEAST = 1e-3  # of an array that is zero but for rounding [m, m/s, N, ...]


def on_both(function, rows, atol=1e-7):
    """Answers of rows of numbers on the first CPU and the other device agree, to `atol` of each array's scale."""
    found = []
    for device in (jax.devices("cpu")[0], OTHER):
        with jax.default_device(device):
            found.append(jax.jit(jax.vmap(function))(jax.device_put(rows, device)))
    for (path, truth), other in zip(jax.tree.leaves_with_path(found[0]), jax.tree.leaves(found[1]), strict=True):
        name = jax.tree_util.keystr(path)
        assert other.devices() == {OTHER}, name
        truth, other = np.asarray(truth), np.asarray(other)
        if np.issubdtype(truth.dtype, np.inexact):
            scale = np.max(np.abs(truth), where=np.isfinite(truth), initial=LEAST)
            np.testing.assert_allclose(other, truth, rtol=0.0, atol=atol * scale, err_msg=name)
        else:
            np.testing.assert_array_equal(other, truth, err_msg=name)


def moved(system, state):
    """A function of two scales of the system's masses: accelerations, a short motion, its reactions."""

    def question(scale):
        new = scaled(system, scale)
        motion = mbs.simulate(new, state, ts=state.t + jnp.asarray(TIMES), rtol=1e-9, atol=1e-11)
        loads = mbs.reactions(new, motion)
        parts = [x for _, load in loads.items() for x in (load.force, load.moment)]
        return {
            "accelerations": mbs.forward_dynamics(new, state)[0],
            "end": (motion.states.coordinates, motion.states.velocities),
            "reactions": jnp.stack(parts),
        }

    return question


@pytest.mark.long
@pytest.mark.parametrize("name", SPECIMENS)
def test_motions_of_the_zoo(name):
    on_both(moved(SPECIMENS[name].system, SPECIMENS[name].state), DESIGNS)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_motions_of_every_kind_of_thing(kind):
    system = KINDS[kind][0](1)
    on_both(moved(system, mbs.State.at(system)), DESIGNS)


@pytest.mark.long
@pytest.mark.parametrize("name", ["tree", "four_bar"])
def test_gradients_of_a_motion(name):
    question = moved(SPECIMENS[name].system, SPECIMENS[name].state)

    def mixed(scale):
        flat = jnp.concatenate([x.reshape(-1) for x in jax.tree.leaves(question(scale))])
        return jnp.cos(jnp.arange(flat.size)) @ flat

    on_both(jax.grad(mixed), DESIGNS, atol=1e-6)


def chain():
    """Thirty bars in a row, beyond what a dense matrix serves."""
    system = chain_of_bars(30)
    state = mbs.State.at(system, pin0=0.3, pin7=-0.4)
    return lambda scale: mbs.forward_dynamics(scaled(system, scale), state)[0]


def rests():
    system, state = SPECIMENS["tree"].system, SPECIMENS["tree"].state
    return lambda scale: mbs.equilibrium(scaled(system, scale), state, throw=False).state.coordinates


def small_vibrations():
    system, state = SPECIMENS["four_bar"].system, SPECIMENS["four_bar"].state

    def matrices(scale):
        found = mbs.linearise(scaled(system, scale), state).system
        return found.stiffness, found.mass

    return matrices


def a_cycle():
    system = duffing()
    state = mbs.State.at(system, x=0.65, velocities={"x": 2.4})

    def cycle(scale):
        found = mbs.periodic(scaled(system, scale), 2.0 * np.pi / 1.5, state, throw=False)
        return found.states.coordinates, found.multipliers

    return cycle


def an_optimum():
    """Problem 71 of Hock and Schittkowski, its sphere and its product scaled."""

    def optimum(scale):
        found = design.interior_point(
            lambda x: x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2], jnp.array([1.0, 5.0, 5.0, 1.0]), bounds=(1.0, 5.0),
            equalities=lambda x: x @ x - 40.0 * scale[0], inequalities=lambda x: 25.0 * scale[1] - jnp.prod(x),
        )  # fmt: skip
        return found.design, found.value, found.ok

    return optimum


QUESTIONS = {f.__name__: f for f in (chain, rests, small_vibrations, a_cycle, an_optimum)}


@pytest.mark.long
@pytest.mark.parametrize("name", QUESTIONS)
def test_questions(name):
    on_both(QUESTIONS[name](), DESIGNS, atol=1e-6)


@pytest.mark.long
def test_a_probability():
    """A question of the host."""
    numbers = {"strength": Normal(300.0, 20.0), "load": Gumbel(150.0, 20.0)}
    found = []
    for device in (jax.devices("cpu")[0], OTHER):
        with jax.default_device(device):
            one = design.reliability(lambda x: x["strength"] - x["load"], numbers, compile="full")
            found.append((one.index, one.probability, *one.importances.values(), *one.derivatives["load"].values()))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8)


@pytest.mark.long
def test_a_structure():
    on_both(answers, DESIGNS[:, 0], atol=1e-7)


@pytest.mark.user
def test_on_two_processors():
    """Accelerations of a long chain, a motion and an optimum, in a process that has two devices."""
    chosen = "test_questions[chain] or test_questions[an_optimum] or test_motions_of_the_zoo[tree]"
    code = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-m", "long", "-k", chosen, __file__]
    flags = os.environ.get("XLA_FLAGS", "") + " --xla_force_host_platform_device_count=2"
    done = subprocess.run(code, env=os.environ | {"XLA_FLAGS": flags}, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "3 passed" in done.stdout, done.stdout[-3000:]
