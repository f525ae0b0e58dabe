"""Frequencies of published Nastran decks: those printed for them, and ours.

Benchmarks of NAFEMS, which `tests/io/published.py` writes as decks, and the payload truss of pyYeti's coupled loads
analysis (its test files, BSD-3), whose fixed modes Nastran found.  The peer's figures are the published ones.
"""

import sys
import tempfile
import time
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
    system = system.to_dense()
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


def plate(count):
    """CPU seconds of reading a plate of so many squares along each side."""
    side = count + 1
    lines = ["BEGIN BULK", "MAT1,1,2.1+11,,.3,7850.", "PSHELL,1,1,.01,1,,1", f"SPC1,1,123456,1,THRU,{side}"]
    lines += [
        f"GRID,{1 + i * side + j},,{i / count:.6f},{j / count:.6f},0." for i in range(side) for j in range(side)
    ]
    corners = [1 + i * side + j for i in range(count) for j in range(count)]
    lines += [f"CQUAD4,{k},1,{a},{a + side},{a + side + 1},{a + 1}" for k, a in enumerate(corners, start=1)]
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "plate.bdf").write_text("\n".join(lines))
        start = time.process_time()
        read_nastran(Path(place) / "plate.bdf")
    return common.row(f"plate of {side**2} nodes", "CPU time to read", time.process_time() - start, "s")


def main():
    parser = common.parser(__doc__)
    parser.add_argument("--folder", help="tell which decks of a folder are read, and why the others are not")
    parser.add_argument("--keep", metavar="FILE", help="of --folder: finished decks, by which a run goes on")
    options = parser.parse_args()
    if options.folder:
        from folder_of_decks import folder_rows

        common.report(folder_rows(options.folder, options.keep), options)
        return
    found = [*nafems(QUICK if options.quick else PUBLISHED), plate(8 if options.quick else 141)]
    common.report(found if options.quick else found + payload(), options)


if __name__ == "__main__":
    main()
