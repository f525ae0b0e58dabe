"""Gradient of a motion to ten masses: reverse mode beside central differences with MuJoCo.

A chain of ten links swings for 1 s in 1000 semi-implicit Euler steps, so that both programs compute the same
numbers; the functional is linear in the final coordinates.  MuJoCo takes the 20 runs of central differences, its
whole run inside one call.
"""

import common
import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from link_chain import LINKS, MASS, START, mujoco_model, our_start, our_system

import jaxmbs as mbs

DT = 1e-3
WEIGHT = np.cos(np.arange(LINKS))
PEER = "MuJoCo, central differences"


class Ours:
    """Final coordinates and the functional as functions of the masses (10,)."""

    def __init__(self, steps):
        self.system, self.steps = our_system(), steps
        self.start = our_start(self.system)

    def final(self, masses):
        system = eqx.tree_at(lambda s: s.mass, self.system, masses)
        motion = mbs.simulate(
            system,
            self.start,
            ts=np.array([self.steps * DT]),
            dt=DT,
            solver=mbs.ode.SemiImplicitEuler(),
            throw=False,
        )
        return motion.states.coordinates[-1]

    def functional(self, masses):
        return jnp.dot(jnp.asarray(WEIGHT), self.final(masses))


class MuJoCo:
    """The same by MuJoCo."""

    def __init__(self, steps):
        self.model, self.steps = mujoco_model("Euler", DT), steps
        self.data = mujoco.MjData(self.model)

    def final(self, masses):
        model, data = self.model, self.data
        model.body_mass[1:] = masses
        model.body_subtreemass[:] = np.cumsum(model.body_mass[::-1])[::-1]
        mujoco.mj_resetData(model, data)
        data.qpos[:] = START
        mujoco.mj_step(model, data, nstep=self.steps)
        return data.qpos.copy()

    def differences(self, masses, relative=1e-6):
        gradient = np.empty(LINKS)
        for i in range(LINKS):
            h = relative * masses[i] * np.eye(LINKS)[i]
            gradient[i] = WEIGHT @ (self.final(masses + h) - self.final(masses - h)) / (2.0 * h[i])
        return gradient


def check(ours, theirs, masses, gradient):
    """Both programs compute the same motion and the same gradient."""
    motion = np.max(np.abs(np.asarray(ours.final(jnp.asarray(masses))) - theirs.final(masses)))
    expected = theirs.differences(masses)
    slope = np.max(np.abs(np.asarray(gradient) - expected)) / np.max(np.abs(expected))
    if not (motion < 1e-8 and slope < 1e-5):
        raise RuntimeError(f"the programs disagree: coordinates by {motion:.1e} rad, gradients by {slope:.1e}")
    return motion, slope


def measure(steps, rounds):
    """All rows."""
    ours, theirs, masses = Ours(steps), MuJoCo(steps), np.full(LINKS, MASS)
    m = jnp.asarray(masses)
    forward, seconds = common.compiled(ours.functional, m)
    reverse, reverse_seconds = common.compiled(jax.grad(ours.functional), m)
    motion, slope = check(ours, theirs, masses, reverse(m))
    times = common.cpu_seconds(
        {
            "forward": lambda: forward(m),
            "gradient": lambda: reverse(m),
            "run": lambda: theirs.final(masses),
            "differences": lambda: theirs.differences(masses),
        },
        rounds,
    )
    times = {name: 1e3 * value for name, value in times.items()}
    case = f"chain N={LINKS} steps={steps}"
    return [
        common.row(case, "difference of final coordinates", motion, "rad", "MuJoCo", goal="<1e-8"),
        common.row(case, "relative difference of gradients", slope, "1", PEER, goal="<1e-5"),
        common.row(case, "forward run", times["forward"], "ms CPU", "MuJoCo, mj_step", times["run"]),
        common.row(case, "gradient", times["gradient"], "ms CPU", PEER, times["differences"], "<=1"),
        common.row(case, "gradient", times["gradient"], "ms CPU", "forward run, ours", times["forward"], "<=5"),
        common.row(case, "compile forward", seconds, "s CPU"),
        common.row(case, "compile gradient", reverse_seconds, "s CPU"),
    ]


def main():
    options = common.parser(__doc__).parse_args()
    rows = measure(100, 2) if options.quick else measure(1000, 7)
    common.report(rows, options)


if __name__ == "__main__":
    main()
