"""The mechanisms of `solvers.py`: what each starts from, what is compared at its end, and its twins elsewhere."""

from collections.abc import Callable
from dataclasses import dataclass

import closed_loop
import first_answers
import first_machines
import four_bars
import jax.numpy as jnp
import link_chain
import numpy as np
from cases import models

import jaxmbs as mbs

SWING = 0.75  # end of the four-bar's motion [s]: at 1 s it comes to rest, where errors hardly move it
STRUT = {"stiffness": 1e7, "damping": 2e3, "length": 1.0, "mass": 1.0}  # its mode: 3160 rad/s, damped by a third


@dataclass(frozen=True)
class Case:
    """A mechanism run to `end`; `read(system, state)` there is compared with `reference`, None for our own at 1e-12.

    `exudyn(module)` gives (system, read) and is run with steps of each size; `mujoco(step)` gives a function to the
    same numbers.
    """

    name: str
    build: Callable
    start: Callable
    read: Callable
    end: float
    reference: tuple[float, ...] | None = None
    is_stiff: bool = False
    exudyn: Callable | None = None
    exudyn_steps: tuple[float, ...] = ()
    exudyn_radius: float = 0.9
    mujoco: Callable | None = None
    mujoco_steps: tuple[float, ...] = ()


def _from_closed_loop(name, **options):
    """A case of `closed_loop.py`."""
    case = next(case for case in closed_loop.CASES if case.name == name)
    known = {"exudyn": case.peer, "exudyn_steps": case.peer_steps, "exudyn_radius": case.peer_radius}
    return Case(name, case.build, case.start, case.read, case.end, case.reference, **(known | options))


def _one(name):
    """Reader of one coordinate."""
    return lambda system, state: jnp.reshape(system.coordinates(state)[name], (1,))


def _four_bar_in_mujoco(step):
    design = four_bars.LENGTHS | {f"{name} mass": four_bars.LENGTHS[name] for name in four_bars.BARS}
    start = np.asarray(mbs.State.at(four_bars.NOMINAL, A=four_bars.START).coordinates)
    one = {name: np.array([value]) for name, value in design.items()}
    call = four_bars.rolled_out(one, start[None], step, 1, SWING)
    return lambda: call()[0][0, :1]


def _chain_in_mujoco(step):
    import mujoco

    model = link_chain.mujoco_model("RK4", step)
    data = mujoco.MjData(model)
    steps = round(1.0 / step)

    def call():
        mujoco.mj_resetData(model, data)
        data.qpos[:] = link_chain.START
        mujoco.mj_step(model, data, nstep=steps)
        return data.qpos[:1].copy()

    return call


def crank_start(system):
    return mbs.State.at(system, main=0.4, velocities={"main": 5.0}, guess=models.slider_crank_guess(0.4))


def press_start(system):
    guess = {"crank pin": -np.pi + 0.1, "head": -2.1, "knee": 1.0, "guide": 0.3}
    return mbs.State.at(system, shaft=np.pi, velocities={"shaft": 6.45}, guess=guess)


def stiff_strut():
    """A mass that swings on a strut of 1e7 N/m with 2e3 N s/m."""
    b = mbs.SystemBuilder(gravity=models.DOWN_Y)
    b.body("sleeve", mass=0.1, com=(0.1, 0.0, 0.0), inertia=mbs.inertia.rod(0.1, 0.2))
    b.body("mass", mass=STRUT["mass"], inertia=(1e-3, 1e-3, 1e-3))
    b.joint("pin", mbs.Revolute(axis="z"), "ground", "sleeve")
    b.joint("slide", mbs.Prismatic(axis="x"), "sleeve", "mass")
    law = mbs.SpringDamper(stiffness=STRUT["stiffness"], damping=STRUT["damping"], free_length=STRUT["length"])
    b.force("strut", law, joint="slide")
    return b.build()


def _strut_start(system):
    return mbs.State.at(system, pin=0.0, slide=STRUT["length"])


CASES = (
    Case(
        "four-bar",
        lambda: four_bars.NOMINAL,
        lambda system: mbs.State.at(system, A=four_bars.START),
        _one("A"),
        SWING,
        exudyn=lambda exudyn: exudyn.hanging_four_bar(four_bars),
        exudyn_steps=(5e-2, 2.5e-2, 1e-2, 5e-3, 2e-3, 1e-3, 2e-4),
        mujoco=_four_bar_in_mujoco,
        mujoco_steps=(2.5e-2, 1e-2, 5e-3, 2e-3, 1e-3, 2e-4),
    ),
    _from_closed_loop("A02 N=2", exudyn_steps=(2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 2e-4)),
    _from_closed_loop("A02 N=10", exudyn_steps=(2e-2, 1e-2, 5e-3, 1e-3)),
    _from_closed_loop("A03", exudyn_steps=(4e-4, 2e-4, 1e-4, 3e-5, 1e-5, 2e-6)),
    Case(
        "C1",
        models.slider_crank,
        crank_start,
        _one("main"),
        1.0,
        exudyn=lambda exudyn: exudyn.slider_crank(),
        exudyn_steps=(2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 2e-4),
    ),
    Case(
        "chain of 10",
        link_chain.our_system,
        link_chain.our_start,
        _one("hinge_0"),
        1.0,
        mujoco=_chain_in_mujoco,
        mujoco_steps=(2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4),
    ),
    Case(
        "sleigh",
        models.chaplygin_sleigh,
        lambda system: mbs.State.at(system, plane=np.zeros(3), velocities={"plane": np.array((1.0, 0.0, 2.0))}),
        lambda system, state: system.coordinates(state)["plane"][:2],
        4.0,
        (2.737392989568389, 4.4188591322339725),
    ),
    Case(
        "press",
        lambda: first_answers.toggle_press(first_answers.LINKS),
        press_start,
        _one("guide"),
        1.6,
        is_stiff=True,
    ),
    Case(
        "elastic four-bar",
        lambda: first_machines.elastic_four_bar()[0],
        lambda system: first_machines.elastic_four_bar()[1],
        _one("A"),
        0.2,
        is_stiff=True,
    ),
    Case(
        "stiff strut",
        stiff_strut,
        _strut_start,
        _one("pin"),
        1.0,
        is_stiff=True,
        exudyn=lambda exudyn: exudyn.stiff_strut(**STRUT),
        exudyn_steps=(2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 2e-4),
        exudyn_radius=0.8,
    ),
    _from_closed_loop(
        "A05",
        is_stiff=True,
        exudyn=lambda exudyn: exudyn.flyball_governor(),
        exudyn_steps=(5e-2, 2e-2, 1e-2, 5e-3, 2e-3, 1e-3),
        exudyn_radius=0.8,
    ),
)
