"""A double wishbone under limits: 20 coordinates of hardpoints, 7 load cases, 50 limits, least largest member load.

The largest tension or push in six members over all load cases is a variable of its own, that the 42 member loads may
not exceed; camber, toe, caster, kingpin inclination, scrub radius and track are the other eight limits.  Each load
case has its own wheel travel.  Printed: the table of the design and its limits, and CPU seconds of compiling and of
running.
"""

import time

from common import parser, report, row  # first: sets what JAX reads at import

import jax  # isort: skip
import jax.numpy as jnp
import numpy as np
from double_wishbone import POINTS, RODS, contact, pose, tensions
from preaccumulation import preaccumulate

import jaxmbs as mbs

FREE = ("LF y z", "LR y z", "LO y z", "UF y z", "UR y z", "UO y z", "TI y z", "TO x y z", "S x y z")
COORDINATES = tuple((names.split()[0], axis) for names in FREE for axis in names.split()[1:])
REACH = 0.04  # [m] that a coordinate may move
CASES = {  # force [N], at the contact point or the wheel centre, wheel travel [m]
    "vertical": ((0.0, 0.0, 4000.0), 1.0, 0.0),
    "bump": ((0.0, 0.0, 12000.0), 1.0, 0.05),
    "braking": ((-4500.0, 0.0, 5500.0), 1.0, 0.02),
    "cornering": ((0.0, -4800.0, 5200.0), 1.0, 0.02),
    "brake and corner": ((-2000.0, 3000.0, 4000.0), 1.0, 0.0),
    "drive at wheel centre": ((3000.0, 0.0, 4200.0), 0.0, -0.01),
    "kerb": ((-3000.0, -1500.0, 6000.0), 1.0, 0.03),
}
POSES = np.array([-0.05, 0.0, 0.05])  # rebound, design, bump [m]
MEMBERS = (*RODS, "strut")


def points_of(design):
    """Hardpoints [m] with the free coordinates moved, `design["LF y"]` [m]."""
    points = {name: jnp.asarray(x) for name, x in POINTS.items()}
    for name, axis in COORDINATES:
        points[name] = points[name].at["xyz".index(axis)].add(design[f"{name} {axis}"])
    return points


def member_loads(points):
    """Tensions (7, 6) [N] of all members in all load cases."""
    force, at_contact, travel = (jnp.array(part, float) for part in zip(*CASES.values(), strict=True))
    return jax.vmap(lambda *case: preaccumulate(lambda points: tensions(points, *case))(points))(
        travel, force, at_contact
    )


def curves(points):
    """At `POSES`: camber, toe, caster, kingpin inclination (3,) [deg]; scrub radius and half track (3,) [mm]."""

    def one(points, travel):
        _, R, centre = pose(points, travel)
        axle = R @ (points["AO"] - points["AI"])
        lower, upper = (centre + R @ (points[name] - points["AO"]) for name in ("LO", "UO"))
        pin, patch = upper - lower, centre + contact(points, R)
        ground = lower + pin * (patch[2] - lower[2]) / pin[2]
        slopes = jnp.stack(
            [-axle[2] / jnp.hypot(axle[0], axle[1]), axle[0] / axle[1], -pin[0] / pin[2], -pin[1] / pin[2]]
        )
        return *jnp.rad2deg(jnp.arctan(slopes)), 1e3 * (patch[1] - ground[1]), 1e3 * patch[1]

    return jax.vmap(lambda travel: preaccumulate(lambda points: one(points, travel))(points))(jnp.asarray(POSES))


def study(design):
    """The largest member load [kN], and what has limits."""
    points = points_of(design)
    camber, toe, caster, pin, scrub, track = curves(points)
    answers = {
        "member loads": member_loads(points) / (1e3 * design["load"]),  # of the largest one
        "bump steer": toe[2] - toe[1],
        "droop steer": toe[0] - toe[1],
        "camber in bump": camber[2],
        "camber in droop": camber[0],
        "caster": caster[1],
        "kingpin inclination": pin[1],
        "scrub radius": scrub[1],
        "track": track[2] - track[0],
    }
    return design["load"], answers


LIMITS = (
    mbs.Limit("member loads", "member loads", -1.0, 1.0),
    mbs.Limit("bump steer [deg]", "bump steer", -0.1, 0.1, scale=1.0),
    mbs.Limit("droop steer [deg]", "droop steer", -0.1, 0.1, scale=1.0),
    mbs.Limit("camber in bump [deg]", "camber in bump", -2.5, -0.2, scale=1.0),
    mbs.Limit("camber in droop [deg]", "camber in droop", -2.5, 1.0, scale=1.0),
    mbs.Limit("caster [deg]", "caster", 4.0, 7.0),
    mbs.Limit("kingpin inclination [deg]", "kingpin inclination", 10.0, 24.0),
    mbs.Limit("scrub radius [mm]", "scrub radius", -45.0, 45.0),
    mbs.Limit("track [mm]", "track", -8.0, 8.0),
)


def first_design():
    moves = {f"{name} {axis}": 0.0 for name, axis in COORDINATES}
    return moves | {"load": float(np.abs(jax.jit(member_loads)(points_of(moves))).max()) / 1e3}


def improve(steps=400):
    """(optimum, CPU seconds up to the first step, and from there to the end)."""
    first, clock = first_design(), [time.process_time()]
    bounds = dict.fromkeys(first, (-REACH, REACH)) | {"load": (0.25 * first["load"], 1.25 * first["load"])}
    best = mbs.minimise(
        study,
        first,
        bounds,
        limits=LIMITS,
        gradient="forward",
        steps=steps,
        progress=False,
        callback=lambda *_: clock.append(time.process_time()),
    )
    return best, clock[1] - clock[0], time.process_time() - clock[1]


def main():
    options = parser(__doc__).parse_args()
    best, compiling, running = improve(3 if options.quick else 400)
    print(best.table(), end="\n\n")
    entries = 42 + len(LIMITS) - 1
    excess = max(max(0.0, -limit.margin) for limit in best.limits)
    case = f"{len(COORDINATES)} coordinates, {len(CASES)} load cases, {entries} limits"
    rows = [
        row(case, "largest member load before", best.initial_value, "kN"),
        row(case, "largest member load after", best.value, "kN"),
        row(case, "largest excess of a limit", excess, "of it", goal="1e-6"),
        row(case, "KKT residual", best.kkt / best.value, "of the load", goal="1e-6"),
        row(case, "steps", len(best.history.values) - 1),
        row(case, "evaluations", int(best.history.evaluations[-1])),
        row(case, "compiling and first step", compiling, "CPU s"),
        row(case, "running from there", running, "CPU s", goal="60"),
    ]
    report(rows, options)


if __name__ == "__main__":
    main()
