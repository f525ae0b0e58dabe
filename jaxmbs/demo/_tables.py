"""Tables that the demo prints."""

import numpy as np

from ..tables import aligned
from ._loads import rms
from ._reference import FREE_ANGLE, FREE_TOLERANCE, LOADS, SOURCE, TIMES


def deviations(loads) -> dict[str, float]:
    """Largest deviation from the reference by quantity; loads at the times of the reference."""
    return {
        name: float(np.max(np.abs(np.asarray(getattr(loads, name)) - np.array(reference.values))))
        for name, reference in LOADS.items()
    }


def free_deviation(angle) -> float:
    """Largest deviation of the crank angle (4,) of the free run from its reference [rad]."""
    return float(np.max(np.abs(angle - np.array(FREE_ANGLE))))


def reference_table(loads, deviation) -> str:
    """Loads beside the reference: a row per quantity and time."""
    head = ("quantity", "t [s]", "computed", "reference", "deviation", "")
    rows = [head]
    for name, reference in LOADS.items():
        found = np.asarray(getattr(loads, name))
        for i, t in enumerate(TIMES):
            label = f"{reference.label} [{reference.unit}]" if i == 0 else ""
            gap = np.max(np.abs(found[i] - np.array(reference.values[i])))
            mark = "ok" if gap <= reference.tolerance else f"above {reference.tolerance:.0e}"
            rows.append((label, f"{t:g}", _numbers(found[i]), _numbers(reference.values[i]), f"{gap:.1e}", mark))
    worst = max(deviation[name] / reference.tolerance for name, reference in LOADS.items())
    verdict = "all within tolerance" if worst <= 1 else "NOT within tolerance"
    return f"{aligned(rows, left=1)}\nreference: {SOURCE}; {verdict}"


def energy_table(motion, deviation) -> str:
    """Energy account of the free run."""
    accounts = motion.diagnostics
    peak = float(np.max(accounts.kinetic))
    rows = [
        ("peak kinetic energy [J]", f"{peak:.6g}"),
        ("largest energy residual [J]", f"{np.max(np.abs(accounts.energy_residual)):.1e}"),
        ("largest constraint residual", f"{np.max(accounts.constraint_drift):.1e}"),
        ("integrator steps", f"{int(accounts.num_steps)}"),
        ("crank angle against reference [rad]", f"{deviation:.1e} (tolerance {FREE_TOLERANCE:.0e})"),
    ]
    return "\n".join(f"  {label:<36} {value}" for label, value in rows)


def load_measures(loads) -> dict[str, float]:
    """The figures a designer looks at, over one turn."""
    peak = lambda force: float(np.max(np.linalg.norm(np.asarray(force), axis=1)))
    return {
        "shaking force, RMS [N]": float(rms(loads.shaking)),
        "shaking force, peak [N]": peak(loads.shaking),
        "main bearing, peak [N]": peak(loads.main),
        "crank pin, peak [N]": peak(loads.crank_pin),
        "wrist pin, peak [N]": peak(loads.wrist),
        "guide, peak [N]": peak(loads.guide),
        "driving torque, peak [N m]": peak(loads.torque),
    }


def comparison_table(before, after) -> str:
    """Loads over one turn of two designs, with the change in percent."""
    rows = [("over one turn", "before", "after", "change")]
    for (label, first), last in zip(load_measures(before).items(), load_measures(after).values(), strict=True):
        rows.append((label, f"{first:.1f}", f"{last:.1f}", f"{100 * (last / first - 1):+.1f} %"))
    return aligned(rows, left=1)


def _numbers(values) -> str:
    return "  ".join(f"{value:12.6f}" for value in values)
