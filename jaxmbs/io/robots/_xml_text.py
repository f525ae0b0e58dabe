"""Untrusted XML: bounded size and depth, one folder, no document types or entities."""

import codecs
import re
import xml.etree.ElementTree as ET
from pathlib import Path

from ...errors import ModelFileError
from .._regular_file import read_bytes

MOST_BYTES, MOST_ELEMENTS = 32_000_000, 200_000
MAX_DEPTH = 200  # a chain of so many bodies is nested no deeper than MuJoCo's own limit
_ENCODING = re.compile(r"""\s*<\?xml[^>]*?\sencoding\s*=\s*["']([\w.-]+)["']""", re.ASCII)
_ENCODINGS = re.compile(
    r"utf-?8(-sig)?|utf-?16|(us-)?ascii|iso-?8859-\d+|latin-?\d|(windows-|cp)\d+|gbk?|gb\d+|big5|shift_jis|euc-\w\w"
    r"|koi8-\w|mac-?roman",
    re.IGNORECASE,
)
_TYPES = re.compile(r"<!\s*(DOCTYPE|ENTITY|ELEMENT|ATTLIST|NOTATION)", re.IGNORECASE)


def read_xml(path: Path) -> ET.Element:
    """The root of a file.

    Raises: ModelFileError for what is no file, not of its encoding, no XML, declares a document type or is too large
    or deep.
    """
    return parse_xml(path, read_bytes(path, MOST_BYTES))


def parse_xml(path: Path, content: bytes) -> ET.Element:
    """The root of a file's content; raises as `read_xml`."""
    text = _decode(path, content)
    if _TYPES.search(text):
        raise ModelFileError(path, ["it declares a document type or entities, which models do not need"])
    try:
        root = ET.fromstring(re.sub(r"^\s*<\?xml[^>]*\?>", "", text))
    except (ET.ParseError, ValueError) as error:
        raise ModelFileError(path, [f"it is not well-formed XML: {error}"]) from error
    if sum(1 for _ in root.iter()) > MOST_ELEMENTS:
        raise ModelFileError(path, [f"it has more than {MOST_ELEMENTS} elements"])
    if _nesting_depth(root) > MAX_DEPTH:
        raise ModelFileError(path, [f"its elements are nested more than {MAX_DEPTH} deep"])
    space = root.tag.rpartition("}")[0]
    for element in root.iter() if space else ():  # the namespace of the whole document is no part of its names
        element.tag = element.tag.removeprefix(space + "}")
    return root


def _decode(path, content):
    """Text, by its byte order mark, else by the encoding that it declares, else as UTF-8."""
    marks = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
    declared = _ENCODING.match(content[:200].decode("latin-1"))
    encoding = next((name for mark, name in marks if content.startswith(mark)), declared[1] if declared else "utf-8")
    if not _ENCODINGS.fullmatch(encoding):
        raise ModelFileError(path, [f"its encoding {encoding!r} is not read; save it as UTF-8"])
    try:
        return content.decode(encoding)
    except (UnicodeError, LookupError) as error:
        where = f" (byte {error.start})" if isinstance(error, UnicodeDecodeError) else ""
        raise ModelFileError(path, [f"it is not {encoding.upper().removesuffix('-SIG')} text{where}"]) from error


def _nesting_depth(root) -> int:
    depth, level = 0, [root]
    while level and depth <= MAX_DEPTH:
        depth, level = depth + 1, [child for element in level for child in element]
    return depth
