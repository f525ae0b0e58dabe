"""Tables of cards that are read over: the manual prints them whole."""

from pathlib import Path

from jaxmbs.io.nastran._ignored_cards import CHOSEN, HARMLESS_BY_PURPOSE

PAGE = Path(__file__).parents[3] / "docs" / "tasks" / "decks.md"


def test_the_manual_prints_both_tables():
    rows = {
        tuple(cell.strip() for cell in line.split("|")[1:3]) for line in PAGE.read_text().splitlines() if "|" in line
    }
    printed = {why: set(names.split()) for why, names in rows}
    for why, names in HARMLESS_BY_PURPOSE.items():
        assert printed[why] == names
    for name, commands in CHOSEN.items():
        assert name in printed[", ".join(sorted(commands))]


def test_every_card_has_one_purpose():
    names = [name for group in HARMLESS_BY_PURPOSE.values() for name in group]
    assert len(names) == len(set(names)) and not set(names) & CHOSEN.keys()
