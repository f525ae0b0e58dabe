"""The page: sections with their tables and pictures as HTML."""

from collections.abc import Sequence
from html import escape
from importlib import resources
from typing import NamedTuple

from ..tables import Rows


class Passage(NamedTuple):
    """A part of the page.

    Attributes:
        title: words over it; lines: paragraphs; rows: head and rows of its table.
        fault: what failed in it, which also stands first on the page.
        pictures: (picture as the address of its data, words that say what it shows).
        html: more, as HTML that is safe.
    """

    title: str
    lines: Sequence[str] = ()
    rows: Rows = ()
    fault: str = ""
    pictures: Sequence[tuple[str, str]] = ()
    html: str = ""


def page(title: str, sections: Sequence[Passage]) -> str:
    """The whole page; every text in it is escaped."""
    template = resources.files(__package__).joinpath("page.html").read_text("utf-8")
    faults = [f"{section.title}: {section.fault}" for section in sections if section.fault]
    items = "".join(f"<li>{escape(fault)}</li>" for fault in faults)
    verdict = f'<ul class="faults">{items}</ul>' if faults else '<p class="good">Nothing in this report failed.</p>'
    links = "".join(f'<li><a href="#part{k}">{escape(s.title)}</a></li>' for k, s in enumerate(sections))
    body = "".join(_section(k, section) for k, section in enumerate(sections))
    parts = {"TITLE": escape(title), "VERDICT": verdict, "LINKS": links, "SECTIONS": body}
    first, *rest = template.split("<!--")  # what is put in is not looked through again
    return first + "".join(parts[name] + after for name, after in (part.split("-->", 1) for part in rest))


def _section(number, section):
    parts = [f'<section id="part{number}"><h2>{escape(section.title)}</h2>']
    if section.fault:
        parts.append(f'<p class="fault">{escape(section.fault)}</p>')
    parts += [f"<p>{escape(line)}</p>" for line in section.lines]
    parts.append(section.html)
    parts += [
        f'<figure><img src="{source}" alt="{escape(words)}"><figcaption>{escape(words)}</figcaption></figure>'
        for source, words in section.pictures
    ]
    return "".join([*parts, _table(section.rows), "</section>"])


def _table(rows):
    """Head and rows; on narrow screens every row is a list of its cells, each with the word of its column."""
    if len(rows) < 2:
        return ""
    head, *rest = [[str(cell) for cell in row] for row in rows]
    cells = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    lines = [
        "".join(f'<td data-head="{escape(word)}">{escape(cell)}</td>' for word, cell in zip(head, row, strict=True))
        for row in rest
    ]
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"
