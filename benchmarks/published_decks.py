"""Frequencies of published Nastran decks: those printed for them, and ours.

Benchmarks of NAFEMS, which `tests/io/published.py` writes as decks, and the payload truss of pyYeti's coupled loads
analysis (its test files, BSD-3), whose fixed modes Nastran found.  The peer's figures are the published ones.
"""

import sys
import tempfile
from pathlib import Path

import common
import numpy as np
import scipy.linalg

sys.path.insert(0, str(Path(__file__).parent.parent))
from jaxmbs.io import read_nastran, read_op4  # noqa: E402
from tests.io.published import PUBLISHED  # noqa: E402

QUICK = ("FV2 double cross", "FV4 off-centre masses")


def frequencies(system, rows, count):
    """Lowest `count` [Hz] with the other rows held; a shift, as bars may have no inertia in torsion."""
    K, M = (np.asarray(A)[np.ix_(rows, rows)] for A in (system.stiffness, system.mass))
    shift = 1e-3 * np.trace(K) / np.trace(M)
    last = [len(rows) - count, len(rows) - 1]
    inverse = scipy.linalg.eigh(M, K + shift * M, eigvals_only=True, subset_by_index=last)[::-1]
    return np.sqrt(np.maximum(1 / inverse - shift, 0.0)) / (2 * np.pi)


def rows_of(name, found, published):
    """A row for each mode, and the largest difference."""
    rows = [
        common.row(f"{name}, mode {k}", "frequency", ours, "Hz", "published", theirs)
        for k, (ours, theirs) in enumerate(zip(found, published, strict=True), start=1)
    ]
    worst = float(np.max(np.abs(np.asarray(found) / np.asarray(published) - 1)))
    return [*rows, common.row(name, "largest difference", worst, "1")]


def nafems(names):
    """The decks of NAFEMS."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            case, path = PUBLISHED[name], Path(folder) / "deck.bdf"
            path.write_text(case.deck)
            system = read_nastran(path).system
            ours = frequencies(system, np.arange(system.num_rows), case.first + len(case.frequencies))
            found += rows_of(name, ours[case.first :], case.frequencies)
            print(f"{name} done", flush=True)
    return found


def payload():
    """Sixteen modes of the truss with its four interface nodes held."""
    try:
        import pyyeti
    except ImportError:
        return []
    folder = Path(pyyeti.__file__).parent / "tests" / "cla_test_data"
    if not folder.exists():
        return []
    nodes = ["GRID 3", "GRID 11", "GRID 19", "GRID 27"]
    system = read_nastran(folder / "outboard.blk", polar=False, masses="consistent").assemble(interface=nodes)
    exact = read_op4(folder / "outboard.op4")
    modal = [np.diag(np.asarray(A))[24:40] for A in (exact.stiffness, exact.mass)]
    ours = frequencies(system, np.array(system.interior), 16)
    return rows_of("payload truss", ours, np.sqrt(modal[0] / modal[1]) / (2 * np.pi))


def main():
    options = common.parser(__doc__).parse_args()
    found = nafems(QUICK if options.quick else PUBLISHED)
    common.report(found if options.quick else found + payload(), options)


if __name__ == "__main__":
    main()
