"""Lines of a deck: its bulk data, with what it includes from its own folder."""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from ...errors import ModelError
from .._file_inside import file_inside, leaves_folder
from .._regular_file import require_file

MAX_BYTES = 256 * 2**20  # of a deck and all that it includes
MAX_FILES, MAX_DEPTH = 500, 20
_BEGIN = re.compile(r"^\s*BEGIN\b(.*)", re.IGNORECASE)
_INCLUDE = re.compile(r"^\s*INCLUDE\b\s*(.*)", re.IGNORECASE)
_SUBCASE = re.compile(r"^\s*SUBCASE(?:\s+|\s*=\s*)(\d{1,8})\b", re.IGNORECASE)
_COMBINATION = re.compile(r"^\s*(SUBCOM|SYMCOM|SYM|REPCASE)(?:\s+|\s*=\s*)\d", re.IGNORECASE)
_PARAMETER = re.compile(r"^\s*PARAM[\s,]+([A-Z]\w*)[\s,]+([^\s,]+)", re.IGNORECASE)
_COMMAND = re.compile(r"^\s*([A-Z][A-Z0-9]*)\s*(?:\(\s*([^)]*)\)\s*)?=\s*(.*?)\s*$", re.IGNORECASE)


class DeckLine(NamedTuple):
    """A line without its comment, and where it stands: "plate.bdf:12"."""

    text: str
    place: str


class BulkData:
    """The bulk data of a deck.

    Attributes:
        name: of the file.
        faults: what is wrong with the files.
        choices: what the case control chooses, in its order: `{"SPC": ["1", "2"], "METHOD": ["4"]}`.
        common: what it chooses before all subcases, the first of each; cases: what each subcase chooses.
        parameters: cards PARAM of the case control, up to those of its first subcase.
        skipped: number of lines before BEGIN BULK.
    """

    def __init__(self, path: Path, faults: list[str], folders: Iterable[Path] = ()) -> None:
        self.name, self.faults, self.skipped = path.name, faults, 0
        self.choices: dict[str, list[str]] = {}
        self.common: dict[str, str] = {}
        self.cases: dict[int, dict[str, str]] = {}
        self.parameters: list[DeckLine] = []
        self._path, self._roots = path, (path.resolve().parent, *(folder.resolve() for folder in folders))
        self._bytes = self._files = 0

    def lines(self) -> Iterator[DeckLine]:
        """Lines of bulk data to the end of the file; blank ones and comments are left out."""
        found = self._read(self._path)
        begin = next((k for k, text in enumerate(found) if _BEGIN.match(text)), None)
        case = self.common
        for number, text in enumerate(found[: begin or 0], start=1):
            if subcase := _SUBCASE.match(text):
                case = self.cases.setdefault(int(subcase[1]), {})
            elif _COMBINATION.match(text):
                case = {}  # sums of cases and cases of parts choose nothing for those before them
            elif (own := _PARAMETER.match(text)) and len(self.cases) < 2:
                self.parameters.append(DeckLine(f"PARAM,{own[1]},{own[2]}", f"{self._path.name}:{number}"))
            elif command := _COMMAND.match(text):
                name, role = command[1].upper(), (command[2] or "").upper()
                warm = name.startswith("TEMP") and name in "TEMPERATURE" and role not in ("", "BOTH")
                load = warm and role.startswith("LOAD")  # a load, no materials; the others choose no load
                self.choices.setdefault("TEMPERATURE(LOAD)" if load else name, []).append(command[3])
                case.setdefault(f"TEMPERATURE({'LOAD' if load else 'INITIAL'})" if warm else name, command[3])
        self.skipped = 0 if begin is None else begin + 1
        yield from self._lines(self._path.name, self._path, found, self.skipped, 0)

    def chooses(self, command: str) -> bool:
        """True if the case control has a command, which four letters name."""
        return any(command == name or (len(name) > 3 and command.startswith(name)) for name in self.choices)

    def _lines(self, name, path, found, start, depth) -> Iterator[DeckLine]:
        numbered = iter(list(enumerate(found, start=1))[start:])
        for number, text in numbered:
            if _BEGIN.match(text):
                self.faults.append(f"{name}:{number}: superelements (a second BEGIN BULK) are not supported")
                return
            if not (include := _INCLUDE.match(text)):
                if text:
                    yield DeckLine(text, f"{name}:{number}")
                continue
            quoted = include[1]
            while quoted[:1] in ("'", '"') and quoted.count(quoted[0]) < 2:  # a path over many lines
                quoted += next(numbered, (0, quoted[0]))[1].strip()
            other = self._inside(quoted.strip("'\" "), path, f"{name}:{number}", depth)
            if other is not None:
                yield from self._lines(other.name, other, self._read(other), 0, depth + 1)

    def _inside(self, name, path, place, depth) -> Path | None:
        """The file that an INCLUDE names, if it lies in the folder of the deck."""
        if depth >= MAX_DEPTH:
            raise ModelError([f"{place}: INCLUDE is nested more than {MAX_DEPTH} files deep"])
        beside = path.resolve().parent
        found = next((file for root in self._roots if (file := file_inside(root, name, beside))), None)
        if found is None:
            leaves = all(leaves_folder(root, name, beside) for root in self._roots)
            what = "leaves the folder of the deck" if leaves else "is not a file in the folder of the deck"
            what += ", nor of those of folders=" if len(self._roots) > 1 else "; folders=[...] allows others"
            self.faults.append(f"{place}: INCLUDE {name[:80]!r} {what}")
        return found

    def _read(self, path) -> list[str]:
        self._files += 1
        self._bytes += require_file(path).stat().st_size
        if self._bytes > MAX_BYTES or self._files > MAX_FILES:
            raise ModelError([f"{path.name}: the deck has more than {MAX_BYTES} bytes or {MAX_FILES} files"])
        text = path.read_bytes().decode("latin-1")
        return [line.split("$", 1)[0].expandtabs(8).rstrip() for line in text.split("\n")]
