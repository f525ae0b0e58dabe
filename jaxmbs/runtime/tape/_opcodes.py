"""Codes of the machine's operations, read from the list that the C compiler reads."""

import re
from pathlib import Path

import numpy as np

HEADER = Path(__file__).parent / "opcodes.h"
_LIST: list[tuple[str, str]] = re.findall(r"\bOP\((\w+), (\w+)\)", HEADER.read_text(encoding="utf-8"))

#: Code of each operation.
CODE: dict[str, int] = {name: code for code, (name, _) in enumerate(_LIST)}
#: Name and kind of operands of each code.
NAMES = [name for name, _ in _LIST]
OPERANDS = [operands for _, operands in _LIST]
#: Type of the fields of instructions and of the numbers of tables: short, so that a step's stay in the cache.
WHOLE = np.dtype(np.int32)
#: Fields of an instruction; `_machine.py` and `machine.c` have the same order.
FIELDS = ("op", "mode", "n", "out", "a", "b", "c", "splat", "x0", "x1", "x2", "x3", "table")
