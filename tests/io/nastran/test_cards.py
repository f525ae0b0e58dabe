"""Cards of bulk data: fields, continuations, files and faults, against pyYeti's reader where that is right."""

import io
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxmbs.errors import ModelError
from jaxmbs.io import read_nastran
from jaxmbs.io.nastran._cards import Card, parse_cards
from jaxmbs.io.nastran._text import BulkData

BAR = "MAT1,1,2.+11,,0.3,7850.\nPBAR,1,1,1.-3,2.-7,1.-7,3.-7\nGRID,1\nGRID,2,,1.,0.,0.\nCBAR,1,1,1,2,0.,1.,0.\n"


def read(text, tmp_path, name="deck.bdf"):
    """Cards and faults of a text."""
    (tmp_path / name).write_text(text, newline="")
    faults = []
    return list(parse_cards(BulkData(tmp_path / name, faults).lines(), faults)), faults


@pytest.mark.parametrize(
    "text",
    [
        "PBAR,7,1,1.5,,2.-3\n,,,,,,,,\n,.8,.9\n",
        "PBAR           7       1     1.5            2.-3\n+\n+             .8      .9\n",
        "PBAR           7       1     1.5            2.-3                        +P\n$ between\n\n+P\n"
        "+P            .8      .9\n",
        "PBAR*                  7               1             1.5\n*                   2.-3\n*\n*\n"
        "*                     .8              .9\n*\n",
        "pbar*,7,1,1.5\n*,2.-3\n*\n*\n*,.8,.9\n",
        "PBAR\t7\t1\t1.5\t\t2.-3\n+,,,,,,,,\n+,.8,.9 $ remark\r\n",
    ],
)
def test_three_forms_of_fields(text, tmp_path):
    (card,), faults = read(text, tmp_path)
    assert not faults and card.name == "PBAR" and card.place == "deck.bdf:1"
    values = [card.integer(1, "PID"), card.integer(2, "MID"), *card.reals(3, 3, "A"), *card.reals(17, 2, "K")]
    assert values == [7, 1, 1.5, 0.0, 2e-3, 0.8, 0.9] and len(card) == 18 and not faults


@given(
    st.lists(
        st.lists(
            st.one_of(st.none(), st.integers(1, 99_999_999), st.floats(1e-30, 1e30), st.floats(-1e30, -1e-30)),
            min_size=1,
            max_size=20,
        ).filter(lambda fields: fields[-1] is not None),
        min_size=1,
        max_size=4,
    ),
    st.booleans(),
)
@settings(max_examples=40, deadline=None)
def test_cards_that_pyyeti_writes(tmp_path_factory, rows, large):
    """Random cards in its small or large fields come back as it reads them."""
    bulk = pytest.importorskip("pyyeti.nastran").bulk
    file = io.StringIO()
    write, name = (bulk.wtcard16, "ABCD*") if large else (bulk.wtcard8, "ABCD")
    for row in rows:
        write(file, [name, *("" if x is None else x for x in row)])
    theirs = bulk.rdcards(io.StringIO(file.getvalue()), "ABCD", return_var="list", blank=None)
    found, faults = read(file.getvalue(), tmp_path_factory.mktemp("cards"))
    assert not faults and len(found) == len(rows)
    for card, row, other in zip(found, rows, theirs, strict=True):
        for k, value in enumerate(row, start=1):
            if isinstance(value, int):
                assert card.integer(k, "") == value
            elif value is not None:
                np.testing.assert_allclose(card.real(k, ""), value, rtol=1e-8 if large else 1e-2)
                assert card.real(k, "") == other[k - 1]


@given(st.floats(allow_nan=False, allow_infinity=False, width=32), st.sampled_from(["E", "e", "D", "d", ""]))
@settings(max_examples=100, deadline=None)
def test_numbers_of_nastran(value, letter):
    """1.25E-3, 1.25D-3, 1.25-3."""
    mantissa, exponent = f"{value:.12e}".split("e")
    card = Card("X", "", [])
    card.fields.append(f"{mantissa}{letter}{int(exponent):+d}")
    assert math.isclose(card.real(1, ""), float(f"{value:.12e}"), rel_tol=1e-15, abs_tol=0.0) and not card.faults


@pytest.mark.parametrize("text", ["nan", "inf", "1_000.", "1.e999", "0x10", "1.2.3", "--1.", "٣.", "1 2", "e5", "."])
def test_what_is_no_number(text):
    card = Card("X", "here", [])
    card.fields.append(text)
    card.real(1, "A")
    assert "A must be a finite number" in card.faults[0]


def test_all_faults_in_one_report_with_their_lines(tmp_path):
    (tmp_path / "bad.bdf").write_text(
        BAR
        + "CPYRAM,5,1,1,2,3,4\nCPYRAM,6,1,1,2,3,4\nCHEXA,7,9,1,2\nCBAR,8,3,1,9,0.,1.,0.\nGRID,11,5,x\nMAT1,2\n"
        + "+,1\nRBE2,4,1,12,1\nPSHELL,5,8,0.\n"
    )
    with pytest.raises(ModelError) as error:
        read_nastran(tmp_path / "bad.bdf")
    report = str(error.value)
    for part in (
        "CPYRAM is not read: bad.bdf:6, bad.bdf:7",
        "CHEXA 7 (bad.bdf:8): there is no PSOLID 9",
        "CHEXA 7 (bad.bdf:8): G3 is missing",
        "CBAR 8 (bad.bdf:9): there is no PBAR 3",
        "CBAR 8 (bad.bdf:9): there is no GRID 9",
        "GRID 11 (bad.bdf:10): there is no coordinate system 5",
        "GRID 11 (bad.bdf:10): X1 must be a finite number, got 'x'",
        "MAT1 2 (bad.bdf:11): E is missing",
        "RBE2 4 (bad.bdf:13): its independent node GN is among the dependent ones",
        "PSHELL 5 (bad.bdf:14): there is no MAT1 8",
        "PSHELL 5 (bad.bdf:14): T must be positive",
    ):
        assert part in report, report


