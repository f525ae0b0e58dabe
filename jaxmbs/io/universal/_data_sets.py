"""Data sets of a universal file: between two lines `    -1`, the first line says which."""

from collections.abc import Iterator
from typing import NamedTuple

_MARK = b"    -1"
_HEADER = 11  # ASCII lines of a binary data set 58


class DataSet(NamedTuple):
    """A data set: its number, the line of the file on which it begins, its lines, and the bytes behind them where it
    is binary; `big` says that these are big-endian."""

    number: int
    line: int
    lines: list[str]
    content: bytes | None = None
    big: bool = False

    @property
    def place(self) -> str:
        """Location in the file, for messages."""
        return f"data set {self.number} at line {self.line}"


def data_sets(content: bytes, faults: list[str]) -> Iterator[DataSet]:
    """Data sets in the order of the file.  Faults: what is cut off, what stands between two of them."""
    at, line = 0, 0
    while at < len(content):
        text, at = _line(content, at)
        line += 1
        if not text.strip():
            continue
        if text.rstrip() != _MARK:
            faults.append(f"line {line}: {_quote(text)} stands outside of a data set: one before it has no end")
            return
        begin = line
        while text.rstrip() == _MARK and at < len(content):  # some programs write it twice
            text, at = _line(content, at)
            line += 1
        number = text[:6].strip()
        if not number.isdigit():
            faults.append(f"line {line}: {_quote(text)} is no number of a data set")
            return
        is_binary = text[6:7].lower() == b"b"
        found = _binary(content, at, text) if is_binary else _text(content, at)
        if found is None:
            faults.append(f"data set {int(number)} at line {begin} has no end: the file is cut off")
            return
        lines, block, at = found
        yield DataSet(int(number), begin, lines, block, is_binary and text.split()[1:2] == [b"2"])
        line += len(lines) + 1 if block is None else len(lines) + block.count(b"\n") + 1


def _text(content, at):
    lines = []
    while at < len(content):
        text, at = _line(content, at)
        if text.rstrip() == _MARK:
            return lines, None, at
        lines.append(text.decode("utf-8", "replace"))
    return None


def _binary(content, at, head):
    """Header lines and as many bytes as the first line says, or those before the next mark where that is wrong."""
    lines = []
    for _ in range(_HEADER):
        text, at = _line(content, at)
        lines.append(text.decode("utf-8", "replace"))
    words = head[7:].split()
    size = int(words[3]) if len(words) > 3 and words[3].isdigit() else 0
    for end in (at + size, content.find(_MARK, at)):
        start = end + len(content[end : end + 2]) - len(content[end : end + 2].lstrip(b"\r\n"))
        if end >= at and content[start : start + 6] == _MARK:
            return lines, content[at:end], _line(content, start)[1]
    return None


def _line(content: bytes, at: int) -> tuple[bytes, int]:
    """A line without its end, and where the next one begins."""
    end = content.find(b"\n", at)
    end = len(content) if end < 0 else end
    return content[at:end].rstrip(b"\r"), end + 1


def _quote(text):
    return repr(text[:40].decode("utf-8", "replace").strip())
