"""A double wishbone and a motion as components of OpenMDAO: the optimum beside ours, and the cost of a derivative.

The wishbone of `wishbone_limits.py` is optimised by OpenMDAO's SLSQP and by `minimise`.  Then CPU seconds of the
total derivative, as a driver of OpenMDAO asks for it, beside the same Jacobian by JAX alone: of the wishbone (21
variables, 51 results), and of the end of a chain's motion by its masses, lengths and springs.
"""

import functools

from common import cpu_seconds, parser, report, row  # first: sets what JAX reads at import

import jax  # isort: skip
import jax.numpy as jnp
import numpy as np
import openmdao.api as om
import wishbone_limits

import jaxmbs as mbs
from jaxmbs.adapters.openmdao import component

LINKS = 4


def problem(part, driver=None):
    """An OpenMDAO problem of one component, set up."""
    whole = om.Problem(reports=None)
    whole.model.add_subsystem("part", part, promotes=["*"])
    if driver is not None:
        whole.driver = driver
    return whole


@functools.cache
def wishbone_component():
    """The double wishbone, compiled once for all problems."""
    first = wishbone_limits.first_design()
    reach = wishbone_limits.REACH
    bounds = dict.fromkeys(first, (-reach, reach)) | {"load": (0.25 * first["load"], 1.25 * first["load"])}
    return component(wishbone_limits.study, first, bounds), first


def wishbone(steps, tolerance):
    """The problem of the double wishbone, ready to run."""
    part, first = wishbone_component()
    driver = om.ScipyOptimizeDriver(optimizer="SLSQP", maxiter=steps, tol=tolerance, disp=False)
    whole = problem(part, driver)
    whole.model.add_objective("objective", ref=first["load"])
    for limit in wishbone_limits.LIMITS:
        size = limit.scale or max(abs(limit.lower), abs(limit.upper))
        whole.model.add_constraint(limit.value, lower=limit.lower, upper=limit.upper, ref=size)
    whole.setup(mode="fwd")
    return whole, first


def build(design, like=None):
    """A chain that hangs from a pin, straight out at first."""
    b = mbs.SystemBuilder()
    for k in range(LINKS):
        mass, length = design["mass"][k], design["length"][k]
        b.body(f"link {k}", mass=mass, com=(0.5 * length, 0, 0), inertia=mbs.inertia.rod(mass, length))
        below, place = (f"link {k - 1}", (design["length"][k - 1], 0.0, 0.0)) if k else ("ground", (0.0, 0.0, 0.0))
        b.joint(f"pin {k}", mbs.Revolute("y"), below, f"link {k}", parent_frame=place)
        b.force(f"spring {k}", mbs.SpringDamper(design["stiffness"][k], 0.1), joint=f"pin {k}")
    return b.build(like=like)


CHAIN = {"mass": np.full(LINKS, 1.0), "length": np.full(LINKS, 0.3), "stiffness": np.full(LINKS, 20.0)}
LIKE = build(CHAIN)


def chain(design):
    """Height of the last link after half a second, by masses [kg], lengths [m] and joint springs [N m/rad]."""
    system = build(design, like=LIKE)
    motion = mbs.simulate(system, mbs.State.at(system), ts=jnp.array([0.0, 0.5]), throw=False)
    return {"height": mbs.position(system, motion.end, f"link {LINKS - 1}")[2]}


def main():
    options = parser(__doc__).parse_args()
    rows = optimum(options.quick) + total_of_wishbone(options.quick) + total_of_motion(options.quick)
    report(rows, options)


def optimum(quick):
    """The optimum by OpenMDAO's driver and by ours."""
    steps = 3 if quick else 400
    whole, _ = wishbone(steps, 1e-12)
    whole.run_driver()
    best, *_ = wishbone_limits.improve(steps)
    case = "double wishbone"
    found = float(whole.get_val("objective")[0])
    excess = 0.0
    for limit in wishbone_limits.LIMITS:
        values = whole.get_val(limit.value)
        size = limit.scale or max(abs(limit.lower), abs(limit.upper))
        excess = max(
            excess, float(np.max((values - limit.upper) / size)), float(np.max((limit.lower - values) / size))
        )
    return [
        row(case, "largest member load", found, "kN", "minimise", best.value, goal="1 to 1e-6"),
        row(case, "largest excess of a limit", excess, "of it", goal="1e-6"),
        row(case, "model evaluations of the driver", int(whole.driver.result.model_evals)),
        row(case, "evaluations of minimise", int(best.history.evaluations[-1])),
    ]


