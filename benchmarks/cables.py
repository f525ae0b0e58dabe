"""A crane with two cables over six sheaves beside the same crane with two springs: run, compilation, gradient."""

import common
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs.forces import Attachment, Sheave
from jaxmbs.math._rotation import rotation_matrix

CASE, END = "crane, 2 cables over 6 sheaves", 0.5
KINDS, RTOL = ("cables", "springs"), 1e-6
BOOM, REACH, FALL = 20.0, 14.0, 6.0  # length of the boom, its tip from the foot, the hook below the tip [m]
HEIGHT = float(np.sqrt(BOOM**2 - REACH**2))
STIFFNESS, DAMPING = 4e6, 2e4


def declared():
    """The bodies: a boom on a column that slews, a hook on six freedoms, a load that swings below it."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    tilt = float(np.arctan2(HEIGHT, REACH))
    b.body("column", 5e3, inertia=8e3)
    b.joint("slew", mbs.Revolute("z"), "ground", "column")
    b.body("boom", 2e3, com=(BOOM / 2, 0, 0), inertia=(50.0, 2e3 * BOOM**2 / 12, 2e3 * BOOM**2 / 12))
    foot = mbs.Pose((0, 0, 0), rotation_matrix(jnp.array([0.0, -tilt, 0.0])))
    b.joint("luff", mbs.Revolute("y"), "column", "boom", parent_frame=foot)
    b.body("hook", 300.0, inertia=40.0)
    b.joint("hook", mbs.Free(), "ground", "hook", parent_frame=(REACH, 0, HEIGHT - FALL))
    b.body("load", 4e3, com=(0, 0, -2.0), inertia=2e3)
    b.joint("sling", mbs.Spherical(), "hook", "load")
    return b


def crane(kind, stiffness=STIFFNESS, like=None):
    """The crane held by "cables" or by "springs" of about their tension."""
    b = declared()
    tip, mast = ("boom", (BOOM, 0, 0)), ("column", (-3.0, 0, 12.0))
    if kind == "springs":
        for name, ends, length in (
            ("pendant", (mast, tip), float(np.hypot(REACH + 3.0, HEIGHT - 12.0)) - 0.005),
            ("hoist", (tip, "hook"), FALL - 0.0053),
        ):
            b.force(name, mbs.SpringDamper(2 * stiffness, 2 * DAMPING, free_length=length), between=ends)
        return b.build(like=like)
    over = {"axis": "y", "radius": 0.3}
    b.cable(
        "pendant",
        [
            Attachment(("column", (-3.0, 0, 0.0))),
            Sheave(mast, side="+", **over),
            Sheave(tip, side="+", **over),
            Sheave(("column", (-3.0, 0, 11.0)), side="+", **over),
            Attachment(("boom", (BOOM - 1.0, 0, -0.2))),
        ],
        stiffness=stiffness,
        damping=DAMPING,
        free_length=65.40458,  # so that the boom starts as with the spring
    )
    b.cable(
        "hoist",
        [
            Attachment(("column", (-1.0, 0, 1.0))),
            Sheave(("column", (-1.0, 0, 9.0)), side="+", **over),
            Sheave(("boom", (BOOM, 0, 0)), side="+", **over),
            Sheave("hook", side="-", **over),
            Attachment(("boom", (BOOM, 0, -0.5))),
        ],
        stiffness=stiffness,
        damping=DAMPING,
        free_length=37.46868,
    )
    return b.build(like=like)


def rows(rounds):
    """Rows of a step of a motion, its compilation, and its gradient by the stiffness, beside springs."""
    values, gradients, programs, steps = {}, {}, {}, {}
    here = jnp.asarray(STIFFNESS)
    for kind in KINDS:
        system = crane(kind)
        start = mbs.State.at(system)

        def end(stiffness, kind=kind, system=system, start=start):
            motion = mbs.simulate(crane(kind, stiffness, like=system), start, t1=END, rtol=RTOL, atol=RTOL)
            return motion.states.coordinates[-1, 1], motion.diagnostics.num_steps

        with_slope = jax.value_and_grad(end, has_aux=True)
        programs |= {kind: (end, here), (kind, "gradient"): (with_slope, here)}
        value, both = (common.compiled(program, here)[0] for program in (end, with_slope))
        steps[kind] = int(value(here)[1])
        values[kind], gradients[kind] = (lambda run=run: run(here) for run in (value, both))
    compile_seconds = common.compile_seconds(programs, min(rounds, 3))
    run, gradient = common.cpu_seconds(values, rounds), common.cpu_seconds(gradients, rounds)
    step, both = ({kind: s[kind] / steps[kind] for kind in KINDS} for s in (run, gradient))

    def beside(metric, figures, unit, goal=""):
        return common.row(CASE, metric, figures["cables"], unit, "springs", figures["springs"], goal)

    return [
        beside("one step", step, "s CPU", "<=1.3"),
        beside("one step, value and gradient", both, "s CPU"),
        beside("steps", steps, ""),
        beside("compilation", compile_seconds, "s CPU"),
        beside("compilation of the gradient", {k: compile_seconds[k, "gradient"] for k in KINDS}, "s CPU"),
        common.row(CASE, "value and gradient", gradient["cables"] / run["cables"], "of value"),
    ]


def main():
    options = common.parser(__doc__).parse_args()
    common.report(rows(1 if options.quick else 7), options)


if __name__ == "__main__":
    main()
