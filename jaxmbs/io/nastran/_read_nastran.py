"""`read_nastran`: from the cards of a deck to its structure."""

import dataclasses
import re
from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from ...elements import DIRECTIONS
from ...elements._base import as_real
from ...errors import ModelError
from ._cards import Card, parse_cards
from ._connections import Groups, bars, conrods, rods
from ._constraints import read_supports, read_ties, select_sets
from ._context import DeckContext, default_cards, scalar_points, split_shared_cards
from ._coordinate_systems import NAMES
from ._coordinates import are_ties_uncoupled, number_coordinates
from ._deck import Deck
from ._faces import panels, plates, solids
from ._groups import DeckParameters
from ._ignored_cards import CHOSEN, HARMLESS
from ._load_cards import read_enforced, read_loads, read_temperatures
from ._lumped import HEAVY, LumpedMassGroup, lump_masses
from ._materials import MATERIALS
from ._nodal import autospc_directions, nodal_sums, rows_without_mass
from ._point_elements import bushes, masses, scalars
from ._properties import PROPERTIES
from ._text import BulkData
from ._ties import AbstractTie, MeanTie, MultipointTie, Pair

ELEMENTS: dict[str, Callable[[list[Card], DeckContext], Groups]] = {
    **dict(CBAR=bars, CBEAM=bars, CROD=rods, CTUBE=rods, CVISC=rods, CSHEAR=panels),
    **dict.fromkeys(("CQUAD4", "CQUADR", "CTRIA3", "CTRIAR", "CQUAD8", "CTRIA6"), plates),
    **dict.fromkeys(("CTETRA", "CPENTA", "CHEXA"), solids),
    **dict(CONROD=conrods, CONM2=masses, CBUSH=bushes),
    **{f"{kind}{form}": scalars for kind in ("CELAS", "CMASS", "CDAMP") for form in "1234"},
}
CONSTRAINTS = ("SPC", "SPC1", "SPCADD", "MPC", "MPCADD", "RBE2", "RBE3", "RBAR")
_NUMBERS = {**MATERIALS, **PROPERTIES}
_CARDS_READ = {"GRID", "GRDSET", "SPOINT", "BAROR", "BEAMOR", "PARAM", *NAMES, *_NUMBERS, *ELEMENTS, *CONSTRAINTS}
_LENGTHS = {"GRID": 8, "CROD": 4, "CONM2": 14, "CONROD": 8, "RBAR": 9, "PROD": 6, "CTUBE": 4, "PTUBE": 6}
_SCALES = ("CK1", "CM1", "CB1", "CP1")  # of all stiffness, masses, dampers and loads
_MASSES = {
    "lumped": "masses are lumped, as Nastran's are without PARAM COUPMASS 1; masses='consistent' takes the others",
    "consistent": "masses are consistent, as Nastran's are with PARAM COUPMASS 1; masses='lumped' takes the others",
}


