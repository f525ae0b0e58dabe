"""Equations of motion of a linear system in the first order, with nonlinear laws between coordinates."""

import abc
from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..forces import AbstractScalarLaw
from ..linear._massless import Condensation
from ..linear._system import LinearSystem
from ..math._interpolation import interval
from ..runtime import lapack
from ..typing import AnyArray
from ._linear_motion import CoordinateLaw, LinearState
from ._linear_stages import LinearStages, StepInverse, invert_implicit_matrix


class SampledLoad(eqx.Module):
    """Loads as a function of time, straight between samples.

    Attributes:
        times: (T,), increasing.
        samples: (T, ...).
    """

    times: Array
    samples: Array

    def __call__(self, t: Array) -> Array:
        """The load (...) at a time ()."""
        i = interval(self.times, t)
        before, after = lax.dynamic_slice_in_dim(self.times, i, 2)
        first, second = lax.dynamic_slice_in_dim(self.samples, i, 2)
        return first + (t - before) / (after - before) * (second - first)


class SecondOrderEquations(eqx.Module):
    """Equations of motion with laws between coordinates, as the rate of (x, x', nothing).

    The last part of the state is that of quadratures, which a linear system has none of: so it is integrated by the
    same solvers as a mechanism.

    Attributes:
        rows: B (laws, n), coefficients of the laws.
        laws: e, their efforts (laws,).
        load: f (n,) as a function of time, or None.
        condensation: the rows without mass that follow statically.
    """

    rows: eqx.AbstractVar[Array]
    laws: eqx.AbstractVar[tuple[AbstractScalarLaw, ...]]
    load: eqx.AbstractVar[Callable | None]
    condensation: eqx.AbstractVar[Any]

    @abc.abstractmethod
    def acceleration(self, t: Array, x: Array, v: Array) -> Array:
        """Accelerations x'' (n,)."""

    def rate(self, t: Array, y: tuple) -> tuple[Array, Array, Array]:
        """The rate of (x, x', nothing)."""
        x, v, quadratures = y
        return v, self.acceleration(t, x, v), quadratures

    def efforts(self, t: Array, x: Array, v: Array) -> Array:
        """Efforts (laws,) along increasing `B x`."""
        return self.efforts_of(t, self.rows @ x, self.rows @ v)

    def efforts_of(self, t: Array, x: Array, v: Array) -> Array:
        """Efforts (laws,) from displacements and velocities `B x`, `B x'` (laws,)."""
        found = [law.effort(x[k], v[k], t) for k, law in enumerate(self.laws)]
        return jnp.stack([jnp.asarray(e, x.dtype) for e in found]) if found else jnp.zeros_like(x)

    def state_at(self, t: Array, y: tuple) -> LinearState:
        """The state in all coordinates, those without mass included."""
        load = self.load(t) if self.load is not None and self.condensation.light else None
        return LinearState(t, self.condensation.expand(y[0], load), self.condensation.expand(y[1]))


