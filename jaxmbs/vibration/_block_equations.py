"""Equations of motion of a linear system in block matrices: products and solutions with them in place of inverses."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..blocksparse import BlockMatrix, Factor, factor, solve
from ..blocksparse._matrix import constrain
from ..checks import is_concrete
from ..forces import AbstractScalarLaw
from ..linear._block_rows import BlockRows, from_blocks, to_blocks
from ..linear._massless import NEGLIGIBLE_DAMPING, massless_rows
from ..linear._symmetric import symmetric_blocks
from ..linear._system import LinearSystem
from ._linear_equations import SecondOrderEquations, coefficient_rows
from ._linear_motion import CoordinateLaw


class BlockCondensation(eqx.Module):
    """Rows without mass ("light") of a system in blocks, which follow the others statically.

    Motions keep all rows; those of the light ones are zero until they are expanded.

    Attributes:
        light: rows without mass.
        rows: of the blocks.
        stiffness: matrix of the system.
        static: factor of its light rows, the others fixed; None where all rows have mass.
    """

    light: tuple[int, ...] = eqx.field(static=True)
    rows: BlockRows | None = eqx.field(static=True)
    stiffness: BlockMatrix
    static: Factor | None

    @classmethod
    def of(cls, system: LinearSystem) -> "BlockCondensation":
        """The rows without mass of a system, which must not be damped.

        Raises: ValueError, if concrete, for rows that have neither mass nor stiffness, or damping of their own.
        """
        light, K = massless_rows(system), system.stiffness
        static = None
        if light:
            static = factor(constrain(symmetric_blocks(K), ~_flag_blocks(system, light), True), "ldl")
        found = cls(light, system.block_rows, K, static)
        if light and is_concrete(K, system.damping):
            _check_light_rows(system, found)
        return found

    def light_load(self, forces: Array) -> Array:
        """The part (..., light) of forces (..., n) on light rows."""
        return forces[..., np.array(self.light, int)]

    def heavy_part(self, x: Array) -> Array:
        """Displacements (..., n) with zeros on light rows."""
        return x.at[..., np.array(self.light)].set(0.0) if self.light else x

    def expand(self, x: Array, forces: Array | None = None) -> Array:
        """Displacements (..., n), or their rates, with the light rows that follow from the others.

        Args: forces: (..., n), whose part on light rows adds its static displacement there.
        """
        if self.static is None:
            return x
        flat = x.reshape(-1, x.shape[-1]).T
        right = -self._times(self.stiffness, flat)
        if forces is not None:
            right = right + forces.reshape(-1, x.shape[-1]).T
        light = np.array(self.light)
        only = jnp.zeros_like(right).at[light].set(right[light])
        found = from_blocks(solve(self.static, self._blocks(only)), self.rows)
        return (flat + found).T.reshape(x.shape)

    def _blocks(self, x):
        return to_blocks(x, self.stiffness.pattern, self.rows)

    def _times(self, A, x):
        return from_blocks(A @ self._blocks(x), self.rows)


class BlockEquations(SecondOrderEquations):
    """`M x'' + C x' + K x = f(t) + B^T e(B x, B x', t)` as the rate of (x, x', nothing), as `LinearEquations`.

    Attributes:
        mass: factor of M, ones on the diagonal of rows without mass.
        damping: C or None.
        rows: B (laws, n), coefficients of the laws.
        laws: e, their efforts (laws,).
        load: f (n,) as a function of time, or None.
        condensation: the stiffness, and the rows that follow statically.
    """

    mass: Factor
    damping: BlockMatrix | None
    rows: Array
    laws: tuple[AbstractScalarLaw, ...]
    load: Callable | None
    condensation: BlockCondensation

    @classmethod
    def of(
        cls,
        system: LinearSystem,
        condensation: BlockCondensation,
        laws: tuple[CoordinateLaw, ...],
        load: Callable | None,
    ) -> "BlockEquations":
        """The equations of a system in blocks."""
        M = symmetric_blocks(system.mass)
        added = _flag_blocks(system, condensation.light)[:, :, None] * np.eye(M.pattern.size)
        M = BlockMatrix(M.pattern, M.diagonal + added.astype(M.diagonal.dtype), M.upper)
        own = [jax.tree.map(lambda a: a.astype(system.dtype) if hasattr(a, "astype") else a, c.law) for c in laws]
        rows = coefficient_rows(system, laws)
        return cls(
            mass=factor(M),
            damping=system.damping,
            rows=rows,
            laws=tuple(own),
            load=load,
            condensation=condensation,
        )

    def acceleration(self, t: Array, x: Array, v: Array) -> Array:
        """Accelerations (n,), zero on rows without mass."""
        whole, load = self.condensation, None if self.load is None else self.load(t)
        force = self.rows.T @ self.efforts(t, x, v)
        force = force if load is None else force + load
        force = force - whole._times(whole.stiffness, whole.expand(x, load))
        if self.damping is not None:
            force = force - whole._times(self.damping, whole.expand(v))
        return from_blocks(solve(self.mass, whole._blocks(whole.heavy_part(force))), whole.rows)


def _flag_blocks(system, chosen):
    """Flags (blocks, size) of rows."""
    pattern, rows = system.stiffness.pattern, system.block_rows
    flags = np.zeros(system.num_rows + 1, bool)
    flags[np.array(chosen, int)] = True
    return flags[:-1].reshape(pattern.shape) if rows is None else flags[rows.numbers]  # padding is -1, the last one


def _check_light_rows(system, whole: BlockCondensation):
    """Refuse light rows that move freely or are damped, by the response to random displacements of the others."""
    light, n = np.array(whole.light), system.num_rows
    v = whole.expand(jnp.asarray(np.random.default_rng(0).normal(size=n) * ~np.isin(np.arange(n), light)))
    if not np.all(np.isfinite(v)):
        names = ", ".join(system.label(k) for k in light[:6])
        raise ValueError(
            f"some of {names} have neither mass nor stiffness: fix these coordinates, leave them out or give them "
            "mass"
        )
    if system.damping is None:
        return
    C = system.damping
    size = BlockMatrix(C.pattern, jnp.abs(C.diagonal), jnp.abs(C.upper))
    force, terms = whole._times(system.damping, v), whole._times(size, jnp.abs(v))
    if np.any(np.abs(force[light]) > NEGLIGIBLE_DAMPING * np.max(terms[light], initial=1e-300)):
        raise ValueError(
            f"rows without mass are damped: {', '.join(system.label(k) for k in light[:6])}.  Give them mass, or "
            "damping proportional to their stiffness, or leave the damping out"
        )
