"""A multibody domain for Mosaic: values and gradients of three tasks beside the complex step, and what they cost.

Each task is packed as a Tesseract and asked by tesseract-core's runtime, as Mosaic's harness does it.  Printed: the
relative error of values, that of the vector-Jacobian product and its cosine with the truth, wall-clock milliseconds
of both, and the least error that central differences reach.
"""

import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE)]

from common import parser, report, row  # isort: skip # noqa: E402

import numpy as np  # noqa: E402
import tasks  # noqa: E402
import truth  # noqa: E402

import jaxmbs as mbs  # noqa: E402
from jaxmbs.adapters.tesseract import write_tesseract  # noqa: E402

DIFFERENCES = 10.0 ** -np.arange(3.0, 9.0)


def main():
    options = parser(__doc__).parse_args()
    chosen = [tasks.chain(2)] if options.quick else [tasks.chain(n) for n in (2, 4, 8)]
    chosen += [] if options.quick else [tasks.four_bar(bearing=False), tasks.four_bar(bearing=True)]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for k, task in enumerate(chosen):
            rows += measure(task, Path(folder) / str(k), repeats=2 if options.quick else 20)
            print(f"{task.name} done", flush=True)
    report(rows, options)


def measure(task, folder, repeats):
    """Rows of one task."""
    from tesseract_core import Tesseract

    folder.mkdir()
    question = mbs.runtime.export(task.function, (task.controls,), folder / "question.mbs")
    container = write_tesseract(question, folder / "container", name="jaxmbs")
    wanted, jacobian = np.atleast_1d(task.truth(task.flat)).real, truth.gradient(task.truth, task.flat)
    weights = np.random.default_rng(0).standard_normal(wanted.shape)
    gradient = weights @ jacobian
    names = list(task.controls)

    with Tesseract.from_tesseract_api(container / "tesseract_api.py") as solver:

        def apply():
            return solver.apply(task.controls)["output"]

        def vjp():
            found = solver.vector_jacobian_product(task.controls, names, ["output"], {"output": weights})
            return np.concatenate([found[name] for name in names])

        value, found = apply(), vjp()
        forward, backward = (milliseconds(call, repeats) for call in (apply, vjp))
    cosine = found @ gradient / np.linalg.norm(found) / np.linalg.norm(gradient)
    return [
        row(task.name, "controls", len(task.flat)),
        row(task.name, "error of the value", distance(value, wanted), "", goal="1e-8"),
        row(task.name, "error of the VJP", distance(found, gradient), "", goal="1e-8"),
        row(task.name, "1 - cosine of the VJP", max(0.0, 1.0 - cosine)),
        row(task.name, "error of central differences", best_difference(task, weights, gradient)),
        row(task.name, "apply", forward, "ms"),
        row(task.name, "vjp", backward, "ms", "apply", forward),
    ]


def distance(found, wanted):
    """Relative to the size of what is wanted."""
    return np.linalg.norm(found - wanted) / np.linalg.norm(wanted)


def best_difference(task, weights, gradient):
    """Least relative error of central differences of the truth over all steps, of one direction."""
    direction = np.random.default_rng(1).standard_normal(len(task.flat)) * task.flat
    ends = [
        [weights @ np.atleast_1d(task.truth(task.flat + s * h * direction)).real for s in (1, -1)]
        for h in DIFFERENCES
    ]
    slopes = np.array([(a - b) / (2 * h) for (a, b), h in zip(ends, DIFFERENCES, strict=True)])
    return np.min(np.abs(slopes / (gradient @ direction) - 1.0))


def milliseconds(call, repeats):
    """Median wall-clock time of a call."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


if __name__ == "__main__":
    main()
