"""Rematerialisation policy: reverse mode computes all again but solutions of linear systems and small factors."""

import jax
from jax.ad_checkpoint import checkpoint_name
from jax.extend.core.primitives import linear_solve_p

from . import _tuning as tuning
from ._tricks import is_on

_FACTOR = "factor"


def remat(function):
    """The function; its derivative saves the arguments and computes again what it needs."""
    if not is_on("remat"):
        return function
    return jax.checkpoint(function, prevent_cse=False, policy=_is_kept)


def save_factor(numbers):
    """The numbers, marked as factors of a linear system."""
    return checkpoint_name(numbers, _FACTOR)


def _is_kept(primitive, *shapes, name=None, **_):
    small = sum(shape.size for shape in shapes) <= tuning.SAVED_FACTOR
    return primitive is linear_solve_p or (name == _FACTOR and small)
