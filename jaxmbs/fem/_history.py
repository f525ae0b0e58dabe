"""Recovery of element forces and stresses over times, load cases or frequencies."""

from collections.abc import Callable

import jax
from jaxtyping import Array

from ..runtime import jit
from ..typing import AnyArray
from ._structure import Structure


@jit
def recover_history(recover: Callable, structure: Structure, x: AnyArray) -> dict[str, Array]:
    """Apply `element_forces` or `element_stresses` to many displacements: (..., elements, labels) by group.

    Args: x: (..., rows) of the dense matrices over times or cases, or complex amplitudes over frequencies.

    Source: S1 (30).
    """
    found = jax.vmap(lambda row: recover(structure, row))(x.reshape(-1, x.shape[-1]))
    return jax.tree.map(lambda f: f.reshape(*x.shape[:-1], *f.shape[1:]), found)
