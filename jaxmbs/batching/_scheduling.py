"""Scheduling of a batch: designs of similar cost share a chunk, because a chunk runs until its last design has ended.

The cost of a design is not known before it has run, so the designs run in parts, each as large as all before it; in
all parts but the first they are sorted by the costs of their nearest neighbours among those that have run.
"""

import jax
import numpy as np
from jaxtyping import Float, Int, PyTree
from scipy.spatial import cKDTree

#: Number of designs that ran from which the cost of another is estimated, weighted by inverse cubed distance: as many
#: as are near in some ten variables, of which the nearest decide.
NEIGHBOURS = 12
_LEAST_INFLUENCE = (
    0.1  # a variable without influence counts this much of the strongest one in the distance of two designs
)


def growing_parts(index: Int[np.ndarray, " B"], first: int) -> list[np.ndarray]:
    """The designs in random order, cut into parts of first, first, 2 first, 4 first, ...; the last takes the rest.

    Few designs stay one part, in their own order.
    """
    if len(index) < 2 * first:
        return [index]
    ends = first * 2 ** np.arange(int(np.log2(len(index) / first)))
    # a fixed seed: a batch that is repeated runs in nearly the same order
    return np.split(np.random.default_rng(0).permutation(index), ends)


def costliest_first(
    designs: PyTree, index: Int[np.ndarray, " n"], ran: Int[np.ndarray, " m"], costs: Float[np.ndarray, " B"]
) -> Int[np.ndarray, " n"]:
    """The designs at `index` sorted by expected cost, estimated from the designs that `ran`.

    Costly designs run first: the last chunks are then short, and the threads end together.
    """
    if len(ran) == 0 or np.ptp(costs[ran]) == 0.0:
        return index
    points = _standardise(designs)
    costs = costs[ran]
    points = points * _cost_influence(points[ran], costs)
    distance, nearest = cKDTree(points[ran]).query(points[index], np.arange(1, 1 + min(NEIGHBOURS, len(ran))))
    weight = 1.0 / (distance + 1e-9) ** 3
    expected = np.sum(weight * costs[nearest], axis=1) / np.sum(weight, axis=1)
    return index[np.argsort(-expected, kind="stable")]


def _standardise(designs: PyTree) -> np.ndarray:
    """Designs as points (B, variables), each variable with mean zero and deviation one."""
    columns = [np.asarray(x, float).reshape(len(x), -1) for x in jax.tree.leaves(designs)]
    points = np.nan_to_num(np.concatenate(columns, axis=1))
    spread = points.std(axis=0)
    return (points - points.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0)


def _cost_influence(points: np.ndarray, costs: np.ndarray) -> np.ndarray:
    """Influence of each variable on the cost, by a linear fit; the strongest is 1."""
    slopes = np.abs(np.linalg.lstsq(np.c_[np.ones(len(points)), points], costs, rcond=None)[0][1:])
    return np.maximum(slopes / max(np.max(slopes, initial=0.0), 1e-300), _LEAST_INFLUENCE)
