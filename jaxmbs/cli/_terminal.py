"""Lines on the terminal, free of control characters in names of models and files."""

import sys
from typing import Any

from ..errors import printable


def print_result(line: Any) -> None:
    """A line of the result, on the standard output."""
    print(printable(str(line)))


def print_note(line: Any) -> None:
    """A line about it, on the error stream."""
    print(printable(str(line)), file=sys.stderr)
