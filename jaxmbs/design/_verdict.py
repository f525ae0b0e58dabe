"""What the reason of a search that has ended leaves out: the end of a model's validity, and kinks."""

from ._kink import describe_kink
from ._search import Search

_ENDS = ("", "converged", "no further descent", "step limit")
_OUTSIDE = (
    "outside of a model's validity: a motion or equilibrium of the design found has the status VALIDITY; "
    "dynamics.validity of it names the part, and a limit on its margin keeps the search inside"
)


def judge(search: Search) -> None:
    """Complete the reason of a search that has ended."""
    if search.reason in _ENDS:
        search.reason = _OUTSIDE if search.best.is_outside else describe_kink(search) or search.reason