def read_nastran(
    path: str | PathLike,
    spc: int | None = None,
    mpc: int | None = None,
    polar: bool = True,
    masses: str | None = None,
    ignore: Sequence[str] = (),
    folders: Sequence[str | PathLike] = (),
) -> Deck:
    """A structure from Nastran bulk data, small, large or free fields; INCLUDE inside the folder of the deck.

    `docs/tasks/decks.md` lists the cards that are read, and those that change neither mass nor stiffness, which
    `Deck.ignored` lists.  Bars, rods, springs, masses and ties are Nastran's, CQUAD4 to five digits; triangles,
    solids and shells with nodes on their edges are ours, which converge to the same answers by other numbers.
    `Deck.notes` says what was decided.

    Args:
        spc, mpc: sets that act; by default the first that the case control chooses, or the only ones.
        polar: whether CBARs with consistent masses have inertia about their own axis, as CBEAMs have; Nastran's have
            none unless asked for.
        masses: "lumped" on the nodes, without inertia in rotation, or "consistent"; by default as the deck says:
            consistent with PARAM COUPMASS 1, else lumped.
        ignore: names of cards that are left out though they may change the answer: `("CGAP", "PGAP")`.
        folders: further folders that files of INCLUDE may lie in.

    Raises: ModelError with every fault: cards that are not read, by name and line, wrong fields, what is missing;
    ValueError for other `masses`; OSError where there is no file.
    """
    if masses not in (None, "lumped", "consistent"):
        raise ValueError(f"masses must be 'lumped', 'consistent', or None to follow the deck, not {masses!r}")
    faults: list[str] = []
    if isinstance(ignore, str):
        raise ValueError(f"ignore must be a sequence of names of cards, not the text {ignore!r}")
    text = BulkData(Path(path), faults, [Path(folder) for folder in folders])
    found, strange, ignored = _cards(text, ignore, faults)
    deck = DeckContext(found, polar)
    deck.read_numbers(MATERIALS, PROPERTIES)
    elements = {
        name: own for kind, read in ELEMENTS.items() if kind in found for name, own in read(found[kind], deck).items()
    }
    if not elements and not any(name.startswith("C") for name in strange):
        faults.append(f"{text.name} has no element")
    sets = [_sets(kind, found, one, text, deck) for kind, one in (("SPC", spc), ("MPC", mpc))]
    tied = read_ties(found, sets[1], deck)
    on_hold = deck.held | read_supports(found, sets[0], deck)
    settings = _settings(found, text, deck)
    settings["masses"] = masses or settings["masses"]
    if any("TEMPERATURE(INITIAL)" in own for own in (text.common, *text.cases.values())):
        deck.remark("temperatures that TEMPERATURE(INITIAL) chooses are not used: thermal strains begin at TREF")
    faults += _double_constraints(tied, on_hold, deck)
    if faults:
        raise ModelError(faults)
    ignored += [f"{what}, {times} times" if times > 1 else what for what, times in deck.notes.items()]
    made = _deck(deck, elements, tied, on_hold, settings, tuple(ignored))
    temperatures, unread = read_temperatures(found, deck)
    return dataclasses.replace(
        made,
        loads=read_loads(found, deck, elements, on_hold),
        temperatures=temperatures,
        unread_temperatures=unread,
        enforced=read_enforced(found, sets[0], deck),
        cases=_cases(text),
    )


def _cards(text, ignore, faults):
    """Cards by name without those that are left out; names of cards that are not read; what is ignored."""
    found: dict[str, list[Card]] = {}
    for card in parse_cards(text.lines(), faults):
        found.setdefault(card.name, []).append(card)
    for card in parse_cards(text.parameters, faults):  # after those of the bulk data, over which they stand
        found.setdefault(card.name, []).append(card)
    for name, most in _LENGTHS.items():
        for card in found.get(name, ()):
            if len(card) > most:
                card.fault(f"it has {len(card)} fields; a {name} has at most {most}")
    split_shared_cards(found)
    default_cards(found)
    left_out = {name.upper() for name in ignore} & found.keys()
    idle = {name for name in found.keys() & CHOSEN.keys() if not any(map(text.chooses, CHOSEN[name]))}
    over = HARMLESS | idle | left_out
    strange = [name for name in found if name and name not in _CARDS_READ | over]
    unused = _unused(found, strange, over)
    ignored = _ignored(found, text, over, left_out, unused)
    faults += _refusals(found, [name for name in strange if name not in unused], text)
    for name in left_out:
        del found[name]
    if not found.get("GRID") and not scalar_points(found):
        raise ModelError([*faults, f"{text.name} has no GRID"])
    return found, strange, ignored


