"""`read_nastran`: from the cards of a deck to its structure."""

import re
from collections.abc import Callable
from os import PathLike
from pathlib import Path

import numpy as np

from ...elements import DIRECTIONS
from ...elements._base import as_real
from ...errors import ModelError
from ._cards import Card, parse_cards
from ._connections import Groups, bars, conrods, plates, rods, solids
from ._constraints import read_supports, read_ties, select_sets
from ._context import DeckContext, default_cards, scalar_points, split_shared_cards
from ._coordinate_systems import NAMES
from ._coordinates import are_ties_uncoupled, number_coordinates
from ._deck import Deck
from ._groups import HEAVY, DeckParameters
from ._lumped import LumpedMassGroup, lump_masses
from ._nodal import autospc_directions, nodal_sums, rows_without_mass
from ._point_elements import bushes, masses, scalars
from ._properties import READ
from ._text import BulkData
from ._ties import AbstractTie, MeanTie, MultipointTie, Pair

ELEMENTS: dict[str, Callable[[list[Card], DeckContext], Groups]] = {
    **dict(CBAR=bars, CBEAM=bars, CROD=rods, CQUAD4=plates, CTRIA3=plates, CHEXA=solids),
    **dict(CONROD=conrods, CONM2=masses, CBUSH=bushes),
    **{f"{kind}{form}": scalars for kind in ("CELAS", "CMASS", "CDAMP") for form in "1234"},
}
CONSTRAINTS = ("SPC", "SPC1", "SPCADD", "MPC", "MPCADD", "RBE2", "RBE3", "RBAR")
_CARDS_READ = {"GRID", "GRDSET", "SPOINT", "BAROR", "BEAMOR", "PARAM", *NAMES, *READ, *ELEMENTS, *CONSTRAINTS}
#: Loads, sets, requests for solutions, output, reduction, aerodynamics, heat, optimisation: none of them changes
#: mass, stiffness or supports.
HARMLESS = {
    *("SET1", "SET2", "SET3", "SEQGP", "PLOTEL3", "PLOTEL4", "DMI", "ITER", "MODTRAK", "UXVEC"),
    *("MONPNT2", "MONPNT3", "MONDSP1", "MONSUM", "MONSUM1", "MONSUMT", "MONCNCM", "MONGRP"),
    *("ACCEL", "ACCEL1", "DEFORM", "FORCEAX", "PLOADX1", "PLOADB3", "PRESAX", "RFORCE1", "LOADCYN", "LOADCYH"),
    *("LOADCYT", "TEMPAX", "TEMPRB", "TEMPP1", "TEMPP2", "TEMPP3", "TEMPF", "TEMPN1", "TEMPBC", "ACSRCE", "TLOAD3"),
    *("RANDT1", "TABRNDG", "TABLED5", "TABLEM1", "TABLEM2", "TABLEM3", "TABLEM4", "TABLEM5", "TABLES1", "TABL3D"),
    *("TABLEST", "TABLEHT", "TABLEH1", "TSTEP1", "NLPARM", "NLPCI", "NLSTEP", "NLCNTL", "NLCNTL2"),
    *("AERO", "AEROS", "AECOMP", "AECOMPL", "AEDW", "AEFACT", "AEFORCE", "AELINK", "AELIST", "AEPARM", "AEPRESS"),
    *("AESTAT", "AESCALE", "AESURF", "AESURFS", "CSSCHD", "DIVERG", "FLFACT", "FLUTTER", "GUST", "MKAERO1"),
    *("MKAERO2", "TRIM", "TRIM2", "SPLINE1", "SPLINE2", "SPLINE3", "SPLINE4", "SPLINE5", "SPLINE6", "SPLINE7"),
    *("SPLINEX", "SPLINRB", *(f"{kind}AERO{k}" for kind in "CP" for k in range(1, 6))),
    *("BDYOR", "CHBDYE", "CHBDYG", "CHBDYP", "PHBDY", "CONV", "CONVM", "PCONV", "PCONVM", "MAT5", "RADBC", "RADBND"),
    *("RADLST", "RADM", "RADMT", "RADMTX", "RADSET", "VIEW", "VIEW3D", "QBDY1", "QBDY2", "QBDY3", "QHBDY", "QVECT"),
    "QVOL",
    *("DCONADD", "DDVAL", "DEQATN", "DESVARG", "DLINK", "DOPTPRM", "DRESP2", "DRESP3", "DSCREEN", "DTABLE"),
    *("DTABLE2", "DVBSHAP", "DVCREL1", "DVCREL2", "DVGRID", "DVMREL1", "DVMREL2", "DVPREL2", "DVPSURF", "DVSHAP"),
    *("BNDGRID", "TOPVAR", "BEADVAR", "TOMVAR"),
    *("EIGR", "EIGRL", "EIGB", "EIGC", "EIGP", "FREQ", "FREQ1", "FREQ2", "FREQ3", "FREQ4", "FREQ5"),
    *("TSTEP", "TSTEPNL", "TIC", "FORCE", "FORCE1", "FORCE2", "MOMENT", "MOMENT1", "MOMENT2", "LOAD", "GRAV"),
    *("PLOAD", "PLOAD1", "PLOAD2", "PLOAD4", "RFORCE", "SLOAD", "DAREA", "DLOAD", "DELAY", "DPHASE", "LSEQ"),
    *("RLOAD1", "RLOAD2", "TLOAD1", "TLOAD2", "TEMP", "TEMPD", "TABLED1", "TABLED2", "TABLED3", "TABLED4"),
    *("TABDMP1", "TABRND1", "RANDPS", "SPCD", "SET", "DTI", "MAT4", "PLOTEL", "SUPORT", "SUPORT1", "ASET", "ASET1"),
    *("BSET", "BSET1", "CSET", "CSET1", "QSET", "QSET1", "OMIT", "OMIT1", "USET", "USET1", "RVDOF", "RVDOF1"),
    *("DESVAR", "DVPREL1", "DRESP1", "DCONSTR", "ECHOON", "ECHOOFF", "MONPNT1", "MDLPRM"),
}


