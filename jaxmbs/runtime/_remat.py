"""What a gradient works out again, and what it keeps all the same: solutions of linear systems, and small factors."""

import jax
from jax.ad_checkpoint import checkpoint_name
from jax.extend.core.primitives import linear_solve_p

_FACTOR = "factor"
#: Numbers of a factor that is kept.
SMALL = 2048


def remat(function):
    """The function; its derivative keeps the arguments and works out again what it needs."""
    return jax.checkpoint(function, prevent_cse=False, policy=_is_kept)


def save_factor(numbers):
    """The numbers, marked as factors of a linear system."""
    return checkpoint_name(numbers, _FACTOR)


def _is_kept(primitive, *shapes, name=None, **_):
    small = sum(shape.size for shape in shapes) <= SMALL
    return primitive is linear_solve_p or (name == _FACTOR and small)
