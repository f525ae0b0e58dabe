"""Rows of N four-bars in linear time: build, states, accelerations, gradients, batches, reactions, motions.

Every row has one freedom and N loops of spatial pins, three rows of each redundant.  SciPy's SuperLU factors and
solves the same saddle system, as a sparse matrix that is already formed; the dense solver stands beside where it ends
in reasonable time.  Motions pass every singular pose and are compared with one equation by SciPy's DOP853.
CPU time, one thread; compilation apart.
"""

import dataclasses
import time

import common
import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as spl
from cases import models

import jaxmbs as mbs

SIZES, DENSE_UP_TO, DESIGNS = (40, 160, 640), 160, 64


def compiled(function, *args):
    """The jitted function, and CPU seconds of its compilation."""
    program, start = mbs.jit(function), time.process_time()
    jax.block_until_ready(program(*args))
    middle = time.process_time()
    jax.block_until_ready(program(*args))
    return program, max(0.0, 2.0 * middle - start - time.process_time())


def saddle_by_superlu(system, state):
    """Function that factors and solves the sparse saddle system."""
    M = sparse.csc_array(np.asarray(mbs.mass_matrix(system, state)))
    A = sparse.csc_array(np.asarray(mbs.constraints.constraint_jacobian(system, state)))
    lower = -1e-9 * sparse.eye_array(A.shape[0])
    K, b = sparse.block_array([[M, A.T], [A, lower]], format="csc"), np.ones(sum(A.shape))
    return lambda: spl.splu(K).solve(b)


def build_rows(n):
    start = time.process_time()
    system = models.n_four_bar(n)
    built = time.process_time() - start
    guess = {name: -0.4 if name[0] == "A" else 0.4 for name in system.topology.joint_names if name[0] in "Al"}
    del guess["A0"]

    def assembled(angle):
        return mbs.State.at(system, A0=angle, velocities={"A0": -1.0}, guess=guess)

    assembled(-0.4)
    times = common.cpu_seconds({"ours": lambda: assembled(-0.45)}, 5, 0.0)
    name = f"N = {n}"
    rows = [common.row(name, "build", built, "s CPU"), common.row(name, "State.at", times["ours"], "s CPU")]
    return system, rows


def solve_rows(n, system, rounds):
    """Accelerations, gradient, batch and reactions."""
    name, state = f"N = {n}", models.n_four_bar_state(system, -0.4)

    def accelerations(mass):
        return mbs.forward_dynamics(dataclasses.replace(system, mass=mass), state)[0]

    forward, first = compiled(accelerations, system.mass)
    gradient, second = compiled(jax.grad(lambda m: jnp.sum(accelerations(m) ** 2)), system.mass)
    loads, third = compiled(lambda m: mbs.reactions(dataclasses.replace(system, mass=m), state), system.mass)
    error = abs(float(forward(system.mass)[0]) - models.n_four_bar_acceleration(n, -0.4))
    programs = {
        "ours": lambda: jax.block_until_ready(forward(system.mass)),
        "gradient": lambda: jax.block_until_ready(gradient(system.mass)),
        "reactions": lambda: jax.block_until_ready(loads(system.mass)),
        "SuperLU": saddle_by_superlu(system, state),
    }
    if n <= DENSE_UP_TO:
        dense = models.n_four_bar(n, linear_solver="dense")
        by_matrix, _ = compiled(
            lambda m: mbs.forward_dynamics(dataclasses.replace(dense, mass=m), state)[0], dense.mass
        )
        programs["dense"] = lambda: jax.block_until_ready(by_matrix(dense.mass))
    times = common.cpu_seconds(programs, rounds, 0.0)
    rows = [
        common.row(name, "accelerations", 1e3 * times["ours"], "ms CPU", "SuperLU", 1e3 * times["SuperLU"]),
        common.row(name, "accelerations, compile", first, "s CPU"),
        common.row(name, "accelerations, error", error, "rad/s^2"),
        common.row(name, "gradient", 1e3 * times["gradient"], "ms CPU", "accelerations", 1e3 * times["ours"]),
        common.row(name, "gradient, compile", second, "s CPU"),
        common.row(name, "all reactions", 1e3 * times["reactions"], "ms CPU"),
        common.row(name, "all reactions, compile", third, "s CPU"),
    ]
    if "dense" in times:
        rows.append(common.row(name, "accelerations", 1e3 * times["ours"], "ms CPU", "dense", 1e3 * times["dense"]))
    return rows


def batch_rows(n, system, rounds):
    """Accelerations of many designs by `mbs.batch`."""
    state, masses = (
        models.n_four_bar_state(system, -0.4),
        system.mass[None] * jnp.linspace(0.9, 1.1, DESIGNS)[:, None],
    )

    def accelerations(mass):
        return mbs.forward_dynamics(dataclasses.replace(system, mass=mass), state)[0]

    def run():
        return jax.block_until_ready(mbs.batch(accelerations, masses, progress=False).values)

    run()
    seconds = common.cpu_seconds({"ours": run}, rounds, 0.0)["ours"] / DESIGNS
    return [common.row(f"N = {n}", f"accelerations, each of {DESIGNS} designs", 1e3 * seconds, "ms CPU")]


def motion_rows(n, system, end):
    """A motion through singular poses."""
    name, state = f"N = {n}", models.n_four_bar_state(system, 0.0)

    def run():
        return mbs.simulate(system, state, ts=np.array([0.0, end]), rtol=1e-10, atol=1e-10, max_steps=100_000)

    run()
    start = time.process_time()
    motion = jax.block_until_ready(run())
    seconds = time.process_time() - start
    error = abs(float(motion.states.coordinates[-1, 0]) - models.n_four_bar_angle(n, 0.0, end))
    return [
        common.row(name, f"motion of {end:g} s", seconds, "s CPU"),
        common.row(name, f"motion of {end:g} s, error of the angle", error, "rad"),
        common.row(name, f"motion of {end:g} s, steps", int(motion.diagnostics.num_steps), "1"),
    ]


def verb_rows(n, system):
    """Verbs about one state of the row, second calls."""
    state = models.n_four_bar_state(system, 0.6, 0.0)
    verbs = {
        "kic": lambda: mbs.constraints.kic(system, state),
        "linearise": lambda: mbs.linearise(system, state),
        "equilibrium": lambda: mbs.equilibrium(system, models.n_four_bar_state(system, 2.6, 0.0)),
        "State.at, near": lambda: mbs.State.at(system, A0=0.7, near=state),
    }
    for verb in verbs.values():
        verb()
    seconds = common.cpu_seconds(verbs, 3, 0.0)
    return [common.row(f"N = {n}", verb, seconds[verb], "s CPU") for verb in verbs]


def main():
    options = common.parser(__doc__).parse_args()
    sizes, rounds = ((12,), 2) if options.quick else (SIZES, 20)
    rows = []
    for n in sizes:
        system, found = build_rows(n)
        rows += found + solve_rows(n, system, rounds)
        if n <= DENSE_UP_TO:
            rows += [] if options.quick else verb_rows(n, system)
            rows += batch_rows(n, system, min(rounds, 5)) + motion_rows(n, system, 1.0 if options.quick else 10.0)
        print(f"N = {n} done", flush=True)
    common.report(rows, options)


if __name__ == "__main__":
    main()
