"""Energy error of a frictionless chain of ten links over 10 s: our default beside MuJoCo's Euler and RK4.

Total energy is conserved; its error is given relative to the peak kinetic energy.  All motions are judged by the same
function, this library's kinetic and potential energy.
"""

import time
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
MUJOCO = {"MuJoCo Euler 1 ms (its default)": "Euler", "MuJoCo RK4 1 ms": "RK4"}


def ours(system, end, ts):
    """Coordinates and velocities (T, 10) at our defaults, and CPU seconds of a compiled run."""
    start = our_start(system)
    mbs.simulate(system, start, ts=ts)
    began = time.process_time()
    motion = mbs.simulate(system, start, ts=ts)
    jax.block_until_ready(motion)
    seconds = time.process_time() - began
    return (motion.states.coordinates, motion.states.velocities), seconds, int(motion.diagnostics.num_steps)


def theirs(integrator, ts):
    """Coordinates and velocities (T, 10) of MuJoCo at the same times."""
    model = mujoco_model(integrator, DT)
    data = mujoco.MjData(model)
    data.qpos[:] = START
    states, done = [], 0
    began = time.process_time()
    for t in ts:
        steps = round(t / DT)
        if steps > done:
            mujoco.mj_step(model, data, nstep=steps - done)
        done = steps
        states.append((data.qpos.copy(), data.qvel.copy()))
    return tuple(map(np.stack, zip(*states, strict=True))), time.process_time() - began, done


def energy_error(system, ts, q, v):
    """Error of the total energy (T,) and the peak kinetic energy [J]."""
    states = mbs.State(jnp.asarray(ts), jnp.asarray(q), jnp.asarray(v))
    kinetic = np.asarray(jax.vmap(lambda s: mbs.kinetic_energy(system, s))(states))
    potential = np.asarray(jax.vmap(lambda s: mbs.potential_energy(system, s))(states))
    total = kinetic + potential
    return total - total[0], np.max(kinetic)


def measure(end):
    """Rows and the curves {name: error over time relative to the peak kinetic energy}."""
    system = our_system()
    ts = np.linspace(0.0, end, round(end / 0.05) + 1)
    runs = {"jaxmbs default (Dopri8, 1e-9)": ours(system, end, ts)}
    runs |= {name: theirs(integrator, ts) for name, integrator in MUJOCO.items()}
    errors = {name: energy_error(system, ts, *states) for name, (states, _, _) in runs.items()}
    peak = next(iter(errors.values()))[1]
    curves = {name: np.abs(error) / peak for name, (error, _) in errors.items()}
    return _rows(f"chain N=10 t={end:g} s", runs, curves, peak), ts, curves


def _rows(case, runs, curves, peak):
    name, *peers = runs
    worst = {key: np.max(curve) for key, curve in curves.items()}
    rows = [common.row(case, "peak kinetic energy", peak, "J")]
    for peer in peers:
        rows += [
            common.row(case, "largest energy error", worst[name], "of peak KE", peer, worst[peer], f"<{GOAL:g}"),
            common.row(case, "one run", runs[name][1], "s CPU", peer, runs[peer][1]),
        ]
    return [*rows, common.row(case, "steps", runs[name][2], "", peers[0], runs[peers[0]][2])]


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
    rows, ts, curves = measure(1.0 if options.quick else 10.0)
    print(over_time(ts, curves))
    common.report(rows, options)
    file = options.plot or (options.json and Path(options.json).with_suffix(".png"))
    if file:
        plot(file, ts, curves)


if __name__ == "__main__":
    main()
