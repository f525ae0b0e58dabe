"""Calls a compiled study of many lanes again and again; exit code 3 where a call makes no progress.

usage: python -m tests.runtime.watchdog PROGRAM LANES CALLS, in the environment as it comes.
"""

import os
import sys
import threading
import time

import jax
import jax.numpy as jnp

import jaxmbs as mbs
from jaxmbs import vibration
from jaxmbs.vibration._modes import natural_modes
from tests.models import four_bar as planar_four_bar
from tests.models import four_bar_angles
from tests.structural_matrices import beam
from tests.zoo.mechanisms import four_bar, four_bar_state

PATIENCE = 120.0  # seconds without a finished call


def _motion():
    """Motion of a closed loop and a reaction in it."""
    system = four_bar()
    start = four_bar_state(system)

    def lane(t):
        state = mbs.State(start.t, start.coordinates, start.velocities * (1.0 + t))
        return mbs.reactions(system, mbs.simulate(system, state, t1=0.2, throw=False))["main"].force

    return lane


def _driven():
    """A loop without freedom, its crank driven."""
    system = planar_four_bar(drive=lambda t: 0.7 + 2.0 * t)
    _, knee, rocker = four_bar_angles(0.7)

    def lane(t):
        state = mbs.State.at(system, t=0.1 * t, guess={"A": 0.7, "B": knee, "D": rocker})
        motion = mbs.simulate(system, state, ts=0.1 * t + jnp.linspace(0.0, 0.5, 5), throw=False)
        return mbs.reactions(system, motion)["A"].force

    return lane


def _equilibrium():
    system = four_bar()
    start = four_bar_state(system, rate=0.0)

    def lane(t):
        state = mbs.State(start.t, start.coordinates * (1.0 + 0.01 * t), start.velocities)
        return mbs.equilibrium(system, state, throw=False).stiffness

    return lane


def _modes():
    """Eigenproblems by LAPACK, and the receptance of the modes."""
    K, M = beam(10)

    def lane(t):
        held = K * (1.0 + t) + jnp.eye(len(K))
        return natural_modes(K=held, M=M).values, vibration.receptance(
            K=held, M=M, omega=jnp.linspace(1.0, 9.0, 5), out=(0,), into=(0,)
        )

    return lane


PROGRAMS = {"motion": _motion, "driven": _driven, "equilibrium": _equilibrium, "modes": _modes}


def main(name, lanes, calls):
    """Runs the program; the process ends here, with 0 or 3."""
    jax.config.update("jax_enable_x64", True)
    lanes = jnp.linspace(0.0, 0.1, lanes)
    program = jax.jit(jax.vmap(PROGRAMS[name]())).lower(lanes).compile()
    finished = 0

    def watch():
        before = -1
        while True:
            time.sleep(PATIENCE)
            if finished == before:
                print(f"HANG in call {finished + 1} of {calls}", flush=True)
                os._exit(3)
            before = finished

    threading.Thread(target=watch, daemon=True).start()
    for _ in range(calls):
        jax.block_until_ready(program(lanes))
        finished += 1
    print(f"{finished} calls of {name}", flush=True)
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
