"""First and later motions with their loads, and rows of loops through singular poses, for `cold_start.py`.

Each function takes `lap(name)`, which notes the CPU seconds since it was called last, and `found`, the figures.
Later answers are those of compiled programs ("full"), the least of ten.
"""

import functools
import time

import first_answers
import first_machines
import jax
import numpy as np

import jaxmbs as mbs

PIN, X = mbs.Revolute("z"), np.array([1.0, 0.0, 0.0])


def four_bar():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7)):
        b.body(name, mass=1.0, com=X * length / 2.0, inertia=mbs.inertia.rod(1.0, length))
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=X * 0.3)
    b.joint("D", PIN, "ground", "rocker", parent_frame=X)
    b.joint("C", PIN, "coupler", "rocker", parent_frame=X * 0.9, child_frame=X * 0.7)
    system = b.build()
    return system, mbs.State.at(system, A=0.7, velocities={"A": 3.0}, guess={"B": -0.2, "D": 1.2}), 1.0


def press():
    guess = {"crank pin": -np.pi + 0.1, "head": -2.1, "knee": 1.0, "guide": 0.3}
    system = first_answers.toggle_press(first_answers.LINKS)
    return system, mbs.State.at(system, shaft=np.pi, velocities={"shaft": 6.45}, guess=guess), 0.5


def hydraulic():
    import hydraulic_arm

    system, pressures = hydraulic_arm.arm(), enumerate(hydraulic_arm.START)
    return system, mbs.State.at(system, pin=0.0, internal={f"cylinder.p{k}": p for k, p in pressures}), 0.4


def cables():
    system = first_machines.hoist(0.4)
    return system, mbs.State.at(system), 1.0


def motion(machine, lap, found):
    """A motion with all reactions along it: the first answers, then compiled ones."""
    system, start, end = machine()
    lap("build")
    simulate = lambda system, start: mbs.simulate(system, start, ts=np.linspace(0.0, end, 101))
    states = jax.block_until_ready(simulate(system, start))
    lap("first motion")
    jax.block_until_ready(mbs.reactions(system, states))
    lap("first reactions")
    questions = {"motion": (simulate, system, start), "reactions": (mbs.reactions, system, states)}
    for name, (question, *args) in questions.items():
        program, runs = mbs.jit(question, compile="full"), []
        for _ in range(11):
            before = time.process_time()
            jax.block_until_ready(program(*args))
            runs.append(time.process_time() - before)
        found[f"later {name}, run"] = 1e3 * min(runs[1:])
    lap("(compiled)")


def singular(n, lap, found):
    """A row of n four-bars passes twelve singular poses in 10 s: errors of both, over those tolerances."""
    from cases import models

    system = models.n_four_bar(n)
    state, angle = models.n_four_bar_state(system, 0.0), models.n_four_bar_angle(n, 0.0, 10.0)
    gravity = models.n_four_bar_acceleration(n, np.pi / 2)  # by the angle: its slope g sin(angle) has an energy
    rate = -np.sqrt(1.0 + 2.0 * gravity * (1.0 - np.cos(angle)))
    options = {"ts": np.array([0.0, 10.0]), "max_steps": 100_000}
    for tolerance in (1e-8, 1e-9, 3e-10, 1e-10, 3e-11):
        motion = mbs.simulate(system, state, rtol=tolerance, atol=tolerance, **options)
        found[f"rtol {tolerance:g}: error of the angle"] = abs(float(motion.states.coordinates[-1, 0]) - angle)
        speed = float(motion.states.velocities[-1, 0])
        found[f"rtol {tolerance:g}: error of the velocity"] = abs(speed - rate)
        found[f"rtol {tolerance:g}: steps"] = int(motion.diagnostics.num_steps)


CASES = {f"motion of {f.__name__}": functools.partial(motion, f) for f in (four_bar, press, hydraulic, cables)}
CASES |= {f"singular {n}": functools.partial(singular, n) for n in (10, 40, 160)}
