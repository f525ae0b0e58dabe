"""Error against CPU time on closed-loop and stiff mechanisms at several tolerances.

Cases A02 (four-bar windows through their singular poses), A03 (Andrews' squeezer) and A05 (stiff flyball governor),
each against a converged reference value at its end.  Where Exudyn is installed its generalised alpha method runs the
planar cases, and the rows compare the CPU time to reach Exudyn's accuracy or better.
"""

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass

import common
import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from cases import models

import jaxmbs as mbs

ANDREWS_NAMES = ("beta", "Theta", "gamma", "Phi", "delta", "Omega", "epsilon")
ANDREWS_START = (
    -0.06171389001427645,
    0.0,
    0.45527981916307037,
    0.22266839016588588,
    0.48736497954384256,
    -0.22266839016588588,
    1.2305474445498212,
)
QUICK = ("A02 N=2",)
EXPLICIT, STIFF = ("Dopri8", "Tsit5"), ("Kvaerno5", "Kvaerno3")


@dataclass(frozen=True)
class Case:
    """A mechanism run to `end`; `read(system, state)` at the end is compared with `reference`."""

    name: str
    build: Callable
    start: Callable
    read: Callable
    end: float
    reference: tuple[float, ...]
    solvers: tuple[str, ...] = EXPLICIT
    tolerances: tuple[float, ...] = (1e-4, 1e-6, 1e-8, 1e-10)
    peer: Callable | None = None
    peer_steps: tuple[float, ...] = ()
    peer_radius: float = 0.9


def _window(n, reference):
    return Case(
        f"A02 N={n}",
        lambda: models.n_four_bar(n),
        lambda system: mbs.State.at(system, A0=0.0, velocities={"A0": -1.0}),
        lambda system, state: mbs.position(system, state, "B0")[:2],
        10.0,
        reference,
        peer=lambda exudyn: exudyn.n_four_bar(n),
        peer_steps=(1e-2, 1e-3, 2e-4),
        peer_radius=0.95,
    )


def _andrews_start(system):
    guess = dict(zip(ANDREWS_NAMES[1:], ANDREWS_START[1:], strict=True))
    return mbs.State.at(system, beta=ANDREWS_START[0], guess=guess)


def _governor_start(system):
    still = {"slide": 0.0, "right": 0.0, "left": 0.0}
    pose = {"spin": 0.0, "slide": 0.5, "right": np.pi / 6, "left": np.pi / 6}
    return mbs.State.at(system, pose, velocities={"spin": 2 * np.pi} | still)


# References: N=2, 10 an exact equation of one freedom by DOP853; A03 three computations that agree to 4e-13
# (the published digits are good to nine); A05 a hand Lagrangian by Radau, 7e-12 from its own check.
CASES = (
    _window(2, (0.3284581115364366, 0.9445185381801237)),
    _window(10, (0.20435356098645713, 0.9788971458289958)),
    Case(
        "A03",
        models.andrews,
        _andrews_start,
        lambda system, state: jnp.reshape(system.coordinates(state)["beta"], (1,)),
        0.03,
        (15.810771195153775,),
        peer=lambda exudyn: exudyn.andrews(ANDREWS_START),
        peer_steps=(1e-4, 1e-5, 2e-6),
    ),
    Case(
        "A05",
        models.flyball_governor,
        _governor_start,
        lambda system, state: jnp.reshape(system.coordinates(state)["slide"], (1,)),
        10.0,
        (0.6196229170613065,),
        STIFF,
        (1e-4, 1e-6, 1e-8),
    ),
)


@dataclass(frozen=True)
class Run:
    """One run: case, solver and its setting, error of the compared quantity, CPU seconds, steps."""

    case: str
    solver: str
    setting: str
    error: float
    seconds: float
    steps: int


def our_runs(case, tolerances, rounds):
    """Runs by each solver at each tolerance."""
    system = case.build()
    start = case.start(system)
    for name in case.solvers:
        solver = getattr(diffrax, name)()
        for tolerance in tolerances:

            def simulate(solver=solver, tolerance=tolerance):
                return mbs.simulate(
                    system, start, ts=[case.end], solver=solver, rtol=tolerance, atol=tolerance, throw=False
                )

            motion = simulate()
            if not bool(motion.ok):
                print(f"{case.name} {name} rtol={tolerance:g}: {motion.status}")
                continue
            value = case.read(system, jax.tree.map(lambda x: x[-1], motion.states))
            seconds = common.cpu_seconds({"run": simulate}, rounds, least=0.0)["run"]
            error = float(np.max(np.abs(np.asarray(value) - case.reference)))
            yield Run(case.name, name, f"rtol={tolerance:.0e}", error, seconds, int(motion.diagnostics.num_steps))


def exudyn_runs(case, steps, rounds):
    """Runs by Exudyn at each step size; none where it is not installed or the case has no model there."""
    if case.peer is None or importlib.util.find_spec("exudyn") is None:
        return
    import exudyn_models

    system, read = case.peer(exudyn_models)
    for step in steps:

        def solve(step=step):
            exudyn_models.solve(system, case.end, step, case.peer_radius)

        seconds = common.cpu_seconds({"run": solve}, rounds, least=0.0)["run"]
        error = float(np.max(np.abs(read() - case.reference)))
        yield Run(case.name, "Exudyn gen. alpha", f"h={step:.0e}", error, seconds, round(case.end / step))


def rows_of(ours, peers):
    """Rows of a case: each run of ours, then our cheapest run that is at least as accurate as each of the peer's."""
    rows = []
    for run in ours:
        where = f"{run.solver} {run.setting}"
        rows.append(common.row(run.case, f"error, {where}", run.error, "m or rad"))
        rows.append(common.row(run.case, f"one run, {where}", run.seconds, "s CPU"))
        rows.append(common.row(run.case, f"steps, {where}", run.steps))
    for peer in peers:
        where = f"{peer.solver} {peer.setting} (error {peer.error:.1e})"
        enough = [run for run in ours if run.error <= peer.error]
        if enough:
            best = min(enough, key=lambda run: run.seconds)
            metric = f"one run, {best.solver} {best.setting} (error {best.error:.1e})"
            rows.append(common.row(peer.case, metric, best.seconds, "s CPU", where, peer.seconds))
    return rows


def table(runs, header=True):
    """Error against CPU time as text."""
    line = "{:10}  {:18}  {:11}  {:>9}  {:>9}  {:>7}".format
    lines = [line("case", "solver", "setting", "error", "CPU s", "steps")] if header else []
    lines += [line(r.case, r.solver, r.setting, f"{r.error:.1e}", f"{r.seconds:.3g}", r.steps) for r in runs]
    return "\n".join(lines)


def main():
    options = common.parser(__doc__, *(case.name for case in CASES)).parse_args()
    rounds, header, rows = (1 if options.quick else 3), True, []
    for case in CASES:
        if not common.wanted(options, case.name):
            continue
        if options.quick and not options.only and case.name not in QUICK:
            continue
        tolerances, steps = case.tolerances, case.peer_steps
        if options.quick:
            tolerances, steps = tolerances[1:2], steps[:1]
        ours, peers = list(our_runs(case, tolerances, rounds)), list(exudyn_runs(case, steps, rounds))
        rows += rows_of(ours, peers)
        print(table(ours + peers, header), flush=True)
        header = False
    common.report(rows, options)


if __name__ == "__main__":
    main()