_LENGTHS = {"GRID": 8, "CROD": 4, "CONM2": 14, "CTRIA3": 15, "CONROD": 8, "RBAR": 9, "PROD": 6}
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
) -> Deck:
    """A structure from Nastran bulk data, small, large or free fields; INCLUDE inside the folder of the deck.

    Read are GRID, GRDSET, SPOINT and the coordinate systems CORD1 and CORD2 of kind R, C, S; CBAR, CBEAM (of one
    section), BAROR, BEAMOR, CROD, CONROD, CQUAD4, CTRIA3, CHEXA (8 nodes), CONM2, CBUSH, and CELAS, CMASS, CDAMP in
    their four forms; MAT1, PBAR, PBARL, PBEAM, PBEAML, PROD, PSHELL, PSOLID, PELAS, PMASS, PDAMP, PBUSH; RBAR, RBE2,
    RBE3, MPC, SPC, SPC1, SPCADD, MPCADD; PARAM WTMASS, AUTOSPC, COUPMASS.  `Deck.ignored` lists loads and requests.

    Bars, rods, springs, masses and ties are Nastran's; plates and solids are our `Quadrilateral`, `Triangle` and
    `Hexahedron`, which converge to the same answers by other numbers.  `Deck.notes` says which masses were taken.

    Args:
        spc, mpc: sets that act; by default those that the case control chooses, or the only ones.
        polar: whether CBARs with consistent masses have inertia about their own axis, as CBEAMs have; Nastran's have
            none unless asked for.
        masses: "lumped" on the nodes, without inertia in rotation, or "consistent"; by default as the deck says:
            consistent with PARAM COUPMASS 1, else lumped.

    Raises: ModelError with every fault: cards that are not read, by name and line, wrong fields, what is missing;
    ValueError for other `masses`; OSError where there is no file.
    """
    if masses not in (None, "lumped", "consistent"):
        raise ValueError(f"masses must be 'lumped', 'consistent', or None to follow the deck, not {masses!r}")
    faults: list[str] = []
    text = BulkData(Path(path), faults)
    found: dict[str, list[Card]] = {}
    for card in parse_cards(text.lines(), faults):
        found.setdefault(card.name, []).append(card)
    for name, most in _LENGTHS.items():
        for card in found.get(name, ()):
            if len(card) > most:
                card.fault(f"it has {len(card)} fields; a {name} has at most {most}")
    split_shared_cards(found)
    default_cards(found)
    strange = [name for name in found if name not in _CARDS_READ | HARMLESS and name]
    unused = _unused(found, strange)
    faults += [f"{name} is not read: {_places(found[name])}" for name in strange if name not in unused]
    if not found.get("GRID") and not scalar_points(found):
        raise ModelError([*faults, f"{text.name} has no GRID"])
    deck = DeckContext(found, polar)
    elements = {
        name: own for kind, read in ELEMENTS.items() if kind in found for name, own in read(found[kind], deck).items()
    }
    if not elements and not any(name.startswith("C") for name in strange):
        faults.append(f"{text.name} has no element")
    sets = [select_sets(kind, found, one, text.choices[kind], faults) for kind, one in (("SPC", spc), ("MPC", mpc))]
    tied = read_ties(found, sets[1], deck)
    on_hold = deck.held | read_supports(found, sets[0], deck)
    settings = _settings(found, deck)
    settings["masses"] = masses or settings["masses"]
    faults += _double_constraints(tied, on_hold, deck)
    if faults:
        raise ModelError(faults)
    return _deck(deck, elements, tied, on_hold, settings, _ignored(found, text, deck, unused))


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


def _settings(found, deck):
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
        else:
            deck.note(f"PARAM {name[:16]}")
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


def _unused(found, strange):
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
            if name[:1] in "CPM" and name not in HARMLESS | unused
            for card in cards
            for field in card.fields[2:]
        }
        more = {name for name in owners - unused if not used & {card.text(1) for card in found[name]}}
        if not more:
            return unused
        unused |= more


def _ignored(found, text, deck, unused):
    lines = [f"{text.skipped} lines before the bulk data"] if text.skipped else []
    lines += [f"{name}: {_places(own)}" for name, own in found.items() if name in HARMLESS]
    lines += [f"{name}, which nothing refers to: {_places(found[name])}" for name in sorted(unused)]
    lines += [f"{what}, {times} times" if times > 1 else what for what, times in deck.notes.items()]
    return tuple(lines)


def _places(own):
    shown = ", ".join(card.place for card in own[:4])
    return shown if len(own) < 5 else f"{shown} and {len(own) - 4} more"
