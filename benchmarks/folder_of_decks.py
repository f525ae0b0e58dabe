"""Decks of a folder: read, or refused by which cards, and what differs from the f06 or op2 files beside them.

Decks are read in processes of their own with a limit of time, so that none ends the run, and each has a line in a
file of finished ones, by which a run goes on where it stopped:
`python published_decks.py --folder MODELS --keep FILE`.
"""

import json
import os
import re
import select
import subprocess
import sys
import time
from pathlib import Path

import common
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from printed_results import results_beside

sys.path.insert(0, str(Path(__file__).parent.parent))
from jaxmbs.errors import ModelError  # noqa: E402
from jaxmbs.io import read_nastran  # noqa: E402

ENDINGS = (".bdf", ".dat", ".nas", ".blk", ".inc")
SECONDS, ROWS, PIECE = 1800, 1500, 40  # of one deck; larger systems are read, not compared
SUBSTRUCTURES = re.compile(r"^\s*BEGIN\s+(BULK|SUPER)", re.IGNORECASE | re.MULTILINE)
STATICS = ("1", "101", "SESTATIC", "STATICS", "105", "SEBUCKL", "")
OTHER_MODES = ("105", "SEBUCKL", "108", "109", "111", "112")  # of buckling; with residual vectors among them


def decks(folder):
    """Files of a folder that have a BEGIN BULK, by their paths in it."""
    files = sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in ENDINGS)
    return [str(p.relative_to(folder)) for p in files if SUBSTRUCTURES.search(p.read_bytes().decode("latin-1"))]


def one_deck(folder, name):
    """What came of a deck: "read" or "refused", cards or fields at fault, differences, CPU seconds of reading."""
    path, start = Path(folder) / name, time.process_time()
    try:
        deck = read_nastran(path, folders=[folder])
    except ModelError as error:
        lines = [line.partition(". ")[2] or line for line in str(error).splitlines()[1:]] or [str(error)]
        cards = sorted({line.split(" is not read")[0] for line in lines if " is not read" in line})
        fields = "fields of " + lines[0].split()[0]
        return {"outcome": "refused", "cards": cards or [fields], "fault": lines[0][:200]}
    seconds = time.process_time() - start
    found = {"outcome": "read", "nodes": len(deck.names), "seconds": seconds}
    try:
        return found | {"beside": beside(deck, path)}
    except (ModelError, ValueError, np.linalg.LinAlgError) as error:
        return found | {"fault": str(error)[:200]}


def solution(path):
    """What the deck's SOL line says."""
    match = re.search(r"^\s*SOL\s*,?\s*(\w+)", path.read_bytes().decode("latin-1"), re.IGNORECASE | re.MULTILINE)
    return match[1].upper() if match else ""


def beside(deck, path):
    """Largest differences from what Nastran left beside a deck, (what, value) each, over the largest of all."""
    moved, cycles, ending = results_beside(path)
    size, kind = len(deck.coordinates.free), solution(path)
    cases = [(number or 1, *sets) for number, *sets in deck.cases]  # Nastran counts from 1 where there is no SUBCASE
    static = [case for case in cases if moved.get(case[0]) and any(case[1:])] if kind in STATICS else []
    modal = cycles if kind not in OTHER_MODES else []
    if size >= ROWS or not (static or modal):
        return []
    system = deck.system
    rows = displacements_beside(deck, system, static, moved, ending)
    return rows + (frequencies_beside(system, modal, ending) if modal else [])


def displacements_beside(deck, system, cases, moved, ending):
    """The largest difference of each case, of lengths of displacements."""
    rows, K = [], np.asarray(system.to_dense().stiffness)
    for number, load, temperature in cases:
        try:
            ours = statics(deck, K, load, temperature)
        except (ModelError, ValueError, np.linalg.LinAlgError) as error:
            rows.append([f"{ending}, subcase {number}", str(error)[:150].replace("\n", " ")])
            continue
        theirs = moved[number]
        both = [(ours[k, :3], theirs[node[5:]]) for k, node in enumerate(deck.names) if node[5:] in theirs]
        a, b = (np.linalg.norm(side, axis=1) for side in zip(*both, strict=True))
        if np.max(b) > 0:
            rows.append([f"{ending}, displacements of subcase {number}", float(np.max(np.abs(a - b)) / np.max(b))])
    return rows


