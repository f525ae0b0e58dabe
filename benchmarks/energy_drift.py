"""Energy error of a frictionless chain of ten links over 10 s: our default beside MuJoCo's Euler and RK4.

Total energy is conserved; its error is given relative to the peak kinetic energy.  All motions are judged by the same
function, this library's kinetic and potential energy.
"""

from pathlib import Path

import common
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from link_chain import START, mujoco_model, our_start, our_system

import jaxmbs as mbs

GOAL = 1e-7
DT = 1e-3
OURS = "jaxmbs default (Dopri8, 1e-9)"
MUJOCO = {"MuJoCo Euler 1 ms (its default)": "Euler", "MuJoCo RK4 1 ms": "RK4"}


def ours(system, ts):
    """Our motion at the defaults, as a function without arguments."""
    start = our_start(system)
    return lambda: mbs.simulate(system, start, ts=ts)


def theirs(integrator, ts):
    """Coordinates and velocities (T, 10) of MuJoCo at the same times, as a function without arguments."""
    model = mujoco_model(integrator, DT)
    data = mujoco.MjData(model)

    def run():
        mujoco.mj_resetData(model, data)
        data.qpos[:] = START
        states, done = [], 0
        for steps in np.round(ts / DT).astype(int):
            if steps > done:
                mujoco.mj_step(model, data, nstep=steps - done)
            done = steps
            states.append((data.qpos.copy(), data.qvel.copy()))
        return tuple(map(np.stack, zip(*states, strict=True)))

    return run


def energy_error(system, ts, q, v):
    """Error of the total energy (T,) and the peak kinetic energy [J]."""
    states = mbs.State(jnp.asarray(ts), jnp.asarray(q), jnp.asarray(v))
    kinetic = np.asarray(jax.vmap(lambda s: mbs.dynamics.kinetic_energy(system, s))(states))
    potential = np.asarray(jax.vmap(lambda s: mbs.dynamics.potential_energy(system, s))(states))
    total = kinetic + potential
    return total - total[0], np.max(kinetic)


def measure(end, rounds):
    """Rows, times and the curves {name: error over time relative to the peak kinetic energy}."""
    system = our_system()
    ts = np.linspace(0.0, end, round(end / 0.05) + 1)
    runs = {OURS: ours(system, ts)} | {name: theirs(integrator, ts) for name, integrator in MUJOCO.items()}
    seconds = common.cpu_seconds(runs, rounds, least=0.1)
    motion = runs[OURS]()
    states = {name: runs[name]() for name in MUJOCO}
    states[OURS] = motion.states.coordinates, motion.states.velocities
    errors = {name: energy_error(system, ts, *states[name]) for name in runs}
    peak = errors[OURS][1]
    curves = {name: np.abs(error) / peak for name, (error, _) in errors.items()}
    steps = int(motion.diagnostics.num_steps), round(end / DT)
    return _rows(f"chain N=10 t={end:g} s", seconds, steps, curves, peak), ts, curves


def _rows(case, seconds, steps, curves, peak):
    worst = {name: np.max(curve) for name, curve in curves.items()}
    rows = [common.row(case, "peak kinetic energy", peak, "J")]
    for peer in MUJOCO:
        rows += [
            common.row(case, "largest energy error", worst[OURS], "of peak KE", peer, worst[peer], f"<{GOAL:g}"),
            common.row(case, "one run", seconds[OURS], "s CPU", peer, seconds[peer]),
            common.row(case, "steps", steps[0], "", peer, steps[1]),
        ]
    return rows


def over_time(ts, curves):
    """The largest error so far, at a few times, as text."""
    marks = np.unique(np.linspace(0, len(ts) - 1, 6).astype(int)[1:])
    lines = ["largest energy error so far, of peak kinetic energy"]
    lines.append(f"{'t [s]':34}" + "".join(f"{ts[i]:>10.3g}" for i in marks))
    lines += [f"{name:34}" + "".join(f"{np.max(c[: i + 1]):>10.1e}" for i in marks) for name, c in curves.items()]
    return "\n".join(lines)


def plot(file, ts, curves):
    """Energy error over time on a logarithmic axis."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(7, 4), layout="constrained")
    for name, curve in curves.items():
        ax.semilogy(ts[1:], np.maximum(curve[1:], 1e-17), label=name)
    ax.axhline(GOAL, color="grey", linestyle=":", linewidth=1)
    ax.set(xlabel="time [s]", ylabel="energy error / peak kinetic energy", title="Frictionless chain of ten links")
    ax.legend()
    figure.savefig(file, dpi=150)
    plt.close(figure)
    print(f"wrote {file}")


def main():
    parser = common.parser(__doc__)
    parser.add_argument("--plot", metavar="FILE", help="picture of the errors (default: beside --json)")
    options = parser.parse_args()
    rows, ts, curves = measure(1.0, 1) if options.quick else measure(10.0, 5)
    print(over_time(ts, curves))
    common.report(rows, options)
    file = options.plot or (options.json and Path(options.json).with_suffix(".png"))
    if file:
        plot(file, ts, curves)


if __name__ == "__main__":
    main()
