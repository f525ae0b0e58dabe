"""Frequencies of published Nastran decks: those printed for them, and ours.

Benchmarks of NAFEMS, which `tests/io/published.py` writes as decks, and the payload truss of pyYeti's coupled loads
analysis (its test files, BSD-3), whose fixed modes Nastran found.  The peer's figures are the published ones.
"""

import re
import sys
import tempfile
import time
from pathlib import Path

import common
import numpy as np
import scipy.linalg

sys.path.insert(0, str(Path(__file__).parent.parent))
from jaxmbs.errors import ModelError  # noqa: E402
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


def folder(path):
    """How many decks of a folder are read, and for which cards the others are refused; a deck has a BEGIN BULK.

    Where an f06 of its name lies beside a deck, frequencies and static displacements are compared with it.
    """
    read, refused, cards, seconds, beside = [], [], {}, 0.0, []
    for file in sorted(
        p for p in Path(path).rglob("*") if p.suffix.lower() in (".bdf", ".dat", ".nas", ".blk", ".inc")
    ):
        if not re.search(
            r"^\s*BEGIN\s+(BULK|SUPER)", file.read_bytes().decode("latin-1"), re.IGNORECASE | re.MULTILINE
        ):
            continue
        start, name = time.process_time(), str(file.relative_to(path))
        try:
            deck = read_nastran(file, folders=[path])
            read.append(name)
            beside += beside_f06(name, deck, file.with_suffix(".f06"))
        except ModelError as error:
            refused.append(name)
            lines = [line.partition(". ")[2] or line for line in str(error).splitlines()[1:]] or [str(error)]
            names = {line.split(" is not read")[0] for line in lines if " is not read" in line}
            for card in names or {"wrong or unsupported fields of " + lines[0].split()[0]}:
                cards[card] = cards.get(card, 0) + 1
        seconds += time.process_time() - start
        print(f"{name} {'is read' if read[-1:] == [name] else 'is refused: ' + lines[0][:100]}", flush=True)
    rows = [
        common.row("decks read", "number", len(read), "1"),
        common.row("decks refused", "number", len(refused), "1"),
    ]
    rows += [*beside, common.row("all decks", "CPU time", seconds, "s")]
    return rows + [
        common.row(f"refused for {card}", "number", n, "1") for card, n in sorted(cards.items(), key=by_count)
    ]


def printed(path):
    """Of an f06: displacements by subcase and node, frequencies of the first table."""
    moved, cycles, subcase, table = {}, [], 1, ""
    for line in path.read_bytes().decode("latin-1").splitlines():
        found, flat = re.search(r"SUBCASE\s+(\d+)", line), line.replace(" ", "")
        subcase = int(found[1]) if found else subcase
        words = line.split()
        if "DISPLACEMENTVECTOR" in flat:
            table = "displacements"
        elif "REALEIGENVALUES" in flat:
            table = "frequencies" if not cycles else ""
        elif line.startswith("1"):
            table = ""
        elif table == "displacements" and len(words) > 4 and words[0].isdigit() and words[1] == "G":
            moved.setdefault(subcase, {}).setdefault(words[0], [float(word) for word in words[2:5]])
        elif table == "frequencies" and len(words) == 7 and words[0].isdigit():
            cycles.append(float(words[4]))
    return moved, cycles


def beside_f06(name, deck, path):
    """Rows of what an f06 prints of a deck: largest differences, displacements over the largest of all."""
    moved, cycles = printed(path) if path.exists() else ({}, [])
    rows, size = [], len(deck.coordinates.free)
    for number, load, temperature in deck.cases if size < 4000 else ():
        theirs = moved.get(number, {})
        try:
            ours = np.asarray(deck.statics(load, temperature)) if theirs and (load or temperature) else None
        except (ModelError, ValueError) as error:
            print(f"{name}: {str(error)[:150]}", flush=True)
            continue
        if ours is not None:
            both = [(ours[k, :3], theirs[node[5:]]) for k, node in enumerate(deck.names) if node[5:] in theirs]
            a, b = (np.linalg.norm(side, axis=1) for side in zip(*both, strict=True))
            worst = float(np.max(np.abs(a - b)) / np.max(b))
            rows.append(common.row(f"{name}, subcase {number}", "largest difference of displacements", worst, "1"))
    if cycles and size < 4000:
        found = frequencies(deck.system, np.arange(size), min(len(cycles), size))
        shown = [(a, b) for a, b in zip(found, cycles, strict=False) if b > 1e-2]
        worst = max(abs(a / b - 1) for a, b in shown)
        rows.append(common.row(name, f"largest difference of {len(shown)} frequencies", worst, "1"))
    return rows


def by_count(item):
    """Most frequent first."""
    return -item[1], item[0]


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
    options = parser.parse_args()
    if options.folder:
        common.report(folder(options.folder), options)
        return
    found = [*nafems(QUICK if options.quick else PUBLISHED), plate(8 if options.quick else 141)]
    common.report(found if options.quick else found + payload(), options)


if __name__ == "__main__":
    main()
