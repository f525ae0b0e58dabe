"""Switches of the tricks: how they are set, and that programs without them answer the same."""

import os
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.math._square import solve
from jaxmbs.runtime import is_on, jit, trick_states, tuning, without_tricks
from jaxmbs.runtime._compiler_options import OPTIONS, compiler_options
from jaxmbs.runtime._tricks import NEEDED, OFF, TRICKS, needed_tricks, read_tricks
from tests.models import DOWN_Y, PIN

SWITCHED = frozenset(TRICKS) - frozenset(needed_tricks())  # those that a switch takes on this release


@pytest.mark.parametrize(
    ("release", "needed"),
    [
        ("0.10.1", {"sequential_lapack"}),
        ("0.10.2", {"ynn_fusion", "sequential_lapack"}),
        ("0.11.2", set()),
        ("0.12.0.1", set()),
    ],
)
def test_tricks_that_a_release_needs(release, needed):
    assert needed_tricks(release).keys() == needed and needed <= NEEDED.keys() <= TRICKS.keys()
    assert all(release in reason for reason in needed_tricks(release).values())


def test_no_switch_takes_a_trick_that_is_needed(monkeypatch):
    monkeypatch.setattr("jaxmbs.runtime._tricks.needed_tricks", lambda: {"ynn_fusion": "wrong without it"})
    for setting in ("none", "-ynn_fusion", "remat"):
        assert "ynn_fusion" not in read_tricks(setting)
    with without_tricks():
        assert is_on("ynn_fusion") and not is_on("codegen_split")
        given = compiler_options("full", "cpu")
        assert OPTIONS["codegen_split"] not in given
        assert OPTIONS["ynn_fusion"] in given or OPTIONS["ynn_fusion"] in os.environ.get("XLA_FLAGS", "")


def test_settings():
    assert read_tricks("") == frozenset()
    assert read_tricks("none") == SWITCHED
    assert read_tricks("-remat, -small_call") == {"remat", "small_call"}
    assert read_tricks("remat,small_call") == SWITCHED - {"remat", "small_call"}


@pytest.mark.parametrize("setting", ["-no_such_trick", "remat,-small_call", "none,remat"])
def test_other_settings_are_refused(setting):
    with pytest.raises(ValueError, match="JAXMBS_TRICKS=.*small_call"):
        read_tricks(setting)


@pytest.mark.long
def test_the_environment_switches_them_for_a_process():
    code = "from jaxmbs.runtime import is_on; print(is_on('remat'), is_on('small_call'))"
    environment = {**os.environ, "JAXMBS_TRICKS": "-remat"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout.split() == ["False", "True"]


def test_a_context_switches_them():
    before = OFF.value
    with without_tricks("remat"):
        assert not is_on("remat") and OFF.value == before | {"remat"}
        with without_tricks():
            assert OFF.value == SWITCHED
        state = {trick.name: trick for trick in trick_states()}["remat"]
        assert state.state == "off" and "JAXMBS_TRICKS" in state.reason
    assert OFF.value == before
    with pytest.raises(ValueError, match="no_such_trick"), without_tricks("no_such_trick"):
        pass
    with pytest.raises(KeyError):
        is_on("no_such_trick")


def test_every_trick_has_a_state():
    states = trick_states()
    assert [trick.name for trick in states] == list(TRICKS)
    assert {trick.state for trick in states} <= {"on", "off", "needed", "not available"}
    assert all(trick.reason for trick in states if trick.state != "on")


def test_a_switched_program_is_traced_anew():
    """Of the library's `jit` too: the same function, with and without a trick."""
    count = []
    question = jit(lambda x: x + (count.append(is_on("remat")) or 1.0))
    with OFF(frozenset()):
        question(1.0)
        with without_tricks("remat"):
            question(1.0)
        question(1.0)
    assert count == [True, False]


def test_small_matrices_without_elimination():
    rng = np.random.default_rng(0)
    A, b = rng.normal(size=(3, 5, 5)) + 3.0 * np.eye(5), rng.normal(size=(3, 5))
    assert len(A[0]) <= tuning.ELIMINATED_UNKNOWNS
    with without_tricks("gauss_jordan"):
        found = jax.jit(jax.vmap(solve))(A, b)
    np.testing.assert_allclose(found, np.linalg.solve(A, b[..., None])[..., 0], rtol=1e-11)


def triangle():
    """A closed loop of three bars and a pendulum on it."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name in ("one", "two", "three", "bob"):
        b.body(name, mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
    b.joint("A", PIN, "ground", "one")
    b.joint("B", PIN, "one", "two", parent_frame=(0.4, 0.0, 0.0))
    b.joint("D", PIN, "ground", "three", parent_frame=(1.0, 0.0, 0.0))
    b.joint("C", PIN, "two", "three", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
    b.joint("E", PIN, "two", "bob", parent_frame=(0.5, 0.0, 0.0))
    return b.build()


SYSTEM = triangle()
STATE = mbs.State.at(SYSTEM, A=0.7, E=0.2, velocities={"A": 3.0, "E": -1.0}, guess={"B": -0.2, "D": 1.2})


def answers():
    """Accelerations and loads of two states, with the derivative of one of them."""

    def one(scale):
        state = mbs.State(STATE.t, STATE.coordinates, scale * STATE.velocities)
        return mbs.forward_dynamics(SYSTEM, state)[0], mbs.reactions(SYSTEM, state)["A"].force

    scales = jnp.array([1.0, 0.5])
    return jit(lambda s: (jax.vmap(one)(s), jax.grad(lambda x: jnp.sum(one(x)[0] ** 2))(s[0])))(scales)


ANSWERS = []


@pytest.mark.long
@pytest.mark.parametrize("trick", ["all", *TRICKS])
def test_answers_do_not_depend_on_a_trick(trick):
    if not ANSWERS:
        ANSWERS.append(answers())
    with without_tricks(*() if trick == "all" else (trick,)):
        found = answers()
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9), found, ANSWERS[0])