def total(whole, of, wrt):
    """The total derivative as a driver asks for it, at a point where nothing is known yet."""
    whole.model.part.evaluator.forget()
    return whole.driver._compute_totals(of=of, wrt=wrt, return_format="dict", driver_scaling=False)


def total_of_wishbone(quick):
    """CPU seconds of the Jacobian of all results."""
    whole, first = wishbone(1, 1e-6)
    whole.run_driver()
    for name, value in first.items():
        whole.set_val(name, value)
    whole.run_model()
    names = sorted(first)
    of = ["objective", *(limit.value for limit in wishbone_limits.LIMITS)]
    direct = mbs.jit(jax.jacfwd(lambda x: wishbone_limits.study(dict(zip(names, x, strict=True)))))
    x = np.array([first[name] for name in names])

    def ours():
        return total(whole, of, names)

    def theirs():
        return jax.block_until_ready(direct(x))

    def solves():
        """OpenMDAO's solves around a component whose products cost nothing."""
        part, evaluator = whole.model.part, whole.model.part.evaluator
        part.evaluator = Nothing(evaluator.question)
        try:
            return total(whole, of, names)
        finally:
            part.evaluator = evaluator

    difference = compare(ours(), theirs(), names)
    functions = {"totals": ours, "direct": theirs, "solves": solves}
    seconds = cpu_seconds(functions, rounds=1 if quick else 9)
    case = "double wishbone, 21 by 51"
    return [
        row(case, "difference of the totals", difference, "", goal="1e-12"),
        row(case, "total derivative", 1e3 * seconds["totals"], "CPU ms", "JAX alone", 1e3 * seconds["direct"], "1.2"),
        row(case, "OpenMDAO's solves alone", 1e3 * seconds["solves"], "CPU ms", "JAX alone", 1e3 * seconds["direct"]),
    ]


class Nothing:
    """Products of no cost."""

    def __init__(self, question):
        self.question = question
        self.found = {"fwd": np.zeros(question.outputs[-1].entries.stop), "rev": np.zeros(len(question.inputs))}

    def product(self, x, direction, mode):
        return self.found[mode]

    def forget(self):
        pass


def compare(totals, direct, names):
    """Largest difference of the totals, relative to the largest entry of each result."""
    load, answers = direct
    worst = 0.0
    for name, rows in {"objective": load, **answers}.items():
        wanted = np.reshape(rows, (-1, len(names)))
        found = np.concatenate([totals[name][wrt].reshape(len(wanted), -1) for wrt in names], axis=1)
        worst = max(worst, float(np.max(np.abs(found - wanted)) / np.max(np.abs(wanted))))
    return worst


def total_of_motion(quick):
    """CPU seconds of the gradient of a motion, each time at a point where nothing is known yet."""
    whole = problem(component(chain, CHAIN))
    whole.setup(mode="rev")
    whole.run_model()
    direct = mbs.jit(jax.grad(lambda design: chain(design)["height"]))
    with_value = mbs.jit(jax.value_and_grad(lambda design: chain(design)["height"]))

    def totals():
        return total(whole, ["height"], list(CHAIN))

    def value_and_totals():
        whole.run_model()
        return totals()

    found, wanted = totals()["height"], direct(CHAIN)
    difference = max(float(np.max(np.abs(found[name] - wanted[name]))) for name in CHAIN)
    functions = {"totals": totals, "both": value_and_totals}
    functions |= {"gradient": lambda: direct(CHAIN), "value and gradient": lambda: with_value(CHAIN)}
    ms = {name: 1e3 * seconds for name, seconds in cpu_seconds(functions, rounds=1 if quick else 9).items()}
    case = f"motion of {LINKS} links, 12 by 1"
    return [
        row(case, "difference of the gradients", difference, "", goal="1e-12"),
        row(case, "total derivative", ms["totals"], "CPU ms", "JAX alone", ms["gradient"], "1.2"),
        row(case, "value, then total", ms["both"], "CPU ms", "JAX alone, in one", ms["value and gradient"]),
    ]


if __name__ == "__main__":
    main()
