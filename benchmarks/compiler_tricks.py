"""What each trick on the compiler gains: compile and run CPU seconds of nine programs with it on, and with it off.

A process for each program, with the flags of any user (none); in it every trick of `jaxmbs.runtime` is switched off
in turn beside all of them on, and both compiled programs run in alternation.  Of `--rounds` the least compilation
counts, and the run with the median ratio.
A program whose text and compiler's options do not change with a trick is not compiled again: its ratio is 1.  Ratios
are "off / on": above 1 the trick gains.
"""

import hashlib
import json
import os
import subprocess
import sys
import time

os.environ["JAXMBS_BENCHMARK_ENVIRONMENT"] = "user"

import common  # noqa: I001, E402
import jax

from jaxmbs.runtime import compile_kind, trick_states, without_tricks
from jaxmbs.runtime._batch_program import _with_sums, is_motion
from jaxmbs.runtime._compiler_options import compiler_options
from trick_programs import PROGRAMS

NOTHING = "none"  # switched off


class Variant:
    """A program traced and compiled with a trick off."""

    def __init__(self, name, quick, off):
        self.program, self.quick, self.off = PROGRAMS[name], quick, off
        self.compile, self.pairs = float("inf"), []
        self.key, self._executable = "", None

    def build(self, twin=None):
        """Trace, and compile unless the twin has the same program; notes the CPU seconds."""
        jax.clear_caches()
        tricks = () if self.off == NOTHING else (self.off,)
        if tricks:
            with without_tricks(*tricks):
                self._build(twin)
        else:
            self._build(twin)

    def _build(self, twin):
        function, self.arguments, kind = self.program(self.quick)
        start = time.process_time()
        often, compile = False, "full" if kind == "batch" else kind
        with compile_kind(compile):
            if kind == "batch":
                often = not is_motion(jax.make_jaxpr(function)(*(x[0] for x in self.arguments)))
                program = _with_sums(jax.vmap(function), self.arguments, "batch")
            else:
                program = jax.jit(function)
            lowered = program.lower(*self.arguments)
        traced = time.process_time() - start
        options = compiler_options(compile, jax.default_backend(), often)
        self.key = hashlib.sha256(f"{lowered.as_text()} {options}".encode()).hexdigest()
        if twin is not None and twin.key == self.key:
            self.xla, self._executable = twin.xla, twin._executable
        else:
            start = time.process_time()
            self._executable = lowered.compile(options)
            self.xla = time.process_time() - start
        self.compile = min(self.compile, traced + self.xla)

    def run(self):
        """(seconds with the trick on, and off) of the pair with the median ratio; () where no pair was run."""
        ordered = sorted(self.pairs, key=lambda pair: pair[1] / pair[0])
        return ordered[len(ordered) // 2] if ordered else ()

    def __call__(self):
        return jax.block_until_ready(self._executable(*self.arguments))


def measure(name, quick, rounds, tricks):
    """Rows (trick, compile on, off, run on, off) of one program; no runs where the trick does not touch it."""
    on, offs = Variant(name, quick, NOTHING), [Variant(name, quick, trick) for trick in tricks]
    for _ in range(rounds):
        on.build()
        for off in offs:
            off.build(on)
            if off.key != on.key:
                times = common.cpu_seconds({"on": on, "off": off}, rounds=5, least=0.02 if quick else 0.2)
                off.pairs.append((times["on"], times["off"]))
    return [(off.off, on.compile, off.compile, *off.run()) for off in offs]


def child(name, options):
    """The figures of a program by a process of its own."""
    command = [sys.executable, __file__, "--child", name, "--rounds", str(options.rounds)]
    command += ["--quick"] * options.quick + (["--tricks", *options.tricks] if options.tricks else [])
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{name}: {done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def rows_of(name, figures):
    """Rows of one program: off in place of ours' peer, so that the ratio is on / off."""
    rows = []
    for trick, compile_on, compile_off, *runs in figures:
        rows.append(common.row(name, f"{trick}: compile, CPU", compile_on, "s", f"{trick} off", compile_off))
        if runs:
            rows.append(common.row(name, f"{trick}: run, CPU", 1e3 * runs[0], "ms", f"{trick} off", 1e3 * runs[1]))
    return rows


def ratio_table(rows):
    """A line for each trick: off / on of compile and run of each program, dots where the program is the same."""
    names, tricks = (list(dict.fromkeys(found)) for found in ([r.case for r in rows], [_trick(r) for r in rows]))
    ratio = {(r.case, r.metric): r.peer_value / r.value for r in rows if r.peer_value}
    lines = [f"{'off / on: compile, run':24}" + "".join(f"{name[:22]:>24}" for name in names)]
    for trick in tricks:
        cells = []
        for name in names:
            compile, run = (ratio.get((name, f"{trick}: {what}, CPU")) for what in ("compile", "run"))
            cells.append(f"{compile or 1.0:.2f} " + ("   ." if run is None else f"{run:.2f}"))
        lines.append(f"{trick:24}" + "".join(f"{cell:>24}" for cell in cells))
    return "\n".join(lines)


def _trick(row):
    return row.metric.partition(":")[0]


def main():
    parser = common.parser(__doc__, *PROGRAMS)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--tricks", nargs="+", metavar="TRICK", help="those to switch off (default: all)")
    parser.add_argument("--child", help="measure this program in this process: the script starts itself so")
    options = parser.parse_args()
    able = [state.name for state in trick_states() if state.state == "on"]
    tricks = [name for name in options.tricks or able if name in able]
    if options.child:
        print(json.dumps(measure(options.child, options.quick, options.rounds, tricks)))
        return
    options.rounds, options.tricks = (1, tricks[:2]) if options.quick else (options.rounds, tricks)
    names = [name for name in PROGRAMS if common.wanted(options, name)]
    rows = [r for name in names[:1] if options.quick for r in rows_of(name, child(name, options))]
    for name in [] if options.quick else names:
        rows += rows_of(name, child(name, options))
        print(ratio_table(rows), flush=True)
    common.report(rows, options)


if __name__ == "__main__":
    main()