def statics(deck, K, load, temperature):
    """`deck.statics` with the stiffness of the system at hand, where nothing is enforced."""
    if deck.enforced is not None or (load and deck.loads[load].moves):
        return np.asarray(deck.statics(load, temperature))
    (rows,) = jax.vjp(deck.displacements, jnp.zeros(len(K)))[1](deck.load(load, temperature))
    return np.asarray(deck.displacements(scipy.linalg.solve(K, np.asarray(rows), assume_a="sym")))


def frequencies_beside(system, cycles, ending):
    """The largest difference of the frequencies that are not of rigid motions."""
    from published_decks import frequencies

    system = system.to_dense()
    rows = np.flatnonzero(np.diag(system.stiffness) + np.diag(system.mass))  # the others are free of everything
    found = frequencies(system, rows, min(len(cycles), len(rows)))
    shown = [(a, b) for a, b in zip(found, cycles, strict=False) if b > 1e-2]
    worst = max((abs(a / b - 1) for a, b in shown), default=0.0)
    return [[f"{ending}, {len(shown)} frequencies", float(worst)]] if shown else []


def finished(folder, keep):
    """All decks of a folder, those that the file `keep` has not yet one after another."""
    done = {}
    if keep and Path(keep).exists():
        lines = Path(keep).read_text().splitlines()
        done = {entry["name"]: entry for entry in map(json.loads, lines)}
    names = decks(folder)
    for place, entry in enumerate(in_processes(folder, [n for n in names if n not in done]), start=len(done) + 1):
        done[entry["name"]] = entry
        if keep:
            with open(keep, "a") as file:
                file.write(json.dumps(entry) + "\n")
        fault = entry.get("fault", "")[:100]
        print(f"{place} of {len(names)}: {entry['name']} {entry['outcome']} {fault}", flush=True)
    return [done[name] for name in names]


def in_processes(folder, names):
    """`one_deck` of each, `PIECE` of them in a process; another starts behind a deck that ends one or is too slow."""
    left = list(names)
    while left:
        command = [sys.executable, __file__, folder, *left[:PIECE]]
        environment = os.environ | {"JAXMBS_COMPILE": "auto"}  # many small decks: compilation would cost more
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment) as child:
            for _ in left[:PIECE]:
                ready, _, _ = select.select([child.stdout], [], [], SECONDS)
                line = child.stdout.readline() if ready else b""
                if line:
                    yield json.loads(line)
                    left.pop(0)
                    continue
                child.kill()
                fault = "ended its process" if ready else f"not done after {SECONDS} s"
                yield {"name": left.pop(0), "outcome": "failed", "fault": fault}
                break


def run_decks(folder, names):
    """Print a line of JSON for each."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what else is printed is no result
    for name in names:
        try:
            found = one_deck(folder, name)
        except Exception as error:  # noqa: BLE001 a fault of ours is a row, not the end
            found = {"outcome": "failed", "fault": f"{type(error).__name__}: {str(error)[:200]}"}
        print(json.dumps({"name": name} | found), file=out, flush=True)


def folder_rows(folder, keep):
    """Rows of the table."""
    found = finished(str(folder), keep)
    count = lambda outcome: sum(entry["outcome"] == outcome for entry in found)
    rows = [common.row(f"decks {what}", "number", count(what), "1") for what in ("read", "refused", "failed")]
    for entry in found:
        rows += [difference_row(entry["name"], what, value) for what, value in entry.get("beside", ())]
        if "fault" in entry and entry["outcome"] != "refused":
            rows.append(difference_row(entry["name"], "all", entry["fault"]))
    cards = {}
    for entry in found:
        for card in entry.get("cards", ()):
            cards[card] = cards.get(card, 0) + 1
    rows += [common.row(f"refused for {card}", "number", cards[card], "1") for card in by_count(cards)]
    seconds = sum(entry.get("seconds", 0.0) for entry in found)
    return [*rows, common.row("all decks that are read", "CPU time of reading", seconds, "s")]


def difference_row(name, what, value):
    """A row of a largest difference, or of why there is none."""
    if isinstance(value, str):
        return common.row(f"{name}, {what}: {value}", "not compared", 1, "1")
    return common.row(f"{name}, {what}", "largest difference", value, "1")


def by_count(cards):
    """Most frequent first."""
    return sorted(cards, key=lambda card: (-cards[card], card))


if __name__ == "__main__":
    run_decks(sys.argv[1], sys.argv[2:])