@pytest.mark.parametrize(
    "between", ["GRID,3,,5.", "CBAR    2       1       1       2       0.      1.      0.              +C"]
)
def test_continuations_out_of_order_are_refused(between, tmp_path):
    """One that belongs to a card further up, behind a card with another label or with none."""
    bar = "CBAR    1       1       1       2       0.      1.      0.              +B\n"
    text = f"{bar}{between}\n+B      ,,,0.,.1\n"
    _, faults = read(text, tmp_path)
    assert len(faults) == 1 and "does not follow its card" in faults[0]
    found, faults = read(bar + "+B,,,0.,.1\n" + "GRID,3,,5.\n+X,,1.\n", tmp_path)  # a label that no card has
    assert not faults and [card.name for card in found] == ["CBAR", "GRID"]


def test_included_files_of_the_folder_only(tmp_path):
    """Relative, in folders below, over two lines; not above, not elsewhere, not by a link, not in a ring."""
    inside, outside = tmp_path / "model", tmp_path / "secret.bdf"
    (inside / "parts").mkdir(parents=True)
    outside.write_text("GRID,99\n")
    (inside / "parts" / "grids.bdf").write_text("include 'more.bdf'\nGRID,2,,1.,0.,0.\n")
    (inside / "parts" / "more.bdf").write_text("GRID,1\n")
    (inside / "link.bdf").symlink_to(outside)
    found, faults = read("INCLUDE 'par\n  ts/grids.bdf'\nGRID,3\n", inside)
    assert [card.fields[1] for card in found] == ["1", "2", "3"] and not faults
    assert [card.place for card in found] == ["more.bdf:1", "grids.bdf:2", "deck.bdf:3"]
    for path in ("../secret.bdf", str(outside), "link.bdf"):
        found, faults = read(f"INCLUDE '{path}'\n", inside)
        assert not found and "leaves the folder" in faults[0]
    assert "is not a file" in read("INCLUDE 'absent.bdf'\n", inside)[1][0]
    with pytest.raises(ModelError, match="more than 20 files deep"):
        read("INCLUDE 'deck.bdf'\n", inside)


@pytest.mark.parametrize("path", ["parts\\grids.bdf", "PARTS/Grids.BDF", ".\\Parts\\GRIDS.bdf"])
def test_included_paths_as_windows_writes_them(path, tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "grids.bdf").write_text("GRID,1\n")
    found, faults = read(f"INCLUDE '{path}'\n", tmp_path)
    assert [card.fields[1] for card in found] == ["1"] and not faults


@pytest.mark.parametrize("path", ["..\\secret.bdf", "parts\\..\\..\\secret.bdf", "..\\SECRET.bdf"])
def test_included_paths_of_windows_do_not_leave_the_folder(path, tmp_path):
    (tmp_path / "model" / "parts").mkdir(parents=True)
    (tmp_path / "secret.bdf").write_text("GRID,1\n")
    found, faults = read(f"INCLUDE '{path}'\n", tmp_path / "model")
    assert not found and len(faults) == 1


def test_capitals_that_fit_two_files_name_none(tmp_path):
    for name in ("grids.bdf", "Grids.bdf"):
        (tmp_path / name).write_text("GRID,1\n")
    assert len(list(tmp_path.glob("[gG]rids.bdf"))) == 2, "this file system has no capitals"
    assert "is not a file" in read("INCLUDE 'GRIDS.bdf'\n", tmp_path)[1][0]


@pytest.mark.slow
def test_case_control_is_skipped_and_its_sets_are_chosen(tmp_path):
    held = "SPC1,1,123456,1\nSPC1,2,123456,2\n"
    deck = tmp_path / "deck.bdf"
    deck.write_text(
        "SOL 103\nCEND\n  SPC = 2\nBEGIN BULK\n" + BAR + held + "PARAM,POST,-1\nEIGRL,1\nENDDATA\nrubbish"
    )
    found = read_nastran(deck)
    assert found.held[0] == "GRID 2 x" and len(found.held) == 6
    assert found.ignored == ("4 lines before the bulk data", "EIGRL: deck.bdf:13", "PARAM POST")
    assert read_nastran(deck, spc=1).held[0] == "GRID 1 x"
    with pytest.raises(ModelError, match="there is no SPC set 5; there are: 1, 2"):
        read_nastran(deck, spc=5)
    deck.write_text(BAR + held)
    with pytest.raises(ModelError, match="has the SPC sets 1, 2; choose one"):
        read_nastran(deck)


def test_pyyeti_loses_what_follows_a_comment():
    """Why its reader is not used: if this fails, look at it again."""
    bulk = pytest.importorskip("pyyeti.nastran").bulk
    text = "PBAR           7       1     1.5\n$ a comment\n+            0.1\n"
    assert len(bulk.rdcards(io.StringIO(text), "PBAR", return_var="list")[0]) == 3
