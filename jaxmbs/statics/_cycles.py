"""The fundamental loops of a network."""

from functools import lru_cache

import numpy as np

from ._network import BodyNetwork


@lru_cache(maxsize=64)
def cycle_pattern(network: BodyNetwork) -> np.ndarray:
    """Y (q, S) of 0, +1, -1: what a unit wrench round each loop adds to every bond; constant, `I_E Y = 0`.

    Loop s is closed by bond `network.chords[s]`, where Y is 1; about one common origin Y acts on all six components
    alike.  Source: S1 (28), the homogeneous family.
    """
    tree, p = network.tree, len(network.bodies)
    parent, child = network.ends
    pattern = np.zeros((len(network.bonds), network.num_loops))
    for s, e in enumerate(network.chords):
        pattern[e, s] = 1.0
        for body, side in ((child[e], -1.0), (parent[e], 1.0)):
            while body < p and tree.bond[body] >= 0:
                pattern[tree.bond[body], s] += side * tree.sign[body]
                body = tree.above[body]
    pattern.setflags(write=False)
    return pattern
