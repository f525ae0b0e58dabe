"""Multiple shooting: a long record by short motions, each from a state of its own."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..errors import ModelError
from ..typing import ArrayLike


def multiple_shooting(
    segment: Callable[[PyTree, Any], tuple[PyTree, PyTree]], starts: PyTree, ts: ArrayLike
) -> tuple[PyTree, PyTree]:
    """Predictions of a record by S motions side by side, and the gaps between them.

    A single motion over a long record depends on its start and on the unknowns ever more steeply, of a chaotic
    mechanism exponentially; the sum of squares then has many minima.  Short motions from states that are unknowns
    too have none of this.  Let the data hold zeros for the gaps, with a small deviation:

        record, gaps = multiple_shooting(segment, u["starts"], ts)
        return {"angle": record, "gaps": gaps}

    Args:
        segment: function of a start and times (k + 1,) to the predictions, a pytree of arrays (k + 1, ...), and the
            end, a pytree like the start.
        starts: states at the begin of the segments, a pytree of arrays with leading axis S.
        ts: (S k + 1,) times of the record.

    Returns: predictions (S k + 1, ...) and gaps, end less next start, a pytree like the starts with leading axis
        S - 1.

    Raises: ModelError where the times are not S segments of equal counts.
    Source: Bock, Recent advances in parameter identification techniques for O.D.E. (1983).
    """
    leaves = jax.tree.leaves(starts)
    count, ts = (len(leaves[0]) if leaves and np.ndim(leaves[0]) else 0), jnp.asarray(ts)
    if ts.ndim != 1 or count < 1 or len(ts) < 2 or (len(ts) - 1) % count:
        raise ModelError(
            [f"times of shape {ts.shape} are not {count} segments of equal counts: give S k + 1 times"],
            "multiple_shooting",
        )
    k = (len(ts) - 1) // count
    times = ts[np.arange(count)[:, None] * k + np.arange(k + 1)]
    found, ends = jax.vmap(segment)(starts, times)
    gaps = jax.tree.map(lambda end, start: end[:-1] - start[1:], ends, starts)
    return jax.tree.map(_joined, found), gaps


def _joined(x):
    """Records (S k + 1, ...) of segments (S, k + 1, ...); at a joint the later one counts."""
    return jnp.concatenate([x[:, :-1].reshape(-1, *x.shape[2:]), x[-1, -1:]])
