"""Commands that analyse a mechanism."""

import argparse
import sys

import numpy as np

from .. import verbs
from ..assembly._state_report import shown_coordinates
from ..motion import Motion
from ..ode import Rodas5P
from ._files import write_table
from ._models import build_imported, read, read_state
from ._terminal import print_note, print_result


def check(options: argparse.Namespace) -> int:
    """Print the parts of a model, its mobility and redundancy, and what its file had besides."""
    model = read(options)
    print_result(build_imported(model).describe())
    for sentence in model.remarks:
        print_result(sentence)
    return 0


def simulate(options: argparse.Namespace) -> int:
    """The motion to `--t1`; status 1 where it fails, what was computed is written all the same."""
    system, state = read_state(options)
    ts = np.linspace(float(state.t), options.t1, options.steps + 1)
    solver = Rodas5P() if options.stiff else None
    motion = verbs.simulate(system, state, ts=ts, solver=solver, progress=sys.stderr.isatty(), throw=False)
    if options.out:
        write_table(motion, options.out)
    else:
        _summarise(system, motion)
    if not bool(motion.ok):
        print_note(f"error: {motion.status}, at t = {float(motion.end.t):.6g} s")
        return 1
    return 0


def _summarise(system, motion: Motion):
    energy = np.asarray(motion.diagnostics.kinetic + motion.diagnostics.potential)
    print_result(f"{motion.status}: {len(motion.ts)} times to {float(motion.end.t):.6g} s")
    print_result(
        f"energy residual {np.max(np.abs(motion.diagnostics.energy_residual)):.3g} J of {np.ptp(energy):.3g} J moved"
    )
    rows = [(name, values) for name, values, _ in shown_coordinates(motion.states)]
    width = max((len(name) for name, _ in rows), default=5)
    print_result(f"{'joint':<{width}}  {'start':>12}  {'end':>12}  {'least':>12}  {'most':>12}")
    for name, x in rows:
        print_result(f"{name:<{width}}  {x[0]:>12.6g}  {x[-1]:>12.6g}  {x.min():>12.6g}  {x.max():>12.6g}")


def reactions(options: argparse.Namespace) -> int:
    """Forces and moments of all joints in a pose."""
    system, state = read_state(options)
    loads = verbs.reactions(system, state)
    if options.out:
        write_table(loads, options.out)
        return 0
    width = max((len(name) for name in loads), default=5)
    print_result(f"{'joint':<{width}}" + "".join(f"  {what:>12}" for what in _COMPONENTS))
    for name, load in loads.items():
        numbers = [*np.asarray(load.force), *np.asarray(load.moment)]
        marks = [*load.unique_force, *load.unique_moment]
        cells = [f"{x:.6g}{'' if known else '*'}" for x, known in zip(numbers, marks, strict=True)]
        print_result(f"{name:<{width}}" + "".join(f"  {cell:>12}" for cell in cells))
    if any(not all([*load.unique_force, *load.unique_moment]) for _, load in loads.items()):
        print_result("* not determined by statics alone; in world axes, as the numbers")
    short = [name for name, load in loads.items() if load.lacks_contact is not None and load.lacks_contact]
    if short:
        print_result(f"bearings carry no contact forces of {', '.join(loads.rows)}: {', '.join(short)}")
    return 0


_COMPONENTS = ("force x [N]", "y", "z", "moment x [N m]", "y", "z")


def modes(options: argparse.Namespace) -> int:
    """Frequencies and damping ratios of small motions."""
    system, state = read_state(options)
    if not options.here:
        found = verbs.equilibrium(system, state)
        state = found.state
        print_note(found.reason)
        if not bool(found.stable) and not any(group.law.stores for group in system.forces):
            print_note("no spring or motor holds its joints: these are motions under weight alone")
    modes = verbs.modes(system, state)
    if options.out:
        write_table(modes, options.out)
        return 0
    print_result(f"{'mode':>4}  {'frequency [Hz]':>14}  {'damping ratio':>14}")
    for k, (frequency, ratio) in enumerate(zip(modes.frequencies, modes.damping_ratios, strict=True)):
        print_result(f"{k:>4}  {float(frequency):>14.6g}  {float(ratio):>14.6g}")
    return 0
