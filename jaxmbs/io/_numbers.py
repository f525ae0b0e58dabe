"""Numbers in files, as other programs write them: Python's own forms, `1_0` and digits of other scripts, are none."""

import numpy as np


def real(text: str) -> float:
    """The number that a text is.  Raises: ValueError."""
    return float(_plain(text))


def reals(text: str) -> np.ndarray:
    """Numbers between blanks.  Raises: ValueError."""
    return np.array(_plain(text).split(), float)


def whole(text: str) -> int:
    """The whole number that a text is.  Raises: ValueError."""
    return int(_plain(text))


def _plain(text):
    if "_" in text or not text.isascii():
        raise ValueError(f"{text[:32]!r} is no number")
    return text
