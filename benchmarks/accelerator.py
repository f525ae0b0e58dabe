"""Many samples at once on an accelerator: an arm of seven joints, motions of four-bars, reactions of a chain.

Samples per second of wall time, values and gradients: "device" is `jax.jit(jax.vmap(f))` on arrays that lie there,
"batch" is `mbs.batch` from arrays of the host and back.  The peer is `mbs.batch` on all cores of the same machine, in
a process of its own.  Errors are those beside one core of the host, of the first samples.  Runs on the CPU alone
where there is no accelerator; `JAX_PLATFORMS=cuda,cpu` chooses one.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from typing import Any

import common
import four_bars
import jax
import numpy as np
from networks import Case
from random_trees import our_system, random_links

import jaxmbs as mbs
from jaxmbs.doctor import wrong_programs

CHECKED = 64  # samples that are compared with the host's
RTOL, SOLVER = 1e-3, "Dopri5 over"
PEER = "mbs.batch, all cores"


@dataclass(frozen=True)
class Workload:
    """A function of one sample, `samples(B)` and the sizes B: on the device, and of a batch."""

    name: str
    function: Any
    samples: Any
    sizes: tuple
    total: int
    goal: str = ""


# ------------------------------------------------------------------------------------------------------ what is run
def arm():
    """Accelerations of a random arm of seven joints, and the gradient of a functional of them by its parameters."""
    system = our_system(random_links("chain", 7, seed=7))
    weight = np.cos(np.arange(7.0))

    def accelerations(row):
        state = mbs.State(np.zeros(()), row["q"], row["v"], structure=system.topology.structure)
        return mbs.forward_dynamics(system, state)[0]

    def gradient(row):
        def work(row):
            return weight @ accelerations(row)

        return jax.grad(work)(row)

    def samples(number):
        rng = np.random.default_rng(1)
        return {"q": rng.uniform(-np.pi, np.pi, (number, 7)), "v": rng.normal(size=(number, 7))}

    return (
        Workload("arm, accelerations", accelerations, samples, (2**14, 2**17, 2**20), 2**20, "1e8"),
        Workload("arm, gradient by q and v", gradient, samples, (2**17,), 2**18),
    )


def motions():
    """Peak pin loads of four-bars over one second, and the gradient of the largest by lengths and masses."""
    motion, slope = four_bars.study(SOLVER), jax.value_and_grad(four_bars.largest(SOLVER), has_aux=True)

    def peaks(row):
        found = motion(row | {"rtol": RTOL})
        return found["peaks"], found["steps"]

    def gradient(row):
        (value, found), slopes = slope(row["bars"], RTOL)
        return value, slopes, found["steps"]

    def samples(number):
        rng = np.random.default_rng(0)
        table = {name: length * rng.uniform(0.9, 1.1, number) for name, length in four_bars.LENGTHS.items()}
        return {"bars": table | {f"{name} mass": table[name].copy() for name in four_bars.BARS}}

    return (
        Workload("four-bar, motion and pin loads", peaks, samples, (2**12,), 2**16, "1e5"),
        Workload("four-bar, motion with gradient", gradient, samples, (2**12,), 2**14, "1e5"),
    )


def reactions():
    """Reactions of a chain of 100 bodies with ten loops, for joint positions of their own."""
    case = Case("loops", 100)

    def samples(number):
        noise = np.random.default_rng(2).normal(size=(number, *case.bonds.position.shape))
        return {"position": np.asarray(case.bonds.position) + 0.01 * noise}

    return (
        Workload(
            "100 bodies, reactions", lambda row: case.value(row["position"], case.loads), samples, (2**10,), 2**13
        ),
    )


WORKLOADS = {"arm": arm, "four-bars": motions, "reactions": reactions}


# ------------------------------------------------------------------------------------------------------- measuring
def wall_seconds(function, rounds=3):
    """Least wall seconds of a call, after a first one."""
    jax.block_until_ready(function())
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        jax.block_until_ready(function())
        times.append(time.perf_counter() - start)
    return min(times)


def error(work, samples, found):
    """Largest difference from the host's results of the first samples, relative to the largest value of an array."""
    few = jax.tree.map(lambda x: np.asarray(x)[:CHECKED], samples)
    with jax.default_device(jax.devices("cpu")[0]):
        expected = jax.jit(jax.vmap(work.function))(few)
    gaps = [
        np.max(np.abs(np.asarray(x)[: len(y)] - y)) / np.max(np.abs(y))
        for x, y in zip(jax.tree.leaves(found), map(np.asarray, jax.tree.leaves(expected)), strict=True)
    ]
    return common.row(work.name, "error beside the host", max(gaps), "1")


def device_rows(work, size):
    """Rows of one program of `size` samples on the device."""
    samples = jax.tree.map(jax.numpy.asarray, work.samples(size))
    start = time.perf_counter()
    program = jax.jit(jax.vmap(work.function)).lower(samples).compile()
    compilation = time.perf_counter() - start
    name = f"{work.name}, B={size}"
    return [
        common.row(name, "device", size / wall_seconds(lambda: program(samples)), "samples/s", goal=work.goal),
        common.row(name, "compilation, wall", compilation, "s"),
        common.row(name, "memory", program.memory_analysis().temp_size_in_bytes / 2**20, "MiB"),
    ]


def batch_rows(work, total, others):
    """Rows of a batch from the host and back, beside that of another process; its error, except in that process."""
    samples = work.samples(total)
    run = lambda: mbs.batch(work.function, samples, progress=False).values
    start = time.perf_counter()
    found = run()
    first, name = time.perf_counter() - start, f"{work.name}, B={total}"
    seconds = time.perf_counter()
    run()
    seconds, peer = time.perf_counter() - seconds, others[name] if others else None
    rows = [
        common.row(name, "batch", total / seconds, "samples/s", PEER if peer else None, peer, work.goal),
        common.row(name, "first batch less a second one, wall", first - seconds, "s"),
    ]
    return [*rows, error(work, samples, found)] if others is not None else rows


def on_the_host(options):
    """Samples per second of the batches on all cores of this machine, by case."""
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "rows.json")
        command = [sys.executable, __file__, "--json", file, "--host", *["--quick"] * options.quick]
        command += ["--only", *options.only] if options.only else []
        subprocess.run(command, env=os.environ | {"JAX_PLATFORMS": "cpu"}, check=True, stdout=subprocess.DEVNULL)
        with open(file) as text:
            return {row["case"]: row["value"] for row in json.load(text) if row["metric"] == "batch"}


def main():
    parser = common.parser(__doc__, *WORKLOADS)
    parser.add_argument("--host", action="store_true", help="batches alone, as of the peer")
    parser.add_argument("--alone", action="store_true", help="without the peer")
    options = parser.parse_args()
    is_cpu = options.alone or jax.default_backend() == "cpu"
    others, rows = None if options.host else {} if is_cpu else on_the_host(options), []
    for name, make in WORKLOADS.items():
        for work in make() if common.wanted(options, name) else ():
            sizes, total = (work.sizes and (CHECKED,), CHECKED) if options.quick else (work.sizes, work.total)
            found = [row for size in sizes if not options.host for row in device_rows(work, size)]
            found += batch_rows(work, total, others)
            print(common.table(found), flush=True)
            rows += found
    wrong = sorted({program.name for program in wrong_programs()})
    rows.append(common.row("compiler", "small programs computed wrongly", ", ".join(wrong) or "none"))
    rows.append(common.row("device", "version", str(jax.devices()[0].device_kind)))
    common.report(rows, options)


if __name__ == "__main__":
    main()
