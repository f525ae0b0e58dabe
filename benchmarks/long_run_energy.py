"""Energy over 10 000 periods: our Gauss methods at a fixed step beside Dopri8 at equal cost and at its default.

Total energy is conserved; its error is given relative to the kinetic energy at its peak.  `band` is the error's range
within the first and the last hundredth of the motion, `drift` its slope per period over the whole of it.
"""

import time
from pathlib import Path

import common
import diffrax
import jax
import numpy as np
from cases import models

import jaxmbs as mbs

STEPS = 60  # of the Gauss methods per period
SAVE_EVERY = 17  # steps: no multiple of the period
DEFAULT = "Dopri8 at 1e-9"
EQUAL = "Dopri8 at equal cost"
METHODS = {"ImplicitMidpoint": mbs.ode.ImplicitMidpoint(), "Gauss4": mbs.ode.Gauss4()}


def three_links():
    """Three rods of 1 m and 1 kg in a row, hinged about z."""
    b = mbs.SystemBuilder(gravity=models.DOWN_Y)
    parent, place = "ground", None
    for i in range(3):
        b.body(f"link_{i}", mass=1.0, com=(0.0, -0.5, 0.0), inertia=mbs.inertia.rod(1.0, 1.0, axis="y"))
        b.joint(f"hinge_{i}", mbs.Revolute(axis="z"), parent, f"link_{i}", parent_frame=place)
        parent, place = f"link_{i}", (0.0, -1.0, 0.0)
    return b.build()


def cases():
    """Name -> (system, start, period [s]); the chain's is that of its slowest small oscillation."""
    pendulum, chain = models.simple_pendulum(), three_links()
    swing = mbs.State.at(pendulum, pivot=1.5)
    bent = mbs.State.at(chain, hinge_0=0.3, hinge_1=0.2, hinge_2=-0.1)
    return {"pendulum 86 deg": (pendulum, swing, 2.0 * 1.1634), "three links": (chain, bent, 2.7)}


def runner(system, start, solver, dt, ts):
    """A motion as a function without arguments."""
    options = {"dt": dt, "solver": solver} if dt else {}
    return lambda: mbs.simulate(system, start, ts=ts, gradient="forward", max_steps=20_000_000, **options)


def save_times(start, dt, count):
    return np.asarray(start.t) + SAVE_EVERY * dt * np.arange(1, count + 1)


def energy_error(system, start, motion):
    """Energy error (T,) relative to the peak kinetic energy."""
    first = float(mbs.dynamics.kinetic_energy(system, start) + mbs.dynamics.potential_energy(system, start))
    account = motion.diagnostics
    return np.asarray(account.kinetic + account.potential - first) / np.max(np.asarray(account.kinetic))


def equal_step(system, start, dt):
    """Step of Dopri8 that costs as much CPU per second of motion as Gauss4 at dt."""
    ts = np.array([2000 * dt])
    runs = {n: runner(system, start, s, dt, ts) for n, s in (("g", mbs.ode.Gauss4()), ("d", diffrax.Dopri8()))}
    seconds = common.cpu_seconds(runs, 3, least=0.1)
    return dt * seconds["d"] / seconds["g"]


def measure(name, system, start, period, periods):
    """Rows, and {method: (times [periods], error)}."""
    dt = period / STEPS
    cheap = equal_step(system, start, dt)
    plans = {n: (solver, dt) for n, solver in METHODS.items()}
    plans |= {EQUAL: (diffrax.Dopri8(), cheap), DEFAULT: (None, None)}
    curves, results = {}, {}
    for method, (solver, step) in plans.items():
        grid = step or dt
        ts = save_times(start, grid, int(periods * period / grid / SAVE_EVERY))
        run = runner(system, start, solver, step, ts)
        jax.block_until_ready(run())  # compiles
        before = time.process_time()
        motion = jax.block_until_ready(run())
        seconds = time.process_time() - before
        error, cycles = energy_error(system, start, motion), ts / period
        results[method] = summary(cycles, error) | {
            "one run": seconds,
            "steps per period": int(motion.diagnostics.num_steps) / periods,
        }
        curves[method] = cycles, error
        print(f"{name}: {method}: {motion.status}, {results[method]}", flush=True)
    return _rows(f"{name}, {periods} periods", results), curves


def summary(cycles, error):
    """Ranges of the error at the start and the end, its largest value, its slope per period."""
    few = max(len(error) // 100, 2)
    return {
        "band at the start": float(np.ptp(error[:few])),
        "band at the end": float(np.ptp(error[-few:])),
        "largest error": float(np.max(np.abs(error))),
        "drift per period": abs(float(np.polyfit(cycles, error, 1)[0])),
    }


def _rows(case, results):
    units = {"one run": "s CPU", "steps per period": ""}
    return [
        common.row(case, f"{metric}, {ours}", results[ours][metric], units.get(metric, "of peak KE"), peer, value)
        for ours in METHODS
        for peer in (EQUAL, DEFAULT)
        for metric, value in results[peer].items()
    ]


def plot(file, curves):
    """Energy errors over the number of periods, logarithmic."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(curves), figsize=(11, 4), layout="constrained", squeeze=False)
    for ax, (case, methods) in zip(axes[0], curves.items(), strict=True):
        for method, (cycles, error) in methods.items():
            largest = np.maximum.accumulate(np.maximum(np.abs(error), 1e-17))
            ax.loglog(cycles, largest, label=method)
        ax.set(xlabel="periods", ylabel="largest energy error so far / peak kinetic energy", title=case)
    axes[0][0].legend()
    figure.savefig(file, dpi=120)
    plt.close(figure)
    print(f"wrote {file}")


def main():
    parser = common.parser(__doc__)
    parser.add_argument("--plot", metavar="FILE", help="picture of the errors (default: beside --json)")
    options = parser.parse_args()
    rows, curves = [], {}
    for name, case in cases().items():
        new, curves[name] = measure(name, *case, 100 if options.quick else 10_000)
        rows += new
    common.report(rows, options)
    file = options.plot or (options.json and Path(options.json).with_suffix(".png"))
    if file:
        plot(file, curves)


if __name__ == "__main__":
    main()
