"""Codes of the machine's operations, read from the list that the C compiler reads."""

import re
from pathlib import Path

HEADER = Path(__file__).parent / "opcodes.h"
_LIST: list[tuple[str, str]] = re.findall(r"\bOP\((\w+), (\w+)\)", HEADER.read_text(encoding="utf-8"))

#: Code of each operation.
CODE: dict[str, int] = {name: code for code, (name, _) in enumerate(_LIST)}
#: Name and kind of operands of each code.
NAMES = [name for name, _ in _LIST]
OPERANDS = [operands for _, operands in _LIST]
#: Fields of an instruction, whole numbers of 64 bits; `_machine.py` and `machine.c` have the same order.
FIELDS = ("op", "mode", "n", "out", "a", "b", "c", "splat", "x0", "x1", "x2", "x3", "table")
