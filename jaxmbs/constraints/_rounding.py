"""Rounding of the constraint rows, by the size of the terms that add up to them.

Rows of joints that are redundant by themselves, as of a second hinge in line with the first, vanish at every pose.
What is left of their residual and entries is rounding: a step that is computed from it leads anywhere.  Searches and
counts of rank take such numbers as zero, however large they are beside other numbers of the same matrix.
"""

import dataclasses

import jax.numpy as jnp
from jax import lax

from ..kinematics._configuration import ClosureDirections, Configuration
from ..model._system import System
from ..runtime import gather_static
from . import _closures as closures
from . import _rows as rows
from ._saddle_operator import loop_entries

#: Rounding, in units of the last place of the terms' size: products of some ten rotations stay below.
_UNITS = 16.0


def residual_without_rounding(system: System, at: Configuration, f):
    """Residual f (position rows,), zero where it is rounding in the rows of loops.

    Args: at: with the directions of its closures.
    """
    return _without_rounding(f, _residual_sizes(system, at, len(f)))


def jacobian_without_rounding(system: System, at: Configuration):
    """Rows A (rows, nv), zero where they are rounding."""
    A, sizes = closures.jacobian(system, at), closures.jacobian(system, _term_sizes(system, at))
    A = [_without_rounding(*both) for both in zip(A, sizes, strict=True)]
    return jnp.concatenate([*A, rows.matrix(system, at)])


def loop_entries_without_rounding(system: System, at: Configuration):
    """Values of `loop_entries`, zero where they are rounding."""
    sizes = loop_entries(system, _term_sizes(system, at)).value
    return _without_rounding(loop_entries(system, at).value, sizes)


def _without_rounding(x, sizes):
    """The numbers x, zero where they are rounding of terms of these sizes; derivatives are those of x."""
    least = _UNITS * jnp.finfo(x.dtype).eps * jnp.abs(sizes)
    return x - lax.stop_gradient(jnp.where(jnp.abs(x) < least, x, 0.0))


def _residual_sizes(system, at, number):
    """Size (number,) of the terms of the residual: positions of frames, one for angles, zero for coordinate rows."""
    x, sizes = jnp.abs(at.x) + jnp.max(jnp.abs(at.origin)), []
    for group, D in zip(system.closures, closures.directions(system, at), strict=True):
        places = gather_static(x, group.first) + gather_static(x, group.second)
        terms = jnp.concatenate([jnp.ones_like(places), places], axis=1)
        D = D[:, : group.kind.num_rows - group.kind.num_slips]
        sizes.append(jnp.einsum("erk,ek->er", jnp.abs(D), terms).reshape(-1))
    return jnp.concatenate([*sizes, jnp.zeros(number - sum(len(part) for part in sizes), x.dtype)])


def _term_sizes(system, at):
    """The configuration with the sizes of the terms in place of joint twists and directions: entries of rows that are
    computed from it are the sizes of their terms, with any sign."""
    turning, sliding = jnp.abs(at.S[:, :3]), jnp.abs(at.S[:, 3:])
    from_world = jnp.sum(turning, axis=1, keepdims=True) * jnp.max(jnp.abs(at.origin))
    D = tuple(jnp.abs(D) for D in closures.directions(system, at))
    S = jnp.concatenate([turning, sliding + from_world], axis=1)
    return dataclasses.replace(at, S=S, directions=ClosureDirections(D))
