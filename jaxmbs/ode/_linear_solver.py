"""`square.solve` as a solver of lineax, and so of the root finders of optimistix and diffrax."""

import equinox as eqx
import jax
import lineax as lx
from jax.flatten_util import ravel_pytree

from ..math._square import Inverted, Lu, factorise


class _State(eqx.Module):
    """A factor, whether it stands for the transposed matrix, and how vectors of both sides come apart."""

    factor: Inverted | Lu
    transposed: bool = eqx.field(static=True)
    structures: tuple = eqx.field(static=True)  # of the matrix as it was given: into it, out of it


class SquareSolver(lx.AbstractLinearSolver):
    """Solves regular square systems; takes no options."""

    def init(self, operator, options):
        """The factor of the operator's matrix; ValueError where it is not square."""
        if operator.in_size() != operator.out_size():
            raise ValueError("a square system needs as many equations as unknowns")
        structures = tuple(_static(s) for s in (operator.in_structure(), operator.out_structure()))
        return _State(factorise(operator.as_matrix()), False, structures)

    def compute(self, state, vector, options):
        """The solution for one right side, lineax's result and no statistics."""
        found = state.factor.solve(ravel_pytree(vector)[0][:, None], state.transposed)[:, 0]
        leaves, tree = state.structures[state.transposed]
        parts, start = [], 0
        for leaf in leaves:
            parts.append(found[start : start + leaf.size].reshape(leaf.shape))
            start += leaf.size
        return jax.tree.unflatten(tree, parts), lx.RESULTS.successful, {}

    def transpose(self, state, options):
        """The state of the transposed matrix."""
        return _State(state.factor, not state.transposed, state.structures), options

    def conj(self, state, options):
        """The state of the conjugate matrix."""
        return jax.tree.map(lambda x: x.conj(), state), options

    def assume_full_rank(self):
        """A singular matrix gives non-finite solutions."""
        return True


def _static(structure):
    leaves, tree = jax.tree.flatten(structure)
    return tuple(leaves), tree