class LinearEquations(SecondOrderEquations):
    """`M x'' + C x' + K x = T^T f(t) + B^T e(B x, B x', t)` of the rows with mass, as the rate of (x, x', nothing).

    Attributes:
        by_displacement, by_velocity, by_effort, by_load: M^-1 times K, C, B^T and T^T; by_load None without load.
        rows: B (laws, heavy), coefficients of the laws.
        laws: e, their efforts (laws,).
        load: f (n,) as a function of time, or None.
        condensation: T and what follows statically; its own system is left out.
        near: inverse of implicit stages for steps that are expected, None for none.
    """

    by_displacement: Array
    by_velocity: Array
    by_effort: Array
    by_load: Array | None
    rows: Array
    laws: tuple[AbstractScalarLaw, ...]
    load: Callable | None
    condensation: Condensation
    near: StepInverse | None = None

    @classmethod
    def of(
        cls,
        system: LinearSystem,
        condensation: Condensation,
        laws: tuple[CoordinateLaw, ...],
        load: Callable | None,
    ) -> "LinearEquations":
        """The equations of a dense system on its rows with mass."""
        heavy = condensation.system
        K, C, M = heavy.stiffness, heavy.damping, heavy.mass
        rows = jnp.asarray(condensation.load(coefficient_rows(system, laws)))
        parts = [K, jnp.zeros_like(K) if C is None else C, rows.T]
        if load is not None:
            basis = condensation.basis
            parts.append(jnp.eye(len(M), dtype=M.dtype) if basis is None else basis.T.astype(M.dtype))
        solved = lapack.solve_positive(M, jnp.concatenate(parts, axis=1))
        found = jnp.split(solved, np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)
        own = [jax.tree.map(lambda a: a.astype(M.dtype) if hasattr(a, "astype") else a, law.law) for law in laws]
        bare: Any = eqx.tree_at(lambda c: c.system, condensation, None)
        by_load = None if load is None else found[3]
        return cls(
            by_displacement=found[0],
            by_velocity=found[1],
            by_effort=found[2],
            by_load=by_load,
            rows=rows,
            laws=tuple(own),
            load=load,
            condensation=bare,
        )

    def acceleration(self, t: Array, x: Array, v: Array) -> Array:
        """Accelerations (heavy,)."""
        a = self.linear_acceleration(t, x, v)
        return a + self.by_effort @ self.efforts(t, x, v) if self.laws else a

    def linear_acceleration(self, t: Array, x: Array, v: Array) -> Array:
        """Accelerations (heavy,) without the laws."""
        a = -(self.by_displacement @ x) - self.by_velocity @ v
        return a if self.load is None else a + self.by_load @ self.load(t)

    def implicit_stages(self, s: Array, start: Any = None) -> LinearStages:
        """The stages of a step of an implicit method, for s = h a_ii [s], the same for all implicit stages."""
        return LinearStages.of(self, s)

    def expecting(self, s: Array) -> "LinearEquations":
        """The equations with the inverse of their implicit stages for an s that most steps have."""
        return eqx.tree_at(lambda e: e.near, self, invert_implicit_matrix(self, s), is_leaf=lambda x: x is None)


def coefficient_rows(system: LinearSystem, laws: tuple[CoordinateLaw, ...]) -> Array:
    """Coefficients (laws, n) of the laws by coordinate."""
    rows = [system.load(law.forces(jnp.ones((), system.dtype))) for law in laws]
    return jnp.stack(rows) if rows else jnp.zeros((0, system.num_rows), system.dtype)


def load_function(
    system: LinearSystem, ts: AnyArray, forces: Mapping | Callable | AnyArray | None
) -> Callable | None:
    """Loads (n,) as a function of time, or None without forces."""
    if forces is None:
        return None
    if callable(forces):
        return eqx.filter_closure_convert(lambda t: system.load(forces(t)), ts[0])
    return SampledLoad(jnp.asarray(ts), sampled_load(system, ts, forces))


def sampled_load(system: LinearSystem, ts: AnyArray, forces: Mapping | AnyArray) -> Array:
    """Loads (T, n) of sampled forces.  Raises: ValueError for those of another number of times."""
    load = system.load(forces)
    if load.shape != (len(ts), system.num_rows):
        raise ValueError(f"forces make loads of shape {load.shape}, not ({len(ts)}, {system.num_rows}): times first")
    return load


def forces_at(times: Array, ts: AnyArray, forces: Mapping | Callable | AnyArray) -> Any:
    """The forces as they were given, at other times (k,) than those that they were sampled at."""
    if callable(forces):
        return jax.vmap(forces)(times)

    def resampled(leaf):
        leaf = jnp.asarray(leaf)
        return jax.vmap(SampledLoad(jnp.asarray(ts), leaf))(times) if leaf.shape[:1] == ts.shape else leaf

    return jax.tree.map(resampled, forces)
