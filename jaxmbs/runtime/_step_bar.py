"""Bars of steps that are counted: text in a terminal, HTML without widgets in a notebook."""

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tqdm import tqdm


def step_bar(
    total: int, title: str, *, is_wanted: bool = True, initial: int = 0, unit: str = "it", **options: Any
) -> "tqdm":
    """A bar of `total` steps, to be used as a context: `with step_bar(9, "sweep") as bar: bar.update()`.

    Args: initial: steps that are done; options: more of `tqdm`.
    """
    from tqdm import tqdm

    from ._notebook_bar import NotebookBar

    kind = NotebookBar if is_notebook() else tqdm
    return kind(total=total, desc=title, initial=initial, unit=unit, disable=not is_wanted, **options)


def is_notebook() -> bool:
    """True in the kernel of a notebook."""
    if "ipykernel" not in sys.modules:
        return False
    from IPython import get_ipython

    return hasattr(get_ipython(), "kernel")
