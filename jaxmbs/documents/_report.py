"""`report`: a machine and results of it as one file for a browser, a printer and an archive."""

import warnings
from os import PathLike
from pathlib import Path
from typing import Any

from ..atomic_write import write_atomic
from ..checks import is_concrete
from ..errors import ModelError
from ..linear._system import LinearSystem
from ._machine import machine_section
from ._page import Passage, page
from ._provenance import provenance_section
from ._results import result_sections

_MOST_BYTES = 5_000_000


def report(
    path: str | PathLike, system: Any = None, /, *, title: str = "", state: Any = None, **results: Any
) -> Path:
    """Write a report: the machine, and every result with its numbers, units, peaks, plots and what failed.

    The file is whole: it asks nothing of a network, is read on a phone as on paper, and holds a scene of the motion
    that plays.  Numbers are those of the results' own `report()`.

        mbs.report("crane.html", system, motion=motion, reactions=loads, optimum=best, rated="Slewing at 3 rpm")

    Args:
        path: of the file, "crane.html".
        system: a mechanism, a linear system, or any other model with a `report()`; None for results alone.
        title: of the page (default: the name of the file).
        state: the State that the machine is drawn in where there is no motion.
        results: by the words that head their sections, underlines as spaces: results of jaxmbs (motions, reactions,
            optima, identifications, responses, peaks, powers), data sets of xarray (studies), texts, or mappings of
            these by name.  The margins of all models along `motion` are added.

    Returns: the path.

    Raises: ModelError for results that are traced or have no report; OSError.

    Pictures and curves need matplotlib (extra `viz`); without it the tables stand alone.
    """
    _check(system, results)
    path = Path(path)
    parts: list[Passage] = []
    if system is not None:
        parts += machine_section(system, state, results)
    parts += result_sections(system, results)
    parts += provenance_section(system)
    text = page(title or path.stem, parts)
    if len(text) > _MOST_BYTES:
        warnings.warn(f"the report has {len(text) / 1e6:.1f} MB: give fewer results, or shorter ones", stacklevel=2)
    write_atomic(path, text)
    return path


def _check(system, results):
    faults = [
        f"{name} is traced: a report is written outside of jit, grad and vmap"
        for name, value in results.items()
        if not is_concrete(value)
    ]
    if not (
        system is None or isinstance(system, LinearSystem) or any(hasattr(system, x) for x in ("describe", "report"))
    ):
        faults.append(f"the system is a {type(system).__name__}, which has neither a description nor a report")
    if faults:
        raise ModelError(faults, "the report")
