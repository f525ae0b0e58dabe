"""An elastic beam spun up faster than its first frequency: error against the number of bodies it is cut into.

The manoeuvre of Kane, Ryan and Banerjee (1987) with the beam of Simo and Vu-Quoc (1986).  One body without stiffening
by rotation is unstable above 3.8 rad/s; the error of several falls with the square of their number, one with it
needs no cut.  The reference is the limit of ANCF cables in elements and steps (2e-7).  Where Exudyn is installed it
runs the same beam.  And the accelerations of rows of up to 100 bodies with pins between them, block-sparse beside
dense.
"""

import functools
import importlib.util
from pathlib import Path

import common
import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from cases import load
from scipy.linalg import lu_factor, lu_solve

import jaxmbs as mbs
from jaxmbs.constraints import _closures as closures
from jaxmbs.constraints import _constraints as constraints
from jaxmbs.dynamics._newton_euler import saddle_sides
from jaxmbs.elements import Beam
from jaxmbs.fem import Structure, assemble
from jaxmbs.flexible import floating_frame
from jaxmbs.kinematics._configuration import at_state, with_velocities
from jaxmbs.kinematics._elastic import mass_matrix

beams = load(Path(__file__).parent.parent / "tests" / "flexible" / "beams.py")
LENGTH, TIMES = 10.0, np.array([2.0, 4.0, 6.0, 8.0])
REFERENCE = np.array([-0.10237244, -0.34225384, -0.54355929, -0.54279588])  # of the tip, in the turning axes [m]
SECTION = Beam(2.8e7, 1e7, 1.0, 5e-4, 5e-4, 1e-3, 1.2)
PEER_RUNS = ((8, 4e-3), (8, 2e-3))  # elements, step


def spin(t):
    """Angle of the hub: to 6 rad/s in 15 s, smoothly."""
    return 0.4 * (0.5 * t**2 + (15.0 / (2 * jnp.pi)) ** 2 * (jnp.cos(2 * jnp.pi * t / 15.0) - 1.0))


def stiffened_beam(elements=16, modes=6):
    """The beam as one elastic body with stiffening on the driven hub: the system and the lag of its tip at states."""
    x = jnp.linspace(0.0, LENGTH, elements + 1)
    nodes = jnp.stack([x, jnp.zeros_like(x), jnp.zeros_like(x)], axis=1)
    structure = Structure(nodes, {"beam": (SECTION, [(k, k + 1) for k in range(elements)])})
    frame = floating_frame(structure, ("0",), modes, stiffening=True)
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.elastic("whole", frame.body)
    b.joint("hub", mbs.Revolute("z"), "ground", "whole.0", drive=spin)
    tip = frame.shapes[frame.system.rows((str(elements), "y"))[0]]
    return b.build(), lambda states: np.asarray(states.coordinates[:, 1:] @ tip)


def beam(parts):
    """The beam cut into equal elastic bodies, hung on the driven hub; and the lag of its tip at states."""
    x = jnp.linspace(0.0, LENGTH / parts, 3)
    nodes = jnp.stack([x, jnp.zeros_like(x), jnp.zeros_like(x)], axis=1)
    structure = Structure(nodes, {"beam": (SECTION, [(0, 1), (1, 2)])})
    body = floating_frame(assemble(structure), ("0", "2"), 1).body
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for k in range(parts):
        b.elastic(f"part{k}", body, motions={"2": mbs.Planar("z")})
    b.joint("hub", mbs.Revolute("z"), "ground", "part0.0", drive=spin)
    for k in range(1, parts):
        b.joint(f"weld{k}", mbs.Weld(), f"part{k - 1}.2", f"part{k}.0")
    system, tip = b.build(), f"part{parts - 1}.2"

    def lag_of(states):
        place = jax.vmap(lambda state: mbs.position(system, state, tip))(states)
        return lag(place[:, 0], place[:, 1], states.t)

    return system, lag_of


def lag(x, y, t):
    """Deflection of the tip across the turning axes."""
    angle = np.asarray(spin(jnp.asarray(t)))
    return -np.asarray(x) * np.sin(angle) + np.asarray(y) * np.cos(angle)


def our_rows(parts, times, rounds, solver):
    """Largest error up to the last time, CPU seconds of a run and of the first one, steps; one part is stiffened."""
    system, lag_of = stiffened_beam() if parts == 1 else beam(parts)
    start = mbs.State.at(system)

    def simulate():
        return mbs.simulate(system, start, ts=times, solver=solver, rtol=1e-6, atol=1e-6)

    first = common.timed(simulate, 1)
    motion = simulate()
    error = np.max(np.abs(lag_of(motion.states) - REFERENCE[: len(times)]))
    seconds = common.cpu_seconds({"run": simulate}, rounds, least=0.0)["run"]
    case = "one body with stiffening" if parts == 1 else f"{parts} bodies"
    return [
        common.row(case, "largest error of the tip", error, "m"),
        common.row(case, "one run", seconds, "s CPU"),
        common.row(case, "first run with compilation", first, "s CPU"),
        common.row(case, "steps", int(motion.diagnostics.num_steps)),
    ]


