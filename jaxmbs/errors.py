"""The errors of the library: a wrong model, an unknown name, a pose that cannot be assembled, a failed motion."""

import re
import sys
import unicodedata
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

#: Files between a warning and the user: this library's, those of what its calls go through, and decorators of Python.
_BELOW = re.compile(
    rf"{re.escape(str(Path(__file__).parent))}|.*[/\\](site|dist)-packages[/\\](jax|equinox|diffrax|jaxtyping|beartype)"
    r"|.*[/\\](contextlib|functools)\.py$|<frozen|<@"
)


def warn(message: str, category: type[Warning] = UserWarning) -> None:
    """Warn of the line of the user's that asked, however deep in the library it is noticed."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and _is_below(frame.f_code):
        level += not frame.f_code.co_filename.startswith("<frozen")  # which `warnings` does not count
        frame = frame.f_back
    warnings.warn(message, category, stacklevel=level)


def _is_below(code):
    """True for code between a warning and the user, as that which makes a dataclass, whose file has no name."""
    return _BELOW.match(code.co_filename) or (code.co_filename == "<string>" and code.co_name == "__init__")


def printable(text: str) -> str:
    """A text whose control characters, which a terminal would obey, are written out: `\\x1b`; lines and tabs stay."""
    if text.replace("\n", "").replace("\t", "").isprintable():
        return text
    return "".join(char.encode("unicode_escape").decode() if _is_control(char) else char for char in text)


def _is_control(char):
    return char not in "\n\t" and unicodedata.category(char) in ("Cc", "Cf", "Cs", "Zl", "Zp")


class ModelError(ValueError):
    """A model that cannot be built, with every fault found in one report.

    Attributes:
        faults: one sentence for each fault.
    """

    def __init__(self, faults: Sequence[str], what: str = "the model") -> None:
        self.faults = [faults] if isinstance(faults, str) else list(faults)
        count = "1 fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
        lines = [f"  {number}. {fault}" for number, fault in enumerate(self.faults, start=1)]
        super().__init__(printable("\n".join([f"{what} has {count}:", *lines])))

    def __reduce__(self):
        return type(self), (self.faults,)


class ModelFileError(ModelError):
    """A file that is no model, with every fault found in one report.

    Attributes:
        path: of the file.
        faults: one sentence for each fault.
    """

    def __init__(self, path: Any, faults: Sequence[str]) -> None:
        self.path = str(path)
        super().__init__(faults, what=self.path)

    def __reduce__(self):
        return type(self), (self.path, self.faults)


class UnknownNameError(ValueError, KeyError):
    """A question that names what is not there: the model may well be right."""

    def __str__(self):
        return printable(ValueError.__str__(self))


class AssemblyError(ValueError):
    """A state whose loops cannot be closed with the coordinates that are held.

    Attributes:
        residuals: what remains open, by the name of the joint or constraint [m or rad].
    """

    def __init__(self, message: str, residuals: Mapping[str, float] | None = None) -> None:
        self.message = message
        self.residuals = dict(residuals or {})
        lines = [f"  {name}: {float(value):.3g}" for name, value in self.residuals.items()]
        super().__init__(printable("\n".join([message, *lines])))

    def __reduce__(self):
        return type(self), (self.message, self.residuals)


class SimulationError(RuntimeError):
    """A simulation that stopped before its end.

    Attributes:
        motion: what was computed up to the failure, or None.
    """

    def __init__(self, message: str, motion: Any = None) -> None:
        self.message = message
        self.motion = motion
        super().__init__(printable(message))

    def __reduce__(self):
        return type(self), (self.message, self.motion)


class SearchError(RuntimeError):
    """A search for a design that was interrupted.

    Attributes:
        optimum: the best design up to then, an `Optimum` that is not ok; in a notebook `sys.last_value.optimum`.
    """

    def __init__(self, message: str, optimum: Any = None) -> None:
        self.message = message
        self.optimum = optimum
        kept = "" if optimum is None else f"; its best design is kept: sys.last_value.optimum\n{optimum}"
        super().__init__(printable(message + kept))

    def __reduce__(self):
        return type(self), (self.message, self.optimum)


class BatchError(RuntimeError):
    """A batch of designs that stopped before its end.

    Attributes:
        batch: the designs computed up to then; the others have the status "not run".  In a notebook
            `sys.last_value.batch`.
    """

    def __init__(self, message: str, batch: Any = None) -> None:
        self.message = message
        self.batch = batch
        super().__init__(printable(message))

    def __reduce__(self):
        return type(self), (self.message, self.batch)
