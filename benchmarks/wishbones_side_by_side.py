"""Many double wishbones, each with its own loads, optimised under 50 limits in one batch of `interior_point`, beside
a loop of SciPy's SLSQP over the same compiled functions and gradients.

Variables are the 20 coordinates of hardpoints of `wishbone_limits.py` in units of their reach, and the largest member
load.  Both searches end at the same tolerance; a part of the designs is measured and counted for all.
"""

import time

from common import parser, report, row  # first: sets what JAX reads at import

import jax  # isort: skip
import jax.numpy as jnp
import numpy as np
import wishbone_limits as one

import jaxmbs as mbs

NAMES = [f"{name} {axis}" for name, axis in one.COORDINATES]
LARGEST = 13.746958352883441  # [kN] member load of the first design
START = np.array([0.0] * 20 + [1.0])
LOWER, UPPER = np.array([-1.0] * 20 + [0.25]), np.array([1.0] * 20 + [1.5])
TOLERANCE = 1e-5
OF_ALL = 1000


def largest_load(z):
    return z[-1]


def limits(z, factors):
    """Excesses (m,) of the limits; factors (7,) of the load cases."""
    points = one.points_of(dict(zip(NAMES, one.REACH * z[:20], strict=True)))
    loads = factors[:, None] * one.member_loads(points) / (1e3 * LARGEST * z[-1])
    camber, toe, caster, pin, scrub, track = one.curves(points)
    values = (
        loads, toe[2] - toe[1], toe[0] - toe[1], camber[2], camber[0], caster[1], pin[1], scrub[1],
        track[2] - track[0],
    )  # fmt: skip
    sides = []
    for limit, value in zip(one.LIMITS, values, strict=True):
        for sign, bound in ((-1.0, limit.lower), (1.0, limit.upper)):
            sides.append(jnp.ravel(sign * (value - bound) / (limit.scale or abs(bound))))
    return jnp.concatenate(sides)


def best(factors):
    found = mbs.design.interior_point(
        largest_load, START, (LOWER, UPPER), inequalities=lambda z: limits(z, factors), hessian="bfgs",
        gradient="forward", tolerance=TOLERANCE,
    )  # fmt: skip
    return {"load": found.value, "over": found.violation, "converged": found.ok, "steps": found.steps}


def by_slsqp(factors, margins, slopes):
    from scipy.optimize import Bounds, minimize

    unit = np.zeros(21)
    unit[-1] = 1.0
    constraint = {
        "type": "ineq",
        "fun": lambda z: -np.asarray(margins(jnp.array(z), factors)),
        "jac": lambda z: -np.asarray(slopes(jnp.array(z), factors)),
    }
    return minimize(
        lambda z: z[-1], START, jac=lambda z: unit, method="SLSQP", bounds=Bounds(LOWER, UPPER),
        constraints=constraint, options={"ftol": 0.01 * TOLERANCE, "maxiter": 500},
    )  # fmt: skip


def main():
    options = parser(__doc__).parse_args()
    number, looped = (4, 1) if options.quick else (32, 4)
    factors = np.random.default_rng(0).uniform(0.85, 1.15, (number, 7))
    study = lambda: mbs.batch(best, factors, chunk=8, progress=False, compile="quick")
    study()
    begin = time.process_time()
    found = study().values
    batch = (time.process_time() - begin) / number * OF_ALL
    margins, slopes = (mbs.jit(f, compile="quick") for f in (limits, jax.jacfwd(limits)))
    by_slsqp(jnp.asarray(factors[0]), margins, slopes)
    begin = time.process_time()
    others = [by_slsqp(jnp.asarray(row), margins, slopes) for row in factors[:looped]]
    loop = (time.process_time() - begin) / looped * OF_ALL
    ours, theirs = np.asarray(found["load"])[:looped], np.array([other.fun for other in others])
    print("steps", np.asarray(found["steps"]), "of SLSQP", [other.nit for other in others])
    print("largest loads over those of SLSQP, less one:", ours / theirs - 1.0)
    case = f"{number} of {OF_ALL} wishbones, 21 variables, 100 limits"
    rows = [
        row(case, "converged", int(np.sum(found["converged"]))),
        row(case, "mean steps", np.mean(found["steps"]), "", "SLSQP", np.mean([other.nit for other in others])),
        row(case, "mean load", np.mean(ours), "of the first", "SLSQP", np.mean(theirs)),
        row(case, "CPU for all", batch, "s", f"SLSQP, {looped} measured", loop, goal="ratio 0.1"),
    ]
    report(rows, options)


if __name__ == "__main__":
    main()
