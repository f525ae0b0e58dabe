"""The zoo: eight mechanisms with a state each.  What must hold of every mechanism is asked of every specimen.

`@of_all()` hands a test the specimens; `probes` has what tests ask of them, a compiled program per room whose answers
all tests of a process share.  A tree and a loop stand in the quick tests, two in the slow ones, the others
in the long ones.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import pytest

import jaxmbs as mbs

from . import mechanisms as m


@dataclass(frozen=True)
class Specimen:
    """A mechanism by its name; `kinds` are the traits by which tests choose."""

    name: str
    build: Callable
    place: Callable
    kinds: frozenset = frozenset()

    @functools.cached_property
    def system(self) -> mbs.System:
        return self.build()

    @functools.cached_property
    def state(self) -> mbs.State:
        return self.place(self.system)


def _specimens(*rows):
    return {name: Specimen(name, build, place, frozenset(kinds)) for name, build, place, *kinds in rows}


SPECIMENS = _specimens(
    ("tree", m.spatial_tree, m.general_state),
    ("chain", m.chain, m.general_state),
    ("floating", m.floating_base, m.floating_state, "ball"),
    ("four_bar", m.four_bar, m.four_bar_state, "loop"),
    ("spatial_loop", m.spatial_loop, m.spatial_loop_state, "loop"),
    ("driven", m.driven_arm, m.driven_arm_state, "drive", "ball", "effort"),
    ("rolling", m.rolling_disk, m.rolling_state, "rolling", "ball"),
    ("elastic", m.elastic_arm, m.elastic_arm_state, "drive", "elastic"),
)


QUICK = ("tree", "four_bar")
SLOW = ("driven", "rolling")


def of_all(*, without=(), quick=QUICK, slow=SLOW):
    """Parametrise a test by the specimens but those of some kinds; those neither quick nor slow are marked long."""
    chosen = [s for s in SPECIMENS.values() if not s.kinds & set(without)]
    marks = {
        name: [] if name in quick else [pytest.mark.slow] if name in slow else [pytest.mark.long]
        for name in SPECIMENS
    }
    return pytest.mark.parametrize("specimen", [pytest.param(s, id=s.name, marks=marks[s.name]) for s in chosen])
