"""Status and cost of each design of a batch, from the motions and states among its results."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..analysis import Equilibrium
from ..assembly._state import State
from ..motion._motion import Motion
from ..reaction import Reactions
from ..rotors import BearingValidity
from ..status import Status, succeeded

#: Kinds of results that have a result code of their own.
_JUDGED = (Motion, Reactions, Equilibrium, BearingValidity)


def design_status(values: PyTree) -> Array:
    """Status code () of the results for one design.

    The worst result among its motions, reactions, equilibria and bearings; NOT_ASSEMBLED for a state that is not ok,
    BRANCH for states that are not all on the branch of the first of them; NOT_FINITE if they succeeded but some other
    number is not finite.  That is not checked after an event: the motion then has unused entries.
    """
    parts = jax.tree.leaves(values, is_leaf=lambda x: isinstance(x, (*_JUDGED, State)))
    codes = [_part_status(part) for part in parts]
    worst = jnp.max(jnp.stack([jnp.asarray(Status.SUCCESS, jnp.int32), *codes]))
    finite = jnp.stack([jnp.asarray(True), *(_all_finite(part) for part in parts if not isinstance(part, Motion))])
    return jnp.where((worst == Status.SUCCESS) & ~jnp.all(finite), Status.NOT_FINITE, worst)


def compare_branches(values: PyTree, status: Array | np.ndarray) -> Array | np.ndarray:
    """Status codes (B,), with BRANCH for designs whose states are on another branch than the first successful
    design's.

    Args: values: results with a leading axis B.
    """
    for part in jax.tree.leaves(values, is_leaf=lambda x: isinstance(x, State)):
        if isinstance(part, State) and part.branch.ndim > 1 and part.branch.size:
            good = succeeded(status)
            changes = part.branch * part.branch[jnp.argmax(good)][None] < 0
            other = jnp.any(changes.reshape(len(status), -1), axis=1)
            status = jnp.where(good & other, jnp.asarray(Status.BRANCH, status.dtype), status)
    return status


def count_steps(values: PyTree) -> Array:
    """Number of steps () of all motions in the results for one design, rejected ones included."""
    motions = [x for x in jax.tree.leaves(values, is_leaf=lambda x: isinstance(x, Motion)) if isinstance(x, Motion)]
    return sum((jnp.sum(m.diagnostics.num_steps + m.diagnostics.num_rejected) for m in motions), jnp.zeros((), int))


def _part_status(part: PyTree) -> Array:
    if isinstance(part, _JUDGED):
        return jnp.max(jnp.asarray(part.result, jnp.int32))
    if isinstance(part, State) and hasattr(part, "ok"):
        signs = part.branch.reshape(-1, part.branch.shape[-1]) if part.branch.size else jnp.zeros((1, 0))
        code = jnp.where(jnp.any(signs * signs[:1] < 0), Status.BRANCH, Status.SUCCESS)
        return jnp.where(jnp.all(part.ok), code, Status.NOT_ASSEMBLED).astype(jnp.int32)
    return jnp.asarray(Status.SUCCESS, jnp.int32)


def _all_finite(part: PyTree) -> Array:
    numbers = [jnp.asarray(x) for x in jax.tree.leaves(part)]
    numbers = [x for x in numbers if jnp.issubdtype(x.dtype, jnp.inexact)]
    return jnp.all(jnp.stack([jnp.asarray(True), *(jnp.all(jnp.isfinite(x)) for x in numbers)]))
