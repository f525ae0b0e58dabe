"""The hydraulic arm HY1 beside Exudyn, at equal errors, and its gradient.

HY1's oil is of two pressures; its error is that of the norm of the case at 0.4 s.  Exudyn sets the valve once per
step, so that its error falls with the step alone: each takes its largest tolerance or step with the error asked for.
"""

import importlib.util

import common
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import forces as F

NORM, END, START = 7.103804185290831, 0.4, (2e6, 2e6)
RTOL = 1e-6
ERRORS = (1e-3, 1e-4, 1e-5)
RTOLS, STEPS = (
    (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
    (2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6),
)  # ours; Exudyn's
LENGTH = np.sqrt(2 * 0.25**2)


def valve(x, v, t):
    """Twice what is missing to the length wanted."""
    return 2.0 * ((jnp.clip(1.0 - jnp.cos(jnp.pi * t), 0.5, 1.5) - 0.5) * 0.1 + LENGTH - x)


def arm(bulk_modulus=1e11, like=None):
    """HY1."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("arm", mass=120.0, com=(0.5, 0.0, 0.0), inertia=10.0)
    b.joint("pin", mbs.Revolute("z"), "ground", "arm")
    law = F.HydraulicCylinder(
        (0.01, 0.01), (1.0, 1.0), bulk_modulus, valve, 2e-5, supply=2e7, damping=2e5, laminar=1.0
    )
    b.force("cylinder", law, between=(("ground", (0.0, -0.25, 0.0)), ("arm", (0.25, 0.0, 0.0))))
    return b.build(like=like)


def norm(system, rtol=RTOL):
    """Norm of the case at its end."""
    start = mbs.State.at(system, pin=0.0, internal={f"cylinder.p{k}": p for k, p in enumerate(START)})
    motion = mbs.simulate(system, start, t1=END, ts=np.array([0.0, END]), rtol=rtol, atol=rtol)
    angle = system.coordinates(motion.states)["pin"][-1]
    centre = jnp.stack([0.5 * jnp.cos(angle) - 0.5, 0.5 * jnp.sin(angle), angle])
    pressures = jnp.stack([motion.internal(f"cylinder.p{k}")[-1] for k in (0, 1)])
    return jnp.linalg.norm(centre) + 1e-6 * jnp.linalg.norm(pressures)


def exudyn_run(step):
    """Norm of the case by Exudyn, as a function without arguments."""
    import exudyn as exu
    from exudyn_models import hydraulic_arm

    def run():
        system, read = hydraulic_arm(START)
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = round(END / step)
        settings.timeIntegration.endTime = END
        settings.solutionSettings.writeSolutionToFile = False
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.newton.useModifiedNewton = True
        system.SolveDynamic(settings)
        return read()

    return run


def error_of(value):
    """Relative error of the norm."""
    return abs(float(value) / NORM - 1.0)


def gradient_rows(rounds):
    """One run at the default tolerance, and its gradient by the bulk modulus."""
    case, system, here = "HY1 t=0.4 s", arm(), jnp.asarray(1e11)
    value, _ = common.compiled(lambda E: norm(arm(E, like=system)), here)
    both, _ = common.compiled(jax.value_and_grad(lambda E: norm(arm(E, like=system))), here)
    seconds = common.cpu_seconds({"value": lambda: value(here), "both": lambda: both(here)}, rounds, least=0.1)
    return [
        common.row(case, f"error at rtol {RTOL:g}", error_of(value(here))),
        common.row(case, "one run", seconds["value"], "s CPU"),
        common.row(case, "value and gradient", seconds["both"] / seconds["value"], "of value", goal="<=5"),
    ]


def largest(settings, make, wanted):
    """(setting, function, error) of the first setting whose error is at most `wanted`; settings go down."""
    for setting in settings:
        run = make(setting)
        error = error_of(run())
        if error <= wanted:
            return setting, run, error
    raise ValueError(f"no setting has an error of {wanted:g}")


def ours(rtol):
    """Norm of the case by jaxmbs at a tolerance, as a function without arguments."""
    system, here = arm(), jnp.asarray(1e11)
    program, _ = common.compiled(lambda E: norm(arm(E, like=system), rtol), here)
    return lambda: program(here)


def equal_error_rows(rounds, errors):
    """One run of each program at the largest tolerance or step that has an error."""
    rows, tolerances, steps = [], RTOLS, STEPS
    for wanted in errors:
        rtol, run, error = largest(tolerances, ours, wanted)
        step, peer_run, peer_error = largest(steps, exudyn_run, wanted)
        tolerances, steps = tolerances[tolerances.index(rtol) :], steps[steps.index(step) :]
        case, peer = f"HY1, error {wanted:g}", f"Exudyn {step:g} s"
        seconds = common.cpu_seconds({"ours": run, "peer": peer_run}, rounds, least=0.1)
        rows += [
            common.row(case, f"error at rtol {rtol:g}", error, "", peer, peer_error),
            common.row(case, "one run", seconds["ours"], "s CPU", peer, seconds["peer"], "<=1"),
        ]
    return rows


def main():
    options = common.parser(__doc__).parse_args()
    rounds = 1 if options.quick else 5
    rows = gradient_rows(rounds)
    if importlib.util.find_spec("exudyn") is not None:
        rows += equal_error_rows(rounds, ERRORS[:1] if options.quick else ERRORS)
    common.report(rows, options)


if __name__ == "__main__":
    main()