def _cases(text):
    """(number, load, temperature) of each subcase, 0 where there is none; names of sets, "" for none."""
    found = []
    for number, own in (text.cases or {0: {}}).items():
        chosen = text.common | own
        warm = chosen.get("TEMPERATURE(LOAD)", chosen.get("TEMPERATURE", chosen.get("TEMP", "")))
        sets = (("LOAD", chosen.get("LOAD", "")), ("TEMPERATURE", warm))
        found.append((number, *(f"{what} {one}" if one.isdigit() else "" for what, one in sets)))
    return tuple(found)


def _deck(deck, elements, tied, on_hold, settings, ignored):
    elements = lump_masses(elements) if settings["masses"] == "lumped" else elements
    numbers = DeckParameters(as_real(deck.positions), deck.materials, deck.properties, as_real(settings["WTMASS"]))
    nodal = nodal_sums(deck, elements, numbers)
    for tie in tied.values():
        for n, d in tie.pairs if isinstance(tie, MultipointTie) else ():
            axis = deck.axes(n)[d % 3]
            nodal.stiff_directions[n, d // 3] += np.outer(axis, axis)
    weak = autospc_directions(deck, nodal, tied) if settings["AUTOSPC"] else set()
    weak = (
        (weak | _unsupported_directions(tied, nodal.sizes))
        - on_hold
        - {pair for tie in tied.values() for pair in tie.dependent}
    )
    coordinates = number_coordinates(deck, tied, on_hold, nodal.sizes, weak)
    if not are_ties_uncoupled(tied):
        _refuse_cyclic_ties(coordinates, numbers.positions)
    if not coordinates.free:
        raise ModelError(["no coordinate is free: all are held or tied"])
    turned, still = dict(coordinates.turned), on_hold | weak
    fixed = [(n, d) for n, d in still if n not in turned or {(n, 3 * (d // 3) + k) for k in range(3)} <= still]
    names = tuple(f"{'SPOINT' if n in deck.scalars else 'GRID'} {one}" for n, one in enumerate(deck.ids))
    labels = [
        tuple(f"{names[n]} {DIRECTIONS[d]}" for n, d in sorted(pairs) if not d or n not in deck.scalars)
        for pairs in (on_hold, weak)
    ]
    parts = deck.materials, deck.properties, elements, numbers.mass, coordinates
    light = rows_without_mass(coordinates, nodal, numbers.positions)
    have_masses = any(isinstance(own, (*HEAVY, LumpedMassGroup)) for own in elements.values())
    notes = [_MASSES[settings["masses"]]] if have_masses else []
    notes += [f"{what}, {times} times" if times > 1 else what for what, times in deck.remarks.items()]
    return Deck(names, numbers.positions, *parts, tuple(sorted(fixed)), light, *labels, ignored, tuple(notes))


def _settings(found, text, deck):
    settings = {"WTMASS": 1.0, "AUTOSPC": True, "masses": "lumped"}
    for card in found.get("PARAM", ()):
        name = card.text(1).upper()
        if name == "WTMASS":
            settings["WTMASS"] = card.real(2, "WTMASS")
            if not settings["WTMASS"] > 0:
                card.fault("WTMASS must be positive")
        elif name == "AUTOSPC":
            settings["AUTOSPC"] = card.text(2).upper() != "NO"
        elif name == "COUPMASS":
            settings["masses"] = "consistent" if card.integer(2, "COUPMASS", -1, low=-1) > 0 else "lumped"
        elif name in _SCALES and card.real(2, name, 1.0) != 1:
            card.fault("it multiplies a whole matrix, which is not supported")
        elif name == "SNORM" and card.real(2, "SNORM", 0.0) > 0:
            deck.remark("PARAM SNORM: normals of shells at nodes are those of each element, not means of several")
        elif name != "K6ROT":  # which `DeckContext` reads
            deck.note(f"PARAM {name[:16]}")
    if own := text.choices.get("AUTOSPC"):
        settings["AUTOSPC"] = own[0].upper() != "NO"
    return settings


def _unsupported_directions(tied: dict[str, AbstractTie], sizes) -> set[Pair]:
    """Directions that an RBE3 averages and that no element has: they stay where they are."""
    averaged = {pair for tie in tied.values() if isinstance(tie, MeanTie) for pair in tie.averaged}
    raised = {pair for tie in tied.values() for pair in tie.implied_directions}
    return {(n, d) for n, d in averaged - raised if d >= sizes[n]}


def _double_constraints(tied, on_hold, deck):
    """Directions that depend on two ties, or on a tie and a support."""
    faults, taken = [], {}
    for name, tie in tied.items():
        for n, d in tie.dependent:
            what = f"GRID {deck.ids[n]}, direction {d + 1}"
            if (n, d) in taken:
                faults.append(f"{what}: depends on {taken[n, d]} and on {name}")
            if (n, d) in on_hold:
                faults.append(f"{what}: depends on {name} and is held")
            taken[n, d] = name
    return faults[:50]


def _refuse_cyclic_ties(coordinates, positions):
    R, columns = coordinates.equations(positions)
    own = np.asarray(R)[:, columns]
    if not np.all(np.isfinite(own)) or np.linalg.cond(own) > 1e12:
        raise ModelError(["the ties depend on one another in a cycle"])


def _sets(kind, found, one, text, deck):
    """Sets of SPC or MPC that act; of those of many subcases the first."""
    chosen = [int(number) for number in text.choices.get(kind, ()) if number.isdigit()]
    if kind == "MPC" and one is None and chosen and not found.keys() & {"MPC", "MPCADD"}:
        deck.remark(f"the case control chooses MPC {chosen[0]}, and the deck has no MPC; Nastran runs such decks")
        chosen = []
    if one is None and len(set(chosen)) > 1:
        word = kind.lower()
        deck.remark(f"{kind} {chosen[0]}, the first that the case control chooses, acts; read_nastran(..., {word}=)")
    acting = select_sets(kind, found, one, list(dict.fromkeys(chosen)), text.faults)
    if one is None and kind not in text.choices and acting and text.choices:
        deck.remark(
            f"{kind} {min(acting)} acts, the only one, though the case control chooses none; Nastran takes none"
        )
    return acting


def _refusals(found, names, text):
    """Faults for cards that may change the answer and are not read."""
    faults = []
    for name in names:
        chosen = [command for command in sorted(CHOSEN.get(name, ())) if text.chooses(command)]
        why = f", and the case control chooses it by {chosen[0]}" if chosen else ""
        faults.append(f"{name} is not read{why}: {_places(found[name])}")
    return faults


def _unused(found, strange, over):
    """Names of cards of materials and properties that are not read, where no card refers to one of them.

    The numbers of materials and properties that cards may refer to are taken from all their fields, whatever these
    mean.
    """
    owners = {name for name in strange if re.fullmatch(r"MAT\d*|MAT(HP|HE|G)|P[A-Z0-9]+", name)}
    unused: set[str] = set()
    while True:  # what only unused cards refer to is unused
        used = {
            field
            for name, cards in found.items()
            if name[:1] in "CPM" and name not in over | unused
            for card in cards
            for field in card.fields[2:]
        }
        more = {name for name in owners - unused if not used & {card.text(1) for card in found[name]}}
        if not more:
            return unused
        unused |= more


def _ignored(found, text, over, left_out, unused):
    lines = [f"{text.skipped} lines before the bulk data"] if text.skipped else []
    for name, own in found.items():
        if name in over:
            why = ", as ignore= says" if name in left_out else "" if name in HARMLESS else ", which nothing chooses"
            lines.append(f"{name}{why}: {_places(own)}")
    return lines + [f"{name}, which nothing refers to: {_places(found[name])}" for name in sorted(unused)]


def _places(own):
    shown = ", ".join(card.place for card in own[:4])
    return shown if len(own) < 5 else f"{shown} and {len(own) - 4} more"