def pinned_row(n, solver):
    """A row of n elastic bodies with pins between them, from pin to pin on the ground, and a state of it."""
    x = jnp.linspace(0.0, 0.5, 3)
    structure = Structure(jnp.stack([x, 0.0 * x, 0.0 * x], axis=1), {"beam": (SECTION, [(0, 1), (1, 2)])})
    return beams.arch_of_beams(n, solver, floating_frame(assemble(structure), ("0", "2"), 1).body)


def refined_accelerations(system, state):
    """Accelerations with residuals in extended precision, of the dense saddle system less its redundant rows."""

    def parts(system, state):
        at = with_velocities(system, at_state(system, state), state.velocities)
        at = closures.with_directions(system, at)
        return mass_matrix(system, at), constraints.jacobian(system, at), *saddle_sides(system, at)

    M, A, need, gamma = map(np.asarray, jax.jit(parts)(system, state))
    U, size, V = np.linalg.svd(A)
    k, n = np.count_nonzero(size > 1e-9 * size[0]), len(M)
    matrix = np.block([[M, V[:k].T], [V[:k], np.zeros((k, k))]])
    right = np.concatenate([need, (U.T @ gamma)[:k] / size[:k]]).astype(np.longdouble)
    factor, wide, x = lu_factor(matrix), matrix.astype(np.longdouble), np.zeros_like(right)
    for _ in range(8):
        x = x + lu_solve(factor, (right - wide @ x).astype(float))
    return x[:n].astype(float)


def row_of_bodies(n, rounds):
    """Time of the accelerations of a row of n bodies, and their errors."""
    case, run, error, first = f"row of {n}", {}, {}, {}
    for solver in ("multifrontal", "dense"):
        system, state = pinned_row(n, solver)
        run[solver] = functools.partial(jax.jit(mbs.forward_dynamics), system, state)
        first[solver] = common.timed(run[solver], 1)
        exact = refined_accelerations(system, state)
        error[solver] = np.max(np.abs(np.asarray(run[solver]()[0]) - exact)) / np.max(np.abs(exact))
    seconds = common.cpu_seconds(run, rounds)

    def beside(metric, of, unit, factor=1.0):
        return common.row(case, metric, factor * of["multifrontal"], unit, "dense", factor * of["dense"])

    return [
        beside("accelerations", seconds, "ms CPU", 1e3),
        beside("first accelerations", first, "s CPU"),
        beside("error, relative", error, "1"),
    ]


def peer_rows(ours, times, rounds):
    """Exudyn's runs: its error and time beside those of our finest beam."""
    if importlib.util.find_spec("exudyn") is None:
        return []
    import exudyn_models

    mine = {row.metric: row.value for row in ours if row.case == ours[-1].case}
    rows = []
    for elements, step in PEER_RUNS:
        found = []

        def solve(elements=elements, step=step, found=found):
            found[:] = exudyn_models.spinning_beam(elements, step, times)

        seconds = common.cpu_seconds({"run": solve}, rounds, least=0.0)["run"]
        error = np.max(np.abs(lag(*np.array(found).T, times) - REFERENCE[: len(times)]))
        peer = f"Exudyn, {elements} cables, h={step:.0e}"
        case = ours[-1].case
        rows.append(common.row(case, "largest error of the tip", mine["largest error of the tip"], "m", peer, error))
        rows.append(common.row(case, "one run", mine["one run"], "s CPU", peer, seconds))
    return rows


def spin_up_rows(quick):
    """The spun-up beam in one and in several bodies."""
    times, counts, rounds = (TIMES[:1], (1,), 1) if quick else (TIMES, (1, 2, 4, 8), 3)
    solver = diffrax.Dopri8() if quick else diffrax.Kvaerno5()  # the implicit one takes long to compile
    rows = [row for parts in counts for row in our_rows(parts, times, rounds, solver)]
    return rows if quick else rows + peer_rows(rows, times, rounds)


def pinned_rows(quick):
    """Accelerations of rows of bodies with pins between them."""
    return [row for n in ((3,) if quick else (25, 50, 100)) for row in row_of_bodies(n, 1 if quick else 3)]


def main():
    common.run_cases(__doc__, {"spin-up": spin_up_rows, "rows": pinned_rows})


if __name__ == "__main__":
    main()
