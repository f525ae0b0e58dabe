"""Statuses of computations, one list for motions and the designs of a batch."""

import enum


class Status(enum.IntEnum):
    """A result code and what it means; in traced code a number, `str` of it in words.

    Up to `EVENT` all is as asked; of two codes the larger one is the worse.
    """

    INFEASIBLE = -2, "refused by `feasible`, not run"
    NOT_RUN = -1, "not run"
    SUCCESS = 0, "success"
    EVENT = 1, "an event ended the motion"
    MAX_STEPS = 2, "maximum number of steps reached"
    STEP_SIZE = (
        3,
        "the step size fell below its least value (stiff or singular motion: try an implicit solver or more damping)",
    )
    NOT_FINITE = 4, "the state is not finite, or the times asked for or the event's value are not"
    INCONSISTENT = (
        5,
        "the constraints contradict the motion (locked, singular, redundantly driven, or on another branch than that "
        "of the build: give the build a guess= of this one)",
    )
    NOT_ASSEMBLED = 6, "the initial state does not satisfy the constraints"
    FAILED = (
        7,
        "the integrator failed (an implicit step was not solved: take smaller ones, or newton=True for Gauss)",
    )
    ENERGY = (
        8,
        "the energy account is off by more than a tenth of the energy exchanged (take smaller steps or tolerances)",
    )
    BRANCH = (
        9,
        "the loops are closed on another branch than in the first design or pose (follow one: State.at(near=...))",
    )
    EVENTS = (
        10,
        "more events acted than `max_events` (they may accumulate, as the bounces of a ball that comes to rest do)",
    )
    JAMMED = (
        11,
        "the friction of joints has no unique loads (they jam: reduce mu, or give the bearing more length)",
    )
    VALIDITY = (
        12,
        "a part of the model is beyond the range where its law holds, at a saved time (dynamics.validity names it)",
    )

    UNSTABLE = (
        13,
        "an equilibrium whose stiffness is negative along some direction: the least push leads away from it",
    )
    NO_EQUILIBRIUM = 14, "no equilibrium was found near the state"
    NO_CYCLE = 15, "no periodic motion was found near the start"

    text: str

    def __new__(cls, code, text=""):
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member

    def __str__(self):
        return self.text


def succeeded(code):
    """True for result codes (...) of computations that ended as asked (traceable)."""
    return (code >= Status.SUCCESS) & (code <= Status.EVENT)
