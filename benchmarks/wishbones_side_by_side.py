"""Many double wishbones, each with its own loads, optimised under 50 limits in batches of `interior_point`, beside a
loop of SciPy's SLSQP over the same functions and gradients, compiled.

Variables are the 20 coordinates of hardpoints of `wishbone_limits.py` in units of their reach, and the largest member
load.  One wishbone with the mean loads is optimised first; the others start from its optimum, with its multipliers
and its curvature, in rounds of some steps: a batch takes as long as its slowest design, so that after a round those
that have ended make room.  SLSQP is measured from the first design and from that optimum.  All end at the same
tolerance.
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
OF_ALL, CHUNK = 1000, 8
ROUND, ROUNDS = 2, 60  # steps, and rounds at most


def largest_load(z, factors):
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


OPTIONS = {"hessian": "bfgs", "gradient": "forward", "tolerance": TOLERANCE}


def side_by_side(factors, first, kind):
    """Optima of wishbones with load factors (k, 7), from the first one."""
    return mbs.design.interior_point_batch(
        largest_load, first.design, factors, (LOWER, UPPER), inequalities=limits, warm=first, round_steps=ROUND,
        steps=ROUND * ROUNDS, chunk=CHUNK, progress=False, compile=kind, **OPTIONS,
    )  # fmt: skip


def by_slsqp(factors, start, margins, slopes):
    from scipy.optimize import Bounds, minimize

    unit = np.zeros(21)
    unit[-1] = 1.0
    constraint = {
        "type": "ineq",
        "fun": lambda z: -np.asarray(margins(jnp.array(z), factors)),
        "jac": lambda z: -np.asarray(slopes(jnp.array(z), factors)),
    }
    return minimize(
        lambda z: z[-1], start, jac=lambda z: unit, method="SLSQP", bounds=Bounds(LOWER, UPPER),
        constraints=constraint, options={"ftol": 0.01 * TOLERANCE, "maxiter": 500},
    )  # fmt: skip


def main():
    options = parser(__doc__).parse_args()
    number, looped, kind = (4, 1, "quick") if options.quick else (OF_ALL, 6, "full")
    factors = np.random.default_rng(0).uniform(0.85, 1.15, (number, 7))
    clock = [time.process_time()]
    mean = jnp.ones(7)
    first = mbs.design.interior_point(
        lambda z: z[-1], START, (LOWER, UPPER), inequalities=lambda z: limits(z, mean), compile="quick", **OPTIONS
    )
    clock.append(time.process_time())
    print("mean loads:", float(first.value), "steps", int(first.steps), "CPU s", clock[1] - clock[0], flush=True)
    side_by_side(factors[:CHUNK], first, kind)
    clock.append(time.process_time())
    found = side_by_side(factors, first, kind)
    loads, steps, good = (np.asarray(part) for part in (found.value, found.steps, found.ok))
    clock.append(time.process_time())
    alone, compiling, batch = np.diff(clock)
    print("compiling", compiling, "running", batch, "steps", np.bincount(steps), flush=True)
    margins, slopes = (mbs.jit(f, compile=kind) for f in (limits, jax.jacfwd(limits)))
    case = f"{number} wishbones, 21 variables, 100 limits"
    rows = [
        row(case, "converged", int(np.sum(good))),
        row(case, "the first one, compiled quick and run", alone, "CPU s"),
        row(case, "compiling the others", compiling, "CPU s"),
    ]
    for name, start in (("first design", START), ("optimum of mean loads", np.asarray(first.design))):
        by_slsqp(jnp.asarray(factors[0]), start, margins, slopes)
        begin = time.process_time()
        others = [by_slsqp(jnp.asarray(row), start, margins, slopes) for row in factors[:looped]]
        loop = (time.process_time() - begin) / looped * number
        theirs = np.array([other.fun for other in others])
        print("largest loads over those of SLSQP, less one:", loads[:looped] / theirs - 1.0)
        peer = f"SLSQP from the {name}, {looped} measured"
        rows += [
            row(case, "mean steps", np.mean(steps), "", peer, np.mean([other.nit for other in others])),
            row(case, "mean load", np.mean(loads[:looped]), "of the first", peer, np.mean(theirs)),
            row(case, "CPU for all, compiled", batch, "s", peer, loop, goal="ratio 0.1"),
        ]
    report(rows, options)


if __name__ == "__main__":
    main()
