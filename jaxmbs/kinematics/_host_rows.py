"""The rows of a concrete system at a pose, for searches on the host: one program for `build` and `State.at`."""

import dataclasses
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..model._system import System
from ..runtime import jit, not_tracing
from . import _constraints as constraints
from ._configuration import configuration
from ._elastic import mass_matrix
from ._poses import node_parameters, step_coordinates
from ._reaction_map import reaction_map


class Rows(NamedTuple):
    """At a pose, in NumPy: residual f, Jacobian A, what remains of the rows at rest f_t, the map of the multipliers
    to reactions, the mass matrix M, and the frames' positions (frames, 3)."""

    f: np.ndarray
    A: np.ndarray
    f_t: np.ndarray
    reactions: np.ndarray
    M: np.ndarray
    positions: np.ndarray


@jit(compile="quick")
def _evaluate(system: System, psi, t):
    at = configuration(system, node_parameters(system), psi, t)
    (f, A), f_t = constraints.residual_and_jacobian(system, at), constraints.time_rate(system, at)
    return Rows(f, A, f_t, reaction_map(system, at), mass_matrix(system, at), at.x)


def evaluate(system: System, psi, t) -> Rows:
    """The rows of a concrete system; its force elements and whether its mobility is known make no other program."""
    bare = dataclasses.replace(
        system, topology=dataclasses.replace(system.topology, analysis=None, guess=()), forces=()
    )
    return Rows(*map(np.asarray, _evaluate(bare, psi, t)))


def on_host(*trees) -> bool:
    """Whether all numbers of the trees are known, and no trace would take up what is done with them."""
    return not_tracing() and is_concrete(trees)


_stepped = jit(compile="quick")(step_coordinates)


def moved(topology, psi, delta):
    """`psi (+) delta` on the host."""
    if topology.is_simple:
        return (psi + delta).astype(psi.dtype)
    return np.asarray(_stepped(topology, jnp.asarray(psi), jnp.asarray(delta, psi.dtype)))
