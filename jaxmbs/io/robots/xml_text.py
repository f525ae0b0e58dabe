"""XML of others, read with distrust: of one folder, of bounded size, without document types, entities or depth."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from ...errors import ModelFileError
from ..regular_file import read_bytes

MOST_BYTES, MOST_ELEMENTS = 32_000_000, 200_000
DEEPEST = 200  # a chain of so many bodies is nested no deeper than MuJoCo's own limit
_TYPES = re.compile(r"<!\s*(DOCTYPE|ENTITY|ELEMENT|ATTLIST|NOTATION)", re.IGNORECASE)


def read_xml(path: Path) -> ET.Element:
    """The root of a file.

    Raises: ModelFileError for what is no file, no UTF-8, no XML, declares a document type or is too large or deep.
    """
    return parse_xml(path, read_bytes(path, MOST_BYTES))


def parse_xml(path: Path, content: bytes) -> ET.Element:
    """The root of a file's content; raises as `read_xml`."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ModelFileError(path, [f"it is not UTF-8 text (byte {error.start})"]) from error
    if _TYPES.search(text):
        raise ModelFileError(path, ["it declares a document type or entities, which models do not need"])
    try:
        root = ET.fromstring(re.sub(r"^\s*<\?xml[^>]*\?>", "", text))
    except (ET.ParseError, ValueError) as error:
        raise ModelFileError(path, [f"it is not well-formed XML: {error}"]) from error
    if sum(1 for _ in root.iter()) > MOST_ELEMENTS:
        raise ModelFileError(path, [f"it has more than {MOST_ELEMENTS} elements"])
    if _depth(root) > DEEPEST:
        raise ModelFileError(path, [f"its elements are nested more than {DEEPEST} deep"])
    return root


def _depth(root) -> int:
    depth, level = 0, [root]
    while level and depth <= DEEPEST:
        depth, level = depth + 1, [child for element in level for child in element]
    return depth


def inside(folder: Path, name: str, *beside: Path) -> Path | None:
    """The file of that name in one of the folders `beside`, links followed; None where there is none, or where it
    lies outside of `folder`."""
    home = folder.resolve()
    for place in (folder, *beside):
        try:
            found = (place / name).resolve()
            if found.is_relative_to(home) and found.is_file():
                return found
        except (OSError, ValueError, RuntimeError):  # nulls, loops of links
            continue
    return None
