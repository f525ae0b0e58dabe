"""Displacements of static cases and frequencies that Nastran left beside a deck, in its f06 or op2 file."""

import re

import numpy as np

_TABLES = ("OUGV1", "OUG1", "BOUGV1", "OUPV1")
_STATICS, _IDENT_WORDS = 1, 146


def results_beside(path):
    """Of a deck: displacements (3,) by subcase and node, frequencies of the first table [Hz], the file's ending."""
    for ending, read in ((".f06", from_f06), (".op2", from_op2)):
        file = path.with_suffix(ending)
        if file.exists():
            moved, cycles = read(file)
            if moved or cycles:
                return moved, cycles, ending
    return {}, [], ""


def from_f06(path):
    """Of the text file."""
    moved, cycles, subcase, table = {}, [], 1, ""
    for line in path.read_bytes().decode("latin-1").splitlines():
        found, flat = re.search(r"SUBCASE\s+(\d+)", line), line.replace(" ", "")
        subcase = int(found[1]) if found else subcase
        words = line.split()
        if "DISPLACEMENTVECTOR" in flat and "COMPLEX" not in flat:
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


def _records(data):
    """Logical records of a file of 4-byte words: pieces, each behind the number of its words, until this is not
    positive."""
    place, pieces, words = 0, [], 0
    while place + 8 <= len(data):
        (size,) = np.frombuffer(data, "<i4", 1, place)
        body = data[place + 4 : place + 4 + size]
        if size < 0 or len(body) < size:
            return
        place += size + 8
        if words > 0 and size == 4 * words:
            pieces += [body] if pieces or words > 1 else []  # one word alone says which sort of record follows
            words = 0
        elif size == 4:
            (words,) = np.frombuffer(body, "<i4")
            if words <= 0 and pieces:
                yield b"".join(pieces)
                pieces = []
        else:
            words = 0


def from_op2(path):
    """Of the binary file; real results in single precision, sorted by subcase."""
    moved, cycles, table, ident = {}, [], "", None
    for record in _records(path.read_bytes()):
        name = record[:8].decode("latin-1").strip()
        if len(record) == 8:
            table = name
        elif len(record) == 4 * _IDENT_WORDS and (table in _TABLES or table.startswith("LAMA")):
            ident = np.frombuffer(record, "<i4")
        elif table in _TABLES and ident is not None:
            rows = _static_rows(ident, record)
            if rows:
                moved.setdefault(int(ident[3]), rows)
            ident = None
        elif table.startswith("LAMA") and ident is not None:
            if not cycles and len(record) % 28 == 0:
                cycles = np.frombuffer(record, "<f4").reshape(-1, 7)[:, 4].astype(float).tolist()
            ident = None
    return moved, cycles


def _static_rows(ident, record):
    """Displacements by node where these are what the record holds."""
    kind, table, width = ident[0] // 10, ident[1] % 1000, ident[9]
    if (kind, table, width) != (_STATICS, 1, 8) or len(record) % 32:
        return {}
    whole = np.frombuffer(record, "<i4").reshape(-1, 8)
    values = np.frombuffer(record, "<f4").reshape(-1, 8).astype(float)
    grid = whole[:, 1] == 1
    return {str(n // 10): row[2:5].tolist() for n, row in zip(whole[grid, 0], values[grid], strict=True)}
