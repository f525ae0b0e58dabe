"""Projection inside of diffrax's own loop: a solver whose every step ends on the constraints."""

import functools
from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from ..typing import ScalarLike


class ProjectedInterpolation(diffrax.AbstractLocalInterpolation):
    """The interpolation of a step whose end was projected: the projected state at the end, the inner one before."""

    t0: Any  # type: ignore[misc]
    t1: Any  # type: ignore[misc]
    inner: diffrax.AbstractLocalInterpolation
    end: PyTree

    def evaluate(self, t0: ScalarLike, t1: ScalarLike | None = None, left: bool = True) -> PyTree:
        """The state at a time, or its change between two."""
        if t1 is not None:
            return jax.tree.map(jnp.subtract, self.evaluate(t1, left=left), self.evaluate(t0, left=left))
        inside = self.inner.evaluate(t0, left=left)
        return jax.tree.map(lambda end, y: jnp.where(t0 == self.t1, end, y), self.end, inside)


@functools.cache
def _projected(interpolation):
    """Constructor of projected interpolations over a class of diffrax; one each, so that it is equal to itself."""

    def construct(*, t0, t1, dense, end):
        return ProjectedInterpolation(t0, t1, interpolation(t0=t0, t1=t1, **dense), end)

    return construct


class ProjectedSolver(diffrax.AbstractWrappedSolver):
    """A solver of diffrax whose every step is projected onto the constraints, for `diffrax.diffeqsolve`.

    The standard projection method: the step's end is moved to the nearest state on the constraints, and the next step
    starts from there, its first slope evaluated anew.  Source: Hairer, Lubich and Wanner, Geometric Numerical
    Integration, IV.4.

    Attributes:
        solver: of diffrax, such as `diffrax.Dopri8()`.
        project: function (t, y, args) -> y, None for none, such as the `project` of a `jaxmbs.vector_field`.
    """

    solver: diffrax.AbstractSolver  # type: ignore[misc]
    project: Callable | None

    @property
    def term_structure(self) -> Any:
        """That of the solver."""
        return self.solver.term_structure

    @property
    def interpolation_cls(self) -> Callable:  # type: ignore[override]
        """The solver's interpolation, with the projected state at the end of the step."""
        return _projected(self.solver.interpolation_cls)

    @property
    def root_finder(self) -> Any:
        """That of an implicit solver."""
        return self.solver.root_finder  # type: ignore[attr-defined]

    @property
    def scan_kind(self) -> Any:
        """That of a Runge-Kutta method."""
        return self.solver.scan_kind  # type: ignore[attr-defined]

    def order(self, terms: PyTree) -> int | None:
        return self.solver.order(terms)

    def error_order(self, terms: PyTree) -> Any:
        return self.solver.error_order(terms)

    def init(self, terms: PyTree, t0: ScalarLike, t1: ScalarLike, y0: PyTree, args: PyTree) -> PyTree:
        return self.solver.init(terms, t0, t1, y0, args)

    def func(self, terms: PyTree, t0: ScalarLike, y0: PyTree, args: PyTree) -> PyTree:
        return self.solver.func(terms, t0, y0, args)

    def step(
        self,
        terms: PyTree,
        t0: ScalarLike,
        t1: ScalarLike,
        y0: PyTree,
        args: PyTree,
        solver_state: PyTree,
        made_jump: Any,
    ) -> tuple:
        del made_jump  # the projection is one
        y1, error, dense, memory, result = self.solver.step(terms, t0, t1, y0, args, solver_state, True)
        if self.project is not None:  # diffrax turns the time of a motion that goes backwards
            y1 = self.project(t1 * getattr(terms, "direction", 1), y1, args)
        return y1, error, {"dense": dense, "end": y1}, memory, result
