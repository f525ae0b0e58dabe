"""Friction of joints from their own loads: a four-bar with no, one and four rubbing joints, and case FR2.

Of the four-bar: one rate, one step and one motion, its first call, and its gradient; of FR2 the torque of the drive
at 36 angles of each of a thousand turns, with its derivative by the coefficient of friction.
"""

import common
import four_bars
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs.friction import SmoothCoulomb

CRANK, ROD, SPEED, MU = 0.1, 0.3, 20.0, 0.12
RUBBING = {"frictionless": (), "one joint": ("D",), "all joints": ("A", "B", "C", "D")}
END, MU_OF_BARS = 1.0, 0.1
TURNS, ANGLES = 1000, 36


def four_bar(rubbing, mu=MU_OF_BARS, like=None):
    """The nominal four-bar, some of whose pins rub."""
    lengths = four_bars.LENGTHS
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    for name in four_bars.BARS:
        inertia = mbs.inertia.rod(lengths[name], lengths[name])
        b.body(name, mass=lengths[name], com=(lengths[name] / 2, 0, 0), inertia=inertia)
    ends = {name: (lengths[name], 0.0, 0.0) for name in lengths}
    pin = mbs.Revolute("y")
    b.joint("A", pin, "ground", "crank")
    b.joint("B", pin, "crank", "coupler", parent_frame=ends["crank"])
    b.joint("D", pin, "ground", "rocker", parent_frame=ends["ground"])
    b.joint("C", pin, "coupler", "rocker", parent_frame=ends["coupler"], child_frame=ends["rocker"])
    for name in rubbing:
        b.friction(f"rub {name}", name, SmoothCoulomb(mu, transition_speed=0.05), radius=0.02)
    return b.build(like=like)


def four_bar_rows(rounds):
    """Rows of the four-bar, each beside the frictionless one."""
    programs, runs, steps, mu = {}, {}, {}, jnp.asarray(MU_OF_BARS)
    for name, rubbing in RUBBING.items():
        system = four_bar(rubbing)
        start = mbs.State.at(system, A=four_bars.START, guess={"B": 0.8, "D": 1.5}, velocities={"A": 2.0})

        def rate(state, system=system):
            return mbs.dynamics.forward_dynamics(system, state)[0]

        def run(mu, rubbing=rubbing, system=system, start=start):
            motion = mbs.simulate(four_bar(rubbing, mu, system), start, ts=np.array([0.0, END]))
            return jnp.sum(motion.end.coordinates), motion.diagnostics.num_steps

        runs[name] = run, mu
        of_rate, _ = common.compiled(rate, start)
        of_run, _ = common.compiled(run, mu)
        steps[name] = int(of_run(mu)[1])
        programs |= {
            (name, "rate"): lambda program=of_rate, start=start: program(start),
            (name, "motion"): lambda program=of_run, mu=mu: program(mu),
        }
        if rubbing:
            of_gradient, _ = common.compiled(jax.grad(run, has_aux=True), mu)
            programs[name, "gradient"] = lambda program=of_gradient, mu=mu: program(mu)
    first_call = common.compile_seconds(runs, min(rounds, 3))
    seconds = common.cpu_seconds(programs, rounds, least=0.1)
    plain, rows = "frictionless", []
    for name in tuple(RUBBING)[1:]:
        case = f"four-bar, {name}"
        step = {key: seconds[key, "motion"] / steps[key] for key in (name, plain)}
        rows += [
            common.row(case, "one rate", seconds[name, "rate"], "s CPU", plain, seconds[plain, "rate"]),
            common.row(case, "one step", step[name], "s CPU", plain, step[plain], "<=2"),
            common.row(case, "motion", seconds[name, "motion"], "s CPU", plain, seconds[plain, "motion"], "<=2"),
            common.row(case, "first call", first_call[name], "s CPU", plain, first_call[plain], "<=1.5"),
            common.row(case, "gradient", seconds[name, "gradient"], "s CPU", "value", seconds[name, "motion"], "<=4"),
        ]
    return rows


def slider_crank(mu=MU, like=None):
    """FR2."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("crank", mass=1e-9, inertia=(1e-12, 1e-12, 1e-12))
    b.body("rod", mass=1.0, com=(0.12, 0, 0), inertia=(1e-4, 0.01, 0.01))
    b.body("slider", mass=2.0, inertia=(1e-3, 1e-3, 1e-3))
    b.joint("A", mbs.Revolute("z"), "ground", "crank", drive=mbs.Ramp(0.0, SPEED))
    b.joint("B", mbs.Revolute("z"), "crank", "rod", parent_frame=(CRANK, 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "slider")
    b.joint("C", mbs.Revolute("z"), "rod", "slider", parent_frame=(ROD, 0, 0))
    b.force("load", mbs.Force((-400.0, 0, 0)), on="slider")
    for name, radius in (("A", 0.02), ("B", 0.015), ("C", 0.012), ("guide", None)):
        b.friction(f"friction {name}", name, SmoothCoulomb(mu, transition_speed=0.01), radius=radius)
    return b.build(like=like)


def fr2_rows(rounds):
    """Rows of FR2: a thousand turns, the torque at so many angles of each, and its derivative."""
    system, turns = slider_crank(), 10 if rounds == 1 else TURNS
    angles = np.linspace(0.0, 2 * np.pi, ANGLES, endpoint=False) + 0.05
    lean = -np.arcsin(CRANK * np.sin(angles) / ROD)
    guess = {"A": angles, "B": lean - angles, "guide": CRANK * np.cos(angles) + ROD * np.cos(lean)}
    starts = [
        mbs.State.at(system, t=angle / SPEED, guess={name: value[k] for name, value in guess.items()})
        for k, angle in enumerate(angles)
    ]
    states = jax.tree.map(lambda *x: jnp.stack(x), *starts)
    every = jax.tree.map(lambda x: jnp.tile(x, (turns,) + (1,) * (x.ndim - 1)), states)

    def work(mu, states):
        """Mean power of the drive over speed."""
        found = mbs.inverse_dynamics(slider_crank(mu, system), states, actuators=["A"])
        return jnp.mean(found["A"])

    def forward(mu, states):
        """The same with its derivative: of one parameter by forward mode."""
        return jax.jvp(lambda mu: work(mu, states), (mu,), (jnp.ones_like(mu),))

    mu = jnp.asarray(MU)
    programs = {"forward": common.compiled(forward, mu, every)[0]}
    programs["reverse"] = common.compiled(jax.value_and_grad(work), mu, every)[0]
    calls = {name: lambda program=program: program(mu, every) for name, program in programs.items()}
    seconds = common.cpu_seconds(calls, min(rounds, 3), least=0.1)
    case, what = f"FR2, {turns} turns", f"torque at {ANGLES} angles and derivative"
    return [common.row(case, f"{what}, {mode}", seconds[mode], "s CPU", goal="<3") for mode in programs]


def main():
    options = common.parser(__doc__).parse_args()
    rounds = 1 if options.quick else 7
    common.report([*four_bar_rows(rounds), *fr2_rows(rounds)], options)


if __name__ == "__main__":
    main()
