"""Verdicts on searches that have ended: the end of a model's validity, and kinks."""

from ._kink import describe_kink
from ._search import Search

_ENDS = ("", "converged", "no further descent", "step limit")
_OUTSIDE = (
    "outside of a model's validity: a motion or equilibrium of the design found has the status VALIDITY; "
    "dynamics.validity of it names the part, and a limit on its margin keeps the search inside"
)


def judge(search: Search, kinks: bool = True) -> None:
    """Complete the reason of a search that has ended.

    Args: kinks: False where designs are no longer evaluated.
    """
    if search.reason in _ENDS and search.best.is_outside:
        search.reason = _OUTSIDE
    elif search.reason in _ENDS and kinks:
        search.reason = describe_kink(search) or search.reason
