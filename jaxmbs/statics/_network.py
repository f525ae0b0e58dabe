"""Bodies and the bonds between them: names, spanning tree and loops of a network; static and hashable."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..checks import repeated
from ..errors import ModelError
from ..runtime import tuning


@dataclass(frozen=True, eq=False)
class BodyTree:
    """A breadth-first tree from the ground; the ground has index `bodies`.

    `above` (bodies,): the next body towards the ground.  `bond` (bodies,): the bond to it, -1 for the reference body
    of a floating part.  `sign` (bodies,): +1 where the body is that bond's child, -1 where it is its parent, else 0.
    `jumps`: (bodies, their ancestors) 1, 2, 4, ... levels higher, for pointer doubling.
    """

    above: np.ndarray
    bond: np.ndarray
    sign: np.ndarray
    jumps: tuple[tuple[np.ndarray, np.ndarray], ...]

    @property
    def attached_bodies(self) -> np.ndarray:
        """Bodies with a bond towards the ground: all but the references of floating parts."""
        return np.nonzero(self.bond >= 0)[0]

    @property
    def references(self) -> np.ndarray:
        """The body of every floating part that stands in for the ground."""
        return np.nonzero(self.bond < 0)[0]


@dataclass(frozen=True)
class BodyNetwork:
    """p bodies and q bonds; bond e joins body parent[e] to body child[e], -1 being the ground.

    Raises: ModelError naming bodies and bonds: double names, bonds to nowhere, bodies without bond.
    """

    bodies: tuple[str, ...]
    bonds: tuple[str, ...]
    parent: tuple[int, ...]
    child: tuple[int, ...]

    def __post_init__(self):
        faults = _network_faults(self)
        if faults:
            raise ModelError(faults)

    @classmethod
    def from_names(cls, bodies: Sequence[str], bonds: Mapping[str, tuple[str, str]]) -> "BodyNetwork":
        """The network of `bonds`: name -> (parent body, child body), "ground" being the ground."""
        index = {"ground": -1, **{name: k for k, name in enumerate(bodies)}}
        faults = (
            ["the name 'ground' is reserved for the ground: give the body another name"] if "ground" in bodies else []
        )
        for bond, ends in bonds.items():
            faults += [f"bond {bond!r}: {body!r} is not a body" for body in ends if body not in index]
        if faults:
            raise ModelError(faults)
        parent, child = (tuple(index[ends[side]] for ends in bonds.values()) for side in (0, 1))
        return cls(tuple(bodies), tuple(bonds), parent, child)

    @cached_property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Indices (q,) of parents and children with the ground as p: for arrays with one padding row."""
        p = len(self.bodies)
        return np.array(self.parent, int) % (p + 1), np.array(self.child, int) % (p + 1)

    @cached_property
    def tree(self) -> BodyTree:
        """The spanning tree, of least depth."""
        return _spanning_tree(self)

    @cached_property
    def chords(self) -> np.ndarray:
        """Bonds outside the tree; each closes one loop."""
        return np.setdiff1d(np.arange(len(self.bonds)), self.tree.bond)

    @property
    def num_loops(self) -> int:
        """S, the number of independent loops."""
        return len(self.chords)

    @property
    def is_small(self) -> bool:
        """True if sums over the network are products with dense matrices."""
        return len(self.bonds) * len(self.bodies) <= tuning.SUM_PRODUCT

    @cached_property
    def incidence(self) -> np.ndarray:
        """Incidence matrix (p, q): +1 where a bond ends at its child, -1 at its parent."""
        rows = np.zeros((len(self.bodies) + 1, len(self.bonds)))
        parent, child = self.ends
        rows[child, np.arange(len(self.bonds))] += 1.0
        rows[parent, np.arange(len(self.bonds))] -= 1.0
        return rows[:-1]

    @cached_property
    def load_paths(self) -> np.ndarray:
        """Signs (q, p) with which a bond of the tree carries the load of a body in its subtree, else 0."""
        tree, held = self.tree, self.tree.attached_bodies
        rows, below = np.zeros((len(self.bonds), len(self.bodies))), np.eye(len(self.bodies))
        for low, high in tree.jumps:
            np.add.at(below, high, below[low])
        rows[tree.bond[held]] = tree.sign[held, None] * below[held]
        return rows

    def adjacency(self) -> list[list[tuple[int, int, int]]]:
        """For every body and then the ground: its bonds as (bond, body at the other end, +1 if that is the child)."""
        lists = [[] for _ in range(len(self.bodies) + 1)]
        for e, (a, b) in enumerate(zip(*(end.tolist() for end in self.ends), strict=True)):
            lists[a].append((e, b, 1))
            lists[b].append((e, a, -1))
        return lists


def _network_faults(network):
    faults, p = [], len(network.bodies)
    for kind, names in (("body", network.bodies), ("bond", network.bonds)):
        faults += [f"the {kind} name {name!r} occurs twice" for name in repeated(names)]
    if not len(network.bonds) == len(network.parent) == len(network.child):
        return [*faults, "every bond needs one parent and one child"]
    for name, a, b in zip(network.bonds, network.parent, network.child, strict=True):
        if not (-1 <= a < p and -1 <= b < p):
            faults.append(f"bond {name!r} joins bodies {a} and {b}; there are {p}")
        elif a == b:
            faults.append(f"bond {name!r} joins {'the ground' if a < 0 else repr(network.bodies[a])} to itself")
    bonded = {*network.parent, *network.child}
    faults += [f"body {name!r} has no bond" for k, name in enumerate(network.bodies) if k not in bonded]
    return faults


def _spanning_tree(network):
    p, around = len(network.bodies), network.adjacency()
    above, bond, sign = np.full(p, p), np.full(p, -1), np.zeros(p)
    reached = np.zeros(p + 1, bool)
    for start in (p, *range(p)):
        if reached[start]:
            continue
        reached[start], queue = True, deque([start])
        while queue:
            k = queue.popleft()
            for e, other, direction in around[k]:
                if not reached[other]:
                    reached[other], above[other], bond[other], sign[other] = True, k, e, direction
                    queue.append(other)
    return BodyTree(above, bond, sign, _jumps(above))


def _jumps(above):
    p, jumps, higher = len(above), [], above
    while (higher < p).any():
        low = np.nonzero(higher < p)[0]
        jumps.append((low, higher[low]))
        higher = np.append(higher, p)[higher]
    return tuple(jumps)
